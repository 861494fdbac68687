"""A run as one page: one file that opens from disk; all text from the run is escaped. Tables are rows of
(head, cells); each cell is a text or a Number."""

import base64
import math
import os
import pathlib

from milltools import pages
from milltools.base.errors import UserError
from milltools.base.text import (
    Number,
    brief,
    column,
    count,
    degrees,
    lines,
    plain,
    scaled,
    share,
    small,
    with_error,
)
from milltools.dose import dose, wear
from milltools.player import parts, player
from milltools.power import command, drum, models
from milltools.read import kinds, motions
from milltools.read.runfile import FORMS
from milltools.read.wear import why_not
from milltools.report import facts

HERE = pathlib.Path(__file__).resolve().parent
CONTENTS = (
    ("verdict", "Answer"), ("energy", "Energy"), ("charge", "Charge"), ("power", "Power"), ("spectra", "Impacts"),
    ("wear", "Wear"), ("liner", "Liner"), ("dose", "Dose"), ("summary", "All numbers"), ("maps", "Maps"),
    ("time", "Over time"), ("anomalies", "Checks"), ("notes", "Notes"), ("how", "How it was run"),
    ("deck", "Deck"), ("cite", "Cite"),
)  # fmt: skip
FACES = 6  # of the table of wear are shown at once
SPEED = "v\N{LATIN SUBSCRIPT SMALL LETTER N}"


def contacts(run) -> tuple[list[str], list[tuple[str, list[Number]]]]:
    """Heads of the columns; rows by kind of contact, then all. Kinds without contacts are left out, as on the
    terminal; the rebound floor, where balls are soft and have none."""
    rows = [kind for kind in run.kinds if int(run.statistic(f"impacts/{kind}/count"))] + ["all"]

    def values(name):
        return [float(run.statistic(f"impacts/{row}/{name}")) for row in rows]

    power, above = values("dissipated_power"), scaled(run.above_floor, "m/s")
    columns = {
        "contacts": [count(times) for times in values("count")],
        "rate": column(values("rate"), "/s"),
        f"median {SPEED} of all": column(values("normal_speed/median"), "m/s"),
        f"median {SPEED} above {above}": column(values("normal_speed/median_above_floor"), "m/s"),
        f"mean {SPEED}": column(values("normal_speed/mean"), "m/s"),
        "at the rebound floor": [share(float(run.statistic(f"floor_share/{row}"))) for row in rows],
        "dissipated power": column(power, "W"),
        "share": [share(one / power[-1] if power[-1] > 0 else math.nan) for one in power],
    }
    if run.soft:
        del columns["at the rebound floor"]
    return list(columns), [(kinds.label(row), cells) for row, *cells in zip(rows, *columns.values())]


def strikes(run) -> str:
    """How many contacts there are when a pair's re-contacts count once; empty where none are merged."""
    window = run.strike_window
    if not window > 0 or not run.has("statistics/strikes/all/count"):
        return ""
    times, rate = run.statistic("strikes/all/count"), run.statistic("strikes/all/rate")
    merged = f"if impacts of the same two bodies within {scaled(window, 's')} count once"
    return f"{count(times)} strikes ({scaled(rate, '/s')}) {merged}."


def balance(run) -> list[tuple[str, object, str]]:
    """(name, value, remark): drive, each motion with its description, energies, energy balance."""
    found = []
    if run.soft:
        lasts = f"contacts last {scaled(run.contact_duration, 's')} and more; no rebound floor"
        found.append(("soft spheres", scaled(run.modulus, "Pa"), f"Young's modulus; {lasts}"))
    for name, unit in facts.DRIVE:
        mean = facts.mean(run, f"{run.driven}/{name}", unit)
        if mean is not None:
            found.append((f"{run.driven} {name}", mean, facts.drive_remark(run)))
    for name in run.motions if run.driven == "drive" else ():
        power, torque = (facts.mean(run, f"motions/{name}/{what}", unit) for what, unit in facts.DRIVE)
        if power is not None:
            words = plain(motions.words(run, name)) + (f"; torque {torque}" if torque and torque.value else "")
            found.append((f"power of {plain(name)}", power, words))
    if not run.unsampled:
        found += _of_window(run)
    for name, label in FORMS.items():
        time, value = run.series(name) if run.has_series(name) else ((), ())
        if len(value) and math.isfinite(value[-1]):
            found.append((label, scaled(value[-1], "J"), f"at {scaled(time[-1], 's')}"))
    if run.has("run/energy_balance_error") and run.has("run/energy_turnover"):
        turned, error = (float(run.about(f"energy_{name}")) for name in ("turnover", "balance_error"))
        remark = f"of {scaled(turned, 'J')} turned over ({small(error)})"
        found.append(("energy error", scaled(error * turned, "J"), remark))
    return found


def formulas(run) -> tuple[list[tuple[str, str, str]], list[str], list[list[str]], list[str]]:
    """Of a horizontal drum: facts of the mill, as `mill power` has them; heads and rows of the power that formulas of
    the field give, beside that of the run; remarks. Empty for other mills."""
    rows = drum.beside(run)
    if not rows:
        return [], [], [], []
    about = command.about(drum.mill_of(run.as_deck))
    about.append(("simulated", f"{with_error(*drum.simulated(run), 'W')}, {models.NET}"))
    facts = [(name, value.replace("m^3", "m³"), "") for name, value in about]
    table = []
    for row in rows:
        power = f"{scaled(row['value'], 'W')}{'*' * bool(row['outside'])}"
        table.append([row["model"], row["basis"], power, str(brief(row["ratio"], row["ratio_error"], ""))])
    notes = [
        "The simulated power is what the mill gives to the balls: compare it with charge net. Shell or pinion power "
        "also contains the losses of the bearings, motor power those of gear and motor."
    ]
    return facts, ["formula", "where the power is taken", "power", "simulated / formula"], table, [
        *notes, *command.stars(rows)
    ]  # fmt: skip


def _of_window(run):
    pinched = f"{run.driven}/pinch_power"
    pinches = run.statistic(pinched) if run.has(f"statistics/{pinched}") else 0
    if pinches > 0:
        yield "pinches", scaled(pinches, "W"), f"part of the {run.driven} power, on balls that moving bodies press"
    for name, label, what, unit in (
        ("median", "median normal speed", "all impacts", "m/s"),
        ("median_above_floor", "median normal speed", "impacts above the floor", "m/s"),
        ("rate_above_1/all", "rate", "impacts above 1 m/s", "/s"),
    ):
        if known := run.known(name):
            remark = what if math.isfinite(known[1]) else f"{what}: error not known"
            yield label, with_error(*known[:2], unit), remark
    yield "dissipated power", with_error(*dose.loss(run), "W"), "all contacts, over the sampled window"


def precision(run) -> list[tuple[str, object, str]]:
    """Precision of the values that decided when the run ended; empty without run.precision."""
    if not run.has("statistics/precision/asked"):
        return []

    def value(name):
        return float(run.statistic(f"precision/{name}"))

    found = [("requested precision", share(value("asked")), "run.precision: standard error divided by value")]
    for name, label, unit in (
        ("median_above_floor", "median normal speed above the floor", "m/s"),
        (f"{run.driven}_power", f"{run.driven} power", "W"),
    ):
        if not run.has(f"statistics/precision/{name}/value"):
            continue
        mean, error = value(f"{name}/value"), value(f"{name}/standard_error")
        known = f"{100 * error / abs(mean):.2g} % of it" if mean and math.isfinite(error) else "error not known"
        found.append((label, with_error(mean, error, unit), known))
    return [
        *found,
        ("start-up left out", scaled(value("warm_up"), "s"), "the sampled window begins then"),
        ("length of a batch", scaled(value("batch"), "s"), f"{value('batches'):.0f} batches"),
        ("start-up is over", "yes" if value("settled") else "not known", ""),
        ("requested precision reached", "yes" if value("reached") else "no", _ended(run)),
    ]


def _ended(run) -> str:
    words = {
        "time": "the run ended at run.time",
        "precision": "the run ended for this reason",
        "max_collisions": "the run ended at run.max_collisions",
        "none": "the run is not complete",
    }
    said = run.about("ended_by", "")
    return words.get(said, plain(said))


def how(run, size: int) -> list[tuple[str, object, str]]:
    """Program, machine-independent facts, cost; `size` of the file [byte]."""
    found = [("program", plain(run.program), plain(run.version))]
    for name in ("compiler", "flags", "hdf5", "gsl", "command", "started", "status"):
        if run.has(f"run/{name}"):
            found.append(({"hdf5": "HDF5", "gsl": "GSL"}.get(name, name), plain(run.about(name)), ""))
    if _ended(run):
        found.append(("end", _ended(run), ""))
    found.append(("simulated", scaled(run.time, "s"), f"{len(run.frame_times())} frames stored"))
    for name, label, unit in (
        ("wall_time", "wall-clock time", "s"),
        ("cpu_time", "processor time", "s"),
        ("peak_memory", "largest memory", "B"),
    ):
        if run.has(f"run/{name}"):
            found.append((label, scaled(run.about(name), unit), ""))
    if run.has("run/threads"):
        found.append(("threads", plain(run.about("threads")), ""))
    if math.isfinite(run.cost):
        cpu = float(run.read("run/cpu_time"))
        rate = f"{scaled(run.contacts / cpu, '')} contacts per processor second" if cpu > 0 else ""
        found.append(("cost per simulated second", Number(f"{run.cost:.4g} s", run.cost),
                      "processor time" + (f"; {rate}" if rate else "")))  # fmt: skip
    found.append(("file", plain(run.path), str(scaled(size, "B"))))
    return found


def everything(run) -> list[tuple[str, str, str, str]]:
    """(name, value, unit, meaning) of all entries of /run, except counts of contacts that the mill cannot have."""
    found = []
    for path, unit, meaning in run.datasets("run"):
        if path.split("/")[-1] in run.absent:
            continue
        value = run.read(path)
        shown = lines(value) if isinstance(value, str) else f"{value:.10g}"
        found.append((path.removeprefix("run/"), shown, unit, meaning))
    return found


def worn(run) -> tuple[str, list[str], list[list[str]]]:
    """The finding about the wear of the parts, heads and rows of its table; empty where the file has no wear."""
    if why_not(run):
        return "", [], []
    found = wear.faces(run)
    said = wear.finding(found)
    return f"{said[0].upper()}{said[1:]}.", *wear.sums(found)


def charge(run) -> list[tuple[str, object, str]]:
    """(name, value with error, explanation) of the charge of a tumbling mill; empty for others."""
    known, found = run.charge, []
    if not known:
        return []
    for name in ("toe", "shoulder"):
        morrell = degrees((known[name][0] + 1.5 * math.pi) % math.tau)
        words = f"from 6 o'clock to the side where the wall rises; from 3 o'clock, as Morrell counts: {morrell}"
        found.append((name, degrees(*known[name]), words))
    found.append(("angle of repose", degrees(*known["repose"]), "dynamic: the direction of the centre of mass"))
    for name in ("mass", "circulation"):
        across, up = (with_error(*known[f"{name}_{way}"], "m") for way in ("across", "up"))
        found.append((f"centre of {name}", across, f"from the axis to the side where the wall rises; upwards: {up}"))
    share_of = with_error(*(100 * one for one in known["in_flight"]), "%")
    return [*found, ("in flight", share_of, "share of the balls in flights longer than the fall by their diameter")]


def dosed(run) -> list[tuple[str, str, str]]:
    """(name, value with error, explanation) of the dose, for a deck with a powder or with heat."""
    if run.unsampled or not {"powder", "heat"} & set(run.as_deck.sections):
        return []
    try:
        return [(row.name, dose.measured(row), row.words) for row in dose.rows(run)]
    except UserError as fault:
        return [("not known", "", plain(fault))]


# ---- the page


def steps() -> float:
    """The number of steps that render() reports to its watch."""
    return 4 + len(parts.figure_names())


def render(run, watch, rerun: str = "auto", printed: bool = False) -> str:
    """The page of an open run as text; `printed`: for paper, with a picture instead of the player."""
    name = plain(facts.deck_name(run))
    made = f"{plain(run.program)} {plain(run.version)}"
    with parts.painter([run]) as draw_all:
        with watch.step("the balls", 4):
            why, fragment = player.no_frames(run), ""
            if not (why or printed):
                (fragment,) = parts.balls([run], rerun, watch.say, lambda text: watch(watch.done, text))
            still = "" if fragment else base64.b64encode(parts.still(run)).decode()
        figures = {one["anchor"]: one for one in parts.sections(draw_all(watch))}
    unsampled = run.unsampled
    known, doses, power = [] if unsampled else precision(run), dosed(run), formulas(run)
    there = {*figures, *["dose"] * bool(doses), *["power"] * bool(power[0])}
    heads, rows = ([], []) if unsampled else contacts(run)
    deck = run.deck_text()
    return parts.page(
        HERE,
        title=facts.finding(run),
        kicker=" \N{MIDDLE DOT} ".join((name, plain(os.path.basename(run.path)), made, plain(run.status))),
        contents=[c for c in CONTENTS if c[0] not in (*parts.OPTIONAL, "power") or c[0] in there],
        charge=charge(run),
        power=power,
        mill=facts.subject(run),
        window=facts.window(run) if run.time > 0 else "",
        checks=facts.checks(run),
        notes=facts.notes(run),
        tiles=facts.tiles(run),
        player=fragment,
        still=still,
        why=why,
        worn=worn(run),
        lining=[f"{said[0].upper()}{said[1:]}" for said, _ in wear.lining(run)] if "liner" in figures else [],
        faces=FACES,
        doses=doses,
        contact_heads=heads,
        contacts=rows,
        strikes="" if unsampled else strikes(run),
        unsampled=unsampled,
        balance=balance(run),
        figures=figures,
        anomalies=facts.anomalies(run),
        no_anomaly="those that are counted are of hard spheres"
        if run.soft
        else "no contact found opening, no pinched ball let go, no contact made smooth, no overlap beyond 1 nm",
        uncounted=f"{plain(run.program)} does not count them."
        if run.time > 0
        else "None counted yet: the run has not reached its first checkpoint.",
        precision=known,
        how=how(run, os.path.getsize(run.path)),
        everything=everything(run),
        deck=lines(deck),
        deck_file=name if name.endswith(".ini") else f"{name}.ini",
        deck_link=pages.data_link(deck),
        cite=parts.cite(run),
    )
