"""Reads closed curves of lines and arcs from a drawing (DXF).

Closed polylines and circles are loops as they are. All other lines and arcs are cut at their ends only; ends closer
than the tolerance are one corner. These corners and pieces divide the plane: the faces of this division are loops, too.
So it does not matter in which order pieces were drawn, or that further lines begin at a corner. Arcs stay arcs; splines
and ellipses become arcs within the tolerance.
"""

import collections
import dataclasses
import itertools
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.base.files import opened
from milltools.base.text import number, plain
from milltools.geometry.contour import LARGEST, TINY, Contour, signed_area
from milltools.geometry.worn import fitted

# unit: (numerator, denominator) of its length [m]: x * 1 / 1000 is the nearest number, x * 0.001 is not always
UNITS = {"um": (1, 1_000_000), "mm": (1, 1000), "cm": (1, 100), "m": (1, 1), "in": (254, 10_000), "ft": (3048, 10_000)}
CODES = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um"}  # of $INSUNITS
TOLERANCE = 1e-5  # of the drawing's size
MOST, DEEPEST = 200_000, 16  # entities; blocks within each other
FAULTS = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)  # of ezdxf, for damaged entities
FINEST = 1e-6  # of a curve's size: no spline follows a smaller tolerance
TRIED, WIDEST = 20, 0.02  # tolerances that are tried where nothing is closed; the largest, of the drawing's size
LOOSE = {"LINE", "ARC", "LWPOLYLINE", "POLYLINE", "SPLINE", "ELLIPSE", "CIRCLE"}


@dataclasses.dataclass
class Found:
    """What a drawing has, in its own unit: `loops` (contour, layers, widest gap that was closed), largest first;
    `tolerance`, `ignored` {what: how many}."""

    unit: str
    unit_from: str
    loops: list[tuple[Contour, set, float]]
    tolerance: float
    ignored: dict[str, int]


def read(path, unit=None, layers=(), tolerance=None) -> Found:
    """The loops of a drawing; `tolerance`: (number, its unit, or "" for that of the drawing). A UserError if it
    has no loops, no known unit, or is no drawing."""
    with opened(path, "a drawing") as file:
        content = file.read()
    if content[:4] == b"AC10":
        raise UserError(f"{path}: is a DWG file: save the drawing as DXF")
    import ezdxf
    from ezdxf import recover

    try:
        try:
            document = ezdxf.readfile(path)
        except (ezdxf.DXFError, ValueError, KeyError, UnicodeDecodeError):
            document, _ = recover.readfile(path)
    except Exception as fault:  # the library raises many kinds for a damaged file
        told = f" ({plain(str(fault))[:80]})" if str(fault) else ""
        raise UserError(f"{path}: is no DXF file that can be read{told}") from None
    unit, unit_from = (unit, "--unit") if unit else _unit(path, document, content)
    ignored: collections.Counter = collections.Counter()
    for layout in document.layouts:
        if layout.name != "Model" and len(layout):
            ignored["in paper space"] += len(layout)
    chains = _Chains(path, document, layers, ignored)
    chains.add(document.modelspace(), (), "")
    if not chains.found and layers:
        raise UserError(f"{path}: nothing to read on layer {', '.join(layers)}: it has {_names(chains.seen)}")
    if not chains.found:
        told = "".join(f"; ignored: {text}" for text in [_told(ignored)] if text)
        raise UserError(f"{path}: has no lines, arcs, circles, polylines, splines or ellipses{told}")
    size = chains.size()
    gap = TOLERANCE * size
    if tolerance:
        (over, under), (own, parts) = UNITS[tolerance[1] or unit], UNITS[unit]
        gap = max(tolerance[0] * over * parts / (under * own), TINY * size)
    closed, loose = [], []
    for layer, closes, chain in chains.within(gap):
        (closed if closes else loose).append((layer, chain))
    try:
        faces, open_ends = _faces(loose, gap)
        loops = [(Contour(chain[:-1]), {layer}, 0.0) for layer, chain in closed] + faces
    except ValueError as fault:
        raise UserError(f"{path}: {fault}") from None
    if open_ends[0]:
        ignored["with an open end"] += open_ends[0]
    if not loops:
        raise UserError(_nothing_closed(path, loose, open_ends, unit, size))
    return Found(unit, unit_from, sorted(loops, key=lambda one: -one[0].area), gap, dict(ignored))


def _unit(path, document, content):
    # where a file has no header, ezdxf makes one
    told = {name: document.header.get(name) for name in ("$INSUNITS", "$MEASUREMENT") if name.encode() in content}
    code = int(told.get("$INSUNITS") or 0)
    if code in CODES:
        return CODES[code], "$INSUNITS"
    measure = told.get("$MEASUREMENT")
    if code == 0 and measure in (0, 1):
        return ("in", "mm")[measure], f"$MEASUREMENT {measure}: {('imperial', 'metric')[measure]}"
    why = f"$INSUNITS {code} is none of {', '.join(UNITS)}" if code else "does not tell its unit"
    raise UserError(f"{path}: {why}: give it, such as --unit mm")


def _names(names):
    names = sorted(names)
    return ", ".join(plain(name) for name in names[:12]) + (f" and {len(names) - 12} more" if len(names) > 12 else "")


def _told(ignored):
    return ", ".join(f"{count} {plain(what)}" for what, count in ignored.items())


def _nothing_closed(path, loose, open_ends, unit, size):
    """What to do: the smallest tolerance with which a curve would be closed, and a place that needs it."""
    count, gaps = open_ends
    if not count:
        return f"{path}: no closed curve that has an area"
    said = f"{path}: no closed curve; pieces with an open end: {count}"
    tried = {}
    for away, x, y in sorted(gaps):
        tried[float(f"{1.05 * away:.1e}")] = (away, x, y)
    for tolerance, (away, x, y) in list(tried.items())[:TRIED]:
        if 0 < tolerance < WIDEST * size and _faces(loose, tolerance)[0]:
            where = place((x, y), unit)
            return (
                f"{said}; a gap is {number(away)} {unit} wide, at {where}: close it, or give --tolerance {tolerance:g}"
            )
    return f"{said}, such as at {place(gaps[0][1:], unit)}" if gaps else said


def place(point, unit) -> str:
    """A point of a drawing."""
    return f"({point[0]:.6g}, {point[1]:.6g}) {unit}"


# ---- entities


class _Chains:
    """Open and closed rows of lines and arcs: `found` [(layer, whether it is closed, function of a tolerance that gives
    rows (n, 3), the last one without a meaning)]; `seen`: layers that have some."""

    def __init__(self, path, document, layers, ignored):
        self.path, self.ignored, self.asked = path, ignored, {name.casefold() for name in layers}
        self.hidden = {each.dxf.name.casefold(): "frozen" if each.is_frozen() else "off"
                       for each in document.layers if each.is_frozen() or each.is_off()}  # fmt: skip
        self.found: list = []
        self.seen: set = set()
        self.read = 0

    def add(self, entities, blocks, of_insert):
        """Takes entities, those of blocks too; `blocks`: the names of the blocks that are being read; `of_insert`: the
        layer that stands for layer 0 in a block."""
        for entity in entities:
            self.read += 1
            if self.read > MOST:
                raise UserError(f"{self.path}: more than {MOST} entities: choose layers with --layer")
            layer = entity.dxf.get("layer", "0")
            layer = of_insert if layer == "0" and of_insert else layer
            kind = entity.dxftype()
            state = self.hidden.get(layer.casefold())
            if state or entity.dxf.get("invisible", 0):
                self.ignored[f"on layer {layer} ({state})" if state else "invisible"] += 1
            elif kind == "INSERT":
                self._add_block(entity, blocks, layer)
            elif kind not in LOOSE:
                self.ignored[kind] += 1
            else:
                self.seen.add(layer)
                if self.asked and layer.casefold() not in self.asked:
                    self.ignored[f"on layer {layer}"] += 1
                else:
                    self._add(entity, kind, layer)

    def _add_block(self, insert, blocks, layer):
        name = insert.dxf.name
        if name in blocks or len(blocks) >= DEEPEST:
            raise UserError(f"{self.path}: block {plain(name)} contains itself, or blocks are nested too deep")
        for one in insert.multi_insert() if insert.mcount > 1 else [insert]:
            self.read += 1
            try:
                inner = list(itertools.islice(one.virtual_entities(), MOST))
            except FAULTS:
                self.ignored["INSERT that cannot be read"] += 1
                break
            self.add(inner, (*blocks, name), layer)

    def _add(self, entity, kind, layer):
        try:
            made = _READERS[kind](entity)
        except FAULTS:
            made = None
        if made is None:
            self.ignored[f"{kind} that is no curve in the plane of the drawing"] += 1
            return
        self.found.append((layer, *made))

    def size(self):
        ends = np.concatenate([_rows(of, math.inf)[:, :2] for _, _, of in self.found])
        if not (np.abs(ends) < LARGEST).all():
            raise UserError(f"{self.path}: has coordinates that are no numbers, or above {LARGEST:g}")
        return float(np.ptp(ends, axis=0).max()) or 1.0

    def within(self, gap):
        """(layer, whether closed, rows): closed ones end where they begin, other lines and arcs are alone; splines are
        within a tolerance."""
        for layer, closed, of in self.found:
            rows = _rows(of, gap)
            if callable(of):
                closed = len(rows) > 3 and math.hypot(*(rows[-1, :2] - rows[0, :2])) <= gap
            elif closed:
                rows = np.concatenate([rows, rows[:1]])
            rows = rows[np.append(np.hypot(*np.diff(rows[:, :2], axis=0).T) > 0, True)]
            if closed and len(rows) > 2:
                yield layer, True, rows
            elif callable(of) and not closed:
                yield layer, False, rows
            elif not closed:
                yield from ((layer, False, rows[k : k + 2]) for k in range(len(rows) - 1))
            else:
                self.ignored["without an area"] += 1


def _rows(of, tolerance):
    return of(tolerance) if callable(of) else of


def _plane(point, *others):
    """Points (n, 2), or None if they have not the same z."""
    z = [p.z for p in (point, *others)]
    span = max(abs(x) for p in (point, *others) for x in (p.x, p.y)) + 1e-300
    return np.array([(p.x, p.y) for p in (point, *others)]) if max(z) - min(z) <= 1e-6 * span else None


def _line(entity):
    ends = _plane(entity.dxf.start, entity.dxf.end)
    return None if ends is None else (False, np.column_stack([ends, [0, 0]]))


def _sign(entity):
    """1, or -1 for an entity that is seen from behind (mirrored); None for a tilted one."""
    z = entity.dxf.extrusion.normalize().z
    return math.copysign(1, z) if abs(z) > 1 - 1e-9 else None


def _arc(entity):
    sign, (x, y, _), radius = _sign(entity), entity.dxf.center, abs(entity.dxf.radius)
    if sign is None or not radius > 0:
        return None
    begin = math.radians(entity.dxf.start_angle)
    sweep = math.radians((entity.dxf.end_angle - entity.dxf.start_angle) % 360 or 360)
    count = 1 if sweep <= math.pi * (1 + 1e-9) else 2
    angles = begin + sweep * np.arange(count + 1) / count
    bulge = np.full(count + 1, math.tan(sweep / count / 4))
    rows = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles), bulge])
    return False, rows * [sign, 1, sign]


def _circle(entity):
    sign, (x, y, _), radius = _sign(entity), entity.dxf.center, abs(entity.dxf.radius)
    if sign is None or not radius > 0:
        return None
    return True, np.array([[sign * x + radius, y, 1.0], [sign * x - radius, y, 1.0]])


def _lwpolyline(entity):
    sign, rows = _sign(entity), np.array(entity.get_points("xyb"), float)
    if sign is None or len(rows) < 2:
        return None
    return bool(entity.closed), rows * [sign, 1, sign]


def _polyline(entity):
    vertices = [v for v in entity.vertices if not v.dxf.flags & 16]  # 16: controls a spline, is not on it
    if len(vertices) < 2 or not (entity.is_2d_polyline or entity.is_3d_polyline):
        return None
    points = _plane(*(v.dxf.location for v in vertices))
    sign = _sign(entity) if entity.is_2d_polyline else 1
    if points is None or sign is None:
        return None
    bulges = [v.dxf.get("bulge", 0.0) if entity.is_2d_polyline else 0.0 for v in vertices]
    return bool(entity.is_closed), np.column_stack([points, bulges]) * [sign, 1, sign]


def _curve(entity):
    """A spline or ellipse."""
    if _plane(*entity.flattening(1e-2 * _reach(entity), 4)) is None:
        return None

    def within(tolerance):
        points = _plane(*entity.flattening(tolerance / 20, 8))
        points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 0)]
        return fitted(np.column_stack([points, np.zeros(len(points))]), tolerance / 2)

    return False, lambda tolerance: within(min(max(tolerance, FINEST * _reach(entity)), 1e-2 * _reach(entity)))


def _reach(entity):
    if entity.dxftype() == "ELLIPSE":
        return entity.dxf.major_axis.magnitude
    points = np.array([(p[0], p[1]) for p in (entity.control_points or entity.fit_points)])
    return float(np.ptp(points, axis=0).max()) or 1.0


_READERS = {"LINE": _line, "ARC": _arc, "CIRCLE": _circle, "LWPOLYLINE": _lwpolyline, "POLYLINE": _polyline,
            "SPLINE": _curve, "ELLIPSE": _curve}  # fmt: skip


# ---- loops of loose pieces


def _faces(loose, gap):
    """([(Contour, layers, widest gap)], (pieces with an open end, [(distance of an end from the next, x, y)]))."""
    if not loose:
        return [], (0, [])
    ends = np.array([rows[k, :2] for _, rows in loose for k in (0, -1)])
    corner = _together(ends, gap)
    centre = np.stack([np.bincount(corner, ends[:, k]) / np.bincount(corner) for k in (0, 1)], axis=1)
    low, high = np.full_like(centre, np.inf), np.full_like(centre, -np.inf)
    np.minimum.at(low, corner, ends)
    np.maximum.at(high, corner, ends)
    centre = np.where(low == high, low, centre)  # a mean could be rounded
    gaps = 2 * np.hypot(*(ends - centre[corner]).T).reshape(-1, 2).max(axis=1)
    edges, known = {}, set()
    for k, (_, rows) in enumerate(loose):
        a, b = corner[2 * k], corner[2 * k + 1]
        middle = _middle(rows)
        key = (min(a, b), max(a, b), *np.round(middle / max(4 * gap, 1e-300)))
        if (a == b and len(rows) == 2) or key in known:
            continue
        known.add(key)
        rows = rows.copy()
        rows[0, :2], rows[-1, :2] = centre[a], centre[b]
        edges[k] = (a, b, rows)
    open_ends = _prune(edges, centre)
    found = [(shape, {loose[k][0] for k in used}, float(max(gaps[k] for k in used))) for shape, used in _trace(edges)]
    return found, open_ends


def _middle(rows):
    k = (len(rows) - 1) // 2
    chord = rows[k + 1, :2] - rows[k, :2]
    return (rows[k, :2] + rows[k + 1, :2]) / 2 + np.array([chord[1], -chord[0]]) * rows[k, 2] / 2


def _together(points, gap):
    """A number for each point (n, 2); those with a way of steps of at most `gap` have the same."""
    order = np.argsort(points[:, 0], kind="stable")
    x, same = points[order], np.arange(len(points))

    def root(k):
        while same[k] != k:
            same[k] = same[same[k]]
            k = same[k]
        return k

    for step in range(1, len(points)):
        close = x[step:, 0] - x[:-step, 0] <= gap
        if not close.any():
            break
        for k in np.flatnonzero(close & (np.hypot(*(x[step:] - x[:-step]).T) <= gap)):
            same[root(k + step)] = root(k)
    names = np.array([root(k) for k in range(len(points))])
    result = np.empty(len(points), int)
    result[order] = np.unique(names, return_inverse=True)[1]
    return result


def _prune(edges, centre):
    """Takes away edges with an open end, one after the other: (how many, [(distance of an open end from the next
    one, x, y)])."""
    at = collections.defaultdict(set)
    for k, (a, b, _) in edges.items():
        at[a].add(k)
        at[b].add(k)
    alone = [c for c, own in at.items() if len(own) == 1 and edges[next(iter(own))][0] != edges[next(iter(own))][1]]
    gaps = []
    if len(alone) > 1:
        some = centre[alone[:2000]]
        away = np.hypot(*np.moveaxis(some[:, None] - some, -1, 0))
        np.fill_diagonal(away, np.inf)
        gaps = [(float(d), float(x), float(y)) for d, (x, y) in zip(away.min(axis=1), some)]
    count = 0
    while alone:
        c = alone.pop()
        for k in list(at[c]):
            if len(at[c]) != 1:
                break
            count += 1
            a, b, _ = edges.pop(k)
            for end in (a, b):
                at[end].discard(k)
                if len(at[end]) == 1:
                    alone.append(end)
    return count, gaps


def _trace(edges):
    """[(Contour, edges)] of the faces with an area; edges with the same face on both sides are left out."""
    while True:
        out = collections.defaultdict(list)  # corner: edges that leave it, (edge, whether forward)
        for k, (a, b, _) in edges.items():
            out[a].append((k, True))
            out[b].append((k, False))
        follows = {}
        for leaving in out.values():
            short = min(_length(edges[k][2]) for k, _ in leaving) / 100
            leaving.sort(key=lambda one: _direction(edges[one[0]][2], one[1], short))
            for n, (k, forward) in enumerate(leaving):
                follows[k, not forward] = leaving[n - 1]  # whoever arrives by it turns as far left as it can
        loops, face = [], {}
        for first in follows:
            if first in face:
                continue
            loop, at = [], first
            while at not in face:
                face[at] = len(loops)
                loop.append(at)
                at = follows[at]
            loops.append(loop)
        bridges = [k for k in edges if face[k, True] == face[k, False]]
        if not bridges:
            break
        for k in bridges:
            del edges[k]
    found = []
    for loop in loops:
        rows = np.concatenate([_way(edges[k][2], forward)[:-1] for k, forward in loop])
        p, q = rows[:, :2], np.roll(rows[:, :2], -1, axis=0)
        keep = np.hypot(*(q - p).T) > 0
        rows = rows[keep]
        if len(rows) > 1 and signed_area(rows) > 0:
            found.append((Contour(rows), {k for k, _ in loop}))
    return found


def _way(rows, forward):
    return rows if forward else np.column_stack([rows[::-1, :2], np.append(-rows[-2::-1, 2], 0)])


def _length(rows):
    return float(np.hypot(*np.diff(rows[:, :2], axis=0).T).sum())


def _direction(rows, forward, away):
    """The angle of the point at a small distance along an edge, so that a line and an arc that leave in the same
    direction differ."""
    (x, y, bulge), end = _way(rows, forward)[0], _way(rows, forward)[1]
    angle, width = 4 * math.atan(bulge), math.hypot(end[0] - x, end[1] - y)
    share = min(1.0, away / width)
    return (math.atan2(end[1] - y, end[0] - x) - (1 - share) * angle / 2) % (2 * math.pi)
