"""`mill export`: a mill, and what a run holds, in the formats of other programs; the file's suffix chooses.

A format is a module of this package and an entry of FORMATS: for each thing it can hold (`--what`) a function of
that name (arguments) that writes arguments.file and returns what it wrote, in a few words.
"""

import argparse
import importlib
import pathlib
import sys

from milltools.base.errors import UserError
from milltools.base.files import keep_apart
from milltools.base.processes import Stopped, stops_in_order
from milltools.export.source import about
from milltools.geometry.solids import PARTS

SUMMARY = """Writes a mill and its balls for other programs; the suffix of the file chooses the format. Of a run: .gsd
(OVITO, HOOMD, freud) and .pvd (ParaView; a file and a folder) hold its frames, .vtp one of them, .csv a table (--what). Of a
deck or a run: .stl, the bodies of the mill as closed surfaces, in metres. An old file is replaced."""


# what a suffix can hold, the default first
FORMATS = {
    ".stl": ("mill",),
    ".gsd": ("balls",),
    ".vtp": ("balls", "mill"),
    ".pvd": ("balls", "mill"),
    ".csv": ("balls", "series", "impacts", "spectra"),
}
WHAT = ("balls", "mill", "series", "impacts", "spectra")
BODY_OPTIONS = ("part", "tolerance", "thickness")
SPAN_OPTIONS = ("begin", "end", "every")
MOMENT_OPTIONS = ("frame", "time")
SPELLED = {"begin": "from", "end": "to"}


def add_arguments(parser):
    parser.add_argument(
        "source", metavar="DECK-or-RUN", help="the output file of a run; for the mill's bodies a deck does"
    )
    parser.add_argument("file", metavar="FILE", help=f"what to write, a name ending in {', '.join(FORMATS)}")
    parser.add_argument(
        "--what", choices=WHAT,
        help="balls: their states (default); mill: its bodies (.stl, .vtp, .pvd); series, impacts, spectra: tables (.csv)",
    )  # fmt: skip
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of a deck; may be repeated",
    )  # fmt: skip
    frames = parser.add_argument_group("which states")
    frames.add_argument("--from", dest="begin", metavar="TIME", help="not before this time, such as '0.1 s'")
    frames.add_argument("--to", dest="end", metavar="TIME", help="not after this time")
    frames.add_argument("--every", type=int, metavar="N", help="only each N-th frame of these")
    frames.add_argument("--frame", type=int, metavar="K", help="only this one, from 0; -1 is the last")
    frames.add_argument("--time", metavar="TIME", help="only the one nearest to this time; of bodies: exactly then")
    bodies = parser.add_argument_group("the mill's bodies")
    bodies.add_argument(
        "--part", action="append", metavar="PART",
        help=f"only this part: {', '.join(PARTS)}, or NAME of a [body.NAME]; may be repeated (default: all there are)",
    )  # fmt: skip
    bodies.add_argument(
        "--tolerance", metavar="LENGTH",
        help="how far flats may be from the round surfaces, such as '0.1 mm'; default: a two-thousandth of the drum's radius",
    )  # fmt: skip
    bodies.add_argument(
        "--thickness", metavar="LENGTH",
        help="of the drum's wall where it is thinnest and of the end walls, such as '2 mm'; default: a twentieth of the drum's "
        "radius",
    )  # fmt: skip


def writer(arguments):
    """The function that writes what is asked for; options that mean nothing to it are refused."""
    suffix = pathlib.Path(arguments.file).suffix.lower()
    if suffix not in FORMATS:
        raise UserError(f"{arguments.file}: expected a name ending in {', '.join(FORMATS)}")
    what = arguments.what or FORMATS[suffix][0]
    if what not in FORMATS[suffix]:
        able = [name for name, holds in FORMATS.items() if what in holds]
        raise UserError(f"--what {what}: not in {suffix}, but in {' or '.join(able)}")
    given = {name for name in (*BODY_OPTIONS, *SPAN_OPTIONS, *MOMENT_OPTIONS) if getattr(arguments, name) is not None}
    for idle, options, why in (
        (what != "mill", BODY_OPTIONS, "only for the mill's bodies (.stl, or --what mill)"),
        (suffix in (".stl", ".vtp"), SPAN_OPTIONS, f"{suffix} holds one moment: --time or --frame; .pvd all"),
        (what in ("series", "impacts", "spectra"), ("every", *MOMENT_OPTIONS), f"only for frames, not for {what}"),
        (what == "spectra", SPAN_OPTIONS, "spectra are of the whole sampled window"),
        ("frame" in given, ("time",), "either --frame or --time"),
        (given.intersection(MOMENT_OPTIONS), SPAN_OPTIONS, "either one state (--frame, --time) or many"),
    ):
        for name in options:
            if idle and name in given:
                raise UserError(f"--{SPELLED.get(name, name)}: {why}")
    return getattr(importlib.import_module(f"milltools.export{suffix}"), what)


def run(arguments: argparse.Namespace) -> int:
    write = writer(arguments)
    about(arguments.source)
    keep_apart(arguments.file, [arguments.source])
    try:
        with stops_in_order():  # half a file, or a folder of half a run, stays behind otherwise
            said = write(arguments)
    except Stopped as stop:
        print("mill export: stopped", file=sys.stderr)
        return 128 + stop.number
    print(f"{arguments.file}: {said}")
    return 0
