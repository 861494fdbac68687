"""The motions of a deck, and the paths of points that they carry.

A motion takes a point p of its own frame to R(t) p + d(t) in the frame of its carrier. For all motions but tables, R
and d are sums of harmonics: a few, or about ten for swings (Bessel functions). The same is true of a chain of motions,
such as a jar on a sun wheel or an arm in a shaken frame. So the place, velocity and acceleration of a point are known
in closed form. SI units, angles in rad; poses (3, 4) as in milltools.geometry.bodies.
"""

import collections
import dataclasses
import functools
import math

import numpy as np
from scipy.special import jv

from milltools.base.errors import UserError
from milltools.geometry.bodies import after, moved

NOTHING = 1e-14  # harmonics smaller than this, relative to the largest, are left out
PARALLEL = 1e-9
ROUNDING = 1e-14  # [m]
TIMES = np.random.default_rng(1).uniform(0, 1, 24)  # moments at which motions are checked, in slowest periods


def vector(deck, key, default=(0.0, 0.0, 0.0)):
    """The vector (3,) of a key of a deck, SI."""
    return np.array(deck.numbers(key) or default)


def direction(deck, key):
    """The unit vector (3,) of a key of a deck; z if the key is not given."""
    along = vector(deck, key, (0.0, 0.0, 1.0))
    return along / np.linalg.norm(along)


def digits(values):
    """Numbers with enough digits for LIGGGHTS to read the same double."""
    return " ".join(f"{value:.17g}" for value in np.atleast_1d(values))


class Harmonics:
    """Sum of value[k] exp(i rate[k] t): value (K, ...) complex, rate (K,) [rad/s]; the sum is real."""

    def __init__(self, rate, value, least=0.0):
        """least: harmonics of at most this size are rounding errors."""
        rate, value = np.asarray(rate, float), np.asarray(value, complex)
        order = np.argsort(rate)
        rate, value = rate[order], value[order]
        near = 1e-12 * np.abs(rate).max(initial=0)
        first = np.concatenate([[True], np.diff(rate) > near])
        value = np.add.reduceat(value, np.flatnonzero(first), axis=0)
        size = np.abs(value).reshape(len(value), -1).max(axis=1)
        rate = np.where(np.abs(rate[first]) > near, rate[first], 0.0)
        keep = (size > max(NOTHING * size.max(), least)) | (rate == 0)
        self.rate, self.value = rate[keep], value[keep]
        self._phase, self._flat = 1j * self.rate, self.value.reshape(len(self.rate), -1)

    def __call__(self, t, order=0):
        """The derivative of this order at the time t, or at times (T,): (T, ...)."""
        wave = self._phase**order * np.exp(np.multiply.outer(t, self._phase))
        return (wave @ self._flat).real.reshape(np.shape(t) + self.value.shape[1:])

    def times(self, inner):
        """This matrix times another."""
        rate = (self.rate[:, None] + inner.rate).ravel()
        value = np.einsum("aij,bj...->abi...", self.value, inner.value)
        return Harmonics(rate, value.reshape(-1, *value.shape[2:]))


def _translation(by):
    """The matrix (4, 4) of a translation."""
    whole = np.eye(4, dtype=complex)
    whole[:3, 3] = by
    return whole


class Motion:
    """harmonics: of its matrix (4, 4); fastest(): its largest angular velocity [rad/s] or velocity [m/s];
    seen(pose): the same motion if its carrier's frame is at a fixed pose."""

    def pose(self, t):
        """The pose (3, 4) at a time."""
        return self.harmonics(t)[:3]

    def path(self, t):
        """The pose relative to t = 0."""
        return after(self.pose(t), self.pose(0.0))


@dataclasses.dataclass(frozen=True)
class Rotation(Motion):
    """Turns about an axis through `centre` by angle + speed t + sum of a sin(w t + phase) of `swings` (a, w, phase)."""

    name: str
    centre: np.ndarray
    axis: np.ndarray
    speed: float = 0.0
    angle: float = 0.0
    swings: tuple = ()

    def fastest(self):
        return abs(self.speed) + sum(abs(a * w) for a, w, _ in self.swings)

    @functools.cached_property
    def harmonics(self):
        still, half = np.zeros((2, 4, 4), complex)
        still[:3, :3], still[3, 3] = np.outer(self.axis, self.axis), 1
        half[:3, :3] = (np.eye(3) - still[:3, :3] - 1j * np.cross(np.eye(3), self.axis)) / 2  # of exp(i angle)
        wave = {self.speed: np.exp(1j * self.angle)}
        for a, w, phase in self.swings:
            # exp(i a sin x) = sum of J_n(a) exp(i n x)
            most, swung = math.ceil(abs(a)) + 16, collections.defaultdict(complex)
            for rate, value in wave.items():
                for n in range(-most, most + 1):
                    swung[rate + n * w] += value * jv(n, a) * np.exp(1j * n * phase)
            wave = swung
        parts = [still, *(half * v for v in wave.values()), *((half * v).conj() for v in wave.values())]
        about = _translation(self.centre) @ parts @ _translation(-self.centre)
        return Harmonics([0.0, *wave, *(-rate for rate in wave)], about)

    def seen(self, pose):
        return dataclasses.replace(self, centre=moved(pose, self.centre), axis=pose[:, :3] @ self.axis)

    @property
    def rates(self):
        """Its angular velocity [rad/s] as [(constant, [(a, w, phase)])]: constant + sum of a cos(w t + phase)."""
        return [(self.speed, [(a * w, w, phase) for a, w, phase in self.swings])]


@dataclasses.dataclass(frozen=True)
class Shift(Motion):
    """Shifts by the vector `amount` (3,) times sin(w t + phase), phase (3,)."""

    name: str
    amount: np.ndarray
    w: float
    phase: np.ndarray
    centre = np.zeros(3)

    def fastest(self):
        return abs(self.w) * float(np.linalg.norm(self.amount))

    @functools.cached_property
    def harmonics(self):
        wave = _translation(self.amount @ np.exp(1j * self.phase) / 2j) - np.eye(4)
        return Harmonics([0, self.w, -self.w], [np.eye(4), wave, wave.conj()])

    def seen(self, pose):
        return dataclasses.replace(self, amount=pose[:, :3] @ self.amount)

    @property
    def rates(self):
        """The velocity [m/s] along x, y and z, in the form of Rotation.rates."""
        return [
            (0.0, [(a * self.w, self.w, phase) for a, phase in zip(row, self.phase, strict=True)])
            for row in self.amount
        ]


def motion(deck, name):
    """The motion of a section [motion.NAME], or "rotor"."""
    if name == "rotor":
        return Rotation(name, np.zeros(3), np.eye(3)[0], deck.rotor_speed, deck.number("rotor.angle", 0.0))
    section, kind = f"motion.{name}", deck.value(f"motion.{name}.kind")
    if kind not in ("turn", "swing", "shift"):
        raise UserError(
            f"{deck.path}: [{section}] kind: mill dem cannot run a {kind}: between its rows, LIGGGHTS accelerates "
            "differently"
        )
    w = 2 * math.pi * deck.number(f"{section}.frequency", 0.0)
    phase, amplitude = deck.numbers(f"{section}.phase") or [0.0], deck.numbers(f"{section}.amplitude")
    if kind == "shift":
        return Shift(name, np.diag(amplitude), w, np.resize(phase, 3))
    about = vector(deck, f"{section}.centre"), direction(deck, f"{section}.axis")
    if kind == "swing":
        return Rotation(name, *about, swings=((amplitude[0], w, phase[0]),))
    return Rotation(name, *about, deck.number(f"{section}.speed"), deck.number(f"{section}.angle", 0.0))


class Chain:
    """A chain of motions, each carried by the next, the innermost first; `name` of the innermost, "": nothing moves."""

    def __init__(self, deck, name):
        self.name, self.motions = name, []
        while name:
            self.motions.append(motion(deck, name))
            name = deck.value(f"motion.{name}.on", "")
        self.whole, self.carriers = Harmonics([0.0], [np.eye(4)]), []  # from the frame of each motion to the laboratory
        for one in reversed(self.motions):
            self.carriers.insert(0, self.whole)
            self.whole = self.whole.times(one.harmonics)
        rates = np.abs(self.whole.rate[self.whole.rate != 0])
        self.times = TIMES * (2 * math.pi / rates.min() if len(rates) else 1.0)

    def pose(self, t):
        """The pose (3, 4) in the laboratory."""
        return self.whole(t)[:3]

    def point(self, place):
        """The Harmonics (3,) of a point at `place` in the innermost frame."""
        return Harmonics(self.whole.rate, (self.whole.value @ [*place, 1.0])[:, :3], ROUNDING)

    def spin(self):
        """The rotation of the carried body, as a Rotation about the origin in the laboratory's directions; None if it
        does not turn. The directions at t = 0 are those of pose(0). UserError if the axis is not fixed."""
        axes, swings, speed = None, [], 0.0
        for one, carrier in zip(self.motions, self.carriers, strict=True):
            if isinstance(one, Shift) or one.fastest() == 0:
                continue
            now = np.array([carrier(t)[:3, :3] @ one.axis for t in self.times])
            axes = now[0] if axes is None else axes
            side = np.sign(now[0] @ axes)
            if np.abs(now - side * axes).max() > PARALLEL:
                raise UserError(f"motion {one.name}: its axis changes direction")
            speed += side * one.speed
            swings += [(side * a, w, phase) for a, w, phase in one.swings]
        if axes is None:
            return None
        start = -sum(a * math.sin(phase) for a, _, phase in swings)
        return Rotation(self.name, np.zeros(3), axes, speed, start, tuple(swings))
