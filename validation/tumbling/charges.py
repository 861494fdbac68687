"""What is compared of tumbling mills in both programs, and how well each is known.

The angles of toe and shoulder are those of millsim's observer of the charge (docs/tumbling.md), which `mill dem` feeds
with LIGGGHTS' positions: one definition. LIGGGHTS runs one start and millsim SEEDS, the first the same; the errors are
those of validation/dem/mills.py.
"""

import dataclasses
import math
import pathlib

import numpy as np
from mills import Quantity, Window, judge

DECK = pathlib.Path(__file__).resolve().parent / "deck.ini"
SEEDS = 4  # of millsim
MODULUS = "1e9"
QUANTITIES = [
    Quantity("power", "power", "W", 4),
    Quantity("kinetic", "kinetic energy", "J", 3),
    Quantity("toe", "toe", "deg", 4),
    Quantity("shoulder", "shoulder", "deg", 4),
    Quantity("fast", "impacts above 1 m/s", "/s", 8),
]
LARGEST_ERROR = 1 / 3  # of the band


class Charge(Window):
    """A Window that knows the charge [deg] and the impacts of all kinds."""

    def _measure(self, run):
        super()._measure(run)
        kinds = [kind.removeprefix("ball_") for kind in run.kinds]
        for of in (self.values, self.blocks):
            of["fast"] = sum(of[f"{kind}_1"] for kind in kinds)
        for key in ("toe", "shoulder"):
            self.values[key] = math.degrees(run.read(f"statistics/charge/{key}/value"))
            self.blocks[key] = np.empty(0)  # an angle of the sums over a run is no mean of those of its turns


def verdicts(soft, hard):
    """The Verdict of each of QUANTITIES, of files of LIGGGHTS and of millsim; of angles the difference [deg]."""
    soft, hard = ([Charge(path) for path in paths] for paths in (soft, hard))
    found = [judge(quantity, soft, hard) for quantity in QUANTITIES]
    return [in_degrees(verdict) if verdict.quantity.unit == "deg" else verdict for verdict in found]


def in_degrees(verdict):
    """A Verdict in degrees instead of per cent."""
    scale = verdict.soft / 100
    values = {name: abs(scale) * abs(getattr(verdict, name)) for name in ("error", "scatter", "blocks")}
    return dataclasses.replace(verdict, off=scale * verdict.off, **values)


def claim(case, verdict, what, headline="", known=""):
    """States a Verdict of the mill `what`; headline: what is added to it in the summary, if it is there."""
    quantity = verdict.quantity
    case.claim(
        f"{what}, {quantity.name}{headline}: millsim {verdict.hard:.4g} {quantity.unit}",
        verdict.off,
        0,
        quantity.band,
        error=verdict.error,
        unit=unit(quantity),
        against=f"LIGGGHTS: {verdict.soft:.4g} {quantity.unit}",
        headline=bool(headline),
        known=known,
    )


def unit(quantity):
    """Of a deviation."""
    return "deg" if quantity.unit == "deg" else "%"


def claim_errors(case, groups, known):
    """Whether the errors are small enough, of lists of Verdicts; known: by quantity, why they are known not to be."""
    for quantity, *found in zip(QUANTITIES, *groups, strict=True):
        case.bound(
            f"largest standard error of {quantity.name}",
            max(verdict.error for verdict in found),
            LARGEST_ERROR * quantity.band,
            unit=unit(quantity),
            against="a third of the band",
            known=known.get(quantity.key, ""),
        )


def listed(found):
    """Verdicts in words."""
    return ", ".join(f"{v.quantity.name} {v.off:+.1f} ± {v.error:.1f} {unit(v.quantity)}" for v in found)
