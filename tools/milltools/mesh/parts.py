"""What the readers of all formats share: the parts of a file, limits, units."""

import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.mesh import fill

MOST_FACETS = 2_000_000  # of all files: what millsim reads
MOST_PARTS = 100_000
METRES = {  # the words of 3MF; those of decks
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
    "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "ft": 0.3048, "m": 1.0,
}  # fmt: skip
SHORT = {metres: name for name, metres in METRES.items()}  # the word of a deck


@dataclasses.dataclass
class Part:
    """A piece of a file: `points` (N, 3), `facets` (M, 3) as numbers of points."""

    name: str
    points: np.ndarray
    facets: np.ndarray


@dataclasses.dataclass
class Foreign:
    """The content of a file. `unit` [m] of its coordinates, None if the file does not say it; `notes`: what was left
    out."""

    path: str
    parts: list[Part]
    unit: float | None = None
    notes: list[str] = dataclasses.field(default_factory=list)

    @property
    def count(self) -> int:
        return sum(len(part.facets) for part in self.parts)


def check_count(path, count):
    if count > MOST_FACETS:
        raise UserError(f"{plain(path)}: more than {MOST_FACETS} facets: simplify the mesh")


def single(path, points) -> np.ndarray:
    """Points as an STL file holds them: numbers of single precision (returned as doubles), no -0."""
    with np.errstate(over="ignore", invalid="ignore"):  # too large, and no number: refused below
        rounded = np.asarray(points, "<f8").astype("<f4").astype("<f8") + 0.0
    bad = np.flatnonzero(~np.isfinite(rounded).all(axis=1))
    if len(bad):
        raise UserError(
            f"{plain(path)}: {len(bad)} of its points are not finite numbers of single precision, the first is number "
            f"{bad[0] + 1}: export it again"
        )
    return rounded


def soup(name, corners) -> Part:
    """A part of facets that are given by their corners (M, 3, 3)."""
    return Part(name, np.asarray(corners).reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def polygons(path, name, points, faces) -> Part:
    """A part of faces of any number of corners, with the points that it uses."""
    if any(max(face) >= len(points) for face in faces):
        raise UserError(f"{plain(path)}: a face has a corner that is not in the file: export it again")
    check_count(path, sum(len(face) - 2 for face in faces))
    alike = [np.array([face for face in faces if len(face) == count], "i8").reshape(-1, count) for count in (3, 4)]
    many = [cut for face in faces if len(face) > 4 for cut in fill.loop(points[face], face)]
    facets = np.concatenate([alike[0], fill.quads(points, alike[1]), np.array(many, "i8").reshape(-1, 3)])
    used, facets = np.unique(facets, return_inverse=True)
    return Part(name, points[used], facets.reshape(-1, 3))
