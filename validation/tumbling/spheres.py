"""What hard spheres do here: smaller rebound floors, millsim's own soft spheres, and stiffer ones in LIGGGHTS"""

import numpy as np
from charges import DECK, QUANTITIES, Charge, claim, unit, verdicts
from points import CENTRE, run_of_liggghts, settings
from runs import say

TIME = {"run__time": "10 s"}
FLOORS = {"10 mm/s": 4, "4 mm/s": 2}  # starts
SOFT = {"1 GPa": 3, "10 GPa": 2}
STIFF, STIFF_TIME = "1e10", {"run__time": "8 s"}  # a second takes three times as long


def check(case):
    say("    rebound floor and soft spheres")
    centre = settings(*CENTRE)
    soft = run_of_liggghts(case, *CENTRE)
    for floor, starts in FLOORS.items():
        paths = case.seeds(starts, DECK, **TIME, **centre, contact__rebound_floor=floor)
        for verdict in verdicts([soft], paths):
            claim(case, verdict, f"rebound floor of {floor}")
    for modulus, starts in SOFT.items():
        own = {"run__spheres": "soft", "soft__modulus": modulus}
        for verdict in verdicts([soft], case.seeds(starts, DECK, **TIME, **centre, **own)):
            claim(case, verdict, f"soft spheres of millsim, {modulus}")
    stiff, soft = Charge(case.dem("tumbling-stiff", DECK, STIFF, **centre, **STIFF_TIME)), Charge(soft)
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
