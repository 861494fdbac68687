"""PLY, the Stanford format: ASCII, or binary of either byte order; elements of any properties. Only the points of
`vertex` and the corners of `face` are used."""

import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.mesh.parts import MOST_FACETS, Foreign, polygons

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
LONGEST = 10_000  # bytes of the head
CORNERS = ("vertex_indices", "vertex_index")


@dataclasses.dataclass
class Element:
    """`properties`: (name, type, type of the length of a list or None)."""

    name: str
    count: int
    properties: list


def ply(path, data) -> Foreign:
    fault = lambda what: UserError(f"{plain(path)}: {what}")  # noqa: E731
    order, elements, at = _head(data, fault)
    rows = _Words(data[at:].split(), fault) if order == "" else _Bytes(data, at, order, fault)
    points, faces = np.empty((0, 3)), []
    for element in elements:
        names = [name for name, *_ in element.properties]
        if element.name == "vertex":
            if not {"x", "y", "z"} <= set(names):
                raise fault("its points have no x, y and z")
            points = rows.columns(element, ("x", "y", "z"))
        elif element.name == "face":
            named = [n for n, kind, length in element.properties if length and kind[0] != "f" and n in CORNERS]
            if not named:
                raise fault(f"its faces have no list {' or '.join(CORNERS)}")
            if element.count > MOST_FACETS:
                raise fault(f"more than {MOST_FACETS} faces: simplify the mesh")
            faces = rows.lists(element, named[0])
        elif element.name == "tristrips":
            raise fault("has strips of triangles: export it with faces")
        else:
            rows.lists(element, None)
    if any(len(face) < 3 or min(face) < 0 for face in faces):
        raise fault("a face has fewer than three corners, or one that is not in the file: export it again")
    return Foreign(path, [polygons(path, "", points, faces)])


def _head(data, fault):
    """(byte order, elements, where they begin)"""
    end = data.find(b"end_header", 0, LONGEST)
    stop = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or stop < 0:
        raise fault("is not a complete PLY file: it has no head from 'ply' to 'end_header'")
    order, elements = None, []
    for line in data[:end].decode("ascii", "replace").splitlines()[1:]:
        match line.split():
            case ["format", name, _] if name in ORDERS:
                order = ORDERS[name]
            case ["element", name, count] if count.isdecimal():
                elements.append(Element(name, int(count[:18]), []))
            case ["property", "list", length, kind, name] if (
                elements and kind in TYPES and TYPES.get(length, "f")[0] != "f"
            ):
                elements[-1].properties.append((name, TYPES[kind], TYPES[length]))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append((name, TYPES[kind], None))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise fault(f"'{plain(line)[:60]}' in its head is not of the PLY format")
    if order is None:
        raise fault("its head has no line 'format'")
    return order, elements, stop + 1


class _Words:
    """The elements of an ASCII file."""

    def __init__(self, words, fault):
        self.words, self.at, self.fault = words, 0, fault

    def _take(self, count):
        if not 0 <= count <= len(self.words) - self.at:
            raise self.fault("ends before its last element: it is incomplete; export it again")
        self.at += count
        return self.words[self.at - count : self.at]

    def _number(self, word, kind):
        try:
            return float(word) if kind[0] == "f" else int(word)
        except ValueError:
            raise self.fault(f"expected a number, got '{plain(word.decode(errors='replace'))[:60]}'") from None

    def lists(self, element, wanted):
        """The values of the wanted list of all rows."""
        found = []
        if not element.properties:
            return found
        for _ in range(element.count):
            for name, kind, length in element.properties:
                many = self._number(self._take(1)[0], length) if length else 1
                values = self._take(many)
                if name == wanted:
                    found.append([self._number(word, kind) for word in values])
        return found

    def columns(self, element, names):
        if any(length for *_, length in element.properties):
            raise self.fault("its points have lists: export it without them")
        columns = [name for name, *_ in element.properties]
        rows = self._take(element.count * len(columns))
        picked = [[self._number(word, "f8") for word in rows[columns.index(name) :: len(columns)]] for name in names]
        return np.array(picked, "<f8").T


class _Bytes:
    """The elements of a binary file."""

    def __init__(self, data, at, order, fault):
        self.data, self.at, self.order, self.fault = data, at, order, fault

    def _rows(self, kinds, count):
        row = np.dtype(kinds)
        if count * row.itemsize > len(self.data) - self.at:
            raise self.fault("ends before its last element: it is incomplete; export it again")
        self.at += count * row.itemsize
        return np.frombuffer(self.data, row, count, self.at - count * row.itemsize)

    def columns(self, element, names):
        if any(length for *_, length in element.properties):
            raise self.fault("its points have lists: export it without them")
        kinds = [(f"{k}", self.order + kind) for k, (_, kind, _) in enumerate(element.properties)]
        rows = self._rows(kinds, element.count)
        columns = [name for name, *_ in element.properties]
        with np.errstate(invalid="ignore"):  # not a number: refused later
            return np.stack([rows[f"{columns.index(name)}"].astype("<f8") for name in names], axis=1)

    def lists(self, element, wanted):
        """The values of the wanted list of all rows. Rows whose lists are as long as those of the row before are read
        together, as most files have triangles alone."""
        found, done, batch = [], 0, 1
        while done < element.count and element.properties:
            start = self.at
            lengths, kinds = self._lengths(element), []
            for k, ((_, kind, length), many) in enumerate(zip(element.properties, lengths)):
                kinds += [(f"n{k}", self.order + length)] if length else []
                kinds += [(f"v{k}", self.order + kind, (many,))]
            self.at, each = start, np.dtype(kinds).itemsize
            rows = self._rows(kinds, min(element.count - done, (len(self.data) - start) // each, batch))
            listed = [k for k, (*_, length) in enumerate(element.properties) if length]
            same = np.all([rows[f"n{k}"] == lengths[k] for k in listed] or [np.ones(len(rows), bool)], axis=0)
            count = len(rows) if same.all() else int(np.argmin(same))
            self.at, done = start + count * each, done + count
            batch = 2 * batch if count == len(rows) else 1
            for k, (name, *_) in enumerate(element.properties):
                if name == wanted:
                    found.extend(rows[f"v{k}"][:count].tolist())
        return found

    def _lengths(self, element):
        """Of the lists of the next row."""
        lengths = []
        for _, kind, length in element.properties:
            many = int(self._rows([("n", self.order + length)], 1)["n"][0]) if length else 1
            if many < 0:
                raise self.fault("has a list of less than no values: export it again")
            self._rows([("v", self.order + kind)], many)
            lengths.append(many)
        return lengths
