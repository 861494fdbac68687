"""Tasks of a Slurm array: what one does, `python -m milltools.study.remote.slurm_task FOLDER TASK`, and the folder
through which it talks with its driver, on a file system that they share.

A task runs its jobs one after the other on each of its cores (--cpus-per-task, 1 by default) and says each result
before it takes the next job. It needs no Slurm: the line above, typed by hand, does the same work. A task that Slurm
puts back into the queue finds what it did before. SIGTERM, which comes shortly before a time limit or a scancel
strikes, ends the runs in hand; what was finished is kept.

    TABLE.slurm/token            names the study in Slurm's queue: no other has the same
    TABLE.slurm/00003/           one array, FOLDER; its name in the queue is mill-TABLE-TOKEN-00003
        job                      what sbatch said: the number of the array, empty while it is not known
        12.jobs                  what task 12 is to do, one job a line: {"call": "module:function", "job": {...}}
        12.rows                  what task 12 says, one line (JSON) each time, see below
        12.out                   standard output and error of task 12

A task says {"start": id, "host": ...} before a job and then one of {"row": row}, {"lost": id, "why": ...}, {"error":
id, "why": ...}; {"end": true} when nothing is left to do. Each line is one write() and on the disk before the next
job begins, so whatever ends a task, what it finished is kept, and it is known which jobs it had in hand. A line torn
by a crash is not a line: the next one begins anew.
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

MOMENT = 1.0  # [s] a run and its task are struck together, but one may feel it before the other
TRIES = 3  # times that a job is begun in one task before it is called lost


# ---- the folder


def ended_job(said):
    """The id of the job whose end a line tells, None for another line."""
    row = said.get("row")
    return row.get("id") if isinstance(row, dict) else said.get("lost", said.get("error"))


class Sayer:
    """Appends lines to a file so that none is lost or torn, whoever dies: the writing end of NAME.rows. For all
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
    """What has been appended to a file since the last look: the reading end of NAME.rows."""

    def __init__(self, path):
        self.path, self.offset, self.rest = path, 0, b""

    def listen(self):
        """The new whole lines, as dicts; a file that is not there says nothing. Opening it anew each time makes a
        network file system ask its server."""
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
            with contextlib.suppress(ValueError):  # torn: whoever wrote it died
                said.append(json.loads(line))
        return [value for value in said if isinstance(value, dict)]


def _text(path) -> str:
    """What a file says; nothing if it is not there."""
    try:
        return path.read_text(errors="replace")
    except OSError:
        return ""


class Array:
    """One array's folder. write() makes it, before sbatch is called."""

    def __init__(self, folder, name):
        self.folder, self.name = pathlib.Path(folder), name

    def write(self, bundles):
        """bundles: per task the list of its entries {"call":, "job":}."""
        self.folder.mkdir()
        for number, entries in enumerate(bundles):
            lines = "".join(json.dumps(entry) + "\n" for entry in entries)
            (self.folder / f"{number}.jobs").write_text(lines)
            # known to every host before a task writes to it: who reads in vain remembers that for a while on NFS
            self.rows(number).touch()

    def rows(self, number):
        return self.folder / f"{number}.rows"

    def entries(self, number):
        """The jobs of a task, as written; a task without a readable list is a ValueError."""
        with open(self.folder / f"{number}.jobs") as file:
            return [json.loads(line) for line in file]

    def tasks(self):
        return sorted(int(path.stem) for path in self.folder.glob("*.jobs"))

    @property
    def job(self):
        """Slurm's number of the array, as sbatch said; None while it is not known."""
        found = re.match(r"\d+", _text(self.folder / "job"))
        return found and found[0]

    def last_words(self, number):
        """The last line of what a task printed, to tell why it ended; empty if it said nothing."""
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
        """Those that an earlier driver left, oldest first."""
        found = [path for path in self.folder.glob("[0-9]*") if (path / "0.jobs").exists()]
        return [Array(path, f"{self.prefix}-{path.name}") for path in sorted(found)]

    def create(self, bundles):
        """A new array, written whole."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "token").write_text(self.token + "\n")
        number = 1 + max((int(p.name) for p in self.folder.glob("[0-9]*")), default=0)
        array = Array(self.folder / f"{number:05d}", f"{self.prefix}-{number:05d}")
        array.write(bundles)
        return array


# ---- what a task does


def script(array):
    """The batch script of an array. Its tasks find this very milltools, whatever the site does to their environment."""
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
    ended = threading.Event()  # by us: whoever resubmits it will see what was begun

    def work():
        """Takes jobs until none is left: one of this runs on each core."""
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

    struck = []  # a handler must not wait for a lock, as Event.set() may
    signal.signal(signal.SIGTERM, lambda *_: struck.append(True))
    cores = os.environ.get("SLURM_CPUS_PER_TASK", "")
    threads = [threading.Thread(target=work, daemon=True) for _ in range(max(1, int(cores)) if cores.isdigit() else 1)]
    for thread in threads:
        thread.start()
    # the main thread only sleeps, so that a signal finds it; runs that are killed end within moments
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
    # runs keep what they need for a while in a folder of this task's, so that none of it stays where they were killed
    with tempfile.TemporaryDirectory(prefix="mill-", ignore_cleanup_errors=True) as scratch:
        tempfile.tempdir = os.environ["TMPDIR"] = scratch
        try:
            return run(pathlib.Path(sys.argv[1]), int(sys.argv[2]))
        except OSError as fault:
            print(f"mill: {fault}", file=sys.stderr)
            return 1


if __name__ == "__main__":
    sys.exit(main())
