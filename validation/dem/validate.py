#!/usr/bin/env python3
"""Compares millsim with LIGGGHTS: runs the parts of this folder and writes RESULTS.md and its figures.

validate.py [PART ...] [--kept]      exit status 1 if a claim is outside its band and no reason is known
"""

import pathlib
import sys

import matplotlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
matplotlib.use("Agg")

import parts
from runs import DemCase

# In this order: what a contact is, what it does to a mill, what to expect elsewhere. Modules of each part.
PARTS = {
    "ladder": ("impacts", "isolated"),
    "transient": ("transient",),
    "steady": ("steady",),
    "other": ("other",),
    "pinches": ("pinches", "gaps", "nips"),
    "jars": ("jars",),
    "price": ("price",),
}
INTRODUCTION = (
    "[README.md](README.md) explains what is compared and why. A deviation is the value of millsim divided by that of "
    "LIGGGHTS, minus 1; *band*: the largest accepted deviation; *error*: its standard error."
)

if __name__ == "__main__":
    sys.exit(
        parts.main(
            __doc__,
            "runs of LIGGGHTS",
            HERE,
            "Compared with LIGGGHTS",
            INTRODUCTION,
            PARTS,
            DemCase,
        )
    )
