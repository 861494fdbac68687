"""What a run has to say of itself in words: its name, what was run, the verdict."""

import dataclasses
import math
import pathlib
import shlex

import numpy as np

from milltools.pages import plain
from milltools.report.numbers import MISSING, SPACE, Number, count, scaled, small, with_error

WITH_VALUE = ("-o", "--output", "-s", "--set", "--export-start", "--value", "--part")
ANOMALIES = (  # of /run, as shown, what it means
    (
        "not_closing",
        "contacts found opening",
        "A contact that was due found its two bodies already parting; they were given the rebound floor.",
    ),
    (
        "reliefs",
        "pinched balls let go",
        "A ball was pressed between a blade and a wall, or between other balls, with nowhere to go, or was squeezed "
        "through a gap narrower than itself, and the blade let it pass. Contacts of a pressed ball are not in the counts.",
    ),
    (
        "smoothed",
        "contacts made smooth",
        "Time stood still at a contact with friction; it was carried out without.",
    ),
    ("overlaps", "overlaps", "Balls were found deeper than 1 nm in another body."),
)


@dataclasses.dataclass(frozen=True)
class Anomaly:
    name: str
    times: Number
    meaning: str


def deck_name(run) -> str:
    """The deck's file name, from the command line; the run's own name where that does not tell."""
    try:
        words = shlex.split(run.read("run/command"))[1:] if run.has("run/command") else []
    except ValueError:
        words = []
    skip = False
    for word in words:
        if skip:
            skip = False
        elif word in WITH_VALUE:
            skip = True
        elif word != "dem" and (not word.startswith("-") or word == "-"):
            name = pathlib.PurePath(word).name
            if name:
                return name
    return pathlib.PurePath(run.path).name


def length(value: float) -> str:
    """Mills and balls are measured in millimetres."""
    return f"{1e3 * value:.4g}{SPACE}mm"


def charge(run) -> str:
    """4000 balls of 5 mm and 7800 kg/m^3."""
    kinds = []
    for section in run.sections():
        if run.has(f"deck/{section}/diameter"):
            kinds.append(
                f"{count(run.quantity(f'{section}/count'))}"
                + (f" {plain(section.removeprefix('balls.'))}" if section != "balls" else "")
                + f" balls of {length(run.quantity(f'{section}/diameter'))} and "
                f"{run.quantity(f'{section}/density'):.4g}{SPACE}kg/m\N{SUPERSCRIPT THREE}"
            )
    return joined(kinds) or "Balls"


def joined(words: list[str]) -> str:
    return (
        words[0]
        if len(words) == 1
        else ", ".join(words[:-1]) + " and " + words[-1]
        if words
        else ""
    )


def mill(run) -> str:
    """In a round drum of 150 x 120 mm with a rotor of 5 blades at 1000 rpm."""
    wavy = run.text("drum/profile", "circle") == "wavy"
    words = (
        f"a {'wavy' if wavy else 'round'} drum, {length(2 * run.quantity('drum/radius'))} wide and "
        f"{length(run.quantity('drum/length'))} long inside"
    )
    if wavy:
        words += (
            f" ({run.quantity('drum/buckles'):.0f} buckles of "
            f"{length(run.quantity('drum/buckle_height'))})"
        )
    if not run.has_rotor:
        return words + ", without a rotor"
    blades, speed = len(run.blades()), run.rotor_speed * 30 / math.pi
    what = f"{blades} blade{'s'[: blades != 1]}" if blades else "no blades"
    return words + f", with a rotor of {what} at {speed:.4g}{SPACE}rpm"


def sampled(run) -> bool:
    return run.has_statistics and run.duration > 0


def rotor_mean(run, name: str, unit: str) -> Number | None:
    """Mean power or torque of the rotor with its standard error; None without a rotor that turns."""
    if not (run.rotor_speed and sampled(run) and run.has(f"statistics/rotor/{name}")):
        return None
    return with_error(
        float(run.statistic(f"rotor/{name}")), float(run.statistic(f"rotor/{name}_error")), unit
    )


def rotor_remark(run) -> str:
    """What its mean is over."""
    turns = run.duration * abs(run.rotor_speed) / (2 * math.pi)
    words = f"over {turns:.3g} revolution{'s'[: abs(turns - 1) >= 5e-3]}"
    if not math.isfinite(float(run.statistic("rotor/power_error"))):
        return words + ": error not known"
    return words


def anomalies(run) -> list[Anomaly] | None:
    """Those that happened; None where the program does not count them."""
    if not all(run.has(f"run/{name}") for name, *_ in ANOMALIES):
        return None
    found = []
    for name, shown, meaning in ANOMALIES:
        times = int(run.read(f"run/{name}"))
        if times and name == "overlaps":
            meaning += f" The deepest: {scaled(run.read('run/largest_overlap'), 'm')}."
        if times:
            found.append(Anomaly(shown, count(times), meaning))
    return found


def energy_error(run) -> str:
    """Of the energy turned over; a dash where it is not known."""
    if not run.has("run/energy_balance_error"):
        return MISSING
    return str(small(run.read("run/energy_balance_error")))


def _rotor_sentence(run) -> str:
    power = rotor_mean(run, "power", "W")
    if power is None:
        dissipated = scaled(run.statistic("impacts/all/dissipated_power"), "W")
        return f"No rotor drives them; the contacts dissipate {dissipated}."
    mass = float(np.sum(run.balls("mass")))
    torque = rotor_mean(run, "torque", "N m")
    return (
        f"The rotor puts {power} into the charge ({scaled(power.value / mass, 'W')} per kilogram) at a torque of {torque} "
        f"({rotor_remark(run)})."
    )


def _speed_sentence(run) -> str:
    normal = "impacts/all/normal_speed"
    total = int(run.statistic("impacts/all/count"))
    if not total:
        return "Nothing touched anything."
    return (
        f"Among {count(total)} contacts ({scaled(run.statistic('impacts/all/rate'), '/s')}) the median normal impact speed is "
        f"{scaled(run.statistic(f'{normal}/median'), 'm/s')}, "
        f"{scaled(run.statistic(f'{normal}/median_above_50mm_s'), 'm/s')} of those above 50{SPACE}mm/s."
    )


def _trust_sentence(run) -> str:
    words = []
    if run.has("run/energy_balance_error"):
        words.append(f"the energy account is off by {energy_error(run)} of the energy turned over")
    found = anomalies(run)
    if found is not None:
        words.append(
            "no anomalies" if not found
            else "anomalies: " + joined([f"{a.times} \N{MULTIPLICATION SIGN} {a.name}" for a in found])
        )  # fmt: skip
    text = "; ".join(words)
    return text[:1].upper() + text[1:] + "." if text else ""


def verdict(run) -> list[str]:
    """The paragraph at the top, sentence by sentence."""
    said = [f"{charge(run)} in {mill(run)}."]
    reached = f"simulated for {scaled(run.time, 's')}"
    if run.time == 0:
        return [*said, f"The run (status \N{LEFT DOUBLE QUOTATION MARK}{plain(run.status)}\N{RIGHT DOUBLE QUOTATION MARK}) "
                "has not come to its first checkpoint: there are no results yet."]  # fmt: skip
    if not sampled(run):
        return [*said, f"It was {reached}; nothing was sampled.", _trust_sentence(run)]
    first, last = run.window
    said.append(
        f"It was {reached} and sampled for {scaled(run.duration, 's')}, from {scaled(first, 's')} to {scaled(last, 's')}."
    )
    return [*said, _rotor_sentence(run), _speed_sentence(run), _trust_sentence(run)]


def tiles(run) -> list[tuple[str, str, str]]:
    """(what, the figure, how it is to be read) of the four figures at the top."""
    found = []
    if sampled(run):
        power = rotor_mean(run, "power", "W")
        if power is not None:
            found.append(("rotor power", str(power), rotor_remark(run)))
        else:
            lost = scaled(run.statistic("impacts/all/dissipated_power"), "W")
            found.append(("dissipated power", str(lost), "in all contacts"))
        normal = "impacts/all/normal_speed"
        known = run.known("median_above_50mm_s")
        error = known[1] if known else math.nan
        median = with_error(float(run.statistic(f"{normal}/median_above_50mm_s")), error, "m/s")
        of_all = scaled(run.statistic(f"{normal}/median"), "m/s")
        found.append(
            ("median impact speed", str(median), f"normal, above 50 mm/s; {of_all} of all contacts")
        )
    if run.has("run/energy_balance_error"):
        found.append(("energy error", energy_error(run), "of the energy turned over"))
    list_of = anomalies(run)
    if list_of is not None:
        total = sum(a.times.value for a in list_of)
        found.append(
            (
                "anomalies",
                str(count(total)) if total else "none",
                "counted, see below" if total else "",
            )
        )
    return found
