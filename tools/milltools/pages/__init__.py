"""Shared by all pages of the mill command: the style, and templates that escape all texts."""

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
    """The shared style sheet, followed by those at the paths."""
    return "\n".join(pathlib.Path(path).read_text("utf-8") for path in (FOLDER / "style.css", *more))


def maker() -> str:
    """The version of millsim; "?" if it is not found."""
    try:
        return engine.version()
    except UserError:
        return "?"


def data_link(text: str) -> str:
    """A data URL of a text, so that the page contains it."""
    return "data:text/plain;charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def environment(*folders) -> jinja2.Environment:
    """Templates of the folders, and the shared ones; all texts are escaped, and a missing value is an error."""
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
    """A matplotlib figure as a data URL: an SVG, or, if that were larger than LARGE, a PNG with `dots` dots per
    inch."""
    import matplotlib  # not every page has figures

    for kind, mime, told in (("svg", "svg+xml", {"Date": None}), ("png", "png", None)):
        store = io.BytesIO()
        with matplotlib.rc_context({"svg.hashsalt": "millsim"}):  # the same figure always gives the same text
            figure.savefig(store, format=kind, dpi=dots, metadata=told)
        address = f"data:image/{mime};base64,{base64.b64encode(store.getvalue()).decode()}"
        if store.tell() < LARGE:
            break
    return address
