"""The deck in SI units with all defaults, as `millsim --check` reads, checks and prints it.

Python never interprets units or defaults itself: the only reader of decks is in the engine.
"""

import collections
import contextlib
import dataclasses
import functools
import math
import pathlib
import sys
import tempfile

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.read import deck_text
from milltools.read.kinds import KINDS

MOST_BLADES = 10000  # as in the engine
SIZES = {"radius", "length", "diameter", "density", "tip_radius", "width", "thickness"}  # above 0, except for bodies


@dataclasses.dataclass(frozen=True)
class Species:
    """One kind of ball; lengths in m, density in kg/m^3."""

    name: str
    count: int
    diameter: float
    density: float

    @property
    def mass(self) -> float:
        """Mass of one ball [kg]."""
        return self.density * math.pi / 6 * self.diameter**3


@dataclasses.dataclass(frozen=True)
class Blade:
    """A box on the rotor: `position` of its centre along x [m], `angle` at t = 0 from +y to +z [rad], `tip_radius`: the
    distance of its tip from the axis [m], `width` along the axis and `thickness` around it [m], `pitch` [rad]."""

    position: float
    angle: float
    tip_radius: float
    width: float
    thickness: float
    pitch: float


# what millsim needs beside a drum to tell its contour
ANY_BALLS = "[run]\ntime = 1 s\n[balls]\ncount = 1\ndiameter = 1 um\ndensity = 1 kg/m^3\n[contact]\nrestitution = 1\n"
Contact = collections.namedtuple("Contact", "restitution friction tangential_restitution")  # of one kind of contact


def _ask(path, overrides, *options):
    """What millsim prints about the deck at `path`; for a wrong deck a UserError with millsim's own message."""
    sets = [word for override in overrides for word in ("--set", override)]
    return engine.ask(*options, *sets, "--", path)


class Deck:
    """A deck in SI. `text` is the full deck as `millsim --check` prints it, `sections` its entries as texts (default:
    read from `text`). `place` names a value in messages, as in "mill.h5: damaged: /deck/drum/radius".
    `digest`: Run.digest if it is the deck of a run, `outlines`: then the text of its contours."""

    def __init__(
        self, text, path=None, overrides=(), sections=None, place="{path}: [{section}] {key}", digest=None, outlines=""
    ):
        self.text, self.path, self.overrides, self.place = text, path, tuple(overrides), place
        self.digest, self.outlines = digest, outlines
        self.sections = deck_text.sections(text, path) if sections is None else sections
        for section, keys in self.sections.items():
            sized = section == "drum" or section.startswith(("ball", "blade"))
            for key in SIZES.intersection(keys) if sized else ():
                if not self.number(f"{section}.{key}") > 0:
                    raise self._fault(f"{section}.{key}", "expected more than 0")

    def _fault(self, key, why):
        section, _, name = key.rpartition(".")
        where = self.place.format(path=self.path, section=section, key=name)
        return UserError(f"{where}: {why}, got {plain(self.value(key))!r}")

    @classmethod
    def check(cls, path, overrides=()):
        """The deck at `path` with `--set` overrides; for a wrong deck a UserError with millsim's own message."""
        return cls(_ask(path, overrides, "--check", "--quiet"), path, overrides)

    def start(self):
        """The start state of the balls, bit for bit as in millsim: position [m], velocity [m/s], spin [rad/s], each
        (N, 3)."""
        with tempfile.TemporaryDirectory(prefix="mill-") as folder:
            file = pathlib.Path(folder) / "start.txt"
            _ask(self.path, self.overrides, "--export-start", file)
            table = np.loadtxt(file, ndmin=2)
        whole = np.pad(table, ((0, 0), (0, 9 - table.shape[1])))  # missing columns are 0
        return [part.copy() for part in np.split(whole, 3, axis=1)]

    @functools.cached_property
    def contours(self):
        """Rows (x, y [m], bulge) of the contours by section, of the drum ("drum") if it is no circle, and of bodies,
        as `millsim --contour` tells them; x, y of the drum are the mill's y, z, those of a body its own."""
        said, found, rows = self.outlines, {}, []
        if not said and self.digest is None:
            round_ = self.value("drum.profile", "circle") == "circle"
            shapes = (self.value(f"body.{name}.shape") for name in self.bodies)
            said = "" if round_ and "contour" not in shapes else _ask(self.path, self.overrides, "--contour")
        elif not said and self.value("drum.profile") == "wavy":  # a run of a version that kept no contours
            own = "".join(
                f"{key} = {plain(value)}\n" for key, value in self.sections["drum"].items() if key != "motion"
            )
            with tempfile.TemporaryDirectory(prefix="mill-") as folder:
                file = pathlib.Path(folder) / "drum.ini"
                file.write_text(f"{ANY_BALLS}[drum]\n{own}")
                try:
                    said = _ask(file, (), "--contour")
                except UserError as fault:
                    raise self._fault("drum.profile", plain(str(fault).removeprefix(f"{file}:"))) from None
        try:
            for line in said.splitlines():
                if line.startswith("# ["):
                    rows = found.setdefault(line[3:-1], [])
                else:
                    x, y, bulge = map(float, line.split())
                    rows.append((x, y, bulge))
        except ValueError:
            raise UserError(f"{self.path}: damaged: contour: {plain(line[:60])!r}") from None
        return {section: tuple(rows) for section, rows in found.items()}

    def value(self, key, default=None):
        """The text of `section.key`; the name of the section can contain dots."""
        section, _, name = key.rpartition(".")
        return self.sections.get(section, {}).get(name, default)

    def numbers(self, key):
        """The numbers of `section.key` in SI, without the unit; UserError if one is not finite."""
        found = []
        with contextlib.suppress(ValueError):
            for word in self.value(key, "").split():
                found.append(float(word))
        if not all(map(math.isfinite, found)):
            raise self._fault(key, "expected a number")
        return found

    def number(self, key, default=None):
        """The number of `section.key` in SI; `default` if the deck has no such key, UserError if it is not a number."""
        if default is not None and self.value(key) is None:
            return default
        found = self.numbers(key)
        if not found:
            raise self._fault(key, "expected a number")
        return found[0]

    def count(self, key, most=sys.maxsize):
        """The whole number of `section.key`, 0 if the deck has no such key."""
        found = self.number(key, 0.0)
        if not (0 <= found <= most and found == int(found)):
            raise self._fault(key, f"expected a whole number from 0 to {most}")
        return int(found)

    @property
    def species(self):
        """The kinds of balls, in the order of their rows."""
        names = [name for name in self.sections if name.startswith("balls.")] or ["balls"]
        sizes = ((self.count(f"{n}.count"), self.number(f"{n}.diameter"), self.number(f"{n}.density")) for n in names)
        return [Species(name.removeprefix("balls."), *own) for name, own in zip(names, sizes)]

    @property
    def mass(self):
        """Mass of all balls [kg]."""
        return sum(kind.count * kind.mass for kind in self.species)

    @property
    def species_of_ball(self):
        """Index into `species` of every ball (N,)."""
        return np.repeat(np.arange(len(self.species)), [kind.count for kind in self.species])

    def named(self, what):
        """NAME of every section [what.NAME], in the order of the deck; `what`: "body" or "motion"."""
        return [s.removeprefix(f"{what}.") for s in self.sections if s.startswith(f"{what}.")]

    @property
    def bodies(self):
        """Names of all bodies."""
        return self.named("body")

    @property
    def motions(self):
        """Names of all motions in millsim's order: "rotor", then each [motion.NAME] after the one that carries it."""
        named, found = self.named("motion"), ["rotor"] * ("rotor" in self.sections)
        for name in named * len(named):  # a deck may define a motion before its carrier
            if name not in found and self.value(f"motion.{name}.on", "") in ("", *found):
                found.append(name)
        return found

    def kind_of(self, body):
        """The kind of contact with the body of a section [body.NAME]."""
        return self.value(f"body.{body}.kind", "") or f"ball_{body}"

    @property
    def kinds(self):
        """The kinds of contact that output files count: first the usual ones, then those of bodies."""
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
    def periodic(self):
        """Whether the mill has periodic ends, and no end walls."""
        return self.value("drum.ends", "walls") == "periodic"

    @property
    def blades(self):
        """All blades in the order of millsim: those of [blades], then each [blade.NAME]."""
        found, turn = [], self.number("rotor.angle", 0.0)
        for section in sorted(self.sections, key=lambda name: name != "blades"):
            size = (self.number(f"{section}.{key}", 0.0) for key in ("tip_radius", "width", "thickness", "pitch"))
            if section == "blades":
                size, count, length = tuple(size), self.count("blades.count", MOST_BLADES), self.number("drum.length")
                step = self.number("blades.angle_step", 0.0)
                found += [Blade((k + 0.5) * length / count - length / 2, turn + k * step, *size) for k in range(count)]
            elif section.startswith("blade."):
                place, angle = (self.number(f"{section}.{key}", 0.0) for key in ("position", "angle"))
                found.append(Blade(place, turn + angle, *size))
        return found

    def contact(self, kind):
        """The contact law of `kind`, one of KINDS."""
        keys = ((f"contact.{kind}.{key}", f"contact.{key}") for key in Contact._fields)
        return Contact(*(self.number(own, self.number(usual, 0.0)) for own, usual in keys))
