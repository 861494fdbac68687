"""The field's formulas for the power of a tumbling mill: one row of MODELS each, with its source, its basis and the
mills it was fitted to or checked on. docs/tumbling.md explains them. SI and radians; gravity is 9.81 m/s^2.

Angles of the charge go from 3 o'clock with the turning: of a mill that turns anticlockwise, anticlockwise.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import NamedTuple

from milltools.base.text import number

GRAVITY = 9.81
STEEL, WATER, ROCK = 7800.0, 1000.0, 2700.0
NET, SHELL, MOTOR = "charge net", "shell or pinion", "motor"  # where a power is taken
DISCHARGES = ("dry", "grate", "overflow")
REPOSE = math.radians(35)  # angle of the charge's surface, of Hogg & Fuerstenau: 30 to 40 degrees


@dataclasses.dataclass(frozen=True)
class Mill:
    """A horizontal drum that turns about its axis, and its charge. `diameter` inside the liners, `length` of the
    cylinder and `cone` of one of two conical ends [m]; `filling`: J, the bulk volume of the charge at rest over that of
    the cylinder; `speed`: the fraction of the critical speed of a point at the wall; `ball_filling`: the same of the
    balls alone (default: J); `voidage` of the charge; `ball`: the largest ball [m]. Densities [kg/m^3]; `pulp` fills
    the voids, 0: none; `charge`: of the whole charge, default: from the others. `trunnion`: radius of the opening of an
    overflow mill [m], default: a quarter of the mill's; `area`: of the cross-section [m^2], default: of the circle."""

    diameter: float
    length: float
    filling: float
    speed: float
    ball_density: float = STEEL
    ball_filling: float | None = None
    voidage: float = 0.4
    ore: float = ROCK
    pulp: float = 0.0
    charge: float | None = None
    discharge: str = "dry"
    trunnion: float | None = None
    cone: float = 0.0
    ball: float = math.nan
    area: float | None = None

    @property
    def critical(self) -> float:
        """The critical speed of a point at the wall [rad/s]: 42.3 rpm / sqrt(D)."""
        return math.sqrt(2 * GRAVITY / self.diameter)

    @property
    def critical_of_ball(self) -> float:
        """That of the largest ball, whose centre is half its diameter off the wall [rad/s]: 42.3 rpm / sqrt(D - d)."""
        return math.sqrt(2 * GRAVITY / (self.diameter - self.ball)) if self.ball < self.diameter else math.nan

    @property
    def rate(self) -> float:
        """Angular velocity [rad/s]."""
        return self.speed * self.critical

    @property
    def volume(self) -> float:
        """That J is a share of [m^3]."""
        return (math.pi / 4 * self.diameter**2 if self.area is None else self.area) * self.length

    @property
    def balls(self) -> float:
        """JB."""
        return self.filling if self.ball_filling is None else self.ball_filling

    @property
    def ball_mass(self) -> float:
        """Of all balls [kg]."""
        return (1 - self.voidage) * self.ball_density * self.balls * self.volume

    @property
    def density(self) -> float:
        """Of the charge with what fills its voids [kg/m^3]."""
        if self.charge is not None:
            return self.charge
        share = self.balls / self.filling
        return (1 - self.voidage) * (share * self.ball_density + (1 - share) * self.ore) + self.voidage * self.pulp


def pulp(ore: float, solids: float) -> float:
    """Density of a pulp of ore [kg/m^3] in water, with a share of solids in its mass."""
    return 1 / (solids / ore + (1 - solids) / WATER)


def toe_and_shoulder(mill: Mill) -> tuple[float, float]:
    """Where the charge of Morrell's C-model ends and begins at the wall [rad]: the toe, where what falls lands, and the
    shoulder, where balls leave. The charge spans 2 pi + shoulder - toe."""
    filling, speed = mill.filling, mill.speed
    highest = max(0.35 * (3.364 - filling), speed)  # the speed at which all of the charge centrifuges
    toe = math.pi / 2 + 2.5307 * (1.2796 - filling) * (1 - math.exp(-19.42 * (highest - speed)))
    rises = (0.3386 + 0.1041 * speed) + (1.54 - 2.5673 * speed) * filling
    return toe, math.pi / 2 - (toe - math.pi / 2) * rises


def _above_zero(*factors: float) -> float:
    """The product of factors; ValueError where one is not above 0: a formula means nothing there."""
    if min(factors) <= 0:
        raise ValueError("no power")
    return math.prod(factors)


def charge_power(mill: Mill) -> tuple[float, float]:
    """What Morrell's C-model gives to the charge [W]: to lift it, and its kinetic energy. The charge is a crescent from
    toe to shoulder, from the radius `inner` to the wall; its layers slip, by a law with the exponent of `slip`. The
    inner radius follows from `active`, the share of the charge that is not in flight; without it, as some reprints
    leave it, the powers of known mills come out by an eighth too high."""
    toe, shoulder = toe_and_shoulder(mill)
    span = math.tau + shoulder - toe
    radius, turns, gravity = mill.diameter / 2, mill.rate / math.tau, GRAVITY
    slip = math.pow(1 - mill.filling, 0.4532)
    mean = radius / 2 * (1 + math.sqrt(1 - math.tau * mill.filling / span))
    rising = span / (math.tau * turns / 2)
    flying = math.sqrt(2 * mean * (math.sin(shoulder) - math.sin(toe)) / gravity)
    active = rising / (rising + flying)
    inner = radius * math.sqrt(1 - math.tau * active * mill.filling / span)
    drop = _above_zero(math.sin(shoulder) - math.sin(toe))
    hole = radius / 4 if mill.trunnion is None else mill.trunnion
    pool = math.pi + math.asin(hole / radius) if mill.discharge == "overflow" else toe  # the end of the pulp
    weight = mill.density * drop + mill.pulp * (math.sin(toe) - math.sin(pool))
    depth = radius - slip * inner
    shape = 2 * radius**3 - 3 * slip * radius**2 * inner + inner**3 * (3 * slip - 2)
    lifted = math.pi * gravity * mill.length * turns * radius / (3 * depth) * shape * weight
    moved = depth**4 - (inner * (slip - 1)) ** 4
    thrown = mill.length * mill.density * (math.pi * turns * radius / depth) ** 3 * moved
    if mill.cone:
        slope = mill.cone / (radius - hole)
        wedge = radius**4 - 4 * radius * inner**3 + 3 * inner**4
        lifted += math.pi * gravity * turns * slope / 3 * wedge * weight
        wedge = radius**5 - 5 * radius * inner**4 + 4 * inner**5
        thrown += 2 * (math.pi * turns) ** 3 * slope * mill.density / 5 * wedge
    return lifted, thrown


def no_load(mill: Mill) -> float:
    """What the motor of an empty mill draws, by Morrell [W]."""
    return 1680 * mill.diameter**2.05 * (mill.speed * (0.667 * mill.cone + mill.length)) ** 0.82


def morrell_net(mill: Mill) -> float:
    return sum(charge_power(mill))


def morrell_gross(mill: Mill) -> float:
    return no_load(mill) + 1.26 * morrell_net(mill)


def morrell_e(mill: Mill) -> float:
    return no_load(mill) + morrell_e_charge(mill)


def morrell_e_charge(mill: Mill) -> float:
    """Morrell's E-model without its no-load [W]."""
    filling, speed = mill.filling, mill.speed
    full = 2 * (2.9863 * speed - 2.2129 * speed**2 - 0.49267)  # twice the filling of the highest power
    fastest = 0.954 - 0.135 * filling
    length = mill.length * (1 + 2.28 * filling * (1 - filling) * mill.cone / mill.length)
    factor = 9.1 if mill.discharge == "grate" else 7.98
    fades = speed * (1 - (1 - fastest) * math.exp(-19.42 * (fastest - speed)))
    fits = _above_zero(full, full - filling, fades) / full**3
    return factor * mill.diameter**2.5 * length * mill.density * filling * fits


def hogg_fuerstenau(mill: Mill, angle: float = REPOSE) -> float:
    fills = mill.filling - 1.065 * mill.filling**2
    return 15.22 * mill.diameter**2.5 * mill.length * mill.speed * mill.density * fills * math.sin(angle)


def _slower(speed: float) -> float:
    """Bond's factor of a speed near the critical one."""
    return speed * (1 - 0.1 / 2 ** (9 - 10 * speed))


def bond(mill: Mill) -> float:
    factor = 7.33 * (1.16 if mill.discharge == "grate" else 1.0) * mill.ball_density
    fills = mill.balls * (1 - 0.937 * mill.balls)
    return factor * _above_zero(fills, _slower(mill.speed)) * mill.length * mill.diameter**2.3


def austin(mill: Mill) -> float:
    """The bed of rock has 30 % of voids, and is 80 % of the mass of what is not balls; the dry charge is as it is."""
    rock = mill.ore / 0.8 if mill.pulp else 0.0
    weight = 0.7 * rock * mill.filling + 0.6 * mill.balls * (mill.ball_density - rock)
    fits = _above_zero(1 - 1.03 * mill.filling, weight, _slower(mill.speed))
    return 10.6 * mill.diameter**2.5 * mill.length * fits


class Model(NamedTuple):
    """A formula. `power` [W]; `source`; `basis`: where the power is taken; ends of the diameters [m], fillings and
    speeds of the `mills` that it stands on."""

    name: str
    power: Callable[[Mill], float]
    basis: str
    source: str
    diameters: tuple[float, float]
    fillings: tuple[float, float]
    speeds: tuple[float, float]
    mills: str

    def of(self, mill: Mill) -> float:
        """[W]; NaN where the formula gives none."""
        try:
            value = self.power(mill)
        except (ArithmeticError, ValueError):  # a root of less than 0, a number too large
            return math.nan
        return value if 0 < value < math.inf else math.nan

    def outside(self, mill: Mill) -> str:
        """In which respects a mill is not one of those that the formula stands on; "" if it is."""
        found = []
        for name, value, (low, high), scale, unit in (
            ("D", mill.diameter, self.diameters, 1, " m"),
            ("J", mill.filling, self.fillings, 100, " %"),
            ("speed", mill.speed, self.speeds, 100, " %"),
        ):
            if not low <= value <= high:
                found.append(f"{name} {number(scale * value)}{unit}, not {scale * low:g} to {scale * high:g}{unit}")
        if self.power is austin and mill.balls >= mill.filling:
            found.append("balls without rock")
        return "; ".join(found)


MORRELL = "S. Morrell, Trans. Instn Min. Metall. C 105 (1996) C43 and C54"
EVERY = (0.85, 10.2), (0.07, 0.48), (0.48, 0.89), "Morrell's 82 ball, SAG and AG mills"
BALLS = (0.85, 5.34), (0.2, 0.48), (0.61, 0.83), "Morrell's 43 ball mills"
MODELS = (
    Model("Morrell C net", morrell_net, NET, MORRELL, *EVERY),
    Model("Morrell C gross", morrell_gross, MOTOR, MORRELL, *EVERY),
    Model("Morrell E gross", morrell_e, MOTOR, MORRELL, *EVERY),
    Model("Hogg & Fuerstenau", hogg_fuerstenau, NET, "R. Hogg and D. W. Fuerstenau, Trans. SME-AIME 252 (1972) 418",
          *BALLS),
    Model("Bond", bond, SHELL, "F. C. Bond, Brit. Chem. Eng. 6 (1961) 378 and 543", *BALLS),
    Model("Austin SAG", austin, SHELL, "L. G. Austin, Miner. Metall. Process. 7 (1990) 57",
          (1.75, 10.2), (0.07, 0.38), (0.48, 0.89), "Morrell's 31 SAG mills"),
)  # fmt: skip
