"""Figures of a run for scripts and notebooks: those of `mill plot` and of the report."""

import importlib
import os

import matplotlib

from milltools.base.errors import UserError
from milltools.figures import FIGURES, spectra
from milltools.figures.base import LOOK


def spectrum(run, ax, options):
    """The impact spectra in axes of one's own, or in new ones of pyplot with a legend."""
    if ax is not None:
        with matplotlib.rc_context(LOOK):
            spectra.plot(ax, run, **options)
        return ax
    import matplotlib.pyplot as plt

    with matplotlib.rc_context(LOOK):
        figure, ax = plt.subplots(layout="constrained")
        live = plt.isinteractive()  # a notebook's backend says so with the first figure; the context takes it back
        try:
            spectra.plot(ax, run, **options)
        except BaseException:
            plt.close(figure)  # or a notebook shows it, empty
            raise
        figure.legend(fontsize="small", loc="outside lower left", ncols=2)
    matplotlib.interactive(live)
    return ax


def draw(name, runs, options):
    """A figure by its name in FIGURES."""
    if name not in FIGURES:
        raise UserError(f"unknown figure '{name}': one of {', '.join(FIGURES)}")
    _shown_inline()
    return FIGURES[name].draw(runs, **options)


def _shown_inline():
    """A notebook's backend teaches it to show figures when it is imported, which drawing without pyplot does not do."""
    backend = os.environ.get("MPLBACKEND", "")
    if "inline" in backend:
        importlib.import_module(backend.removeprefix("module://"))
