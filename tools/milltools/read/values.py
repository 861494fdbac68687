"""Reads values of deck keys through `millsim --value`: Python itself interprets no units."""

import contextlib
import dataclasses
import math
import re

from milltools.base import engine
from milltools.base.errors import UserError

ANY = "any_of_them"  # stands for * in a key
COMPONENT = re.compile(r"(.+)\.([123])")  # of a vector: body.lifter.size.2
AT_ONCE = 2000  # values on one command line


@dataclasses.dataclass(frozen=True)
class Value:
    """One value of a deck key. `text`: its number in SI (or word, or file name), with enough digits for the same
    bits."""

    key: str  # section.key
    kind: str  # number, whole, choice, vector or file
    text: str
    unit: str  # SI; "1" for a plain number
    meaning: str
    choices: tuple[str, ...]  # all words of a choice; those that stand for no file

    @property
    def value(self):
        """In SI: float, int or str."""
        if self.kind == "number":
            return float(self.text)
        return int(self.text) if self.kind == "whole" else self.text

    @property
    def is_file(self) -> bool:
        """Whether it names a file."""
        return self.kind == "file" and self.text not in self.choices

    @property
    def order(self) -> str:
        """The value in the form of the option `--set`."""
        return order(self.key, self.text, self.unit)


def order(key, text, unit) -> str:
    """`section.key=value unit`, the form of the option `--set`."""
    return f"{key}={text}" if unit == "1" else f"{key}={text} {unit}"


def component_of(key) -> tuple[str, int] | None:
    """The key of the vector and the place (from 0) of a component such as body.lifter.size.2; None for other keys."""
    found = COMPONENT.fullmatch(key)
    return (found[1], int(found[2]) - 1) if found else None


def tell(orders) -> list[Value]:
    """The Value of each "section.key=text"; a component of a vector is a number. For a wrong one a UserError with
    millsim's own message: "[rotor] speed: expected ..."."""
    found, orders = [], list(orders)
    for start in range(0, len(orders), AT_ONCE):
        part = orders[start : start + AT_ONCE]
        try:
            said = engine.ask(*(f"--value={_single(text)}" for text in part))
        except UserError as fault:
            if fault.status == 2 and any(map(component_of, (text.partition("=")[0].strip() for text in part))):
                _blame(part, fault)
            raise UserError(
                _plain(str(fault).replace(f".{ANY}", ".*")), 1 if fault.status in (1, 126, 127) else 2
            ) from None
        for asked, line in zip(part, said.split("\n")):
            _, kind, text, unit, meaning, choices = line.split("\t")
            key = asked.partition("=")[0].strip()
            if part_of := component_of(key):
                if kind != "vector":
                    _blame([asked])
                kind, text, meaning = "number", text.split()[part_of[1]], f"{meaning} (component {part_of[1] + 1})"
            found.append(Value(key, kind, text, unit, meaning, tuple(filter(None, choices.split("|")))))
    return found


def _blame(orders, fault=None):
    """A UserError for the first of these that is a wrong component; `fault` is that of all of them."""
    for text in orders if len(orders) > 1 else ():
        tell([text])
    key, _, value = orders[0].partition("=")
    if len(orders) == 1 and "must be" not in str(fault):
        section, _, name = key.strip().rpartition(".")
        what = f"expected one component of a vector such as '20 mm', got '{value.strip()}'"
        raise UserError(f"[{section}] {name}: {what}")


def _single(text: str) -> str:
    """What millsim reads: the key of one section for one of several, such as blade.*.pitch; for a component the vector
    of which each component has this value (of a direction, which has no unit, the others are 1)."""
    key, equals, value = text.partition("=")
    if part_of := component_of(key.strip()):
        key, place = part_of
        number, unit = re.fullmatch(r"\s*([-+.\deE]*)(.*)", value, re.S).groups()
        value = " ".join(number if unit.strip() or k == place else "1" for k in range(3)) + f" {unit.strip()}"
    return key.replace(".*", f".{ANY}") + equals + value


def seconds(asked: dict, negative: bool = False) -> list:
    """The times [s] of options {"--from": "120 ms", "--to": None}, in their order. A plain number is in seconds; None
    stays None. A wrong text, or a time below 0 unless `negative`, is a UserError that names the option."""
    return _read(asked, "output.frames", "a time such as '120 ms'", negative)


def metres(asked: dict) -> list:
    """Like `seconds`, for lengths [m]."""
    return _read(asked, "rotor.shaft_radius", "a length such as '0.1 mm'", False)


def _read(asked, key, expected, negative):
    """`key`: a deck key that accepts all values of this unit from 0 on."""
    found = {}
    for option, text in asked.items():
        with contextlib.suppress(ValueError):
            found[option] = None if text is None else float(text)
    with_unit = {option: text.strip() for option, text in asked.items() if option not in found}
    try:
        told = tell(f"{key}={text.removeprefix('-')}" for text in with_unit.values())
    except UserError as fault:
        if fault.status != 2:
            raise
        if len(asked) > 1:  # one of them is wrong
            return [_read({option: text}, key, expected, negative)[0] for option, text in asked.items()]
        if limit := str(fault).partition(": must be ")[2]:
            raise UserError(f"{next(iter(asked))}: must be {limit}") from None
        told = []
    found |= {o: -one.value if text[0] == "-" else one.value for (o, text), one in zip(with_unit.items(), told)}
    for option, text in asked.items():
        value = found.get(option, math.nan)
        if text is not None and not (math.isfinite(value) and (negative or value >= 0)):
            words = "must be 0 or more" if value < 0 else f"expected {expected}"
            raise UserError(f"{option}: {words}, got '{text}'")
    return [found[option] for option in asked]


def _plain(text) -> str:
    """millsim's message without the option --value: the caller adds the line of the file."""
    if not text.startswith("--value "):
        return text
    head, bracket, rest = text.partition(": [")
    return "[" + rest if bracket else text.split(": ", 1)[-1]
