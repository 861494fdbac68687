"""The cases of `make bench`: what is run, what is taken from it, and the figures it is held against."""

import json
import math
import pathlib
import resource
import struct
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass

import h5py

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENGINE, POLY = "tests/bench/bench_engine", "tests/bench/bench_poly"
LARGE = 100_000  # balls: from here on all repeats are of one run
POLY_ROW = "mill, past the bound"  # of bench_poly: the calls of a mill that no bound settles


class BenchError(Exception):
    """One line for the user."""

    status = 1


class UsageError(BenchError):
    status = 2


class Programs:
    """The programs of one build. Quick: they have little to do, and large gases fewer balls."""

    def __init__(self, build, quick, repeats, folder):
        self.build, self.quick, self.repeats = build, quick, repeats
        self.folder = pathlib.Path(folder)

    def run(self, program, *arguments):
        """What the program prints, and its processor time [s], user and system."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            done = subprocess.run(
                [self.build / program, *map(str, arguments)],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                check=True,
            )
        except OSError as error:
            raise BenchError(f"{self.build / program}: {error.strerror}: run make bench") from None
        except subprocess.CalledProcessError as error:
            said = error.stderr.strip().splitlines() or ["no message"]
            raise BenchError(f"{program} ended with {error.returncode}: {said[-1]}") from None
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def mill(self, deck, *settings):
        """One run of the whole program; its time counts from start to end, output and all."""
        if self.quick:
            settings = (*settings, "run.time=20 ms", "run.sample_from=0 s")
        output = self.folder / "run.h5"
        sets = [f"--set={setting}" for setting in settings]
        text, cpu = self.run("millsim", "-q", "-j", "-f", "-o", output, *sets, deck)
        summary = json.loads(text)
        contacts = sum(summary["run"]["collisions"].values())
        with h5py.File(output) as file:
            events = file["/run/events"]
            others = int(events["cell_crossings"][()]) + int(events["stale"][()])
            balls = int(file["/deck/balls/count"][()])
        return {
            "balls": balls,
            "contacts": contacts,
            "events": contacts + others,
            "cpu": cpu,
            "simulated": summary["time"],
            "peak_memory": summary["run"]["peak_memory"],
            "bytes_per_ball": summary["run"]["peak_memory"] / balls,
        }

    def start(self, deck):
        """Processor time [s] of the program from its beginning to the first event. Linux only."""
        options = ["--progress=json", "-f", "-o", self.folder / "start.h5"]
        command = [self.build / "millsim", *options, ROOT / deck]
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
        try:
            with subprocess.Popen(command, **pipes) as run:
                # the object that is printed when the mill is made
                begun = any('"time": 0,' in line for line in run.stderr)
                used = pathlib.Path(f"/proc/{run.pid}/schedstat").read_text()  # [ns] first
                run.kill()
        except OSError as error:
            raise BenchError(f"{error.filename}: {error.strerror}: run make bench, on Linux") from None
        if not begun:
            raise BenchError(f"millsim did not start {deck}")
        return {"cpu_seconds": 1e-9 * int(used.split()[0])}

    def balls(self, number):
        return number // 16 if self.quick and number >= LARGE else number

    def gas(self, number, packing, *options):
        """The event loop alone on an elastic gas: samples of one run, several where it is large."""
        repeats = 1 if number < LARGE else self.repeats
        little = ["--contacts", 10_000, "--settle", 1] if self.quick else []
        text, _ = self.run(ENGINE, "--repeats", repeats, *little, self.balls(number), packing, *options)
        return [json.loads(line) for line in text.splitlines()]

    def gas_deck(self, number, packing):
        """Path of the deck of such a gas."""
        path = self.folder / "gas.ini"
        path.write_text(self.run(ENGINE, "--print", self.balls(number), packing)[0])
        return path

    def poly(self):
        """The rows of one run of bench_poly."""
        path = self.folder / "poly.json"
        self.run(POLY, "--json", path)
        rows = {row["name"]: row for row in json.loads(path.read_text())["rows"]}
        if POLY_ROW not in rows:
            raise BenchError(f"bench_poly has no row '{POLY_ROW}' but {', '.join(rows)}")
        return rows


# ---- the cases ----


@dataclass(frozen=True)
class Case:
    name: str
    title: str
    measure: Callable | None  # Programs -> samples; None: made of other cases
    at_least: float
    aim: float
    quantity: str = "contacts_per_second"
    aim_quantity: str | None = None  # where the aim is one of another quantity
    once: bool = False  # all samples come in the first turn
    parts: tuple[str, ...] = ()  # the cases that it is made of


UNITS = {  # quantity -> unit, factor that takes it to the table's unit, that unit
    "contacts_per_second": ("1/s", 1e-6, "M contacts/s"),
    "cpu_per_simulated_second": ("s/s", 1.0, "CPU s/simulated s"),
    "time_ratio": ("1", 1.0, "times the time"),
    "bytes_per_ball": ("byte", 1.0, "bytes a ball"),
    "nanoseconds": ("ns", 1.0, "ns"),
    "cpu_seconds": ("s", 1e3, "CPU ms"),
}
HIGHER_IS_BETTER = {"contacts_per_second"}


def simoloyer(programs):
    return [programs.mill("input/simoloyer.ini")]


def short(programs):
    """All but the events: the start, the samples for the maps, the results, the file."""
    output = programs.folder / "run.h5"
    sets = ["--set=run.time=1 us", "--set=run.sample_from=0 s"]
    _, cpu = programs.run("millsim", "-q", "-f", "-o", output, *sets, "input/simoloyer.ini")
    return [{"cpu_seconds": cpu}]


def frictionless(programs):
    sets = ["rotor.speed=300 rpm", "contact.friction=0", "contact.tangential_restitution=0"]
    return [programs.mill("input/simoloyer.ini", *sets, "run.time=1 s")]


def wavy(programs):
    return [programs.mill("input/wavy.ini", "run.precision=0", "run.time=0.3 s")]


def wavy_frictionless(programs):
    sets = ["contact.friction=0", "contact.tangential_restitution=0", "run.precision=0"]
    return [programs.mill("input/wavy.ini", *sets, "run.time=1 s")]


def wavy_cost(programs):
    """From 0.15 s on, when the charge is up in the air: the start is no matter of walls."""

    def run(time, sets):
        return programs.mill("input/wavy.ini", "run.precision=0", "run.sample_from=0 s", f"run.time={time}", *sets)

    def contact(*sets):
        late = run("1 s", sets)
        early = {"cpu": 0.0, "contacts": 0} if programs.quick else run("0.15 s", sets)
        return (late["cpu"] - early["cpu"]) / (late["contacts"] - early["contacts"])

    return [{"time_ratio": contact() / contact("drum.buckle_height=0 mm")}]


BROAD = {  # the reference mill with 25 times as many balls, at the same tip speed
    "balls.count": 100_000,
    "drum.radius": "219.3 mm",
    "drum.length": "350.9 mm",
    "rotor.speed": "342 rpm",
    "rotor.shaft_radius": "43.9 mm",
    "blades.tip_radius": "211.3 mm",
    "blades.width": "35.1 mm",
    "blades.thickness": "20.5 mm",
}


def cores(programs):
    """Elapsed time, with the start, while the balls are thrown up."""

    def elapsed(threads):
        began = time.monotonic()
        sets = [f"{key}={value}" for key, value in {**BROAD, "run.threads": threads}.items()]
        sets.append(f"balls.count={programs.balls(BROAD['balls.count'])}")
        programs.mill("input/simoloyer.ini", *sets, "run.sample_from=0 s", "run.time=80 ms")
        return time.monotonic() - began

    return [{"time_ratio": elapsed(2) / elapsed(1)}]


def rest(programs):
    """A quarter of the reference mill whose rotor stands still, after its balls have come to rest."""
    sets = ["rotor.speed=0 rpm", "balls.count=1000", "drum.length=30 mm", "blades.count=2", "run.sample_from=0 s"]
    late = programs.mill("input/simoloyer.ini", *sets, "run.time=33 s")
    early = {"cpu": 0.0} if programs.quick else programs.mill("input/simoloyer.ini", *sets, "run.time=3 s")
    return [{"cpu_per_simulated_second": max(late["cpu"] - early["cpu"], 0.0) / 30}]


def planetary(programs):
    return [programs.mill("input/planetary.ini")]


def planetary_bed(programs):
    """50 balls of 10 mm in a 250 ml jar."""
    sets = ["motion.sun.speed=300 rpm", "motion.jar.speed=-600 rpm", "body.jar.radius=37 mm"]
    sets += ["body.jar.length=58.1 mm", "balls.count=50", "balls.diameter=10 mm"]
    return [programs.mill("input/planetary.ini", *sets, "run.time=5 s")]


ATTRITOR = ROOT / "tests/bench/attritor.ini"
SIDES, PINS, LEVELS = 26, 4, 10  # of a pin, at a level


def attritor(programs):
    return [programs.mill(ATTRITOR)]


def pin(level, number):
    """The facets of one pin of attritor.ini, a prism: corners in mm."""
    turn = math.radians(45 * level) + math.pi / 2 * number
    c, s, z = math.cos(turn), math.sin(turn), 14.0 * level - 63.0

    def corner(x, k):
        y, up = (4.0 * f(2 * math.pi * k / SIDES) for f in (math.cos, math.sin))
        return (x * c - y * s, x * s + y * c, z + up)

    near, far = ([corner(x, k) for k in range(SIDES)] for x in (7.0, 41.0))
    for k in range(SIDES):
        n = (k + 1) % SIDES
        yield from ((near[k], near[n], far[k]), (near[n], far[n], far[k]))
    for k in range(1, SIDES - 1):
        yield from ((near[0], near[k + 1], near[k]), (far[0], far[k], far[k + 1]))


def attritor_mesh(programs):
    """The same with its pins as one mesh of 4000 facets."""
    facets = [f for level in range(LEVELS) for n in range(PINS) for f in pin(level, n)]
    rows = (struct.pack("<12fH", 0, 0, 0, *(x for p in f for x in p), 0) for f in facets)
    stl = b"pins, in mm".ljust(80) + struct.pack("<I", len(facets)) + b"".join(rows)
    (programs.folder / "pins.stl").write_bytes(stl)
    sections = ATTRITOR.read_text().split("\n\n")
    kept = [text for text in sections if "[body.pin" not in text]
    mesh = "[body.pins]\nshape = mesh\nmotion = shaft\nfile = pins.stl\nunit = mm"
    deck = programs.folder / "mesh.ini"
    deck.write_text("\n\n".join([*kept, mesh]) + "\n")
    return [programs.mill(deck)]


def memory(programs):
    """Frames are stored three times within the run."""
    deck = programs.gas_deck(256_000, 0.30)
    return [programs.mill(deck, "run.time=2 ms", "output.frames=1 ms")]


def quartic(programs):
    rows = programs.poly()
    return [{"nanoseconds": rows[POLY_ROW]["first_rise"], "rows": list(rows.values())}]


def gas(name, number, packing, at_least, aim):
    title = f"elastic gas, {number} balls, packing {packing:.2f}"
    return Case(name, title, lambda p: p.gas(number, packing), at_least, aim, once=number >= LARGE)


CASES = [
    Case("simoloyer", "reference mill, whole program", simoloyer, 1.2e6, 2e6),
    Case(
        "frictionless",
        "same, no friction, 300 rpm, first second",
        frictionless,
        1.4e6,
        1.0,
        aim_quantity="cpu_per_simulated_second",
    ),
    Case(
        "start",
        "reference mill, from the beginning to the first event",
        lambda p: [p.start("input/simoloyer.ini")],
        0.03,
        0.02,
        quantity="cpu_seconds",
    ),
    Case("short", "reference mill, whole program, 1 us", short, 0.1, 0.05, quantity="cpu_seconds"),
    Case("wavy", "wavy mill, 8 buckles of 4 mm, whole program", wavy, 0.92e6, 1.5e6),
    Case(
        "wavy-frictionless",
        "same, no friction, first second",
        wavy_frictionless,
        2.5,
        2.0,
        quantity="cpu_per_simulated_second",
    ),
    Case(
        "wavy-cost",
        "time of a contact, wavy over the same mill with a smooth wall",
        wavy_cost,
        1.3,
        1.0,
        quantity="time_ratio",
    ),
    Case(
        "planetary",
        "planetary mill, 7 balls, whole program",
        planetary,
        1 / 30,
        0.01,
        quantity="cpu_per_simulated_second",
    ),
    Case(
        "planetary-bed",
        "same, 50 balls of 10 mm, 300 rpm",
        planetary_bed,
        1 / 3,
        0.1,
        quantity="cpu_per_simulated_second",
    ),
    Case(
        "rest",
        "reference mill, 1000 balls at rest on 0 rpm",
        rest,
        1.5,
        0.15,
        quantity="cpu_per_simulated_second",
        once=True,
    ),
    Case(
        "cores",
        "elapsed time, reference mill of 100000 balls, two threads over one",
        cores,
        1 / 1.5,
        1 / 1.8,
        quantity="time_ratio",
    ),
    Case("attritor", "attritor, 4000 balls, 40 pins, whole program", attritor, 1.0e6, 2e6),
    Case("attritor-mesh", "same, the pins a mesh of 4000 facets", attritor_mesh, 0.75e6, 2e6),
    Case(
        "pins",
        "contacts per second, reference mill over attritor",
        None,
        1 / 0.8,
        1.0,
        quantity="time_ratio",
        parts=("simoloyer", "attritor"),
    ),
    Case(
        "pins-mesh",
        "contacts per second, reference mill over attritor-mesh",
        None,
        1 / 0.6,
        1.0,
        quantity="time_ratio",
        parts=("simoloyer", "attritor-mesh"),
    ),
    gas("gas4k-0.05", 4000, 0.05, 0.9e6, 1.2e6),
    gas("gas4k-0.30", 4000, 0.30, 1.1e6, 1.8e6),
    gas("gas4k-0.45", 4000, 0.45, 1.8e6, 2.5e6),
    Case(
        "gravity4k-0.30",
        "same at 0.30, gravity, floor and lid",
        lambda p: p.gas(4000, 0.30, "gravity"),
        0.7e6,
        1.2e6,
    ),
    gas("gas256k-0.30", 256_000, 0.30, 0.40e6, 0.7e6),
    gas("gas256k-0.45", 256_000, 0.45, 0.60e6, 0.9e6),
    gas("gas1m-0.30", 1_000_000, 0.30, 0.30e6, 0.5e6),
    Case(
        "scaling",
        "time of a contact, 256000 balls over 4000",
        None,
        3.0,
        2.0,
        quantity="time_ratio",
        parts=("gas4k-0.30", "gas256k-0.30"),
    ),
    Case(
        "memory",
        "256000 balls at 0.30, peak of the whole program",
        memory,
        400.0,
        300.0,
        quantity="bytes_per_ball",
        once=True,
    ),
    Case(
        "quartic",
        f"first root of a quartic, bench_poly '{POLY_ROW}'",
        quartic,
        150.0,
        80.0,
        quantity="nanoseconds",
    ),
]
BY_NAME = {case.name: case for case in CASES}


def chosen(words):
    """The cases of these names, or beginnings of names; all of them for none."""
    for word in words:
        if not any(case.name.startswith(word) for case in CASES):
            raise UsageError(f"no case '{word}'; there are {', '.join(BY_NAME)}")
    return [case for case in CASES if not words or any(case.name.startswith(w) for w in words)]
