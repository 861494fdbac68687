"""Cuts faces and holes into facets: a loop of points that may be concave and need not be quite flat."""

import numpy as np


def normal(points) -> np.ndarray:
    """Twice the area vector of a loop of points (Newell): its normal where it is flat."""
    off = points - points[0]
    return np.cross(off, np.roll(off, -1, axis=0)).sum(axis=0)


def loop(points, numbers) -> list[list[int]]:
    """Facets of a loop that goes around them counter-clockwise, as triples of its `numbers`: those of its projection
    onto the plane to which it is nearest."""
    import manifold3d

    up = normal(points)
    length = np.linalg.norm(up)
    if not length > 0:
        return [[numbers[0], numbers[k], numbers[k + 1]] for k in range(1, len(numbers) - 1)]
    least = np.zeros(3)
    least[np.argmin(abs(up))] = 1.0
    x = np.cross(least, up / length)
    x /= np.linalg.norm(x)
    flat = (points - points[0]) @ np.stack([x, np.cross(up / length, x)], axis=1)
    return [[numbers[k] for k in cut] for cut in manifold3d.triangulate([flat]).tolist()]


def quads(points, faces) -> np.ndarray:
    """Facets of faces (N, 4) of four corners: two each, cut along the shorter diagonal that is within the face."""
    if not len(faces):
        return np.empty((0, 3), "i8")
    a, b, c, d = (points[faces[:, k]] for k in range(4))
    up = np.cross(c - a, d - b)

    def inside(p, q, r):
        return np.einsum("ij,ij->i", np.cross(q - p, r - p), up) > 0

    first, other = inside(a, b, c) & inside(a, c, d), inside(b, c, d) & inside(b, d, a)
    shorter = np.linalg.norm(c - a, axis=1) <= np.linalg.norm(d - b, axis=1)
    chosen = np.where(first == other, shorter, first)
    cuts = np.where(chosen[:, None], faces[:, [0, 1, 2, 0, 2, 3]], faces[:, [1, 2, 3, 1, 3, 0]])
    return cuts.reshape(-1, 3)
