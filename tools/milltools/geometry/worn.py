"""How a contour wears: what is left if its points move along their normals, as few lines and arcs."""

import math

import numpy as np

from milltools.geometry.contour import READ, TINY, Contour, bow, cross, left, signed_area

SHORT = 1e-7  # of the size: shorter pieces of a worn contour are left out
SHARP = math.radians(120)  # joints that turn by less stay joints when their pieces move
CORNER = math.radians(15)  # pieces that turn by more do not become one arc
CRUMBS = 0.01  # of the worn area: less that comes loose counts as worn, twice as much does not
FINE = 0.2  # of the radius of an arc: longer pieces of it are cut before they wear
FOLDED = 0.1  # of its length: a moved piece that is left with less, or turned around, is consumed
FAR = 3.0  # widths of what is consumed: neighbours that would meet farther away meet in its middle


def _moved(contour, depth):
    """The rows (n, 3) of the curve of which each vertex has moved by its depth (n,) [m] into the solid.

    The pieces move with their vertices, and two of them meet again where they would without a change of the depth: so
    no step is left between them, and a corner stays sharp; a sharper one than SHARP gets an arc where its pieces come
    apart. A piece that turns around, because its radius is smaller than the depth, is consumed: its neighbours meet
    where they cross, as faces of a solid do that move on. Elsewhere pieces may cross: see `_boundary`."""
    every = np.arange(len(contour.vertices))
    first, last = contour.normals(every, 0.0), contour.normals(every, 1.0)
    before = np.roll(last, 1, axis=0)
    turn = contour.turns
    begin, end = contour.start - depth[:, None] * first, contour.end - np.roll(depth, -1)[:, None] * last
    width = np.hypot(*(end - begin).T)
    meets = np.abs(turn) < SHARP
    tip = contour.start - depth[:, None] * (before + first) / np.maximum(1 + np.cos(turn), 0.1)[:, None]
    begin[meets], end[np.roll(meets, -1)] = tip[meets], np.roll(tip, -1, axis=0)[np.roll(meets, -1)]
    following = _without_folded(contour.end - contour.start, begin, end)
    rows = []
    for i in np.flatnonzero(following >= 0):
        share = np.hypot(*(end[i] - begin[i])) / max(width[i], TINY * contour.size)
        rows.append((*begin[i], contour.vertices[i, 2] * min(share, 1.0)))
        k = following[i]
        if (end[i] != begin[k]).any():
            rows.append((*end[i], math.tan(turn[k] / 4) if turn[k] > 0 else 0.0))
            if turn[k] < 0:  # the strips that both pieces sweep overlap
                rows.append((*contour.start[k], 0.0))
    rows = np.array(rows).reshape(-1, 3)
    step = np.hypot(*(np.roll(rows[:, :2], -1, axis=0) - rows[:, :2]).T)
    return rows[step > 1e-13 * contour.size]


def _without_folded(chord, begin, end):
    """The piece that follows each one (n,), -1 for pieces that are consumed: they point against their chords (n, 2).
    Moves the ends `begin` and `end` (n, 2) of their neighbours to where these cross."""
    n = len(chord)
    following, previous = np.roll(np.arange(n), -1), np.roll(np.arange(n), 1)

    def folded(i):
        return (end[i] - begin[i]) @ chord[i] <= FOLDED * chord[i] @ chord[i]

    waiting = [i for i in range(n) if folded(i)]
    while waiting:
        i = waiting.pop()
        if following[i] < 0 or not folded(i):
            continue
        a, b = previous[i], following[i]
        following[i] = -1
        if a in (b, i):
            return np.full(n, -1)
        following[a], previous[b] = b, a
        u, v = (chord[k] if folded(k) else end[k] - begin[k] for k in (a, b))
        turn, middle, gap = cross(u, v), (end[a] + begin[b]) / 2, np.hypot(*(end[a] - begin[b]))
        meet = begin[a] + cross(begin[b] - begin[a], v) / turn * u if turn else middle
        end[a] = begin[b] = meet if np.hypot(*(meet - middle)) <= FAR * gap else middle
        waiting += [a, b]
    return following


class _Curve(Contour):
    """A closed curve that may cross itself, in either direction."""

    def __init__(self, rows):
        self.vertices = np.asarray(rows, float)
        self._measure(self.vertices)


def _boundary(raw) -> tuple[list[Contour], float]:
    """The contours around the places about which a closed curve (N, 3) winds once or more, largest first, without the
    islands of the solid within them; and the area of these islands [m^2], which have come loose."""
    if len(raw) < 2:
        return [], 0.0
    curve = _Curve(raw)
    pieces, shares, points = curve._meetings()
    if not len(pieces):
        return [Contour(raw)] if signed_area(curve.vertices) > 0 else [], 0.0
    runs = _runs(curve, pieces, shares, points)
    middles, normals, steps = (np.array(x) for x in zip(*(_middle(curve, run) for _, _, run in runs)))
    inner = curve.winding(middles + steps[:, None] * normals)
    outer = curve.winding(middles - steps[:, None] * normals)
    kept: dict[int, list] = {}
    for (begin, end, run), a, b in zip(runs, inner, outer):
        if a >= 1 and b <= 0:
            kept.setdefault(begin, []).append((end, run))
    found, loose = [], 0.0
    while kept:
        begin = at = next(iter(kept))
        rows: list = []
        while at in kept:
            end, run = kept[at].pop()
            if not kept[at]:
                del kept[at]
            rows += run
            at = end
            if at == begin:
                break
        loop = _joined(curve, rows) if at == begin else []
        area = signed_area(loop) if len(loop) > 1 else 0.0
        loose -= min(area, 0.0)
        if area > (TINY * curve.size) ** 2:
            found.append(Contour(loop))
    return sorted(found, key=lambda one: -one.area), loose


def _runs(curve, pieces, shares, points):
    """[(node, node, [(piece, from share, to share)])]: the curve, cut where it meets itself. Nodes are numbers."""
    n = len(curve.vertices)
    cuts: list[list] = [[] for _ in range(n)]
    same = list(range(n + len(points)))

    def root(k):
        while same[k] != k:
            k = same[k]
        return k

    crossed = set()
    for k, (pair, share) in enumerate(zip(pieces.tolist(), shares.tolist())):
        for i, t in zip(pair, share):
            slack = 2 * TINY * curve.size / curve.lengths[i]
            if slack < t < 1 - slack:
                cuts[i].append((t, n + k))
            else:
                same[root(n + k)] = root((i + (t > 0.5)) % n)
        crossed.add(n + k)
    crossed = {root(k) for k in crossed}
    steps = []  # (piece, from, to, node at the end)
    for i in range(n):
        at = 0.0
        for t, node in sorted(cuts[i]):
            if t > at:
                steps.append((i, at, t, root(node)))
                at = t
        steps.append((i, at, 1.0, root((i + 1) % n)))
    ends = [k for k, step in enumerate(steps) if step[3] in crossed]
    steps = steps[ends[-1] + 1 :] + steps[: ends[-1] + 1]
    runs, run, begin = [], [], steps[-1][3]
    for i, a, b, node in steps:
        run.append((i, a, b))
        if node in crossed:
            runs.append((begin, node, run))
            run, begin = [], node
    return runs


def _middle(curve, run):
    """(point, normal to the left, a small step) in the middle of the longest piece of a run."""
    i, a, b = max(run, key=lambda step: (step[2] - step[1]) * curve.lengths[step[0]])
    t = (a + b) / 2
    return curve.points(i, t), curve.normals(i, t), 1e-4 * (b - a) * curve.lengths[i]


def _joined(curve, run):
    piece, a, b = (np.array(x) for x in zip(*run))
    rows = np.column_stack([curve.points(piece, a), np.tan(curve.sweep[piece] * (b - a) / 4)])
    step = np.hypot(*(np.roll(rows[:, :2], -1, axis=0) - rows[:, :2]).T)
    return rows[step > TINY * curve.size / 10]


def fitted(rows, tolerance) -> np.ndarray:
    """Rows (m, 3) of fewer lines and arcs along an open path (n, 3) of them, between the same ends, at most `tolerance`
    [m] away, with the same area below them; the last bulge has no meaning."""
    rows = np.asarray(rows, float)
    p, closing = rows[:, :2] - rows[0, :2], np.diff(rows[:, :2], axis=0)
    swept = np.concatenate([[0], np.cumsum(cross(p[:-1], p[1:]) / 2 + (closing**2).sum(1) * bow(rows[:-1, 2]))])
    half = 2 * np.arctan(rows[:-1, 2])
    way = np.arctan2(closing[:, 1], closing[:, 0])
    turn = (way[1:] - half[1:] - way[:-1] - half[:-1] + np.pi) % (2 * np.pi) - np.pi
    corner = np.append(np.abs(turn) > CORNER, True)  # at the end of each piece
    middle = (p[:-1] + p[1:]) / 2 - left(closing) * rows[:-1, 2:] / 2
    kept, i, last = [], 0, len(rows) - 1

    def arc(i, j):
        """The bulge of one arc from vertex i to j, None if it is too far away."""
        if j == i + 1:
            return rows[i, 2]
        chord = p[j] - p[i]
        width = math.hypot(*chord)
        if not width > 0:
            return None
        bulge = _bulge_of((swept[j] - swept[i] + cross(p[j], p[i]) / 2) / width**2)
        if bulge is None:
            return None
        unit, some = chord / width, np.concatenate([p[i + 1 : j], middle[i:j]])
        x, y = (some - p[i]) @ unit - width / 2, (some - p[i]) @ left(unit)
        # the arc as height below its chord: -y = f(x); without the centre, so that straight ones are no special case
        k = 4 * bulge / (width * (1 + bulge * bulge))  # curvature
        sag = bulge * width / 2
        root = 1 - (k * x) ** 2
        if (root < 0.04).any() or (np.abs(x) > width / 2 * (1 + 1e-9)).any():
            return None
        fall = sag - k * x * x / (1 + np.sqrt(root))
        return bulge if (np.abs(y + fall) * np.sqrt(root) <= tolerance).all() else None

    while i < last:
        end = i + int(np.argmax(corner[i:])) + 1  # the next corner
        step, j, bulge = 1, i + 1, rows[i, 2]
        while step and j < end:
            to = min(j + step, end)
            fits = arc(i, to)
            if fits is not None:
                j, bulge, step = to, fits, step * 2
            else:
                step = min(step, to - j) // 2
        kept.append((*rows[i, :2], bulge))
        i = j
    return np.array([*kept, rows[-1]])


def _bulge_of(area):
    """The bulge of an arc with this area between it and its chord of length 1; None above 0.6."""
    b = 3 * area
    for _ in range(30):
        if abs(b) > 0.7:
            return None
        slope = (bow(b + 1e-4) - bow(b - 1e-4)) / 2e-4
        step = (float(bow(b)) - area) / float(slope)
        b -= step
        if abs(step) < 1e-15:
            break
    return float(b) if abs(b) <= 0.6 else None


def simplified(contour: Contour, tolerance) -> Contour:
    """Fewer lines and arcs, at most `tolerance` [m] away, that enclose the same area; corners stay."""
    begin = int(np.abs(contour.turns).argmax())
    rows = np.roll(contour.vertices, -begin, axis=0)
    return Contour(fitted(np.concatenate([rows, rows[:1]]), tolerance)[:-1])


def along(contour: Contour, s, depth):
    """(area, mean) of depths [m] at developed lengths s [m] (increasing, within one turn), linear between them and
    periodic: their integral [m^2], and a function mean(x, width) that gives the mean over `width` [m] around x."""
    s, depth, length = np.asarray(s, float).ravel(), np.asarray(depth, float).ravel(), contour.length
    if s.shape != depth.shape or not len(s) or not np.isfinite(s).all() or not np.isfinite(depth).all():
        raise ValueError("expected as many finite depths as places")
    if not 0 <= s[0] <= s[-1] < length * (1 + 1e-12) or (np.diff(s) <= 0).any() or s[-1] - s[0] >= length:
        raise ValueError(f"places along the contour: expected increasing ones from 0 to {length} m")
    x, y = np.append(s, s[0] + length), np.append(depth, depth[0])
    total = np.concatenate([[0], np.cumsum(np.diff(x) * (y[1:] + y[:-1]) / 2)])

    def integral(at):
        turns, rest = np.divmod(at - x[0], length)
        rest = rest + x[0]
        k = np.clip(np.searchsorted(x, rest, side="right") - 1, 0, len(x) - 2)
        d = rest - x[k]
        return turns * total[-1] + total[k] + d * (y[k] + d * (y[k + 1] - y[k]) / (x[k + 1] - x[k]) / 2)

    def mean(at, width):
        if width < 1e-9 * length:
            return np.interp((at - x[0]) % length + x[0], x, y)
        return (integral(at + width / 2) - integral(at - width / 2)) / width

    return float(total[-1]), mean


def worn(contour: Contour, s, depth, smooth=0.0, tolerance=None) -> Contour:
    """The contour after wear: `depth` [m] (not below 0) at developed lengths s [m] (increasing, within one turn), into
    the solid; linear between them. Depths are averaged over a length `smooth` [m] along the contour, which keeps their
    sum. The result has lines and arcs within `tolerance` [m] (default: a hundredth of the mean depth) of the worn
    shape, and its area is larger by exactly the integral of depth over length: the depths are multiplied by a common
    factor, because at the edges of a lifter two faces lose the same material. Corners that balls do not reach stay
    sharp, and get no arc of the radius of the depth. Material that comes loose is gone, too, besides this area.
    ValueError if nothing of that shape is left."""
    area, mean = along(contour, s, depth)
    if np.min(depth) < 0 or not 0 <= smooth < contour.length:
        raise ValueError("expected depths of 0 or more, and a smoothing length below the length of the contour")
    if np.max(depth) > contour.size:
        raise ValueError("the depths are larger than the contour")
    if area == 0:
        return contour
    step = smooth / 4 if smooth else contour.length / max(400, 2 * len(np.atleast_1d(s)))
    fine = contour.divided(np.minimum(max(step, contour.length / 8000), FINE * contour.radius))
    at = np.concatenate([[0], np.cumsum(fine.lengths)[:-1]])
    depths = mean(at, smooth)
    factor, tried = 1.0, []
    for _ in range(12):
        shapes, loose = _boundary(_moved(fine, factor * depths))
        loose = min(max(2 * (loose - CRUMBS * area), 0.0), loose)  # without a jump, for the search
        if not shapes:
            raise ValueError("the depths are larger than the contour")
        new = shapes[0]
        tried.append((factor, (new.area - loose - contour.area) / area - 1))
        if abs(tried[-1][1]) < 1e-7:
            break
        (f, e), (g, d) = tried[-1], tried[-2] if len(tried) > 1 else (0.0, -1.0)
        if e == d:
            break
        factor = f - e * (f - g) / (e - d)
        if not 0 < factor < 10:
            factor = f / max(1 + e, 0.1)
    if not abs(tried[-1][1]) < 1e-3:
        raise ValueError("no contour has lost this area: smaller depths, or a larger smoothing length")
    tolerance = area / contour.length / 100 if tolerance is None else tolerance
    few = simplified(new, tolerance)
    while len(few.vertices) > READ and tolerance < contour.size:
        tolerance = max(2 * tolerance, TINY * contour.size)
        few = simplified(new, tolerance)
    new = Contour(few.vertices[few.width > SHORT * few.size])
    # what is left is some 1e-9 of the size
    return Contour(new.vertices * [*[math.sqrt((contour.area + area + loose) / new.area)] * 2, 1.0])
