"""What `mill check` runs: which stretch of the mill, how stiff, from how many starts, so that it ends in time."""

import dataclasses
import json
import math
import pathlib
import re
import subprocess

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.files import write_text
from milltools.base.processes import cores
from milltools.read.deck import Deck

SOFTEST = 1e9
STIFF = (2.1e11, 1e10, SOFTEST)  # [Pa] the stiffest that leaves enough time is taken
FORECAST = re.compile(r"forecast: .*?([0-9.e+-]+) s of processor time")
CONTACT = re.compile(r"contact lasts ([0-9.e+-]+) s")
FEWEST, MOST = 6, 24  # starts, if their number is not given
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


def forecast(deck, *options):
    """Processor seconds for a simulated second of a deck, from a trial of millsim, and the duration [s] of a contact of
    soft spheres."""
    words = [engine.program(), "--check", *(word for one in deck.overrides for word in ("-s", one)), *options]
    done = subprocess.run([*words, "--", deck.path], capture_output=True, text=True, errors="replace")
    found = FORECAST.search(done.stderr)
    if not found:
        said = [line for line in done.stderr.splitlines() if "forecast" in line]
        raise UserError(
            engine.own_words(said[0]) if said else f"millsim --check ended with status {done.returncode}", 1
        )
    lasts = CONTACT.search(done.stderr)
    return float(found[1]) / deck.number("run.time"), float(lasts[1]) if lasts else 0.0


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
    (soft, lasts), (hard, _) = forecast(deck, "--soft", "-s", f"soft.modulus={SOFTEST} Pa"), forecast(deck)
    whole = deck.number("run.time")
    wanted = min(whole, PERIODS * period_of(deck))
    many, budget = starts or FEWEST, 60 * minutes * cores()

    def price(stiff):
        # the duration of a contact, and with it the step, goes as the modulus to the power of -0.4
        return hard + soft * (stiff / SOFTEST) ** 0.4

    stiff = modulus or next((one for one in STIFF if price(one) * many * wanted <= budget), STIFF[-1])
    length = time or min(whole, max(budget / (many * price(stiff)), min(wanted, LEAST)))
    if not starts:
        many = int(np.clip(budget // (length * price(stiff)), FEWEST, MOST))
    begin = deck.number("run.sample_from", 0.0)
    begin = begin if 0 < begin <= EARLY * length else EARLY * length if begin > 0 else 0.0
    rounds = math.ceil(2 * many / cores()) / 2
    return Plan(length, begin, stiff, lasts * (stiff / SOFTEST) ** -0.4, many, rounds * length * price(stiff))


# ---- kept, so that the same command continues: what a second costs is not the same twice

PLAN = "plan.json"


def load(folder, asked):
    """The Plan of an earlier check in this folder, or None; UserError if something else was `asked` then."""
    try:
        kept = json.loads((folder / PLAN).read_text())
        plan = Plan(**kept["plan"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError):
        raise UserError(f"{folder / PLAN}: is not the plan of a check; --force starts again") from None
    if kept["asked"] != asked:
        raise UserError(f"{folder}: has another check; -o gives another folder, --force starts again")
    return plan


def save(folder, asked, plan):
    """Makes the folder, with the plan."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / PLAN, json.dumps({"asked": asked, "plan": dataclasses.asdict(plan)}))
    except OSError as fault:
        raise UserError(f"{folder}: cannot be written: {fault.strerror}") from None


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
