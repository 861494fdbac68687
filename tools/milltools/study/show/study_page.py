"""A study as one page: text, tables and pictures in one file that opens from disk; everything from the study escaped."""

import base64
import io
import pathlib

import matplotlib.pyplot as plt

from milltools import pages
from milltools.base.text import plain
from milltools.study.show import outputs as show
from milltools.study.show import pair as show_beside
from milltools.study.show import terminal as show_text


def embedded(figure) -> str:
    """A figure as the data address of an SVG (of a PNG where that is the smaller one); it is closed."""
    stores = {}
    for kind, mime in (("svg", "svg+xml"), ("png", "png")):
        store = io.BytesIO()
        figure.savefig(store, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None)
        stores[mime] = store.getvalue()
    plt.close(figure)
    mime = "svg+xml" if len(stores["svg+xml"]) < 600_000 else "png"
    return f"data:image/{mime};base64," + base64.b64encode(stores[mime]).decode()


def proper(text) -> str:
    """What a file said without steering characters, with a real plus-minus sign."""
    return plain(text).replace("+-", "\N{PLUS-MINUS SIGN}")


def sections(view, objective) -> list[tuple]:
    """(title, heads, lines) of the tables."""
    found = []
    table = show_text.best_table(view, objective)
    if table:
        found.append((f"The best designs, by {objective.words}", *table))
    if len(view.objectives) > 1:
        heads, lines, count = show_text.front_table(view, 100)
        found.append((f"Pareto front: {count} designs", heads, lines))
    return found


def render(view, objective, sensitivities=(), beside=None, wanted=None, **options) -> str:
    """The page as text."""
    pictures = [
        (title, words, embedded(make()))
        for _, title, words, make in show.figures(view, objective, sensitivities, **options)
    ]
    told = []
    if beside is not None:
        both = [view, beside]
        told = show_beside.sentences(both, objective, wanted)
        told += show_beside.difference_lines(both)
        figure = show_beside.draw(both, objective, sensitivities=sensitivities, wanted=wanted, **options)
        pictures.insert(0, (f"Beside {beside.name}", " ".join(told), embedded(figure)))
    aims = [objective] + [o for o in view.objectives if o is not objective]
    template = pages.environment(pathlib.Path(__file__).parent).get_template("study_page.html")
    return template.render(
        style=pages.style(),
        name=plain(view.name),
        head=[proper(line) for line in show_text.head_lines(view) + show_text.progress_lines(view)],
        optima=[[proper(line.strip()) for line in show_text.optimum_lines(view, aim)] for aim in aims],
        beside=[proper(line) for line in told],
        tables=[
            (title, heads, [[proper(cell) for cell in line] for line in lines])
            for title, heads, lines in sections(view, objective)
        ],
        pictures=pictures,
        study=view.meta.get("study", ""),
        deck=view.meta.get("deck", ""),
        command=plain(view.meta.get("command", "")),
        version=plain(view.meta.get("version", "")),
    )
