"""What is compared of a run, read once; runs that are replicates of each other stand on one side."""

import math
import pathlib
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.compare import map_deviation as maps
from milltools.geometry import vessel
from milltools.read.runfile import Run, estimates

LEVELS = (0.1, 0.5, 0.9, 0.99)  # quantiles of the balls' speeds
SPEED_EDGES = np.geomspace(1e-4, 1e3, 7 * 40 + 1)  # [m/s]
MOST_BLOCKS = 64
MOST_STATES = 20_000_000  # ball states looked at: more frames than that are thinned out
USUAL = {"rad/s": ("rpm", 30 / math.pi), "rad": ("deg", 180 / math.pi)}
ENERGIES = ("kinetic_energy", "rotational_energy", "potential_energy", "elastic_energy")
# keys that may differ between replicates, and say nothing about what mill it is
OWN = re.compile(r"run\.seed|balls\.start|output\..*")
GEOMETRY = re.compile(r"(drum|blades|blade\.[^.]*|body\.[^.]*)\..*|rotor\.shaft_radius")


class Member:
    """One run: deck, facts, window, blocks of time, and everything the rows are made of. The file is closed again."""

    def __init__(self, path: str):
        with Run(path) as run:
            run.need_statistics()
            self.path = str(path)
            self.program, self.version, self.status = run.program, run.version, run.status
            self.command = run.read("run/command") if run.has("run/command") else ""
            self.notes = run.notes
            # of soft spheres: stiffness [Pa], duration of a contact [s]; NaN where a contact takes no time
            self.modulus, self.contact_duration = (
                float(run.read(f"run/{name}")) if run.has(f"run/{name}") else math.nan
                for name in ("modulus", "contact_duration")
            )
            self.deck, self.time, self.cost = run.deck(), run.time, run.cost
            self.rotor_speed, self.period, self.kinds = run.rotor_speed, run.period, run.kinds
            self.vessel = vessel.of(run)
            self.drive, self.motions = run.driven or "rotor", run.motions
            self.turn = "revolution" if self.drive == "rotor" else "period"
            self.duration, self.window = run.duration, run.window
            self._load_series(run)
            self._load_impacts(run)
            self._cut()
            self._load_balls(run)
        self.trend = self._trend()

    # ---- reading

    def _load_series(self, run):
        names = [*ENERGIES, "rotor_work"] + [
            f"{what}/{kind}"
            for what in ("dissipation", "dissipation_normal", "collisions", "fast_collisions")
            for kind in run.kinds
        ]
        names += [f"motion_work/{name}" for name in run.motions]
        self.series = {name: run.series(name) for name in names if run.has_series(name)}
        self.series["drive_work"] = run.drive_work()
        for name in ("kinetic_energy", "rotor_work"):
            if name not in self.series or len(self.series[name][0]) < 2:
                raise UserError(f"{run.path}: its time series /observables/{name} is missing or too short")

    def _load_impacts(self, run):
        rows = (*run.kinds, "all")
        self.impacts = {row: run.histogram(row) for row in rows}
        self.strikes = {row: run.histogram(row, "strikes") for row in run.kinds}
        self.medians = {
            (row, name): float(run.statistic(f"impacts/{row}/normal_speed/{name}"))
            for row in rows
            for name in ("median", "median_above_50mm_s")
        }
        self.known = {name: run.known(name) for name in estimates(run.kinds)}

    def _load_balls(self, run):
        """Maps, and what the frames within the window say about speeds and the maps' noise."""
        times = run.frame_times()
        first, last = self.span
        inside = np.flatnonzero((times >= first - 1e-9) & (times <= last + 1e-9))
        balls = len(run.balls("diameter"))
        inside = inside[:: max(1, math.ceil(balls * len(inside) / MOST_STATES))]
        block = np.clip(np.searchsorted(self.edges, times[inside], "right") - 1, 0, self.blocks - 1)
        self.maps = maps.StoredMaps(run)
        scatter = maps.Scatter(run, self.vessel, self.blocks)
        self.speed_counts = np.zeros(len(SPEED_EDGES) - 1)
        measures = np.zeros((len(inside), 2 + len(LEVELS)))
        for row, (index, part) in enumerate(zip(inside, block)):
            velocity = run.frame(int(index), "velocity").astype(float)
            speed = np.linalg.norm(velocity, axis=1)
            measures[row] = speed.mean(), (speed**2).mean(), *np.quantile(speed, LEVELS)
            self.speed_counts += np.histogram(speed, SPEED_EDGES)[0]
            scatter.add(int(part), run.frame(int(index), "position").astype(float), velocity)
        self.speeds, self.speed_blocks = measures, block
        self.map_noise, self.map_frames = scatter.noise(self.maps), len(inside)

    # ---- blocks of time

    def _cut(self):
        """Blocks within the part of the window that the series cover."""
        time = self.series["rotor_work"][0]
        first, last = max(self.window[0], time[0]), min(self.window[1], time[-1])
        rows = int(np.sum((time >= first) & (time <= last)))
        self.span = (first, last)
        turn = self.period
        turns = int((last - first) / turn * (1 + 1e-9))
        if turns >= 4:
            each = math.ceil(turns / MOST_BLOCKS)
            self.edges = first + turn * np.arange(0, turns + 1, each)
            self.cut = f"{turns // each} blocks of {each} {self.turn}{'s'[: each > 1]}"
        elif rows >= 9 and last > first:
            count = 10 if math.isinf(turn) and rows >= 41 else 4
            self.edges = np.linspace(first, last, count + 1)
            self.cut = f"{count} equal blocks of {(last - first) / count:.4g} s"
        else:
            self.edges = np.array([first, last])
            self.cut = "no blocks: too few rows of the time series"
        self.blocks = len(self.edges) - 1

    def rates(self, name: str, column: int | None = None):
        """Rate of a cumulative series: (over the whole span, (K,) by block)."""
        time, value = self.series[name]
        value = value if column is None else value[:, column]
        at = np.interp([*self.span, *self.edges], time, value)
        span = self.span[1] - self.span[0]
        return (at[1] - at[0]) / span if span > 0 else math.nan, np.diff(at[2:]) / np.diff(self.edges)

    def means(self, name: str):
        """Mean of an instantaneous series: (over the span, (K,) by block), from the trapezoidal rule."""
        time, value = self.series[name]
        steps = np.diff(time) * (value[1:] + value[:-1]) / 2
        total = np.concatenate([[0], np.cumsum(steps)])
        at = np.interp([*self.span, *self.edges], time, total)
        span = self.span[1] - self.span[0]
        return (at[1] - at[0]) / span if span > 0 else math.nan, np.diff(at[2:]) / np.diff(self.edges)

    def value_at(self, name: str, time: float) -> float:
        return float(np.interp(time, *self.series[name]))

    def speed_blocks_of(self, column: int) -> np.ndarray:
        """Block means of a column of `speeds`; NaN in a block without frames."""
        count = np.bincount(self.speed_blocks, minlength=self.blocks)
        with np.errstate(invalid="ignore"):
            return np.bincount(self.speed_blocks, self.speeds[:, column], self.blocks) / count

    @property
    def made_by(self) -> str:
        """Program, version and stiffness in a few words."""
        name = self.version if self.program in self.version else f"{self.program} {self.version}"
        return name + (f" at {self.modulus:.3g} Pa" if self.modulus > 0 else "")

    def same_data(self, other) -> bool:
        """Whether the other is the same run: every row of the time series is equal."""
        return self.series.keys() == other.series.keys() and all(
            np.array_equal(value, other.series[name][1]) for name, (_, value) in self.series.items()
        )

    # ---- is it steady?

    def _trend(self) -> str:
        """Why the run is not steady over its window; empty if it is."""
        energy = {n: [self.value_at(n, t) for t in self.span] for n in ENERGIES if n in self.series}
        change = abs(sum(e[1] - e[0] for e in energy.values()))
        work = [self.value_at("drive_work", t) for t in self.span]
        turned = max(abs(work[1] - work[0]), change)
        # a gas that nothing drives keeps its energy to rounding: no change of 1 % of it, no trend
        if change > max(0.05 * turned, 0.01 * abs(self.means("kinetic_energy")[0])):
            return (
                f"energy of the balls changes by {change:.3g} J while the {self.drive} does {work[1] - work[0]:.3g} J"
            )
        time, value = self.series["kinetic_energy"]
        inside = value[(time >= self.span[0]) & (time <= self.span[1])]
        if len(inside) < 16:
            return ""
        parts = np.array([p.mean() for p in np.array_split(inside, 16)])
        start, rest = parts[:4].mean(), parts[4:]
        off = abs(start - rest.mean())
        if off > 0.05 * abs(rest.mean()) and off > 3 * rest.std(ddof=1):
            share = off / abs(rest.mean())
            return f"kinetic energy in the first quarter is {100 * share:.0f} % off the rest"
        return ""

    @property
    def steady(self) -> bool:
        return not self.trend


class Side:
    """One run or several replicates of it, under a letter."""

    def __init__(self, letter: str, runs: list[Member]):
        self.letter, self.runs = letter, runs
        self.first = runs[0]
        name = pathlib.PurePath(self.first.path).name.removesuffix(".h5")
        self.name = name + (f" and {len(runs) - 1} more" if len(runs) > 1 else "")
        for other in runs[1:]:
            _check_replicate(self.first, other)
        seen = [(r.program, r.version, r.deck.get("run.seed"), r.deck.get("balls.start")) for r in runs]
        for run, key in zip(runs, seen):
            if seen.count(key) > 1:
                raise UserError(f"{run.path}: seed and start of another replicate: it tells nothing new")

    @property
    def label(self) -> str:
        return f"{self.letter}: {self.name}"

    @property
    def soft(self) -> bool:
        """Not by millsim, so contacts take time and re-contacts of a pair merge."""
        return any(r.program != "millsim" for r in self.runs)

    @property
    def steady(self) -> bool:
        return all(r.steady for r in self.runs)

    def mean_map(self, name: str, view: str) -> np.ndarray:
        return np.mean([r.maps.get(view, name) for r in self.runs], axis=0)


def usual(text: str) -> str:
    """A value of a deck as decks are written: angles in degrees, speeds in rpm, numbers without the noise of their last digit."""
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


def _check_replicate(first: Member, other: Member):
    if first.program != other.program:
        raise UserError(f"{other.path}: by {other.program}, so no replicate of {first.path}, by {first.program}")
    for key in different_keys(first.deck, other.deck):
        if not OWN.fullmatch(key):
            raise UserError(
                f"{other.path}: no replicate of {first.path}: {key} is {usual(other.deck.get(key, 'absent'))}, "
                f"not {usual(first.deck.get(key, 'absent'))}"
            )
    if not math.isclose(first.duration, other.duration, rel_tol=1e-6):
        raise UserError(
            f"{other.path}: no replicate of {first.path}: it sampled {other.duration:.6g} s, not {first.duration:.6g} s"
        )


def replicates(argument: str) -> list[str]:
    """The files of one side; a name that has a comma in it is taken whole if there is such a file."""
    if pathlib.Path(argument).exists():
        return [argument]
    files = [name for name in argument.split(",") if name]
    if not files:
        raise UserError(f"'{argument}' names no file")
    return files


def sides(files: list[list[str]]) -> list[Side]:
    """Reads every run; letters from A on."""
    if len(files) > 26:
        raise UserError(f"{len(files)} runs at a time are more than can be told apart: 26 at most")
    return [Side(chr(ord("A") + k), [Member(f) for f in names]) for k, names in enumerate(files)]
