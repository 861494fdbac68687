"""Expressions of the results of a run, such as `rate_above(1 mJ, ball_ball) / power`, with units and errors.

    question = Expression("rate_above(1 mJ) / power")
    question.of(Results.of(run))        # Quantity: value and standard error in SI, unit "1/J"

An expression has numbers with units, the names of NAMES, paths of scalars below /statistics such as
`impacts/all/rate`, the signs + - * /, parentheses, and abs, min, max. A slash inside a path has no space around it.
Nothing of an expression is executed: Python's parser gives a tree, and only these parts of a tree are accepted.

An expression of keys, such as `360 deg / body.lifter.copies`, is written in the same way: see Expression.at.

The standard error is that of first order. A rate and the power rise and fall together: rates, losses and the power of
the drive are known in each block of time, and so is what an expression makes of them to first order. Other numbers
count as independent. A number that occurs twice counts as one, so `power / power` has no error.
"""

import ast
import dataclasses
import functools
import math
import operator
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import spoken_unit
from milltools.read.results import Results
from milltools.read.sums import standard_error

MEDIAN = "normal_speed/median_above_floor"
# name: (path below /statistics, words); KIND is the argument of the name, "all" without one
NAMES = {
    "power": ("drive/power", "power"),
    "torque": ("rotor/torque", "rotor torque"),
    "mass": ("", "mass of the balls"),
    "rate": ("impacts/KIND/rate", "rate of impacts"),
    "rate_above": ("", "rate of impacts of ... or more"),
    "median_speed": (f"impacts/KIND/{MEDIAN}", "median normal impact speed above the floor"),
    "dissipation": ("impacts/KIND/dissipated_power", "dissipated power"),
    "dose_rate": ("dose/dose_rate", "dose rate"),
    "hard_rate": ("dose/hard_impacts", "rate of hard impacts"),
    "wear_depth": ("wear/KIND/depth", "depth of sliding wear"),
    "erosion": ("wear/KIND/erosion", "mass that erosion removes"),
    "toe": ("charge/toe/value", "toe of the charge"),
    "shoulder": ("charge/shoulder/value", "shoulder of the charge"),
    "repose": ("charge/repose/value", "dynamic angle of repose"),
    "in_flight": ("charge/in_flight/value", "share of balls in flight"),
    "above_toe": ("charge/above_toe/value", "share of the liner's impacts above the toe, by energy along the normal"),
}
OTHERS = {"drive/power": "rotor/power"}  # of a run without the first
WORDS = {path: words for path, words in NAMES.values() if path} | {
    "impacts/KIND/normal_speed/median": "median normal impact speed",
    "impacts/KIND/normal_speed/mean": "mean normal impact speed",
    "rotor/power": "rotor power",
    "drive/power": "drive power",
}
SHOWN = "power, torque, mass, rate(KIND), rate_above(1 mJ or 1 m/s, KIND), median_speed(KIND), dissipation(KIND), " \
    "dose_rate, hard_rate, wear_depth(KIND), erosion(KIND), toe, shoulder, repose, in_flight, or a path such as " \
    "impacts/all/rate"  # fmt: skip

# ---- units: (size in SI, exponents of kg, m, s, K, rad)

BASE = ("kg", "m", "s", "K", "rad")
PLAIN = (0, 0, 0, 0, 0)
UNITS = {
    "g": (1e-3, (1, 0, 0)), "t": (1e3, (1, 0, 0)), "m": (1.0, (0, 1, 0)), "s": (1.0, (0, 0, 1)),
    "min": (60.0, (0, 0, 1)), "h": (3600.0, (0, 0, 1)), "J": (1.0, (1, 2, -2)), "Wh": (3600.0, (1, 2, -2)),
    "W": (1.0, (1, 2, -3)), "N": (1.0, (1, 1, -2)), "Nm": (1.0, (1, 2, -2)), "Pa": (1.0, (1, -1, -2)),
    "Hz": (1.0, (0, 0, -1)), "rpm": (math.tau / 60, (0, 0, -1, 0, 1)), "rad": (1.0, (0, 0, 0, 0, 1)),
    "deg": (math.tau / 360, (0, 0, 0, 0, 1)), "K": (1.0, (0, 0, 0, 1)), "year": (365.25 * 86400, (0, 0, 1)),
    "%": (0.01, ()), "1": (1.0, ()),
}  # fmt: skip
UNITS = {name: (size, (*powers, *PLAIN[len(powers) :])) for name, (size, powers) in UNITS.items()}
PREFIXES = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6, "G": 1e9}
PREFIXED = ("g", "m", "s", "J", "Wh", "W", "N", "Nm", "Pa", "Hz")
SPOKEN = ("1", "W", "J", "N", "kg", "m", "s", "s-1", "m s-1", "J-1", "W-1", "W kg-1", "J kg-1", "kg-1 s-1", "J m-2",
          "W m-2", "N m-2", "kg-1", "s2 m-2")  # fmt: skip
LETTERS = 500  # of an expression: so many operations within each other can be computed
ATOM = r"(?:(?:[A-Za-zµμ]+|%)(?:\^|\*\*)?(?:-?\d+)?|1(?![\d.]))"
UNIT = re.compile(rf"\s*((?:1?/)?{ATOM}(?:[./*]{ATOM})*)")
DOTTED = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+")  # the name of a key, section.key
PARTS = re.compile(r"([./* ]?)([A-Za-zµμ]+|%|1(?!\d))(?:\^|\*\*)?(-?\d+)?")


def unit_of(text: str) -> tuple[float, tuple[int, ...]]:
    """Size in SI and exponents of BASE of a unit such as "mJ", "m/s", "m s-1"; KeyError for an unknown one, and for an
    exponent above 9."""
    size, powers = 1.0, PLAIN
    for sign, name, power in PARTS.findall(text):
        if name not in UNITS and (name[:1] not in PREFIXES or name[1:] not in PREFIXED):
            raise KeyError(name)
        if len(power.lstrip("-")) > 1:
            raise KeyError(f"{name}^{power}")
        one, own = UNITS.get(name) or (PREFIXES[name[0]] * UNITS[name[1:]][0], UNITS[name[1:]][1])
        times = int(power or 1) * (-1 if sign == "/" else 1)
        size, powers = size * one**times, tuple(a + times * b for a, b in zip(powers, own))
    return size, powers


SPELLED = {unit_of(text)[1]: text for text in reversed(SPOKEN)}


def spelled(powers) -> str:
    """The unit of exponents as the output file writes it: "J-1", "kg m s-1"."""
    return SPELLED.get(tuple(powers)) or " ".join(f"{b}{p if p != 1 else ''}" for b, p in zip(BASE, powers) if p)


# ---- quantities


@dataclasses.dataclass(frozen=True)
class Quantity:
    """`value` in SI, exponents `powers` of BASE, and `shares` {number: array of what it contributes to the error,
    then to each block of time if it is known there}; `own`: the unit in the file of a number that is not computed;
    `period`: blocks in a period; `starts`: of how many starts the blocks are, one after the other."""

    value: float
    powers: tuple = PLAIN
    shares: dict = dataclasses.field(default_factory=dict)
    own: str = ""
    period: int = 0
    starts: int = 1

    @classmethod
    def told(cls, value, powers, own, name, error, blocks, results) -> "Quantity":
        """A number of a run with its name, its standard error and, but for a factor, its values in blocks of time
        (None: not known), of these results."""
        series = np.empty(0) if blocks is None or not blocks.any() else value * (blocks / blocks.mean() - 1)
        return cls(value, powers, {name: np.array([error, *series])}, own, results.period, results.starts)

    @property
    def error(self) -> float:
        """The standard error, NaN if that of one part is not known, and of a value that is no number."""
        if not math.isfinite(self.value):
            return math.nan
        together = [share[1:] for share in self.shares.values() if share[1:].any()]
        if len(together) < 2:
            return math.hypot(*(share[0] for share in self.shares.values()))
        alone = [share[0] for share in self.shares.values() if not share[1:].any()]
        return math.hypot(standard_error(sum(together), self.period, self.starts), *alone)

    @property
    def unit(self) -> str:
        return self.own or spelled(self.powers)

    def _with(self, other, value, mine, its, powers):
        names, value = dict.fromkeys([*self.shares, *other.shares]), value if math.isfinite(value) else math.nan
        with np.errstate(over="ignore", invalid="ignore"):
            shares = {n: mine * self.shares.get(n, 0.0) + its * other.shares.get(n, 0.0) for n in names}
        told = self if self.shares else other
        return Quantity(value, powers, shares, period=told.period, starts=told.starts)

    def __add__(self, other):
        return self._with(other, self.value + other.value, 1, 1, self.powers)

    def __sub__(self, other):
        return self._with(other, self.value - other.value, 1, -1, self.powers)

    def __mul__(self, other):
        powers = tuple(map(operator.add, self.powers, other.powers))
        return self._with(other, self.value * other.value, other.value, self.value, powers)

    def __truediv__(self, other):
        powers = tuple(map(operator.sub, self.powers, other.powers))
        if not other.value:
            return Quantity(math.nan, powers)
        value = self.value / other.value
        return self._with(other, value, 1 / other.value, -value / other.value, powers)

    def _doubt(self, gap: "Quantity"):
        """Itself; without an error where `gap` may as well be 0, at which its slope is not one number."""
        near = gap.shares and abs(gap.value) <= 1.96 * gap.error
        return dataclasses.replace(self, shares={"": np.array([math.nan])}, own="") if near else self

    @staticmethod
    def absolute(one):
        return (one if one.value >= 0 else Quantity(-1.0) * one)._doubt(one)

    @staticmethod
    def least(*several, sign=1):
        """The smallest of several (sign -1: the largest)."""
        best, *others = sorted(several, key=lambda one: sign * one.value)
        for other in others:
            best = best._doubt(best - other)
        return best


FUNCTIONS = {
    "abs": Quantity.absolute, "min": Quantity.least, "max": functools.partial(Quantity.least, sign=-1),
}  # fmt: skip
SIGNS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
TOKENS = re.compile(r"(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*(?:[/.]\w+)*)|(\s+)|([-+*/(),])")


class Expression:
    """`text`: the expression, with single spaces. UserError for a text that is none."""

    def __init__(self, text: str):
        self.text = " ".join(text.split()).removeprefix("/statistics/")
        if len(self.text) > LETTERS:
            raise self.fault(f"expected an expression of at most {LETTERS} letters, got {len(self.text)}")
        self._numbers, self._leaves = {}, {}  # name in the tree: Quantity with its text; path or name
        text = self._pythonic()
        try:
            self._tree = ast.parse(text, mode="eval").body
        except (SyntaxError, RecursionError, ValueError, MemoryError):
            raise self.fault("expected an expression such as 'rate_above(1 mJ) / power'") from None
        self._check(self._tree)

    def fault(self, why) -> UserError:
        return UserError(f"'{self.text[:80]}': {why}")

    def _pythonic(self) -> str:
        """The text with a Python name for every number with its unit, and for every path."""
        out, at = [], 0
        while at < len(self.text):
            found = TOKENS.match(self.text, at)
            if not found:
                raise self.fault(f"'{self.text[at]}' has no meaning here")
            number, word, space, sign = found.groups()
            at = found.end()
            if number:
                at, quantity = self._number(number, at)
                name = f"n{len(self._numbers)}_"
                self._numbers[name] = quantity, self.text[found.start() : at].strip()
                out.append(name)
            elif word:
                first = re.match(r"\w+", word)[0]
                if first not in NAMES:  # so does one behind a key, section.key
                    first = (re.match(rf"{DOTTED.pattern}(?=/)", word) or [word])[0]
                if first != word:  # a slash behind a name divides
                    word, at = first, found.start() + len(first)
                name = f"p{len(self._leaves)}_"
                self._leaves[name] = word
                out.append(name)
            else:
                out.append(sign or " ")
        return "".join(out)

    def _number(self, number, at):
        """The place behind a number with its unit, and the number in SI."""
        found = UNIT.match(self.text, at)
        text = found[1] if found else ""
        while text:
            try:
                size, powers = unit_of(text)
                at += found[0].index(found[1]) + len(text)
                break
            except KeyError as fault:
                shorter = re.match(r"(.*)[./*]", text)
                if not shorter and text[0] not in "1/":
                    raise self.fault(
                        f"unknown unit '{fault.args[0]}' behind {number}; there are mJ, W, m/s, kg, s ..."
                    ) from None
                text = shorter[1] if shorter else ""
        else:
            size, powers = 1.0, PLAIN
        if not (math.isfinite(float(number) * size) and size):
            raise self.fault(f"the number {number} {text}".rstrip() + " is too large or too small")
        return at, Quantity(float(number) * size, powers)

    def _check(self, node):
        """UserError for a tree with other parts than an expression has."""
        if isinstance(node, ast.BinOp) and type(node.op) in SIGNS:
            self._check(node.left)
            self._check(node.right)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            self._check(node.operand)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            self._check_call(node)
        elif isinstance(node, ast.Name) and node.id in self._leaves:
            name = self._leaves[node.id]
            if name == "rate_above":
                raise self.fault("rate_above needs a speed or an energy, such as rate_above(1 mJ)")
            if name not in NAMES and not re.search("[/.]", name):
                raise self.fault(f"unknown name '{name}'; there are {SHOWN}")
        elif not (isinstance(node, ast.Name) and node.id in self._numbers):
            raise self.fault("expected numbers, names, + - * / and parentheses")

    def _check_call(self, node):
        name, given = self._leaves.get(node.func.id, ""), list(node.args)
        if name in FUNCTIONS:
            if len(given) != 1 if name == "abs" else len(given) < 2:
                raise self.fault("expected abs(a), min(a, b) or max(a, b)")
            for one in given:
                self._check(one)
            return
        if name == "rate_above":
            limit = self._numbers.get(getattr(given.pop(0), "id", "") if given else "")
            powers = limit[0].powers if limit else ()
            if powers not in (UNITS["J"][1], unit_of("m/s")[1]) or not limit[0].value > 0:
                raise self.fault("rate_above needs a speed or an energy, such as rate_above(1 mJ) or rate_above(1 m/s)")
        elif "KIND" not in NAMES.get(name, ("",))[0]:
            raise self.fault(f"'{name}' takes nothing in parentheses; there are {SHOWN}")
        if len(given) > 1 or not all(isinstance(one, ast.Name) and one.id in self._leaves for one in given):
            raise self.fault(f"expected the name of one kind of contact in {name}(...), such as ball_ball")

    # ---- values

    def of(self, results: Results) -> Quantity:
        """The value; UserError for a part that these results do not have, and for units that do not fit. An angle is a
        plain number."""
        return self._value(self._tree, results)

    def at(self, look) -> Quantity:
        """The value of an expression of keys; look(name) is the Quantity of a key, with KeyError for other names. An
        angle is none: rad/s and Hz differ."""
        return self._value(self._tree, look)

    @property
    def keys(self) -> list[str]:
        """The names in it that may be keys, section.key."""
        return [name for name in dict.fromkeys(self._leaves.values()) if DOTTED.fullmatch(name)]

    @property
    def computes(self) -> bool:
        """Whether it is more than one name or number."""
        return not isinstance(self._tree, ast.Name)

    def _alike(self, *several):
        """UserError if quantities have different units."""
        if len({felt(one.powers) for one in several}) > 1:
            units = " and ".join(dict.fromkeys(spoken_unit(one.unit) or "a plain number" for one in several))
            raise self.fault(f"{units} cannot be added or compared")

    def _value(self, node, results):
        if isinstance(node, ast.BinOp):
            a, b = self._value(node.left, results), self._value(node.right, results)
            if isinstance(node.op, (ast.Add, ast.Sub)):
                self._alike(a, b)
            if isinstance(node.op, ast.Div) and not b.value and not b.shares:
                raise self.fault("divides by zero")
            return SIGNS[type(node.op)](a, b)
        if isinstance(node, ast.UnaryOp):
            return Quantity(-1.0) * self._value(node.operand, results)
        if isinstance(node, ast.Name) and node.id in self._numbers:
            number = self._numbers[node.id][0]
            return number if callable(results) else _turned(number)
        if self._function(node):
            values = [self._value(one, results) for one in node.args]
            self._alike(*values)
            return FUNCTIONS[self._function(node)](*values)
        name, arguments = self._parts(node)
        if callable(results):
            try:
                return results(name)
            except KeyError as fault:
                raise self.fault(fault.args[0]) from None
        return self._leaf(name, arguments, results)

    def _function(self, node):
        """The name in FUNCTIONS that is called; "" for other nodes."""
        name = self._leaves.get(node.func.id, "") if isinstance(node, ast.Call) else ""
        return name if name in FUNCTIONS else ""

    def _parts(self, node):
        """Name and arguments of a leaf: names of kinds, or numbers of self._numbers."""
        if isinstance(node, ast.Name):
            return self._leaves[node.id], []
        return self._leaves[node.func.id], [self._numbers.get(a.id) or self._leaves[a.id] for a in node.args]

    def _leaf(self, name, arguments, results):
        kind = next((one for one in arguments if isinstance(one, str)), "all")
        if kind not in results.kinds:
            raise self.fault(f"there is no kind of contact '{kind}'; there are {', '.join(results.kinds)}")
        if name == "mass":
            return Quantity(results.data["mass"], UNITS["g"][1], own="kg")
        if name == "rate_above":
            limit = arguments[0][0]
            unit = "J" if limit.powers[0] else "m/s"
            value, *known = results.above(limit.value, unit, kind)
            name = f"{kind} above {limit.value:g} {unit}"
            return Quantity.told(value, UNITS["Hz"][1], "s-1", name, *known, results)
        path = NAMES[name][0].replace("KIND", kind) if name in NAMES else name.replace(".", "/")
        path = path if path in results.units else OTHERS.get(path, path)
        try:
            value, error = results.scalar(path)
            size, powers = unit_of(results.units[path])
            if size != 1:  # the files of runs have SI units
                raise KeyError(path)
        except KeyError:
            hint = "; keys of the deck cannot be used with results" if "." in name else _hint(path, results)
            raise self.fault(f"'{path}' is not a scalar of /statistics in this run{hint}") from None
        own = results.units[path]
        return _turned(Quantity.told(value, powers, own, path, error, results.history(path), results))

    # ---- in words

    @property
    def words(self) -> str:
        """The expression as people say it: "impacts of 1 mJ or more per joule"."""
        return self._words(self._tree)

    @property
    def ratio(self) -> "tuple[Expression, Expression] | None":
        """Numerator and denominator of a quotient; None for others."""
        tree = self._tree
        if not (isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Div)):
            return None
        parts = [self._text(node) for node in (tree.left, tree.right)]
        if any(isinstance(node, ast.Name) and node.id in self._numbers for node in (tree.left, tree.right)):
            return None
        return Expression(parts[0]), Expression(parts[1])

    def _text(self, node, within=False) -> str:
        if isinstance(node, ast.BinOp):
            sign = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}[type(node.op)]
            text = f"{self._text(node.left, True)} {sign} {self._text(node.right, True)}"
            return f"({text})" if within else text
        if isinstance(node, ast.UnaryOp):
            return f"-{self._text(node.operand, True)}"
        if isinstance(node, ast.Name) and node.id in self._numbers:
            return self._numbers[node.id][1]
        if name := self._function(node):
            return f"{name}({', '.join(map(self._text, node.args))})"
        name, arguments = self._parts(node)
        inner = ", ".join(one if isinstance(one, str) else one[1] for one in arguments)
        return f"{name}({inner})" if inner else name

    def _words(self, node) -> str:
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
            a, b = self._words(node.left), self._words(node.right)
            if b == "power" and a.startswith("rate of "):
                return f"{a.removeprefix('rate of ')} per joule"
            return f"{a} per {b}"
        if (
            isinstance(node, (ast.BinOp, ast.UnaryOp))
            or self._function(node)
            or (isinstance(node, ast.Name) and node.id in self._numbers)
        ):
            return self._text(node, True)
        name, arguments = self._parts(node)
        kind = next((one for one in arguments if isinstance(one, str)), "all")
        words = NAMES[name][1] if name in NAMES else WORDS.get(name)
        if name not in NAMES and words is None:
            kind = (re.match(r"impacts/(\w+)/", name) or ["", "all"])[1]
            words = WORDS.get(name.replace(f"/{kind}/", "/KIND/")) or re.sub("[./_]", " ", name)
        if kind != "all":
            label = kind.replace("ball_", "ball-")
            words = re.sub(r"\bimpacts?\b", lambda m: f"{label} {m[0]}", words, count=1) \
                if "impact" in words else f"{words} ({label})"  # fmt: skip
        return words.replace("...", arguments[0][1]) if name == "rate_above" else words


def felt(powers):
    """Exponents with which quantities may be added: a speed is an angular speed times a length."""
    return powers if not any(powers[:2]) else (*powers[:4], 0)


def _turned(one: Quantity) -> Quantity:
    """A quantity whose angle is a plain number."""
    return dataclasses.replace(one, powers=(*one.powers[:4], 0))


NEEDS = {
    "dose": "[powder] or [heat] of the deck, such as powder.mass",
    "wear": "wear.archard and wear.hardness, or wear.erosion",
}  # fmt: skip


def _hint(path, results) -> str:
    import difflib

    section = path.partition("/")[0]
    if section in NEEDS and not difflib.get_close_matches(path, results.units, 1, 0.9):
        return f": {results.data.get('without', {}).get(section) or f'it needs {NEEDS[section]}'}"
    near = difflib.get_close_matches(path, results.units, 1, 0.6)
    return f"; did you mean '{near[0]}'?" if near else ""


@functools.lru_cache(maxsize=256)
def parsed(text: str) -> Expression:
    """Expression(text), each text parsed once."""
    return Expression(text)


# ---- lists and requirements


def split(text: str) -> list[str]:
    """The parts of a list of expressions: commas within parentheses do not divide."""
    parts, depth = [""], 0
    for letter in text:
        depth = max(depth + (letter == "(") - (letter == ")"), 0)
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def sides(text: str) -> tuple[Expression, int, Expression]:
    """Left side, sign (+1: at most, -1: at least) and right side of a requirement. UserError for another text."""
    found = re.fullmatch(r"(.+?)(<=|>=|=<|=>|<|>)(.+)", " ".join(text.split()))
    if not found:
        raise UserError(f"expected a requirement such as 'power <= 225 W', got '{text[:80]}'")
    return parsed(found[1].strip()), 1 if "<" in found[2] else -1, parsed(found[3].strip())


def keys_of(text: str) -> list[str]:
    """The names in a requirement that may be keys."""
    left, _, right = sides(text)
    return [*left.keys, *right.keys]


@dataclasses.dataclass(frozen=True)
class Requirement:
    """`expression` at most (sign +1) or at least (-1) `limit` [SI]; `text` as written."""

    text: str
    expression: Expression
    sign: int
    limit: float

    @classmethod
    def read(cls, text: str) -> "Requirement":
        """UserError for a text that is not such as 'power <= 225 W'."""
        left, sign, right = sides(text)
        if right._leaves or not right._numbers:
            raise UserError(f"'{text[:80]}': expected a number with its unit on the right, such as 225 W")
        limit = right._value(right._tree, None)
        if not math.isfinite(limit.value):
            raise UserError(f"'{text[:80]}': the limit is too large")
        return cls(f"{left.text} {'<=' if sign > 0 else '>='} {right.text}", left, sign, limit.value)

    def excess(self, results: Results | None) -> tuple[float, float]:
        """By how much results violate it (below 0: met), with the standard error; NaN without results."""
        if results is None:
            return math.nan, math.nan
        found = self.expression.of(results)
        return self.sign * (found.value - self.limit), found.error

    def check(self, results: Results):
        """UserError if the units of both sides differ."""
        value, limit = self.expression.of(results), parsed(self.text.split("= ")[-1])
        if value.own == "rad" and self.limit and not any(one.powers[4] for one, _ in limit._numbers.values()):
            raise UserError(f"'{self.text}': {self.expression.text} is an angle: give the limit in deg or rad")
        if value.powers != limit._value(limit._tree, None).powers:
            unit = spoken_unit(value.unit) or "a plain number"
            raise UserError(f"'{self.text}': {self.expression.text} has the unit {unit}, and the limit has another one")


@functools.cache
def excess(packed: str, texts: tuple[str, ...]) -> tuple:
    """Requirement.excess of every requirement, from packed Results; each run is unpacked once."""
    results = Results.unpack(packed) if texts else None
    return tuple(Requirement.read(text).excess(results) for text in texts)
