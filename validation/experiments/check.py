"""Experiments: single impacts and a cooling gas, predicted with measured coefficients, compared with measurements.

README.md says what is claimed, where each number was read, and what could not be read.
"""

from experiments.figures import draw_gas, draw_impacts
from experiments.gas import check_gas
from experiments.impacts import check_impacts


def check(case):
    draw_impacts(case, *check_impacts(case))
    draw_gas(case, *check_gas(case))
