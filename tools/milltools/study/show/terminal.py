"""A study on the terminal: how far it is, what it cost, the best designs with 95 % confidence, what cannot be told from the
best, which key matters, the Pareto front."""

import collections
import math
import sys
import time

import numpy as np
import pandas as pd

from milltools.study.show import optimum as show_optimum
from milltools.study.show import stats as show_stats
from milltools.study.show.data import scale_of

BEST = 10  # lines of the table of designs
FRONT = 20  # lines of the table of the Pareto front
QUIET = 3  # a study that rests for so many usual pauses between two runs is said to rest


def plain(text) -> str:
    """What a file said, without characters that would steer a terminal."""
    return "".join(c if c.isprintable() else "?" for c in str(text))


def told(value: float, half: float) -> tuple[str, str]:
    """A value and its half width, both to the second digit of the latter; five digits and nothing without one."""
    if not math.isfinite(value):
        return "", ""
    if not math.isfinite(half) or half <= 0:
        return f"{value:.5g}", ""
    digits = 1 - math.floor(math.log10(half))
    if digits > 8 or abs(value) >= 1e7:
        return f"{value:.5g}", f"{half:.2g}"
    return f"{value:.{max(digits, 0)}f}", f"{half:.{max(digits, 0)}f}"


def pair(value: float, half: float, scale) -> str:
    """ "1.098 +- 0.013 m/s" """
    value, half = told(value / scale.size, half / scale.size)
    return f"{value}{' +- ' + half if half else ''}{scale.suffix}"


def duration(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "?"
    if seconds < 100:
        return f"{seconds:.3g} s"
    minutes, hours = seconds / 60, seconds / 3600
    if minutes < 100:
        return f"{minutes:.3g} min"
    return f"{hours:.3g} h" if hours < 100 else f"{hours / 24:.3g} days"


def aligned(heads, lines, left=()) -> list[str]:
    """Columns under their heads, the ones in `left` flush left."""
    table = [[plain(cell) for cell in line] for line in [heads, *lines]]
    widths = [max(len(line[k]) for line in table) for k in range(len(heads))]
    return [
        "  " + "  ".join(
            f"{cell:<{w}}" if k in left else f"{cell:>{w}}" for k, (cell, w) in enumerate(zip(line, widths))
        ).rstrip()
        for line in table
    ]  # fmt: skip


def finished_times(view) -> np.ndarray:
    """When each run ended [s since 1970], NaN where unknown."""
    stamps = pd.to_datetime(view.rows["finished"], utc=True, errors="coerce", format="ISO8601")
    seconds = (stamps - pd.Timestamp(0, tz="UTC")).dt.total_seconds()
    return seconds.to_numpy(float)


def progress(view, now: float | None = None) -> dict:
    """planned (None: not known), counts of runs by status, cpu, wall [s] of all runs, elapsed [s] from the first start to the
    last end, left [s] (NaN: not known or nothing left), complete, resting [s] since the last end where that is long."""
    rows = view.rows
    count = {what: int((rows["status"] == what).sum()) for what in ("done", "capped", "failed")}
    planned = view.meta.get("planned")
    ends = finished_times(view)
    wall = pd.to_numeric(rows["wall"]).to_numpy(float)
    known = np.isfinite(ends)
    starts = ends - np.where(np.isfinite(wall), wall, 0)
    elapsed = float(np.max(ends[known]) - np.min(starts[known])) if known.any() else math.nan
    complete = planned is not None and len(rows) >= planned
    left = resting = math.nan
    if not complete and known.sum() > 1:
        last = np.sort(ends[known])[-100:]
        pace = (last[-1] - last[0]) / (len(last) - 1)
        if planned is not None:
            left = pace * (planned - len(rows))
        since = (time.time() if now is None else now) - last[-1]
        if since > max(60.0, QUIET * float(np.nanmax(wall)) if known.any() else 0.0):
            resting = since
    return {
        "planned": planned, **count, "runs": len(rows), "cpu": float(np.nansum(pd.to_numeric(rows["cpu"]))),
        "wall": float(np.nansum(wall)), "elapsed": elapsed, "left": left, "resting": resting,
        "complete": complete,
    }  # fmt: skip


def progress_lines(view, now=None) -> list[str]:
    p = progress(view, now)
    of = f" of {p['planned']}" if p["planned"] is not None else ""
    parts = [f"{p[what]} {what}" for what in ("done", "capped", "failed") if p[what] or what == "done"]
    line = f"progress   {p['runs']}{of} runs: {', '.join(parts)}"
    if p["complete"]:
        line += "; complete"
    elif math.isfinite(p["resting"]):
        line += f"; nothing new for {duration(p['resting'])}"
    elif math.isfinite(p["left"]):
        line += f"; {duration(p['left'])} left at the pace of the last runs"
    lines = [
        line,
        f"cost       {duration(p['cpu'])} of CPU, runs of {duration(p['wall'])} in all within {duration(p['elapsed'])}",
    ]
    for what in ("capped", "failed"):
        said = collections.Counter(view.rows["message"][view.rows["status"] == what])
        for message, times in said.most_common(3):
            lines.append(f"{what:<10} {times} x {plain(message) or '(no message)'}")
        if len(said) > 3:
            lines.append(f"{'':<10} and {len(said) - 3} other messages")
    return lines


def head_lines(view) -> list[str]:
    aims = [f"{o.words} [{o.unit or '1'}], {o.goal}d" for o in view.objectives]
    spans = [
        f"{a.words} {' | '.join(map(str, a.choices))}" if a.choices else
        f"{a.words} {a.tell(a.span[0], False)}..{a.tell(a.span[1])}"
        + (f" ({len(a.values)} values)" if a.values else "")
        for a in view.axes
    ]  # fmt: skip
    runs = view.rows.groupby(view.design_of).size()
    each = f"{runs.min()}" if runs.min() == runs.max() else f"{runs.min()} to {runs.max()}"
    plural = "" if each == "1" else "s"
    return [
        plain(f"{view.name}: {'; '.join(aims)}"),
        plain(f"varied     {', '.join(spans)}"),
        f"designs    {len(view.designs)}, {each} run{plural} each",
    ]


def scale_for(view, objective):
    return scale_of(objective.unit, (1.0,))


def optimum_lines(view, objective) -> list[str]:
    best = show_optimum.find(view, objective)
    if best is None:
        if not (view.designs["state"] == "capped").any():
            return [f"optimum    no run has a value of {objective.words}"]
        return [
            "optimum    none: every run with a value was capped, for the reasons above",
            "           more run.time or max_collisions, or a larger precision, lets runs end as asked for",
        ]
    scale, found = scale_for(view, objective), view.estimate(objective.path)
    known = math.isfinite(best.half)
    lines = [
        f"optimum    {view.tell(best.design)}: {objective.words} {pair(best.value, best.half, scale)}"
        f" ({'95 %; ' if known else ''}{best.how})"
    ]
    if best.surface is not None:
        own = pair(float(found.mean[best.design]), float(found.half[best.design]), scale)
        lines.append(f"           (its own runs alone: {own})")
    several = len(view.designs)
    if not known:
        lines.append(
            "           nothing tells how sure that is: single runs without an error of their own "
            "(study.replicates or run.precision gives one)"
        )
    elif best.open.sum() > 1:
        lines.append(
            f"           {show_optimum.spans(view, best.open)} cannot be told from the best "
            f"({best.open.sum()} of {several} designs, 95 %)"
        )
    else:
        lines.append("           no other design that was run can be as good (95 %)")
    if best.alike.sum() > 1:
        lines.append(
            f"           {show_optimum.spans(view, best.alike)} is within 2 % of the best ({best.alike.sum()} designs)"
        )
    if best.surface is not None and not view.is_grid():
        lines.append(
            f"           by the surface, designs that were not run as well: {anywhere(view, best)} cannot be told from the best"
        )
    at = at_edge(view, [view.designs[axis.key][best.design] for axis in view.axes])
    if at:
        lines.append(f"           on the edge of what was varied: {', '.join(at)}")
    if found.factor > 1.05:
        lines.append(
            f"           replicates scatter {found.factor:.2f} times as much as the runs' errors say: errors enlarged by that"
        )
    return lines


def anywhere(view, best) -> str:
    """Intervals of the keys, over all that the study allows, of what cannot be told from the best design that was run."""
    parts = []
    for axis, part in zip(view.axes, best.surface.optimum().place):
        if part.words:
            parts.append(f"{axis.short} {' or '.join(map(str, part.words))}")
        else:
            low, high = axis.tell(part.low, False), axis.tell(part.high)
            same = axis.tell(part.low) == high
            parts.append(f"{axis.short} {high}" if same else f"{axis.short} {low}..{high}")
    return ", ".join(parts)


def at_edge(view, values) -> list[str]:
    """The varied numbers of a design (one value an axis) that are at an end of their range, in words."""
    parts = []
    for axis, value in zip(view.axes, values):
        if not axis.numeric or axis.span[1] == axis.span[0]:
            continue
        near = 1e-9 * (axis.span[1] - axis.span[0])
        if min(abs(value - end) for end in axis.span) <= near:
            parts.append(f"{axis.short} = {axis.tell(value)}")
    return parts


def best_table(view, objective, count=BEST):
    """(heads, lines) of the best designs with 95 % confidence intervals: best by the surface (so that luck does not rank
    them), else by their own runs."""
    found, optimum = view.estimate(objective.path), show_optimum.find(view, objective)
    if optimum is None:
        return None
    scale = scale_for(view, objective)
    ok = show_optimum.usable(view) & np.isfinite(found.mean)
    score = np.where(ok, objective.sign * optimum.mean, np.nan)
    order = np.argsort(-score, kind="stable")[: min(count, int(np.isfinite(score).sum()))]
    heads = ["", *(a.words + (a.scale.bracket if a.numeric else "") for a in view.axes)]
    if optimum.surface is not None:
        heads += ["surface" + scale.bracket, "95 %"]
    heads += ["runs alone" + scale.bracket, "95 %", "runs"]
    heads.append("")
    lines = []
    for place, k in enumerate(order, 1):
        line = [str(place), *(a.tell(view.designs[a.key][k], False) for a in view.axes)]
        if optimum.surface is not None:
            width = show_optimum.REACH * optimum.spread[k]
            value, half = told(optimum.mean[k] / scale.size, width / scale.size)
            line += [value, f"+- {half}" if half else "?"]
        value, half = told(found.mean[k] / scale.size, found.half[k] / scale.size)
        line += [value, f"+- {half}" if half else "?", str(found.runs[k])]
        told_apart = math.isfinite(optimum.half) and not optimum.open[k]
        line.append("best" if k == optimum.design else "worse" if told_apart else "")
        lines.append(line)
    return heads, lines


def front(view) -> np.ndarray:
    """Indices of the designs on the Pareto front of all objectives, best of the first one first."""
    ok = show_optimum.usable(view)
    means = [view.estimate(o.path).mean for o in view.objectives]
    scores = np.column_stack([np.where(ok, o.sign * m, np.nan) for o, m in zip(view.objectives, means)])
    which = np.flatnonzero(show_stats.pareto(scores))
    return which[np.argsort(-scores[which, 0], kind="stable")]


def front_table(view, count=FRONT):
    which = front(view)
    heads = ["", *(a.words + (a.scale.bracket if a.numeric else "") for a in view.axes)]
    for objective in view.objectives:
        heads += [objective.words + scale_for(view, objective).bracket, "95 %"]
    lines = []
    for place, k in enumerate(which[:count], 1):
        line = [str(place), *(a.tell(view.designs[a.key][k], False) for a in view.axes)]
        for objective in view.objectives:
            found, scale = view.estimate(objective.path), scale_for(view, objective)
            value, half = told(found.mean[k] / scale.size, found.half[k] / scale.size)
            line += [value, f"+- {half}" if half else "?"]
        lines.append(line)
    return heads, lines, len(which)


def sensitivity_lines(entries) -> list[str]:
    """Of what sensitivity.indices gave."""
    if not entries:
        return []

    def share(value, half):
        value, half = told(value, half)
        return f"{value} +- {half}" if half else value

    lines = [
        [key, share(first, first_ci), share(total, total_ci)] for key, first, first_ci, total, total_ci, _ in entries
    ]
    methods = ", ".join(dict.fromkeys(str(entry[5]) for entry in entries))
    return [
        plain(
            f"which key matters: share of the variance, alone and with all its interactions (Sobol indices; {methods})"
        ),
        *aligned(["key", "alone", "in all"], lines, left=(0,)),
    ]


def lines(view, sensitivities=(), objective=None, now=None) -> list[str]:
    """The whole text; sensitivities: what sensitivity.indices gave, or nothing."""
    shown = [objective] if objective else view.objectives
    out = [*head_lines(view), *progress_lines(view, now)]
    for aim in shown:
        out += ["", *map(plain, optimum_lines(view, aim))]
    table = best_table(view, shown[0])
    if table:
        many = len(view.designs) > len(table[1])
        of = f"the best {len(table[1])} of {len(view.designs)} designs" if many else "the designs, best first"
        by = f" by {shown[0].words}"
        out += ["", plain(f"{of},{by}"), *aligned(*table, left=(len(table[0]) - 1,))]
    if len(view.objectives) > 1:
        heads, rows, count = front_table(view)
        more = f", the first {len(rows)} shown" if count > len(rows) else ""
        out += [
            "",
            f"Pareto front: {count} designs that no other beats in every objective, by their means{more}",
        ]
        out += aligned(heads, rows) if rows else []
    told_of = sensitivity_lines(sensitivities)
    return out + (["", *told_of] if told_of else [])


def show(view, sensitivities=(), objective=None, stream=None):
    print("\n".join(lines(view, sensitivities, objective)), file=stream or sys.stdout)
