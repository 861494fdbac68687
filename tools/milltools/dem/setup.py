"""The deck in LIGGGHTS: the frame of the simulation, and the walls in this frame.

The frame moves with the middle of the container and does not turn: x is along the container's axis at t = 0. So a
planetary jar, a shaken box or a drum on a shaker is at rest in this frame and can be made of exact primitives; the
path of the container only adds a uniform force, m (g - a(t)). Contacts, normal speeds and losses are the same in such
a frame; other results are transformed back to the laboratory. A round container that turns about its axis has a moving
surface; a container of flat facets turns as a mesh.
"""

import functools
import typing

import numpy as np

from milltools.base.errors import UserError
from milltools.dem.meshes import BLADE, CURVED, SHAFT, Wall, axes, copies, cylinder, ends, fault, lining, own_triangles
from milltools.dem.paths import Chain, Rotation, motion
from milltools.geometry.bodies import moved
from milltools.geometry.solids import blade_triangles

ALONE = "mill dem can then compute only the sum of the forces on all walls"


class Frame:
    """rows (3, 3): the directions of the frame's x, y and z in the laboratory; track: the path of its origin there."""

    def __init__(self, rows, track, gravity):
        self.rows, self.track, self.g = rows, track, np.array(gravity)
        self.moves = bool(np.abs(track.rate).max() > 0)

    def from_laboratory(self, time, place, velocity, spin):
        """The state (N, 3) in the frame of balls in the laboratory."""
        place, velocity = place - self.track(time), velocity - self.track(time, 1)
        return [values @ self.rows.T for values in (place, velocity, spin)]

    def of(self, time):
        """Its origin (3,), velocity (3,) and directions (3, 3), one after the other: (15,)."""
        return np.concatenate([self.track(time), self.track(time, 1), self.rows.ravel()])

    def gravity(self, time):
        """(3,) [m/s^2], or (T, 3) at times (T,), in the frame, with the inertial force of the frame's motion."""
        return (self.g - self.track(time, 2)) @ self.rows.T

    @property
    def pushes(self):
        """gravity() along x, y and z as functions of time, in the form of Rotation.rates."""
        upper = self.track.rate > 0
        rate = self.track.rate[upper]
        push = 2 * rate[:, None] ** 2 * (self.track.value[upper] @ self.rows.T)
        waves = [list(zip(np.abs(along), rate, np.angle(along), strict=True)) for along in push.T]
        return list(zip(self.rows @ self.g, waves, strict=True))


class Mesh(typing.NamedTuple):
    """Triangles (T, 3, 3) that LIGGGHTS moves as one; motion: a Rotation or Shift, or None."""

    name: str
    kind: int
    motion: object
    triangles: np.ndarray

    @property
    def file(self):
        """The name of its file."""
        return "blades.stl" if self.name == "rotor" else f"{self.name}.stl"


class Setup:
    """walls: of milltools.dem.meshes; frame: a Frame; chain: the motions that carry the container; spin: its Rotation
    in the frame, or None; half (3,) [m]: of the box that holds all; speed [m/s]: of the fastest surface;
    shafts: names of the primitives of a shaft that has friction."""

    def __init__(self, deck):
        self.deck = deck
        if deck.periodic and (deck.bodies or deck.blades):
            raise UserError(
                f"{deck.path}: [drum] ends: with periodic ends mill dem can run a drum with its profile and a shaft, "
                "but no blades and bodies, which LIGGGHTS would cut there: set 'ends = walls'"
            )
        inside = [name for name in deck.bodies if deck.value(f"body.{name}.side") == "inside"]
        self.vessel = inside[0] if inside else ""
        self.place = f"body.{self.vessel}" if self.vessel else "drum"
        self.chain = Chain(deck, deck.value(f"{self.place}.motion", ""))
        rows, middle = axes(deck, self.vessel) if self.vessel else (np.eye(3), np.zeros(3))
        self.frame = Frame(
            rows @ self.chain.pose(0.0)[:, :3].T, self.chain.point(middle), deck.numbers("gravity.acceleration")
        )
        try:
            spin = self.chain.spin()
        except UserError as reason:
            raise self._refused(f"{reason}, and LIGGGHTS turns a wall about one axis") from None
        self.spin = spin and spin.seen(np.column_stack([self.frame.rows, np.zeros(3)]))
        self.moves = self.frame.moves or self.spin is not None
        self.half, self.inner = np.zeros(3), np.full(3, np.inf)
        self.walls = self._container() + self._rotor()
        for name in deck.bodies:
            self.walls += self._body(name) if name != self.vessel else []
        self.half[deck.periodic :] += max(kind.diameter for kind in deck.species)
        self.speed = self._fastest()
        rubs = deck.contact(deck.kinds[SHAFT]).friction > 0
        self.shafts = [name for wall in self.walls if wall.kind == SHAFT and rubs for name, *_ in wall.primitives]

    def _refused(self, reason):
        return UserError(f"{self.deck.path}: [{self.place}] motion: {reason}")

    # ---- the container

    def _container(self):
        shape = self.deck.value(f"{self.place}.shape") if self.vessel else "drum"
        if shape == "cylinder":
            return self._round(self.deck.number(f"{self.place}.radius"))
        if shape in ("drum", "contour"):
            return self._round(*lining(self.deck, self.place))
        if shape not in ("box", "mesh"):
            raise fault(
                self.deck, self.vessel, "shape", f"expected cylinder, box, contour or mesh, got {shape}: {CURVED}"
            )
        triangles = own_triangles(self.deck, self.vessel)
        corner, still = np.abs(triangles).reshape(-1, 3), self.spin is None
        self.half = corner.max(axis=0) if still else np.full(3, np.linalg.norm(corner, axis=1).max())
        kind = self.deck.kinds.index(self.deck.kind_of(self.vessel))
        if shape == "mesh" or not still:
            return [Wall(kind, (), self.spin, triangles)]
        places = zip("xxyyzz", np.repeat(self.half, 2) * [-1, 1, -1, 1, -1, 1], strict=True)
        return [Wall(kind, [(f"side{k}", f"{axis}plane {at:.17g}", "", None) for k, (axis, at) in enumerate(places)])]

    def _round(self, radius, mantle=True, sides=()):
        """A cylinder with flat ends, of which only a part may be there (`mantle`), and flat sides within it."""
        deck, spin, length = self.deck, self.spin, self.deck.number(f"{self.place}.length")
        kinds = [deck.kinds.index(deck.kind_of(self.vessel))] * 2 if self.vessel else (1, 2)
        rubs = [deck.contact(deck.kinds[kind]).friction > 0 for kind in kinds]
        self.inner = np.array([length / 2, radius, radius])
        self.half = self.inner.copy()
        if spin:
            if abs(abs(spin.axis[0]) - 1) > 1e-9:
                raise self._refused("it does not turn about its own axis: LIGGGHTS' round walls lie along x, y or z")
            if spin.swings and any(rubs):
                raise self._refused(
                    "it swings about its own axis: the surface of LIGGGHTS' round walls can only turn at a constant "
                    "speed"
                )
            self.half[1:] = 4.5 * radius if rubs[1] and not deck.periodic else radius  # with large facets at the ends
        rolling = [radius - kind.diameter / 2 for kind in deck.species] if spin and rubs[0] else ()
        walls = [cylinder(kinds[0], "drum", radius, spin, rolling)] if mantle else []
        walls += [Wall(kinds[0], (), spin, sides)] if len(sides) else []
        if not deck.periodic:
            walls.append(ends(kinds[1], length / 2, spin, radius if spin and rubs[1] else None))
        return walls

    # ---- bodies in the container

    def _rotor(self):
        deck, walls = self.deck, []
        if self.moves and (deck.shaft_radius > 0 or deck.blades):
            raise self._refused(f"cannot run a rotor in a moving container: {ALONE}")
        if deck.shaft_radius > 0:
            rolling = [deck.shaft_radius + kind.diameter / 2 for kind in deck.species]
            walls.append(cylinder(SHAFT, "shaft", deck.shaft_radius, motion(deck, "rotor"), rolling))
        if deck.blades:
            walls.append(Wall(BLADE, (), motion(deck, "rotor"), blade_triangles(deck, 0.0)))
        return walls

    def _body(self, name):
        deck, place = self.deck, f"body.{name}"
        shape = deck.value(f"{place}.shape")
        if shape not in ("box", "contour", "mesh"):
            raise fault(deck, name, "shape", f"expected box, contour or mesh, got {shape}: {CURVED}")
        if deck.number(f"{place}.rounding", 0.0) > 0:
            raise fault(deck, name, "rounding", CURVED)
        chain = Chain(deck, deck.value(f"{place}.motion", ""))
        moving = [(one, carrier) for one, carrier in zip(chain.motions, chain.carriers) if one.fastest() > 0]
        if self.moves and chain.name != self.chain.name:
            raise fault(deck, name, "motion", f"the container moves, and this body does not move with it: {ALONE}")
        if not self.moves and len(moving) > 1:
            raise fault(
                deck, name, "motion", f"{len(moving)} motions carry this body: mill dem can move a mesh by only one"
            )
        path = self.spin if self.moves else next((one.seen(self._pose(carrier)) for one, carrier in moving), None)
        kind = deck.kinds.index(deck.kind_of(name))
        walls = [Wall(kind, (), path, moved(self._pose(chain.whole), triangles)) for triangles in copies(deck, name)]
        for wall in walls:
            self.half = np.maximum(self.half, wall.reach())
        return walls

    def _pose(self, whole):
        """The place in the frame at t = 0 of a point that has these Harmonics in the laboratory."""
        start = whole(0.0)[:3]
        start[:, 3] -= self.frame.track(0.0)
        return self.frame.rows @ start

    def meshes(self, time):
        """All meshes: blades ("rotor"), and bodies of one kind and motion."""
        found = {}
        for wall in self.walls:
            if len(triangles := wall.mesh(time)):
                found.setdefault((wall.kind, wall.motion and wall.motion.name), (wall.motion, []))[1].append(triangles)
        return [
            Mesh("rotor" if kind == BLADE else f"mesh{k}", kind, motion, np.concatenate(triangles))
            for k, ((kind, _), (motion, triangles)) in enumerate(found.items())
        ]

    @functools.cached_property
    def driven(self):
        """The meshes, without blades, whose work LIGGGHTS computes. There are none if the container moves: the
        balance of momentum then gives the work."""
        meshes = [] if self.moves else self.meshes(0.0)
        return [mesh for mesh in meshes if mesh.motion and mesh.kind != BLADE]

    def _fastest(self):
        """The largest speed [m/s]: of the rotor's tips, added to that of all other moving walls."""
        deck = self.deck
        tip = max((blade.tip_radius for blade in deck.blades), default=deck.shaft_radius)
        speeds = [abs(deck.rotor_speed) * tip]
        if not deck.named("motion"):
            return speeds[0] or 1.0
        if self.frame.moves:
            speeds.append(max(np.linalg.norm(self.frame.track(t, 1)) for t in self.chain.times))
        reach = np.linalg.norm(np.minimum(self.half, self.inner))
        for path in {wall.motion.name: wall.motion for wall in self.walls if wall.motion}.values():
            speeds.append(path.fastest() * reach if isinstance(path, Rotation) else path.fastest())
        return sum(speeds) or 1.0


setup_of = functools.lru_cache(maxsize=8)(Setup)
