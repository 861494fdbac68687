"""`mill report`: a run, or several side by side, as one page that opens from disk.

facts.py says what a run has to say in words, tables.py in rows, notes.py what to know first, pictures.py has the figures,
player.py the balls; page.py puts it together, beside.py does so with several runs.
"""

import os

from milltools.errors import UserError

SUMMARY = (
    "Writes a run as one HTML page that needs no network: what was run, how hard and where the balls hit, where the energy "
    "goes, the deck, and the balls themselves, turning. With --compare several runs on one page, with differences and verdicts."
)


def add_arguments(parser):
    parser.add_argument("runs", nargs="+", metavar="RUN", help="output file of a run")
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="the page; default: the run's name with .html, beside it; an old one is replaced"
    )  # fmt: skip
    parser.add_argument(
        "--compare", action="store_true",
        help="two or more runs on one page, the first is the reference; replicates (other seeds) joined by commas: a1.h5,a2.h5",
    )  # fmt: skip


def run(arguments) -> int:
    from milltools import compare  # its words for what cannot be written
    from milltools.runfile import Run

    if len(arguments.runs) > 1 and not arguments.compare:
        raise UserError("one run makes a report; several need --compare")
    path = arguments.runs[0]
    output = arguments.output or path.removesuffix(".h5") + ".html"
    with Run(path) as opened:
        if os.path.exists(output) and os.path.samefile(output, path):
            raise UserError(f"{output}: the run itself; choose another name with -o")
        compare.check_writable(output)
        from milltools import pages
        from milltools.report import page

        pages.write(output, page.render(opened))
    print(f"{output}: {os.path.getsize(output) / 1e6:.1f} MB")
    return 0
