#!/usr/bin/env python3
"""How fast millsim is beside other event-driven programs that the user has built. `make bench-peers` runs it.

All programs compute the same number of elastic hard balls at the same packing fraction, in turn, so that a slow minute
of the machine spreads over all of them. The peers' boxes are periodic; millsim's gas is in a drum, as bench_engine.c
says, and has contacts with its walls besides. Ratios are those of one turn; median, least and greatest are shown.
"""

import argparse
import contextlib
import json
import math
import os
import pathlib
import pty
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from bench import aligned, begin, finish, short, show_progress
from bench_cases import ENGINE, ROOT, BenchError, Programs, UsageError

REPEATS = 7


@dataclass(frozen=True)
class Case:
    name: str
    balls: int
    packing: float
    ratio: int = 1  # diameter of the large balls over that of the small ones, which have the same volume in all
    gravity: bool = False
    settle: int = 60  # contacts of each ball before the measuring
    contacts: int = 500_000  # of all balls, measured


CASES = [
    *(Case(f"gas4k-{packing:.2f}", 4000, packing) for packing in (0.05, 0.30, 0.45)),
    Case("gravity4k-0.30", 4000, 0.30, gravity=True),
    Case("gas256k-0.30", 256_000, 0.30, settle=5),
    Case("gas256k-0.45", 256_000, 0.45, settle=20),
    *(Case(f"mix20k-1:{ratio}", 20_000, 0.30, ratio, settle=6, contacts=40_000) for ratio in (1, 2, 3, 5, 10)),
]
EQUAL = "mix20k-1:1"  # what the other mixtures are compared with
BEFORE = "before"  # an earlier build of bench_engine


# ---- the start of a peer ----


def sites(least):
    """At least so many sites of a face-centred cubic lattice in the unit cube, neighbours in memory where in space."""
    n = math.ceil((least / 4) ** (1 / 3) - 1e-9)
    corners = np.stack(np.meshgrid(*3 * [np.arange(n)], indexing="ij"), -1).reshape(-1, 1, 3)
    faces = np.array([[1, 1, 1], [3, 3, 1], [3, 1, 3], [1, 3, 3]]) / 4
    return ((corners + faces) / n).reshape(-1, 3)


def picked(places, number):
    """So many of the places at random, in their order."""
    return places[np.sort(np.random.default_rng(1).choice(len(places), number, replace=False))]


def start(case):
    """Side of the periodic cube and places of the large and of the small balls, in diameters of a large ball."""
    large = case.balls if case.ratio == 1 else round(case.balls / (1 + case.ratio**3))
    small = case.balls - large
    side = ((large + small / case.ratio**3) * math.pi / 6 / case.packing) ** (1 / 3)
    places, free, tried = picked(sites(large), large) * side, np.empty((0, 3)), small
    while len(free) < small:
        free = sites(tried) * side
        for place in places:
            away = np.abs(free - place)
            away = np.minimum(away, side - away)
            free = free[(away**2).sum(axis=1) > (0.5 + 0.5 / case.ratio) ** 2]
        tried = 1 + int(1.02 * tried * small / max(1, len(free)))
    if case.gravity:  # floor and lid: z from 0 to the side
        z = places[:, 2]
        places[:, 2] = 0.51 + (z - z.min()) * (side - 1.02) / np.ptp(z)
    return side, places, picked(free, small)


# ---- the peers: how they are called, and the lines in which they tell their contacts ----


def edmd(program, case, folder):
    """EDMD of F. Smallenburg: reads its balls from init.sph, draws their velocities; all masses are equal."""
    side, large, small = start(case)
    with (folder / "init.sph").open("w") as file:
        print(case.balls, f"\n{side:.12f} {side:.12f} {side:.12f}", file=file)
        for kind, radius, places in (("a", 0.5, large), ("b", 0.5 / case.ratio, small)):
            file.writelines(f"{kind} {x:.12f} {y:.12f} {z:.12f} {radius:.12f}\n" for x, y, z in places)
    # the fork with gravity; energies are in kT: the gas would thin out by 1/e over the box if it were ideal
    told = "initial_configuration file init.sph\ntime 1e9\nwrite_interval 1\nsnapshots 1e9\nwalls\n"
    (folder / "input.dat").write_text(f"{told}gravity {1 / side:.12f}\n")
    return [program]


def dynamo(program, case, folder):
    """DynamO: dynamod, beside dynarun, makes the start."""
    cells = round((case.balls / 4) ** (1 / 3))
    density = case.packing * 6 / math.pi
    told = [program.with_name("dynamod"), "-m0", f"-C{cells}", f"-d{density:.12f}", "-o", "start.xml"]
    made = subprocess.run(told, cwd=folder, capture_output=True, text=True)
    if made.returncode:
        raise BenchError(f"{told[0]}: {(made.stderr or made.stdout).strip().splitlines()[-1]}")
    return [program, "start.xml", "-c", "1000000000", "-p", str(max(1000, case.contacts // 20))]


@dataclass(frozen=True)
class Peer:
    title: str
    prepare: Callable | None  # program, case, folder for its files -> command
    line: re.Pattern | None  # of what it prints: contacts so far
    fits: Callable = lambda case: not case.gravity and case.ratio < 10  # there EDMD has minutes between two lines
    unit: int = 1  # contacts


COLLISIONS = re.compile(r"Simtime: .*Collisions: (\d+),")
PEERS = {
    "single": Peer("EDMD, variant Single", edmd, COLLISIONS),
    "cell": Peer("EDMD, variant Cell", edmd, COLLISIONS),
    "multi": Peer("EDMD, variant Multi", edmd, COLLISIONS),
    "gravity": Peer("EDMD with gravity, variant Cylinder or Gravity_raw", edmd, COLLISIONS, lambda case: case.gravity),
    "dynamo": Peer(
        "DynamO, program dynarun (gases of 4000 balls)",
        dynamo,
        re.compile(r"Events (\d+)k,"),
        lambda case: case.name.startswith("gas4k"),
        unit=1000,
    ),
    BEFORE: Peer("bench_engine of an earlier build of millsim", None, None, lambda case: True),
}


def watched(command, folder, peer, settle, contacts):
    """Contacts and processor time [s] of a peer between two of its lines: after `settle` contacts, and at least
    `contacts` later. Its output is a terminal, so that a line comes at once; then it is ended."""
    try:
        ours, its = pty.openpty()
    except OSError as error:
        raise BenchError(f"needs a pseudo terminal, mount /dev/pts: {error}") from None
    first, said = None, "it printed nothing"
    with subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=its, stderr=its) as process:
        os.close(its)
        clock = ~process.pid << 3 | 2  # of its processor time: what clock_getcpuclockid(3) of Linux gives
        # EIO: the program has ended
        with open(ours, errors="replace") as lines, contextlib.suppress(OSError):
            try:
                for line in lines:
                    said = line.strip() or said
                    if found := peer.line.search(line):
                        now = peer.unit * int(found[1]), time.clock_gettime(clock)
                        if first and now[0] >= first[0] + contacts:
                            return now[0] - first[0], now[1] - first[1]
                        if not first and now[0] >= settle:
                            first = now
            finally:
                process.kill()
    raise BenchError(f"ended before {settle + contacts:.0f} contacts: {said}")


# ---- measuring ----


def one_turn(case, programs, peers):
    """Samples of millsim and of each peer that can do the case, by name; a text where a peer failed."""
    if programs.quick:
        case = replace(case, balls=programs.balls(case.balls), settle=1, contacts=10_000)

    def engine(program):
        told = ["--repeats", 1, "--ratio", case.ratio, "--settle", case.settle, "--contacts", case.contacts]
        return json.loads(programs.run(program, *told, case.balls, case.packing, *["gravity"] * case.gravity)[0])

    found = {"millsim": engine(ENGINE)}
    for name, program in peers.items():
        peer = PEERS[name]
        if name == BEFORE:
            found[name] = engine(program)
        elif peer.fits(case):
            with tempfile.TemporaryDirectory(dir=programs.folder) as folder:
                try:
                    command = peer.prepare(program, case, pathlib.Path(folder))
                    number, cpu = watched(command, folder, peer, case.settle * case.balls / 2, case.contacts)
                    found[name] = {"ball_contacts": number, "cpu": cpu}
                except BenchError as error:
                    found[name] = str(error)
    return found


def spread(values):
    return {"median": statistics.median(values), "least": min(values), "greatest": max(values)}


def rates(turns, name, key="ball_contacts"):
    """[1/s], turn by turn; all contacts where only those are told apart"""
    return [turn[name].get(key, turn[name]["ball_contacts"]) / turn[name]["cpu"] for turn in turns]


def over(above, below):
    return spread([a / b for a, b in zip(above, below, strict=True)])


def record(case, turns, equal):
    """What the report says of a case: rates [1/s], and ratios within each turn. `equal`: the turns of 1:1."""
    failed = {name: told for turn in reversed(turns) for name, told in turn.items() if isinstance(told, str)}
    programs = {}
    for name in turns[0].keys() - failed.keys():
        programs[name] = {"ball_contacts": spread(rates(turns, name))}
        if "contacts" in turns[0][name]:
            programs[name]["all_contacts"] = spread(rates(turns, name, "contacts"))
        if name != "millsim":
            programs[name]["millsim_over_it"] = over(rates(turns, "millsim"), rates(turns, name))
            programs[name]["millsim_over_it_all"] = over(*(rates(turns, n, "contacts") for n in ("millsim", name)))
        reference = BEFORE if name == "millsim" and BEFORE in turns[0] else name
        if case.ratio > 1 and not any(isinstance(turn[reference], str) for turn in equal):
            programs[name]["over_equal"] = over(rates(turns, name, "contacts"), rates(equal, reference, "contacts"))
    ordered = {name: programs[name] for name in turns[0] if name in programs}
    return {**vars(case), "programs": ordered, "failed": failed, "turns": turns}


def table(entries):
    def cell(found, key, factor=1.0):
        if key not in found:
            return ""
        median, least, most = (short(found[key][k] * factor) for k in ("median", "least", "greatest"))
        return f"{median} ({least} .. {most})"

    rows = [("case", "program", "ball-ball, M/s", "all, M/s", "millsim over it, ball-ball", "all", "over 1:1")]
    for entry in entries:
        for name, found in entry["programs"].items():
            rates = [cell(found, key, 1e-6) for key in ("ball_contacts", "all_contacts")]
            ratios = [cell(found, key) for key in ("millsim_over_it", "millsim_over_it_all", "over_equal")]
            rows.append((entry["name"], name, *rates, *ratios))
    return aligned(rows)


def remarks(report):
    yield "Contacts per second of processor time: median (least .. greatest). Ratios are those of one turn."
    yield f"Contacts of peers are those of two balls. Over 1:1: of millsim, over 1:1 of '{BEFORE}' if that is given."
    if report["quick"]:
        yield "Quick: too little work, and large gases with fewer balls; these figures mean nothing."
    for entry in report["cases"]:
        for name, told in entry["failed"].items():
            yield f"{entry['name']}: {name} {told}"
    yield f"Load of the machine: {report['load_before']:.2f} before, {report['load_after']:.2f} after."


def read_arguments():
    told = "; ".join(f"{name}: {peer.title}" for name, peer in PEERS.items())
    parser = argparse.ArgumentParser(prog="bench_peers.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("peers", nargs="*", metavar="NAME=PROGRAM", help=told)
    parser.add_argument("--case", action="append", default=[], help="name of a case or its beginning, repeatable")
    parser.add_argument("--quick", action="store_true", help="see that it works; figures are void")
    parser.add_argument("--repeats", type=int, help=f"turns; default {REPEATS}, 1 with --quick")
    parser.add_argument("--json", type=pathlib.Path, metavar="FILE", help="default build/bench-peers.json")
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release", help="where the programs are")
    arguments = parser.parse_args()
    if arguments.repeats is not None and arguments.repeats < 1:
        raise UsageError("--repeats: at least 1")
    return arguments


def named(words):
    """The programs of NAME=PROGRAM by name."""
    peers = {}
    for word in words:
        name, _, path = word.partition("=")
        if name not in PEERS:
            raise UsageError(f"no peer '{name}'; NAME=PROGRAM with one of {', '.join(PEERS)}")
        if not os.access(path, os.X_OK) or os.path.isdir(path):
            raise UsageError(f"{word}: expected the path of a program")
        peers[name] = pathlib.Path(path).resolve()
    return peers


def chosen(words):
    for word in words:
        if not any(case.name.startswith(word) for case in CASES):
            raise UsageError(f"no case '{word}'; there are {', '.join(case.name for case in CASES)}")
    names = {c.name for c in CASES if not words or any(c.name.startswith(w) for w in words)}
    if any(name.startswith("mix") for name in names):
        names.add(EQUAL)
    return [case for case in CASES if case.name in names]


def bench(arguments):
    peers, cases = named(arguments.peers), chosen(arguments.case)
    repeats = arguments.repeats or (1 if arguments.quick else REPEATS)
    turns = {case.name: [] for case in cases}
    with tempfile.TemporaryDirectory(prefix="millsim-bench-") as folder:
        programs = Programs(arguments.build.resolve(), arguments.quick, 1, folder)
        target, report = begin(programs, arguments.json, "bench-peers")
        for turn in range(repeats):
            for case in cases:
                show_progress(f"turn {turn + 1} of {repeats}: {case.name}")
                failed = {name for found in turns[case.name] for name in found if isinstance(found[name], str)}
                left = {name: path for name, path in peers.items() if name not in failed}
                turns[case.name].append({**one_turn(case, programs, left), **dict.fromkeys(failed, "failed before")})
    if sys.stderr.isatty():
        show_progress("")
    report |= {"repeats": repeats, "peers": {name: str(path) for name, path in peers.items()}}
    report["load_after"] = os.getloadavg()[0]
    report["cases"] = [record(case, turns[case.name], turns.get(EQUAL)) for case in cases]
    finish(report, target, [*table(report["cases"]), "", *remarks(report)])


def main():
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # and end the peer, which would run on for ever
    try:
        bench(read_arguments())
    except BenchError as error:
        print(f"bench_peers.py: {error}", file=sys.stderr)
        return error.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
