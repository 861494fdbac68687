"""Blades as boxes in numpy's or mpmath's numbers, and balls placed so that they meet them."""

import dataclasses

import mpmath
import numpy as np
from single.common import exact

A = 0.0025  # [m] radius of the balls
DRUM = 0.1  # [m] inner radius
G = 9.81
END = 0.02  # [s] of the runs: less than a third of a turn
LEAST = 0.5  # [m/s] closing speed


@dataclasses.dataclass
class Meeting:
    """A blade, a ball's start, and what the first contact ought to be."""

    blade: dict
    place: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    feature: str
    time: object = None
    point: list = None
    normal: list = None
    closing: object = None


def cross(p, q):
    return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]


class Box:
    """A blade, and the distance of a ball's centre from it; with numpy's or mpmath's numbers."""

    def __init__(self, blade, speed, gravity, number=float):
        self.number = number
        self.maths = mpmath if number is exact else np
        self.at, self.angle = number(blade["position"]), number(blade["angle"])
        self.half = [number(blade[k]) / 2 for k in ("width", "tip_radius", "thickness")]
        self.pitch = number(blade.get("pitch", 0.0))
        self.speed, self.gravity = number(speed), number(gravity)

    def centre(self, ball, t):
        """Where a ball is at time t [m]."""
        x, y, z = (self.number(p) + self.number(v) * t for p, v in zip(ball.place, ball.velocity))
        return x, y, z - self.gravity * t * t / 2

    def view(self, ball, t):
        """The centre as seen from the box's own, along width, radius and thickness [m]."""
        x, y, z = self.centre(ball, t)
        turn = self.angle + self.speed * t
        c, s = self.maths.cos(turn), self.maths.sin(turn)
        radial, around, along = c * y + s * z - self.half[1], c * z - s * y, x - self.at
        cp, sp = self.maths.cos(self.pitch), self.maths.sin(self.pitch)
        return cp * along + sp * around, radial, cp * around - sp * along

    def off(self, ball, t):
        """The centre less the nearest point of the box, along the same axes [m]."""
        if self.maths is np:
            return [np.sign(q) * np.maximum(np.abs(q) - h, 0) for q, h in zip(self.view(ball, t), self.half)]
        view = zip(self.view(ball, t), self.half)
        return [mpmath.sign(q) * max(abs(q) - h, mpmath.mpf(0)) for q, h in view]

    def gap(self, ball, t):
        x, y, z = self.off(ball, t)
        return self.maths.sqrt(x * x + y * y + z * z) - self.number(A)

    def to_world(self, vector, t):
        """A direction of the box (width, radius, thickness) in the drum's frame."""
        w, radial, h = vector
        turn = self.angle + self.speed * t
        c, s = self.maths.cos(turn), self.maths.sin(turn)
        cp, sp = self.maths.cos(self.pitch), self.maths.sin(self.pitch)
        around = sp * w + cp * h
        return [cp * w - sp * h, c * radial - s * around, s * radial + c * around]

    def meet(self, ball, t):
        """Point, normal into the ball, closing speed and slip of a contact at t."""
        off = self.off(ball, t)
        size = self.maths.sqrt(sum(q * q for q in off))
        normal = self.to_world([q / size for q in off], t)
        point = [c - size * n for c, n in zip(self.centre(ball, t), normal)]
        speed = [self.number(v) for v in ball.velocity]
        speed[2] -= self.gravity * t
        surface = [0, -self.speed * point[2], self.speed * point[1]]
        relative = [v - s for v, s in zip(speed, surface)]
        closing = -sum(u * n for u, n in zip(relative, normal))
        rolling = cross([self.number(w) * self.number(A) for w in ball.spin], normal)
        slip = [u + closing * n - r for u, n, r in zip(relative, normal, rolling)]
        return point, normal, closing, self.maths.sqrt(sum(q * q for q in slip))


def random_blade(rng, slice_at, pitched):
    return {
        "position": slice_at,
        "angle": rng.uniform(-np.pi, np.pi),
        "tip_radius": rng.uniform(0.05, 0.08),
        "width": rng.uniform(0.01, 0.02),
        "thickness": rng.uniform(0.004, 0.01),
        "pitch": rng.uniform(-0.8, 0.8) if pitched else 0.0,
    }


def first_root(box, ball, until):
    """First time at which the gap closes, with a bracket; None if there is none.

    The sampled gap is searched for any place where it could dip below zero between two samples.
    """
    t = np.linspace(0.0, until, 4001)
    gap = box.gap(ball, t)
    if gap[0] <= 0:
        return None
    below = np.flatnonzero(gap <= 0)
    end = below[0] if len(below) else len(t)
    # a dip between samples: no gap changes faster than this [m/s]
    fastest = np.linalg.norm(ball.velocity) + abs(box.gravity) * until + abs(box.speed) * DRUM
    near = np.minimum(gap[: end - 1], gap[1:end]) < 0.5 * fastest * t[1]
    if end == len(t) or np.any(near[:-1] & (np.diff(gap[:end])[:-1] > 0)):
        return None  # no contact, or a grazing that is not worth its trouble
    return t[end - 1], t[end]


def refine(sharp, ball, bracket):
    """The root to 40 digits and more."""
    ends = tuple(exact(t) for t in bracket)
    return mpmath.findroot(lambda t: sharp.gap(ball, t), ends, solver="anderson", tol=mpmath.mpf(10) ** -80)


def reference(meeting, speed, gravity, time):
    sharp = Box(meeting.blade, speed, gravity, exact)
    meeting.time = time
    meeting.point, meeting.normal, meeting.closing, _ = sharp.meet(meeting, time)


NORMALS = {
    "face": (0, 0, 1),
    "side edge": (1, 0, 1),
    "tip edge": (0, 1, 1),
    "pitch edge": (1, 1, 0),  # only a pitched blade strikes with it
    "tip": (0, 1, 0),
    "corner": (1, 1, 1),
}


def aimed(rng, slice_at, feature, speed, pitched, still):
    """A ball placed so that it meets a feature of a blade at some time, unless it meets another before."""
    blade = random_blade(rng, slice_at, pitched)
    target = rng.uniform(1e-3, 2e-3) if still else rng.uniform(1e-3, END)
    outside = np.array(NORMALS[feature])
    side = rng.choice([-1.0, 1.0], 3)
    side[1] = 1.0  # the tip, not the axis
    if still and not pitched:
        side[2] = np.sign(speed)  # the face that goes ahead
    normal = outside * side * rng.uniform(0.3, 1.0, 3)
    normal /= np.linalg.norm(normal)
    half = 0.5 * np.array([blade["width"], blade["tip_radius"], blade["thickness"]])
    spot = np.where(outside, side * half, rng.uniform([-0.9, 0.2, -0.9], 0.9) * half) + A * normal
    centre = Box(blade, speed, 0.0).to_world(spot + [0, half[1], 0], target)
    velocity = 2.0 * rng.normal(size=3)
    velocity[0] = rng.uniform(-2.0, 2.0)  # the ball stays near its blade
    if still:
        velocity[:] = 0.0
    place = np.array(centre) + [slice_at, 0, 0] - velocity * target
    if not still:
        place[2] += 0.5 * G * target**2
    spin = 0.0 * velocity if still else rng.normal(size=3) / A
    return Meeting(blade, place, velocity, spin, feature), target


def first_is_meant(meeting, box, target):
    """Nothing is met before: neither another part of the blade nor the drum."""
    bracket = first_root(box, meeting, target + 2e-5)
    if bracket is None or not bracket[0] - 1e-6 <= target <= bracket[1] + 1e-6:
        return None
    _, y, z = box.centre(meeting, np.linspace(0, target, 400))
    return bracket if np.hypot(y, z).max() < DRUM - 1.001 * A else None


def by_trial(rng, slice_at, feature, speed, still):
    """A ball and a pitched blade that meet as meant, closing at LEAST or faster."""
    gravity = 0.0 if still else G
    while True:
        meeting, target = aimed(rng, slice_at, feature, speed, True, still)
        box = Box(meeting.blade, speed, gravity)
        if not box.meet(meeting, target)[2] > LEAST:
            continue
        bracket = first_is_meant(meeting, box, target)
        if bracket is not None:
            time = refine(Box(meeting.blade, speed, gravity, exact), meeting, bracket)
            reference(meeting, speed, gravity, time)
            return meeting
