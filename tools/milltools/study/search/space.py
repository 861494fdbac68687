"""The space of a study's varied keys: values of a design <-> places in a unit cube.

All code that models or samples a study (Gaussian process, optimiser, sensitivities) uses numbers between 0 and 1.
This module converts the values of keys to these numbers and back:

    numbers with a list of values (a list in the deck, or a range with steps)   one column, spaced as the values are
    whole numbers, real numbers between low and high                            one column; logarithmic if the key is
    words (choices, file names)      one column for each word: 1/sqrt(2) for the chosen word, 0 for the others

So two different words have the same distance as the two ends of a range of numbers. Whole-number and stepped keys are
rounded to one of their values *before* the encoding, so the model never gets values between the steps (Garrido-Merchan
& Hernandez-Lobato, Neurocomputing 380 (2020) 20).
"""

import itertools
import math

import numpy as np

from milltools.study.plan.ranges import Range

MOST_LISTED = 20_000  # largest number of designs of a space that are all evaluated


def _at(r: Range, share: float):
    """The value at a share of 0..1: all values of a list are equally likely."""
    share = min(max(share, 0.0), math.nextafter(1.0, 0.0))
    if r.values is not None:
        return r.values[int(share * len(r.values))]
    if not r.log:
        return min(max(r.low + share * (r.high - r.low), r.low), r.high)
    low, high = math.log(r.low), math.log(r.high)
    return min(max(math.exp(low + share * (high - low)), r.low), r.high)


def _near(r: Range, value, step: float, generator):
    """Another value at a distance of about `step` (share of the range); a word is changed with that probability."""
    if not r.numeric:
        return generator.choice(r.values) if generator.random() < step else value
    aim = r.share(value) + step * generator.standard_normal()
    if r.values is None:
        return _at(r, aim)
    return min(r.values, key=lambda other: abs(r.share(other) - aim))


class Space:
    """All varied keys, from the entries of the table's "vary" (or the study deck's). A design is a tuple of values, in
    the order of `keys`; `ranges`: their values in order; `met`, if given: whether {key: value} meets what is required
    of keys."""

    def __init__(self, vary: list[dict], met=None):
        self.ranges = [Range.of(entry).ordered() for entry in vary]
        self.keys, self.met = [r.key for r in self.ranges], met

    def __len__(self):
        return len(self.ranges)

    def encode(self, designs) -> np.ndarray:
        """Codes of designs, shape (len(designs), columns)."""
        columns = []
        for r, values in zip(self.ranges, zip(*designs)):
            if r.numeric:
                columns.append([r.share(value) for value in values])
            else:
                columns += [[math.sqrt(0.5) * (value == word) for value in values] for word in r.values]
        return np.column_stack(columns)

    def at(self, shares) -> list[tuple]:
        """The designs at shares of 0..1, shape (any, len(self))."""
        return [tuple(_at(r, float(u)) for r, u in zip(self.ranges, row)) for row in shares]

    def allowed(self, designs) -> list[tuple]:
        """Those that meet what is required of keys."""
        return [one for one in designs if self.met(dict(zip(self.keys, one)))] if self.met else list(designs)

    def near(self, design, step: float, generator) -> tuple:
        """A design at a distance of about `step`: on average at least one key is changed."""
        moved = generator.random(len(self)) < max(0.5, 1 / len(self))
        moved[generator.integers(len(self))] = True
        return tuple(_near(r, x, step, generator) if m else x for r, x, m in zip(self.ranges, design, moved))

    def everything(self, most=MOST_LISTED) -> list[tuple] | None:
        """All designs, or None where there are more than `most`."""
        if math.prod(math.inf if r.values is None else len(r.values) for r in self.ranges) > most:
            return None
        return list(itertools.product(*(r.values for r in self.ranges)))
