"""What a deck is in LIGGGHTS: the frame of the simulation, and the walls in it.

The frame moves with the middle of what holds the balls and does not turn: x is along that container's axis, as it is at t = 0. So a
planetary jar, a shaken box or a drum on a shaker stand still there, as exact primitives, and all that their path does is a
uniform force, m (g - a(t)). Contacts, normal speeds and what is lost are the same in such a frame; the rest is brought back to
the laboratory. A container that turns about its axis has a moving surface, one of flat facets turns as a mesh.
"""

import functools

import numpy as np

from milltools.base.errors import UserError
from milltools.dem.boxes import Boxes
from milltools.dem.facets import axes, copies, fault, own_triangles
from milltools.dem.paths import Chain, Rotation, formula, motion
from milltools.dem.walls import Cylinder, Ends, Flats

CURVED = "LIGGGHTS has no such primitive, and on a curved wall of triangles it adds up the forces of neighbours, which changes restitution"  # fmt: skip
SHAFT, BLADE = 3, 4  # kinds


class Frame:
    """rows (3, 3): the directions of the frame's x, y and z in the laboratory; track: the path of its origin there."""

    def __init__(self, rows, track, gravity):
        self.rows, self.track, self.g = rows, track, np.array(gravity)
        self.moves = bool(np.abs(track.rate).max() > 0)
        self.is_laboratory = not self.moves and np.array_equal(rows, np.eye(3)) and not track(0).any()  # fmt: skip

    def to_laboratory(self, time, place, velocity, spin):
        """The state (N, 3) there of balls in the frame."""
        if self.is_laboratory:
            return place, velocity, spin
        velocity = velocity @ self.rows + self.track(time, 1)
        return place @ self.rows + self.track(time), velocity, spin @ self.rows

    def from_laboratory(self, time, place, velocity, spin):
        """The other way."""
        if self.is_laboratory:
            return [place, velocity, spin]
        place, velocity = place - self.track(time), velocity - self.track(time, 1)
        return [values @ self.rows.T for values in (place, velocity, spin)]

    def gravity(self, time):
        """(3,) [m/s^2] in the frame, with what its motion adds."""
        return self.rows @ (self.g - self.track(time, 2))

    def lines(self, begin, step):
        """LIGGGHTS' commands for gravity; `begin` [s]: the time at step 0."""
        if not self.moves:
            g = self.rows @ self.g
            words = " ".join(f"{v:.17g}" for v in g)
            return [f"fix weight all gravity {np.sqrt(g @ g):.17g} vector {words}"] * bool(g.any())
        said, upper = [], self.track.rate > 0
        rate = self.track.rate[upper]
        push = 2 * rate[:, None] ** 2 * (self.track.value[upper] @ self.rows.T)
        for axis, constant, waves in zip("xyz", self.rows @ self.g, push.T, strict=True):
            waves = list(zip(np.abs(waves), rate, np.angle(waves), strict=True))
            said.append(f"variable push_{axis} equal {formula(constant, waves, begin, step)}")
            way = " ".join("1" if axis == other else "0" for other in "xyz")
            said.append(f"fix weight_{axis} all gravity v_push_{axis} vector {way}")
        return said


class Scene:
    """walls: of milltools.dem.walls; frame: a Frame; chain: the motions that carry the container; spin: its Rotation in the frame,
    or None; half (3,) [m]: of the box that holds all; speed [m/s]: of the fastest surface."""

    def __init__(self, deck):
        self.deck = deck
        inside = [name for name in deck.bodies if deck.value(f"body.{name}.side") == "inside"]
        self.vessel = inside[0] if inside else ""
        self.place = f"body.{self.vessel}" if self.vessel else "drum"
        self.chain = Chain(deck, deck.value(f"{self.place}.motion", ""))
        rows, middle = axes(deck, self.vessel) if self.vessel else (np.eye(3), np.zeros(3))
        turn, _ = self.chain.pose(0.0)
        self.frame = Frame(rows @ turn.T, self.chain.point(middle), deck.numbers("gravity.acceleration"))
        try:
            spin = self.chain.spin()
        except UserError as reason:
            raise self._refused(f"{reason}, and LIGGGHTS turns a wall about one axis") from None
        self.spin = spin.seen(self.frame.rows, np.zeros(3)) if spin else None
        self.moves = self.frame.moves or self.spin is not None
        self.half, self.inner = np.zeros(3), np.full(3, np.inf)
        self.walls = self._container() + self._rotor()
        for name in deck.bodies:
            self.walls += self._body(name) if name != self.vessel else []
        self.half += max(kind.diameter for kind in deck.species)
        self.speed = self._fastest()

    def _refused(self, reason):
        return UserError(f"{self.deck.path}: [{self.place}] motion: {reason}")

    # ---- what holds the balls

    def _container(self):
        shape = self.deck.value(f"{self.place}.shape") if self.vessel else "drum"
        if shape in ("drum", "cylinder"):
            return self._round()
        if shape not in ("box", "mesh"):
            raise fault(self.deck, self.vessel, "shape", f"expected cylinder, box or mesh, got {shape}: {CURVED}")  # fmt: skip
        triangles = own_triangles(self.deck, self.vessel)
        corner = np.abs(triangles).reshape(-1, 3)
        still = self.spin is None
        self.half = corner.max(axis=0) if still else np.resize(np.linalg.norm(corner, axis=1).max(), 3)  # fmt: skip
        planes = None
        if shape == "box" and still:
            planes = [
                (f"side{k}", f"{axis}plane {sign * size:.17g}", None)
                for k, (axis, sign, size) in enumerate(zip("xxyyzz", (-1, 1) * 3, np.repeat(self.half, 2), strict=True))
            ]  # fmt: skip
        kind = self.deck.kinds.index(self.deck.kind_of(self.vessel))
        return [Flats(kind, triangles, -1, motion=self.spin, planes=planes)]

    def _round(self):
        deck, spin = self.deck, self.spin
        radius, length = deck.number(f"{self.place}.radius"), deck.number(f"{self.place}.length")
        kinds = deck.kinds.index(deck.kind_of(self.vessel)) if self.vessel else 1
        kinds = (kinds, kinds) if self.vessel else (1, 2)
        rubs = [deck.contact(deck.kinds[kind]).friction > 0 for kind in kinds]
        self.inner = np.array([length / 2, radius, radius])
        self.half = self.inner.copy()
        if spin:
            if abs(abs(spin.axis[0]) - 1) > 1e-9:
                raise self._refused("it turns about another axis than its own: LIGGGHTS' round walls lie along x, y or z")  # fmt: skip
            if spin.swings and any(rubs):
                raise self._refused("it swings to and fro about its own axis: the surface of LIGGGHTS' round walls turns at a constant speed only")  # fmt: skip
            self.half[1:] = 4.5 * radius if rubs[1] else radius  # there are large facets
        rolling = [radius - kind.diameter / 2 for kind in deck.species]
        rolling = rolling if spin and rubs[0] else ()
        return [
            Cylinder(kinds[0], "drum", radius, -1.0, spin, rolling, partner=0 if self.vessel else -1),
            Ends(kinds[1], length / 2, 0 if self.vessel else None, spin, radius if spin and rubs[1] else None),
        ]  # fmt: skip

    # ---- what is in it

    def _rotor(self):
        deck, walls = self.deck, []
        if self.moves and (deck.shaft_radius > 0 or deck.blades):
            raise self._refused("what holds the balls moves beside a rotor: mill dem knows the forces on all of them only")  # fmt: skip
        if deck.shaft_radius > 0:
            turning = motion(deck, "rotor")
            rolling = [deck.shaft_radius + kind.diameter / 2 for kind in deck.species]
            walls.append(Cylinder(SHAFT, "shaft", deck.shaft_radius, 1.0, turning, rolling))
        return walls + ([Boxes(deck)] if deck.blades else [])

    def _body(self, name):
        deck, place = self.deck, f"body.{name}"
        shape = deck.value(f"{place}.shape")
        if shape not in ("box", "mesh"):
            raise fault(deck, name, "shape", f"expected box or mesh, got {shape}: {CURVED}")
        if deck.number(f"{place}.rounding", 0.0) > 0:
            raise fault(deck, name, "rounding", CURVED)
        chain = Chain(deck, deck.value(f"{place}.motion", ""))
        moving = [one for one in chain.motions if one.fastest() > 0]
        if self.moves and chain.name != self.chain.name:
            raise fault(deck, name, "motion", "what holds the balls moves, and it does not ride with it: mill dem knows the forces on all of them only")  # fmt: skip
        if not self.moves and len(moving) > 1:
            raise fault(deck, name, "motion", f"it rides on {len(moving)} motions: mill dem moves a mesh by one")  # fmt: skip
        turn, to = chain.pose(0.0)
        rows, origin = self.frame.rows, self.frame.track(0.0)
        path = self.spin if self.moves else self._seen(chain, moving)
        kind = deck.kinds.index(deck.kind_of(name))
        walls = [
            Flats(kind, (triangles @ turn.T + to - origin) @ rows.T, 1, k, path)
            for k, triangles in enumerate(copies(deck, name))
        ]
        for wall in walls:
            self.half = np.maximum(self.half, wall.reach())
        return walls

    def _seen(self, chain, moving):
        """A body's one motion in the frame, which stands still."""
        if not moving:
            return None
        (one,) = moving
        outer = chain.motions[chain.motions.index(one) + 1 :]
        turn, to = np.eye(3), np.zeros(3)
        for still in outer:
            by, shift = still.pose(0.0)
            turn, to = by @ turn, by @ to + shift
        rows = self.frame.rows
        return one.seen(rows @ turn, turn.T @ (self.frame.track(0.0) - to))

    def meshes(self, time):
        """[(name, kind, triangles (T, 3, 3), motion)] of all meshes: blades ("rotor"), and bodies of one kind and motion."""
        found = {}
        for wall in self.walls:
            triangles = wall.mesh(time)
            if len(triangles):
                name = wall.motion.name if wall.motion else ""
                key = wall.kind if isinstance(wall, Boxes) else (wall.kind, name)
                found.setdefault(key, []).append((wall, triangles))
        return [
            ("rotor" if key == BLADE else f"mesh{k}", walls[0][0].kind, np.concatenate([t for _, t in walls]), walls[0][0].motion)
            for k, (key, walls) in enumerate(found.items())
        ]  # fmt: skip

    @property
    def driven(self):
        """[(name of a motion, name of a mesh)] of the meshes whose work LIGGGHTS tells by itself, blades apart; where what holds
        the balls moves there are none: that work is the balance of momentum's."""
        return [] if self.moves else [
            (motion.name, name) for name, kind, _, motion in self.meshes(0.0) if motion and kind != BLADE
        ]  # fmt: skip

    def _fastest(self):
        """A rotor's tips, as far as there is one; else of all walls."""
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

    def own(self, time, place, velocity):
        """Places and velocities (N, 3) as the container's own frame sees them, which turns with it."""
        if self.spin is None:
            return place, velocity
        turn, _ = self.spin.pose(time)
        return place @ turn, (velocity - np.cross(self.spin.field(time)[0], place)) @ turn


scene_of = functools.lru_cache(maxsize=8)(Scene)
