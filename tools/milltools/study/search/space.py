"""The space of a study's varied keys: values of a design <-> places in a unit cube.

Everything that models or samples a study (Gaussian process, optimiser, sensitivities) sees numbers between 0 and 1; this
is the one place where they are made from values of keys and back. A `Variable` comes from an entry of the table's
"vary" (or the study deck's), SI:

    numbers with a list of values (a list in the deck, or a range with steps)   one column, spaced as the values are
    whole numbers, real numbers between low and high                            one column; logarithmic if the key is
    words (choices, file names)                                                 one column each: 1/sqrt(2) for the chosen

so that two different choices are as far apart as the two ends of a number. Whole and stepped keys are always at one of their
values *before* they are encoded: the model never sees the stairs between them (Garrido-Merchan & Hernandez-Lobato,
Neurocomputing 380 (2020) 20).
"""

import dataclasses
import itertools
import math

import numpy as np

MOST_LISTED = 20_000  # designs of a space that is searched by listing all of it


@dataclasses.dataclass(frozen=True)
class Variable:
    """One varied key. `values`: all it can be, in order, or None for a real one between `low` and `high`."""

    key: str
    unit: str
    values: tuple | None
    low: float | None
    high: float | None
    log: bool = False
    words: bool = False

    @property
    def width(self) -> int:
        """Columns of its code."""
        return len(self.values) if self.words else 1

    def share(self, value) -> float:
        """Where a number lies between low (0) and high (1)."""
        low, high, value = (self._scale(v) for v in (self.low, self.high, value))
        return (value - low) / (high - low) if high > low else 0.0

    def _scale(self, value) -> float:
        return math.log(value) if self.log else float(value)

    def encode(self, value) -> list[float]:
        if self.words:
            return [math.sqrt(0.5) * (value == v) for v in self.values]
        return [self.share(value)]

    def at(self, u: float):
        """The value at the share u of 0..1: all values of a list are equally likely."""
        u = min(max(u, 0.0), math.nextafter(1.0, 0.0))
        if self.values is not None:
            return self.values[int(u * len(self.values))]
        low, high = self._scale(self.low), self._scale(self.high)
        value = low + u * (high - low)
        return min(max(math.exp(value) if self.log else value, self.low), self.high)

    def near(self, value, step: float, generator) -> object:
        """Another value some `step` (share of the range) from this one; a word is changed with that probability."""
        if self.words:
            return generator.choice(self.values) if generator.random() < step else value
        aim = self.share(value) + step * generator.standard_normal()
        if self.values is None:
            return self.at(aim)
        shares = np.array([self.share(v) for v in self.values])
        return self.values[int(np.argmin(np.abs(shares - aim)))]


def variable(entry: dict) -> Variable:
    """From an entry of "vary": {key, unit, whole, log, low, high, values (list or null)}, SI."""
    if entry.get("values") and isinstance(entry["values"][0], str):
        words = tuple(entry["values"])
        return Variable(entry["key"], entry.get("unit") or "", words, None, None, words=True)
    log, values = bool(entry.get("log")), entry.get("values")
    if values is None and entry.get("whole"):
        values = range(math.ceil(entry["low"]), math.floor(entry["high"]) + 1)
    if values is not None:
        values = tuple(sorted(set(values)))
        low, high = values[0], values[-1]
    else:
        low, high = float(entry["low"]), float(entry["high"])
    return Variable(entry["key"], entry.get("unit") or "", values, low, high, log and low > 0)


class Space:
    """All varied keys. A design is a tuple of values, in the order of `keys`."""

    def __init__(self, vary: list[dict]):
        self.variables = [variable(entry) for entry in vary]
        self.keys = [v.key for v in self.variables]
        self.columns = sum(v.width for v in self.variables)

    def __len__(self):
        return len(self.variables)

    @property
    def count(self) -> float:
        """How many designs there are; inf where a key is real."""
        counts = [math.inf if v.values is None else len(v.values) for v in self.variables]
        return math.prod(counts)

    def encode(self, designs) -> np.ndarray:
        """Codes of designs, shape (len(designs), columns)."""
        rows = [
            list(itertools.chain.from_iterable(v.encode(x) for v, x in zip(self.variables, design)))
            for design in designs
        ]
        return np.array(rows, float).reshape(len(rows), self.columns)

    def at(self, shares) -> list[tuple]:
        """The designs at shares of 0..1, shape (any, len(self))."""
        return [tuple(v.at(float(u)) for v, u in zip(self.variables, row)) for row in shares]

    def near(self, design, step: float, generator) -> tuple:
        """A design some `step` away: about one key is moved at least."""
        moved = generator.random(len(self)) < max(0.5, 1 / len(self))
        moved[generator.integers(len(self))] = True
        return tuple(v.near(x, step, generator) if m else x for v, x, m in zip(self.variables, design, moved))

    def everything(self) -> list[tuple] | None:
        """All designs, or None where they are too many."""
        if self.count > MOST_LISTED:
            return None
        return list(itertools.product(*(v.values for v in self.variables)))
