"""The surfaces that balls meet: where a ball touches them, how fast they move, and what LIGGGHTS has for them.

Everything is in the frame of the simulation (milltools.dem.setup). A wall has
    kind        index of its contact's kind
    primitives  [(name, LIGGGHTS' words, number of a species or None: of all balls)]
    motion      a Rotation or Shift of milltools.dem.paths, or None
    mesh(time)  triangles (T, 3, 3) where it is a mesh in LIGGGHTS, else none
    find(time, place, radius)  the Found of the balls (N, 3), (N,) that touch it
"""

import numpy as np

NO_MESH = np.empty((0, 3, 3))
ON_EDGE = 1e-9  # of a ball's radius: places closer than this are one


class Found:
    """The contacts of one wall, or of balls, at one sample. Normals point into `ball`; key: who touches what; part: the
    primitive or facet."""

    __slots__ = ("key", "ball", "partner", "overlap", "normal", "part")

    def __init__(self, key, ball, partner, overlap, normal, part=None):
        self.key, self.ball, self.partner = key, ball, partner
        self.overlap, self.normal = overlap, normal
        self.part = np.zeros(len(ball), np.int64) if part is None else part

    def where(self, chosen):
        """Those `chosen` alone."""
        return Found(*(getattr(self, name)[chosen] for name in self.__slots__))


class Wall:
    """A wall that does not move and has no mesh."""

    motion = None
    primitives = ()

    def mesh(self, time):
        return NO_MESH

    def velocity(self, time, points):
        """Of the surface (M, 3) at points (M, 3)."""
        if self.motion is None:
            return np.zeros_like(points)
        spin, drift = self.motion.field(time)
        return np.cross(spin, points) + drift


class Cylinder(Wall):
    """About the x axis, endless: a drum (sign -1: balls are inside) or a shaft (+1)."""

    def __init__(self, kind, name, radius, sign, motion=None, turning=(), partner=-1):
        """turning: radii at which the centres of the species roll [m], if the wall turns and rubs."""
        self.kind, self.radius, self.sign, self.motion = kind, radius, sign, motion
        self.partner = partner
        words = f"xcylinder {radius:.17g} 0 0"
        speed = motion.speed * motion.axis[0] if motion else 0.0
        # LIGGGHTS takes an angular velocity here and lets it act at the ball's centre
        shears = [f"{words} shear y {speed * radius / at:.17g}" for at in turning if speed]
        if len(shears) > 1:
            self.primitives = [(f"{name}{k}", shear, k) for k, shear in enumerate(shears)]
        else:
            self.primitives = [(name, (shears or [words])[0], None)]

    def find(self, time, place, radius):
        rho = np.hypot(place[:, 1], place[:, 2])
        deep = self.sign * (self.radius - rho) + radius
        ball = np.nonzero(deep > 0)[0]
        normal = np.zeros((len(ball), 3))
        normal[:, 1:] = self.sign * place[ball, 1:] / rho[ball, None]
        return Found(ball, ball, np.full(len(ball), self.partner), deep[ball], normal)


class Ends(Wall):
    """The planes x = -half and half. Where they turn and rub each is a facet in LIGGGHTS, large enough for no edge to be met."""

    def __init__(self, kind, half, partner=None, motion=None, radius=None):
        """partner: None: 0 and 1, as of end walls; radius: of the ends, if they turn and rub."""
        self.kind, self.half, self.partner, self.motion = kind, half, partner, motion
        self.radius = radius
        if radius is None:
            self.primitives = [(f"wall{k}", f"xplane {x:.17g}", None) for k, x in enumerate((-half, half))]  # fmt: skip

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


def pose_of(motion, time):
    """(R, d) of a wall's motion since t = 0; None: it stands still."""
    if motion is None:
        return np.eye(3), np.zeros(3)
    (turn, place), (first, begin) = motion.pose(time), motion.pose(0.0)
    turn = turn @ first.T
    return turn, place - turn @ begin


class Flats(Wall):
    """Flat facets: a box, a mesh. triangles (T, 3, 3) at t = 0, facing away from the balls (side -1: they are inside), or
    towards them (+1); those of one plane are one facet."""

    def __init__(self, kind, triangles, side, partner=0, motion=None, planes=None):
        """planes: names and words of the primitives that stand for it, in the order of its facets."""
        self.kind, self.triangles, self.side, self.partner = kind, triangles, side, partner
        self.motion, self.primitives = motion, planes or ()
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        height = np.einsum("ij,ij->i", normal, triangles[:, 0])
        size = np.abs(triangles).max()
        keys = np.column_stack([normal, height / size])
        self.flat = np.empty(len(triangles), np.int64)  # number of the facet of each triangle
        first = []
        for k, key in enumerate(keys):
            same = [n for n, f in enumerate(first) if np.abs(keys[f] - key).max() < 1e-6]
            self.flat[k] = same[0] if same else len(first)
            first += [] if same else [k]
        self.normal, self.height = normal[first], height[first]
        self.members = [triangles[self.flat == n] for n in range(len(first))]

    def mesh(self, time):
        if self.primitives:
            return NO_MESH
        turn, place = pose_of(self.motion, time)
        return self.triangles @ turn.T + place

    def reach(self):
        """How far from the origin along x, y and z it ever is: (3,) [m], or more."""
        corner, path = self.triangles.reshape(-1, 3), self.motion
        if path is None:
            return np.abs(corner).max(axis=0)
        if hasattr(path, "amount"):  # a shift
            return np.abs(corner).max(axis=0) + 2 * np.abs(path.amount).sum(axis=1)
        return np.abs(path.centre) + np.linalg.norm(corner - path.centre, axis=1).max()

    def find(self, time, place, radius):
        turn, origin = pose_of(self.motion, time)
        local = (place - origin) @ turn
        high = self.side * (local @ self.normal.T - self.height)
        # centres that are beyond a facet belong to others, but for those of very soft balls
        ball, flat = np.nonzero((high < radius[:, None]) & (high > -0.5 * radius[:, None]))
        if self.primitives:  # planes, as far as they go
            near = local[ball] - high[ball, flat][:, None] * self.side * self.normal[flat]
            edge = np.zeros(len(ball), bool)
        else:
            near, edge = self._nearest(local[ball], flat)
        out = local[ball] - near
        distance = np.linalg.norm(out, axis=1)
        inside = high[ball, flat] < 0
        keep = (distance < radius[ball]) & ~(inside & edge)
        ball, flat, near, edge, out, distance, inside = (
            a[keep] for a in (ball, flat, near, edge, out, distance, inside)
        )
        sign = np.where(inside, -1.0, 1.0)
        normal = out / (sign * np.maximum(distance, 1e-300))[:, None]
        keep = self._own(ball, flat, near, edge, sign * distance, radius)
        ball, flat = ball[keep], flat[keep]
        overlap = (radius[ball] - (sign * distance)[keep]) if len(ball) else np.empty(0)
        return Found(
            ball * len(self.normal) + flat, ball, np.full(len(ball), self.partner), overlap,
            normal[keep] @ turn.T, flat,
        )  # fmt: skip

    def _nearest(self, points, flat):
        """The nearest places (M, 3) of the facets, and whether they are on their rims."""
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
            # on a diagonal between two triangles of one facet it is no rim
            drop = points[rows] - near[rows]
            across = drop - (drop @ self.normal[n])[:, None] * self.normal[n]
            edge[rows] &= np.linalg.norm(across, axis=1) > 1e-12 * np.abs(self.triangles).max()
        return near, edge

    def _own(self, ball, flat, near, edge, distance, radius):
        """Which contacts are none of a neighbouring facet: an edge that two facets share is met once."""
        keep = np.ones(len(ball), bool)
        for k in np.nonzero(edge)[0]:
            others = np.nonzero((ball == ball[k]) & keep & (np.arange(len(ball)) != k))[0]
            for other in others:
                if (distance[other], other) > (distance[k], k):
                    continue
                gaps = [np.linalg.norm(nearest(near[k : k + 1], t)[0] - near[k]) for t in self.members[flat[other]]]  # fmt: skip
                if min(gaps) < ON_EDGE * radius[ball[k]]:
                    keep[k] = False
                    break
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
