"""Shared by all pages of the mill command: the style, and templates that escape all texts."""

import base64
import hashlib
import html
import pathlib
import re

import jinja2

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import lines, plain

FOLDER = pathlib.Path(__file__).resolve().parent


def style(*more) -> str:
    """The shared style sheet, followed by those at the paths."""
    return "\n".join(pathlib.Path(path).read_text("utf-8") for path in (FOLDER / "style.css", *more))


def maker() -> str:
    """The version of millsim; "?" if it is not found."""
    try:
        return engine.version()
    except UserError:
        return "?"


def policy(scripts, more: str = "") -> str:
    """The Content-Security-Policy of a page that loads nothing and runs only these `scripts` (texts); `more`: other
    sources of scripts.

    Scripts are allowed by their hash. So a script in a text from a deck would not be executed even if it were not
    escaped."""
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts]
    run = " ".join([f"'sha256-{one}'" for one in hashes] + [more] * bool(more))
    return (
        f"default-src 'none'; script-src {run}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def declared(text: str) -> str:
    """The Content-Security-Policy that a page has in itself; that of a page that may do nothing, if it has none."""
    found = re.search(r'http-equiv="Content-Security-Policy" content="(.*?)"', text)
    return html.unescape(found[1]) if found else "default-src 'none'"


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
