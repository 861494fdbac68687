"""What a study's table says, ready to be shown: its varied keys and objectives with names and units, its rows as a frame, its
designs with their means and errors. Everything stays in SI here; `Scale` is for showing only."""

import dataclasses
import functools
import math
import re

import numpy as np
import pandas as pd

from milltools.study.show import stats as show_stats

# What is varied most, as a paper would call it; other keys are their own name
WORDS = {
    "drum.buckles": "number of buckles n",
    "drum.buckle_height": "buckle height h",
    "balls.count": "number of balls",
    "balls.diameter": "ball diameter",
    "rotor.speed": "rotor speed",
    "contact.restitution": "restitution",
    "contact.friction": "friction",
    "impacts/all/normal_speed/median_above_50mm_s": "median normal impact speed above 50 mm/s",
    "impacts/all/normal_speed/median": "median normal impact speed",
    "impacts/all/rate": "rate of impacts",
    "rotor/power": "rotor power",
    "drive/power": "drive power",
    "rotor/torque": "rotor torque",
}
SHORT = {"drum.buckles": "n", "drum.buckle_height": "h"}
RPM = math.tau / 60


@dataclasses.dataclass(frozen=True)
class Scale:
    """How SI values are shown: value / size, in `unit`."""

    size: float = 1.0
    unit: str = ""

    @property
    def bracket(self) -> str:
        return f" [{self.unit or '1'}]"

    @property
    def suffix(self) -> str:
        return f" {self.unit}" if self.unit else ""


def scale_of(unit: str, values, turning: bool = True) -> Scale:
    """The scale in which values [unit] are read best: mm, ms where they are small; rpm if `turning`."""
    finite = np.abs(np.asarray(values, float))
    most = float(np.max(finite[np.isfinite(finite)], initial=0.0))
    if unit == "rad/s" and turning:
        return Scale(RPM, "rpm")
    if unit == "rad" and turning:
        return Scale(math.pi / 180, "deg")
    if unit in ("m", "s") and 0 < most < 0.5:
        return Scale(1e-3, f"m{unit}")
    return Scale(1.0, "" if unit == "1" else unit)


def spoken(unit: str) -> str:
    """A unit as it is written on axes: "m s-1" of an output file is "m/s"."""
    above, below = [], []
    for part in (unit or "").split():
        name, sign, power = re.fullmatch(r"(.*?)(-?)(\d*)", part).groups()
        raised = f"{name}^{power}" if power not in ("", "1") else name
        (below if sign and name else above).append(raised if name else part)
    if not below:
        return " ".join(above)
    return f"{' '.join(above) or '1'}/{'/'.join(below)}"


def words_of(name: str) -> str:
    return WORDS.get(name) or name.replace(".", " ").replace("/", " ").replace("_", " ")


@dataclasses.dataclass(frozen=True)
class Axis:
    """A varied key. `values` are those of a grid (SI, in order), None where it is scattered."""

    key: str
    unit: str
    meaning: str = ""
    whole: bool = False
    log: bool = False
    choices: tuple | None = None
    values: tuple | None = None
    span: tuple = (0.0, 0.0)

    @property
    def numeric(self) -> bool:
        return not self.choices

    @property
    def words(self) -> str:
        return words_of(self.key)

    @property
    def short(self) -> str:
        return SHORT.get(self.key, self.words)

    @functools.cached_property
    def scale(self) -> Scale:
        return scale_of(self.unit, self.span) if self.numeric else Scale()

    def tell(self, value, unit: bool = True) -> str:
        """A value of it as text, in its scale, for people."""
        if not self.numeric:
            return str(value)
        return f"{float(value) / self.scale.size:.5g}" + (self.scale.suffix if unit else "")


@dataclasses.dataclass(frozen=True)
class Objective:
    """A scalar that is maximised (sign 1), minimised (-1) or only recorded (goal "")."""

    path: str
    goal: str
    unit: str
    description: str = ""

    @property
    def sign(self) -> int:
        return -1 if self.goal == "minimise" else 1

    @property
    def words(self) -> str:
        return words_of(self.path)

    @property
    def best(self) -> str:
        return "lowest" if self.sign < 0 else "highest"


class View:
    """A study as it is shown.

    name       what it is called
    meta       the table's metadata
    rows       DataFrame of all runs (columns as in the table)
    axes       varied keys
    objectives what is maximised or minimised
    designs    DataFrame: one line per design, columns of the axes, "state" (done | capped | failed), "runs"
    """

    def __init__(self, name: str, meta: dict, rows: pd.DataFrame):
        self.name, self.meta = name, meta
        self.rows = rows.drop_duplicates("id", keep="last").reset_index(drop=True)
        self.axes = [self._axis(entry) for entry in meta["vary"]]
        self.objectives = [
            Objective(o["path"], o["goal"], spoken(o.get("unit")), o.get("description") or "")
            for o in meta["objectives"]
        ]
        self._group()
        self._estimates = {}

    @classmethod
    def of(cls, table) -> "View":
        """Of a table.Table."""
        return cls(table.path.stem, table.meta, table.frame())

    def _axis(self, entry) -> Axis:
        numeric = entry.get("kind", "number") in ("number", "whole")
        values, found = entry.get("values"), self.rows[entry["key"]]
        words, span = None, (0.0, 0.0)
        if numeric:
            bounds = [b for b in (entry.get("low"), entry.get("high")) if b is not None]
            bounds += [*map(float, values or ()), *found.dropna().astype(float)]
            span = (min(bounds, default=0.0), max(bounds, default=0.0))
        else:
            words = tuple(dict.fromkeys([*map(str, values or ()), *map(str, found.unique())]))
        return Axis(
            entry["key"],
            spoken(entry.get("unit")),
            entry.get("meaning") or "",
            entry.get("kind") == "whole",
            bool(entry.get("log")),
            words,
            tuple(sorted(values) if numeric else values) if values else None,
            span,
        )

    def _group(self):
        keys = [axis.key for axis in self.axes]
        group = self.rows.groupby(keys, sort=False, dropna=False)
        self.design_of = group.ngroup().to_numpy()
        self.designs = self.rows.loc[~pd.Series(self.design_of).duplicated(), keys].reset_index(drop=True)
        count = len(self.designs)
        status = self.rows["status"].to_numpy()
        has = {what: np.bincount(self.design_of[status == what], minlength=count) > 0 for what in ("done", "capped")}
        self.designs["state"] = np.where(has["done"], "done", np.where(has["capped"], "capped", "failed"))
        self.designs["runs"] = np.bincount(self.design_of, minlength=count)

    def estimate(self, path: str) -> "show_stats.Estimate":
        """Means of a scalar with their standard errors, one per design; of capped runs where no other is there."""
        if path not in self._estimates:
            state = self.designs["state"].to_numpy()[self.design_of]
            usable = (self.rows["status"] == state).to_numpy()
            value = pd.to_numeric(self.rows[path]).to_numpy(float)
            error = self.rows.get(f"{path}:error")
            error = np.full(len(value), np.nan) if error is None else error.to_numpy(float)
            self._estimates[path] = show_stats.estimate(
                self.design_of, np.where(usable, value, np.nan), error, len(self.designs)
            )
        return self._estimates[path]

    def axis(self, key: str) -> Axis:
        return next(a for a in self.axes if a.key == key)

    def is_grid(self) -> bool:
        """Whether every combination of values is (to be) there, so that neighbours are neighbours."""
        if not all(axis.values for axis in self.axes):
            return False
        cells = math.prod(len(axis.values) for axis in self.axes)
        return bool(self.meta.get("planned")) and self.meta["planned"] >= cells

    def tell(self, design: int, unit: bool = True) -> str:
        """A design in words: "n = 6, h = 6.5 mm"."""
        line = self.designs.iloc[design]
        return ", ".join(f"{a.short} = {a.tell(line[a.key], unit)}" for a in self.axes)
