"""What all pages of the mill command share: one style, templates that escape everything, files written as a whole."""

import os
import pathlib

import jinja2

from milltools.compare.text import plain
from milltools.errors import UserError

FOLDER = pathlib.Path(__file__).resolve().parent


def lines(text) -> str:
    """The same of a text of several lines."""
    return "".join(c if c.isprintable() or c in "\n\t" else "?" for c in str(text))


def style(*more) -> str:
    """The house's style sheet, and those of the paths after it."""
    return "\n".join(
        pathlib.Path(path).read_text("utf-8") for path in (FOLDER / "style.css", *more)
    )


def environment(*folders) -> jinja2.Environment:
    """Templates of the folders, and the shared ones; whatever they show is escaped, whatever is missing is an error."""
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*map(str, folders), str(FOLDER)]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters["plain"] = plain
    return found


def write(path, text: str):
    """Writes a page; an old one is replaced as a whole. A full disk is a UserError."""
    part = f"{path}.part"
    try:
        with open(part, "w", encoding="utf-8", errors="replace") as file:
            file.write(text)
        os.replace(part, path)
    except BaseException as fault:
        try:
            os.unlink(part)
        except OSError:
            pass
        if isinstance(fault, OSError):
            raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None
        raise
