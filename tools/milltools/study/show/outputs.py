"""A study shown, for commands: what `mill study` writes, and what sweep and optimize end with.

print(show.text(table))                # the summary
show.draw(table, "figure7.png")         # the main picture
"""

import os

from milltools.base.errors import UserError
from milltools.study.show import optimum as show_optimum
from milltools.study.show import terminal as show_text
from milltools.study.show.data import View


def indices(table, view, objective) -> list:
    """sensitivity.indices of an objective, from the surface that is there already; nothing where they cannot be had."""
    optimum = show_optimum.find(view, objective)
    if len(view.axes) < 2 or optimum is None or optimum.surface is None:
        return []
    from milltools.study.search import sensitivity

    number = view.objectives.index(objective)
    return sensitivity.indices(table, number, surface=optimum.surface)


def text(table) -> str:
    """The summary of a table.Table."""
    view = View.of(table)
    return "\n".join(show_text.lines(view, indices(table, view, view.objectives[0])))


def main_figure(view, objective, x=None, y=None, average=False, sensitivities=()):
    """Contours over two keys; a line where only one is a number."""
    from milltools.study.show import contour as show_contour
    from milltools.study.show import slices as show_slices

    if len([axis for axis in view.axes if axis.numeric]) < 2:
        return show_slices.draw(view, objective)
    return show_contour.draw(view, objective, x, y, average, sensitivities)


def figures(view, objective, sensitivities=(), **options):
    """(kind, title, words for who cannot see it, function that draws it) of all pictures that a study has."""
    from milltools.study.show import slices as show_slices

    numeric = [axis for axis in view.axes if axis.numeric]
    what = objective.words
    if len(numeric) > 1:
        yield (
            "contour", "Over two keys",
            f"{what} as filled contours over two varied keys, the best design, the designs within 2 % of it and those that "
            "cannot be told from it; the relative standard errors beside it",
            lambda: main_figure(view, objective, sensitivities=sensitivities, **options),
        )  # fmt: skip
    yield (
        "slices", "Along each key", f"{what} along each varied key through the best design, with 95 % error bars",
        lambda: show_slices.draw(view, objective),
    )  # fmt: skip
    if len(view.objectives) > 1:
        yield (
            "pareto", "Pareto front", "the designs that no other beats in every objective, with 95 % error bars",
            lambda: show_slices.draw_front(view),
        )  # fmt: skip
    if sensitivities:
        yield (
            "sensitivity", "Which key matters", "share of the variance that each varied key explains, alone and in all",
            lambda: show_slices.draw_sensitivity(view, sensitivities),
        )  # fmt: skip


def draw(table, path):
    """The main picture of a table.Table into a file (.png, .svg, .pdf)."""
    from milltools.study.show import draw as show_draw

    show_draw.check_name(str(path))
    view = View.of(table)
    objective = view.objectives[0]
    sensitivities = indices(table, view, objective) if len(view.axes) > 2 else []
    show_draw.write(main_figure(view, objective, sensitivities=sensitivities), str(path))


def replace(path: str, content: str):
    """A text file, replaced as a whole."""
    part = f"{path}.part"
    try:
        with open(part, "w", encoding="utf-8", newline="") as file:
            file.write(content)
        os.replace(part, path)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}", status=1) from None


def csv(view) -> str:
    """All runs as comma-separated values, SI, the unit of each column in its head: "drum.buckle_height [m]"."""
    units = {axis.key: axis.unit for axis in view.axes}
    units |= {o.path: o.unit for o in view.objectives}
    units |= {entry["path"]: entry.get("unit") for entry in view.meta.get("record", []) if isinstance(entry, dict)}
    units |= {"time": "s", "sample_from": "s", "cpu": "s", "wall": "s"}
    heads = {}
    for column in view.rows.columns:
        unit = units.get(column.removesuffix(":error"))
        heads[column] = f"{column} [{unit}]" if unit and unit != "1" else column
    return view.rows.rename(columns=heads).to_csv(index=False, lineterminator="\n", na_rep="")
