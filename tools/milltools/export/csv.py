"""Tables as CSV: the first line names the columns with their units; numbers have enough digits to read back the
same double."""

import bisect
import csv
import io
import itertools
import os

import numpy as np

from milltools.base.extras import needs
from milltools.base.files import whole
from milltools.base.text import cell, plural, size, spoken_unit
from milltools.export import source

needs("export", "pyarrow")
import pyarrow as pa
from pyarrow.csv import CSVWriter, WriteOptions

BLOCK = 65536  # rows held at once
XYZ = "xyz"


def fill(file, blocks) -> int:
    """Writes blocks, {head: (rows,) numbers or texts}, as one table and returns the number of rows."""
    writer, rows = None, 0
    for block in blocks:
        columns = [pa.array(values, from_pandas=True) for values in block.values()]  # NaN: empty
        batch = pa.record_batch(columns, names=list(block))
        if writer is None:
            csv.writer(head := io.StringIO(), lineterminator="\n").writerow(map(cell, block))
            file.write(head.getvalue().encode(errors="replace"))
            writer = CSVWriter(file, batch.schema, write_options=WriteOptions(include_header=False))
        writer.write_batch(batch)
        rows += len(batch)
    return rows


def table(arguments, blocks, of=""):
    """Writes blocks into the file; returns the number of rows in words."""
    with whole(arguments.file) as draft:
        with open(draft, "wb") as file:
            rows = fill(file, blocks)
        total = os.path.getsize(draft)
    return f"{plural(rows, 'row')}{of}, {size(total)}"


def cells(names) -> np.ndarray:
    """Names from the file, for columns of text."""
    return np.array([cell(name) for name in names], object)


def head(name, text):
    return name if text in ("", "1") else f"{name} [{spoken_unit(text)}]"


def vector(name, values, text):
    return {head(f"{name}{axis}", text): values[:, k] for k, axis in enumerate(XYZ)}


# ---- balls


def balls(arguments):
    with source.open_run(arguments) as run:
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

        return table(arguments, blocks(), f" ({source.count(chosen, count)})")


# ---- rows by time


def _blocks(run, path, columns, arguments, slack=0.0):
    """Blocks of the rows whose times are within --from and --to: the times and columns(rows). The dataset at the path
    contains the times in ascending order."""
    low, high = source.window(arguments, slack)
    rows = range(run.length(path))
    first = bisect.bisect_left(rows, low, key=lambda k: run.read(path, k))
    end = bisect.bisect_right(rows, high, key=lambda k: run.read(path, k))
    for start in source.steps(range(first, max(end, first + 1), BLOCK), arguments):
        part = slice(start, min(start + BLOCK, end))
        yield {"time [s]": run.read(path, part)} | columns(part)


def series(arguments):
    with source.open_run(arguments) as run:
        names = run.series_names()
        time = f"observables/{names[0] if names else 'rotor_work'}/time"

        def columns(part):
            found = {}
            for name in names:
                path = f"observables/{name}/value"
                values, text = run.read(path, part), run.attribute(path, "unit", "")
                if values.ndim == 1:
                    found[head(name, text)] = values
                    continue
                marks = run.attribute(path, "thresholds", range(values.shape[1]))
                found |= {head(f"{name} from {mark:g} m/s", text): values[:, k] for k, mark in enumerate(marks)}
            return found

        slack = source.SLACK * source.interval(run.read(time, slice(0, 2)))
        return table(arguments, _blocks(run, time, columns, arguments, slack), f" of {len(names)} series")


IMPACTS = {  # column: unit
    "ball": "", "partner": "", "position": "m", "normal": "", "normal_speed": "m s-1", "tangential_speed": "m s-1",
    "dissipation": "J",
}  # fmt: skip


def impacts(arguments):
    with source.open_run(arguments) as run:
        run.read("impacts/time", slice(0, 0), why="single impacts are kept with output.impacts = all")
        kinds = cells(run.attribute("impacts", "kinds", run.kinds))

        def columns(part):
            found = {"kind": kinds[run.read("impacts/kind", part)]}
            for name, text in IMPACTS.items():
                values = run.read(f"impacts/{name}", part)
                letter = {"position": "", "normal": "n"}.get(name)
                found |= {_loss(run, name, text): values} if letter is None else vector(letter, values, text)
            return found

        return table(arguments, _blocks(run, "impacts/time", columns, arguments))


def _loss(run, name, text, path="impacts/dissipation"):
    """The head of a column; for losses it says if only the normal part is known."""
    part = run.attribute(path, "part", "all") if name == "dissipation" else "all"
    return head(name if part == "all" else f"{name}, {part} part", text)


# ---- spectra


def spectra(arguments):
    """One histogram after the other, bin by bin. The first row of each histogram counts impacts slower than all bins,
    the last row impacts faster than all bins."""
    with source.open_run(arguments) as run:
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

        rows = itertools.product(("impacts", "strikes"), run.kinds, ("normal_speed", "tangential_speed"))
        return table(arguments, itertools.starmap(block, rows))
