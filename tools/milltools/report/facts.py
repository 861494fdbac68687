"""A run described in words: its name, what was run, the verdict."""

import contextlib
import math
import pathlib
import shlex

import numpy as np

from milltools.base.text import SPACE, Number, count, plain, plural, scaled, small, with_error
from milltools.read import motions

WITH_VALUE = ("-o", "--output", "-s", "--set", "--export-start", "--value", "--progress", "--part")
DRIVE = (("power", "W"), ("torque", "N m"))
ANOMALIES = (  # of /run, as shown, what it means
    ("not_closing", "contacts with an opening gap",
     "At a predicted contact the two bodies were already moving apart; they got the rebound floor as speed."),
    ("reliefs", "pinched balls released",
     "A ball was pressed between a moving body, such as a blade, and a wall or other balls and could not escape, or "
     "was squeezed through a gap narrower than itself, and the body let it pass. Contacts of a pressed ball are not "
     "counted."),
    ("smoothed", "contacts without friction",
     "Contacts followed each other without any time between them; they were computed without friction."),
    ("overlaps", "overlaps", "Balls were more than 1 nm deep in another body."),
)  # fmt: skip


def deck_name(run) -> str:
    """The deck's file name, from the command line; if it is not there, the name of the output file."""
    words = iter(())
    with contextlib.suppress(ValueError):
        words = iter(shlex.split(run.about("command", ""))[1:])
    for word in words:
        if word in WITH_VALUE:
            next(words, "")
        elif word != "dem" and (not word.startswith("-") or word == "-"):
            if name := pathlib.PurePath(word).name:
                return name
    return pathlib.PurePath(run.path).name


def length(value: float) -> str:
    """A length in millimetres."""
    return f"{1e3 * value:.4g}{SPACE}mm"


def charge(run) -> str:
    """4000 balls of 5 mm and 7800 kg/m^3."""
    kinds = []
    for section in run.as_deck.sections:
        if run.has(f"deck/{section}/diameter"):
            number, diameter, density = (run.quantity(f"{section}/{name}") for name in ("count", "diameter", "density"))
            name = "" if section == "balls" else f" {plain(section.removeprefix('balls.'))}"
            of = f"{length(diameter)} and {density:.4g}{SPACE}kg/m\N{SUPERSCRIPT THREE}"
            kinds.append(f"{count(number)}{name} balls of {of}")
    return joined(kinds) or "Balls"


def joined(words: list[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1] if words else ""


def _vessel(run) -> str:
    """The container, such as "a round drum, 150 mm wide and 120 mm long inside"."""
    if run.vessel:
        place, sizes = f"body.{run.vessel}", []
        for name in ("size", "radius", "end_radius", "length"):
            if run.text(f"{place}/{name}", ""):
                millimetres = " x ".join(f"{1e3 * v:.4g}" for v in run.vector(f"{place}/{name}"))
                sizes.append(f"{name.replace('_', ' ')} {millimetres}{SPACE}mm")
        of = f" of {joined(sizes)}" if sizes else ""
        return f"the container “{plain(run.vessel)}”, a {plain(run.text(f'{place}/shape'))}{of}"
    wide, long = length(2 * run.quantity("drum/radius")), length(run.quantity("drum/length"))
    if run.text("drum/profile", "circle") != "wavy":
        return f"a round drum, {wide} wide and {long} long inside"
    buckles = f"{run.quantity('drum/buckles'):.0f} buckles of {length(run.quantity('drum/buckle_height'))}"
    return f"a wavy drum, {wide} wide and {long} long inside ({buckles})"


def mill(run) -> str:
    """In a round drum of 150 x 120 mm with a rotor of 5 blades at 1000 rpm."""
    words, own = _vessel(run), []
    if run.has_rotor:
        blades = len(run.as_deck.blades)
        own.append(f"a rotor of {plural(blades, 'blade') if blades else 'no blades'} at {motions.speed(run, 'rotor')}")
    for name in run.as_deck.bodies:
        copies = int(run.quantity(f"body.{name}/copies", 1))
        if name != run.vessel:
            own.append(f"{copies} × {plain(name)}" if copies > 1 else plain(name))
    if not own and not run.driven:
        return f"{words}, in which nothing moves"
    words += f", with {joined(own)}" if own else ""
    moving = [f"{plain(name)} {plain(motions.words(run, name))}" for name in run.as_deck.named("motion")]
    return words + (f"; {joined(moving)}" if moving else "")


def mean(run, name: str, unit: str) -> Number | None:
    """A mean over the sampled window with its standard error; None where it is not known: "rotor/power",
    "motions/jar/torque"."""
    if not run.driven or run.unsampled or not run.has(f"statistics/{name}"):
        return None
    return with_error(float(run.statistic(name)), run.standard_error(name), unit)


def drive_remark(run) -> str:
    """The time over which the mean is taken, in words."""
    what = "revolution" if run.driven == "rotor" else "period"
    turns = run.duration / run.period if math.isfinite(run.period) else math.nan
    words = f"over {turns:.3g} {what}{'s'[: abs(turns - 1) >= 5e-3]}" if turns == turns else "over the window"
    if run.driven == "drive" and len(run.motions) > 1 and turns == turns:
        words += " of the slowest motion"
    if not math.isfinite(run.standard_error(f"{run.driven}/power")):
        return words + ": error not known"
    return words


def anomalies(run) -> list[tuple[str, Number, str]] | None:
    """(name, count, meaning) of the anomalies that happened; None if the program does not count them."""
    if not all(run.has(f"run/{name}") for name, *_ in ANOMALIES):
        return None
    found = []
    for name, shown, meaning in ANOMALIES:
        times = int(run.read(f"run/{name}"))
        if times and name == "overlaps":
            meaning += f" The deepest: {scaled(run.read('run/largest_overlap'), 'm')}."
        if times:
            found.append((shown, count(times), meaning))
    return found


def energy_error(run) -> str:
    """Energy error as a share of the energy turned over; a dash if it is not known."""
    return str(small(run.about("energy_balance_error", math.nan)))


def dissipated(run) -> Number:
    """Power that all contacts dissipate."""
    return scaled(run.statistic("impacts/all/dissipated_power"), "W")


def _drive_sentence(run) -> str:
    power, torque = (mean(run, f"{run.driven}/{name}", unit) for name, unit in DRIVE)
    if power is None:
        return f"Nothing drives them; the contacts dissipate {dissipated(run)}."
    mass = float(np.sum(run.balls("mass")))
    words = f" at a torque of {torque}" if torque else ""
    return (
        f"The {run.driven} puts {power} into the charge ({scaled(power.value / mass, 'W')} per kilogram){words}, "
        f"{drive_remark(run)}."
    )


def _speed_sentence(run) -> str:
    normal = "impacts/all/normal_speed"
    total = int(run.statistic("impacts/all/count"))
    if not total:
        return "There were no impacts."
    return (
        f"Among {count(total)} impacts ({scaled(run.statistic('impacts/all/rate'), '/s')}) the median normal impact "
        f"speed is {scaled(run.statistic(f'{normal}/median'), 'm/s')}, "
        f"{scaled(run.statistic(f'{normal}/median_above_50mm_s'), 'm/s')} of those above 50{SPACE}mm/s."
    )


def _trust_sentence(run) -> str:
    words = []
    if run.has("run/energy_balance_error"):
        words.append(f"the error of the energy balance is {energy_error(run)} of the energy turned over")
    found = anomalies(run)
    if found:
        words.append("anomalies: " + joined([f"{times} \N{MULTIPLICATION SIGN} {what}" for what, times, _ in found]))
    elif found is not None:
        words.append("no anomalies")
    text = "; ".join(words)
    return text[:1].upper() + text[1:] + "." if text else ""


def verdict(run) -> list[str]:
    """The paragraph at the top, sentence by sentence."""
    said = [f"{charge(run)} in {mill(run)}."]
    reached = f"simulated for {scaled(run.time, 's')}"
    if run.time == 0:
        status = f"\N{LEFT DOUBLE QUOTATION MARK}{plain(run.status)}\N{RIGHT DOUBLE QUOTATION MARK}"
        return [*said, f"The run (status {status}) has not reached its first checkpoint: there are no results yet."]
    if run.unsampled:
        return [*said, f"It was {reached}; nothing was sampled.", _trust_sentence(run)]
    first, last = run.window
    said.append(
        f"It was {reached} and sampled for {scaled(run.duration, 's')}, from {scaled(first, 's')} to "
        f"{scaled(last, 's')}."
    )
    return [*said, _drive_sentence(run), _speed_sentence(run), _trust_sentence(run)]


def tiles(run) -> list[tuple[str, str, str]]:
    """(name, number, explanation) of the four numbers at the top."""
    found = []
    if not run.unsampled:
        power = mean(run, f"{run.driven}/power", "W")
        if power is not None:
            found.append((f"{run.driven} power", str(power), drive_remark(run)))
        else:
            found.append(("dissipated power", str(dissipated(run)), "in all contacts"))
        normal = "impacts/all/normal_speed"
        _, error, _ = run.known("median_above_50mm_s") or (0, math.nan, 0)
        median = with_error(float(run.statistic(f"{normal}/median_above_50mm_s")), error, "m/s")
        of_all = scaled(run.statistic(f"{normal}/median"), "m/s")
        found.append(("median impact speed", str(median), f"normal, above 50 mm/s; {of_all} of all contacts"))
    if run.has("run/energy_balance_error"):
        found.append(("energy error", energy_error(run), "of the energy turned over"))
    happened = anomalies(run)
    if happened is not None:
        total = sum(times.value for _, times, _ in happened)
        found.append(("anomalies", str(count(total)) if total else "none", "counted, see below" if total else ""))
    return found


def notes(run) -> list[str]:
    """Warnings about the numbers, the most important first: that the run is not complete (only the file shows this),
    then the notes of the program that made the run."""
    until = f"{run.time:.6g} s of {run.quantity('run/time', math.nan):.6g} s"
    found = []
    if run.status == "failed":
        found = [f"The run failed, at {until}; the file contains everything up to its last checkpoint."]
    elif run.status == "running" and run.time == 0:
        found = [
            "The run has not reached its first checkpoint: the file contains only its deck. If it is no longer "
            "running, start it again."
        ]
    elif run.status == "running":
        found = [
            f"The run is not complete: these are the results at its last checkpoint, at {until}. If it is no longer "
            "running, --resume continues from there."
        ]
    return [plain(note) for note in found + [note[:1].upper() + note[1:] for note in run.notes]]
