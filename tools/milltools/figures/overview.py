"""The overview of a run. Left: the mill and the balls of the last stored frame, seen along the drum's axis and coloured
by speed. Middle: a map of the dissipated power. Right: the spectra of impact speeds."""

import contextlib

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure as Canvas

from milltools.base.errors import UserError
from milltools.figures import outlines
from milltools.figures.bins import curve
from milltools.figures.style import SPEEDS, colour_bar, lay_out, log_ticks, millimetres, rounded_up
from milltools.geometry import bodies, vessel
from milltools.geometry.trajectory import stored
from milltools.read import kinds


def draw(run) -> Canvas:
    """The figure of a run, without a window."""
    figure = Canvas(figsize=(15, 4.6), layout="none")
    left, middle, right = figure.subplots(1, 3)
    mill(left, run, last=True)
    draw_balls(left, run)
    draw_power(middle, run, mill(middle, run))
    draw_spectra(right, run)
    lay_out(figure)
    return figure


def mill(ax, run, last=False):
    """Prepares axes (y, z), draws the container's wall, at the start or in the `last` frame; returns a patch to clip a
    map with."""
    frames = len(run.frame_times())
    holds = vessel.of(run, run.poses(frames - 1) if last and frames else None)
    words, reach = vessel.axes([run]), 1.02 * holds.outermost
    ax.add_patch(outlines.rim(holds, color="k"))
    wall = ax.add_patch(outlines.room(holds, ec="none"))
    ax.set_aspect("equal")
    millimetres(ax)
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach), xlabel=words["y"], ylabel=words["z"])
    return wall


def draw_balls(ax, run):
    times = run.frame_times()
    if not len(times):
        ax.set_title("no ball states stored (output.frames)")
        with contextlib.suppress(UserError):  # the bodies are not in every file
            outlines.stand(ax, run, {})
        return
    into = bodies.inverse(bodies.container(run, len(times) - 1))
    position = bodies.moved(into, run.frame(-1, "position").astype(float))
    speed = stored(run, len(times) - 1).speed
    outlines.stand(ax, run, run.poses(len(times) - 1))
    order = np.argsort(position[:, 0])  # the ones in front last
    balls = EllipseCollection(
        *(run.balls("diameter")[order],) * 2, 0, units="x", offsets=position[order, 1:], transOffset=ax.transData,
        cmap=SPEEDS, edgecolors="k", linewidths=0.1,
    )  # fmt: skip
    balls.set_array(speed[order])
    balls.set_clim(0, rounded_up(np.quantile(speed, 0.99)))
    ax.add_collection(balls)
    ax.set_title(f"t = {times[-1]:.4g} s")
    colour_bar(balls, [ax], label="speed [m/s]", extend="max")


def draw_power(ax, run, rim):
    edges = run.edges()
    area = np.outer(np.diff(edges[0]), np.diff(edges[1]))
    with np.errstate(invalid="ignore"):
        density = run.map("dissipation") / run.duration / area / 1e3
    if not np.any(density > 0):
        ax.set_title("nothing dissipated in the sampled window")
        return
    seen = np.where(density > 0, density, np.nan).T
    image = ax.pcolormesh(*edges, seen, norm=LogNorm(), cmap="inferno", rasterized=True)
    image.set_clip_path(rim)
    part = run.attribute("statistics/maps/cross_section/dissipation", "part", "all")
    ax.set_title("dissipated power" + ("" if part == "all" else f", {part} part"))
    bar = colour_bar(image, [ax], label="summed along the axis [kW/m²]")
    log_ticks(bar.ax.yaxis, *image.get_clim())


def draw_spectra(ax, run):
    ax.set(title="impact speeds", xlabel="normal impact speed [m/s]", ylabel="impacts per second and decade [1/s]")
    for kind in run.kinds:
        curve(ax, [run.histogram(kind)], run.duration, label=kinds.label(kind))
    if not ax.lines:
        ax.text(0.5, 0.5, "too few impacts for a spectrum", ha="center", transform=ax.transAxes)
        return
    floor = run.rebound_floor
    if floor and not run.soft:  # soft spheres have none
        ax.axvline(floor, color="0.6", lw=1, ls=":", label="rebound floor", zorder=0)
    ax.set_xlim(1e-3, 20)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
