"""The `mill` command: `mill SUBCOMMAND ...`, and its overview `mill --help`.

A sub-command is a module with SUMMARY (a sentence or two), add_arguments(parser) and run(arguments) -> Answer. The
module is imported only when the sub-command runs, so that the overview needs neither numpy nor matplotlib.
Exit status: 0 done; 1 a failure outside of mill, such as a full disk; 2 wrong usage or input; 128 + N: signal N.
"""

import argparse
import contextlib
import dataclasses
import difflib
import importlib
import os
import sys

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.processes import Stopped


@dataclasses.dataclass(frozen=True)
class Command:
    name: str
    line: str
    example: str

    @property
    def module(self) -> str:
        return f"milltools.{HOMES.get(self.name, f'{self.name}.command')}"


# modules of the commands that are not in the command.py of a package of the same name
HOMES = {"plot": "figures.command", "wear": "dose.wear", "sweep": "study.sweep", "optimize": "study.optimize"}

# in the order in which a user meets them
COMMANDS = (
    Command("studio", "a page in which a mill turns, simulated live in the browser, with sliders for its design",
            "studio input/planetary.ini"),
    Command("watch", "shows a run while it goes on, in the browser: balls, results so far, time left",
            "watch input/simoloyer.ini"),
    Command("plot", "draws runs: an overview, or figures (energy, spectra, maps, power); also numbers as CSV",
            "plot reference.h5 reference.png"),
    Command("report", "a web page of one run: moving balls in 3D, energy balance, spectra, maps, numbers",
            "report reference.h5"),
    Command("dose", "what the impacts do to the powder: dose, stress energy, hard impacts, temperatures",
            "dose reference.h5"),
    Command("wear", "which parts of the mill the balls wear, by part and face: impacts, power, depth",
            "wear reference.h5"),
    Command("power", "the power of a tumbling mill by Morrell, Bond, Hogg & Fuerstenau, Austin, beside its run",
            "power input/bond.ini"),
    Command("render", "3D pictures and films of a run, in slow motion or next to a film of a camera",
            "render reference.h5 movie.mp4 --slow 50"),
    Command("check", "do hard spheres hold for a mill? runs it with soft ones, too, and says so in a sentence",
            "check input/planetary.ini"),
    Command("dem", "runs the same deck with soft spheres in LIGGGHTS, into a file of the same format",
            "dem input/simoloyer.ini -o soft.h5"),
    Command("compare", "compares two or more runs: differences, standard errors, verdicts, pictures",
            "compare reference.h5 soft.h5 --html compared.html"),
    Command("sweep", "makes many runs with varied deck keys on all cores or a cluster, in one table",
            "sweep input/process.study"),
    Command("optimize", "finds the best design of a study with few runs, with confidence intervals",
            "optimize input/figure7.study"),
    Command("study", "shows the results of a study: best designs, contours, slices, Pareto front, CSV",
            "study figure7.parquet --html figure7.html"),
    Command("export", "a run for other programs: OVITO (GSD), ParaView (VTP), tables (CSV), the mill (STL)",
            "export reference.h5 balls.gsd"),
    Command("mesh", "makes one closed mesh for a deck from STL, OBJ, PLY and 3MF files: mends, unites",
            "mesh hub.stl pins.3mf -o rotor.stl"),
    Command("contour", "makes the contour of a drum from a drawing (DXF) of its liner; shows contours",
            "contour liner.dxf -o liner.txt --draw liner.svg"),
)  # fmt: skip


class Parser(argparse.ArgumentParser):
    """Reports wrong usage in one line that names the help."""

    def error(self, message):
        raise UserError(f"{message}; see '{self.prog} --help'")


def tour() -> str:
    mill, millsim = engine.called(), engine.MILLSIM
    lines = [
        "mill: tools around millsim, the simulator of high-energy ball mills.",
        "",
        f"    {mill} COMMAND [options] ...      COMMAND --help: its options      --version",
        "",
    ]
    for command in COMMANDS:
        lines += [f"  {command.name:<9} {command.line}", f"            $ {mill} {command.example}"]
    lines += [
        "",
        f"First make a run: '{millsim} input/simoloyer.ini' writes simoloyer.h5 ('make run': reference.h5).",
        "input/ also has decks of other mills: planetary, mixer, shaker, tumbling, attritors and more.",
        f"It is in the sources; '{millsim} --examples input' copies it here. The sources have docs/, too:",
        "docs/mills.md lists these decks and explains how to describe your own mill,",
        "docs/deck.md the keys of a deck, docs/file-format.md the output file,",
        "docs/compare.md the comparison of runs, docs/studies.md studies with many runs.",
    ]
    return "\n".join(lines)


def add_arguments(command: Command, parser: argparse.ArgumentParser):
    """Describes a command to a parser of its arguments."""
    module = importlib.import_module(command.module)
    parser.description = module.SUMMARY
    parser.epilog = f"example: {engine.called()} {command.example}"
    module.add_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output, nothing else")


def dispatch(words: list[str]) -> int:
    """Runs one command line (without the program's name); returns the exit status."""
    if not words or words[0] in ("-h", "--help", "help"):
        print(tour())
        return 0
    if words[0] in ("-V", "--version"):
        print(f"mill {engine.version()}")
        return 0
    if words[0].startswith("-"):
        raise UserError(f"unknown option '{words[0]}'; see 'mill --help'")
    command = next((one for one in COMMANDS if one.name == words[0]), None)
    if command is None:
        names = [one.name for one in COMMANDS]
        meant = "".join(f"; did you mean '{name}'?" for name in difflib.get_close_matches(words[0], names, 1))
        raise UserError(f"unknown command '{words[0]}'{meant or ': one of ' + ', '.join(names)}")
    parser = Parser(prog=f"mill {command.name}", allow_abbrev=False)
    add_arguments(command, parser)
    parser.set_defaults(words=["mill", *words])  # for commands that record their command line
    arguments = parser.parse_args(words[1:])
    with contextlib.redirect_stdout(sys.stderr) if arguments.json else contextlib.nullcontext():
        answer = importlib.import_module(command.module).run(arguments)
    answer.show(command.name, arguments.json)
    return answer.status


def main() -> int:
    words = sys.argv[1:]
    name = f"mill {words[0]}" if words and words[0] in {c.name for c in COMMANDS} else "mill"
    try:
        status = dispatch(words)
        sys.stdout.flush()
        return status
    except UserError as fault:
        print(*(f"{name}: {line}" for line in fault.lines), sep="\n", file=sys.stderr)
        return fault.status
    except Stopped as stop:
        print(f"{name}: stopped", file=sys.stderr)
        return 128 + stop.number
    except KeyboardInterrupt as stop:  # that of a study has a text about its progress and the status of the signal
        print(f"{name}: {str(stop) or 'interrupted'}", file=sys.stderr)
        return getattr(stop, "status", 130)
    except BrokenPipeError:
        # the reader closed the pipe; Python must not try at exit to write the rest of the buffer
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141  # the status of a program that SIGPIPE ends


if __name__ == "__main__":
    sys.exit(main())
