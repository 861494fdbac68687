"""Impacts out of a soft-sphere run: contacts followed from sample to sample.

A sample is the state of all balls; it comes eight times in the duration of a contact, so a contact that is complete
is seen. At its first sample the damped spring is solved back from overlap and closing speed to the speed of the impact
and to its time: the normal speed that a hard-sphere code reports. Geometry is that of the deck (milltools.dem.walls),
exactly; LIGGGHTS' own list of contacts costs it more than the whole state does.

Only neighbours are looked at: pairs near enough to meet before the list is made anew (`_Near`), in two rings, the
outer one from a k-d tree. Arrays are by contact where not said otherwise; SI units.
"""

import numpy as np
from scipy.spatial import cKDTree

from milltools.dem.boxes import Boxes
from milltools.dem.setup import scene_of
from milltools.dem.walls import Found

INNER_SAMPLES = 8  # the inner ring is drawn anew after so many samples
SPEEDUP = 1.5  # the rings allow for balls faster than all are now, by this factor; faster ones draw them anew


def solve_back(overlap, closing, decay, frequency):
    """(impact speed [m/s], time since the contact began [s]) of a damped linear spring from its overlap [m] > 0 and
    closing speed [m/s]; decay [1/s] and frequency [rad/s] of the oscillation. Gravity during a contact is neglected."""
    phase = np.arctan2(1.0, (closing / overlap + decay) / frequency)
    age = phase / frequency
    return overlap * frequency * np.exp(decay * age) / np.sin(phase), age


class Contacts:
    """Follows the contacts of a mill.

    sample(time, place, velocity, spin) takes the state (N, 3) [m, m/s, rad/s] and returns the impacts that began
    since the last one: a dict of arrays with `time`, `kind`, `ball`, `partner`, `point`, `normal`, `normal_speed`,
    `tangential_speed`, `dissipation` (that of an isolated impact in the normal direction, (1 - e^2)/2 m v_n^2), in the
    order of time, or None. normal_loss (5,) [J] is what the dashpots have taken since the beginning by kind, summed
    over the samples; elastic (5,) [J] what the springs hold now; deepest [m] is the largest overlap so far.
    """

    def __init__(self, deck, model, scene=None):
        self.model, self.scene = model, scene or scene_of(deck)
        self.walls = [None, *self.scene.walls]  # None: other balls
        self.kinds = [0, *(wall.kind for wall in self.scene.walls)]
        self.interval = model.sample_interval
        self.kind_of_ball = deck.species_of_ball
        self.radius = np.array([kind.diameter / 2 for kind in deck.species])[self.kind_of_ball]
        self.count = len(self.radius)
        self.rotor = deck.rotor_speed
        self.boxes = next((wall for wall in self.walls if isinstance(wall, Boxes)), Boxes(deck))
        self.skin = 0.2 * 2 * self.radius.max()
        self.spring = {name: model.table(name) for name in ("mass", "stiffness", "damping", "decay", "frequency")}
        self.loss = [1 - deck.contact(kind).restitution ** 2 for kind in deck.kinds]
        self.touching = [np.empty(0, np.int64) for _ in self.walls]
        self.normal_loss = np.zeros(len(deck.kinds))
        self.elastic = np.zeros(len(self.walls))
        self.isolated_loss = np.zeros(len(deck.kinds))
        self.deepest = 0.0
        self.outer_until = self.inner_until = -np.inf
        self.fastest = self.fast = 0.0  # [m/s] what the outer and the inner ring allow for
        self.found = [None] * len(self.walls)
        self.time = 0.0  # [s] of what was found
        self.before = None  # velocities and spins of the last sample
        self.last = None  # [s] its time

    # --- neighbours -------------------------------------------------------------------------------------

    def _rings(self, time, place, velocity):
        """Draws the rings anew where they are due."""
        now = np.sqrt(np.einsum("ij,ij->i", velocity, velocity).max())
        if time < self.inner_until and now <= self.fast:
            return
        tip = abs(self.rotor) * self.boxes.reach
        ahead = INNER_SAMPLES * self.interval
        if time + ahead > self.outer_until or now > self.fastest:
            self.fastest = SPEEDUP * max(now, 1e-3)
            self.outer_until = time + max(self.skin / (self.fastest + max(self.fastest, tip)), ahead)
            reach = self.outer_until - time
            self._outer(time, place, 2 * self.fastest * reach, (self.fastest + tip) * reach)
        self.fast = fastest = min(SPEEDUP * max(now, 1e-3), self.fastest)
        self.inner_until = time + (INNER_SAMPLES - 0.5) * self.interval
        i, j = self.pairs
        away = place[i] - place[j]
        near = self.radius[i] + self.radius[j] + 2 * fastest * ahead
        keep = np.einsum("ij,ij->i", away, away) < near * near
        self.near_i, self.near_j = i[keep], j[keep]
        near = self.radius[self.near_i] + self.radius[self.near_j]
        self.near_square = near * near
        if self.boxes.count:
            ball, blade = self.at_blades
            distance, _ = self.boxes.look(place[ball], blade, time)
            keep = distance < self.radius[ball] + (fastest + tip) * ahead
            self.near_ball, self.near_blade = ball[keep], blade[keep]

    def _outer(self, time, place, reach, reach_blade):
        tree = cKDTree(place)
        pairs = tree.query_pairs(2 * self.radius.max() + reach, output_type="ndarray")
        pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        self.pairs = pairs[:, 0].copy(), pairs[:, 1].copy()
        if self.boxes.count:
            out = np.hypot(place[:, 1], place[:, 2]) - self.radius
            near = np.nonzero(out < self.boxes.reach + reach_blade)[0]
            ball = np.repeat(near, self.boxes.count)
            blade = np.tile(np.arange(self.boxes.count), len(near))
            distance, _ = self.boxes.look(place[ball], blade, time)
            keep = distance < self.radius[ball] + reach_blade
            self.at_blades = ball[keep], blade[keep]

    # --- who touches whom -------------------------------------------------------------------------------

    def _balls(self, place):
        i, j = self.near_i, self.near_j
        away = place.take(i, axis=0) - place.take(j, axis=0)
        square = np.einsum("ij,ij->i", away, away)
        hit = np.nonzero(square < self.near_square)[0]
        i, j, away = i[hit], j[hit], away[hit]
        distance = np.sqrt(square[hit])
        return Found(
            i * self.count + j,
            i,
            j,
            np.sqrt(self.near_square[hit]) - distance,
            away / distance[:, None],
        )

    def _blades(self, place, time):
        ball, blade = self.near_ball, self.near_blade
        distance, normal = self.boxes.look(place[ball], blade, time)
        overlap = self.radius[ball] - distance
        hit = np.nonzero(overlap > 0)[0]
        ball, blade = ball[hit], blade[hit]
        return Found(ball * self.boxes.count + blade, ball, blade, overlap[hit], normal[hit])

    def find(self, time, place, velocity):
        """The contacts at this moment: the Found of balls, then of each wall of the scene."""
        self._rings(time, place, velocity)
        self.time = time
        found = [self._balls(place)]
        for wall in self.scene.walls:
            blades = wall is self.boxes
            found.append(self._blades(place, time) if blades else wall.find(time, place, self.radius))  # fmt: skip
        return found

    # --- what happens there -----------------------------------------------------------------------------

    def springs(self, name, which, found):
        """`name` of the Spring of each contact found with the wall of number `which`, from 1; 0: of balls."""
        pair, wall = self.spring[name]
        kind = self.model.kinds[self.kinds[which]]
        if len(pair) == 1:
            return pair[0, 0] if which == 0 else wall[kind][0]
        of = self.kind_of_ball[found.ball]
        return pair[of, self.kind_of_ball[found.partner]] if which == 0 else wall[kind][of]

    def relative(self, which, found, place, velocity):
        """Velocity (M, 3) of the ball's centre against the partner's, or against the surface."""
        own = velocity[found.ball]
        if which == 0:
            return own - velocity[found.partner]
        if self.walls[which].motion is None:
            return own
        at = place[found.ball] - self.radius[found.ball, None] * found.normal
        return own - self.walls[which].velocity(self.time, at)

    def slip(self, which, found, place, velocity, spin):
        """Slip (M, 3) of the two surfaces: tangential velocity of `ball` against its partner at the contact."""
        turning = spin[found.ball] * self.radius[found.ball, None]
        if which == 0:
            turning = turning + spin[found.partner] * self.radius[found.partner, None]
        moving = self.relative(which, found, place, velocity) - np.cross(turning, found.normal)
        along = np.einsum("ij,ij->i", moving, found.normal)
        return moving - along[:, None] * found.normal

    def sample(self, time, place, velocity, spin):
        """See the class."""
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
            self.normal_loss[self.kinds[which]] += self.interval * np.sum(
                self.springs("damping", which, found) * closing * closing
            )
            self.elastic[which] = 0.5 * np.sum(self.springs("stiffness", which, found) * found.overlap**2)
            self.deepest = max(self.deepest, found.overlap.max())
            new = np.isin(found.key, self.touching[which], assume_unique=True, invert=True)
            self.touching[which] = found.key
            if new.any():
                began.append(self._impacts(time, which, found, new, closing, place))
        self.before[0][:], self.before[1][:] = velocity, spin
        self.last = time
        if not began:
            return None
        joined = {name: np.concatenate([part[name] for part in began]) for name in began[0]}
        order = np.argsort(joined["time"], kind="stable")
        return {name: column[order] for name, column in joined.items()}

    def _impacts(self, time, which, found, new, closing, place):
        found, kind = found.where(new), self.kinds[which]
        decay, frequency, mass = (self.springs(name, which, found) for name in ("decay", "frequency", "mass"))
        speed, age = solve_back(found.overlap, closing[new], decay, frequency)
        slip = self.slip(which, found, place, *self.before)
        lost = 0.5 * self.loss[kind] * mass * speed * speed
        self.isolated_loss[kind] += lost.sum()
        reach = (self.radius[found.ball] - found.overlap / 2)[:, None]
        return {
            # it began after the last sample, whatever rounding and forces of third bodies say
            "time": np.maximum(time - age, self.last),
            "kind": np.full(len(speed), kind),
            "ball": found.ball,
            "partner": found.partner,
            "point": place[found.ball] - reach * found.normal,
            "normal": found.normal,
            "normal_speed": speed,
            "tangential_speed": np.sqrt(np.einsum("ij,ij->i", slip, slip)),
            "dissipation": lost,
        }
