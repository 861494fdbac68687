"""Tasks of a Slurm array: the program of one task, `python -m milltools.study.remote.slurm_task FOLDER TASK`, and the
folder, on a shared file system, through which the task and its driver exchange jobs and results.

A task runs its jobs one after the other on each of its cores (--cpus-per-task, 1 by default) and writes each result
before it takes the next job. It does not need Slurm: the command above, typed by hand, does the same work. A task that
Slurm puts back into the queue finds its earlier results. SIGTERM, which comes shortly before a time limit or a scancel
takes effect, ends the current runs; finished results are kept.

    TABLE.slurm/token            names the study in Slurm's queue: no other has the same
    TABLE.slurm/00003/           one array, FOLDER; its name in the queue is mill-TABLE-TOKEN-00003
        job                      output of sbatch: the number of the array, empty while it is not known
        12.jobs                  the jobs of task 12, one per line (JSON): {"call": "module:function", "job": {...}}
        12.rows                  the messages of task 12, one per line (JSON), see below
        12.out                   standard output and error of task 12

A task writes {"start": id, "host": ...} before a job and then one of {"row": row}, {"lost": id, "why": ...}, {"error":
id, "why": ...}; {"end": true} after the last job. Each line is one write() and is on the disk before the next job
begins. So, however a task ends, its finished results are kept, and the jobs that it was running are known. A line that
a crash has cut off does not count: the next message begins a new line.
"""

import collections
import contextlib
import json
import os
import pathlib
import pkgutil
import re
import secrets
import shlex
import signal
import sys
import tempfile
import threading
import time

from milltools.study.plan.job import Lost, end_all, worker
from milltools.study.remote.cluster import one_line

MOMENT = 1.0  # [s] a signal reaches a run and its task together, but one may react before the other
TRIES = 3  # number of starts of a job in one task before it counts as lost


# ---- the folder


def ended_job(said):
    """The id of the job whose end a line reports; None for other lines."""
    row = said.get("row")
    return row.get("id") if isinstance(row, dict) else said.get("lost", said.get("error"))


class Sayer:
    """Appends lines to a file so that a crash does not lose or cut off a line: the writer of NAME.rows. Safe for
    threads."""

    def __init__(self, path):
        self.lock = threading.Lock()
        self.file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
        size = os.fstat(self.file).st_size
        if size and os.pread(self.file, 1, size - 1) != b"\n":
            os.write(self.file, b"\n")

    def say(self, line):
        text = memoryview(json.dumps(line).encode() + b"\n")
        with self.lock:
            while text:
                text = text[os.write(self.file, text) :]
            os.fsync(self.file)


class Listener:
    """The lines appended to a file since the last reading: the reader of NAME.rows."""

    def __init__(self, path):
        self.path, self.offset, self.rest = path, 0, b""

    def listen(self):
        """The new complete lines, as dicts; none if the file does not exist. Opening the file each time makes a network
        file system ask its server."""
        try:
            with open(self.path, "rb") as file:
                file.seek(self.offset)
                new = file.read()
        except FileNotFoundError:
            return []
        self.offset += len(new)
        *whole, self.rest = (self.rest + new).split(b"\n")
        said = []
        for line in whole:
            with contextlib.suppress(ValueError):  # cut off: its writer died
                said.append(json.loads(line))
        return [value for value in said if isinstance(value, dict)]


def _text(path) -> str:
    """The text of a file; empty if it does not exist."""
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


class Array:
    """The folder of one array. write() makes it before sbatch is called."""

    def __init__(self, folder, name):
        self.folder, self.name = pathlib.Path(folder), name

    def write(self, bundles):
        """bundles: for each task the list of its entries {"call":, "job":}."""
        self.folder.mkdir()
        for number, entries in enumerate(bundles):
            lines = "".join(json.dumps(entry) + "\n" for entry in entries)
            (self.folder / f"{number}.jobs").write_text(lines)
            # the file must exist before a task writes to it: on NFS a host remembers a missing file for a while
            self.rows(number).touch()

    def rows(self, number):
        return self.folder / f"{number}.rows"

    def entries(self, number):
        """The jobs of a task, as written; ValueError if the list cannot be read."""
        with open(self.folder / f"{number}.jobs") as file:
            return [json.loads(line) for line in file]

    def tasks(self):
        return sorted(int(path.stem) for path in self.folder.glob("*.jobs"))

    @property
    def job(self):
        """Slurm's number of the array, from sbatch; None while it is not known."""
        found = re.match(r"\d+", _text(self.folder / "job"))
        return found and found[0]

    def last_words(self, number):
        """The last line that a task printed, which may explain its end; empty if it printed nothing."""
        lines = _text(self.folder / f"{number}.out").splitlines()
        return next((one_line(line) for line in reversed(lines) if line.strip()), "")


class Spool:
    """The folder as a whole. It is made when the first array is."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        word = re.sub(r"[^A-Za-z0-9_.-]+", "_", self.folder.with_suffix("").stem)[:24] or "study"
        self.token = _text(self.folder / "token").strip() or secrets.token_hex(4)
        self.prefix = f"mill-{word}-{self.token}"

    def arrays(self):
        """The arrays of earlier drivers, oldest first."""
        found = [path for path in self.folder.glob("[0-9]*") if (path / "0.jobs").exists()]
        return [Array(path, f"{self.prefix}-{path.name}") for path in sorted(found)]

    def create(self, bundles):
        """A new array, completely written."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "token").write_text(self.token + "\n")
        number = 1 + max((int(p.name) for p in self.folder.glob("[0-9]*")), default=0)
        array = Array(self.folder / f"{number:05d}", f"{self.prefix}-{number:05d}")
        array.write(bundles)
        return array


# ---- the program of a task


def script(array):
    """The batch script of an array. Its tasks use this copy of milltools, also if the site changes the environment."""
    tools = pathlib.Path(__file__).resolve().parents[3]
    words = [sys.executable, "-m", __name__, str(array.folder.resolve())]
    return (
        "#!/bin/sh\n"
        f"PYTHONPATH={shlex.quote(str(tools))}${{PYTHONPATH:+:$PYTHONPATH}}\n"
        "export PYTHONPATH\n"
        f"exec {shlex.join(words)} $SLURM_ARRAY_TASK_ID\n"
    )


def run(folder, number):
    """All jobs of this task that it has not done yet; returns the exit status."""
    array = Array(folder, "")
    before = Listener(array.rows(number)).listen()
    begun = collections.Counter(said["start"] for said in before if "start" in said)
    done = {ended_job(said) for said in before}
    left = iter([entry for entry in array.entries(number) if entry["job"]["id"] not in done])
    say = Sayer(array.rows(number)).say
    ended = threading.Event()  # by us: the next task will see which jobs were begun

    def work():
        """Takes jobs until none is left; there is one such thread per core."""
        while not ended.is_set() and (entry := next(left, None)):
            job = entry["job"]
            name = job["id"]
            if begun[name] >= TRIES:
                say({"lost": name, "why": f"its task was ended {TRIES} times while it ran"})
                continue
            say({"start": name, "host": worker()})
            try:
                said = {"row": pkgutil.resolve_name(entry["call"])(job)}
            except Lost as fault:
                if ended.wait(MOMENT):
                    return
                said = {"lost": name, "why": one_line(fault)}
            except Exception as fault:
                said = {"error": name, "why": one_line(fault)}
            say(said)

    struck = []  # a list, because a signal handler must not wait for a lock, as Event.set() may
    signal.signal(signal.SIGTERM, lambda *_: struck.append(True))
    cores = os.environ.get("SLURM_CPUS_PER_TASK", "")
    threads = [threading.Thread(target=work, daemon=True) for _ in range(max(1, int(cores)) if cores.isdigit() else 1)]
    for thread in threads:
        thread.start()
    # the main thread only sleeps, so that it can handle signals; killed runs end within moments
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.1)
        if struck:
            ended.set()
            end_all()
            for thread in threads:
                thread.join(5)
            return 128 + signal.SIGTERM
    say({"end": True})
    return 0


def main():
    if len(sys.argv) != 3 or not sys.argv[2].isdigit():
        print("usage: python -m milltools.study.remote.slurm_task FOLDER TASK", file=sys.stderr)
        return 2
    # runs put temporary files into a folder of this task, so that no files remain after they are killed
    with tempfile.TemporaryDirectory(prefix="mill-", ignore_cleanup_errors=True) as scratch:
        tempfile.tempdir = os.environ["TMPDIR"] = scratch
        try:
            return run(pathlib.Path(sys.argv[1]), int(sys.argv[2]))
        except OSError as fault:
            print(f"mill: {fault}", file=sys.stderr)
            return 1


if __name__ == "__main__":
    sys.exit(main())
