"""`mill compare`: two or more runs side by side, with differences, standard errors and verdicts.

load.py reads what is compared, errors.py says how sure a number is, rows.py makes the table, maps.py compares maps;
text.py, pictures.py and page.py show it. docs/compare.md says what every number means.
"""

import os
import pathlib

from milltools.base.errors import UserError
from milltools.base.files import keep_apart

SUMMARY = (
    "Puts runs side by side: power, energies, losses, impacts, ball speeds, maps, price; each with its difference from the "
    "first run, the standard error of that, and a verdict. Files joined by commas are replicates of one run "
    "(other seeds): their scatter gives the error, which runs that are not steady need."
)

PICTURES = (".png", ".svg", ".pdf")


def add_arguments(parser):
    parser.add_argument(
        "runs", nargs="+", metavar="RUN", help="output file, or replicates: a1.h5,a2.h5; the first is the reference"
    )  # fmt: skip
    parser.add_argument("--csv", metavar="FILE", help="the table with all digits")
    parser.add_argument("--png", metavar="FILE", help="all pictures in one (.png, .svg, .pdf)")
    parser.add_argument("--html", metavar="FILE", help="table and pictures as one page")


def replicates(argument: str) -> list[str]:
    """The files of one side; a name that has a comma in it is taken whole if there is such a file."""
    if pathlib.Path(argument).exists():
        return [argument]
    files = [name for name in argument.split(",") if name]
    if not files:
        raise UserError(f"'{argument}' names no file")
    return files


def check_writable(path: str):
    """Said before the work, not after it."""
    folder = os.path.dirname(path) or "."
    if not os.path.isdir(folder):
        raise UserError(f"{path}: No such file or directory", status=1)
    if os.path.isdir(path):
        raise UserError(f"{path}: a folder, not a file", status=1)
    if not os.access(folder, os.W_OK):
        raise UserError(f"{path}: permission denied", status=1)


def run(arguments) -> int:
    if len(arguments.runs) < 2:
        raise UserError("one run is nothing to compare with; give two or more")
    if arguments.png and pathlib.Path(arguments.png).suffix not in PICTURES:
        raise UserError(f"{arguments.png}: expected a name that ends in {', '.join(PICTURES)}")
    files = [path for argument in arguments.runs for path in replicates(argument)]
    for path in filter(None, (arguments.csv, arguments.png, arguments.html)):
        check_writable(path)
        keep_apart(path, files)
    # imported here: a wrong command line needs neither scipy nor matplotlib
    from milltools.compare import load, rows
    from milltools.compare import terminal as text

    sides = load.sides([replicates(argument) for argument in arguments.runs])
    tables = [rows.compare(sides[0], side) for side in sides[1:]]
    notes = rows.notes(sides)
    text.show(sides, tables, notes)
    if arguments.csv:
        text.write_csv(tables, arguments.csv)
    if arguments.png:
        from milltools.compare import pictures

        pictures.write(sides, arguments.png)
    if arguments.html:
        from milltools.compare import compare_page as page

        page.write(sides, tables, notes, arguments.html)
    return 0
