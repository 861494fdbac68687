"""The log of all impacts as tables of pandas, read slice by slice."""

from collections.abc import Iterator

import pandas as pd

from milltools.base.errors import InputError
from milltools.read.runfile import Run

COLUMNS = (  # columns of /impacts
    "time", "kind", "ball", "partner", "position", "normal", "normal_speed", "tangential_speed", "dissipation",
)  # fmt: skip
VECTORS = {"position": ("x", "y", "z"), "normal": ("normal_x", "normal_y", "normal_z")}


class Impacts:
    """The log of all impacts (`output.impacts = all`), read in slices: `impacts[:1000]` is a DataFrame of the first
    thousand impacts, `impacts[:]` of all (about 100 bytes each); `chunks()` gives one slice after the other;
    len(impacts) is their number."""

    def __init__(self, run: Run):
        if not run.has("impacts/time"):
            raise InputError(f"{run.path}: its impacts were not logged: run it with output.impacts = all")
        self._run = run
        self._kinds = run.index_names("impacts/kind")

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
        for name in COLUMNS:
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
