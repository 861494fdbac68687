"""What all pages of the mill command share: one style, templates that escape everything."""

import base64
import io
import pathlib

import jinja2

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import lines, plain

FOLDER = pathlib.Path(__file__).resolve().parent
LARGE = 600_000  # bytes of an SVG


def style(*more) -> str:
    """The house's style sheet, and those of the paths after it."""
    return "\n".join(pathlib.Path(path).read_text("utf-8") for path in (FOLDER / "style.css", *more))


def maker() -> str:
    """The version of the tools; unknown where there is no engine beside them."""
    try:
        return engine.version()
    except UserError:
        return "?"


def data_link(text: str) -> str:
    """The address of a text that a page holds itself."""
    return "data:text/plain;charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def environment(*folders) -> jinja2.Environment:
    """Templates of the folders, and the shared ones; whatever they show is escaped, whatever is missing is an error."""
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*map(str, folders), str(FOLDER)]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters |= {"plain": plain, "lines": lines}
    return found


def embedded(figure, dots: int = 150) -> str:
    """A matplotlib figure as a data address: of an SVG, or of a PNG of so many dots per inch where an SVG would be a
    large one."""
    import matplotlib  # not every page has figures

    for kind, mime, told in (("svg", "svg+xml", {"Date": None}), ("png", "png", None)):
        store = io.BytesIO()
        with matplotlib.rc_context({"svg.hashsalt": "millsim"}):  # the same figure is the same text
            figure.savefig(store, format=kind, dpi=dots, metadata=told)
        address = f"data:image/{mime};base64,{base64.b64encode(store.getvalue()).decode()}"
        if store.tell() < LARGE:
            break
    return address
