"""The work that motions do on the balls, and the energy that friction takes at the walls.

Either the container is at rest, or it moves together with all bodies in it. If it moves, the total force of the walls
on the balls follows without the contacts: only this force and gravity change the momentum and the angular momentum of
the balls. The force times the velocity that each motion gives to the container gives the work of each motion. The only
error comes from the interval of the samples, of which there are eight in a contact. If the container is at rest,
LIGGGHTS sums the forces on each mesh over all steps.

Friction comes from LIGGGHTS' own forces at a few moments. The power of the tangential forces against the slip, summed
over all contacts of a moment, is the energy that goes into tangential springs, dashpots and sliding; energy that the
springs return counts as negative. So the mean power over many moments is the loss, whatever the time between them;
only its scatter depends on their number.

Between balls this does not work. `compute pair/gran/local` evaluates the contact law again after the step; a sliding
contact, whose spring was limited to mu F_n before, then counts as sticking, and its dashpot force is added. There the
friction loss is the remainder of the balance of energy (milltools.dem.soft_mill).
"""

import numpy as np

from milltools.dem.walls import SHAFT


class Drive:
    """work {name of a motion: [J] so far}; torque [N m]: the rotor's, mean over the last row.

    sample(time, state): the balls (N, 3) in the frame; row(told): LIGGGHTS' values for meshes over a row of
    `length` [s]. After balls were moved artificially, settle(keep=0) starts a new balance of momentum.
    """

    def __init__(self, setup, mass, inertia):
        self.setup, self.mass, self.inertia = setup, mass, inertia
        deck = setup.deck
        self.work = dict.fromkeys(["rotor", *deck.motions], 0.0)
        self.rotor_speed, self.blades = deck.rotor_speed, bool(deck.blades)
        self.torque = self.shaft_impulse = 0.0
        self.waiting = []  # (time, momentum, sum of mass times place, angular momentum) of samples

    def sample(self, time, place, velocity, spin):
        if not self.setup.moves:
            return
        whirl = (self.mass[:, None] * place).T @ velocity  # its antisymmetric part is the angular momentum
        angular = (whirl - whirl.T)[[1, 2, 0], [2, 0, 1]] + self.inertia @ spin
        self.waiting.append((time, self.mass @ velocity, self.mass @ place, angular))

    def settle(self, keep=1):
        """Adds the work up to the last sample: of many samples at once, in a twentieth of the time."""
        waiting, self.waiting = self.waiting, self.waiting[len(self.waiting) - keep :]
        if len(waiting) < 2:
            return
        time, momentum, middle, angular = map(np.array, zip(*waiting, strict=True))
        frame, chain = self.setup.frame, self.setup.chain
        step, half = np.diff(time)[:, None], (time[1:] + time[:-1]) / 2
        pull = frame.gravity(half)
        force = np.diff(momentum, axis=0) - self.mass.sum() * pull * step
        torque = np.diff(angular, axis=0) - np.cross((middle[1:] + middle[:-1]) / 2, pull) * step
        force, torque, origin = force @ frame.rows, torque @ frame.rows, frame.track(half)
        for one, field in zip(chain.motions, chain.fields(half), strict=True):
            turning = field[:, [2, 0, 1], [1, 2, 0]]
            there = np.einsum("tij,tj->ti", field[:, :, :3], origin) + field[:, :, 3]
            self.work[one.name] += float(np.sum(force * there + torque * turning))

    def row(self, told, length):
        self.settle()
        told = list(told)
        self.torque = self.shaft_impulse / length - (told.pop(0) if self.blades else 0.0)
        self.work["rotor"] += self.torque * self.rotor_speed * length
        self.shaft_impulse = 0.0
        for mesh, power in zip(self.setup.driven, told, strict=True):
            name = mesh.motion.name
            self.work[name] += power * length
            if name == "rotor" and self.rotor_speed:
                self.torque += power / self.rotor_speed


def columns_of(contacts, which, found):
    """For each contact with wall number `which`: the index in Setup.acting of its force."""
    primitives = contacts.walls[which].primitives or [("blades", "", "", None)]
    name, _, _, species = primitives[0]
    first = contacts.setup.acting.index(name)
    if species is not None:
        return first + contacts.kind_of_ball[found.ball]
    return first + (found.part if len(primitives) > 1 else np.zeros(len(found.ball), np.int64))


def at_walls(contacts, state, forces):
    """Power [W] of the tangential forces by kind (0 for ball_ball), and the torque [N m] of the shaft on the balls
    about +x.

    contacts: a Contacts that has just sampled this state: place, velocity, spin (N, 3); forces (N, W, 3) [N] of the
    W walls (Setup.acting) on the balls.
    """
    (place, velocity, spin), power, torque = state, np.zeros(len(contacts.normal_loss)), 0.0
    touched = [(k, f, columns_of(contacts, k, f)) for k, f in enumerate(contacts.found) if k and len(f.ball)]
    shared = np.zeros(forces.shape[:2], int)  # a ball touching two blades: half of the force to each
    for _, found, column in touched:
        np.add.at(shared, (found.ball, column), 1)
    for which, contact, column in touched:
        here = forces[contact.ball, column] / shared[contact.ball, column][:, None]
        tangential = here - np.einsum("ij,ij->i", here, contact.normal)[:, None] * contact.normal
        slip = contacts.slip(which, contact, place, velocity, spin)
        kind = contacts.kinds[which]
        power[kind] -= np.einsum("ij,ij->", tangential, slip)
        if kind == SHAFT:
            arm = place[contact.ball] - contacts.radius[contact.ball, None] * contact.normal
            torque = float(np.sum(arm[:, 1] * here[:, 2] - arm[:, 2] * here[:, 1]))
    return power, torque
