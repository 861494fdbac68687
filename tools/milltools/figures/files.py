"""Figures and their numbers into files."""

import csv

import matplotlib
import numpy as np

from milltools.figures.base import LOOK, Table
from milltools.style import save, whole

DOTS = 200  # per inch, of a PNG and of the fields of maps


def picture(figure, path):
    """A figure as .png, .svg or .pdf, on white."""
    with matplotlib.rc_context(LOOK):
        save(figure, path, dpi=DOTS)


def numbers(tables: list[Table], path):
    """Tables with the same heads as one CSV file, to the last digit; of several runs with their names in front. What is
    not known is empty."""

    def write(part):
        with open(part, "w", newline="", encoding="utf-8") as file:
            out = csv.writer(file, lineterminator="\n")
            several = len(tables) > 1
            out.writerow((["run"] if several else []) + list(tables[0].columns))
            for table in tables:
                for row in zip(*table.columns.values()):
                    out.writerow(([table.name] if several else []) + [_cell(v) for v in row])

    whole(path, write)


def _cell(value) -> str:
    if isinstance(value, str):
        return str(value)
    if isinstance(value, (np.integer, int)):
        return str(int(value))
    value = float(value)
    return "" if np.isnan(value) else repr(value)
