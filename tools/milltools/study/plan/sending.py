"""Sends jobs through an executor and takes their rows: never more at once than it wants, lost ones again.

Nothing is kept here: a row is handed to `take` as soon as it is there. Memory and time per row do not grow with the study.
"""

import concurrent.futures
import queue

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.study.plan import job as jobs_of_one

ATTEMPTS = 3  # of a run that is lost
TICK = 0.2  # [s] between looks at the clock


def send(jobs, executor, take, tick=None):
    """Runs every job of the iterator `jobs` through the executor; take(row) gets each row, in the main thread.

    The iterator is asked only when there is room for one more, after the rows so far were taken; it may yield None: nothing
    now, ask again when the next row is there. tick() is called now and then. A job that raises Lost, or whose worker
    went, is submitted again, ATTEMPTS times in all, then its row says so.
    """
    with processes.between_steps():
        _send(iter(jobs), executor, take, tick)


def _send(jobs, executor, take, tick):
    done, flying, more = queue.SimpleQueue(), 0, True

    def submit(job, attempt):
        future = executor.submit(jobs_of_one.run, job)
        future.add_done_callback(lambda future: done.put((future, job, attempt)))

    while more or flying:
        processes.raise_if_asked()
        while more and flying < executor.width:
            try:
                job = next(jobs)
            except StopIteration:
                more = False
                break
            if job is None:
                if not flying:
                    raise RuntimeError("the plan waits for a row, but nothing runs")
                break
            submit(job, 1)
            flying += 1
        if not flying:
            continue
        try:
            future, job, attempt = done.get(timeout=TICK)
        except queue.Empty:
            if tick:
                tick()
            continue
        row = _row(future, job, attempt)
        if row is None:
            submit(job, attempt + 1)
            continue
        flying -= 1
        take(row)
        if tick:
            tick()


def _row(future, job, attempt):
    """The row of a finished job; None if it is worth another try."""
    try:
        return future.result()
    except (jobs_of_one.Lost, concurrent.futures.BrokenExecutor, concurrent.futures.CancelledError) as fault:
        if attempt < ATTEMPTS:
            return None
        return jobs_of_one.empty(job, "failed", f"lost {attempt} times: {fault}")
    except UserError:
        raise
    except Exception as fault:  # a disk that is full, a folder that cannot be made
        return jobs_of_one.empty(job, "failed", f"{type(fault).__name__}: {fault}")
