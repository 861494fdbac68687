"""A ball between walls that a sine moves along z, in 40 digits: an independent reference that shares no code with
the program."""

import dataclasses

import mpmath
import numpy as np

TRIALS = 400  # points of a flight at which the sign of the gap is looked at


@dataclasses.dataclass
class Shaken:
    """Wall centres at offset + A sin(w t + phase); the ball's centre falls with `gravity`. All SI."""

    amplitude: float
    frequency: float
    phase: float
    gravity: float
    restitution: float
    low: float  # the centre's lowest and highest place in the box at rest
    high: float

    def __post_init__(self):
        for field in dataclasses.fields(self):
            setattr(self, field.name, mpmath.mpf(getattr(self, field.name)))
        self.omega = 2 * mpmath.pi * self.frequency

    def wall(self, t):
        return self.amplitude * mpmath.sin(self.omega * t + self.phase)

    def wall_speed(self, t):
        return self.amplitude * self.omega * mpmath.cos(self.omega * t + self.phase)

    def gap(self, end, t, t0, z, v):
        """Room to the lower (end = 0) or upper wall at t, of a flight from z with v at t0."""
        fall = z + v * (t - t0) - self.gravity * (t - t0) ** 2 / 2
        return (fall - self.low - self.wall(t)) if end == 0 else self.high + self.wall(t) - fall

    def first(self, t0, z, v):
        """The next contact after t0: its time and end. The gap's sign is looked at in steps that no flight is as
        short as."""
        step = 1 / (self.frequency * TRIALS)
        before = None
        floats = [float(x) for x in (t0, z, v, self.amplitude, self.omega, self.phase)]
        for k in range(1, 100 * TRIALS):
            for end in (0, 1):
                if self._gap(end, floats, (k + 0.5) * float(step)) < 0:
                    before = t0 + (k - 0.5) * step
                    return self.root(end, before, before + step, t0, z, v), end
        raise RuntimeError("the ball does not come down")

    def _gap(self, end, start, after):
        t0, z, v, amplitude, omega, phase = start
        fall = z + v * after - 0.5 * float(self.gravity) * after**2
        wall = amplitude * np.sin(omega * (t0 + after) + phase)
        return (fall - float(self.low) - wall) if end == 0 else float(self.high) + wall - fall

    def root(self, end, a, b, t0, z, v):
        """The root between a and b, by bisection to 1e-13 of a step and Newton's steps from there."""
        for _ in range(44):
            middle = (a + b) / 2
            inside = self.gap(end, middle, t0, z, v) > 0
            a, b = (middle, b) if inside else (a, middle)
        for _ in range(3):
            falls = v - self.gravity * (b - t0) - self.wall_speed(b)
            b -= self.gap(end, b, t0, z, v) / (falls if end == 0 else -falls)
        return b

    def impacts(self, z, v, count):
        """Times and normal speeds of the first `count` impacts of a ball that starts at z with v."""
        t, z, v = mpmath.mpf(0), mpmath.mpf(z), mpmath.mpf(v)
        times, speeds = [], []
        for _ in range(count):
            when, end = self.first(t, z, v)
            z += v * (when - t) - self.gravity * (when - t) ** 2 / 2
            v -= self.gravity * (when - t)
            moving = self.wall_speed(when)
            speeds.append(abs(v - moving))
            times.append(when)
            v = moving - self.restitution * (v - moving)
            t = when
        return times, speeds

    def phases(self, times):
        """Phase of the shaker at each time, -pi .. pi."""
        turns = np.array([float(mpmath.fmod(self.frequency * mpmath.mpf(float(t)), 1)) for t in times])
        angle = 2 * np.pi * turns + float(self.phase)
        return np.arctan2(np.sin(angle), np.cos(angle))
