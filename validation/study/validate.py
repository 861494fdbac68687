#!/usr/bin/env python3
"""Design studies of the wavy chamber held against what they are to show: writes RESULTS.md, figures, and README's short form.

validate.py [PART ...] [--kept]      ends with 1 when a claim is outside its band
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
    "overhead": ("overhead",),
}
INTRODUCTION = (
    "[README.md](README.md) says what is claimed and why so. *Band* is what a value may be off, or its bound; *error* its "
    "standard error."
)


def main():
    parser = parts.parser(__doc__.splitlines()[0], PARTS)
    parser.add_argument(
        "--kept", action="store_true", help="take kept tables whatever version made them"
    )
    arguments = parser.parse_args()
    return parts.main(
        "study",
        "Design studies of the wavy chamber",
        INTRODUCTION,
        PARTS,
        arguments.part,
        lambda scratch: StudyCase(HERE, scratch, arguments.kept),
    )


if __name__ == "__main__":
    sys.exit(main())
