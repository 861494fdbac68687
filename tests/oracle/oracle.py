"""A slow mill for a few balls, to check the event-driven program against, impact by impact.

Nothing is solved in closed form here. Every gap between two bodies is sampled along the flight of
the balls; where a sampled gap changes sign, or has a minimum between two samples, the interval is
cut down until the times in it are neighbouring doubles. The only rule is that of a contact: the
first time at which gap <= 0 and the gap is closing. No contact is treated specially for having just
happened: its gap is then zero and opening, which is no contact.

All numbers are SI. Frame: x along the axis, the rotor's angle counted from +y towards +z.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")
STEP = 1e-5  # s between two samples of a gap: 0.2 mm for the fastest balls
SAMPLES = 96  # steps looked at together
NEAR = 1e-4  # m; a gap wider than this cannot close and open again within a step
FAN = 24  # parts an interval is cut into at each refinement
INSTANT = 1e-18  # s; an interval this short is not cut further
OVERLAP = 1e-12  # m; deeper than this, a contact has been missed


class Law(NamedTuple):
    restitution: float
    friction: float = 0.0
    tangential: float = 0.0


class Blade(NamedTuple):
    position: float
    angle: float
    tip_radius: float
    width: float
    thickness: float
    pitch: float


@dataclass
class Mill:
    """What the mill is made of; `radius` and `density` hold one value a ball."""

    drum_radius: float
    drum_length: float
    radius: np.ndarray
    density: np.ndarray
    laws: dict
    rebound_floor: float = 5e-3
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    shaft_radius: float = 0.0  # 0: no shaft
    rotor_speed: float = 0.0
    rotor_angle: float = 0.0
    blades: tuple = ()
    buckles: int = 0  # of a wavy drum; 0: a circle
    buckle_height: float = 0.0
    buckle_angle: float = 0.0

    def mass(self):
        return self.density * 4.0 / 3.0 * np.pi * self.radius**3


class Impact(NamedTuple):
    time: float
    kind: str
    ball: int
    partner: int
    position: np.ndarray
    normal: np.ndarray
    normal_speed: float
    tangential_speed: float
    dissipation: float
    feature: str  # of a blade: face, edge or corner; of a wavy drum: outer or inner arc; else ""
    grip: str  # smooth, sticking or sliding
    floored: bool


class Pair(NamedTuple):
    kind: str
    ball: int
    partner: int
    surface: int = -1  # which of the surfaces, where kind and partner do not tell


def length(a):
    return np.sqrt((a * a).sum(axis=-1))


def wavy_arcs(mill):
    """Arcs of the wavy profile: centres (2n, 2), their one radius, the direction of each middle as seen from its
    centre, and half of each arc's angle, outer and inner arcs in turn.

    The distance u of the centres from the circle is cut down to from what it must give: neighbours that touch."""
    n, big, h = mill.buckles, mill.drum_radius, mill.buckle_height
    at = mill.buckle_angle + np.pi / n * np.arange(2 * n)
    outer = np.arange(2 * n) % 2 == 0

    def centres(u):
        away = np.where(outer, big - u, big + u)
        return np.stack([away * np.cos(at), away * np.sin(at)], axis=-1)

    low, high = (
        -h,
        big,
    )  # of one radius u + h each, neighbours are apart at one end and overlap at the other
    while True:
        u = (low + high) / 2
        if u in (low, high):
            break
        c = centres(u)
        if length(c[1] - c[0]) > 2 * (u + h):
            low = u
        else:
            high = u
    c = centres(u)
    middle = np.where(outer, at, at + np.pi)
    towards = c[1:] - c[:-1]  # the joint with the next arc is on the way to its centre
    joint = np.arctan2(towards[:2, 1], towards[:2, 0])
    half = np.abs((joint - middle[:2] + np.pi) % (2 * np.pi) - np.pi)
    return c, u + h, middle, np.where(outer, half[0], half[1])


def nearest_arc(arcs, p):
    """Number of the arc nearest to the points p (..., 2), ends of arcs included. The profile is its own mirror image at
    the rays through the centres, so none is nearer than the outer arc around here and the inner ones beside it."""
    centre, rho, middle, half = arcs
    pitch = 4 * np.pi / len(centre)
    outer = 2 * np.round((np.arctan2(p[..., 1], p[..., 0]) - middle[0]) / pitch).astype(int)
    near = (outer[..., None] + np.array([-1, 0, 1])) % len(centre)
    off = p[..., None, :] - centre[near]
    angle = np.arctan2(off[..., 1], off[..., 0]) - middle[near]
    angle = (angle + np.pi) % (2 * np.pi) - np.pi
    angle = middle[near] + np.clip(angle, -half[near], half[near])
    wall = rho * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    best = length(off - wall).argmin(axis=-1)
    return np.take_along_axis(near, best[..., None], -1)[..., 0]


def wavy_nearest(arcs, p):
    """For points (..., 2): their distance within the profile, the unit normal towards them (..., 2), and the nearest
    points of the wall. Nearest on a curve without corners is where its normal points, never an end of an arc; so the
    sign of the distance is that of the nearest arc alone."""
    centre, rho, _, _ = arcs
    best = nearest_arc(arcs, p)
    off = p - centre[best]
    from_centre = length(off)
    out = off / np.maximum(from_centre, 1e-300)[..., None]
    outer = best % 2 == 0
    # towards its centre an outer arc is free, an inner one away from it
    distance = np.where(outer, rho - from_centre, from_centre - rho)
    return distance, np.where(outer, -1.0, 1.0)[..., None] * out, centre[best] + rho * out


def box_axes(phi, pitch):
    """Unit vectors of a blade at rotor angle phi: radial, along its width, along its thickness."""
    zero, one = np.zeros_like(phi), np.ones_like(phi)
    axial = np.stack([one, zero, zero], axis=-1)
    radial = np.stack([zero, np.cos(phi), np.sin(phi)], axis=-1)
    around = np.stack([zero, -np.sin(phi), np.cos(phi)], axis=-1)
    wide = np.cos(pitch) * axial + np.sin(pitch) * around
    thick = np.cos(pitch) * around - np.sin(pitch) * axial
    return radial, wide, thick


class Simulation:
    def __init__(self, mill, position, velocity, spin, step=STEP):
        self.mill = mill
        self.step = step
        self.r = np.array(position, dtype=float)
        self.v = np.array(velocity, dtype=float)
        self.w = np.array(spin, dtype=float)
        self.time = 0.0
        self.rotor_work = 0.0
        self.dissipated = 0.0
        self.mass = mill.mass()
        self.inertia = 0.4 * self.mass * mill.radius**2
        n = len(self.r)
        self.first, self.second = np.triu_indices(n, 1)
        self.pairs = [Pair("ball_ball", i, j) for i, j in zip(self.first, self.second)]
        self.pairs += self.surface_pairs()

    def surface_pairs(self):
        mill = self.mill
        self.arcs = wavy_arcs(mill) if mill.buckles else None
        surfaces = [("ball_drum", -1), ("ball_wall", 0), ("ball_wall", 1)]
        if mill.shaft_radius > 0:
            surfaces.append(("ball_shaft", -1))
        surfaces += [("ball_blade", k) for k in range(len(mill.blades))]
        self.surfaces = surfaces
        return [Pair(kind, i, number) for kind, number in surfaces for i in range(len(self.r))]

    # Where things are, t seconds after the last impact

    def fly(self, t, balls=slice(None)):
        """Positions and velocities of `balls` at the times t: arrays (times, balls, 3)."""
        t = np.asarray(t)[:, None, None]
        g = self.mill.gravity
        return self.r[balls] + self.v[balls] * t + 0.5 * g * t * t, self.v[balls] + g * t

    def rotor(self, t):
        return self.mill.rotor_angle + self.mill.rotor_speed * self.time + self.mill.rotor_speed * t

    def nearest(self, kind, number, r, t):
        """Distance of the points r (times, balls, 3) from a surface at the times t, the unit normal
        towards the point, and the point of the surface that is nearest."""
        mill = self.mill
        if kind == "ball_wall":
            side = 2 * number - 1
            nearest = r.copy()
            nearest[..., 0] = side * mill.drum_length / 2
            normal = np.zeros_like(r)
            normal[..., 0] = -side
            return mill.drum_length / 2 - side * r[..., 0], normal, nearest
        if kind == "ball_drum" and self.arcs:
            distance, across, wall = wavy_nearest(self.arcs, r[..., 1:])
            along = np.zeros_like(r[..., :1])
            normal = np.concatenate([along, across], axis=-1)
            return distance, normal, np.concatenate([r[..., :1], wall], axis=-1)
        if kind in ("ball_drum", "ball_shaft"):
            inward = kind == "ball_drum"
            rho = mill.drum_radius if inward else mill.shaft_radius
            off_axis = r * np.array([0.0, 1.0, 1.0])
            from_axis = length(off_axis)
            outward = off_axis / np.maximum(from_axis, 1e-300)[..., None]
            nearest = r - off_axis + rho * outward
            if inward:
                return rho - from_axis, -outward, nearest
            return from_axis - rho, outward, nearest
        blade = mill.blades[number]
        centre = np.array([blade.position, 0.0, 0.0])
        half = (blade.width / 2, blade.thickness / 2)
        axes = box_axes(self.rotor(np.asarray(t))[:, None] + blade.angle, blade.pitch)
        along = [((r - centre) * axis).sum(axis=-1) for axis in axes]
        inside = [
            np.clip(along[0], 0.0, blade.tip_radius),
            np.clip(along[1], -half[0], half[0]),
            np.clip(along[2], -half[1], half[1]),
        ]
        nearest = centre + sum(s[..., None] * axis for s, axis in zip(inside, axes))
        away = sum((a - s)[..., None] * axis for a, s, axis in zip(along, inside, axes))
        distance = length(away)
        return distance, away / np.maximum(distance, 1e-300)[..., None], nearest

    def feature(self, pair, t):
        """Which part of the surface is nearest. Of a blade: one box coordinate outside is a face, two an edge. Of a
        wavy drum: an outer or an inner arc."""
        r, _ = self.fly([t], [pair.ball])
        if pair.kind == "ball_drum" and self.arcs:
            return ("outer", "inner")[int(nearest_arc(self.arcs, r[0, 0, 1:])) % 2]
        if pair.kind != "ball_blade":
            return ""
        blade = self.mill.blades[pair.partner]
        axes = box_axes(self.rotor(np.array([t])) + blade.angle, blade.pitch)
        along = [float((r[0, 0] - [blade.position, 0, 0]) @ axis[0]) for axis in axes]
        outside = (
            (along[0] > blade.tip_radius) + (abs(along[1]) > blade.width / 2) + (abs(along[2]) > blade.thickness / 2)
        )
        return ("inside", "face", "edge", "corner")[outside]

    def surface_velocity(self, kind, point):
        """Shaft and blades turn with the rotor; drum and end walls stand still."""
        if kind not in ("ball_shaft", "ball_blade"):
            return np.zeros_like(point)
        omega = self.mill.rotor_speed
        zero = np.zeros_like(point[..., 0])
        return np.stack([zero, -omega * point[..., 2], omega * point[..., 1]], axis=-1)

    # Gaps and how fast they change: rows are self.pairs

    def ball_gaps(self, t, i, j):
        r, v = self.fly(t, i)
        q, u = self.fly(t, j)
        distance = length(r - q)
        rate = ((v - u) * (r - q)).sum(axis=-1) / distance
        return (distance - self.mill.radius[i] - self.mill.radius[j]).T, rate.T

    def surface_gaps(self, t, kind, number, balls):
        r, v = self.fly(t, balls)
        distance, normal, nearest = self.nearest(kind, number, r, t)
        rate = ((v - self.surface_velocity(kind, nearest)) * normal).sum(axis=-1)
        return (distance - self.mill.radius[balls]).T, rate.T

    def gaps(self, t):
        everyone = np.arange(len(self.r))
        rows = [self.ball_gaps(t, self.first, self.second)] if len(self.first) else []
        rows += [self.surface_gaps(t, kind, number, everyone) for kind, number in self.surfaces]
        return np.concatenate([g for g, _ in rows]), np.concatenate([d for _, d in rows])

    def gap(self, pair, t):
        """Gap and its rate of one pair at the times t: two arrays (times,)."""
        if pair.kind == "ball_ball":
            gap, rate = self.ball_gaps(t, [pair.ball], [pair.partner])
        else:
            gap, rate = self.surface_gaps(t, pair.kind, pair.partner, [pair.ball])
        return gap[0], rate[0]

    # The search

    def first_true(self, condition, lo, hi):
        """Cuts [lo, hi], where `condition` is false at lo and true at hi, down to two neighbouring
        doubles (or INSTANT); returns the later one, where it is true."""
        while hi - lo > INSTANT:
            inner = np.unique(np.linspace(lo, hi, FAN + 1)[1:-1])
            inner = inner[(inner > lo) & (inner < hi)]
            if len(inner) == 0:
                break
            true = condition(inner)
            k = int(np.argmax(true)) if true.any() else len(inner)
            edges = np.concatenate([[lo], inner, [hi]])
            lo, hi = edges[k], edges[k + 1]
        return hi

    def contact_between(self, pair, lo, hi):
        """First contact of the pair in one step [lo, hi], or None. In so short a step a gap turns
        once at most."""
        g, d = self.gap(pair, np.array([lo, hi]))

        def touching(t):
            return self.gap(pair, t)[0] <= 0

        def touching_at(t):
            return touching(np.array([t]))[0]

        if g[0] <= 0:
            if d[0] < 0:
                return lo
            if d[1] >= 0:
                return None
            top = self.first_true(lambda t: self.gap(pair, t)[1] < 0, lo, hi)
            if touching_at(top):
                return top
            return self.first_true(touching, top, hi) if g[1] <= 0 else None
        if g[1] <= 0:
            return self.first_true(touching, lo, hi)
        if d[0] < 0 <= d[1]:
            bottom = self.first_true(lambda t: self.gap(pair, t)[1] >= 0, lo, hi)
            if touching_at(bottom):
                return self.first_true(touching, lo, bottom)
        return None

    def next_contact(self, until):
        """The first contact within `until` seconds, and when: (pair, seconds) or (None, until)."""
        start = 0.0
        while start < until:
            stop = min(until, start + SAMPLES * self.step)
            t = np.linspace(start, stop, max(2, int(np.ceil((stop - start) / self.step)) + 1))
            gap, rate = self.gaps(t)
            g0, g1 = gap[:, :-1], gap[:, 1:]
            falls, rises = rate[:, :-1] < 0, rate[:, 1:] >= 0
            suspect = (g1 <= 0) | ((g0 <= 0) & (falls | ~rises)) | ((g0 < NEAR) & falls & rises)
            for k in np.flatnonzero(suspect.any(axis=0)):
                assert gap[:, k].min() > -OVERLAP, "the oracle has missed a contact"
                found = []
                for row in np.flatnonzero(suspect[:, k]):
                    when = self.contact_between(self.pairs[row], t[k], t[k + 1])
                    if when is not None:
                        found.append((when, row))
                if found:
                    when, row = min(found)
                    return self.pairs[row], when
            start = stop
        return None, until

    # The impact

    def energy(self):
        """Kinetic, rotational and potential energy of all balls."""
        kinetic = 0.5 * (self.mass * (self.v**2).sum(axis=1)).sum()
        spinning = 0.5 * (self.inertia * (self.w**2).sum(axis=1)).sum()
        return kinetic + spinning - (self.mass * (self.r @ self.mill.gravity)).sum()

    def advance(self, t):
        r, v = self.fly([t])
        self.r, self.v = r[0], v[0]
        self.time += float(t)

    def touched(self, pair):
        """Of a surface that a ball touches now: the unit normal, the point, and the velocity there."""
        _, normal, point = self.nearest(pair.kind, pair.partner, self.r[None, [pair.ball]], [0.0])
        return normal[0, 0], point[0, 0], self.surface_velocity(pair.kind, point[0, 0])

    def strike(self, pair):
        """Resolves the contact of `pair`, touching now, and returns its record."""
        mill, i, j = self.mill, pair.ball, pair.partner
        law = mill.laws[pair.kind]
        feature = self.feature(pair, 0.0)
        energy = self.energy()
        if pair.kind == "ball_ball":
            away = self.r[i] - self.r[j]
            normal = away / length(away)
            point = self.r[i] - mill.radius[i] * normal
            other = self.v[j] + np.cross(self.w[j], mill.radius[j] * normal)
            bodies = [(i, 1.0, -mill.radius[i] * normal), (j, -1.0, mill.radius[j] * normal)]
        else:
            normal, point, other = self.touched(pair)
            bodies = [(i, 1.0, -mill.radius[i] * normal)]
        slip = self.v[i] + np.cross(self.w[i], -mill.radius[i] * normal) - other
        approach = max(0.0, -float(slip @ normal))
        tangential = slip - (slip @ normal) * normal
        # How much the slip changes for one unit of impulse: along the normal the balls only move,
        # across it they turn as well
        give = sum(1 / self.mass[b] for b, _, _ in bodies)
        give_across = give + sum(mill.radius[b] ** 2 / self.inertia[b] for b, _, _ in bodies)
        rebound = max(law.restitution * approach, mill.rebound_floor)
        push = (approach + rebound) / give
        drag, grip = np.zeros(3), "smooth"
        if law.friction > 0:
            grip = "sticking"
            drag = -(1 + law.tangential) * tangential / give_across
            if length(drag) > law.friction * push:
                grip = "sliding"
                drag *= law.friction * push / length(drag)
        impulse = push * normal + drag  # received by ball i
        for b, sign, arm in bodies:
            self.v[b] += sign * impulse / self.mass[b]
            self.w[b] += sign * np.cross(arm, impulse) / self.inertia[b]
        work = float(impulse @ other) if pair.kind != "ball_ball" else 0.0  # of the motions
        self.rotor_work += work
        loss = energy + work - self.energy()
        self.dissipated += loss
        return Impact(
            self.time, pair.kind, int(i), int(j), point, normal, approach,
            float(length(tangential)), float(loss), feature, grip,
            law.restitution * approach < mill.rebound_floor,
        )  # fmt: skip

    def run(self, until, most=10**9):
        """Impacts in order, up to time `until` or `most` of them."""
        impacts = []
        while len(impacts) < most and self.time < until:
            pair, t = self.next_contact(until - self.time)
            self.advance(t)
            if pair is None:
                break
            impacts.append(self.strike(pair))
        return impacts
