#!/usr/bin/env python3
"""Compares design studies of the wavy chamber with their requirements: writes RESULTS.md and figures.

validate.py [PART ...] [--kept]      exit status 1 if a claim is outside its band and no reason is known
"""

import pathlib
import sys

import matplotlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
matplotlib.use("Agg")

import parts
from study_case import StudyCase

# In this order: later parts stand on the tables of earlier ones. Modules of each part.
PARTS = {
    "figure7": ("figure7",),
    "friction": ("friction",),
    "optimum": ("optimum",),
    "chamber": ("chamber",),
    "overhead": ("overhead",),
}
INTRODUCTION = (
    "[README.md](README.md) explains what is claimed and why. *Band*: the limit of the measured value; *error*: its "
    "standard error."
)

if __name__ == "__main__":
    sys.exit(
        parts.main(
            __doc__,
            "tables",
            HERE,
            "Design studies of the wavy chamber",
            INTRODUCTION,
            PARTS,
            StudyCase,
        )
    )
