"""Sends jobs through an executor and takes their rows: never more at once than it wants, lost ones again.

Nothing is kept here: a row is handed to `take` as soon as it is there. Memory and time per row do not grow with the study.
"""

import concurrent.futures
import contextlib
import queue
import signal

from milltools.errors import UserError
from milltools.study import job as jobs_of_one

ATTEMPTS = 3  # of a run that is lost
TICK = 0.2  # [s] between looks at the clock


class Stopped(BaseException):
    """SIGTERM or SIGHUP asks for an end; no Exception, so that nothing mistakes it for a failure."""

    def __init__(self, number):
        super().__init__(number)
        self.number = number


_asked = None  # the signal that asks for an end
_driving = False  # then it is looked at between two rows, so that none is torn in two


@contextlib.contextmanager
def stops_in_order():
    """Within it SIGINT raises KeyboardInterrupt, SIGTERM and SIGHUP raise Stopped: while jobs are driven between two
    rows, otherwise, and for an impatient second signal, at once."""
    global _asked
    _asked = None

    def stop(number, _):
        global _asked
        impatient = _asked is not None
        _asked = number
        if impatient or not _driving:
            _raise_if_asked()

    wanted = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    signals = [number for number in wanted if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in signals}
    try:
        yield
    finally:
        _asked = None  # whoever drives next in this process was not asked to end
        for number, handler in before.items():
            signal.signal(number, handler)


def _raise_if_asked():
    if _asked == signal.SIGINT:
        raise KeyboardInterrupt
    if _asked is not None:
        raise Stopped(_asked)


def drive(jobs, executor, take, tick=None):
    """Runs every job of the iterator `jobs` through the executor; take(row) gets each row, in the main thread.

    The iterator is asked only when there is room for one more, after the rows so far were taken; it may yield None: nothing
    now, ask again when the next row is there. tick() is called now and then. A job that raises Lost, or whose worker
    went, is submitted again, ATTEMPTS times in all, then its row says so.
    """
    global _driving
    _driving = True
    try:
        _drive(iter(jobs), executor, take, tick)
    finally:
        _driving = False


def _drive(jobs, executor, take, tick):
    done, flying, more = queue.SimpleQueue(), 0, True

    def submit(job, attempt):
        future = executor.submit(jobs_of_one.run, job)
        future.add_done_callback(lambda future: done.put((future, job, attempt)))

    while more or flying:
        _raise_if_asked()
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
    except (
        jobs_of_one.Lost,
        concurrent.futures.BrokenExecutor,
        concurrent.futures.CancelledError,
    ) as fault:
        if attempt < ATTEMPTS:
            return None
        return jobs_of_one.empty(job, "failed", f"lost {attempt} times: {fault}")
    except UserError:
        raise
    except Exception as fault:  # a disk that is full, a folder that cannot be made
        return jobs_of_one.empty(job, "failed", f"{type(fault).__name__}: {fault}")
