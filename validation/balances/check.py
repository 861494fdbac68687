"""Balances that hold in any steady mill: power, forces, torques, and an atmosphere of hard spheres.

README.md says what is claimed and where each band comes from.
"""

from balances.atmosphere import atmosphere
from balances.common import Mill
from balances.figures import draw_atmosphere, draw_mills
from balances.friction import rough
from balances.power import power
from balances.smooth import smooth


def check(case):
    reference = power(case, Mill(case.run()))
    rubbing, sliding = Mill(case.run("rough.ini"), margin=0.25), Mill(case.run("smooth.ini"))
    case.bound(
        "contacts of pressed balls in the two mills whose impacts are logged",
        sum(int(mill.file["run/pinch_contacts"][()]) for mill in (rubbing, sliding)),
        0,
        against="the log does not contain these contacts and would be incomplete",
    )
    rough(case, rubbing)
    steady = smooth(case, sliding)
    draw_mills(case, reference, steady)
    draw_atmosphere(case, atmosphere(case))
