"""The objective over two varied keys, as the paper's Figure 7: filled contours, optimum, and how sure both are.

On a grid the colours are the means of the designs' own runs, joined by straight lines only. Scattered designs (Latin hypercube, Sobol,
optimiser) have a surface drawn through them, said so, and their runs as dots in the same colours. More than two keys: a cut through
the optimum, or the mean over the others.
"""

import dataclasses
import math

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import Normal, Stroke

from milltools.study.show import canvas, optimum
from milltools.study.show.data import Axis

LEVELS = 18
FINE = 81  # points of a surface along a real key
FINEST = 120  # values of a grid's key that are drawn; of more, neighbours are averaged
HATCHES = {
    "capped": {"fc": "none", "ec": "0.75", "hatch": "xxxxx"},
    "failed": {"fc": "0.9", "ec": "0.4", "hatch": "////"},
}
WIDTH = 1.3  # of the outlines of regions
AVERAGED = 64  # of the other keys' values, for a mean over them


@dataclasses.dataclass
class Plane:
    """Two keys' plane of a study. Arrays are [y, x] over xs, ys (shown scale); `value`, `error` in the objective's shown
    scale, `state` "done" | "capped" | "failed" | "" (not there); `star`: where the best design stands."""

    x: Axis
    y: Axis
    xs: np.ndarray
    ys: np.ndarray
    value: np.ndarray
    error: np.ndarray
    state: np.ndarray
    open: np.ndarray
    alike: np.ndarray
    star: tuple | None
    grid: bool
    others: str = ""
    points: list = dataclasses.field(default_factory=list)  # scattered: (x, y, value, state) of each design
    count: dict = dataclasses.field(default_factory=dict)  # grid: designs by state


def main_keys(view, objective, x=None, y=None, sensitivities=()) -> tuple[Axis, Axis]:
    """The two keys to draw: those asked for, else those that matter most (their total indices), else the first two."""
    numeric = [a for a in view.axes if a.numeric]
    weight = {entry[0]: entry[3] for entry in sensitivities}
    chosen = [view.axis(key) for key in (x, y) if key]
    ranked = sorted(numeric, key=lambda a: -weight.get(a.key, 0.0))
    chosen = [*chosen, *(axis for axis in ranked if axis not in chosen)][:2]
    if y and not x:
        chosen.reverse()
    elif not x and not y:
        chosen.sort(key=view.axes.index)
    return chosen[0], chosen[1]


def plane(view, objective, x: Axis, y: Axis, average=False) -> Plane:
    """The plane of two keys; with `average` the mean over the others instead of a cut through the optimum."""
    make = _grid_plane if view.is_grid() else _surface_plane
    return make(view, objective, x, y, average, optimum.find(view, objective))


def _others(view, x, y, best, average) -> str:
    rest = [a for a in view.axes if a.key not in (x.key, y.key)]
    if not rest:
        return ""
    if average or best is None:
        return "mean over " + ", ".join(a.words for a in rest)
    line = view.designs.iloc[best.design]
    return "at " + ", ".join(f"{a.words} = {a.tell(line[a.key])}" for a in rest)


def _grid_plane(view, objective, x, y, average, best) -> Plane:
    found, frame = view.estimate(objective.path), view.designs
    take = np.ones(len(frame), bool)
    if best is not None and not average:
        for axis in view.axes:
            if axis.key not in (x.key, y.key):
                take &= (frame[axis.key] == frame[axis.key][best.design]).to_numpy()
    (columns, xs, more_x), (rows, ys, more_y) = (_cells(a, frame[a.key][take]) for a in (x, y))
    shape = len(ys), len(xs)
    at, size = rows * shape[1] + columns, shape[0] * shape[1]

    def mean(values, keep):
        count = np.bincount(at[keep], minlength=size)
        with np.errstate(invalid="ignore", divide="ignore"):
            return (np.bincount(at[keep], values[keep], size) / count).reshape(shape)

    which, done = np.flatnonzero(take), (frame["state"][take] == "done").to_numpy()
    value, error = found.mean[which], found.error[which]
    value[np.isin(at, at[done]) & ~done] = np.nan  # in a cell of several, those that ended are taken
    sound = np.isfinite(value)
    several = np.sqrt(np.bincount(at[sound], minlength=size)).reshape(shape)
    with np.errstate(invalid="ignore", divide="ignore"):
        errors = np.sqrt(mean(error**2, sound)) / several
    state = np.full(size, "", dtype="<U6")
    for what in ("failed", "capped", "done"):
        state[at[(frame["state"][take] == what).to_numpy()]] = what
    there, marks = np.bincount(at, minlength=size), []
    for mask in (best.open, best.alike) if best else np.zeros((2, len(frame)), bool):
        inside = np.bincount(at[mask[which]], minlength=size)
        marks.append(((2 * inside >= there) & (there > 0)).reshape(shape))
    star = None if average and len(view.axes) > 2 else _place(view, best, x, y)
    others = [_others(view, x, y, best, average)]
    others += [f"means of {more} neighbours along {a.short}" for a, more in ((x, more_x), (y, more_y)) if more > 1]
    return Plane(
        x, y, xs, ys, mean(value, sound), errors, state.reshape(shape), *marks, star, True,
        ", ".join(filter(None, others)), count=frame["state"][take].value_counts().to_dict(),
    )  # fmt: skip


def _cells(axis, found):
    """Of a grid's key: the cell of each value found, where the cells stand on the axis, how many values make a cell."""
    more = -(-len(axis.values) // FINEST)
    cell = np.searchsorted(axis.values, found.to_numpy(float)) // more
    spots = canvas.places(axis, axis.values)
    return cell, np.array([spots[k : k + more].mean() for k in range(0, len(spots), more)]), more


def _place(view, best, x, y):
    if best is None:
        return None
    line = view.designs.iloc[best.design]
    return tuple(float(canvas.places(a, [line[a.key]])[0]) for a in (x, y))


def _span(axis) -> np.ndarray:
    """SI values along which a surface is drawn."""
    if axis.values and len(axis.values) <= FINE:
        return np.array(axis.values, float)
    low, high = axis.span
    if axis.whole and high - low < FINE:
        return np.arange(round(low), round(high) + 1)
    return np.geomspace(low, high, FINE) if axis.log and low > 0 else np.linspace(low, high, FINE)


def _surface_plane(view, objective, x, y, average, best) -> Plane:
    found, xs, ys = view.estimate(objective.path), _span(x), _span(y)
    shape = len(ys), len(xs)
    value = error = np.full(shape, np.nan)
    open_ = alike = np.zeros(shape, bool)
    if best is not None and best.surface is not None:
        mesh = [m.ravel() for m in np.meshgrid(xs, ys)]
        named = {x.key: mesh[0].tolist(), y.key: mesh[1].tolist()}
        ask = np.flatnonzero(view.usable)[:AVERAGED] if average else [best.design]
        told = []
        for k in ask:
            line = view.designs.iloc[k]
            designs = list(zip(*(named.get(a.key, [line[a.key]] * len(mesh[0])) for a in view.axes)))
            told.append(best.surface.predict(designs))
        value, error = np.mean(told, axis=0).reshape(2, *shape)
        if not (average and len(view.axes) > 2):
            _, width = best.surface.gaps(designs, optimum.tuples(view, [best.design])[0])
            gap = objective.sign * (best.value - value)
            open_ = gap <= optimum.REACH * width.reshape(shape)
            alike = gap <= optimum.ALIKE * abs(best.value)
    spots = [canvas.places(a, view.designs[a.key]) for a in (x, y)]
    return Plane(
        x, y, canvas.places(x, xs), canvas.places(y, ys), value, error, np.full(shape, "done"), open_, alike,
        _place(view, best, x, y), False, _others(view, x, y, best, average),
        list(zip(*spots, found.mean, view.designs["state"])),
    )  # fmt: skip


def levels_of(planes) -> np.ndarray:
    """Of the colours of all of them: over the values drawn, without those of capped designs."""
    found = [p.value[np.isfinite(p.value) & (p.state == "done")] for p in planes]
    found += [np.array([v for *_, v, s in p.points if s == "done"]) for p in planes]
    found = np.concatenate([f[np.isfinite(f)] for f in found])
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
    if low == high:
        low, high = low - 0.5 * (abs(low) or 1), high + 0.5 * (abs(high) or 1)
    return matplotlib.ticker.MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)


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
            boxes.append(Rectangle((xe[c], ye[low]), xe[c + 1] - xe[c], ye[high] - ye[low]))
    return boxes


def _lines(ax, mask, xs, ys, label, **look):
    """Outlines of a region; returns the handle of a legend."""
    made = LineCollection(canvas.outline(mask, xs, ys), zorder=4, linewidths=WIDTH, **look)
    made.set_path_effects([Stroke(linewidth=WIDTH + 1.6, foreground="white"), Normal()])
    ax.add_collection(made)
    return Line2D([], [], c=look["colors"], lw=WIDTH, ls=look.get("linestyles", "-"), label=label)


def paint(ax, plane: Plane, levels):
    """One plane on one axes; returns what a colour bar wants, and the handles of a legend."""
    xe, ye = (canvas.edges(v, a.log) for v, a in ((plane.xs, plane.x), (plane.ys, plane.y)))
    colours = matplotlib.colormaps[canvas.COLOURS]
    norm = matplotlib.colors.BoundaryNorm(levels, colours.N)
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
                ax.scatter(px[these], py[these], 26, canvas.INK, marker=mark, linewidths=1.1, zorder=3)
                handles.append(Line2D([], [], ls="", marker=mark, c=canvas.INK, label=f"{what} ({these.sum()})"))
    if plane.alike.any():
        label = f"at most {100 * optimum.ALIKE:g} % worse than the best"
        handles.append(_lines(ax, plane.alike, xe, ye, label, colors=canvas.INK))
    if plane.open.any():
        look = {"colors": "#d5006d", "linestyles": (0, (2.2, 1.6))}
        handles.append(_lines(ax, plane.open, xe, ye, "cannot be told from the best (95 %)", **look))
    if plane.star:
        ax.plot(*plane.star, "*", ms=13, mfc="white", mec=canvas.INK, mew=1, zorder=6, clip_on=False)
    ax.set_xlim(_limits(plane.xs, xe))
    ax.set_ylim(_limits(plane.ys, ye))
    canvas.dress(ax, plane.x, "x")
    canvas.dress(ax, plane.y, "y", second=False)
    for side in ("top", "right"):
        ax.spines[side].set_visible(True)
    return image, handles


def best_words(view, objective) -> tuple[str, str]:
    best = optimum.find(view, objective)
    known = " (95 %)" if math.isfinite(best.half) else ""
    value = objective.scale.pair(best.value, best.half) + known
    return f"best: {view.tell(best.design)}", value.replace("+-", "\N{PLUS-MINUS SIGN}")


def star(view, objective):
    label = "\n".join(canvas.broken(line, 50) for line in best_words(view, objective))
    return Line2D([], [], ls="", marker="*", ms=11, mfc="white", mec=canvas.INK, label=label)


def relative_errors(plane) -> np.ndarray:
    """Standard error over value [%] of every cell."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(plane.state == "done", 100 * plane.error / np.abs(plane.value), np.nan)


def draw(view, objective, x=None, y=None, average=False, sensitivities=()):
    """The figure of one study: the plane, and beside it its relative standard errors."""
    shown = plane(view, objective, *main_keys(view, objective, x, y, sensitivities), average)
    figure = canvas.new(8.2, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(2.1, 1), sharey=True)
    image, handles = paint(left, shown, levels_of([shown]))
    figure.colorbar(image, ax=left, label=canvas.value_label(objective, 60), pad=0.015, aspect=28)
    if shown.star:
        handles.insert(0, star(view, objective))
    canvas.title(figure, title(view, shown))
    draw_errors(right, shown)
    canvas.legend(figure, handles, 3)
    return figure


def title(view, shown) -> str:
    how = "" if shown.grid else "surface through all runs (Gaussian process)"
    return ", ".join(filter(None, (view.name, shown.others, how)))


def draw_errors(ax, shown):
    """How sure each point of the plane is."""
    share = relative_errors(shown)
    xe, ye = (canvas.edges(v, a.log) for v, a in ((shown.xs, shown.x), (shown.ys, shown.y)))
    canvas.dress(ax, shown.x, "x")
    ax.set_xlim(_limits(shown.xs, xe))
    ax.set_title("how sure" if shown.grid else "how sure the surface is", loc="left", fontsize=8.5)
    if not np.isfinite(share).any():
        ax.text(0.5, 0.5, "no errors known", ha="center", transform=ax.transAxes)
        return
    top = float(np.nanquantile(share, 0.99)) or 1.0
    image = ax.pcolormesh(xe, ye, share, cmap="cividis_r", vmin=0, vmax=top, rasterized=True)
    label = f"relative standard error [%], median {np.nanmedian(share):.2g}"
    ax.figure.colorbar(image, ax=ax, label=label, extend="max", pad=0.02, aspect=28)
