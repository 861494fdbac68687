"""From closed shells to solids: which shells are solids, which are rooms within them, and what all solids are together.

A shell that faces outwards is a solid. One that faces inwards, within a solid, is a room in it. Solids may lie within
each other, touch and cross: together they fill what at least one of them fills.
"""

import dataclasses

import manifold3d
import numpy as np

from milltools.base.errors import UserError
from milltools.mesh.surface import Surface
from milltools.mesh.unclosed import OUT, place

MOST_SHELLS = 5000
NO_VOLUME = 1e-9  # of a shell, over its area times its size
PROBES = 5  # points of a shell that tell in which others it lies
BLOCK = 1_000_000  # facets at a time


@dataclasses.dataclass
class Shell:
    """A closed surface. `points` (N, 3); `facets` (M, 3); `volume` is negative if it faces inwards."""

    points: np.ndarray
    facets: np.ndarray
    solid: "Shell | None" = None  # the one in which it is a room
    rooms: "list[Shell]" = dataclasses.field(default_factory=list)

    def __post_init__(self):
        corners = self.corners()
        self.low, self.high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        off = corners - (self.low + self.high) / 2
        self.volume = float(np.einsum("ij,ij->", off[:, 0], np.cross(off[:, 1], off[:, 2])) / 6)
        self.area = float(np.linalg.norm(np.cross(off[:, 1] - off[:, 0], off[:, 2] - off[:, 0]), axis=1).sum() / 2)

    def corners(self):
        return self.points[self.facets]

    def normals(self) -> np.ndarray:
        """Of the points, outwards: the mean of the facets around, by area; 0 where this is 0."""
        a, b, c = self.corners().transpose(1, 0, 2)
        across = np.cross(b - a, c - a)
        found = np.zeros_like(self.points)
        for k in range(3):
            np.add.at(found, self.facets[:, k], across)
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.divide(found, length, out=np.zeros_like(found), where=length > 0)

    def turn(self):
        self.facets, self.volume = self.facets[:, ::-1], -self.volume

    @property
    def is_empty(self) -> bool:
        return not abs(self.volume) > NO_VOLUME * self.area * float((self.high - self.low).max())

    def holds(self, other: "Shell") -> bool:
        """Whether most of the other one lies within this one."""
        if (other.low < self.low).any() or (other.high > self.high).any():
            return False
        step = max(len(other.facets) // PROBES, 1)
        inside = [abs(self.turns_around(point)) > 0.5 for point in other.corners()[::step].mean(axis=1)[:PROBES]]
        return 2 * sum(inside) > len(inside)

    def turns_around(self, point) -> float:
        """The winding number: the solid angle of all facets over 4 pi (van Oosterom and Strackee, 1983)."""
        total = 0.0
        for first in range(0, len(self.facets), BLOCK):
            a, b, c = (self.points[self.facets[first : first + BLOCK]] - point).transpose(1, 0, 2)
            p, q, r = (np.linalg.norm(one, axis=1) for one in (a, b, c))
            below = p * q * r
            for one, other, length in ((a, b, r), (b, c, p), (c, a, q)):
                below += np.einsum("ij,ij->i", one, other) * length
            total += float(np.arctan2(np.einsum("ij,ij->i", a, np.cross(b, c)), below).sum())
        return total / (2 * np.pi)


def shells_of(surface: Surface) -> list[Shell]:
    """The shells of a closed surface."""
    points, facets = surface.parted()
    which = surface.shells()
    order = np.argsort(which, kind="stable")
    return [Shell(*_compact(points, facets[own])) for own in np.split(order, np.cumsum(np.bincount(which))[:-1])]


def _compact(points, facets):
    used, numbers = np.unique(facets, return_inverse=True)
    return points[used], numbers.reshape(-1, 3)


def sort_out(shells: list[Shell], step) -> tuple[list[Shell], int]:
    """Turns shells so that solids face outwards and rooms inwards, and gives each room to the smallest solid that it is
    in. Returns the solids, and how many shells were turned.

    A shell that no other one holds is a solid. If it faced inwards, what it holds was turned over with it: all of it
    came from one mirrored part."""
    if len(shells) > MOST_SHELLS:
        raise UserError(f"{len(shells)} shells: at most {MOST_SHELLS} can be united; export fewer parts into a file")
    holders = []
    for one in step(shells, "finding which shells lie within others"):
        larger = [other for other in shells if abs(other.volume) > abs(one.volume)]
        holders.append([other for other in larger if other.holds(one)])
    wrong = [
        max(around or [one], key=lambda other: abs(other.volume)).volume < 0 for one, around in zip(shells, holders)
    ]
    for one, turn in zip(shells, wrong):
        if turn:
            one.turn()
    for one, around in zip(shells, holders):
        around = [other for other in around if other.volume > 0]
        if one.volume < 0 and around:
            one.solid = min(around, key=lambda other: other.volume)
            one.solid.rooms.append(one)
    return [one for one in shells if one.volume > 0], sum(wrong)


def need_uniting(solids: list[Shell]) -> bool:
    """Whether the boxes around any two solids touch."""
    low, high = np.array([one.low for one in solids]), np.array([one.high for one in solids])
    touch = (((low[k + 1 :] <= high[k]) & (high[k + 1 :] >= low[k])).all(axis=1).any() for k in range(len(solids) - 1))
    return any(touch)


def united(solids: list[Shell], grow: float, progress):
    """What the solids fill together, as a manifold3d.Manifold; `grow`: their surfaces are moved outwards before."""
    left = [_manifold(one, grow) for one in solids]
    for k, solid in enumerate(solids):
        for room in solid.rooms:
            left[k] -= _manifold(room, grow)
    to_go = len(left) - 1
    while len(left) > 1:
        pairs = []
        for k in range(0, len(left) - 1, 2):
            both = left[k] + left[k + 1]
            both.num_tri()  # it is computed only when it is asked for
            pairs.append(both)
            progress(f"uniting solids, {to_go} of {len(solids) - 1} to go")
            to_go -= 1
        left = pairs + left[len(left) - len(left) % 2 :]
    return left[0]


def _manifold(shell: Shell, grow: float):
    """What a shell encloses; `grow`: its surface is moved out of the solid before."""
    facets = shell.facets if shell.volume > 0 else shell.facets[:, ::-1]
    points = shell.points + grow * shell.normals() if grow else shell.points
    mesh = manifold3d.Mesh(points.astype("<f4"), facets.astype("<u4"))
    found = manifold3d.Manifold(mesh)
    if found.status() != manifold3d.Error.NoError:
        why = f"cannot be united ({found.status().name})"
        raise UserError(f"the shell around {place(shell.points[0])} {why}: mend it{OUT}")
    return found


def facets_of(manifold, tolerance: float = 0.0):
    """(points, facets), simplified if that moves them by less than the tolerance."""
    mesh = (manifold.simplify(tolerance) if tolerance else manifold).to_mesh()
    return mesh.vert_properties[:, :3].astype("<f8") + 0.0, mesh.tri_verts.astype("<i8")
