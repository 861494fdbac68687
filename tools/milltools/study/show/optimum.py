"""Where the best design is, how good it is, and which others cannot be told from it.

Neighbouring designs know of each other: a Gaussian process through all runs (`gp.py`) averages out the noise that lifts the luckiest
of hundreds of designs above the truly best one. Where there are too few runs for it, or no scikit-learn, each design
stands for itself and Gupta's subset says which may be best (`stats.not_told_apart`).
"""

import dataclasses

import numpy as np
from scipy.stats import norm

from milltools.study.show import stats

LEAST = 8  # designs with a value, below which no surface is fitted
MOST = 420  # values given to the surface: neighbours of larger grids are averaged first
ALIKE = 0.02  # "as good": within this share of the best value
REACH = float(norm.ppf((1 + stats.LEVEL) / 2))


@dataclasses.dataclass(frozen=True)
class Best:
    """`design`: index of the best design; `value` +- `half` (95 %, NaN if unknown), SI. Over designs: `open` those that
    cannot be told from the best, `alike` those at most ALIKE worse. `surface`: the gp.Surface, None if each
    design stood for itself. `mean`, `spread`: what the surface says of each design (else its own mean and error)."""

    design: int
    value: float
    half: float
    open: np.ndarray
    alike: np.ndarray
    mean: np.ndarray
    spread: np.ndarray
    surface: object = None

    @property
    def how(self) -> str:
        return "each design by its own runs" if self.surface is None else "Gaussian process through all runs"


def tuples(view, which) -> list[tuple]:
    """Designs as the surface wants them."""
    columns = [view.designs[a.key][which].tolist() for a in view.axes]
    return list(zip(*columns))


def thinned(view, which, mean, error):
    """Designs with a value, neighbours along the key with most values averaged where there are more than MOST:
    (designs, means, errors)."""
    keys = [a.key for a in view.axes]
    frame = view.designs.loc[which, keys].assign(mean=mean[which], square=error[which] ** 2)
    if len(frame) > MOST and all(a.numeric for a in view.axes):
        longest = max(keys, key=lambda key: frame[key].nunique())
        rank = frame[longest].rank(method="dense") - 1
        cells = max(2, int(rank.max() + 1) * MOST // len(frame))
        others = [key for key in keys if key != longest]
        group = frame.groupby([*others, (rank * cells // (rank.max() + 1)).rename("cell")], sort=True)
        count = group.size().to_numpy()
        means = group.mean().reset_index()
        means["square"] /= count
        frame = means
    designs = list(zip(*(frame[key].tolist() for key in keys)))
    return designs, frame["mean"].to_numpy(), np.sqrt(frame["square"].to_numpy())


def surface_of(view, objective):
    """A gp.Surface through the means of the designs, None where there cannot be one."""
    try:
        import sklearn  # noqa: F401

        from milltools.study.search import gp, space
    except ImportError:
        return None
    if any(not e.get("choices") for e, a in zip(view.meta["vary"], view.axes) if not a.numeric):
        return None  # files, vectors: no distance between them
    found = view.estimate(objective.path)
    which = view.usable & np.isfinite(found.mean)
    values = found.mean[which]
    if which.sum() < LEAST or np.ptp(values) == 0:
        return None
    designs, mean, error = thinned(view, which, found.mean, found.error)
    room = space.Space(view.meta["vary"])
    return gp.Surface(room, designs, mean, error, maximise=objective.sign > 0)


def find(view, objective) -> Best | None:
    """The optimum of an objective among the designs that were run; None if none has a value."""
    cache = view.__dict__.setdefault("_optima", {})
    if objective.path not in cache:
        cache[objective.path] = _find(view, objective)
    return cache[objective.path]


def _find(view, objective):
    found, sign = view.estimate(objective.path), objective.sign
    which = view.usable & np.isfinite(found.mean)
    best = stats.best_of(found, sign, which)
    if best is None:
        return None
    surface = surface_of(view, objective)
    if surface is None:
        with np.errstate(invalid="ignore"):
            alike = which & (sign * (found.mean[best] - found.mean) <= ALIKE * abs(found.mean[best]))
        value, half = float(found.mean[best]), float(found.half[best])
        return Best(best, value, half, stats.not_told_apart(found, sign, which), alike, found.mean, found.error)
    mean, spread = np.full(len(which), np.nan), np.full(len(which), np.nan)
    mean[which], spread[which] = surface.predict(tuples(view, which))
    best = int(np.flatnonzero(which)[np.argmax(sign * mean[which])])
    value = float(mean[best])
    # the error of a difference is at most the sum of both: only those that may pass are asked in pairs
    gap = sign * (value - mean)
    with np.errstate(invalid="ignore"):
        near = np.flatnonzero(gap <= REACH * (spread + spread[best]) + 1e-12 * abs(value))
        alike = gap <= ALIKE * abs(value)
    _, width = surface.gaps(tuples(view, near), tuples(view, [best])[0])
    open_ = np.zeros(len(which), bool)
    open_[near] = gap[near] <= np.maximum(REACH * width, 1e-12 * abs(value))
    return Best(best, value, float(REACH * spread[best]), open_, alike, mean, spread, surface)


def spans(view, mask) -> str:
    """What a set of designs covers, key by key: "n 5..8, h 5.5..8 mm"."""
    parts = []
    for axis in view.axes:
        found = view.designs[axis.key][mask]
        words = [word for word in axis.choices or () if (found == word).any()]
        parts.append(f"{axis.short} {axis.reach(found.min(), found.max(), words)}")
    return ", ".join(parts)


def front(view) -> np.ndarray:
    """Indices of the designs on the Pareto front of all objectives, best of the first one first."""
    means = [view.estimate(o.path).mean for o in view.objectives]
    scores = np.column_stack([np.where(view.usable, o.sign * m, np.nan) for o, m in zip(view.objectives, means)])
    which = np.flatnonzero(stats.pareto(scores))
    return which[np.argsort(-scores[which, 0], kind="stable")]


def indices(table, view, objective) -> list:
    """sensitivity.indices of an objective, from the surface that is there already; nothing where they cannot be had."""
    best = find(view, objective)
    if len(view.axes) < 2 or best is None or best.surface is None:
        return []
    from milltools.study.search import sensitivity

    return sensitivity.indices(table, view.objectives.index(objective), surface=best.surface)
