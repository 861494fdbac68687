"""The figures of a run, each under a name: `FIGURES["speeds"].draw(run)`.

    with Run("reference.h5") as run:
        for figure in FIGURES.values():
            if figure.why_not(run) is None:
                drawing = figure.draw(run)                 # a matplotlib Figure, without a window
                markup = svg(drawing, figure.name)         # SVG for a web page
                numbers = figure.tables(run)               # the numbers drawn, in SI

`draw` and `tables` take one open Run or a list of runs. See base.Figure; on the command line use `mill plot`.
"""

__all__ = ["FIGURES", "Columns", "Figure", "svg"]


def __getattr__(name):
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # these import matplotlib, which 'mill plot --help' does not need
    from milltools.figures import base, charge, flow, inline, liner, maps, overtime, spectra, wear

    every = (*flow.FIGURES, *charge.FIGURES, *spectra.FIGURES, *maps.FIGURES, *wear.FIGURES, *liner.FIGURES)
    every += overtime.FIGURES
    found = {"FIGURES": {figure.name: figure for figure in every}, "svg": inline.svg}
    globals().update(found, Columns=base.Columns, Figure=base.Figure)
    return globals()[name]
