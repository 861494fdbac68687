"""Decks and independent answers for the tests of `mill dem`: contacts by brute force, springs integrated; and what
millsim sees in samples."""

import contextlib
import math

import h5py
import numpy as np
from conftest import SMALL
from foreign import RUN
from scipy.integrate import solve_ivp

from milltools.foreign.digest import Digest
from milltools.read.kinds import KINDS

BLADES = """
[blade.broad]
position = -8 mm
angle = 40 deg
tip_radius = 18 mm
width = 12 mm
thickness = 3 mm
pitch = 70 deg
[blade.back]
position = 12 mm
angle = 200 deg
tip_radius = 21 mm
width = 5 mm
thickness = 5 mm
pitch = -25 deg
"""
SECOND_KIND = """
[balls.large]
count = 60
diameter = 5 mm
density = 7800 kg/m^3
[balls.small]
count = 60
diameter = 3 mm
density = 3000 kg/m^3
"""
MIXTURE = SMALL.replace(SMALL[SMALL.index("[balls]") : SMALL.index("[drum]")], SECOND_KIND[1:])


def flown(contact, speed, times):
    """(overlap, closing speed) of a Spring's contact at `times` since it began with `speed`, integrated."""

    def rate(_, state):
        return [
            state[1],
            -(contact.stiffness * state[0] + contact.damping * state[1]) / contact.mass,
        ]

    done = solve_ivp(rate, (0, times[-1]), [0.0, speed], t_eval=times, rtol=1e-11, atol=1e-18)
    return done.y


def turned(blade, angle):
    """Matrix (3, 3) whose columns are the axes of a blade's box: width, radial, thickness."""
    c, s, cp, sp = math.cos(angle), math.sin(angle), math.cos(blade.pitch), math.sin(blade.pitch)
    about_axis = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    about_radius = np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])  # +x edge towards larger angles
    return about_axis @ about_radius


def box_distance(blade, angle, points):
    """Distance of points (M, 3) outside a blade's box, which begins on the axis; 0 inside."""
    local = (points - [blade.position, 0, 0]) @ turned(blade, angle)
    low = np.array([-blade.width / 2, 0, -blade.thickness / 2])
    high = np.array([blade.width / 2, blade.tip_radius, blade.thickness / 2])
    return np.linalg.norm(local - np.clip(local, low, high), axis=1)


def brute(deck, place, time):
    """{kind: {(ball, partner): overlap}} by looking at everything."""
    radius = np.array([kind.diameter / 2 for kind in deck.species])[deck.species_of_ball]
    found = {kind: {} for kind in KINDS}
    overlap = radius[:, None] + radius - np.linalg.norm(place[:, None] - place, axis=2)
    for i, j in np.argwhere(np.triu(overlap > 0, 1)).tolist():
        found["ball_ball"][i, j] = overlap[i, j]
    rho, half = np.hypot(place[:, 1], place[:, 2]), deck.number("drum.length") / 2
    surfaces = [("ball_drum", -1, rho + radius - deck.number("drum.radius"))]
    surfaces += [("ball_wall", k, s * place[:, 0] + radius - half) for k, s in enumerate((-1, 1))]
    surfaces += [("ball_shaft", -1, deck.shaft_radius + radius - rho)]
    for k, blade in enumerate(deck.blades):
        distance = box_distance(blade, blade.angle + deck.rotor_speed * time, place)
        surfaces.append(("ball_blade", k, np.where(distance > 0, radius - distance, np.nan)))
    for kind, partner, overlap in surfaces:
        found[kind].update({(int(i), partner): overlap[i] for i in np.nonzero(overlap > 0)[0]})
    return found


class Watched(contextlib.AbstractContextManager):
    """Hands samples in the laboratory to `millsim --digest`, in the springs of a Model; `seen`: what it then answers;
    ended(): the impacts in its file, a dictionary of columns. The deck must log all impacts."""

    def __init__(self, deck, model, file):
        self.deck, self.file, self.rng = deck, file, np.random.default_rng(9)
        self.digest = Digest(deck, file, apart=1e3, springs=True, force=True)
        self.digest.facts(RUN)
        self.digest.springs(model.sample_interval, True, model.springs())
        self.frame = np.concatenate([np.zeros(6), np.eye(3).ravel()])
        self.told = False

    def __exit__(self, *_):
        self.digest.close()

    def sample(self, time, place, velocity, spin=None):
        spin = np.zeros_like(place) if spin is None else spin
        rows = np.column_stack([1.0 + np.arange(len(place)), place, velocity, spin])
        self.digest.sample(time, not self.told, self.frame, self.rng.permutation(rows))
        if not self.told:
            self.digest.account(0.0, {})
        self.told = True

    @property
    def seen(self):
        return self.digest.ask()

    def ended(self):
        self.digest.account(self.deck.number("run.time"), {})
        self.digest.end("complete", self.deck.number("run.time"))
        with h5py.File(self.file) as file:
            log = file["impacts"]
            columns = {name: log[name][:] for name in log if name != "species"}
            kinds = [self.deck.kinds.index(str(kind)) for kind in log.attrs["kinds"]]
        return columns | {"kind": np.array(kinds)[columns["kind"]]}
