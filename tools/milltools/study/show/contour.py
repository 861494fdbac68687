"""The objective over two varied keys, as the paper's Figure 7: filled contours, optimum, and how sure both are.

On a grid the colours are the means of the designs' own runs, joined by straight lines only. Scattered designs (Latin hypercube, Sobol,
optimiser) have a surface drawn through them, said so, and their runs as dots in the same colours. More than two keys: a cut through
the optimum, or the mean over the others.
"""

import dataclasses
import math

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke

from milltools.study.show import draw as show_draw
from milltools.study.show import optimum as show_optimum
from milltools.study.show import terminal as show_text
from milltools.study.show.data import Axis

LEVELS = 18
FINE = 81  # points of a surface along a real key
FINEST = 120  # values of a grid's key that are drawn; of more, neighbours are averaged
HATCHES = {
    "capped": {"fc": "none", "ec": "0.75", "hatch": "xxxxx"},
    "failed": {"fc": "0.9", "ec": "0.4", "hatch": "////"},
}
AVERAGED = 64  # of the other keys' values, for a mean over them


@dataclasses.dataclass
class Plane:
    """Two keys' plane of a study. Arrays are [y, x] over xs, ys (shown scale); `value`, `error` in the objective's shown
    scale, `state` "done" | "capped" | "failed" | "" (not there)."""

    x: Axis
    y: Axis
    xs: np.ndarray
    ys: np.ndarray
    value: np.ndarray
    error: np.ndarray
    state: np.ndarray
    open: np.ndarray
    alike: np.ndarray
    best: tuple | None
    grid: bool
    others: str = ""
    points: list = dataclasses.field(default_factory=list)  # scattered: (x, y, value, state) of each design
    count: dict = dataclasses.field(default_factory=dict)  # grid: designs by state


def main_keys(view, objective, x=None, y=None, sensitivities=()) -> tuple[Axis, Axis]:
    """The two keys to draw: those asked for, else those that matter most (their total indices), else the first two."""
    numeric = [a for a in view.axes if a.numeric]
    weight = {entry[0]: entry[3] for entry in sensitivities}
    ranked = sorted(numeric, key=lambda a: -weight.get(a.key, 0.0)) if weight else numeric
    chosen = [view.axis(key) for key in (x, y) if key]
    for axis in ranked:
        if len(chosen) == 2:
            break
        if axis not in chosen:
            chosen.append(axis)
    if y and not x:
        chosen.reverse()
    elif not x and not y:
        chosen.sort(key=view.axes.index)
    return chosen[0], chosen[1]


def plane(view, objective, x: Axis, y: Axis, average=False) -> Plane:
    """The plane of two keys; with `average` the mean over the others instead of a cut through the optimum."""
    optimum = show_optimum.find(view, objective)
    if view.is_grid():
        return _grid_plane(view, objective, x, y, average, optimum)
    return _surface_plane(view, objective, x, y, average, optimum)


def _others(view, x, y, optimum, average) -> str:
    rest = [a for a in view.axes if a.key not in (x.key, y.key)]
    if not rest:
        return ""
    if average or optimum is None:
        return "mean over " + ", ".join(a.words for a in rest)
    line = view.designs.iloc[optimum.design]
    return "at " + ", ".join(f"{a.words} = {a.tell(line[a.key])}" for a in rest)


def _grid_plane(view, objective, x, y, average, optimum) -> Plane:
    scale, found = show_draw.value_scale(objective), view.estimate(objective.path)
    frame = view.designs
    take = np.ones(len(frame), bool)
    if optimum is not None and not average:
        for axis in view.axes:
            if axis.key not in (x.key, y.key):
                take &= (frame[axis.key] == frame[axis.key][optimum.design]).to_numpy()
    (columns, xs, more_x), (rows, ys, more_y) = (_cells(a, frame[a.key][take]) for a in (x, y))
    shape = len(ys), len(xs)
    at, size = rows * shape[1] + columns, shape[0] * shape[1]

    def mean(values, keep):
        count = np.bincount(at[keep], minlength=size)
        with np.errstate(invalid="ignore", divide="ignore"):
            return (np.bincount(at[keep], values[keep], size) / count).reshape(shape)

    which, done = np.flatnonzero(take), (frame["state"][take] == "done").to_numpy()
    value, error = found.mean[which] / scale.size, found.error[which] / scale.size
    value[np.isin(at, at[done]) & ~done] = np.nan  # in a cell of several, those that ended are taken
    sound = np.isfinite(value)
    several = np.sqrt(np.bincount(at[sound], minlength=size)).reshape(shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        errors = np.sqrt(mean(error**2, sound)) / several
    state = np.full(size, "", dtype="<U6")
    for what in ("failed", "capped", "done"):
        state[at[(frame["state"][take] == what).to_numpy()]] = what
    marks = []
    for mask in (optimum.open, optimum.alike) if optimum else (None, None):
        cells = np.zeros(size, bool)
        if mask is not None:
            cells = 2 * np.bincount(at[mask[which]], minlength=size) >= np.bincount(at, minlength=size)
            cells &= np.bincount(at, minlength=size) > 0
        marks.append(cells.reshape(shape))
    best = None
    if optimum is not None and not (average and len(view.axes) > 2):
        best = _place(view, optimum, x, y)
    others = [_others(view, x, y, optimum, average)]
    others += [f"means of {more} neighbours along {a.short}" for a, more in ((x, more_x), (y, more_y)) if more > 1]
    return Plane(
        x, y, xs, ys, mean(value, sound), errors, state.reshape(shape), *marks, best, True,
        ", ".join(filter(None, others)), count=frame["state"][take].value_counts().to_dict(),
    )  # fmt: skip


def _cells(axis, found):
    """Of a grid's key: the cell of each value found, where the cells stand on the axis, how many values make a cell."""
    more = -(-len(axis.values) // FINEST)
    cell = np.searchsorted(axis.values, found.to_numpy(float)) // more
    spots = show_draw.places(axis, axis.values)
    return cell, np.array([spots[k : k + more].mean() for k in range(0, len(spots), more)]), more


def _place(view, optimum, x, y):
    line = view.designs.iloc[optimum.design]
    return tuple(float(show_draw.places(a, [line[a.key]])[0]) for a in (x, y))


def _span(axis) -> np.ndarray:
    """SI values along which a surface is drawn."""
    if axis.values and len(axis.values) <= FINE:
        return np.array(axis.values, float)
    low, high = axis.span
    if axis.whole and high - low < FINE:
        return np.arange(round(low), round(high) + 1)
    return np.geomspace(low, high, FINE) if axis.log and low > 0 else np.linspace(low, high, FINE)


def _surface_plane(view, objective, x, y, average, optimum) -> Plane:
    scale, found = show_draw.value_scale(objective), view.estimate(objective.path)
    xs, ys = _span(x), _span(y)
    shape = len(ys), len(xs)
    value = error = np.full(shape, np.nan)
    open_ = alike = np.zeros(shape, bool)
    if optimum is not None and optimum.surface is not None:
        mesh = [m.ravel() for m in np.meshgrid(xs, ys)]
        line = view.designs.iloc[optimum.design]
        ask = np.flatnonzero(show_optimum.usable(view))[:AVERAGED] if average else [optimum.design]
        total, square = np.zeros(shape[0] * shape[1]), np.zeros(shape[0] * shape[1])
        for k in ask:
            line = view.designs.iloc[k]
            named = {x.key: mesh[0].tolist(), y.key: mesh[1].tolist()}
            columns = [named.get(a.key, [line[a.key]] * len(mesh[0])) for a in view.axes]
            designs = list(zip(*columns))
            m, s = optimum.surface.predict(designs)
            total, square = total + m / len(ask), square + s / len(ask)
        value, error = (total / scale.size).reshape(shape), (square / scale.size).reshape(shape)
        if not (average and len(view.axes) > 2):
            best = show_optimum.tuples(view, [optimum.design])[0]
            _, width = optimum.surface.gaps(designs, best)
            gap = objective.sign * (optimum.value - total)
            open_ = (gap <= show_optimum.REACH * width).reshape(shape)
            alike = (gap <= show_optimum.ALIKE * abs(optimum.value)).reshape(shape)
    points = list(
        zip(
            show_draw.places(x, view.designs[x.key]),
            show_draw.places(y, view.designs[y.key]),
            found.mean / scale.size,
            view.designs["state"],
        )
    )
    best = _place(view, optimum, x, y) if optimum is not None else None
    return Plane(
        x, y, show_draw.places(x, xs), show_draw.places(y, ys), value, error,
        np.full(shape, "done"), open_, alike, best, False, _others(view, x, y, optimum, average), points,
    )  # fmt: skip


def limits(planes) -> tuple[float, float]:
    """Colour scale for all of them: the values drawn, without those of capped designs where there are enough others."""
    found = [p.value[np.isfinite(p.value) & (p.state == "done")] for p in planes]
    found += [np.array([v for *_, v, s in p.points if s == "done"]) for p in planes]
    found = np.concatenate([f[np.isfinite(f)] for f in found])
    if not len(found):
        return 0.0, 1.0
    low, high = float(found.min()), float(found.max())
    return (low, high) if high > low else (low - 0.5 * (abs(low) or 1), high + 0.5 * (abs(high) or 1))


def _limits(spots, borders) -> tuple[float, float]:
    """Whole cells where they are small, else up to the outermost points: none should seem to lie beyond the ranges."""
    coarse = len(spots) > 1 and len(spots) < 12
    return (spots[0], spots[-1]) if coarse else (borders[0], borders[-1])


def _boxes(cells, xe, ye) -> list:
    """Rectangles over the cells that are set, one a run of neighbours along y."""
    boxes = []
    for c in range(cells.shape[1]):
        ends = np.flatnonzero(np.diff(np.pad(cells[:, c].astype(int), 1)))
        for low, high in ends.reshape(-1, 2):
            boxes.append(plt.Rectangle((xe[c], ye[low]), xe[c + 1] - xe[c], ye[high] - ye[low]))
    return boxes


def _lines(ax, mask, xs, ys, **look):
    made = LineCollection(show_draw.outline(mask, xs, ys), zorder=4, **look)
    made.set_path_effects([Stroke(linewidth=look["linewidths"] + 1.6, foreground="white"), Normal()])
    ax.add_collection(made)


def paint(ax, plane: Plane, levels):
    """One plane on one axes; returns what a colour bar wants, and the handles of a legend."""
    xe, ye = (show_draw.edges(v, a.log) for v, a in ((plane.xs, plane.x), (plane.ys, plane.y)))
    colours = plt.get_cmap(show_draw.COLOURS)
    norm = plt.matplotlib.colors.BoundaryNorm(levels, colours.N)
    handles = []
    # cells first, so that next to a hole they reach as far as they do; lines join the means of neighbours
    image = ax.pcolormesh(xe, ye, np.ma.masked_invalid(plane.value), cmap=colours, norm=norm, rasterized=True)
    if min(plane.value.shape) > 1 and np.isfinite(plane.value).any():
        wide = np.ma.masked_invalid(np.pad(plane.value, 1, mode="edge"))
        wx, wy = (np.concatenate([e[:1], v, e[-1:]]) for e, v in ((xe, plane.xs), (ye, plane.ys)))
        image = ax.contourf(wx, wy, wide, levels, cmap=colours, norm=norm)
        ax.contour(wx, wy, wide, levels, colors="white", linewidths=0.3, alpha=0.5)
    for what, look in HATCHES.items():
        if (cells := plane.state == what).any():
            ax.add_collection(PatchCollection(_boxes(cells, xe, ye), lw=0, zorder=2, **look))
            handles.append(Patch(lw=0, label=f"{what} ({plane.count[what]})", **look))
    if plane.points:
        px, py, pv, state = (np.array(c) for c in zip(*plane.points))
        done, look = state == "done", {"zorder": 3, "linewidths": 0.8, "edgecolors": "white"}
        if plane.others:  # they lie before and behind the plane: their colours would not be its
            ax.scatter(px[done], py[done], 9, "0.3", **look | {"linewidths": 0.4})
        else:
            ax.scatter(px[done], py[done], 22, pv[done].astype(float), cmap=colours, norm=norm, **look)
        label = f"designs ({done.sum()}{', off this plane' if plane.others else ''})"
        handles.append(Line2D([], [], ls="", marker="o", mfc="0.5", mec="white", label=label))
        for what, mark in (("capped", "x"), ("failed", "+")):
            if (these := state == what).any():
                ax.scatter(px[these], py[these], 26, show_draw.INK, marker=mark, linewidths=1.1, zorder=3)
                handles.append(Line2D([], [], ls="", marker=mark, c=show_draw.INK, label=f"{what} ({these.sum()})"))
    if plane.alike.any():
        _lines(ax, plane.alike, xe, ye, colors=show_draw.INK, linewidths=1.3)
        handles.append(Line2D([], [], c=show_draw.INK, lw=1.3, label="within 2 % of the best"))
    if plane.open.any():
        _lines(ax, plane.open, xe, ye, colors="#d5006d", linewidths=1.3, linestyles=(0, (2.2, 1.6)))
        handles.append(
            Line2D(
                [],
                [],
                c="#d5006d",
                lw=1.3,
                ls=(0, (2.2, 1.6)),
                label="cannot be told from the best (95 %)",
            )
        )
    if plane.best:
        ax.plot(*plane.best, "*", ms=13, mfc="white", mec=show_draw.INK, mew=1, zorder=6, clip_on=False)
    ax.set_xlim(_limits(plane.xs, xe))
    ax.set_ylim(_limits(plane.ys, ye))
    show_draw.dress(ax, plane.x, "x")
    show_draw.dress(ax, plane.y, "y", second=False)
    for side in ("top", "right"):
        ax.spines[side].set_visible(True)
    return image, handles


def best_words(view, objective) -> tuple[str, str]:
    optimum = show_optimum.find(view, objective)
    scale = show_draw.value_scale(objective)
    value = show_text.pair(optimum.value, optimum.half, scale)
    known = " (95 %)" if math.isfinite(optimum.half) else ""
    return f"best: {view.tell(optimum.design)}", (value + known).replace("+-", "\N{PLUS-MINUS SIGN}")


def levels_of(planes) -> np.ndarray:
    low, high = limits(planes)
    return plt.matplotlib.ticker.MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)


def star(view, objective):
    label = "\n".join(show_draw.broken(line, 50) for line in best_words(view, objective))
    return Line2D([], [], ls="", marker="*", ms=11, mfc="white", mec=show_draw.INK, label=label)


def relative_errors(plane) -> np.ndarray:
    """Standard error over value [%] of every cell."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(plane.state == "done", 100 * plane.error / np.abs(plane.value), np.nan)


def draw(view, objective, x=None, y=None, average=False, sensitivities=()):
    """The figure of one study: the plane, and beside it its relative standard errors."""
    shown = plane(view, objective, *main_keys(view, objective, x, y, sensitivities), average)
    figure = show_draw.new(8.2, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(2.1, 1), sharey=True)
    image, handles = paint(left, shown, levels_of([shown]))
    figure.colorbar(image, ax=left, label=show_draw.value_label(objective, 60), pad=0.015, aspect=28)
    if shown.best:
        handles.insert(0, star(view, objective))
    figure.suptitle(show_draw.broken(title(view, shown), 110), fontsize=9.5, x=0.01, ha="left")
    draw_errors(right, shown)
    figure.legend(handles=handles, loc="outside lower left", ncols=3, frameon=False)
    return figure


def title(view, shown) -> str:
    parts = [
        view.name,
        shown.others,
        "" if shown.grid else "surface through all runs (Gaussian process)",
    ]
    return ", ".join(filter(None, parts))


def draw_errors(ax, shown):
    """How sure each point of the plane is."""
    share = relative_errors(shown)
    xe, ye = (show_draw.edges(v, a.log) for v, a in ((shown.xs, shown.x), (shown.ys, shown.y)))
    show_draw.dress(ax, shown.x, "x")
    ax.set_xlim(_limits(shown.xs, xe))
    ax.set_title("how sure" if shown.grid else "how sure the surface is", loc="left", fontsize=8.5)
    if not np.isfinite(share).any():
        ax.text(0.5, 0.5, "no errors known", ha="center", transform=ax.transAxes)
        return
    top = float(np.nanquantile(share, 0.99)) or 1.0
    image = ax.pcolormesh(xe, ye, share, cmap="cividis_r", vmin=0, vmax=top, rasterized=True)
    label = f"relative standard error [%], median {np.nanmedian(share):.2g}"
    ax.figure.colorbar(image, ax=ax, label=label, extend="max", pad=0.02, aspect=28)
