"""A run as one page: everything in one file that opens from disk, everything from the run escaped."""

import base64
import os
import pathlib

from milltools import engine, pages
from milltools.errors import UserError
from milltools.report import facts, notes, pictures, policy, still, tables

HERE = pathlib.Path(__file__).resolve().parent
CITE = (
    "millsim: event-driven simulation of high-energy ball mills. The millsim developers.",
    "Reichardt, Wiechert: Design optimization of high energy ball mills by discrete event simulation (2007).",
)


def maker() -> str:
    """The version of the tools; unknown where there is no engine beside them."""
    try:
        return engine.version()
    except UserError:
        return "?"


def nothing(run) -> str:
    """Why there are no statistics."""
    try:
        run.need_statistics()
    except UserError as fault:
        return str(fault).removeprefix(f"{run.path}: ").strip() + "."
    return ""


def balls(run) -> tuple[str, str]:
    """(fragment, scripts) of the player, or a picture, or why there is neither."""
    picture = still.picture(run)
    if picture is None:
        return (
            '<p class="missing">No ball states are stored: the deck has output.frames = 0 s, or the run has not come to '
            "its first checkpoint.</p>",
            "",
        )
    source = base64.b64encode(picture).decode()
    return f'<figure><img alt="The balls" src="data:image/png;base64,{source}"></figure>', ""


def data_link(text: str) -> str:
    return "data:text/plain;charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def cite(run) -> list[str]:
    made = pages.plain(run.version)
    own = [f"{pages.plain(run.program)} {made}, which made this run."] if run.program != "millsim" else []
    return [f"{CITE[0]} Version {made}." if not own else CITE[0], CITE[1], *own]


def sections(run) -> list[tuple]:
    """(anchor, title, lead, pictures) of the sections of figures."""
    if not facts.sampled(run):
        return []
    return [
        ("spectra", "How hard they hit", "", pictures.spectra(run)),
        ("maps", "Where it happens", "", pictures.maps(run)),
    ]


CONTENTS = (
    ("balls", "Balls"), ("summary", "Summary"), ("energy", "Energy"), ("spectra", "Impacts"), ("maps", "Maps"),
    ("time", "Over time"), ("anomalies", "Anomalies"), ("precision", "Precision"), ("notes", "Notes"),
    ("how", "How it was run"), ("deck", "Deck"), ("cite", "Cite"),
)  # fmt: skip


def render(run) -> str:
    """The page of an open run as text."""
    name = pages.plain(facts.deck_name(run))
    fragment, scripts = balls(run)
    figures = sections(run)
    precision = tables.precision(run) if run.has_statistics else []
    there = {anchor for anchor, *_ in figures} | ({"precision"} if precision else set())
    theme = (HERE / "theme.js").read_text("utf-8")
    deck = run.deck_text()
    sampled = facts.sampled(run)
    return (
        pages.environment(HERE)
        .get_template("page.html")
        .render(
            policy=policy.of(fragment, scripts, f"<script>{theme}</script>"),
            maker=maker(),
            title=name,
            kicker=f"{pages.plain(os.path.basename(run.path))} \N{MIDDLE DOT} {pages.plain(run.program)} {pages.plain(run.version)}"
            f" \N{MIDDLE DOT} {pages.plain(run.status)}",
            style=pages.style(HERE / "report.css"),
            contents=[
                (anchor, words)
                for anchor, words in CONTENTS
                if anchor in there or anchor not in ("energy", "spectra", "maps", "time", "precision")
            ],
            verdict=facts.verdict(run),
            notes=[pages.plain(note) for note in notes.notes(run)],
            tiles=facts.tiles(run),
            player=fragment,
            contacts=tables.contacts(run) if sampled else [],
            contact_heads=tables.CONTACT_HEADS,
            strikes=tables.strikes(run) if sampled else "",
            nothing=nothing(run),
            balance=tables.balance(run),
            figures=figures,
            anomalies=facts.anomalies(run),
            program=pages.plain(run.program),
            precision=precision,
            how=tables.how(run, os.path.getsize(run.path)),
            everything=tables.everything(run),
            deck=pages.lines(deck),
            deck_file=name if name.endswith(".ini") else f"{name}.ini",
            deck_link=data_link(deck),
            cite=cite(run),
            scripts=scripts,
            theme=theme,
        )
    )
