"""One ball in a jar that is carried in a plane, in 30 digits and more: an independent reference that shares no code
with the program.

Motions take a point p of the jar's frame to Rz(angle) p + (x, y, 0) in the laboratory; the closed forms, and their
derivatives, are given here. The law of the impact is Walton's, with the rebound floor (docs/physics.md).
"""

import math

import mpmath

FASTEST = 25.0  # [m/s] no ball and wall of these mills approach each other faster
TINY = mpmath.mpf("1e-60")


class Swing:
    """About the z axis through the origin."""

    def __init__(self, amplitude, frequency, phase=0.0):
        self.amplitude, self.phase = mpmath.mpf(amplitude), mpmath.mpf(phase)
        self.omega = 2 * mpmath.pi * mpmath.mpf(frequency)

    def pose(self, t, lib):
        """x, y, angle."""
        x, y = lib.mpf(0), lib.mpf(0)
        return (
            x,
            y,
            lib.mpf(self.amplitude) * lib.sin(lib.mpf(self.omega) * t + lib.mpf(self.phase)),
        )

    def rates(self, t):
        angle = self.amplitude * self.omega * mpmath.cos(self.omega * t + self.phase)
        return mpmath.mpf(0), mpmath.mpf(0), angle


class Circle:
    """A shift on a circle: x = A cos(w t), y = A sin(w t)."""

    def __init__(self, amplitude, frequency):
        self.amplitude = mpmath.mpf(amplitude)
        self.omega = 2 * mpmath.pi * mpmath.mpf(frequency)

    def pose(self, t, lib):
        a, angle = lib.mpf(self.amplitude), lib.mpf(self.omega) * t
        return a * lib.cos(angle), a * lib.sin(angle), lib.mpf(0)

    def rates(self, t):
        x, y, _ = self.pose(t, mpmath)
        return -self.omega * y, self.omega * x, mpmath.mpf(0)


class Planetary:
    """A turn with `jar` [rad/s] about (distance, 0, 0) on a turn with `sun` about the origin."""

    def __init__(self, distance, sun, jar):
        self.distance, self.sun = mpmath.mpf(distance), mpmath.mpf(sun)
        self.whole = self.sun + mpmath.mpf(jar)

    def pose(self, t, lib):
        d, sun, whole = lib.mpf(self.distance), lib.mpf(self.sun) * t, lib.mpf(self.whole) * t
        return d * (lib.cos(sun) - lib.cos(whole)), d * (lib.sin(sun) - lib.sin(whole)), whole

    def rates(self, t):
        d, sun, whole = self.distance, self.sun, self.whole
        x = d * (whole * mpmath.sin(whole * t) - sun * mpmath.sin(sun * t))
        y = d * (sun * mpmath.cos(sun * t) - whole * mpmath.cos(whole * t))
        return x, y, whole


class Floats:
    """The same mathematics in doubles, for the search."""

    sin, cos, sqrt, mpf = math.sin, math.cos, math.sqrt, float


class Capsule:
    """Round ends, straight part of `length` along y, about (centre, 0, 0) of the frame."""

    def __init__(self, centre, radius, length):
        self.centre, self.radius, self.half = map(mpmath.mpf, (centre, radius, length / 2))

    def room(self, p, a, lib):
        """Room between the ball's surface and the wall, and where from the ball is seen so: -normal times the
        distance."""
        half = lib.mpf(self.half)
        past = p[1] - max(-half, min(half, p[1]))
        arm = [p[0] - lib.mpf(self.centre), past, p[2]]
        return lib.mpf(self.radius) - a - lib.sqrt(arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2), arm


class Cylinder:
    """Flat ends, along z, about (centre, 0, 0) of the frame."""

    def __init__(self, centre, radius, length):
        self.centre, self.radius, self.half = map(mpmath.mpf, (centre, radius, length / 2))

    def room(self, p, a, lib):
        x, y = p[0] - lib.mpf(self.centre), p[1]
        around = lib.mpf(self.radius) - a - lib.sqrt(x * x + y * y)
        ends = lib.mpf(self.half) - a - abs(p[2])
        if around < ends:
            return around, [x, y, lib.mpf(0)]
        return ends, [lib.mpf(0), lib.mpf(0), p[2]]


def cross(u, v):
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def dot(u, v):
    return sum(p * q for p, q in zip(u, v))


def plus(u, v, factor=1):
    return [p + factor * q for p, q in zip(u, v)]


def length(u):
    return mpmath.sqrt(dot(u, u))


class Ball:
    """A ball of radius a, and of mass 1, in a shape on a motion. law: restitution, friction, tangential, floor."""

    def __init__(self, motion, shape, a, law, state, gravity=(0, 0, 0), step=1e-6):
        self.motion, self.shape, self.step = motion, shape, step
        self.a = mpmath.mpf(a)
        self.e, self.mu, self.beta, self.floor = map(mpmath.mpf, law)
        numbers = [mpmath.mpf(float(x)) for x in (*state, *[0.0] * 9)][:9]
        self.x, self.v, self.w = numbers[:3], numbers[3:6], numbers[6:]
        self.g = [mpmath.mpf(x) for x in gravity]
        self.t, self.work = mpmath.mpf(0), mpmath.mpf(0)

    def place(self, t, lib):
        after = t - lib.mpf(self.t)
        return [lib.mpf(x) + lib.mpf(v) * after + lib.mpf(g) * after * after / 2
                for x, v, g in zip(self.x, self.v, self.g)]  # fmt: skip

    def room(self, t, lib):
        """Room at the time t of this flight, and the arm of the shape in the laboratory's axes."""
        x, y, angle = self.motion.pose(t, lib)
        c, s = lib.cos(angle), lib.sin(angle)
        p = self.place(t, lib)
        p = [p[0] - x, p[1] - y, p[2]]
        room, arm = self.shape.room([c * p[0] + s * p[1], c * p[1] - s * p[0], p[2]], lib.mpf(self.a), lib)
        return room, [c * arm[0] - s * arm[1], s * arm[0] + c * arm[1], arm[2]]

    def next_time(self, latest):
        """Of the next contact: strides that no room can close in, in doubles, then bisection and secants."""
        t = float(self.t) + 0.5 * self.step
        stride, room = self.step, 0.0
        while t <= latest:
            stride = max(self.step, room / FASTEST)
            room = self.room(t + stride, Floats)[0]
            if room <= 0:
                break
            t += stride
        else:
            return None
        a, b = mpmath.mpf(t), mpmath.mpf(t + stride)
        for _ in range(40):
            middle = (a + b) / 2
            a, b = (middle, b) if self.room(middle, mpmath)[0] > 0 else (a, middle)
        for _ in range(4):
            fa, fb = self.room(a, mpmath)[0], self.room(b, mpmath)[0]
            if fa == fb or abs(fb) < TINY:
                break
            a, b = b, b - fb * (b - a) / (fb - fa)
        return b

    def hit(self, when):
        """Brings the ball through the contact at `when`; normal speed and slip before it."""
        after = when - self.t
        _, arm = self.room(when, mpmath)
        self.x, self.v, self.t = self.place(when, mpmath), plus(self.v, self.g, after), when
        n = [-q / length(arm) for q in arm]
        vx, vy, omega = self.motion.rates(when)
        x, y, _ = self.motion.pose(when, mpmath)
        point = plus(self.x, n, -self.a)
        surface = plus([vx, vy, mpmath.mpf(0)], cross([0, 0, omega], [point[0] - x, point[1] - y, 0]))
        seen = plus(plus(self.v, cross(self.w, plus(point, self.x, -1))), surface, -1)
        normal = -dot(seen, n)
        slip = plus(seen, n, normal)
        push = max(self.e * normal, self.floor) + normal
        size = length(slip)
        grip = 0 if size < TINY else min(2 * (1 + self.beta) / 7, self.mu * push / size)
        impulse = plus([push * q for q in n], slip, -grip)
        self.v = plus(self.v, impulse)
        self.w = plus(self.w, cross([-self.a * q for q in n], impulse), 1 / (self.a**2 * mpmath.mpf(2) / 5))
        self.work += dot(impulse, surface)
        return normal, size

    def impacts(self, count, latest=1e9):
        """Times, normal speeds and slips of the next `count` impacts, as lists; fewer up to `latest`."""
        rows = []
        while len(rows) < count:
            when = self.next_time(latest)
            if when is None:
                break
            rows.append((when, *self.hit(when)))
        return [list(column) for column in zip(*rows)]
