"""The mill's bodies as triangles: drum, end walls, shaft, blades, each closed, seen counter-clockwise from outside.

A body is an array (T, 3, 3): triangles, their corners, (x, y, z) in m. Corners that meet are the same numbers to the bit, so
that readers can join them; they lie on the true surface, and no flat is farther from it than a tolerance.
"""

import math

import numpy as np

from milltools.geometry.profile import Profile

SUNK = 0.005  # [m] a blade's foot is this deep in the shaft, or a third of its radius
CORNERS = np.array([(a, b, c) for a in (-1, 1) for b in (0, 1) for c in (-1, 1)], float)
# the six faces of a box by its CORNERS, counter-clockwise seen from outside (axes: width, radial, thickness)
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
MERGED = 1e-5  # of the drum's radius: corners of an outline closer than this are one; single precision tells them apart

# ---- blades


def _foot(blade, shaft_radius):
    """Radius [m] at which a blade's box begins: inside the shaft, its corners too."""
    sine, cosine = abs(math.sin(blade.pitch)), abs(math.cos(blade.pitch))
    half = (sine * blade.width + cosine * blade.thickness) / 2
    inside = math.sqrt(max(shaft_radius**2 - half**2, 0.0))
    return max(min(shaft_radius - SUNK, 0.95 * inside), 0.3 * inside, 1e-3 * blade.tip_radius)


def blade_corners(blade, shaft_radius):
    """The eight corners (8, 3) [m] of a blade at its angle, in the order of CORNERS."""
    foot = _foot(blade, shaft_radius)
    w = CORNERS[:, 0] * blade.width / 2
    radial = foot + CORNERS[:, 1] * (blade.tip_radius - foot)
    h = CORNERS[:, 2] * blade.thickness / 2
    x = math.cos(blade.pitch) * w - math.sin(blade.pitch) * h
    across = math.sin(blade.pitch) * w + math.cos(blade.pitch) * h
    c, s = math.cos(blade.angle), math.sin(blade.angle)
    return np.stack([x + blade.position, c * radial - s * across, s * radial + c * across], axis=1)


def blade_triangles(deck, turn):
    """Closed surfaces of all blades, the rotor turned on by `turn` [rad]: (T, 3, 3) corners [m], outward."""
    c, s = math.cos(turn), math.sin(turn)
    turned = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    triangles = []
    for blade in deck.blades:
        corner = blade_corners(blade, deck.shaft_radius) @ turned
        for a, b, c_, d in FACES:
            triangles += [corner[[a, b, c_]], corner[[a, c_, d]]]
    return np.array(triangles)


# ---- drum, walls, shaft


def circle(radius, tolerance, angle=0.0):
    """Outline (N, 2) of a circle, its first corner at `angle`; chords within the tolerance."""
    return Profile(radius, angle=angle).outline(tolerance)


def _cross(a, b, c):
    """Twice the area of the triangle a b c, positive if it turns left; arrays (..., 2)."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def triangulate(polygon):
    """Triangles (N - 2, 3), indices into a polygon (N, 2) that runs counter-clockwise and may touch itself along a bridge
    to a hole: ears are cut off one by one (G. H. Meisters, Am. Math. Monthly 82, 648, 1975)."""
    left, ears = list(range(len(polygon))), []
    at, failed = 0, 0
    while len(left) > 3:
        before, tip, after = (left[(at + k) % len(left)] for k in (-1, 0, 1))
        a, b, c = polygon[[before, tip, after]]
        if _is_ear(polygon, left, a, b, c):
            ears.append((before, tip, after))
            del left[at % len(left)]
            failed = 0
            at = (at + 1) % len(left)  # not the neighbour again: fans of slivers come of that
        else:
            failed += 1
            at = (at + 1) % len(left)
            if failed > len(left):
                raise ValueError("the outline crosses itself")
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
    """The closed body between x = low and x = high within an outline (N, 2) of (y, z), counter-clockwise, and without
    what lies within `hole` (M, 2), counter-clockwise too; the first corners of both must see each other."""
    rings = [outline] if hole is None else [outline, hole[::-1]]  # a hole is walked the other way
    count = len(outline)
    points = np.concatenate(rings)
    if hole is None:
        order = np.arange(count)
    else:  # around, over the bridge, around the hole, and back
        last = len(points) - 1  # the hole's first corner, now last
        order = np.concatenate([np.arange(count), [0], [last], np.arange(count, last + 1)])
    cap = order[triangulate(points[order])]
    ends = [np.insert(points, 0, x, axis=1) for x in (low, high)]
    # seen from outside: along +x at the far end, the other way round at the near one
    triangles = [ends[1][cap], ends[0][cap[:, ::-1]]]
    start = 0
    for ring in rings:
        k = start + np.arange(len(ring))
        n = start + (np.arange(len(ring)) + 1) % len(ring)
        triangles += [
            np.stack([ends[0][k], ends[0][n], ends[1][n]], axis=1),
            np.stack([ends[0][k], ends[1][n], ends[1][k]], axis=1),
        ]
        start += len(ring)
    return np.concatenate(triangles)


def _merged(outline, least):
    """An outline without corners closer than `least` [m] to the one before."""
    kept = [outline[0]]
    for point in outline[1:]:
        if math.dist(point, kept[-1]) >= least:
            kept.append(point)
    while len(kept) > 3 and math.dist(kept[-1], kept[0]) < least:
        kept.pop()
    return np.array(kept)


def drum(deck, tolerance, thickness):
    """[the drum]: a tube, inside the profile, outside a circle `thickness` [m] beyond its outermost point."""
    profile, half = Profile.of(deck.value), deck.number("drum.length") / 2
    hole = profile.outline(tolerance)
    # an arc starts half its angle before its middle: begin at an outermost point, where the outer circle is near
    hole = np.roll(hole, -int(np.argmax(np.hypot(*hole.T))), axis=0)
    hole = _merged(hole, MERGED * profile.radius)
    angle = math.atan2(hole[0, 1], hole[0, 0])
    rim = circle(profile.outermost + thickness, tolerance, angle)
    return [prism(rim, -half, half, hole)]


def walls(deck, tolerance, thickness):
    """[both end walls]: discs that close the drum."""
    profile, half = Profile.of(deck.value), deck.number("drum.length") / 2
    rim = circle(profile.outermost + thickness, tolerance)
    return [prism(rim, -half - thickness, -half), prism(rim, half, half + thickness)]


def shaft(deck, tolerance, _thickness):
    """[the shaft], from end wall to end wall; [] without one."""
    radius, half = deck.shaft_radius, deck.number("drum.length") / 2
    return [prism(circle(radius, min(tolerance, radius / 4)), -half, half)] if radius > 0 else []


def blades(deck, _tolerance, _thickness):
    """[every blade], a box from within the shaft to its tip, the rotor as at t = 0."""
    return list(blade_triangles(deck, 0.0).reshape(-1, 2 * len(FACES), 3, 3))


PARTS = {"drum": drum, "walls": walls, "shaft": shaft, "blades": blades}
