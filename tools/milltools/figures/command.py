"""`mill plot`: draws runs. Without --figure it draws the overview of one run; with --figure one of milltools.figures,
of one or more runs, as a picture or as numbers."""

import contextlib
import os
import pathlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import keep_apart, write_csv
from milltools.base.progress import Progress
from milltools.base.text import size

SUMMARY = (
    "Draws runs. Without --figure it draws an overview of one run: the mill with its balls coloured by speed, a map of "
    "the dissipated power, and the spectrum of impact speeds of each contact kind. With --figure it draws one figure "
    "of one or more runs. The name of the file gives the format: .png, .svg, .pdf, or .csv for the numbers of the "
    "figure."
)
PICTURES = (".png", ".svg", ".pdf")
DOTS, FEWER = 200, 90  # dots per inch: of a figure (a PNG, and the fields of maps), and of the overview


def add_arguments(parser):
    parser.add_argument("runs", nargs="*", metavar="run.h5", help="output files of runs")
    parser.add_argument("file", nargs="?", help="file to write; an old one is replaced")
    parser.add_argument("--figure", metavar="NAME", help="figure to draw; --list shows the names")
    parser.add_argument("--list", action="store_true", help="list the figures; with runs, also what cannot be drawn")
    parser.add_argument(
        "--kind", action="append", metavar="KIND", dest="kinds",
        help="show only spectra of this contact kind, such as ball_ball, ball_drum or all; can be repeated",
    )  # fmt: skip
    parser.add_argument("--strikes", action="store_true", help="spectra of strikes (repeated impacts count once)")
    parser.add_argument("--per-ball", action="store_true", help="spectra divided by the number of balls")


def run(arguments) -> Answer:
    from milltools.figures import FIGURES
    from milltools.read.runfile import Run

    names = [*arguments.runs, *filter(None, [arguments.file])]
    with contextlib.ExitStack() as stack:
        if arguments.list:
            return tell(FIGURES, [stack.enter_context(Run(path)) for path in names])
        if len(names) < 2:
            raise UserError("expected a run and the name of the picture to write; see 'mill plot --help'")
        *paths, target = names
        keep_apart(target, paths)
        options = {name: value for name in ("kinds", "strikes", "per_ball") if (value := getattr(arguments, name))}
        runs = [stack.enter_context(Run(path)) for path in paths]
        if arguments.figure:
            write_figure(FIGURES, arguments.figure, runs, target, options)
            title = FIGURES[arguments.figure].title
        else:
            if len(runs) > 1 or options or pathlib.Path(target).suffix.lower() == ".csv":
                raise UserError(
                    f"without --figure only one run can be drawn, without options; else --figure {', '.join(FIGURES)}"
                )
            runs[0].need_statistics()
            from milltools.figures import overview, style

            style.save(overview.draw(runs[0]), target, FEWER)
            title = "overview"
    total = os.path.getsize(target)
    facts = {"files": [target], "bytes": total, "figure": arguments.figure or title, "title": title, "runs": paths}
    return Answer(f"{target}: {title}, {size(total)}", facts)


def write_figure(figures, name, runs, target, options):
    """Writes a figure of runs as a picture or as numbers; of several runs, the first column names the run."""
    if name not in figures:
        raise UserError(f"unknown figure '{name}': one of {', '.join(figures)}")
    figure, suffix = figures[name], pathlib.Path(target).suffix.lower()
    if suffix not in (*PICTURES, ".csv"):
        raise UserError(f"{target}: expected a name that ends in {', '.join(PICTURES)} or .csv")
    for one in runs:
        with Progress("mill plot", 1.0) as watch:
            figure.prepare(one, lambda share: watch(share, "log of impacts"))
    if suffix != ".csv":
        from milltools.figures import base, style

        style.save(figure.draw(runs, **options), target, DOTS, base.LOOK)
        return
    tables = figure.tables(runs, **options)
    who = [[table.name] * (len(tables) > 1) for table in tables]
    rows = ([*name, *row] for name, table in zip(who, tables) for row in zip(*table.columns.values()))
    write_csv(target, ["run"] * (len(tables) > 1) + list(tables[0].columns), rows)


def tell(figures, runs) -> Answer:
    """All figures; for a run without one of them also the reason."""
    lines, found = [], []
    for figure in figures.values():
        reasons = {r.path: why for r in runs if (why := figure.why_not(r))}
        lines.append(f"{figure.name:<20} {figure.title}")
        lines += [f"{'':<20}   not for {path}: {why}" for path, why in reasons.items()]
        found.append({"name": figure.name, "title": figure.title, "not_for": reasons})
    return Answer("\n".join(lines), {"files": [], "figures": found})
