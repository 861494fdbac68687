"""The drum's inner cross-section, circle or wavy: its arcs, outline, area, and how far a point is from it.

A wavy profile (Figure 6 of the paper that `drum.profile = wavy` follows; docs/deck.md has the keys) is 2n circular arcs of
one radius rho, bulging outwards and inwards in turn, tangent where they join, between the radii R + h and R - h.
Centres lie at R - u (outer arcs) and R + u (inner arcs), pi/n apart; that neighbours touch, 2 rho = |C_i - C_o| with
rho = u + h, gives

    (1 - c) u^2 + 4 h u + 2 h^2 - (1 - c) R^2 = 0,    c = cos(pi/n),

and u is its larger root: the only one with rho > 0. It is positive up to h = R sin(pi/2n); beyond, bulges overhang.
The polygon of the centres with the outer sectors added and the inner ones taken away has the area
n (R^2 - u^2) sin(pi/n) + pi rho^2. This is written from that formula alone, without the engine's code: the tests hold
the two against each other.
"""

import dataclasses
import math

import numpy as np

from milltools.base.errors import UserError

MOST_BUCKLES = 100_000


@dataclasses.dataclass(frozen=True)
class Arc:
    """A circular arc: `centre` (y, z) and `radius` [m], from the direction `start` counted from +y to +z through `turn`
    [rad]: positive, around the axis, for an outer arc; negative for an inner one; 2 pi for the circle."""

    centre: tuple[float, float]
    radius: float
    start: float
    turn: float

    @property
    def outer(self) -> bool:
        return self.turn > 0

    def point(self, share):
        """Points (..., 2) [m] at shares 0..1 of the arc."""
        angle = self.start + np.asarray(share) * self.turn
        return np.stack(
            [
                self.centre[0] + self.radius * np.cos(angle),
                self.centre[1] + self.radius * np.sin(angle),
            ],
            axis=-1,
        )


@dataclasses.dataclass(frozen=True)
class Profile:
    """Drum of `radius` R with n `buckles` of `height` h [m], one outermost point at `angle` [rad]; a circle if h = 0 or n = 0."""

    radius: float
    buckles: int = 0
    height: float = 0.0
    angle: float = 0.0

    def __post_init__(self):
        numbers = (self.radius, self.height, self.angle)
        if not all(map(math.isfinite, numbers)) or self.radius <= 0 or self.height < 0:
            raise ValueError(f"no profile: radius {self.radius} m, buckle height {self.height} m")
        if self.height > 0 and not 2 <= self.buckles <= MOST_BUCKLES:
            raise ValueError(f"no profile: {self.buckles} buckles, expected 2 to {MOST_BUCKLES}")
        if self.height >= self.radius:
            raise ValueError(f"no profile: buckle height {self.height} m reaches the axis")
        if not self.circle and not self.neck > 0:
            raise ValueError(f"no profile: {self.buckles} buckles of {self.height} m run into each other")

    @classmethod
    def of(cls, lookup) -> "Profile":
        """From what a deck says; lookup(key, default) gives the SI text of "section.key": `Deck.value`."""

        def number(key, default):
            text = lookup(key, default)
            try:
                return float(text.split()[0])
            except (ValueError, IndexError):
                raise UserError(f"{key}: expected a number, got {text!r}") from None

        if lookup("drum.radius", None) is None:
            raise UserError("the deck has no drum.radius")
        kind = lookup("drum.profile", "circle")
        if kind not in ("circle", "wavy"):
            raise UserError(f"drum.profile: expected 'circle' or 'wavy', got {kind!r}")
        try:
            if kind == "circle":
                return cls(number("drum.radius", ""))
            buckles, height, angle = (
                number(f"drum.{k}", d) for k, d in (("buckles", ""), ("buckle_height", ""), ("buckle_angle", "0"))
            )
            return cls(number("drum.radius", ""), int(buckles), height, angle)
        except (ValueError, OverflowError) as fault:
            raise UserError(str(fault)) from None

    @classmethod
    def of_run(cls, run) -> "Profile":
        """From the deck of a milltools.read.runfile.Run."""
        try:
            return cls.of(run.as_deck.value)
        except UserError as fault:
            raise run.damaged("deck/drum", fault) from None

    # ---- sizes

    @property
    def circle(self) -> bool:
        return self.height == 0 or self.buckles == 0

    @property
    def step(self) -> float:
        """Angle between neighbouring centres, seen from the axis [rad]."""
        return math.pi / self.buckles

    @property
    def offset(self) -> float:
        """u [m]: how far the centres of outer arcs are inside of R, those of inner arcs outside."""
        if self.circle:
            return self.radius
        a = 2 * math.sin(self.step / 2) ** 2  # 1 - cos(pi/n) without cancellation
        b, c = 4 * self.height, 2 * self.height**2 - a * self.radius**2
        return -2 * c / (b + math.sqrt(b * b - 4 * a * c))

    @property
    def arc_radius(self) -> float:
        """rho [m]"""
        return self.radius if self.circle else self.offset + self.height

    @property
    def halves(self) -> tuple[float, float]:
        """Half of the angle of an outer and of an inner arc, seen from its centre [rad]; they differ by pi/n."""
        if self.circle:
            return math.pi, 0.0
        near, far = self.radius - self.offset, self.radius + self.offset
        inner = math.atan2(near * math.sin(self.step), far - near * math.cos(self.step))
        return inner + self.step, inner

    @property
    def outermost(self) -> float:
        """Largest distance of the wall from the axis [m]."""
        return self.radius + (0 if self.circle else self.height)

    @property
    def innermost(self) -> float:
        """Smallest distance of the wall from the axis [m]."""
        return self.radius - (0 if self.circle else self.height)

    @property
    def neck(self) -> float:
        """Half of the narrowest width of a bulge, or of what lies between two, whichever is less [m]; infinite where
        neither narrows, not positive where the formula has no profile."""
        if self.circle:
            return math.inf
        outer, inner = self.halves
        sine, widths = math.sin(self.step), [math.inf]
        if outer > math.pi / 2:  # the mouth of a bulge, between two inner arcs
            widths.append((self.radius + self.offset) * sine - self.arc_radius)
        if inner > math.pi / 2:  # the waist of what stands between two outer arcs
            widths.append((self.radius - self.offset) * sine - self.arc_radius)
        return min(widths)

    @property
    def area(self) -> float:
        """[m^2]"""
        if self.circle:
            return math.pi * self.radius**2
        return self.buckles * (self.radius**2 - self.offset**2) * math.sin(self.step) + math.pi * self.arc_radius**2

    @property
    def length(self) -> float:
        """All the way around [m]."""
        if self.circle:
            return 2 * math.pi * self.radius
        return 2 * self.buckles * self.arc_radius * sum(self.halves)

    # ---- arcs and outline

    def arcs(self) -> list[Arc]:
        """All arcs, around the axis from the outermost point's arc on, each beginning where the last one ends."""
        if self.circle:
            return [Arc((0.0, 0.0), self.radius, self.angle, 2 * math.pi)]
        found = []
        for k in range(2 * self.buckles):
            outer = k % 2 == 0
            at = self.angle + k * self.step
            away = self.radius - self.offset if outer else self.radius + self.offset
            centre = away * math.cos(at), away * math.sin(at)
            half = self.halves[k % 2]
            start = at - half if outer else at + math.pi + half
            found.append(Arc(centre, self.arc_radius, start, 2 * half if outer else -2 * half))
        return found

    def outline(self, tolerance=None) -> np.ndarray:
        """Closed polygon (N, 2) of (y, z) [m] with its corners on the wall, counter-clockwise, the last one not the first
        again; nowhere farther from the wall than `tolerance` [m] (default: R/2000)."""
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
        """Distance [m] of a ball's surface from the wall, < 0: it is in the wall by that much. Its centre (y, z), arrays.

        The profile is its own mirror image at the ray through each centre, so the nearest point of the wall lies between
        the same two rays as the ball: half an outer and half an inner arc are all there is to look at."""
        y, z = np.broadcast_arrays(np.asarray(y, float), np.asarray(z, float))
        away = np.hypot(y, z)
        if self.circle:
            return self.radius - away - radius
        angle = (np.arctan2(z, y) - self.angle) % (2 * self.step)
        angle = np.minimum(angle, 2 * self.step - angle)  # 0: at the outer arc, step: at the inner
        y, z = away * np.cos(angle), away * np.sin(angle)
        rho, near, far = self.arc_radius, self.radius - self.offset, self.radius + self.offset
        # as seen from the centre of the outer arc, then of the inner one
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
        # the line of the two centres parts the chamber: axis' side and far side
        across = (far * cosine - near) * z - far * sine * (y - near)
        inside = np.where(across >= 0, from_inner > rho, from_outer < rho)
        return np.where(inside, distance, -distance) - radius
