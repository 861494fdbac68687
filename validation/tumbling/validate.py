#!/usr/bin/env python3
"""Compares tumbling mills with the same mills of soft spheres in LIGGGHTS, and with the formulas of the trade: runs
every part and writes RESULTS.md and its figures.

validate.py [PART ...] [--kept]      exit status 1 if a claim is outside its band and no reason is known
"""

import pathlib
import sys

import matplotlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "dem")]
matplotlib.use("Agg")

import parts
from runs import DemCase

PARTS = {"points": ("points",), "around": ("around",), "spheres": ("spheres",), "bond": ("bond",)}
INTRODUCTION = (
    "[README.md](README.md) explains what is compared and why. A deviation is the value of millsim divided by that of "
    "LIGGGHTS, minus 1, or of angles the difference; *band*: the largest accepted deviation; *error*: its standard "
    "error."
)

if __name__ == "__main__":
    sys.exit(
        parts.main(
            __doc__,
            "runs of LIGGGHTS",
            HERE,
            "Tumbling mills",
            INTRODUCTION,
            PARTS,
            DemCase,
        )
    )
