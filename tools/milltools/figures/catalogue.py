"""All figures by their names."""

from milltools.figures import flow, maps, overtime, spectra
from milltools.figures.base import Columns, Figure
from milltools.figures.inline import svg

FIGURES: dict[str, Figure] = {
    figure.name: figure for figure in (*flow.FIGURES, *spectra.FIGURES, *maps.FIGURES, *overtime.FIGURES)
}

__all__ = ["FIGURES", "Columns", "Figure", "svg"]
