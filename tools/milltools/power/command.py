"""`mill power`: the power of a tumbling mill by the field's formulas, beside that of its run."""

import math
import textwrap
from typing import Any

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.progress import say
from milltools.base.text import MINUS, SPACE, THIN, brief, columns, number, quantity, with_error
from milltools.power import drum, models
from milltools.power.models import DISCHARGES, Mill
from milltools.read import values
from milltools.read.deck import Deck
from milltools.read.runfile import Run, kind_of

SUMMARY = (
    "Says what power the field's formulas give to a horizontal drum that turns about its axis: Morrell's C- and "
    "E-model, Hogg & Fuerstenau, Bond, Austin; also critical speed, filling, toe and shoulder. With the run of the "
    "mill its simulated power is beside them. docs/tumbling.md explains the formulas and their ranges."
)
RPM = 30 / math.pi
SOLIDS = 0.7


def add_arguments(parser):
    parser.add_argument("what", metavar="DECK|RUN", help="deck of a horizontal drum, or the output file of its run")
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of the deck; may be repeated",
    )  # fmt: skip
    parser.add_argument("--discharge", choices=DISCHARGES, help="grate or overflow: a wet mill; default: dry, no ore")
    parser.add_argument("--ore", metavar="DENSITY", help="of the ore of a wet mill; default: '2.7 g/cm^3'")
    parser.add_argument("--solids", metavar="SHARE", help="of the pulp's mass that is ore; default: '70 %%'")
    parser.add_argument("--angle", metavar="ANGLE", help="of the charge, for Hogg & Fuerstenau; default: '35 deg'")


def _given(option: str, text: str | None, key: str, default: float, most: float = math.inf) -> float:
    """The value of an option in SI, which millsim reads as a value of `key`; above 0, at most `most`."""
    if text is None:
        return default
    try:
        (told,) = values.tell([f"{key}={text}"])
    except UserError as fault:
        raise UserError(f"{option}: {str(fault).partition(': ')[2] or fault}", fault.status) from None
    if not 0 < told.value <= most:
        limit = f", at most {most:g}" if most < math.inf else ""
        raise UserError(f"{option}: expected more than 0{limit}, got '{text}'")
    return told.value


def _wet(arguments) -> dict[str, Any]:
    """The fields of Mill that the options give."""
    kind = arguments.discharge or "dry"
    if kind == "dry" and (lone := [f"--{one}" for one in ("ore", "solids") if getattr(arguments, one)]):
        raise UserError(f"{lone[0]}: only of a wet mill, with --discharge grate or overflow")
    ore = _given("--ore", arguments.ore, "powder.density", models.ROCK)
    solids = _given("--solids", arguments.solids, "powder.packing", SOLIDS, 1)
    return {} if kind == "dry" else {"discharge": kind, "ore": ore, "pulp": models.pulp(ore, solids)}


def _plain(shown) -> str:
    return str(shown).replace(SPACE, " ").replace(THIN, " ")


def _spoken(angle: float) -> str:
    return f"{math.degrees(angle):.1f}".replace("-", MINUS)


def about(mill: Mill) -> list[tuple[str, str]]:
    """(name, value) of the mill and its charge; a line without a name belongs to the one before."""
    toe, shoulder = models.toe_and_shoulder(mill)
    percent = f"{100 * mill.speed:.1f}"
    found = [
        ("mill", f"{number(mill.diameter, 4)} m x {number(mill.length, 4)} m, {number(mill.rate * RPM, 4)} rpm"),
        ("critical speed", f"{number(mill.critical * RPM, 4)} rpm, 42.3/sqrt(D): the mill turns at {percent} % of it"),
    ]
    if mill.critical_of_ball == mill.critical_of_ball:
        own, share = mill.critical_of_ball, 100 * mill.rate / mill.critical_of_ball
        of = f"of the largest ball, {number(1e3 * mill.ball)} mm"
        found.append(("", f"{number(own * RPM, 4)} rpm, 42.3/sqrt(D-d) {of}: {share:.1f} %"))
    return [
        *found,
        ("filling", f"J {100 * mill.filling:.1f} % with {100 * mill.voidage:.0f} % of voids: "
         f"{quantity(1e3 * mill.ball_mass, 'g', 4)} of balls of {mill.ball_density:.0f} kg/m^3"),
        ("charge", f"{mill.density:.0f} kg/m^3 " + ("dry, without ore" if not mill.pulp else
         f"with pulp of {mill.pulp:.0f} kg/m^3, {mill.discharge} discharge")),
        ("toe, shoulder", f"Morrell expects {_spoken(toe)}, {_spoken(shoulder)} deg from 3 o'clock with the turning"),
        ("", f"{_spoken(toe - 3 * math.pi / 2)}, {_spoken(shoulder + math.pi / 2)} deg from 6 o'clock, "
         "the rising side positive"),
    ]  # fmt: skip


def run(arguments) -> Answer:
    wet, angle = _wet(arguments), _given("--angle", arguments.angle, "blades.pitch", models.REPOSE, math.pi / 2)
    drawn, path = (math.nan, math.nan), arguments.what
    is_run = kind_of(path) == "run"
    if is_run and arguments.set:
        raise UserError(f"{path}: --set: a finished run cannot be changed; give its deck")
    if is_run:
        with Run(path) as opened:
            deck = opened.as_deck
            mill, drawn = drum.mill_of(deck, **wet), drum.simulated(opened)
            for note in opened.notes:
                say("mill power", f"note: {note}")
    else:
        deck = Deck.check(path, arguments.set)
        mill = drum.mill_of(deck, **wet)
    rows = drum.rows(mill, drawn, angle)
    lines = columns([(name, value) for name, value in about(mill)], left=(0, 1))
    if is_run:
        lines.append(f"{'simulated':<15}{_plain(with_error(*drawn, 'W'))}, {models.NET}")
    idle = _plain(brief(models.no_load(mill), math.nan, "W"))
    lines += ["", *_printed(rows, angle, is_run), f"Both gross powers of Morrell contain his no-load of {idle}."]
    if deck.periodic:
        lines.append("All is of a slice of this length; that no-load is of a whole mill as short as it.")
    toe, shoulder = models.toe_and_shoulder(mill)
    facts = {
        "files": [], "run" if is_run else "deck": path, "diameter": mill.diameter, "length": mill.length,
        "speed": mill.rate, "critical_speed": mill.critical, "critical_speed_of_ball": mill.critical_of_ball,
        "fraction_of_critical": mill.speed, "filling": mill.filling, "ball_mass": mill.ball_mass,
        "charge_density": mill.density, "no_load": models.no_load(mill),
        "toe": toe, "shoulder": shoulder, "angle": angle,
        "simulated": {"value": drawn[0], "standard_error": drawn[1], "unit": "W", "basis": models.NET},
        "models": rows,
    }  # fmt: skip
    return Answer("\n".join(lines), facts)


def _printed(rows, angle: float, is_run: bool) -> list[str]:
    """The lines of the table of `rows`, and what its stars mean."""
    cells = [("model", "power", *["simulated/model"] * is_run, "basis")]
    for row in rows:
        name = row["model"] + (f", {math.degrees(angle):.3g} deg" if row["model"].startswith("Hogg") else "")
        ratio = str(brief(row["ratio"], row["ratio_error"], "")).replace("\N{NO-BREAK SPACE}", " ")
        shown = str(brief(row["value"], math.nan, "W")).replace("\N{NO-BREAK SPACE}", " ") + (
            "*" if row["outside"] else " "
        )
        cells.append((name, shown, *[ratio] * is_run, row["basis"]))
    found = columns(cells, left=(0, *range(2 + is_run, 3 + is_run)))
    return [*found, *(line for note in stars(rows) for line in textwrap.wrap(note, 100, subsequent_indent="  "))]


def stars(rows) -> list[str]:
    """A line for each reason why a row of drum.rows() has a star: the mill is outside of the model's range."""
    found: dict[str, list[str]] = {}
    for row in rows:
        if row["outside"]:
            found.setdefault(f"outside of {row['mills']}: {row['outside']}", []).append(row["model"])
    return [f"* {', '.join(names)}: {why}." for why, names in found.items()]
