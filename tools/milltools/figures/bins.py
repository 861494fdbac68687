"""Impacts by speed or energy in bins that are wide enough to draw; they contain all impacts of the file."""

import dataclasses

import numpy as np

MERGED = 8  # bins of the file per bin here: 14.6 per decade of speed; 0.05, 1 and 20 m/s stay edges


@dataclasses.dataclass(frozen=True)
class Bins:
    """Impacts of one kind in a window: `edges` (n + 1,) of speed [m/s] or energy [J], `count` (n,), `dissipation` (n,)
    [J], number and dissipation `below` the first and `above` the last edge, `duration` of the window [s], and the
    `part` of the dissipation that is known for single impacts, "all" or "normal"."""

    edges: np.ndarray
    count: np.ndarray
    dissipation: np.ndarray
    below: tuple[float, float]  # number, energy [J]
    above: tuple[float, float]
    duration: float
    part: str = "all"

    @property
    def total(self) -> float:
        """Number of impacts, including those outside the bins."""
        return float(self.count.sum()) + self.below[0] + self.above[0]

    @property
    def rate(self) -> float:
        """Impacts per second [1/s], including those outside the bins."""
        return self.total / self.duration

    @property
    def power(self) -> float:
        """Dissipated power [W], including the impacts outside the bins."""
        return (float(self.dissipation.sum()) + self.below[1] + self.above[1]) / self.duration

    @property
    def middle(self) -> np.ndarray:
        """(n,) geometric middles of the bins."""
        return np.sqrt(self.edges[:-1] * self.edges[1:])

    @property
    def decades(self) -> np.ndarray:
        """(n,) widths of the bins in decades."""
        return np.diff(np.log10(self.edges))

    @property
    def rate_density(self) -> np.ndarray:
        """(n,) impacts per second and decade [1/s]."""
        return self.count / self.duration / self.decades

    @property
    def power_density(self) -> np.ndarray:
        """(n,) dissipated power per decade [W]."""
        return self.dissipation / self.duration / self.decades

    @property
    def exceedance(self) -> np.ndarray:
        """(n + 1,) impacts per second at or above each edge [1/s]."""
        above = np.concatenate([np.cumsum(self.count[::-1])[::-1], [0]]) + self.above[0]
        return above / self.duration


def merged(histogram, duration: float, together: int = MERGED) -> Bins:
    """A histogram of the file with `together` bins merged into one; the last bin can be narrower."""
    first = np.arange(0, len(histogram.count), together)
    edges = np.append(histogram.edges[first], histogram.edges[-1])
    return Bins(
        edges,
        np.add.reduceat(histogram.count.astype(float), first),
        np.add.reduceat(histogram.dissipation.astype(float), first),
        (histogram.underflow, histogram.dissipation_underflow),
        (histogram.overflow, histogram.dissipation_overflow),
        float(duration),
        histogram.part,
    )


def enough(histograms) -> bool:
    """Whether histograms contain enough impacts for a curve."""
    return sum(one.count.sum() for one in histograms) >= 100


def curve(ax, histograms, duration: float, **look):
    """Draws the sum of histograms over a window as impacts per second and decade; nothing if there are too few for a
    curve."""
    if enough(histograms):
        found = [merged(one, duration) for one in histograms]
        rate = sum(one.rate_density for one in found)
        ax.loglog(found[0].middle, np.where(rate > 0, rate, np.nan), **look)
