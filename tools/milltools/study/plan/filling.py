"""The common part of `mill sweep` and `mill optimize`: filling a table, showing progress, and ending in order after a
signal.

Jobs go through an executor, at most as many at once as it accepts; lost jobs are submitted again. Each row is passed
on at once when its run ends. Memory and time per row do not grow with the size of the study.
"""

import concurrent.futures
import contextlib
import queue
import sys

from milltools.base import engine, processes
from milltools.base.errors import UserError
from milltools.base.progress import Progress, say
from milltools.base.text import number, spoken_unit
from milltools.read import expression
from milltools.study.plan import job as one_job
from milltools.study.plan.sealed import STATUSES
from milltools.study.plan.table import Writer

ATTEMPTS = 3  # of a run that gets lost
TICK = 0.2  # [s] between looks at the clock
END = object()  # of a plan


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, SIGTERM or SIGHUP ended a study; finished runs are kept. `status`: exit status of the command."""

    def __init__(self, text, status):
        super().__init__(text)
        self.status = status


@contextlib.contextmanager
def filled(command, path, about, force):
    """The Writer of a table while it is filled; a signal raises Interrupted, with the progress in its message."""
    with Writer.begin(path, about, force) as table:
        if table.damaged:
            say(command, f"{table.left_out}; their runs will be repeated")
        try:
            with processes.stops_in_order():
                yield table
        except (KeyboardInterrupt, processes.Stopped) as stop:
            text = (
                f"interrupted; {path} has {len(table.of_plan())} of {about['planned']} runs; the same command continues"
            )
            raise Interrupted(text, 128 + getattr(stop, "number", 2)) from None


class Tracker:
    """Progress of a study: the number of runs, and the best value of its first objective."""

    def __init__(self, command, planned, rows, study, quiet):
        self.objective, self.best = study.objectives[0], None
        self.require = tuple(one.text for one in study.require)
        self.count = dict.fromkeys(STATUSES, 0)
        self.progress = Progress(command, planned, quiet, kept=len(rows))
        for row in rows:
            self.note(row)

    def note(self, row):
        """Called for each new row."""
        self.count[row["status"]] += 1
        value = row[self.objective.path]
        better = self.best is None or (value - self.best) * self.objective.sign > 0
        good = row["status"] == "done" and value == value and better
        if good and all(over <= 0 for over, _ in expression.excess(row.get("results", ""), self.require)):
            self.best = value

    def tick(self):
        """Called regularly, to update the time."""
        runs = sum(self.count.values())
        words = [f"{runs} of {self.progress.total} runs"]
        words += [f"{self.count[name]} {name}" for name in ("failed", "capped") if self.count[name]]
        if self.best is not None:
            words.append(f"best {number(self.best, 4)} {spoken_unit(self.objective.unit)}".rstrip())
        self.progress(runs, ", ".join(words))


def fill(jobs, executor, take, tracker):
    """Runs the jobs; `take` gets each row, then the progress counts it."""

    def took(row):
        take(row)
        tracker.note(row)
        tracker.tick()

    with tracker.progress:
        send(jobs, executor, took, tracker.tick)


def send(jobs, executor, take, tick=lambda: None):
    """Runs every job of the iterator `jobs` through the executor; take(row) gets each row, in the main thread.

    The iterator is asked only if the executor has room for one more job and all rows so far were taken. It may yield
    None: no job now, ask again after the next row. tick() is called while no row arrives. A job that raises Lost, or
    whose worker has died, is submitted again, at most ATTEMPTS times in all; then its row contains the failure.
    """
    jobs, done, flying, more = iter(jobs), queue.SimpleQueue(), 0, True

    def submit(job, attempt):
        future = executor.submit(one_job.run, job)
        future.add_done_callback(lambda future: done.put((future, job, attempt)))

    with processes.between_steps():
        while True:
            processes.raise_if_asked()
            while more and flying < executor.width and (job := next(jobs, END)) is not None:
                if job is END:
                    more = False
                else:
                    submit(job, 1)
                    flying += 1
            if not flying:
                return
            try:
                future, job, attempt = done.get(timeout=TICK)
            except queue.Empty:
                tick()
                continue
            row = _row(future, job, attempt)
            if row is None:
                submit(job, attempt + 1)
            else:
                flying -= 1
                take(row)


def _row(future, job, attempt):
    """The row of a finished job; None if the job should be tried again."""
    try:
        return future.result()
    except (one_job.Lost, concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as fault:
        return (
            None if attempt < ATTEMPTS else one_job.empty(job, "failed", f"no result, tried {attempt} times: {fault}")
        )
    except UserError:
        raise
    except Exception as fault:  # a full disk, or a folder that cannot be made
        return one_job.empty(job, "failed", f"{type(fault).__name__}: {fault}")


def last_words(table, command, more=()) -> tuple[str, int]:
    """The number of runs and how to show them as a line, and the exit status. Prints the most frequent failure on
    standard error."""
    frame = table.of_plan()
    count = {name: int((frame["status"] == name).sum()) for name in STATUSES}
    words = "; ".join([", ".join(f"{many} {name}" for name, many in count.items() if many), *more])
    line = f"{table.path}: {len(frame)} runs ({words}); see them with: {engine.command_line('study', table.path)}"
    if count["failed"]:
        message = frame.loc[frame["status"] == "failed", "message"].mode()[0]
        print(f"{command}: {count['failed']} runs failed; the most frequent message: {message}", file=sys.stderr)
    return line, 1 if count["failed"] == len(frame) else 0
