"""A run as one page: everything in one file that opens from disk, everything from the run escaped."""

import os
import pathlib

from milltools import pages
from milltools.base.errors import UserError
from milltools.base.text import lines, plain
from milltools.player import parts, player
from milltools.report import facts, tables

HERE = pathlib.Path(__file__).resolve().parent
CONTENTS = (
    ("balls", "Balls"), ("summary", "Summary"), *parts.CONTENTS, ("anomalies", "Anomalies"), ("precision", "Precision"),
    ("notes", "Notes"), ("how", "How it was run"), ("deck", "Deck"), ("cite", "Cite"),
)  # fmt: skip


def nothing(run) -> str:
    """Why there are no statistics."""
    try:
        run.need_statistics()
    except UserError as fault:
        return str(fault).removeprefix(f"{run.path}: ").strip() + "."
    return ""


def steps() -> float:
    """What render() tells its watch of, all in all."""
    return 4 + len(parts.figure_names())


def render(run, watch, rerun: str = "auto") -> str:
    """The page of an open run as text."""
    name = plain(facts.deck_name(run))
    made = f"{plain(run.program)} {plain(run.version)}"
    with parts.painter([run]) as draw_all:
        with watch.step("the balls", 4):
            fragment = parts.balls(run, rerun, watch.say, lambda text: watch(watch.done, text))
        figures = parts.sections(draw_all(watch))
    sampled = facts.sampled(run)
    precision = tables.precision(run) if sampled else []
    deck = run.deck_text()
    return (
        pages.environment(HERE)
        .get_template("page.html")
        .render(
            policy=player.policy(pages.theme()),
            maker=pages.maker(),
            title=name,
            kicker=" \N{MIDDLE DOT} ".join((plain(os.path.basename(run.path)), made, plain(run.status))),
            style=pages.style(pages.FOLDER / "report.css"),
            contents=[c for c in CONTENTS if precision or c[0] != "precision"],
            verdict=[said for said in facts.verdict(run) if said],
            notes=facts.notes(run),
            tiles=facts.tiles(run),
            player=fragment,
            contacts=tables.contacts(run) if sampled else [],
            contact_heads=tables.CONTACT_HEADS,
            strikes=tables.strikes(run) if sampled else "",
            nothing=nothing(run),
            balance=tables.balance(run),
            figures=figures,
            anomalies=facts.anomalies(run),
            uncounted=f"{plain(run.program)} does not count them."
            if run.time > 0
            else "None counted yet: the run has not come to its first checkpoint.",
            precision=precision,
            how=tables.how(run, os.path.getsize(run.path)),
            everything=tables.everything(run),
            deck=lines(deck),
            deck_file=name if name.endswith(".ini") else f"{name}.ini",
            deck_link=pages.data_link(deck),
            cite=parts.cite(run),
            scripts=player.scripts(),
            theme=pages.theme(),
        )
    )
