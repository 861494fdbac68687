"""The figures of a report: those of milltools.figures, as SVG that is part of the page."""

import dataclasses

from markupsafe import escape

from milltools import figures
from milltools.base.errors import UserError


@dataclasses.dataclass(frozen=True)
class Picture:
    """`svg` is empty where it cannot be drawn; then `why` says so."""

    name: str
    title: str
    caption: str
    svg: str
    why: str = ""


def names(group: str) -> list[str]:
    """Of the figures that belong to a group: "spectra", "energy", "maps", "time"."""
    return [name for name, figure in figures.FIGURES.items() if figure.group == group]


def draw(name: str, runs, prefix: str = "figure") -> Picture:
    """A figure of one open run, or of several together."""
    figure = figures.FIGURES[name]
    runs = runs if isinstance(runs, list) else [runs]
    for run in runs:
        why = figure.why_not(run)
        if why:
            who = f"{run.path}: " if len(runs) > 1 else ""
            return Picture(name, figure.title, figure.caption, "", f"{who}{why}")
    try:
        drawing, caption = figure.draw(runs, titled=False), figure.says(runs)
    except UserError as fault:
        return Picture(name, figure.title, figure.caption, "", str(fault))
    markup = figures.svg(drawing, f"{prefix}-{name}")
    label = escape(f"{figure.title}: {caption}")
    markup = markup.replace('role="img"', f'role="img" aria-label="{label}"', 1)
    return Picture(name, figure.title, caption, markup)
