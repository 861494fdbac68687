"""The table of a study, prepared for showing: varied keys and objectives with names and units, rows as a frame,
designs with means and errors. All values here are in SI; `Scale` is for showing only.

A run gives the standard error s of its value (block averages); replicates give their scatter. Both are used. The mean
of k runs has the error sqrt(sum s^2)/k; a run without s has the root mean square of the others of its design. If
replicates scatter more than their errors allow, the errors of all designs are enlarged by one factor (the scale factor
of the Particle Data Group, Review of Particle Physics, section 5.2.2: sqrt(chi^2/dof) if above 1), and Student's t with
these degrees of freedom is used. So the interval is never narrower than the errors of the runs imply. If no run of a
design has s, the scatter of the replicates is pooled over all such designs, relative to their means (the pure error of
Box, Hunter & Hunter, Statistics for Experimenters, 2005, section 5.6), because two or three replicates of one design
often agree by chance. The degrees of freedom of Student's t are then the number of runs minus the number of designs.
The interval is at least that of runs with the median relative s of the study.
"""

import contextlib
import dataclasses
import functools
import math
import pathlib
import re
import tempfile
from fnmatch import fnmatchcase

import numpy as np
import pandas as pd
from scipy import stats

from milltools.base.errors import MissingFileError, UserError
from milltools.base.text import plain, spoken_unit
from milltools.read import deck_text, expression, values
from milltools.read.deck import Deck
from milltools.read.kinds import label
from milltools.read.results import Results
from milltools.study.plan import formulas
from milltools.study.plan.formulas import Formulas
from milltools.study.plan.job import FRICTIONLESS, UNSETTLED
from milltools.study.plan.ranges import Range, unit_written
from milltools.study.plan.study_deck import Objective
from milltools.study.plan.table import Table
from milltools.study.search import gp

# Names, as in papers, of the keys that are varied most often; other keys keep their names
WORDS = {
    "drum.buckles": "number of buckles n",
    "drum.buckle_height": "buckle height h",
    "balls.count": "number of balls",
    "balls.diameter": "ball diameter",
    "rotor.speed": "rotor speed",
    "contact.restitution": "restitution",
    "contact.friction": "friction",
    "rotor.tip_speed": "tip speed",
    "blade.*.pitch": "pitch of the blades",
}
SHORT = {"drum.buckles": "n", "drum.buckle_height": "h"}
# where a table does not tell
VARIED = "varied"  # stands for the value of a varied key in what is common
UNKNOWN = dict.fromkeys(("unit", "meaning", "log", "low", "high", "values")) | {"choices": ()}
WITHIN = (1 + gp.CONFIDENCE) / 2  # share below the upper end of an interval
TURNING = {"rad/s": ("rpm", math.tau / 60), "rad": ("deg", math.pi / 180)}


@dataclasses.dataclass(frozen=True)
class Scale:
    """Conversion of SI values for showing: value / size, in `unit`."""

    size: float = 1.0
    unit: str = ""

    @property
    def bracket(self) -> str:
        return f" [{self.unit or '1'}]"

    @property
    def suffix(self) -> str:
        return f" {self.unit}" if self.unit else ""

    def told(self, value: float, half: float) -> tuple[str, str]:
        """A value and its half width, both to the second digit of the half width; without one, five digits."""
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


def deck_entries(meta, name) -> list[deck_text.Entry]:
    """The entries of the "study" deck or its base "deck", from the table; none if the text cannot be read."""
    try:
        return deck_text.entries(meta.get(name) or "", "")
    except UserError:
        return []


def deck_scales(meta) -> dict[str, Scale]:
    """The scale of each key whose line in [vary] of the study deck has a unit: "600..1200 rpm step 100 rpm"."""
    lines = {e.key: e.value for e in deck_entries(meta, "study") if e.section == "vary"}
    found = {}
    for entry in meta["vary"]:  # tables of earlier versions do not tell the unit
        unit = entry.get("written") or unit_written(lines.get(entry["key"], ""))
        if unit and entry.get("kind") == "number":
            found[entry["key"]] = unit
    try:
        told = values.tell(f"{key}=1 {unit}" for key, unit in found.items())
    except UserError:  # no engine, or an engine that does not know the unit
        return {}
    return {one.key: Scale(one.value, plain(found[one.key])) for one in told}


def words_of(name: str) -> str:
    """A key or a path below /statistics as people write it; that of a kind as that of all impacts, with the kind."""
    kind = re.fullmatch("impacts/(\\w+)/(.+)", name)
    if kind and (words := expression.WORDS.get(f"impacts/KIND/{kind[2]}")):
        return words if kind[1] == "all" else f"{words}, {label(kind[1])}"
    return WORDS.get(name) or expression.WORDS.get(name) or re.sub("[./_]", " ", name.replace(".*.", ".all."))


@dataclasses.dataclass(frozen=True)
class Axis(Range):
    """A varied key for showing: `unit` as people write it, all words in `choices`; `span`: the range and all values
    that were run; `said`: the scale of the unit in the study deck, None if there is no unit."""

    span: tuple = (0.0, 0.0)
    said: Scale | None = None

    @property
    def words(self) -> str:
        return words_of(self.key)

    @property
    def short(self) -> str:
        return SHORT.get(self.key, self.words)

    @functools.cached_property
    def drawn(self) -> Scale:
        """The scale for pictures: the unit of the study deck, else SI, or mm and ms for small values."""
        small = self.unit in ("m", "s") and 0 < max(map(abs, self.span)) < 0.5
        return self.said or (Scale(1e-3, f"m{self.unit}") if small else Scale(unit=self.unit))

    @functools.cached_property
    def scale(self) -> Scale:
        """The scale for texts and tables: the unit of the study deck, else degrees and rpm for angles and speeds."""
        if self.said or self.unit not in TURNING:
            return self.drawn
        unit, size = TURNING[self.unit]
        return Scale(size, unit)

    @property
    def heading(self) -> str:
        return self.words + (self.scale.bracket if self.numeric else "")

    def tell(self, value, unit: bool = True, digits: int = 5) -> str:
        """A value as text, in the scale of the key."""
        if not self.numeric:
            return str(value)
        return f"{float(value) / self.scale.size:.{digits}g}" + (self.scale.suffix if unit else "")

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
        return expression.parsed(self.path).words

    @property
    def scale(self) -> Scale:
        return Scale(unit=self.unit)

    @property
    def goal_words(self) -> str:
        many = self.words.startswith("impacts")
        return f"{('the largest ', 'the smallest ', 'most ', 'fewest ')[2 * many + (self.sign < 0)]}{self.words}"


@dataclasses.dataclass(frozen=True)
class Means:
    """Per design: mean, standard error (NaN if unknown), degrees of freedom of the error (inf: normal), number of runs.
    `factor`: the factor that enlarged the errors."""

    mean: np.ndarray
    error: np.ndarray
    dof: np.ndarray
    runs: np.ndarray
    factor: float = 1.0

    @property
    def half(self) -> np.ndarray:
        """Half width of the 95 % confidence interval of each mean; NaN if unknown."""
        return stats.t.ppf(WITHIN, self.dof) * self.error


def estimate(group, value, error, count) -> Means:
    """Runs (group 0..count-1, value, standard error; NaN: not known) -> `Means` of each group."""
    good = np.isfinite(value)
    group, value, error = group[good], value[good], error[good]
    runs = np.bincount(group, minlength=count)
    own = np.isfinite(error) & (error > 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(runs > 0, np.bincount(group, value, count) / runs, np.nan)
        square = np.bincount(group[own], error[own] ** 2, count) / np.bincount(group[own], minlength=count)
        error, told = np.where(own, error, np.sqrt(square[group])), np.sqrt(square / runs)
        known, several = np.isfinite(told), runs > 1
        # of replicates without errors, relative to their means; absolute if values have both signs
        oriented = np.all(mean[runs > 0] > 0) or np.all(mean[runs > 0] < 0)
        size = np.abs(mean) if oriented else 1 + 0 * mean

    def scatter(groups, unit):
        """Scatter of the runs of some groups about their means, in units of `unit`, and its degrees of freedom."""
        pool, free = groups[group], float((runs[groups] - 1).sum())
        return math.sqrt(np.sum(((value - mean[group])[pool] / unit[pool]) ** 2) / free), free

    factor, dof, spread = 1.0, np.full(count, np.inf), np.full(count, np.nan)
    if (known & several).any():
        ratio, free = scatter(known & several, error)
        if ratio > 1:
            factor, dof[:] = ratio, free
    if (~known & several).any():
        share, free = scatter(~known & several, size[group])
        least = np.median((error / size[group])[own]) if own.any() else 0.0
        if stats.t.ppf(WITHIN, free) * share < stats.norm.ppf(WITHIN) * least:  # agreement by chance
            share, free = least, np.inf
        dof[~known] = free
        with np.errstate(divide="ignore"):
            spread = share * size / np.sqrt(runs)
    return Means(mean, np.where(known, factor * told, spread), dof, runs, factor)


class StudyView:
    """A study for showing: `name`, the table's metadata `meta`, a DataFrame of all runs `rows` (columns as in the
    table), varied keys `axes`, `objectives`, requirements `require`; `designs`: a DataFrame with one line per design,
    columns of the axes, "state" (done | capped | failed), "runs"."""

    def __init__(self, name: str, meta: dict, rows: pd.DataFrame):
        self.name, self.meta = name, meta
        self.rows = rows.drop_duplicates("id", keep="last").reset_index(drop=True)
        said = deck_scales(meta)
        self.axes = [self._axis(entry, said.get(entry["key"])) for entry in meta["vary"]]
        self.objectives = [Aim(o["path"], o["goal"], spoken_unit(o.get("unit") or "")) for o in meta["objectives"]]
        self.require = [expression.Requirement.read(text) for text in meta.get("require") or ()]
        self.formulas = Formulas.of(meta)
        self._estimates = {}
        keys = [axis.key for axis in self.axes]
        self.design_of = self.rows.groupby(keys, sort=False, dropna=False).ngroup().to_numpy()
        self.designs = self.rows.loc[~pd.Series(self.design_of).duplicated(), keys].reset_index(drop=True)
        count, status = len(self.designs), self.rows["status"].to_numpy()
        has = {what: np.bincount(self.design_of[status == what], minlength=count) > 0 for what in ("done", "capped")}
        self.designs["state"] = np.where(has["done"], "done", np.where(has["capped"], "capped", "failed"))
        self.designs["runs"] = np.bincount(self.design_of, minlength=count)

    @classmethod
    def of(cls, table) -> "StudyView":
        """The view of a table.Table."""
        return cls(table.path.stem, table.meta, table.frame())

    def _axis(self, entry, said) -> Axis:
        axis, found = Axis.of({**UNKNOWN, **entry}), self.rows[entry["key"]]
        values, unit = axis.values or (), spoken_unit(axis.unit or "")
        if not axis.numeric:
            words = dict.fromkeys(map(str, [*values, *found.unique()]))
            return dataclasses.replace(axis, unit=unit, choices=tuple(words))
        known = [*values, *found.dropna(), *(end for end in (axis.low, axis.high) if end is not None)]
        span = float(min(known, default=0)), float(max(known, default=0))
        return dataclasses.replace(axis, unit=unit, values=tuple(sorted(values)) or None, span=span, said=said)

    def estimate(self, path: str) -> Means:
        """Means of a scalar with their standard errors, one per design; from capped runs if there are no others."""
        if path not in self._estimates:
            state = self.designs["state"].to_numpy()[self.design_of]
            value, error = self.column(path)
            value = np.where((self.rows["status"] == state).to_numpy(), value, np.nan)
            self._estimates[path] = estimate(self.design_of, value, error, len(self.designs))
        return self._estimates[path]

    def column(self, text: str) -> tuple[np.ndarray, np.ndarray]:
        """Values and standard errors of an expression in all rows, as stored or from the kept results. UserError if it
        is neither stored nor computable."""
        if text in self.rows:
            return tuple(self.rows[name].to_numpy(float) for name in (text, f"{text}:error"))
        found = np.full((2, len(self.rows)), np.nan)
        for k, results in enumerate(self._results):
            if results:
                told = expression.parsed(text).of(results)
                found[:, k] = told.value, told.error
        return tuple(found)

    @functools.cached_property
    def _results(self) -> list:
        """The kept Results of every row, None where there are none."""
        texts = self.rows["results"] if "results" in self.rows else [""] * len(self.rows)
        found = [Results.unpack(text) for text in texts]
        if not any(found):
            stored = ", ".join(name.removesuffix(":error") for name in self.rows if name.endswith(":error"))
            raise UserError(
                f"{self.name}: no run of this table has kept its results (an earlier version made it), so there are "
                f"only {stored}; for other questions run the study again with --force"
            )
        return found

    def aim(self, text: str, goal: str = "maximise") -> Aim:
        """An expression as an objective: one of the study, or a new one. UserError for a wrong expression."""
        text = expression.parsed(text).text
        for own in self.objectives:
            if own.path == text:
                return own
        unit = ""
        if text not in self.rows or any(self.rows.get("results", ())):
            told = next(results for results in self._results if results)
            unit = spoken_unit(expression.parsed(text).of(told).unit)
        return Aim(text, goal, unit)

    def ask(self, objective: str | None = None, require=()) -> Aim:
        """Makes the view answer another question: an objective, such as "rate / power" or "minimise power", and more
        requirements such as "power <= 225 W". Returns the objective."""
        goal, text = re.fullmatch(r"\s*(?:(maximise|minimise)\b)?(.*)", objective or "", re.S).groups()
        chosen = self.aim(text, goal or "maximise") if text.strip() else self.objectives[0]
        rules = [text for text in require if any(map(self.formulas.has, expression.keys_of(text)))]
        self.formulas.rules += [text for text in rules if text not in self.formulas.rules]
        asked = [expression.Requirement.read(text) for text in require if text not in rules]
        new = {(one.expression.text, one.sign) for one in asked}  # a new limit replaces that of the study
        self.require = [one for one in self.require if (one.expression.text, one.sign) not in new] + asked
        for one in asked:
            if told := next(filter(None, self._results), None):
                one.check(told)
        if chosen not in self.objectives:
            self.objectives = [chosen]
        for name in ("feasible", "possible", "_optima"):
            self.__dict__.pop(name, None)
        return chosen

    @functools.cached_property
    def feasible(self) -> np.ndarray:
        """Designs whose keys and means meet all requirements."""
        return np.all([self.possible, *map(self.meets, self.require)], axis=0)

    @functools.cached_property
    def possible(self) -> np.ndarray:
        """Designs whose keys meet what is required of keys: an earlier plan may have had others."""
        rules = self.formulas.rules
        return np.array([not rules or self.formulas.met(one) for one in self.designs.to_dict("records")], bool)

    def derived(self, design: int) -> list[str]:
        """The keys that follow from those of a design: "body.lifter.turn_by = 45 deg"."""
        line = self.rows.iloc[int(np.flatnonzero(self.design_of == design)[0])]
        told = []
        for key, about in self.formulas.derived.items():
            unit, size = TURNING.get(about["unit"], (about["unit"], 1.0))
            if unit in ("m", "s") and 0 < abs(line[key]) < 0.5:
                unit, size = f"m{unit}", 1e-3
            told.append(f"{key} = {line[key] / size:.5g} {unit}".removesuffix(" 1"))
        return told

    def meets(self, one) -> np.ndarray:
        """Designs whose mean meets one requirement."""
        return one.sign * (self.estimate(one.expression.text).mean - one.limit) <= 1e-12 * abs(one.limit)

    @property
    def usable(self) -> np.ndarray:
        """Designs with a run that was not capped; a capped run may still be in its start-up."""
        return (self.designs["state"] == "done").to_numpy()

    @property
    def judged(self) -> np.ndarray:
        """Those of the `done` designs that have a value of every objective."""
        return self.usable & np.all([np.isfinite(self.estimate(o.path).mean) for o in self.objectives], axis=0)

    @functools.cached_property
    def frictionless(self) -> np.ndarray:
        """Runs (not designs) that computed contacts without friction; tables of earlier versions do not tell."""
        return np.array([FRICTIONLESS in message for message in self.rows["message"]], bool)

    @functools.cached_property
    def unsettled(self) -> np.ndarray:
        """Runs (not designs) that have no errors because they have not settled; earlier versions do not tell."""
        return np.array([UNSETTLED in message for message in self.rows["message"]], bool)

    def axis(self, key: str) -> Axis:
        return next(a for a in self.axes if a.key == key)

    def having(self, values: dict) -> np.ndarray:
        """Marks the designs that have these values {key: value}."""
        return (self.designs[list(values)] == pd.Series(values)).all(axis=1).to_numpy()

    def is_grid(self) -> bool:
        """Whether every combination of values is planned, so that neighbours on the grid are real neighbours."""
        if not all(axis.values for axis in self.axes):
            return False
        return (self.meta.get("planned") or 0) >= math.prod(len(axis.values) for axis in self.axes)

    def label(self, design: int) -> str:
        """A design as a short label: "1000 rpm, 2.5 mm"."""
        line = self.designs.iloc[design]
        bare = [axis.numeric and not axis.scale.unit for axis in self.axes]
        return ", ".join(f"{a.short} = " * b + a.tell(line[a.key], digits=4) for a, b in zip(self.axes, bare))

    def tell(self, design: int) -> str:
        """A design in words: "n = 6, h = 6.5 mm"."""
        line = self.designs.iloc[design]
        return ", ".join(f"{a.short} = {a.tell(line[a.key])}" for a in self.axes)


# ---- the deck of a design


def settings(view, design, words=()) -> list[str]:
    """The varied keys of a design, and those that follow, as `millsim --set` takes them: in SI, or as `words` has them,
    see spoken(). A vector stands for its components."""
    line = {**view.rows.iloc[np.flatnonzero(view.design_of == design)[0]], **view.designs.iloc[design]}
    keys, found = view.meta.get("common") or {}, {}
    for entry in [*view.meta["vary"], *view.formulas.derived.values()]:
        key, value = entry["key"], line[entry["key"]]
        vector, place = values.component_of(key) or (key, None)
        text = formulas.text_of(float(value), entry["kind"]) if key in view.formulas.derived else str(value)
        text = repr(float(value)) if entry["kind"] == "number" else text
        order = (text, entry.get("unit") or "1")
        if entry["kind"] == "number" and place is None and (key, float(value)) in words:
            order = words[key, float(value)], "1"
        for name in [name for name in keys if fnmatchcase(name, vector)] if "*" in key else [vector]:
            if place is not None:
                parts = (found.get(name) or (keys[name], ""))[0].split()
                order = " ".join([*parts[:place], text, *parts[place + 1 : 3]]), order[1]
            found[name] = order
    return [values.order(name, *order) for name, order in found.items()]


def common(view) -> dict[str, str]:
    """{section.key: text} of what all designs have. `settings` belong to it as `millsim --set` takes them: a varied
    balls.fill replaces a balls.count."""
    keys, own = view.meta.get("common") or {}, {one.partition("=")[0] for one in settings(view, 0)}
    shared = {key: text for key, text in keys.items() if "." in key and not key.startswith("study.")}
    return {key: text for key, text in shared.items() if key not in own and text != VARIED}


@contextlib.contextmanager
def base_of(view, *orders):
    """A temporary file with the deck of what all designs have. UserError if it, or an override of `orders`, names a
    file: of this computer, and the table may be a stranger's."""
    keys = common(view)
    if files := [
        one.text for one in values.tell([*(f"{k}={text}" for k, text in keys.items()), *orders]) if one.is_file
    ]:
        raise UserError(f"its deck names the file {files[0]}")
    sections: dict[str, list[str]] = {}
    for key, text in keys.items():
        section, _, name = key.rpartition(".")
        sections.setdefault(section, []).append(f"{name} = {text}")
    lines = [line for name, own in sections.items() for line in (f"[{name}]", *own)]
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        file = pathlib.Path(folder) / "mill.ini"
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        yield file


def deck_of(view, design) -> Deck:
    """The deck of a design, with all defaults and the seed of its first run."""
    first = int(np.flatnonzero(view.design_of == design)[0])
    orders = [*settings(view, design), f"run.seed={view.rows['seed'][first]}"]
    with base_of(view, *orders) as file:
        found = Deck.check(file, orders)
        _ = found.contours  # while the file is there
    return found


# ---- the table that belongs to a name


def table_of(name: str) -> pathlib.Path:
    """The table itself, the table of a journal, or of a study deck (next to the deck or in the current folder)."""
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
        raise UserError(f"{name}: it has no table yet: neither {' nor '.join(map(str, dict.fromkeys(found)))}")
    raise MissingFileError(f"{name}: no such file")


def opened(name: str) -> tuple[Table, StudyView]:
    """A study by the name of its table, journal or deck; UserError if it has no rows yet."""
    table = Table.open(table_of(name))
    if not len(table):
        raise UserError(f"{table.path}: no run has ended yet", status=1)
    return table, StudyView.of(table)
