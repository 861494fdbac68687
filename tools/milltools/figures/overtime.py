"""Figures over time: power and torque of the drive, energy of the charge, rate of the collisions.

Means over an interval are differences of cumulative series divided by the time between, so they are exact for intervals
of any length; between two rows a series is interpolated linearly.
"""

import math

import numpy as np

from milltools.base.text import literal, number
from milltools.figures.base import WIDTH, Figure, labels, subtitle
from milltools.figures.style import COLOURS, INK, KIND_LOOK, LINES, kind_look, legend, log_ticks, run_style
from milltools.read import motions
from milltools.read.kinds import label

FIRST, SECOND = (KIND_LOOK[kind][0] for kind in ("ball_ball", "ball_drum"))
EACH = (FIRST, *COLOURS[3:], SECOND)  # colours of the motions of a run
MOST = 300  # largest number of fine intervals: more would be a blur and a large file


def intervals(time) -> np.ndarray:
    """Bounds of the fine intervals: the rows of a series, or an even choice of at most MOST + 1 of them."""
    if len(time) <= MOST + 1:
        return time
    return time[np.linspace(0, len(time) - 1, MOST + 1).round().astype(int)]


def means(time, cumulative, bounds) -> np.ndarray:
    """Mean rates between `bounds` of a cumulative series."""
    return np.diff(np.interp(bounds, time, cumulative)) / np.diff(bounds)


def revolutions(run, time) -> np.ndarray:
    """Bounds of whole periods of the slowest motion (revolutions of the rotor) within the series. One bound is the
    start of the sampled window, so that the periods in the window are the blocks of the file. Empty if nothing moves or
    the series is shorter than a period."""
    period = run.period
    if not math.isfinite(period) or len(time) < 2:
        return np.empty(0)
    start = run.window[0] if run.has_statistics else 0.0
    slack = 1e-9 * max(period, time[-1])
    first = math.ceil((time[0] - start - slack) / period)
    last = math.floor((time[-1] - start + slack) / period)
    together = max(1, math.ceil((last - first) / MOST))  # in a long run, several periods in one interval
    bounds = start + period * np.arange(first, last + 1, together)
    return np.clip(bounds, time[0], time[-1]) if len(bounds) > 1 else np.empty(0)


class OverTime(Figure):
    """Lines over time; the sampled window is shaded."""

    group = "time"
    ylabel = ""
    series = "kinetic_energy"

    def paint(self, figure, runs):
        figure.set_size_inches(WIDTH, 3.3)
        ax = figure.subplots()
        windows = {run.window for run in runs if not run.unsampled}
        if len(windows) == 1:  # the same of all
            ax.axvspan(*windows.pop(), color=INK, alpha=0.07, lw=0, zorder=0, label="sampled window")
        for k, (run, name) in enumerate(zip(runs, labels(runs))):
            self.lines(ax, run, name if len(runs) > 1 else "", k)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(self.ylabel)
        ax.set_xlim(0, max(run.series("kinetic_energy")[0][-1] for run in runs))
        handles, texts = ax.get_legend_handles_labels()
        if handles:
            legend(figure, handles, texts, 2, rest=2.5, handlelength=2.4)
        if len(runs) == 1:
            subtitle(ax, labels(runs)[0])

    def why_not(self, run):
        for name in self.needed(run):
            if not run.has_series(name):
                return f"the file has no series /observables/{name}"
            time, value = run.series(name)
            if len(time) < 2:
                return "fewer than two rows of the time series are stored (output.series)"
            if not np.isfinite(value).all():
                return f"/observables/{name} contains values that are not numbers"
        return None

    def needed(self, run):
        return [self.series]

    def lines(self, ax, run, name, position):
        raise NotImplementedError


def _named(name, words):
    return literal(f"{name}, {words}" if name else words, 60)


class Draw(OverTime):
    """Power or torque of the whole drive and of each motion: means over short intervals, over whole periods, and over
    the window with its standard error."""

    def __init__(self, name, title, series, statistic, unit, caption):
        self.name, self.title, self.series, self.caption = name, title, series, caption
        self.statistic, self.unit = statistic, unit
        self.ylabel = f"{title[0].lower()}{title[1:]} [{unit}]"

    def why_not(self, run):
        if self.sources(run):
            return super().why_not(run)
        return "no motion turns at a constant speed" if run.driven else "nothing moves in this mill"

    def sources(self, run):
        """(motion, its series, divisor of the series, group of its statistics); motion "": the whole drive."""
        if run.driven != "drive":
            return [("", self.series, 1.0, "rotor")] if run.has_rotor else []
        torque = self.statistic == "torque"
        rates = {name: motions.rate(run, name) if torque else 1.0 for name in run.motions}
        each = [(name, f"motion_work/{name}", rate, f"motions/{name}") for name, rate in rates.items() if rate]
        if torque:
            return each
        known = len(each) > 1 and all(run.has_series(series) for _, series, *_ in each)
        whole = self.series if run.has_series(self.series) else f"motion_work/{run.motions[0]}"
        return [("", whole, 1.0, "drive"), *(each if known else [])]

    def needed(self, run):
        return [series for _, series, *_ in self.sources(run)]

    def curves(self, run):
        """Of every source: (motion, time, integral of the quantity over time, its mean and standard error over the
        sampled window, NaN if not known)."""
        for motion, series, divisor, place in self.sources(run):
            time, value = run.series(series) if motion or self.statistic == "torque" else run.drive_work()
            if series == "rotor_torque":  # the mean over the interval before each row
                value = np.concatenate([[0.0], np.cumsum(value[1:] * np.diff(time))])
            mean = error = math.nan
            if not run.unsampled and run.has(f"statistics/{place}/{self.statistic}"):
                mean, error = (float(run.statistic(f"{place}/{self.statistic}{end}")) for end in ("", "_error"))
            yield motion, time, value / divisor, mean, error

    def parts(self, run):
        """(name of the interval, bounds) of the fine and of the coarse means."""
        time = run.series("kinetic_energy")[0]
        turn = "period" if run.driven == "drive" else "revolution"
        return ("interval", intervals(time)), (turn, revolutions(run, time))

    def lines(self, ax, run, name, position):
        sources = list(self.curves(run))
        if name and self.statistic == "power":  # of several runs only the whole drive
            sources = sources[:1]
        (_, fine), (period, turns) = self.parts(run)
        low, high = ax.get_ylim() if position else (0.0, 0.0)
        for k, (motion, time, whole, mean, error) in enumerate(sources):
            colour = run_style(position)["color"] if name else EACH[k % len(EACH)]
            who = ", ".join(filter(None, [name, motion]))
            look = {"baseline": None, "color": colour, "ls": LINES[k % len(LINES)] if name else "-"}
            value = np.zeros(1)
            if not motion or len(sources) == 1 or not len(turns):
                value = means(time, whole, fine)
                words = f"mean of {number(1e3 * float(np.median(np.diff(fine))))} ms"
                ax.stairs(value, fine, lw=0.7, alpha=0.6, **look, label=_named(who, words))
            if len(turns):
                thick = means(time, whole, turns)
                ax.stairs(thick, turns, lw=1.8, **look, label=_named(who, f"mean of a {period}"))
                value = np.append(value, thick)
            low, high = min(low, 1.05 * float(value.min())), max(high, 1.05 * float(value.max()))
            if math.isfinite(mean):
                begin, end = run.window
                colour = colour if name or len(sources) > 1 else SECOND
                sure = ""
                if math.isfinite(error):
                    sure = f" ± {number(error, 2)}"
                    ax.fill_between([begin, end], mean - error, mean + error, color=colour, alpha=0.3, lw=0)
                words = _named(who, f"window: {number(mean)}{sure} {self.unit}")
                ax.plot([begin, end], [mean] * 2, color=colour, lw=1.2, ls=(0, (5, 2)), label=words)
        ax.set_ylim(low, high if high > low else 1)

    def columns(self, run):
        rows = []
        for motion, time, whole, mean, error in self.curves(run):
            who = motion or ("all" if run.driven == "drive" else "rotor")
            for what, bounds in self.parts(run):
                rows += [(who, what, *row, math.nan) for row in zip(bounds, bounds[1:], means(time, whole, bounds))]
            if math.isfinite(mean):
                rows.append((who, "window", *run.window, mean, error))
        mean, error = f"{self.statistic} [{self.unit}]", f"standard error [{self.unit}]"
        heads = ("motion", "mean over", "from [s]", "to [s]", mean, error)
        return dict(zip(heads, map(np.array, zip(*rows))))


class Energy(OverTime):
    name, title = "energy", "Kinetic energy"
    caption = "Kinetic energy of all balls over time: of translation and of rotation. Shaded: the sampled window."
    ylabel = "kinetic energy [J]"
    SERIES = {"kinetic_energy": "translation", "rotational_energy": "rotation"}

    def needed(self, run):
        return list(self.SERIES)

    def thinned(self, run, name):
        time, value = run.series(name)
        rows = np.searchsorted(time, intervals(time))
        return time[rows], value[rows]

    def lines(self, ax, run, name, position):
        for (series, words), own, dashes in zip(self.SERIES.items(), (FIRST, SECOND), ("-", (0, (4, 1.5)))):
            colour = run_style(position)["color"] if name else own
            ax.plot(*self.thinned(run, series), color=colour, lw=1.4, ls=dashes, label=_named(name, words))
        ax.set_ylim(bottom=0)

    def columns(self, run):
        time = self.thinned(run, "kinetic_energy")[0]
        values = {f"{words} [J]": self.thinned(run, series)[1] for series, words in self.SERIES.items()}
        return {"time [s]": time, **values}


class Collisions(OverTime):
    name, title = "collisions", "Rate of impacts"
    caption = "Impacts per second over time, by contact kind, logarithmic. Shaded: the sampled window."
    ylabel = "impacts per second [1/s]"
    series = "collisions/ball_ball"

    def needed(self, run):
        return [f"collisions/{kind}" for kind in run.kinds]

    def why_not(self, run):
        none = "no impact was counted"
        return super().why_not(run) or (None if any(run.series(n)[1].any() for n in self.needed(run)) else none)

    def rates(self, run, kind):
        """(bounds, rates) [s], [1/s] of a kind, or of "all"."""
        kinds = run.kinds if kind == "all" else [kind]
        time = run.series(f"collisions/{kinds[0]}")[0]
        bounds = intervals(time)
        return bounds, sum(means(time, run.series(f"collisions/{k}")[1], bounds) for k in kinds)

    def lines(self, ax, run, name, position):
        for kind in ["all"] if name else run.kinds:
            bounds, rate = self.rates(run, kind)
            if not rate.any():
                continue
            look = {**(run_style(position) if name else kind_look(kind, run.kinds)), "lw": 1.2}
            middle = (bounds[1:] + bounds[:-1]) / 2
            ax.plot(middle, np.where(rate > 0, rate, np.nan), **look, label=_named(name, label(kind)))
        ax.set_yscale("log")
        log_ticks(ax.yaxis)

    def columns(self, run):
        bounds, _ = self.rates(run, "all")
        rates = {f"{kind} [1/s]": self.rates(run, kind)[1] for kind in (*run.kinds, "all")}
        return {"from [s]": bounds[:-1], "to [s]": bounds[1:], **rates}


_CAPTION = (
    "{}. Thin: means over short intervals. Thick: means over whole revolutions, or over periods of the slowest motion. "
    "Shaded: the sampled window, with its mean and standard error."
)
FIGURES = (
    Draw("power", "Power of the drive", "rotor_work", "power", "W",
         _CAPTION.format("Power that all motions give to the balls, and that of each motion if there are several")),
    Draw("torque", "Torque of the drive", "rotor_torque", "torque", "N m",
         _CAPTION.format("Torque on the balls about the axis of each motion that turns")),
    Energy(),
    Collisions(),
)  # fmt: skip
