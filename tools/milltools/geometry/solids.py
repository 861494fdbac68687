"""Drum, end walls, shaft and blades as closed bodies of triangles, counter-clockwise seen from outside.

A body is an array (T, 3, 3): triangles, corners, (x, y, z) in m. Common corners are equal to the bit, so that readers
can join them. All corners are on the true surface, and no triangle is farther from it than a tolerance.
"""

import math

import numpy as np

from milltools.geometry import contour

PARTS = ("drum", "walls", "shaft", "blades")
SUNK = 0.005  # [m] depth of a blade's foot in the shaft, in thin shafts less
CORNERS = np.array([(a, b, c) for a in (-1, 1) for b in (0, 1) for c in (-1, 1)], float)
# the six faces of a box by its CORNERS, counter-clockwise seen from outside (axes: width, radial, thickness)
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
MERGED = 1e-5  # of the drum's radius: closer corners of an outline are merged; single precision resolves the others

# ---- blades


def blade_triangles(deck, turn):
    """Closed surfaces of all blades with the rotor turned by `turn` [rad]: corners (T, 3, 3) [m], facing outwards."""
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    triangles = []
    for blade in deck.blades:
        sine, cosine = math.sin(blade.pitch), math.cos(blade.pitch)
        half = (abs(sine) * blade.width + abs(cosine) * blade.thickness) / 2
        # where the corners of the foot are inside the shaft, too
        inside = math.sqrt(max(deck.shaft_radius**2 - half**2, 0.0))
        foot = max(min(deck.shaft_radius - SUNK, 0.95 * inside), 0.3 * inside, 1e-3 * blade.tip_radius)
        w, h = CORNERS[:, 0] * blade.width / 2, CORNERS[:, 2] * blade.thickness / 2
        radial = foot + CORNERS[:, 1] * (blade.tip_radius - foot)
        x, across = cosine * w - sine * h, sine * w + cosine * h
        c, s = math.cos(blade.angle), math.sin(blade.angle)
        corner = np.stack([x + blade.position, c * radial - s * across, s * radial + c * across], axis=1) @ turned
        for p, q, r, t in FACES:
            triangles += [corner[[p, q, r]], corner[[p, r, t]]]
    return np.array(triangles)


# ---- drum, walls, shaft


def circle(radius, tolerance, angle=0.0):
    """Outline (N, 2) of a circle, its first corner at `angle`; chords within the tolerance."""
    y, z = radius * math.cos(angle), radius * math.sin(angle)
    return contour.Contour([(y, z, 1), (-y, -z, 1)]).flattened(tolerance)


def _cross(a, b, c):
    """Twice the area of the triangle a b c, positive if it turns left; arrays (..., 2)."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def triangulate(polygon):
    """Triangles (N - 2, 3) as indices into a counter-clockwise polygon (N, 2), which can touch itself along a bridge to
    a hole. Ears are cut off one by one (G. H. Meisters, Am. Math. Monthly 82, 648, 1975)."""
    left, ears = list(range(len(polygon))), []
    at, failed = 0, 0
    while len(left) > 3:
        before, tip, after = (left[(at + k) % len(left)] for k in (-1, 0, 1))
        a, b, c = polygon[[before, tip, after]]
        failed += 1
        if _is_ear(polygon, left, a, b, c):
            ears.append((before, tip, after))
            del left[at % len(left)]
            failed = 0
        elif failed > len(left):
            raise ValueError("the outline crosses itself")
        at = (at + 1) % len(left)  # skip the neighbour of the ear, to avoid fans of thin triangles
    return np.array([*ears, left])


def _is_ear(polygon, left, a, b, c):
    if not _cross(a, b, c) > 0:
        return False
    others = polygon[left]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    others = others[((others >= low) & (others <= high)).all(axis=1)]
    own = (others == a).all(axis=1) | (others == b).all(axis=1) | (others == c).all(axis=1)
    p = others[~own]
    inside = (_cross(a, b, p) >= 0) & (_cross(b, c, p) >= 0) & (_cross(c, a, p) >= 0)
    return not inside.any()


def prism(outline, low, high, hole=None):
    """The closed body between x = low and x = high inside an `outline` (N, 2) of (y, z) and outside a `hole` (M, 2),
    both counter-clockwise. The line between their first corners must not cross them."""
    rings = [outline] if hole is None else [outline, hole[::-1]]  # the hole in the opposite direction
    count = len(outline)
    points = np.concatenate(rings)
    order = np.arange(count)
    if hole is not None:  # the outline, the bridge to the hole's first corner (now the last), the hole, and back
        order = np.r_[order, 0, len(points) - 1, count : len(points)]
    cap = order[triangulate(points[order])]
    ends = [np.insert(points, 0, x, axis=1) for x in (low, high)]
    # counter-clockwise from outside: the end at `high` as it is, the end at `low` reversed
    triangles = [ends[1][cap], ends[0][cap[:, ::-1]]]
    for k in np.split(np.arange(len(points)), [count])[: len(rings)]:
        n = np.roll(k, -1)
        triangles += [
            np.stack([ends[0][k], ends[0][n], ends[1][n]], axis=1),
            np.stack([ends[0][k], ends[1][n], ends[1][k]], axis=1),
        ]
    return np.concatenate(triangles)


def _merged(outline, least):
    """An outline without corners that are closer than `least` [m] to the previous corner."""
    kept = [outline[0]]
    for point in outline[1:]:
        if math.dist(point, kept[-1]) >= least:
            kept.append(point)
    while len(kept) > 3 and math.dist(kept[-1], kept[0]) < least:
        kept.pop()
    return np.array(kept)


def parts(deck, tolerance, thickness) -> dict[str, list[np.ndarray]]:
    """The closed bodies of each of PARTS at t = 0. Drum: a tube with its contour inside and a circle outside,
    `thickness` [m] beyond the outermost point. Walls: discs that close the drum, if its ends are not periodic. Shaft,
    if there is one: from end to end. Blades: boxes from inside the shaft to their tips."""
    wall, half, radius = contour.of(deck), deck.number("drum.length") / 2, deck.shaft_radius
    hole = wall.flattened(tolerance)
    # begin at an outermost point, where the outer circle is near
    hole = np.roll(hole, -int(np.argmax(np.hypot(*hole.T))), axis=0)
    hole = _merged(hole, MERGED * wall.outermost)
    angle = math.atan2(hole[0, 1], hole[0, 0])
    tube = circle(wall.outermost + thickness, tolerance, angle)
    # half a side further: bodies that share edges would not be closed for readers that join all corners of a file
    rim = circle(wall.outermost + thickness, tolerance, angle + math.pi / len(tube))
    return {
        "drum": [prism(tube, -half, half, hole)],
        "walls": [prism(rim, -half - thickness, -half), prism(rim, half, half + thickness)] * (not deck.periodic),
        "shaft": [prism(circle(radius, min(tolerance, radius / 4)), -half, half)] if radius > 0 else [],
        "blades": list(blade_triangles(deck, 0.0).reshape(-1, 2 * len(FACES), 3, 3)),
    }
