"""What pages of runs are made of: the balls, the figures under their headings, how to cite."""

import dataclasses

from milltools.base.text import plain
from milltools.player import finer, painter, player, poster

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


def balls(run, rerun: str, say, tell, most_bytes: int = MOST_BYTES) -> str:
    """The player with its still picture, or why there is none; `rerun`, `say`, `tell`: see finer.frames_of."""
    if not len(run.frame_times()):
        why = "output.frames is 0 s" if run.time > 0 else "it has not come to its first checkpoint"
        return f'<p class="missing">No ball states are stored in this run: {why}.</p>'
    with finer.frames_of(run, most_bytes, rerun, say, tell) as shown:
        return player.fragment(shown, most_bytes, poster.picture(shown))


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
    panels: list[list[painter.Picture]]
    missing: str


def figure_names() -> list[str]:
    """Of all figures, in the order of the page."""
    return [name for anchor, _ in FIGURES for name in painter.names(anchor)]


def sections(drawings: dict[str, painter.Picture]) -> list[Section]:
    """The sections of figures, from all of them by name."""
    found = []
    for anchor, _ in FIGURES:
        panels = {}
        for name in painter.names(anchor):
            panels.setdefault(name.split("-")[0], []).append(drawings[name])
        drawn = [one for panel in panels.values() for one in panel]
        missing = "; ".join(dict.fromkeys(one.why for one in drawn))
        if any(one.svg for one in drawn):
            missing = ""
        shown = [drawn] if max(map(len, panels.values()), default=1) == 1 else list(panels.values())
        shown = [] if missing else shown
        found.append(Section(anchor, TITLES[anchor], LEADS[anchor], shown, plain(missing)))
    return found
