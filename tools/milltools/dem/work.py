"""The work that motions do on the balls.

What holds the balls is all that moves, or it stands still. Where it moves, what all walls together do to the balls is known
without looking at a single contact: the momentum and the angular momentum of the balls change by it and by gravity alone. Times the
velocity that each motion gives to the container, that is the work of each. It is exact but for the interval of the samples, of
which there are eight in a contact. Otherwise LIGGGHTS sums the forces on each mesh over all steps.
"""

from milltools.dem.paths import cross


class Drive:
    """work {name of a motion: [J] so far}; torque [N m]: the rotor's, mean over the last row.

    sample(time, state): the balls (N, 3) in the frame; row(told): what LIGGGHTS tells of meshes over a row of `length` [s].
    """

    def __init__(self, scene, mass, inertia):
        self.scene, self.mass, self.inertia = scene, mass, inertia
        deck = scene.deck
        self.work = dict.fromkeys(["rotor", *deck.motions], 0.0)
        self.rotor_speed, self.blades = deck.rotor_speed, bool(deck.blades)
        self.torque = self.shaft_impulse = 0.0
        self.last = None

    @property
    def total(self):
        """[J] of all motions."""
        return sum(self.work.values())

    def restart(self):
        """The balls have been moved by hand: what comes next begins anew."""
        self.last = None

    def sample(self, time, place, velocity, spin):
        """See the class."""
        if not self.scene.moves:
            return
        scene, mass = self.scene, self.mass
        momentum, middle = mass @ velocity, mass @ place
        whirl = (mass[:, None] * place).T @ velocity  # its odd part is the angular momentum
        angular = (whirl - whirl.T)[[1, 2, 0], [2, 0, 1]] + self.inertia @ spin
        if self.last is not None:
            before, momentum_before, middle_before, angular_before = self.last
            step, half = time - before, (time + before) / 2
            pull = scene.frame.gravity(half)
            force = momentum - momentum_before - mass.sum() * pull * step
            torque = angular - angular_before - cross((middle + middle_before) / 2, pull) * step
            force, torque = force @ scene.frame.rows, torque @ scene.frame.rows
            spins, drifts = scene.chain.fields(half)
            middle_there = scene.frame.track(half)
            for one, about, along in zip(scene.chain.motions, spins, drifts, strict=True):
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
        for (name, _), power in zip(self.scene.driven, told, strict=True):
            self.work[name] += power * length
            if name == "rotor" and self.rotor_speed:
                self.torque += power / self.rotor_speed
