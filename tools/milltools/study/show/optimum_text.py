"""What a study says of its best design, as text: its value and its place with confidence intervals; the front of several
objectives."""

from milltools.study.search import gp
from milltools.study.show import stats as show_stats
from milltools.study.show import summary
from milltools.study.show import terminal as show_text
from milltools.study.show.data import View, spoken


def lines(table) -> list[str]:
    """For the end of a search."""
    if len(table.meta["objectives"]) > 1:
        return _front(table)
    try:
        surface, best = gp.of_table(table)
    except ValueError:
        return ["no run has a value"]
    about, space, view = table.meta["objectives"][0], surface.space, View.of(table)
    unit = f" {spoken(about['unit'])}" if about["unit"] not in ("", "1") else ""
    word = "largest" if about["goal"] == "maximise" else "smallest"
    found = [
        f"the {word} {about['path']}: {best.value:.5g}{unit}, 95 %: {best.low:.5g} .. {best.high:.5g}{unit}",
        "",
    ]
    width = max(len(v.key) for v in space.variables)
    for v, value, place in zip(space.variables, best.design, best.place):
        found.append(
            f"    {v.key:<{width}}  {view.axis(v.key).tell(value):<16} at 95 % it may be {_range(view.axis(v.key), place)}"
        )
    runs = "one run" if best.runs == 1 else f"{best.runs} runs"
    alone = all(part.low == part.high and len(part.words) < 2 for part in best.place)
    others = "every other is worse beyond doubt" if alone else f"{_share(best.place_share)} of all designs cannot be told from it"  # fmt: skip
    found += [
        "",
        f"from {len(surface.values)} runs of {len(surface.tested())} designs together, {runs} of this one; {others}",
    ]
    edges = show_text.at_edge(view, best.design)
    if edges:
        found.append(f"on the edge of what was varied, so perhaps not the best there is: {', '.join(edges)}")
    for key in best.flat:
        alike = next(part for v, part in zip(space.variables, best.alike) if v.key == key)
        found.append(
            f"flat along {key}: designs within {gp.ALIKE:.0%} of it reach over {_range(view.axis(key), alike)}"
        )
    return [*found, ""]


def _range(axis, part) -> str:
    if part.words:
        return " or ".join(part.words)
    if part.low == part.high:
        return axis.tell(part.low)
    return f"{axis.tell(part.low, unit=False)} .. {axis.tell(part.high)}"


def _share(share) -> str:
    return f"{share:.1%}" if share >= 0.001 else "less than 0.1 %"


def _front(table) -> list[str]:
    found = summary.designs(table)
    if not len(found):
        return ["no run has a value"]
    view = View.of(table)
    goals = view.objectives
    signs = [goal.sign for goal in goals]
    kept = found[show_stats.pareto(found[[o.path for o in goals]].to_numpy(float) * signs)]
    rows = [summary.heads(view)]
    rows += [summary.cells(view, row) for _, row in kept.iterrows()]
    widths = [max(map(len, column)) for column in zip(*rows)]
    text = ["  ".join(f"{cell:>{w}}" for cell, w in zip(row, widths)).rstrip() for row in rows]
    return [
        f"{len(kept)} of {len(found)} designs are not beaten by another in every objective (the Pareto front; +-: 95 %):",
        "",
        *text,
        "",
    ]
