"""Draws a contour: lines and arcs in two colours, the axis, the smallest radius, where a ball does not fit, a scale."""

import textwrap

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from milltools.base.text import literal, quantity
from milltools.figures.base import LOOK
from milltools.figures.style import COLOURS, INK, rounded_up

INK_OF = {"lines": COLOURS[2], "arcs": COLOURS[1], "narrow": COLOURS[3]}
MOST = 200  # places that are drawn


def draw(shape, title, ball=None, reach=0.0) -> Figure:
    """A figure of a contour; `ball`: diameter [m] of a ball, None: only the narrowest place is marked, if it is
    narrower than a tenth of the contour; `reach`: radius [m] of the circle that blades sweep in it, 0: none."""
    with matplotlib.rc_context(LOOK):
        low, high = shape.box
        size = float((high - low).max())
        figure = Figure(figsize=(7.2, 7.6))
        axes = figure.add_axes((0.01, 0.1, 0.98, 0.84))
        axes.set_axis_off()
        axes.set_aspect("equal")
        axes.set_title("\n".join(textwrap.wrap(literal(title, 120), 64)), fontsize=10)
        for is_arc, name in ((False, "lines"), (True, "arcs")):
            pieces = np.flatnonzero(shape.is_arc == is_arc)
            counts = np.clip(np.ceil(np.abs(shape.sweep[pieces]) / 0.05), 1, 200).astype(int)
            paths = [shape.points(np.full(n + 1, k), np.linspace(0, 1, n + 1)) for k, n in zip(pieces, counts)]
            if paths:
                axes.add_collection(LineCollection(paths, colors=INK_OF[name], linewidths=1.2, label=name))
        axes.plot([0], [0], ls="", marker="+", ms=12, color=INK, label="axis")
        if shape.is_arc.any():
            k = int(shape.radius.argmin())
            label = f"smallest radius, {quantity(shape.radius[k], 'm', 4)}"
            axes.plot(*shape.points(k, 0.5), ls="", marker="o", ms=9, mfc="none", color=INK_OF["arcs"], label=label)
        if reach:
            turn = np.linspace(0, 2 * np.pi, 361)
            way = reach * np.array([np.cos(turn), np.sin(turn)])
            axes.plot(*way, color=INK, lw=0.8, ls=(0, (5, 3)), label="reach of the blades")
        places = shape.narrow(ball / 2 if ball else size / 20)[0]
        if len(places):
            own = places[:MOST] if ball else places[:1]
            balls = [Circle((x, y), r) for x, y, r in own]
            axes.add_collection(PatchCollection(balls, facecolor=INK_OF["narrow"], alpha=0.6))
            label = f"narrowest place: a ball of {quantity(2 * places[0, 2], 'm', 4)} fits"
            axes.plot(*places[0, :2], ls="", marker="s", ms=11, mfc="none", color=INK_OF["narrow"], label=label)
        bar = rounded_up(size / 10)
        x, y = low[0], low[1] - 0.06 * size
        axes.plot([x, x + bar], [y, y], color=INK, lw=2.5, solid_capstyle="butt")
        axes.text(x, y - 0.012 * size, quantity(bar, "m"), va="top")
        axes.set_xlim(low[0] - 0.03 * size, high[0] + 0.03 * size)
        axes.set_ylim(y - 0.05 * size, high[1] + 0.03 * size)
        figure.legend(loc="lower left", ncols=3, bbox_to_anchor=(0.02, 0.01))
        return figure
