"""`mill optimize`: the best design of a study deck in few runs, with a confidence interval of its value and of its place."""

import pathlib
import shlex
import sys

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.study import sweep
from milltools.study.remote import executors

SUMMARY = (
    "Searches the ranges of a study deck for the best design: runs a few that are spread, models them as a Gaussian process that knows "
    "the error of every run, and goes where an improvement is to be expected; several objectives: NSGA-II. Whatever ends "
    "it, the same command goes on."
)
RUNS = 40


def add_arguments(parser):
    parser.add_argument("study", metavar="STUDY", help="the study deck, such as input/figure7.study")  # fmt: skip
    sweep.add_common(parser)
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help=f"runs in all, earlier ones included (default: {RUNS})")  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="N", help="of the search's own choices (default: the study's seed)")  # fmt: skip
    parser.add_argument(
        "--storage", metavar="URL|FILE",
        help="where the search is kept: a file for Optuna's journal, sqlite:///FILE or postgresql://USER@HOST/NAME "
        "(default: a journal beside the table)",
    )  # fmt: skip
    executors.add_arguments(parser)


def run(arguments) -> int:
    if arguments.runs < 1:
        raise UserError(f"--runs: expected 1 or more, got {arguments.runs}")
    if arguments.seed is not None and not 0 <= arguments.seed < 2**32:
        raise UserError(f"--seed: expected a whole number from 0 to {2**32 - 1}, got {arguments.seed}")  # fmt: skip
    # imported here: neither --help nor wrong usage waits for Optuna and scikit-learn
    from milltools.study.plan import probe
    from milltools.study.plan.study_deck import Study
    from milltools.study.plan.table import Writer
    from milltools.study.search.acquisition import Plan, spread
    from milltools.study.search.space import Space
    from milltools.study.search.storage import open_storage

    study = Study.read(arguments.study, arguments.set)
    if arguments.output is None:  # not that of `mill sweep`: a grid half done is no search
        arguments.output = f"{pathlib.Path(arguments.study).stem}-optimize.parquet"
    path = sweep.output_of(arguments)
    seed = study.seed if arguments.seed is None else arguments.seed
    plan = Plan(arguments.runs, study.replicates, study.objectives[0].sign > 0, seed)
    space = Space(study.about()["vary"])
    first = [dict(zip(space.keys, spread(space, [], plan, k), strict=True)) for k in range(5)]
    probe.probe(study, first)
    storage = open_storage(arguments.storage, path) if arguments.storage else None
    about = study.about(arguments.runs, shlex.join(["mill", *sys.argv[1:]]))
    with Writer.begin(path, about, arguments.force) as table:
        try:
            with processes.stops_in_order():
                others = _search(arguments, study, plan, table, storage)
        except (KeyboardInterrupt, processes.Stopped) as stop:
            print(
                f"mill optimize: interrupted; {path} has {len(table)} of {arguments.runs} runs, and the same command goes on",
                file=sys.stderr,
            )
            return 128 + stop.number if isinstance(stop, processes.Stopped) else 130
    return _end(table, plan, others)


def _search(arguments, study, plan, table, storage) -> int:
    """Runs until it is known or the runs are spent; returns how many of other drivers are still out."""
    from milltools.study.plan import sending as drive
    from milltools.study.plan.progress import Watch
    from milltools.study.search.search import Search, forget
    from milltools.study.search.storage import open_storage

    storage, place = storage or open_storage(None, table.path)
    if arguments.force:
        forget(study, storage)
    search = Search(study, table, storage, plan, private=arguments.storage is None)
    kept = table.rows()
    if kept:
        print(f"mill optimize: {len(kept)} runs are there already ({place})", file=sys.stderr)
    if len(kept) >= plan.runs:
        return search.out
    with (
        executors.open_executor(arguments) as executor,
        Watch("mill optimize", plan.runs, kept, study.objectives[0], arguments.quiet) as watch,
    ):

        def take(row):
            search.take(row)
            watch.row(row)

        drive.drive(search.jobs(executor.workers), executor, take, watch.tick)
    search.take_over()
    return search.out


def _end(table, plan, others) -> int:
    from milltools.study.show import optimum_text as optimum

    frame = table.frame()
    count = {name: int((frame["status"] == name).sum()) for name in ("done", "capped", "failed")}
    print("\n".join(optimum.lines(table)))
    words = ", ".join(f"{number} {name}" for name, number in count.items() if number)
    spared = plan.runs - len(frame) - others
    if spared > 0:
        words += f"; {spared} were not needed"
    if others:
        words += f"; {others} of other drivers are still out"
    print(f"{table.path}: {len(frame)} runs ({words}); see them with: mill study {table.path}")
    if count["failed"]:
        message = frame.loc[frame["status"] == "failed", "message"].mode()[0]
        print(
            f"mill optimize: {count['failed']} runs failed, most of them so: {message}",
            file=sys.stderr,
        )
    return 1 if count["failed"] == len(frame) else 0
