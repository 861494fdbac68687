"""Figures and their numbers into files."""

import matplotlib

from milltools.base.files import write_csv
from milltools.figures.base import LOOK, Table
from milltools.figures.style import save

DOTS = 200  # per inch, of a PNG and of the fields of maps


def picture(figure, path):
    """A figure as .png, .svg or .pdf, on white."""
    with matplotlib.rc_context(LOOK):
        save(figure, path, dpi=DOTS)


def numbers(tables: list[Table], path):
    """Tables with the same heads as one CSV file, to the last digit; of several runs with their names in front. What is
    not known is empty."""

    several = len(tables) > 1
    head = (["run"] if several else []) + list(tables[0].columns)
    rows = ([table.name] * several + list(row) for table in tables for row in zip(*table.columns.values()))
    write_csv(path, head, rows)
