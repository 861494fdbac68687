"""The path of the outermost ball that a lifter throws, as the trade computes it: a ball that no other one touches slips
along the face of the lifter, leaves it at its tip, and flies to the wall (M. Powell, Int. J. Miner. Process. 31 (1991)
163; docs/tumbling.md)."""

import dataclasses
import math

import numpy as np

STEP = 1e-3  # of a turn: time step on the face
POINTS = 60  # of the path in the air


@dataclasses.dataclass(frozen=True)
class Throw:
    """Angles [rad] from 3 o'clock, where the mill turns anticlockwise: the ball begins to slip, leaves the lifter,
    lands. Its speeds [m/s] when it leaves and when it lands; `head` [m]: its highest place above the axis; `path`
    (N, 2) [m] of its centre from the slip on, to the side where the wall rises, and up."""

    slips: float
    leaves: float
    speed: float
    head: float
    lands: float
    landing_speed: float
    path: np.ndarray


def throw(
    radius: float, speed: float, diameter: float, height: float = 0.0, face: float = 0.0, friction: float = 0.3,
    gravity: float = 9.81,
) -> Throw | None:  # fmt: skip
    """For a mill of a radius [m] inside its liner that turns at `speed` [rad/s], a ball of a diameter [m], and lifters
    of a height [m], whose faces are inclined to the radius by the angle `face` [rad]. Without lifters (height 0) the
    ball leaves where it no longer presses on the wall (Davis). None if it is carried around."""
    if height <= 0:
        face = friction = 0.0
    foot, along = radius - diameter / 2, np.array([-math.cos(face), -math.sin(face)])
    lean, out = math.atan(friction) - face, np.array([along[1], -along[0]])
    steep = speed**2 * foot / gravity * math.cos(lean)
    if steep >= 1:
        return None
    slips = lean + math.asin(steep)

    def course(state):
        """Rates of the way along the face, the speed on it and the mill's angle; the pressure on the face."""
        way, rate, angle = state
        pull = speed**2 * (np.array([foot, 0.0]) + way * along)
        pull -= gravity * np.array([math.sin(angle), math.cos(angle)])
        pressure = -pull @ out - 2 * speed * rate
        return np.array([rate, pull @ along - friction * max(pressure, 0.0), speed]), pressure

    state, step, path, tip = np.array([0.0, 0.0, slips]), STEP * math.tau / speed, [], radius - height
    # along the face until the centre is as far inside as its tip, or until nothing presses on it any more
    while height > diameter / 2 and len(path) < 1 / STEP:
        path.append(_turned(np.array([foot, 0.0]) + state[0] * along, state[2]))
        first, pressure = course(state)
        change = step * course(state + step / 2 * first)[0]
        here, there = (math.hypot(*(np.array([foot, 0.0]) + way * along)) for way in (state[0], state[0] + change[0]))
        state = state + change * (min(1.0, (here - tip) / (here - there)) if here > there else 1.0)
        if there <= tip or pressure < 0:
            break
    place = _turned(np.array([foot, 0.0]) + state[0] * along, state[2])
    velocity = _turned(state[1] * along, state[2]) + speed * np.array([-place[1], place[0]])
    fall, energy = np.array([0.0, -gravity]), velocity @ velocity
    # |place + velocity t + fall t^2 / 2| = foot; the root 0 of a ball at the wall is left out
    square = [gravity**2 / 4, velocity @ fall, energy + place @ fall, 2 * place @ velocity, place @ place - foot**2]
    roots = np.roots(square)
    times = roots[np.abs(roots.imag) < 1e-6 * np.abs(roots)].real
    flight = min(times[times > 1e-3 * math.sqrt(energy) / gravity], default=math.nan)
    t = np.linspace(0, flight, POINTS)[:, None]
    arc = place + velocity * t + fall / 2 * t**2
    head = place[1] + max(velocity[1], 0.0) ** 2 / (2 * gravity)
    leaves, lands = (math.atan2(y, x) % math.tau for x, y in (place, arc[-1]))
    ends = [math.sqrt(energy), head, lands, math.hypot(*(velocity + fall * flight))]
    return Throw(slips, leaves, *ends, np.array([*path, *arc]))


def _turned(point, angle):
    """A point of the turning mill in the laboratory."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([c * point[0] - s * point[1], s * point[0] + c * point[1]])
