"""Balls, or the mill's bodies, at one moment as VTK PolyData (.vtp).

The arrays stand in the XML as base64, not compressed, and the time (TimeValue, where VTK looks for it) behind the points:
so OVITO reads it as well, which knows neither raw nor compressed data, nor a file that begins with its fields.
"""

import base64
import os
from xml.sax.saxutils import quoteattr

import numpy as np

from milltools.base.files import whole
from milltools.base.text import size
from milltools.export import source, stl
from milltools.geometry.bodies import moved

TYPES = {"f4": "Float32", "f8": "Float64", "i4": "Int32", "i8": "Int64"}


class Document:
    """XML that is written element by element."""

    def __init__(self, file):
        self.file = file

    def open(self, tag, **attributes):
        words = "".join(f" {name}={quoteattr(str(value))}" for name, value in attributes.items())
        self.file.write(f"<{tag}{words}>\n".encode())

    def close(self, *tags):
        for tag in tags:
            self.file.write(f"</{tag}>\n".encode())

    def array(self, name, values, **attributes):
        """(N,) or (N, 3), behind the number of its bytes"""
        kind = values.dtype.str[1:]
        parts = 1 if values.ndim == 1 else values.shape[1]
        content = np.ascontiguousarray(values, f"<{kind}").tobytes()
        content = np.array(len(content), "<u8").tobytes() + content
        words = {"type": TYPES[kind], "Name": name, "NumberOfComponents": parts}
        self.open("DataArray", **words, format="binary", **attributes)
        self.file.write(base64.b64encode(content) + b"\n")
        self.close("DataArray")

    def section(self, tag, arrays, **attributes):
        self.open(tag, **attributes)
        for name, values in arrays.items():
            self.array(name, values)
        self.close(tag)


def polydata(path, time, points, cells, point_data=None, cell_data=None):
    """Writes PolyData, returns its size [bytes]. `points` (N, 3), `cells` {"Verts" or "Polys": (M, corners)}, data by name."""
    kinds = ("Verts", "Lines", "Strips", "Polys")
    counts = {f"NumberOf{kind}": len(cells.get(kind, ())) for kind in kinds}
    with open(path, "wb") as file:
        file.write(b'<?xml version="1.0"?>\n')
        out = Document(file)
        layout = {"byte_order": "LittleEndian", "header_type": "UInt64"}
        out.open("VTKFile", type="PolyData", version="1.0", **layout)
        out.open("PolyData")
        out.open("Piece", NumberOfPoints=len(points), **counts)
        out.section("PointData", point_data or {})
        out.section("CellData", cell_data or {})
        out.section("Points", {"Points": points})
        for kind, corners in cells.items():
            ends = corners.shape[1] * np.arange(1, len(corners) + 1, dtype="i8")
            out.section(kind, {"connectivity": corners.astype("i8").ravel(), "offsets": ends})
        out.close("Piece")
        out.open("FieldData")
        out.array("TimeValue", np.array([time]), NumberOfTuples=1)
        out.close("FieldData", "PolyData", "VTKFile")
    return os.path.getsize(path)


# ---- balls


def still(run):
    """What balls keep, by name."""
    kept = {name: run.balls(name) for name in ("id", "species", "diameter", "mass")}
    return kept | {"radius": kept["diameter"] / 2}  # what ParaView and OVITO draw spheres by


def write_balls(run, index, time, kept, path):
    """One frame, a point and a vertex for each ball; returns the size [bytes]."""
    moving = {name: run.frame(index, name) for name in ("velocity", "angular_velocity")}
    points = run.frame(index, "position")
    vertices = np.arange(len(points))[:, None]
    return polydata(path, time, points, {"Verts": vertices}, moving | kept)


def balls(arguments):
    with source.open_run(arguments) as run:
        index = source.one(run, arguments)
        times = source.stored(run)
        kept = still(run)
        with whole(arguments.file) as draft:
            total = write_balls(run, index, times[index], kept, draft)
    which = f"frame {index} of 0 to {len(times) - 1}, {times[index]:.6g} s"
    return f"{which}, {len(kept['id'])} balls, {size(total)}"


# ---- the mill


class Bodies:
    """The wanted bodies as one mesh, at any time."""

    def __init__(self, deck, arguments):
        self._parts = stl.Parts(deck, arguments)
        self.parts = list(self._parts.at_start)
        self.pieces, corners, part = [], [], []
        count = 0
        for name, own in self._parts.at_start.items():
            for motion in dict.fromkeys(motion for motion, _ in own):
                triangles = np.concatenate([body for rides, body in own if rides == motion])
                points, places = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
                self.pieces.append((motion, points))
                corners.append(places.reshape(-1, 3) + count)
                part.append(np.full(len(triangles), self._parts.names.index(name), "i4"))
                count += len(points)
        self.corners, self.part = np.concatenate(corners), np.concatenate(part)

    def write(self, time, path, poses=None):
        """Returns the size [bytes]; `poses` of the motions then, where a run tells them."""
        ways = self._parts.ways(poses, time)
        points = np.concatenate([moved(ways[motion], p) if motion in ways else p for motion, p in self.pieces])
        cells = {"Polys": self.corners}
        return polydata(path, time, points.astype("f4"), cells, cell_data={"part": self.part})


def mill(arguments):
    bodies = Bodies(source.deck_of(arguments), arguments)
    time = stl.asked_time(arguments)
    with whole(arguments.file) as draft:
        total = bodies.write(time, draft)
    return f"{', '.join(bodies.parts)} at {time:.6g} s: {len(bodies.part)} triangles, {size(total)}"
