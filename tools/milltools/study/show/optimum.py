"""Where the best design is, how good it is, and which others cannot be told from it.

Neighbouring designs know of each other: a Gaussian process through all runs (`gp.py`) averages out the noise that lifts the luckiest
of hundreds of designs above the truly best one. Where there are too few runs for it, or no scikit-learn, each design
stands for itself and Gupta's subset says which may be best (`show_stats.not_told_apart`).
"""

import dataclasses

import numpy as np
from scipy import stats

from milltools.study.show import stats as show_stats

LEAST = 8  # designs with a value, below which no surface is fitted
MOST = 420  # values given to the surface: neighbours of larger grids are averaged first
ALIKE = 0.02  # "as good": within this share of the best value
REACH = float(stats.norm.ppf((1 + show_stats.LEVEL) / 2))


@dataclasses.dataclass(frozen=True)
class Optimum:
    """`design`: index of the best design; `value` +- `half` (95 %, NaN if unknown), SI. Over designs: `open` those that
    cannot be told from the best, `alike` those within ALIKE of it. `surface`: the gp.Surface, None if each
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
        if self.surface is None:
            return "each design by its own runs"
        return "Gaussian process through all runs"


def usable(view) -> np.ndarray:
    return (view.designs["state"] == "done").to_numpy()


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
    which = usable(view) & np.isfinite(found.mean)
    values = found.mean[which]
    if which.sum() < LEAST or np.ptp(values) == 0:
        return None
    designs, mean, error = thinned(view, which, found.mean, found.error)
    room = space.Space(view.meta["vary"])
    return gp.Surface(room, designs, mean, error, maximise=objective.sign > 0)


def find(view, objective) -> Optimum | None:
    """The optimum of an objective among the designs that were run; None if none has a value."""
    cache = view.__dict__.setdefault("_optima", {})
    if objective.path not in cache:
        cache[objective.path] = _find(view, objective)
    return cache[objective.path]


def _find(view, objective):
    found, which, sign = view.estimate(objective.path), usable(view), objective.sign
    best = show_stats.best_of(found, sign, which)
    if best is None:
        return None
    surface = surface_of(view, objective)
    if surface is None:
        return Optimum(
            best,
            float(found.mean[best]),
            float(found.half[best]),
            show_stats.not_told_apart(found, sign, which),
            show_stats.within(found, sign, which, ALIKE),
            found.mean,
            found.error,
        )
    which = which & np.isfinite(found.mean)
    mean, spread = np.full(len(which), np.nan), np.full(len(which), np.nan)
    designs = tuples(view, which)
    mean[which], spread[which] = surface.predict(designs)
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
    return Optimum(best, value, float(REACH * spread[best]), open_, alike, mean, spread, surface)


def spans(view, mask) -> str:
    """What a set of designs covers, key by key: "n 5..8, h 5.5..8 mm"."""
    parts = []
    for axis in view.axes:
        found = view.designs[axis.key][mask]
        if not axis.numeric:
            kept = [str(c) for c in axis.choices if (found == c).any()]
            parts.append(f"{axis.short} {' or '.join(kept)}")
        elif found.min() == found.max():
            parts.append(f"{axis.short} {axis.tell(found.min())}")
        else:
            parts.append(f"{axis.short} {axis.tell(found.min(), False)}..{axis.tell(found.max())}")
    return ", ".join(parts)
