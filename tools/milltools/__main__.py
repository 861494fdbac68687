"""The `mill` command: `mill SUBCOMMAND ...`, and its tour `mill --help`.

A sub-command is a module with SUMMARY (a sentence or two), add_arguments(parser) and run(arguments) -> exit
status. It is imported only when it is used, so the tour needs neither numpy nor matplotlib; hence its line for the tour
stands here. Exit status: 0 done; 1 something outside failed; 2 wrong usage or input; 130 Ctrl-C.
"""

import argparse
import dataclasses
import importlib
import os
import shutil
import sys

from milltools.base import engine
from milltools.base.errors import UserError


@dataclasses.dataclass(frozen=True)
class Command:
    name: str
    line: str
    example: str

    @property
    def module(self) -> str:
        return f"milltools.{HOMES.get(self.name, f'{self.name}.command')}"


# where a command lives, if not in the command.py of the package of its name
HOMES = {"plot": "figures.command", "sweep": "study.sweep", "optimize": "study.optimize"}

# in the order in which they are met
COMMANDS = (
    Command("plot", "runs as pictures: an overview, or figures: energy, spectra, maps, power; their numbers",
            "plot reference.h5 reference.png"),
    Command("report", "one run as a page: the balls turning, where the energy goes, spectra, maps, numbers",
            "report reference.h5"),
    Command("render", "pictures and films of a run in 3D, slow motion too, also beside a camera's film",
            "render reference.h5 movie.mp4 --slow 50"),
    Command("dem", "the same deck as soft spheres, in LIGGGHTS, into a file of the same schema",
            "dem input/simoloyer.ini -o soft.h5"),
    Command("compare", "two or more runs side by side: differences, standard errors, verdicts, pictures",
            "compare reference.h5 soft.h5 --html compared.html"),
    Command("sweep", "many runs: deck keys varied over ranges, on all cores or a cluster, in one table",
            "sweep input/process.study"),
    Command("optimize", "the best design of a study in few runs, with confidence intervals",
            "optimize input/figure7.study"),
    Command("study", "what a study found: best designs with confidence, contours, slices, Pareto front, CSV",
            "study figure7.parquet --html figure7.html"),
    Command("export", "a run for other programs: OVITO (GSD), ParaView (VTP), tables (CSV), its mill as STL",
            "export reference.h5 balls.gsd"),
)  # fmt: skip


class Parser(argparse.ArgumentParser):
    """Wrong usage is one line, and says where help is."""

    def error(self, message):
        raise UserError(f"{message}; see '{self.prog} --help'")


def called() -> str:
    """How this command was called, as it is to be called again: "mill" where the shell finds it, else "./mill"."""
    name = os.environ.get("MILL_CALLED") or sys.argv[0]
    if name.endswith("__main__.py"):
        return "python -m milltools"
    found = shutil.which(os.path.basename(name))
    return os.path.basename(name) if found and os.path.samefile(found, name) else name


def tour() -> str:
    mill, millsim = called(), "./millsim" if engine.in_checkout() else "millsim"
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
        f"A run comes first: '{millsim} input/simoloyer.ini' writes simoloyer.h5 ('make run': reference.h5).",
        "input/ has decks of other mills, too: planetary, mixer, shaker, tumbling mills, attritors and more:",
        "docs/mills.md says which, and how to describe your own.",
        "Next: docs/deck.md says what a deck can hold, docs/file-format.md what is in the file,",
        "docs/compare.md how runs are compared, docs/studies.md how many are made.",
    ]
    return "\n".join(lines)


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
        raise UserError(f"unknown command '{words[0]}': one of {', '.join(c.name for c in COMMANDS)}")
    module = importlib.import_module(command.module)
    parser = Parser(
        prog=f"mill {command.name}",
        description=module.SUMMARY,
        epilog=f"example: {called()} {command.example}",
        allow_abbrev=False,
    )
    module.add_arguments(parser)
    parser.set_defaults(words=["mill", *words])  # for commands that write down how they were called
    return module.run(parser.parse_args(words[1:]))


def main() -> int:
    words = sys.argv[1:]
    name = f"mill {words[0]}" if words and words[0] in {c.name for c in COMMANDS} else "mill"
    try:
        status = dispatch(words)
        sys.stdout.flush()
        return status
    except UserError as fault:
        print(f"{name}: {fault}", file=sys.stderr)
        return fault.status
    except KeyboardInterrupt as stop:  # one of a study says how far it is, and which signal it was
        print(f"{name}: {str(stop) or 'interrupted'}", file=sys.stderr)
        return getattr(stop, "status", 130)
    except BrokenPipeError:
        # whoever read our output has had enough; what is still buffered must not be tried again at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141  # as a program ended by SIGPIPE


if __name__ == "__main__":
    sys.exit(main())
