"""Finds the impacts in a soft-sphere run: contacts are followed from sample to sample.

A sample is the state of all balls. There are eight samples in the duration of a contact, so no complete contact is
missed. At the first sample of a contact the equation of the damped spring gives, from overlap and closing speed, the
speed and the time of the impact: the normal speed that a hard-sphere code reports. The geometry is exactly that of the
deck (milltools.dem.walls). LIGGGHTS' own list of contacts is not used: writing it costs more than the whole state.

Only neighbours are checked: pairs from a k-d tree, and balls near enough to a blade to meet it before the lists are
made again. Arrays have one row per contact unless stated otherwise; SI units.
"""

import numpy as np
from scipy.spatial import cKDTree

from milltools.base.errors import UserError
from milltools.dem.setup import setup_of
from milltools.dem.walls import Blades, Found
from milltools.foreign.digest import impacts_of

SKIN = 0.2  # of the largest ball's diameter: pairs with a smaller gap are on the list
LEAST_SAMPLES = 8  # for which a list is valid
SPEEDUP = 1.5  # lists allow for speeds up to this factor times the present maximum; faster balls need new lists
ROUNDS = 400
CLOSED = 1e-7  # of the largest radius: smaller overlaps count as none


def solve_back(overlap, closing, decay, frequency):
    """(impact speed [m/s], time since the contact began [s]) of a damped linear spring, from its overlap [m] > 0 and
    closing speed [m/s]; decay [1/s] and frequency [rad/s] are of the oscillation. Gravity is neglected."""
    phase = np.arctan2(1.0, (closing / overlap + decay) / frequency)
    age = phase / frequency
    return overlap * frequency * np.exp(decay * age) / np.sin(phase), age


class Contacts:
    """Follows the contacts of a mill.

    sample(time, place, velocity, spin) takes the state (N, 3) [m, m/s, rad/s] and returns the impacts that began
    since the last sample, in the order of time, or None: an array of milltools.foreign.digest.IMPACT; `dissipation`
    is the normal loss of an isolated impact, (1 - e^2)/2 m v_n^2. normal_loss (5,) [J] is the energy that the
    dashpots have dissipated since the beginning by kind, summed over the samples; elastic (5,) [J] is the energy in
    the springs now; deepest [m] is the largest overlap so far.
    """

    def __init__(self, deck, model):
        self.model, self.setup = model, setup_of(deck)
        self.walls = [None, *self.setup.walls]  # None: other balls
        self.kinds = [0, *(wall.kind for wall in self.setup.walls)]
        self.interval = model.sample_interval
        self.kind_of_ball = deck.species_of_ball
        self.radius = np.array([kind.diameter / 2 for kind in deck.species])[self.kind_of_ball]
        self.blades = next((wall for wall in self.setup.walls if isinstance(wall, Blades)), Blades(deck))
        self.spring = {name: model.table(name) for name in ("mass", "stiffness", "damping", "decay", "frequency")}
        self.loss = [1 - deck.contact(kind).restitution ** 2 for kind in deck.kinds]
        self.touching = [np.empty(0, np.int64) for _ in self.walls]  # their keys, ascending
        self.normal_loss, self.isolated_loss = np.zeros((2, len(deck.kinds)))
        self.elastic = np.zeros(len(self.walls))
        self.deepest = 0.0
        self.listed_until, self.fastest = -np.inf, 0.0  # [s], [m/s] limits of the lists
        self.found = [None] * len(self.walls)
        self.time = 0.0  # [s] of the contacts found
        self.before = None  # velocities and spins of the last sample
        self.last = None  # [s] its time

    # --- finding contacts -------------------------------------------------------------------------------

    def _list(self, time, place, velocity):
        """Makes new lists of neighbours if the old ones are no longer valid."""
        now = np.sqrt(np.einsum("ij,ij->i", velocity, velocity).max())
        if time < self.listed_until and now <= self.fastest:
            return
        self.fastest = SPEEDUP * max(now, 1e-3)
        tip = abs(self.blades.speed) * self.blades.reach
        skin = SKIN * 2 * self.radius.max()
        span = max(skin / (self.fastest + max(self.fastest, tip)), LEAST_SAMPLES * self.interval)
        self.listed_until = time + span - 0.5 * self.interval
        pairs = cKDTree(place).query_pairs(2 * (self.radius.max() + self.fastest * span), output_type="ndarray")
        i, j = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
        away, touching = place[i] - place[j], self.radius[i] + self.radius[j]
        keep = np.einsum("ij,ij->i", away, away) < (touching + 2 * self.fastest * span) ** 2
        self.pairs, self.touching_square = (i[keep], j[keep]), touching[keep] ** 2
        reach = (self.fastest + tip) * span
        out = np.hypot(place[:, 1], place[:, 2]) - self.radius
        near = np.nonzero(out < self.blades.reach + reach)[0] if self.blades.count else np.empty(0, int)
        ball, blade = np.repeat(near, self.blades.count), np.tile(np.arange(self.blades.count), len(near))
        keep = self.blades.look(place[ball], blade, time)[0] < self.radius[ball] + reach
        self.at_blades = ball[keep], blade[keep]

    def _balls(self, place):
        i, j = self.pairs
        away = place.take(i, axis=0) - place.take(j, axis=0)
        square = np.einsum("ij,ij->i", away, away)
        hit = np.nonzero(square < self.touching_square)[0]
        i, j, distance = i[hit], j[hit], np.sqrt(square[hit])
        overlap = np.sqrt(self.touching_square[hit]) - distance
        return Found(i * len(place) + j, i, j, overlap, away[hit] / distance[:, None])

    def find(self, time, place, velocity):
        """The contacts at this moment: a Found for pairs of balls, then one for each wall of the setup."""
        self._list(time, place, velocity)
        self.time = time
        listed = {self.blades: self.at_blades}
        return [self._balls(place)] + [w.find(time, place, self.radius, *listed.get(w, ())) for w in self.setup.walls]

    # --- contact motion and losses -----------------------------------------------------------------------------

    def springs(self, name, which, found):
        """Attribute `name` of the Spring of each contact with wall number `which`, from 1; 0: contacts of two balls."""
        table = self.spring[name][self.kinds[which]]
        if table.size == 1:
            return table.item()
        of = self.kind_of_ball[found.ball]
        return table[of, self.kind_of_ball[found.partner]] if which == 0 else table[of]

    def relative(self, which, found, place, velocity):
        """Velocity (M, 3) of the ball's centre relative to the partner's centre, or to the surface."""
        own = velocity[found.ball]
        if which == 0:
            return own - velocity[found.partner]
        if motion := self.walls[which].motion:
            own -= motion.velocity(self.time, place[found.ball] - self.radius[found.ball, None] * found.normal)
        return own

    def slip(self, which, found, place, velocity, spin):
        """Slip (M, 3) of the two surfaces: tangential velocity of `ball` relative to its partner at the contact."""
        turning = spin[found.ball] * self.radius[found.ball, None]
        if which == 0:
            turning = turning + spin[found.partner] * self.radius[found.partner, None]
        moving = self.relative(which, found, place, velocity) - np.cross(turning, found.normal)
        along = np.einsum("ij,ij->i", moving, found.normal)
        return moving - along[:, None] * found.normal

    def sample(self, time, place, velocity, spin):
        if self.before is None:
            self.before, self.last = (velocity.copy(), spin.copy()), time
        began = []
        self.found = self.find(time, place, velocity)
        for which, found in enumerate(self.found):
            if not len(found.ball):
                self.touching[which] = found.key
                self.elastic[which] = 0.0
                continue
            relative = self.relative(which, found, place, velocity)
            closing = -np.einsum("ij,ij->i", relative, found.normal)
            damping = self.springs("damping", which, found)
            self.normal_loss[self.kinds[which]] += self.interval * np.sum(damping * closing * closing)
            self.elastic[which] = 0.5 * np.sum(self.springs("stiffness", which, found) * found.overlap**2)
            self.deepest = max(self.deepest, found.overlap.max())
            new = np.append(self.touching[which], -1)[np.searchsorted(self.touching[which], found.key)] != found.key
            self.touching[which] = found.key
            if new.any():
                began.append(self._impacts(which, found.where(new), closing[new], place))
        self.before[0][:], self.before[1][:] = velocity, spin
        self.last = time
        if not began:
            return None
        joined = np.concatenate(began)
        return joined[np.argsort(joined["time"], kind="stable")]

    def _impacts(self, which, found, closing, place):
        kind = self.kinds[which]
        decay, frequency, mass = (self.springs(name, which, found) for name in ("decay", "frequency", "mass"))
        speed, age = solve_back(found.overlap, closing, decay, frequency)
        slip = self.slip(which, found, place, *self.before)
        lost = 0.5 * self.loss[kind] * mass * speed * speed
        self.isolated_loss[kind] += lost.sum()
        reach = (self.radius[found.ball] - found.overlap / 2)[:, None]
        return impacts_of(
            # the contact began after the last sample; rounding and forces of third bodies can give an earlier time
            time=np.maximum(self.time - age, self.last),
            kind=kind,
            ball=found.ball,
            partner=found.partner,
            position=place[found.ball] - reach * found.normal,
            normal=found.normal,
            normal_speed=speed,
            tangential_speed=np.sqrt(np.einsum("ij,ij->i", slip, slip)),
            dissipation=lost,
        )


def part(contacts, time, place, velocity):
    """Places (N, 3) [m] without overlaps near the given ones.

    Needed between a soft run and a stiffer one: with the overlaps of the soft run, stiffer springs would throw balls
    apart with much more energy. So overlapping bodies are moved apart, each by half; velocities stay the same."""
    place, enough = place.copy(), CLOSED * contacts.radius.max()
    for _ in range(ROUNDS):
        contacts.listed_until = -np.inf
        shift, deepest = np.zeros_like(place), 0.0
        for kind, found in enumerate(contacts.find(time, place, velocity)):
            deepest = max(deepest, found.overlap.max(initial=0.0))
            away = (found.overlap + enough / 2)[:, None] * found.normal
            np.add.at(shift, found.ball, away / 2 if kind == 0 else away)
            if kind == 0:
                np.add.at(shift, found.partner, -away / 2)
        if deepest <= enough:
            return place
        place += shift
    raise UserError(
        f"--warm-up leaves overlaps of {deepest:.2g} m that cannot be removed: choose a larger modulus for it", 1
    )
