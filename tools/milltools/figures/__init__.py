"""The figures of a run, each under a name: `FIGURES["speeds"].draw(run)`.

    with Run("reference.h5") as run:
        for figure in FIGURES.values():
            if figure.why_not(run) is None:
                drawing = figure.draw(run)                 # a matplotlib Figure, in no window
                markup = svg(drawing, figure.name)         # to be put into a page
                numbers = figure.tables(run)               # what is drawn, in SI

`draw` and `tables` take one open Run or a list of them. See base.Figure; `mill plot` is this on the command line.
"""

from milltools.figures import flow, maps, overtime, spectra
from milltools.figures.base import Figure, Table
from milltools.figures.inline import svg

FIGURES: dict[str, Figure] = {
    figure.name: figure for figure in (*flow.FIGURES, *spectra.FIGURES, *maps.FIGURES, *overtime.FIGURES)
}

__all__ = ["FIGURES", "Figure", "Table", "svg"]
