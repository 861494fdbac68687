"""The trade-off of a study: what one objective costs of the other, with the Pareto front, its knee, the limit of a
requirement and lines of equal efficiency.

An objective that is a quotient, such as `rate_above(1 mJ) / power`, is shown as its numerator over its denominator: the
slope of a line through the origin is then its value.
"""

import dataclasses

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from milltools.base.errors import UserError
from milltools.base.text import literal, number
from milltools.figures.style import colour_bar
from milltools.read import expression
from milltools.study.show import canvas, optimum, summary
from milltools.study.show.data import Aim

LABELLED = 14  # designs of a front up to which each has a label
CORNERS = (1, 1), (1, -1), (-1, 1), (-1, -1)  # right and up of a point, the first is preferred
OTHER = {"maximise": "minimise", "minimise": "maximise"}
BARS = {"elinewidth": 0.6, "ecolor": "0.6", "capsize": 0, "ls": "", "marker": ""}


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two objectives over each other: `x` and `y`. `slope`: the unit of y/x if one is to be small and the other large,
    so that y/x is an efficiency; None else, and of a share x, which is no cost."""

    x: Aim
    y: Aim
    slope: str | None = None


def pairs(view, objective) -> list[Pair]:
    """What is worth drawing: numerator and denominator of the objective; the objectives of the study; the objective and
    what is required. Empty for one plain objective."""
    if len(view.objectives) == 1:
        try:
            if ratio := expression.parsed(objective.path).ratio:
                above = dataclasses.replace(view.aim(ratio[0].text), goal=objective.goal)
                below = dataclasses.replace(view.aim(ratio[1].text), goal=OTHER[objective.goal])
                return [_pair(view, below, above)]
        except UserError:  # the table has only the quotient
            return []
    first, *others = [objective, *(o for o in view.objectives if o is not objective)]
    if not others:
        limits = [view.aim(one.expression.text, "minimise" if one.sign > 0 else "maximise") for one in view.require]
        others = list({aim.path: aim for aim in limits if aim.path != objective.path}.values())
    return [_pair(view, other, first) for other in others]


def _pair(view, x, y):
    if x.goal == y.goal:
        return Pair(x, y)
    if x.goal == "maximise":
        x, y = y, x
    if not x.unit:
        return Pair(x, y)
    try:
        return Pair(x, y, view.aim(f"({y.path}) / ({x.path})").unit)
    except UserError:
        return Pair(x, y, f"{y.unit} per {x.unit}")


def draw(view, objective, colour=None):
    """One panel per pair."""
    found = pairs(view, objective)[:3]
    figure = canvas.new(7.4 if len(found) == 1 else 5.4 * len(found), 5.2)
    axes = np.ravel(figure.subplots(1, len(found), squeeze=False))
    numeric = [a for a in view.axes if a.numeric and view.designs[a.key].nunique() > 1]
    hue = next((a for a in numeric if a.key == colour), numeric[0] if numeric else None)
    handles = {}
    colours = canvas.places(hue, view.designs[hue.key]) if hue else np.zeros(len(view.designs))
    look = ScalarMappable(Normalize(colours.min(), colours.max()), canvas.COLOURS)
    for ax, pair in zip(axes, found):
        _panel(ax, view, objective, pair, hue, look.to_rgba(colours) if hue else ["0.6"] * len(colours), handles)
    if hue:
        colour_bar(look, axes[-1:], label=literal(hue.heading))
    canvas.title(figure, summary.finding(view, objective) or view.name)
    canvas.legend(figure, handles.values(), 3)
    return figure


def shapes(view, hue):
    """The key that the shape of a point shows, and the shape of each of its values; (None, {}) if there is none."""
    for axis in view.axes:
        values = sorted(view.designs[axis.key].unique())
        if axis is not hue and 1 < len(values) <= len(canvas.MARKS):
            return axis, dict(zip(values, canvas.MARKS))
    return None, {}


def _panel(ax, view, objective, pair, hue, colours, handles):
    one, two = (view.estimate(aim.path) for aim in (pair.x, pair.y))
    known = view.usable & np.isfinite(one.mean) & np.isfinite(two.mean)
    shown = np.flatnonzero(known)
    x, y = one.mean, two.mean
    halves = (np.nan_to_num(found.half[shown]) for found in (two, one))
    ax.errorbar(x[shown], y[shown], *halves, **BARS, zorder=2)
    axis, marks = shapes(view, hue)
    for value, mark in marks.items() or [(None, "o")]:
        own = view.designs[axis.key].to_numpy() == value if axis else np.full(len(x), True)
        for good, alpha in ((True, 1.0), (False, 0.25)):
            some = shown[(own & (view.feasible == good))[shown]]
            if len(some):
                ax.scatter(x[some], y[some], 34, [colours[k] for k in some], marker=mark, alpha=alpha,
                           edgecolors=canvas.INK, linewidths=0.6, zorder=3)  # fmt: skip
        if axis:
            label = f"{axis.short} = {axis.tell(value)}"
            handles.setdefault(
                label, Line2D([], [], ls="", marker=mark, mfc="0.7", mec=canvas.INK, label=literal(label))
            )
    which = optimum.front(view, (pair.y, pair.x))
    a, b = x[which], y[which]
    order = np.argsort(a)
    (line,) = ax.plot(a[order], b[order], color="0.35", lw=1, ls="-", alpha=0.7, zorder=1, label="Pareto front")
    handles.setdefault("front", line)
    best, knee = optimum.find(view, objective), optimum.knee(view, (pair.y, pair.x), which)
    if best is not None and known[best.design]:
        label = f"best: {view.tell(best.design)}"
        star = ax.plot(x[best.design], y[best.design], "*", ms=17, mfc="none", mec=canvas.INK, zorder=5, ls="")[0]
        star.set_label(literal(label, 70))
        handles.setdefault("best", star)
    if knee is not None:
        look = {"ms": 13, "mfc": "none", "mec": "#d5006d", "mew": 1.4, "ls": "", "zorder": 4}
        handles.setdefault("knee", ax.plot(x[knee], y[knee], "o", label="knee of the front", **look)[0])
    ax.margins(0.08)
    if pair.slope is not None:
        _through_origin(ax, pair, x[shown], y[shown], handles)
    _limits(ax, view, pair, handles)
    first = [d for d in (best.design if best else None, knee) if d is not None and known[d]]
    _labels(ax, view, x, y, list(dict.fromkeys([*first, *which[[0, -1]], *which])) if len(which) else first)
    for aim, label in ((pair.x, ax.set_xlabel), (pair.y, ax.set_ylabel)):
        label(canvas.value_label(aim, 60))
    ax.grid(alpha=0.2, lw=0.6)


def _through_origin(ax, pair, x, y, handles):
    """Lines of equal y/x through the origin, with their values at the border."""
    if not (len(x) and np.all(x > 0) and np.all(y > 0)):
        return
    ax.set(xlim=(0, ax.get_xlim()[1]), ylim=(0, ax.get_ylim()[1]))
    right, top = ax.get_xlim()[1], ax.get_ylim()[1]
    slopes = [s for s in MaxNLocator(3).tick_values((y / x).min(), (y / x).max()) if s > 0]
    for slope in slopes:
        end = (right, slope * right) if slope * right <= top else (top / slope, top)
        (line,) = ax.plot((0, end[0]), (0, end[1]), color="0.55", lw=0.7, ls=(0, (4, 3)), zorder=0)
        at = {"ha": "left", "va": "center"} if end[0] == right else {"ha": "center", "va": "bottom"}
        ax.annotate(f"{number(slope)}", end, (2, 0) if end[0] == right else (0, 1), textcoords="offset points",
                    fontsize=6.5, color="0.4", annotation_clip=False, **at)  # fmt: skip
    if slopes:
        line.set_label(literal(f"equal efficiency [{pair.slope or '1'}]"))
        handles.setdefault("slope", line)


def _limits(ax, view, pair, handles):
    """Shades what a requirement forbids."""
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())  # what is shaded moves them no more
    for one in view.require:
        for aim, shade, ends in ((pair.x, ax.axvspan, ax.get_xlim()), (pair.y, ax.axhspan, ax.get_ylim())):
            if aim.path == one.expression.text and ends[0] < one.limit < ends[1]:
                low, high = sorted((one.limit, ends[1] if one.sign > 0 else ends[0]))
                handles.setdefault(one.text, shade(low, high, **canvas.forbidden(one)))
                (ax.axvline if aim is pair.x else ax.axhline)(one.limit, color=canvas.OVER, lw=1, zorder=1)
    ax.autoscale(False)


def _labels(ax, view, x, y, designs):
    """Labels of designs, the first ones first, each at the corner of its point where it covers fewest other points;
    those without room are left out."""
    placed = []
    scale = 72 / ax.figure.dpi
    spots = ax.transData.transform(np.column_stack([x, y])) * scale
    edge = ax.transAxes.transform([(0, 0), (1, 1)]) * scale

    def box(text, spot, corner):
        size = np.array([4.2 * len(text) + 8, 14])  # [points] of the label and its offset, in a font of 7 points
        return spot + np.minimum(0, corner * size), spot + np.maximum(0, corner * size)

    def crowded(low, high, spot):
        beyond = max(*(edge[0] - low), *(high - edge[1])) > 0
        own = np.all(spots == spot, axis=1)
        hidden = np.sum(np.all((spots > low) & (spots < high), axis=1) & ~own)
        return hidden + 100 * (beyond or any(np.all((low < other[1]) & (high > other[0])) for other in placed))

    for design in designs[:LABELLED]:
        spot, text = spots[design], literal(view.label(design))
        right, up = min(CORNERS, key=lambda corner: crowded(*box(text, spot, np.array(corner)), spot))
        found = box(text, spot, np.array((right, up)))
        if not placed or crowded(*found, spot) < 2:
            look = {"ha": "left" if right > 0 else "right", "va": "bottom" if up > 0 else "top"}
            ax.annotate(text, (x[design], y[design]), (7 * right, 4 * up), textcoords="offset points", fontsize=7,
                        zorder=2.5, bbox={"fc": "white", "alpha": 0.85, "lw": 0, "pad": 0.8}, **look)  # fmt: skip
            placed.append(found)
