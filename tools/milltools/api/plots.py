"""Figures of a run for scripts and notebooks: those of `mill plot` and of the report."""

from milltools.figures import spectra


def spectrum(run, ax, options):
    """The impact spectra in axes of one's own, or in new ones of pyplot."""
    run.need_statistics()
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots(layout="constrained")[1]
    spectra.plot(ax, run, **options)
    return ax
