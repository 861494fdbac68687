"""Motions of bodies for the oracle: where a frame is at the times t, and how fast it moves.

A motion carries a point p of its own frame to M(t) p in its carrier's frame; the last carrier is the laboratory. Every
rate is the derivative of the closed formula, not a difference, so that velocities are as good as places.

All numbers are SI; arrays over times come first: place (times, 3), rotation (times, 3, 3).
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline


class Pose(NamedTuple):
    """M(t) p = rotation p + place; `velocity` is that of the frame's origin, `spin` the angular velocity, both told in
    the coordinates that `place` is told in."""

    place: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


def times(matrix, vector):
    """Matrices (..., 3, 3) times vectors (..., 3)."""
    return (matrix * vector[..., None, :]).sum(axis=-1)


def skew(a):
    """Matrices (..., 3, 3) of the cross product with a (..., 3)."""
    x, y, z = np.moveaxis(a, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotation_of(vector):
    """Rotation matrices (..., 3, 3) by rotation vectors (..., 3), after Rodrigues."""
    angle = np.sqrt((vector**2).sum(axis=-1))[..., None, None]
    half = np.sinc(angle / (2 * np.pi))  # sin(angle / 2) / (angle / 2)
    cross = skew(vector)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * (cross @ cross)


def spin_of(vector, rate):
    """Angular velocity of the rotation by `vector`, that changes at `rate`: the left Jacobian of the rotation
    vector."""
    angle = np.sqrt((vector**2).sum(axis=-1))[..., None]
    half = np.sinc(angle / (2 * np.pi))
    small = angle < 1e-2  # there (angle - sin) / angle^3 loses digits, its series does not
    safe = np.where(small, 1.0, angle)
    third = np.where(small, 1 / 6 - angle**2 / 120 + angle**4 / 5040, (safe - np.sin(safe)) / safe**3)
    across = np.cross(vector, rate)
    return rate + 0.5 * half**2 * across + third * np.cross(vector, across)


def about(centre, axis, angle, rate):
    """Pose of a rotation by `angle` (times,) about the axis through `centre`."""
    axis = axis / np.sqrt(axis @ axis)
    rotation = rotation_of(angle[:, None] * axis)
    spin = rate[:, None] * axis
    arm = -times(rotation, np.broadcast_to(centre, spin.shape))
    return Pose(centre + arm, rotation, np.cross(spin, arm), spin)


def carried(outer, inner):
    """The pose `inner`, told in the frame that `outer` carries."""
    arm = times(outer.rotation, inner.place)
    return Pose(
        outer.place + arm,
        outer.rotation @ inner.rotation,
        outer.velocity + np.cross(outer.spin, arm) + times(outer.rotation, inner.velocity),
        outer.spin + times(outer.rotation, inner.spin),
    )


def standing(t):
    zero = np.zeros((len(t), 3))
    return Pose(zero, np.broadcast_to(np.eye(3), (len(t), 3, 3)), zero, zero)


@dataclass
class Turn:
    centre: np.ndarray
    axis: np.ndarray
    speed: float
    angle: float = 0.0

    def pose(self, t):
        return about(self.centre, self.axis, self.angle + self.speed * t, np.full_like(t, self.speed))


@dataclass
class Swing:
    centre: np.ndarray
    axis: np.ndarray
    amplitude: float
    frequency: float
    phase: float = 0.0

    def pose(self, t):
        omega = 2 * np.pi * self.frequency
        turn = omega * t + self.phase
        rate = self.amplitude * omega * np.cos(turn)
        return about(self.centre, self.axis, self.amplitude * np.sin(turn), rate)


@dataclass
class Shift:
    amplitude: np.ndarray
    frequency: float
    phase: np.ndarray

    def pose(self, t):
        omega = 2 * np.pi * self.frequency
        turn = omega * t[:, None] + self.phase
        still = standing(t)
        return still._replace(place=self.amplitude * np.sin(turn), velocity=self.amplitude * omega * np.cos(turn))


class Table:
    """Rows `t x y z rx ry rz` of one period; the first row is where it is at t = 0."""

    def __init__(self, rows):
        times = rows[:, 0] - rows[0, 0]
        self.period = times[-1]
        self.curve = CubicSpline(times, rows[:, 1:], bc_type="periodic")
        self.slope = self.curve.derivative()

    def pose(self, t):
        at = np.mod(t, self.period)
        value, rate = self.curve(at), self.slope(at)
        turn = value[:, 3:]
        return Pose(value[:, :3], rotation_of(turn), rate[:, :3], spin_of(turn, rate[:, 3:]))


@dataclass
class Motion:
    """A link and what carries it. `late` and `drift` set its clock wrong by some roundings: they make twins."""

    link: object
    carrier: "Motion | None" = None
    late: float = 0.0  # s
    drift: float = 0.0

    def pose(self, t):
        """Poses in the laboratory at the times t (times,)."""
        own = self.link.pose(t + (self.late + self.drift * t))
        return carried(self.carrier.pose(t), own) if self.carrier else own

    def jolted(self, near):
        carrier = self.carrier.jolted(near) if self.carrier else None
        late, drift = near(np.zeros(2)).tolist()
        return replace(self, carrier=carrier, late=late, drift=drift)
