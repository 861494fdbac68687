"""Several runs on one page: what `mill compare` says of them, their spectra and maps together, the balls of each."""

import contextlib

from milltools import pages
from milltools.base.text import lines, plain
from milltools.compare import load, rows
from milltools.compare.compare_page import shown
from milltools.compare.terminal import percent, title
from milltools.player import painter, player, policy
from milltools.read.runfile import Run
from milltools.report import run_page as page

MOST_BYTES = 6_000_000  # of all players together
TOLD = ("rotor_power", "drive_power", "median_above_50mm_s", "kinetic_energy")
CONTENTS = (
    ("verdict", "Runs"), ("notes", "To know first"), ("balls", "Balls"), ("tables", "Differences"), *page.FIGURES,
    ("deck", "Decks"), ("cite", "Cite"),
)  # fmt: skip


def sentence(table) -> str:
    """The paragraph at the top: a side against the reference, in the few rows that matter most, and how many verdicts of
    each kind there are."""
    words = []
    for row in table.rows:
        if row.key in TOLD and row.difference == row.difference:
            error = percent(row.difference_error, "")
            error = f" \N{PLUS-MINUS SIGN} {error}" if error else ""
            words.append(f"{row.label} {percent(row.difference)}{error} % ({row.verdict})")
    judged = {mood: sum(row.mood == mood for row in table.rows) for mood in ("agree", "differ", "open")}
    return (
        f"{title(table)}: {'; '.join(words)}. Of {len(table.rows)} quantities {judged['agree']} agree, "
        f"{judged['differ']} differ, {judged['open']} are open."
    )


def decks(sides) -> list[tuple[str, str, str, str]]:
    """(label, file name, data link, text) of each side's first run."""
    found = []
    for side in sides:
        with Run(side.first.path) as run:
            text = run.deck_text()
        found.append((plain(side.label), f"{side.letter}.ini", page.data_link(text), lines(text)))
    return found


def steps(files) -> float:
    """What render() tells its watch of, all in all."""
    return 3 + 3 * len(files) + page.steps() - 4


def render(files: list[list[str]], watch, rerun: str = "auto") -> str:
    """The page of sides, each a list of replicates."""
    with watch.step("reading the runs", 3):
        sides = load.sides(files)
        tables = [rows.compare(sides[0], side) for side in sides[1:]]
    with contextlib.ExitStack() as stack:
        runs = [stack.enter_context(Run(side.first.path)) for side in sides]
        drawing = stack.enter_context(painter.Painter(runs, page.figure_names()))
        players = []
        for side, run in zip(sides, runs):
            with watch.step("the balls", 3):
                room = MOST_BYTES // len(runs)
                players.append((plain(side.label), page.balls(run, watch, rerun, room)))
        figures = page.sections(drawing.all(watch))
        cite = list(dict.fromkeys(line for run in runs for line in page.cite(run)))
    scripts, theme = player.scripts(), page.theme()
    names = ", ".join(f"{side.letter}: {side.name}" for side in sides)
    template = pages.environment(page.HERE).get_template("beside.html")
    return template.render(
        policy=policy.of(*(fragment for _, fragment in players), scripts, f"<script>{theme}</script>"),
        maker=page.maker(),
        title="Runs compared",
        kicker=plain(names),
        style=pages.style(page.HERE / "report.css"),
        contents=CONTENTS,
        verdict=[plain(sentence(table)) for table in tables],
        sides=sides,
        differ=rows.deck_differences(sides),
        players=players,
        tables=[shown(table) for table in tables],
        figures=figures,
        notes=[plain(note) for note in rows.notes(sides)],
        decks=decks(sides),
        cite=cite,
        scripts=scripts,
        theme=theme,
    )
