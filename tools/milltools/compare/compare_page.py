"""The comparison as one page: table and pictures in one file that opens from disk, everything from the runs escaped."""

import base64
import io
import pathlib

import matplotlib.pyplot as plt

from milltools import pages
from milltools.base.files import write_text
from milltools.base.text import plain
from milltools.compare import pictures
from milltools.compare import terminal as text
from milltools.compare.rows import deck_differences


def embedded(figure) -> str:
    """A figure as the data address of a PNG; it is closed."""
    store = io.BytesIO()
    figure.savefig(store, format="png", dpi=110)
    plt.close(figure)
    return "data:image/png;base64," + base64.b64encode(store.getvalue()).decode()


def shown(table) -> dict:
    """A table as pages/compared.html takes it."""
    return {
        "title": text.title(table),
        "heads": text.heads(table),
        "rows": [(row, text.cells(row)) for row in table.rows],
    }


def render(sides, tables, notes) -> str:
    """The page as text."""
    template = pages.environment(pathlib.Path(__file__).parent).get_template("page.html")
    return template.render(
        style=pages.style(),
        sides=sides,
        notes=[plain(note) for note in notes],
        deck=deck_differences(sides),
        tables=[shown(table) for table in tables],
        pictures=[(t, words, embedded(f)) for t, words, f in pictures.figures(sides)],
    )


def write(sides, tables, notes, path):
    """Writes the page; an old one is replaced as a whole."""
    write_text(path, render(sides, tables, notes))
