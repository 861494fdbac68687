"""Balls, or the mill's bodies, at one moment as VTK PolyData (.vtp).

The arrays are in the XML as base64, not compressed; the time (TimeValue, the name that VTK expects) comes after the
points. OVITO can read such a file too. It can read neither raw nor compressed data, nor a file that begins with its
field data.
"""

import base64
import contextlib
import os
from xml.sax.saxutils import quoteattr

import numpy as np

from milltools.base.files import whole
from milltools.base.text import size
from milltools.export import source, stl

TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64"}


@contextlib.contextmanager
def _element(file, tag, **attributes):
    """Writes XML element by element."""
    words = "".join(f" {name}={quoteattr(str(value))}" for name, value in attributes.items())
    file.write(f"<{tag}{words}>\n".encode())
    yield
    file.write(f"</{tag}>\n".encode())


def _section(file, tag, arrays, **more):
    """An element of arrays (N,) or (N, 3) by name, each after the number of its bytes; `more`: further attributes."""
    with _element(file, tag):
        for name, values in arrays.items():
            kind = values.dtype.str[1:]
            parts = 1 if values.ndim == 1 else values.shape[1]
            content = np.ascontiguousarray(values, f"<{kind}").tobytes()
            content = np.array(len(content), "<u8").tobytes() + content
            words = {"type": TYPES[kind], "Name": name, "NumberOfComponents": parts, "format": "binary"} | more
            with _element(file, "DataArray", **words):
                file.write(base64.b64encode(content) + b"\n")


def polydata(path, time, points, cells, point_data=None, cell_data=None):
    """Writes PolyData, returns its size [bytes]. `points` (N, 3), `cells` {"Verts" or "Polys": (M, corners)}, data
    by name."""
    counts = {f"NumberOf{kind}": len(cells.get(kind, ())) for kind in ("Verts", "Lines", "Strips", "Polys")}
    layout = {"type": "PolyData", "version": "1.0", "byte_order": "LittleEndian", "header_type": "UInt64"}
    with open(path, "wb") as file:
        file.write(b'<?xml version="1.0"?>\n')
        with _element(file, "VTKFile", **layout), _element(file, "PolyData"):
            with _element(file, "Piece", NumberOfPoints=len(points), **counts):
                _section(file, "PointData", point_data or {})
                _section(file, "CellData", cell_data or {})
                _section(file, "Points", {"Points": points})
                for kind, corners in cells.items():
                    ends = corners.shape[1] * np.arange(1, len(corners) + 1, dtype="i8")
                    _section(file, kind, {"connectivity": corners.astype("i8").ravel(), "offsets": ends})
            _section(file, "FieldData", {"TimeValue": np.array([time])}, NumberOfTuples=1)
    return os.path.getsize(path)


# ---- balls


def still(run):
    """The constant properties of the balls, by name."""
    kept = {name: run.balls(name) for name in ("id", "species", "diameter", "mass")}
    return kept | {"radius": kept["diameter"] / 2}  # ParaView and OVITO draw spheres of this radius


def write_balls(run, index, time, kept, path):
    """One frame, a point and a vertex for each ball; returns the size [bytes]."""
    moving = {name: run.frame(index, name) for name in ("velocity", "angular_velocity")}
    moving["relief"] = run.relieved(time).astype("i4")  # 1: it may be inside a body
    points = run.frame(index, "position")
    vertices = np.arange(len(points))[:, None]
    return polydata(path, time, points, {"Verts": vertices}, moving | kept)


def balls(arguments):
    with source.open_run(arguments) as run:
        index, times, kept = source.one(run, arguments), source.stored(run), still(run)
        with whole(arguments.file) as draft:
            total = write_balls(run, index, times[index], kept, draft)
    which = f"frame {index} of 0 to {len(times) - 1}, {times[index]:.6g} s"
    return f"{which}, {len(kept['id'])} balls, {size(total)}", {"frame": index, "time": times[index], "bytes": total}


# ---- the mill


class Bodies(stl.Parts):
    """The wanted parts as one mesh, at any time."""

    def __init__(self, deck, arguments):
        super().__init__(deck, arguments)
        self.pieces, corners, part = [], [], []
        count = 0
        for name, own in self.at_start.items():
            for motion in dict.fromkeys(motion for motion, _ in own):
                triangles = np.concatenate([body for rides, body in own if rides == motion])
                points, places = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
                self.pieces.append((motion, points))
                corners.append(places.reshape(-1, 3) + count)
                part.append(np.full(len(triangles), self.names.index(name), "i4"))
                count += len(points)
        self.corners, self.part = np.concatenate(corners), np.concatenate(part)

    def write(self, time, path, poses=None):
        """Returns the size [bytes]; `poses`: of the motions at this time, if a run gives them."""
        points = self.placed(self.pieces, time, poses).astype("f4")
        return polydata(path, time, points, {"Polys": self.corners}, cell_data={"part": self.part})


def mill(arguments):
    bodies, time = Bodies(source.deck_of(arguments), arguments), stl.asked_time(arguments)
    with whole(arguments.file) as draft:
        total = bodies.write(time, draft)
    facts = {"parts": list(bodies.at_start), "time": time, "triangles": len(bodies.part), "bytes": total}
    return f"{', '.join(bodies.at_start)} at {time:.6g} s: {len(bodies.part)} triangles, {size(total)}", facts
