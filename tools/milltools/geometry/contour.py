"""A closed curve of lines and circular arcs, the inner face of a liner: its area, distances, where balls fit.

A contour is an array (n, 3) of rows x, y [m], bulge, one vertex a row, anticlockwise: the balls are on the left, the
solid is on the right. Piece i goes from vertex i to the next one, the last piece to the first vertex. As in DXF, the
bulge is tan(sweep/4): 0 is a line, 1 half a circle that turns anticlockwise. An arc with a bulge above 0 lies to the
right of its chord, on a circle of radius c (1 + b^2)/(4 |b|) for a chord of length c. Along a piece at shares t of its
length, the chord from its start has the length c sin(t a/2)/sin(a/2) with a = 4 atan(b), and is turned by (t - 1) a/2.
This holds for lines, too, and does not use the centre, which is far away for small bulges.
"""

import functools
import math
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.files import opened
from milltools.base.text import plain

TINY = 1e-9  # of the size of a contour: what is closer than this meets
READ = 4000  # vertices of a contour that millsim reads
MOST_PIECES = 50_000
LARGEST, BULGE = 1e12, 1e3  # a coordinate; a bulge
CELLS = 24  # across a contour, for points that are computed together
AT_ONCE = 2_000_000  # pairs that are computed together
# cosines of the angle between the normals of two sides: at a neck, of a slot, of walls with a ground between
NECK, SLOT, WALLS = -0.95, -1 + 1e-6, -0.3
SAME = 1e-6  # balls that differ by less fit alike
SHARES = np.array([0.05, 0.275, 0.5, 0.725, 0.95])  # where pieces and corners are tried

LONGEST = 4096  # characters of a row
# three numbers, as millsim reads them: commas between all or between none
_ROW = re.compile(
    rb"\s*,?\s*(%b)(?:(\s+)|\s*,\s*)(%b)(?(2)\s+|\s*,\s*)(%b)[\s,]*"
    % ((rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?",) * 3)
)


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def left(a):
    return np.stack([-a[..., 1], a[..., 0]], axis=-1)


def _turned(a, angle):
    return np.stack([np.cos(angle) * a[..., 0] - np.sin(angle) * a[..., 1],
                     np.sin(angle) * a[..., 0] + np.cos(angle) * a[..., 1]], axis=-1)  # fmt: skip


def bow(bulge):
    """Area between arcs and their chords, above 0 for anticlockwise ones, for chords of length 1."""
    b = np.asarray(bulge, float)
    with np.errstate(all="ignore"):
        closed = ((1 + b * b) ** 2 * np.arctan(b) - b * (1 - b * b)) / (8 * b * b)
    return np.where(np.abs(b) < 0.03, b * (1 / 3 + b**2 * (1 / 15 - b**2 * (1 / 105 - b**2 / 315))), closed)


class Contour:
    """A contour of rows x, y [m], bulge; `clockwise` ones are reversed. `vertices`: the array (n, 3); per piece
    `start`, `chord` (n, 2), `width` (of the chord), `sweep` [rad], `lengths` (n,), and of arcs `centre`, `radius` (of
    lines infinite). ValueError for rows that are no contour."""

    def __init__(self, vertices):
        rows = np.array(vertices, float)
        if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 2:
            raise ValueError("expected two or more rows x, y, bulge")
        if not (np.abs(rows) < [LARGEST, LARGEST, BULGE]).all():
            raise ValueError(f"expected coordinates below {LARGEST:g}, and bulges below {BULGE:g}")
        if len(rows) > MOST_PIECES:
            raise ValueError(f"{len(rows)} vertices: expected at most {MOST_PIECES}")
        self.clockwise = signed_area(rows) < 0
        if self.clockwise:
            rows = np.column_stack([rows[::-1, :2], -np.roll(rows[::-1, 2], -1)])
        rows.setflags(write=False)
        self.vertices = rows
        self._measure(rows)
        if not self.width.min() > 0:
            raise ValueError(f"vertex {int(np.argmin(self.width)) + 1} and the next one are the same point")

    def _measure(self, rows):
        bulge, self.start = rows[:, 2], rows[:, :2]
        self.end = np.roll(self.start, -1, axis=0)
        self.chord = self.end - self.start
        self.width = np.hypot(*self.chord.T)
        self.sweep = 4 * np.arctan(bulge)
        self.size = float(np.ptp(self.start, axis=0).max() + np.abs(bulge * self.width).max())
        self.is_arc = np.abs(bulge) * self.width > 1e-12 * self.size
        with np.errstate(all="ignore"):
            self.lengths = self.width * np.where(bulge == 0, 1, (1 + bulge**2) * np.arctan(bulge) / bulge)
            self.radius = np.where(self.is_arc, self.width * (1 + bulge**2) / (4 * np.abs(bulge)), np.inf)
            self.unit = self.chord / self.width[:, None]
            away = np.where(self.is_arc, self.width * (1 - bulge**2) / (4 * bulge), 0)
            self._bend = 4 * bulge / (self.width * (1 + bulge**2))  # curvature, above 0 to the left
        self.centre = (self.start + self.end) / 2 + left(self.unit) * away[:, None]
        self._middle = (self.start + self.end) / 2 - left(self.unit) * (bulge * self.width / 2)[:, None]

    @functools.cached_property
    def area(self) -> float:
        """Enclosed area [m^2]."""
        return signed_area(self.vertices)

    @property
    def length(self) -> float:
        """Developed length [m]."""
        return float(self.lengths.sum())

    @functools.cached_property
    def box(self) -> np.ndarray:
        """Bounding box [[x, y] least, [x, y] largest] [m]."""
        return np.stack([self._low.min(axis=0), self._high.max(axis=0)])

    @functools.cached_property
    def _boxes(self):
        low, high, every = np.minimum(self.start, self.end), np.maximum(self.start, self.end), range(len(self.vertices))
        for way in (0, np.pi / 2, np.pi, 3 * np.pi / 2):  # where pieces go along x or y
            turn = (way - np.arctan2(self.unit[:, 1], self.unit[:, 0]) + np.pi) % (2 * np.pi) - np.pi
            with np.errstate(all="ignore"):
                share = np.where(np.abs(turn) < np.abs(self.sweep) / 2, 0.5 + turn / self.sweep, 0.0)
            p = self.points(every, share)
            low, high = np.minimum(low, p), np.maximum(high, p)
        return low, high

    @functools.cached_property
    def outermost(self) -> float:
        """Largest distance from the origin [m]."""
        _, _, there, _ = self._beside(slice(None), np.zeros(2))
        away = np.hypot(*self.centre.T) + self.radius
        return float(max(np.hypot(*self.start.T).max(), away[there & self.is_arc].max(initial=0)))

    @functools.cached_property
    def innermost(self) -> float:
        """Least distance from the origin [m]."""
        least = float(self._away(np.zeros((1, 2)))[0])
        return least if least < self.outermost * (1 - 1e-14) else self.outermost

    @property
    def circle(self) -> bool:
        """Whether it is a circle about the origin."""
        return self.innermost == self.outermost

    @property
    def _low(self):
        return self._boxes[0]

    @property
    def _high(self):
        return self._boxes[1]

    def _beside(self, i, points):
        """Of points, and the lines or circles of pieces i: distance on the left; whether the nearest point, and whether
        the farthest one of the circle is on the piece; the direction of the normal, a pair along and left of the chord.
        Without the centre, which is far away for small bulges."""
        d, bend, unit = points - self._middle[i], self._bend[i], self.unit[i]
        x, y = (d * unit).sum(axis=-1), cross(unit, d)
        across, up = -bend * x, 1 - bend * y
        straight = np.hypot(across, up)
        within, most = np.abs(x) <= self.width[i] / 2 * straight, np.abs(self.vertices[i, 2]) > 1
        near, far = (np.where(most, ~within | side, within & side) for side in (up > 0, up < 0))
        return (2 * y - bend * (x * x + y * y)) / (1 + straight), near, far, (across, up)

    # ---- along the contour

    def points(self, piece, share):
        """Points (..., 2) [m] of pieces at shares 0..1 of their lengths."""
        a, t = self.sweep[piece], np.asarray(share, float)
        with np.errstate(all="ignore"):
            part = np.where(np.abs(a) < 1e-8, t, np.sin(t * a / 2) / np.sin(a / 2))
        return self.start[piece] + _turned(self.chord[piece] * part[..., None], (t - 1) * a / 2)

    def normals(self, piece, share):
        """Unit normals (..., 2) towards the balls, of pieces at shares of their lengths."""
        return left(_turned(self.unit[piece], (np.asarray(share, float) - 0.5) * self.sweep[piece]))

    def at(self, s):
        """(piece, share of it) at developed lengths s [m] from the first vertex on; s is taken modulo the length."""
        ends = np.cumsum(self.lengths)
        s = np.asarray(s, float) % ends[-1]
        piece = np.minimum(np.searchsorted(ends, s, side="right"), len(ends) - 1)
        return piece, np.clip((s - ends[piece] + self.lengths[piece]) / self.lengths[piece], 0, 1)

    def divided(self, step):
        """The same curve with every piece cut into equal ones of at most `step` [m]."""
        return Contour(_divided(self, np.ceil(self.lengths / step * (1 - 1e-9)).astype(int)))  # equal parts alike

    def flattened(self, tolerance) -> np.ndarray:
        """Corners (N, 2) [m] of a polygon with its corners on the contour, at most `tolerance` [m] away from it."""
        part = np.where(self.is_arc, np.minimum(tolerance / (2 * self.radius), 0.5), 0.5)
        return _divided(self, np.ceil(np.abs(self.sweep) / (4 * np.arcsin(np.sqrt(part)))).astype(int).clip(1))[:, :2]

    # ---- points in the plane

    def winding(self, points) -> np.ndarray:
        """How many times the curve goes around points (N, 2): of a contour 1 inside and 0 outside."""
        return self._in_parts(self._winding, points)

    def _winding(self, p):
        # pieces that a ray towards larger x can meet
        low, high = p.min(axis=0) - TINY * self.size, p.max(axis=0) + TINY * self.size
        k = np.flatnonzero((self._low[:, 1] <= high[1]) & (self._high[:, 1] >= low[1]) & (self._high[:, 0] >= low[0]))
        q, e, chord = p[:, None] - self.start[k], p[:, None] - self.end[k], self.chord[k]
        left = cross(chord, q)
        # a point on a chord counts as if it were a little above, and less to the right
        level = np.where(chord[:, 0] != 0, chord[:, 0], -chord[:, 1])
        left = np.where(left == 0, level, left)
        # up through the height of p with p on the left, or down with p on the right
        count = ((q[..., 1] >= 0) & (e[..., 1] < 0) & (left > 0)).sum(axis=1)
        count -= ((q[..., 1] < 0) & (e[..., 1] >= 0) & (left < 0)).sum(axis=1)
        arcs, left = k[self.is_arc[k]], left[:, self.is_arc[k]]
        way = np.sign(self.vertices[arcs, 2])
        between = (way * self._beside(arcs, p[:, None])[0] > 0) & (way * left < 0)  # the chord and the arc
        return count + np.where(between, way, 0).sum(axis=1).astype(int)

    def gap(self, points) -> np.ndarray:
        """Distance [m] of points (N, 2) from the contour, below 0 in the solid."""
        away = self._in_parts(self._away, points)
        return np.where(self.winding(points) > 0, away, -away)

    def _away(self, p):
        # pieces that can be the nearest ones of points in this box
        low, high = p.min(axis=0), p.max(axis=0)
        most = np.hypot(*(self.start - (low + high) / 2).T).min() + np.hypot(*(high - low)) / 2
        apart = np.maximum(self._low - high, low - self._high).clip(0)
        k = np.flatnonzero(np.hypot(*apart.T) <= most * (1 + 1e-9))
        away, near, _, _ = self._beside(k, p[:, None])
        ends = np.hypot(*np.moveaxis(p[:, None] - self.start[k], -1, 0))
        return np.minimum(np.where(near, np.abs(away), np.inf), ends).min(axis=1)

    def _in_parts(self, of, points):
        points = np.asarray(points, float).reshape(-1, 2)
        found = np.zeros(len(points), int if of == self._winding else float)
        # neighbours together, of which few pieces are near
        cell = np.floor((points - self.box[0]) / (self.size / CELLS)).clip(-1, CELLS + 1) @ [CELLS + 3, 1]
        order = np.argsort(cell, kind="stable")
        for some in np.split(order, np.flatnonzero(np.diff(cell[order])) + 1) if len(points) else ():
            for part in np.array_split(some, 1 + len(some) * len(self.vertices) // AT_ONCE):
                found[part] = of(points[part])
        return found

    # ---- where pieces meet

    def crossings(self) -> np.ndarray:
        """Points (N, 2) [m] where the contour crosses, touches or follows itself."""
        return self._meetings()[2]

    def _meetings(self):
        """(pieces (N, 2), shares (N, 2), points (N, 2)) where pieces meet but at the vertex that two of them share."""
        i, j = self._near()
        n, eps = len(self.vertices), TINY * self.size
        found = [self._meet(i, j, k) for k in (0, 1)] + [self._overlap(i, j)]
        i, j, p = np.tile(i, 3), np.tile(j, 3), np.concatenate(found)
        good = np.isfinite(p).all(axis=1)
        i, j, p = i[good], j[good], p[good]
        shares = np.stack([self._share(i, p), self._share(j, p)], axis=1)
        slack = eps / np.stack([self.lengths[i], self.lengths[j]], axis=1)
        good = ((shares >= -slack) & (shares <= 1 + slack)).all(axis=1)
        for one, other in ((i, j), (j, i)):
            near = np.hypot(*(p - self.start[other]).T) <= 2 * eps
            good &= ~(((one + 1) % n == other) & near)
        i, j, p, shares = i[good], j[good], p[good], shares[good].clip(0, 1)
        _, first = np.unique(np.column_stack([i, j, np.round(p / (4 * eps))]), axis=0, return_index=True)
        return np.stack([i, j], axis=1)[first], shares[first], p[first]

    def _near(self):
        """Pairs i < j of pieces whose boxes meet."""
        eps, order = TINY * self.size, np.argsort(self._low[:, 0], kind="stable")
        last = np.searchsorted(self._low[order, 0], self._high[order, 0] + eps, side="right")
        found, some = [np.zeros((0, 2), int)], max(1, AT_ONCE // len(order))
        for k in range(0, len(order), some):
            counts = last[k : k + some] - np.arange(k, min(k + some, len(order))) - 1
            first = np.repeat(np.arange(k, k + len(counts)), counts)
            second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
            i, j = order[first], order[second]
            meet = (self._low[j, 1] <= self._high[i, 1] + eps) & (self._high[j, 1] >= self._low[i, 1] - eps)
            found.append(np.sort(np.stack([i[meet], j[meet]], axis=1), axis=1))
        return np.concatenate(found).T

    def _meet(self, i, j, k):
        """Where pieces i and j meet: root k = 0 or 1; NaN where there is none. Of neighbours, one root is the vertex
        they share, and the other one its reflection, which stays exact where they are tangent."""
        p = np.full((len(i), 2), np.nan)
        arcs = self.is_arc[i].astype(int) + self.is_arc[j]
        with np.errstate(all="ignore"):
            if k == 0:
                both = arcs == 0
                a, b = i[both], j[both]
                down = cross(self.unit[a], self.unit[b])
                t = cross(self.start[b] - self.start[a], self.unit[b]) / np.where(np.abs(down) > 1e-12, down, np.nan)
                p[both] = self.start[a] + t[:, None] * self.unit[a]
            one = arcs == 1
            a = np.where(self.is_arc[i], j, i)[one]  # the line
            b = np.where(self.is_arc[i], i, j)[one]  # the arc
            foot = self.start[a] + self.unit[a] * ((self.centre[b] - self.start[a]) * self.unit[a]).sum(1)[:, None]
            p[one] = foot + (1, -1)[k] * self._half(b, np.hypot(*(foot - self.centre[b]).T))[:, None] * self.unit[a]
            p[one] = self._reflected(a, b, p[one], foot, self.unit[a])
            two = arcs == 2
            a, b = i[two], j[two]
            line = self.centre[b] - self.centre[a]
            apart = np.hypot(*line.T)
            apart = np.where(apart > TINY * self.size, apart, np.nan)
            line = line / apart[:, None]
            along = (apart + (self.radius[a] - self.radius[b]) * (self.radius[a] + self.radius[b]) / apart) / 2
            foot = self.centre[a] + line * along[:, None]
            p[two] = foot + (1, -1)[k] * self._half(a, along)[:, None] * left(line)
            p[two] = self._reflected(a, b, p[two], foot, left(line))
        return p

    def _half(self, arc, away):
        """Half of the chord that a line at a distance cuts from the circle of an arc; 0 if they touch."""
        square = (self.radius[arc] - away) * (self.radius[arc] + away)
        return np.sqrt(np.where(np.abs(square) < 1e-14 * self.radius[arc] ** 2, 0, square))

    def _reflected(self, a, b, p, foot, way):
        n = len(self.vertices)
        for first, second in ((a, b), (b, a)):
            shared = self.start[second]
            other = shared - 2 * ((shared - foot) * way).sum(axis=1)[:, None] * way
            p = np.where((((first + 1) % n == second) & (n > 2))[:, None], other, p)
        return p

    def _overlap(self, i, j):
        """A point that pieces on the same line or circle have in common; NaN if there is none."""
        eps = TINY * self.size
        lines = ~self.is_arc[i] & ~self.is_arc[j]
        with np.errstate(all="ignore"):
            same = lines & (np.abs(cross(self.unit[i], self.unit[j])) < 1e-9)
            same &= np.abs(cross(self.unit[i], self.start[j] - self.start[i])) < eps
            circles = self.is_arc[i] & self.is_arc[j] & (np.hypot(*(self.centre[i] - self.centre[j]).T) < eps)
            circles &= np.abs(self.radius[i] - self.radius[j]) < eps
        found = np.full((len(i), 2), np.nan)
        k = np.flatnonzero(same | circles)
        for share in (0.0, 1.0, 0.5):  # of several points, the last one counts
            for one, other in ((i[k], j[k]), (j[k], i[k])):
                p = self.points(one, share)
                t = self._share(other, p) * self.lengths[other]
                within = (eps < t) & (t < self.lengths[other] - eps)
                found[k[within]] = p[within]
        return found

    def _share(self, piece, p):
        """The share of the length of pieces at which points on their lines or circles are; outside of 0..1 for points
        that are not on the piece."""
        d, a = p - self.start[piece], self.sweep[piece]
        along, across = (d * self.unit[piece]).sum(axis=-1), cross(self.unit[piece], d)
        with np.errstate(all="ignore"):
            wide = 1 + 2 * np.arctan2(across, along) / a
            half = np.arcsin(np.clip(np.hypot(along, across) * np.sin(np.abs(a) / 2) / self.width[piece], -1, 1))
            near = np.where(along < 0, -1, 1) * 2 * half / np.abs(a)
        turn = 2 * np.pi / np.abs(a).clip(1e-9)  # what is farther than halfway around is behind the start
        wide = np.where(wide > (1 + turn) / 2, wide - turn, wide)
        wide = np.where(np.hypot(along, across) < TINY * self.size, 0, wide)
        curved = np.where(np.abs(a) < 1, near, wide)
        return np.where(self.is_arc[piece], curved, along / self.width[piece])

    # ---- the room for balls

    @functools.cached_property
    def turns(self) -> np.ndarray:
        """Angles [rad] of the corners at the vertices; below 0 where the solid points at the balls."""
        every = np.arange(len(self.vertices))
        before, after = self.normals(every - 1, 1.0), self.normals(every, 0.0)
        return np.arctan2(cross(before, after), (before * after).sum(axis=1))

    def _spots(self, piece, share):
        """Points and normals of pieces at shares of them; a piece n + i is the corner at vertex i of n."""
        i, corner = piece % len(self.vertices), (piece >= len(self.vertices))[:, None]
        turned = _turned(self.normals(i - 1, 1.0), share * self.turns[i])
        return (np.where(corner, self.start[i], self.points(i, share)),
                np.where(corner, turned, self.normals(i, share)))  # fmt: skip

    def touching(self, piece, share, most=np.inf):
        """(radius [m], piece, its normal) of the largest ball inside that touches the contour at a point of each of the
        given pieces (see `_spots`), and the piece that it touches then, too. Radii above `most` [m] may be too large.
        """
        p, n = self._spots(piece, share)
        i = piece % len(self.vertices)
        own = np.where((piece == i) & (self.vertices[i, 2] > 0), self.radius[i], np.inf)
        best, other, facing = np.minimum(own, 2 * self.size), i.copy(), n.copy()
        for k in range(0, len(p), 256):  # neighbours, which have few pieces in their reach
            part = slice(k, k + 256)
            low, high = p[part].min(axis=0) - 2 * most, p[part].max(axis=0) + 2 * most
            near = np.flatnonzero(((self._low <= high) & (self._high >= low)).all(axis=1))
            self._touching(near, p[part], n[part], piece[part], best[part], other[part], facing[part], most)
        return best, other, facing

    def _touching(self, pieces, p, n, piece, best, other, facing, most):
        """Makes best and other smaller for what `pieces` do to balls at points p with normals n of other pieces."""
        d = self.start[pieces] - p[:, None]
        ahead = (d * n[:, None]).sum(axis=-1)
        with np.errstate(all="ignore"):
            ball = np.where(ahead > TINY * self.size, (d**2).sum(axis=-1) / (2 * ahead), np.inf)
        k = ball.argmin(axis=1)
        ball = ball[np.arange(len(p)), k]
        closer = ball < best * (1 - 1e-9)
        best[closer], other[closer] = ball[closer], pieces[k[closer]]
        facing[closer] = n[closer] - d[np.arange(len(p)), k][closer] / ball[closer, None]
        reach = np.minimum(best, most)
        c = p + reach[:, None] * n
        grown = reach[:, None, None] * (1 + 1e-9)
        near = ((self._low[pieces] <= c[:, None] + grown) & (self._high[pieces] >= c[:, None] - grown)).all(axis=-1)
        at, q = np.nonzero(near & (pieces != piece[:, None]))
        q = pieces[q]
        o, m, u, bend = p[at] - self._middle[q], n[at], self.unit[q], self._bend[q]
        y = cross(u, o)
        with np.errstate(all="ignore"):
            # the ball whose centre has its radius as its distance from the line or circle
            down = 1 - cross(u, m) + bend * (o * m).sum(axis=1)
            ball = (2 * y - bend * (o * o).sum(axis=1)) / (2 * down)
            _, ok, _, normal = self._beside(q, p[at] + ball[:, None] * m)
            normal = (normal[0][:, None] * u + normal[1][:, None] * left(u)) / np.hypot(*normal)[:, None]
        ok &= (down > 1e-9) & (ball > TINY * self.size) & np.isfinite(ball)
        order = np.flatnonzero(ok)[np.argsort(-ball[ok], kind="stable")]
        closest, last = np.full(len(p), np.inf), np.zeros(len(p), int)
        closest[at[order]], last[at[order]] = ball[order], order
        closer = np.flatnonzero(closest < best)
        best[closer], other[closer], facing[closer] = closest[closer], q[last[closer]], normal[last[closer]]

    def narrow(self, radius):
        """(places, largest): where a ball of a radius [m] does not reach, narrowest first, at most 1000: rows x, y [m]
        of the centre and radius [m] of the largest ball that fits there; and, if the ball fits nowhere, such a row of
        the largest one of all, else None. A place is an arc that the ball touches nowhere, a piece or corner between
        two others that face each other, and the neck of a slot; what only gets narrower up to a corner is none. Places
        within a ball's diameter of each other are one."""
        n = len(self.vertices)
        # along the contour: pieces, and the corners where the solid points at the balls
        parts = np.stack([n + np.arange(n), np.arange(n)], axis=1)
        parts = parts[np.stack([self.turns < -1e-6, np.ones(n, bool)], axis=1)]
        u = (np.arange(len(parts))[:, None] + (SHARES if n <= 1000 else 0.5)).ravel()

        def touching(u):
            piece = parts[np.floor(u).astype(int) % len(parts)]
            ball, other, facing = self.touching(piece, u % 1, radius)
            p, own = self._spots(piece, u % 1)
            apart = (other - piece % n) % n  # of a corner the piece before it is a neighbour, too
            apart = (apart > 1 - (piece >= n)) & (apart < n - 1)
            return np.minimum(ball, radius), p + ball[:, None] * own, facing, (own * facing).sum(axis=1), apart

        def faced(before, after):
            return (before * after).sum(axis=1) < WALLS

        ball, centre, facing, cosine, apart = touching(u)
        before, after = np.roll(ball, 1), np.roll(ball, -1)
        neck, less = apart & (cosine < NECK), ball < radius
        top = (ball >= before) & (ball >= after) & less
        widest = np.argsort(np.where(top, -ball, 0), kind="stable")[:20]  # one may lead to the largest of all
        top &= neck | faced(np.roll(facing, 1, axis=0), np.roll(facing, -1, axis=0))
        top[widest] = True
        low = (ball <= before) & (ball <= after) & less & neck
        arc = parts[np.floor(u).astype(int)]
        alone = (arc < n) & (self.vertices[arc % n, 2] > 0) & (ball > self.radius[arc % n] * (1 - 1e-6))
        found = [np.column_stack([centre, ball])[(alone | (apart & (cosine < SLOT))) & less]]
        for chosen, sign in ((top, 1), (low, -1)):  # the largest or smallest ball between the neighbours of a spot
            k = np.flatnonzero(chosen)
            begin, end = u[k - 1] - len(parts) * (k == 0), u[(k + 1) % len(u)] + len(parts) * (k == len(u) - 1)
            for _ in range(45 * (len(k) > 0)):
                step = (end - begin) * 0.3819660112501051
                first = sign * touching(begin + step)[0] >= sign * touching(end - step)[0]
                begin, end = np.where(first, begin, begin + step), np.where(first, end - step, end)
            ball, centre, _, cosine, apart = touching((begin + end) / 2)
            told = apart & (cosine < SLOT)
            if sign > 0:
                told |= faced(touching(begin - 1e-6)[2], touching(end + 1e-6)[2]) | (less.all() & (ball == ball.max()))
            found.append(np.column_stack([centre, ball])[told])
        found = np.concatenate(found)
        found = found[np.argsort(found[:, 2], kind="stable")]
        if less.all() and found[-1, 2] < radius * (1 - SAME):
            return found[-1:], found[-1]
        kept = np.zeros((0, 3))
        for row in found[found[:, 2] < radius * (1 - SAME)]:
            if len(kept) < 1000 and (np.hypot(*(kept[:, :2] - row[:2]).T) > 2 * radius).all():
                kept = np.vstack([kept, row])
        return kept, None

    # ---- other contours

    def moved(self, by) -> "Contour":
        """The contour moved by a vector [m]."""
        return Contour(self.vertices + [*by, 0.0])

    # ---- files

    def text(self, comments=()) -> str:
        """The content of a contour file."""
        lines = [f"# {plain(line)}" for line in (*comments, "x [m]  y [m]  bulge (tan of a quarter of the sweep)")]
        return "\n".join(lines + [" ".join(repr(float(x) + 0.0) for x in row) for row in self.vertices]) + "\n"

    @classmethod
    def read(cls, path) -> "Contour":
        """Reads a contour file: rows x y [m] bulge; # begins a comment. A UserError names the wrong line. As millsim
        does: src/deck/deck_files.c."""
        rows = []
        with opened(path, "a contour") as file:
            for number, line in enumerate(file, 1):
                text = line.removeprefix(b"\xef\xbb\xbf" if number == 1 else b"").partition(b"#")[0]
                if not text.strip(b" \t\r\n\f\v,"):
                    continue
                match = _ROW.fullmatch(text) if len(text) <= LONGEST else None
                row = [float(word) for word in match.group(1, 3, 4)] if match else [math.inf]
                if not all(map(math.isfinite, row)):
                    said = plain(" ".join(text.decode("latin-1").split())[:60])
                    mixed = re.fullmatch(rb"(?=.*,)[-+.\deE\s,]*[^\s,]\s+[^\s,][-+.\deE\s,]*", text[:LONGEST])
                    mend = "; write decimal points, and commas between all numbers or none" if mixed else ""
                    raise UserError(f"{path}:{number}: expected 'x y bulge' (metres), got '{said}'{mend}")
                rows.append(row)
                if len(rows) > MOST_PIECES:
                    raise UserError(f"{path}:{number}: expected at most {MOST_PIECES} vertices")
        try:
            return cls(rows)
        except ValueError as fault:
            raise UserError(f"{path}: {fault}") from None


_made = functools.lru_cache(maxsize=32)(Contour)


def of(deck, section="drum") -> Contour:
    """The wall of the drum of a milltools.read.deck.Deck over y, z [m], or the contour of a body over its own x, y."""
    rows = deck.contours.get(section, ())
    if not rows and section == "drum" and deck.value("drum.profile", "circle") in ("circle", "wavy"):
        radius = deck.number("drum.radius")
        rows = (radius, 0.0, 1.0), (-radius, 0.0, 1.0)
    try:
        return _made(rows)
    except ValueError as fault:
        raise UserError(f"{deck.path}: [{section}]: {fault}") from None


def signed_area(rows) -> float:
    """The area [m^2] that rows (n, 3) enclose, below 0 for clockwise ones."""
    p = rows[:, :2] - rows[:, :2].mean(axis=0)
    q = np.roll(p, -1, axis=0)
    return float((cross(p, q) / 2 + ((q - p) ** 2).sum(axis=1) * bow(rows[:, 2])).sum())


def _divided(contour, counts):
    piece = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[piece]
    return np.column_stack([contour.points(piece, share), np.tan(contour.sweep[piece] / counts[piece] / 4)])
