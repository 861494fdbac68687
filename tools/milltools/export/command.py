"""`mill export`: writes a mill or the data of a run in the format of another program; the suffix of the file chooses.

A format is a module of this package and an entry of FORMATS. For each kind of content (`--what`) the module has a
function of that name (arguments), which writes arguments.file and returns a short description of what it wrote and the
facts for --json. tables.py has the contents of tables.
"""

import argparse
import functools
import importlib
import pathlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import keep_apart
from milltools.base.processes import stops_in_order
from milltools.geometry.solids import PARTS
from milltools.read.runfile import kind_of

SUMMARY = """Writes a mill and its balls for other programs; the suffix of the file chooses the format. From a run: .gsd
(OVITO, HOOMD, freud) and .pvd (ParaView, PyVista; a file and a folder) contain its frames, .vtp one frame, .csv a table
(--what), .xlsx a workbook of tables. From a deck or a run: .stl, the bodies of the mill as closed surfaces, in metres.
An old file is replaced."""


# what a file with this suffix can contain, the default first
FORMATS = {
    ".stl": ("mill",),
    ".gsd": ("balls",),
    ".vtp": ("balls", "mill"),
    ".pvd": ("balls", "mill", "both"),
    ".csv": ("balls", "summary", "dose", "wear", "series", "impacts", "spectra"),
    ".xlsx": ("all", "summary", "dose", "wear", "series", "spectra", "impacts", "balls"),
}
WHAT = ("balls", "mill", "both", "summary", "dose", "wear", "series", "impacts", "spectra", "all")
TABLES = (".csv", ".xlsx")
BODY_OPTIONS = ("part", "tolerance", "thickness")
SPAN_OPTIONS = ("begin", "end", "every")
MOMENT_OPTIONS = ("frame", "time")
SPELLED = {"begin": "from", "end": "to"}


def add_arguments(parser):
    parser.add_argument(
        "source", metavar="DECK-or-RUN", help="the output file of a run; for the mill's bodies also a deck"
    )
    parser.add_argument("file", metavar="FILE", help=f"what to write, a name ending in {', '.join(FORMATS)}")
    parser.add_argument(
        "--what", choices=WHAT,
        help="balls: their states (default); mill: its bodies (.stl, .vtp, .pvd); both (.pvd); summary, dose, "
        "wear, series, impacts (if output.impacts = all), spectra: tables (.csv, .xlsx); all: all of these but impacts "
        "and balls (default of .xlsx)",
    )  # fmt: skip
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of a deck, or of [powder] and [wear] for dose and wear of a run; may be repeated",
    )  # fmt: skip
    frames = parser.add_argument_group("which states")
    frames.add_argument("--from", dest="begin", metavar="TIME", help="only frames from this time on, such as '0.1 s'")
    frames.add_argument("--to", dest="end", metavar="TIME", help="only frames up to this time")
    frames.add_argument("--every", type=int, metavar="N", help="only every N-th of these frames")
    frames.add_argument("--frame", type=int, metavar="K", help="only the frame of this number, from 0; -1 is the last")
    frames.add_argument("--time", metavar="TIME", help="only the frame nearest to this time; bodies: at this time")
    bodies = parser.add_argument_group("the mill's bodies")
    bodies.add_argument(
        "--part", action="append", metavar="PART",
        help=f"only this part: {', '.join(PARTS)}, or NAME of a kind ball_NAME; may be repeated (default: all parts)",
    )  # fmt: skip
    bodies.add_argument(
        "--tolerance", metavar="LENGTH",
        help="largest distance of triangles from round surfaces, such as '0.1 mm'; "
        "default: 1/2000 of the drum's radius",
    )  # fmt: skip
    bodies.add_argument(
        "--thickness", metavar="LENGTH",
        help="smallest thickness of the drum's wall and of the end walls, such as '2 mm'; default: 1/20 of the drum's "
        "radius",
    )  # fmt: skip


def writer(arguments):
    """The function that writes the requested content; options that it does not use are refused."""
    suffix = pathlib.Path(arguments.file).suffix.lower()
    if suffix not in FORMATS:
        raise UserError(f"{arguments.file}: expected a name ending in {', '.join(FORMATS)}")
    what = arguments.what or FORMATS[suffix][0]
    if what not in FORMATS[suffix]:
        able = [name for name, holds in FORMATS.items() if what in holds]
        raise UserError(f"a {suffix} file cannot contain {what}: write {' or '.join(able)}")
    given = {name for name in (*BODY_OPTIONS, *SPAN_OPTIONS, *MOMENT_OPTIONS) if getattr(arguments, name) is not None}
    for idle, options, why in (
        (what not in ("mill", "both"), BODY_OPTIONS, "only for the mill's bodies (.stl, or --what mill)"),
        (suffix in (".stl", ".vtp"), SPAN_OPTIONS, f"{suffix} files contain one moment: use --time, --frame or .pvd"),
        (suffix in TABLES and what != "balls", ("every", *MOMENT_OPTIONS), f"only for frames, not for {what}"),
        (what in ("summary", "dose", "wear", "spectra"), SPAN_OPTIONS, f"{what}: always of the whole sampled window"),
        (what == "all", SPAN_OPTIONS, "only for one table: add --what series"),
        ("frame" in given, ("time",), "either --frame or --time"),
        (given.intersection(MOMENT_OPTIONS), SPAN_OPTIONS, "either one state (--frame, --time) or many"),
    ):
        for name in options:
            if idle and name in given:
                raise UserError(f"--{SPELLED.get(name, name)}: {why}")
    if suffix in TABLES:
        from milltools.export import tables

        return functools.partial(tables.write, what=what)
    return getattr(importlib.import_module(f"milltools.export{suffix}"), what)


def run(arguments: argparse.Namespace) -> Answer:
    write = writer(arguments)
    kind_of(arguments.source)
    keep_apart(arguments.file, [arguments.source])
    with stops_in_order():  # otherwise half a file, or a folder of half a run, would stay behind
        said, facts = write(arguments)
    return Answer(f"{arguments.file}: {said}", {"files": [arguments.file]} | facts)
