"""Parts of the pages about runs: the player, the figures under their headings, the references."""

import contextlib
import dataclasses
import functools
import io
import itertools

from markupsafe import escape
from matplotlib.figure import Figure as Canvas
from PIL import Image

from milltools import pages
from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.progress import Progress
from milltools.base.text import plain
from milltools.figures import FIGURES, overview, svg
from milltools.figures.style import lay_out
from milltools.geometry.bodies import Mill
from milltools.geometry.trajectory import stored
from milltools.player import finer, player
from milltools.read.runfile import Run
from milltools.render import camera, colour, scene
from milltools.render.team import team

MOST_BYTES = 6_500_000  # of the player
STILL = 960, 540  # [pixels]
SHARE = 0.6  # of the figures are drawn by the second process; the first one also makes the player
CITE = (
    "millsim: event-driven simulation of high-energy ball mills. The millsim developers.",
    "Reichardt, Wiechert: Design optimization of high energy ball mills by discrete event simulation (2007).",
)
# groups of figures: name in the contents, heading, text below it
GROUPS = {
    "energy": ("Energy", "Where the energy goes", ""),
    "charge": ("Charge", "Where the charge is", ""),
    "spectra": (
        "Impacts",
        "How hard the balls hit",
        "How often and how hard the balls hit, and how much of the power the impacts dissipate, by kind of contact.",
    ),
    "maps": (
        "Maps",
        "Where the balls hit",
        "Averaged around the axis (axial cut) and along it (cross-section), over the sampled window.",
    ),
    "wear": ("Wear", "Which parts wear", ""),
    "liner": ("Liner", "What the liner gets", ""),
    "time": ("Over time", "Over time", ""),
}
# figures that are shown at once: the first ones of a group that can be drawn, all others of the group are folded
SHOWN = {"energy": ("flow",), "spectra": ("energies-power", "speeds-power"), "wear": ("wear",)}
OPTIONAL = ("charge", "liner", "dose")  # left out of a page that has nothing for them
CONTENTS = tuple((anchor, name) for anchor, (name, *_) in GROUPS.items())


def balls(runs, rerun: str, say, tell, most_bytes: int = MOST_BYTES) -> list[str]:
    """The players of runs that are shown together, each with its still picture and at most `most_bytes` long, or the
    reason why there is none. They have the same colours and one least energy of flashes; several end where a turn has
    ended. `rerun`, `say`, `tell`: see finer.frames_of."""
    there = [run for run in runs if not player.no_frames(run)]
    limits = player.scales(there) if there else {}
    with contextlib.ExitStack() as stack:
        found = {}
        for run in there:
            until = player.last_turn(run) if len(runs) > 1 else None
            shown = stack.enter_context(finer.frames_of(run, most_bytes, rerun, say, tell, until))
            found[run] = shown, player.flashes(shown)
        all_flashes = [flashes for _, flashes in found.values() if flashes]
        for flashes in all_flashes:
            flashes.beside(all_flashes)

        def picture(shown):
            return smaller(still(shown, limits), finer.still_room(most_bytes))

        return [
            player.fragment(found[run][0], most_bytes, picture(found[run][0]), limits, found[run][1])
            if run in found
            else f'<p class="missing">{player.no_frames(run)}</p>'
            for run in runs
        ]


def still(run, limits=None) -> bytes:
    """The last stored frame as a PNG, for browsers without WebGL and for printing; without frames the mill alone."""
    last, store = len(run.frame_times()) - 1, io.BytesIO()
    limits = limits or {"speed": colour.shared([run], "speed")[1] if last >= 0 else 1.0}
    try:  # as `mill render` draws it
        if last < 0:
            raise UserError("no frame")
        state = stored(run, last)
        riding = state.poses if Mill.of(run).wanders else None  # like the first view of the player
        look = camera.of("front", run, poses=riding), colour.of(run, "speed", (0.0, limits["speed"]))
        with scene.Scene(run, STILL, "draft", *look) as drawing:
            Image.fromarray(drawing.draw(state)).save(store, format="png")
    except UserError:  # no frame, or no 3D drawing without a display on this machine: draw the view along the axis
        figure = Canvas(figsize=(8, 6.4), layout="none")
        ax = figure.subplots()
        overview.mill(ax, run, last=True)
        overview.draw_balls(ax, run)
        lay_out(figure)
        figure.savefig(store, format="png", dpi=100)
    return store.getvalue()


def smaller(png: bytes, most_bytes: int) -> bytes:
    """A PNG of at most `most_bytes`, as far as fewer colours and then half or a quarter of the pixels along each side
    make this possible: a picture must not take the room of the balls."""
    with Image.open(io.BytesIO(png)) as whole:
        colours = whole.convert("RGB")
    for part in (1, 2, 4):
        if len(png) <= most_bytes:
            break
        store = io.BytesIO()
        colours.reduce(part).quantize(256).save(store, format="png", optimize=True)
        png = store.getvalue()
    return png


def page(folder, **values) -> str:
    """The template page.html of a folder, filled with `values`: a page with players and figures. A script card.js of
    the folder goes into it too."""
    files = pages.FOLDER / "theme.js", folder / "card.js"
    theme = "\n".join(path.read_text("utf-8") for path in files if path.exists())
    shared = {"policy": player.policy(theme), "maker": pages.maker(), "scripts": player.scripts(), "theme": theme}
    template = pages.environment(folder).get_template("page.html")
    return template.render(style=pages.style(pages.FOLDER / "report.css"), **shared, **values)


def cite(run) -> list[str]:
    made = plain(run.version)
    if run.program == "millsim":
        return [f"{CITE[0]} Version {made}.", CITE[1]]
    return [*CITE, f"{plain(run.program)} {made}, which made this run."]


# ---- figures


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure of milltools.figures as inline SVG; if it cannot be drawn, `svg` is empty and `why` has the
    reason."""

    name: str
    title: str
    caption: str
    svg: str
    why: str = ""


def draw(name: str, runs: list[Run]) -> Picture:
    """One figure of all open `runs`."""
    figure = FIGURES[name]
    try:
        for run in runs:
            why = figure.why_not(run)
            if why:
                raise UserError(f"{run.path}: {why}" if len(runs) > 1 else why)
        drawing, caption = figure.draw(runs, titled=False), figure.says(runs)
    except UserError as fault:
        return Picture(name, figure.title, figure.caption, "", str(fault))
    label = escape(f"{figure.title}: {caption}")
    markup = svg(drawing, f"figure-{name}").replace('role="img"', f'role="img" aria-label="{label}"', 1)
    return Picture(name, figure.title, caption, markup)


@contextlib.contextmanager
def drawing(paths: list[str]):
    """Yields draw() for the runs at paths, for a second process."""
    with contextlib.ExitStack() as stack:
        runs = [stack.enter_context(Run(path)) for path in paths]
        yield lambda name: draw(name, runs)


@contextlib.contextmanager
def painter(runs: list[Run]):
    """Yields a function of a Progress that returns all figures of open `runs` by name. Figures take most of the time of
    a page, so a second process draws some of them while this process makes the player. This process draws the rest, and
    those that the second process did not finish."""
    names, begun = figure_names(), {}
    worth_it = processes.cores() > 1 and any(not run.unsampled for run in runs)

    def draw_all(watch: Progress) -> dict[str, Picture]:
        found = {}
        for name in sorted(names, key=begun.__contains__):  # first the figures that this process draws
            with watch.step("pictures"):
                try:
                    found[name] = begun[name].result()
                except (KeyError, UserError):  # not given to the second process, or not finished there
                    found[name] = draw(name, runs)
        return found

    with contextlib.ExitStack() as stack:
        if worth_it:
            submit = stack.enter_context(team(functools.partial(drawing, [run.path for run in runs]), 1))
            begun |= {name: submit(name) for name in names[: round(SHARE * len(names))]}
        yield draw_all


def figure_names() -> list[str]:
    """The names of all figures in the order of the page."""
    return [name for group in GROUPS for name, figure in FIGURES.items() if figure.group == group]


def sections(drawings: dict[str, Picture]) -> list[dict]:
    """The figures (given by name) under the headings of GROUPS, in panels. The names in a panel have the same
    beginning: "slip", "slip-power". If no figure of a group can be drawn, there are no panels, and `missing` has the
    reason; groups of OPTIONAL are left out then. `shown`: the figure that is not folded; the panels of its group do not
    have it."""
    found = []
    for anchor, (_, title, lead) in GROUPS.items():
        drawn = [drawings[name] for name in figure_names() if FIGURES[name].group == anchor]
        shown = [one for name in SHOWN.get(anchor, ()) for one in drawn if one.name == name and one.svg][:1]
        drawn = [one for one in drawn if one not in shown]
        panels = [list(some) for _, some in itertools.groupby(drawn, key=lambda one: one.name.split("-")[0])]
        why = plain("; ".join(dict.fromkeys(one.why for one in drawn)))
        missing = "" if any(one.svg for one in (*shown, *drawn)) else why
        if drawn and len(panels) == len(drawn):
            panels = [drawn]
        if missing and anchor in OPTIONAL:
            continue
        words = {"anchor": anchor, "title": title, "lead": lead, "missing": missing}
        found.append(words | {"shown": shown, "panels": [] if missing else panels})
    return found
