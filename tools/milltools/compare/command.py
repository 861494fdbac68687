"""`mill compare`: two or more runs side by side, with differences, standard errors and verdicts.

load.py reads what is compared, agreement.py says how sure a number is, map_deviation.py compares maps, rows.py makes
the table; terminal.py, pictures.py and page.py show it. docs/compare.md says what every number means.
"""

import pathlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.base.processes import stops_in_order
from milltools.figures.command import PICTURES

RERUN = ("auto", "always", "never")
SUMMARY = (
    "Compares runs: power, energies, losses, impacts, ball speeds, maps and computing cost, each with its difference "
    "from the first run, the standard error of this difference and a verdict. Files joined by commas are replicates of "
    "one run (other seeds): their scatter gives the error. Runs that are not steady need replicates."
)


def add_arguments(parser):
    parser.add_argument(
        "runs", nargs="+", metavar="RUN", help="output file, or replicates: a1.h5,a2.h5; the first is the reference"
    )
    parser.add_argument("--csv", metavar="FILE", help="write the table with all digits as CSV")
    parser.add_argument("--png", metavar="FILE", help="write all pictures into one file (.png, .svg, .pdf)")
    parser.add_argument(
        "--html", metavar="FILE", help="write one HTML page with everything: tables, figures, moving balls"
    )
    add_rerun(parser)


def add_rerun(parser):
    """The option --rerun of pages with players, see player/finer.py."""
    parser.add_argument(
        "--rerun", choices=RERUN, default="auto",
        help="run the deck again, bit for bit the same, if the stored frames are too far apart to show motion; "
        "auto: only if this takes at most half a minute",
    )  # fmt: skip


def run(arguments) -> Answer:
    if len(arguments.runs) < 2:
        raise UserError("one run cannot be compared; give two or more")
    if arguments.png and pathlib.Path(arguments.png).suffix not in PICTURES:
        raise UserError(f"{arguments.png}: expected a name that ends in {', '.join(PICTURES)}")
    # imported here: a wrong command line needs neither scipy nor matplotlib
    from milltools.compare import load, rows, terminal

    names = [load.replicates(argument) for argument in arguments.runs]
    files = [path for path in (arguments.csv, arguments.png, arguments.html) if path]
    for path in files:
        check_writable(path, [file for side in names for file in side])
    sides = load.sides(names)
    tables = rows.tables(sides)
    notes = rows.notes(sides, tables)
    # the files first: the reader of the text may close the pipe before its end
    if arguments.html:  # made before any file is written: the page reads the most data
        from milltools.base.progress import Progress
        from milltools.compare import page

        with stops_in_order(), Progress("mill compare", page.steps(sides)) as watch:
            text = page.render(sides, tables, watch, arguments.rerun)
    if arguments.png:
        from milltools.compare import pictures

        pictures.write(tables, arguments.png)
    if arguments.csv:
        terminal.write_csv(tables, arguments.csv)
    if arguments.html:
        write_text(arguments.html, text)
    facts = {
        "files": files,
        "notes": notes,
        "rows": [dict(zip(terminal.COLUMNS, row)) for row in terminal.rows(tables)],
    }
    return Answer(lambda: terminal.show(sides, tables, notes), facts)
