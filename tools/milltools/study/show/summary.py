"""A study in words: how far it is, what it cost, the best designs with 95 % confidence, what cannot be told from the best, which
key matters, the Pareto front. `lines` is what `mill study` says; sweeps and searches end with `of_sweep` and `of_search`."""

import collections
import math
import time

import numpy as np
import pandas as pd

from milltools.base.text import columns, duration, plain, plural
from milltools.study.search import gp
from milltools.study.show import optimum
from milltools.study.show.data import Scale, StudyView

BEST = 10  # lines of the table of designs
FEW = 5  # of them at the end of a sweep
FRONT = 20  # lines of the table of the Pareto front
QUIET = 3  # a study that rests for so many usual pauses between two runs is said to rest
UNDER = " " * 11  # a line that goes on


def progress(view, now: float | None = None) -> dict:
    """planned (None: not known), counts of runs by status, cpu, wall [s] of all runs, elapsed [s] from the first start to the
    last end, left [s] (NaN: not known or nothing left), complete, resting [s] since the last end where that is long."""
    rows, planned = view.rows, view.meta.get("planned")
    cpu, wall = (pd.to_numeric(rows[name]).to_numpy(float) for name in ("cpu", "wall"))
    stamps = pd.to_datetime(rows["finished"], utc=True, errors="coerce", format="ISO8601")
    ends = (stamps - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy(float)
    known = np.isfinite(ends)
    starts = ends - np.where(np.isfinite(wall), wall, 0)
    elapsed = float(np.max(ends[known]) - np.min(starts[known])) if known.any() else math.nan
    complete = planned is not None and len(rows) >= planned
    left = resting = math.nan
    if not complete and known.sum() > 1:
        last = np.sort(ends[known])[-100:]
        if planned is not None:
            left = (last[-1] - last[0]) / (len(last) - 1) * (planned - len(rows))
        since = (time.time() if now is None else now) - last[-1]
        if since > max(60.0, QUIET * float(np.nanmax(wall))):
            resting = since
    count = {what: int((rows["status"] == what).sum()) for what in ("done", "capped", "failed")}
    return {
        "planned": planned, **count, "runs": len(rows), "cpu": float(np.nansum(cpu)), "wall": float(np.nansum(wall)),
        "ended": float(np.max(ends[known], initial=-math.inf)), "elapsed": elapsed, "left": left, "resting": resting,
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
    cost = f"{duration(p['cpu'])} of CPU, runs of {duration(p['wall'])} in all within {duration(p['elapsed'])}"
    lines = [line, f"cost       {cost}"]
    for what in ("capped", "failed"):
        said = collections.Counter(view.rows["message"][view.rows["status"] == what])
        for message, times in said.most_common(3):
            lines.append(f"{what:<10} {times} x {message or '(no message)'}")
        if len(said) > 3:
            lines.append(f"{'':<10} and {len(said) - 3} other messages")
    return lines


def head_lines(view) -> list[str]:
    aims = "; ".join(f"{o.words}{o.scale.bracket}, {o.goal}d" for o in view.objectives)
    spans = []
    for a in view.axes:
        words = " | ".join(map(str, a.choices)) if a.choices else f"{a.tell(a.span[0], False)}..{a.tell(a.span[1])}"
        spans.append(f"{a.words} {words}" + (f" ({len(a.values)} values)" if a.numeric and a.values else ""))
    least, most = view.designs["runs"].min(), view.designs["runs"].max()
    each = plural(most, "run") if least == most else f"{least} to {most} runs"
    return [f"{view.name}: {aims}", f"varied     {', '.join(spans)}", f"designs    {len(view.designs)}, {each} each"]


def optimum_lines(view, objective) -> list[str]:
    best = optimum.find(view, objective)
    if best is None and not (view.designs["state"] == "capped").any():
        return [f"optimum    no run has a value of {objective.words}"]
    if best is None:
        return [
            "optimum    none: every run with a value was capped, for the reasons above",
            f"{UNDER}more run.time or max_collisions, or a larger precision, lets runs end as asked for",
        ]
    scale, found = objective.scale, view.estimate(objective.path)
    known = math.isfinite(best.half)
    value = f"{scale.pair(best.value, best.half)} ({'95 %; ' if known else ''}{best.how})"
    lines = [f"optimum    {view.tell(best.design)}: {objective.words} {value}"]
    if best.surface is not None:
        own = scale.pair(float(found.mean[best.design]), float(found.half[best.design]))
        lines.append(f"{UNDER}(its own runs alone: {own})")
    if not known:
        lines.append(
            f"{UNDER}nothing tells how sure that is: single runs without an error of their own "
            "(study.replicates or run.precision gives one)"
        )
    elif best.open.sum() > 1:
        where = optimum.spans(view, best.open)
        count = f"{best.open.sum()} of {len(view.designs)} designs, 95 %"
        lines.append(f"{UNDER}{where} cannot be told from the best ({count})")
    else:
        lines.append(f"{UNDER}no other design that was run can be as good (95 %)")
    if best.alike.sum() > 1:
        where = optimum.spans(view, best.alike)
        lines.append(
            f"{UNDER}{where}: at most {100 * optimum.ALIKE:g} % worse than the best ({best.alike.sum()} designs)"
        )
    if best.surface is not None and not view.is_grid():
        places = zip(view.axes, best.surface.optimum().place)
        where = ", ".join(f"{axis.short} {axis.reach(p.low, p.high, p.words)}" for axis, p in places)
        lines.append(
            f"{UNDER}by the surface, of all designs that the study allows: {where} cannot be told from the best"
        )
    edges = at_edge(view, [view.designs[axis.key][best.design] for axis in view.axes])
    if edges:
        lines.append(f"{UNDER}on the edge of what was varied: {', '.join(edges)}")
    if found.factor > 1.05:
        lines.append(
            f"{UNDER}replicates scatter {found.factor:.2f} times as much as the runs' errors say: errors enlarged by that"
        )
    return lines


def at_edge(view, values) -> list[str]:
    """The varied numbers of a design (one value an axis) that are at an end of their range, in words."""
    parts = []
    for axis, value in zip(view.axes, values):
        width = axis.span[1] - axis.span[0]
        if axis.numeric and width > 0 and min(abs(value - end) for end in axis.span) <= 1e-9 * width:
            parts.append(f"{axis.short} = {axis.tell(value)}")
    return parts


def table_of(view, which, shown):
    """(heads, lines) of designs: place, values of the keys, then of each column (name, scale, values, half widths of their
    95 % intervals) the value and the interval."""
    heads = ["", *(axis.heading for axis in view.axes)]
    for name, scale, *_ in shown:
        heads += [name + scale.bracket, "95 %"]
    lines = []
    for place, k in enumerate(which, 1):
        lines.append([str(place), *(axis.tell(view.designs[axis.key][k], False) for axis in view.axes)])
        for _, scale, values, halves in shown:
            value, half = scale.told(values[k], halves[k])
            lines[-1] += [value, f"+- {half}" if half else "?"]
    return heads, lines


def best_table(view, objective, count=BEST):
    """(heads, lines) of the best designs with 95 % confidence intervals: best by the surface (so that luck does not rank
    them), else by their own runs."""
    found, best = view.estimate(objective.path), optimum.find(view, objective)
    if best is None:
        return None
    ok = view.usable & np.isfinite(found.mean)
    order = np.argsort(-np.where(ok, objective.sign * best.mean, np.nan), kind="stable")[: min(count, ok.sum())]
    shown = [("runs alone", objective.scale, found.mean, found.half)]
    if best.surface is not None:
        shown.insert(0, ("surface", objective.scale, best.mean, optimum.REACH * best.spread))
    heads, lines = table_of(view, order, shown)
    for line, k in zip(lines, order):
        worse = math.isfinite(best.half) and not best.open[k]
        word = f"at most {100 * optimum.ALIKE:g} % worse" if worse and best.alike[k] else "worse" if worse else ""
        line += [str(found.runs[k]), "best" if k == best.design else word]
    return [*heads, "runs", ""], lines


def table_of_runs(view, which):
    """(heads, lines) of designs with all objectives, by their own runs."""
    found = [(o, view.estimate(o.path)) for o in view.objectives]
    return table_of(view, which, [(o.words, o.scale, means.mean, means.half) for o, means in found])


def front_table(view, count=FRONT):
    """(heads, lines, how many there are) of the Pareto front."""
    which = optimum.front(view)
    return *table_of_runs(view, which[:count]), len(which)


def sensitivity_lines(entries) -> list[str]:
    """Of what sensitivity.indices gave."""
    if not entries:
        return []
    scale = Scale()
    table = [(key, scale.pair(first, a), scale.pair(total, b)) for key, first, a, total, b, _ in entries]
    methods = ", ".join(dict.fromkeys(str(entry[5]) for entry in entries))
    return [
        f"which key matters: share of the variance, alone and with all its interactions (Sobol indices; {methods})",
        *indented([("key", "alone", "in all"), *table], left=(0,)),
    ]


def indented(rows, left=()) -> list[str]:
    return ["  " + line for line in columns(rows, left)]


def lines(view, sensitivities=(), objective=None, now=None) -> list[str]:
    """The whole text; sensitivities: what sensitivity.indices gave, or nothing."""
    shown = [objective] if objective else view.objectives
    out = [*head_lines(view), *progress_lines(view, now)]
    for aim in shown:
        out += ["", *optimum_lines(view, aim)]
    if table := best_table(view, shown[0]):
        heads, rows = table
        many = len(view.designs) > len(rows)
        of = f"the best {len(rows)} of {len(view.designs)} designs" if many else "the designs, best first"
        out += ["", f"{of}, by {shown[0].words}", *indented([heads, *rows], left=(len(heads) - 1,))]
    if len(view.objectives) > 1:
        heads, rows, count = front_table(view)
        more = f", the first {len(rows)} shown" if count > len(rows) else ""
        out += ["", f"Pareto front: {count} designs that no other beats in every objective, by their means{more}"]
        out += indented([heads, *rows]) if rows else []
    if sensitivities:
        out += ["", *sensitivity_lines(sensitivities)]
    return [plain(line) for line in out]


# ---- at the end of a sweep or a search


def of_sweep(table) -> list[str]:
    """The best designs by the first objective, of those with a value of all."""
    view = StudyView.of(table)
    good = view.usable.copy()
    for objective in view.objectives:
        good &= np.isfinite(view.estimate(objective.path).mean)
    if not good.any():
        said = collections.Counter(view.rows["message"]).most_common(3)
        reasons = [plain(f"    {times} x {message}") for message, times in said]
        return ["no run is done as asked for, so there is no best design:", *reasons, ""]
    first = view.objectives[0]
    order = np.argsort(-first.sign * np.where(good, view.estimate(first.path).mean, np.nan), kind="stable")
    goal = "largest" if first.sign > 0 else "smallest"
    title = f"the {goal} {first.path} of {good.sum()} designs:"
    heads, rows = table_of_runs(view, order[: min(FEW, good.sum())])
    return [plain(title), "", *indented([heads, *rows]), ""]


def of_search(table) -> list[str]:
    """The best design that a search found, with intervals of its value and its place; the front of several objectives."""
    view = StudyView.of(table)
    if len(view.objectives) > 1:
        which = optimum.front(view)
        if not len(which):
            return ["no run has a value"]
        known = np.all([np.isfinite(view.estimate(o.path).mean) for o in view.objectives], axis=0)
        of = f"{len(which)} of {(view.usable & known).sum()} designs"
        heads, rows = table_of_runs(view, which)
        title = f"{of} are not beaten by another in every objective (the Pareto front):"
        return [title, "", *indented([heads, *rows]), ""]
    try:
        surface, best = gp.of_table(table)
    except ValueError:
        return ["no run has a value"]
    about = view.objectives[0]
    word = "largest" if about.sign > 0 else "smallest"
    ends = f"{best.low:.5g} .. {best.high:.5g}{about.scale.suffix}"
    found = [f"the {word} {about.path}: {best.value:.5g}{about.scale.suffix}, 95 %: {ends}", ""]
    places = [axis.reach(part.low, part.high, part.words) for axis, part in zip(view.axes, best.place)]
    found += indented(
        [
            ("", axis.key, axis.tell(value), f"at 95 % it may be {place}")
            for axis, value, place in zip(view.axes, best.design, places)
        ],
        left=(1, 2, 3),
    )
    alone = all(part.low == part.high and len(part.words) < 2 for part in best.place)
    share = f"{100 * best.place_share:.1f} %" if best.place_share >= 0.001 else "less than 0.1 %"
    others = "every other is worse beyond doubt" if alone else f"{share} of all designs cannot be told from it"
    tested = f"from {len(surface.values)} runs of {len(surface.tested())} designs together"
    found += ["", f"{tested}, {plural(best.runs, 'run')} of this one; {others}"]
    if edges := at_edge(view, best.design):
        found.append(f"on the edge of what was varied, so perhaps not the best there is: {', '.join(edges)}")
    for axis, part in zip(view.axes, best.alike):
        if axis.key in best.flat:
            reach = axis.reach(part.low, part.high, part.words)
            found.append(f"flat along {axis.key}: designs at most {100 * gp.ALIKE:g} % worse reach over {reach}")
    return [*map(plain, found), ""]
