"""The pictures of a comparison: differences with their intervals, spectra, power and energy over time, maps, speeds of
the balls.

Every drawing function takes a figure or subfigure and the tables, of which each has the reference as side a; `PICTURES`
lists them with their titles and sizes. A panel without data is left out, and so is a picture without panels.
"""

import math
import textwrap

import matplotlib
import numpy as np
from matplotlib import ticker
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D

from milltools.base.text import MINUS, literal, plain
from milltools.compare import finding
from milltools.compare import map_deviation as cells
from milltools.compare.load import SPEED_EDGES
from milltools.compare.map_deviation import LEAST
from milltools.figures.base import LOOK, WIDTH
from milltools.figures.bins import curve, enough
from milltools.figures.outlines import rim, room
from milltools.figures.overtime import means
from milltools.figures.style import INK, colour_bar, lay_out, legend, run_style, save
from milltools.read.kinds import label as kind_label

PITCH = 0.33  # [inch] of a row of the forest plot: a text above a bar


def sides_of(tables):
    return [tables[0].a, *(table.b for table in tables)]


def important(tables):
    """The rows of the forest plot: the first table's, in its order, and what only others have."""
    return list({row.key: row for table in tables for row in table.important}.values())


def draw_forest(figure, tables, shown):
    """The relative differences of the important rows with their 95 % intervals. A filled marker: the verdict is higher,
    lower or differ. If a value more than doubles, the axis has equal steps for equal ratios."""
    ax, several = figure.subplots(), len(tables) > 1
    every = [[table.row(one.key) for one in shown] for table in tables]
    ends = np.array([row.interval for rows in every for row in rows if row])
    ends = ends[np.isfinite(ends).all(axis=1)]
    ratios = ends.max() > 1
    low, high = max(ends.min(), -0.95) if ratios else ends.min(), ends.max()
    for number, (table, rows) in enumerate(zip(tables, every)):
        colour = run_style(number + 1)["color"] if several else INK
        shift = 0.22 + 0.4 * ((number + 0.5) / len(tables) - 0.5)  # below the text of the row
        ax.plot([], [], "o-", color=colour, label=literal(f"{table.b.label} against A", 44))
        for place, row in enumerate(rows):
            if not row or not math.isfinite(row.difference_error):
                continue
            inside = np.clip([row.difference, *row.interval], low, high)
            ax.plot(1 + inside[1:], [place + shift] * 2, color=colour, lw=1.6, solid_capstyle="butt")
            fill = colour if row.mood in ("apart", "differ") else "none"
            ax.plot(1 + inside[0], place + shift, "o", mfc=fill, mec=colour, mew=1.3, ms=5.5)
            if not several:
                words = f"{finding.percent(row)}  ({finding.interval(row).removesuffix(' %')})"
                ax.text(1, place - 0.25, words, ha="right", va="center", transform=ax.get_yaxis_transform(), fontsize=9)
    if ratios:
        ax.set_xscale("log")
        marks = (0.1, 1, 10, 100, 1000) if (1 + high) / (1 + low) > 30 else (0.1, 0.25, 0.5, 1, 2, 4, 10)
        ax.xaxis.set_major_locator(ticker.FixedLocator([m for m in marks if 1 + low < m < 1 + high]))
        ax.xaxis.set_minor_locator(ticker.NullLocator())
    else:
        ax.locator_params(axis="x", nbins=5)
    ax.xaxis.set_major_formatter(ticker.FuncFormatter(lambda x, _: _tick(100 * (x - 1))))
    ax.margins(x=0.06)
    ax.set_ylim(len(shown) - 0.45, -0.5)
    ax.set_xlim(ax.get_xlim())  # the ticks stay
    ax.grid(False)
    top, bottom = np.arange(len(shown)) + 0.03, np.arange(len(shown)) + 0.45
    for x in {1.0, *ax.get_xticks()}:  # only beside the bars: a line of the whole height would run through the texts
        look = {"lw": 0.8, "zorder": 1} if abs(x - 1) < 1e-9 else {"lw": 0.6, "alpha": 0.2, "zorder": 0.5}
        ax.vlines([x] * len(shown), top, bottom, color=INK, **look)
    for place, row in enumerate(shown):
        ax.axhline(place - 0.5, color=INK, lw=0.5, alpha=0.15)
        ax.text(0, place - 0.25, literal(row.name), va="center", transform=ax.get_yaxis_transform(), fontsize=9)
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    who = "each run" if several else literal(tables[0].b.name, 24)
    scale = ", logarithmic" if ratios else ""
    label = f"difference of {who} from {literal(tables[0].a.name, 24)} [%]{scale}"
    ax.set_xlabel(textwrap.fill(label, 60, break_long_words=False))
    if several:
        _legend(figure, [ax])


def _tick(percent: float) -> str:
    return "0" if abs(percent) < 1e-6 else f"{percent:+.4g}".replace("-", MINUS)


def spectra(tables):
    """kind -> the histograms of every side, of the kinds with enough impacts for a curve."""
    sides = sides_of(tables)
    every = dict.fromkeys(kind for side in sides for kind in side.first.kinds)
    found = {k: [[run.histogram(k) for run in s.runs if k in run.kinds] for s in sides] for k in every}
    return {kind: each for kind, each in found.items() if any(map(enough, each))}


def draw_spectra(figure, tables, found):
    """Spectra of the normal impact speed by contact kind; replicates are added up."""
    sides = sides_of(tables)
    columns = min(len(found), 2 if len(found) == 4 else 3)
    axes = figure.subplots(math.ceil(len(found) / columns), columns, sharey=True, sharex=True, squeeze=False).ravel()
    for ax, (kind, each) in zip(axes, found.items()):
        for number, (side, histograms) in enumerate(zip(sides, each)):
            duration = sum(run.duration for run in side.runs)
            curve(ax, histograms, duration, **run_style(number), label=literal(side.label, 44))
        ax.set_title(kind_label(kind))
        ax.set_xlim(1e-3, 20)
        ax.grid(alpha=0.3)
    for ax in axes[len(found) :]:
        ax.remove()
    for ax in axes[max(0, len(found) - columns) : len(found)]:
        ax.tick_params(labelbottom=True)
        ax.set_xlabel("normal impact speed [m/s]")
    for ax in axes[: len(found) : columns]:
        ax.set_ylabel("impacts per second\nand decade [1/s]")
    _legend(figure, axes[: len(found)])


def _legend(figure, axes):
    """One legend for all axes of a figure, above them."""
    found = {label: line for ax in axes for line, label in zip(*ax.get_legend_handles_labels())}
    if found:
        legend(figure, found.values(), found.keys(), 4, "upper left")


def draw_power(figure, _, sides):
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
            ax.axvspan(*window, color=INK, alpha=0.07, zorder=0, lw=0, label="sampled window")
        ax.set_xlabel("time [s]")
        ax.set_xlim(left=0)
        ax.grid(alpha=0.3)
    axes[0].set(title="power, means over short pieces of time", ylabel="power of the drive [W]")
    axes[1].set(title="translational kinetic energy", ylabel="kinetic energy of the balls [J]")
    _legend(figure, axes)


def speeds(tables):
    """The numbers of balls by speed over the frames in the window, of the sides that have frames."""
    counts = [(side, np.sum([run.speed_counts for run in side.runs], axis=0)) for side in sides_of(tables)]
    return counts if any(count.sum() for _, count in counts) else []


def draw_speeds(figure, _, counts):
    """Distribution of the balls' speeds over the frames in the window."""
    ax = figure.subplots()
    middle = np.sqrt(SPEED_EDGES[1:] * SPEED_EDGES[:-1])
    top = 0.0
    for number, (side, count) in enumerate(counts):
        if not count.sum():
            continue
        density = count / count.sum() / np.diff(SPEED_EDGES)
        density[density == 0] = np.nan
        ax.semilogy(middle, density, **run_style(number), label=literal(side.label, 44))
        top = max(top, SPEED_EDGES[1 + np.searchsorted(np.cumsum(count), 0.9995 * count.sum())])
    ax.set(xlabel="speed of the balls [m/s]", ylabel="probability density [s/m]")
    ax.grid(alpha=0.3)
    ax.set_xlim(0, top)
    ax.set_ylim(bottom=1e-4)
    _legend(figure, [ax])


# the flow only where the solid fraction is above LEAST: elsewhere it would be the speed of single balls
MAPS = (("solid_fraction", "solid fraction [1]"), ("velocity", "speed of the mean flow [m/s]"))


def draw_maps(figure, _, sides):
    """Cross-sections: all sides on one scale, and the difference of each side from the first, where both have cells."""
    view = "cross_section"
    columns = 2 * len(sides) - 1
    axes = figure.subplots(2, columns, squeeze=False, sharex=True, sharey=True)
    for line, (name, label) in zip(axes, MAPS):
        fields = [_field(side, name) for side in sides]
        top = max(np.nanquantile(f, 0.995) if np.isfinite(f).any() else 0 for f in fields) or 1
        for ax, side, field in zip(line, sides, fields):
            image = _map(ax, side, side.first.edges(), field, "viridis", 0, top)
            ax.set_title(literal(side.label, 30))
        colour_bar(image, line[: len(sides)], label=label, extend="max")
        off = []
        for side in sides[1:]:
            pair = [sides[0].first, side.first]
            common = cells.common(pair, view)
            one, two = (_field(s, name, common) for s in (sides[0], side))
            both = True if common is None else cells.shared(pair, view, common)
            off.append((side, common or side.first.edges(), np.where(both, two - one, np.nan)))
        finite = [np.abs(o[np.isfinite(o)]) for *_, o in off]
        reach = max((np.quantile(f, 0.99) for f in finite if len(f)), default=0) or top / 100
        for ax, (side, edges, difference) in zip(line[len(sides) :], off):
            ax.set_title(f"{side.letter} \N{MINUS SIGN} A")
            image = _map(ax, side, edges, difference, "RdBu_r", -reach, reach)
        what = label.replace(" [", ", difference [")
        colour_bar(image, line[len(sides) :], label=what, extend="both")
    reach = 1.02e3 * max(side.first.container.outermost for side in sides)
    for ax in axes.ravel():
        ax.locator_params(nbins=4)
        ax.grid(False)
        ax.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach))
    for ax in axes[-1]:
        ax.set_xlabel("y [mm]")
    for ax in axes[:, 0]:
        ax.set_ylabel("z [mm]")


def _field(side, name, common=None):
    """A side's map, or the magnitude of its mean velocity; NaN where there is nothing."""
    fraction = side.mean_map("solid_fraction", "cross_section", common)
    if name == "solid_fraction":
        return fraction
    with np.errstate(invalid="ignore"):
        speed = np.linalg.norm(side.mean_map(name, "cross_section", common), axis=0)
        return np.where(fraction > LEAST, speed, np.nan)


def _map(ax, side, edges, field, colours, low, high):
    y, z = (1e3 * edge for edge in edges)
    image = ax.pcolormesh(y, z, field.T, cmap=colours, vmin=low, vmax=high, rasterized=True)
    holds = side.first.container
    for patch in (rim(holds, lw=0.8), room(holds, ec="none")):
        patch.set_transform(Affine2D().scale(1e3) + ax.transData)  # in mm
        image.set_clip_path(ax.add_patch(patch))
    return image


# name, title, description for readers who cannot see it, what gives its data (nothing: no picture), what draws them,
# size [inch] for a number of sides and these data
PICTURES = (
    (
        "forest", "Differences", "relative differences with their 95 % intervals (bars); filled: higher, lower or "
        "differ; hollow: tied, agree or undecided",
        important, draw_forest, lambda n, rows: (WIDTH, 0.6 * (n - 1) + max(4.2, PITCH * len(rows))),
    ),
    (
        "spectra", "Impact speeds", "spectra of the normal impact speed by contact kind, all runs overlaid",
        spectra, draw_spectra, lambda n, _: (9.6, 5.8 + 0.2 * (n // 3)),
    ),
    (
        "over-time", "Over time", "power of the drive and kinetic energy of the balls over time",
        sides_of, draw_power, lambda n, _: (9.6, 3.6 + 0.2 * (n // 3)),
    ),
    (
        "sections", "Maps", "cross-sections of the mill: solid fraction for each run, speed of the mean flow "
        f"where the solid fraction is above {LEAST}, and the differences from the first, in common cells",
        sides_of, draw_maps, lambda n, _: (2.9 * (2 * n - 1) + 1.8, 6.2),
    ),
    (
        "ball-speeds", "Speeds of the balls", "distribution of the balls' speeds over the stored frames",
        speeds, draw_speeds, lambda n, _: (WIDTH, 3.4 + 0.2 * (n // 2)),
    ),
)  # fmt: skip


def figures(tables):
    """(name, title, description, figure) of every picture that has data."""
    for name, title, words, data, draw, size in PICTURES:
        if found := data(tables):
            with matplotlib.rc_context(LOOK):
                figure = Figure(figsize=size(len(tables) + 1, found), layout="none")
                draw(figure, tables, found)
                lay_out(figure)
            yield name, title, words, figure


def write(tables, path):
    """All pictures one below the other, the finding above them."""
    shown = [(one, found, one[-1](len(tables) + 1, found)) for one in PICTURES if (found := one[3](tables))]
    width, heights = max(w for *_, (w, _) in shown), [h + 0.5 for *_, (_, h) in shown]
    with matplotlib.rc_context(LOOK):
        said = [line for table in tables for line in textwrap.wrap(plain(finding.title(table)), int(9 * width))]
        heights = [0.2 * len(said) + 0.1, *heights]
        whole = Figure(figsize=(width, sum(heights)), layout="none")
        head, *parts = whole.subfigures(len(heights), 1, height_ratios=heights)
        head.suptitle("\n".join(literal(line, 400) for line in said), x=0.01, ha="left", fontsize=11, fontweight="bold")
        for part, ((_, title, _, _, draw, _), found, _) in zip(parts, shown):
            part.suptitle(title, fontweight="bold")
            draw(part, tables, found)
        lay_out(whole)
    save(whole, path, 100, LOOK)
