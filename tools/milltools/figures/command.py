"""`mill plot`: runs as pictures. Without --figure the overview of one run; with it one of milltools.figures, of one run
or several, or its numbers."""

import contextlib
import pathlib

from milltools.base.errors import UserError
from milltools.base.files import keep_apart, write_csv
from milltools.base.progress import Progress

SUMMARY = (
    "Draws runs. Without --figure an overview of one run: the mill and its balls coloured by speed, where the energy "
    "goes, and the spectrum of impact speeds of each contact kind. With --figure one figure of one run or several, or its "
    "numbers. The format follows the name of the file: .png, .svg, .pdf, or .csv for the numbers."
)
PICTURES = (".png", ".svg", ".pdf")
DOTS, FEWER = 200, 90  # per inch, of a figure (a PNG, and the fields of maps), and of the overview


def add_arguments(parser):
    parser.add_argument("runs", nargs="*", metavar="run.h5", help="output files of runs")
    parser.add_argument("file", nargs="?", help="where it goes; an old one is replaced")
    parser.add_argument("--figure", metavar="NAME", help="one of those that --list names")
    parser.add_argument("--list", action="store_true", help="names the figures; of the runs, if given")
    parser.add_argument(
        "--kind", action="append", metavar="KIND", dest="kinds",
        help="spectra of this contact kind alone, such as ball_ball, ball_drum or all; may be repeated",
    )  # fmt: skip
    parser.add_argument("--strikes", action="store_true", help="spectra of strikes: re-contacts of a pair merged")
    parser.add_argument("--per-ball", action="store_true", help="spectra divided by the number of balls")


def run(arguments) -> int:
    from milltools.figures import FIGURES
    from milltools.read.runfile import Run

    names = [*arguments.runs, *filter(None, [arguments.file])]
    with contextlib.ExitStack() as stack:
        if arguments.list:
            return tell(FIGURES, [stack.enter_context(Run(path)) for path in names])
        if len(names) < 2:
            raise UserError("expected a run and the name of a picture; see 'mill plot --help'")
        *paths, target = names
        keep_apart(target, paths)
        options = {name: value for name in ("kinds", "strikes", "per_ball") if (value := getattr(arguments, name))}
        runs = [stack.enter_context(Run(path)) for path in paths]
        if arguments.figure:
            write_figure(FIGURES, arguments.figure, runs, target, options)
            return 0
        if len(runs) > 1 or options or pathlib.Path(target).suffix.lower() == ".csv":
            raise UserError(
                f"the overview is of one run, as a picture; say which figure: --figure {', '.join(FIGURES)}"
            )
        runs[0].need_statistics()
        from milltools.figures import overview, style

        style.save(overview.draw(runs[0]), target, FEWER)
    return 0


def write_figure(figures, name, runs, target, options):
    """A figure of runs as a picture, or its numbers: of several runs with their names in front."""
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


def tell(figures, runs) -> int:
    """The figures there are; those that a run does not have with the reason."""
    for figure in figures.values():
        reasons = [f"{r.path}: {why}" for r in runs if (why := figure.why_not(r))]
        print(f"{figure.name:<20} {figure.title}" + "".join(f"\n{'':<20}   not of {r}" for r in reasons))
    return 0
