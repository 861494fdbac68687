"""The dose of a run: rows of (name, value, standard error, unit, explanation)."""

import dataclasses
import math
import pathlib
import typing

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import SPACE, THIN, quantity, with_error
from milltools.dose import laws
from milltools.read import sums
from milltools.read.runfile import HARD_PER_JOULE, HARD_RATE, Hard, Run

MINUTES = (1, 10, 60)
HOUR = 3600.0


class Powder(typing.NamedTuple):
    """The values of [powder] in SI (docs/deck.md)."""

    mass: float
    density: float
    size: float
    packing: float
    capture: str
    layer: float
    modulus: float
    energy: str
    threshold: float
    law: str
    coefficient: float
    exponent: float
    strength: float
    least: float
    hard: Hard  # of the threshold
    rates: tuple[np.ndarray, np.ndarray] | None


class Heating(typing.NamedTuple):
    """The values of [heat] in SI."""

    ball_heat_capacity: float
    powder_heat_capacity: float
    jar_heat_capacity: float
    jar_mass: float
    ball_to_jar: float
    jar_to_room: float
    room: float
    share: float


@dataclasses.dataclass(frozen=True)
class Row:
    name: str
    value: float
    error: float  # NaN: not known
    unit: str
    words: str
    shown: tuple[str, float] = ("", 1.0)  # unit that people use, in SI; default: `unit`


def measured(row: Row) -> str:
    """Value and error of a row as text. Temperatures and units of the trade have no prefix."""
    unit, factor = row.shown
    if not unit and row.unit != "K":
        return str(with_error(row.value, row.error, row.unit)).replace(SPACE, " ").replace(THIN, " ")
    value, error = row.value / factor, row.error / factor
    digits = 1 - math.floor(math.log10(error)) if error > 0 else 3 - math.floor(math.log10(abs(value) or 1))
    text = f"{value:.{max(digits, 0)}f}" + (f" ± {error:.{max(digits, 0)}f}" if error == error else "")
    return f"{text} {unit or row.unit}"


HARD = "run.hard_impact"
CARRIED = 0.9  # part of the energy that counted impacts bring: the slow ones beyond it hang on the rebound floor
# defaults of keys that a deck can leave out; millsim prints them for a deck that has the section
DEFAULTS = {
    "powder": {
        "size": "0", "packing": "0.6", "capture": "monolayer", "layer": "0", "modulus": "115e9", "energy": "normal",
        "threshold": "auto", "law": "none", "coefficient": "0", "exponent": "0", "strength": "0", "least": "0",
        "table": "none",
    },
    "heat": {"powder_heat_capacity": "0", "room": "293.15", "share": "0.5"},
}  # fmt: skip


def given(sets: typing.Sequence[str], sections: typing.Collection[str]) -> list[tuple[str, str, str]]:
    """(section, key, value in SI) of each "SECTION.KEY=VALUE"; a UserError for one of other sections."""
    found = []
    for one in sets:
        try:
            name, *row = engine.ask("--value", one).rstrip("\n").split("\t")
        except UserError as fault:
            raise UserError(str(fault).removeprefix("--value ")) from None
        part, _, key = name.rpartition(".")
        if part.partition(".")[0] not in sections and name not in sections:
            known = " and ".join(f"[{section}]" for section in sections if "." not in section)
            raise UserError(f"'{one}': only keys of {known} can be set for a run that is finished")
        found.append((part, key, row[1]))
    return found


def values(run: Run, section: str, sets: typing.Sequence[str]) -> dict[str, str]:
    """The values of a section in SI, as texts: of the deck of the run, with "SECTION.KEY=VALUE" of `sets`."""
    found = {key: text.split()[0] for key, text in run.as_deck.sections.get(section, {}).items()}
    found |= {key: value for part, key, value in given(sets, (*DEFAULTS, HARD)) if part == section}
    return DEFAULTS[section] | found if found else {}


def powder(run: Run, sets: typing.Sequence[str] = ()) -> Powder | None:
    """The powder of a run; None if its deck has no [powder] and `sets` give none."""
    found = values(run, "powder", sets)
    if not found:
        return None
    ratio = found.pop("ball_to_powder", None)
    if ratio is not None:
        found["mass"] = repr(run.as_deck.mass / float(ratio))
    for key in ("mass", "density"):
        if key not in found:
            raise UserError(f"{run.path}: needs [powder] {key}: add it to the deck, or -s 'powder.{key}=...'")
    table = found.pop("table")
    hard = run.hard if found["threshold"] == "auto" else Hard(float(found["threshold"]), found["energy"])
    found["threshold"] = repr(hard.energy)
    words = {key: text if key in ("capture", "energy", "law") else float(text) for key, text in found.items()}
    one = Powder(**words, hard=hard, rates=None if table == "none" else _table(table))
    needs = {
        "size": one.law == "vogel_peukert",
        "strength": one.law == "vogel_peukert",
        "coefficient": one.law in ("power", "threshold"),
        "exponent": one.law == "power",
        "layer": one.capture == "layer",
    }
    for key, needed in needs.items():
        if needed and not getattr(one, key):
            raise UserError(f"{run.path}: needs [powder] {key}: add it to the deck, or -s 'powder.{key}=...'")
    if one.law == "table" and one.rates is None:
        raise UserError(f"{run.path}: needs [powder] table: the name of a file with rows 'E k'")
    return one


def _table(path: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        rows = np.loadtxt(pathlib.Path(path), ndmin=2)
    except (OSError, ValueError) as fault:
        raise UserError(f"{path}: cannot be read as rows 'E k': {fault}") from None
    if rows.shape[1] != 2 or not np.isfinite(rows).all() or not (np.diff(rows[:, 0]) > 0).all():
        raise UserError(f"{path}: expected rows 'E k' with ascending energies E [J]")
    return rows[:, 0], rows[:, 1]


def heating(run: Run, sets: typing.Sequence[str] = ()) -> Heating | None:
    found = values(run, "heat", sets)
    for key in Heating._fields if found else ():
        if key not in found:
            raise UserError(f"{run.path}: needs [heat] {key}: add it to the deck, or -s 'heat.{key}=...'")
    return Heating(**{key: float(text) for key, text in found.items()}) if found else None


def loss(run: Run) -> tuple[float, float]:
    """(value, error) of the power that all impacts dissipate [W]."""
    known = "precision/dissipated_power/all/standard_error"
    error = float(run.statistic(known)) if run.has(f"statistics/{known}") else math.nan
    return float(run.statistic("impacts/all/dissipated_power")), error


def rows(run: Run, sets: typing.Sequence[str] = ()) -> list[Row]:
    """All results that the deck of the run, with `sets`, allows; UserError if nothing was sampled."""
    run.need_statistics()
    stuff, heat = powder(run, sets), heating(run, sets)
    power, error = loss(run)
    asked = [value for part, _, value in given(sets, (*DEFAULTS, HARD)) if part == "run"]
    mass, sort, is_hard = run.as_deck.mass, stuff.energy if stuff else "normal", stuff.hard if stuff else run.hard
    is_hard = Hard(float(asked[-1])) if asked else is_hard
    drive = run.known(f"{run.driven}_power") if run.driven else None
    drive = drive and drive[:2]
    found = [Row("power of the drive", *drive, "W", "that the motions give to the balls")] if drive else []
    found += [
        Row("power", power, error, "W", "lost in impacts"),
        Row("power per ball mass", *(x / mass for x in (drive or (power, error))), "W/kg", f"{mass:.4g} kg of balls"),
    ]
    if stuff:
        per = stuff.mass
        found += [
            Row("ball to powder", mass / per, math.nan, "", f"mass ratio; {per:.4g} kg of powder"),
            Row("dose rate", power / per, error / per, "W/kg", "power per powder mass", ("W/g", 1e3)),
            Row("dose in an hour", *(HOUR / per * x for x in (power, error)), "J/kg", "per powder mass", ("kJ/g", 1e6)),
        ]
    least = sums.carrying(run, CARRIED, sort)
    frequent, brought = sums.total(run, sums.above(least), sort), sums.total(run, _energy_above(least), sort)
    which = f"impacts of {quantity(least, 'J')} or more, which bring nine tenths of the energy"
    work = "of work of the drive" if run.driven else "lost in all impacts"
    found += [
        Row("stress frequency", frequent.value, frequent.error, "/s", which),
        Row(
            "mean stress energy",
            *brought.over(frequent)[:2],
            "J",
            f"{sort} energy of one of them, mean" + ", of which a part is lost" * (sort != "dissipated"),
        ),
    ]
    if math.isfinite(is_hard.energy):
        found += _hard(run, is_hard, work)
    if stuff:
        found += _of_powder(run, stuff, sort, sums.carrying(run, CARRIED))
    if heat:
        found += _temperatures(
            laws.Heat(power, mass, stuff.mass if stuff else 0.0, heat), error / power if power else math.nan
        )
    return found


def scalars(run: Run) -> dict[str, tuple[float, float, str]]:
    """{path: (value, standard error, unit)} of rows(), as studies keep them: "dose/dose_rate"."""
    hard = {"hard impacts": "/s", "hard impacts per joule": "/J", "power of hard impacts": "W"}
    told = {name: (math.nan, math.nan, unit) for name, unit in hard.items()}  # without impacts none is hard
    told |= {row.name: (row.value, row.error, row.unit or "1") for row in rows(run)}
    return {f"dose/{name.replace(' ', '_')}": known for name, known in told.items()}


def _hard(run: Run, which: Hard, work: str) -> list[Row]:
    count = sums.total(run, sums.above(which.energy), which.by)
    brought = sums.total(run, _energy_above(which.energy), which.by)
    rate, per_joule = (count.value, count.error), sums.per_work(run, count)[:2]
    if which == run.hard and (told := run.known(HARD_RATE)):
        rate, per_joule = told[:2], (run.known(HARD_PER_JOULE) or per_joule)[:2]
    words = which.words + ", which lose half of the energy" * which.found
    return [
        Row("hard impacts", *rate, "/s", words),
        Row("hard impacts per joule", *per_joule, "/J", f"per joule {work}"),
        Row("power of hard impacts", brought.value, brought.error, "W", f"{which.by} energy that they bring"),
    ]


def _energy_above(least: float) -> sums.Weight:
    counts = sums.above(least)
    return lambda energy, pair: energy * counts(energy, pair)


def _of_powder(run: Run, stuff: Powder, sort: str, least: float) -> list[Row]:
    found = []
    if stuff.size or stuff.capture == "layer":
        above = sums.above(least)
        caught = sums.total(run, lambda energy, p: laws.captured(energy, p.radius, stuff) * above(energy, p), "normal")
        share = caught.value / stuff.mass, caught.error / stuff.mass
        found = [
            Row(
                "powder caught",
                caught.value,
                caught.error,
                "kg/s",
                f"by impacts of {quantity(least, 'J')} or more; model: {stuff.capture}",
                ("g/s", 1e-3),
            ),
            Row("stress number rate", *share, "/s", "times a second that each part of the powder is caught, mean"),
        ]
    if stuff.law != "none":
        done = sums.total(run, lambda energy, p: laws.effect(energy, p.radius, stuff), sort)
        what = "particles broken" if stuff.law == "vogel_peukert" else "sum of k(E) over all impacts"
        found.append(Row("rate of the law", done.value, done.error, "/s", f"{what}; law: {stuff.law}"))
    return found


def _temperatures(heat: laws.Heat, relative: float) -> list[Row]:
    """relative: standard error of the power, divided by the power"""
    found = []
    for column, name in enumerate(("balls", "jar")):
        after = [(f"after {minutes} min", heat.after(60.0 * minutes)[column]) for minutes in MINUTES]
        for when, at in (*after, ("in the end", heat.steady()[column])):
            if math.isfinite(at):  # the rise above the room is proportional to the power
                words = f"temperature of the {name}"
                found.append(Row(f"{name} {when}", float(at), abs(float(at) - heat.room) * relative, "K", words))
    return found
