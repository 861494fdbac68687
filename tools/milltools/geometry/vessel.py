"""The container in the frame of the maps (x along its axis): its outlines in the two views, and the volume of each
map cell inside it. Drums and contours have formulas; for other bodies the triangles of their surface are used."""

import numpy as np

from milltools.base.text import literal
from milltools.geometry import contour
from milltools.geometry.bodies import Mill, inverse, moved, outline, seen
from milltools.geometry.cells import RINGS, Maps

RAYS = 6  # along each side of a cell, or across a ring
MOST_RINGS = 100  # more are not millsim's
AROUND = 180  # directions in which rings are sampled


def of(run, poses=None):
    """The Drum or Container of a milltools.read.runfile.Run. `low`, `high`: its ends along x; `innermost`, `outermost`:
    the least and largest distance of its wall from the axis [m]; `radial` (N, 2): its outline over (x, r); `across`
    (M, 2): its outline over (y, z), `placed`: in the frame of the maps at `poses` of the motions (default: at the
    start); `turns`: whether it turns there, and is no circle; `noise`: a cells.Maps with the cells of the file, or
    None."""
    return Container(run) if run.vessel and run.text(f"body.{run.vessel}/shape") != "contour" else Drum(run, poses)


def axes(runs) -> dict[str, str]:
    """Labels in mm of the axes x, r, y, z of a picture of runs, which are axes of the container."""
    names = {run.vessel or "drum" for run in runs}
    whose = f"the {literal(names.pop(), 24) if len(names) == 1 else 'container'}'s axis"
    words = {"x": f"along {whose}", "r": "from the axis", "y": f"across {whose}", "z": f"across {whose}"}
    return {axis: f"{axis}, {said} [mm]" for axis, said in words.items()}


class Drum:
    def __init__(self, run, poses=None):
        place = f"body.{run.vessel}" if run.vessel else "drum"
        self.wall, length = contour.of(run.as_deck, place), run.quantity(f"{place}/length")
        self.low, self.high = -length / 2, length / 2
        self.innermost, self.outermost = self.wall.innermost, self.wall.outermost
        self.across = self.placed = self.wall.flattened(self.outermost / 2000)
        ends = np.array([self.low, self.high, self.high, self.low])
        self.radial = np.column_stack([ends, self.outermost * np.array([0, 0, 1, 1])])
        self.turns = run.mapped != run.carrier and not self.wall.circle
        if self.turns:
            points = moved(run.vessel_frame(), np.insert(self.across, 0, 0, axis=1))
            self.placed = seen(run, run.carrier, points, poses or Mill.of(run).poses[0])[:, 1:]
        self._length, self._periodic, self._still = length, bool(run.slice_length), not (run.vessel or run.mapped)

    def _maps(self, rings):
        return Maps(self.wall, self._length, rings, self._periodic, self.turns)

    @property
    def noise(self):
        """A new cells.Maps of its cells; None if their frame moves, because frames are in the laboratory."""
        return self._maps(RINGS) if self._still else None

    def volume(self, view, edges):
        """Of the cells of a view within it (n, m) [m^3]."""
        rings = (len(edges[1]) - 1) // (2 if view == "cross_section" else 1)
        maps = self._maps(min(max(rings, 1), MOST_RINGS))
        found = maps.cross if view == "cross_section" else maps.axial
        if found.n == tuple(len(e) - 1 for e in edges):
            return found.room.reshape(found.n)
        first, second = (np.diff(e) for e in edges)  # not millsim's cells
        if view == "cross_section":
            return np.outer(first, second) * self._length
        return np.outer(first, np.pi * np.diff(edges[1] ** 2))


class Container:
    def __init__(self, run):
        shell = moved(inverse(run.vessel_frame()), Mill.of(run).shell)
        if run.text(f"body.{run.vessel}/shape") == "mesh":  # its centre is that of its bounding box
            points = shell.reshape(-1, 3)
            shell = shell - (points.min(axis=0) + points.max(axis=0)) / 2
        self._shell, points, self.noise = shell, shell.reshape(-1, 3), None
        self.low, self.high = points[:, 0].min(), points[:, 0].max()
        away = np.hypot(points[:, 1], points[:, 2])
        self.innermost, self.turns = away.max(), False
        self.outermost = self.innermost
        self.across = self.placed = outline(points[:, 1:])
        both = np.concatenate([away, -away])
        self.radial = outline(np.column_stack([np.tile(points[:, 0], 2), both]))
        self.radial[:, 1] = np.maximum(self.radial[:, 1], 0)

    def volume(self, view, edges):
        """Of the cells of a view within it (n, m) [m^3]."""
        if view == "cross_section":
            y, z = (_between(e) for e in edges)
            lengths = self._inside(*(g.ravel() for g in np.meshgrid(y, z, indexing="ij")), None)
            n, m = (len(e) - 1 for e in edges)
            cells = lengths.reshape(n, RAYS, m, RAYS).mean(axis=(1, 3))
            return cells * np.outer(np.diff(edges[0]), np.diff(edges[1]))
        r = np.sqrt(_between(edges[1] ** 2))  # of equal area
        angle = 2 * np.pi * (np.arange(AROUND) + 0.37) / AROUND
        y, z = np.outer(r, np.cos(angle)).ravel(), np.outer(r, np.sin(angle)).ravel()
        within = self._inside(y, z, edges[0]).reshape(len(edges[0]), -1, RAYS * AROUND)
        return np.diff(within.mean(axis=2), axis=0) * np.pi * np.diff(edges[1] ** 2)

    def _inside(self, y, z, ends):
        """Lengths [m] inside the container of lines along x at (y, z) (K,): the whole length (K,), or up to each of
        `ends` (E, K)."""
        total = np.zeros(len(y) if ends is None else (len(ends), len(y)))
        order = np.argsort(y)
        rank = y[order]
        for corner in self._shell:
            across = corner[:, 1:]
            low, high = across.min(axis=0), across.max(axis=0)
            some = order[slice(*np.searchsorted(rank, (low[0], high[0])))]
            some = some[(z[some] >= low[1]) & (z[some] <= high[1])]
            (a, b), (c, d) = across[1] - across[0], across[2] - across[0]
            twice = a * d - b * c
            if twice == 0 or not len(some):
                continue
            u, v = y[some] - across[0, 0], z[some] - across[0, 1]
            one, two = (u * d - v * c) / twice, (v * a - u * b) / twice
            hit = (one >= 0) & (two >= 0) & (one + two <= 1)
            at = corner[0, 0] + one * (corner[1, 0] - corner[0, 0]) + two * (corner[2, 0] - corner[0, 0])  # fmt: skip
            at, some, way = at[hit], some[hit], np.sign(twice)  # > 0: the line leaves the container
            if ends is None:
                total[some] += way * at
            else:
                total[:, some] -= way * np.maximum(ends[:, None] - at, 0)
        return np.maximum(total, 0)


def _between(edges):
    """RAYS places within each of the cells between edges; a small offset keeps them off the edges of triangles."""
    share = (np.arange(RAYS) + 0.5 + 0.013) / RAYS
    return (edges[:-1, None] + np.diff(edges)[:, None] * share).ravel()
