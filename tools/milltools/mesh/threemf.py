"""3MF (3D Manufacturing Format): a zip archive of XML. Read are the meshes that the build places, with their
transformations, and the unit.

Nothing is unpacked to the disk, a document type is refused (so there are no entities), and bytes, depth and instances
have limits.
"""

import dataclasses
import posixpath
import xml.parsers.expat
import zipfile
from array import array
from io import BytesIO

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain, size
from milltools.mesh.parts import METRES, Foreign, Part, check_count

MOST_BYTES = 1_000_000_000  # of the archive, unpacked
MOST_NAMES = 10_000  # files in the archive
MOST_PLACES = 100_000  # instances of objects
DEEPEST = 32  # elements, and objects within objects
MODEL = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"


@dataclasses.dataclass
class Thing:
    """An object: a mesh, or others that it places: (file, id, transformation)."""

    name: str
    kind: str
    points: array = dataclasses.field(default_factory=lambda: array("d"))
    facets: array = dataclasses.field(default_factory=lambda: array("q"))
    places: list = dataclasses.field(default_factory=list)


class Archive:
    def __init__(self, path, data):
        self.path, self.left = path, MOST_BYTES
        self.units, self.things, self.builds = {}, {}, {}
        try:
            self.zip = zipfile.ZipFile(BytesIO(data))
        except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError) as fault:
            raise self.fault(f"is not a complete 3MF file: {fault}; export it again") from None
        if len(self.zip.namelist()) > MOST_NAMES:
            raise self.fault(f"has more than {MOST_NAMES} files in it")

    def fault(self, what):
        return UserError(f"{plain(self.path)}: {plain(what)}")

    def parse(self, name, starts, ends=None):
        """Calls starts(tag, attributes) for each element of a file of the archive, and ends(tag)."""
        parser, depth = xml.parsers.expat.ParserCreate(namespace_separator=" "), 0

        def refused(*_):
            raise self.fault(f"{name} has a document type, which 3MF forbids")

        def start(tag, attributes):
            nonlocal depth
            depth += 1
            if depth > DEEPEST:
                raise self.fault(f"{name} has elements more than {DEEPEST} deep")
            starts(tag.split(" ")[-1], attributes)

        def end(tag):
            nonlocal depth
            depth -= 1
            if ends:
                ends(tag.split(" ")[-1])

        parser.StartDoctypeDeclHandler = refused
        parser.StartElementHandler, parser.EndElementHandler = start, end
        try:
            with self.zip.open(name) as file:
                while block := file.read(1 << 20):
                    self.left -= len(block)
                    if self.left < 0:
                        raise self.fault(f"is larger than {size(MOST_BYTES)} unpacked: simplify the mesh")
                    parser.Parse(block)
                parser.Parse(b"", True)
        except KeyError as missing:
            what = missing.args[0] if " " in missing.args[0] else f"an element has no {missing.args[0]}"
            raise self.fault(f"{name}: {what}: it is damaged; export it again") from None
        except (zipfile.BadZipFile, xml.parsers.expat.ExpatError, EOFError, OSError, RuntimeError, ValueError) as fault:
            if isinstance(fault, UserError):
                raise
            raise self.fault(f"{name}: {fault}: it is damaged; export it again") from None
        except (NotImplementedError, zipfile.zlib.error) as fault:
            raise self.fault(f"{name}: {fault}: it is damaged; export it again") from None

    def first_model(self):
        """The name of the model with the build."""
        found = []

        def starts(tag, attributes):
            if tag == "Relationship" and attributes.get("Type") == MODEL:
                found.append(attributes.get("Target", "").lstrip("/"))

        if "_rels/.rels" in self.zip.namelist():
            self.parse("_rels/.rels", starts)
        names = [name for name in self.zip.namelist() if name.lower() == "3d/3dmodel.model"]
        if not found and not names:
            raise self.fault("is not a 3MF file: it has no 3D/3dmodel.model in it")
        return (found or names)[0]

    def model(self, name):
        """Reads a model once: its unit, objects and build."""
        if name in self.units:
            return
        thing, build = None, self.builds.setdefault(name, [])

        def placed(attributes):
            path = next((value for key, value in attributes.items() if key.split(" ")[-1] == "path"), None)
            where = posixpath.normpath(path).lstrip("/") if path else name
            return where, attributes["objectid"], _transformation(attributes.get("transform"))

        def starts(tag, attributes):
            nonlocal thing
            if tag == "model":
                unit = attributes.get("unit", "millimeter")
                if unit not in METRES:
                    raise self.fault(f"{name}: '{unit[:60]}' is not a unit of 3MF")
                self.units[name] = METRES[unit]
            elif tag == "object":
                thing = Thing(attributes.get("name", ""), attributes.get("type", "model"))
                self.things[name, attributes["id"]] = thing
            elif tag == "vertex":
                thing.points.extend((float(attributes["x"]), float(attributes["y"]), float(attributes["z"])))
            elif tag == "triangle":
                thing.facets.extend((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
                check_count(self.path, len(thing.facets) // 3)
            elif tag == "component":
                thing.places.append(placed(attributes))
            elif tag == "item":
                build.append(placed(attributes))

        try:
            self.parse(name, starts)
        except (AttributeError, TypeError, OverflowError) as fault:
            raise self.fault(f"{name}: {fault}: it is damaged; export it again") from None
        if name not in self.units:
            raise self.fault(f"{name}: has no element 'model': it is damaged; export it again")


def _transformation(text):
    """(4, 3): a row of points and a 1, times this, is the row of moved points."""
    if text is None:
        return np.eye(4, 3)
    found = np.array([float(word) for word in text.split()])
    if len(found) != 12:
        raise ValueError(f"expected a transformation of 12 numbers, got '{text[:60]}'")
    return found.reshape(4, 3)


def _then(first, after):
    """One transformation after another."""
    return np.vstack([first[:3] @ after[:3], first[3] @ after[:3] + after[3]])


def threemf(path, data) -> Foreign:
    archive = Archive(path, data)
    root = archive.first_model()
    archive.model(root)
    unit = archive.units[root]
    parts, other, total, left = [], 0, 0, MOST_PLACES
    waiting = [(*item, 0) for item in reversed(archive.builds[root])]
    while waiting:
        name, number, move, depth = waiting.pop()
        left -= 1
        if left < 0 or depth > DEEPEST:
            limit = f"{DEEPEST} objects within each other" if left >= 0 else f"{MOST_PLACES} objects"
            raise archive.fault(f"more than {limit}")
        archive.model(name)
        thing = archive.things.get((name, number))
        if thing is None:
            raise archive.fault(f"{name} has no object {number}, which is placed: it is damaged; export it again")
        if thing.kind != "model":
            other += 1
            continue
        waiting.extend((file, one, _then(its, move), depth + 1) for file, one, its in reversed(thing.places))
        points = np.array(thing.points).reshape(-1, 3) * (archive.units[name] / unit)
        facets = np.array(thing.facets, "i8").reshape(-1, 3)
        if np.linalg.det(move[:3]) < 0:
            facets = facets[:, ::-1]  # a mirrored object
        total += max(len(facets), len(points) // 3)
        check_count(path, total)
        parts.append(Part(thing.name, points @ move[:3] + move[3], facets))
    one = "1 object that is not part of the model (a support or other) is left out"
    many = f"{other} objects that are not part of the model (supports and others) are left out"
    notes = [one if other == 1 else many] if other else []
    return Foreign(path, parts, unit, notes)
