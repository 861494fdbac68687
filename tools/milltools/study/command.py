"""`mill study`: a table of runs, finished or growing. docs/study-pictures.md says what it shows.

show/data.py reads the table, show/stats.py and show/optimum.py say how sure things are; summary, contour, slices, pair and outputs
show them.
"""

import pathlib
import time

from milltools.base.errors import UserError
from milltools.base.files import check_writable

SUMMARY = (
    "Shows a study: how far it is, the best designs with 95 % confidence intervals, which others cannot be told from the best, "
    "which key matters, the Pareto front of several objectives; as text, pictures, one page, CSV. Works while the study runs."
)
PAUSE = 3.0  # [s] between two looks at a study that is followed, at least
SHARE = 10  # and at least this many times what a look takes
FILES = {
    "png": "pictures: FILE-contour.png, -slices, -pareto, -sensitivity, -beside",
    "svg": "the same as SVG",
    "pdf": "the same, as pages of one PDF",
    "html": "everything as one page",
    "csv": "all runs, with units",
}


OPTIONS = (
    ("objective", "PATH", "which objective, if there are several (default: the first)"),
    ("x", "KEY", "varied key along x"),
    ("y", "KEY", "varied key along y"),
    ("beside", "OTHER", "another study of the same keys, on one scale, and what is left of the gain"),
    ("reference", "KEY=VALUE,...", "what --beside counts the gain from, such as 'drum.buckle_height=0 mm'"),
)
FLAGS = {
    "average": "mean over the other keys instead of a cut through the best",
    "follow": "look again every few seconds until the study is complete",
}


def add_arguments(parser):
    parser.add_argument("study", metavar="FILE", help="table of a study (NAME.parquet), its journal, or the study deck")
    for name, what, words in (*((kind, "FILE", words) for kind, words in FILES.items()), *OPTIONS):
        parser.add_argument(f"--{name}", metavar=what, help=words)
    for name, words in FLAGS.items():
        parser.add_argument(f"--{name}", action="store_true", help=words)


def chosen(view, arguments):
    """The objective that is asked for; wrong names of it and of keys are a UserError."""
    numeric = [axis.key for axis in view.axes if axis.numeric]
    for option, key in (("--x", arguments.x), ("--y", arguments.y)):
        if key and key not in numeric:
            raise UserError(f"{option} {key}: expected one of {', '.join(numeric)}")
    if arguments.x and arguments.x == arguments.y:
        raise UserError(f"--x and --y: two different keys, not {arguments.x} twice")
    if not arguments.objective:
        return view.objectives[0]
    for objective in view.objectives:
        if objective.path == arguments.objective.removeprefix("/statistics/"):
            return objective
    paths = ", ".join(o.path for o in view.objectives)
    raise UserError(f"--objective {arguments.objective}: expected one of {paths}")


def reference(view, text) -> dict | None:
    """--reference as {key: SI value}; millsim reads the units."""
    if not text:
        return None
    from milltools.read import values

    wanted, keys = {}, [axis.key for axis in view.axes]
    for part in map(str.strip, text.split(",")):
        key, equals, _ = part.partition("=")
        if not equals or key.strip() not in keys:
            raise UserError(f"--reference {part}: expected KEY=VALUE with KEY one of {', '.join(keys)}")
        try:
            wanted[key.strip()] = values.tell([part])[0].value
        except UserError as fault:
            raise UserError(f"--reference {part}: {fault}", fault.status) from None
    return wanted


def run(arguments) -> int:
    asked = {kind: path for kind in FILES if (path := getattr(arguments, kind))}
    for kind, path in asked.items():
        check_writable(path)
        if kind in ("png", "svg", "pdf") and pathlib.Path(path).suffix != f".{kind}":
            raise UserError(f"{path}: expected a name that ends in .{kind}")
    if arguments.reference and not arguments.beside:
        raise UserError("--reference: only with --beside")
    if arguments.follow:
        follow(arguments)
    # imported here: a wrong command line needs neither pandas nor matplotlib
    from milltools.study.show import optimum, pair, summary
    from milltools.study.show.data import opened

    table, view = opened(arguments.study)
    objective = chosen(view, arguments)
    beside = opened(arguments.beside)[1] if arguments.beside else None
    wanted = reference(view, arguments.reference)
    said = []
    if beside is not None:
        pair.check([view, beside], objective)
        said = ["", *pair.sentences([view, beside], objective, wanted)]
    sensitivities = optimum.indices(table, view, objective)
    # the files first: who reads the text may go away before its end
    written = write(arguments, asked, view, objective, sensitivities, beside, wanted)
    if not arguments.follow:
        said[:0] = summary.lines(view, sensitivities, objective if arguments.objective else None)
    print("\n".join([*said, *(f"written: {path}" for path in written)]))
    return 0


def write(arguments, asked, view, objective, sensitivities, beside, wanted) -> list[str]:
    """Writes the files that are asked for; returns the names of the pictures."""
    if not asked:
        return []
    from milltools.study.show import outputs

    options = {"x": arguments.x, "y": arguments.y, "average": arguments.average}
    if "csv" in asked:
        outputs.csv(view, asked.pop("csv"))
    if "html" in asked:
        outputs.write_page(asked.pop("html"), view, objective, sensitivities, beside, wanted, **options)
    kinds = list(outputs.figures(view, objective, sensitivities, **options))
    if beside is not None:
        kinds.append(outputs.of_pair(view, beside, objective, sensitivities, wanted, **options))
    return [name for path in asked.values() for name in outputs.pictures(kinds, path)]


def follow(arguments):
    """The text again and again, in place on a terminal, until the study is complete."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from milltools.study.show import optimum, summary
    from milltools.study.show.data import opened

    console = Console(highlight=False)
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as live:
        while True:
            begin = time.monotonic()
            complete = False
            try:
                table, view = opened(arguments.study)
            except UserError as fault:
                if fault.status != 1:
                    raise
                said = str(fault)
            else:
                complete = table.complete
                objective = chosen(view, arguments)
                found = optimum.indices(table, view, objective) if complete else []
                said = "\n".join(summary.lines(view, found, objective if arguments.objective else None))
            if console.is_terminal:
                live.update(Text(said, no_wrap=True, overflow="ellipsis"), refresh=True)
            else:
                print(said, end="\n\n", flush=True)
            if complete:
                return
            time.sleep(max(PAUSE, SHARE * (time.monotonic() - begin)))
