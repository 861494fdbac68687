"""The deck as millsim understands it: read, checked and filled in by `millsim --check`, in SI units.

Python never reads units or defaults itself: there is one reader of decks, and it is in the engine.
"""

import configparser
import dataclasses
import os
import pathlib
import subprocess

import numpy as np

from milltools.errors import UserError

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")


def program():
    """Path of the engine: $MILLSIM, or the one built in this checkout."""
    path = pathlib.Path(os.environ.get("MILLSIM", pathlib.Path(__file__).resolve().parents[2] / "millsim"))
    if not path.exists():
        raise UserError(f"{path} is not built: run make first", 1)
    return path


@dataclasses.dataclass(frozen=True)
class Species:
    """One kind of ball; lengths in m, density in kg/m^3."""

    name: str
    count: int
    diameter: float
    density: float


@dataclasses.dataclass(frozen=True)
class Blade:
    """One blade: centred at x = position, reaching from the axis to tip_radius; m and rad, angle at t = 0
    in the world's frame (the rotor's own angle is in it)."""

    position: float
    angle: float
    tip_radius: float
    width: float
    thickness: float
    pitch: float


@dataclasses.dataclass(frozen=True)
class Contact:
    """What one kind of contact is made of."""

    restitution: float
    friction: float
    tangential_restitution: float


class Deck:
    """A deck in SI. `text` is the full deck as `millsim --check` prints it, `sections` its entries as texts."""

    def __init__(self, text, path=None, overrides=()):
        self.text, self.path, self.overrides = text, path, tuple(overrides)
        parser = configparser.ConfigParser(
            delimiters="=", inline_comment_prefixes=("#", ";"), interpolation=None, strict=True
        )
        parser.optionxform = str
        parser.read_string(text)
        self.sections = {name: dict(parser[name]) for name in parser.sections()}

    @classmethod
    def check(cls, path, overrides=()):
        """The deck at `path` with `--set` overrides; millsim's own line is the error of a wrong one."""
        sets = [word for override in overrides for word in ("--set", override)]
        done = subprocess.run(
            [program(), "--check", *sets, "--", path], capture_output=True, text=True, errors="replace"
        )
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or [f"millsim --check ended with {done.returncode}"]
            raise UserError(lines[-1].removeprefix("millsim: "), done.returncode if done.returncode > 0 else 1)
        return cls(done.stdout, path, overrides)

    def value(self, key, default=None):
        """The text of `section.key`; the section may hold dots itself."""
        section, _, name = key.rpartition(".")
        return self.sections.get(section, {}).get(name, default)

    def numbers(self, key):
        """The numbers of `section.key`, SI, without their unit."""
        found = []
        for word in self.value(key, "").split():
            try:
                found.append(float(word))
            except ValueError:
                break
        return found

    def number(self, key, default=None):
        """The number of `section.key`, SI; `default` where the deck has none."""
        found = self.numbers(key)
        return found[0] if found else default

    @property
    def species(self):
        """The kinds of balls, in the order of their rows."""
        names = [name for name in self.sections if name.startswith("balls.")] or ["balls"]
        return [
            Species(
                name.removeprefix("balls."),
                int(self.number(f"{name}.count")),
                self.number(f"{name}.diameter"),
                self.number(f"{name}.density"),
            )
            for name in names
        ]

    @property
    def species_of_ball(self):
        """Index into `species` of every ball (N,)."""
        return np.repeat(np.arange(len(self.species)), [kind.count for kind in self.species])

    @property
    def rotor_speed(self):
        """[rad/s], positive about +x; 0 without a rotor."""
        return self.number("rotor.speed", 0.0)

    @property
    def shaft_radius(self):
        """[m]; 0 without a shaft."""
        return self.number("rotor.shaft_radius", 0.0)

    @property
    def blades(self):
        """All blades, numbered as millsim numbers them: those of [blades], then each [blade.NAME]."""
        turn = self.number("rotor.angle", 0.0)
        found = []
        if "blades" in self.sections:
            shape = [self.number(f"blades.{key}") for key in ("tip_radius", "width", "thickness", "pitch")]
            count, length = int(self.number("blades.count")), self.number("drum.length")
            step = self.number("blades.angle_step")
            for k in range(count):
                found.append(Blade(-length / 2 + (k + 0.5) * length / count, turn + k * step, *shape))
        for name in self.sections:
            if name.startswith("blade."):
                place = self.number(f"{name}.position"), turn + self.number(f"{name}.angle")
                keys = ("tip_radius", "width", "thickness", "pitch")
                found.append(Blade(*place, *(self.number(f"{name}.{key}", 0.0) for key in keys)))
        return found

    def contact(self, kind):
        """The contact law of `kind`, one of KINDS."""
        keys = ("restitution", "friction", "tangential_restitution")
        return Contact(*(self.number(f"contact.{kind}.{key}", self.number(f"contact.{key}", 0.0)) for key in keys))
