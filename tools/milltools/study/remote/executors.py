"""The one door through which runs are sent: a concurrent.futures.Executor, made from the command line.

    with open_executor(arguments) as executor:
        drive.drive(jobs, executor, take)

An executor has two more attributes: `workers`, how many runs go on at once (for the time left), and `width`, how many are
handed over at once (waves). When the block is left by an exception, what runs is ended.
"""

import concurrent.futures
import contextlib

from milltools.base import processes
from milltools.base.errors import UserError


def add_arguments(parser):
    """The options that say where runs are done."""
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help="runs at once on this machine (default: one for each core)",
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS",
        help="runs go to the Dask scheduler at HOST:PORT or of this scheduler file; local: to one of our own, here",
    )  # fmt: skip
    parser.add_argument("--slurm", action="store_true", help="runs go to Slurm, in job arrays")
    parser.add_argument("--slurm-options", metavar="OPTIONS", help="for sbatch: --slurm-options='--time=60 --partition=short'")  # fmt: skip
    parser.add_argument("--bundle", type=int, metavar="K", help="runs in one Slurm task (default: minutes of them)")  # fmt: skip
    parser.add_argument("--tasks", type=int, metavar="N", help="Slurm tasks at once, at most")
    parser.add_argument("--detach", action="store_true", help="when interrupted, leave tasks to Slurm; the same command takes up their results")  # fmt: skip


def open_executor(arguments):
    """A context manager that gives the executor asked for."""
    for name in ("workers", "bundle", "tasks"):
        number = getattr(arguments, name)
        if number is not None and number < 1:
            raise UserError(f"--{name}: expected 1 or more, got {number}")
    if not arguments.slurm:
        for name in ("slurm_options", "bundle", "tasks", "detach"):
            if getattr(arguments, name):
                raise UserError(f"--{name.replace('_', '-')} goes with --slurm")
    if arguments.dask and arguments.slurm:
        raise UserError("--dask or --slurm, not both")
    if arguments.workers and (arguments.slurm or arguments.dask not in (None, "local")):
        raise UserError("--workers is for runs on this machine: elsewhere Dask or --tasks says how many")
    if arguments.dask:
        from milltools.study.remote.cluster_dask import DaskExecutor

        return DaskExecutor(arguments.dask, arguments.workers)
    if arguments.slurm:
        from milltools.study.remote.slurm import SlurmExecutor
        from milltools.study.sweep import output_of

        return SlurmExecutor(
            f"{output_of(arguments)}.slurm",
            arguments.slurm_options or "",
            arguments.bundle,
            arguments.tasks,
            arguments.detach,
            arguments.force,
        )
    return local(arguments.workers or processes.cores())


class Local(concurrent.futures.ThreadPoolExecutor):
    """Runs on this machine. Threads will do: each run is a process of its own."""

    def __init__(self, workers):
        super().__init__(workers, thread_name_prefix="run")
        self.workers, self.width = workers, workers + 2  # a worker never waits for the driver


@contextlib.contextmanager
def local(workers):
    """`workers` runs at once on this machine."""
    from milltools.study.plan import job  # h5py: not for --help

    executor = Local(workers)
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False, cancel_futures=True)
        job.end_all()
        raise
    finally:
        executor.shutdown(wait=True)
