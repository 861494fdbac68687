"""`mill compare`: two or more runs side by side, with differences, standard errors and verdicts.

load.py reads what is compared, agreement.py says how sure a number is, map_deviation.py compares maps, rows.py makes
the table; terminal.py, pictures.py and page.py show it. docs/compare.md says what every number means.
"""

import pathlib

from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.figures.command import PICTURES

SUMMARY = (
    "Puts runs side by side: power, energies, losses, impacts, ball speeds, maps, price; each with its difference from the "
    "first run, the standard error of that, and a verdict. Files joined by commas are replicates of one run "
    "(other seeds): their scatter gives the error, which runs that are not steady need."
)


def add_arguments(parser):
    parser.add_argument(
        "runs", nargs="+", metavar="RUN", help="output file, or replicates: a1.h5,a2.h5; the first is the reference"
    )
    parser.add_argument("--csv", metavar="FILE", help="the table with all digits")
    parser.add_argument("--png", metavar="FILE", help="all pictures in one (.png, .svg, .pdf)")
    parser.add_argument(
        "--html", metavar="FILE", help="everything as one page, with the figures and the balls of the runs"
    )


def run(arguments) -> int:
    if len(arguments.runs) < 2:
        raise UserError("one run is nothing to compare with; give two or more")
    if arguments.png and pathlib.Path(arguments.png).suffix not in PICTURES:
        raise UserError(f"{arguments.png}: expected a name that ends in {', '.join(PICTURES)}")
    # imported here: a wrong command line needs neither scipy nor matplotlib
    from milltools.compare import load, rows, terminal

    names = [load.replicates(argument) for argument in arguments.runs]
    for path in filter(None, (arguments.csv, arguments.png, arguments.html)):
        check_writable(path, [file for side in names for file in side])
    sides = load.sides(names)
    tables, notes = rows.tables(sides), rows.notes(sides)
    # the files first: who reads the text may go away before its end
    if arguments.html:  # made before anything is written: it reads most of the runs
        from milltools.base.progress import Progress
        from milltools.compare import page

        with Progress("mill compare", page.steps(sides)) as watch:
            text = page.render(sides, tables, notes, watch)
    if arguments.png:
        from milltools.compare import pictures

        pictures.write(sides, arguments.png)
    if arguments.csv:
        terminal.write_csv(tables, arguments.csv)
    if arguments.html:
        write_text(arguments.html, text)
    terminal.show(sides, tables, notes)
    return 0
