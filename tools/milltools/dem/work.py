"""The work that motions do on the balls, and the energy that friction takes at the walls.

What holds the balls is all that moves, or it stands still. Where it moves, what all walls together do to the balls is known
without looking at a single contact: the momentum and the angular momentum of the balls change by it and by gravity alone. Times the
velocity that each motion gives to the container, that is the work of each. It is exact but for the interval of the samples, of
which there are eight in a contact. Otherwise LIGGGHTS sums the forces on each mesh over all steps.

Friction, from LIGGGHTS' own forces at a few moments: the power of the tangential forces against the slip, summed over all
contacts of a moment and averaged over moments, is the energy that goes into tangential springs, dashpots and sliding; what the
springs give back is in it with its sign. So the mean over many moments is the loss, however far apart they are. Only its scatter
depends on their number.

Between balls this does not work: `compute pair/gran/local` evaluates the contact law once more, after the step, and a
sliding contact whose spring was just cut back to mu F_n then counts as sticking, dashpot added. What friction takes there is
what the balance of energy leaves over (milltools.dem.soft_mill).
"""

import numpy as np

from milltools.dem.paths import cross
from milltools.dem.walls import SHAFT


class Drive:
    """work {name of a motion: [J] so far}; torque [N m]: the rotor's, mean over the last row.

    sample(time, state): the balls (N, 3) in the frame; row(told): what LIGGGHTS tells of meshes over a row of `length` [s].
    Where balls are moved by hand, `last` = None begins anew.
    """

    def __init__(self, setup, mass, inertia):
        self.setup, self.mass, self.inertia = setup, mass, inertia
        deck = setup.deck
        self.work = dict.fromkeys(["rotor", *deck.motions], 0.0)
        self.rotor_speed, self.blades = deck.rotor_speed, bool(deck.blades)
        self.torque = self.shaft_impulse = 0.0
        self.last = None

    @property
    def total(self):
        """[J] of all motions."""
        return sum(self.work.values())

    def sample(self, time, place, velocity, spin):
        """See the class."""
        if not self.setup.moves:
            return
        setup, mass = self.setup, self.mass
        momentum, middle = mass @ velocity, mass @ place
        whirl = (mass[:, None] * place).T @ velocity  # its odd part is the angular momentum
        angular = (whirl - whirl.T)[[1, 2, 0], [2, 0, 1]] + self.inertia @ spin
        if self.last is not None:
            before, momentum_before, middle_before, angular_before = self.last
            step, half = time - before, (time + before) / 2
            pull = setup.frame.gravity(half)
            force = momentum - momentum_before - mass.sum() * pull * step
            torque = angular - angular_before - cross((middle + middle_before) / 2, pull) * step
            force, torque = force @ setup.frame.rows, torque @ setup.frame.rows
            spins, drifts = setup.chain.fields(half)
            middle_there = setup.frame.track(half)
            for one, about, along in zip(setup.chain.motions, spins, drifts, strict=True):
                along = along + cross(about, middle_there)
                self.work[one.name] += float(force @ along + torque @ about)
        self.last = time, momentum, middle, angular

    def row(self, told, length):
        """See the class."""
        told = list(told)
        torque = -told.pop(0) if self.blades else 0.0
        self.torque = torque + self.shaft_impulse / length
        self.work["rotor"] += self.torque * self.rotor_speed * length
        self.shaft_impulse = 0.0
        for (name, _), power in zip(self.setup.driven, told, strict=True):
            self.work[name] += power * length
            if name == "rotor" and self.rotor_speed:
                self.torque += power / self.rotor_speed


def columns_of(contacts, which, found):
    """Of each contact with the wall of number `which`: which of script.walls_of tells its force."""
    walls, wall = contacts.walls[1:], contacts.walls[which]
    told_before = walls[: which - 1] if wall.primitives else walls  # one column for all meshes, the last
    first = sum(len(other.primitives) for other in told_before)
    if wall.primitives and wall.primitives[0][2] is not None:
        return first + contacts.kind_of_ball[found.ball]
    part = found.part if len(wall.primitives) > 1 else np.zeros(len(found.ball), np.int64)
    return first + part


def at_walls(contacts, state, forces):
    """Power [W] of the tangential forces by kind (0 for ball_ball), and the torque [N m] of the shaft on the balls
    about +x.

    contacts: a Contacts that has just sampled this state: place, velocity, spin (N, 3); forces (N, W, 3) [N] of the
    W walls (script.walls_of) on the balls.
    """
    place, velocity, spin = state
    power, torque = np.zeros(len(contacts.normal_loss)), 0.0
    touched = [(k, f) for k, f in enumerate(contacts.found) if k and len(f.ball)]
    columns = [columns_of(contacts, which, found) for which, found in touched]
    shared = np.zeros(forces.shape[:2], int)  # a ball between two blades: half of the force to each
    for (_, found), column in zip(touched, columns, strict=True):
        np.add.at(shared, (found.ball, column), 1)
    for (which, contact), column in zip(touched, columns, strict=True):
        here = forces[contact.ball, column] / shared[contact.ball, column][:, None]
        tangential = here - np.einsum("ij,ij->i", here, contact.normal)[:, None] * contact.normal
        slip = contacts.slip(which, contact, place, velocity, spin)
        kind = contacts.kinds[which]
        power[kind] -= np.einsum("ij,ij->", tangential, slip)
        if kind == SHAFT:
            arm = place[contact.ball] - contacts.radius[contact.ball, None] * contact.normal
            torque = float(np.sum(arm[:, 1] * here[:, 2] - arm[:, 2] * here[:, 1]))
    return power, torque
