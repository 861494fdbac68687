#!/usr/bin/env python3
"""Tests every statement of the 2007 paper with simulated mills: writes RESULTS.md and figures.

validate.py [PART ...] [--kept]      exit status 1 if a question has no answer
"""

import pathlib
import sys

import matplotlib

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]
matplotlib.use("Agg")

import parts
from verdicts import PaperCase, counted, summary

# Modules of each part.
PARTS = {
    "gas": ("ideal_gas",),
    "impacts": ("impacts", "maps"),
    "speeds": ("speeds",),
    "buckles": ("buckles",),
    "grid": ("grid",),
    "process": ("process",),
    "price": ("price",),
}
INTRODUCTION = (
    "[README.md](README.md) explains how a question becomes a verdict. Errors are standard errors; *runs*: the number "
    "of runs with different seeds over which the answer is averaged."
)

if __name__ == "__main__":
    sys.exit(
        parts.main(
            __doc__,
            "measurements",
            HERE,
            "The paper, statement by statement",
            INTRODUCTION,
            PARTS,
            PaperCase,
            counted,
            summary,
        )
    )
