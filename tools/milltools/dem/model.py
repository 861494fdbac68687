"""The soft-sphere model of a deck: LIGGGHTS' `model hooke`, linear spring and dashpot.

Formulas: LIGGGHTS 3.8.0, gran_model_hooke (stiffness from Young's modulus and a characteristic speed); the damped
oscillator for contact duration and restitution (Schwager & Poeschel, Granular Matter 9 (2007) 465).
Restitution does not depend on speed: the contact ends with the overlap, attraction is allowed (`limitForce off`).
"""

import dataclasses
import math

import numpy as np

from milltools.dem.setup import setup_of

POISSON = 0.3  # of all bodies; only E / (2 (1 - nu^2)) has an effect
STEEL = 2.1e11  # [Pa]
STEPS_PER_CONTACT = 40  # restitution is then correct to 0.1 % (20: 0.2 %, 10: 0.4 %)
STEPS_PER_SAMPLE = 5  # eight samples of every contact: no complete contact is missed
STUCK = 0.03  # tangential restitutions closer than this count as equal


@dataclasses.dataclass(frozen=True)
class Spring:
    """A contact of two bodies: reduced mass [kg], stiffness [N/m], damping [kg/s]."""

    mass: float
    stiffness: float
    damping: float

    @property
    def decay(self):
        """[1/s] rate at which the oscillation decays."""
        return self.damping / (2 * self.mass)

    @property
    def frequency(self):
        """[rad/s] of the damped oscillation."""
        return math.sqrt(self.stiffness / self.mass - self.decay**2)

    @property
    def duration(self):
        """[s] from touching to parting."""
        return math.pi / self.frequency


def spring(modulus, speed, restitution, mass, radius):
    """The Spring of reduced mass [kg] and radius [m] at a Young's modulus [Pa], a characteristic speed [m/s] and a
    normal restitution."""
    root, stiff = math.sqrt(radius), modulus / (2 * (1 - POISSON**2))
    stiffness = 16 / 15 * root * stiff * (15 * mass * speed**2 / (16 * root * stiff)) ** 0.2
    damping = 0.0
    if restitution < 1:
        damping = math.sqrt(4 * mass * stiffness / (1 + (math.pi / math.log(restitution)) ** 2))
    return Spring(mass, stiffness, damping)


def sticking_restitution(restitution):
    """Tangential restitution beta0 of a contact that sticks, with kt = 2/7 kn and tangential damping on.

    Solid spheres: the reduced mass along the surface is 2/7 m, so both springs have one frequency, and the
    tangential one is damped 7/2 times as much.
    """
    if restitution == 1:
        return 1.0
    log = -math.log(restitution)
    zeta = log / math.hypot(math.pi, log)
    time = math.pi / math.sqrt(1 - zeta**2)  # in units of the undamped frequency
    zeta_t = 3.5 * zeta
    root = complex(1 - zeta_t**2) ** 0.5  # imaginary if the tangential motion is overdamped
    sine = (np.sin(root * time) / root).real if root else time
    return float(-math.exp(-zeta_t * time) * (np.cos(root * time).real - zeta_t * sine))


class Model:
    """All springs of a deck at one stiffness.

    pair[a][b], wall[kind][a]: Spring of balls of species a and b, of a ball of species a on a surface;
    time_step, sample_interval [s]: the interval is STEPS_PER_SAMPLE steps and divides the interval of the series.
    """

    def __init__(self, deck, modulus):
        self.modulus, self.kinds = modulus, deck.kinds
        # [m/s] the impact speed at which the linear spring is as stiff as a Hertzian contact: the speed of the fastest
        # surface, such as the blades' tips; the stiffness depends on it with the power 0.4
        self.speed = setup_of(deck).speed
        bodies = [(kind.mass, kind.diameter / 2) for kind in deck.species]

        def springs(kind, others):
            e = deck.contact(kind).restitution
            return [spring(modulus, self.speed, e, mass, radius) for mass, radius in others]

        def reduced(a, b):
            return [x * y / (x + y) for x, y in zip(a, b, strict=True)]

        self.pair = [springs("ball_ball", [reduced(a, b) for b in bodies]) for a in bodies]
        self.wall = {kind: springs(kind, bodies) for kind in self.kinds[1:]}
        self.shortest = min(s.duration for row in (*self.pair, *self.wall.values()) for s in row)
        series = deck.number("output.series")
        self.samples_per_row = math.ceil(series / (STEPS_PER_SAMPLE * self.shortest / STEPS_PER_CONTACT))
        self.sample_interval = series / self.samples_per_row
        self.time_step = self.sample_interval / STEPS_PER_SAMPLE

    def springs(self):
        """Stiffness and damping (K, S, S, 2) of all kinds of contact; of two balls, or of a surface and the second."""
        size = len(self.pair)
        rows = [self.pair, *([wall] * size for wall in self.wall.values())]
        return np.array([[[(s.stiffness, s.damping) for s in row] for row in kind] for kind in rows])


def tangential_damping(deck):
    """Whether tangential damping in LIGGGHTS is closer to the deck, and {kind: (wanted, got)} of the
    tangential restitutions that LIGGGHTS cannot give. Without friction nothing sticks, and the dictionary is empty."""
    missed = {True: {}, False: {}}
    for kind in deck.kinds:
        law = deck.contact(kind)
        for damped, got in ((True, sticking_restitution(law.restitution)), (False, 1.0)):
            if law.friction > 0 and abs(got - law.tangential_restitution) > STUCK:
                missed[damped][kind] = law.tangential_restitution, got
    off = {damped: sum(abs(a - b) for a, b in pairs.values()) for damped, pairs in missed.items()}
    nearer = off[True] <= off[False]
    return nearer, missed[nearer]
