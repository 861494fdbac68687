"""The blades of a rotor, as a wall."""

import numpy as np

from milltools.dem.paths import motion
from milltools.dem.walls import Wall
from milltools.geometry.solids import blade_triangles
from milltools.read.kinds import KINDS


class Boxes(Wall):
    """The blades as boxes that turn with the rotor; the foot is on the axis, as in millsim. Contacts finds who touches them."""

    kind = KINDS.index("ball_blade")

    def __init__(self, deck):
        self.deck = deck
        self.motion = motion(deck, "rotor")
        blades = deck.blades
        self.speed = deck.rotor_speed
        self.count = len(blades)
        self.position = np.array([b.position for b in blades])
        self.angle = np.array([b.angle for b in blades])
        self.cos_p, self.sin_p = (np.array([f(b.pitch) for b in blades]) for f in (np.cos, np.sin))
        half = [(b.width / 2, b.tip_radius / 2, b.thickness / 2) for b in blades]
        self.half = np.array(half).reshape(-1, 3)
        across = np.abs(self.sin_p) * self.half[:, 0] + np.abs(self.cos_p) * self.half[:, 2]
        # [m] of the farthest corner from the axis
        self.reach = np.hypot(2 * self.half[:, 1], across).max(initial=0.0)

    def mesh(self, time):
        return blade_triangles(self.deck, self.speed * time)

    def look(self, place, blade, time):
        """Distance (M,) [m] of centres `place` (M, 3) from the boxes `blade` (M,), and the unit normal (M, 3) to them."""
        turn = self.angle[blade] + self.speed * time
        c, s = np.cos(turn), np.sin(turn)
        cp, sp, half = self.cos_p[blade], self.sin_p[blade], self.half[blade]
        x = place[:, 0] - self.position[blade]
        y, z = place[:, 1], place[:, 2]
        across = c * z - s * y
        local = np.stack([cp * x + sp * across, c * y + s * z - half[:, 1], cp * across - sp * x], axis=1)
        out = local - np.clip(local, -half, half)
        distance = np.sqrt(np.einsum("ij,ij->i", out, out))
        inside = distance == 0
        if inside.any():  # out through the nearest face; only a very soft ball gets here
            depth = np.abs(local[inside]) - half[inside]
            face = depth.argmax(axis=1)
            row = np.arange(len(face))
            out[inside] = 0.0
            out[np.nonzero(inside)[0], face] = np.where(local[inside][row, face] < 0, 1.0, -1.0)
            distance[inside] = depth[row, face]
        normal = out / np.where(inside, -1.0, distance)[:, None]
        w, radial, h = normal.T
        across = sp * w + cp * h
        return distance, np.stack([cp * w - sp * h, c * radial - s * across, s * radial + c * across], axis=1)
