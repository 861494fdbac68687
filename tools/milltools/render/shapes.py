"""What a picture shows of a mill besides its balls, from the run's own geometry, as triangles.

A surface is an array (T, 3, 3): triangles, their corners, (x, y, z) in m, counter-clockwise from outside. The rotor is at
angle 0: pictures turn it. Drum and shaft are the true ones; rims and the shaft's stub are there to be looked at.
"""

import dataclasses

import numpy as np

from milltools.profile import Profile
from milltools.solids import FACES, blade_corners, circle, prism

FLATNESS = 1 / 1500  # how far a flat may be off the true surface, of the drum's radius
RIM_WIDTH, RIM_LENGTH = 0.045, 0.045  # of a rim, beyond the wall and along the axis; of the drum's outermost radius
STUB = 0.10  # the shaft stands out of the drum so far, of its outermost radius


@dataclasses.dataclass(frozen=True)
class Mill:
    """Sizes of a mill [m]: the drum's `profile` and half its length, the shaft's radius (0: none), its blades."""

    profile: Profile
    half: float
    shaft_radius: float
    blades: tuple

    @classmethod
    def of(cls, run) -> "Mill":
        """From a milltools.runfile.Run."""
        return cls(
            Profile.of(run.deck().get),
            run.quantity("drum/length") / 2,
            run.quantity("rotor/shaft_radius", 0.0) if run.has_rotor else 0.0,
            tuple(run.blades()) if run.has_rotor else (),
        )

    @property
    def flatness(self) -> float:
        """[m]"""
        return self.profile.radius * FLATNESS

    @property
    def rim_radius(self) -> float:
        """Outer radius of the rims [m]."""
        return self.profile.outermost * (1 + RIM_WIDTH)

    @property
    def rim_length(self) -> float:
        """[m]"""
        return self.profile.outermost * RIM_LENGTH

    @property
    def stub(self) -> float:
        """How far the shaft reaches from the drum's middle [m]."""
        return self.half + self.profile.outermost * STUB

    def hull(self) -> np.ndarray:
        """Points (K, 3) [m] that are in the picture if the whole mill is: its rims, and the shaft's ends."""
        outline = circle(self.rim_radius, self.rim_radius / 300)
        ends = [np.insert(outline, 0, x, axis=1) for x in (-self._reach, self._reach)]
        if self.shaft_radius > 0:
            stub = circle(self.shaft_radius, self.shaft_radius / 50)
            ends += [np.insert(stub, 0, x, axis=1) for x in (-self.stub, self.stub)]
        return np.concatenate(ends)

    @property
    def _reach(self) -> float:
        return self.half + self.rim_length

    # ---- surfaces

    def tube(self) -> np.ndarray:
        """The drum's wall, one layer, seen from outside."""
        points = self.profile.outline(self.flatness)
        near, far = (np.insert(points, 0, x, axis=1) for x in (-self.half, self.half))
        near_next, far_next = np.roll(near, -1, axis=0), np.roll(far, -1, axis=0)
        return np.concatenate(
            [
                np.stack([near, near_next, far_next], axis=1),
                np.stack([near, far_next, far], axis=1),
            ]
        )

    def rims(self) -> list[np.ndarray]:
        """A ring at either end: inside the drum's profile, outside a circle."""
        hole = self.profile.outline(self.flatness)
        hole = np.roll(hole, -int(np.argmax(np.hypot(*hole.T))), axis=0)
        angle = float(np.arctan2(hole[0, 1], hole[0, 0]))
        rim = circle(self.rim_radius, self.flatness, angle)
        return [
            prism(rim, low, low + self.rim_length, hole)
            for low in (-self.half - self.rim_length, self.half)
        ]

    def shaft(self) -> np.ndarray | None:
        """The shaft with its stubs; None without one."""
        if not self.shaft_radius > 0:
            return None
        outline = circle(self.shaft_radius, min(self.flatness / 2, self.shaft_radius / 100))
        return prism(outline, -self.stub, self.stub)

    def blade_boxes(self) -> np.ndarray:
        """The eight corners of every blade (B, 8, 3), in the order of solids.CORNERS."""
        corners = [blade_corners(blade, self.shaft_radius) for blade in self.blades]
        return np.array(corners).reshape(-1, 8, 3)

    def blade_triangles(self) -> np.ndarray:
        """All blades as triangles."""
        found = []
        for corner in self.blade_boxes():
            for a, b, c, d in FACES:
                found += [corner[[a, b, c]], corner[[a, c, d]]]
        return np.array(found).reshape(-1, 3, 3)
