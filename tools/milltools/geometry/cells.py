"""Cells of millsim's maps: how much of each cell is inside the drum, and how the balls of a frame fill the cells.

The file has the maps of the whole sampled window. Maps of parts of the window, made here from frames, show how precise
the maps are (compare/map_deviation.py). Rules and order of sums are those of src/observe/maps.c and maps_sample.c. SI.
"""

import functools
import math

import numpy as np

RINGS = 30  # cells of r, half as many as across
SUBS, ANGLES = 32, 720  # points along each direction of a cell or ring, and directions, if no formula gives its area

# Points of a ball's volume: (+-1, +-1, +-1) and the permutations of (+-3, +-1, +-1) in half spacings, see
# src/observe/maps_sample.c. Seen along x they are 12 places (plane in y, plane in z, points / 2):
_SQUARE = [(j, k, 1 + (j in (1, 2) and k in (1, 2))) for j in range(4) for k in range(4) if j in (1, 2) or k in (1, 2)]
# In the plane of radius and azimuth, two points each at +-k, and the planes along x that hold them:
_SPOTS = [
    (-3, 1, (1, 2)), (-1, 1, (0, 1, 2, 3)), (1, 1, (0, 1, 2, 3)), (3, 1, (1, 2)), (-1, 3, (1, 2)), (1, 3, (1, 2)),
]  # fmt: skip


class Map:
    """Equal cells over two coordinates; points outside count in the cells at the rim."""

    def __init__(self, n, begin, end, room):
        self.n, self.begin = n, begin
        self.size = [(end[k] - begin[k]) / n[k] for k in (0, 1)]  # [m]
        self.per = [n[k] / (end[k] - begin[k]) for k in (0, 1)]
        self.room = room  # [m^3] of the cells inside the drum, (n0 n1,)
        self.flow = np.zeros((4, n[0] * n[1]))  # volume [m^3], and volume times velocity [m^4/s]

    def planes(self, axis, centre, half, periodic=False):
        """Cells of the planes -3, -1, 1, 3 of the lattice across an axis, (4, N). Periodic: those beyond an end are at
        the other end."""
        if periodic:
            at = (centre + np.array([-3, -1, 1, 3])[:, None] * half) * self.per[axis] - self.begin[axis] * self.per[
                axis
            ]
            return np.floor(at).astype(np.int64) % self.n[axis]
        end = self.n[axis] - 1e-9
        one = np.minimum(half * self.per[axis], end / 6)
        at = np.minimum(centre * self.per[axis] - self.begin[axis] * self.per[axis], end - 3 * one)
        at = np.maximum(at, 3 * one)
        return (at + np.array([-3, -1, 1, 3])[:, None] * one).astype(np.int64)

    def pour(self, cells, what):
        """Adds `what` (4 times an array or number for each of `cells`): volume, and volume times velocity."""
        cells = cells.ravel()
        for flow, part in zip(self.flow, what):
            flow += np.bincount(cells, np.ravel(part), len(flow))


def _under_arc(radius, y):
    s = np.minimum(1, y / radius)
    return 0.5 * radius * radius * (s * np.sqrt(1 - s * s) + np.arcsin(s))


def circle_cells(radius, n):
    """Area [m^2] inside the circle of each of the n x n equal cells over its square, index y n + z; n even."""
    size = 2 * radius / n
    edge = np.arange(n // 2 + 1) * size
    y0, z0 = np.meshgrid(edge[:-1], edge[:-1], indexing="ij")
    y1, z1 = np.meshgrid(edge[1:], edge[1:], indexing="ij")
    full = np.sqrt(np.maximum(0, radius * radius - z1 * z1))  # y up to which the whole cell is inside
    none = np.sqrt(np.maximum(0, radius * radius - z0 * z0))  # y from which on nothing of it is inside
    a = np.minimum(np.maximum(full, y0), y1)
    b = np.minimum(np.maximum(none, a), y1)
    area = (a - y0) * (z1 - z0) + _under_arc(radius, b) - _under_arc(radius, a) - z0 * (b - a)
    area[~(area > 1e-9 * (y1 - y0) * (z1 - z0))] = 0  # rounding at a corner on the circle
    half = np.concatenate([area[::-1], area])  # the quadrants are equal
    return np.concatenate([half[:, ::-1], half], axis=1).ravel()


@functools.lru_cache(maxsize=4)
def _sub_points(wall, rings):
    """(areas of the cells as in `circle_cells`, areas of `rings` rings of r) inside any contour, from the share of
    points inside, as in millsim."""
    n, size = 2 * rings, wall.outermost / rings
    corner = np.arange(n) * size - wall.outermost
    y, z = np.meshgrid(corner, corner, indexing="ij")
    gap = wall.gap(np.stack([y, z], axis=-1) + size / 2).reshape(y.shape)
    share = (gap > 0).astype(float)
    at = size * (np.arange(SUBS) + 0.5) / SUBS
    cut = np.abs(gap) <= size  # cells near the wall
    points = np.stack(np.broadcast_arrays(y[cut][:, None, None] + at[:, None], z[cut][:, None, None] + at), axis=-1)
    share[cut] = (wall.winding(points) > 0).reshape(-1, SUBS * SUBS).mean(axis=1)
    inner = np.arange(rings) * size
    outer = inner + size
    part = (np.arange(SUBS) + 0.5) / SUBS  # of equal area
    r = np.sqrt(inner[:, None] ** 2 + (outer**2 - inner**2)[:, None] * part)
    angle = 2 * math.pi * np.arange(ANGLES) / ANGLES
    inside = np.ones((r.size, ANGLES))
    odd = r.ravel() >= wall.innermost
    points = r.ravel()[odd][:, None, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    inside[odd] = (wall.winding(points) > 0).reshape(-1, ANGLES)
    areas = math.pi * (outer**2 - inner**2) * inside.reshape(*r.shape, ANGLES).mean(axis=(1, 2))
    return size * size * share.ravel(), areas


class Maps:
    """The cross-section (y, z) and the axial map (x, r) of a container with a `wall`, a geometry.contour.Contour,
    `length` [m] long, with walls or periodic ends; `rings` of r. `turns`: about its axis, and its frame does not."""

    def __init__(self, wall, length, rings=RINGS, periodic=False, turns=False):
        radius = wall.outermost
        slices = int(min(max(math.floor(length / (radius / rings) + 0.5), 4), 400))
        half = length / 2
        if wall.circle or turns:
            edge = np.arange(rings + 1) * (radius / rings)
            cells, ring = circle_cells(radius, 2 * rings), math.pi * (edge[1:] ** 2 - edge[:-1] ** 2)
        else:
            cells, ring = _sub_points(wall, rings)
        self.samples, self.periodic = 0, periodic
        self.cross = Map((2 * rings, 2 * rings), (-radius, -radius), (radius, radius), cells * length)
        self.axial = Map((slices, rings), (-half, 0.0), (half, radius), None)
        self.axial.room = np.tile(ring * self.axial.size[0], slices)

    def sample(self, position, velocity, radius):
        """Adds balls (N,): the volume of each ball is spread over 32 equal points within it."""
        x, y, z = position.T
        u, v, w = velocity.T
        half = radius * math.sqrt(1 / 15)  # of the spacing that keeps the ball's second moment
        two = 2 * (4 * math.pi / 3 * radius**3 / 32)  # [m^3] of two points
        stride = self.cross.n[1]
        rows, columns = self.cross.planes(0, y, half) * stride, self.cross.planes(1, z, half)
        points = np.array([[n] for *_, n in _SQUARE]) * two
        self.cross.pour(
            np.stack([rows[j] + columns[k] for j, k, _ in _SQUARE]), (points, points * u, points * v, points * w)
        )
        axial = self.axial
        slices = axial.planes(0, x, half, self.periodic) * axial.n[1]
        radius = np.sqrt(y * y + z * z)
        off = radius > 0
        c, s = np.where(off, y, 1) / np.where(off, radius, 1), z / np.where(off, radius, 1)
        out, around = v * c + w * s, w * c - v * s
        cells, shares = [], []
        for along, across, planes in _SPOTS:
            there = radius + along * half
            r = np.sqrt(there * there + across * half * across * half)
            ring = np.minimum(r * axial.per[1], axial.n[1] - 1).astype(np.int64)
            for plane in planes:
                cells.append(slices[plane] + ring)
                shares.append(there / r)
        share, points = np.stack(shares), np.broadcast_to(two, (len(cells), len(two)))
        axial.pour(np.stack(cells), (points, points * u, points * share * out, points * share * around))
        self.samples += 1
