"""What one task of a Slurm array does: `python -m milltools.study.remote.slurm_task FOLDER TASK`, FOLDER an array's (spool.py).

It runs its jobs one after the other on each of its cores (--cpus-per-task, 1 by default) and says each result before it
takes the next job. It needs no Slurm: the line above, typed by hand, does the same work. A task that Slurm puts back into
the queue finds what it did before. SIGTERM, which comes shortly before a time limit or a scancel strikes, ends the runs in
hand; what was finished is kept.
"""

import collections
import importlib
import os
import pathlib
import shlex
import signal
import socket
import sys
import tempfile
import threading
import time

from milltools.study.plan.job import Lost, end_all
from milltools.study.remote.spool import Array, Listener, Sayer, one_line

MOMENT = 1.0  # [s] a run and its task are struck together, but one may feel it before the other
TRIES = 3  # times that a job is begun in one task before it is called lost


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


def _function(call):
    module, name = call.split(":")
    return getattr(importlib.import_module(module), name)


class Task:
    """The jobs of one task that are not done yet, and where their results go."""

    def __init__(self, array, number):
        self.begun, finished = collections.Counter(), set()
        for said in Listener(array.rows(number)).listen():
            if "start" in said:
                self.begun[said["start"]] += 1
            elif "row" in said:
                finished.add(said["row"].get("id"))
            elif "lost" in said or "error" in said:
                finished.add(said.get("lost", said.get("error")))
        entries = array.entries(number)
        self.left = collections.deque(e for e in entries if e["job"]["id"] not in finished)
        self.sayer = Sayer(array.rows(number))
        self.lock = threading.Lock()
        self.ended = threading.Event()  # by us: whoever resubmits it will see what was begun

    def say(self, line):
        with self.lock:
            self.sayer.say(line)

    def next(self):
        with self.lock:
            return self.left.popleft() if self.left and not self.ended.is_set() else None

    def work(self):
        """Takes jobs until none is left: one of this runs on each core."""
        while entry := self.next():
            job = entry["job"]
            name = job["id"]
            if self.begun[name] >= TRIES:
                self.say({"lost": name, "why": f"its task was ended {TRIES} times while it ran"})
                continue
            self.say({"start": name, "host": f"{socket.gethostname()}:{os.getpid()}"})
            try:
                said = {"row": _function(entry["call"])(job)}
            except Lost as fault:
                if self.ended.wait(MOMENT):
                    return
                said = {"lost": name, "why": one_line(fault)}
            except Exception as fault:
                said = {"error": name, "why": one_line(fault)}
            self.say(said)

    def stop(self):
        """Ends the runs in hand and takes no other job."""
        self.ended.set()
        end_all()


def _cores():
    try:
        return max(1, int(os.environ["SLURM_CPUS_PER_TASK"]))
    except (KeyError, ValueError):
        return 1


def run(folder, number):
    """All jobs of this task; returns the exit status."""
    array = Array(folder, "")
    task = Task(array, number)
    struck = []  # a handler must not wait for a lock, as Event.set() may
    signal.signal(signal.SIGTERM, lambda *_: struck.append(True))
    threads = [threading.Thread(target=task.work, daemon=True) for _ in range(_cores())]
    for thread in threads:
        thread.start()
    # the main thread only sleeps, so that a signal finds it; runs that are killed end within moments
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.1)
        if struck:
            task.stop()
            for thread in threads:
                thread.join(5)
            return 128 + signal.SIGTERM
    task.say({"end": True})
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
