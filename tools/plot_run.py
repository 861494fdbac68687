#!/usr/bin/env python3
"""Draws one run: `python3 tools/plot_run.py run.h5 run.png`.

Left the mill and the balls of the last stored frame, seen along the drum's axis, coloured by speed; in the
middle where the energy goes; right how often and how hard the balls meet. Needs h5py and matplotlib.
"""

import sys

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend is chosen first: no display is needed)
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection  # noqa: E402
from matplotlib.colors import LogNorm  # noqa: E402
from matplotlib.transforms import Affine2D  # noqa: E402

LABEL = {
    "ball_ball": "ball-ball",
    "ball_drum": "ball-drum",
    "ball_wall": "ball-end wall",
    "ball_shaft": "ball-shaft",
    "ball_blade": "ball-blade",
}


def quantity(run, path, default=None):
    """A value of the deck, in SI; the unit that follows the number is SI too."""
    return float(run[f"deck/{path}"][()].decode().split()[0]) if f"deck/{path}" in run else default


def blades(run):
    """(angle, tip radius, thickness as seen along the axis) of every blade, angles at t = 0."""
    found = []
    for section in run["deck"]:
        if section != "blades" and not section.startswith("blade."):
            continue
        width, thickness, tip, pitch = (
            quantity(run, f"{section}/{key}", 0.0)
            for key in ("width", "thickness", "tip_radius", "pitch")
        )
        across = abs(np.sin(pitch)) * width + abs(np.cos(pitch)) * thickness
        if section == "blades":
            count, step = quantity(run, "blades/count"), quantity(run, "blades/angle_step")
            found += [(k * step, tip, across) for k in range(int(count))]
        else:
            found.append((quantity(run, f"{section}/angle"), tip, across))
    return found


def draw_rotor(ax, run, time):
    if "deck/rotor" not in run:
        return
    speed = quantity(run, "rotor/speed")
    turn = quantity(run, "rotor/angle") + speed * time
    for angle, tip, across in blades(run):
        box = plt.Rectangle((0, -across / 2), tip, across, fc="0.6", ec="k", lw=0.5, zorder=0)
        box.set_transform(Affine2D().rotate(angle + turn) + ax.transData)
        ax.add_patch(box)
    shaft = quantity(run, "rotor/shaft_radius")
    ax.add_patch(plt.Circle((0, 0), shaft, fc="0.75", ec="k", lw=0.5, zorder=0))
    if speed:
        ends = [(0.6 * shaft * np.cos(a), 0.6 * shaft * np.sin(a)) for a in (-0.6, 0.6)]
        arrow = {"arrowstyle": "->", "connectionstyle": f"arc3,rad={np.sign(speed) * 0.45}"}
        start, end = ends if speed > 0 else ends[::-1]
        ax.annotate("", end, start, arrowprops=arrow)


def draw_balls(ax, run):
    trajectory = run["particles/trajectory"]
    if "position" not in trajectory or not len(trajectory["position/value"]):
        ax.set_title("no ball states stored (output.frames)")
        return
    position = trajectory["position/value"][-1]
    speed = np.linalg.norm(trajectory["velocity/value"][-1], axis=1)
    time = trajectory["position/time"][-1]
    draw_rotor(ax, run, time)
    order = np.argsort(position[:, 0])  # the ones in front last
    balls = EllipseCollection(
        *(trajectory["diameter"][:][order],) * 2,
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
    ax.set_title(f"t = {time:.4g} s")
    plt.colorbar(balls, ax=ax, label="speed [m/s]", shrink=0.7, extend="max")


def draw_power(ax, run, rim):
    cross = run["statistics/maps/cross_section"]
    edges = cross["y_edges"][:], cross["z_edges"][:]
    area = np.outer(np.diff(edges[0]), np.diff(edges[1]))
    with np.errstate(invalid="ignore"):
        density = cross["dissipation"][:] / run["statistics/duration"][()] / area / 1e3
    if not np.any(density > 0):
        ax.set_title("nothing dissipated in the sampled window")
        return
    image = ax.pcolormesh(
        *edges,
        np.where(density > 0, density, np.nan).T,
        norm=LogNorm(),
        cmap="inferno",
        rasterized=True,
    )
    image.set_clip_path(rim)
    ax.set_title("dissipated power")
    plt.colorbar(image, ax=ax, label="summed along the axis [kW/m$^2$]", shrink=0.7)


def draw_spectra(ax, run):
    duration = run["statistics/duration"][()]
    ax.set_title("impact speeds")
    ax.set_xlabel("normal impact speed [m/s]")
    ax.set_ylabel("impacts per second and decade [1/s]")
    for kind, label in LABEL.items():
        histogram = run[f"statistics/impacts/{kind}/normal_speed/histogram"]
        edges, count = histogram["edges"][:], histogram["count"][:]
        if count.sum() < 100:  # too few for a curve
            continue
        group = 8  # fine bins together, for a smooth curve
        n = len(count) // group * group
        rate = count[:n].reshape(-1, group).sum(axis=1) / duration
        width = np.diff(np.log10(edges[: n + 1 : group]))
        middle = np.sqrt(edges[:n:group] * edges[group : n + 1 : group])
        ax.loglog(middle, np.where(rate > 0, rate / width, np.nan), label=label)
    if not ax.lines:
        ax.text(0.5, 0.5, "too few impacts for a spectrum", ha="center", transform=ax.transAxes)
        return
    floor = quantity(run, "contact/rebound_floor")
    if floor:
        ax.axvline(floor, color="0.6", lw=1, ls=":", label="rebound floor", zorder=0)
    ax.set_xlim(1e-3, 20)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)


def draw(run, picture):
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
    radius = quantity(run, "drum/radius")
    rims = [plt.Circle((0, 0), radius, fill=False, color="k") for _ in range(2)]
    for ax, rim in zip(axes, rims):
        ax.add_patch(rim)
        ax.set_aspect("equal")
        ax.set_xlim(-1.02 * radius, 1.02 * radius)
        ax.set_ylim(-1.02 * radius, 1.02 * radius)
        ax.set_xlabel("y [m]")
        ax.set_ylabel("z [m]")
    draw_balls(axes[0], run)
    draw_power(axes[1], run, rims[1])
    draw_spectra(axes[2], run)
    figure.savefig(picture, dpi=90)


def main() -> int:
    if len(sys.argv) != 3:
        print("usage: plot_run.py RUN.h5 PICTURE.png", file=sys.stderr)
        return 2
    try:
        with h5py.File(sys.argv[1]) as run:
            draw(run, sys.argv[2])
    except (OSError, KeyError) as fault:
        print(
            f"plot_run.py: {sys.argv[1]}: not a finished run of millsim: {fault}", file=sys.stderr
        )
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
