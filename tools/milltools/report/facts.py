"""A run described in words: the finding, its numbers, the checks, its name, what was run."""

import contextlib
import math
import pathlib
import shlex

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import SPACE, Number, brief, count, plain, plural, quantity, scaled, share, small, with_error
from milltools.dose import dose
from milltools.geometry import contour
from milltools.power import drum
from milltools.read import kinds, motions, sums

WITH_VALUE = ("-o", "--output", "-s", "--set", "--export-start", "--value", "--progress", "--part")
RUBBED = "is lost by sliding"
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
    found = []
    for section in run.as_deck.sections:
        if run.has(f"deck/{section}/diameter"):
            number, diameter, density = (run.quantity(f"{section}/{name}") for name in ("count", "diameter", "density"))
            name = "" if section == "balls" else f" {plain(section.removeprefix('balls.'))}"
            of = f"{length(diameter)} and {density:.4g}{SPACE}kg/m\N{SUPERSCRIPT THREE}"
            found.append(f"{count(number)}{name} balls of {of}")
    return joined(found) or "Balls"


def joined(words: list[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1] if words else ""


def _vessel(run) -> str:
    """The container, such as "a round drum, 150 mm in diameter and 120 mm long inside"."""
    if run.vessel:
        place, sizes = f"body.{run.vessel}", []
        if (shape := run.text(f"{place}/shape")) == "contour":
            sizes.append(_box(run, place))
        for name in ("size", "radius", "end_radius", "length"):
            if run.text(f"{place}/{name}", ""):
                millimetres = " x ".join(f"{1e3 * v:.4g}" for v in run.vector(f"{place}/{name}"))
                sizes.append(f"{name.replace('_', ' ')} {millimetres}{SPACE}mm")
        of = f" of {joined(sizes)}" if sizes else ""
        return f"the container “{plain(run.vessel)}”, a {plain(shape)}{of}"
    long = length(run.quantity("drum/length")) + (" long with periodic ends" if run.slice_length else " long inside")
    wide, profile = length(2 * run.quantity("drum/radius")), run.text("drum/profile", "circle")
    if profile == "file":
        return f"a drum with a contour of {_box(run, 'drum')}, {long}"
    mean = "mean " * (profile in ("wavy", "harmonics"))
    wall = "wavy drum" if mean else "drum with lifters" if profile == "lifters" else "round drum"
    part = {"wavy": "buckle", "lifters": "lifter"}.get(profile)
    if part:
        long += f" ({run.quantity(f'drum/{part}s'):.0f} {part}s of {length(run.quantity(f'drum/{part}_height'))})"
    return f"a {wall}, {wide} in {mean}diameter and {long}"


def _box(run, section) -> str:
    """The size of a contour, such as "70 x 65 mm"."""
    return " x ".join(f"{1e3 * v:.4g}" for v in np.ptp(contour.of(run.as_deck, section).box, axis=0)) + f"{SPACE}mm"


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
    names = run.as_deck.named("motion")
    moving = [f"{'it' if names == [run.carrier] else plain(name)} {plain(motions.words(run, name))}" for name in names]
    return words + (f"; {joined(moving)}" if moving else "") + "".join(f", {one}" for one in trade(run))


def trade(run) -> list[str]:
    """Of a horizontal drum that turns about its axis: its speed as the share of the critical one, and its filling."""
    if drum.why_not(run.as_deck):
        return []
    of = drum.mill_of(run.as_deck)
    speed = f"{100 * of.rate / of.critical_of_ball:.1f}{SPACE}% of the critical speed"
    return [speed, f"J{SPACE}{100 * of.filling:.1f}{SPACE}%"]


def mean(run, name: str, unit: str) -> Number | None:
    """A mean over the sampled window with its standard error; None where it is not known: "rotor/power",
    "motions/jar/torque"."""
    if not run.driven or run.unsampled or not run.has(f"statistics/{name}"):
        return None
    return with_error(float(run.statistic(name)), run.standard_error(name), unit)


def drive_remark(run) -> str:
    """The time over which the mean is taken, in words."""
    what = "revolution" if run.driven == "rotor" else "period"
    turns = run.duration / run.starts / run.period if math.isfinite(run.period) else math.nan
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


# ---- the finding


def losses(run) -> list[tuple[float, str]]:
    """What takes the power that impacts lose [W], in words, the largest first: sliding of all kinds together, and the
    impacts of each kind along the normal; the impacts of each kind where the file does not tell these apart."""

    def power(part, kind):
        path = f"precision/dissipated_power{part}/{kind}/value" if part else f"impacts/{kind}/dissipated_power"
        return float(run.statistic(path))

    if run.has("statistics/precision/dissipated_power_normal/all/value"):
        found = [(power("_normal", kind), f"goes into {plain(kinds.label(kind))} hits") for kind in run.kinds]
        found.append((power("", "all") - power("_normal", "all"), RUBBED))
    else:
        found = [(power("", kind), f"is lost in {plain(kinds.label(kind))} impacts") for kind in run.kinds]
    least = 1e-9 * sum(abs(power) for power, _ in found)  # smaller ones are rounding
    return sorted((one for one in found if abs(one[0]) > least), reverse=True)


def rubbed(run) -> tuple[float, float]:
    """The share of the lost power that sliding takes, which `losses` must have, and its standard error, from the
    starts, or from the time series of the first one in the blocks of the energies; NaN where the file does not have
    them."""
    blocks, sliding = "statistics/energies/blocks", next(power for power, words in losses(run) if words == RUBBED)
    value = sliding / float(run.statistic("impacts/all/dissipated_power"))
    names = [f"{part}/{kind}" for part in ("dissipation", "dissipation_normal") for kind in run.kinds]
    if run.doubt:
        return value, math.nan
    if run.starts >= sums.SEVERAL:
        every, normal = (run.read(f"starts/dissipated_power{part}/all") for part in ("", "_normal"))
        return value, sums.standard_error(every - normal - value * every, sums.APART) / every.mean()
    if not (run.has(f"{blocks}/duration") and all(map(run.has_series, names))):
        return value, math.nan
    block, period = float(run.read(f"{blocks}/duration")), int(run.read(f"{blocks}/period"))
    times, (first, last) = run.series(names[0])[0], run.window
    edges = first + block * np.arange(int((last - first) / block + 1e-9) + 1)
    if len(times) < 2 or np.median(np.diff(times)) > 1.01 * block or times[0] > first or times[-1] < edges[-1] - block:
        return value, math.nan
    lost = np.diff([np.interp(edges, *run.series(name)) for name in names])
    every, normal = lost[: len(run.kinds)].sum(axis=0), lost[len(run.kinds) :].sum(axis=0)
    rest = (every - normal) - value * every
    return value, sums.standard_error(rest, period) / every.mean() if every.any() else math.nan


def lossless(run) -> bool:
    """Whether impacts lose no energy, but for rounding."""
    lost = float(run.statistic("impacts/all/dissipated_power")) * run.duration
    return not lost > 1e-9 * float(run.about("energy_turnover", 0.0))


def power_drawn(run) -> tuple[float, float]:
    """(value, standard error) [W] of the power that the mill draws: that of the drive; that lost in impacts where
    nothing drives the balls."""
    if gives := mean(run, f"{run.driven}/power", "W"):
        return gives.value, run.standard_error(f"{run.driven}/power")
    return dose.loss(run)


def finding(run) -> str:
    """The answer of the run in one line: what takes most of the power, and how much it is."""
    if run.time == 0:
        return "No results yet: the run has not reached its first checkpoint"
    if run.unsampled:
        return f"No results: {run.unsampled}"
    so_far = "" if run.status == "complete" else "So far: "
    if not int(run.statistic("impacts/all/count")):
        return f"{so_far}The balls hit nothing in {scaled(run.duration, 's')}"
    if lossless(run):
        rate = str(brief(float(run.statistic("impacts/all/rate")), math.nan, "/s")).removesuffix("/s").strip()
        return f"{so_far}{rate} impacts each second lose no energy"
    total, error = dose.loss(run)
    parts = [(round(100 * power / total), words) for power, words in losses(run)[:2] if power > 0.005 * total]
    if rest := 100 - sum(part for part, _ in parts):
        parts.append((rest, "is the rest"))
    said = [f"{part}{SPACE}%{{}} {words}" for part, words in parts]
    drawn = power_drawn(run)
    if abs(drawn[0] - total) < max(3 * math.hypot(drawn[1], error), 0.01 * total):  # steady: one power
        total, error = drawn
    return so_far + ", ".join(said).replace("{}", f" of {brief(total, error, 'W')}", 1).replace("{}", "")


def tiles(run) -> list[tuple[str, Number, str]]:
    """(name, number with its standard error, explanation) of the numbers of the card, three, of a tumbling mill also
    toe and shoulder: the power, the hard
    impacts, the dose, the share that sliding takes, the median speed: the first three that the run has."""
    if run.unsampled or not int(run.statistic("impacts/all/count")):
        return []
    (power, error), mass, told = power_drawn(run), run.as_deck.mass, {}
    with contextlib.suppress(UserError):  # a file without energies
        told = {row.name: row for row in dose.rows(run)}
    what = f"of the {run.driven}" if run.driven else "lost in impacts"
    remark = f"{what}: {brief(power / mass, error / mass, 'W')} per kg of balls"
    if run.driven:
        remark += f"; {brief(*dose.loss(run), 'W')} lost in impacts"
    remark += "" if error == error or lossless(run) else "; error not known"
    found = [("power", brief(power, error, "W"), remark)]
    hard, fast = told.get("hard impacts"), run.known("rate_above_1/all")
    if hard and hard.value:
        per = told["hard impacts per joule"]
        remark = f"{hard.words}; {brief(per.value, per.error, '')} {per.words}"
        found.append(("hard impacts", brief(hard.value, hard.error, "/s"), remark))
    elif fast and fast[0]:
        found.append(("hard impacts", brief(*fast[:2], "/s"), f"of 1{SPACE}m/s or more"))
    if rate := told.get("dose rate"):
        hour, grams = told["dose in an hour"], quantity(1e3 * mass / told["ball to powder"].value, "g")
        remark = f"{brief(hour.value / 1e3, hour.error / 1e3, 'J/g')} in an hour; {grams} of powder"
        found.append(("dose of the powder", brief(rate.value / 1e3, rate.error / 1e3, "W/g"), remark))
    if not lossless(run) and any(words == RUBBED for _, words in losses(run)):
        value, error = rubbed(run)
        rest = [f"; {share(part / dose.loss(run)[0])} {words}" for part, words in losses(run) if words != RUBBED]
        remark = "of the lost power" + "".join(rest[:1])
        found.append(("lost by sliding", Number(str(brief(100 * value, 100 * error, "%")), value), remark))
    _, error, _ = run.known("median_above_floor") or (0, math.nan, 0)
    median = brief(float(run.statistic("impacts/all/normal_speed/median_above_floor")), error, "m/s")
    found.append(("median impact speed", median, f"normal, of the impacts above 50{SPACE}mm/s"))
    toe, shoulder = (math.degrees(run.charge[name][0]) if run.charge else math.nan for name in ("toe", "shoulder"))
    if math.isfinite(toe + shoulder):
        flying, said = run.charge["in_flight"][0], ["from 6 o'clock to the rising side", *trade(run)]
        said += [f"{100 * flying:.0f}{SPACE}% of the balls in flight"] * math.isfinite(flying)
        return [
            *found[:1],
            ("toe, shoulder", Number(f"{toe:.0f}°, {shoulder:.0f}°", toe), "; ".join(said)),
            *found[1:3],
        ]
    return found[:3]


def checks(run) -> str:
    """One line on how far the numbers can be trusted."""
    words = []
    if run.has("run/energy_balance_error"):
        words.append(f"energy balance {energy_error(run)}")
    found = anomalies(run)
    if found is not None:
        told = [f"{times} \N{MULTIPLICATION SIGN} {what}" for what, times, _ in found]
        words.append("anomalies: " + joined(told) if told else "no anomalies")
    if not run.unsampled:
        turns = run.duration / run.starts / run.period if math.isfinite(run.period) else 0.0
        periods = f" ({turns:.3g} {'revolutions' if run.driven == 'rotor' else 'periods'})" if turns else ""
        each = f" in each of {run.starts} starts" if run.starts > 1 else ""
        words.append(f"{quantity(run.duration / run.starts, 's')} sampled{each}{periods}")
        total, error = power_drawn(run)
        if error == error and total > 0:
            words.append(f"power known to {100 * error / total:.2g}{SPACE}%")
        elif not lossless(run):
            words.append("error of the power not known")
    return ", ".join(words)


def subject(run) -> str:
    """4000 balls of 5 mm in a round drum, with a rotor. Contact laws assumed: steel on steel (estimates)."""
    assumed = dict.fromkeys(run.read(f"run/assumed/{kind}") for kind in run.names("run/assumed"))
    pairs = [f"{pair} ({remark})" if remark else pair for pair, _, remark in (text.partition(": ") for text in assumed)]
    laws = f" Contact laws are assumed: {plain(joined(pairs))}." if pairs else ""
    soft = f" The balls are soft spheres of {scaled(run.modulus, 'Pa')}." if run.soft else ""
    return f"{charge(run)} in {mill(run)}.{soft}{laws}"


def window(run) -> str:
    """How long the run is, and what was sampled."""
    reached = f"It was simulated for {scaled(run.time, 's')}"
    if run.unsampled:
        return f"{reached}; nothing was sampled."
    first, last = run.window
    each = f", in each of {run.starts} starts" if run.starts > 1 else ""
    span = f"for {scaled(run.duration / run.starts, 's')}, from {scaled(first, 's')} to {scaled(last, 's')}"
    return f"{reached} and sampled {span}{each}."


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
