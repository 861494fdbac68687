"""Mills of bodies for the tests of `mill dem`: decks in SI, and single balls followed in LIGGGHTS without millsim."""

import numpy as np

from milltools.dem.soft_mill import SoftMill
from milltools.read.deck import Deck

HEAD = """\
[run]
time = 0.1 s
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 1
diameter = 0.01 m
density = 7800 kg/m^3
[contact]
restitution = 0.8
friction = 0
tangential_restitution = 0
[output]
frames = 0 s
series = 0.001 s
"""
JAR = """\
[body.jar]
shape = cylinder
side = inside
motion = jar
centre = 0.07 0 0 m
radius = 0.02 m
length = 0.04 m
"""
BOX = """\
[body.box]
shape = box
side = inside
size = 0.04 0.05 0.06 m
"""


def deck_of(text, **changes):
    """The Deck of a text in SI with HEAD before it, as if millsim had printed it; changes: section__key="value" """
    lines = [line if "=" not in line else f"{line}  # given" for line in (HEAD + text).splitlines()]
    deck = Deck("\n".join(lines), "deck.ini")
    for name, value in changes.items():
        section, _, key = name.rpartition("__")
        deck.sections.setdefault(section.replace("__", "."), {})[key] = value
    return deck


class Recorder:
    """In the place of milltools.foreign.digest.Digest: keeps all that it is given."""

    def __init__(self):
        self.rows, self.told, self.states = [], [], []

    def account(self, time, values):
        self.rows.append({"time": time, **values})

    def impacts(self, rows):
        self.told.append(rows)

    def state(self, time, *state):
        self.states.append((time, *(values.copy() for values in state)))

    def column(self, name):
        """Of the accounts."""
        return np.array([row[name] for row in self.rows])

    def kinetic(self, mass):
        """Kinetic energy [J] of the balls at the accounts."""
        velocity = {time: velocity for time, _, velocity, _ in self.states}
        times = np.array(list(velocity))
        at = [velocity[times[np.argmin(np.abs(times - row["time"]))]] for row in self.rows]
        return np.array([0.5 * mass @ np.einsum("ij,ij->i", v, v) for v in at])

    def all(self, name):
        """Of all impacts."""
        return np.concatenate([part[name] for part in self.told]) if self.told else np.empty(0)


def follow(deck, place, velocity, until, modulus=1e9, spin=None):
    """Runs balls from places and velocities in the laboratory (N, 3); the SoftMill at the end, and the Recorder."""
    place, velocity = np.atleast_2d(place).astype(float), np.atleast_2d(velocity).astype(float)
    spin = np.zeros_like(place) if spin is None else np.atleast_2d(spin).astype(float)
    seen = Recorder()
    mill = SoftMill(deck, None, True, seen)
    mill.state = mill.setup.frame.from_laboratory(0.0, place, velocity, spin)
    mill.run(modulus, until)
    mill.flush()
    return mill, seen
