"""`mill report`: a run, or several side by side, as one page that opens from disk.

facts.py describes a run in words; the player package makes the moving balls and the figures; run_page.py makes the
tables and the whole page. For several runs, page.py of the compare package makes the page.
"""

import os

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.base.processes import stops_in_order
from milltools.base.progress import Progress
from milltools.base.text import size
from milltools.compare.command import add_rerun

SUMMARY = (
    "Writes one HTML page about a run; the page needs no network: what was run, how hard and where the balls hit, "
    "where the energy goes, the deck, and moving pictures of the balls. --compare puts several runs on one page, "
    "with differences and verdicts."
)


def add_arguments(parser):
    parser.add_argument("runs", nargs="+", metavar="RUN", help="output file of a run")
    parser.add_argument(
        "-o", "--output", metavar="FILE",
        help="file of the page, replaced if it exists; default: the first run's name with .html (--compare: "
        "-compared.html), in its folder",
    )  # fmt: skip
    parser.add_argument(
        "--compare", action="store_true",
        help="two or more runs on one page, the first is the reference; replicates (other seeds) joined by commas: "
        "a1.h5,a2.h5",
    )  # fmt: skip
    add_rerun(parser)


def run(arguments) -> Answer:
    if not arguments.compare and len(arguments.runs) > 1:
        raise UserError("a report shows one run; --compare puts several on one page")
    if arguments.compare and len(arguments.runs) < 2:
        raise UserError("one run cannot be compared; give two or more")
    sides = [[path] for path in arguments.runs]
    if arguments.compare:
        from milltools.compare.load import replicates

        sides = [replicates(side) for side in arguments.runs]
    files = [path for side in sides for path in side]
    output = arguments.output or files[0].removesuffix(".h5") + ("-compared.html" if arguments.compare else ".html")
    check_writable(output, files)
    with stops_in_order():  # otherwise a second run of the deck leaves its folder behind
        _write(arguments, sides, files, output)
    total = os.path.getsize(output)
    return Answer(f"{output}: {size(total)}", {"files": [output], "bytes": total, "runs": files})


def _write(arguments, sides, files, output):
    # imported here: a wrong command line needs neither matplotlib nor scipy
    if arguments.compare:
        from milltools.compare import load, page, rows

        with Progress("mill report", 3 + page.steps(sides)) as watch:
            with watch.step("reading the runs", 3):
                compared = load.sides(sides)
                tables = rows.tables(compared)
            text = page.render(compared, tables, watch, arguments.rerun)
    else:
        from milltools.read.runfile import Run
        from milltools.report import run_page

        with Run(files[0]) as opened, Progress("mill report", run_page.steps()) as watch:
            text = run_page.render(opened, watch, arguments.rerun)
    write_text(output, text)
