"""The inner cross-section of the drum, a circle or wavy: its arcs, outline, area, and the distance of a point from it.

A wavy profile (Figure 6 of the paper that `drum.profile = wavy` follows; docs/deck.md has the keys) is 2n circular
arcs of one radius rho between the radii R + h and R - h. They bulge outwards and inwards alternately and join with a
common tangent. Their centres are at the radius R - u (outer arcs) and R + u (inner arcs), pi/n apart. Neighbouring arcs
touch, so 2 rho = |C_i - C_o| with rho = u + h. This gives

    (1 - c) u^2 + 4 h u + 2 h^2 - (1 - c) R^2 = 0,    c = cos(pi/n),

and u is the larger root, the only one with rho > 0. It is positive up to h = R sin(pi/2n); for larger h the bulges
overhang. The area is that of the polygon of the centres plus the outer sectors minus the inner ones: n (R^2 - u^2)
sin(pi/n) + pi rho^2. This code is independent of the engine's code; the tests compare the two.
"""

import dataclasses
import math

import numpy as np

from milltools.base.errors import UserError

MOST_BUCKLES = 100_000


@dataclasses.dataclass(frozen=True)
class Arc:
    """A circular arc: `centre` (y, z) and `radius` [m]. It begins in the direction `start` [rad], from +y to +z, and
    turns by `turn` [rad]: positive for an outer arc, negative for an inner one, 2 pi for the circle."""

    centre: tuple[float, float]
    radius: float
    start: float
    turn: float

    def point(self, share):
        """Points (..., 2) [m] at shares 0..1 of the arc."""
        angle = self.start + np.asarray(share) * self.turn
        return np.stack([c + self.radius * f(angle) for c, f in zip(self.centre, (np.cos, np.sin))], axis=-1)


@dataclasses.dataclass(unsafe_hash=True)
class Profile:
    """Drum of `radius` R with n `buckles` of `height` h [m], one outermost point at `angle` [rad]; a circle if h = 0 or
    n = 0.

    Derived values: `outermost` and `innermost`: the largest and smallest distance of the wall from the axis; `step`:
    the angle between neighbouring centres, seen from the axis; `offset`: u; `arc_radius`: rho; `halves`: half of the
    angle of an outer and of an inner arc, seen from its centre; `neck`: half of the narrowest width of a bulge or of
    the wall between two bulges, whichever is smaller (infinite if neither narrows; not positive if there is no such
    profile); `area` [m^2] and `length` [m] of the whole outline."""

    radius: float
    buckles: int = 0
    height: float = 0.0
    angle: float = 0.0

    def __post_init__(self):
        radius, height = self.radius, self.height
        if not all(map(math.isfinite, (radius, height, self.angle))) or radius <= 0 or height < 0:
            raise ValueError(f"no profile: radius {radius} m, buckle height {height} m")
        if height > 0 and not 2 <= self.buckles <= MOST_BUCKLES:
            raise ValueError(f"no profile: {self.buckles} buckles, expected 2 to {MOST_BUCKLES}")
        if height >= radius:
            raise ValueError(f"no profile: buckle height {height} m reaches the axis")
        self.circle = height == 0 or self.buckles == 0
        self.outermost, self.innermost = (radius, radius) if self.circle else (radius + height, radius - height)
        if self.circle:
            self.arc_radius, self.halves, self.neck = radius, (math.pi, 0.0), math.inf
            self.area, self.length = math.pi * radius**2, 2 * math.pi * radius
            return
        self.step = math.pi / self.buckles
        a = 2 * math.sin(self.step / 2) ** 2  # 1 - cos(pi/n) without cancellation
        b, c = 4 * height, 2 * height**2 - a * radius**2
        self.offset = -2 * c / (b + math.sqrt(b * b - 4 * a * c))
        self.arc_radius = rho = self.offset + height
        near, far, sine = radius - self.offset, radius + self.offset, math.sin(self.step)
        inner = math.atan2(near * sine, far - near * math.cos(self.step))
        self.halves = inner + self.step, inner
        # the opening of a bulge between two inner arcs, and the narrowest wall between two outer arcs
        widths = (away * sine - rho for away, half in zip((far, near), self.halves) if half > math.pi / 2)
        self.neck = min(widths, default=math.inf)
        if not self.neck > 0:
            raise ValueError(f"no profile: {self.buckles} buckles of {height} m height overlap each other")
        self.area = self.buckles * (radius**2 - self.offset**2) * sine + math.pi * rho**2
        self.length = 2 * self.buckles * rho * sum(self.halves)

    @classmethod
    def of(cls, lookup) -> "Profile":
        """The profile of a deck; lookup(key, default) returns the SI text of "section.key", as `Deck.value` does."""
        if lookup("drum.radius", None) is None:
            raise UserError("the deck has no drum.radius")
        kind = lookup("drum.profile", "circle")
        if kind not in ("circle", "wavy"):
            raise UserError(f"drum.profile: expected 'circle' or 'wavy', got {kind!r}")
        keys = (
            {"radius": "", "buckles": "", "buckle_height": "", "buckle_angle": "0"}
            if kind == "wavy"
            else {"radius": ""}
        )
        found = []
        for key, default in keys.items():
            text = lookup(f"drum.{key}", default)
            try:
                found.append(float(text.split()[0]))
            except (ValueError, IndexError):
                raise UserError(f"drum.{key}: expected a number, got {text!r}") from None
        try:
            return cls(found[0], *map(int, found[1:2]), *found[2:])
        except (ValueError, OverflowError) as fault:
            raise UserError(str(fault)) from None

    @classmethod
    def of_run(cls, run) -> "Profile":
        """The profile of a milltools.read.runfile.Run."""
        try:
            return cls.of(run.as_deck.value)
        except UserError as fault:
            raise run.damaged("deck/drum", fault) from None

    # ---- arcs and outline

    def arcs(self) -> list[Arc]:
        """All arcs in their order around the axis, from the arc of the outermost point on."""
        if self.circle:
            return [Arc((0.0, 0.0), self.radius, self.angle, 2 * math.pi)]
        found = []
        for k in range(2 * self.buckles):
            at, side, half = self.angle + k * self.step, (-1, 1)[k % 2], self.halves[k % 2]  # side < 0: an outer one
            away = self.radius + side * self.offset
            start = at - half if side < 0 else at + math.pi + half
            found.append(Arc((away * math.cos(at), away * math.sin(at)), self.arc_radius, start, -2 * side * half))
        return found

    def outline(self, tolerance=None) -> np.ndarray:
        """Polygon (N, 2) of (y, z) [m] with its corners on the wall, counter-clockwise; the first corner is not
        repeated at the end. Its distance from the wall is at most `tolerance` [m] (default: R/2000)."""
        tolerance = self.radius / 2000 if tolerance is None else tolerance
        if not tolerance > 0:
            raise ValueError(f"tolerance {tolerance} m: expected more than 0")
        rho = self.arc_radius
        widest = 4 * math.asin(math.sqrt(min(tolerance / (2 * rho), 0.5)))  # a chord's angle
        pieces = []
        for arc in self.arcs():
            least = 3 if self.circle else 1
            count = max(least, math.ceil(abs(arc.turn) / widest))
            pieces.append(arc.point(np.arange(count) / count))
        return np.concatenate(pieces)

    # ---- distances

    def gap(self, y, z, radius=0.0) -> np.ndarray:
        """Distance [m] of the surface of balls with their centres at (y, z) from the wall; negative if they penetrate
        it. Arrays.

        The profile is symmetric about the ray from the axis through each centre of an arc. So the nearest point of the
        wall is between the same two rays as the ball, on half an outer arc or half an inner arc."""
        y, z = np.broadcast_arrays(np.asarray(y, float), np.asarray(z, float))
        away = np.hypot(y, z)
        if self.circle:
            return self.radius - away - radius
        angle = (np.arctan2(z, y) - self.angle) % (2 * self.step)
        angle = np.minimum(angle, 2 * self.step - angle)  # 0: at the outer arc, step: at the inner
        y, z = away * np.cos(angle), away * np.sin(angle)
        rho, near, far = self.arc_radius, self.radius - self.offset, self.radius + self.offset
        # relative to the centre of the outer arc, then of the inner arc
        outer_y, outer_z = y - near, z
        cosine, sine = math.cos(self.step), math.sin(self.step)
        inner_y, inner_z = far - (cosine * y + sine * z), sine * y - cosine * z
        join = (near + far * cosine) / 2, far * sine / 2
        to_join = np.hypot(y - join[0], z - join[1])
        from_outer, from_inner = np.hypot(outer_y, outer_z), np.hypot(inner_y, inner_z)
        half_outer, half_inner = self.halves
        faces_outer = np.arctan2(outer_z, outer_y) <= half_outer
        faces_inner = np.arctan2(inner_z, inner_y) <= half_inner
        distance = np.minimum(
            np.where(faces_outer, np.abs(rho - from_outer), to_join),
            np.where(faces_inner, np.abs(from_inner - rho), to_join),
        )
        # the line through the two centres divides the chamber into the side of the axis and the far side
        across = (far * cosine - near) * z - far * sine * (y - near)
        inside = np.where(across >= 0, from_inner > rho, from_outer < rho)
        return np.where(inside, distance, -distance) - radius
