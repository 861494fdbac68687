"""`mill sweep`: runs every design of a study deck, on all cores or on a cluster, into one crash-safe table."""

import shlex

from milltools.base.answer import Answer
from milltools.base.text import plural
from milltools.study.plan import options
from milltools.study.remote import executors

SUMMARY = (
    "Runs the designs of a study deck and writes one row per run into a Parquet table. After any interruption, the "
    "same command continues; finished runs are not repeated."
)
NAME = "mill sweep"


def add_arguments(parser):
    options.add_arguments(parser)
    parser.add_argument("--retry", action="store_true", help="repeat failed runs")
    parser.add_argument("--no-picture", action="store_true", help="do not draw a picture at the end")
    executors.add_arguments(parser)


def sweep(
    study, output=None, *, overrides=(), retry=False, force=False, quiet=False, command="milltools.sweep", **where
):
    """Runs every design of a study deck that is not in the table yet, and returns the table (table.Table).

    output: the table's file, by default the deck's name with .parquet, here. overrides: as --set takes them. retry:
    repeat failed runs. force: start again, also over the table of another study. command: the command line that the
    table stores. where: the fields of executors.Where (workers, dask, slurm, ...). Ctrl-C raises
    filling.Interrupted; finished runs are kept."""
    # imported when needed: --help and wrong options need not wait for pandas
    where = executors.Where(**where)
    from milltools.study.plan import designs, filling, probe
    from milltools.study.plan.study_deck import Study

    study_deck = Study(study, overrides)
    path = options.output_of(study, output)
    plan = designs.plan(study_deck)
    probe.probe(NAME, study_deck, plan)
    numbers = {job["id"]: job["design"] for job in designs.jobs(study_deck, plan)}
    with filling.filled(NAME, path, study_deck.about(len(numbers), command), force) as table:
        table.number(numbers)
        there = table.ids(failed=not retry) & set(numbers)
        rows = [row for row in table.rows() if row["id"] in there]
        tracker = filling.Tracker(NAME, len(numbers), rows, study_deck, quiet)
        if rows:
            tracker.progress.say(f"{len(rows)} of {len(numbers)} runs are there already")
        if len(rows) < len(numbers):
            missing = (job for job in designs.jobs(study_deck, plan) if job["id"] not in there)
            with executors.open_executor(where, path, force) as executor:
                filling.fill(missing, executor, table.add, tracker)
    return table


def dry_run(arguments) -> Answer:
    """Tells the number of runs and their cost."""
    from milltools.study.plan import designs, probe, table
    from milltools.study.plan.study_deck import Study

    study, where = Study(arguments.study, arguments.set), executors.Where(**executors.asked(arguments))
    path, plan = options.output_of(arguments.study, arguments.output), designs.plan(study)
    probe.probe(NAME, study, plan)
    wanted = {job["id"] for job in designs.jobs(study, plan)}
    there = set()
    if path.exists() and not arguments.force:
        there = wanted & set(table.Table.open(path).frame()["id"])
    each = plural(study.replicates, "run")
    had = f"; {len(there)} of them are in {path} already" if there else ""
    said = f"plan       {plural(len(plan), 'design')}, {each} each: {plural(len(wanted), 'run')}{had}"
    return probe.answer(NAME, study, said, len(wanted) - len(there), where, arguments.quiet)


def run(arguments) -> Answer:
    from milltools.study import life

    if life.is_life(arguments.study):
        return life.run(arguments)
    if arguments.dry_run:
        return dry_run(arguments)
    from milltools.study.plan import filling

    table = sweep(
        arguments.study, arguments.output, overrides=arguments.set, retry=arguments.retry, force=arguments.force,
        quiet=arguments.quiet, command=shlex.join(arguments.words), **executors.asked(arguments),
    )  # fmt: skip
    from milltools.study.search import sensitivity
    from milltools.study.show import summary

    lines = [*summary.of_sweep(table), *sensitivity.lines(table)]
    files = [table.path] + ([] if arguments.no_picture else _draw(table))
    lines += [f"{path}: the first objective over two of the varied keys" for path in files[1:]]
    last, status = filling.last_words(table, NAME)
    return Answer("\n".join([*lines, last]), lambda: {"files": files} | summary.facts(table), status)


def _draw(table) -> list:
    """The main picture, if there are two axes for it; its path."""
    from milltools.study.plan.ranges import Range
    from milltools.study.show import outputs

    axes = [r for r in map(Range.of, table.meta["vary"]) if r.numeric and (r.values is None or len(r.values) > 1)]
    if len(axes) < 2:
        return []
    path = table.path.with_suffix(".png")
    outputs.draw(table, path)
    return [path]
