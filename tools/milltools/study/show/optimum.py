"""The best design that meets the requirements, its value, and the designs that cannot be distinguished from it.

Neighbouring designs give information about each other: a Gaussian process through all runs (`gp.py`) averages out the
noise, which would otherwise make a lucky one of hundreds of designs look better than the truly best one. If there are
too few runs for this, each design is judged by its own runs, and Gupta's subset contains the designs that may be best
(`subset_reach`)."""

import dataclasses
import functools
import math

import numpy as np
from scipy import integrate, optimize, stats

from milltools.study.search import gp, sensitivity, space
from milltools.study.show.data import Means

LEAST = 8  # smallest number of designs with a value for fitting a surface
MOST = 420  # largest number of values for the surface: in larger grids neighbours are averaged first
ALIKE = gp.ALIKE  # equally good: within this share of the best value
REACH = gp.REACH


@dataclasses.dataclass(frozen=True)
class Best:
    """`design`: index of the best design; `value` +- `half` (95 %, NaN if unknown), SI. Over designs: `gap`, how much
    worse than the best; `reach`, how much worse a design may look that is as good (95 %). `surface`: the gp.Surface,
    None if it was not used. `mean`, `spread`: estimates of the surface for each design (else its own mean and
    error)."""

    design: int
    value: float
    half: float
    gap: np.ndarray
    reach: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    surface: object = None

    @property
    def open(self) -> np.ndarray:
        """Designs that cannot be distinguished from the best."""
        return self.gap <= self.reach

    @property
    def alike(self) -> np.ndarray:
        """Designs at most ALIKE worse."""
        return self.gap <= ALIKE * abs(self.value)


def tuples(view, which) -> list[tuple]:
    """Designs in the form for the surface."""
    return list(zip(*(view.designs[a.key][which].tolist() for a in view.axes)))


def thinned(view, which, found):
    """Designs with a value: (designs, means, errors). Of more than MOST, neighbours along the key with most values are
    averaged."""
    keys = [a.key for a in view.axes]
    frame = view.designs.loc[which, keys].assign(mean=found.mean[which], square=found.error[which] ** 2)
    if len(frame) > MOST and all(a.numeric for a in view.axes):
        longest = max(keys, key=lambda key: frame[key].nunique())
        rank = frame[longest].rank(method="dense") - 1
        cells = max(2, int(rank.max() + 1) * MOST // len(frame))
        others = [key for key in keys if key != longest]
        group = frame.groupby([*others, (rank * cells // (rank.max() + 1)).rename("cell")], sort=True)
        frame = group.mean().reset_index()
        frame["square"] /= group.size().to_numpy()
    designs = list(zip(*(frame[key].tolist() for key in keys)))
    return designs, frame["mean"].to_numpy(), np.sqrt(frame["square"].to_numpy())


def surface_of(view, which, found, sign):
    """A gp.Surface through the means of designs, None if it is not possible."""
    if any(e.get("kind") != "choice" for e, a in zip(view.meta["vary"], view.axes) if not a.numeric):
        return None  # files, vectors: no distance between them
    if which.sum() < LEAST or np.ptp(found.mean[which]) == 0:
        return None
    return gp.Surface(space.Space(view.meta["vary"]), *thinned(view, which, found), maximise=sign > 0)


def find(view, objective) -> Best | None:
    """The optimum of an objective among the designs that were run and meet the requirements; None if none has a
    value."""
    cache = view.__dict__.setdefault("_optima", {})
    if objective.path not in cache:
        cache[objective.path] = _find(view, objective)
    return cache[objective.path]


def _find(view, objective):
    found, sign = view.estimate(objective.path), objective.sign
    which = view.usable & np.isfinite(found.mean)
    among = which & view.feasible
    if not among.any():
        return None
    best = int(np.argmax(np.where(among, sign * found.mean, -np.inf)))
    surface = surface_of(view, which, found, sign)
    mean, spread, half = found.mean, found.error, found.half[best]
    if surface is not None:
        mean, spread = np.full((2, len(which)), np.nan)
        mean[which], spread[which] = surface.predict(tuples(view, which))
        best = int(np.flatnonzero(among)[np.argmax(sign * mean[among])])
        half = REACH * spread[best]
    value = float(mean[best])
    gap, least = np.where(among, sign * (value - mean), np.inf), 1e-12 * abs(value)
    if surface is None:
        reach = subset_reach(found, sign, among)
    else:
        reach = np.zeros(len(which))
        _, width = surface.gaps(tuples(view, among), tuples(view, [best])[0])
        reach[among] = np.maximum(REACH * width, least)
    return Best(best, value, float(half), gap, reach, mean, spread, surface)


@functools.lru_cache
def subset_quantile(count: int) -> float:
    """By how many standard errors of a difference the best of `count` designs may be below the one that looks best:
    Gupta, Technometrics 7 (1965) 225, eq. 2.4, for equal known errors; 1.64 for two designs, 3.3 for 400."""
    if count < 2:
        return 0.0

    def density(z, d):
        return stats.norm.pdf(z) * stats.norm.cdf(z + d * math.sqrt(2)) ** (count - 1)

    return optimize.brentq(lambda d: integrate.quad(density, -9, 9, (d,), limit=200)[0] - gp.CONFIDENCE, 0.0, 12.0)


def subset_reach(found: Means, sign: int, usable) -> np.ndarray:
    """How much worse each design may look than the best one, so that those within this reach contain the truly best one
    with 95 % confidence (Gupta's subset; errors may differ, as in Hsu, Ann. Statist. 9 (1981) 1026). A design without
    known error counts by its mean alone."""
    inside = usable & np.isfinite(found.mean)
    best = int(np.argmax(np.where(inside, sign * found.mean, -np.inf)))
    quantile = subset_quantile(int(inside.sum()))
    dof = float(found.dof[best])
    if math.isfinite(dof):  # the same tail under Student's t
        quantile = stats.t.isf(stats.norm.sf(quantile), dof)
    error = np.nan_to_num(found.error)
    return quantile * np.hypot(error, error[best])


def spans(view, mask) -> str:
    """The ranges of a set of designs, key by key: "n 5..8, h 5.5..8 mm"."""
    parts = []
    for axis in view.axes:
        found = view.designs[axis.key][mask]
        words = [word for word in axis.choices or () if (found == word).any()]
        parts.append(f"{axis.short} {axis.reach(found.min(), found.max(), words)}")
    return ", ".join(parts)


def pareto(scores: np.ndarray) -> np.ndarray:
    """Marks the lines of scores (designs x objectives, all to be large) that no other line beats (as good in all,
    better in one). Lines with NaN are excluded. Lines are sorted by the first score, so only earlier lines can beat a
    line: n log n for two, n k for more."""
    sound, kept = np.flatnonzero(np.isfinite(scores).all(axis=1)), []
    for line in sound[np.lexsort(-scores[sound, ::-1].T)]:
        better, here = scores[kept], scores[line]
        if not ((better >= here).all(axis=1) & (better > here).any(axis=1)).any():
            kept.append(line)
    return np.isin(np.arange(len(scores)), kept)


def front(view, aims=None) -> np.ndarray:
    """Indices of the designs on the Pareto front of objectives (default: all), best of the first one first."""
    means = [o.sign * view.estimate(o.path).mean for o in aims or view.objectives]
    scores = np.where((view.usable & view.feasible)[:, None], np.column_stack(means), np.nan)
    which = np.flatnonzero(pareto(scores))
    return which[np.argsort(-scores[which, 0], kind="stable")]


def limits(view) -> list[tuple]:
    """(requirement, function of designs that were perhaps not run: by how much they violate it, by a fit through the
    runs, less `doubt` standard errors of it) of all requirements for which a fit is possible."""
    fits = []
    for one in view.require:
        found = view.estimate(one.expression.text)
        surface = surface_of(view, view.usable & np.isfinite(found.mean), found, -one.sign)
        if surface is not None:

            def excess(designs, doubt=0.0, r=one, s=surface):
                mean, spread = s.predict(designs)
                return r.sign * (mean - r.limit) - doubt * spread

            fits.append((one, excess))
    return fits


def allowed(view):
    """A function of designs that were perhaps not run: which of them meet all requirements, by more than `doubt`
    standard errors if it is below 0, or, if it is above, may meet them."""
    fits = limits(view)
    keys, formulas = [axis.key for axis in view.axes], view.formulas

    def marked(designs, doubt=0.0):
        possible = [not formulas.rules or formulas.met(dict(zip(keys, design))) for design in designs]
        return np.all([np.array(possible, bool), *(excess(designs, doubt) <= 0 for _, excess in fits)], axis=0)

    return marked


def knee(view, aims, which) -> int | None:
    """The design on a front of two objectives that is farthest from the line between its ends, both objectives scaled
    to the front's range; None for fewer than four designs, or where the front is nearly straight."""
    if len(which) < 4:
        return None
    places = np.column_stack([o.sign * view.estimate(o.path).mean[which] for o in aims])
    places = (places - places.min(axis=0)) / np.ptp(places, axis=0)
    bulge = places.sum(axis=1) - 1  # from (0, 1) to (1, 0)
    return int(which[np.argmax(bulge)]) if bulge.max() > 0.1 else None


def indices(table, view, objective) -> list:
    """sensitivity.indices of an objective, from the existing surface; empty if they cannot be computed."""
    best = find(view, objective)
    if len(view.axes) < 2 or best is None or best.surface is None:
        return []
    stored = [one["path"] for one in table.meta["objectives"]]
    number = stored.index(objective.path) if objective.path in stored else None
    return sensitivity.indices(table, number, surface=best.surface)
