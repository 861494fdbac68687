"""The objective over two varied keys, like Figure 7 of the paper: filled contours, optimum, and errors of both.

On a grid the colours are the means of the designs' own runs, with linear interpolation only. For scattered designs
(Latin hypercube, Sobol, optimiser) a surface through the runs is drawn and labelled as such, with the runs as dots in
the same colours. With more than two keys: a cut through the optimum, or the mean over the other keys.
"""

import dataclasses
import functools
import math

import matplotlib
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import Normal, Stroke

from milltools.figures.style import colour_bar
from milltools.study.show import canvas, optimum, summary
from milltools.study.show.data import Axis

LEVELS = 18
FINE = 81  # points of a surface along a real key
FINEST = 120  # largest number of values of a grid's key; of more values, neighbours are averaged
HATCHES = {
    "capped": {"fc": "none", "ec": "0.75", "hatch": "xxxxx"},
    "failed": {"fc": "0.9", "ec": "0.4", "hatch": "////"},
}
WIDTH = 1.3  # of the outlines of regions
DOTS = 2000  # designs of a grid up to which each is a point
AVERAGED = 64  # of the other keys' values, for a mean over them


@dataclasses.dataclass(kw_only=True)
class Plane:
    """Two keys' plane of a study. Arrays are [y, x] over xs, ys (shown scale); `value`, `error` in the objective's
    shown scale, `state` "done" | "capped" | "failed" | "" (no run); `gap` and `reach` as in optimum.Best; `star`: the
    place of the best design; `limits`: (text of a requirement, excess over it) for each."""

    x: Axis
    y: Axis
    xs: np.ndarray
    ys: np.ndarray
    value: np.ndarray
    error: np.ndarray
    state: np.ndarray
    gap: np.ndarray
    reach: np.ndarray
    star: tuple | None
    others: str
    grid: bool
    alike_reach: float
    limits: list = dataclasses.field(default_factory=list)
    points: tuple = ()  # scattered: places x and y, values and states of the designs
    count: dict | None = None  # grid: designs by state

    @functools.cached_property
    def edges(self):
        """Borders of the cells along x and y."""
        return canvas.edges(self.xs, self.x.log), canvas.edges(self.ys, self.y.log)

    @property
    def ends(self):
        """Limits of the axes: whole cells if they are small, else up to the outermost points, so that no cell seems to
        be beyond the ranges."""
        ends = [spots if 1 < len(spots) < 12 else borders for spots, borders in zip((self.xs, self.ys), self.edges)]
        return [(along[0], along[-1]) for along in ends]


def main_keys(view, x=None, y=None, sensitivities=()) -> list[Axis]:
    """The two keys to draw: the requested keys, else those with the largest total indices, else the first two."""
    weight = {entry[0]: entry[3] for entry in sensitivities}
    chosen = [view.axis(key) for key in (x, y) if key]
    ranked = sorted((a for a in view.axes if a.numeric), key=lambda a: -weight.get(a.key, 0.0))
    chosen = [*chosen, *(axis for axis in ranked if axis not in chosen)][:2]
    if y and not x:
        chosen.reverse()
    elif not x:
        chosen.sort(key=view.axes.index)
    return chosen


def plane(view, objective, x: Axis, y: Axis, average=False) -> Plane:
    """The plane of two keys; with `average` the mean over the others instead of a cut through the optimum."""
    best, grid = optimum.find(view, objective), view.is_grid()
    rest, star, others = [a for a in view.axes if a.key not in (x.key, y.key)], None, []
    line = view.designs.iloc[best.design] if best else None
    if rest and (average or not best):
        others = ["mean over " + ", ".join(a.words for a in rest)]
    elif rest:
        others = ["at " + ", ".join(f"{a.words} = {a.tell(line[a.key])}" for a in rest)]
    if best and not (grid and average and rest):
        star = tuple(float(canvas.places(a, [line[a.key]])[0]) for a in (x, y))
    fields, averaged = (_grid if grid else _surface)(view, objective, x, y, rest, average, best)
    worse = optimum.ALIKE * abs(best.value) if best else 0.0
    others = ", ".join([*others, *averaged])
    return Plane(x=x, y=y, star=star, others=others, grid=grid, alike_reach=worse, **fields)


def _grid(view, objective, x, y, rest, average, best):
    """Fields of a Plane whose cells are means of designs; texts about keys whose neighbouring values are averaged."""
    found, cut = view.estimate(objective.path), rest if best and not average else []
    which = np.flatnonzero(view.having({axis.key: view.designs[axis.key][best.design] for axis in cut}))
    frame = view.designs.iloc[which]
    (columns, xs, more_x), (rows, ys, more_y) = (_cells(a, frame[a.key]) for a in (x, y))
    at, shape, size = rows * len(xs) + columns, (len(ys), len(xs)), len(xs) * len(ys)

    def mean(values, keep=slice(None)):
        """Means of the values of designs in each cell of the plane."""
        with np.errstate(invalid="ignore"):
            found = np.bincount(at[keep], values[which][keep], size) / np.bincount(at[keep], minlength=size)
        return found.reshape(shape)

    state = np.full(size, "", dtype="<U6")
    for what in ("failed", "capped", "done"):
        state[at[(frame["state"] == what).to_numpy()]] = what
    # in a cell with several designs, those with state "done" are used
    sound = np.isfinite(found.mean[which]) & ((state[at] != "done") | (frame["state"] == "done").to_numpy())
    several = np.bincount(at[sound], minlength=size).reshape(shape)
    marks = (best.gap, best.reach) if best else np.full((2, len(view.designs)), np.nan)
    with np.errstate(invalid="ignore"):
        fields = {
            "xs": xs, "ys": ys,
            "value": mean(found.mean, sound), "error": np.sqrt(mean(found.error**2, sound) / several),
            "state": state.reshape(shape), "count": frame["state"].value_counts().to_dict(),
        }  # fmt: skip
    for name, values in zip(("gap", "reach"), marks):
        fields[name] = mean(values, sound)
    limits = [(one, view.estimate(one.expression.text).mean) for one in view.require]
    fields["limits"] = [(one.text, mean(one.sign * (values - one.limit), sound)) for one, values in limits]
    return fields, [f"means of {more} neighbours along {a.short}" for a, more in ((x, more_x), (y, more_y)) if more > 1]


def _cells(axis, found):
    """For a grid's key: the cell of each value, the places of the cells on the axis, the number of values per cell."""
    more = -(-len(axis.values) // FINEST)
    cell = np.searchsorted(axis.values, found.to_numpy(float)) // more
    spots = canvas.places(axis, axis.values)
    return cell, np.array([spots[k : k + more].mean() for k in range(0, len(spots), more)]), more


def _span(axis) -> np.ndarray:
    """SI values along which a surface is drawn."""
    if axis.values and len(axis.values) <= FINE:
        return np.array(axis.values, float)
    low, high = axis.span
    if axis.whole and high - low < FINE:
        return np.arange(round(low), round(high) + 1)
    return np.geomspace(low, high, FINE) if axis.log and low > 0 else np.linspace(low, high, FINE)


def _surface(view, objective, x, y, _, average, best):
    """Fields of a Plane that shows the surface through all runs."""
    mesh = np.meshgrid(_span(x), _span(y))
    shape = mesh[0].shape
    fields = {"value": np.full(shape, np.nan), "error": np.full(shape, np.nan)}
    fields |= {"gap": np.full(shape, np.nan), "reach": np.full(shape, np.nan), "state": np.full(shape, "done")}
    if best and best.surface:
        named = {axis.key: values.ravel().tolist() for axis, values in zip((x, y), mesh)}
        told = []
        for design in np.flatnonzero(view.usable)[:AVERAGED] if average else [best.design]:
            line = view.designs.iloc[design]
            designs = list(zip(*(named.get(a.key, [line[a.key]] * mesh[0].size) for a in view.axes)))
            told.append(best.surface.predict(designs))
        fields["value"], fields["error"] = np.mean(told, axis=0).reshape(2, *shape)
        if not (average and len(view.axes) > 2):
            _, width = best.surface.gaps(designs, optimum.tuples(view, [best.design])[0])
            fields["gap"] = objective.sign * (best.value - fields["value"])
            fields["reach"] = optimum.REACH * width.reshape(shape)
            told = [(one.text, excess(designs).reshape(shape)) for one, excess in optimum.limits(view)]
            fields["limits"] = told
            for _, excess in told:
                fields["gap"][excess > 0] = np.nan
    spots = [canvas.places(a, view.designs[a.key]) for a in (x, y)]
    fields["xs"], fields["ys"] = canvas.places(x, mesh[0][0]), canvas.places(y, mesh[1][:, 0])
    fields["points"] = *spots, view.estimate(objective.path).mean, view.designs["state"].to_numpy()
    return fields, []


def levels_of(planes) -> np.ndarray:
    """Range of the common colour scale: of all drawn values, without capped designs."""
    drawn = [(p.value, p.state) for p in planes] + [p.points[2:] for p in planes if p.points]
    found = np.concatenate([value[np.isfinite(value) & (state == "done")] for value, state in drawn])
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.0, 1.0)
    if low == high:
        low, high = low - 0.5 * (abs(low) or 1), high + 0.5 * (abs(high) or 1)
    return matplotlib.ticker.MaxNLocator(LEVELS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)


def paint(ax, plane: Plane, levels):
    """Draws one plane on one axes; returns the mappable for a colour bar, and the handles of a legend."""
    xe, ye = plane.edges
    colours = matplotlib.colormaps[canvas.COLOURS]
    norm = matplotlib.colors.BoundaryNorm(levels, colours.N)
    handles = []
    # cells first, so that cells next to a hole are complete; contours then interpolate between neighbours
    image = ax.pcolormesh(xe, ye, np.ma.masked_invalid(plane.value), cmap=colours, norm=norm, rasterized=True)
    wx, wy = (np.concatenate([e[:1], v, e[-1:]]) for e, v in ((xe, plane.xs), (ye, plane.ys)))

    def level(field):
        """Where a field is 0, with the interpolation of the colours; unknown values are far above."""
        most = np.nanmax(np.abs(field), initial=0) or 1.0
        return wx, wy, np.pad(np.nan_to_num(field, nan=most, posinf=most), 1, mode="edge"), [0]

    if min(plane.value.shape) > 1 and np.isfinite(plane.value).any():
        wide = np.ma.masked_invalid(np.pad(plane.value, 1, mode="edge"))
        image = ax.contourf(wx, wy, wide, levels, cmap=colours, norm=norm)
        ax.contour(wx, wy, wide, levels, colors="white", linewidths=0.3, alpha=0.5)
    for what, look in HATCHES.items():
        if (cells := plane.state == what).any():
            region = Path.make_compound_path(*map(Path, canvas.outline(cells, xe, ye)))
            label = f"{what} ({plane.count[what]})"
            handles.append(ax.add_patch(PathPatch(region, lw=0, zorder=2, label=label, **look)))
    if plane.points:
        px, py, values, state = plane.points
        done, look = state == "done", {"zorder": 3, "edgecolors": "white"}
        if plane.others:  # these designs are not in the plane, so their colours would not match
            ax.scatter(px[done], py[done], 9, "0.3", linewidths=0.4, **look)
        else:
            ax.scatter(px[done], py[done], 22, values[done], cmap=colours, norm=norm, linewidths=0.8, **look)
        label = f"designs ({done.sum()}{', off this plane' if plane.others else ''})"
        handles.append(Line2D([], [], ls="", marker="o", mfc="0.5", mec="white", label=label))
        for what, mark in (("capped", "x"), ("failed", "+")):
            if (these := state == what).any():
                ax.scatter(px[these], py[these], 26, canvas.INK, marker=mark, linewidths=1.1, zorder=3)
                handles.append(Line2D([], [], ls="", marker=mark, c=canvas.INK, label=f"{what} ({these.sum()})"))
    if plane.grid and plane.state.size <= DOTS:
        at = np.array([(x, y) for y, row in zip(plane.ys, plane.state) for x, what in zip(plane.xs, row) if what])
        ax.plot(*at.T, "o", ms=3, mfc="white", mec=canvas.INK, mew=0.6, zorder=3, ls="", clip_on=False)
        handles.append(
            Line2D([], [], ls="", marker="o", ms=3, mfc="white", mec=canvas.INK, label="designs that were run")
        )
    for text, excess in plane.limits:
        if min(excess.shape) > 1 and (excess > 0).any():
            ax.contourf(*level(excess)[:3], [0, np.inf], colors="none", hatches=["\\\\"], zorder=2)
            ax.contour(*level(excess), colors=canvas.OVER, linewidths=WIDTH, zorder=4)
            look = {"fc": "none", "ec": "0.25", "hatch": "\\\\\\"}
            handles.append(matplotlib.patches.Patch(label=f"does not meet {text}", **look))
    for field, colour, dashes, label in (
        (plane.gap - plane.alike_reach, canvas.INK, "-", f"at most {100 * optimum.ALIKE:g} % worse than the best"),
        (plane.gap - plane.reach, "#d5006d", (0, (2.2, 1.6)), "not distinguishable from best (95 %)"),
    ):
        if min(field.shape) > 1 and (field <= 0).any():
            lines = ax.contour(*level(field), colors=colour, linewidths=WIDTH, linestyles=[dashes], zorder=4)
            lines.set_path_effects([Stroke(linewidth=WIDTH + 1.6, foreground="white"), Normal()])
            handles.append(Line2D([], [], c=colour, lw=WIDTH, ls=dashes, label=label))
    if plane.star:
        ax.plot(*plane.star, "*", ms=13, mfc="white", mec=canvas.INK, mew=1, zorder=6, clip_on=False)
    ax.set(**dict(zip(("xlim", "ylim"), plane.ends)))
    canvas.dress(ax, plane.x, "x")
    canvas.dress(ax, plane.y, "y")
    ax.spines[["top", "right"]].set_visible(True)
    return image, handles


def best_words(view, objective) -> tuple[str, str]:
    best = optimum.find(view, objective)
    known = " (95 %)" if math.isfinite(best.half) else ""
    value = objective.scale.pair(best.value, best.half) + known
    return f"best: {view.tell(best.design)}", value.replace("+-", "\N{PLUS-MINUS SIGN}")


def relative_errors(plane) -> np.ndarray:
    """Standard error over value [%] of every cell."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(plane.state == "done", 100 * plane.error / np.abs(plane.value), np.nan)


def draw(view, objective, x=None, y=None, average=False, sensitivities=()):
    """The figure of one study: the plane, and beside it its relative standard errors."""
    shown = plane(view, objective, *main_keys(view, x, y, sensitivities), average)
    figure = canvas.new(8.2, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(2.1, 1), sharey=True)
    image, handles = paint(left, shown, levels_of([shown]))
    left.set_title(canvas.value_label(objective, 70), loc="left", fontsize=8.5)
    colour_bar(image, [left])
    if shown.star:
        label = "\n".join(canvas.broken(line, 50) for line in best_words(view, objective))
        handles.insert(0, Line2D([], [], ls="", marker="*", ms=11, mfc="white", mec=canvas.INK, label=label))
    canvas.title(figure, "; ".join(filter(None, (summary.finding(view, objective), title(view, shown)))))
    _draw_errors(right, shown)
    canvas.legend(figure, handles, 3)
    return figure


def title(view, shown) -> str:
    how = "" if shown.grid else "fit through all runs (Gaussian process)"
    return ", ".join(filter(None, (view.name, shown.others, how)))


def _draw_errors(ax, shown):
    """The relative error of each point of the plane."""
    share = relative_errors(shown)
    canvas.dress(ax, shown.x, "x")
    ax.set_xlim(shown.ends[0])
    what = "standard error " if shown.grid else "standard error of the fit\n"
    ax.set_title(f"{what}[% of the value]", loc="left", fontsize=8.5)
    if not np.isfinite(share).any():
        ax.text(0.5, 0.5, "no errors known", ha="center", transform=ax.transAxes)
        return
    if np.nanmax(share) - np.nanmin(share) < 1e-6 * np.nanmax(share):  # replicates pooled over all designs
        ax.text(0.5, 0.5, f"{np.nanmedian(share):.2g} % everywhere", ha="center", transform=ax.transAxes)
        return
    top = float(np.nanquantile(share, 0.99)) or 1.0
    look = {"edgecolors": "white", "linewidth": 0.4} if share.size <= DOTS else {"rasterized": True}
    image = ax.pcolormesh(*shown.edges, share, cmap="cividis_r", vmin=0, vmax=top, **look)
    colour_bar(image, [ax], extend="max")
