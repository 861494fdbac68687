"""Mills of bodies for the tests of `mill dem`: decks in SI, and single balls followed in LIGGGHTS without millsim."""

import pathlib
import tempfile

import h5py
import numpy as np
from foreign import RUN

from milltools.dem.soft_mill import SoftMill
from milltools.foreign.digest import Digest
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
    deck.given = HEAD + text, [f"{name.replace('__', '.')}={value}" for name, value in changes.items()]
    return deck


def laboratory(frame, time, place, velocity, spin):
    """The state (N, 3) in the laboratory of balls in a Frame."""
    return place @ frame.rows + frame.track(time), velocity @ frame.rows + frame.track(time, 1), spin @ frame.rows


class Recorder(Digest):
    """A Digest that keeps its accounts, and the velocities at them; `told`: columns of all impacts, at the end."""

    def __init__(self, *arguments):
        super().__init__(*arguments, apart=1.0, springs=True)
        self.rows, self.velocities, self.told = [], [], {}

    def ask(self):
        answer = super().ask()
        self.velocity = answer.state[1].copy()
        return answer

    def account(self, time, values):
        super().account(time, values)
        self.rows.append({"time": time, **values})
        self.velocities.append(self.velocity)

    def column(self, name):
        """Of the accounts."""
        return np.array([row[name] for row in self.rows])

    def kinetic(self, mass):
        """Kinetic energy [J] of the balls at the accounts."""
        return np.array([0.5 * mass @ np.einsum("ij,ij->i", v, v) for v in self.velocities])

    def all(self, name):
        """Of all impacts."""
        return self.told[name]


def follow(deck, place, velocity, until, modulus=1e9, spin=None, watch=None):
    """Runs balls from places and velocities in the laboratory (N, 3); the SoftMill at the end, and the Recorder."""
    place, velocity = np.atleast_2d(place).astype(float), np.atleast_2d(velocity).astype(float)
    spin = np.zeros_like(place) if spin is None else np.atleast_2d(spin).astype(float)
    text, changes = deck.given
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "deck.ini"
        path.write_text(text)
        deck = Deck.check(path, [*changes, f"run.time={until!r} s", "output.impacts=all"])
        with Recorder(deck, path.with_name("out.h5")) as seen:
            seen.facts(RUN)
            mill = SoftMill(deck, None, True, seen, watch=watch)
            mill.state = mill.setup.frame.from_laboratory(0.0, place, velocity, spin)
            mill.run(modulus, until)
            seen.end("complete", until)
        with h5py.File(path.with_name("out.h5")) as file:
            log = file["impacts"]
            seen.told = {name: log[name][:] for name in ("time", "normal_speed", "tangential_speed")}
            seen.kinds = [str(log.attrs["kinds"][kind]) for kind in log["kind"][:]]
    return mill, seen
