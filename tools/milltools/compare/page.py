"""Several runs on one page that opens from disk: differences and how sure they are, pictures, the balls of each run,
decks. All text from the runs is escaped."""

import math
import pathlib

from milltools import pages
from milltools.base.text import lines, plain
from milltools.compare import pictures, rows, terminal
from milltools.figures.style import embedded
from milltools.player import parts

MOST_BYTES = 6_000_000  # of all players together
TOLD = ("rotor_power", "drive_power", "median_above_50mm_s", "kinetic_energy")
CONTENTS = (
    ("verdict", "Runs"), ("notes", "Read first"), ("balls", "Balls"), ("tables", "Differences"),
    ("pictures", "Pictures"), *parts.CONTENTS, ("deck", "Decks"), ("cite", "Cite"),
)  # fmt: skip


def sentence(table) -> str:
    """The paragraph at the top: it compares a side with the reference in the most important rows, and counts the
    verdicts of each kind."""
    words = []
    for row in table.shown:
        if row.key in TOLD and math.isfinite(row.difference):
            error = terminal.percent(row.difference_error, "")
            error = f" \N{PLUS-MINUS SIGN} {error}" if error else ""
            words.append(f"{row.label} {terminal.percent(row.difference)}{error} % ({row.verdict})")
    judged = {mood: sum(row.mood == mood for row in table.shown) for mood in ("agree", "differ", "open")}
    return (
        f"{table.title}: {'; '.join(words)}. Of {len(table.shown)} quantities {judged['agree']} agree, "
        f"{judged['differ']} differ, {judged['open']} have no verdict."
    )


def steps(sides) -> float:
    """The number of steps that `render` reports to its watch."""
    return 3 * len(sides) + len(pictures.PICTURES) + len(parts.figure_names())


def render(sides, tables, notes, watch, rerun: str = "never") -> str:
    """The page as text; `watch`: a Progress; `rerun`: of the player, see finer.frames_of."""
    runs = [side.first for side in sides]
    with parts.painter(runs) as draw_all:
        players = []
        for run in runs if any(len(run.frame_times()) for run in runs) else ():
            with watch.step("the balls", 3):
                most = MOST_BYTES // len(runs)
                players.append(parts.balls(run, rerun, watch.say, lambda text: watch(watch.done, text), most, runs))
        shown = []
        for title, words, figure in pictures.figures(sides):
            with watch.step("pictures"):
                shown.append((title, words, embedded(figure, dpi=110)))
        figures = parts.sections(draw_all(watch))
    return parts.page(
        pathlib.Path(__file__).parent,
        title="Runs compared",
        kicker=plain(", ".join(side.label for side in sides)),
        contents=[entry for entry in CONTENTS if players or entry[0] != "balls"],
        verdict=[sentence(table) for table in tables],
        sides=sides,
        differ=rows.deck_differences(sides),
        notes=notes,
        players=zip(sides, players),
        tables=[
            (table, terminal.heads(table), [(row, terminal.cells(row)) for row in table.shown]) for table in tables
        ],
        pictures=shown,
        figures=figures,
        decks=[(side, pages.data_link(deck), lines(deck)) for side in sides for deck in [side.first.deck_text()]],
        cite=list(dict.fromkeys(line for run in runs for line in parts.cite(run))),
    )
