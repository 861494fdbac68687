"""Decks as dictionaries: {"rotor": {"speed": "1500 rpm"}, "contact": {"restitution": 0.8}}.

Section and key are those of docs/deck.md. A value is a text as in the deck, with its unit, or a number where the key is
dimensionless. Nothing here knows units, keys or defaults: millsim reads them, and what is wrong is its own line.
"""

import numbers
import os
import pathlib
from collections.abc import Mapping

from milltools.base.errors import UserError
from milltools.read import deck_text as lines
from milltools.read.deck import Deck

START = "balls.start"  # the one key that names a file


def _value(key: str, value) -> str:
    """A value as a deck has it."""
    if isinstance(value, numbers.Integral) and not isinstance(value, bool):
        return str(int(value))
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return repr(float(value))
    if key == START and isinstance(value, os.PathLike):
        value = os.fspath(value)
    if not isinstance(value, str):
        what = type(value).__name__
        raise UserError(f"{key}: expected a text such as '1500 rpm', or a number, got {what}")
    return _one_line(key, value)


def _one_line(name: str, text: str) -> str:
    if any(ord(c) < 32 and c != "\t" for c in text):
        raise UserError(f"{text!r} ({name}): expected one line of plain text")
    return text


def _pairs(deck: Mapping):
    """(section, key, value as text) of a dictionary, checked for its form alone."""
    for section, keys in deck.items():
        if not isinstance(keys, Mapping):
            what = type(keys).__name__
            raise UserError(f"{section}: expected a dictionary of keys, such as {{'speed': '1500 rpm'}}, got {what}")
        for key, value in keys.items():
            yield str(section), str(key), _value(f"{section}.{key}", value)


def as_text(deck: Mapping) -> str:
    """The text of a deck given as a dictionary of sections; sections and keys in its order."""
    found = []
    for section, keys in deck.items():
        found.append(f"[{_one_line('a section', str(section))}]")
        for _, key, value in _pairs({section: keys}):
            if f"{section}.{key}" == START and value != "random":
                value = '"' + value.replace('"', '""') + '"'
            found.append(f"{_one_line('a key', key)} = {value}")
        found.append("")
    return "\n".join(found)


def override(name: str, value) -> str:
    """`rotor__speed` or `rotor.speed` and a value as millsim's --set takes them: "rotor.speed=1500 rpm"."""
    key = name if "." in name else name.replace("__", ".")
    if "." not in key:
        raise TypeError(
            f"unexpected keyword argument '{name}': keys of the deck are spelled section__key, such as rotor__speed='1500 rpm'"
        )
    return f"{_one_line('a key', key)}={_value(key, value)}"


def start_of(text: str) -> str | None:
    """The start file that a deck's text names; None if there is none, or if the text is not a deck."""
    try:
        entries = lines.entries(text, "deck")
    except UserError:
        return None  # millsim says it better
    named = [one.value for one in entries if f"{one.section}.{one.key}" == START]
    return named[0] if named and named[0] != "random" else None


def read_deck(path, **overrides) -> dict[str, dict[str, str]]:
    """The deck at `path` as millsim understands it: {section: {key: text}}, every default filled in, in SI units.

    Keyword arguments override keys as in `run`: read_deck("mill.ini", rotor__speed="1500 rpm"). UserError if it is wrong.
    """
    sets = [override(name, value) for name, value in overrides.items()]
    return sections(Deck.check(os.fspath(path), sets).text)


def sections(text: str) -> dict[str, dict[str, str]]:
    """{section: {key: text}} of the text of a deck."""
    found: dict[str, dict[str, str]] = {}
    for one in lines.entries(text, "deck"):
        found.setdefault(one.section, {})[one.key] = one.value
    return found


def write_deck(deck: Mapping, path, *, force: bool = False) -> None:
    """Writes a dictionary of sections as a deck; one that is there is kept without `force`. What it says is not checked:
    `run` and `read_deck` do that. UserError with status 1 if it cannot be written."""
    text, path = as_text(deck), pathlib.Path(path)
    if path.exists() and not force:
        raise UserError(f"{path}: exists already; force=True overwrites it")
    draft = path.with_name(f"{path.name}.part")
    try:
        draft.write_text(text, encoding="utf-8")
        os.replace(draft, path)
    except OSError as fault:
        draft.unlink(missing_ok=True)
        raise UserError(f"{path}: {fault.strerror}", status=1) from None
