"""A study for the tests of clusters, and a millsim that writes down each of its runs."""

import collections
import os
import pathlib
import subprocess
import sys
import time

import pandas
from conftest import PROGRAM, ROOT, SMALL, run_mill

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

# The file `hold` says which start of a task is the first that is held (of all starts, where there are no tasks), or,
# with "only", which of all starts is held alone: such a run goes on when the file is gone, so that no test needs a
# clock. Looks at a deck are no runs.
COUNTED = """\
#!{python} -SE
import os, sys, time
words = sys.argv[1:]
if "run.h5" in words and "run.time=1 ns" not in words:
    count, speed = ([w for w in words if w.startswith(k)][-1] for k in ("balls.count", "rotor.speed"))
    task = os.environ.get("SLURM_ARRAY_JOB_ID", "-") + "_" + os.environ.get("SLURM_ARRAY_TASK_ID", "-")
    try:
        first, *only = open({hold!r}).read().split()
    except FileNotFoundError:
        first, only = 10**9, []
    with open({log!r}, "a+") as log:
        log.seek(0)
        tasks = [line.split("\\t")[1] for line in log]
        held = len(tasks) + 1 == int(first) if only else tasks.count(task) + 1 >= int(first)
        log.write(f"{{count}},{{speed}}\\t{{task}}\\t{{os.getpid()}}\\t{{held:d}}\\n")
    while held and os.path.exists({hold!r}):
        time.sleep(0.02)
os.execv({program!r}, [{program!r}, *words])
"""


class Case:
    """A folder with a study NAME.study of 2 x (last - 9) designs. sweep() runs it, start() starts it; starts() says
    what was run; between hold() and release() runs wait."""

    def __init__(self, folder, last=13, environment=None, name="t"):
        self.name, self.designs = name, 2 * (last - 9)
        self.folder = pathlib.Path(folder)
        self.log, self.program, self.held = (self.folder / name for name in ("starts", "counted", "hold"))
        (self.folder / "deck.ini").write_text(SMALL)
        (self.folder / f"{name}.study").write_text(STUDY.format(last=last))
        (self.folder / "scratch").mkdir()
        self.program.write_text(
            COUNTED.format(
                python=sys.executable,
                log=str(self.log),
                hold=str(self.held),
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

    def hold(self, first, only=""):
        """Holds this start of each task and those behind it, from now on; "only": this one of all starts, and no
        other."""
        draft = self.folder / "hold.part"
        draft.write_text(f"{first} {only}")
        draft.replace(self.held)

    def release(self):
        self.held.unlink()

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

    def sweep(self, *words, timeout=120):
        """The same, to its end: status, stdout, stderr."""
        words = ["sweep", f"{self.name}.study", *QUIET, *words]
        return run_mill(self.folder, *words, timeout=timeout, env=self.environment)

    def stop(self):
        for process in self.started:
            if process.poll() is None:
                process.kill()
            process.communicate()

    def starts(self):
        """[(design, ARRAY_TASK, pid)] of all runs so far."""
        return [line[:3] for line in self._lines()]

    def _lines(self):
        text = self.log.read_text() if self.log.exists() else ""
        return [tuple(line.split("\t")) for line in text.split("\n")[:-1]]

    def runs(self):
        """{design: how often it was run}"""
        return collections.Counter(design for design, _, _ in self.starts())

    def kept(self):
        """How many rows the table has, whatever became of its driver."""
        return len(Table.open(self.folder / f"{self.name}.parquet"))

    def await_held(self, count):
        """Those runs that are held, as starts() gives them, when there are so many."""

        def held():
            return [line[:3] for line in self._lines() if line[3] == "1"]

        wait(lambda: len(held()) >= count, f"{count} runs that are held")
        return held()

    def table(self):
        return pandas.read_parquet(self.folder / f"{self.name}.parquet").sort_values("design")


def wait(ready, what, timeout=300):
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
