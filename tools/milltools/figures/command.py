"""`mill plot`: runs as pictures.

Without --figure the overview of one run: left the mill and the balls of the last stored frame, seen along the drum's axis,
coloured by speed; in the middle where the energy goes; right how often and how hard the balls meet. With it one of
milltools.figures, of one run or several, or its numbers.
"""

import contextlib
import pathlib
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm

from milltools.base.errors import UserError
from milltools.base.files import keep_apart
from milltools.figures import style
from milltools.geometry import bodies, vessel
from milltools.read import kinds
from milltools.read.runfile import Run

SUMMARY = (
    "Draws runs. Without --figure an overview of one run: the mill and its balls coloured by speed, where the energy "
    "goes, and the spectrum of impact speeds of each contact kind. With --figure one figure of one run or several, or its "
    "numbers. The format follows the name of the file: .png, .svg, .pdf, or .csv for the numbers."
)
PICTURES = (".png", ".svg", ".pdf")


def add_arguments(parser):
    parser.add_argument("runs", nargs="*", metavar="run.h5", help="output files of runs")
    parser.add_argument("file", nargs="?", help="where it goes; an old one is replaced")
    parser.add_argument("--figure", metavar="NAME", help="one of those that --list names")
    parser.add_argument("--list", action="store_true", help="names the figures; of the runs, if given")
    parser.add_argument(
        "--kind",
        action="append",
        metavar="KIND",
        help="spectra of this contact kind alone, such as ball_ball, ball_drum or all; may be repeated",
    )
    parser.add_argument("--strikes", action="store_true", help="spectra of strikes: re-contacts of a pair merged")
    parser.add_argument("--per-ball", action="store_true", help="spectra divided by the number of balls")


def run(arguments) -> int:
    names = [*arguments.runs, *filter(None, [arguments.file])]
    if arguments.list:
        return tell(names)
    if len(names) < 2:
        raise UserError("expected a run and the name of a picture; see 'mill plot --help'")
    *paths, target = names
    keep_apart(target, paths)
    options = {"kinds": arguments.kind, "strikes": arguments.strikes, "per_ball": arguments.per_ball}
    options = {name: value for name, value in options.items() if value}
    with contextlib.ExitStack() as stack:
        runs = [stack.enter_context(Run(path)) for path in paths]
        if arguments.figure:
            return write_figure(arguments.figure, runs, target, options)
        if len(runs) > 1 or options or pathlib.Path(target).suffix.lower() == ".csv":
            raise UserError(
                f"the overview is of one run, as a picture; say which figure: --figure {', '.join(figures().FIGURES)}"
            )
        runs[0].need_statistics()
        figure = draw(runs[0])
    save(figure, target)
    return 0


def figures():
    """Imported when they are asked for: who reads this module for the overview has no need of them."""
    import milltools.figures

    return milltools.figures


def find(name):
    known = figures().FIGURES
    if name not in known:
        raise UserError(f"unknown figure '{name}': one of {', '.join(known)}")
    return known[name]


def write_figure(name, runs, target, options) -> int:
    from milltools.figures import files

    figure = find(name)
    suffix = pathlib.Path(target).suffix.lower()
    if suffix not in (*PICTURES, ".csv"):
        raise UserError(f"{target}: expected a name that ends in {', '.join(PICTURES)} or .csv")
    for one in runs:
        with Watch() as told:
            figure.prepare(one, told)
    if suffix == ".csv":
        files.numbers(figure.tables(runs, **options), target)
    else:
        files.picture(figure.draw(runs, **options), target)
    return 0


class Watch:
    """How far the reading of a long log is, on standard error: a bar on a terminal, a line now and then elsewhere, nothing
    in the first seconds."""

    QUIET, PLAIN = (2.0, 10.0)  # [s] before anything is said, between lines where there is no terminal

    def __enter__(self):
        self.bar, self.begin = None, time.monotonic()
        self.said = self.begin
        return self

    def __exit__(self, *exception):
        if self.bar:
            self.bar.stop()

    def __call__(self, share):
        now = time.monotonic()
        if now - self.begin < self.QUIET:
            return
        if not self.bar:
            from rich.console import Console
            from rich.progress import Progress

            console = Console(stderr=True)
            self.bar = Progress(console=console, transient=True, disable=not console.is_terminal)
            self.task = self.bar.add_task("reading the log of impacts", total=1.0)
            self.bar.start()
        self.bar.update(self.task, completed=share)
        if self.bar.disable and share > 0 and now - self.said > self.PLAIN:
            self.said = now
            left = (now - self.begin) * (1 / share - 1)
            print(f"mill plot: log of impacts, {100 * share:.0f} %, {left:.0f} s left", file=sys.stderr)


def tell(paths) -> int:
    """The figures there are; those that a run does not have with the reason."""
    with contextlib.ExitStack() as stack:
        runs = [stack.enter_context(Run(path)) for path in paths]
        for figure in figures().FIGURES.values():
            reasons = [f"{r.path}: {why}" for r in runs if (why := figure.why_not(r))]
            print(f"{figure.name:<20} {figure.title}" + "".join(f"\n{'':<20}   not of {r}" for r in reasons))
    return 0


def save(figure, path, dpi=90):
    """Writes a figure and forgets it; a name without a known format, or a full disk, is a UserError."""
    try:
        style.save(figure, path, dpi)
    finally:
        plt.close(figure)


def draw_balls(ax, run):
    times = run.frame_times()
    if not len(times):
        ax.set_title("no ball states stored (output.frames)")
        return
    into = bodies.inverse(bodies.container(run, len(times) - 1))
    position = bodies.moved(into, run.frame(-1, "position").astype(float))
    speed = np.linalg.norm(run.frame(-1, "velocity"), axis=1)
    from milltools.figures import outlines

    outlines.stand(ax, run, run.poses(len(times) - 1))
    order = np.argsort(position[:, 0])  # the ones in front last
    balls = EllipseCollection(
        *(run.balls("diameter")[order],) * 2,
        0,
        units="x",
        offsets=position[order, 1:],
        transOffset=ax.transData,
        cmap="viridis",
        edgecolors="k",
        linewidths=0.1,
    )
    balls.set_array(speed[order])
    balls.set_clim(0, np.quantile(speed, 0.99) or 1)
    ax.add_collection(balls)
    ax.set_title(f"t = {times[-1]:.4g} s")
    plt.colorbar(balls, ax=ax, label="speed [m/s]", shrink=0.7, extend="max")


def draw_power(ax, run, rim):
    edges = run.edges()
    area = np.outer(np.diff(edges[0]), np.diff(edges[1]))
    with np.errstate(invalid="ignore"):
        density = run.map("dissipation") / run.duration / area / 1e3
    if not np.any(density > 0):
        ax.set_title("nothing dissipated in the sampled window")
        return
    image = ax.pcolormesh(
        *edges, np.where(density > 0, density, np.nan).T, norm=LogNorm(), cmap="inferno", rasterized=True
    )
    image.set_clip_path(rim)
    part = run.attribute("statistics/maps/cross_section/dissipation", "part", "all")
    ax.set_title("dissipated power" + ("" if part == "all" else f", {part} part"))
    plt.colorbar(image, ax=ax, label="summed along the axis [kW/m$^2$]", shrink=0.7)


def spectrum(histogram, duration, group=8):
    """(speed [m/s], impacts per second and decade [1/s]) of a histogram, `group` bins together for a smooth curve;
    NaN where there were none."""
    n = len(histogram.count) // group * group
    rate = histogram.count[:n].reshape(-1, group).sum(axis=1) / duration
    edges = histogram.edges[: n + 1 : group]
    width = np.diff(np.log10(edges))
    return np.sqrt(edges[:-1] * edges[1:]), np.where(rate > 0, rate / width, np.nan)


def draw_spectra(ax, run):
    ax.set_title("impact speeds")
    ax.set_xlabel("normal impact speed [m/s]")
    ax.set_ylabel("impacts per second and decade [1/s]")
    for kind in run.kinds:
        histogram = run.histogram(kind)
        if histogram.count.sum() < 100:  # too few for a curve
            continue
        ax.loglog(*spectrum(histogram, run.duration), label=kinds.label(kind))
    if not ax.lines:
        ax.text(0.5, 0.5, "too few impacts for a spectrum", ha="center", transform=ax.transAxes)
        return
    floor = run.quantity("contact/rebound_floor", 0.0)
    if floor and run.program == "millsim":  # soft spheres have none
        ax.axvline(floor, color="0.6", lw=1, ls=":", label="rebound floor", zorder=0)
    ax.set_xlim(1e-3, 20)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)


def draw(run):
    """The figure of a run, open in `run`."""
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
    holds = vessel.of(run)
    radius = holds.outermost
    rims, words = [holds.rim(color="k") for _ in range(2)], vessel.axes([run])
    for ax, rim in zip(axes, rims):
        ax.add_patch(rim)
        ax.set_aspect("equal")
        ax.set_xlim(-1.02 * radius, 1.02 * radius)
        ax.set_ylim(-1.02 * radius, 1.02 * radius)
        ax.set_xlabel(words["y"])
        ax.set_ylabel(words["z"])
    draw_balls(axes[0], run)
    draw_power(axes[1], run, rims[1])
    draw_spectra(axes[2], run)
    return figure
