"""Common style of all pictures: colours, and saving of figures.

Nothing here chooses a backend or changes matplotlib's global settings, so figures of a notebook keep their style. All
drawing is done within `with matplotlib.rc_context(STYLE)`.
"""

import base64
import functools
import io
import math
import pathlib

import matplotlib
import numpy as np
from matplotlib import ticker
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.colors import ListedColormap
from matplotlib.lines import TICKDOWN, TICKLEFT
from matplotlib.transforms import Bbox

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


# ---- layout: that of matplotlib measures all texts twice, with every minor tick, and takes longer than the drawing

PAD, BESIDE, BAR = 0.06, 0.09, 0.13  # [inch] at borders; from axes to their colour bar; width of a colour bar
_renderer = functools.lru_cache(4)(functools.partial(RendererAgg, 1, 1))  # keeps the sizes of texts, for its dots/inch


def colour_bar(image, axes, **look):
    """A colour bar to the right of axes, in the order of their grid."""
    bar = axes[0].figure.colorbar(image, cax=axes[0].figure.add_axes((0.9, 0.2, 0.05, 0.5)), **look)
    bar.ax.beside = list(axes)
    bar.solids.set_rasterized(True)
    bar.ax.grid(False)
    return bar


def legend(figure, handles, labels, columns: int, place="lower left", rest=0.0, **look):
    """A legend outside of the axes, in fewer columns where it would be too wide. The figure grows if less than `rest`
    [inch] of its height would remain."""
    look = {"borderaxespad": 0, "columnspacing": 1.2, "frameon": False} | look
    for n in range(columns, 0, -1):
        made = figure.legend(handles, labels, loc=place, ncols=n, **look)
        size = made.get_window_extent(_renderer(figure.dpi)).size / figure.dpi
        if n == 1 or size[0] < figure.bbox.width / figure.dpi - PAD:
            break
        made.remove()
    if rest:
        figure.set_figheight(max(figure.get_figheight(), size[1] + rest))


def lay_out(figure):
    """Places the axes of a finished figure and of its subfigures, their colour bars, titles and legends."""
    for part in figure.subfigs:
        lay_out(part)
    own, pad, renderer = [ax for ax in figure.axes if ax.figure is figure], PAD * figure.dpi, _renderer(figure.dpi)
    frame, fraction = figure.bbox.padded(-pad), figure.transSubfigure.inverted()
    for one in (*figure.texts, *figure.legends):
        box = one.get_window_extent(renderer)
        top = box.y0 + box.y1 > figure.bbox.y0 + figure.bbox.y1
        x, y = fraction.transform((frame.x0, frame.y1 if top else frame.y0))
        one.set_y(y) if one in figure.texts else one.set_bbox_to_anchor((x, y), figure.transSubfigure)
        frame.y0, frame.y1 = frame.y0 + (box.height + pad) * (not top), frame.y1 - (box.height + pad) * top
    for ax in own:
        _fix_ticks(ax)
    grid, spans = own[0].get_gridspec() if own else figure.add_gridspec(), {}
    room = [np.zeros(n) for n in np.repeat(grid.get_geometry()[::-1], 2)]  # left, right of columns, above, below rows
    for ax in own:
        ax.minorticks_off()  # not before, because axes share them
        box, inner = ax.get_tightbbox(renderer, for_layout_only=True), ax.get_window_extent()
        around = inner.x0 - box.x0, box.x1 - inner.x1, box.y1 - inner.y1, inner.y0 - box.y0
        if hasattr(ax, "beside"):
            around = 0, around[1] + (BESIDE + BAR) * figure.dpi, 0, 0
        first, last = (one.get_subplotspec() for one in np.take(getattr(ax, "beside", [ax]), [0, -1]))
        spans[ax] = first.colspan.start, last.colspan.stop - 1, first.rowspan.start, last.rowspan.stop - 1
        for some, place, size in zip(room, spans[ax], around):
            some[place] = max(some[place], size)
    x = _spread(frame.x0, frame.x1, *room[:2], np.array(grid.get_width_ratios()), pad)
    y = _spread(-frame.y1, -frame.y0, *room[2:], np.array(grid.get_height_ratios()), pad)
    for ax, (left, right, top, bottom) in spans.items():
        ends = x[0][left], -y[1][bottom], x[1][right], -y[0][top]
        if hasattr(ax, "beside"):
            begin = max(one.get_window_extent().x1 for one in ax.beside) + BESIDE * figure.dpi
            ends = begin, ends[1], begin + BAR * figure.dpi, ends[3]
        ax.set_position(Bbox.from_extents(*ends).transformed(fraction))
        ax.apply_aspect()


def _spread(low, high, before, after, ratios, apart):
    """Begins and ends of intervals from low to high, as long as the `ratios` say, with room before and after each."""
    around = before + after + apart
    size = max(high - low - around.sum() + apart, 1) * ratios / ratios.sum()
    begin = low + before + np.cumsum(around + size) - around - size
    return begin, begin + size


def _fix_ticks(ax):
    """Fixes the ticks of axes, with powers of ten in their numbers. Of logarithmic axes, draws the minor ticks as one
    line of marks: each tick would be several objects of matplotlib."""
    ax.set(xlim=ax.get_xlim(), ylim=ax.get_ylim())
    for axis, marker, transform in (
        (ax.xaxis, TICKDOWN, ax.get_xaxis_transform()), (ax.yaxis, TICKLEFT, ax.get_yaxis_transform()),
    ):  # fmt: skip
        axis.set_major_locator(ticker.FixedLocator(axis.get_majorticklocs()))
        axis.get_major_formatter().format_ticks(axis.get_majorticklocs())
        if axis.get_major_formatter().get_offset():
            axis.set_major_formatter(ticker.FuncFormatter(lambda value, _: number(value, 6)))
        if axis.get_scale() == "log" and not hasattr(ax, "beside"):
            low, high = sorted(axis.get_view_interval())
            places = [place for place in axis.get_minorticklocs() if low <= place <= high]
            points = (places, [0] * len(places))[:: 1 if axis is ax.xaxis else -1]
            look = {"color": matplotlib.rcParams["xtick.color"], "ms": 2, "mew": 0.6, "label": "_minor"}
            ax.plot(*points, ls="", marker=marker, transform=transform, clip_on=False, in_layout=False, **look)


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
        figure.savefig(target, format=kind, dpi=dpi, metadata=dateless)
