"""Reads the text of a deck or study deck into entries with their lines. docs/deck.md describes the syntax."""

import dataclasses
import re

from milltools.base.errors import UserError
from milltools.base.files import faults, opened

BLANK = " \t"  # other white space is part of a name, as for millsim
LISTS = ("maximise", "minimise", "require", "record")  # keys of [study] that may have several lines


@dataclasses.dataclass(frozen=True)
class Entry:
    """`key = value` of a section; `where` is its place for messages: "FILE:LINE" or "--set ..."."""

    section: str
    key: str
    value: str
    where: str
    line: int = 0  # number in the file, from 1; 0: not from a file

    def fault(self, text) -> UserError:
        return UserError(f"{self.where}: [{self.section}] {self.key}: {text}")


def read_text(path) -> str:
    """The text of a file; UserError if it cannot be read."""
    try:
        with opened(path, "a deck", "r", encoding="utf-8-sig", newline="") as file, faults(path):
            text = file.read().replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise UserError(f"{path}: is not a UTF-8 text") from None
    if "\0" in text:
        raise UserError(f"{path}: holds the control character 0x00: a deck is plain text")
    return text


def _value(text, where) -> str:
    """A value without its comment. In a value in double quotes, "" stands for one "."""
    if text.startswith('"'):
        quoted = re.match(r'"((?:[^"]|"")*)"(?:[ \t]+(?:[#;].*)?)?$', text)
        if not quoted:
            raise UserError(f"{where}: the closing '\"' of the value is missing")
        return quoted.group(1).replace('""', '"')
    return re.split(r"(?:^|[ \t])[#;]", text, maxsplit=1)[0].strip(BLANK)


def sections(text, file) -> dict[str, dict[str, str]]:
    """{section: {key: value}} of a text."""
    found: dict[str, dict[str, str]] = {}
    for one in entries(text, file):
        found.setdefault(one.section, {})[one.key] = one.value
    return found


def entries(text, file) -> list[Entry]:
    """All entries of a text, in their order. Comments begin with # or ; at the start of a line or after white space. A
    section or key that is there twice is a UserError, but for LISTS."""
    found, section, seen = [], None, {}
    for number, line in enumerate(text.split("\n"), 1):  # other separators of lines are none for millsim
        where, line = f"{file}:{number}", line.strip(BLANK)
        if not line or line[0] in "#;":
            continue
        if line.startswith("["):
            title = re.split(r"[ \t][#;]", line, maxsplit=1)[0].strip(BLANK)
            if not title.endswith("]"):
                raise UserError(f"{where}: expected '[section]', got '{line[:80]}'")
            section = title[1:-1].strip(BLANK)
            if section in seen:
                raise UserError(f"{where}: [{section}]: is given twice (first in line {seen[section]})")
            seen[section] = number
            continue
        key, equals, value = line.partition("=")
        key = key.strip(BLANK)
        if not equals or not key:
            raise UserError(f"{where}: expected '[section]' or 'key = value', got '{line[:80]}'")
        if section is None:
            raise UserError(f"{where}: {key}: stands before the first [section]")
        if (section, key) in seen and not (section == "study" and key in LISTS):
            raise UserError(f"{where}: [{section}] {key}: is given twice (first in line {seen[section, key]})")
        seen[section, key] = number
        found.append(Entry(section, key, _value(value.strip(BLANK), where), where, number))
    return found
