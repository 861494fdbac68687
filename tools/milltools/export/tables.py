"""The tables of a run, block by block, for spreadsheets and data frames: csv.py and xlsx.py write them."""

import bisect
import contextlib
import dataclasses
import importlib
import itertools
import os
import pathlib
from collections.abc import Iterator

import numpy as np

from milltools.base.errors import UserError
from milltools.base.files import whole
from milltools.base.text import cell, plural, size, spoken_unit
from milltools.dose import dose, wear
from milltools.export import source
from milltools.read.kinds import label
from milltools.read.runfile import HARD_PER_JOULE, HARD_RATE, SUMMARY
from milltools.read.wear import why_not

BLOCK = 65536  # rows held at once
XYZ = "xyz"
SHEETS = ("summary", "dose", "wear", "series", "spectra")  # of a workbook with everything that is not long


@dataclasses.dataclass(frozen=True)
class Table:
    """The number of `rows`, the `blocks` {head: (rows,) numbers or texts}, at least one; what to say about them; and
    the options that choose fewer rows."""

    rows: int
    blocks: Iterator[dict]
    words: str = ""
    fewer: str = "--from, --to"


def write(arguments, what):
    """Writes a table, or all SHEETS that the run has data for."""
    form = importlib.import_module(f"milltools.export{pathlib.Path(arguments.file).suffix.lower()}")
    with source.open_run(arguments) as run:
        lacks = {"wear"} if why_not(run) else set()
        lacks |= set() if run.has("statistics/energies/edges") else {"dose"}
        names = [name for name in SHEETS if name not in lacks] if what == "all" else [what]
        tables = {name: CONTENTS[name](run, arguments) for name in names}
        for name, table in tables.items():
            if table.rows > form.ROWS:
                raise UserError(
                    f"{arguments.file}: a sheet of Excel has room for {form.ROWS} rows, and {name} has {table.rows}: "
                    f"write .csv, or choose fewer rows with {table.fewer}"
                )
        with whole(arguments.file) as draft:
            form.write(draft, tables)
            total = os.path.getsize(draft)
    rows = {name: table.rows for name, table in tables.items()}
    said = [plural(table.rows, "row") + table.words for table in tables.values()]
    if what == "all":
        said = [f"{name} ({words})" for name, words in zip(names, said)]
    return f"{', '.join(said)}, {size(total)}", {"rows": rows.get(what, rows), "bytes": total}


def cells(names) -> np.ndarray:
    """Names from the file, for columns of text."""
    return np.array([cell(name) for name in names], object)


def head(name, text):
    """The name of a column as people write it, with its unit."""
    name = name.replace("_", " ")
    return name if text in ("", "1") else f"{name} [{spoken_unit(text)}]"


def vector(name, values, text):
    return {head(f"{name}{axis}", text): values[:, k] for k, axis in enumerate(XYZ)}


# ---- balls


def balls(run, arguments) -> Table:
    chosen, times = source.many(run, arguments), source.stored(run)
    still = {
        "id": run.balls("id"),
        "species": cells(run.species_names())[run.balls("species")],
        "diameter [m]": run.balls("diameter"),
        "mass [kg]": run.balls("mass"),
    }
    count = len(still["id"])

    def blocks():
        for index in source.steps(chosen, arguments):
            block = {"time [s]": np.full(count, times[index]), "frame": np.full(count, index)} | still
            block |= vector("", run.frame(index, "position"), "m")
            block |= vector("v", run.frame(index, "velocity"), "m s-1")
            yield block | vector("w", run.frame(index, "angular_velocity"), "rad s-1")

    words = f" ({source.count(chosen, count)})"
    return Table(count * len(chosen), blocks(), words, "--from, --to, --every, --frame")


# ---- rows by time


def _timed(run, path, columns, arguments, slack=0.0, words="") -> Table:
    """The rows whose times are within --from and --to: the times and columns(rows). The dataset at the path contains
    the times in ascending order."""
    low, high = source.window(arguments, slack)
    rows = range(run.length(path))
    first = bisect.bisect_left(rows, low, key=lambda k: run.read(path, k))
    end = bisect.bisect_right(rows, high, key=lambda k: run.read(path, k))

    def blocks():
        for start in source.steps(range(first, max(end, first + 1), BLOCK), arguments):
            part = slice(start, min(start + BLOCK, end))
            yield {"time [s]": run.read(path, part)} | columns(part)

    return Table(max(end - first, 0), blocks(), words)


# how people name the series of each kind of contact
SERIES = {
    "collisions": "contacts",
    "fast_collisions": "contacts",
    "dissipation": "dissipated energy",
    "dissipation_normal": "dissipated energy, normal part",
    "motion_work": "work of motion",
}


def _power(run) -> dict:
    """The mean power of the drive since the row before, from its work; empty where no series has the work."""
    drive = {"rotor": "rotor power", "drive": "drive power"}.get(run.driven)
    if not drive or not run.has_series("rotor_work" if run.driven == "rotor" else f"motion_work/{run.motions[0]}"):
        return {}
    time, work = run.drive_work()
    with np.errstate(divide="ignore", invalid="ignore"):
        return {head(drive, "W"): np.concatenate([[np.nan], np.diff(work) / np.diff(time)])[: len(time)]}


def series(run, arguments) -> Table:
    names, power = run.series_names(), _power(run)
    time = f"observables/{names[0] if names else 'kinetic_energy'}/time"

    def columns(part):
        found = {name: values[part] for name, values in power.items()}
        for name in names:
            path = f"observables/{name}/value"
            values, text = run.read(path, part), run.attribute(path, "unit", "")
            words, _, kind = name.partition("/")
            words, of = SERIES.get(words, words), f", {label(kind)}" if kind else ""
            if values.ndim == 1:
                found[head(words + of, text)] = values
                continue
            marks = run.attribute(path, "thresholds", range(values.shape[1]))
            found |= {head(f"{words} from {mark:g} m/s{of}", text): values[:, k] for k, mark in enumerate(marks)}
        return found

    slack = source.SLACK * source.interval(run.read(time, slice(0, 2)))
    return _timed(run, time, columns, arguments, slack, f" of {len(names)} series")


IMPACTS = {  # column: unit
    "ball": "", "partner": "", "position": "m", "normal": "", "normal_speed": "m s-1", "tangential_speed": "m s-1",
    "dissipation": "J",
}  # fmt: skip


def impacts(run, arguments) -> Table:
    run.read("impacts/time", slice(0, 0), why="single impacts are kept with output.impacts = all")
    kinds = cells(run.index_names("impacts/kind"))

    def columns(part):
        found = {"kind": kinds[run.read("impacts/kind", part)]}
        for name, text in IMPACTS.items():
            values = run.read(f"impacts/{name}", part)
            letter = {"position": "", "normal": "n"}.get(name)
            found |= {_loss(run, name, text): values} if letter is None else vector(letter, values, text)
        return found

    return _timed(run, "impacts/time", columns, arguments)


def _loss(run, name, text, path="impacts/dissipation"):
    """The head of a column; for losses it says if only the normal part is known."""
    if name != "dissipation":
        return head(name, text)
    part = run.attribute(path, "part", "all")
    return head("dissipated energy" + ("" if part == "all" else f", {part} part"), text)


# ---- the sampled window


HEADS = {  # columns of runfile.SUMMARY
    "count": "impacts",
    "rate": "impacts",
    "mean": "mean impact speed",
    "median": "median impact speed",
    "median_above_floor": "median impact speed above the floor",
    "floor_share": "share at the rebound floor",
}


def summary(run, arguments) -> Table:
    """A row for each kind of contact, then one for all impacts, which also has the numbers of the whole mill."""
    run.need_statistics()
    kinds = (*run.kinds, "all")
    units = {name: run.attribute(f"statistics/{path.format('all')}", "unit", "1") for name, path in SUMMARY.items()}
    block = {"kind": cells(kinds)}
    block |= {head(HEADS.get(name, name), units[name]): values for name, values in run.summary().items()}
    mill = {head("sampled time", "s"): run.duration}
    for quantity, text in (("power", "W"), ("torque", "N m")):
        path = f"{run.drive}/{quantity}"
        with contextlib.suppress(UserError):  # no torque of a drive
            mill[head(quantity, text)] = float(run.statistic(path))
            mill[head(f"standard error of {quantity}", text)] = run.standard_error(path)
    mill[head("least energy of hard impacts", "J")] = run.hard.energy
    for path, unit in ((HARD_RATE, "1/s"), (HARD_PER_JOULE, "1/J")):
        if known := run.known(path):
            hard = head("hard impacts", unit)
            mill |= {hard: known[0], f"standard error of {hard}": known[1]}
    block |= {name: [None] * len(run.kinds) + [value] for name, value in mill.items()}
    return Table(len(kinds), iter([block]))


def dosed(run, arguments) -> Table:
    """A row for each result of `mill dose`."""
    found = dose.rows(run, arguments.set if arguments.what == "dose" else ())
    block = {"result": cells([row.name for row in found])}
    block |= {"value": [row.value for row in found], "standard error": [row.error for row in found]}
    block |= {"unit": cells([row.unit for row in found]), "explanation": cells([row.words for row in found])}
    return Table(len(found), iter([block]))


def worn(run, arguments) -> Table:
    """A row for each face of each part, as `mill wear --faces`."""
    found = wear.faces(run, arguments.set if arguments.what == "wear" else ())
    units = {"area": "m2", "rate": "1/s", "erosion": "kg/s", "peak": "W/m2"} | dict.fromkeys(
        ("depth", "deepest"), "m/s"
    )
    words = {"rate": "impacts", "normal": "power lost along the normal", "sliding": "power lost by sliding"}
    words["peak"] = "power lost by sliding at the worst spot"
    block = {}
    for name in (field.name for field in dataclasses.fields(wear.Face)):
        named, values = name in ("part", "face"), [getattr(face, name) for face in found]
        heading = head(words.get(name, name), "" if named else units.get(name, "W"))
        block[heading] = cells(values) if named else values
    return Table(len(found), iter([block]))


def spectra(run, arguments) -> Table:
    """One histogram after the other, bin by bin. The first row of each histogram counts impacts slower than all bins,
    the last row impacts faster than all bins."""
    run.need_statistics()

    def block(group, kind, speed):
        path = f"statistics/{group}/{kind}/{speed}/histogram/dissipation"
        found = run.histogram(kind, group, speed)
        lost = [run.attribute(path, side, 0.0) for side in ("underflow", "overflow")]
        count = np.concatenate([[found.underflow], found.count, [found.overflow]]).astype("u8")
        words = {"group": group, "kind": cell(kind), "speed": speed.removesuffix("_speed")}
        return {name: np.full(len(count), word, object) for name, word in words.items()} | {
            "from [m/s]": np.concatenate([[0.0], found.edges]),
            "to [m/s]": np.concatenate([found.edges, [np.inf]]),
            "count": count,
            "rate [1/s]": count / run.duration,
            _loss(run, "dissipation", "J", path): np.concatenate([lost[:1], found.dissipation, lost[1:]]),
        }

    groups = ("impacts", "strikes"), run.kinds, ("normal_speed", "tangential_speed")
    blocks = list(itertools.starmap(block, itertools.product(*groups)))
    return Table(sum(len(one["count"]) for one in blocks), iter(blocks))


CONTENTS = {
    "balls": balls,
    "series": series,
    "impacts": impacts,
    "summary": summary,
    "spectra": spectra,
    "dose": dosed,
    "wear": worn,
}
