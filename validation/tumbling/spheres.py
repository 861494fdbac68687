"""What hard spheres do: smaller rebound floors, millsim's own soft spheres, and stiffer ones in LIGGGHTS"""

import numpy as np
from charges import DECK, QUANTITIES, Charge, claim, unit, verdicts
from points import CENTRE, POINTS, run_of_liggghts, settings
from runs import say

TIME = {"run__time": "10 s"}
SOFT = {"run__spheres": "soft"}
# point, settings of millsim, starts, in words, keys of the quantities that are known to be off
MILLS = [
    (CENTRE, {"contact__rebound_floor": "10 mm/s"}, 4, "rebound floor of 10 mm/s", ("kinetic",)),
    (CENTRE, {"contact__rebound_floor": "4 mm/s"}, 2, "rebound floor of 4 mm/s", ()),
    ((90, 40), {"contact__rebound_floor": "4 mm/s"}, 2, "rebound floor of 4 mm/s", ("fast",)),
    ((90, 20), {"contact__rebound_floor": "4 mm/s"}, 2, "rebound floor of 4 mm/s", ("power", "toe")),
    (CENTRE, SOFT | {"soft__modulus": "10 GPa"}, 2, "millsim's soft spheres of 10 GPa", ()),
]
STILL = "this floor, too, is too large for balls of one size on lifters"
STIFF, STIFF_TIME = "1e10", {"run__time": "8 s"}  # a second takes three times as long


def check(case):
    say("    rebound floor and soft spheres")
    for point, own, starts, what, off in MILLS:
        paths = case.seeds(starts, DECK, **TIME, **settings(*point), **own)
        for verdict in verdicts([run_of_liggghts(case, *point)], paths):
            known = STILL if verdict.quantity.key in off else ""
            claim(case, verdict, f"{point[0]} %, J {point[1]} %, {what}", known=known)
    own = SOFT | {"soft__modulus": "1 GPa"}
    found = {
        point: verdicts([run_of_liggghts(case, *point)], case.seeds(2, DECK, **TIME, **settings(*point), **own))
        for point in POINTS
    }
    for k in range(len(QUANTITIES)):
        worst = max(POINTS, key=lambda point, k=k: abs(found[point][k].off))
        what = f"{worst[0]} %, J {worst[1]} %, millsim's soft spheres of 1 GPa"
        claim(case, found[worst][k], what, " (largest of 12)")
    stiffer(case)


def stiffer(case):
    """LIGGGHTS with ten times the stiffness beside its own run."""
    stiff = Charge(case.dem("tumbling-stiff", DECK, STIFF, **settings(*CENTRE), **STIFF_TIME))
    soft = Charge(run_of_liggghts(case, *CENTRE))
    for quantity in QUANTITIES:
        one, other = stiff.values[quantity.key], soft.values[quantity.key]
        scale = 1 if quantity.unit == "deg" else 100 / other
        error = abs(scale) * np.hypot(stiff.error(quantity.key), soft.error(quantity.key))
        case.claim(
            f"LIGGGHTS at 1e10 Pa, {quantity.name}: {one:.4g} {quantity.unit}",
            scale * (one - other),
            0,
            quantity.band,
            error=error if np.isfinite(error) else None,
            unit=unit(quantity),
            against=f"LIGGGHTS at 1e9 Pa: {other:.4g} {quantity.unit}",
        )
