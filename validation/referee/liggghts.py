#!/usr/bin/env python3
"""Compares soft and hard millsim with LIGGGHTS, by `mill dem`, and writes RESULTS-liggghts.md.

.venv/bin/python validation/referee/liggghts.py [MILL ...]      exit status 1 if soft millsim is off LIGGGHTS
"""

import contextlib
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent.parent / "tools")]

import comparison
from comparison import Mill
from validate import Runner

from milltools.base.engine import version
from milltools.read.runfile import Run

MILLS = [
    Mill("emax", "emax", 1e10, 6, 0.1, 0.3),
    Mill("gas", "gas", 1e9, 6, 0.02, 0.06, ("output.series=0.1 ms",)),
    Mill("planetary", "planetary", 1e10, 6, 0.1, 0.4),
    Mill("reference mill", "simoloyer", 1e9, 6, 0.06, 0.16),
    Mill("single", "single", 1e10, 6, 0.0, 0.2),
    Mill("tumbling, bars with sharp edges", "tumbling", 1e9, 6, 1.0, 4.0, ("body.lifter.rounding=0 mm",)),
    Mill("drum with eight bars", "bars", 1e9, 6, 1.5, 5.0),
]


def measure(runner, mill, path, sets):
    """The quantities of LIGGGHTS' run of a deck with these overrides."""
    output = pathlib.Path(runner.folder, "liggghts.h5")
    words = [word for one in sets for word in ("-s", one)]
    subprocess.run(
        [sys.executable, "-m", "milltools", "dem", path, *words, "--modulus", f"{mill.modulus:g}", "-q", "-f", "--json",
         "-o", output], check=True, stdout=subprocess.DEVNULL, cwd=HERE.parent.parent / "tools",
    )  # fmt: skip
    with contextlib.closing(Run(output)) as run:
        # its cost without output, which is nearly all of the work of `mill dem`
        return comparison.of_file(run) | {"cpu": float(run.read("run/price")) * run.time}


def liggghts(runner, mill, path, own, _):
    """The same, or what an earlier call gave."""
    key = json.dumps([str(path), own, mill.modulus])
    return runner.kept(f"LIGGGHTS {mill.name} {own[0]}", key, lambda: measure(runner, mill, path, own))


def main(names):
    chosen = [mill for mill in MILLS if not names or mill.name in names]
    with tempfile.TemporaryDirectory(prefix="millsim-liggghts-") as folder:
        table, off = comparison.table(Runner(folder), chosen, liggghts, "LIGGGHTS")
    made = f"`liggghts.py{''.join(' ' + repr(n) for n in names)}` with millsim {version()}"
    comparison.write_page("RESULTS-liggghts.md", "Compared with LIGGGHTS", made, ["", *table], off)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
