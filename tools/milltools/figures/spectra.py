"""Impact spectra: how often and how hard the balls collide, and which impacts dissipate the power.

    from milltools.figures import spectra
    spectra.plot(ax, run)                                   # impacts per second and decade by normal speed
    spectra.plot(ax, run, weight="energy")                  # W per decade: the area under a curve is its power
    spectra.plot(ax, run, abscissa="energy", weight="cumulative", kinds=["ball_blade"])

Spectra are per decade, so that bins of any width give the same curve and the integral over log10 is the total the file
counts: the number in the legend.
"""

import textwrap

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import literal, number
from milltools.figures import energies
from milltools.figures.base import LOOK, QUIET, WIDTH, Figure, labels, sampled, subtitle
from milltools.figures.bins import Bins, merged
from milltools.figures.style import KIND_LOOK, kind_look, legend, log_ticks, run_style
from milltools.read import sums
from milltools.read.kinds import label

GROUPS = ("impacts", "strikes")
SPEEDS = {"normal_speed": "normal impact speed", "tangential_speed": "slip speed at impact"}
WEIGHTS = ("count", "energy", "cumulative")
NORMAL = 1.96  # standard errors of a 95 % interval
SEEN = 1e-4  # share of the impacts that can be outside the picture on the left, of the power on each side


def bins(run, kind="all", group="impacts", speed="normal_speed", abscissa="speed") -> Bins:
    """The bins of a curve: impacts of a kind by speed [m/s] or by available normal energy [J]."""
    if abscissa == "energy":
        return energies.bins(run, kind, group)
    return merged(run.histogram(kind, group, speed), run.duration)


def plot(
    ax, run, group="impacts", speed="normal_speed", abscissa="speed", weight="count", kinds=None, per_ball=False,
    name="", position=None,
):  # fmt: skip
    """Draws the spectra of a run into matplotlib axes, with axis labels, units and limits; returns the lines, one a
    kind.

    run        an open milltools.read.runfile.Run
    group      "impacts" or "strikes" (re-contacts of a pair merged)
    speed      "normal_speed" (approach) or "tangential_speed" (slip of the surfaces)
    abscissa   "speed", or "energy": the available normal energy m* v_n^2 / 2
    weight     "count": impacts per second and decade, both axes logarithmic; "energy": dissipated power per decade, the
               ordinate linear, so that areas compare; "cumulative": impacts per second at or above
    kinds      contact kinds, as in Run.kinds and "all"; all kinds but "all" if None
    per_ball   the ordinate divided by the number of balls
    name, position   for several runs in the same axes: what the lines are called, and the run's number from 0, which
               sets their colour; without it the kind does

    Call ax.legend() for the legend: lines are labelled with their kind and total. UserError for an argument that is not
    one of the above, or if the run does not have the data."""
    kinds = _checked(run, group, speed, abscissa, weight, kinds)
    share = 1 / len(run.balls("mass")) if per_ball else 1.0
    drawn, lines = [], []
    for place, kind in enumerate(kinds):
        found = bins(run, kind, group, speed, abscissa)
        x, y = _curve(found, weight, share)
        look = _look(kind, run.kinds, place, position)
        total, unit = (found.power, "W") if weight == "energy" else (found.rate, "/s")
        words = label(kind) if not name else f"{name}, {label(kind)}"
        amount = f"{number(total * share)} {unit}" if found.total else "none"
        lines += ax.plot(x, y, **look, label=literal(f"{words}: {amount}", 60))
        joules = _joules(run, kind, found.edges, group, speed, abscissa)
        if joules is not None:
            _band(ax, x, y, found, sums.errors(run, joules, kind, weight == "cumulative"), weight, look["color"])
        if weight != "cumulative":
            _dots(ax, x, y, look["color"])
        drawn.append(found)
    _marks(ax, run, drawn, speed, abscissa, weight, share, position)
    _axes(ax, group, speed, abscissa, weight, per_ball, drawn[0].part)
    _limits(ax, weight)
    return lines


def _joules(run, kind, edges, group="impacts", speed="normal_speed", abscissa="speed"):
    """The edges of bins as normal energies [J], for which the file has the numbers of impacts in blocks of time; None
    where it has not."""
    mass = energies.one_mass(run)
    if group != "impacts" or speed != "normal_speed" or not sums.has_errors(run):
        return None
    if abscissa == "energy":
        return edges
    if mass is None or kind == "all":
        return None
    return 0.5 * (mass / 2 if kind == "ball_ball" else mass) * edges**2


def _band(ax, x, y, found: Bins, errors, weight, colour):
    """Shades the 95 % interval of the number of impacts in each bin; of the power, the same part of it."""
    rate = found.exceedance if weight == "cumulative" else found.count / found.duration
    with np.errstate(invalid="ignore", divide="ignore"):
        part = NORMAL * errors / rate
    low = y * (1 - part) if weight == "energy" else y * np.maximum(1 - part, 1e-3)  # above 0 on a logarithmic axis
    ax.fill_between(x, low, y * (1 + part), color=colour, alpha=0.25, lw=0, zorder=1, label="_band")


def _checked(run, group, speed="normal_speed", abscissa="speed", weight="count", kinds=None):
    kinds = list(run.kinds if kinds is None else [kinds] if isinstance(kinds, str) else kinds)
    for word, words, what in (
        (group, GROUPS, "group"),
        (speed, SPEEDS, "speed"),
        (abscissa, ("speed", "energy"), "abscissa"),
        (weight, WEIGHTS, "weight"),
        *((kind, (*run.kinds, "all"), "contact kind") for kind in kinds),
    ):
        if word not in words:
            raise UserError(f"unknown {what} '{word}': one of {', '.join(words)}")
    why = run.unsampled or (energies.why_not(run, group) if abscissa == "energy" else None)
    if why:
        raise UserError(f"{run.path}: {why}")
    if abscissa == "energy" and speed != "normal_speed":
        raise UserError("the abscissa 'energy' needs the speed 'normal_speed'")
    return kinds


def _curve(found: Bins, weight, share):
    if weight == "cumulative":
        return found.edges, np.where(found.exceedance > 0, found.exceedance * share, np.nan)
    density = found.rate_density if weight == "count" else found.power_density
    return found.middle, np.where(density != 0, density * share, np.nan)


def _dots(ax, x, y, colour):
    """Draws dots for bins between empty bins, which have no line."""
    there = np.isfinite(np.concatenate([[np.nan], y, [np.nan]]))
    alone = there[1:-1] & ~there[:-2] & ~there[2:]
    if alone.any():
        ax.plot(x[alone], y[alone], ".", color=colour, ms=3.5, label="_alone")


def _look(kind, kinds, place, position):
    if position is None:
        return {**kind_look(kind, kinds), "lw": 1.5}
    lines = [line for _, line in KIND_LOOK.values()]
    return {**run_style(position), "ls": lines[place % len(lines)], "lw": 1.5}


def _marks(ax, run, drawn, speed, abscissa, weight, share, position):
    """Draws lines at the rebound floor and at the height of a bin with a single impact."""
    if weight == "energy":
        return
    floor = run.rebound_floor if not run.soft else 0.0
    first = position in (None, 0)
    if floor and first and abscissa == "speed" and speed == "normal_speed":
        ax.axvline(floor, **QUIET, lw=0.9, ls=":", label=f"rebound floor, {number(floor)} m/s")
    one = share / drawn[0].duration
    if weight == "count":
        one /= drawn[0].decades[0]
    ax.axhline(one, **QUIET, lw=0.9, ls=(0, (1, 2.5)), label="one impact" if first else "_one")


def _axes(ax, group, speed, abscissa, weight, per_ball, part):
    ax.set_xscale("log")
    log_ticks(ax.xaxis)
    if weight != "energy":
        ax.set_yscale("log")
        log_ticks(ax.yaxis)
    energy = "available normal energy ½ m* v² of an impact [J]"
    ax.set_xlabel(energy if abscissa == "energy" else f"{SPEEDS[speed]} [m/s]")
    ball = " and ball" if per_ball else ""
    power = "dissipated power per decade" + ball + (f", {part} part" if part != "all" else "")
    words = {
        "count": f"{group} per second{ball.replace(' and', ',')} and decade [1/s]",
        "energy": f"{power} [W]",
        "cumulative": f"{group} per second{ball} at or above [1/s]",
    }
    ax.set_ylabel(textwrap.fill(words[weight], 40))
    ax.grid(True, **{k.split(".")[1]: LOOK[k] for k in ("grid.color", "grid.alpha")})


def _limits(ax, weight):
    """Limits the axes to the important part of all curves: the few slowest impacts spread over many decades."""
    ends = []  # left, right, bottom, top of each curve
    for line in ax.lines:
        x, y = (np.asarray(v, float) for v in line.get_data())
        there = np.isfinite(y)
        if len(x) < 20 or not np.any(y[there]):
            continue  # a marking line, or an empty curve: elastic contacts dissipate no energy
        x, y = x[there], y[there]
        if weight == "cumulative":
            seen = x[y <= y.max() * (1 - SEEN)]
        else:
            share = np.cumsum(np.abs(y)) / np.abs(y).sum()
            seen = x[(share > SEEN) & (share - np.diff(share, prepend=0) < 1 - SEEN)]
        seen = seen if len(seen) else x
        ends.append((seen[0], seen[-1] if weight == "energy" else x[-1], y.min(), y.max()))
    if not ends:  # nothing within the bins
        ax.set(xlim=(1e-3, 10), ylim=(1e-3, 1))
        return
    left, right, bottom, top = zip(*ends)
    ax.set_xlim(min(left) / 1.3, max(right) * 1.3)
    if weight == "energy":
        ax.set_ylim(min(0, 1.05 * min(bottom)), 1.05 * max(top) or 1)
    else:
        ax.set_ylim(min(bottom) / 1.6, max(top) * 2)


class SpectrumFigure(Figure):
    """A spectrum of every contact kind; for several runs, of all kinds together or of the chosen kinds."""

    group = "spectra"
    options = ("kinds", "strikes", "per_ball")

    def __init__(self, name, title, caption, weight, speed="normal_speed", abscissa="speed"):
        self.name, self.title, self.caption, self.weight = name, title, caption, weight
        self.by = {"speed": speed, "abscissa": abscissa}
        self.energetic = abscissa == "energy"

    def why_not(self, run, kinds=None, strikes=False, per_ball=False):
        group = GROUPS[bool(strikes)]
        why = run.unsampled or (energies.why_not(run, group) if self.energetic else None)
        if why:
            return why
        rows = _checked(run, group, kinds=kinds or "all")
        of_kind = " of that kind" if kinds else ""
        if not any(int(run.statistic(f"{group}/{kind}/count")) for kind in rows):
            return f"no {group}{of_kind} in the sampled window"
        if not any(run.histogram(kind, group, self.by["speed"]).count.any() for kind in rows):
            return f"all {group}{of_kind} are slower or faster than the bins of the file"
        return None

    def says(self, runs):
        known = (_joules(run, kind, np.ones(1), **self.by) is not None for run in runs for kind in run.kinds)
        return f"{self.caption} Bands: 95 % intervals." if any(known) else self.caption

    def prepare(self, run, told=None):
        if self.energetic and not self.why_not(run):
            energies.read(run, told)

    def paint(self, figure, runs, kinds=None, strikes=False, per_ball=False):
        figure.set_size_inches(WIDTH, 4.1)
        ax = figure.subplots()
        one, names = len(runs) == 1, labels(runs)
        kinds = kinds or (None if one else "all")
        for k, (run, name) in enumerate(zip(runs, names)):
            several = {} if one else {"name": name, "position": k}
            plot(
                ax,
                run,
                GROUPS[bool(strikes)],
                weight=self.weight,
                kinds=kinds,
                per_ball=per_ball,
                **self.by,
                **several,
            )
        words = {sampled(run) for run in runs}
        first = f"{names[0]}, " if one else ""
        subtitle(ax, first + (words.pop() if len(words) == 1 else "each over its own window"))
        entries = list(zip(*ax.get_legend_handles_labels()))
        entries.sort(key=lambda entry: len(entry[0].get_xdata()) == 2)  # marking lines last
        legend(figure, *zip(*entries), 2, rest=3.2, handlelength=2.6)

    def columns(self, run, kinds=None, strikes=False, per_ball=False):
        group = GROUPS[bool(strikes)]
        axis = "available normal energy {} [J]" if self.energetic else "speed {} [m/s]"
        kinds = _checked(run, group, **self.by, kinds=kinds or (*run.kinds, "all"))
        rows = [_rows(kind, bins(run, kind, group, **self.by), axis, group) for kind in kinds]
        together = {head: np.concatenate([row[head] for row in rows]) for head in rows[0]}
        if per_ball:
            head = f"{group} per second, ball and decade [1/s]"
            together[head] = together[f"{group} per second and decade [1/s]"] / len(run.balls("mass"))
        return together


def _rows(kind, found: Bins, axis: str, group: str) -> dict:
    """The bins of a kind from the first to the last that is not empty, with a row below and a row above for impacts
    outside all bins."""
    used = np.flatnonzero((found.count != 0) | (found.dissipation != 0))
    a, b = (used[0], used[-1] + 1) if len(used) else (0, 0)

    def whole(values, first=np.nan, last=np.nan):
        return np.concatenate([[first], values[a:b], [last]])

    edges = np.concatenate([[0.0], found.edges[a : b + 1], [np.inf]])
    count = whole(found.count, found.below[0], found.above[0])
    lost = whole(found.dissipation, found.below[1], found.above[1])
    part = "" if found.part == "all" else f", {found.part} part"
    return {
        "kind": np.array([kind] * len(count)),
        axis.format("from"): edges[:-1],
        axis.format("to"): edges[1:],
        f"{group} [1]": count,
        f"{group} per second [1/s]": count / found.duration,
        f"{group} per second and decade [1/s]": whole(found.rate_density),
        f"{group} per second at or above [1/s]": np.append(found.rate, found.exceedance[a : b + 1]),
        f"dissipated power{part} [W]": lost / found.duration,
        f"dissipated power per decade{part} [W]": whole(found.power_density),
    }


_KINDS = (  # name, title, abscissa in words
    ("speeds", "Normal impact speeds", "normal speed", {}),
    ("slip", "Slip speeds at impact", "slip speed", {"speed": "tangential_speed"}),
    ("energies", "Impact energies", "available normal energy", {"abscissa": "energy"}),
)
_WEIGHTED = (  # end of the name, of the title, caption
    ("", "", "count", "How often the balls hit at each {}: impacts per second and decade, by contact kind. "
     "The integral of a curve is the rate in the legend. Dotted: the height of a single impact in the window."),
    ("-power", ": dissipated power", "energy", "The {} of the impacts that dissipate the power: dissipated power per "
     "decade, by contact kind. The area under a curve is the power in the legend, so equal areas are equal powers."),
    ("-exceedance", ": exceedance", "cumulative", "How often an impact reaches a given {}: impacts per second at or "
     "above it, by contact kind."),
)  # fmt: skip
FIGURES = tuple(
    SpectrumFigure(name + end, title + more, caption.format(words), weight, **what)
    for name, title, words, what in _KINDS
    for end, more, weight, caption in _WEIGHTED
)
