"""Wear of the mill's surfaces: what impacts do to each facet (docs/file-format.md#wear)."""

import dataclasses
import functools

import numpy as np

from milltools.base.errors import UserError
from milltools.read.runfile import Run

PLACE = "statistics/wear"
FACES = ("-x", "+x", "-y", "+y", "-z", "+z")


@dataclasses.dataclass(frozen=True)
class Part:
    """One surface: its kind of contact, its number (-1: the only one), the name of its motion ("": none), whether it is
    round about x of its `axes`, its `axes` as a pose (3, 4) in the frame of its motion, and the pose `start` of this
    motion at t = 0; `lattice`: beginning and size of the cells along three coordinates, and the radius of angles."""

    kind: str
    number: int
    motion: str
    round: bool
    axes: np.ndarray
    start: np.ndarray
    lattice: np.ndarray

    def boxes(self, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest coordinates (C, 3) of cells: x, y, z in `axes` [m], or of a round part x and the distance
        from it [m] and the angle about it [rad]."""
        scale = np.array([1, 1, 1 / self.lattice[6] if self.round else 1])
        low, size = self.lattice[:3] * scale, self.lattice[3:6] * scale
        many = np.column_stack([np.ones((len(cells), 2)), cells[:, 4]])
        first = low + cells[:, 1:4] * size
        return first, first + many * size


class Wear:
    """The facets of a run, with arrays (facets,): `part` and `face` are indices into `parts` and FACES, `area` [m^2].
    `[name]` reads a column of the file, such as "sliding_power" [W/m^2]."""

    def __init__(self, run: Run):
        if why := why_not(run):
            raise UserError(f"{run.path}: {why}")
        self.run = run
        kinds, motions = (run.index_names(f"{PLACE}/parts/{name}") for name in ("kind", "motion"))
        columns = (run.read(f"{PLACE}/parts/{name}") for name in ("kind", "number", "motion", "round", "axes", "start"))
        rows = zip(*columns, run.read(f"{PLACE}/lattices"))
        self.parts = [
            Part(kinds[kind], int(number), motions[motion] if motion >= 0 else "", bool(turned), axes, start, lattice)
            for kind, number, motion, turned, axes, start, lattice in rows
        ]
        self.part, self.face, self.area = (run.read(f"{PLACE}/{name}") for name in ("part", "face", "area"))
        self.area = self.area.astype(float)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.run.read(f"{PLACE}/{name}")

    @functools.cached_property
    def cells(self) -> np.ndarray:
        """Cells (C, 6) of the lattices: facet, index along each coordinate, cells joined along the third, face."""
        found = self["cells"]
        if not len(found):
            raise self.run.damaged(f"{PLACE}/cells", "no cells")
        return found

    def face_name(self, part: Part, face: int) -> str:
        """What people call a face of a part."""
        if part.kind == "ball_wall":
            return "face"
        if part.round:
            return ("end", "end", "inside", "outside", "side", "side")[face]
        if part.kind == self.run.vessel_kinds[0] and self.contour:
            return "inside" if face < 4 else "end"
        if part.kind == "ball_blade":
            leading = self.run.rotor_speed >= 0
            return ("side", "side", "root", "tip", *(("trailing", "leading") if leading else ("leading", "trailing")))[
                face
            ]
        return f"faces {FACES[face]}"

    @functools.cached_property
    def contour(self) -> bool:
        """Whether the container is a contour: its parts have the contour's axes, and the mill's axis is their z."""
        return (f"body.{self.run.vessel}" if self.run.vessel else "drum") in self.run.as_deck.contours

    def part_name(self, part: Part) -> str:
        """A part in words: "blade 2", "end wall 0", "drum"."""
        name = {"ball_wall": "end wall"}.get(part.kind, part.kind.removeprefix("ball_").replace("_", " "))
        alike = sum(other.kind == part.kind for other in self.parts)
        return f"{name} {part.number}" if alike > 1 else name


def why_not(run: Run) -> str | None:
    """Why the file has no wear; None if it has."""
    if run.unsampled:
        return run.unsampled
    if not run.has(f"{PLACE}/area"):
        return "the file has no wear: an older version or another program wrote it"
    return None
