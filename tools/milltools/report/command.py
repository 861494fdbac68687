"""`mill report`: a run, or several side by side, as one page that opens from disk.

facts.py describes a run in words; the player package makes the moving balls and the figures; run_page.py makes the
tables and the whole page, pdf.py prints it. For several runs, page.py of the compare package makes the page.
"""

import os

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.base.processes import stops_in_order
from milltools.base.progress import Progress
from milltools.base.text import size
from milltools.compare.command import add_rerun
from milltools.report import pdf

SUMMARY = (
    "Writes one HTML page about a run, or a PDF; the page needs no network: what takes the power, how hard and where "
    "the balls hit, which parts wear, the deck, and moving pictures of the balls. --compare puts several runs on one "
    "page, with differences and verdicts."
)


def add_arguments(parser):
    parser.add_argument("runs", nargs="+", metavar="RUN", help="output file of a run")
    parser.add_argument(
        "-o", "--output", metavar="FILE",
        help="file of the page, replaced if it exists; .pdf: a PDF of A4 pages; default: the first run's name with "
        ".html (--compare: -compared.html), in its folder",
    )  # fmt: skip
    parser.add_argument("--pdf", action="store_true", help="write a PDF; needs Chromium or Chrome")
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
    end = "-compared" * arguments.compare + (pdf.SUFFIX if arguments.pdf else ".html")
    output = arguments.output or files[0].removesuffix(".h5") + end
    is_pdf = output.lower().endswith(pdf.SUFFIX)
    if arguments.pdf and not is_pdf:
        raise UserError(f"{output}: the name of a PDF ends with {pdf.SUFFIX}")
    if is_pdf:
        pdf.browser()
    check_writable(output, files)
    with stops_in_order():  # otherwise a second run of the deck leaves its folder behind
        write = pdf.write if is_pdf else write_text
        write(output, _text(arguments, sides, files, is_pdf))
    total = os.path.getsize(output)
    return Answer(f"{output}: {size(total)}", {"files": [output], "bytes": total, "runs": files})


def _text(arguments, sides, files, printed) -> str:
    # imported here: a wrong command line needs neither matplotlib nor scipy
    if arguments.compare:
        from milltools.compare import load, page, rows

        with Progress("mill report", 3 + page.steps(sides)) as watch:
            with watch.step("reading the runs", 3):
                compared = load.sides(sides)
                tables = rows.tables(compared)
            return page.render(compared, tables, watch, "never" if printed else arguments.rerun)
    else:
        from milltools.read.runfile import Run
        from milltools.report import run_page

        with Run(files[0]) as opened, Progress("mill report", run_page.steps()) as watch:
            return run_page.render(opened, watch, arguments.rerun, printed)
