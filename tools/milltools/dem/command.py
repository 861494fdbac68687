"""`mill dem`: runs the deck of a mill in LIGGGHTS as soft spheres and writes a file in millsim's own schema."""

import contextlib
import datetime
import math
import pathlib
import re
import shlex
import signal
import tempfile
import textwrap
import time

import numpy as np

from milltools.base import engine
from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable
from milltools.base.processes import Stopped, between_steps, stops_in_order
from milltools.base.progress import Progress, say
from milltools.base.text import plain
from milltools.dem import script, singles
from milltools.dem.liggghts import command
from milltools.dem.model import STEEL, Model, sticking_restitution, tangential_damping
from milltools.dem.setup import setup_of
from milltools.dem.soft_mill import HALF_AN_INTERVAL, SoftMill
from milltools.foreign.digest import Digest
from milltools.read.deck import Deck
from milltools.read.runfile import Run

SUMMARY = """Runs a deck in LIGGGHTS, as soft spheres: the same geometry, start, materials and rotor. The file that
it writes has millsim's own schema, so './mill compare' and all other tools can read it."""

SETTLE = 0.02  # [s] of the stiff run between a softer warm-up and the sampled window
PUBLISH = 60.0  # [s] of wall-clock time between checkpoints of the results
PREFIXES = {"": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
LEAST_RESTITUTION = 0.05  # LIGGGHTS accepts no smaller value
LEAST_WITH_FRICTION = 0.7  # below this restitution, friction in LIGGGHTS differs much from the deck's
OFF = {1e9: "energies, power and rates of impacts", 1e11: "rates of impacts"}  # below this modulus [Pa]
RESTITUTION_OFF = 0.02  # if single impacts differ more than this from the deck's restitution, something is wrong
SINGLES = {
    "restitution": "normal restitution",
    "friction": "friction of sliding contacts",
    "tangential_restitution": "tangential restitution of sticking contacts",
}
ISOLATED = "loss computed for isolated impacts, divided by the loss in the dashpots"


def modulus(text):
    """Young's modulus [Pa] from 'steel', '1e9' or '10 GPa'. No key of a deck has this unit, so millsim cannot read
    it."""
    if text.strip() == "steel":
        return STEEL
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([A-Za-z]*)\s*", text)
    with contextlib.suppress(ValueError, KeyError, TypeError):
        value = float(found[1]) * PREFIXES[found[2]]
        if 1e5 <= value <= 1e13:
            return value
    raise UserError(
        f"modulus '{text}': expected 'steel' or a Young's modulus from 1e5 to 1e13 Pa, such as 1e9 or '10 GPa'"
    )


def add_arguments(parser):
    add = parser.add_argument
    add("deck", help="deck of the mill, as for millsim")
    add("-o", "--output", help="file of the results; default: the deck's name with -dem.h5, in this folder")
    add(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of the deck; may be repeated",
    )  # fmt: skip
    add("-f", "--force", action="store_true", help="overwrite an existing output file")
    add("-q", "--quiet", action="store_true", help="no progress")
    add(
        "--modulus", default="1e10", metavar="E",
        help="Young's modulus of all bodies in Pa, or 'steel' (2.1e11); default %(default)s. It sets the time step. "
        "Compare rates of impacts at 'steel' only",
    )  # fmt: skip
    add(
        "--warm-up", metavar="E",
        help="a smaller modulus up to 20 ms before run.sample_from: saves most of the cost of this time",
    )  # fmt: skip
    add("--time", help="end of the run, such as '50 ms', instead of the deck's run.time")
    add("--ranks", type=int, default=1, help="processes of LIGGGHTS (mpirun); default %(default)s")
    add("--script", metavar="FOLDER", help="only write LIGGGHTS' input script, balls and meshes into FOLDER")


def refuse(deck):
    """UserError for decks that LIGGGHTS cannot run correctly."""
    setup_of(deck)
    for kind in deck.kinds:
        own = f"contact.{kind}" if f"contact.{kind}" in deck.sections else "contact"
        if deck.value(f"{own}.restitution_speed") or deck.value(f"{own}.restitution_table"):
            raise UserError(
                f"{deck.path}: [{own}] restitution: it falls with the speed, which LIGGGHTS cannot do; give a number "
                "and no restitution_speed or restitution_table"
            )
        e = deck.contact(kind).restitution
        if e <= LEAST_RESTITUTION:
            raise UserError(
                f"{deck.path}: [contact] restitution of {kind}: LIGGGHTS needs more than {LEAST_RESTITUTION}, got {e:g}"
            )


def cautions(deck, missed):
    """Notes to read before comparing, one sentence each."""
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
            f"restitution below {LEAST_WITH_FRICTION} with friction ({', '.join(low)}): LIGGGHTS' effective friction "
            "is far from the deck's there; do not compare"
        )
    return found


def start_of(deck):
    """The state of the balls in the setup's frame. millsim refuses balls that overlap anything."""
    return setup_of(deck).frame.from_laboratory(0.0, *deck.start())


class Job:
    """One run of `mill dem`, from the checked deck to the output file."""

    def __init__(self, arguments):
        times = [f"run.time={arguments.time}"] if arguments.time else []
        self.arguments, self.deck = arguments, Deck.check(arguments.deck, [*arguments.set, *times])
        refuse(self.deck)
        self.modulus = modulus(arguments.modulus)
        self.soft = modulus(arguments.warm_up) if arguments.warm_up else None
        self.damped, missed = tangential_damping(self.deck)
        self.cautions = cautions(self.deck, missed)
        self.model = Model(self.deck, self.modulus)
        self.end = self.deck.number("run.time")
        self.soft_until = 0.0
        if self.soft is not None:
            if self.soft >= self.modulus:
                raise UserError(f"--warm-up {arguments.warm_up} is not softer than --modulus {arguments.modulus}")
            series = self.deck.number("output.series")
            until = self.deck.number("run.sample_from", 0.0) - SETTLE
            self.soft_until = max(0.0, math.floor(until / series + 1e-9) * series)
            if self.soft_until == 0:
                self.cautions.append(f"--warm-up has no effect: run.sample_from must be later than {SETTLE * 1e3:g} ms")
        self.soft_model = Model(self.deck, self.soft) if self.soft_until > 0 else self.model
        self.interval = max(self.model.sample_interval, self.soft_model.sample_interval)
        self.frames = self.deck.number("output.frames", 0.0)
        if 0 < self.frames < self.interval:
            raise UserError(
                f"{self.deck.path}: [output] frames: {self.frames:g} s is less than {self.interval:.3g} s, the "
                "interval of LIGGGHTS' samples with this modulus: choose a longer one, or 0 s"
            )
        if arguments.ranks < 1:
            raise UserError(f"--ranks {arguments.ranks}: expected 1 or more")
        self.output = pathlib.Path(arguments.output or f"{pathlib.Path(arguments.deck).stem}-dem.h5")
        self.started = datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        self.begin = self.published = time.monotonic()
        self.measured, self.price = {}, math.nan

    def write_script(self, folder) -> Answer:
        """Writes LIGGGHTS' files for the whole run, for users who run LIGGGHTS themselves."""
        folder, step, deck = pathlib.Path(folder), self.model.time_step, self.deck
        if self.soft is not None:
            raise UserError("--script writes a run of one stiffness: omit --warm-up")
        if (folder / "in.mill").exists() and not self.arguments.force:
            raise UserError(f"{folder}: contains an in.mill already; --force overwrites it")
        state, run = start_of(deck), "liggghts -in in.mill -screen screen.txt -log none"
        types = ", ".join(f"{k} {kind.name}" for k, kind in enumerate(deck.species, start=1))
        head = [
            f"{pathlib.Path(deck.path).name} as LIGGGHTS reads it, SI units, by mill dem of millsim {engine.version()}",
            f"run here: {run}",
            f"types: {types}; then {', '.join(deck.kinds[1:])}",
            f"a contact of two balls lasts {self.model.pair[0][0].duration:.4g} s; state.bin holds the balls at "
            "output.frames",
        ]
        lines = [f"# {plain(line).replace('&', '?').replace('$', '?')}\n" for line in head]
        try:
            folder.mkdir(parents=True, exist_ok=True)
            steps, frames = (round(time / step) for time in (self.end, self.frames))  # all samples would need gigabytes
            text, meshes = script.write(folder, deck, self.model, self.damped, steps, 0.0, state, states_every=frames)
            (folder / "in.mill").write_text("".join(lines) + text)
        except OSError as fault:
            raise UserError(f"{folder}: cannot write: {fault.strerror}", 1) from None
        names = ["in.mill", "balls.data", *(mesh.file for mesh in meshes)]
        facts = {"files": [folder / name for name in names], "folder": folder, "run": run}
        return Answer(f"{folder}: {', '.join(names)}; run there: {run}", facts)

    def facts(self, mill):
        """The facts of a SoftMill for /run, as milltools.foreign.digest takes them."""
        model, price = self.model, "processor seconds of LIGGGHTS for one simulated second at `modulus`, without output"
        softness = [
            f"at {self.modulus:.3g} Pa balls touch several others at a time: {what} are wrong: use --modulus steel"
            for least, what in OFF.items()
            if self.modulus < least
        ]
        found = {
            "notes": "\n".join(self.cautions + softness[:1]),
            "program": "LIGGGHTS",
            "version": mill.version,
            "command": shlex.join(self.arguments.words),
            "started": self.started,
            "wall_time": time.monotonic() - self.begin,
            "cpu_time": mill.cpu,
            "largest_overlap": mill.deepest,
            "tools": (engine.version(), "", "version of millsim's tools that drove it"),
            "price": (self.price, "1", price),
            "modulus": (self.modulus, "Pa", "Young's modulus of all bodies"),
            "warm_up_modulus": (self.soft or self.modulus, "Pa", "Young's modulus up to warm_up_time"),
            "warm_up_time": (self.soft_until, "s", "end of the part with the smaller modulus"),
            "time_step": (model.time_step, "s", "time step at `modulus`"),
            "sample_interval": (model.sample_interval, "s", "time between two samples of the contacts"),
            "contact_duration": (model.pair[0][0].duration, "s", "of a contact of two balls of the first kind"),
            "ranks": (self.arguments.ranks, "1", "processes of LIGGGHTS"),
        }
        if not mill.rubs and mill.turnover:
            found["energy_turnover"] = mill.turnover
            found["energy_balance_error"] = abs(mill.unbalanced) / mill.turnover
        for kind, isolated, lost in zip(self.deck.kinds, mill.isolated_loss, mill.normal_loss, strict=True):
            found[f"isolated_share/{kind}"] = (isolated / lost if lost else math.nan, "1", ISOLATED)
        for kind, law in self.measured.items():
            for name, meaning in SINGLES.items():
                text = f"{meaning} of single impacts in LIGGGHTS at this stiffness and time step"
                found[f"measured/{kind}/{name}"] = (getattr(law, name), "1", text)
        return found

    def publish(self, mill):
        """Writes the results so far to the disk."""
        self.results.facts(self.facts(mill))
        self.results.publish()
        self.published = time.monotonic()

    def finish(self, mill, status):
        """The file is complete when this returns."""
        self.results.facts(self.facts(mill))
        # the times of a sample and of its account differ by rounding
        self.results.end(status, self.end if status == "complete" else max(mill.time, mill.told, 0.0))

    def check_singles(self):
        """Runs single impacts, to measure LIGGGHTS' restitution and friction before the long run."""
        self.measured = singles.measure(self.deck, self.model, self.damped)
        for kind, law in self.measured.items():
            wanted = self.deck.contact(kind).restitution
            if abs(law.restitution - wanted) > RESTITUTION_OFF:
                raise UserError(
                    f"LIGGGHTS gives a restitution of {law.restitution:.3f} in single impacts of {kind} where the deck "
                    f"says {wanted:g}",
                    1,
                )

    def run(self) -> Answer:
        """Runs the mill."""
        command(self.arguments.ranks)
        check_writable(self.output, [self.deck.path])
        if self.output.exists() and not self.arguments.force:
            raise UserError(f"{self.output}: exists already; --force overwrites it")
        for caution in self.cautions:
            say("mill dem", f"note: {caution}")
        state = start_of(self.deck)
        with stops_in_order(), between_steps(patient=True):
            try:
                apart = self.interval * HALF_AN_INTERVAL
                with Digest(self.deck, self.output, apart, True, self.arguments.force) as self.results:
                    return self.follow(state)
            except OSError as fault:  # usually a full disk
                raise UserError(f"{fault.filename or tempfile.gettempdir()}: {fault.strerror or fault}", 1) from None

    def follow(self, state) -> Answer:
        """Runs LIGGGHTS from `state` and writes the results also if the run fails."""
        progress = Progress("mill dem", self.steps(self.end), self.arguments.quiet)

        def tell(reached):
            progress(self.steps(reached), f"LIGGGHTS at {reached * 1e3:.2f} of {self.end * 1e3:g} ms")
            if time.monotonic() - self.published > PUBLISH:
                self.publish(mill)

        mill = SoftMill(self.deck, state, self.damped, self.results, self.arguments.ranks, tell)
        self.results.facts(self.facts(mill))
        end, status = "stopped", 0
        try:
            self.check_singles()
            if self.soft_until > 0:
                mill.run(self.soft, self.soft_until)
            mill.run(self.modulus, self.end)
            end = "complete"
            try:  # the cost of LIGGGHTS alone; if this fails, the complete run is still valid
                self.price = mill.price((self.end - self.soft_until) / self.model.time_step)
            except UserError as fault:
                say("mill dem", f"note: the cost of LIGGGHTS alone was not measured: {fault}")
        except KeyboardInterrupt:
            status = 128 + signal.SIGINT
        except Stopped as stopped:
            status = 128 + stopped.number
        except UserError as fault:
            with contextlib.suppress(UserError):
                if mill.rows:
                    self.finish(mill, "failed")
                    fault = UserError(
                        f"{fault}; results up to {mill.time * 1e3:.4g} ms are in {self.output}", fault.status
                    )
            raise fault from None
        finally:
            progress.stop()
        self.finish(mill, end)
        text = summarize(self.output, self.deck, self.measured)
        if end == "stopped":
            name = signal.Signals(status - 128).name
            say("mill dem", f"stopped by {name} at {mill.time * 1e3:.4g} ms; results up to then are in {self.output}")
        with Run(self.output) as run:
            return Answer(text, {"files": [self.output]} | run.results(), status)

    def steps(self, reached):
        """Number of time steps up to `reached` [s]."""
        soft = min(reached, self.soft_until)
        return soft / self.soft_model.time_step + (reached - soft) / self.model.time_step


def _number(value):
    return f"{value:.4g}" if math.isfinite(value) else "-"


def summarize(path, deck, measured):
    """The results in the file at `path` as a text, in the form of millsim's own summary; measured: {kind:
    Singles}."""
    with Run(path) as run:
        read, window = run.read, run.duration
        until = read("run/warm_up_time")
        warm = f", after {until * 1e3:.4g} ms at {read('run/warm_up_modulus'):.3g} Pa" if until > 0 else ""
        sampled = f"sampled for {window * 1e3:.4g} ms"
        if not window > 0:
            sampled = f"nothing sampled: it ended at {run.time * 1e3:.4g} ms, before run.sample_from"
        lines = [
            "",
            f"{sampled}; LIGGGHTS, E = {read('run/modulus'):.3g} Pa{warm}",
            "",
            "                                       median v_n  median v_n    mean v_n   dissipated",
            "                                           of all  above floor     of all        power",
            "kind           contacts     rate [/s]       [m/s]       [m/s]       [m/s]          [W]",
        ]
        speeds = [f"normal_speed/{name}" for name in ("median", "median_above_floor", "mean")]
        columns = [("rate", 14), *((name, 12) for name in speeds), ("dissipated_power", 13)]
        for kind in (*run.kinds, "all"):
            row = f"statistics/impacts/{kind}"
            cells = "".join(f"{_number(read(f'{row}/{name}')):>{width}}" for name, width in columns)
            lines.append(f"{kind:<12}{read(f'{row}/count'):>11}{cells}")
        drive = run.drive
        error = read(f"statistics/{drive}/power_error")
        error = f"+- {_number(error)} W" if math.isfinite(error) else "(no error: too short)"
        lines += ["", f"{drive} power        {_number(read(f'statistics/{drive}/power'))} W {error}"]
        moving, turning = (run.series(name)[1] for name in ("kinetic_energy", "rotational_energy"))
        if len(moving):  # empty if the run was stopped before its first row
            lines.append(f"kinetic energy     {_number(moving[-1])} J at the end, and {_number(turning[-1])} J in spin")
        if run.has("run/energy_balance_error"):
            balance = read("run/energy_balance_error")
            lines.append(f"energy error       {100 * balance:.2g} % of the energy turned over (contacts are sampled)")
        lines += ["", "single impacts      restitution        friction          tangential restitution"]
        for kind, law in measured.items():
            wanted = deck.contact(kind)
            lines.append(
                f"{kind:<12} deck {wanted.restitution:<6.4g} got {law.restitution:.3f}"
                f"   deck {wanted.friction:<6.4g} got {_number(law.friction):<7}"
                f"   deck {wanted.tangential_restitution:<6.4g} got {_number(law.tangential_restitution)}"
            )
        overlap = read("run/largest_overlap")
        lines += [
            "",
            f"cost               {read('run/cpu_time'):.4g} s CPU with output, without it {_number(read('run/price'))} "
            f"s per simulated second; {read('run/wall_time'):.4g} s wall",
            f"largest overlap    {overlap * 1e6:.3g} um, {100 * overlap / run.balls('diameter').min():.2g} % of a "
            f"diameter; contacts last {read('run/contact_duration') * 1e6:.3g} us, time step "
            f"{read('run/time_step') * 1e6:.3g} us",
            f"file               {path}",
        ]
        for note in read("run/notes").splitlines():
            lines += textwrap.wrap(f"note: {note}", 100, subsequent_indent="      ")
    return "\n".join(lines)


def run(arguments) -> Answer:
    job = Job(arguments)
    return job.write_script(arguments.script) if arguments.script else job.run()
