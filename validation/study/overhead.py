"""Additional computing cost of a study: 1000 designs of one CPU second each."""

import os
import resource
import subprocess
import sys

import pandas
from study_case import FIGURE7, ROOT

SPIN = '''#!{python}
"""Stands in for millsim: the file of a real run, after one second of CPU time, which includes its own start."""
import os, shutil, sys, time
if "-o" not in sys.argv or not any("run.seed" in word for word in sys.argv):
    os.execv("{program}", sys.argv)
target = sys.argv[sys.argv.index("-o") + 1]
shutil.copyfile("{sample}", target + ".stand-in")
while time.process_time() < {seconds}:
    pass
os.rename(target + ".stand-in", target)
os._exit(0)  # the end of Python's interpreter is no part of a study
'''
SECONDS = 1.0


def check(case):
    sample = case.run(ROOT / "input" / "simoloyer.ini", run__time="20 ms", run__sample_from="5 ms")
    fake = case.write(
        "spin",
        SPIN.format(python=sys.executable, program=case.program, sample=sample, seconds=SECONDS),
    )
    fake.chmod(0o755)
    table = case.scratch / "thousand.parquet"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [ROOT / "mill", "sweep", FIGURE7, "-o", table, "--set", "vary.drum.buckles=2..26",
         "--set", "vary.drum.buckle_height=0..9.75 mm step 0.25 mm"],
        env={**os.environ, "MILLSIM": str(fake)}, capture_output=True, check=True, cwd=case.scratch,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    all_of_it = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    rows = pandas.read_parquet(table)
    designs = SECONDS * len(rows)
    case.bound("number of the 1000 designs that are missing", 1000 - len(rows), 0, against="the grid is complete")
    case.bound(
        f"additional CPU time (driver, start of processes, table, picture), relative to the {designs:.0f} s of the "
        f"{len(rows)} designs",
        100 * (all_of_it / designs - 1), 5, unit="%", against="required: less than 5 %", headline=True,
    )  # fmt: skip
