"""The state of all balls at any time, computed from the stored frames of a run.

Between two impacts a ball flies on a parabola. Two neighbouring frames give two parabolas: forward from the earlier
frame and backward from the later one. If the two agree, the ball had no contact in between. If they cross in one point,
it had one contact there; its time has an exact solution, because gravity cancels in the difference of the parabolas. In
both cases the flight is known. After more than one contact it is not: then a cubic curve joins the two states, and the
ball is counted as unknown.
"""

import dataclasses
import functools

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import contour

HALF_ULP = 2.0**-24  # states are stored in single precision
SLACK = 4.0  # tolerance of comparisons, in bounds of the rounding errors
INSIDE = 1e-6  # a contact can be beyond the wall by this share of the drum's radius
SAME_TIME = 1e-9  # [s] times closer than this count as equal


@dataclasses.dataclass(frozen=True)
class State:
    """All balls at a `time` [s]: position [m], velocity [m/s], angular_velocity [rad/s], each (N, 3) float64; for some
    pictures a further `value` of each ball (N,), and `flashes` of impacts (n, 4): place and radius [m]; `poses` of the
    motions, as from Run.poses; `relieved` (N,) bool: balls that pictures leave out, because they may be inside a
    body."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    value: np.ndarray | None = None
    flashes: np.ndarray | None = None
    poses: dict | None = None
    relieved: np.ndarray | None = None
    twist: np.ndarray | None = None  # as from Run.twist

    @property
    def speed(self) -> np.ndarray:
        """Speeds [m/s] (N,) in the frame in which the charge is steady."""
        v = (
            self.velocity
            if self.twist is None
            else self.velocity - self.twist[0] - np.cross(self.twist[1], self.position)
        )
        return np.linalg.norm(v, axis=1)


def stored(run, index) -> State:
    """A stored frame of a run."""
    time = run.frame_time(index)
    names = ("position", "velocity", "angular_velocity")
    values = [run.frame(index, name).astype(np.float64) for name in names]
    return State(time, *values, poses=run.poses(index), relieved=run.relieved(time), twist=run.twist(index))


def between(a, b, share) -> np.ndarray:
    """The pose (3, 4) at a share 0..1 of the way from pose a to pose b, along the smaller rotation."""
    turn = b[:, :3] @ a[:, :3].T
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = np.linalg.norm(axis)
    if sine < 1e-9:  # no rotation, or half a turn: then the axis is a column of turn + 1
        both = turn + np.eye(3)
        axis = both[:, np.argmax(np.diag(both))]
    angle = share * np.arctan2(sine, np.trace(turn) - 1)
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    part = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return np.column_stack([part @ a[:, :3], (1 - share) * a[:, 3] + share * b[:, 3]])


def _length(vectors):
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


class Bounds:
    """The limits of a flight: inside a drum that stands still, and outside the shaft. From the deck alone."""

    def __init__(self, run):
        self.still = not run.vessel and not run.text("drum/motion", "")
        if self.still:
            self.wall = contour.of(run.as_deck)
            self.half = np.inf if run.slice_length else run.quantity("drum/length") / 2
        self.shaft = run.quantity("rotor/shaft_radius") if run.has_rotor else 0.0
        self.gravity = run.vector("gravity/acceleration")[:3]
        self.radius = run.balls("diameter") / 2
        self.slice_length = run.slice_length

    def outside(self, balls, position):
        """Which of the `balls` (indices) would overlap a wall or the shaft at these positions; (n,) bool."""
        if not self.still:
            return np.zeros(len(position), bool)
        radius, least = self.radius[balls], -INSIDE * self.wall.outermost
        x, y, z = position.T
        gap = np.minimum(self.wall.gap(position[:, 1:]), self.half - np.abs(x)) - radius
        if self.shaft > 0:
            gap = np.minimum(gap, np.hypot(y, z) - self.shaft - radius)
        return gap < least


class Flights:
    """The flights of all balls between two states `a` and `b`.

    `contact` (N,): the time of a ball's contact in seconds after `a`, infinite if it has none. `unknown` (N,) bool: the
    flight is not known because of more than one contact."""

    def __init__(self, a: State, b: State, mill: Bounds):
        self.step = h = b.time - a.time
        if not h > 0:
            raise UserError(f"the frames at {a.time:.9g} s and {b.time:.9g} s are not in the order of time")
        if mill.slice_length:  # balls that left at one periodic end are where they would be beyond it
            onwards = a.position + (a.velocity + b.velocity) * (h / 2)
            turns = np.rint((onwards - b.position)[:, :1] / mill.slice_length)
            b = dataclasses.replace(b, position=b.position + turns * [mill.slice_length, 0, 0])
        self.a, self.b, self.mill = a, b, mill
        g = mill.gravity
        # forward minus backward parabola, `s` seconds after a: offset + rate s
        offset = a.position - b.position + b.velocity * h - g * h**2 / 2
        rate = a.velocity + g * h - b.velocity
        # how much the two can differ [m] and [m/s] because the states are rounded
        speed = HALF_ULP * (_length(a.velocity) + _length(b.velocity))
        place = SLACK * (HALF_ULP * (_length(a.position) + _length(b.position)) + speed * h) + 1e-12
        speed = SLACK * speed + 1e-9
        agree = (_length(offset) <= place) & (_length(rate) <= speed)
        with np.errstate(divide="ignore", invalid="ignore"):
            square = np.einsum("ij,ij->i", rate, rate)
            at = -np.einsum("ij,ij->i", offset, rate) / square
            early = place / np.sqrt(square)  # uncertainty of this time
            crosses = (at >= -early) & (at <= h + early) & (_length(rate) > speed)
            crosses &= _length(offset + rate * at[:, None]) <= place
        once = ~agree & crosses
        self.contact = np.where(once, np.clip(at, 0, h), np.inf)
        # after two impacts along one line the parabolas also cross in a point, but behind the wall: not one contact
        balls = np.flatnonzero(once)
        at = self.contact[balls]
        wrong = mill.outside(balls, self._parabola(b, balls, (at + h) / 2 - h)[0])
        for share in (0.5, 1.0):
            wrong |= mill.outside(balls, self._parabola(a, balls, share * at)[0])
        self.contact[balls[wrong]] = np.inf
        self.unknown = ~agree & ~np.isfinite(self.contact)

    def _parabola(self, state, balls, s):
        """Position and velocity of balls, `s` seconds after one of the two states."""
        s, velocity, g = np.reshape(s, (-1, 1)), state.velocity[balls], self.mill.gravity
        return state.position[balls] + velocity * s + g * s**2 / 2, velocity + g * s

    def _cubic(self, balls, s):
        """Position and velocity on the cubic through both states."""
        a, b, h = self.a, self.b, self.step
        u = s / h
        x, y = a.position[balls], b.position[balls]
        v, w = a.velocity[balls] * h, b.velocity[balls] * h
        place = x + u * v + u**2 * (3 * (y - x) - 2 * v - w) + u**3 * (2 * (x - y) + v + w)
        slope = v + 2 * u * (3 * (y - x) - 2 * v - w) + 3 * u**2 * (2 * (x - y) + v + w)
        return place, slope / h

    def at(self, time) -> State:
        """The state at a time between the two; at the time of its contact a ball has its velocity before it."""
        s = time - self.a.time
        position, velocity = self._parabola(self.a, slice(None), s)
        spin = self.a.angular_velocity.copy()
        late = np.flatnonzero((s > self.contact) & ~self.unknown)
        position[late], velocity[late] = self._parabola(self.b, late, s - self.step)
        spin[late] = self.b.angular_velocity[late]
        open_ = np.flatnonzero(self.unknown)
        position[open_], velocity[open_] = self._cubic(open_, s)
        share = s / self.step
        spin[open_] = (1 - share) * self.a.angular_velocity[open_] + share * self.b.angular_velocity[open_]
        if self.mill.slice_length:
            position[:, 0] -= self.mill.slice_length * np.rint(position[:, 0] / self.mill.slice_length)
        poses = {name: between(pose, self.b.poses[name], share) for name, pose in (self.a.poses or {}).items()}
        twist = None if self.a.twist is None else (1 - share) * self.a.twist + share * self.b.twist
        return State(float(time), position, velocity, spin, poses=poses, twist=twist)


class Trajectory:
    """The state of an open Run at any time; fastest in the order of time, because only one pair of frames is cached.

    `asked` counts the states of single balls computed between frames, `unknown` those of them that are only an
    estimate."""

    def __init__(self, run):
        self.run = run
        self.times = run.frame_times()
        if not len(self.times):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s)")
        self.begin, self.end = float(self.times[0]), float(self.times[-1])
        self.frame = functools.lru_cache(2)(functools.partial(stored, run))  # index -> State
        self.flights = functools.lru_cache(1)(self._flights)
        self.asked = self.unknown = 0

    def frame_at(self, time) -> int | None:
        """Index of the frame stored at a time; None if there is none."""
        nearest = int(np.argmin(np.abs(self.times - time)))
        return nearest if abs(self.times[nearest] - time) <= SAME_TIME else None

    @functools.cached_property
    def _mill(self):
        return Bounds(self.run)

    def _flights(self, index) -> Flights:
        """The flights between frame `index` and the next."""
        return Flights(self.frame(index), self.frame(index + 1), self._mill)

    def at(self, time) -> State:
        """The state at a time [s] from the first to the last frame; UserError for other times."""
        index = self.frame_at(time)
        if index is not None:
            return dataclasses.replace(self.frame(index), time=float(time))
        if not self.begin < time < self.end:
            raise UserError(
                f"{self.run.path}: {time:.6g} s: ball states are stored from {self.begin:.6g} s to {self.end:.6g} s"
            )
        flights = self.flights(int(np.searchsorted(self.times, time)) - 1)
        self.asked += len(flights.unknown)
        self.unknown += int(flights.unknown.sum())
        state = flights.at(time)
        return dataclasses.replace(
            state, poses=state.poses | self.run.rotor_pose(time), relieved=self.run.relieved(time)
        )
