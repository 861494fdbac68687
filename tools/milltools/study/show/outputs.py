"""A study as files: pictures, one page, CSV."""

import functools
import pathlib

from milltools import pages
from milltools.base.files import write_csv, write_text
from milltools.base.text import plain, spoken_unit
from milltools.study.show import canvas, contour, optimum, pair, slices, summary
from milltools.study.show.data import StudyView


def main_figure(view, objective, **options):
    """Contours over two keys; a line where only one is a number."""
    if sum(axis.numeric for axis in view.axes) < 2:
        return slices.draw(view, objective)
    return contour.draw(view, objective, **options)


def figures(view, objective, sensitivities=(), **options):
    """(kind, title, words for who cannot see it, function that draws it) of all pictures that a study has."""
    what = objective.words
    if sum(axis.numeric for axis in view.axes) > 1:
        yield (
            "contour", "Over two keys",
            f"{what} as filled contours over two varied keys, the best design, the designs at most {100 * optimum.ALIKE:g} % worse "
            "and those that cannot be told from it; the relative standard errors beside it",
            functools.partial(contour.draw, view, objective, sensitivities=sensitivities, **options),
        )  # fmt: skip
    yield (
        "slices", "Along each key", f"{what} along each varied key through the best design, with 95 % error bars",
        functools.partial(slices.draw, view, objective),
    )  # fmt: skip
    if len(view.objectives) > 1:
        yield (
            "pareto", "Pareto front", "the designs that no other beats in every objective, with 95 % error bars",
            functools.partial(slices.draw_front, view),
        )  # fmt: skip
    if sensitivities:
        yield (
            "sensitivity", "Which key matters", "share of the variance that each varied key explains, alone and in all",
            functools.partial(slices.draw_sensitivity, view, sensitivities),
        )  # fmt: skip


def of_pair(view, beside, objective, sensitivities=(), wanted=None, **options):
    """The picture of two studies, as `figures` gives those of one."""
    both = [view, beside]
    make = functools.partial(pair.draw, both, objective, sensitivities=sensitivities, wanted=wanted, **options)
    return "beside", f"Beside {plain(beside.name)}", " ".join(pair.sentences(both, objective, wanted)), make


def draw(table, path):
    """The main picture of a table.Table into a file (.png, .svg, .pdf)."""
    view = StudyView.of(table)
    objective = view.objectives[0]
    sensitivities = optimum.indices(table, view, objective) if len(view.axes) > 2 else ()
    canvas.write(main_figure(view, objective, sensitivities=sensitivities), str(path))


def pictures(kinds, path: str) -> list[str]:
    """Writes pictures, as `figures` gives them, one file each, or as pages of a PDF; the names of the files."""
    if path.endswith(".pdf"):
        canvas.write_pages([make for *_, make in kinds], path)
        return [path]
    names = [canvas.beside(path, kind) for kind, *_ in kinds]
    for name, (*_, make) in zip(names, kinds):
        canvas.write(make(), name)
    return names


def csv(view, path):
    """All runs as comma-separated values, SI, the unit of each column in its head: "drum.buckle_height [m]"."""
    units = {one.key: one.unit for one in view.axes} | {one.path: one.unit for one in view.objectives}
    recorded = (entry for entry in view.meta.get("record", []) if isinstance(entry, dict))
    units |= {entry["path"]: spoken_unit(entry.get("unit") or "") for entry in recorded}
    units |= {"time": "s", "sample_from": "s", "cpu": "s", "wall": "s"}
    named = [(column, units.get(column.removesuffix(":error"))) for column in view.rows.columns]
    rows = view.rows.astype(object).where(view.rows.notna(), None)
    write_csv(path, [f"{name} [{unit}]" if unit else name for name, unit in named], rows.itertuples(index=False))


def _signed(text) -> str:
    """What a file said, with a real plus-minus sign."""
    return plain(text).replace("+-", "\N{PLUS-MINUS SIGN}")


def page(view, objective, sensitivities=(), beside=None, wanted=None, **options) -> str:
    """Text, tables and pictures as one page that opens from disk; everything from the study escaped."""
    kinds = list(figures(view, objective, sensitivities, **options))
    if beside is not None:
        kinds.insert(0, of_pair(view, beside, objective, sensitivities, wanted, **options))
    aims = [objective] + [o for o in view.objectives if o is not objective]
    tables = []
    if best := summary.best_table(view, objective):
        tables.append((f"The best designs, by {objective.words}", *best))
    if len(view.objectives) > 1:
        *front, count = summary.front_table(view, 100)
        tables.append((f"Pareto front: {count} designs", *front))
    templates = pages.environment(pathlib.Path(__file__).parent)
    templates.filters["signed"] = _signed
    return templates.get_template("study_page.html").render(
        policy="default-src 'none'; img-src data:; style-src 'unsafe-inline'",
        style=pages.style(),
        title=f"Study: {plain(view.name)}",
        name=plain(view.name),
        head=summary.head_lines(view) + summary.progress_lines(view),
        optima=[summary.optimum_lines(view, aim) for aim in aims],
        beside=pair.sentences([view, beside], objective, wanted) if beside is not None else [],
        tables=tables,
        pictures=[(title, words, pages.embedded(make())) for _, title, words, make in kinds],
        meta=view.meta,
    )


def write_page(path, *arguments, **options):
    write_text(path, page(*arguments, **options))
