#!/usr/bin/env python3
"""Draws one run: `python3 tools/plot_run.py run.h5 run.png`.

Left the balls of the last stored frame, seen along the drum's axis, coloured by speed; in the
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

LABEL = {
    "ball_ball": "ball-ball",
    "ball_drum": "ball-drum",
    "ball_wall": "ball-end wall",
    "ball_shaft": "ball-shaft",
    "ball_blade": "ball-blade",
}


def draw_balls(ax, run):
    trajectory = run["particles/trajectory"]
    position = trajectory["position/value"][-1]
    speed = np.linalg.norm(trajectory["velocity/value"][-1], axis=1)
    order = np.argsort(position[:, 0])  # the ones in front last
    balls = EllipseCollection(
        *(trajectory["diameter"][:][order],) * 2,
        0,
        units="x",
        offsets=position[order, 1:] * [1, 1],
        transOffset=ax.transData,
        cmap="viridis",
        edgecolors="k",
        linewidths=0.1,
    )
    balls.set_array(speed[order])
    balls.set_clim(0, np.quantile(speed, 0.99))
    ax.add_collection(balls)
    time = trajectory["position/time"][-1]
    ax.set_title(f"t = {time:.4g} s")
    plt.colorbar(balls, ax=ax, label="speed [m/s]", shrink=0.7)


def draw_power(ax, run):
    cross = run["statistics/maps/cross_section"]
    edges = cross["y_edges"][:], cross["z_edges"][:]
    area = np.outer(np.diff(edges[0]), np.diff(edges[1]))
    density = cross["dissipation"][:] / run["statistics/duration"][()] / area / 1e3
    image = ax.pcolormesh(
        *edges,
        np.where(density > 0, density, np.nan).T,
        norm=LogNorm(),
        cmap="inferno",
        rasterized=True,
    )
    ax.set_title("dissipated power")
    plt.colorbar(image, ax=ax, label="summed along the axis [kW/m$^2$]", shrink=0.7)


def draw_spectra(ax, run):
    duration = run["statistics/duration"][()]
    for kind, label in LABEL.items():
        histogram = run[f"statistics/impacts/{kind}/normal_speed/histogram"]
        edges, count = histogram["edges"][:], histogram["count"][:]
        if count.sum() < 1000:
            continue
        group = 8  # fine bins together, for a smooth curve
        n = len(count) // group * group
        rate = count[:n].reshape(-1, group).sum(axis=1) / duration
        width = np.diff(np.log10(edges[: n + 1 : group]))
        middle = np.sqrt(edges[:n:group] * edges[group : n + 1 : group])
        ax.loglog(middle, np.where(rate > 0, rate / width, np.nan), label=label)
    ax.set_xlim(1e-3, 20)
    ax.set_ylim(1e2, None)
    ax.set_xlabel("normal impact speed [m/s]")
    ax.set_ylabel("impacts per second and decade [1/s]")
    ax.grid(alpha=0.3)
    ax.legend(frameon=False)
    ax.set_title("impact speeds")


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__.splitlines()[0], file=sys.stderr)
        return 2
    with h5py.File(sys.argv[1]) as run:
        figure, axes = plt.subplots(1, 3, figsize=(15, 4.6), layout="constrained")
        draw_balls(axes[0], run)
        draw_power(axes[1], run)
        draw_spectra(axes[2], run)
        radius = run["statistics/maps/cross_section/y_edges"][-1]
        for ax in axes[:2]:
            ax.add_patch(plt.Circle((0, 0), radius, fill=False, color="k"))
            ax.set_aspect("equal")
            ax.set_xlim(-1.02 * radius, 1.02 * radius)
            ax.set_ylim(-1.02 * radius, 1.02 * radius)
            ax.set_xlabel("y [m]")
            ax.set_ylabel("z [m]")
        figure.savefig(sys.argv[2], dpi=90)
    return 0


if __name__ == "__main__":
    sys.exit(main())
