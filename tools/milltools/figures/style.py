"""Common style of all pictures: colours, and saving of figures.

Nothing here chooses a backend or changes matplotlib's global settings, so figures of a notebook keep their style. All
drawing is done within `with matplotlib.rc_context(STYLE)`.
"""

import base64
import io
import math
import pathlib

import matplotlib
import numpy as np
from matplotlib import ticker
from matplotlib.colors import ListedColormap

from milltools.base.errors import UserError
from milltools.base.files import whole
from milltools.base.text import MINUS, decade, number

INK = "#1a1a1a"  # lines and letters; in an inline SVG the text colour of the page
# distinguishable with all kinds of colour vision (Okabe and Ito); lines differ too
COLOURS = (INK, "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
LINES = ("-", "--", "-.", ":")
# the colour map of the balls, in every picture of them: its lightness rises evenly from 32 to 91 (CIE L*), in grey and
# with all kinds of colour vision too; balls at rest are visible on black, the fastest ones on white
SPEEDS = ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.2, 1, 256)), "speeds")
# similar colours, with a contrast of at least 3 on white and on #111; grey for a rare kind
KIND_LOOK = {
    "ball_ball": ("#1f86c9", "-"),
    "ball_drum": ("#d55e00", (0, (6, 1.5))),
    "ball_wall": ("#009e73", (0, (6, 1.5, 1.5, 1.5))),
    "ball_shaft": ("#7f7f7f", (0, (1.5, 1.5))),
    "ball_blade": ("#b8609a", (0, (3, 1.2))),
    "all": (INK, "-"),
}
MORE = (("#b58900", (0, (8, 2))), ("#2aa1b3", (0, (4, 1, 1, 1))), ("#8a6d3b", (0, (2, 1))), ("#7b61c9", (0, (5, 3))))
SCALE_ENDS = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 10)  # of a scale of colours, times a power of ten
LARGE = 600_000  # bytes of an SVG in a page


def kind_look(kind: str, kinds=()) -> dict:
    """Colour and line of one of the `kinds` of a run; kinds of bodies get those that the other kinds do not use."""
    if kind in KIND_LOOK:
        colour, line = KIND_LOOK[kind]
    else:
        own = [k for k in kinds if k not in KIND_LOOK]
        free = [look for k, look in KIND_LOOK.items() if k not in (*kinds, "ball_ball", "all")]
        colour, line = ((*free, *MORE) * len(own))[own.index(kind)]
    return {"color": colour, "ls": line}


SMALL = 8.5  # [pt] the smallest letters: 11 px in the pages
STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # one name: it stands in every text of an SVG
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "legend.fontsize": SMALL,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "0.35",
    "axes.axisbelow": True,
    "svg.hashsalt": "millsim",  # the same picture is the same file
    "svg.fonttype": "none",  # text stays text
    "pdf.fonttype": 42,
    "hatch.linewidth": 0.6,
}


def run_style(number: int) -> dict:
    """Look of the line of a run among several."""
    line = LINES[(number // len(COLOURS) + (number > 0)) % len(LINES)]
    return {"color": COLOURS[number % len(COLOURS)], "ls": line, "lw": 1.4}


def beyond(values, low: float, high: float) -> str:
    """Which ends of a colour bar are triangles, because values lie beyond them: `extend` of Figure.colorbar."""
    return ("neither", "min", "max", "both")[(values < low).any() + 2 * (values > high).any()]


def log_ticks(axis, low: float = 0.0, high: float = np.inf, most: int = 8):
    """Labels at whole decades, of an axis from `low` to `high` that holds few of them at 2 and 5 times these too."""
    few = low > 0 and high < 100 * low
    axis.set_major_locator(ticker.LogLocator(10, (1, 2, 5) if few else (1,), numticks=most))
    axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: decade(value) or (number(value) if few else "")))
    axis.set_minor_formatter(ticker.NullFormatter())


def rounded_up(value: float) -> float:
    """The value rounded up to a short number, the end of a scale; 1 for 0."""
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{step * power:.3g}") for step in SCALE_ENDS if step * power >= value * (1 - 1e-12))


def log_marks(low: float, high: float) -> list[float]:
    """Numbers to write at a logarithmic scale: whole decades, of few ones also 2 and 5 times these."""
    tens = [10.0**k for k in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)]
    marks = [m * ten for ten in tens for m in ((1,) if len(tens) > 4 else (1, 2, 5))]
    return [mark for mark in marks if low * (1 - 1e-9) <= mark <= high * (1 + 1e-9)]


def millimetres(ax):
    """Writes the ticks of axes of lengths [m] in mm."""
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: f"{1e3 * value:.4g}".replace("-", MINUS)))


# ---- files


def save(figure, path, dpi=90, look=None):
    """Writes a figure, drawn with the settings `look`, whole or not at all; a name without a known format, or a full
    disk, is a UserError."""
    kind = pathlib.Path(path).suffix.lower().lstrip(".") or "png"
    known = figure.canvas.get_supported_filetypes()
    if kind not in known:
        raise UserError(f"{path}: no picture can be written as '{kind}': one of {', '.join(known)}")
    with matplotlib.rc_context(look or {}), whole(path) as draft:
        _write(figure, draft, kind, dpi)


def embedded(figure, dpi=150) -> str:
    """A figure as a data URL: an SVG, or a PNG if the SVG were larger than LARGE."""
    for kind in ("svg", "png"):
        store = io.BytesIO()
        _write(figure, store, kind, dpi)
        if store.tell() < LARGE:
            break
    return f"data:image/{'svg+xml' if kind == 'svg' else kind};base64,{base64.b64encode(store.getvalue()).decode()}"


def _write(figure, target, kind, dpi):
    """Writes a figure without dates and random names: the same picture is the same file."""
    dateless = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    with matplotlib.rc_context({"svg.hashsalt": "millsim"}):
        lay_out(figure, dpi)
        figure.savefig(target, format=kind, dpi=dpi, metadata=dateless)


def lay_out(figure, dpi):
    """Finds the layout of a figure. Figure.savefig draws a figure that has a layout engine twice: half of the time."""
    engine, figure.dpi = figure.get_layout_engine(), dpi
    if engine:
        engine.execute(figure)
        with matplotlib.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine(None)
