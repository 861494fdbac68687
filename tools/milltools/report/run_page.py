"""A run as one page: everything in one file that opens from disk, everything from the run escaped."""

import base64
import dataclasses
import os
import pathlib

from milltools import pages
from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import lines, plain
from milltools.player import finer, painter, pictures, player, policy
from milltools.player import poster as still
from milltools.report import facts, notes
from milltools.report import sections as tables

HERE = pathlib.Path(__file__).resolve().parent
MOST_BYTES = 6_500_000  # of the player
CITE = (
    "millsim: event-driven simulation of high-energy ball mills. The millsim developers.",
    "Reichardt, Wiechert: Design optimization of high energy ball mills by discrete event simulation (2007).",
)
FIGURES = (("energy", "Energy"), ("spectra", "Impacts"), ("maps", "Maps"), ("time", "Over time"))
TITLES = {
    "energy": "Where the energy goes",
    "spectra": "How hard they hit",
    "maps": "Where it happens",
    "time": "Over time",
}
LEADS = {
    "energy": "",
    "spectra": "How often the balls meet, how hard, and what that takes of the power, by kind of contact.",
    "maps": "Averaged around the axis (axial cut) and along it (cross-section), over the sampled window.",
    "time": "",
}
CONTENTS = (
    ("balls", "Balls"), ("summary", "Summary"), *FIGURES, ("anomalies", "Anomalies"), ("precision", "Precision"),
    ("notes", "Notes"), ("how", "How it was run"), ("deck", "Deck"), ("cite", "Cite"),
)  # fmt: skip


def maker() -> str:
    """The version of the tools; unknown where there is no engine beside them."""
    try:
        return engine.version()
    except UserError:
        return "?"


def theme() -> str:
    """The script of the switch between light and dark."""
    return (HERE / "theme.js").read_text("utf-8")


def nothing(run) -> str:
    """Why there are no statistics."""
    try:
        run.need_statistics()
    except UserError as fault:
        return str(fault).removeprefix(f"{run.path}: ").strip() + "."
    return ""


def balls(run, watch, rerun: str, most_bytes: int = MOST_BYTES) -> str:
    """The player with its still picture, or why there is none; `rerun`: one of report.RERUN."""
    if not len(run.frame_times()):
        why = "output.frames is 0 s" if run.time > 0 else "it has not come to its first checkpoint"
        return f'<p class="missing">No ball states are stored in this run: {why}.</p>'
    with finer.frames_of(run, most_bytes, rerun, watch.say, watch.tell) as shown:
        return player.fragment(shown, most_bytes, still.picture(shown))


def data_link(text: str) -> str:
    return "data:text/plain;charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def cite(run) -> list[str]:
    made = plain(run.version)
    if run.program == "millsim":
        return [f"{CITE[0]} Version {made}.", CITE[1]]
    return [*CITE, f"{plain(run.program)} {made}, which made this run."]


@dataclasses.dataclass(frozen=True)
class Section:
    """Figures under one heading, in panels; those of one panel begin with one name: "slip", "slip-power". Where none of them
    can be drawn there are no panels, and `missing` says why."""

    anchor: str
    title: str
    lead: str
    panels: list[list[pictures.Picture]]
    missing: str


def figure_names() -> list[str]:
    """Of all figures, in the order of the page."""
    return [name for anchor, _ in FIGURES for name in pictures.names(anchor)]


def sections(drawings: dict[str, pictures.Picture]) -> list[Section]:
    """The sections of figures, from all of them by name."""
    found = []
    for anchor, _ in FIGURES:
        panels = {}
        for name in pictures.names(anchor):
            panels.setdefault(name.split("-")[0], []).append(drawings[name])
        drawn = [one for panel in panels.values() for one in panel]
        missing = "; ".join(dict.fromkeys(one.why for one in drawn))
        if any(one.svg for one in drawn):
            missing = ""
        shown = [drawn] if max(map(len, panels.values()), default=1) == 1 else list(panels.values())
        shown = [] if missing else shown
        found.append(Section(anchor, TITLES[anchor], LEADS[anchor], shown, plain(missing)))
    return found


def steps() -> float:
    """What render() tells its watch of, all in all."""
    return 4 + len(figure_names())


def render(run, watch, rerun: str = "auto") -> str:
    """The page of an open run as text."""
    name = plain(facts.deck_name(run))
    made = f"{plain(run.program)} {plain(run.version)}"
    with painter.Painter([run], figure_names()) as drawing:
        with watch.step("the balls", 4):
            fragment = balls(run, watch, rerun)
        figures = sections(drawing.all(watch))
    sampled, shared = facts.sampled(run), player.scripts()
    precision = tables.precision(run) if sampled else []
    deck = run.deck_text()
    return (
        pages.environment(HERE)
        .get_template("page.html")
        .render(
            policy=policy.of(fragment, shared, f"<script>{theme()}</script>"),
            maker=maker(),
            title=name,
            kicker=" \N{MIDDLE DOT} ".join((plain(os.path.basename(run.path)), made, plain(run.status))),
            style=pages.style(HERE / "report.css"),
            contents=[c for c in CONTENTS if precision or c[0] != "precision"],
            verdict=[said for said in facts.verdict(run) if said],
            notes=[plain(note) for note in notes.notes(run)],
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
            deck_link=data_link(deck),
            cite=cite(run),
            scripts=shared,
            theme=theme(),
        )
    )
