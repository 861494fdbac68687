"""What pictures share: colours, names as matplotlib must show them, numbers and their units, figures into files.

Nothing here chooses a backend or touches matplotlib's own settings, so that a notebook's figures stay its own: who draws
does it within `with matplotlib.rc_context(STYLE)`.
"""

import os
import pathlib

import matplotlib
import numpy as np
from matplotlib import ticker

from milltools.errors import UserError

INK = "#1a1a1a"  # lines and letters; the page's own ink in an inline SVG
# told apart by all kinds of colour vision (Okabe and Ito), and by the line
COLOURS = ("#000000", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
LINES = ("-", "--", "-.", ":")
# near them, with a contrast of 3 and more on white as on #111; grey for what is rare
KIND_LOOK = {
    "ball_ball": ("#1f86c9", "-"),
    "ball_drum": ("#d55e00", (0, (6, 1.5))),
    "ball_wall": ("#009e73", (0, (6, 1.5, 1.5, 1.5))),
    "ball_shaft": ("#7f7f7f", (0, (1.5, 1.5))),
    "ball_blade": ("#b8609a", (0, (3, 1.2))),
    "all": (INK, "-"),
}
MORE = (
    ("#b58900", (0, (8, 2))),
    ("#2aa1b3", (0, (4, 1, 1, 1))),
    ("#8a6d3b", (0, (2, 1))),
    ("#7b61c9", (0, (5, 3))),
)


def kind_look(kind: str, kinds=()) -> dict:
    """Colour and line of one of a run's `kinds`; of bodies those that no other kind of the run has, in their order."""
    if kind in KIND_LOOK:
        colour, line = KIND_LOOK[kind]
    else:
        own = [k for k in kinds if k not in KIND_LOOK]
        free = [look for k, look in KIND_LOOK.items() if k not in (*kinds, "ball_ball", "all")]
        colour, line = ((*free, *MORE) * len(own))[own.index(kind)]
    return {"color": colour, "ls": line}


STYLE = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # one name: it stands in every text of an SVG
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "0.35",
    "axes.axisbelow": True,
    "svg.hashsalt": "millsim",  # the same picture is the same file
    "svg.fonttype": "none",  # text stays text
    "pdf.fonttype": 42,
    "hatch.linewidth": 0.6,
}


def literal(text, most: int = 60) -> str:
    """A name as matplotlib must show it: no mathematics, no characters that steer, not too long."""
    text = "".join(c if c.isprintable() else "?" for c in str(text))
    if len(text) > most:
        text = text[: most // 2 - 1] + "..." + text[-(most // 2 - 2) :]
    # matplotlib leaves out of legends what begins with "_"; a mark of no width in front keeps it
    text = "\N{WORD JOINER}" * text.startswith("_") + text
    return text.replace("\\", "/").replace("$", r"\$")


def run_style(number: int) -> dict:
    """Look of the line of a run among several."""
    line = LINES[(number // len(COLOURS) + (number > 0)) % len(LINES)]
    return {"color": COLOURS[number % len(COLOURS)], "ls": line, "lw": 1.4}


# ---- numbers

SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def number(value: float, digits: int = 3) -> str:
    """A number in plain letters, as in 862, 0.0123 and 7.17×10⁶."""
    if not np.isfinite(value):
        return "?"
    text = f"{value:.{digits}g}"
    if "e" not in text and (value == 0 or 1e-3 <= abs(value)):
        return text.replace("-", "−")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    exponent = int(exponent)
    if 0 <= exponent < 4:  # 1.23e+03
        return f"{value:.0f}".replace("-", "−")
    return f"{mantissa}×10{str(exponent).translate(SUPERSCRIPT)}".replace("-", "−")


PREFIXES = {9: "G", 6: "M", 3: "k", 0: "", -3: "m", -6: "µ", -9: "n", -12: "p"}


def quantity(value: float, unit: str) -> str:
    """A number of three digits with its unit and prefix, as in 862 W and 31.4 µW."""
    if value == 0 or not np.isfinite(value):
        return f"{number(value)} {unit}"
    power = int(np.floor(np.log10(float(f"{abs(value):.2e}")) / 3)) * 3
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    return f"{number(value / 10.0**power)} {PREFIXES[power]}{unit}"


def decade(value, _=None) -> str:
    """Label of a tick of a logarithmic axis at a whole decade, in plain letters: matplotlib's own are mathematics."""
    exponent = np.log10(value)
    if abs(exponent - round(exponent)) > 1e-6:
        return ""
    exponent = int(round(exponent))
    return f"{value:g}" if -3 <= exponent <= 2 else "10" + str(exponent).translate(SUPERSCRIPT)


def log_ticks(axis, low: float = 0.0, high: float = np.inf, most: int = 8):
    """Labels at whole decades, of an axis from `low` to `high` that holds few of them at 2 and 5 times these too."""
    few = low > 0 and high < 100 * low
    axis.set_major_locator(ticker.LogLocator(10, (1, 2, 5) if few else (1,), numticks=most))
    axis.set_major_formatter(ticker.FuncFormatter(_some if few else decade))
    axis.set_minor_formatter(ticker.NullFormatter())


def _some(value, _=None) -> str:
    return decade(value) or number(value)


# ---- files


def whole(path, write):
    """Has write(part) make a file beside `path` that takes its place when it is whole; a fault of the disk is a UserError."""
    path = pathlib.Path(path)
    part = path.with_name(f"{path.name}.part")
    try:
        write(part)
        os.replace(part, path)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None
    finally:
        part.unlink(missing_ok=True)


def save(figure, path, dpi=90):
    """Writes a figure, whole or not at all; a name without a known format, or a full disk, is a UserError."""
    kind = pathlib.Path(path).suffix.lower().lstrip(".") or "png"
    known = figure.canvas.get_supported_filetypes()
    if kind not in known:
        raise UserError(f"{path}: no picture can be written as '{kind}': one of {', '.join(known)}")
    # no dates: the same picture is the same file
    dateless = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)

    def write(name):
        figure.savefig(name, dpi=dpi, format=kind, metadata=dateless)

    with matplotlib.rc_context({"svg.hashsalt": "millsim"}):
        whole(path, write)
