"""`mill optimize`: finds the best design of a study deck in few runs, with confidence intervals of its value and of
its keys."""

import shlex

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.text import plural
from milltools.study.plan import options
from milltools.study.remote import executors

SUMMARY = (
    "Searches the ranges of a study deck for the best design: runs a few evenly spread designs, fits a Gaussian "
    "process that uses the error of every run, and runs designs where it expects an improvement. For several "
    "objectives it uses the genetic algorithm NSGA-II. After any interruption, the same command continues."
)
NAME = "mill optimize"
RUNS = 40


def add_arguments(parser):
    options.add_arguments(parser, "-optimize")
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N",
        help=f"runs in all, earlier ones included (default: {RUNS})")  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="N", help="seed of the search itself (default: the study's seed)")
    parser.add_argument(
        "--storage", metavar="URL|FILE",
        help="where the search is stored: a file for Optuna's journal, sqlite:///FILE or postgresql://USER@HOST/NAME; "
        "put a password into ~/.pgpass (default: a journal next to the table)",
    )  # fmt: skip
    executors.add_arguments(parser)


def optimize(
    study, output=None, *, runs=RUNS, seed=None, storage=None, overrides=(), force=False, quiet=False,
    command="milltools.optimize", **where,
):  # fmt: skip
    """Searches the ranges of a study deck for the best design, and returns the table (table.Table).

    output: the table's file, by default the deck's name with -optimize.parquet, here. runs: number in all, earlier
    runs included. seed: of the search itself, by default the study's. storage: as for --storage. The other
    arguments are those of sweep.sweep()."""
    _check_runs(runs)
    if seed is not None and not 0 <= seed < 2**32:
        raise UserError(f"--seed: expected a whole number from 0 to {2**32 - 1}, got {seed}")
    where = executors.Where(**where)
    # imported here: --help and wrong usage need not wait for Optuna and scikit-learn
    from milltools.study.plan import filling, probe
    from milltools.study.plan.study_deck import Study
    from milltools.study.search.acquisition import Budget, spread
    from milltools.study.search.search import Search
    from milltools.study.search.space import Space
    from milltools.study.search.storage import open_storage

    study_deck = Study(study, overrides)
    path = options.output_of(study, output, "-optimize")  # not the table of `mill sweep`: half a grid is not a search
    goal = study_deck.objectives[0]
    budget = Budget(runs, study_deck.replicates, goal.sign > 0, study_deck.seed if seed is None else seed)
    space = Space(study_deck.about()["vary"], study_deck.formulas.met if study_deck.formulas.rules else None)
    probe.probe(NAME, study_deck, [dict(zip(space.keys, spread(space, [], budget, k), strict=True)) for k in range(5)])
    kept = open_storage(storage, path) if storage else None
    with filling.filled(NAME, path, study_deck.about(runs, command), force) as table:
        kept, place = kept or open_storage(None, path)
        search = Search(study_deck, table, kept, budget, private=storage is None, anew=force)
        rows = table.rows()
        tracker = filling.Tracker(NAME, runs, rows, study_deck, quiet)
        if rows:
            tracker.progress.say(f"{len(rows)} runs are there already ({place})")
        if len(rows) < runs:
            with executors.open_executor(where, path, force) as executor:
                filling.fill(search.jobs(executor.workers), executor, search.take, tracker)
            search.take_over()
        table.elsewhere = search.out
    return table


def _check_runs(runs):
    if runs < 1:
        raise UserError(f"--runs: expected 1 or more, got {runs}")


def dry_run(arguments) -> Answer:
    """Tells the cost of the runs that are missing."""
    from milltools.study.plan import probe, table
    from milltools.study.plan.study_deck import Study

    _check_runs(arguments.runs)
    study, where = Study(arguments.study, arguments.set), executors.Where(**executors.asked(arguments))
    path = options.output_of(arguments.study, arguments.output, "-optimize")
    probe.probe(NAME, study, probe.corners(study))
    there = len(table.Table.open(path)) if path.exists() and not arguments.force else 0
    had = f"; {there} of them are in {path} already" if there else ""
    plan = f"plan       at most {plural(arguments.runs, 'run')}{had}"
    return probe.answer(NAME, study, plan, max(arguments.runs - there, 0), where, arguments.quiet)


def run(arguments) -> Answer:
    if arguments.dry_run:
        return dry_run(arguments)
    from milltools.study.plan import filling

    table = optimize(
        arguments.study, arguments.output, runs=arguments.runs, seed=arguments.seed, storage=arguments.storage,
        overrides=arguments.set, force=arguments.force, quiet=arguments.quiet, command=shlex.join(arguments.words),
        **executors.asked(arguments),
    )  # fmt: skip
    from milltools.study.show import summary

    spared = arguments.runs - len(table) - table.elsewhere
    more = [f"{spared} more were not needed"] if spared > 0 else []
    if table.elsewhere:
        more.append(f"{table.elsewhere} runs of other 'mill optimize' commands are not finished")
    last, status = filling.last_words(table, NAME, more)
    lines = [*summary.of_search(table), last]
    return Answer("\n".join(lines), lambda: {"files": [table.path]} | summary.facts(table), status)
