"""STL, binary and ASCII, by the rules of millsim."""

import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain, plural
from milltools.geometry.stl import FACET, HEAD
from milltools.mesh.parts import MOST_PARTS, Foreign, Part, check_count, soup

NUMBER = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"  # takes time in proportion to its length, always
VERTEX = rb"vertex\s+(%s)\s+(%s)\s+(%s)\s+" % (NUMBER, NUMBER, NUMBER)
TEXT_FACET = re.compile(
    rb"\s*facet\s+normal\s+\S+\s+\S+\s+\S+\s+outer\s+loop\s+" + 3 * VERTEX + rb"endloop\s+endfacet(?!\S)", re.I
)
SOLID, ENDSOLID = (re.compile(rb"\s*%s(?!\S)[^\r\n]*" % word, re.I) for word in (b"solid", b"endsolid"))
END = re.compile(rb"\s*\Z")


def stl(path, data) -> Foreign:
    """Binary if the size agrees with the number of facets, as millsim decides; here a few bytes may follow them."""
    count = int.from_bytes(data[80:84], "little")
    is_text = data[:100].lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" and b"\0" not in data[:1000]
    excess = len(data) - 84 - 50 * count
    if len(data) >= 84 and 0 <= excess < (1 if is_text else 50):
        check_count(path, count)
        rows = np.frombuffer(data, FACET, count, HEAD)
        notes = [f"{plural(excess, 'byte')} after the last facet left out"] if excess else []
        return Foreign(path, [soup("", rows["corners"])], notes=notes)
    if is_text:
        return Foreign(path, _ascii(path, data))
    if len(data) < 84:
        raise UserError(f"{plain(path)}: is not an STL file: it has {len(data)} bytes, and does not begin with 'solid'")
    raise UserError(
        f"{plain(path)}: is not a complete STL file: the {count} facets in its bytes 81 to 84 need {84 + 50 * count} "
        f"bytes, but it has {len(data)}; export it again"
    )


def _ascii(path, data) -> list[Part]:
    parts, at, total = [], 3 * data.startswith(b"\xef\xbb\xbf"), 0
    while not END.match(data, at):
        at = _expect(path, data, at, SOLID, "'solid'").end()
        numbers = []
        while found := TEXT_FACET.match(data, at):
            numbers.append(np.array(found.groups(), "S").astype("<f8"))
            at = found.end()
            check_count(path, total + len(numbers))
        at = _expect(path, data, at, ENDSOLID, "'endsolid' or a whole facet").end()
        total += len(numbers)
        parts.append(soup("", np.array(numbers).reshape(-1, 3, 3)))
        if len(parts) > MOST_PARTS:
            raise UserError(f"{plain(path)}: more than {MOST_PARTS} solids")
    return parts


def _expect(path, data, at, pattern, what):
    found = pattern.match(data, at)
    if not found:
        rest = data[at : at + 200].lstrip()
        line = data.count(b"\n", 0, at + len(data[at : at + 200]) - len(rest)) + 1
        got = plain(rest.split(b"\n")[0].decode(errors="replace").strip())[:60]
        raise UserError(f"{plain(path)}:{line}: expected {what}, got '{got}': it is damaged; export it again")
    return found
