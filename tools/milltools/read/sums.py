"""Sums over all impacts of a run, such as the impacts above 1 mJ each second, with their standard errors.

The histograms of energy in the file give the sum. Its error comes from the same histograms of each start of the mill,
or, of fewer than SEVERAL starts, of short blocks of time of each.
"""

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from milltools.base.errors import UserError
from milltools.read.runfile import Run

BLOCKS = "statistics/energies/blocks"
OCTAVE = 4  # bins of the blocks from an energy to twice this energy
SORTS = ("normal", "total", "dissipated")  # energies of an impact
POINTS = 8  # at which a function of energy is taken within a bin
FEWEST = 36  # blocks that an error needs
PERIODS = 3  # of the motions, the same
PIECES = 8  # in which they are joined
SEVERAL = 4  # starts that an error needs
SEEN = 10  # impacts that an error needs
APART = -1  # as a period: each block is a start
ROUNDING = 1e-9
NORMAL = 1.96


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two bodies that meet: the kind of contact, the reduced mass [kg] and the reduced radius [m] (of the ball where it
    meets the mill), and the index of the classes of species in the arrays of the file."""

    kind: str
    mass: float
    radius: float
    index: tuple[int, ...]


Weight = Callable[[np.ndarray, Pair], np.ndarray]  # of energies [J] of impacts of a pair


def pairs(run: Run, kinds: Iterable[str] | None = None) -> Iterator[Pair]:
    """All pairs of species (if there are many, of classes of them) and surfaces of a run."""
    classes = run.classes
    masses = [one.mass for one in classes]
    for kind in run.kinds if kinds is None else kinds:
        for i, one in enumerate(classes):
            if kind != "ball_ball":
                yield Pair(kind, masses[i], one.diameter / 2, (i,))
                continue
            for j in range(i, len(classes)):
                radii = one.diameter / 2, classes[j].diameter / 2
                mass, radius = (a * b / (a + b) for a, b in ((masses[i], masses[j]), radii))
                yield Pair(kind, mass, radius, (i, j))


@dataclasses.dataclass(frozen=True)
class Sum:
    """A sum over impacts for each second of the window: its value, its value in each block of time (None: the file has
    no blocks), blocks in a period, the error that independent impacts would give, the number of impacts, and of how
    many starts the blocks are, one after the other."""

    value: float
    series: np.ndarray | None
    period: int
    least: float
    seen: float = math.inf
    starts: int = 1

    @property
    def error(self) -> float:
        """Standard error; NaN if the run is too short, its file has no blocks, or too few impacts were seen."""
        return self.spread[0]

    @property
    def spread(self) -> tuple[float, float]:
        """The error and its degrees of freedom."""
        if self.series is None or not self.value or self.seen < SEEN or few_saw(self.series, self.period):
            return math.nan, 0
        error, freedom = spread(self.series, self.period, self.starts)
        return (max(error, self.least), freedom) if error == error else (math.nan, 0)

    def over(self, other: "Sum") -> tuple[float, float, float]:
        """(value, standard error, degrees of freedom) of this sum divided by another one of the same run."""
        if not other.value:
            return math.nan, math.nan, 0
        ratio = self.value / other.value
        # no error of this sum: no blocks, too few impacts, or few starts have seen them
        if math.isnan(self.error) or other.series is None:
            return ratio, math.nan, 0
        error, freedom = spread(self.series - ratio * other.series, self.period, self.starts)
        return ratio, error / abs(other.value), freedom


def total(run: Run, weight: Weight, energy: str = "normal", kinds: Iterable[str] | None = None) -> Sum:
    """The sum of weight(energy of the impact) over all impacts of some `kinds` (default: all), for each second of the
    window; `energy`: one of SORTS. In a bin the impacts are taken to be evenly spread over the logarithm of energy."""
    place = "statistics/energies"
    if not run.has(f"{place}/edges"):
        raise UserError(f"{run.path}: has no energies of impacts: an older version or another program wrote it")
    run.need_statistics()
    value, squares, seen, series = 0.0, 0.0, 0.0, None
    points = _points(run.read(f"{place}/edges"))
    known = has_errors(run)
    coarse = _points(run.read(f"{BLOCKS}/edges")) if known else None
    read = functools.lru_cache(2)(run.read)  # the pairs of a kind follow each other
    for pair in pairs(run, kinds):
        count = read(f"{place}/{pair.kind}/{energy}")[pair.index]
        weights = np.mean(weight(points, pair), axis=1)
        value += float(count @ weights)
        squares += float(count @ weights**2)
        seen += float(count @ (weights > 0))
        if known:
            rows = read(f"{BLOCKS}/{pair.kind}/{energy}")[(slice(None), *pair.index)]
            part = rows @ np.mean(weight(coarse, pair), axis=1)
            series = part if series is None else series + part
    time = run.duration
    if series is None:
        return Sum(value / time, None, 0, math.sqrt(squares) / time, seen)
    length = float(run.read(f"{BLOCKS}/duration"))
    return Sum(value / time, series / length, period(run), math.sqrt(squares) / time, seen, few(run))


def carrying(run: Run, share: float, energy: str = "normal") -> float:
    """The energy [J] above which impacts bring this share of the energy that all bring; NaN without impacts."""
    points = _points(run.read("statistics/energies/edges"))
    count = sum(run.read(f"statistics/energies/{pair.kind}/{energy}")[pair.index] for pair in pairs(run))
    brought = (points * (count / POINTS)[:, None]).ravel()[::-1].cumsum()
    return float(points.ravel()[::-1][np.searchsorted(brought, share * brought[-1])]) if brought[-1] else math.nan


def few_saw(series: np.ndarray, period: int) -> bool:
    """Whether a few of several starts have seen most of the impacts, as in src/observe/spread.c."""
    least = min(len(series) / 2, SEVERAL)
    return period == APART and bool(series.sum() ** 2 < least * np.sum(series**2))


def has_errors(run: Run) -> bool:
    """Whether the file has what errors of sums follow from, and they would be right."""
    return run.has(f"{BLOCKS}/edges") and not run.doubt


def period(run: Run) -> int:
    """Blocks in a period of the motions, for `spread`; APART if each block is a start."""
    return APART if run.starts >= SEVERAL else int(run.read(f"{BLOCKS}/period"))


def few(run: Run) -> int:
    """Of how many starts the blocks are, one after the other, for `spread`."""
    return run.starts if run.starts < SEVERAL else 1


def per_work(run: Run, hard: Sum) -> tuple[float, float, float]:
    """(value [1/J], standard error, degrees of freedom) of impacts for each joule of work of the drive; where nothing
    drives the balls, for each joule that impacts lose. In the mean both are equal, so the relative error is that of the
    impacts divided by the losses, which varies less."""
    ratio, error, freedom = hard.over(total(run, itself, "dissipated"))
    power = run.statistic(f"{run.driven}/power") if run.driven else run.statistic("impacts/all/dissipated_power")
    value = hard.value / float(power) if power > 0 else math.nan
    # no better than the count of independent impacts, as in src/observe/tally_results.c
    relative = max(error / ratio, hard.least / hard.value) if hard.value and error == error else math.nan
    return value, value * relative, freedom


def errors(run: Run, edges: np.ndarray, kind: str, above: bool = False) -> np.ndarray:
    """Standard errors [1/s] of the rates of the impacts of a kind, or "all", whose normal energies are between the
    (n + 1,) edges [J]: (n,); `above`: at or above each edge, (n + 1,). NaN as in Sum.error. Needs the blocks."""
    blocks = "statistics/energies/blocks"
    points = _points(run.read(f"{blocks}/edges"))
    weights = np.zeros((len(points), len(edges) + 1))
    np.add.at(weights, (np.arange(len(points))[:, None], np.searchsorted(edges, points, side="right")), 1 / POINTS)
    weights = weights[:, :0:-1].cumsum(axis=1)[:, ::-1] if above else weights[:, 1:-1]
    kinds = run.kinds if kind == "all" else [kind]
    found = (run.read(f"{blocks}/{one}/normal") for one in kinds)
    rows = sum(counts.sum(axis=tuple(range(1, counts.ndim - 1))) for counts in found)
    series = rows @ weights / float(run.read(f"{blocks}/duration"))
    rates, least = series.mean(axis=0), SEEN / run.duration
    of = period(run), few(run)
    known = [rate >= least and not few_saw(x, of[0]) for x, rate in zip(series.T, rates)]
    found = [standard_error(x, *of) if good else math.nan for x, good in zip(series.T, known)]
    return np.maximum(found, np.sqrt(rates / run.duration))


def every(energy: np.ndarray, pair: Pair) -> np.ndarray:
    """Counts all impacts."""
    return np.ones_like(energy)


def itself(energy: np.ndarray, pair: Pair) -> np.ndarray:
    """Adds up the energies."""
    return energy


def above(least: float) -> Weight:
    """Counts impacts of this energy [J] or more; within a bin by its share of the logarithm of energy."""

    def weight(energy: np.ndarray, pair: Pair) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            part = energy[:, 1:2] / energy[:, :1]  # each point is in the middle of its part of the bin
            share = np.clip(np.log(energy / least) / np.log(part) + 0.5, 0, 1)
        return np.where(part > 1, share, energy >= least)

    return weight


def faster(least: float) -> Weight:
    """Counts impacts of this normal speed [m/s] or more."""
    return lambda energy, pair: above(pair.mass * least**2 / 2)(energy, pair)


def _points(edges: np.ndarray) -> np.ndarray:
    """Energies within each bin, evenly on the scale of logarithms: (bins, POINTS). Below the bins 0, above them the
    highest edge."""
    inner = np.log(edges[1:-1])
    shares = (np.arange(POINTS) + 0.5) / POINTS
    within = np.exp(inner[:-1, None] + np.diff(inner)[:, None] * shares)
    return np.vstack([np.zeros(POINTS), within, np.full(POINTS, edges[-2])])


def standard_error(x: np.ndarray, period: int, starts: int = 1) -> float:
    """The error of spread()."""
    return spread(x, period, starts)[0]


def spread(x: np.ndarray, period: int, starts: int = 1) -> tuple[float, float]:
    """Standard error of the mean of x, widened by Student's t so that +- 1.96 errors is the 95 % interval, and its
    degrees of freedom. APART: the values are independent. Else they are the stationary series of so many starts, one
    after the other; PIECES pieces of each are independent, and what repeats each `period` values (0: none) is not
    scatter. NaN: too few values. The same estimate as in src/observe/spread.c."""
    n = len(x) if period == APART else len(x) // starts
    if n < (SEVERAL if period == APART else max(FEWEST, PERIODS * period)):
        return math.nan, 0
    if period == APART:
        return _scatter(x)
    phases = max(period, 1)
    ends, pieces, shift = np.arange(PIECES + 1) * n // PIECES, [], 0.0
    for own in x.reshape(starts, n):
        means = np.array([own[phase::phases].mean() for phase in range(phases)])
        times = np.array([len(own[phase::phases]) for phase in range(phases)])
        shift += float(np.sum(means * times) / n - means.mean()) / starts
        rest = own - means[np.arange(n) % phases]
        pieces += [own.mean() + rest[a:b].mean() for a, b in itertools.pairwise(ends)]
    error, freedom = _scatter(np.array(pieces))
    share = 1 - 1 / (n // period) if period > 1 else 1.0
    return math.hypot(error / math.sqrt(share), shift), freedom


def _scatter(x: np.ndarray) -> tuple[float, float]:
    squares, count = float(np.sum((x - x.mean()) ** 2)), len(x)
    if not squares > (ROUNDING * x.mean()) ** 2:
        return 0.0, math.inf
    u, q = 1 / (count - 1), NORMAL**2
    fourth = ((((79 * q + 776) * q + 1482) * q - 1920) * q - 945) / 92160
    third = (((3 * q + 19) * q + 17) * q - 15) / 384
    widening = 1 + u * ((q + 1) / 4 + u * (((5 * q + 16) * q + 3) / 96 + u * (third + u * fourth)))
    return math.sqrt(squares / (count - 1) / count) * widening, count - 1
