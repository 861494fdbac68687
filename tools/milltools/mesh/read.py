"""Reads meshes: binary and ASCII STL, OBJ, PLY, 3MF.

The files may be hostile. No other file that they name is opened, nothing is unpacked to the disk, and no count of a
file is believed before as many bytes are there.
"""

import pathlib

from milltools.base.errors import UserError
from milltools.base.files import opened
from milltools.base.text import plain, size
from milltools.mesh.obj import obj
from milltools.mesh.parts import Foreign, check_count, single
from milltools.mesh.ply import ply
from milltools.mesh.stl import stl
from milltools.mesh.threemf import threemf

LARGEST = 400_000_000  # bytes of a file
READERS = {".stl": stl, ".obj": obj, ".ply": ply, ".3mf": threemf}


def _format(suffix: str, data: bytes) -> str:
    """The format of the contents, where they show it, as millsim sees it; else that of the name."""
    head = data[:65536].lstrip()
    while head.startswith(b"#"):
        head = head.partition(b"\n")[2].lstrip()
    if len(data) > 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return suffix  # a binary STL may begin with anything
    if data.startswith(b"PK\x03\x04"):
        return ".3mf"
    if head.startswith((b"ply\n", b"ply\r")):
        return ".ply"
    words = (b"v ", b"vn ", b"vt ", b"mtllib ", b"o ", b"g ")
    return ".obj" if suffix == ".stl" and head.startswith(words) else suffix


def read(path: str) -> Foreign:
    """Reads a mesh. A UserError for what is not one, is too large, or is damaged."""
    suffix = pathlib.Path(path).suffix.lower()
    if suffix not in READERS:
        raise UserError(f"{plain(path)}: expected a name ending in {', '.join(READERS)}")
    with opened(path, "a mesh") as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise UserError(f"{plain(path)}: is larger than {size(LARGEST)}: simplify the mesh")
    try:
        found = READERS[_format(suffix, data)](path, data)
    except MemoryError:
        raise UserError(f"{plain(path)}: out of memory", status=1) from None
    found.parts = [part for part in found.parts if len(part.facets)]
    if not found.parts:
        raise UserError(f"{plain(path)}: has no facets")
    check_count(path, found.count)
    for part in found.parts:
        if part.facets.min() < 0 or part.facets.max() >= len(part.points):
            raise UserError(f"{plain(path)}: a facet has a corner that is not in the file: export it again")
        part.points = single(path, part.points)
    return found
