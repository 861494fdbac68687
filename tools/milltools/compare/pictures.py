"""The pictures of a comparison: spectra, power and energy over time, maps, speeds of the balls, computing cost.

Every drawing function takes a figure or subfigure and the sides; `PICTURES` lists them with their titles and sizes.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from milltools.base.text import literal
from milltools.compare.load import SPEED_EDGES
from milltools.compare.map_deviation import LEAST, same_cells
from milltools.figures.bins import curve
from milltools.figures.outlines import rim
from milltools.figures.overtime import means
from milltools.figures.style import run_style, save
from milltools.read.kinds import label as kind_label


def draw_spectra(figure, sides):
    """Spectra of the normal impact speed by contact kind; replicates are added up."""
    every = dict.fromkeys(kind for side in sides for kind in side.first.kinds)
    axes = figure.subplots(1, len(every), sharey=True)
    for ax, kind in zip(axes, every):
        for number, side in enumerate(sides):
            histograms = [run.histogram(kind) for run in side.runs if kind in run.kinds]
            duration = sum(run.duration for run in side.runs)
            curve(ax, histograms, duration, **run_style(number), label=literal(side.label, 44))
        ax.set_title(kind_label(kind))
        ax.set_xlim(1e-3, 20)
        ax.grid(alpha=0.3)
        if not ax.lines:
            ax.set_xscale("log")
            ax.text(0.5, 0.5, "too few impacts", ha="center", transform=ax.transAxes)
    figure.supxlabel("normal impact speed [m/s]", fontsize="medium")
    axes[0].set_ylabel("impacts per second and decade [1/s]")
    _legend(figure, axes, len(sides))


def _legend(figure, axes, count):
    """One legend for all axes of a figure, above them."""
    found = {label: line for ax in axes for line, label in zip(*ax.get_legend_handles_labels())}
    if found:
        figure.legend(found.values(), found.keys(), loc="outside upper left", ncols=min(count, 4), frameon=False)


def draw_power(figure, sides):
    """Power of the drive and kinetic energy over time, one line for each run."""
    axes = figure.subplots(1, 2)
    for number, side in enumerate(sides):
        for k, run in enumerate(side.runs):
            time, work = run.drive_work()
            look = {**run_style(number), "alpha": 1 if len(side.runs) == 1 else 0.6}
            label = literal(side.label, 44) if k == 0 else None
            pieces = np.linspace(time[0], time[-1], min(100, len(time)))
            axes[0].plot((pieces[1:] + pieces[:-1]) / 2, means(time, work, pieces), **look, label=label)
            axes[1].plot(*run.series("kinetic_energy"), **look, label=label)
    window = sides[0].first.window
    same = all(np.allclose(side.first.window, window) for side in sides)
    for ax in axes:
        if same:
            ax.axvspan(*window, color="0.93", zorder=0, lw=0, label="sampled window")
        ax.set_xlabel("time [s]")
        ax.set_xlim(left=0)
        ax.grid(alpha=0.3)
    axes[0].set(title="power, means over short pieces of time", ylabel="power of the drive [W]")
    axes[1].set(title="translational kinetic energy", ylabel="kinetic energy of the balls [J]")
    _legend(figure, axes, len(sides) + 1)


def draw_speeds(figure, sides):
    """Distribution of the balls' speeds over the frames in the window, and the computing cost of a simulated second."""
    ax, price = figure.subplots(1, 2, width_ratios=(3, 2))
    middle = np.sqrt(SPEED_EDGES[1:] * SPEED_EDGES[:-1])
    top = 0.0
    for number, side in enumerate(sides):
        count = np.sum([run.speed_counts for run in side.runs], axis=0)
        if not count.sum():
            continue
        density = count / count.sum() / np.diff(SPEED_EDGES)
        density[density == 0] = np.nan
        ax.semilogy(middle, density, **run_style(number), label=literal(side.label, 44))
        top = max(top, SPEED_EDGES[1 + np.searchsorted(np.cumsum(count), 0.9995 * count.sum())])
    ax.set(title="speeds of the balls", xlabel="speed [m/s]", ylabel="probability density [s/m]")
    ax.grid(alpha=0.3)
    if top:
        ax.set_xlim(0, top)
        ax.set_ylim(bottom=1e-4)
    else:
        ax.text(0.5, 0.5, "no frames in the window", ha="center", transform=ax.transAxes)
    _draw_price(price, sides)
    _legend(figure, [ax], len(sides))


def _draw_price(ax, sides):
    costs = [float(np.mean([run.cost for run in side.runs])) for side in sides]
    known = [c for c in costs if math.isfinite(c) and c > 0]
    colours = [run_style(number)["color"] for number in range(len(sides))]
    bars = ax.barh(range(len(sides)), costs, color=colours, height=0.6)
    ax.bar_label(bars, [f"{c:.3g}" for c in costs], padding=4)
    ax.set_yticks(range(len(sides)), [literal(side.label, 24) for side in sides])
    ax.invert_yaxis()
    ax.set(title="Cost", xlabel="CPU seconds per simulated second [s/s]")
    if known:
        ax.set_xlim(0, 1.2 * max(known))


# the flow only where the solid fraction is above LEAST: elsewhere it would be the speed of single balls
MAPS = (("solid_fraction", "solid fraction [1]"), ("velocity", "speed of the mean flow [m/s]"))


def draw_maps(figure, sides):
    """Cross-sections: all sides on one scale, and the difference of each side from the first."""
    columns = 2 * len(sides) - 1
    axes = figure.subplots(2, columns, squeeze=False, sharex=True, sharey=True)
    for line, (name, label) in zip(axes, MAPS):
        fields = [_field(side, name) for side in sides]
        top = max(np.nanquantile(f, 0.995) if np.isfinite(f).any() else 0 for f in fields) or 1
        for ax, side, field in zip(line, sides, fields):
            image = _map(ax, side, field, "viridis", 0, top)
            ax.set_title(literal(side.label, 30))
        figure.colorbar(image, ax=line[: len(sides)], label=label, extend="max", shrink=0.9)
        off = {k: fields[k] - fields[0] for k in range(1, len(sides)) if same_cells(sides[k].first, sides[0].first)}
        finite = [np.abs(o[np.isfinite(o)]) for o in off.values()]
        reach = max((np.quantile(f, 0.99) for f in finite if len(f)), default=0) or top / 100
        for k, ax in enumerate(line[len(sides) :], 1):
            ax.set_title(f"{sides[k].letter} - A")
            if k in off:
                image = _map(ax, sides[k], off[k], "RdBu_r", -reach, reach)
            else:
                ax.text(0, 0, "maps have different cells", ha="center")
        if off:
            what = label.replace(" [", ", difference [")
            figure.colorbar(image, ax=line[len(sides) :], label=what, extend="both", shrink=0.9)
    reach = 1.02 * max(side.first.container.outermost for side in sides)
    for ax in axes.ravel():
        ax.locator_params(nbins=4)
        ax.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    for ax in axes[-1]:
        ax.set_xlabel("y, across the container's axis [m]")
    for ax in axes[:, 0]:
        ax.set_ylabel("z, across the container's axis [m]")


def _field(side, name):
    """A side's map, or the magnitude of its mean velocity; NaN where there is nothing."""
    fraction = side.mean_map("solid_fraction", "cross_section")
    if name == "solid_fraction":
        return fraction
    with np.errstate(invalid="ignore"):
        speed = np.linalg.norm(side.mean_map(name, "cross_section"), axis=0)
        return np.where(fraction > LEAST, speed, np.nan)


def _map(ax, side, field, colours, low, high):
    edges = side.first.edges()
    image = ax.pcolormesh(*edges, field.T, cmap=colours, vmin=low, vmax=high, rasterized=True)
    image.set_clip_path(ax.add_patch(rim(side.first.container, lw=0.8)))
    return image


# title, description for readers who cannot see it, function, size [inch] for a number of sides
PICTURES = (
    (
        "Impact speeds", "spectra of the normal impact speed by contact kind, all runs overlaid",
        draw_spectra, lambda n: (15, 4.2),
    ),
    (
        "Over time", "power of the drive and kinetic energy of the balls over time",
        draw_power, lambda n: (15, 4.4),
    ),
    (
        "Maps", "cross-sections of the mill: solid fraction for each run, speed of the mean flow "
        f"where it is above {LEAST}, and the differences from the first",
        draw_maps, lambda n: (3.5 * (2 * n - 1) + 2.5, 7.0),
    ),
    (
        "Speeds of the balls, and the cost", "distribution of the balls' speeds; CPU seconds per simulated second",
        draw_speeds, lambda n: (15, 4.2 + 0.15 * max(0, n - 6)),
    ),
)  # fmt: skip


def figures(sides):
    """(title, description, figure) of every picture."""
    for title, words, draw, size in PICTURES:
        figure = Figure(figsize=size(len(sides)), layout="constrained")
        draw(figure, sides)
        yield title, words, figure


def write(sides, path):
    """All pictures one below the other."""
    sizes = [size(len(sides)) for *_, size in PICTURES]
    whole = Figure(figsize=(max(w for w, _ in sizes), sum(h + 0.5 for _, h in sizes)), layout="constrained")
    parts = whole.subfigures(len(PICTURES), 1, height_ratios=[h for _, h in sizes], hspace=0.03)
    for part, (title, _, draw, _) in zip(parts, PICTURES):
        part.suptitle(title, fontweight="bold")
        draw(part, sides)
    save(whole, path, dpi=100)
