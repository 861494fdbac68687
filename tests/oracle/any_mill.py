"""The slow mill of oracle.py for any container, bodies and motions: what sections 3 and 6 of the contract describe.

Contacts are found as there, by samples of the gap a step apart, but only where a contact is possible: within a span
of time a gap changes by no more than the fastest approach of ball and surface lets it. So coarse samples rule out
most of the flight.
"""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from motions import standing, times
from oracle import NEAR, OVERLAP, Pair, Simulation, length
from shapes import Shape

SPAN = 2e-3  # s looked at together
COARSE = 2e-4  # s between the samples that rule contacts out
FASTER = 1.05  # a wall's greatest speed is that of its samples, and this margin
HORIZON = 0.5  # s in which they are sampled


class Surface(NamedTuple):
    """A shape in the frame of its motion: p = place + rotation q for points q of the shape's own frame."""

    shape: Shape
    labels: tuple  # by face: contact kind and partner
    motion: str | None = None
    place: np.ndarray = np.zeros(3)
    rotation: np.ndarray = np.eye(3)


@dataclass
class AnyMill:
    radius: np.ndarray
    density: np.ndarray
    laws: dict
    surfaces: list
    motions: dict = field(default_factory=dict)
    rebound_floor: float = 5e-3
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))

    def mass(self):
        return self.density * 4.0 / 3.0 * np.pi * self.radius**3

    def pose(self, motion, t):
        return self.motions[motion].pose(t) if motion else standing(t)

    def wall_speed(self, surface):
        """A bound of the speed of all points of the surface."""
        if surface.motion is None:
            return 0.0
        pose = self.pose(surface.motion, np.arange(0.0, HORIZON, 1e-4))
        reach = length(surface.place) + surface.shape.reach
        return FASTER * (length(pose.velocity) + length(pose.spin) * reach).max()

    def jolted(self, near):
        """The same mill with each motion's clock some roundings wrong."""
        return replace(self, motions={name: m.jolted(near) for name, m in self.motions.items()})


class AnySimulation(Simulation):
    def surface_pairs(self):
        mill = self.mill
        self.surfaces = mill.surfaces
        self.speeds = np.array([mill.wall_speed(surface) for surface in self.surfaces])
        self.rows = {}  # of self.pairs, by surface, face and ball
        pairs = []
        for number, surface in enumerate(self.surfaces):
            for face, (kind, partner) in enumerate(surface.labels):
                for ball in range(len(self.r)):
                    self.rows[number, face, ball] = len(self.pairs) + len(pairs)
                    pairs.append(Pair(kind, ball, partner, (number, face)))
        return pairs

    # Gaps and how fast they change, by surface and face

    def seen(self, surface, t, r):
        """Poses of the surface's motion at the times t, and the points r (times, balls, 3) in the shape's own frame."""
        pose = self.mill.pose(surface.motion, self.time + np.asarray(t, dtype=float))
        frame = np.swapaxes(pose.rotation, -1, -2)[:, None]
        own = times(frame, r - pose.place[:, None]) - surface.place
        return pose, own @ surface.rotation

    def face_gaps(self, number, t, balls, faces=slice(None)):
        """Gaps and their rates (faces, times, balls)."""
        surface = self.surfaces[number]
        r, v = self.fly(t, balls)
        pose, own = self.seen(surface, t, r)
        distance, normal, point = surface.shape.nearest(own, faces)
        axes = pose.rotation @ surface.rotation  # of the shape, in the laboratory
        # all vectors in the shape's own frame, where the normals are
        moved = np.swapaxes(axes, -1, -2)[:, None]
        origin = pose.velocity + np.cross(pose.spin, times(pose.rotation, surface.place + 0 * r[:, 0]))
        own_v = times(moved, v - origin[:, None])
        own_spin = times(moved[:, 0], pose.spin)[:, None]
        rate = ((own_v - np.cross(own_spin, point)) * normal).sum(axis=-1)
        return distance - self.mill.radius[balls], rate

    def gap(self, pair, t):
        if pair.kind == "ball_ball":
            return super().gap(pair, t)
        number, face = pair.surface
        gap, rate = self.face_gaps(number, t, [pair.ball], [face])
        return gap[0, :, 0], rate[0, :, 0]

    def touched(self, pair):
        number, face = pair.surface
        surface = self.surfaces[number]
        pose, own = self.seen(surface, [0.0], self.r[None, [pair.ball]])
        _, normal, point = surface.shape.nearest(own[0, 0], [face])
        axes = pose.rotation[0] @ surface.rotation
        arm = axes @ point[0] + pose.rotation[0] @ surface.place
        velocity = pose.velocity[0] + np.cross(pose.spin[0], arm)
        return axes @ normal[0], pose.place[0] + arm, velocity

    def feature(self, pair, t):
        if pair.kind == "ball_ball":
            return ""
        number, face = pair.surface
        surface = self.surfaces[number]
        r, _ = self.fly([t], [pair.ball])
        _, own = self.seen(surface, [t], r)
        shape = surface.shape
        return f"{type(shape).__name__} {shape.part(face, own[0, 0])}"

    # The search: first where contacts are possible, then as in oracle.py

    def possible(self, t):
        """By interval of the coarse samples t: which surfaces and balls (None for pairs of balls) may touch in it."""
        hold = t[1] - t[0]
        fastest = length(self.v) + length(self.mill.gravity) * t[-1]
        everyone = np.arange(len(self.r))
        found = [[] for _ in t[1:]]
        for number, speed in enumerate(self.speeds):
            gap = self.face_gaps(number, t, everyone)[0].min(axis=0)
            near = gap[:-1] + gap[1:] <= (fastest + speed) * hold
            for k in np.flatnonzero(near.any(axis=1)):
                found[k].append((number, np.flatnonzero(near[k])))
        if len(self.first):
            gap = self.ball_gaps(t, self.first, self.second)[0].T
            near = gap[:-1] + gap[1:] <= (fastest[self.first] + fastest[self.second]) * hold
            for k in np.flatnonzero(near.any(axis=1)):
                found[k].append((None, np.flatnonzero(near[k])))
        return found

    def samples(self, candidates, t):
        """Gaps and rates at the times t of the pairs that may touch, and their numbers in self.pairs."""
        gaps, rates, rows = [], [], []
        for number, which in candidates:
            if number is None:
                gap, rate = self.ball_gaps(t, self.first[which], self.second[which])
                gaps.append(gap), rates.append(rate), rows.append(which)
                continue
            gap, rate = self.face_gaps(number, t, which)
            for face in range(len(gap)):
                gaps.append(gap[face].T), rates.append(rate[face].T)
                rows.append([self.rows[number, face, ball] for ball in which])
        return np.concatenate(gaps), np.concatenate(rates), np.concatenate(rows)

    def contact_among(self, candidates, start, stop):
        """The first contact of the candidates in [start, stop]: (seconds, row) or None."""
        t = np.linspace(start, stop, max(2, int(np.ceil((stop - start) / self.step)) + 1))
        gap, rate, rows = self.samples(candidates, t)
        g0, g1 = gap[:, :-1], gap[:, 1:]
        falls, rises = rate[:, :-1] < 0, rate[:, 1:] >= 0
        suspect = (g1 <= 0) | ((g0 <= 0) & (falls | ~rises)) | ((g0 < NEAR) & falls & rises)
        for k in np.flatnonzero(suspect.any(axis=0)):
            assert gap[:, k].min() > -OVERLAP, "the oracle has missed a contact"
            found = []
            for row in rows[suspect[:, k]]:
                when = self.contact_between(self.pairs[row], t[k], t[k + 1])
                if when is not None:
                    found.append((when, row))
            if found:
                return min(found)
        return None

    def next_contact(self, until):
        start = 0.0
        while start < until:
            stop = min(until, start + SPAN)
            t = np.linspace(start, stop, max(2, int(np.ceil((stop - start) / COARSE)) + 1))
            for k, candidates in enumerate(self.possible(t)):
                found = candidates and self.contact_among(candidates, t[k], t[k + 1])
                if found:
                    return self.pairs[found[1]], found[0]
            start = stop
        return None, until
