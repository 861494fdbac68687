"""Several runs on one page that opens from disk: the finding, differences and how sure they are, the balls of each run
on one clock, pictures, decks. All text from the runs is escaped."""

import pathlib

from milltools import pages
from milltools.base.text import lines, plain, plural
from milltools.compare import finding, pictures, rows, terminal
from milltools.figures import svg
from milltools.player import parts

HERE = pathlib.Path(__file__).parent
MOST_BYTES = 6_000_000  # of all players together
CONTENTS = (
    ("verdict", "Finding"), ("balls", "Balls"), ("tables", "Differences"), ("pictures", "Pictures"), *parts.CONTENTS,
    ("runs", "Runs"), ("notes", "Notes"), ("deck", "Decks"), ("cite", "Cite"),
)  # fmt: skip


def steps(sides) -> float:
    """The number of steps that `render` reports to its watch."""
    return 3 * len(sides) + len(pictures.PICTURES) + len(parts.figure_names())


def render(sides, tables, watch, rerun: str) -> str:
    """The page as text; `watch`: a Progress; `rerun`: of the player, see finer.frames_of."""
    runs = [side.first for side in sides]
    with parts.painter(runs) as draw_all:
        players = []
        if any(len(run.frame_times()) for run in runs):
            with watch.step("the balls", 3 * len(runs)):
                tell = lambda text: watch(watch.done, text)  # noqa: E731
                players = parts.balls(runs, rerun, watch.say, tell, MOST_BYTES // len(runs))
        shown = []
        for name, title, words, figure in pictures.figures(tables):
            with watch.step("pictures"):
                shown.append((name, title, words, svg(figure, f"compared-{name}")))
        figures = parts.sections(draw_all(watch))
    left_out = {*parts.OPTIONAL, *(() if players else ("balls",))} - {one["anchor"] for one in figures}
    findings = [(finding.title(table), finding.sentences(table)) for table in tables]
    one = len(findings) == 1
    warnings = rows.warnings(sides)
    return parts.page(
        HERE,
        title=findings[0][0] if one else f"{plural(len(tables), 'run')} against {plain(sides[0].name)}",
        kicker=plain(_kicker(sides)),
        contents=[(anchor, name) for anchor, name in CONTENTS if anchor not in left_out],
        findings=[("" if one else title, words) for title, words in findings],
        sides=sides,
        differ=rows.deck_differences(sides),
        warnings=len(warnings),
        notes=warnings + rows.methods(sides, tables),
        players=list(zip(sides, players)),
        tables=[(table, terminal.heads(table), _rows(table)) for table in tables],
        forest=[one for one in shown if one[0] == "forest"],
        pictures=[one for one in shown if one[0] != "forest"],
        figures=figures,
        decks=[(side, pages.data_link(deck), lines(deck)) for side in sides for deck in [side.first.deck_text()]],
        cite=list(dict.fromkeys(line for run in runs for line in parts.cite(run))),
    )


def _kicker(sides) -> str:
    """The names of the runs, and the keys that differ with their values."""
    found = rows.deck_differences(sides)
    found.sort(key=lambda one: one[0].startswith(("run.", "output.")))  # the mill first
    more = f" and {len(found) - 4} more keys" if len(found) > 4 else ""
    named = [f"{key} {' | '.join(value or '–' for value in values)}" for key, values in found[:4]]
    differ = f" \N{MIDDLE DOT} different: {', '.join(named)}{more}" if named else " \N{MIDDLE DOT} same deck"
    return ", ".join(side.label for side in sides) + differ


def _rows(table) -> list[tuple[str, list]]:
    """[(head, [(row, its name, its other cells)])]: the rows of the forest plot, then all others."""
    important = table.important
    others = [row for row in table.shown if row not in important]
    head = f"{len(others)} more rows" if important else ""
    parted = ("", important, lambda row: row.name), (head, others, lambda row: row.label)
    return [
        (head, [(row, name(row), terminal.cells(row, table.designs)[1:]) for row in some])
        for head, some, name in parted
        if some
    ]
