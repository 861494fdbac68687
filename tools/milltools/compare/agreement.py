"""How sure is a number, and do two numbers agree?

Values that the file gives with a standard error are taken from there: rotor power, medians, rates. For all others
(energies, losses, speeds of balls, and files of programs that give no error) a run is cut into K blocks of time (whole
revolutions if there are enough). The scatter of the block means gives the standard error of the mean, with Student's t
because blocks may be few. Correlated neighbouring blocks contain less information than independent ones. With eight
blocks or more the lag-1 correlation r is estimated (corrected for its bias of -1/K); a positive r makes the error
larger, as in a first-order autoregressive series: K -> K (1-r)/(1+r). With fewer blocks r cannot be distinguished from
noise, and the blocks are taken as independent.

The blocks of a transient are not samples of one mean. Only replicates (other seeds) give the error of a transient.
"""

import dataclasses
import functools
import math
import statistics
import typing

import numpy as np

from milltools.read import sums

NORMAL = 1.96  # errors in files are scaled so that +- this multiple of them is the 95 % interval
CONFIDENCE = 0.99  # two-sided: of equal runs, one row in a hundred gets the verdict "differ"
FEWEST_FOR_CORRELATION = 8
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
COARSE = 0.10  # the verdict is "undecided" if this relative difference would not be noticed


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A value, its standard error from the scatter (NaN: unknown) with its degrees of freedom, and a remark.
    `pooled`: both sides share one estimate of the scatter, so they also share its degrees of freedom."""

    value: float
    error: float = math.nan
    dof: float = 0.0
    remark: str = ""
    pooled: bool = False

    @property
    def told(self) -> float:
        """The standard error as millsim writes it: scaled so that value +- 1.96 errors is the 95 % interval."""
        return self.error * _widening(self.dof) if math.isfinite(self.error) else math.nan


def _widening(dof: float) -> float:
    """Student's quantile for 95 % divided by the quantile of the normal distribution."""
    return student(dof, 0.975) / NORMAL if math.isfinite(dof) else 1.0


@functools.lru_cache(4096)
def student(freedom: float, share: float) -> float:
    """The quantile of Student's t with `freedom` >= 1 for a probability of 0.5 to 1; NaN for less freedom.

    With t = sqrt(freedom) tan(angle) the density is cos(angle)**(freedom - 1). It decreases, so Newton's steps from 0
    never go beyond the root.
    """
    if not freedom >= 1:
        return math.nan
    if freedom > 1e5:  # the logarithms of gamma below cancel; the next term of this series is of order 1/freedom**2
        z = statistics.NormalDist().inv_cdf(share)
        return z + (z**3 + z) / (4 * freedom)
    quarter = math.sqrt(math.pi) / 2 * math.exp(math.lgamma(freedom / 2) - math.lgamma((freedom + 1) / 2))
    angle = 0.0
    for _ in range(100):
        density = np.cos(angle * (1 + NODES) / 2) ** (freedom - 1)
        step = ((2 * share - 1) * quarter - angle / 2 * WEIGHTS @ density) / math.cos(angle) ** (freedom - 1)
        angle += step
        if abs(step) <= 1e-14 * angle:
            break
    return math.sqrt(freedom) * math.tan(angle)


def lag_correlation(blocks: np.ndarray) -> float:
    """Correlation of neighbouring blocks, corrected for bias, within 0..0.9; 0 if there are too few blocks."""
    count = len(blocks)
    off = blocks - blocks.mean()
    power = float(off @ off)
    if count < FEWEST_FOR_CORRELATION or power == 0:
        return 0.0
    return float(np.clip(off[1:] @ off[:-1] / power + 1 / count, 0, 0.9))


class Starts(np.ndarray):
    """Values of several starts of a run, which are independent, in place of those of blocks of time."""


def from_blocks(value: float, blocks: np.ndarray, remark: str = "") -> Estimate:
    """A mean over the window with its error from the block means, or from the values of Starts."""
    apart, blocks = isinstance(blocks, Starts), np.asarray(blocks, float)
    if apart and len(blocks) < sums.SEVERAL:
        return Estimate(value, remark=remark)
    if len(blocks) < 2 or not np.all(np.isfinite(blocks)):
        return Estimate(value, remark=remark)
    r = 0.0 if apart else lag_correlation(blocks)
    effective = len(blocks) * (1 - r) / (1 + r)
    error = float(np.std(blocks, ddof=1)) / math.sqrt(effective)
    return Estimate(value, error, max(effective - 1, 1.0), remark)


def from_file(known: tuple[float, float, float] | None) -> Estimate | None:
    """(value, standard error, degrees of freedom) from the file of a run; None if the file has none. The file's error
    is scaled by Student's t at 95 %; the scaling is removed here, for other levels and for differences."""
    if known is None:
        return None
    value, error, freedom = known
    if not math.isfinite(error):
        return Estimate(value)
    return Estimate(value, error / _widening(freedom), freedom)


def mean_of(estimates: list[Estimate]) -> Estimate:
    """Mean of independent estimates, from their own errors."""
    values = [e.value for e in estimates]
    value, errors = float(np.mean(values)), np.array([e.error for e in estimates])
    remark = next((e.remark for e in estimates if e.remark), "")
    if not np.all(np.isfinite(errors)):
        return Estimate(value, remark=remark)
    variance = float(np.sum(errors**2)) / len(errors) ** 2
    return Estimate(value, math.sqrt(variance), _welch(errors, estimates), remark)


def _welch(errors, estimates) -> float:
    """Welch and Satterthwaite's degrees of freedom of a sum."""
    fourth = sum(err**4 / e.dof for err, e in zip(errors, estimates) if math.isfinite(e.dof))
    return float(np.sum(errors**2)) ** 2 / fourth if fourth > 0 else math.inf


def from_replicates(first: list[Estimate], second: list[Estimate]) -> tuple[Estimate, Estimate]:
    """The means of both sides, with errors from the scatter between replicates. The relative scatter is assumed to be
    the same on both sides and is pooled: a side with one run gets its error from the other side. A side of zeros has no
    error, and the other one has its own."""
    sides = [np.array([e.value for e in side]) for side in (first, second)]
    means = [float(values.mean()) for values in sides]
    counted = [(v, m) for v, m in zip(sides, means) if v.any()]
    freedom = sum(len(v) - 1 for v, _ in counted)
    if freedom < 1 or not all(math.isfinite(m) and m != 0 for _, m in counted):
        return Estimate(means[0]), Estimate(means[1])
    scatter = math.sqrt(sum(float(np.sum((v / m - 1) ** 2)) for v, m in counted) / freedom)
    return tuple(
        Estimate(m, scatter * abs(m) / math.sqrt(len(v)), freedom, "error from replicates", True)
        if v.any()
        else Estimate(m)
        for v, m in zip(sides, means)
    )


def combine(first: list[Estimate], second: list[Estimate], steady: bool):
    """The estimates of both sides: from replicates if a run is not steady or if the replicates leave three degrees of
    freedom or more, else from blocks."""
    freedom = len(first) + len(second) - 2
    if not steady or freedom >= 3:
        return from_replicates(first, second)
    return mean_of(first), mean_of(second)


class Difference(typing.NamedTuple):
    """B - A relative to A, its relative standard error (scaled as in files; NaN: unknown, or B has none), and the
    verdict with its `mood`: "agree", "differ" or "open"; of two designs "tied", "apart" or "open"."""

    relative: float
    error: float
    dof: float
    verdict: str
    mood: str


def _beside(one: Estimate, other: Estimate) -> Estimate:
    """Nothing was counted, so there is no error: exact beside a value that is certainly not zero."""
    none = one.value == 0 and not math.isfinite(one.error) and abs(other.value) > NORMAL * other.told
    return dataclasses.replace(one, error=0.0, dof=math.inf) if none else one


def difference(a: Estimate, b: Estimate, unknown: str, designs: bool = False) -> Difference:
    """Compares two estimates; `unknown` is the verdict if an error is not known. Of two programs (or seeds) it is
    tested at CONFIDENCE whether chance explains the difference. Two `designs` are expected to differ: the verdict says
    which value is higher, or that the 95 % interval of the difference contains zero."""
    a, b = _beside(a, b), _beside(b, a)
    scale = abs(a.value) or math.nan
    off = b.value - a.value
    errors = np.array([a.error, b.error])
    error = math.hypot(*errors)
    if not (math.isfinite(off) and math.isfinite(error) and error):
        return Difference(off / scale, math.nan, 0, unknown if math.isfinite(off) else "no value", "open")
    # of B/A: both errors count, the error of A times B/A
    share = np.array([a.error * b.value / scale, b.error]) if a.value and b.value else errors
    dof = a.dof if a.pooled else float(_welch(share, [a, b]))
    told = math.hypot(*share) * _widening(dof)
    freedom = a.dof if a.pooled else float(_welch(errors, [a, b]))
    reach = student(freedom, 0.5 + CONFIDENCE / 2) * error  # the largest difference that chance explains
    if designs and abs(a.value) > NORMAL * a.told:
        reach = NORMAL * told
    elif designs:  # a share of what may be zero says nothing
        scale = math.nan
    if abs(off) > reach:
        words = ("higher" if off > 0 else "lower") if designs else f"differ by {abs(off) / told:.1f} standard errors"
        verdict, mood = words, "apart" if designs else "differ"
    elif not reach < COARSE * scale:
        verdict, mood = "undecided: error too large", "open"
    else:
        verdict, mood = ("tied", "tied") if designs else ("agree", "agree")
    return Difference(off / scale, told / scale if b.value else math.nan, dof, verdict, mood)
