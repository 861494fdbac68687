"""Distances to the surfaces of bodies, each in the body's own frame: z along its axis, its middle at the origin.

Every shape answers nearest(p, faces): for points p (..., 3) the distance of each of its faces, the unit normal from
the face towards the point, and the nearest point of the face: arrays (faces, ...) and (faces, ..., 3). A solid that
balls are outside of is one face, with negative or no distance to points within it, but a mesh has one face a
triangle. Of a container each face is a surface of its own, and goes on beyond its edges: a ball that is inside of
all others cannot touch it there.
"""

from dataclasses import dataclass

import numpy as np
from oracle import length, wavy_nearest

X, Y, Z = np.eye(3)


def unit(a, size):
    return a / np.maximum(size, 1e-300)[..., None]


def polar(p):
    """Distance from the z axis (...) and the direction away from it (..., 3)."""
    off = p * np.array([1.0, 1.0, 0.0])
    rho = length(off)
    return rho, unit(off, rho)


class Shape:
    count = 1  # of faces

    def nearest(self, p, faces=slice(None)):
        found = [self.face(k, p) for k in np.arange(self.count)[faces]]
        return tuple(np.stack(part) for part in zip(*found))

    def covers(self, p):
        """Whether points are on the wrong side though no face tells it: only a mesh needs to ask."""
        return np.zeros(p.shape[:-1], dtype=bool)


# Solids


@dataclass
class Box(Shape):
    half: np.ndarray  # three half lengths
    rounding: float = 0.0

    def __post_init__(self):
        self.reach = length(self.half)

    def face(self, _, p):
        core = self.half - self.rounding
        inner = np.clip(p, -core, core)
        away = p - inner
        distance = length(away)
        normal = unit(away, distance)
        return distance - self.rounding, normal, inner + self.rounding * normal

    def part(self, _, p):
        """One coordinate outside of the box is a face, two an edge, three a corner."""
        return ("inside", "face", "edge", "corner")[(abs(p) > self.half - self.rounding).sum()]


@dataclass
class Frustum(Shape):
    """Cone or cylinder: `radius` at z = -half, `end_radius` at z = half."""

    radius: float
    end_radius: float
    half: float
    rounding: float = 0.0

    def __post_init__(self):
        self.reach = np.hypot(max(self.radius, self.end_radius), self.half)
        self.profile = self.shrunk()

    def shrunk(self):
        """Corners (4, 2) of the profile in (rho, z), moved inwards by the rounding: from the lower to the upper
        middle."""
        r = self.rounding
        slope = (self.end_radius - self.radius) / (2 * self.half)
        inset = r * np.hypot(1.0, slope)  # of the slanted side, at a given z
        z = np.array([-self.half + r, self.half - r])
        rho = self.radius + slope * (z + self.half) - inset
        if rho.min() < 0:  # the shrunk solid ends in a tip
            tip = z[0] - rho[0] / slope
            z[rho.argmin()] = tip
            rho = np.maximum(rho, 0.0)
        return np.array([[0.0, z[0]], [rho[0], z[0]], [rho[1], z[1]], [0.0, z[1]]])

    def nearest_side(self, p):
        """In the half plane of p: (rho, z), direction of rho, and by side the nearest points (3, ..., 2)."""
        rho, out = polar(p)
        at = np.stack([rho, p[..., 2]], axis=-1)
        start, along = self.profile[:-1], np.diff(self.profile, axis=0)
        spread = (slice(None),) + (None,) * rho.ndim
        size = np.maximum((along**2).sum(axis=-1), 1e-300)
        part = ((at - start[spread]) * along[spread]).sum(axis=-1) / size[spread]
        return at, out, start[spread] + np.clip(part, 0, 1)[..., None] * along[spread]

    def face(self, _, p):
        at, out, spots = self.nearest_side(p)
        gap = length(at - spots)
        best = gap.argmin(axis=0)
        spot = np.take_along_axis(spots, best[None, ..., None], 0)[0]
        away = at - spot
        distance = np.take_along_axis(gap, best[None], 0)[0]
        normal = unit(away[..., :1] * out + away[..., 1:] * Z, distance)
        point = spot[..., :1] * out + spot[..., 1:] * Z + self.rounding * normal
        return np.where(self.within(at), -distance, distance) - self.rounding, normal, point

    def within(self, at):
        (_, low), (wide, _), (narrow, high), _ = self.profile
        rho, z = at[..., 0], at[..., 1]
        side = wide + (narrow - wide) * (z - low) / (high - low) if high > low else wide
        return (rho < side) & (z > low) & (z < high)

    def part(self, _, p):
        _, _, spots = self.nearest_side(p)
        at = np.array([polar(p)[0], p[2]])
        spot = spots[length(at - spots).argmin()]
        rims = length(spot - self.profile[1:3])
        return "edge" if rims.min() == 0 else "end" if abs(at[1]) > self.profile[2, 1] else "side"


@dataclass
class Capsule(Shape):
    """Round ends beyond the straight part |z| <= half; half = 0 is the sphere."""

    radius: float
    half: float = 0.0

    def __post_init__(self):
        self.reach = self.radius + self.half

    def face(self, _, p):
        core = np.clip(p[..., 2:], -self.half, self.half) * Z
        away = p - core
        size = length(away)
        normal = unit(away, size)
        return size - self.radius, normal, core + self.radius * normal

    def part(self, _, p):
        return "side" if abs(p[2]) < self.half else "end"


class Mesh(Shape):
    """Triangles (n, 3, 3), corners in right-hand order as seen from where they face."""

    def __init__(self, triangles, inside=False):
        self.corners = triangles
        self.inside = inside
        self.count = len(triangles)
        self.reach = length(triangles).max()
        a, b, c = np.moveaxis(triangles, 1, 0)
        across = np.cross(b - a, c - a)
        self.normal = unit(across, length(across))
        self.along = np.roll(triangles, -1, axis=1) - triangles
        # towards the inside of the triangle, from each of its edges
        self.inwards = np.cross(self.normal[:, None], self.along)

    def nearest(self, p, faces=slice(None)):
        spread = (slice(None),) + (None,) * (p.ndim - 1)
        corner = self.corners[faces]
        off = [p - corner[:, k][spread] for k in range(3)]
        plane = self.normal[faces][spread]
        height = (off[0] * plane).sum(axis=-1)
        over = np.ones(height.shape, dtype=bool)
        best, foot = np.full(height.shape, np.inf), np.zeros(off[0].shape)
        for k in range(3):
            over &= (off[k] * self.inwards[faces][:, k][spread]).sum(axis=-1) >= 0
            along = self.along[faces][:, k][spread]
            share = (off[k] * along).sum(axis=-1) / (along * along).sum(axis=-1)
            step = np.clip(share, 0, 1)[..., None] * along
            size = length(off[k] - step)
            nearer = (size < best)[..., None]
            foot = np.where(nearer, corner[:, k][spread] + step, foot)
            best = np.minimum(best, size)
        normal = np.where(over[..., None], np.sign(height)[..., None] * plane, unit(p - foot, best))
        foot = np.where(over[..., None], p - height[..., None] * plane, foot)
        return np.where(over, abs(height), best), normal, foot

    def covers(self, p):
        """By the solid angle that the triangles fill as seen from p: 4 pi within them, else 0."""
        a, b, c = (self.corners[:, k] - p[..., None, :] for k in range(3))
        u, v, w = length(a), length(b), length(c)
        top = (a * np.cross(b, c)).sum(axis=-1)
        low = u * v * w + (a * b).sum(-1) * w + (b * c).sum(-1) * u + (c * a).sum(-1) * v
        turns = np.arctan2(top, low).sum(axis=-1) / (2 * np.pi)
        return (turns > 0.5) != self.inside

    def part(self, face, p):
        _, normal, _ = self.nearest(p, [face])
        return "face" if abs(normal[0] @ self.normal[face]) > 1 - 1e-12 else "edge"


# Containers


@dataclass
class BoxInside(Shape):
    half: np.ndarray
    count = 6

    def __post_init__(self):
        self.reach = length(self.half)

    def face(self, k, p):
        side, axis = 2 * (k % 2) - 1, np.eye(3)[k // 2]
        distance = self.half[k // 2] - side * (p @ axis)
        return distance, -side * axis + 0 * p, p + side * distance[..., None] * axis

    def part(self, k, _):
        return "xyz"[k // 2] + "-+"[k % 2]


@dataclass
class FrustumInside(Shape):
    """Its faces: the side, the end at z = -half, the end at z = half."""

    radius: float
    end_radius: float
    half: float
    count = 3

    def __post_init__(self):
        self.reach = np.hypot(max(self.radius, self.end_radius), self.half)

    def face(self, k, p):
        if k > 0:
            side = 2 * k - 3
            distance = self.half - side * p[..., 2]
            return distance, -side * Z + 0 * p, p + side * distance[..., None] * Z
        slope = (self.end_radius - self.radius) / (2 * self.half)
        cos = 1 / np.hypot(1.0, slope)
        rho, out = polar(p)
        distance = (self.radius + slope * (p[..., 2] + self.half) - rho) * cos
        normal = cos * (slope * Z - out)
        return distance, normal, p - distance[..., None] * normal

    def part(self, k, _):
        return ("side", "end", "end")[k]


class CapsuleInside(Capsule):
    def face(self, _, p):
        distance, normal, point = super().face(0, p)
        return -distance, -normal, point


@dataclass
class Drum(Shape):
    """A drum about x: its mantle, and the end walls at x = -half and x = half. `arcs` are those of a wavy profile."""

    radius: float
    half: float
    arcs: tuple | None = None
    outermost: float = 0.0
    count = 3

    def __post_init__(self):
        self.reach = np.hypot(max(self.radius, self.outermost), self.half)

    def face(self, k, p):
        if k > 0:
            side = 2 * k - 3
            distance = self.half - side * p[..., 0]
            return distance, -side * X + 0 * p, p + side * distance[..., None] * X
        if self.arcs:
            distance, across, wall = wavy_nearest(self.arcs, p[..., 1:])
            normal = np.concatenate([np.zeros_like(p[..., :1]), across], axis=-1)
            return distance, normal, np.concatenate([p[..., :1], wall], axis=-1)
        return rod(self.radius, p, -1)

    def part(self, k, _):
        return ("mantle", "wall", "wall")[k]


@dataclass
class Shaft(Shape):
    """An endless rod about x."""

    radius: float
    reach: float

    def face(self, _, p):
        return rod(self.radius, p, 1)

    def part(self, *_):
        return "side"


def rod(radius, p, side):
    """Distance from the cylinder about x, outside of it (side 1) or inside (-1)."""
    off = p * np.array([0.0, 1.0, 1.0])
    rho = length(off)
    out = unit(off, rho)
    return side * (rho - radius), side * out, p - off + radius * out
