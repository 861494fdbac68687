"""What all pages of the mill command share: one style, templates that escape everything."""

import pathlib

import jinja2

from milltools.base.text import plain

FOLDER = pathlib.Path(__file__).resolve().parent


def style(*more) -> str:
    """The house's style sheet, and those of the paths after it."""
    return "\n".join(pathlib.Path(path).read_text("utf-8") for path in (FOLDER / "style.css", *more))


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
