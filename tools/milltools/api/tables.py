"""A run as tables of pandas. `table.attrs["units"]` says the unit of each column."""

from collections.abc import Iterator

import pandas as pd

from milltools.base.errors import UserError
from milltools.read import motions as words
from milltools.read import runfile
from milltools.read.histogram import ENERGIES
from milltools.read.runfile import Run
from milltools.read.schema import LOG

SUMMARY = {  # column: path below impacts/ROW
    "count": "count",
    "rate": "rate",
    "dissipated_power": "dissipated_power",
    "mean": "normal_speed/mean",
    "median": "normal_speed/median",
    "median_above_50mm_s": "normal_speed/median_above_50mm_s",
}
VECTORS = {"position": ("x", "y", "z"), "normal": ("normal_x", "normal_y", "normal_z")}


def summary(run: Run) -> pd.DataFrame:
    """How often, how hard and at what loss: one row a kind of contact, and "all"."""
    run.need_statistics()
    where, kinds = "statistics/impacts", (*run.kinds, "all")
    found = {name: [run.read(f"{where}/{row}/{path}")[()] for row in kinds] for name, path in SUMMARY.items()}
    found["floor_share"] = [run.statistic(f"floor_share/{row}")[()] for row in kinds]
    units = {name: run.attribute(f"{where}/all/{path}", "unit") for name, path in SUMMARY.items()}
    table = pd.DataFrame(found, index=pd.Index(kinds, name="kind"))
    table.attrs["units"] = units | {"floor_share": "1"}
    return table


def motions(run: Run) -> pd.DataFrame:
    """Power and torque of every motion, with their errors, and how it goes: one row a motion."""
    run.need_statistics()
    found = {"power": [], "power_error": [], "torque": [], "torque_error": []}
    for name in run.motions:
        known = run.has(f"statistics/motions/{name}/power")
        place = f"motions/{name}" if known else "rotor"  # files of before motions have the rotor's alone
        for what in ("power", "torque"):
            found[what].append(float(run.statistic(f"{place}/{what}")))
            found[f"{what}_error"].append(run.standard_error(f"{place}/{what}"))
    found["words"] = [words.words(run, name) for name in run.motions]
    table = pd.DataFrame(found, index=pd.Index(run.motions, name="motion"))
    units = ("W", "W", "N m", "N m", "")
    table.attrs["units"] = dict(zip(found, units, strict=True))
    return table


def estimates(run: Run) -> pd.DataFrame:
    """What the file knows with a standard error: one row a number."""
    run.need_statistics()
    found = {}
    for name, (group, _) in runfile.estimates(run.kinds).items():
        known = run.known(name)
        if known and (run.has_rotor or not name.startswith("rotor_")):
            found[name] = *known, run.attribute(f"statistics/precision/{group}/value", "unit")
    columns = ["value", "error", "degrees_of_freedom", "unit"]
    table = pd.DataFrame.from_dict(found, orient="index", columns=columns)
    return table.rename_axis("name")


def spectrum(run: Run, kind: str, group: str, speed: str, species=None) -> pd.DataFrame:
    """Impacts by speed or energy: one row a bin."""
    histogram = _histogram(run, kind, group, speed, species)
    found = {
        "low": histogram.edges[:-1],
        "high": histogram.edges[1:],
        "count": histogram.count,
        "dissipation": histogram.dissipation,
        "rate": histogram.count / run.duration,
        "power": histogram.dissipation / run.duration,
    }
    table = pd.DataFrame(found)
    edge = "J" if speed in ENERGIES else "m s-1"
    table.attrs["units"] = dict(zip(found, (edge, edge, "1", "J", "s-1", "W")))
    return table


def rate(run: Run, above: float, kind: str, group: str, speed: str, species=None) -> float:
    """Impacts a second at or above a speed or energy."""
    return _histogram(run, kind, group, speed, species).above(above) / run.duration


def _histogram(run, kind, group, speed, species):
    speeds = ("normal_speed", "tangential_speed", *ENERGIES)
    for given, known in (
        (kind, (*run.kinds, "all")),
        (group, ("impacts", "strikes")),
        (speed, speeds),
    ):
        if given not in known:
            raise UserError(f"unknown {given!r}: one of {', '.join(known)}")
    run.need_statistics()
    return run.histogram(kind, group, speed, species)


class Impacts:
    """The log of all impacts (`output.impacts = all`), read by slices: `impacts[:1000]` is a DataFrame of the first thousand,
    `impacts[:]` of all of them (some 100 bytes each), `chunks()` one after the other; len(impacts) is their number."""

    def __init__(self, run: Run):
        if not run.has("impacts/time"):
            raise UserError(f"{run.path}: its impacts were not logged: run it with output.impacts = all")
        self._run = run
        self._kinds = [str(kind) for kind in run.attribute("impacts/kind", "kinds")]

    def __len__(self) -> int:
        return self._run.layout("impacts/time")[0][0]

    def __repr__(self) -> str:
        return f"<{len(self)} impacts of {self._run.path}: [first:last] reads them as a DataFrame>"

    def __getitem__(self, rows: slice) -> pd.DataFrame:
        """Rows of a slice with step 1, in the order of time; the index is the number of the impact."""
        if not isinstance(rows, slice) or rows.step not in (None, 1):
            raise TypeError("impacts are read by slices without a step, such as impacts[:1000]")
        first, last, _ = rows.indices(len(self))
        part = slice(first, max(first, last))
        found, units = {}, {}
        for name in LOG:
            values = self._run.read(f"impacts/{name}", part)
            unit = self._run.attribute(f"impacts/{name}", "unit")
            if name == "kind":
                values = pd.Categorical.from_codes(values, self._kinds)
            columns = VECTORS.get(name, (name,))
            for k, column in enumerate(columns):
                found[column] = values[:, k] if name in VECTORS else values
                units[column] = unit
        table = pd.DataFrame(found, index=pd.RangeIndex(part.start, part.stop, name="impact"))
        table.attrs["units"] = units
        return table

    def chunks(self, rows: int = 1_000_000) -> Iterator[pd.DataFrame]:
        """All impacts, `rows` at a time."""
        for first in range(0, len(self), rows):
            yield self[first : first + rows]
