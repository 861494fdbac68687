"""What all pictures of a study share: colours, names as matplotlib must show them, axes with units, figures into files."""

import pathlib
import re
import textwrap

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from milltools.base.files import whole
from milltools.base.text import literal
from milltools.figures import style
from milltools.study.show.data import TURNING, Scale

COLOURS = "viridis"  # even for the eye, in grey, and for all kinds of colour vision
LINES = (*style.COLOURS[1:], style.COLOURS[0])
MARKS = ("o", "s", "^", "D", "v", "P", "X")
INK = style.INK
STYLE = {**style.STYLE, "svg.fonttype": "path"}


def new(width: float, height: float) -> Figure:
    """An empty figure [inch] in the style of all, in no window."""
    matplotlib.rcParams.update(STYLE)
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def title(figure, text):
    figure.suptitle(broken(text.replace("+-", "\N{PLUS-MINUS SIGN}"), 110), fontsize=9.5, x=0.01, ha="left")


def legend(figure, handles, columns: int):
    """Below everything; `handles` with their labels."""
    figure.legend(handles=list(handles), loc="outside lower left", ncols=columns, frameon=False)


def value_label(objective, width: int = 30) -> str:
    """Its name and unit, broken into lines."""
    return broken(objective.words + objective.scale.bracket, width)


def broken(text, width: int) -> str:
    """A literal text in lines of at most `width` characters, at most four of them."""
    # a number stays with its unit, a name with its bracket
    bound = re.sub(r"(?<=\d) (?=[^\W\d])| (?=[\[=])|(?<==) ", "\N{NO-BREAK SPACE}", literal(text, 4 * width))
    lines = textwrap.wrap(bound, width)
    return "\n".join(lines[:4])


def places(axis, values) -> np.ndarray:
    """Where values of a key stand on its axis: in its scale, words by their number."""
    if not axis.numeric:
        return np.array([axis.choices.index(v) for v in values], float)
    return np.asarray(values, float) / axis.drawn.size


def dress(ax, axis, which: str, second: bool = True):
    """Label, unit, ticks and logarithm of a varied key on "x" or "y"; angles and angular speeds have the other unit, SI or rpm,
    on the other side."""
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
    if second and axis.unit in TURNING:
        other = axis.scale if axis.drawn.unit == axis.unit else Scale(unit=axis.unit)
        ratio = other.size / axis.drawn.size
        make, side = (ax.secondary_xaxis, "top") if which == "x" else (ax.secondary_yaxis, "right")
        if other.unit != axis.drawn.unit:
            beside = make(side, functions=(lambda v: v / ratio, lambda v: v * ratio))
            beside.set(**{f"{which}label": f"[{other.unit}]"})


def edges(values, log: bool = False) -> np.ndarray:
    """Borders of cells about sorted values: halfway between neighbours."""
    v = np.log(values) if log else np.asarray(values, float)
    if len(v) == 1:
        e = np.array([v[0] - 0.5, v[0] + 0.5])
    else:
        middle = (v[1:] + v[:-1]) / 2
        e = np.concatenate([[2 * v[0] - middle[0]], middle, [2 * v[-1] - middle[-1]]])
    return np.exp(e) if log else e


def outline(mask, x, y) -> list[np.ndarray]:
    """Borders of the cells where mask[row, column] holds, as closed lines of shape (points, 2); x, y: edges of the cells."""
    wide = np.pad(mask, 1).astype(int)
    onward = {}  # from corner (row, column) to the next ones, the cells to the left
    for r, c in np.argwhere(np.diff(wide[1:-1], axis=1)):
        up = wide[r + 1, c] > wide[r + 1, c + 1]
        onward.setdefault((r + (not up), c), []).append((r + up, c))
    for r, c in np.argwhere(np.diff(wide[:, 1:-1], axis=0)):
        left = wide[r, c + 1] > wide[r + 1, c + 1]
        onward.setdefault((r, c + left), []).append((r, c + (not left)))
    loops = []
    while onward:
        start = here = next(iter(onward))
        loop = [here]
        while True:
            ends = onward[here]
            here_next = ends.pop()
            if not ends:
                del onward[here]
            here = here_next
            loop.append(here)
            if here == start:
                break
        loops.append(np.array([(x[c], y[r]) for r, c in loop]))
    return loops


def beside(path: str, kind: str) -> str:
    """NAME-kind.png for NAME.png."""
    path = pathlib.Path(path)
    return str(path.with_name(f"{path.stem}-{kind}{path.suffix}"))


def write(figure, path: str):
    style.save(figure, path, dpi=200)


def write_pages(makers, path: str):
    """Figures, one a page of a PDF."""
    with whole(path) as draft, PdfPages(draft, metadata={"CreationDate": None}) as pages:
        for make in makers:
            pages.savefig(make())
