"""Keys that follow from others, and what keys must meet:

    [set]    body.lifter.turn_by = 360 deg / body.lifter.copies
    [study]  require = body.lifter.size.2 <= 2 * balls.diameter

Both are expressions of keys (read/expression.py), computed in SI for each design. The metadata of a table have them
too, so `mill study` knows which designs are possible.
"""

import fnmatch
import functools

from milltools.base.errors import UserError
from milltools.base.text import spoken_unit
from milltools.read import expression
from milltools.read.expression import Quantity
from milltools.read.values import component_of

ROUNDING = 1e-9  # by which sides of a requirement may differ and still be equal, and a number be a whole one


class Formulas:
    """vary     [{"key", "unit"}] of the varied keys
    derived  [{"key", "text", "unit", "kind"}] of the keys that follow: `text` is the expression
    rules    requirements on keys, such as "balls.diameter <= 5 mm"
    known    {key: [text of its value in SI, unit]} of the fixed keys that these name

    A design is {varied key: value in SI}."""

    def __init__(self, vary, derived=(), rules=(), known=None):
        self.units = {one["key"]: one.get("unit") or "1" for one in vary}
        self.derived, self.rules, self.known = {one["key"]: one for one in derived}, list(rules), known or {}

    @classmethod
    def of(cls, meta) -> "Formulas":
        """From the metadata of a table."""
        return cls(meta["vary"], *(meta.get(name) or () for name in ("derived", "rules")), meta.get("known"))

    def about(self) -> dict:
        """The metadata of a table; nothing without formulas."""
        found = {"derived": list(self.derived.values()), "rules": self.rules, "known": self.known}
        return found if self.derived or self.rules else {}

    def look(self, design):
        """The function of the name of a key that gives its Quantity in a design; KeyError with a reason for others,
        UserError for one that follows from itself."""
        found = {}

        def quantity(name):
            if name not in found:
                found[name] = None
                found[name] = self._quantity(name, design, quantity)
            if found[name] is None:
                by = list(found)[list(found).index(name) + 1 :]  # all of them are being computed
                raise UserError(f"{name} follows from itself" + f", by {' and '.join(by)}" * bool(by))
            return found[name]

        return quantity

    def _quantity(self, name, design, look):
        if name in self.derived:
            return expression.parsed(self.derived[name]["text"]).at(look)
        if key := self._varied(name):
            value = design[key]
            return _number(value if key.rpartition(".")[2] == name.rpartition(".")[2] else
                           value.split()[component_of(name)[1]], self.units[key], name)  # fmt: skip
        if name in self.known:
            return _number(*self.known[name], name)
        if "/" in name or name in expression.NAMES:
            raise KeyError(f"{name} is a result: it is known only after a run, and cannot be used with keys")
        raise KeyError(f"neither the base deck nor the study gives {name}")

    def _varied(self, name) -> str | None:
        """The varied key that is `name`, names it by *, or is the vector of this component."""
        names = (name, *(component_of(name) or ())[:1])
        return next((key for one in names for key in self.units if fnmatch.fnmatchcase(one, key)), None)

    def has(self, name) -> bool:
        """Whether it has the value of a key."""
        return name in self.derived or name in self.known or self._varied(name) is not None

    def roots(self, name, seen=()) -> set[str]:
        """The varied keys from which a key follows; itself if it is varied."""
        if name in self.derived and name not in seen:
            names = expression.parsed(self.derived[name]["text"]).keys
            return set().union(*(self.roots(one, (*seen, name)) for one in names))
        return {key} if (key := self._varied(name)) else set()

    def derive(self, design) -> dict[str, float]:
        """The values of the keys that follow."""
        look = self.look(design)
        return {key: look(key).value for key in self.derived}

    def met(self, design) -> bool:
        """Whether the keys of a design meet all requirements on keys."""
        look = self.look(design)
        return all(holds(rule, look) for rule in self.rules)


def _number(value, unit, name) -> Quantity:
    try:
        return Quantity(float(value), expression.unit_of(unit)[1])
    except (KeyError, ValueError):
        told = f"{value} {unit}".removesuffix(" 1")
        few = " (its components are .1, .2 and .3)" if " " in str(value) else ""
        raise KeyError(f"{name} = {told} is not one number in SI{few}") from None


def holds(rule: str, look) -> bool:
    """Whether a requirement on keys is met; UserError where its sides cannot be compared."""
    left, sign, right = _sides(rule)
    one, other = left.at(look), right.at(look)
    if expression.felt(one.powers) != expression.felt(other.powers):
        units = " and ".join(spoken_unit(side.unit) or "a plain number" for side in (one, other))
        raise UserError(f"'{rule}': {units} cannot be compared")
    return sign * (one.value - other.value) <= ROUNDING * max(abs(one.value), abs(other.value))


@functools.lru_cache(maxsize=256)
def _sides(rule):
    return expression.sides(rule)


def text_of(value: float, kind: str) -> str:
    """The text of the value of a key that follows; of one that takes whole numbers without a point."""
    near = kind == "whole" and abs(value - round(value)) <= ROUNDING * abs(value)
    return str(round(value)) if near else repr(value)


def is_formula(text: str, known) -> bool:
    """Whether a value is an expression of keys: it has the name of a known key, or computes with such names."""
    try:
        found = expression.parsed(text)
    except UserError:
        return any(word in known for word in expression.DOTTED.findall(text))
    return any(is_known(name, known) for name in found.keys) or (bool(found.keys) and found.computes)


def is_known(name: str, known) -> bool:
    """Whether keys that are given have this one, or the vector of which it is a component."""
    return name in known or (component_of(name) or ("",))[0] in known
