"""The base class of all figures: name, title, caption, why it cannot be drawn, the drawing, the numbers as tables."""

import dataclasses
import pathlib
import textwrap

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Canvas

from milltools.base.errors import UserError
from milltools.base.text import literal, number, plain
from milltools.figures.style import INK, SMALL, STYLE, lay_out

WIDTH = 4.8  # [inch]: a column of a page, or a phone held upright
QUIET = {"color": INK, "alpha": 0.7}  # for less important parts; not grey, because dark pages need a light colour
INKED = (
    "text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "patch.edgecolor", "grid.color",
    "hatch.color",
)  # fmt: skip
# all lines and letters have one colour, so that an inline SVG can take it from its page
LOOK = {
    **STYLE,
    **dict.fromkeys(INKED, INK),
    "axes.linewidth": 0.7,
    "axes.titley": 1.0,  # else matplotlib measures all tick labels again to find it
    "axes.grid": True,
    "grid.alpha": 0.18,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "lines.dash_capstyle": "butt",
}


@dataclasses.dataclass(frozen=True)
class Columns:
    """Numbers of a figure: `name` of the run, and columns of equal length by their heads, "speed [m/s]" or "kind"."""

    name: str
    columns: dict[str, np.ndarray]


class Figure:
    """One kind of picture of one run or several.

    name      its name for `mill plot --figure`
    title     a few words
    caption   a sentence or two: what the figure shows and how to read it
    group     its group of figures: "spectra", "energy", "maps", "time"
    options   names of the keywords that draw and tables take in addition to the runs
    """

    name = title = caption = group = ""
    options: tuple[str, ...] = ()

    def why_not(self, run, **options) -> str | None:
        """Why the figure cannot be drawn for this run, as part of a sentence; None if it can."""
        raise NotImplementedError

    def prepare(self, run, told=None):
        """Does the slow work ahead of draw and tables, and calls told(share) with its progress. Optional."""

    def draw(self, runs, titled: bool = True, **options) -> Canvas:
        """The figure of one open Run, or of several side by side or overlaid; UserError if it cannot be drawn.
        `titled=False` omits the title, for pages that print it themselves."""
        runs = self.checked(runs, options)
        with matplotlib.rc_context(LOOK):
            figure = Canvas(layout="none")
            self.paint(figure, runs, **options)
            if titled:
                figure.suptitle(self.finding(runs), x=0.015, ha="left", fontsize=10, fontweight="bold")
            lay_out(figure)
        return figure

    def paint(self, figure, runs, **options):
        """Draws into an empty figure and sets its size."""
        raise NotImplementedError

    def says(self, runs) -> str:
        """The caption for these runs."""
        return self.caption

    def finding(self, runs) -> str:
        """The title above the picture: what it shows of these runs, where few words can say it."""
        return self.title

    def tables(self, runs, **options) -> list[Columns]:
        """The numbers drawn, in SI: one table for each run, all with the same heads."""
        runs = self.checked(runs, options)
        return [Columns(name, self.columns(run, **options)) for name, run in zip(labels(runs), runs)]

    def columns(self, run, **options) -> dict[str, np.ndarray]:
        raise NotImplementedError

    def checked(self, runs, options):
        runs = list(runs) if isinstance(runs, (list, tuple)) else [runs]
        for name in options:
            if name not in self.options:
                raise UserError(f"figure '{self.name}' has no option '{name.replace('_', '-')}'")
        for run in runs:
            why = self.why_not(run, **options)
            if why:
                raise UserError(f"{run.path}: no figure '{self.name}': {why}")
        return runs


def labels(runs) -> list[str]:
    """A unique short name for each run: of its file, else its path, else its path with a number."""
    stems, names = [pathlib.Path(run.path).stem for run in runs], [str(run.path) for run in runs]
    numbered = [f"{name} ({k + 1})" for k, name in enumerate(names)]
    return next((some for some in (stems, names) if len(set(some)) == len(some)), numbered)


def sampled(run) -> str:
    """The sampled window in words."""
    begin, end = run.window
    each = f", {run.starts} starts" if run.starts > 1 else ""
    return f"sampled {number(run.duration / run.starts, 4)} s ({number(begin, 4)} to {number(end, 4)} s{each})"


def subtitle(ax, text: str, most: int = 52):
    """Writes lines of at most `most` small letters above axes, such as the run and its sampled window."""
    lines = [literal(line, most) for line in textwrap.wrap(plain(text), most)[:3]]
    ax.set_title("\n".join(lines), loc="left", fontsize=SMALL, **QUIET)
