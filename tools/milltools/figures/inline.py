"""A figure as inline SVG of a page. It takes the text colour of the page, so it suits light and dark pages."""

import io
import re

import matplotlib
from matplotlib.backends.backend_svg import FigureCanvasSVG

from milltools.figures.base import LOOK
from milltools.figures.style import INK

_TAG = re.compile(r"<[^>]*>")  # a ">" in an attribute is written as &gt;
_ID = re.compile(r'\s+id="([^"]*)"')
_USED = re.compile(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"")
DPI = 144  # of the fields of maps, the only part that is an image


def svg(figure, prefix: str) -> str:
    """Inline SVG of a figure of this package: text as text, no background, INK as currentColor, the width of the page.
    Every id begins with `prefix` (letters, digits, "-", "_"; different for each figure of a page). matplotlib escapes
    names from files. There are no scripts and no external links."""
    if not re.fullmatch(r"[A-Za-z][\w-]*", prefix):
        raise ValueError(f"not a valid prefix of an id: {prefix!r}")
    text = _drawn(figure)
    text = text[text.index("<svg") :]
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, count=1, flags=re.S)
    used = {a or b for a, b in _USED.findall("".join(_TAG.findall(text)))}
    text = _TAG.sub(lambda tag: _own(tag[0], used, prefix), text)
    head, body = text.split(">", 1)
    box, width = re.search(r'viewBox="\S+ \S+ (\S+) [^"]*"', head).group(0, 1)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {box} '
        f'class="figure" style="width:100%;max-width:{float(width) * 4 / 3:.0f}px;height:auto" role="img"'
    )
    body = re.sub(r"<!--.*?-->", "", body, flags=re.S)
    return f"{head}>" + re.sub(r">\s+<", "><", body)  # without line ends and indentation


def _drawn(figure) -> str:
    out, nothing = io.StringIO(), dict.fromkeys(("Date", "Creator", "Format", "Type"))
    with matplotlib.rc_context(LOOK):
        canvas = FigureCanvasSVG(figure)
        figure.dpi = DPI
        for patch in (figure.patch, *(ax.patch for ax in figure.axes)):
            patch.set(facecolor="none", edgecolor="none")
        canvas.print_svg(out, metadata=nothing)
    return out.getvalue()


def _own(tag: str, used: set, prefix: str) -> str:
    """A tag with the text colour of the page and prefixed ids; ids that are not used are removed."""
    tag = _ID.sub(lambda m: f' id="{prefix}-{m[1]}"' if m[1] in used else "", tag)
    tag = tag.replace("url(#", f"url(#{prefix}-").replace('href="#', f'href="#{prefix}-')
    return tag.replace(INK, "currentColor")
