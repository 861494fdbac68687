"""How the motions of a deck carry what is on them, and how LIGGGHTS is told so.

A motion takes a point p of its frame to R(t) p + d(t) in its carrier's. Of all but tables R and d are sums of harmonics, a few
or (swings: Bessel functions) some ten, and so are those of a chain of motions: a sun wheel's jar, an arm in a shaken frame. So a
point's place, velocity and acceleration are known in closed form. SI units, angles in rad.
"""

import collections
import dataclasses
import math

import numpy as np
from scipy.special import jv

from milltools.base.errors import UserError

NOTHING = 1e-14  # harmonics smaller than this are left out, beside the largest
PARALLEL = 1e-9
ROUNDING = 1e-14  # [m]
TIMES = np.random.default_rng(1).uniform(0, 1, 24)  # moments at which a motion is looked at, in its slowest periods


def skew(a):
    """The matrix of p -> a x p."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def cross(a, b):
    """a x b of two vectors: numpy's own takes ten times as long."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def turned(axis, angle):
    """The matrix (3, 3) that turns by `angle` about `axis`, of length 1."""
    across = skew(axis)
    return np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across


def vector(deck, key, default=(0.0, 0.0, 0.0)):
    """The vector (3,) of a key of a deck, SI."""
    return np.array(deck.numbers(key) or default)


def direction(deck, key):
    """The unit vector (3,) of a key of a deck; without it that of z."""
    along = vector(deck, key, (0.0, 0.0, 1.0))
    return along / np.linalg.norm(along)


def digits(values):
    """Numbers as LIGGGHTS reads them back to the last bit."""
    return " ".join(f"{value:.17g}" for value in values)


class Harmonics:
    """Sum of value[k] exp(i rate[k] t): value (K, ...) complex, rate (K,) [rad/s]; the sum is real."""

    def __init__(self, rate, value, least=0.0):
        """least: harmonics as small as this are nothing but rounding."""
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

    def __call__(self, t, order=0):
        """The derivative of this order at the time t."""
        wave = (1j * self.rate) ** order * np.exp(1j * self.rate * t)
        return np.tensordot(wave, self.value, 1).real

    def after(self, inner):
        """This matrix times another."""
        rate = (self.rate[:, None] + inner.rate).ravel()
        value = np.einsum("aij,bj...->abi...", self.value, inner.value)
        return Harmonics(rate, value.reshape(-1, *value.shape[2:]))


def _affine(turn, shift):
    """(4, 4) of a part of R and of d."""
    whole = np.zeros((4, 4), complex)
    whole[:3, :3], whole[:3, 3] = turn, shift
    return whole


@dataclasses.dataclass(frozen=True)
class Rotation:
    """About an axis through `centre`, by angle + speed t + sum of a sin(w t + phase) of the `swings` (a, w, phase)."""

    name: str
    centre: np.ndarray
    axis: np.ndarray
    speed: float = 0.0
    angle: float = 0.0
    swings: tuple = ()

    def fastest(self):
        """[rad/s] at most."""
        return abs(self.speed) + sum(abs(a * w) for a, w, _ in self.swings)

    def pose(self, t):
        """(R, d) at a time."""
        swung = sum(a * math.sin(w * t + phase) for a, w, phase in self.swings)
        turn = turned(self.axis, self.angle + self.speed * t + swung)
        return turn, self.centre - turn @ self.centre

    def field(self, t):
        """(w, u): a point at p moves with w x p + u in the carrier's frame."""
        rate = self.speed + sum(a * w * math.cos(w * t + phase) for a, w, phase in self.swings)
        spin = rate * self.axis
        return spin, -cross(spin, self.centre)

    def harmonics(self):
        """Of the matrix (4, 4)."""
        along = np.outer(self.axis, self.axis)
        half = (np.eye(3) - along - 1j * skew(self.axis)) / 2  # of exp(i angle); the rest is its conjugate
        wave = {self.speed: np.exp(1j * self.angle)}
        for a, w, phase in self.swings:
            # exp(i a sin x) = sum of J_n(a) exp(i n x)
            most, swung = math.ceil(abs(a)) + 16, collections.defaultdict(complex)
            for rate, value in wave.items():
                for n in range(-most, most + 1):
                    swung[rate + n * w] += value * jv(n, a) * np.exp(1j * n * phase)
            wave = swung
        rates = [0.0, *wave, *(-rate for rate in wave)]
        parts = [along, *(half * v for v in wave.values()), *(np.conj(half * v) for v in wave.values())]
        whole = [_affine(part, -part @ self.centre) for part in parts]
        whole[0] += _affine(np.zeros((3, 3)), self.centre)
        whole[0][3, 3] = 1
        return Harmonics(rates, whole)

    def seen(self, frame, origin):
        """The same in coordinates frame @ (p - origin)."""
        return dataclasses.replace(self, centre=frame @ (self.centre - origin), axis=frame @ self.axis)

    def lines(self, mesh, begin, step):
        """LIGGGHTS' commands for a mesh; `begin` [s]: the time at step 0."""
        axis = self.axis if self.swings or self.speed > 0 else -self.axis
        where = f"origin {digits(self.centre)} axis {digits(axis)}"
        if not self.swings:
            period = 2 * math.pi / abs(self.speed)
            return [f"fix move_{mesh} all move/mesh mesh {mesh} rotate {where} period {period:.17g}"]
        waves = [(a * w, w, phase) for a, w, phase in self.swings]
        return [  # the rate in the middle of the step that ends
            f"variable rate_{mesh} equal {formula(self.speed, waves, begin - step / 2, step)}",
            f"fix move_{mesh} all move/mesh mesh {mesh} rotate/variable {where} omega v_rate_{mesh}",
        ]

    def power(self, mesh):
        """The power [W] that the mesh gives to the balls, as a formula: f_mesh[4..6] is the torque on it."""
        torque = "+".join(f"({v:.17g})*f_{mesh}[{k}]" for k, v in enumerate(self.axis, start=4))
        rate = f"v_rate_{mesh}" if self.swings else f"({self.speed:.17g})"
        return f"-({torque})*{rate}"


@dataclasses.dataclass(frozen=True)
class Shift:
    """By the vectors `amount` (3,) times sin(w t + phase), phase (3,)."""

    name: str
    amount: np.ndarray
    w: float
    phase: np.ndarray
    centre = np.zeros(3)

    def fastest(self):
        """[m/s] at most."""
        return abs(self.w) * float(np.linalg.norm(self.amount))

    def pose(self, t):
        """(R, d) at a time."""
        return np.eye(3), self.amount @ np.sin(self.w * t + self.phase)

    def field(self, t):
        """As of Rotation."""
        return np.zeros(3), self.amount @ (self.w * np.cos(self.w * t + self.phase))

    def harmonics(self):
        """Of the matrix (4, 4)."""
        part = _affine(np.zeros((3, 3)), self.amount @ np.exp(1j * self.phase) / 2j)
        return Harmonics([0, self.w, -self.w], [np.eye(4), part, np.conj(part)])

    def seen(self, frame, origin):
        """As of Rotation."""
        return dataclasses.replace(self, amount=frame @ self.amount)

    def lines(self, mesh, begin, step):
        """As of Rotation."""
        said = []
        for name, row in zip("xyz", self.amount, strict=True):
            waves = [(a * self.w, self.w, phase) for a, phase in zip(row, self.phase, strict=True)]
            rate = formula(0.0, waves, begin - step / 2, step)
            said.append(f"variable {name}_{mesh} equal {rate}")
        along = " ".join(f"v_{name}_{mesh}" for name in "xyz")
        return [*said, f"fix move_{mesh} all move/mesh mesh {mesh} linear/variable {along}"]

    def power(self, mesh):
        """As of Rotation; f_mesh[1..3] is the force on it."""
        return "-" + "-".join(f"f_{mesh}[{k}]*v_{name}_{mesh}" for k, name in enumerate("xyz", 1))


def formula(constant, waves, begin, step):
    """constant + sum of a cos(w t + phase) of the waves (a, w, phase), as LIGGGHTS reads it; t is begin [s] at step 0."""
    words = [f"{constant:.17g}"]
    words += [f"({a:.17g})*cos({w:.17g}*step*{step:.17g}+({phase + w * begin:.17g}))" for a, w, phase in waves if a]
    return "+".join(words)


def motion(deck, name):
    """The motion of a section [motion.NAME], or "rotor"."""
    if name == "rotor":
        return Rotation(name, np.zeros(3), np.eye(3)[0], deck.rotor_speed, deck.number("rotor.angle", 0.0))
    section, kind = f"motion.{name}", deck.value(f"motion.{name}.kind")
    if kind not in ("turn", "swing", "shift"):
        raise UserError(
            f"{deck.path}: [{section}] kind: mill dem knows no {kind}: its acceleration between the rows is not LIGGGHTS'"
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
    """Motions one on the other, the innermost first; `name` of the innermost, "": nothing moves."""

    def __init__(self, deck, name):
        self.name, self.motions = name, []
        while name:
            self.motions.append(motion(deck, name))
            name = deck.value(f"motion.{name}.on", "")
        self.whole = Harmonics([0.0], [np.eye(4)])
        for one in self.motions:
            self.whole = one.harmonics().after(self.whole)
        rates = np.abs(self.whole.rate[self.whole.rate != 0])
        self.times = TIMES * (2 * math.pi / rates.min() if len(rates) else 1.0)

    def frames(self, t):
        """[(R, d)] from the innermost frame to the laboratory, then from the carrier of each motion, the innermost first."""
        found = [(np.eye(3), np.zeros(3))]
        for one in reversed(self.motions):
            (turn, place), (by, to) = found[-1], one.pose(t)
            found.append((turn @ by, turn @ to + place))
        return found[::-1]

    def pose(self, t):
        """(R, d) in the laboratory."""
        return self.frames(t)[0]

    def fields(self, t):
        """(w, u) of each motion by itself: a point at p in the laboratory moves with w x p + u. (M, 3) each."""
        found = []
        for one, (turn, place) in zip(self.motions, self.frames(t)[1:], strict=True):
            spin, drift = one.field(t)
            spin = turn @ spin
            found.append((spin, turn @ drift - cross(spin, place)))
        return np.array(found).transpose(1, 0, 2)

    def point(self, place):
        """The Harmonics (3,) of a point at `place` in the innermost frame."""
        return Harmonics(self.whole.rate, (self.whole.value @ [*place, 1.0])[:, :3], ROUNDING)

    def spin(self):
        """How what it carries turns, as the Rotation about the origin in the laboratory's directions; None: not at all. The
        directions at t = 0 are those of pose(0). UserError: not about one fixed axis."""
        axes, swings, speed = None, [], 0.0
        for k, one in enumerate(self.motions):
            if isinstance(one, Shift) or one.fastest() == 0:
                continue
            now = np.array([self.frames(t)[k + 1][0] @ one.axis for t in self.times])
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
