"""The common parts of all pictures of a study: colours, names escaped for matplotlib, axes with units."""

import re
import textwrap

import contourpy
import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from milltools.base.text import literal
from milltools.figures import style
from milltools.study.show.data import TURNING

COLOURS = "viridis"  # perceptually uniform, also in grey and for colour-blind readers
LINES = (*style.COLOURS[1:], style.COLOURS[0])
MARKS = ("o", "s", "^", "D", "v", "P", "X")
INK = style.INK
OVER = "#b3261e"  # the limit of a requirement
STYLE = {**style.STYLE, "svg.fonttype": "path"}


def new(width: float, height: float) -> Figure:
    """An empty figure [inch] in the common style, without a window."""
    matplotlib.rcParams.update(STYLE)
    figure = Figure(figsize=(width, height), layout="none")
    FigureCanvasAgg(figure)
    return figure


def title(figure, text):
    text = broken(text.replace("+-", "\N{PLUS-MINUS SIGN}"), int(13 * figure.get_figwidth()))
    figure.suptitle(text, fontsize=9.5, x=0.01, ha="left")


def legend(figure, handles, columns: int):
    """A legend below the figure, of `handles` with their labels; with it the figure is complete."""
    handles = list(handles)
    style.legend(figure, handles, [handle.get_label() for handle in handles], columns)
    style.lay_out(figure)


def forbidden(one) -> dict:
    """The look of the area that a requirement forbids, with its label."""
    return {"fc": OVER, "alpha": 0.1, "lw": 0, "zorder": 0, "label": literal(f"does not meet {one.text}", 70)}


def value_label(objective, width: int = 30) -> str:
    """The name and unit, broken into lines."""
    return broken(objective.words + objective.scale.bracket, width)


def broken(text, width: int) -> str:
    """A literal text in lines of at most `width` characters, at most four of them."""
    # keep a number with its unit and its error, a name with its bracket
    bound = re.sub(r"(?<=\d) (?=[^\W\d])| (?=[\[=±])|(?<=[=±]) ", "\N{NO-BREAK SPACE}", literal(text, 4 * width))
    return "\n".join(textwrap.wrap(bound, width)[:4])


def places(axis, values) -> np.ndarray:
    """The places of values of a key on its axis: in its scale; words by their number."""
    if not axis.numeric:
        return np.array([axis.choices.index(v) for v in values], float)
    return np.asarray(values, float) / axis.drawn.size


def dress(ax, axis, which: str):
    """Label, unit, ticks and logarithm of a varied key on "x" or "y"; along x, angles and angular speeds
    without a unit in the study deck have a second axis, on the opposite side, with the other unit (rpm or degrees)."""
    line = getattr(ax, f"{which}axis")
    ax.set(**{f"{which}label": literal(axis.words + (axis.drawn.bracket if axis.numeric else ""))})
    if not axis.numeric:
        line.set_ticks(range(len(axis.choices)), [literal(c, 20) for c in axis.choices])
        return
    if axis.log:
        ax.set(**{f"{which}scale": "log"})
        line.set_minor_formatter(matplotlib.ticker.NullFormatter())
        line.set_major_locator(matplotlib.ticker.LogLocator(10, (1, 2, 5)))
        line.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    elif axis.whole:
        line.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    if which == "x" and axis.unit in TURNING and not axis.said:
        ratio = axis.scale.size / axis.drawn.size
        beside = ax.secondary_xaxis("top", functions=(lambda v: v / ratio, lambda v: v * ratio))
        beside.set_xlabel(f"[{axis.scale.unit}]")


def edges(values, log: bool = False) -> np.ndarray:
    """Borders of cells about sorted values: halfway between neighbours."""
    v = np.log(values) if log else np.asarray(values, float)
    first, last = (v[1] - v[0], v[-1] - v[-2]) if len(v) > 1 else (1, 1)
    wide = np.array([v[0] - first, *v, v[-1] + last])
    e = (wide[1:] + wide[:-1]) / 2
    return np.exp(e) if log else e


def outline(mask, x, y) -> list[np.ndarray]:
    """Borders of the cells where mask[row, column] holds, as closed lines of shape (points, 2); x, y: edges of the
    cells."""
    # four corners for each cell, so that the step between two neighbours has no width
    at = [np.repeat([ends[0], *ends, ends[-1]], 2)[1:-1] for ends in (x, y)]
    corners = np.pad(mask, 1).astype(float).repeat(2, axis=0).repeat(2, axis=1)
    return contourpy.contour_generator(*at, corners).lines(0.5)
