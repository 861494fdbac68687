"""What a check has found: differences between hard and soft spheres, and one sentence."""

import contextlib
import dataclasses
import math

from milltools.base.text import MINUS, columns, quantity
from milltools.compare import agreement, rows
from milltools.compare.load import Sampled

SPEEDS = (0.5, 1.0, 2.0)  # [m/s]
DECIDES = ("power", "kinetic_energy", "impacts_above_1")
CERTAIN = 2.6  # standard errors: one difference in a hundred is as large by chance
NOTHING = 1e-3  # of the kinetic energy: a smaller loss is that of a mill that loses none
TINY = 1e-6  # of the kinetic energy: the spin of smooth balls is rounding
RARE = 30  # impacts in all runs of a side: fewer say nothing
STEEL = 1e11  # [Pa] softer balls merge impacts that are several for bodies as stiff as steel


@dataclasses.dataclass(frozen=True)
class Finding:
    """One watched quantity of both sides. `difference`: hard minus soft, relative to soft, with its standard `error`;
    `matters`: a smaller one counts as none. `bound`: the difference if re-contacts of hard spheres count, too; the
    truth lies between, if the soft spheres are softer than steel. `rare`: too few impacts to compare."""

    key: str
    words: str
    unit: str
    hard: float
    soft: float
    difference: float
    error: float
    matters: float
    bound: float = math.nan
    rare: bool = False

    @property
    def state(self):
        """ "holds", "off", "rare", or "open": not known well enough."""
        if self.rare or not math.isfinite(self.error):
            return "rare" if self.rare else "open"
        if abs(self.difference) <= self.matters and self.error <= 0.5 * self.matters:
            return "holds"
        bound = self.difference if math.isnan(self.bound) else self.bound
        sure = min(abs(self.difference), abs(bound)) if self.difference * bound > 0 else 0.0
        return "off" if sure > max(self.matters, CERTAIN * self.error) else "open"

    @property
    def told(self):
        """ "+0.6 +- 1.2 %" """
        if not math.isfinite(self.difference):
            return "not known"
        error = 100 * self.error
        error = "" if not math.isfinite(error) else f" +- {error:.0f}" if error >= 10 else f" +- {error:.2g}"
        places = 1 if abs(self.difference) < 0.1 and self.error < 0.1 else 0
        return f"{round(100 * self.difference, places) + 0.0:+.{places}f}".replace("-", MINUS) + f"{error} %"


def stuff(modulus):
    """ "steel", or the modulus with its unit."""
    return "steel" if modulus == 2.1e11 else quantity(modulus, "Pa")


def rate(speed, group="strikes"):
    """Rate of impacts at or above a speed; of strikes: re-contacts within the duration of a soft contact are one."""
    return lambda run: run.histogram("all", group).above(speed) / run.duration


def watched(run):
    """(key, words, unit, measure(run), the relative difference that matters) of what is compared."""
    lost = rows.added(run, "dissipation/{kind}", "all")[0] * run.duration
    if any(run.drive_work()[1]):
        yield "power", "power", "W", lambda run: run.rates("drive_work")[0], 0.03
    elif lost > NOTHING * run.means("kinetic_energy")[0]:
        yield "power", "lost power", "W", lambda run: rows.added(run, "dissipation/{kind}", "all")[0], 0.03
    yield "kinetic_energy", "kinetic energy", "J", lambda run: run.means("kinetic_energy")[0], 0.03
    yield "rotational_energy", "energy in the spin", "J", lambda run: run.means("rotational_energy")[0], 0.10
    for speed in SPEEDS:
        yield f"impacts_above_{speed:g}", f"impacts above {speed:g} m/s", "1/s", rate(speed), 0.10


@dataclasses.dataclass(frozen=True)
class Values:
    """What is watched of the runs of one kind of spheres; dictionaries by key, one value for each run."""

    duration: float  # [s] of the window of each
    modulus: float  # [Pa]; NaN: hard
    values: dict[str, list[float]]
    gross: dict[str, list[float]]  # rates with re-contacts


def values_of(paths, watch):
    """Values of these files; `watch`: of `watched`."""
    values, gross = {one[0]: [] for one in watch}, {}
    for path in paths:
        with contextlib.closing(Sampled(path)) as run:
            for key, _, _, measure, _ in watch:
                values[key].append(measure(run))
            for speed in SPEEDS:
                gross.setdefault(f"impacts_above_{speed:g}", []).append(rate(speed, "impacts")(run))
            duration, modulus = run.duration, run.modulus
    return Values(duration, modulus, values, gross)


def findings(hard, soft):
    """A Finding of each quantity; `hard`, `soft`: the files of the runs."""
    with contextlib.closing(Sampled(hard[0])) as run:
        watch = list(watched(run))
        hard, soft = values_of(hard, watch), values_of(soft, watch)
    found = []
    tiny = TINY * max(soft.values["kinetic_energy"] + hard.values["kinetic_energy"])
    for key, words, unit, _, matters in watch:
        both = soft.values[key] + hard.values[key]
        if not any(both) or (key == "rotational_energy" and max(both) < tiny):
            continue
        seen = min(sum(soft.values[key]), sum(hard.values[key])) * hard.duration
        sides = ([agreement.Estimate(value) for value in side.values[key]] for side in (soft, hard))
        one, other = agreement.from_replicates(*sides)
        off = agreement.difference(one, other, "")
        bound, impacts = math.nan, key in hard.gross
        if impacts and soft.modulus < STEEL and one.value:
            bound = sum(hard.gross[key]) / len(hard.gross[key]) / one.value - 1
        values = (other.value, one.value, off.relative, off.error, matters, bound, impacts and seen < RARE)
        found.append(Finding(key, words, unit, *values))
    return found


def sentence(found, modulus):
    """The finding in one sentence, and the verdict: holds, off, open, or "energy": impacts are off, the rest holds."""
    told = {one.key: f"{one.words} {one.told}" for one in found}
    state = {one.key: one.state for one in found if one.key in DECIDES and not one.rare}
    off, unknown = ([key for key in state if state[key] == what] for what in ("off", "open"))
    impacts = DECIDES[-1]
    stiff = f" (soft spheres of {stuff(modulus)})"
    stiffer = "" if modulus >= STEEL else ": stiffer ones can differ less (--modulus, --minutes)"
    every = ", ".join(told[key] for key in state)
    if not state:
        return "not decided: there is too little to compare", "open"
    if off == [impacts] and not unknown:
        rest = ", ".join(told[key] for key in state if key != impacts)
        words = f"hard spheres hold for power and energies of this mill, {rest}, and less for impacts: {told[impacts]}"
        return words + stiff + stiffer, "energy"
    if off:
        return f"hard spheres do not hold for this mill: {', '.join(told[key] for key in off)}{stiff}{stiffer}", "off"
    if unknown:
        why = ", ".join(told[key] for key in unknown)
        balls = "" if modulus >= STEEL else ", and stiffer balls (--modulus)"
        return f"not decided: {why}{stiff}: more starts (--starts, --minutes) tell{balls}", "open"
    return f"hard spheres hold for this mill: {every}{stiff}", "holds"


def lines(found):
    """The table in the terminal."""
    head = ("", "hard spheres", "soft spheres", "difference", "")
    words = {"holds": "agrees", "off": "differs", "open": "not known well enough", "rare": "too rare to compare"}
    rows = [
        (one.words, quantity(one.hard, one.unit), quantity(one.soft, one.unit), one.told, words[one.state])
        for one in found
    ]
    return columns([head, *rows], left=(0, 4))
