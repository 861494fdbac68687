"""What a picture shows of a mill besides its balls, from the run's own geometry, as triangles.

A surface is an array (T, 3, 3): triangles, their corners, (x, y, z) in m, counter-clockwise from outside. The rotor is at
angle 0: pictures turn it. Drum and shaft are the true ones; rims and the shaft's stub are there to be looked at.
"""

import dataclasses

import numpy as np

from milltools.profile import Profile
from milltools.solids import FACES, blade_corners, circle, prism

FLATNESS = 1 / 1500  # how far a flat may be off the true surface, of the drum's radius
RIM_WIDTH, RIM_LENGTH = (
    0.045,
    0.045,
)  # of a rim, beyond the wall and along the axis; of the drum's outermost radius
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
    def rim_width(self) -> float:
        """[m]; where the wall bulges inwards, less than what it bulges by."""
        return min(self.profile.outermost * RIM_WIDTH, 0.7 * self.profile.arc_radius)

    @property
    def rim_radius(self) -> float:
        """Largest radius of the rims [m]."""
        return self.profile.outermost + self.rim_width

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
        return _strip(self._wall(-self.half), self._wall(self.half))

    def rims(self) -> list[np.ndarray]:
        """A band at either end, along the wall and outside of it."""
        found = []
        for low in (-self.half - self.rim_length, self.half):
            high = low + self.rim_length
            rings = [
                self._wall(x, beyond)
                for x, beyond in (
                    (low, 0.0),
                    (low, self.rim_width),
                    (high, self.rim_width),
                    (high, 0.0),
                )
            ]
            around = zip(rings, (*rings[1:], rings[0]), strict=True)
            found.append(np.concatenate([_strip(a, b) for a, b in around]))
        return found

    def _wall(self, x, beyond=0.0):
        """Points (N, 3) around the wall at x, `beyond` [m] outside of it."""
        steps = []
        for arc in self.profile.arcs():
            least = 3 if self.profile.circle else 1
            widest = 2 * np.arccos(max(1 - self.flatness / arc.radius, 0.0))
            share = np.arange(max(least, int(np.ceil(abs(arc.turn) / widest))))
            radius = arc.radius + (beyond if arc.outer else -beyond)
            wider = dataclasses.replace(arc, radius=radius)
            steps.append(wider.point(share / len(share)))
        return np.insert(np.concatenate(steps), 0, x, axis=1)

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


def _strip(one, two):
    """Triangles between two closed rings (N, 3) of as many points."""
    one_next, two_next = np.roll(one, -1, axis=0), np.roll(two, -1, axis=0)
    return np.concatenate(
        [np.stack([one, one_next, two_next], axis=1), np.stack([one, two_next, two], axis=1)]
    )
