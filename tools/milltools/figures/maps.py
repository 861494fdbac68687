"""Maps of fields: in the cross-section (y, z), averaged along the axis, and in the axial cut (x, r), averaged around
the axis. Densities are per volume inside the container, also in cells that the wall cuts, like the solid fraction in
the file. Cells without data are blank."""

import dataclasses
import functools
import textwrap

import matplotlib
import numpy as np
from matplotlib.colors import ListedColormap, LogNorm, Normalize

from milltools.dose.wear import ENOUGH
from milltools.figures import outlines
from milltools.figures.base import WIDTH, Figure, labels, sampled, subtitle
from milltools.figures.style import beyond, colour_bar, log_ticks, millimetres
from milltools.geometry import vessel
from milltools.read.runfile import VIEWS

ARROWS = 20  # approximate number of arrows along the longer side
ENDS = (0.01, 0.995)  # the ends of a colour scale are these quantiles by volume
FEW = "#c0c0c0"  # colour of cells with too few impacts for a mean
RANGE = 1e4  # largest ratio of the ends of a logarithmic scale


@functools.lru_cache
def colours(name: str) -> ListedColormap:
    """A colour map of matplotlib without its black end, which looks blank on a dark page."""
    return ListedColormap(matplotlib.colormaps[name](np.linspace(0.12, 1, 256)), name)


@dataclasses.dataclass(frozen=True)
class Shown:
    """A quantity of maps: the `head` of its column and the `label` of its colour scale include the unit."""

    words: str
    caption: str
    head: str
    label: str
    log: bool
    impacts: bool  # computed from impacts, else from the balls
    scale: float = 1.0  # of the numbers in the picture


QUANTITIES = {
    "rate": Shown(
        "rate of impacts",
        "How often the balls hit at each place: impacts per second and volume, logarithmic.",
        "impacts per time and volume [1/(m3 s)]", "impacts per time and volume [1/(cm³ s)]", True, True, 1e-6),
    "impact-speed": Shown(
        "impact speed",
        "How hard the impacts are: the mean normal speed of the impacts in a cell; grey: too few impacts for a mean.",
        "mean normal impact speed [m/s]", "mean normal impact speed [m/s]", False, True),
    "power": Shown(
        "dissipated power", "Where the energy goes: dissipated power per volume, logarithmic.",
        "dissipated power per volume [W/m3]", "dissipated power density [W/cm³]", True, True, 1e-6),
    "solid": Shown(
        "solid fraction", "Where the balls are: the share of the volume they fill, averaged over time.",
        "solid fraction [1]", "solid fraction", False, False),
    "velocity": Shown(
        "mean velocity",
        "How the charge moves: the colour is the speed of the mean flow, the arrows its part in the plane.",
        "mean speed [m/s]", "speed of the mean flow [m/s]", False, False),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Field:
    """A view of maps: edges (n + 1,), (m + 1,) [m] of the cells, their volumes inside the container (n, m) [m^3], and
    each of QUANTITIES (n, m), NaN in cells without data; `flow` (3, n, m) [m/s]: the mean velocity, `count` (n, m):
    number of impacts."""

    edges: tuple[np.ndarray, np.ndarray]
    volume: np.ndarray
    count: np.ndarray
    values: dict[str, np.ndarray]
    flow: np.ndarray
    part: str


def field(run, view: str) -> Field:
    """A view of a run's maps."""
    edges = run.edges(view)
    count = run.map("impact_count", view).astype(float)
    volume = vessel.of(run).volume(view, edges)
    whole = np.outer(np.diff(edges[0]), np.diff(edges[1] if view == "cross_section" else np.pi * edges[1] ** 2))
    if view == "cross_section":
        whole *= np.ptp(run.edges("axial")[0])
    # cells with impacts that are outside but for rounding
    volume = np.where((volume <= 0) & (count > 0), whole, volume)
    fraction = run.map("solid_fraction", view).astype(float)
    flow = np.array([run.map(f"velocity_{axis}", view) for axis in VIEWS[view][2]], float)
    with np.errstate(invalid="ignore", divide="ignore"):
        met = count > 0
        room = np.where(volume > 0, volume, np.nan) * run.duration
        values = {
            "rate": np.where(met, count / room, np.nan),
            "impact-speed": np.where(met, run.map("normal_speed_sum", view) / count, np.nan),
            "power": np.where(met, run.map("dissipation", view) / room, np.nan),
            "solid": np.where(fraction > 0, fraction, np.nan),
            "velocity": np.where(fraction > 0, np.sqrt((flow**2).sum(axis=0)), np.nan),
        }
    part = run.attribute(f"statistics/maps/{view}/dissipation", "part", "all")
    return Field(edges, volume, count, values, flow, part)


def limits(fields, name) -> tuple[float, float]:
    """Ends of a common colour scale of all fields: the quantiles ENDS by volume. A quantity of impacts is taken only
    from cells with `wear.ENOUGH` impacts; if there is no such cell, from those with the most."""
    value = np.concatenate([f.values[name].ravel() for f in fields])
    volume = np.concatenate([f.volume.ravel() for f in fields])
    log = QUANTITIES[name].log
    good = np.isfinite(value) & (volume > 0) & ((value > 0) if log else True)
    if QUANTITIES[name].impacts and good.any():
        count = np.concatenate([f.count.ravel() for f in fields])
        good &= count >= min(ENOUGH, count[good].max())
    if not good.any():
        return (1.0, 10.0) if log else (0.0, 1.0)
    low, high = np.quantile(value[good], ENDS, weights=volume[good], method="inverted_cdf")
    if log:
        return min(max(low, high / RANGE), high / 2), high
    return 0.0, high or 1.0


class MapFigure(Figure):
    group = "maps"

    def __init__(self, name, view, quantity, title, caption):
        self.name, self.view, self.quantity = name, view, quantity
        self.title, self.caption = title, caption

    def says(self, runs):
        return " ".join(dict.fromkeys([self.caption, *(outlines.signs(run, self.view) for run in runs)]))

    def why_not(self, run):
        if run.unsampled:
            return run.unsampled
        if not run.has(f"statistics/maps/{self.view}"):
            return "the file has no maps"
        if QUANTITIES[self.quantity].impacts:
            return None if run.map("impact_count", self.view).any() else "no impacts in the sampled window"
        return None if int(run.statistic("maps/samples")) else "no snapshot of the balls in the sampled window"

    def paint(self, figure, runs):
        quantity, fields = QUANTITIES[self.quantity], [field(run, self.view) for run in runs]
        low, high = (quantity.scale * end for end in limits(fields, self.quantity))
        norm = LogNorm(low, high, clip=False) if quantity.log else Normalize(low, high)
        figure.set_size_inches(WIDTH, 0.4 + len(runs) * self._height(runs))
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        first, second, _ = VIEWS[self.view]
        words = vessel.axes(runs)
        for ax, run, name, found in zip(axes, runs, labels(runs), fields):
            image = self._panel(ax, run, found, norm)
            subtitle(ax, f"{name}, {sampled(run)}")
            ax.set_ylabel(words[second])
        axes[-1].set_xlabel(words[first])
        x, y = [ax.get_xlim() for ax in axes], [ax.get_ylim() for ax in axes]
        for ax in axes:  # mills of different size on one scale
            ax.set(xlim=(np.min(x), np.max(x)), ylim=(np.min(y), np.max(y)))
            ax.locator_params(axis="y", nbins=np.clip(int(14 * np.ptp(y) / np.ptp(x)), 2, 5))
        words = quantity.label
        if self.quantity == "power" and fields[0].part != "all":
            words = words.replace(" [", f", {fields[0].part} part [")
        values = quantity.scale * np.concatenate([found.values[self.quantity].ravel() for found in fields])
        extend = beyond(values, low, high)
        bar = colour_bar(image, axes, label=textwrap.fill(words, int(13 * figure.get_figheight())), extend=extend)
        if quantity.log:
            log_ticks(bar.ax.yaxis, low, high)

    def _panel(self, ax, run, found, norm):
        quantity, few_cells = QUANTITIES[self.quantity], None
        value, log = quantity.scale * found.values[self.quantity], quantity.log
        if log:  # a negative loss, of slow impacts at the rebound floor, is below the scale
            value = np.where(value <= 0, norm.vmin / 2, value)
        elif quantity.impacts:
            few = found.count < min(ENOUGH, found.count.max())
            grey = np.where(few & np.isfinite(value), 0.0, np.nan).T
            look = {"cmap": ListedColormap([FEW]), "rasterized": True, "zorder": 1}
            few_cells, value = ax.pcolormesh(*found.edges, grey, **look), np.where(few, np.nan, value)
        rim = (outlines.section if self.view == "cross_section" else outlines.axial)(ax, run)
        image = ax.pcolormesh(
            *found.edges, value.T, norm=norm, cmap=colours("inferno" if log else "viridis"), rasterized=True, zorder=1,
        )  # fmt: skip
        image.set_clip_path(rim)
        if few_cells:
            few_cells.set_clip_path(rim)
        if self.quantity == "velocity":
            self._arrows(ax, found)
        ax.set_aspect("equal")
        ax.locator_params(nbins=5)
        millimetres(ax)
        ax.grid(False)
        return image

    def _arrows(self, ax, found):
        """Draws the part of the mean velocity in the plane as arrows: averages over squares of cells, weighted with the
        volume of the balls."""
        planar = (1, 2) if self.view == "cross_section" else (0, 1)
        weight = np.nan_to_num(found.values["solid"]) * found.volume
        step = max(1, round(max(weight.shape) / ARROWS))
        places = np.meshgrid(*(0.5 * (e[:-1] + e[1:]) for e in found.edges), indexing="ij")
        flow = [np.nan_to_num(found.flow[k]) for k in planar]
        balls, room = _blocks(weight, step), _blocks(found.volume, step)
        there = balls > 0.005 * np.maximum(room, 1e-300)  # without the squares of a few stray balls
        x, y, u, v = (_blocks(weight * what, step)[there] / balls[there] for what in (*places, *flow))
        top = np.quantile(np.hypot(u, v), 0.98) if there.any() else 0
        if not top:
            return
        long = np.hypot(u, v) > 0.04 * top  # shorter ones are dots
        span = step * float(np.diff(found.edges[0][:2])[0])
        ax.quiver(  # without the wall's clip path: matplotlib writes it for each arrow of an SVG
            x[long], y[long], u[long], v[long],
            angles="xy", scale_units="xy", scale=top / (1.5 * span), units="xy", width=0.14 * span, pivot="mid",
            headwidth=3.4, headlength=3.6, headaxislength=3.2, fc="#fafafa", ec="#101010", lw=0.35, zorder=2,
        )  # fmt: skip

    def _height(self, runs):
        if self.view == "cross_section":
            return 3.65
        sizes = [vessel.of(run) for run in runs]
        radius = max(size.outermost for size in sizes)
        length = max(size.high - size.low for size in sizes)
        return min(max(3.3 * radius / length, 0.8), 4.5) + 0.75

    def columns(self, run):
        found = field(run, self.view)
        first, second, components = VIEWS[self.view]
        low, high = (
            np.meshgrid(*(edge[part] for edge in found.edges), indexing="ij") for part in (slice(-1), slice(1, None))
        )
        part = "" if found.part == "all" else f", {found.part} part"
        table = {f"{first} from [m]": low[0], f"{first} to [m]": high[0]}
        table |= {f"{second} from [m]": low[1], f"{second} to [m]": high[1]}
        table |= {"volume in the container [m3]": found.volume, "impacts [1]": found.count}
        for name, quantity in QUANTITIES.items():
            head = quantity.head.replace(" per volume", f"{part} per volume") if name == "power" else quantity.head
            table[head] = found.values[name]
        table |= {f"mean velocity {axis} [m/s]": values for axis, values in zip(components, found.flow)}
        return {head: values[found.volume > 0] for head, values in table.items()}


def _blocks(values, step):
    """Sums over squares of step x step cells; the last squares can be smaller."""
    first, second = (np.arange(0, n, step) for n in values.shape)
    return np.add.reduceat(np.add.reduceat(values, first, axis=0), second, axis=1)


_ROUND = {
    "axial": ("Axial cut", "axial", "Averaged around the container's axis x; r is the distance from it."),
    "cross_section": (
        "Cross-section", "section",
        "Averaged along the container's axis x, seen against the direction of x, as the charge is steady.",
    ),
}  # fmt: skip
FIGURES = tuple(
    MapFigure(f"{short}-{name}", view, name, f"{place}: {shown.words}", f"{shown.caption} {where}")
    for view, (place, short, where) in _ROUND.items()
    for name, shown in QUANTITIES.items()
)
