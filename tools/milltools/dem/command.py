"""`mill dem`: the deck of a mill, run by LIGGGHTS as soft spheres, into a file that every reader of millsim's reads."""

import contextlib
import datetime
import math
import os
import pathlib
import re
import shlex
import signal
import sys
import tempfile
import time

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.processes import Stopped, between_steps, stops_in_order
from milltools.base.progress import Progress
from milltools.dem import singles
from milltools.dem.contacts import Contacts
from milltools.dem.liggghts import command
from milltools.dem.model import STEEL, Model, sticking_restitution, tangential_damping
from milltools.dem.script import file_of
from milltools.dem.setup import scene_of
from milltools.dem.soft_mill import HALF_AN_INTERVAL, Mill, inputs
from milltools.dem.summary import summarize
from milltools.foreign.digest import Digest
from milltools.read.deck import Deck

SUMMARY = """Runs a deck in LIGGGHTS, as soft spheres: the same geometry, start, materials and rotor. The file it writes
has millsim's own schema, so './mill compare' and every other reader work on it."""

SETTLE = 0.02  # [s] of the stiff run before the sampled window, after a softer warm-up
PUBLISH = 60.0  # [s] on the wall's clock between results brought to the disk
UNITS = {"": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
LEAST_RESTITUTION = 0.05  # LIGGGHTS takes no less
LEAST_WITH_FRICTION = 0.7  # below, its friction is quite another than the deck's
LEAST_FOR_POWER = 1e9  # [Pa] softer balls do not even draw the power
LEAST_FOR_RATES = 1e11  # [Pa]
LARGEST_START_OVERLAP = 1e-3  # of a diameter
RESTITUTION_OFF = 0.02  # single impacts farther than this from the deck's restitution: something is wrong


def modulus(text):
    """Young's modulus [Pa] from 'steel', '1e9', '10 GPa'."""
    if text.strip() == "steel":
        return STEEL
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([A-Za-z]*)\s*", text)
    with contextlib.suppress(ValueError, KeyError, TypeError):
        value = float(found[1]) * UNITS[found[2]]
        if 1e5 <= value <= 1e13:
            return value
    raise UserError(
        f"modulus '{text}': expected 'steel' or a Young's modulus from 1e5 to 1e13 Pa, such as 1e9 or '10 GPa'"
    )


def add_arguments(parser):
    parser.add_argument("deck", help="deck of the mill, as for millsim")
    parser.add_argument(
        "-o",
        "--output",
        help="where results go; default: the deck's name with -dem.h5, in this folder",
    )
    parser.add_argument("-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
                        help="override one value of the deck; may be repeated")  # fmt: skip
    parser.add_argument("-f", "--force", action="store_true", help="overwrite an existing output file")
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")
    parser.add_argument("--modulus", default="1e10", metavar="E",
                        help="Young's modulus of all bodies in Pa, or 'steel' (2.1e11); default %(default)s. The time "
                        "step goes with it: compare rates of impacts at 'steel' only")  # fmt: skip
    parser.add_argument("--warm-up", metavar="E",
                        help="this softer modulus up to 20 ms before run.sample_from: saves most of its time")  # fmt: skip
    parser.add_argument("--time", help="end of the run, such as '50 ms', instead of the deck's run.time")
    parser.add_argument("--ranks", type=int, default=1, help="processes of LIGGGHTS (mpirun); default %(default)s")
    parser.add_argument("--script", metavar="FOLDER",
                        help="write LIGGGHTS' input script, balls and blades into FOLDER and end")  # fmt: skip


def refuse(deck):
    """UserError for decks that LIGGGHTS cannot run as they are meant."""
    if deck.value("drum.profile", "circle") != "circle":
        raise UserError(
            f"{deck.path}: [drum] profile: expected 'circle', got '{deck.value('drum.profile')}': on a curved wall of "
            "triangles LIGGGHTS adds up the forces of neighbours, which changes restitution"
        )
    scene_of(deck)
    for kind in deck.kinds:
        e = deck.contact(kind).restitution
        if e <= LEAST_RESTITUTION:
            raise UserError(
                f"{deck.path}: [contact] restitution of {kind}: LIGGGHTS wants more than {LEAST_RESTITUTION}, got {e:g}"
            )


def cautions(deck, damped, missed):
    """What a reader ought to know before comparing, one sentence each."""
    found = []
    for wanted, got in sorted({(round(a, 6), round(b, 6)) for a, b in missed.values()}):
        kinds = [kind for kind, pair in missed.items() if np.allclose(pair, (wanted, got), atol=1e-6)]
        also = sticking_restitution(deck.contact(kinds[0]).restitution)
        found.append(
            f"tangential restitution {wanted:g} of {', '.join(kinds)} has no counterpart in LIGGGHTS, which has "
            f"{also:.3f} (damped) or 1: this run has {got:.3f}"
        )
    low = [k for k in deck.kinds if deck.contact(k).friction > 0 and deck.contact(k).restitution < LEAST_WITH_FRICTION]
    if low:
        found.append(
            f"restitution below {LEAST_WITH_FRICTION} with friction ({', '.join(low)}): LIGGGHTS' effective friction is "
            "far from the deck's there; do not compare"
        )
    return found


class Job:
    """One run of `mill dem`: from the checked deck to the file."""

    def __init__(self, arguments):
        overrides = list(arguments.set)
        if arguments.time:
            overrides.append(f"run.time={arguments.time}")
        self.arguments = arguments
        self.deck = Deck.check(arguments.deck, overrides)
        refuse(self.deck)
        self.modulus = modulus(arguments.modulus)
        self.soft = modulus(arguments.warm_up) if arguments.warm_up else None
        self.damped, missed = tangential_damping(self.deck)
        self.cautions = cautions(self.deck, self.damped, missed)
        self.model = Model(self.deck, self.modulus)
        self.end = self.deck.number("run.time")
        self.soft_until = 0.0
        if self.soft is not None:
            if self.soft >= self.modulus:
                raise UserError(f"--warm-up {arguments.warm_up} is not softer than --modulus {arguments.modulus}")
            series = self.deck.number("output.series")
            until = self.deck.number("run.sample_from", 0.0) - SETTLE
            self.soft_until = max(0.0, math.floor(until / series + 1e-9) * series)
        frames = self.deck.number("output.frames", 0.0)
        self.interval = self.model.sample_interval
        if self.soft_until > 0:
            self.interval = max(self.interval, Model(self.deck, self.soft).sample_interval)
        elif self.soft is not None:
            self.cautions.append(
                f"--warm-up has no effect: run.sample_from is not after {SETTLE * 1e3:g} ms, which the stiff run wants"
            )
        if 0 < frames < self.interval:
            raise UserError(
                f"{self.deck.path}: [output] frames: {frames:g} s is less than the {self.interval:.3g} s at which LIGGGHTS is "
                "looked at with this modulus: choose more, or 0 s"
            )
        if arguments.ranks < 1:
            raise UserError(f"--ranks {arguments.ranks}: expected 1 or more")
        self.output = pathlib.Path(arguments.output or f"{pathlib.Path(arguments.deck).stem}-dem.h5")
        self.started = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        self.begin = self.published = time.monotonic()
        self.measured = {}
        self.price = math.nan

    def write_script(self, folder):
        """LIGGGHTS' files for the whole run, for those who go on by hand."""
        folder, step = pathlib.Path(folder), self.model.time_step
        if self.soft is not None:
            raise UserError("--script writes one run of one stiffness: leave --warm-up out")
        if (folder / "in.mill").exists() and not self.arguments.force:
            raise UserError(f"{folder}: there is an in.mill already; --force overwrites it")
        state = scene_of(self.deck).frame.from_laboratory(0.0, *self.deck.start())
        self.check_start(state)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            # every sample would be gigabytes
            frames = round(self.deck.number("output.frames", 0.0) / step)
            text, _ = inputs(
                folder,
                self.deck,
                self.model,
                self.damped,
                round(self.end / step),
                0,
                0.0,
                state,
                states_every=frames,
            )
            names = [kind.name for kind in self.deck.species]
            head = [
                f"{pathlib.Path(self.deck.path).name} as LIGGGHTS reads it, SI units, by mill dem of millsim {engine.version()}",
                "run here: liggghts -in in.mill -screen screen.txt -log none",
                f"types: {', '.join(f'{k} {name}' for k, name in enumerate(names, start=1))}; then {', '.join(self.deck.kinds[1:])}",
                f"a contact of two balls lasts {self.model.pair[0][0].duration:.4g} s; state.bin holds the balls at output.frames",
            ]
            head = "".join(
                "# " + "".join(c if c.isprintable() and c not in "&$" else "?" for c in line) + "\n" for line in head
            )
            (folder / "in.mill").write_text(head + text)
        except OSError as fault:
            raise UserError(f"{folder}: cannot write: {fault.strerror}", 1) from None
        meshes = [file_of(name) for name, *_ in scene_of(self.deck).meshes(0.0)]
        names = ", ".join(["in.mill", "balls.data", *meshes])
        print(f"{folder}: {names}; run there: liggghts -in in.mill -screen screen.txt -log none")

    def softness(self):
        """What the stiffness alone keeps from being compared."""
        if self.modulus >= LEAST_FOR_RATES:
            return []
        soft = self.modulus < LEAST_FOR_POWER
        what = "energies, power and rates of impacts" if soft else "rates of impacts"
        return [
            f"at {self.modulus:.3g} Pa balls touch several others at a time: {what} are off; compare them at steel stiffness"
        ]

    def facts(self, mill):
        """What goes into /run."""
        facts = {
            "notes": (
                "\n".join(self.cautions + self.softness()),
                "",
                "what a reader ought to know before comparing, a line each",
            ),
            "program": "LIGGGHTS",
            "version": mill.version,
            "command": shlex.join(["mill", "dem", *self.words()]),
            "started": self.started,
            "wall_time": time.monotonic() - self.begin,
            "cpu_time": mill.cpu,
            "largest_overlap": mill.deepest,
            "tools": (engine.version(), "", "version of millsim's tools that drove it"),
            "price": (
                self.price,
                "1",
                "processor seconds of LIGGGHTS for one simulated second at `modulus`, without output",
            ),
            "modulus": (self.modulus, "Pa", "Young's modulus of all bodies"),
            "warm_up_modulus": (
                self.soft or self.modulus,
                "Pa",
                "Young's modulus up to warm_up_time",
            ),
            "warm_up_time": (self.soft_until, "s", "end of the softer warm-up"),
            "time_step": (self.model.time_step, "s", "time step at `modulus`"),
            "sample_interval": (
                self.model.sample_interval,
                "s",
                "interval at which contacts were looked at",
            ),
            "contact_duration": (
                self.model.pair[0][0].duration,
                "s",
                "of two balls of the first kind at `modulus`",
            ),
            "ranks": (self.arguments.ranks, "1", "processes of LIGGGHTS"),
        }
        if not mill.rubs and mill.turnover:
            facts["energy_turnover"] = mill.turnover
            facts["energy_balance_error"] = abs(mill.unbalanced) / mill.turnover
        for k, kind in enumerate(self.deck.kinds):
            share = mill.isolated_loss[k] / mill.normal_loss[k] if mill.normal_loss[k] else math.nan
            facts[f"isolated_share/{kind}"] = (
                share, "1", "loss of the impacts, as if each were alone, over the loss in the dashpots, summed over samples",
            )  # fmt: skip
        for kind, law in self.measured.items():
            text = "of single impacts in LIGGGHTS at this stiffness and time step"
            facts[f"measured/{kind}/restitution"] = (
                law.restitution,
                "1",
                f"normal restitution {text}",
            )
            facts[f"measured/{kind}/friction"] = (
                law.friction,
                "1",
                f"friction of sliding contacts {text}",
            )
            facts[f"measured/{kind}/tangential_restitution"] = (
                law.tangential_restitution, "1", f"tangential restitution of sticking contacts {text}",
            )  # fmt: skip
        return facts

    def words(self):
        """The command line's words after `mill dem`."""
        return sys.argv[2:] if len(sys.argv) > 2 else [str(self.arguments.deck)]

    def publish(self, mill):
        """Brings the results so far to the disk."""
        self.results.facts(self.facts(mill))
        self.results.publish()
        self.published = time.monotonic()

    def finish(self, mill, status):
        """The file is whole when this returns."""
        mill.flush()
        self.results.facts(self.facts(mill))
        # a sample and the account it makes differ by rounding
        self.results.end(status, self.end if status == "complete" else max(mill.time, mill.told, 0.0))

    def check_singles(self):
        """Throws single balls, so that what LIGGGHTS makes of the deck's contacts is known before it runs for long."""
        self.measured = singles.measure(self.deck, self.model, self.damped)
        for kind, law in self.measured.items():
            wanted = self.deck.contact(kind)
            if abs(law.restitution - wanted.restitution) > RESTITUTION_OFF:
                raise UserError(
                    f"LIGGGHTS gives a restitution of {law.restitution:.3f} in single impacts of {kind} where the deck "
                    f"says {wanted.restitution:g}",
                    1,
                )

    def run(self):
        """Runs the mill and returns the exit status."""
        command(self.arguments.ranks)
        self.check_output()
        for caution in self.cautions:
            print(f"mill dem: note: {caution}", file=sys.stderr)
        state = scene_of(self.deck).frame.from_laboratory(0.0, *self.deck.start())
        self.check_start(state)
        with stops_in_order(), between_steps(patient=True):
            try:
                with contextlib.closing(self.gather()):
                    return self.follow(state)
            except OSError as fault:  # a full disk, as a rule
                raise UserError(f"{fault.filename or tempfile.gettempdir()}: {fault.strerror or fault}", 1) from None

    def check_output(self):
        """Refuses an output that cannot be written in the end."""
        if self.output.is_dir():
            raise UserError(f"{self.output}: a folder; --output wants a file")
        if self.output.exists() and not self.arguments.force:
            raise UserError(f"{self.output}: there is such a file already; --force overwrites it")
        if not self.output.parent.is_dir():
            raise UserError(f"{self.output}: there is no folder {self.output.parent}")
        if self.output.exists() and self.output.samefile(self.deck.path):
            raise UserError(f"{self.output}: that is the deck itself")
        if not os.access(self.output.parent, os.W_OK):
            raise UserError(f"{self.output}: cannot write into {self.output.parent}", 1)

    def gather(self):
        """What takes this run, nothing told yet."""
        force, apart = self.arguments.force, self.interval * HALF_AN_INTERVAL
        self.results = Digest(self.deck, self.output, apart, springs=True, force=force)
        return self.results

    def follow(self, state):
        """Runs LIGGGHTS from `state` and writes the results, whatever its end; returns the exit status."""
        progress = Progress("mill dem", 1.0, self.arguments.quiet)

        def tell(reached):
            progress(self.work(reached), f"LIGGGHTS at {reached * 1e3:.2f} of {self.end * 1e3:g} ms")
            if time.monotonic() - self.published > PUBLISH:
                self.publish(mill)

        mill = Mill(self.deck, state, self.damped, self.results, self.arguments.ranks, tell)
        self.results.facts(self.facts(mill))
        end, status = "stopped", 0
        try:
            self.check_singles()
            if self.soft_until > 0:
                mill.run(self.soft, self.soft_until)
            mill.run(self.modulus, self.end)
            end = "complete"
            self.measure_price(mill)
        except KeyboardInterrupt:
            status = 128 + signal.SIGINT
        except Stopped as stopped:
            status = 128 + stopped.number
        except UserError as fault:
            raise self.failed(mill, fault) from None
        finally:
            progress.stop()
        self.finish(mill, end)
        print(summarize(self.output, self.deck, self.measured), end="")
        if end == "stopped":
            print(
                f"mill dem: stopped by {signal.Signals(status - 128).name} at {mill.time * 1e3:.4g} ms; results up to then are "
                f"in {self.output}",
                file=sys.stderr,
            )
        return status

    def measure_price(self, mill):
        """What LIGGGHTS costs by itself; a run that is complete does not fail with it."""
        try:
            self.price = mill.price((self.end - self.soft_until) / self.model.time_step)
        except UserError as fault:
            print(f"mill dem: note: the price was not measured: {fault}", file=sys.stderr)

    def failed(self, mill, fault):
        """Writes what there is; returns what to tell the user."""
        if not mill.rows:
            return fault
        try:
            self.finish(mill, "failed")
        except UserError:
            return fault
        return UserError(f"{fault}; results up to {mill.time * 1e3:.4g} ms are in {self.output}", fault.status)

    def work(self, reached):
        """Share of the time steps up to `reached` [s]."""
        soft = Model(self.deck, self.soft).time_step if self.soft else self.model.time_step

        def steps(t):
            return min(t, self.soft_until) / soft + max(t - self.soft_until, 0.0) / self.model.time_step

        return steps(reached) / steps(self.end)

    def check_start(self, state):
        """Bodies that overlap at the start would fly apart: LIGGGHTS says nothing."""
        found = Contacts(self.deck, self.model).find(0.0, state[0], state[1])
        deepest = max((f.overlap.max() for f in found if f is not None and len(f.ball)), default=0.0)
        least = min(kind.diameter for kind in self.deck.species)
        if deepest > LARGEST_START_OVERLAP * least:
            raise UserError(f"{self.deck.path}: balls overlap by {deepest:.3g} m at the start")


def run(arguments) -> int:
    job = Job(arguments)
    if arguments.script:
        job.write_script(arguments.script)
        return 0
    return job.run()
