"""`mill study`: shows the table of a study, finished or growing. docs/study-pictures.md explains the pictures.

show/data.py reads the table and computes errors; show/optimum.py finds the best design and its uncertainty; summary,
contour, slices, pair and outputs show them.
"""

import os
import pathlib
import time

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable
from milltools.base.progress import say

SUMMARY = (
    "Shows a study: its progress, the best designs with 95 % confidence intervals, the designs that may be as good as "
    "the best, which key matters, the Pareto front of several objectives; as text, pictures, one page, CSV. Works "
    "while the study runs."
)
PAUSE = 3.0  # [s] smallest time between two readings with --follow
SHARE = 10  # and at least this multiple of the time that a reading takes
OPTIONS = (
    ("png", "FILE", "pictures; FILE a.png gives a-contour.png, a-slices.png, a-pareto.png ..."),
    ("svg", "FILE", "the same as SVG"),
    ("pdf", "FILE", "the same, as pages of one PDF"),
    (
        "html",
        "FILE",
        "everything as one page; runs the best design once more for its animation, and others while time is left: up "
        "to about 30 s",
    ),
    ("deck", "FILE", "the deck of the best design, or of --design, with all defaults"),
    ("design", "N", "with --deck: another design, by its number in the table (--csv and the page have it)"),
    ("csv", "FILE", "all runs, keys in the units of the study deck, all else in SI"),
    (
        "objective",
        "EXPR",
        "objective: one of the study or any other expression, such as 'rate_above(1 mJ) / power' or "
        "'minimise power' (default: the first of the study)",
    ),
    ("require", "EXPR", "only designs that meet this, such as 'power <= 225 W'; may be repeated"),
    ("x", "KEY", "varied key along x"),
    ("y", "KEY", "varied key along y"),
    ("beside", "OTHER", "also show another study of the same keys, and how much of the best design's gain remains"),
    ("reference", "KEY=VALUE,...", "reference design for the gain with --beside, such as 'drum.buckle_height=0 mm'"),
    ("average", None, "contours: mean over the other keys instead of a cut through the best design"),
    ("follow", None, "update the text every few seconds until the study is complete"),
)


def add_arguments(parser):
    parser.add_argument("study", metavar="FILE", help="table of a study (NAME.parquet), its journal, or the study deck")
    for name, what, words in OPTIONS:
        kind = {"metavar": what} if what else {"action": "store_true"}
        kind |= {"action": "append", "default": []} if name == "require" else {"type": int} if name == "design" else {}
        parser.add_argument(f"--{name}", help=words, **kind)


def chosen(view, arguments):
    """The requested objective; UserError for wrong names of objectives or keys."""
    numeric = [axis.key for axis in view.axes if axis.numeric]
    for option, key in (("--x", arguments.x), ("--y", arguments.y)):
        if key and key not in numeric:
            raise UserError(f"{option} {key}: expected one of {', '.join(numeric)}")
    if arguments.x and arguments.x == arguments.y:
        raise UserError(f"--x and --y: expected two different keys, got {arguments.x} twice")
    try:
        return view.ask(arguments.objective, arguments.require)
    except UserError as fault:
        given = [f"--objective {arguments.objective}"] * bool(arguments.objective)
        given += [f"--require {text}" for text in arguments.require]
        raise UserError(f"{', '.join(given)}: {fault}", fault.status) from None


def reference(view, text) -> dict:
    """--reference as {key: SI value}; millsim reads the units."""
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


def run(arguments) -> Answer:
    asked = {kind: path for kind, what, _ in OPTIONS if what == "FILE" and (path := getattr(arguments, kind))}
    for kind, path in asked.items():
        check_writable(path)
        if kind in ("png", "svg", "pdf") and pathlib.Path(path).suffix != f".{kind}":
            raise UserError(f"{path}: expected a name that ends in .{kind}")
        if kind == "deck" and os.path.lexists(path):
            raise UserError(f"{path}: exists already; give another name")
    if arguments.reference and not arguments.beside:
        raise UserError("--reference: only with --beside")
    if arguments.design is not None and not arguments.deck:
        raise UserError("--design: only with --deck")
    if arguments.follow and arguments.json:
        raise UserError("--follow: not with --json, which prints one object")
    if arguments.follow:
        follow(arguments)
    # imported here: a wrong command line needs neither pandas nor matplotlib
    from milltools.study.show import optimum, summary
    from milltools.study.show.data import opened

    table, view = opened(arguments.study)
    if table.damaged:
        say("mill study", f"{table.left_out}; the command that made the table repeats their runs")
    objective = chosen(view, arguments)
    beside = opened(arguments.beside)[1] if arguments.beside else None
    wanted = reference(view, arguments.reference) if arguments.reference else None
    said = []
    if beside is not None:
        from milltools.study.show import pair

        pair.check([view, beside], objective)
        said = ["", *pair.sentences([view, beside], objective, wanted)]
    sensitivities = optimum.indices(table, view, objective)
    # the files first: the reader of the text may close the pipe before its end
    written = []
    if asked:
        from milltools.study.show import outputs

        options = {"x": arguments.x, "y": arguments.y, "average": arguments.average, "beside": beside, "wanted": wanted}
        written = outputs.write(asked, view, objective, sensitivities, design=arguments.design, **options)
    if not arguments.follow:
        said[:0] = summary.lines(view, sensitivities, objective if arguments.objective else None)
    files = list(dict.fromkeys([*written, *(asked[kind] for kind in ("csv", "html", "deck") if kind in asked)]))
    said += [f"written: {path}" for path in files]
    return Answer("\n".join(said), lambda: {"files": files} | summary.facts(table, view, sensitivities))


def follow(arguments):
    """Prints the text repeatedly, in place on a terminal, until the study is complete."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from milltools.study.show import optimum, summary
    from milltools.study.show.data import opened

    console = Console(highlight=False)
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as live:
        while True:
            begin, complete = time.monotonic(), False
            try:
                table, view = opened(arguments.study)
                objective, complete = chosen(view, arguments), table.complete
                found = optimum.indices(table, view, objective) if complete else []
                said = "\n".join(summary.lines(view, found, objective if arguments.objective else None))
            except UserError as fault:
                if fault.status != 1:
                    raise
                said = str(fault)
            if console.is_terminal:
                live.update(Text(said, no_wrap=True, overflow="ellipsis"), refresh=True)
            else:
                print(said, end="\n\n", flush=True)
            if complete:
                return
            time.sleep(max(PAUSE, SHARE * (time.monotonic() - begin)))
