"""What a study's table says, ready to be shown: its varied keys and objectives with names and units, its rows as a frame, its
designs with their means and errors. Everything stays in SI here; `Scale` is for showing only."""

import dataclasses
import functools
import math
import pathlib
import re

import numpy as np
import pandas as pd

from milltools.base.errors import MissingFileError, UserError
from milltools.base.text import plain, spoken_unit
from milltools.read import deck_text, values
from milltools.study.plan.study_deck import Objective
from milltools.study.plan.table import Table
from milltools.study.show import stats

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
TURNING = {"rad/s": ("rpm", math.tau / 60), "rad": ("deg", math.pi / 180)}


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

    def told(self, value: float, half: float) -> tuple[str, str]:
        """A value and its half width, both to the second digit of the latter; five digits and nothing without one."""
        value, half = value / self.size, half / self.size
        if not math.isfinite(value):
            return "", ""
        if not math.isfinite(half) or half <= 0:
            return f"{value:.5g}", ""
        digits = 1 - math.floor(math.log10(half))
        if digits > 8 or abs(value) >= 1e7:
            return f"{value:.5g}", f"{half:.2g}"
        return f"{value:.{max(digits, 0)}f}", f"{half:.{max(digits, 0)}f}"

    def pair(self, value: float, half: float) -> str:
        """ "1.098 +- 0.013 m/s" """
        value, half = self.told(value, half)
        return f"{value}{' +- ' + half if half else ''}{self.suffix}"


def scale_of(unit: str, span) -> Scale:
    """The scale for values [unit] up to those of `span`: SI, or mm and ms where they are small."""
    if unit in ("m", "s") and 0 < max(map(abs, span)) < 0.5:
        return Scale(1e-3, f"m{unit}")
    return Scale(unit=unit)


def deck_scales(meta) -> dict[str, Scale]:
    """The scale of each key whose line in [vary] of the study deck has a unit: "600..1200 rpm step 100 rpm"."""
    try:
        lines = {e.key: e.value for e in deck_text.entries(meta.get("study") or "", "") if e.section == "vary"}
    except UserError:
        return {}
    found = {}
    for entry in meta["vary"]:
        text = re.sub(r"(\s+(log|in\s+\d+))+$", "", lines.get(entry["key"], ""))
        unit = re.match(r".*\d\.?\s*([^\W\d][^,]*)$", text)
        if unit and entry.get("kind") == "number":
            found[entry["key"]] = unit.group(1).strip()
    try:
        told = values.tell(f"{key}=1 {unit}" for key, unit in found.items())
    except UserError:  # no engine, or a unit that this one does not know
        return {}
    return {one.key: Scale(one.value, plain(found[one.key])) for one in told}


def words_of(name: str) -> str:
    return WORDS.get(name) or re.sub("[./_]", " ", name)


@dataclasses.dataclass(frozen=True)
class Axis:
    """A varied key. `values` are those of a grid (SI, in order), None where it is scattered; `said`: the scale of the
    study deck's own unit, None where it has none."""

    key: str
    unit: str
    whole: bool = False
    log: bool = False
    choices: tuple | None = None
    values: tuple | None = None
    span: tuple = (0.0, 0.0)
    said: Scale | None = None

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
    def drawn(self) -> Scale:
        """Of the axes of pictures: as the study deck has it, else SI and its multiples."""
        return self.said or scale_of(self.unit, self.span)

    @functools.cached_property
    def scale(self) -> Scale:
        """Of words and tables: as the study deck has it, else angles in degrees and speeds in rpm."""
        if self.said or self.unit not in TURNING:
            return self.drawn
        unit, size = TURNING[self.unit]
        return Scale(size, unit)

    @property
    def heading(self) -> str:
        return self.words + (self.scale.bracket if self.numeric else "")

    def tell(self, value, unit: bool = True) -> str:
        """A value of it as text, in its scale, for people."""
        if not self.numeric:
            return str(value)
        return f"{float(value) / self.scale.size:.5g}" + (self.scale.suffix if unit else "")

    def reach(self, low, high, words=()) -> str:
        """From one value to another, or the words: "5..8 mm", "circle or wavy"."""
        if not self.numeric:
            return " or ".join(map(str, words))
        ends = [self.tell(low, unit=False), self.tell(high)]
        return ends[1] if self.tell(low) == ends[1] else "..".join(ends)


class Aim(Objective):
    """An objective with its name and how its values are shown."""

    @property
    def words(self) -> str:
        return words_of(self.path)

    @property
    def scale(self) -> Scale:
        return Scale(unit=self.unit)


class StudyView:
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
        said = deck_scales(meta)
        self.axes = [self._axis(entry, said.get(entry["key"])) for entry in meta["vary"]]
        self.objectives = [Aim(o["path"], o["goal"], spoken_unit(o.get("unit") or "")) for o in meta["objectives"]]
        self._group()
        self._estimates = {}

    @classmethod
    def of(cls, table) -> "StudyView":
        """Of a table.Table."""
        return cls(table.path.stem, table.meta, table.frame())

    def _axis(self, entry, said) -> Axis:
        numeric = entry.get("kind", "number") in ("number", "whole")
        values, found = entry.get("values"), self.rows[entry["key"]]
        words, span = None, (0.0, 0.0)
        if numeric:
            bounds = [b for b in (entry.get("low"), entry.get("high")) if b is not None]
            bounds += [*map(float, values or ()), *found.dropna().astype(float)]
            span = (min(bounds, default=0.0), max(bounds, default=0.0))
        else:
            words = tuple(dict.fromkeys([*map(str, values or ()), *map(str, found.unique())]))
        values = tuple(sorted(values) if numeric else values) if values else None
        whole, unit = entry.get("kind") == "whole", spoken_unit(entry.get("unit") or "")
        return Axis(entry["key"], unit, whole, bool(entry.get("log")), words, values, span, said)

    def _group(self):
        keys = [axis.key for axis in self.axes]
        self.design_of = self.rows.groupby(keys, sort=False, dropna=False).ngroup().to_numpy()
        self.designs = self.rows.loc[~pd.Series(self.design_of).duplicated(), keys].reset_index(drop=True)
        count, status = len(self.designs), self.rows["status"].to_numpy()
        has = {what: np.bincount(self.design_of[status == what], minlength=count) > 0 for what in ("done", "capped")}
        self.designs["state"] = np.where(has["done"], "done", np.where(has["capped"], "capped", "failed"))
        self.designs["runs"] = np.bincount(self.design_of, minlength=count)

    def estimate(self, path: str) -> stats.Means:
        """Means of a scalar with their standard errors, one per design; of capped runs where no other is there."""
        if path not in self._estimates:
            state = self.designs["state"].to_numpy()[self.design_of]
            value = pd.to_numeric(self.rows[path]).to_numpy(float)
            value = np.where((self.rows["status"] == state).to_numpy(), value, np.nan)
            error = self.rows.get(f"{path}:error")
            error = np.full(len(value), np.nan) if error is None else error.to_numpy(float)
            self._estimates[path] = stats.estimate(self.design_of, value, error, len(self.designs))
        return self._estimates[path]

    @property
    def usable(self) -> np.ndarray:
        """Designs of which a run ended as asked for: a capped one may not have settled."""
        return (self.designs["state"] == "done").to_numpy()

    def axis(self, key: str) -> Axis:
        return next(a for a in self.axes if a.key == key)

    def is_grid(self) -> bool:
        """Whether every combination of values is (to be) there, so that neighbours are neighbours."""
        if not all(axis.values for axis in self.axes):
            return False
        return (self.meta.get("planned") or 0) >= math.prod(len(axis.values) for axis in self.axes)

    def tell(self, design: int) -> str:
        """A design in words: "n = 6, h = 6.5 mm"."""
        line = self.designs.iloc[design]
        return ", ".join(f"{a.short} = {a.tell(line[a.key])}" for a in self.axes)


# ---- the table that a name means


def table_of(name: str) -> pathlib.Path:
    """The table itself, that of a journal, or that beside a study deck or in the current folder."""
    path = pathlib.Path(name)
    if path.name.endswith(".parquet.journal"):
        return path.with_name(path.name.removesuffix(".journal"))
    if path.suffix == ".parquet" or not path.suffix:
        return path
    folders = path.parent, pathlib.Path(".")
    found = [folder / f"{path.stem}{end}.parquet" for end in ("", "-optimize") for folder in folders]
    for candidate in found:
        if candidate.exists():
            return candidate
    if path.exists():
        raise UserError(f"{name}: no table of it yet: neither {' nor '.join(map(str, dict.fromkeys(found)))}")
    raise MissingFileError(f"{name}: no such file")


def opened(name: str) -> tuple[Table, StudyView]:
    """A study by the name of its table, journal or deck; one without rows yet is a UserError."""
    table = Table.open(table_of(name))
    if not len(table):
        raise UserError(f"{table.path}: no run has ended yet", status=1)
    return table, StudyView.of(table)
