"""`mill mesh`: makes of meshes of other programs one that millsim accepts.

The steps: the files (read.py, ply.py, threemf.py) -> closed surfaces (surface.py) -> solids and what they fill together
(solids.py) -> millsim's judgement (judge.py) -> the file.
"""

import os
import pathlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.base.files import check_writable, whole
from milltools.base.processes import stops_in_order
from milltools.base.progress import Progress
from milltools.base.text import plain

SUMMARY = """Makes one closed mesh, as [body.NAME] of a deck reads it, of STL, OBJ, PLY and 3MF files: welds corners,
drops facets without area, turns facets outwards, closes small holes, unites the solids of all files, and asks millsim
whether it accepts the result. It says what it changed. A mesh that it cannot mend is refused with its faults, and
nothing is written."""
UNITS = ("um", "mm", "cm", "m", "in", "ft")


def add_arguments(parser):
    parser.add_argument("input", nargs="+", metavar="IN", help="a mesh: .stl, .obj, .ply or .3mf")
    parser.add_argument("-o", "--output", required=True, metavar="OUT.stl", help="the file to write, a binary STL file")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite an existing file")
    parser.add_argument(
        "--unit", choices=UNITS,
        help="unit of the coordinates in OUT.stl (default: that of the first 3MF file). 3MF files, which know theirs, "
        "are converted; other files must have this unit already",
    )  # fmt: skip
    parser.add_argument(
        "--hole", type=_length, metavar="LENGTH",
        help="close holes up to this size, a number in the unit of OUT.stl (default: 0.05 of the largest dimension of "
        "IN; 0: none)",
    )  # fmt: skip
    parser.add_argument(
        "--weld", type=_length, metavar="LENGTH",
        help="weld corners at gaps up to this width, a number in the unit of OUT.stl (default: 0.00001 of the largest "
        "dimension of IN)",
    )  # fmt: skip
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")


def _length(text):
    value = float(text)
    if not 0 <= value < 1e30:
        raise ValueError
    return value


_length.__name__ = "length"  # argparse's errors name it


def run(arguments) -> Answer:
    output = arguments.output
    if pathlib.Path(output).suffix.lower() != ".stl":
        raise UserError(f"{plain(output)}: expected a name ending in .stl")
    check_writable(output, arguments.input)
    if os.path.lexists(output) and not arguments.force:
        raise UserError(f"{plain(output)}: exists already; --force overwrites it")
    needs("mesh")
    with stops_in_order(), Progress("mill mesh", quiet=arguments.quiet) as progress:
        from milltools.geometry.stl import binary
        from milltools.mesh import mend

        found = mend.mended(arguments, lambda text: progress(0, text))
        content = binary(found.corners, "made by mill mesh" + f"; unit {found.unit}" * bool(found.unit))
        with whole(output) as draft:
            draft.write_bytes(content)
    facts = {"files": [output], "bytes": len(content)} | found.facts
    return Answer("\n".join([*found.lines, f"{plain(output)}: {found.result}"]), facts)
