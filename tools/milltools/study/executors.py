"""The one door through which runs are sent: a concurrent.futures.Executor, made from the command line.

    with open_executor(arguments) as executor:
        drive.drive(jobs, executor, take)

An executor has two more attributes: `workers`, how many runs go on at once (for the time left), and `width`, how many are
handed over at once (waves). When the block is left by an exception, what runs is ended.
"""

import concurrent.futures
import contextlib
import os

from milltools.errors import UserError
from milltools.study import job


def add_arguments(parser):
    """The options that say where runs are done."""
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="runs at once on this machine (default: one for each core)",
    )


def open_executor(arguments):
    """A context manager that gives the executor asked for."""
    if arguments.workers is not None and arguments.workers < 1:
        raise UserError(f"--workers: expected 1 or more, got {arguments.workers}")
    return local(arguments.workers or len(os.sched_getaffinity(0)))


class Local(concurrent.futures.ThreadPoolExecutor):
    """Runs on this machine. Threads will do: each run is a process of its own."""

    def __init__(self, workers):
        super().__init__(workers, thread_name_prefix="run")
        self.workers, self.width = workers, workers + 2  # a worker never waits for the driver


@contextlib.contextmanager
def local(workers):
    """`workers` runs at once on this machine."""
    executor = Local(workers)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        job.end_all()
        raise
    finally:
        executor.shutdown(wait=True)
