"""The comparison as one page: table and pictures in one file that opens from disk, everything from the runs escaped."""

import base64
import importlib.resources
import io
import os

import jinja2
import matplotlib.pyplot as plt

from milltools.compare import pictures, text
from milltools.compare.rows import deck_differences
from milltools.errors import UserError


def embedded(figure) -> str:
    """A figure as the data address of a PNG; it is closed."""
    store = io.BytesIO()
    figure.savefig(store, format="png", dpi=110)
    plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(store.getvalue()).decode()


def render(sides, tables, notes) -> str:
    """The page as text."""
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    source = importlib.resources.files(__package__).joinpath("page.html").read_text("utf-8")
    return environment.from_string(source).render(
        sides=sides,
        notes=[text.plain(note) for note in notes],
        deck=deck_differences(sides),
        tables=[
            {
                "title": text.title(table),
                "heads": text.heads(table),
                "rows": [(row, text.cells(row)) for row in table.rows],
            }
            for table in tables
        ],
        pictures=[(t, words, embedded(f)) for t, words, f in pictures.figures(sides)],
        plain=text.plain,
    )


def write(sides, tables, notes, path):
    """Writes the page; an old one is replaced as a whole."""
    page, part = render(sides, tables, notes), f"{path}.part"
    try:
        with open(part, "w", encoding="utf-8") as file:
            file.write(page)
        os.replace(part, path)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}", status=1) from None
