"""The mill of a deck, as the formulas of `models` know it; the power of a run beside what they give."""

import math

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.geometry.profile import Profile
from milltools.power import models
from milltools.power.models import Mill
from milltools.read.deck import Deck

SLACK = 1e-6  # of a direction
GRAVITIES = 0.99 * models.GRAVITY, 1.01 * models.GRAVITY


def why_not(deck: Deck) -> str:
    """Why a deck is no horizontal drum that turns about its own axis with all that is in it; "" if it is one."""
    if "drum" not in deck.sections:
        return "it has no drum"
    inside = [name for name in deck.bodies if deck.value(f"body.{name}.side") == "inside"]
    if inside:
        return f"body.{plain(inside[0])} contains the balls, not a drum"
    gravity = np.array(deck.numbers("gravity.acceleration") or [0, 0, -models.GRAVITY])
    size = float(np.linalg.norm(gravity))
    if abs(gravity[0]) > SLACK * size:
        return "its axis is not horizontal"
    if not GRAVITIES[0] <= size <= GRAVITIES[1]:
        return f"its gravity is {size:.3g} m/s^2, not 9.81 m/s^2"
    own = deck.value("drum.motion", "")
    if not own:
        return "drum.motion is not given, so the drum stands still"
    if own != "rotor":
        place = f"motion.{own}"
        if deck.value(f"{place}.kind", "turn") != "turn" or deck.value(f"{place}.on", ""):
            return f"{plain(place)} does not just turn"
        axis = np.array(deck.numbers(f"{place}.axis") or [1, 0, 0])
        centre = np.array(deck.numbers(f"{place}.centre") or [0, 0, 0])
        radius = deck.number("drum.radius")
        if np.abs(axis[1:]).max() > SLACK * np.abs(axis).max() or np.abs(centre[1:]).max() > SLACK * radius:
            return f"{plain(place)} does not turn about the drum's axis"
    others = [f"body.{name}" for name in deck.bodies if deck.value(f"body.{name}.motion", "") != own]
    others += ["rotor"] * ("rotor" in deck.sections and own != "rotor")
    if others:
        return f"{plain(others[0])} does not turn with the drum"
    if not rate(deck):
        return "the drum does not turn"
    return "" if deck.mass > 0 else "it has no balls"


def rate(deck: Deck) -> float:
    """How fast the drum turns [rad/s]."""
    own = deck.value("drum.motion")
    return abs(deck.rotor_speed if own == "rotor" else deck.number(f"motion.{own}.speed"))


def mill_of(deck: Deck, **more) -> Mill:
    """The mill of a deck, with 40 % of voids between its balls; `more`: other fields of Mill. The diameter is that of
    the circle with the area of the drum's cross-section. UserError if `why_not` has a reason."""
    if why := why_not(deck):
        raise UserError(f"{deck.path}: expected a horizontal drum that turns about its axis: {why}")
    area, length = Profile.of(deck.value).area, deck.number("drum.length")
    solid = sum(kind.count * kind.mass / kind.density for kind in deck.species)
    diameter, voidage = 2 * math.sqrt(area / math.pi), 0.4
    return Mill(
        diameter, length, solid / (1 - voidage) / (area * length),
        rate(deck) / math.sqrt(2 * models.GRAVITY / diameter), deck.mass / solid, voidage=voidage,
        ball=max(kind.diameter for kind in deck.species if kind.count), **more,
    )  # fmt: skip


def simulated(run) -> tuple[float, float]:
    """The power that the drum gives to the balls of a run, and its standard error [W]; UserError without results."""
    run.need_statistics()
    path = f"{run.drive}/power"
    return float(run.statistic(path)), run.standard_error(path)
