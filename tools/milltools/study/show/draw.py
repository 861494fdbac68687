"""What all pictures of a study share: colours, names as matplotlib must show them, axes with units, figures into files."""

import pathlib
import re
import textwrap

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import literal
from milltools.figures import style
from milltools.figures.command import save
from milltools.study.show.data import Scale, scale_of

FORMATS = (".png", ".svg", ".pdf")
COLOURS = "viridis"  # even for the eye, in grey, and for all kinds of colour vision
# told apart by all kinds of colour vision (Okabe and Ito)
LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
MARKS = ("o", "s", "^", "D", "v", "P", "X")
INK = "#1a1a1a"
STYLE = {**style.STYLE, "svg.fonttype": "path"}


def new(width: float, height: float):
    """An empty figure [inch] in the style of all."""
    plt.rcParams.update(STYLE)
    return plt.figure(figsize=(width, height), layout="constrained")


def value_scale(objective) -> Scale:
    return scale_of(objective.unit, (1.0,), turning=False)


def value_label(objective, width: int = 30) -> str:
    """Its name and unit, broken into lines."""
    return broken(objective.words + value_scale(objective).bracket, width)


def broken(text, width: int) -> str:
    """A literal text in lines of at most `width` characters, at most four of them."""
    # a number stays with its unit, a name with its bracket
    bound = re.sub(r"(?<=\d) (?=[^\W\d])| (?=[\[=])|(?<==) ", "\N{NO-BREAK SPACE}", literal(text, 4 * width))
    lines = textwrap.wrap(bound, width)
    return "\n".join(lines[:4])


def axis_scale(axis) -> Scale:
    """SI or its multiples, on every axis of every picture."""
    return scale_of(axis.unit, axis.span, turning=False) if axis.numeric else Scale()


def places(axis, values) -> np.ndarray:
    """Where values of a key stand on its axis: in its scale, words by their number."""
    if not axis.numeric:
        return np.array([axis.choices.index(v) for v in values], float)
    return np.asarray(values, float) / axis_scale(axis).size


def dress(ax, axis, which: str, second: bool = True):
    """Label, unit, ticks and logarithm of a varied key on "x" or "y"; angular speeds get rpm on the other side."""
    line = ax.xaxis if which == "x" else ax.yaxis
    set_label = ax.set_xlabel if which == "x" else ax.set_ylabel
    set_label(literal(axis.words + (axis_scale(axis).bracket if axis.numeric else "")))
    if not axis.numeric:
        line.set_ticks(range(len(axis.choices)), [literal(c, 20) for c in axis.choices])
        return
    if axis.log:
        (ax.set_xscale if which == "x" else ax.set_yscale)("log")
        line.set_minor_formatter(matplotlib.ticker.NullFormatter())
        line.set_major_locator(matplotlib.ticker.LogLocator(10, (1, 2, 5)))
        line.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    elif axis.whole:
        line.set_major_locator(matplotlib.ticker.MaxNLocator(integer=True, steps=[1, 2, 5, 10]))
    friendly = axis.scale
    if second and friendly.unit != axis_scale(axis).unit:
        ratio = friendly.size / axis_scale(axis).size
        make = ax.secondary_xaxis if which == "x" else ax.secondary_yaxis
        other = make("top" if which == "x" else "right", functions=(lambda v: v / ratio, lambda v: v * ratio))
        (other.set_xlabel if which == "x" else other.set_ylabel)(f"[{friendly.unit}]")


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


def check_name(path: str):
    if pathlib.Path(path).suffix.lower() not in FORMATS:
        raise UserError(f"{path}: expected a name that ends in {', '.join(FORMATS)}")


def beside(path: str, kind: str) -> str:
    """NAME-kind.png for NAME.png."""
    path = pathlib.Path(path)
    return str(path.with_name(f"{path.stem}-{kind}{path.suffix}"))


def write(figure, path: str):
    save(figure, path, dpi=200)


def write_pages(makers, path: str):
    """Figures, one a page of a PDF."""
    from matplotlib.backends.backend_pdf import PdfPages

    try:
        with PdfPages(path) as pages:
            for make in makers:
                figure = make()
                pages.savefig(figure)
                plt.close(figure)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None
