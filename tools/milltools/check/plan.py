"""What `mill check` runs: which stretch of the mill, how stiff, from how many starts, so that it ends in time."""

import contextlib
import dataclasses
import fcntl
import json
import math
import os
import pathlib
import signal
import subprocess
import tempfile

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.files import write_text
from milltools.base.processes import cores, guard
from milltools.read.deck import Deck
from milltools.read.runfile import Run

SOFTEST = 1e9
STIFF = (2.1e11, 1e10, SOFTEST)  # [Pa] the stiffest that leaves enough time is taken
TRIAL, LEAST_TRIAL = 0.04, 2.0  # of the time, [s]: what each of the two trials may take
MINUTES = 3.0
FEWEST, MOST = 6, 24  # starts, if neither their number nor the time is given
PERIODS = 2  # of the mill: a shorter stretch is taken only if nothing else fits
LEAST = 0.05  # [s] the same for a mill that does not move
ROWS = 400  # of the series
NUDGE = 1e-5  # [m/s] added at random to balls of a start file: other starts of a mill that has only one
EARLY = 0.5  # of the stretch is not sampled, unless the deck samples earlier


@dataclasses.dataclass(frozen=True)
class Plan:
    """`time`, `sample_from` [s]: the stretch; `modulus` [Pa]; `contact` [s]: duration of a soft contact; `wall` [s]:
    what all runs take, on all cores."""

    time: float
    sample_from: float
    modulus: float
    contact: float
    starts: int
    wall: float

    def sets(self, deck):
        """Overrides of the deck, as -s takes them."""
        series = min(deck.number("output.series"), self.time / ROWS)
        return [
            f"run.time={self.time:.9g} s", f"run.sample_from={self.sample_from:.9g} s", "run.precision=0",
            "run.max_collisions=0", "run.threads=1", "output.frames=0 s", f"output.series={series:.9g} s",
            "output.impacts=statistics",
        ]  # fmt: skip


def forecast(deck, seconds, *sets):
    """Processor seconds for a simulated second of a deck, from a run of so many seconds: a shorter trial would not see
    the charge move. And the duration [s] of a contact of soft spheres; 0 of hard ones."""
    sets = [*deck.overrides, "output.frames=0 s", "run.threads=1", "run.starts=1", *sets]
    with tempfile.TemporaryDirectory(prefix="mill-check-") as folder:
        file = pathlib.Path(folder, "trial.h5")
        words = [*guard(), engine.program(), "-q", "-o", file, *(word for one in sets for word in ("-s", one))]
        with subprocess.Popen([*words, "--", deck.path], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
            try:
                said = process.communicate(timeout=seconds)[1]
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGINT)  # millsim then saves its results
                said = process.communicate()[1]
        if process.returncode not in (0, 128 + signal.SIGINT):
            raise UserError(engine.complaints(process.returncode, said.decode(errors="replace")), 1)
        with Run(file) as run:
            lasts = run.read("run/soft/contact_duration") if run.soft else 0.0
            return float(run.read("run/cpu_time") / run.time), float(lasts)


def period_of(deck):
    """[s] The longest period of a motion; LEAST / PERIODS if nothing moves."""
    periods = []
    for name in deck.motions:
        section = "rotor" if name == "rotor" else f"motion.{name}"
        speed, frequency = abs(deck.number(f"{section}.speed", 0.0)), abs(deck.number(f"{section}.frequency", 0.0))
        periods += [2 * math.pi / speed] if speed else [1 / frequency] if frequency else []
    return max(periods, default=LEAST / PERIODS)


def make(deck, minutes, modulus=None, starts=None, time=None):
    """The Plan for this number of minutes on all cores; what is given is kept."""
    most = MOST if minutes is None else math.inf
    minutes = minutes or MINUTES
    seconds = max(TRIAL * 60 * minutes, LEAST_TRIAL)
    soft, lasts = forecast(deck, seconds, "run.spheres=soft", f"soft.modulus={SOFTEST} Pa")
    hard, _ = forecast(deck, seconds)
    whole = deck.number("run.time")
    wanted = min(whole, PERIODS * period_of(deck))
    many, budget = starts or FEWEST, 60 * minutes * cores()

    def price(stiff):
        # the duration of a contact, and with it the step, goes as the modulus to the power of -0.4
        return hard + soft * (stiff / SOFTEST) ** 0.4

    stiff = modulus or next((one for one in STIFF if price(one) * many * wanted <= budget), STIFF[-1])
    length = time or min(whole, max(budget / (many * price(stiff)), min(wanted, LEAST)))
    if not starts:
        many = int(np.clip(budget // (length * price(stiff)), FEWEST, most))
    begin = deck.number("run.sample_from", 0.0)
    begin = begin if 0 < begin <= EARLY * length else EARLY * length if begin > 0 else 0.0
    rounds = math.ceil(2 * many / cores()) / 2
    return Plan(length, begin, stiff, lasts * (stiff / SOFTEST) ** -0.4, many, rounds * length * price(stiff))


# ---- kept, so that the same command continues: what a second costs is not the same twice

PLAN = "plan.json"


def load(folder, asked):
    """The Plan of an earlier check in this folder, or None. It has more starts of the same stretch if the present check
    is `asked` for more minutes or starts; UserError if for anything else."""
    try:
        kept = json.loads((folder / PLAN).read_text())
        plan, before = Plan(**kept["plan"]), kept["asked"]
        same = before["deck"] == asked["deck"]
        same &= all(asked[key] in (before[key], getattr(plan, key)) for key in ("modulus", "time"))
        longer = max((asked["minutes"] or MINUTES) / before["minutes"], 1.0)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, ZeroDivisionError):
        raise UserError(f"{folder / PLAN}: is not the plan of a check; --force starts again") from None
    starts = asked["starts"] or int(plan.starts * longer)
    if not same or starts < plan.starts:
        raise UserError(f"{folder}: has another check; -o gives another folder, --force starts again")
    asked["minutes"] = before["minutes"] * longer
    return dataclasses.replace(plan, starts=starts, wall=plan.wall * starts / plan.starts)


def save(folder, asked, plan):
    """Makes the folder, with the plan."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        asked["minutes"] = asked["minutes"] or MINUTES
        write_text(folder / PLAN, json.dumps({"asked": asked, "plan": dataclasses.asdict(plan)}))
    except OSError as fault:
        raise UserError(f"{folder}: cannot be written: {fault.strerror}") from None


@contextlib.contextmanager
def alone(folder):
    """While no other check runs in this folder; UserError if one does."""
    try:
        file = os.open(folder / "lock", os.O_CREAT | os.O_RDWR | os.O_NOFOLLOW, 0o666)
    except OSError as fault:
        raise UserError(f"{folder / 'lock'}: cannot be opened: {fault.strerror}") from None
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise UserError(f"{folder}: another check is running there") from None
    finally:
        os.close(file)


def start_files(deck, folder, count):
    """A start file for each start, or None: the seeds make other starts. All starts have the balls of the deck's own
    file at the same places."""
    if deck.value("balls.start", "random") == "random":
        return [None] * count
    place, velocity, spin = deck.start()
    random = np.random.default_rng(1)
    files = []
    for k in range(count):
        nudged = velocity + (NUDGE * random.standard_normal(velocity.shape) if k else 0.0)
        files.append(pathlib.Path(folder, f"start-{k + 1}.txt"))
        np.savetxt(files[-1], np.hstack([place, nudged, spin]), fmt="%.17g")
    return files


def read(path, overrides):
    """The deck, as hard spheres: what it says of soft ones is replaced."""
    return Deck.check(path, [*overrides, "run.spheres=hard"])
