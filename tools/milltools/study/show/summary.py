"""A study as text: progress, cost, the best designs with 95 % confidence, the designs that cannot be distinguished from
the best, the influence of the keys, the Pareto front. `mill study` prints `lines`; sweeps and searches end with
`of_sweep` and `of_search`."""

import collections
import math
import time

import numpy as np
import pandas as pd

from milltools.base.text import columns, duration, plain, plural
from milltools.study.plan.sealed import STATUSES
from milltools.study.search import gp
from milltools.study.show import optimum
from milltools.study.show.data import TURNING, Scale, StudyView

BEST = 10  # lines of the table of designs
FEW = 5  # of them at the end of a sweep
NAMED = 4  # designs that are named one by one; ranges are told of more
FRONT = 20  # lines of the table of the Pareto front
WIDE = 40  # letters of a head
QUIET = 3  # a study counts as resting after this multiple of the usual pause between two runs
UNDER = " " * 11  # indent of a continued line


def progress(view, now: float | None = None) -> dict:
    """planned (None: not known), runs, cpu, wall [s] of all runs, ended: time of the last end, elapsed [s] from the
    first start to this, left [s] (NaN: not known or nothing left), complete, resting [s] since the last end if this is
    long."""
    rows, planned = view.rows, view.meta.get("planned")
    cpu, wall = (pd.to_numeric(rows[name]).to_numpy(float) for name in ("cpu", "wall"))
    stamps = pd.to_datetime(rows["finished"], utc=True, errors="coerce", format="ISO8601")
    ends = (stamps - pd.Timestamp(0, tz="UTC")).dt.total_seconds().to_numpy(float)
    starts = ends - np.where(np.isfinite(wall), wall, 0)
    last = np.sort(ends[np.isfinite(ends)])[-100:]
    complete = planned is not None and len(rows) >= planned
    found = dict.fromkeys(("ended", "elapsed", "left", "resting"), math.nan)
    found |= {
        "planned": planned,
        "runs": len(rows),
        "cpu": np.nansum(cpu),
        "wall": np.nansum(wall),
        "complete": complete,
    }
    if len(last):
        found |= {"ended": last[-1], "elapsed": last[-1] - np.nanmin(starts)}
    if not complete and len(last) > 1:
        if planned is not None:
            found["left"] = (last[-1] - last[0]) / (len(last) - 1) * (planned - len(rows))
        since = (time.time() if now is None else now) - last[-1]
        if since > max(60.0, QUIET * float(np.nanmax(wall))):
            found["resting"] = since
    return found


def progress_lines(view, now=None) -> list[str]:
    p, count = progress(view, now), collections.Counter(view.rows["status"])
    of = f" of {p['planned']}" if p["planned"] is not None else ""
    parts = [f"{count[what]} {what}" for what in STATUSES if count[what] or what == "done"]
    line = f"progress   {p['runs']}{of} runs: {', '.join(parts)}"
    if p["complete"]:
        line += "; complete"
    elif math.isfinite(p["resting"]):
        line += f"; no new run for {duration(p['resting'])}"
    elif math.isfinite(p["left"]):
        line += f"; {duration(p['left'])} left at the pace of the last runs"
    cost = f"{duration(p['cpu'])} of CPU; the runs took {duration(p['wall'])} in all, within {duration(p['elapsed'])}"
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
    out = [f"{view.name}: {aims}", f"varied     {', '.join(spans)}", f"designs    {len(view.designs)}, {each} each"]
    if required(view):
        meet = f"{(view.usable & view.feasible).sum()} of {view.usable.sum()} designs meet this"
        out.append(f"required   {required(view)}: {meet}")
    return out + [f"warning    {note}" for note in view.meta.get("notes") or ()]


def doubts(view) -> list[tuple[np.ndarray, str, str]]:
    """(the runs, what is wrong with them, what follows for them)."""
    return [
        (view.frictionless, "computed contacts without friction", "power and rates are not to be trusted"),
        (view.unsettled, "had not settled", "errors are not known: sample later (run.sample_from)"),
    ]


def doubt_lines(view) -> list[str]:
    """How many runs cannot be trusted, and of which designs."""
    told = []
    for runs, what, so in doubts(view):
        designs = np.unique(view.design_of[runs])
        which = "; ".join(map(view.tell, designs))
        if len(designs) > NAMED:
            ranges = optimum.spans(view, np.isin(np.arange(len(view.designs)), designs))
            which = f"{len(designs)} of {len(view.designs)} designs, with {ranges}"
        whose = "its" if runs.sum() == 1 else "their"
        told += [f"{runs.sum()} of {plural(len(runs), 'run')} ({which}) {what}: {whose} {so}"] * bool(runs.any())
    return told


def doubt_of(view, design) -> list[str]:
    """The same of one design."""
    return [
        f"runs of this design {what}: its {so}"
        for runs, what, so in doubts(view)
        if runs[view.design_of == design].any()
    ]


def required(view) -> str:
    return " and ".join([*(one.text for one in view.require), *view.formulas.rules])


def limit_lines(view, design) -> list[str]:
    """How a design meets each requirement: "power there: 221 +- 3 W (95 %), required power <= 225 W"."""
    told = []
    for one in view.require:
        found, aim = view.estimate(one.expression.text), view.aim(one.expression.text)
        value, half = float(found.mean[design]), float(found.half[design])
        unsure = math.isfinite(half) and view.meets(one)[design] and one.sign * (value - one.limit) + half > 0
        known = " (95 %)" if math.isfinite(half) else ""
        more = "; within its error it may not meet this" if unsure else ""
        told.append(f"{aim.words} there: {scale_of(view, aim).pair(value, half)}{known}, required {one.text}{more}")
    return told


def beyond(view, objective, design) -> list[str]:
    """Where designs next to the best one are better but do not meet the requirements: a value between may be better."""
    said, own = [], view.designs.iloc[design]
    mean, met = view.estimate(objective.path).mean, np.all([view.meets(one) for one in view.require], axis=0)
    for axis in view.axes if view.require else ():
        if not axis.numeric:
            continue
        line = view.having({other.key: own[other.key] for other in view.axes if other is not axis})
        value = view.designs[axis.key].to_numpy(float)
        for sign in (1, -1):
            ahead = np.flatnonzero(line & (sign * (value - value[design]) > 0) & np.isfinite(mean))
            near = min(ahead, key=lambda k: abs(value[k] - value[design]), default=None)
            if near is not None and not met[near] and objective.sign * (mean[near] - mean[design]) > 0:
                ends = sorted((value[design], value[near]))
                said.append(
                    f"a {axis.short} between {axis.tell(ends[0])} and {axis.tell(ends[1])} may be better: "
                    f"{axis.tell(value[near])} is, but does not meet {required(view)}"
                )
    return said


def finding(view, objective) -> str:
    """The answer as one sentence; "" if there is none."""
    best = optimum.find(view, objective)
    if best is None:
        return ""
    known = " (95 %)" if math.isfinite(best.half) else " (error not known)"
    under = f" with {required(view)}" if required(view) else ""
    value, others = objective.scale.pair(best.value, best.half), int(best.open.sum()) - 1
    tied = f"; {plural(others, 'other design')} may be as good" if known == " (95 %)" and others > 0 else ""
    drifts = view.unsettled[view.design_of == best.design].any()
    tied += "; its own run had not settled" * bool(drifts)
    return f"{view.tell(best.design)} gives {objective.goal_words}{under}: {value}{known}{tied}"


def optimum_lines(view, objective) -> list[str]:
    best = optimum.find(view, objective)
    if best is None and (which := view.usable & ~view.feasible).any():
        return unmet(view, which)
    if best is None and not (view.designs["state"] == "capped").any():
        return [f"optimum    no run has a value of {objective.words}"]
    if best is None:
        return [
            "optimum    none: every run with a value was capped, for the reasons above",
            f"{UNDER}raise the limit named above (run.time, max_collisions, cpu_limit), or accept a larger error",
        ]
    scale, found = objective.scale, view.estimate(objective.path)
    known = math.isfinite(best.half)
    how = "each design by its own runs" if best.surface is None else "Gaussian process through all runs"
    value = f"{scale.pair(best.value, best.half)} ({'95 %; ' if known else ''}{how})"
    more = []
    if best.surface is not None:
        own = scale.pair(float(found.mean[best.design]), float(found.half[best.design]))
        more.append(f"this value is of a fit through all runs; its own runs alone give {own}")
    if not known:
        more.append(
            "its error is not known: its window is shorter than 3 revolutions (periods, without a rotor), or not "
            "settled, or of too few starts; a longer run.time gives one, or run.starts = 8, or study.replicates"
        )
    elif best.open.sum() > 1:
        count = f"{best.open.sum()} of {len(view.designs)} designs, 95 %"
        few = best.open.sum() <= NAMED
        others = [k for k in np.flatnonzero(best.open) if k != best.design]
        which = "; ".join(map(view.tell, others)) if few else optimum.spans(view, best.open)
        more.append(f"{which} cannot be distinguished from the best ({count})")
    else:
        more.append(f"no other design that was run{' and meets this' * bool(view.require)} can be as good (95 %)")
    more[:0] = [*doubt_of(view, best.design), *view.derived(best.design), *limit_lines(view, best.design)]
    if best.alike.sum() > 1:
        what = f"at most {100 * optimum.ALIKE:g} % worse than the best"
        more.append(f"{optimum.spans(view, best.alike)}: {what} ({best.alike.sum()} designs)")
    if best.surface is not None and not view.is_grid():
        found_place = best.surface.optimum(optimum.tuples(view, [best.design]), optimum.allowed(view)).place
        places = zip(view.axes, found_place)
        where = ", ".join(f"{axis.short} {axis.reach(p.low, p.high, p.words)}" for axis, p in places)
        more.append(f"by the fit, of all possible designs, those with {where} cannot be distinguished from the best")
    more += beyond(view, objective, best.design)
    if edges := at_edge(view, [view.designs[axis.key][best.design] for axis in view.axes]):
        more.append(f"on the edge of the varied range: {', '.join(edges)}")
    if found.factor > 1.05:
        times = f"{found.factor:.2f} times as much as the runs' errors say"
        more.append(f"replicates scatter {times}: errors enlarged by that")
    return [f"optimum    {view.tell(best.design)}: {objective.words} {value}", *(UNDER + line for line in more)]


def unmet(view, which) -> list[str]:
    """That none of the designs that `which` marks meets the requirements, and which one is nearest to it."""
    over = [
        one.sign * (view.estimate(one.expression.text).mean - one.limit) / (abs(one.limit) or 1) for one in view.require
    ]
    worst = np.where(which, np.max(over, axis=0), np.nan)
    if np.isnan(worst).all():
        return [f"optimum    none: no design has a value of what is required, {required(view)}"]
    design = int(np.nanargmin(worst))
    near = [f"nearest to it is {view.tell(design)}", *limit_lines(view, design)]
    return [f"optimum    none: no design that was run meets {required(view)}", *(UNDER + line for line in near)]


def at_edge(view, values) -> list[str]:
    """The varied numbers of a design (one value an axis) that are at an end of their range, in words."""
    parts = []
    for axis, value in zip(view.axes, values):
        width = axis.span[1] - axis.span[0]
        if axis.numeric and width > 0 and min(abs(value - end) for end in axis.span) <= 1e-9 * width:
            parts.append(f"{axis.short} = {axis.tell(value)}")
    return parts


def head_of(aim) -> str:
    """The name of a column: the expression itself where its words are long."""
    return aim.words if len(aim.words) <= max(WIDE, len(aim.path)) else aim.path


def scale_of(view, aim) -> Scale:
    """The scale of an expression in texts and tables: degrees, rpm, and per cent where its limit has them."""
    if aim.unit in TURNING:
        return Scale(*reversed(TURNING[aim.unit]))
    limits = [one.text for one in view.require if one.expression.text == aim.path and not aim.unit]
    return Scale(0.01, "%") if any(text.endswith("%") for text in limits) else aim.scale


def table_of(view, which, shown):
    """Heads and lines of designs: place, values of the keys, then of each column (name, scale, values, half widths of
    their 95 % intervals) the value and the interval."""
    table = [["", *(axis.heading for axis in view.axes)]]
    for name, scale, *_ in shown:
        table[0] += [name + scale.bracket, "95 %"]
    for place, k in enumerate(which, 1):
        table.append([str(place), *(axis.tell(view.designs[axis.key][k], False) for axis in view.axes)])
        for _, scale, values, halves in shown:
            value, half = scale.told(values[k], halves[k])
            table[-1] += [value, f"+- {half}" if half else "?"]
    return table


def best_table(view, objective, count=BEST):
    """Heads and lines of the best designs with 95 % confidence intervals: best by the surface (so that luck does not
    rank them), else by their own runs. Designs that break a requirement come last. Nothing where none has a value."""
    found, best = view.estimate(objective.path), optimum.find(view, objective)
    ok, mean = view.usable & np.isfinite(found.mean), best.mean if best else found.mean
    order = np.lexsort((-objective.sign * mean, ~view.feasible, ~ok))[: min(count, ok.sum())]
    if not ok.any():
        return []
    shown = [("own runs", objective.scale, found.mean, found.half)]
    if best and best.surface is not None:
        shown.insert(0, ("fit", objective.scale, best.mean, optimum.REACH * best.spread))
    shown += [
        (head_of(aim), scale_of(view, aim), m.mean, m.half) for aim, m in limits_of(view) if aim.path != objective.path
    ]
    heads, *lines = table_of(view, order, shown)
    drifts = np.bincount(view.design_of, view.unsettled, len(view.designs))
    for line, k in zip(lines, order):
        word = broken(view, k)
        if not word and math.isfinite(best.half) and not best.open[k]:
            word = f"at most {100 * optimum.ALIKE:g} % worse" if best.alike[k] else "worse"
        line[0] = "" if not view.feasible[k] else line[0]
        marks = ["best" if best and k == best.design else word, "not settled" * bool(drifts[k])]
        line += [str(found.runs[k]), ", ".join(filter(None, marks))]
    return [[*heads, "runs", ""], *lines]


def broken(view, design) -> str:
    """The requirements that a design does not meet: "power 612 > 400 W", "power has no value"."""
    told = [] if view.possible[design] else [f"breaks {' or '.join(view.formulas.rules)}"]
    for one in view.require:
        if not view.meets(one)[design]:
            text, sign = one.expression.text, ">" if one.sign > 0 else "<"
            value = view.estimate(text).mean[design]
            scale = scale_of(view, view.aim(text))
            over = f"{text} {value / scale.size:.5g} {sign} {one.limit / scale.size:.5g}{scale.suffix}"
            told.append(f"{text} has no value" if math.isnan(value) else over)
    return ", ".join(told)


def limits_of(view):
    """The expressions of the requirements as objectives, with their means."""
    aims = {one.expression.text: view.aim(one.expression.text) for one in view.require}
    return [(aim, view.estimate(path)) for path, aim in aims.items()]


def table_of_runs(view, which):
    """Heads and lines of designs with all objectives and requirements, by their own runs."""
    found = [(o, view.estimate(o.path)) for o in view.objectives]
    found += [(o, means) for o, means in limits_of(view) if o not in view.objectives]
    return table_of(view, which, [(head_of(o), scale_of(view, o), means.mean, means.half) for o, means in found])


def front_table(view, count=FRONT):
    """Heads and lines of the Pareto front, and how many designs it has."""
    which = optimum.front(view)
    return table_of_runs(view, which[:count]), len(which)


def sensitivity_lines(entries) -> list[str]:
    """Of what sensitivity.indices gave."""
    scale = Scale()
    table = [(key, scale.pair(first, a), scale.pair(total, b)) for key, first, a, total, b, _ in entries]
    methods = ", ".join(dict.fromkeys(str(entry[5]) for entry in entries))
    return [
        f"which key matters: share of the variance, alone and with interactions (Sobol indices; {methods})",
        *indented([("key", "alone", "with interactions"), *table], left=(0,)),
    ]


def indented(rows, left=()) -> list[str]:
    return ["  " + line for line in columns(rows, left)]


def lines(view, sensitivities=(), objective=None, now=None) -> list[str]:
    """The whole text; sensitivities: what sensitivity.indices gave, or nothing."""
    shown = [objective] if objective else view.objectives
    out = [*head_lines(view), *(f"warning    {line}" for line in doubt_lines(view)), *progress_lines(view, now)]
    for aim in shown:
        out += ["", *optimum_lines(view, aim)]
    if table := best_table(view, shown[0]):
        best, count = len(table) - 1, len(view.designs)
        of = f"{best} of {count} designs, best first" if count > best else "the designs, best first"
        last = f"; last those that do not meet {required(view)}" if any(not line[0] for line in table[1:]) else ""
        out += ["", f"{of}, by {shown[0].words}{last}", *indented(table, left=(len(table[0]) - 1,))]
    if len(view.objectives) > 1:
        table, count = front_table(view)
        more = f", the first {FRONT} shown" if count > FRONT else ""
        out += ["", f"Pareto front: {count} designs that no other beats in every objective, by their means{more}"]
        out += indented(table) if count else []
    if sensitivities:
        out += ["", *sensitivity_lines(sensitivities)]
    return [plain(line) for line in out]


# ---- at the end of a sweep or a search


def of_sweep(table) -> list[str]:
    """The best designs by the first objective, of those with a value of all, and what is wrong with them."""
    view = StudyView.of(table)
    return [*_of_sweep(view), *_warned(view)]


def _warned(view) -> list[str]:
    return [text for line in doubt_lines(view) for text in (plain(f"warning: {line}"), "")]


def _of_sweep(view) -> list[str]:
    good = view.judged & view.feasible
    if view.judged.any() and not good.any():
        return [plain(line.strip()) for line in optimum_lines(view, view.objectives[0])] + [""]
    if not good.any():
        said = collections.Counter(view.rows["message"]).most_common(3)
        reasons = [plain(f"    {times} x {message}") for message, times in said]
        return ["every run was capped or failed, so there is no best design:", *reasons, ""]
    first = view.objectives[0]
    order = np.argsort(-first.sign * np.where(good, view.estimate(first.path).mean, np.nan), kind="stable")
    goal = "largest" if first.sign > 0 else "smallest"
    of = f"{good.sum()} designs" + (f" that meet {required(view)}" if required(view) else "")
    title = f"the {goal} {first.words} of {of}:"
    return [plain(title), "", *indented(table_of_runs(view, order[: min(FEW, good.sum())])), ""]


def of_search(table) -> list[str]:
    """The best design that a search found, with intervals of its value and its place; the front of several
    objectives; and what is wrong with them."""
    view = StudyView.of(table)
    return [*_of_search(table, view), *_warned(view)]


def _of_search(table, view) -> list[str]:
    if len(view.objectives) > 1:
        which = optimum.front(view)
        if not len(which):
            return ["no run has a value"]
        of = f"{len(which)} of {view.judged.sum()} designs"
        title = f"{of} are not beaten by another in every objective (the Pareto front):"
        return [title, "", *indented(table_of_runs(view, which)), ""]
    if (view.usable & ~view.feasible).any() and not (view.usable & view.feasible).any():
        return [plain(line.strip()) for line in optimum_lines(view, view.objectives[0])] + [""]
    try:
        limited = bool(view.require or view.formulas.rules)
        good = view.feasible[view.design_of] if limited else None
        surface, best = gp.of_table(table, good=good, allowed=optimum.allowed(view) if limited else None)
    except ValueError:
        return ["no run has a value"]
    about = view.objectives[0]
    word = "largest" if about.sign > 0 else "smallest"
    ends = f"{best.low:.5g} .. {best.high:.5g}{about.scale.suffix}"
    under = f" with {required(view)}" if required(view) else ""
    found = [f"the {word} {about.words}{under}: {best.value:.5g}{about.scale.suffix}, 95 %: {ends}"]
    same = view.having(dict(zip([axis.key for axis in view.axes], best.design)))
    design = int(np.flatnonzero(same)[0])
    found += [*doubt_of(view, design), *limit_lines(view, design), ""]
    rows = []
    for axis, value, part in zip(view.axes, best.design, best.place):
        place = axis.reach(part.low, part.high, part.words)
        rows.append(("", axis.key, axis.tell(value), f"95 % interval: {place}"))
    rows += [("", *one.split(" = "), "follows") for one in view.derived(design)]
    found += indented(rows, left=(1, 2, 3))
    alone = all(part.low == part.high and len(part.words) < 2 for part in best.place)
    share = f"{100 * best.place_share:.1f} %" if best.place_share >= 0.001 else "less than 0.1 %"
    others = (
        "every other design is worse (95 %)" if alone else f"{share} of all designs cannot be distinguished from it"
    )
    tested = f"computed from {len(surface.values)} runs of {len(surface.tested())} designs"
    found += ["", f"{tested}, {best.runs} of them of this design; {others}"]
    if edges := at_edge(view, best.design):
        found.append(f"on the edge of the varied range, so there may be better designs outside: {', '.join(edges)}")
    for axis, part in zip(view.axes, best.alike):
        if axis.key in best.flat:
            reach = axis.reach(part.low, part.high, part.words)
            found.append(f"flat along {axis.key}: designs at most {100 * gp.ALIKE:g} % worse cover {reach}")
    return [*map(plain, found), ""]


# ---- for programs


def facts(table, view=None, sensitivities=None) -> dict:
    """The members of the JSON object of a study, in SI. `best`, for each objective, and `pareto` are designs {key:
    value} with the values of the objectives and the half widths of their 95 % intervals. `open` is the number of
    designs that cannot be distinguished from the best."""
    view = view or StudyView.of(table)
    keys, means = [axis.key for axis in view.axes], {o.path: view.estimate(o.path) for o in view.objectives}

    def design(k):
        values = {path: {"value": found.mean[k], "half_95": found.half[k]} for path, found in means.items()}
        return {"design": dict(zip(keys, view.designs[keys].iloc[k])), "objectives": values}

    best = []
    for objective in view.objectives:
        if sensitivities is None:
            sensitivities = optimum.indices(table, view, objective)
        if found := optimum.find(view, objective):
            how = "runs" if found.surface is None else "surface"
            own = {"value": found.value, "half_95": found.half, "from": how}
            own["open"] = found.open.sum() if math.isfinite(found.half) else math.nan
            best.append({"objective": objective.path} | own | design(found.design))
    names = ("key", "alone", "alone_half_95", "total", "total_half_95", "method")
    state = progress(view)
    return {
        "study": view.name,
        "objectives": [{"path": o.path, "goal": o.goal, "unit": o.unit, "words": o.words} for o in view.objectives],
        "varied": {axis.key: axis.unit for axis in view.axes},
        "runs": {name: state[name] for name in ("planned", "runs", "complete", "cpu")}
        | {status: int((view.rows["status"] == status).sum()) for status in STATUSES},
        "best": best,
        "pareto": [design(k) for k in optimum.front(view)] if len(view.objectives) > 1 else [],
        "sensitivity": [dict(zip(names, entry)) for entry in sensitivities or ()],
    }
