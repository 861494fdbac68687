"""What every figure is: a name, a title, words, why it cannot be drawn, the drawing, and its numbers as tables."""

import dataclasses
import pathlib

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Canvas

from milltools.base.errors import UserError
from milltools.base.text import literal, number
from milltools.figures.style import INK, STYLE

WIDTH = 4.8  # [inch]: a column of a page, or a phone held upright
QUIET = {"color": INK, "alpha": 0.7}  # what stands back; no grey, as a dark page needs a light one
INKED = (
    "text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "patch.edgecolor", "grid.color",
    "hatch.color",
)  # fmt: skip
# all that is ink in one colour, which an inline SVG takes from its page
LOOK = {
    **STYLE,
    **dict.fromkeys(INKED, INK),
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.alpha": 0.18,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "lines.dash_capstyle": "butt",
}


@dataclasses.dataclass(frozen=True)
class Columns:
    """Numbers of a figure: `name` of the run, and columns of one length under their heads, "speed [m/s]" or "kind"."""

    name: str
    columns: dict[str, np.ndarray]


class Figure:
    """One kind of picture of one run or several.

    name      what `mill plot --figure` calls it
    title     a few words
    caption   a sentence or two: what is shown and how it is read
    group     what it belongs to: "spectra", "energy", "maps", "time"
    options   names of the keywords that draw and tables take beside the runs
    """

    name = title = caption = group = ""
    options: tuple[str, ...] = ()

    def why_not(self, run, **options) -> str | None:
        """Why it cannot be drawn of this run, as part of a sentence; None if it can."""
        raise NotImplementedError

    def prepare(self, run, told=None):
        """Does now what takes long, so that draw and tables do not; told(share) hears how far it is. Never needed."""

    def draw(self, runs, titled: bool = True, **options) -> Canvas:
        """The figure of one open Run or of several, side by side or overlaid; UserError where it cannot be drawn.
        `titled=False` leaves out what a page says itself: the title."""
        runs = self.checked(runs, options)
        with matplotlib.rc_context(LOOK):
            figure = Canvas(layout="constrained")
            figure.set_layout_engine("constrained", h_pad=0.05, w_pad=0.05)
            self.paint(figure, runs, **options)
            if titled:
                figure.suptitle(self.title, x=0.015, ha="left", fontsize=10, fontweight="bold")
        return figure

    def paint(self, figure, runs, **options):
        """Draws into an empty figure and sets its size."""
        raise NotImplementedError

    def says(self, runs) -> str:
        """The caption, as it is of these runs."""
        return self.caption

    def tables(self, runs, **options) -> list[Columns]:
        """The numbers drawn, in SI: a table for each run, all with the same heads."""
        runs = self.checked(runs, options)
        return [Columns(name, self.columns(run, **options)) for name, run in zip(labels(runs), runs)]

    def columns(self, run, **options) -> dict[str, np.ndarray]:
        raise NotImplementedError

    def checked(self, runs, options):
        runs = list(runs) if isinstance(runs, (list, tuple)) else [runs]
        for name in options:
            if name not in self.options:
                raise UserError(f"figure '{self.name}' takes no option '{name.replace('_', '-')}'")
        for run in runs:
            why = self.why_not(run, **options)
            if why:
                raise UserError(f"{run.path}: no figure '{self.name}': {why}")
        return runs


def labels(runs) -> list[str]:
    """A short name for each run, all different: of its file, its path where that is not enough, then numbered."""
    stems, names = [pathlib.Path(run.path).stem for run in runs], [str(run.path) for run in runs]
    numbered = [f"{name} ({k + 1})" for k, name in enumerate(names)]
    return next((some for some in (stems, names) if len(set(some)) == len(some)), numbered)


def sampled(run) -> str:
    """The sampled window in words."""
    begin, end = run.window
    return f"sampled {number(run.duration, 4)} s ({number(begin, 4)} to {number(end, 4)} s)"


def subtitle(ax, text: str, most: int = 110):
    """Smaller letters above axes: which run, which window."""
    ax.set_title(literal(text, most), loc="left", fontsize=8, **QUIET)
