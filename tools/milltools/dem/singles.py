"""Single impacts in LIGGGHTS: the restitution and friction that its contacts really have.

The spring-dashpot model of LIGGGHTS with a Coulomb limit differs from a hard-sphere law: the limit applies to the
tangential spring but not to the dashpot, and contacts end at a time step. So isolated balls are thrown at each other
and at a wall under a set of angles, with the stiffness and time step of the run. Walton's law is fitted to the results.
"""

import dataclasses
import math
import pathlib
import tempfile

import numpy as np

from milltools.dem import script
from milltools.dem.liggghts import Liggghts, states
from milltools.dem.meshes import Wall
from milltools.dem.model import STEPS_PER_SAMPLE
from milltools.dem.setup import setup_of

ANGLES = np.concatenate([np.linspace(0.1, 0.6, 6), np.linspace(0.8, 2.4, 9), np.linspace(2.8, 4.4, 5)])  # slip / v_n
PHASES = 4  # for each angle, contacts begin at this number of different fractions of a time step
SPEED = 0.02  # [m/s] normal speed of all impacts: slow, so that the normal hardly turns during the contact
GAP = 0.004  # of the diameter, before the impact


@dataclasses.dataclass(frozen=True)
class Singles:
    """One kind of contact: the law of the deck, the law measured in LIGGGHTS (means over impacts), and the impacts.

    ratio (A,): slip over normal speed before; after (A,): slip after over normal speed before; negative: reversed.
    """

    restitution: float
    friction: float  # NaN: the deck has none
    tangential_restitution: float  # NaN likewise
    spread: float  # standard deviation of the restitution over impacts
    ratio: np.ndarray
    after: np.ndarray


def _thrown(deck, kind):
    """State [place, velocity, spin] of all balls: first the thrown balls (A,), then their targets if these are balls;
    and half of the size (3,) [m] of the box around them."""
    diameter, pairs = deck.species[0].diameter, kind == "ball_ball"
    ratio = np.repeat(ANGLES, PHASES)
    count = len(ratio)
    side, spacing = math.ceil(math.sqrt(count)), 6 * diameter
    grid = np.array([(k % side, k // side) for k in range(count)]) * spacing - side * spacing / 2
    gap = GAP * diameter * (1 + np.arange(count) / (7.1 * count))
    height = 3 * diameter if pairs else 0.0
    place = np.column_stack([grid, height + (diameter if pairs else diameter / 2) + gap])
    # the slip should be along x at the contact: start so far back that the ball hits the grid's place
    place[:, 0] -= ratio * gap
    velocity = np.column_stack([ratio * SPEED, 0 * ratio, np.full(count, -SPEED)])
    if pairs:
        place = np.vstack([place, np.column_stack([grid, np.full(count, height)])])
        velocity = np.vstack([velocity, np.zeros((count, 3))])
    size = side * spacing + 4 * diameter
    return [place, velocity, np.zeros_like(place)], (size, size, 12 * diameter)


def throw(deck, model, damped, kind):
    """Throws balls of the deck's first species at each other (ball_ball) or at a plane with the contact law of
    `kind`."""
    state, half = _thrown(deck, kind)
    count = len(state[0])
    contact = model.pair[0][0] if kind == "ball_ball" else model.wall[kind][0]
    flight = 1.2 * GAP * deck.species[0].diameter / SPEED
    steps = STEPS_PER_SAMPLE * math.ceil((flight + 1.5 * contact.duration) / model.sample_interval)
    floor = [] if kind == "ball_ball" else [Wall(deck.kinds.index(kind), [("floor", "zplane 0", "", None)])]
    text = script.fill(deck, model, damped, steps, steps, steps, floor)
    with tempfile.TemporaryDirectory(prefix="mill-dem-", ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name)
        (folder / "balls.data").write_text(script.data_file(deck, np.zeros(count, int), state, half))
        with Liggghts(folder, text, count) as process:
            for _, last in process.samples(steps):  # noqa: B007
                pass
            process.finish()
    return _measure(deck, kind, state, states(last))


def _measure(deck, kind, before, after):
    radius, count = deck.species[0].diameter / 2, len(ANGLES) * PHASES
    normal = np.tile([0.0, 0.0, 1.0], (count, 1))
    tangent = np.cross([0.0, 1.0, 0.0], normal)

    def along(velocity, spin):
        """Closing speed (A,) and slip (A,) along the direction of throw."""
        relative, turning = velocity[:count].copy(), spin[:count] * radius
        if kind == "ball_ball":
            relative -= velocity[count:]
            turning = turning + spin[count:] * radius
        surface = relative - np.cross(turning, normal)
        return -np.einsum("ij,ij->i", relative, normal), np.einsum("ij,ij->i", surface, tangent)

    (speed, slip), (speed_after, slip_after) = along(*before[1:]), along(*after[1:])
    e = -speed_after / speed
    ratio, left = slip / speed, slip_after / speed
    law = deck.contact(kind)
    friction = tangential = math.nan
    if law.friction > 0:
        # sliding throughout: the slip decreases by a constant; sticking: it is multiplied by a constant
        sliding = ratio > 1.25 * 3.5 * law.friction * (1 + e.mean()) / (1 + 0.4)
        sticking = ratio < 0.5 * 3.5 * law.friction * (1 + e.mean()) / 2
        if sliding.any():
            friction = float(np.mean((ratio - left)[sliding] / (3.5 * (1 + e[sliding]))))
        if sticking.any():
            tangential = float(np.mean(-left[sticking] / ratio[sticking]))
    return Singles(float(e.mean()), friction, tangential, float(e.std()), ratio, left)


def measure(deck, model, damped):
    """{kind: Singles} of every kind of contact that the deck's mill can have; walls with equal laws share one test."""
    walls = {deck.kinds[wall.kind] for wall in setup_of(deck).walls}
    laws = {
        kind: (deck.contact(kind), kind == "ball_ball") for kind in deck.kinds if kind == "ball_ball" or kind in walls
    }
    first = {law: kind for kind, law in reversed(laws.items())}
    thrown = {law: throw(deck, model, damped, kind) for law, kind in first.items()}
    return {kind: thrown[law] for kind, law in laws.items()}
