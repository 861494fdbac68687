"""Decks as dictionaries: {"rotor": {"speed": "1500 rpm"}, "contact": {"restitution": 0.8}}.

docs/deck.md lists sections and keys. A value is a text as in the deck, with its unit, or a number if the key is
dimensionless. This module does not check units, keys or defaults: millsim does, and errors contain its message.
"""

import numbers
import os
import pathlib
from collections.abc import Mapping
from typing import SupportsFloat

from milltools.base.errors import InputError, MillsimError, MissingFileError
from milltools.base.files import write_text
from milltools.read.deck import Deck

START = "balls.start"  # the one key that names a file
Value = str | SupportsFloat | os.PathLike[str]
Sections = Mapping[str, Mapping[str, Value]]


def _value(key: str, value: object) -> str:
    """A value as written in a deck."""
    if isinstance(value, numbers.Integral) and not isinstance(value, bool):
        return str(int(value))
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return repr(float(value))
    if key == START and isinstance(value, os.PathLike):
        value = os.fspath(value)
    if not isinstance(value, str):
        what = type(value).__name__
        raise InputError(f"{key}: expected a text such as '1500 rpm', or a number, got {what}")
    return _one_line(key, value)


def _one_line(name: str, text: str) -> str:
    if any(ord(c) < 32 and c != "\t" for c in text):
        raise InputError(f"{text!r} ({name}): expected one line of plain text")
    return text


def as_text(deck: Sections) -> str:
    """The text of a deck from a dictionary of sections; sections and keys keep their order."""
    found = []
    for section, keys in deck.items():
        if not isinstance(keys, Mapping):
            what = type(keys).__name__
            raise InputError(f"{section}: expected a dictionary of keys, such as {{'speed': '1500 rpm'}}, got {what}")
        found.append(f"[{_one_line('a section', str(section))}]")
        for key, value in keys.items():
            text = _value(f"{section}.{key}", value)
            if f"{section}.{key}" == START and text != "random":
                text = '"' + text.replace('"', '""') + '"'
            found.append(f"{_one_line('a key', str(key))} = {text}")
        found.append("")
    return "\n".join(found)


def text_of(deck: object) -> str | None:
    """The text of a deck that is given as a text or a dictionary; None for other types, such as a path."""
    if isinstance(deck, Mapping):
        return as_text(deck)
    return deck if isinstance(deck, str) and ("\n" in deck or deck.lstrip().startswith("[")) else None


def override(name: str, value: object) -> str:
    """`rotor__speed` or `rotor.speed` and a value in the form of millsim's --set: "rotor.speed=1500 rpm"."""
    key = name if "." in name else name.replace("__", ".")
    if "." not in key:
        raise TypeError(
            f"unexpected keyword argument '{name}': keys of the deck are spelled section__key, such as "
            "rotor__speed='1500 rpm'"
        )
    return f"{_one_line('a key', key)}={_value(key, value)}"


def read_deck(path: str | os.PathLike[str], **overrides: Value) -> dict[str, dict[str, str]]:
    """The deck at `path` as millsim reads it: {section: {key: text}} with all defaults, in SI units.

    Keyword arguments override keys as in `run`: read_deck("mill.ini", rotor__speed="1500 rpm"). InputError if it is
    wrong, MissingFileError if it does not exist.
    """
    sets = [override(name, value) for name, value in overrides.items()]
    try:
        return Deck.check(os.fspath(path), sets).sections
    except MillsimError as fault:
        raise located(fault, path) from None


def located(fault: MillsimError, path: str | os.PathLike[str]) -> MillsimError:
    """Raises millsim's message about a deck; a missing file is a MissingFileError."""
    return fault if os.path.exists(path) else MissingFileError(fault, fault.status)


def write_deck(deck: Sections, path: str | os.PathLike[str], *, force: bool = False) -> None:
    """Writes a dictionary of sections as a deck; an existing file is replaced only with `force`. The content is not
    checked: `run` and `read_deck` do this. MillsimError with status 1 if it cannot be written."""
    text = as_text(deck)
    if pathlib.Path(path).exists() and not force:
        raise InputError(f"{path}: exists already; force=True overwrites it")
    write_text(path, text)
