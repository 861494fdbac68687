"""The deck as millsim understands it: read, checked and filled in by `millsim --check`, in SI units.

Python never reads units or defaults itself: there is one reader of decks, and it is in the engine.
"""

import dataclasses
import pathlib
import subprocess
import tempfile

import numpy as np

from milltools.base.engine import program
from milltools.base.errors import UserError
from milltools.read import blades
from milltools.read.kinds import KINDS
from milltools.read.schema import deck_entries


@dataclasses.dataclass(frozen=True)
class Species:
    """One kind of ball; lengths in m, density in kg/m^3."""

    name: str
    count: int
    diameter: float
    density: float


@dataclasses.dataclass(frozen=True)
class Contact:
    """What one kind of contact is made of."""

    restitution: float
    friction: float
    tangential_restitution: float


def _ask(path, overrides, *options):
    """What millsim prints about the deck at `path`; its own line is the error of a wrong one."""
    sets = [word for override in overrides for word in ("--set", override)]
    words = [program(), *options, *sets, "--", path]
    done = subprocess.run(words, capture_output=True, text=True, errors="replace")
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"millsim ended with status {done.returncode}"]
        raise UserError(lines[-1].removeprefix("millsim: "), done.returncode if done.returncode > 0 else 1)
    return done.stdout


class Deck:
    """A deck in SI. `text` is the full deck as `millsim --check` prints it, `sections` its entries as texts."""

    def __init__(self, text, path=None, overrides=()):
        self.text, self.path, self.overrides = text, path, tuple(overrides)
        self.sections = {}
        for section, key, value, _ in deck_entries(text):
            self.sections.setdefault(section, {})[key] = value

    @classmethod
    def check(cls, path, overrides=()):
        """The deck at `path` with `--set` overrides; millsim's own line is the error of a wrong one."""
        return cls(_ask(path, overrides, "--check", "--quiet"), path, overrides)

    def start(self):
        """Start state of the balls as millsim makes it, to the bit: place [m], velocity [m/s], spin [rad/s], (N, 3) each."""
        with tempfile.TemporaryDirectory(prefix="mill-") as folder:
            file = pathlib.Path(folder) / "start.txt"
            _ask(self.path, self.overrides, "--export-start", file)
            table = np.loadtxt(file, ndmin=2)
        whole = np.zeros((len(table), 9))
        whole[:, : table.shape[1]] = table
        return [whole[:, k : k + 3].copy() for k in (0, 3, 6)]

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

    def named(self, what):
        """NAME of every section [what.NAME], in the deck's order: of "body", "motion"."""
        return [s.removeprefix(f"{what}.") for s in self.sections if s.startswith(f"{what}.")]

    @property
    def bodies(self):
        """Names of all bodies."""
        return self.named("body")

    @property
    def motions(self):
        """Names of all that moves: of [motion.NAME], and "rotor"."""
        return self.named("motion") + ["rotor"] * ("rotor" in self.sections)

    def kind_of(self, body):
        """The kind of contact with the body of a section [body.NAME]."""
        return self.value(f"body.{body}.kind", "") or f"ball_{body}"

    @property
    def kinds(self):
        """The kinds of contact that files count, those of bodies behind the usual ones."""
        return tuple(dict.fromkeys([*KINDS, *map(self.kind_of, self.bodies)]))

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
        return blades.of(self.sections, lambda key: self.number(key, 0.0), self.number("rotor.angle", 0.0))

    def contact(self, kind):
        """The contact law of `kind`, one of KINDS."""
        keys = ("restitution", "friction", "tangential_restitution")
        return Contact(*(self.number(f"contact.{kind}.{key}", self.number(f"contact.{key}", 0.0)) for key in keys))
