"""The mill of a deck, as the formulas of `models` know it; the power of a run beside what they give."""

import math
from typing import Any

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.geometry import contour
from milltools.power import models
from milltools.power.models import Mill
from milltools.read.deck import Deck

SLACK = 1e-6  # of a direction
LARGEST = 1e6  # of every size, in SI
GRAVITIES = 0.99 * models.GRAVITY, 1.01 * models.GRAVITY


def _vector(deck: Deck, key: str, usual: tuple[float, float, float]) -> np.ndarray:
    found = np.array(usual if deck.value(key) is None else deck.numbers(key))
    if found.shape != (3,) or not np.abs(found).max() < LARGEST:
        raise UserError(f"{deck.path}: damaged: {key}")
    return found


def why_not(deck: Deck) -> str:
    """Why a deck is no horizontal drum that turns about its own axis with all that is in it; "" if it is one."""
    if "drum" not in deck.sections:
        return "it has no drum"
    inside = [name for name in deck.bodies if deck.value(f"body.{name}.side") == "inside"]
    if inside:
        return f"body.{plain(inside[0])} contains the balls, not a drum"
    gravity = _vector(deck, "gravity.acceleration", (0, 0, -models.GRAVITY))
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
        axis = _vector(deck, f"{place}.axis", (1, 0, 0))
        centre = _vector(deck, f"{place}.centre", (0, 0, 0))
        radius = deck.number("drum.radius")
        if np.abs(axis[1:]).max() > SLACK * np.abs(axis).max() or np.abs(centre[1:]).max() > SLACK * radius:
            return f"{plain(place)} does not turn about the drum's axis"
    others = [f"body.{name}" for name in deck.bodies if deck.value(f"body.{name}.motion", "") != own]
    others += ["rotor"] * ("rotor" in deck.sections and own != "rotor")
    if others:
        return f"{plain(others[0])} does not turn with the drum"
    if not rate(deck):
        return "the drum does not turn"
    return "" if any(kind.count for kind in deck.species) else "it has no balls"


def rate(deck: Deck) -> float:
    """How fast the drum turns [rad/s]."""
    own = deck.value("drum.motion")
    return abs(deck.rotor_speed if own == "rotor" else deck.number(f"motion.{own}.speed"))


def mill_of(deck: Deck, **more) -> Mill:
    """The mill of a deck, with 40 % of voids between its balls; `more`: other fields of Mill. The diameter is that of
    the key, as of the engine's critical speed: between lifters, or the mean of waves. UserError if `why_not` has a
    reason."""
    if why := why_not(deck):
        raise UserError(f"{deck.path}: expected a horizontal drum that turns about its axis: {why}")
    kinds, voidage = [kind for kind in deck.species if kind.count], 0.4
    area = contour.of(deck).area
    length, largest = deck.number("drum.length"), max(kind.diameter for kind in kinds)
    turns, diameter = rate(deck), 2 * deck.number("drum.radius")
    sizes = diameter, length, turns, *(size for kind in kinds for size in (kind.diameter, kind.density))
    if not all(1 / LARGEST < size < LARGEST for size in sizes):
        raise UserError(f"{deck.path}: no mill has these sizes")
    masses = [kind.count * kind.mass for kind in kinds]
    solid = sum(mass / kind.density for mass, kind in zip(masses, kinds))
    filling = solid / (1 - voidage) / (area * length)
    if filling > 1 / (1 - voidage):
        raise UserError(f"{deck.path}: its balls are larger than the drum")
    speed = turns / math.sqrt(2 * models.GRAVITY / diameter)
    return Mill(diameter, length, filling, speed, sum(masses) / solid, voidage=voidage, ball=largest, area=area, **more)


def simulated(run) -> tuple[float, float]:
    """The power that the drum gives to the balls of a run, and its standard error [W]; UserError without results."""
    run.need_statistics()
    path = f"{run.drive}/power"
    return float(run.statistic(path)), run.standard_error(path)


def rows(mill: Mill, drawn: tuple[float, float], angle: float = models.REPOSE) -> list[dict[str, Any]]:
    """A row for each model: name, value [W], basis, source, outside (in which respects the mill is out of its range;
    "" if in none), ratio (simulated / value) and ratio_error of the simulated power (value, standard error)."""
    found = []
    for model in models.MODELS:
        value = model.of(mill)
        if model.power is models.hogg_fuerstenau:
            value *= math.sin(angle) / math.sin(models.REPOSE)
        ratio, error = (part / value for part in drawn)
        found.append({
            "model": model.name, "value": value, "unit": "W", "basis": model.basis, "ratio": ratio,
            "ratio_error": error, "outside": model.outside(mill), "mills": model.mills, "source": model.source,
        })  # fmt: skip
    return found


def beside(run) -> list[dict[str, Any]]:
    """`rows` of a run; empty where it has no results, or its mill is none for the formulas."""
    if run.unsampled or why_not(run.as_deck):
        return []
    return rows(mill_of(run.as_deck), simulated(run))
