"""Studies: many runs of millsim over ranges of deck keys, in one table. docs/studies.md says how they are written and kept.

deck.py reads the study deck, ranges.py its [vary], designs.py makes the plan, job.py is one run, drive.py sends jobs through an
executor of executors.py, table.py keeps the rows. docs/optimize.md: search.py chooses the designs one by one, by gp.py and acquisition.py.

This file is `mill study`, which shows a table, finished or growing: show_data.py reads it, show_stats.py and show_optimum.py say how sure
things are, show_text.py, show_contour.py, show_slices.py, show_beside.py and show_page.py show them.
"""

import pathlib
import time

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.compare.command import check_writable

SUMMARY = (
    "Shows a study: how far it is, the best designs with 95 % confidence intervals, which others cannot be told from the best, "
    "which key matters, the Pareto front of several objectives; as text, pictures, one page, CSV. Works while the study runs."
)
PAUSE = 3.0  # [s] between two looks at a study that is followed, at least
SHARE = 10  # and at least this many times what a look takes


def add_arguments(parser):
    parser.add_argument(
        "study",
        metavar="FILE",
        help="table of a study (NAME.parquet), its journal, or the study deck",
    )
    parser.add_argument(
        "--png",
        metavar="FILE",
        help="pictures: FILE-contour.png, -slices, -pareto, -sensitivity, -beside",
    )
    parser.add_argument("--svg", metavar="FILE", help="the same as SVG")
    parser.add_argument("--pdf", metavar="FILE", help="the same, as pages of one PDF")
    parser.add_argument("--html", metavar="FILE", help="everything as one page")
    parser.add_argument("--csv", metavar="FILE", help="all runs, with units")
    parser.add_argument(
        "--objective",
        metavar="PATH",
        help="which objective, if there are several (default: the first)",
    )
    parser.add_argument("--x", metavar="KEY", help="varied key along x")
    parser.add_argument("--y", metavar="KEY", help="varied key along y")
    parser.add_argument(
        "--average",
        action="store_true",
        help="mean over the other keys instead of a cut through the best",
    )
    parser.add_argument(
        "--beside",
        metavar="OTHER",
        help="another study of the same keys, on one scale, and what is left of the gain",
    )
    parser.add_argument(
        "--reference",
        metavar="KEY=VALUE,...",
        help="what --beside counts the gain from, such as 'drum.buckle_height=0 mm'",
    )
    parser.add_argument(
        "--follow",
        action="store_true",
        help="look again every few seconds until the study is complete",
    )


def table_of(name: str) -> pathlib.Path:
    """The table that a name means: itself, that of a journal, or that beside a study deck or in the current folder."""
    path = pathlib.Path(name)
    if path.name.endswith(".parquet.journal"):
        return path.with_name(path.name.removesuffix(".journal"))
    if path.suffix == ".parquet" or not path.suffix:
        return path
    found = [
        folder / f"{path.stem}{end}.parquet" for end in ("", "-optimize") for folder in (path.parent, pathlib.Path("."))
    ]
    for candidate in found:
        if candidate.exists():
            return candidate
    if path.exists():
        raise UserError(f"{name}: no table of it yet: neither {' nor '.join(map(str, dict.fromkeys(found)))}")
    raise UserError(f"{name}: no such file")


def opened(name: str):
    """(table, its View); a study without rows yet is a UserError."""
    from milltools.study.plan.table import Table
    from milltools.study.show.data import View

    table = Table.open(table_of(name))
    if not len(table):
        raise UserError(f"{table.path}: no run has ended yet", status=1)
    return table, View.of(table)


def chosen(view, arguments):
    """The objective that is asked for; wrong names of it and of keys are a UserError."""
    for option, key in (("--x", arguments.x), ("--y", arguments.y)):
        numeric = [a.key for a in view.axes if a.numeric]
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
    for part in text.split(","):
        key, equals, _ = part.partition("=")
        if not equals or key.strip() not in keys:
            raise UserError(f"--reference {part.strip()}: expected KEY=VALUE with KEY one of {', '.join(keys)}")
        try:
            wanted[key.strip()] = values.tell([part.strip()])[0].value
        except UserError as fault:
            raise UserError(f"--reference {part.strip()}: {fault}", fault.status) from None
    return wanted


def run(arguments) -> int:
    for path in filter(None, (arguments.png, arguments.svg, arguments.pdf, arguments.html, arguments.csv)):
        check_writable(path)
    for suffix in ("png", "svg", "pdf"):
        path = getattr(arguments, suffix)
        if path and pathlib.Path(path).suffix != f".{suffix}":
            raise UserError(f"{path}: expected a name that ends in .{suffix}")
    if arguments.reference and not arguments.beside:
        raise UserError("--reference: only with --beside")
    if arguments.follow:
        follow(arguments)
    from milltools.study.show import outputs as show
    from milltools.study.show import terminal as show_text

    table, view = opened(arguments.study)
    objective = chosen(view, arguments)
    beside = opened(arguments.beside)[1] if arguments.beside else None
    wanted = reference(view, arguments.reference)
    if beside is not None:
        from milltools.study.show import pair as show_beside

        show_beside.check([view, beside], objective)
    sensitivities = show.indices(table, view, objective)
    if not arguments.follow:
        show_text.show(view, sensitivities, objective if arguments.objective else None)
    if beside is not None:
        print()
        for line in show_beside.sentences([view, beside], objective, wanted):
            print(plain(line))
        for line in show_beside.difference_lines([view, beside]):
            print(plain(line))
    write(arguments, view, objective, sensitivities, beside, wanted)
    return 0


def write(arguments, view, objective, sensitivities, beside, wanted):
    """The files that are asked for."""
    from milltools.study.show import outputs as show

    options = {"x": arguments.x, "y": arguments.y, "average": arguments.average}
    if arguments.csv:
        show.replace(arguments.csv, show.csv(view))
    if arguments.html:
        from milltools.study.show import study_page as show_page

        page = show_page.render(view, objective, sensitivities, beside, wanted, **options)
        show.replace(arguments.html, page)
    pictures = [p for p in (arguments.png, arguments.svg, arguments.pdf) if p]
    if not pictures:
        return
    from milltools.study.show import draw as show_draw
    from milltools.study.show import pair as show_beside

    kinds = list(show.figures(view, objective, sensitivities, **options))
    if beside is not None:
        both = [view, beside]

        def together():
            return show_beside.draw(both, objective, sensitivities=sensitivities, wanted=wanted, **options)

        kinds.append(("beside", "", "", together))
    for path in pictures:
        if path.endswith(".pdf"):
            show_draw.write_pages([make for *_, make in kinds], path)
            print(f"written: {path}")
            continue
        for kind, _, _, make in kinds:
            name = show_draw.beside(path, kind)
            show_draw.write(make(), name)
            print(f"written: {name}")


def follow(arguments):
    """The text again and again, in place on a terminal, until the study is complete."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    from milltools.study.show import outputs as show
    from milltools.study.show import terminal as show_text

    console = Console(highlight=False)
    with Live(console=console, auto_refresh=False, vertical_overflow="crop") as live:
        while True:
            begin = time.monotonic()
            try:
                table, view = opened(arguments.study)
            except UserError as fault:
                if fault.status != 1:
                    raise
                table, said = None, str(fault)
            if table is not None:
                objective = chosen(view, arguments) if arguments.objective else None
                found = show.indices(table, view, objective or view.objectives[0]) if table.complete else []
                said = "\n".join(show_text.lines(view, found, objective))
            if console.is_terminal:
                live.update(Text(said, no_wrap=True, overflow="ellipsis"), refresh=True)
            else:
                print(said, end="\n\n", flush=True)
            if table is not None and table.complete:
                return
            time.sleep(max(PAUSE, SHARE * (time.monotonic() - begin)))
