"""The common options of the commands that fill the table of a study."""

import pathlib

from milltools.base.files import check_writable


def add_arguments(parser, end=""):
    parser.add_argument("study", metavar="STUDY", help="the study deck, such as input/figure7.study")
    parser.add_argument("-o", "--output", metavar="FILE",
        help=f"the table (default: the study's name with {end}.parquet, in this folder)")  # fmt: skip
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="KEY=VALUE",
        help="override one value: study.KEY=VALUE, vary.SECTION.KEY=RANGE, or SECTION.KEY=VALUE for all runs; "
        "may be repeated",
    )  # fmt: skip
    parser.add_argument("-f", "--force", action="store_true", help="start again, even over the table of another study")
    parser.add_argument("-n", "--dry-run", action="store_true",
        help="check everything, tell the number of runs and their cost, run nothing and write nothing")  # fmt: skip
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")


def output_of(study, output, end="") -> pathlib.Path:
    """The name of the table, by default from the study deck; UserError before any run if it cannot be written."""
    path = pathlib.Path(output or f"{pathlib.Path(study).stem}{end}.parquet")
    check_writable(path, [study])
    return path
