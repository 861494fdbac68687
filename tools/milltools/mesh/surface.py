"""Makes one closed surface of facets that do not quite fit: welds corners, drops facets without area, splits sides at
corners that lie on them, turns facets, closes small holes.

Corners have coordinates of single precision, as in an STL file: two corners are the same if they are equal there.
A *side* is one of the three of a facet, from its corner k to the next one, and has the number 3 * facet + k. In a
closed surface each side has a partner: the side of another facet that goes the other way.
"""

import dataclasses

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from milltools.mesh import fill

NO_AREA = 1e-9  # height over longest side: millsim's own limit is this
SAME_ANGLE = 1e-5  # [rad] facets at an edge that lie upon each other
MOST_PATCHES = 10  # that meet three at a time
FIN = 0.05  # over the largest dimension: larger sheets that stick out are parts of what is meant, such as lifters
MOST_PASSES = 40  # of one step of mending


@dataclasses.dataclass
class Changes:
    """What mending did: numbers, and lengths in the unit of the file."""

    welded: int = 0
    apart: float = 0.0  # the largest distance of corners that were welded
    dropped: int = 0  # facets without area, also those that are two of other facets now
    doubled: int = 0  # facets that were there twice
    split: int = 0  # sides at corners that lay on them
    turned: int = 0
    walls: int = 0  # facets of walls within the solid
    fins: int = 0  # facets of small sheets that stuck out
    holes: list = dataclasses.field(default_factory=list)  # (size, sides) of each that was closed

    def add(self, other: "Changes"):
        for field in dataclasses.fields(self):
            mine, its = getattr(self, field.name), getattr(other, field.name)
            setattr(self, field.name, max(mine, its) if field.name == "apart" else mine + its)


def components(number: int, one, other) -> np.ndarray:
    """The component of each node of a graph, numbered in the order of their first nodes."""
    graph = coo_matrix((np.ones(len(one), bool), (one, other)), shape=(number, number))
    labels = connected_components(graph, directed=False)[1]
    _, first, labels = np.unique(labels, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[labels]


class Surface:
    """Facets that belong to one surface: `points` (N, 3), `facets` (M, 3) as numbers of points."""

    def __init__(self, points, facets):
        self.changes = Changes()
        self.points, self.facets = points, facets
        self._weld_equal()
        extent = np.ptp(self.points, axis=0) if len(self.points) else np.zeros(3)
        self.size = float(extent.max())

    # ---- corners

    def _weld_equal(self):
        """Gives points of equal coordinates one number."""
        order = np.lexsort(self.points.T[::-1])
        ranked = self.points[order]
        fresh = np.concatenate([[True], (ranked[1:] != ranked[:-1]).any(axis=1)])
        number = np.empty(len(order), "i8")
        number[order] = np.cumsum(fresh) - 1
        self.points, self.facets = ranked[fresh], number[self.facets]

    def corners(self) -> np.ndarray:
        """(M, 3, 3)"""
        return self.points[self.facets]

    def _flat(self) -> np.ndarray:
        """Facets without area, but with three corners."""
        a, b, c = self.corners().transpose(1, 0, 2)
        longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
        return np.flatnonzero(~(np.linalg.norm(np.cross(b - a, c - a), axis=1) > 2 * NO_AREA * longest))

    def _hand_over(self, flat) -> bool:
        """Gives the middle corner of flat facets to their neighbours at the long side: both facets become two that meet
        at this corner. False if there is none to give it to."""
        start, _ = self.sides()
        order, begins, counts = self.edges()
        other = np.full(len(start), -1)
        one, two = order[begins[counts == 2]], order[begins[counts == 2] + 1]
        other[one], other[two] = two, one
        corners = self.points[self.facets[flat]]
        long_side = np.argmax(((corners - np.roll(corners, -1, axis=1)) ** 2).sum(axis=2), axis=1)
        touched, gone = set(), []
        for side in 3 * flat + long_side:
            f, g = side // 3, other[side] // 3
            if g < 0 or f in touched or g in touched:
                continue
            touched |= {f, g}
            p, q, t = np.roll(self.facets[f], -(side % 3))
            d = self.facets[g, (other[side] + 2) % 3]
            self.facets[f], self.facets[g] = (p, d, t), (d, q, t)
            gone += [f, g] if d == t else []
        self.facets = np.delete(self.facets, gone, axis=0)
        return bool(touched)

    def drop(self):
        """Takes out facets that have no area; drops those that have the corners of another one in the same order. If
        all facets are there in both orders, as some programs write sheets that are seen from both sides, one of each
        pair stays."""
        before = len(self.facets)
        points = [self.facets[:, k] == self.facets[:, (k + 1) % 3] for k in range(3)]
        self.facets = self.facets[~np.any(points, axis=0)]
        flat, seen = self._flat(), set()
        self.changes.dropped += before - len(self.facets) + len(flat)
        while len(flat) and (now := self.facets[flat].tobytes()) not in seen and self._hand_over(flat):
            seen.add(now)  # a facet may come back to where it was
            flat = self._flat()
        self.facets = np.delete(self.facets, flat, axis=0)
        first = np.argmin(self.facets, axis=1)
        begun = np.take_along_axis(self.facets, (first[:, None] + np.arange(3)) % 3, axis=1)
        kept = np.zeros(len(begun), bool)
        kept[np.unique(begun, axis=0, return_index=True)[1]] = True
        ordered = np.sort(self.facets[kept], axis=1)
        _, which, count = np.unique(ordered, axis=0, return_index=True, return_counts=True)
        if len(count) and (count == 2).all():
            places = np.flatnonzero(kept)
            kept[:] = False
            kept[places[which]] = True
        self.changes.doubled += int((~kept).sum())
        self.facets = self.facets[kept]

    # ---- sides

    def sides(self):
        """(from, to) of all sides."""
        return self.facets.ravel(), np.roll(self.facets, -1, axis=1).ravel()

    def edges(self):
        """All sides in the order of their edges, and where the sides of each edge begin."""
        start, end = self.sides()
        key = np.minimum(start, end) * len(self.points) + np.maximum(start, end)
        order = np.argsort(key, kind="stable")
        ranked = key[order]
        begins = np.flatnonzero(np.concatenate([[True], ranked[1:] != ranked[:-1]])) if len(key) else np.empty(0, "i8")
        return order, begins, np.diff(np.append(begins, len(key)))

    def turn(self) -> np.ndarray:
        """Turns facets so that neighbours face to the same side, the fewer of each patch of facets; returns the patch
        of each facet. Patches end where more or fewer than two facets meet."""
        start, _ = self.sides()
        order, begins, counts = self.edges()
        one, other = order[begins[counts == 2]], order[begins[counts == 2] + 1]
        f, g, against = one // 3, other // 3, start[one] == start[other]
        # each facet is two nodes, as it is and turned; a patch is two components, one the other turned
        nodes = components(
            2 * len(self.facets),
            np.concatenate([2 * f, 2 * f + 1]),
            np.concatenate([2 * g + against, 2 * g + ~against]),
        )
        kept, turned = nodes[0::2], nodes[1::2]
        self.has_one_side = bool((kept == turned).any())
        many = np.bincount(kept, minlength=2 * len(self.facets))
        wrong = (many[kept] < many[turned]) | ((many[kept] == many[turned]) & (kept > turned))
        self.facets = np.where(wrong[:, None], self.facets[:, ::-1], self.facets)
        self.changes.turned += int(wrong.sum())
        return np.minimum(kept, turned)

    def partners(self, patch) -> np.ndarray:
        """The partner of each side, -1 for one without. Where more than two facets meet at an edge, those of one
        patch are partners, else those with the solid between them."""
        start, _ = self.sides()
        order, begins, counts = self.edges()
        partner = np.full(len(start), -1)
        one, other = order[begins[counts == 2]], order[begins[counts == 2] + 1]
        fit = start[one] != start[other]
        partner[one[fit]], partner[other[fit]] = other[fit], one[fit]
        for begin, count in zip(begins[counts > 2], counts[counts > 2]):
            for p, q in self._match(order[begin : begin + count], patch):
                partner[p], partner[q] = q, p
        return partner

    def _match(self, sides, patch):
        """Pairs of partners among the sides of one edge; none if they do not all find one."""
        start, end = self.sides()
        low = min(start[sides[0]], end[sides[0]])
        forward = {int(s): bool(start[s] == low) for s in sides}
        pairs, left = [], []
        for one in np.unique(patch[sides // 3]):
            own = [int(s) for s in sides if patch[s // 3] == one]
            if len(own) == 2 and forward[own[0]] != forward[own[1]]:
                pairs.append(tuple(own))
            else:
                left.extend(own)
        if 2 * sum(forward[s] for s in left) != len(left):
            return []
        ordered, open_ones, depth, lowest, begin = self._around(left, forward), [], 0, 0, 0
        for k, s in enumerate(ordered):
            depth += -1 if forward[s] else 1
            if depth < lowest:
                lowest, begin = depth, k + 1
        for s in ordered[begin:] + ordered[:begin]:
            if not forward[s]:
                open_ones.append(s)
            else:
                pairs.append((open_ones.pop(), s))
        return pairs

    def _around(self, sides, forward):
        """Sides in the order in which their facets lie around the edge; where facets lie upon each other, first those
        before which the solid is (forward), then those after which it is."""
        if not sides:
            return []
        start, end = self.sides()
        low, high = sorted((start[sides[0]], end[sides[0]]))
        along = self.points[high] - self.points[low]
        along /= np.linalg.norm(along)
        away = np.array([self.points[self.facets[s // 3, (s + 2) % 3]] - self.points[low] for s in sides])
        away -= np.outer(away @ along, along)
        x = away[0] / np.linalg.norm(away[0])
        angle = np.arctan2(away @ np.cross(along, x), away @ x)
        order = np.argsort(angle, kind="stable")
        fresh = np.concatenate([[False], np.diff(angle[order]) > SAME_ANGLE])
        group = np.cumsum(fresh)
        if group[-1] and angle[order[0]] + 2 * np.pi - angle[order[-1]] <= SAME_ANGLE:
            group[group == group[-1]] = 0  # across the cut of the angle
        ranked = sorted(range(len(sides)), key=lambda k: (group[k], not forward[sides[order[k]]]))
        return [sides[order[k]] for k in ranked]

    # ---- gaps

    def close(self, weld: float, hole: float, step=lambda: None):
        """Mends what is not closed; sets `partner`, the partner of each side. What fits within the rounding of the
        coordinates is joined first, wider gaps later. `step` is called now and then."""
        self.drop()
        for most in (weld * share for share in (0.01, 0.1, 1.0)):
            seen = set()
            while len(seen) < MOST_PASSES:
                step()
                order, begins, counts = self.edges()
                lone = order[begins[counts % 2 == 1]]
                now = np.sort(np.stack(self.sides())[:, lone], axis=0).tobytes()
                if now in seen or not len(lone) or not (self._weld_near(lone, most) or self._split(lone, most)):
                    break
                seen.add(now)
                self.drop()
        self._pair()
        if (self.partner < 0).any() and not self.has_one_side and self._fill(hole):
            self._pair()
        if (self.partner < 0).any() and self._drop_fins(min(hole, FIN * self.size)):
            self._pair()
        if (self.partner < 0).any() and self._take_out_walls():
            self._pair()

    def _pair(self):
        self.patch = self.turn()
        self.partner = self.partners(self.patch)

    def _weld_near(self, lone, most) -> bool:
        """Welds ends of lone sides that are near to each other."""
        start, end = self.sides()
        ends = np.unique(np.concatenate([start[lone], end[lone]]))
        pairs = cKDTree(self.points[ends]).query_pairs(most, output_type="ndarray")
        if not len(pairs):
            return False
        group = components(len(ends), pairs[:, 0], pairs[:, 1])
        first = np.unique(group, return_index=True)[1]
        number = np.arange(len(self.points))
        number[ends] = ends[first[group]]
        moved = np.linalg.norm(self.points - self.points[number], axis=1)
        self.changes.welded += int((number != np.arange(len(number))).sum())
        self.changes.apart = max(self.changes.apart, float(moved.max()))
        self.facets = number[self.facets]
        return True

    def _split(self, lone, most) -> bool:
        """Splits facets with a lone side at the ends of other lone sides that lie on it."""
        start, end = self.sides()
        ends = np.unique(np.concatenate([start[lone], end[lone]]))
        tree = cKDTree(self.points[ends])
        a, b = self.points[start[lone]], self.points[end[lone]]
        length = np.linalg.norm(b - a, axis=1)
        near = tree.query_ball_point((a + b) / 2, length / 2 + most, return_sorted=True)
        cut, gone, busy = [], [], set()
        for side, p, q, far, some in zip(lone, a, b, length, near):
            if side // 3 in busy or len(some) <= 2:
                continue
            some = ends[np.array(some)]
            some = some[(some != start[side]) & (some != end[side])]
            along = (self.points[some] - p) @ (q - p) / far
            off = np.linalg.norm(self.points[some] - p - np.outer(along, (q - p) / far), axis=1)
            tip = self.facets[side // 3, (side + 2) % 3]
            on = (off <= most) & (along > 0) & (along < far) & (some != tip)
            if not on.any():
                continue
            stops = [start[side], *some[on][np.argsort(along[on], kind="stable")], end[side]]
            cut.extend([one, other, tip] for one, other in zip(stops, stops[1:]))
            gone.append(side // 3)
            busy.add(side // 3)
            self.changes.split += 1
        if gone:
            self.facets = np.concatenate([np.delete(self.facets, gone, axis=0), np.array(cut)])
        return bool(gone)

    def holes(self) -> list[list[int]]:
        """Loops of points around holes, each in the order that the facets in it have. A loop that passes a point twice
        is two loops."""
        start, end = self.sides()
        order, begins, counts = self.edges()
        lone = np.zeros(len(start), bool)
        lone[order[begins[counts == 1]]] = True
        ways = {}
        for side in np.flatnonzero(lone & (self.partner < 0)):
            ways.setdefault(int(end[side]), []).append(int(start[side]))
        loops = []
        while ways:
            path, at = [], next(iter(ways))
            places = {}
            while True:
                if at in places:
                    begin = places[at]
                    loops.append(path[begin:])
                    for point in path[begin:]:
                        del places[point]
                    del path[begin:]
                if at not in ways:
                    break
                places[at] = len(path)
                path.append(at)
                onward = ways[at].pop(0)
                if not ways[at]:
                    del ways[at]
                at = onward
        return [loop for loop in loops if len(loop) > 2]

    def across(self, loop) -> float:
        """The size of a hole: the largest of its three lengths along the axes."""
        return float(np.ptp(self.points[loop], axis=0).max())

    def _fill(self, hole) -> bool:
        fresh = []
        for loop in self.holes():
            if self.across(loop) <= hole:
                fresh.extend(fill.loop(self.points[loop], loop))
                self.changes.holes.append((self.across(loop), len(loop)))
        if fresh:
            self.facets = np.concatenate([self.facets, np.array(fresh)])
        return bool(fresh)

    def loose(self) -> np.ndarray:
        """Whether a facet is of a patch that ends at lone sides and meets two others: a sheet that sticks out."""
        order, _, counts = self.edges()
        lone, meet = (self.patch[order[np.repeat(is_so, counts)] // 3] for is_so in (counts == 1, counts > 2))
        return np.isin(self.patch, np.intersect1d(lone, meet))

    def _drop_fins(self, most) -> bool:
        """Drops sheets that stick out, up to this size: they bound nothing."""
        loose, corners = self.loose(), self.corners()
        low, high = np.full((2, self.patch.max() + 1, 3), [[[np.inf]], [[-np.inf]]])
        np.minimum.at(low, self.patch, corners.min(axis=1))
        np.maximum.at(high, self.patch, corners.max(axis=1))
        fins = loose & ((high - low)[self.patch].max(axis=1) <= most)
        self.changes.fins += int(fins.sum())
        self.facets = self.facets[~fins]
        return bool(fins.any())

    def _take_out_walls(self) -> bool:
        """Drops patches where three meet, as at a wall between two rooms of a solid, so that all is closed and encloses
        as much as possible."""
        order, begins, counts = self.edges()
        if set(np.unique(counts)) - {2, 3}:
            return False
        meet = [set(self.patch[order[b : b + 3] // 3].tolist()) for b in begins[counts == 3]]
        out = []
        while meet:
            rows = [meet.pop()]
            group = rows[0]
            while near := [row for row in meet if row & group]:
                meet = [row for row in meet if not row & group]
                group = group.union(*near)
                rows += near
            choice = self._chosen(sorted(group), rows)
            if choice is None:
                return False
            out += choice
        gone = np.isin(self.patch, out)
        self.changes.walls += int(gone.sum())
        self.facets = self.facets[~gone]
        return True

    def _chosen(self, patches, meet):
        """Those of the patches without which the others enclose the most, one of each set that meets; None if there is
        no such choice."""
        best, most = None, 0.0
        for bits in range(1, 1 << len(patches) if len(patches) <= MOST_PATCHES else 1):
            out = [one for k, one in enumerate(patches) if bits >> k & 1]
            if any(len(row) != 3 or len(row.intersection(out)) != 1 for row in meet):
                continue
            rest = Surface(self.points, self.facets[np.isin(self.patch, [one for one in patches if one not in out])])
            patch = rest.turn()
            a, b, c = (rest.corners() - self.points[0]).transpose(1, 0, 2)
            each = np.bincount(patch, np.einsum("ij,ij->i", a, np.cross(b, c)))
            if (volume := float(abs(each).sum())) > most:
                best, most = out, volume
        return best

    # ---- what hangs together

    def shells(self) -> np.ndarray:
        """The shell of each facet: those that hang together by partners."""
        return components(len(self.facets), np.arange(3 * len(self.facets)) // 3, self.partner // 3)

    def parted(self):
        """(points, facets): points where facets meet that do not hang together around them are several."""
        sides = np.arange(3 * len(self.facets))
        after = sides - sides % 3 + (sides + 1) % 3
        # a side begins where its partner ends, and ends where its partner begins
        one = np.concatenate([sides, after])
        other = np.concatenate([after[self.partner], self.partner])
        corner = components(len(sides), one, other)
        points = np.empty((corner.max() + 1, 3))
        points[corner] = self.points[self.facets.ravel()]
        return points, corner.reshape(-1, 3)
