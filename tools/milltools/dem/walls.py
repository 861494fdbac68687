"""The surfaces that balls touch: the places of contacts, the motion of the surfaces, and their form in LIGGGHTS.

Everything is in the frame of the simulation (milltools.dem.setup). A wall has
    kind        index of its contact's kind
    primitives  [(name, LIGGGHTS' words for its place, for its shear, number of a species or None: for all balls)]
    motion      a Rotation or Shift of milltools.dem.paths, or None
    mesh(time)  triangles (T, 3, 3) if it is a mesh in LIGGGHTS, else none
    find(time, place, radius)  the Found of those of the balls (N, 3), (N,) that touch it
"""

import dataclasses
import pathlib

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from milltools.base.errors import UserError
from milltools.dem.paths import direction, motion, vector
from milltools.geometry.bodies import STILL, inverse, moved
from milltools.geometry.solids import CORNERS, FACES, blade_triangles
from milltools.geometry.stl import FACET, HEAD

NO_MESH = np.empty((0, 3, 3))
ON_EDGE = 1e-9  # of a ball's radius: places closer than this count as one
FLAT = np.cos(np.radians(10))  # between neighbouring facets: with a smaller angle they belong to a curved wall
SHAFT, BLADE = 3, 4  # kinds
ADDS_UP = "LIGGGHTS adds up the forces of neighbours, which changes restitution"


@dataclasses.dataclass
class Found:
    """The contacts (M,) of one wall, or between balls, at one sample. Normals (M, 3) point into `ball`; key: identifies
    the pair in contact; part: the primitive or facet."""

    key: np.ndarray
    ball: np.ndarray
    partner: np.ndarray
    overlap: np.ndarray
    normal: np.ndarray
    part: np.ndarray | None = None

    def where(self, chosen):
        """Those `chosen` alone."""
        return Found(*(values if values is None else values[chosen] for values in vars(self).values()))


class Wall:
    """A wall that does not move and has no mesh."""

    motion = None
    primitives = ()

    def mesh(self, time):
        return NO_MESH


class Cylinder(Wall):
    """A cylinder about the x axis, without ends: a drum (sign -1: balls are inside) or a shaft (+1)."""

    def __init__(self, kind, name, radius, sign, motion=None, turning=(), partner=-1):
        """turning: radii [m] at which the centres of each species roll, if the wall turns and has friction."""
        self.kind, self.radius, self.sign, self.motion = kind, radius, sign, motion
        self.partner = partner
        words = f"xcylinder {radius:.17g} 0 0"
        speed = motion.speed * motion.axis[0] if motion else 0.0
        # LIGGGHTS takes an angular velocity here and applies it at the radius of the ball's centre
        shears = [f"shear y {speed * radius / at:.17g}" for at in turning if speed]
        if len(shears) > 1:
            self.primitives = [(f"{name}{k}", words, shear, k) for k, shear in enumerate(shears)]
        else:
            self.primitives = [(name, words, "".join(shears), None)]

    def find(self, time, place, radius):
        rho = np.sqrt(place[:, 1] ** 2 + place[:, 2] ** 2)
        deep = self.sign * (self.radius - rho) + radius
        ball = np.nonzero(deep > 0)[0]
        normal = np.zeros((len(ball), 3))
        normal[:, 1:] = self.sign * place[ball, 1:] / rho[ball, None]
        return Found(ball, ball, np.full(len(ball), self.partner), deep[ball], normal)


class Ends(Wall):
    """The planes x = -half and half. If they turn and have friction, each plane is a facet in LIGGGHTS, so large that
    no ball reaches its edges."""

    def __init__(self, kind, half, partner=None, motion=None, radius=None):
        """partner: None: 0 and 1, as for end walls; radius: of the ends, if they turn and have friction."""
        self.kind, self.half, self.partner, self.motion = kind, half, partner, motion
        self.radius = radius
        if radius is None:
            self.primitives = [(f"wall{k}", f"xplane {x:.17g}", "", None) for k, x in enumerate((-half, half))]

    def mesh(self, time):
        if self.radius is None:
            return NO_MESH
        angle = np.pi / 6 + 2 * np.pi / 3 * np.arange(3)
        corner = 2.2 * self.radius * np.column_stack([0 * angle, np.cos(angle), np.sin(angle)])
        return np.array([corner[::-1] - [self.half, 0, 0], corner + [self.half, 0, 0]])

    def find(self, time, place, radius):
        x = place[:, 0]
        depth = np.abs(x) + radius - self.half
        ball = np.nonzero(depth > 0)[0]
        high = x[ball] > 0
        normal = np.zeros((len(ball), 3))
        normal[:, 0] = np.where(high, -1.0, 1.0)
        part = high.astype(np.int64)
        partner = part if self.partner is None else np.full(len(ball), self.partner)
        return Found(2 * ball + high, ball, partner, depth[ball], normal, part)


class Blades(Wall):
    """The blades as boxes that turn with the rotor; the foot is on the axis, as in millsim."""

    kind = BLADE

    def __init__(self, deck):
        self.deck, blades = deck, deck.blades
        self.motion, self.speed, self.count = motion(deck, "rotor"), deck.rotor_speed, len(blades)
        self.foot = np.array([(b.position, 0, 0) for b in blades]).reshape(-1, 3)
        self.angle, pitch = np.array([(b.angle, b.pitch) for b in blades]).reshape(-1, 2).T
        self.cos_p, self.sin_p = np.cos(pitch), np.sin(pitch)
        half = [(b.width / 2, b.tip_radius / 2, b.thickness / 2) for b in blades]
        self.half = np.array(half).reshape(-1, 3)
        across = np.abs(self.sin_p) * self.half[:, 0] + np.abs(self.cos_p) * self.half[:, 2]
        # [m] of the farthest corner from the axis
        self.reach = np.hypot(2 * self.half[:, 1], across).max(initial=0.0)

    def mesh(self, time):
        return blade_triangles(self.deck, self.speed * time)

    def find(self, time, place, radius, ball, blade):
        """The contacts among the pairs of blades `blade` (M,) and balls `ball` (M,)."""
        distance, normal = self.look(place[ball], blade, time)
        overlap = radius[ball] - distance
        hit = np.nonzero(overlap > 0)[0]
        ball, blade = ball[hit], blade[hit]
        return Found(ball * self.count + blade, ball, blade, overlap[hit], normal[hit])

    def look(self, place, blade, time):
        """Distance (M,) [m] of centres `place` (M, 3) from the boxes `blade` (M,), and the unit normal (M, 3) to
        them."""
        turn = self.angle[blade] + self.speed * time
        c, s = np.cos(turn), np.sin(turn)
        cp, sp, half = self.cos_p[blade], self.sin_p[blade], self.half[blade]
        # directions of width, length and thickness
        axes = np.stack([cp, -sp * s, sp * c, 0 * c, c, s, -sp, -cp * s, cp * c], axis=1).reshape(-1, 3, 3)
        local = np.einsum("mij,mj->mi", axes, place - self.foot[blade]) - half * [0, 1, 0]
        out = local - np.clip(local, -half, half)
        distance = np.sqrt(np.einsum("ij,ij->i", out, out))
        inside = distance == 0
        if inside.any():  # out through the nearest face; only the centre of a very soft ball gets inside
            depth = np.abs(local[inside]) - half[inside]
            face = depth.argmax(axis=1)
            row = np.arange(len(face))
            out[inside] = 0.0
            out[np.nonzero(inside)[0], face] = np.where(local[inside][row, face] < 0, 1.0, -1.0)
            distance[inside] = depth[row, face]
        normal = out / np.where(inside, -1.0, distance)[:, None]
        return distance, np.einsum("mij,mi->mj", axes, normal)


class Flats(Wall):
    """Flat facets: a box or a mesh. triangles (T, 3, 3) at t = 0 face away from the balls (side -1: balls are inside)
    or towards them (+1); triangles in one plane form one facet."""

    def __init__(self, kind, triangles, side, partner=0, motion=None, planes=None):
        """planes: names and words of the primitives that replace it, in the order of its facets."""
        self.kind, self.triangles, self.side, self.partner = kind, triangles, side, partner
        self.motion, self.primitives = motion, planes or ()
        normal = normals(triangles)
        height = np.einsum("ij,ij->i", normal, triangles[:, 0])
        size = np.abs(triangles).max()
        keys = np.column_stack([normal, height / size])
        alike = cKDTree(keys).query_ball_point(keys, 1e-6, p=np.inf)
        first, facet = np.unique([min(same) for same in alike], return_inverse=True)
        self.normal, self.height = normal[first], height[first]
        self.members = [triangles[facet == n] for n in range(len(first))]

    def mesh(self, time):
        if self.primitives:
            return NO_MESH
        return moved(self.pose(time), self.triangles)

    def pose(self, time):
        """The pose (3, 4) relative to t = 0."""
        return STILL if self.motion is None else self.motion.path(time)

    def reach(self):
        """Upper limit of its distance from the origin along x, y and z at all times: (3,) [m]."""
        corner, path = self.triangles.reshape(-1, 3), self.motion
        if path is None:
            return np.abs(corner).max(axis=0)
        if hasattr(path, "amount"):  # a shift
            return np.abs(corner).max(axis=0) + 2 * np.abs(path.amount).sum(axis=1)
        return np.abs(path.centre) + np.linalg.norm(corner - path.centre, axis=1).max()

    def find(self, time, place, radius):
        pose = self.pose(time)
        local = moved(inverse(pose), place)
        high = self.side * (local @ self.normal.T - self.height)
        # centres behind a facet touch other facets, except centres of very soft balls
        ball, flat = np.nonzero((high < radius[:, None]) & (high > -0.5 * radius[:, None]))
        if self.primitives:  # planes: limited to the facets
            near = local[ball] - high[ball, flat][:, None] * self.side * self.normal[flat]
            edge = np.zeros(len(ball), bool)
        else:
            near, edge = self._nearest(local[ball], flat)
        out = local[ball] - near
        sign = np.where(high[ball, flat] < 0, -1.0, 1.0)
        distance = sign * np.linalg.norm(out, axis=1)
        rows = np.nonzero((np.abs(distance) < radius[ball]) & ~((sign < 0) & edge))[0]
        rows = rows[self._own(ball[rows], flat[rows], near[rows], edge[rows], distance[rows], radius)]
        ball, flat, distance, sign = ball[rows], flat[rows], distance[rows], sign[rows]
        normal = out[rows] / (sign * np.maximum(np.abs(distance), 1e-300))[:, None]
        key, partner = ball * len(self.normal) + flat, np.full(len(ball), self.partner)
        return Found(key, ball, partner, radius[ball] - distance, normal @ pose[:, :3].T, flat)

    def _nearest(self, points, flat):
        """The nearest places (M, 3) on the facets, and whether these are on the rim of a facet."""
        near, best = np.empty_like(points), np.full(len(points), np.inf)
        edge = np.zeros(len(points), bool)
        for n in np.unique(flat):
            rows = np.nonzero(flat == n)[0]
            for triangle in self.members[n]:
                place, rim = nearest(points[rows], triangle)
                away = np.linalg.norm(points[rows] - place, axis=1)
                better = away < best[rows]
                near[rows[better]], best[rows[better]] = place[better], away[better]
                edge[rows[better]] = rim[better]
            # a side between two triangles of one facet is not a rim
            drop = points[rows] - near[rows]
            across = drop - (drop @ self.normal[n])[:, None] * self.normal[n]
            edge[rows] &= np.linalg.norm(across, axis=1) > 1e-12 * np.abs(self.triangles).max()
        return near, edge

    def _own(self, ball, flat, near, edge, distance, radius):
        """Which contacts to keep, so that an edge shared by two facets gives one contact only."""
        keep = np.ones(len(ball), bool)
        for k in np.flatnonzero(edge):
            others = np.flatnonzero(keep & (ball == ball[k]))
            closer = [other for other in others if (distance[other], other) < (distance[k], k)]
            place, _ = self._nearest(np.tile(near[k], (len(closer), 1)), flat[closer])
            keep[k] = not (np.linalg.norm(place - near[k], axis=1) < ON_EDGE * radius[ball[k]]).any()
        return keep


def nearest(points, triangle):
    """The places (M, 3) of a triangle that are nearest to points (M, 3), and whether they are on its sides."""
    a, b, c = triangle
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal)
    best = points - ((points - a) @ normal)[:, None] * normal
    outside = np.zeros(len(points), bool)
    sides = []
    for p, q in ((a, b), (b, c), (c, a)):
        outside |= (best - p) @ np.cross(normal, q - p) < 0
        along = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
        sides.append(p + along[:, None] * (q - p))
    sides = np.array(sides)
    closest = np.linalg.norm(sides - points, axis=2).argmin(axis=0)
    best[outside] = sides[closest, np.arange(len(points))][outside]
    return best, outside


# ---- bodies of a deck as flat facets, in the frame of their motion; curved bodies are refused


def fault(deck, name, key, reason):
    """The UserError for a key of [body.NAME]."""
    return UserError(f"{deck.path}: [body.{name}] {key}: {reason}")


def normals(triangles):
    """Unit normals (T, 3) of triangles (T, 3, 3)."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normal / np.linalg.norm(normal, axis=1)[:, None]


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


def own_triangles(deck, name):
    """Triangles of a box or mesh around its own origin, facing outwards; coordinates are along its own z, x, y."""
    place, shape = f"body.{name}", deck.value(f"body.{name}.shape")
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
    normal, owner = normals(triangles), {}
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
