#!/usr/bin/env python3
"""Compares soft and hard millsim with LIGGGHTS, by `mill dem`, and writes RESULTS-liggghts.md.

.venv/bin/python validation/referee/liggghts.py [MILL ...]      exit status 1 if soft millsim is off LIGGGHTS
.venv/bin/python validation/referee/liggghts.py dense [MILL ...]    the dense charges, into RESULTS-dense.md
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


def drum(name, fill, speed, *sets, starts=3, end=4.5, modulus=1e9):
    """The drum with eight bars at another filling [%] and another part of the critical speed [%]."""
    turn = f"motion.roll.speed={9.81**0.5 / 0.094**0.5 * speed / 100:.6g} rad/s"
    return Mill(name, "bars", modulus, starts, 1.5, end, (f"balls.bulk_fill={fill} %", turn, *sets))


def stirred(name, fill, *sets):
    """The attritor with boxes as arms."""
    return Mill(name, "stirred", 1e9, 3, 0.6, 1.2, (f"balls.bulk_fill={fill} %", *sets))


DENSE = [
    drum("drum 20 %, 70 % critical", 20, 70),
    drum("drum 30 %, 50 % critical", 30, 50),
    drum("drum 30 %, 70 % critical", 30, 70),
    drum("drum 30 %, 90 % critical", 30, 90),
    drum("drum 42 %, 60 % critical", 42, 60),
    drum("drum 45 %, 70 % critical", 45, 70),
    drum("drum 30 %, e 0.5", 30, 70, "contact.restitution=0.5"),
    drum("drum 30 %, e 0.3", 30, 70, "contact.restitution=0.3"),
    drum("drum 30 %, mu 0.1", 30, 70, "contact.friction=0.1"),
    drum("drum 30 %, 10 GPa", 30, 70, modulus=1e10, starts=3, end=3.5),
    stirred("attritor 30 %", 30),
    stirred("attritor 55 %", 55),
    stirred("attritor 70 %", 70),
    stirred("attritor 55 %, e 0.5", 55, "contact.restitution=0.5"),
    Mill("planetary, with powder", "planetary", 1e10, 3, 0.1, 0.5,
         ("contact.restitution=0.3", "contact.friction=0.6", "contact.restitution_speed=0 m/s")),
    Mill("drum 30 %, 12 and 4 mm", "bars-mixed", 1e9, 3, 1.5, 3.0),
]  # fmt: skip


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
    dense = names[:1] == ["dense"]
    all_mills, names = (DENSE, names[1:]) if dense else (MILLS, names)
    chosen = [mill for mill in all_mills if not names or mill.name in names]
    with tempfile.TemporaryDirectory(prefix="millsim-liggghts-") as folder:
        table, off = comparison.table(Runner(folder), chosen, liggghts, "LIGGGHTS")
    made = f"`liggghts.py{' dense' * dense}{''.join(' ' + repr(n) for n in names)}` with millsim {version()}"
    page, title = ("dense", "Dense charges compared") if dense else ("liggghts", "Compared")
    comparison.write_page(f"RESULTS-{page}.md", f"{title} with LIGGGHTS", made, ["", *table], off)
    return 1 if off else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
