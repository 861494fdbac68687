"""A study for the tests of clusters, and a millsim that writes down each of its runs."""

import collections
import os
import pathlib
import subprocess
import sys
import time

import pandas
from conftest import PROGRAM, ROOT, SMALL

from milltools.study.plan.table import Table

QUIET = ("-q", "--no-picture")
TOOLS = str(ROOT / "tools")

STUDY = """\
[study]
deck = deck.ini
maximise = rotor/power
[vary]
balls.count = 10..{last}
rotor.speed = 300, 600 rpm
"""

# Runs are slowed down by the number in the file `pause`; looks at a deck are no runs.
COUNTED = """\
#!{python} -SE
import os, sys, time
words = sys.argv[1:]
if "run.h5" in words and "run.time=1 ns" not in words:
    count, speed = ([w for w in words if w.startswith(k)][-1] for k in ("balls.count", "rotor.speed"))
    task = os.environ.get("SLURM_ARRAY_JOB_ID", "-") + "_" + os.environ.get("SLURM_ARRAY_TASK_ID", "-")
    with open({log!r}, "a") as log:
        log.write(f"{{count}},{{speed}}\\t{{task}}\\t{{os.getpid()}}\\n")
    time.sleep(float(open({pause!r}).read()))
os.execv({program!r}, [{program!r}, *words])
"""


class Case:
    """A folder with a study NAME.study of 2 x (last - 9) designs. sweep() runs it, start() starts it; starts() says what
    was run."""

    def __init__(self, folder, last=15, environment=None, name="t"):
        self.name, self.designs = name, 2 * (last - 9)
        self.folder = pathlib.Path(folder)
        self.log, self.program = self.folder / "starts", self.folder / "counted"
        (self.folder / "deck.ini").write_text(SMALL)
        (self.folder / f"{name}.study").write_text(STUDY.format(last=last))
        (self.folder / "scratch").mkdir()
        self.pause(0)
        self.program.write_text(
            COUNTED.format(
                python=sys.executable,
                log=str(self.log),
                pause=str(self.folder / "pause"),
                program=str(PROGRAM.resolve()),
            )
        )
        self.program.chmod(0o755)
        self.environment = {
            **os.environ,
            "PYTHONPATH": TOOLS,
            "MILLSIM": str(self.program),
            "TMPDIR": str(self.folder / "scratch"),
            **(environment or {}),
        }
        self.started = []

    def pause(self, seconds):
        (self.folder / "pause").write_text(str(seconds))

    def start(self, *words):
        """`mill sweep NAME.study ...` as a process; stop() ends it if it still runs."""
        process = subprocess.Popen(
            [sys.executable, "-m", "milltools", "sweep", f"{self.name}.study", *QUIET, *words],
            cwd=self.folder,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.started.append(process)
        return process

    def sweep(self, *words, timeout=60):
        """The same, to its end: status, stdout, stderr."""
        process = self.start(*words)
        said = process.communicate(timeout=timeout)
        return subprocess.CompletedProcess(words, process.returncode, *said)

    def stop(self):
        for process in self.started:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def starts(self):
        """[(design, ARRAY_TASK, pid)] of all runs so far."""
        if not self.log.exists():
            return []
        return [tuple(line.split("\t")) for line in self.log.read_text().splitlines()]

    def runs(self):
        """{design: how often it was run}"""
        return collections.Counter(design for design, _, _ in self.starts())

    def kept(self):
        """How many rows the table has, whatever became of its driver."""
        return len(Table.open(self.folder / f"{self.name}.parquet"))

    def await_starts(self, count, timeout=30):
        wait(lambda: len(self.starts()) >= count, f"{count} runs", timeout)

    def table(self):
        return pandas.read_parquet(self.folder / f"{self.name}.parquet").sort_values("design")


def wait(ready, what, timeout=30):
    end = time.monotonic() + timeout
    while not ready():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.02)


def alive(pid):
    """Does this process run? (One that has ended and nobody has asked for does not.)"""
    try:
        state = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def facts(table):
    """What must not depend on where a study was run: all but times and workers."""
    return table.drop(columns=["cpu", "wall", "worker", "finished"]).reset_index(drop=True)
