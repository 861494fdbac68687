"""The pictures of a comparison: spectra, power and energy over time, maps, speeds of the balls, price.

Every drawing function takes a figure or subfigure and the sides; `PICTURES` lists them with their titles and sizes.
"""

import math

import numpy as np
from matplotlib.figure import Figure

from milltools.base.text import literal
from milltools.compare.load import SPEED_EDGES
from milltools.compare.map_deviation import LEAST
from milltools.figures.bins import MERGED
from milltools.figures.style import run_style, save
from milltools.read.kinds import label as kind_label


def _spectrum(histograms, duration):
    """(speed [m/s], impacts per second and decade [1/s]), bins put together for a smooth curve; NaN where there were none."""
    whole = len(histograms[0].count) // MERGED * MERGED
    edges = histograms[0].edges[: whole + 1 : MERGED]
    count = sum(one.count[:whole].reshape(-1, MERGED).sum(axis=1) for one in histograms)
    rate = count / duration / np.diff(np.log10(edges))
    return np.sqrt(edges[:-1] * edges[1:]), np.where(rate > 0, rate, np.nan)


def draw_spectra(figure, sides):
    """Normal impact speeds by kind; replicates together."""
    every = dict.fromkeys(kind for side in sides for kind in side.first.kinds)
    axes = figure.subplots(1, len(every), sharey=True)
    for ax, kind in zip(axes, every):
        for number, side in enumerate(sides):
            histograms = [run.impacts[kind] for run in side.runs if kind in run.impacts]
            if sum(h.count.sum() for h in histograms) >= 100:  # else too few for a curve
                duration = sum(run.duration for run in side.runs)
                label = literal(side.label, 44)
                ax.loglog(*_spectrum(histograms, duration), **run_style(number), label=label)
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
    """One for all axes of a figure, above them."""
    found = {}
    for ax in np.ravel(axes):
        for handle, label in zip(*ax.get_legend_handles_labels()):
            found.setdefault(label, handle)
    if found:
        figure.legend(found.values(), found.keys(), loc="outside upper left", ncols=min(count, 4), frameon=False)


def _shade(ax, sides):
    first, last = sides[0].first.window
    if all(np.allclose(s.first.window, (first, last)) for s in sides):
        ax.axvspan(first, last, color="0.93", zorder=0, lw=0, label="sampled window")


def draw_power(figure, sides):
    """Power of the drive and kinetic energy over time, every run on its own."""
    axes = figure.subplots(1, 2)
    for number, side in enumerate(sides):
        for k, run in enumerate(side.runs):
            time, work = run.series["drive_work"]
            look = {**run_style(number), "alpha": 1 if len(side.runs) == 1 else 0.6}
            label = literal(side.label, 44) if k == 0 else None
            pieces = np.linspace(time[0], time[-1], min(100, len(time)))
            power = np.diff(np.interp(pieces, time, work)) / np.diff(pieces)
            axes[0].plot((pieces[1:] + pieces[:-1]) / 2, power, **look, label=label)
            axes[1].plot(*run.series["kinetic_energy"], **look, label=label)
    for ax, what in zip(axes, ("power of the drive [W]", "kinetic energy of the balls [J]")):
        _shade(ax, sides)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(what)
        ax.set_xlim(left=0)
        ax.grid(alpha=0.3)
    axes[0].set_title("power, means over short pieces of time")
    axes[1].set_title("translational kinetic energy")
    _legend(figure, axes, len(sides) + 1)


def draw_speeds(figure, sides):
    """Distribution of the balls' speeds over the frames in the window, and what a second of it costs."""
    axes = figure.subplots(1, 2, width_ratios=(3, 2))
    middle = np.sqrt(SPEED_EDGES[1:] * SPEED_EDGES[:-1])
    top = 0.0
    for number, side in enumerate(sides):
        count = np.sum([run.speed_counts for run in side.runs], axis=0)
        if not count.sum():
            continue
        density = count / count.sum() / np.diff(SPEED_EDGES)
        density[density == 0] = np.nan
        axes[0].semilogy(middle, density, **run_style(number), label=literal(side.label, 44))
        top = max(top, SPEED_EDGES[1 + np.searchsorted(np.cumsum(count), 0.9995 * count.sum())])
    axes[0].set_title("speeds of the balls")
    axes[0].set_xlabel("speed [m/s]")
    axes[0].set_ylabel("probability density [s/m]")
    axes[0].grid(alpha=0.3)
    if top:
        axes[0].set_xlim(0, top)
        axes[0].set_ylim(bottom=1e-4)
    else:
        axes[0].text(0.5, 0.5, "no frames in the window", ha="center", transform=axes[0].transAxes)
    _draw_price(axes[1], sides)
    _legend(figure, axes[:1], len(sides))


def _draw_price(ax, sides):
    costs = [float(np.mean([run.cost for run in side.runs])) for side in sides]
    known = [c for c in costs if math.isfinite(c) and c > 0]
    colours = [run_style(number)["color"] for number in range(len(sides))]
    bars = ax.barh(range(len(sides)), costs, color=colours, height=0.6)
    ax.bar_label(bars, [f"{c:.3g}" for c in costs], padding=4)
    ax.set_yticks(range(len(sides)), [literal(side.label, 24) for side in sides])
    ax.invert_yaxis()
    ax.set_title("price")
    ax.set_xlabel("CPU seconds per simulated second [s/s]")
    if known:
        ax.set_xlim(0, 1.2 * max(known))


MAPS = (
    ("solid_fraction", "solid fraction [1]", "viridis"),
    ("velocity", "speed of the mean flow [m/s]", "viridis"),
)  # the second where the solid fraction is above LEAST: elsewhere it is the speed of the odd ball


def draw_maps(figure, sides):
    """Cross-sections: each side on one scale, and what each has more than the first."""
    columns = 2 * len(sides) - 1
    axes = figure.subplots(2, columns, squeeze=False, sharex=True, sharey=True)
    for line, (name, label, colours) in zip(axes, MAPS):
        fields = [_field(side, name) for side in sides]
        top = max(np.nanquantile(f, 0.995) if np.isfinite(f).any() else 0 for f in fields) or 1
        for ax, side, field in zip(line, sides, fields):
            image = _map(ax, side, field, colours, 0, top)
            ax.set_title(literal(side.label, 30))
        figure.colorbar(image, ax=line[: len(sides)], label=label, extend="max", shrink=0.9)
        off = [
            field - fields[0] if side.first.maps.same_cells(sides[0].first.maps) else None
            for side, field in zip(sides[1:], fields[1:])
        ]
        finite = [np.abs(o[np.isfinite(o)]) for o in off if o is not None]
        reach = max((np.quantile(f, 0.99) for f in finite if len(f)), default=0) or top / 100
        image = None
        for ax, side, field in zip(line[len(sides) :], sides[1:], off):
            ax.set_title(f"{side.letter} - A")
            if field is None:
                ax.text(0, 0, "maps have different cells", ha="center")
            else:
                image = _map(ax, side, field, "RdBu_r", -reach, reach)
        if image:
            what = label.replace(" [", ", difference [")
            figure.colorbar(image, ax=line[len(sides) :], label=what, extend="both", shrink=0.9)
    radius = max(side.first.vessel.outermost for side in sides)
    for ax in axes.ravel():
        ax.set_aspect("equal")
        ax.locator_params(nbins=4)
        ax.set_xlim(-1.02 * radius, 1.02 * radius)
        ax.set_ylim(-1.02 * radius, 1.02 * radius)
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
    edges = side.first.maps.edges["cross_section"]
    image = ax.pcolormesh(*edges, field.T, cmap=colours, vmin=low, vmax=high, rasterized=True)
    rim = ax.add_patch(side.first.vessel.rim(lw=0.8))
    image.set_clip_path(rim)
    return image


# title, what it shows for who cannot see it, function, size [inch] for a number of sides
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
        "Speeds of the balls, and the price", "distribution of the balls' speeds; CPU seconds per simulated second",
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
