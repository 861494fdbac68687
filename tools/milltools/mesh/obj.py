"""Wavefront OBJ. Materials and textures are not read."""

import functools

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.mesh.parts import MOST_PARTS, Foreign, polygons


def obj(path, data) -> Foreign:
    """Wavefront OBJ: points, and faces of any number of corners; `o` and `g` begin parts. Materials are not read."""
    points, parts, faces = [], {}, []
    parts[""] = faces
    fault = functools.partial(_obj_fault, path)
    for number, line in enumerate(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").split(b"\n"), 1):
        word, *values = line.split(maxsplit=1) or (b"",)
        rest = values[0] if values else b""
        if word == b"v":
            try:
                points.append([float(value) for value in rest.split()[:3]])
            except ValueError:
                raise fault(number, "three numbers", line) from None
            if len(points[-1]) < 3:
                raise fault(number, "three numbers", line)
        elif word == b"f":
            try:
                told = [int(value.split(b"/")[0]) for value in rest.split()]
            except ValueError:
                raise fault(number, "numbers of points", line) from None
            corners = [one - 1 if one > 0 else len(points) + one for one in told]
            if len(corners) < 3 or min(corners) < 0 or 0 in told:
                raise fault(number, "the numbers of at least three points of the file", line)
            faces.append(corners)
        elif word in (b"o", b"g"):
            faces = parts.setdefault(rest.strip().decode(errors="replace"), [])
            if len(parts) > MOST_PARTS:
                raise UserError(f"{plain(path)}: more than {MOST_PARTS} parts")
        elif word in (b"curv", b"curv2", b"surf"):
            raise fault(number, "flat faces (write the surface as facets)", line)
    points = np.array(points, "<f8").reshape(-1, 3)
    return Foreign(path, [polygons(path, name, points, faces) for name, faces in parts.items()])


def _obj_fault(path, number, what, line):
    return UserError(
        f"{plain(path)}:{number}: expected {what}, got '{plain(line.decode(errors='replace').strip())[:60]}'"
    )
