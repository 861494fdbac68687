"""What `mill sweep` and `mill optimize` share: a table that is filled, its progress, and the end when a signal asks for
it.

Jobs go through an executor, never more at once than it wants, lost ones again; a row is handed on as soon as it is
there. Memory and time per row do not grow with the study.
"""

import concurrent.futures
import contextlib
import queue
import sys

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.progress import Progress, say
from milltools.base.text import number, spoken_unit
from milltools.study.plan import job as one_job
from milltools.study.plan.sealed import STATUSES
from milltools.study.plan.table import Writer

ATTEMPTS = 3  # of a run that is lost
TICK = 0.2  # [s] between looks at the clock
END = object()  # of a plan


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, SIGTERM or SIGHUP ended a study: what was done is kept. `status` is that of the command."""

    def __init__(self, text, status):
        super().__init__(text)
        self.status = status


@contextlib.contextmanager
def filled(command, path, about, force):
    """The Writer of a table while it is filled; whatever asks for an end is an Interrupted that says how far it is."""
    with Writer.begin(path, about, force) as table:
        if table.damaged:
            say(command, f"{table.left_out}; the runs of these lines are done again")
        try:
            with processes.stops_in_order():
                yield table
        except (KeyboardInterrupt, processes.Stopped) as stop:
            text = f"interrupted; {path} has {len(table.of_plan())} of {about['planned']} runs, and the same command goes on"
            raise Interrupted(text, 128 + getattr(stop, "number", 2)) from None


class Tracker:
    """Progress of a study: how many runs there are, and the best of `objective`."""

    def __init__(self, command, planned, rows, objective, quiet):
        self.objective, self.best = objective, None
        self.count = dict.fromkeys(STATUSES, 0)
        self.progress = Progress(command, planned, quiet, kept=len(rows))
        for row in rows:
            self.note(row)

    def note(self, row):
        """Another row is there."""
        self.count[row["status"]] += 1
        value = row[self.objective.path]
        better = self.best is None or (value - self.best) * self.objective.sign > 0
        if row["status"] == "done" and value == value and better:
            self.best = value

    def tick(self):
        """Time goes on."""
        runs = sum(self.count.values())
        words = [f"{runs} of {self.progress.total} runs"]
        words += [f"{self.count[name]} {name}" for name in ("failed", "capped") if self.count[name]]
        if self.best is not None:
            words.append(f"best {number(self.best, 4)} {spoken_unit(self.objective.unit)}".rstrip())
        self.progress(runs, ", ".join(words))


def fill(jobs, executor, take, tracker):
    """Runs the jobs; each row is taken, then counts in the progress."""

    def took(row):
        take(row)
        tracker.note(row)
        tracker.tick()

    with tracker.progress:
        send(jobs, executor, took, tracker.tick)


def send(jobs, executor, take, tick=lambda: None):
    """Runs every job of the iterator `jobs` through the executor; take(row) gets each row, in the main thread.

    The iterator is asked only when there is room for one more, after the rows so far were taken; it may yield None:
    nothing now, ask again when the next row is there. tick() is called while there is none. A job that raises Lost,
    or whose worker went, is submitted again, ATTEMPTS times in all, then its row says so.
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
    """The row of a finished job; None if it is worth another try."""
    try:
        return future.result()
    except (one_job.Lost, concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as fault:
        return one_job.empty(job, "failed", f"lost {attempt} times: {fault}") if attempt == ATTEMPTS else None
    except UserError:
        raise
    except Exception as fault:  # a disk that is full, a folder that cannot be made
        return one_job.empty(job, "failed", f"{type(fault).__name__}: {fault}")


def last_words(table, command, more=()) -> int:
    """How many runs there are, how to see them, and what failed most; returns the exit status."""
    frame = table.of_plan()
    count = {name: int((frame["status"] == name).sum()) for name in STATUSES}
    words = "; ".join([", ".join(f"{many} {name}" for name, many in count.items() if many), *more])
    print(f"{table.path}: {len(frame)} runs ({words}); see them with: mill study {table.path}")
    if count["failed"]:
        message = frame.loc[frame["status"] == "failed", "message"].mode()[0]
        print(f"{command}: {count['failed']} runs failed, most of them so: {message}", file=sys.stderr)
    return 1 if count["failed"] == len(frame) else 0
