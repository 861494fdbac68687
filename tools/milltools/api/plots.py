"""Pictures of a run for scripts and notebooks: the figures of `mill plot`, and the player of the report."""

from __future__ import annotations

import html
import importlib
import os
import pathlib
import tempfile
import webbrowser
from typing import TYPE_CHECKING, Any

import matplotlib

from milltools.base.errors import InputError
from milltools.base.files import write_text
from milltools.base.progress import in_notebook
from milltools.figures import spectra
from milltools.figures.base import LOOK

INK: Any = LOOK  # a type for matplotlib's many keyword arguments

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from milltools.read.runfile import Run


def spectrum(run: Run, ax: Axes | None, options: dict[str, Any]) -> Axes:
    """The impact spectra in the given axes, or in new axes of pyplot with a legend."""
    if ax is not None:
        with matplotlib.rc_context(INK):
            spectra.plot(ax, run, **options)
        return ax
    import matplotlib.pyplot as plt

    with matplotlib.rc_context(INK):
        figure, ax = plt.subplots(layout="constrained")
        live = plt.isinteractive()  # a notebook's backend sets this with the first figure; the context resets it
        try:
            spectra.plot(ax, run, **options)
        except BaseException:
            plt.close(figure)  # otherwise a notebook shows it, empty
            raise
        figure.legend(fontsize="small", loc="outside lower left", ncols=2)
    matplotlib.interactive(live)
    return ax


def shown_inline() -> None:
    """Imports the notebook's backend, so that the notebook shows figures; drawing without pyplot does not import it."""
    backend = os.environ.get("MPLBACKEND", "")
    if "inline" in backend:
        importlib.import_module(backend.removeprefix("module://"))


# ---- the player


def show(
    run: Run, name: str, path: str | os.PathLike[str] | None, browser: bool, height: int
) -> EmbeddedPage | pathlib.Path:
    """The player of a run in a notebook, or as a separate page: see Result.show."""
    if not (path or browser or in_notebook()):
        raise InputError('not in a notebook: show(browser=True) opens a browser, show("balls.html") writes the page')
    from milltools.player import player

    text = player.page(run, name)
    if not (path or browser):
        return EmbeddedPage(name, text, height)
    file = pathlib.Path(path or f"{tempfile.mkdtemp(prefix='mill-')}/balls.html").absolute()
    write_text(file, text)
    if browser and not webbrowser.open(file.as_uri()):
        raise InputError(f"no browser was found; the page is {file}")
    return file


class EmbeddedPage:
    """A page within a notebook, isolated from the notebook."""

    def __init__(self, name: str, page: str, height: int) -> None:
        self.name, self.page, self.height = name, page, height

    def __repr__(self) -> str:
        return f"<the balls of {self.name}, in a notebook>"

    def _repr_html_(self) -> str:
        look = f'style="width: 100%; height: {int(self.height)}px; border: 0" allow="fullscreen"'
        return f'<iframe sandbox="allow-scripts" {look} srcdoc="{html.escape(self.page)}"></iframe>'
