"""`mill sweep`: every design of a study deck, run on all cores or on a cluster, into one table that survives."""

import os
import pathlib
import shlex
import sys

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.study.remote import executors

SUMMARY = (
    "Runs the designs of a study deck and keeps one row a run in a Parquet table. Whatever ends it, the same command goes on: "
    "what is done is not done again."
)


def add_arguments(parser):
    parser.add_argument("study", metavar="STUDY", help="the study deck, such as input/figure7.study")
    add_common(parser)
    parser.add_argument("--retry", action="store_true", help="run again what failed")
    parser.add_argument("--no-picture", action="store_true", help="do not draw one at the end")
    executors.add_arguments(parser)


def add_common(parser):
    """Options of all commands that fill the table of a study."""
    parser.add_argument("-o", "--output", metavar="FILE", help="the table (default: the study's name with .parquet, here)")  # fmt: skip
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="KEY=VALUE",
        help="override one value: study.KEY=VALUE, vary.SECTION.KEY=RANGE, or SECTION.KEY=VALUE for all runs; may be repeated",
    )  # fmt: skip
    parser.add_argument("-f", "--force", action="store_true", help="begin anew, even over the table of another study")  # fmt: skip
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")


def output_of(arguments) -> pathlib.Path:
    """The table's name; what cannot be written is said before any run."""
    path = pathlib.Path(arguments.output or pathlib.Path(arguments.study).stem + ".parquet")
    folder = path.parent
    if not folder.is_dir():
        raise UserError(f"{path}: its folder {folder} does not exist")
    if path.is_dir():
        raise UserError(f"{path}: a folder, not a file")
    if path.exists() and path.samefile(arguments.study):
        raise UserError(f"{path}: is the study deck itself; -o gives another name")
    if not os.access(folder, os.W_OK):
        raise UserError(f"{path}: permission denied", status=1)
    return path


def run(arguments) -> int:
    # imported as they are needed: neither --help nor a wrong deck waits for pandas
    from milltools.study.plan import designs
    from milltools.study.plan.study_deck import Study

    study = Study.read(arguments.study, arguments.set)
    path = output_of(arguments)
    plan = designs.plan(study)

    from milltools.study.plan import probe
    from milltools.study.plan.table import Writer

    probe.probe(study, plan)
    numbers = {job["id"]: job["design"] for job in designs.jobs(study, plan)}
    about = study.about(len(numbers), shlex.join(["mill", *sys.argv[1:]]))
    with Writer.begin(path, about, arguments.force) as table:
        table.number(numbers)
        try:
            with processes.stops_in_order():
                _fill(arguments, study, plan, numbers, table)
        except (KeyboardInterrupt, processes.Stopped) as stop:
            kept = len(table.ids() & set(numbers))
            print(
                f"mill sweep: interrupted; {path} has {kept} of {len(numbers)} runs, and the same command goes on",
                file=sys.stderr,
            )
            return 128 + stop.number if isinstance(stop, processes.Stopped) else 130
    return _end(table, numbers, not arguments.no_picture)


def _fill(arguments, study, plan, numbers, table):
    from milltools.study.plan import designs
    from milltools.study.plan import sending as drive
    from milltools.study.plan.progress import Watch

    there = table.ids(failed=not arguments.retry) & set(numbers)
    kept = [row for row in table.rows() if row["id"] in there]
    if kept:
        print(f"mill sweep: {len(kept)} of {len(numbers)} runs are there already", file=sys.stderr)
    missing = (job for job in designs.jobs(study, plan) if job["id"] not in there)
    if len(kept) == len(numbers):
        return
    with (
        executors.open_executor(arguments) as executor,
        Watch("mill sweep", len(numbers), kept, study.objectives[0], arguments.quiet) as watch,
    ):

        def take(row):
            table.add(row)
            watch.row(row)

        drive.drive(missing, executor, take, watch.tick)


def _end(table, numbers, picture) -> int:
    """The last word: what there is, the best of it, and how to see it."""
    from milltools.study.search import sensitivity
    from milltools.study.show import summary

    frame = table.frame()
    frame = frame[frame["id"].isin(numbers)]
    count = {name: int((frame["status"] == name).sum()) for name in ("done", "capped", "failed")}
    summary.show(table)
    for line in sensitivity.lines(table):
        print(line)
    if picture:
        _draw(table)
    words = ", ".join(f"{number} {name}" for name, number in count.items() if number)
    print(f"{table.path}: {len(frame)} runs ({words}); see them with: mill study {table.path}")
    if count["failed"]:
        message = frame.loc[frame["status"] == "failed", "message"].mode()[0]
        print(
            f"mill sweep: {count['failed']} runs failed, most of them so: {message}",
            file=sys.stderr,
        )
    return 1 if count["failed"] == len(frame) else 0


def _draw(table):
    """The main picture, where there are two axes for it."""
    axes = [v for v in table.meta["vary"] if v["kind"] in ("number", "whole")]
    axes = [v for v in axes if v["values"] is None or len(v["values"]) > 1]
    if len(axes) < 2:
        return
    from milltools.study.show import outputs as show

    path = table.path.with_suffix(".png")
    show.draw(table, path)
    print(f"{path}: the first objective over two of the varied keys")
