#!/usr/bin/env python3
"""millsim held against LIGGGHTS: runs the parts of this folder and writes RESULTS.md and its figures.

validate.py [PART ...] [--kept]      ends with 1 when a claim is outside its band
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
    "[README.md](README.md) says what is compared and why so. Deviations are millsim over LIGGGHTS less 1; *band* is "
    "what they may be, *error* their standard error."
)

if __name__ == "__main__":
    sys.exit(
        parts.main(
            __doc__,
            "runs of LIGGGHTS",
            HERE,
            "Held against LIGGGHTS",
            INTRODUCTION,
            PARTS,
            DemCase,
        )
    )
