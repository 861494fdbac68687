"""Tables as CSV: the first line names the columns with their units, numbers have as many digits as it takes to read them
back to the last bit."""

import bisect
import csv
import io
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


class Sheet:
    """A CSV file that grows block by block; a block is {head: (rows,) numbers or texts}."""

    def __init__(self, file):
        self.file, self.writer, self.rows = file, None, 0

    def add(self, block):
        columns = [pa.array(values, from_pandas=True) for values in block.values()]  # NaN: empty
        batch = pa.record_batch(columns, names=list(block))
        if self.writer is None:
            csv.writer(head := io.StringIO(), lineterminator="\n").writerow(map(cell, block))
            self.file.write(head.getvalue().encode(errors="replace"))
            self.writer = CSVWriter(self.file, batch.schema, write_options=WriteOptions(include_header=False))
        self.writer.write_batch(batch)
        self.rows += len(batch)


def table(arguments, blocks, of=""):
    """Writes blocks into the file; says how much."""
    with whole(arguments.file) as draft:
        with open(draft, "wb") as file:
            out = Sheet(file)
            for block in blocks:
                out.add(block)
        total = os.path.getsize(draft)
    return f"{plural(out.rows, 'row')}{of}, {size(total)}"


def cells(names) -> np.ndarray:
    """Names from a file, for columns of texts."""
    return np.array([cell(name) for name in names], object)


def head(name, text):
    return name if text in ("", "1") else f"{name} [{spoken_unit(text)}]"


def vector(name, values, text):
    return {head(f"{name}{axis}", text): values[:, k] for k, axis in enumerate(XYZ)}


# ---- balls


def balls(arguments):
    with source.open_run(arguments) as run:
        chosen, times = source.many(run, arguments), source.stored(run)
        of = f" ({source.count(chosen, len(run.balls('id')))})"
        return table(arguments, _ball_blocks(run, chosen, times, arguments), of)


def _ball_blocks(run, chosen, times, arguments):
    names = cells(run.species_names())
    still = {
        "id": run.balls("id"),
        "species": names[run.balls("species")],
        "diameter [m]": run.balls("diameter"),
        "mass [kg]": run.balls("mass"),
    }
    count = len(still["id"])
    for index in source.steps(chosen, arguments):
        block = {"time [s]": np.full(count, times[index]), "frame": np.full(count, index)} | still
        for letter, what, text in (
            ("", "position", "m"),
            ("v", "velocity", "m s-1"),
            ("w", "angular_velocity", "rad s-1"),
        ):
            block |= vector(letter, run.frame(index, what), text)
        yield block


# ---- rows by time


def _between(run, path, arguments, slack=0.0):
    """Rows (first, last + 1) whose times, in order at the path, are within --from and --to."""
    low, high = source.window(arguments, slack)
    rows = range(run.length(path))
    return (
        bisect.bisect_left(rows, low, key=lambda k: run.read(path, k)),
        bisect.bisect_right(rows, high, key=lambda k: run.read(path, k)),
    )


def _parts(first, end, arguments):
    starts = source.steps(range(first, max(end, first + 1), BLOCK), arguments)
    return (slice(start, min(start + BLOCK, end)) for start in starts)


def series(arguments):
    with source.open_run(arguments) as run:
        names = run.series_names()
        path = f"observables/{names[0] if names else 'rotor_work'}/time"
        times = run.read(path, slice(0, 2))
        first, end = _between(run, path, arguments, source.SLACK * source.interval(times))

        def blocks():
            for part in _parts(first, end, arguments):
                block = {"time [s]": run.read(path, part)}
                for name in names:
                    block |= _series(run, name, part)
                yield block

        return table(arguments, blocks(), f" of {len(names)} series")


def _series(run, name, part):
    path = f"observables/{name}/value"
    values, text = run.read(path, part), run.attribute(path, "unit", "")
    if values.ndim == 1:
        return {head(name, text): values}
    marks = run.attribute(path, "thresholds", range(values.shape[1]))
    return {head(f"{name} from {mark:g} m/s", text): values[:, k] for k, mark in enumerate(marks)}


IMPACTS = (
    ("ball", ""),
    ("partner", ""),
    ("position", "m"),
    ("normal", ""),
    ("normal_speed", "m s-1"),
    ("tangential_speed", "m s-1"),
    ("dissipation", "J"),
)


def impacts(arguments):
    with source.open_run(arguments) as run:
        why = "single impacts are kept with output.impacts = all"
        run.read("impacts/time", slice(0, 0), why=why)
        first, end = _between(run, "impacts/time", arguments)
        kinds = cells(run.attribute("impacts", "kinds", run.kinds))

        def blocks():
            for part in _parts(first, end, arguments):
                yield _impacts(run, kinds, part)

        return table(arguments, blocks())


def _impacts(run, kinds, part):
    block = {"time [s]": run.read("impacts/time", part)}
    block["kind"] = kinds[run.read("impacts/kind", part)]
    for name, text in IMPACTS:
        values = run.read(f"impacts/{name}", part)
        letter = {"position": "", "normal": "n"}.get(name)
        block |= {_loss(run, name, text): values} if letter is None else vector(letter, values, text)
    return block


def _loss(run, name, text, path="impacts/dissipation"):
    """The head of a column; of losses it says so where only their normal part is known."""
    part = run.attribute(path, "part", "all") if name == "dissipation" else "all"
    return head(name if part == "all" else f"{name}, {part} part", text)


# ---- spectra


def spectra(arguments):
    with source.open_run(arguments) as run:
        run.need_statistics()
        rows = [
            (group, kind, speed)
            for group in ("impacts", "strikes")
            for kind in run.kinds
            for speed in ("normal_speed", "tangential_speed")
        ]
        return table(arguments, (_spectrum(run, *row) for row in rows))


def _spectrum(run, group, kind, speed):
    """One histogram, bin by bin; the first row is what is slower than its bins, the last what is faster."""
    path = f"statistics/{group}/{kind}/{speed}/histogram"
    found = run.histogram(kind, group, speed)
    lost = [run.attribute(f"{path}/dissipation", side, 0.0) for side in ("underflow", "overflow")]
    count = np.concatenate([[found.underflow], found.count, [found.overflow]]).astype("u8")
    bins = len(count)
    return {
        "group": np.full(bins, group, object),
        "kind": np.full(bins, cell(kind), object),
        "speed": np.full(bins, speed.removesuffix("_speed"), object),
        "from [m/s]": np.concatenate([[0.0], found.edges]),
        "to [m/s]": np.concatenate([found.edges, [np.inf]]),
        "count": count,
        "rate [1/s]": count / run.duration,
        _loss(run, "dissipation", "J", f"{path}/dissipation"): np.concatenate(
            [[lost[0]], found.dissipation, [lost[1]]]
        ),
    }
