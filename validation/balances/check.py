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
    rough(case, Mill(case.run("rough.ini"), margin=0.25))
    steady = smooth(case, Mill(case.run("smooth.ini")))
    draw_mills(case, reference, steady)
    draw_atmosphere(case, atmosphere(case))
