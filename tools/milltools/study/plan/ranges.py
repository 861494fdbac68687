"""The meaning of a line of [vary]: the values that one deck key takes.

    2..20                          all whole numbers (for whole-number keys), else all numbers between
    0..10 mm step 0.5 mm           every half millimetre
    2..10 mm in 5 log              five values, evenly spaced in the logarithm
    600, 800, 1000 rpm             these
    circle, wavy                   these words

millsim converts the units: each value goes through `millsim --value`.
"""

import dataclasses
import decimal
import math
import re

from milltools.base.errors import UserError
from milltools.read.values import tell

MOST = 1_000_000  # values of one key
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)$", re.S)
CLAUSES = {"log": r"(.*\S)\s+(log)$", "in": r"(.*\S)\s+in\s+(\d+)$", "step": r"(.*?\S)\s+step\s+(.+)$"}
# the order of these names identifies a search
ABOUT = ("key", "unit", "meaning", "kind", "whole", "log", "low", "high", "values", "choices")
WANTED = (
    "expected values such as '600, 800, 1000 rpm', or a range such as '2..20', '0..10 mm step 0.5 mm' or "
    "'2..10 mm in 5 log'"
)


@dataclasses.dataclass(frozen=True)
class Range:
    """One varied key. Values are in SI: float (number), int (whole), str (choice, vector, file)."""

    key: str
    kind: str  # number, whole, choice, vector or file
    unit: str  # SI; "1" for plain numbers
    meaning: str
    log: bool
    low: float | None  # None for words
    high: float | None
    values: tuple | None  # values for a grid, in order; None: any number between low and high
    choices: tuple[str, ...]  # of a choice: all words it could take
    written: str = ""  # the unit in the deck

    @property
    def whole(self) -> bool:
        return self.kind == "whole"

    @property
    def numeric(self) -> bool:
        return self.kind in ("number", "whole")

    def ordered(self) -> "Range":
        """A numerical key with its values in order, from the first to the last."""
        if not self.numeric:
            return self
        values, low, high = self.values, self.low, self.high
        if values is None and self.whole:
            values = range(math.ceil(low), math.floor(high) + 1)
        if values is not None:
            values = tuple(sorted(set(values)))
            low, high = values[0], values[-1]
        return dataclasses.replace(self, values=values, low=low, high=high, log=self.log and low > 0)

    def at(self, share: float):
        """The value at a share in [0, 1) of the range: equal shares are equal steps (of the logarithm if `log`); in a
        list each value has an equal share."""
        if self.log and self.whole:
            wanted = self.low * (self.high / self.low) ** share
            return min(self.values, key=lambda value: abs(math.log(value / wanted)))
        if self.values is not None:
            return self.values[min(int(share * len(self.values)), len(self.values) - 1)]
        if self.log:
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + (self.high - self.low) * share)

    def share(self, value) -> float:
        """The place of a number between low (0) and high (1)."""
        low, high, value = map(math.log if self.log else float, (self.low, self.high, value))
        return (value - low) / (high - low) if high > low else 0.0

    def about(self) -> dict:
        """The form for the table's metadata."""
        return {name: getattr(self, name) for name in ABOUT} | ({"written": self.written} if self.written else {})

    @classmethod
    def of(cls, about) -> "Range":
        """From the table's metadata."""
        values, log = about.get("values"), bool(about.get("log"))
        texts = about["key"], about.get("kind", "number"), about.get("unit") or "", about.get("meaning") or ""
        ends = about.get("low"), about.get("high")
        written = about.get("written") or ""
        return cls(*texts, log, *ends, values and tuple(values), tuple(about.get("choices") or ()), written)


def parse(key: str, text: str) -> Range:
    """The Range of `key = text`; UserError, without file and line, if the text is wrong."""
    found = _span(key, text) if ".." in text and not text.lstrip().startswith('"') else _list(key, text)
    return dataclasses.replace(found, written=unit_written(text) if found.kind == "number" else "")


def unit_written(text: str) -> str:
    """The last unit of a line: "rpm" of "600..1200 rpm step 100 rpm"; "" without one."""
    span, clauses = _clauses(text)
    found = [NUMBER.match(part) for part in (clauses.get("step", ""), re.split(r"\.\.|,", span)[-1])]
    return next((one[2].strip() for one in found if one and one[2]), "")


def _told(orders) -> list:
    """The values, which are all of one kind: a share of the critical speed is not a speed."""
    found = tell(orders)
    if len(units := {value.unit for value in found}) > 1:
        raise UserError(f"expected all values in one kind of unit, got {' and '.join(sorted(units))}")
    return found


def _list(key, text) -> Range:
    items = [item.strip() for item in text.split(",")]
    if not all(items):
        raise UserError(f"{WANTED}, got '{text[:80]}'" if text.strip() else f"{WANTED}, got nothing")
    numbers = [NUMBER.match(item) for item in items]
    unit = numbers[-1].group(2) if numbers[-1] else ""
    # '600, 800, 1000 rpm': values without a unit get the unit of the last; '0 0 -9.81 m/s^2' is three numbers
    bare = [bool(number) and not number.group(2) and unit and not NUMBER.match(unit) for number in numbers]
    found = _told(f"{key}={item} {unit}" if add else f"{key}={item}" for item, add in zip(items, bare))
    values = tuple(value.value for value in found)
    for k, value in enumerate(values):
        if value in values[:k]:
            raise UserError(f"expected different values, got '{items[k]}' twice")
    first = found[0]
    ends = (min(values), max(values)) if first.kind in ("number", "whole") else (None, None)
    return Range(key, first.kind, first.unit, first.meaning, False, *ends, values, first.choices)


def _clauses(text):
    """The span, then what follows it: {"step": text, "in": count, "log": "log"}."""
    rest, found = text.strip(), {}
    while clause := next((name for name, pattern in CLAUSES.items() if re.match(pattern, rest, re.S)), None):
        if clause in found:
            raise UserError(f"{WANTED}, got '{clause}' twice")
        rest, found[clause] = re.match(CLAUSES[clause], rest, re.S).groups()
    return rest, found


def _number(text, what):
    found = NUMBER.match(text)
    if not found:
        raise UserError(f"{WANTED}, got '{text.strip()[:80]}' as {what}")
    return decimal.Decimal(found.group(1)), found.group(2).strip()


def _span(key, text) -> Range:
    span, found = _clauses(text)
    step, log = found.get("step"), "log" in found
    count = int(found["in"]) if "in" in found else None
    if "..." in span or span.count("..") != 1:
        raise UserError(f"{WANTED}, got '{text[:80]}' (numbers such as 0.5 on both sides of '..')")
    low_text, high_text = span.split("..")
    high, unit = _number(high_text, "the end")
    low, low_unit = _number(low_text, "the beginning")
    width, step_unit = _number(step, "the step") if step else (None, "")
    if step and count is not None:
        raise UserError(f"{WANTED}, got both 'step' and 'in'")
    if step and log:
        raise UserError("expected 'in N log' for a logarithmic range, got 'step' and 'log'")
    ends = _told(f"{key}={number} {u}".strip() for number, u in ((low, low_unit or unit), (high, unit)))
    about, first, last = ends[0], ends[0].value, ends[1].value
    if about.kind not in ("number", "whole"):
        raise UserError(f"expected a list of values, got the range '{text[:80]}'")
    if not first < last:
        raise UserError(f"expected a range from low to high, got '{text[:80]}'")
    if log and not first > 0:
        raise UserError(f"expected a range above 0 for 'log', got '{text[:80]}'")
    if count is not None and not 2 <= count <= MOST:
        raise UserError(f"expected 'in 2' to 'in {MOST}', got 'in {count}'")
    if about.kind == "whole" and not step and count is None and not log:
        width = decimal.Decimal(1)
    values = None
    if width is not None:
        values = _steps(key, (low, low_unit), (high, unit), (width, step_unit), ends, text)
    elif count is not None:
        values = _spread(about.kind, first, last, count, log)
    elif about.kind == "whole":
        values = tuple(range(first, last + 1))
    return Range(key, about.kind, about.unit, about.meaning, log, first, last, values, ())


def _steps(key, low, high, step, ends, text):
    """low, low + step, ... up to high, each rounded once, as if written out with its unit."""
    unit = high[1]
    if {low[1], step[1]} - {"", unit}:  # different units: convert all to SI
        unit = ends[0].unit if ends[0].unit != "1" else ""
        told = _told([f"{key}={high[0]} {high[1]}", f"{key}={step[0]} {step[1] or high[1]}"])[1]
        low, high, step = ((decimal.Decimal(value.text),) for value in (*ends, told))
    low, high, step = low[0], high[0], step[0]
    if step <= 0:
        raise UserError(f"expected a step above 0, got '{text[:80]}'")
    many = (high - low) / step
    if many > MOST:
        raise UserError(f"expected at most {MOST} values, got '{text[:80]}'")
    numbers = [low + k * step for k in range(int(many) + 1)]
    return tuple(v.value for v in tell(f"{key}={number} {unit}".strip() for number in numbers))


def _spread(kind, low, high, count, log):
    """`count` values from low to high, both included; for whole-number keys rounded, each value once."""
    ratio = high / low if log else None
    inner = [
        low * ratio ** (k / (count - 1)) if log else low + (high - low) * k / (count - 1) for k in range(1, count - 1)
    ]
    values = [low, *inner, high]
    if kind == "whole":
        return tuple(sorted({round(value) for value in values}))
    return tuple(float(value) for value in values)
