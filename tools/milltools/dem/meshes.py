"""The walls of a deck as LIGGGHTS has them: primitives where there are any, else triangles.

Contacts are found elsewhere, from millsim's own shapes (src/engine/soft_watch.c).
"""

import pathlib
import typing

import numpy as np
from scipy.spatial.transform import Rotation

from milltools.base.errors import UserError
from milltools.dem.paths import direction, vector
from milltools.geometry import contour
from milltools.geometry.bodies import facing, moved
from milltools.geometry.solids import CORNERS, FACES, prism
from milltools.geometry.stl import FACET, HEAD

NO_MESH = np.empty((0, 3, 3))
FLAT = np.cos(np.radians(10))  # between neighbouring facets: with a smaller angle they belong to a curved wall
SAME = 1e-9  # of a radius
SHAFT, BLADE = 3, 4  # kinds
ADDS_UP = "LIGGGHTS adds up the forces of neighbours, which changes restitution"
CURVED = f"LIGGGHTS has no such primitive, and on a curved wall of triangles {ADDS_UP.replace('LIGGGHTS', 'it')}"


class Wall(typing.NamedTuple):
    """A wall in the frame of the simulation (milltools.dem.setup).

    kind: index of its contact's kind; primitives: (name, LIGGGHTS' words for its place, for its shear, number of a
    species or None: for all balls); motion: a Rotation or Shift of milltools.dem.paths, or None; triangles (T, 3, 3):
    at t = 0, if it is a mesh.
    """

    kind: int
    primitives: tuple = ()
    motion: object = None
    triangles: np.ndarray = NO_MESH

    def mesh(self, time):
        """The triangles at this time."""
        return self.triangles if self.motion is None else moved(self.motion.path(time), self.triangles)

    def reach(self):
        """Upper limit of its distance from the origin along x, y and z at all times: (3,) [m]."""
        corner, path = self.triangles.reshape(-1, 3), self.motion
        if path is None:
            return np.abs(corner).max(axis=0)
        if hasattr(path, "amount"):  # a shift
            return np.abs(corner).max(axis=0) + 2 * np.abs(path.amount).sum(axis=1)
        return np.abs(path.centre) + np.linalg.norm(corner - path.centre, axis=1).max()


def cylinder(kind, name, radius, motion=None, turning=()):
    """A cylinder about the x axis, without ends; turning: radii [m] at which the centres of each species roll, if the
    wall turns and has friction."""
    words = f"xcylinder {radius:.17g} 0 0"
    speed = motion.speed * motion.axis[0] if motion else 0.0
    # LIGGGHTS takes an angular velocity here and applies it at the radius of the ball's centre
    shears = [f"shear y {speed * radius / at:.17g}" for at in turning if speed]
    if len(shears) > 1:
        return Wall(kind, [(f"{name}{k}", words, shear, k) for k, shear in enumerate(shears)], motion)
    return Wall(kind, [(name, words, "".join(shears), None)], motion)


def ends(kind, half, motion=None, radius=None):
    """The planes x = -half and half. If they turn and have friction, with this radius, each plane is a facet in
    LIGGGHTS, so large that no ball reaches its edges."""
    if radius is None:
        return Wall(kind, [(f"wall{k}", f"xplane {x:.17g}", "", None) for k, x in enumerate((-half, half))], motion)
    angle = np.pi / 6 + 2 * np.pi / 3 * np.arange(3)
    corner = 2.2 * radius * np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
    return Wall(kind, (), motion, np.array([corner[::-1] - [half, 0, 0], corner + [half, 0, 0]]))


# ---- bodies of a deck as flat facets, in the frame of their motion; curved bodies are refused


def fault(deck, name, key, reason):
    """The UserError for a key of [body.NAME]."""
    return UserError(f"{deck.path}: [body.{name}] {key}: {reason}")


def turned(axis, angle):
    """The matrix (3, 3) that turns by `angle` about `axis`, of length 1."""
    return Rotation.from_rotvec(angle * axis).as_matrix()


def axes(deck, name):
    """Rows (3, 3): the body's own z, x and y in its motion's frame; and its middle (3,)."""
    z = direction(deck, f"body.{name}.axis")
    across = np.eye(3)[1 if np.hypot(z[1], z[2]) < 1e-6 else 0]
    x = across - (across @ z) * z
    x = turned(z, deck.number(f"body.{name}.angle", 0.0)) @ (x / np.linalg.norm(x))
    return np.array([z, x, np.cross(z, x)]), vector(deck, f"body.{name}.centre")


def read_stl(path):
    """Triangles (T, 3, 3) of an STL file, binary or ASCII."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + 50 * count:
        return np.frombuffer(content, FACET, offset=HEAD)["corners"].astype(float)
    lines = (line.split() for line in content.decode(errors="replace").splitlines())
    return np.array([words[1:4] for words in lines if words[:1] == ["vertex"]], float).reshape(-1, 3, 3)


def lining(deck, section):
    """(outermost radius [m], whether a part of the wall is on this circle, triangles of its other sides) of a container
    with a contour, from end to end; x is along its axis. UserError for arcs that are not on the circle."""
    wall, half = contour.of(deck, section), deck.number(f"{section}.length") / 2
    own = wall.is_arc & (wall.vertices[:, 2] > 0) & (np.hypot(*wall.centre.T) < SAME * wall.outermost)
    own &= np.abs(wall.radius - wall.outermost) < SAME * wall.outermost
    if (wall.is_arc & ~own).any():
        mend = "; set 'lifter_rounding = 0 mm'" * (deck.number(f"{section}.lifter_rounding", 0.0) > 0)
        raise UserError(f"{deck.path}: [{section}]: its wall has arcs that are not on one circle: {CURVED}{mend}")
    (a, b), (c, d) = ([np.insert(p[~own], 0, x, axis=1) for x in (half, -half)] for p in (wall.start, wall.end))
    sides = np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])
    if curved(sides):
        raise UserError(f"{deck.path}: [{section}]: its lines make a curved wall, on which {ADDS_UP}")
    return wall.outermost, bool(own.any()), sides


def own_triangles(deck, name):
    """Triangles of a box, contour or mesh around its own origin, facing outwards; coordinates are along its own z, x,
    y."""
    place, shape = f"body.{name}", deck.value(f"body.{name}.shape")
    if shape == "contour":
        wall, half = contour.of(deck, place), deck.number(f"{place}.length") / 2
        triangles = prism(wall.start, -half, half)
        if wall.is_arc.any() or curved(triangles):
            raise fault(deck, name, "file", f"expected a contour of lines with corners: {CURVED}")
        return triangles
    if shape == "box":
        corner = (CORNERS * [0.5, 1, 0.5] - [0, 0.5, 0]) * np.roll(deck.numbers(f"{place}.size"), 1)
        return np.array([corner[list(t)] for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))])
    file = pathlib.Path(deck.path).parent / deck.value(f"{place}.file").strip('"')
    try:
        triangles = read_stl(file) * deck.number(f"{place}.unit", 1.0)
    except (OSError, ValueError) as reason:
        raise fault(deck, name, "file", f"{file}: {reason}") from None
    if curved(triangles):
        raise fault(deck, name, "file", f"its facets make a curved wall, on which {ADDS_UP}")
    return np.roll(triangles, 1, axis=2)


def curved(triangles):
    """Whether facets that share an edge are nearly, but not exactly, in one plane."""
    if not len(triangles):
        return False
    normal, owner = facing(triangles)[0], {}
    for k, triangle in enumerate(np.round(triangles / np.abs(triangles).max(), 6)):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            owner.setdefault(frozenset((tuple(triangle[a]), tuple(triangle[b]))), []).append(k)
    between = np.array([normal[k[0]] @ normal[k[1]] for k in owner.values() if len(k) == 2])
    return bool(((between > FLAT) & (between < 1 - 1e-9)).any())


def copies(deck, name):
    """[triangles (T, 3, 3) of each copy in the frame of its motion]."""
    place = f"body.{name}"
    rows, middle = axes(deck, name)
    found = [own_triangles(deck, name) @ rows + middle]
    turn = turned(direction(deck, f"{place}.turn_about"), deck.number(f"{place}.turn_by", 0.0))
    for _ in range(int(deck.number(f"{place}.copies", 1)) - 1):
        found.append(found[-1] @ turn.T + vector(deck, f"{place}.shift_by"))
    return found
