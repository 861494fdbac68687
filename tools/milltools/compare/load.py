"""The data of a run that are compared, read once. Replicates of one run form one side of the comparison."""

import math
import pathlib
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plural
from milltools.compare import map_deviation as maps
from milltools.compare.agreement import Starts
from milltools.geometry import vessel
from milltools.geometry.trajectory import stored
from milltools.read import sums
from milltools.read.runfile import FORMS, Run

LEVELS = (0.1, 0.5, 0.9, 0.99)  # quantiles of the balls' speeds
SPEED_EDGES = np.geomspace(1e-4, 1e3, 7 * 40 + 1)  # [m/s]
MOST_BLOCKS = 64
MOST_STATES = 20_000_000  # ball states that are read; of more states, frames are left out evenly
USUAL = {"rad/s": ("rpm", 30 / math.pi), "rad": ("deg", 180 / math.pi)}
# keys that may differ between replicates: they do not describe the mill
OWN = re.compile(r"run\.seed|balls\.start|output\..*")
# keys that say how a mill is run and observed, not which mill it is
CONDUCT = re.compile(r"(run|output|soft)\..*|balls\.start(_motion)?")
GEOMETRY = re.compile(r"(drum|blades|blade\.[^.]*|body\.[^.]*)\..*|rotor\.shaft_radius")


class Sampled(Run):
    """One open run: its window in blocks of time, and why it is not steady ("" if it is)."""

    def __init__(self, path: str):
        super().__init__(path)
        self.need_statistics()
        if not self.has_series("kinetic_energy") or len(self.series("kinetic_energy")[0]) < 2:
            raise UserError(f"{self.path}: its time series /observables/kinetic_energy is missing or too short")
        self._cut()
        self.trend = self._trend()
        self.steady = not self.trend

    # ---- blocks of time

    def _cut(self):
        """Cuts the part of the window that the time series cover into blocks."""
        time = self.series("kinetic_energy")[0]
        first, last = max(self.window[0], time[0]), min(self.window[1], time[-1])
        rows = int(np.sum((time >= first) & (time <= last)))
        self.span = (first, last)
        turn = self.period
        turns = int((last - first) / turn * (1 + 1e-9))
        if turns >= 4:
            each = math.ceil(turns / MOST_BLOCKS)
            self.bounds = first + turn * np.arange(0, turns + 1, each)
            what = "revolution" if self.drive == "rotor" else "period"
            self.cut = f"{turns // each} blocks of {plural(each, what)}"
        elif rows >= 9 and last > first:
            count = 10 if math.isinf(turn) and rows >= 41 else 4
            self.bounds = np.linspace(first, last, count + 1)
            self.cut = f"{count} equal blocks of {(last - first) / count:.4g} s"
        else:
            self.bounds = np.array([first, last])
            self.cut = "no blocks: too few rows of the time series"
        self.cut = f"{self.starts} starts" if self.starts >= sums.SEVERAL else self.cut
        self.blocks = len(self.bounds) - 1

    def series(self, name: str):
        """A time series as Run gives it; "drive_work" is the work of all motions."""
        return self.drive_work() if name == "drive_work" else super().series(name)

    def _starts(self, name: str, column: int | None = None):
        """(mean, value of each start) of what a series of this name gives; None if it is of the first start only."""
        group, _, kind = name.partition("/")
        own = {
            "drive_work": "drive_power", "rotor_work": "power/rotor", "motion_work": f"power/{kind}",
            "dissipation": f"dissipated_power/{kind}", "dissipation_normal": f"dissipated_power_normal/{kind}",
            "collisions": f"rate/{kind}", "fast_collisions": f"fast_rate/{kind}",
            "kinetic_energy": name, "rotational_energy": name,
        }.get(group)  # fmt: skip
        if self.starts == 1 or not own or not self.has(f"starts/{own}"):
            return None
        value = self.read(f"starts/{own}").astype(float).view(Starts)
        value = value if column is None else value[:, column]
        return float(value.mean()), value

    def rates(self, name: str, column: int | None = None):
        """Rate of a cumulative series: (over the whole span, (K,) by block), or of all starts."""
        if (found := self._starts(name, column)) and self.starts >= sums.SEVERAL:
            return found
        time, value = self.series(name)
        return self._rates(time, value if column is None else value[:, column], found)

    def means(self, name: str):
        """Mean of an instantaneous series: (over the span, (K,) by block), from the trapezoidal rule; or of all
        starts."""
        if (found := self._starts(name)) and self.starts >= sums.SEVERAL:
            return found
        time, value = self.series(name)
        steps = np.diff(time) * (value[1:] + value[:-1]) / 2
        return self._rates(time, np.concatenate([[0], np.cumsum(steps)]), found)

    def _rates(self, time, total, few):
        """`few`: the mean of a few starts, of which only the first has series: its blocks show the scatter."""
        at = np.interp([*self.span, *self.bounds], time, total)
        span = self.span[1] - self.span[0]
        rate, blocks = (at[1] - at[0]) / span if span > 0 else math.nan, np.diff(at[2:]) / np.diff(self.bounds)
        return (few[0], blocks + few[0] - rate) if few else (rate, blocks)

    # ---- is it steady?

    def _trend(self) -> str:
        """Why the run is not steady over its window; empty if it is. Several starts tell more than this series of the
        first one."""
        if self.starts >= sums.SEVERAL:
            return "its starts drift all in one direction" if self.doubt == "not settled" else ""
        energies = [np.interp(self.span, *self.series(n)) for n in FORMS if self.has_series(n)]
        change = abs(sum(end - begin for begin, end in energies))
        work = float(np.diff(np.interp(self.span, *self.series("drive_work")))[0])
        turned = max(abs(work), change)
        # without a drive the energy stays constant but for rounding: a change below 1 % is not a trend
        if change > max(0.05 * turned, 0.01 * abs(self.means("kinetic_energy")[0])):
            return f"energy of the balls changes by {change:.3g} J while the {self.drive} does work of {work:.3g} J"
        time, value = self.series("kinetic_energy")
        inside = value[(time >= self.span[0]) & (time <= self.span[1])]
        if len(inside) < 16:
            return ""
        parts = np.array([p.mean() for p in np.array_split(inside, 16)])
        start, rest = parts[:4].mean(), parts[4:]
        off = abs(start - rest.mean())
        if off > 0.05 * abs(rest.mean()) and off > 3 * rest.std(ddof=1):
            share = off / abs(rest.mean())
            return f"kinetic energy in the first quarter differs from the rest by {100 * share:.0f} %"
        return ""


class Member(Sampled):
    """One of the runs that are compared: with the speeds and the noise of the maps from its frames."""

    def __init__(self, path: str):
        super().__init__(path)
        self.container = vessel.of(self)
        self._load_balls()

    def _load_balls(self):
        """The speeds of the balls and the noise of the maps, from the frames within the window."""
        times = self.frame_times()
        first, last = self.span
        inside = np.flatnonzero((times >= first - 1e-9) & (times <= last + 1e-9))
        radius = self.balls("diameter").astype(float) / 2
        inside = inside[:: max(1, math.ceil(len(radius) * len(inside) / MOST_STATES))]
        block = np.clip(np.searchsorted(self.bounds, times[inside], "right") - 1, 0, self.blocks - 1)
        parts = [self.container.noise for _ in range(self.blocks)]
        self.speed_counts = np.zeros(len(SPEED_EDGES) - 1)
        measures = np.zeros((len(inside), 2 + len(LEVELS)))
        for row, (index, part) in enumerate(zip(inside, block)):
            velocity = self.frame(int(index), "velocity").astype(float)
            speed = stored(self, int(index)).speed
            measures[row] = speed.mean(), (speed**2).mean(), *np.quantile(speed, LEVELS)
            self.speed_counts += np.histogram(speed, SPEED_EDGES)[0]
            if parts[part]:
                parts[part].sample(self.frame(int(index), "position").astype(float), velocity, radius)
        self.speeds, self.speed_blocks = measures, block
        self.map_noise, self.map_frames = maps.noise(self, parts), len(inside)

    def speed_blocks_of(self, column: int) -> np.ndarray:
        """Block means of a column of `speeds`; NaN in a block without frames."""
        count = np.bincount(self.speed_blocks, minlength=self.blocks)
        with np.errstate(invalid="ignore"):
            return np.bincount(self.speed_blocks, self.speeds[:, column], self.blocks) / count

    @property
    def made_by(self) -> str:
        """Program, version and, of soft spheres, stiffness in a few words."""
        name = self.version if self.program in self.version else f"{self.program} {self.version}"
        modulus = self.modulus
        return name + (f" at {modulus:.3g} Pa" if modulus > 0 else "")

    def same_data(self, other) -> bool:
        """Whether the other is the same run: every row of the time series is equal."""
        names = self.series_names()
        return names == other.series_names() and all(
            np.array_equal(self.series(name)[1], other.series(name)[1]) for name in names
        )


class Side:
    """One run or several replicates of it, named by a letter."""

    def __init__(self, letter: str, runs: list[Member]):
        self.letter, self.runs = letter, runs
        self.first = runs[0]
        more = f" and {len(runs) - 1} more" if len(runs) > 1 else ""
        self.name = pathlib.PurePath(self.first.path).name.removesuffix(".h5")
        self.label = f"{letter}: {self.name}{more}"
        self.steady = all(run.steady for run in runs)
        # contacts take time, and re-contacts of a pair merge
        self.soft = any(run.soft for run in runs)
        for other in runs[1:]:
            _check_replicate(self.first, other)
        seen = [(r.program, r.version, r.text("run/seed", ""), r.text("balls/start", "")) for r in runs]
        for run, key in zip(runs, seen):
            if seen.count(key) > 1:
                raise UserError(f"{run.path}: same seed and start as another replicate: it adds no information")

    def mean_map(self, name: str, view: str, cells=None) -> np.ndarray:
        """The mean map of the runs, in their own cells or brought to other ones."""
        return np.mean([maps.brought(r, view, name, maps.stored(r, view, name), cells) for r in self.runs], axis=0)


def usual(text: str) -> str:
    """A value as people write it in a deck: angles in degrees, speeds in rpm, numbers without rounding noise in the
    last digit."""
    words = text.split()
    name, scale = USUAL.get(words[-1] if words else "", ("", 1.0))

    def short(word):
        try:
            number = float(word) * scale
        except ValueError:
            return word
        return word if name == "" and word.isdigit() else f"{number:.12g}"

    return " ".join([*map(short, words[:-1]), name] if name else map(short, words))


def different_keys(a: dict, b: dict) -> list[str]:
    """Keys of two decks with different values, in the order of the first, then what only the second has."""
    shown = [{key: usual(value) for key, value in deck.items()} for deck in (a, b)]
    return [key for key in dict.fromkeys([*a, *b]) if shown[0].get(key) != shown[1].get(key)]


def designs(a: Side, b: Side) -> bool:
    """Whether the sides are two designs: mills of one program whose decks describe different mills. Else they are the
    same mill by two programs or from other starts, and the question is whether they agree."""
    keys = different_keys(a.first.deck(), b.first.deck())
    return a.first.program == b.first.program and not all(map(CONDUCT.fullmatch, keys))


def _check_replicate(first: Member, other: Member):
    no_replicate = f"{other.path}: not a replicate of {first.path}:"
    if first.program != other.program:
        raise UserError(f"{other.path}: not a replicate of {first.path}: by {other.program}, not by {first.program}")
    decks = first.deck(), other.deck()
    for key in different_keys(*decks):
        if not OWN.fullmatch(key):
            wanted, found = (usual(deck.get(key, "absent")) for deck in decks)
            raise UserError(f"{no_replicate} {key} is {found}, not {wanted}")
    if not math.isclose(first.duration, other.duration, rel_tol=1e-6):
        raise UserError(f"{no_replicate} it sampled {other.duration:.6g} s, not {first.duration:.6g} s")


def replicates(argument: str) -> list[str]:
    """The files of one side; a name with a comma counts as one name if such a file exists."""
    if pathlib.Path(argument).exists():
        return [argument]
    files = [name for name in argument.split(",") if name]
    if not files:
        raise UserError(f"'{argument}' contains no file name")
    return files


def sides(files: list[list[str]]) -> list[Side]:
    """Reads every run; letters from A on."""
    if len(files) > 26:
        raise UserError(f"{len(files)} runs are too many to compare: at most 26")
    found = [Side(chr(ord("A") + k), [Member(f) for f in names]) for k, names in enumerate(files)]
    if len({side.name for side in found}) < len(found):  # then the letters tell them apart
        for side in found:
            side.name = side.letter
    return found
