"""One run of a study: a job (a JSON-able dict, made by Study.job) -> a row (a flat dict, SI). `run` has no state, so
threads, Dask workers and tasks of a batch system can call it.

A run that ends by itself always gives a row: done, capped or failed. A run that is killed raises Lost, and the job
should be tried again.
"""

import datetime
import math
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

from milltools.base import engine, processes
from milltools.base.errors import UserError
from milltools.dose import dose, wear
from milltools.read import expression
from milltools.read.results import Results
from milltools.read.runfile import Run

FRICTIONLESS = "contacts were computed without friction"  # in the message of a run with the note "locks"
UNSETTLED = "not settled: no errors are known"  # of a run whose starts drift
NOTES = FRICTIONLESS, UNSETTLED


class Lost(Exception):
    """The run was killed from outside, or its machine failed: it has no result."""


def worker() -> str:
    """host:pid of this process."""
    return f"{socket.gethostname()}:{os.getpid()}"


def empty(job, status, message) -> dict:
    """The row of a run without results."""
    row = {name: job[name] for name in ("design", "replicate", "seed", "id")} | job["values"]
    for path in (*job["objectives"], *job["record"]):
        row[path] = row[f"{path}:error"] = math.nan
    row.update(results="", status=status, message=message, time=math.nan, sample_from=math.nan, collisions=0)
    row.update(cpu=0.0, wall=0.0, version="", worker=worker())
    return row | {"finished": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")}


def run(job, reader=None) -> dict:
    """Runs millsim once in a folder of its own, reads the results (`read`, or another reader(job, path)) and removes
    the folder."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="mill-"))
    try:
        deck = folder / pathlib.Path(job["deck"]).name
        deck.write_text(job["text"], encoding="utf-8")
        words = [word for text in job["set"] for word in ("-s", text)]
        # relative names: messages show the name of the deck only, and no path is too long
        # a study has a run on each core already
        threads = [] if any(text.startswith("run.threads=") for text in job["set"]) else ["-s", "run.threads=1"]
        options = ["-q", "-o", "run.h5", "-s", "output.frames=0 s", *threads, *words]
        command = [*processes.guard(), job["program"], *options, "--", deck.name]
        status, said, cut = _execute(command, folder, job["limit"])
        if status < 0 or (status > 128 and not cut):
            raise Lost(f"millsim was ended by signal {abs(status) % 128}")
        if status != 0 and not (cut and (folder / "run.h5").exists()):
            return empty(job, "failed", said or f"millsim ended with status {status}")
        row = (reader or read)(job, folder / "run.h5")
        if cut:
            why = f"stopped after {job['limit']:g} s of {cut}"
            row.update(status="capped", message="; ".join([why, *(note for note in NOTES if note in row["message"])]))
        return row
    finally:
        shutil.rmtree(folder, ignore_errors=True)


# ---- the process


PROC = "/proc/{pid}/stat"
_running: dict[int, subprocess.Popen] = {}  # thread -> its run
_lock = threading.Lock()
_ended = False


def end_all():
    """Ends all runs of this process; later runs raise Lost at once."""
    global _ended
    with _lock:
        _ended = True
        for process in _running.values():
            process.kill()


def end_of(threads):
    """Ends the runs of these threads."""
    with _lock:
        for thread in threads:
            if thread in _running:
                _running[thread].kill()


def _execute(command, folder, limit):
    """Exit status, its message in one line, and the kind of time whose `limit` [s] made us stop it ("": none)."""
    with _lock:
        if _ended:
            raise Lost("the study is ending")
        # a session of its own: only the driver reacts to Ctrl-C
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "start_new_session": True}
        process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, **quiet)
        _running[threading.get_ident()] = process
    cut, begin = "", time.monotonic()
    try:
        while True:
            left = None if limit is None or cut else max(limit - _spent(process.pid, begin)[0], 0.01)
            try:
                said = process.communicate(timeout=left)[1]
                break
            except subprocess.TimeoutExpired:
                spent, what = _spent(process.pid, begin)
                if spent >= limit:
                    cut = what
                    process.send_signal(signal.SIGTERM)  # millsim then saves its results
    finally:
        with _lock:
            del _running[threading.get_ident()]
        if process.poll() is None:
            process.kill()
            process.wait()
    said = said.decode(errors="replace").strip()
    return process.returncode, UserError(engine.complaints(process.returncode, said)).line if said else "", cut


def _spent(pid, begin) -> tuple[float, str]:
    """Time used by a process so far [s] and its kind: CPU time, or, if the system does not give it (no /proc),
    wall-clock time, which is never less."""
    try:
        with open(PROC.format(pid=pid)) as file:
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return time.monotonic() - begin, "wall-clock time (this system does not give the CPU time)"
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), "CPU time"


# ---- the results


def results_of(run) -> Results:
    """What a row keeps of a run: its scalars and spectra, and what `mill dose` and `mill wear` make of it."""
    return Results.of(run, ("dose", dose.scalars), ("wear", wear.scalars))


def read(job, path) -> dict:
    """The row of a finished run, from its file."""
    row, why, notes = empty(job, "done", ""), "", []  # why it is capped
    try:
        with Run(path) as run:
            results = results_of(run)
            for name in (*job["objectives"], *job["record"]):
                found = expression.parsed(name).of(results)
                row[name], row[f"{name}:error"] = float(found.value), float(found.error)
            row["results"] = results.pack()
            row["time"], row["collisions"], row["version"] = run.time, run.contacts, run.version
            row["sample_from"] = run.window[0]
            row["cpu"], row["wall"] = (float(run.read(f"run/{name}_time")) for name in ("cpu", "wall"))
            if run.has("run/ended_by") and run.read("run/ended_by") == "max_collisions":
                why = "stopped at run.max_collisions"
            elif run.has("statistics/precision/reached") and not run.read("statistics/precision/reached"):
                why = "run.time was reached before run.precision"
            if deep := int(run.read("run/overlaps")):
                why = f"{deep} balls overlap other bodies: the impacts are not reliable"
            notes += [FRICTIONLESS] * bool(run.has("run/smoothed") and run.read("run/smoothed") > 0)
            notes += [UNSETTLED] * (run.doubt == "not settled")
    except (UserError, TypeError) as fault:
        return empty(job, "failed", str(fault).replace(f"{path}: ", ""))
    return row | {"status": "capped" if why else "done", "message": "; ".join(filter(None, [why, *notes]))}
