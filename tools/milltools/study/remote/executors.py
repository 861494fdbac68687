"""The one door through which runs are sent: a concurrent.futures.Executor.

    with open_executor(Where(workers=4), "a.parquet") as executor:
        filling.send(jobs, executor, take)

An executor has two more attributes: `workers`, how many runs go on at once (for the time left), and `width`, how
many are handed over at once (waves). When the block is left by an exception, what runs is ended.
"""

import concurrent.futures
import dataclasses
import shlex

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.extras import needs


def add_arguments(parser):
    """The options that say where runs are done."""
    parser.add_argument(
        "--workers", type=int, metavar="N", help="runs at once on this machine (default: one for each core)"
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


@dataclasses.dataclass(frozen=True)
class Where:
    """Where runs are done: what the options of the same names say. Those that do not go together are a UserError."""

    workers: int | None = None
    dask: str | None = None
    slurm: bool = False
    slurm_options: str | None = None
    bundle: int | None = None
    tasks: int | None = None
    detach: bool = False

    def __post_init__(self):
        for name in ("workers", "bundle", "tasks"):
            number = getattr(self, name)
            if number is not None and number < 1:
                raise UserError(f"--{name}: expected 1 or more, got {number}")
        for name in ("slurm_options", "bundle", "tasks", "detach"):
            if getattr(self, name) and not self.slurm:
                raise UserError(f"--{name.replace('_', '-')} goes with --slurm")
        if self.dask and self.slurm:
            raise UserError("--dask or --slurm, not both")
        if self.dask:
            needs("cluster", "dask", "distributed")  # before a table is begun
        if self.workers and (self.slurm or self.dask not in (None, "local")):
            raise UserError("--workers is for runs on this machine: elsewhere Dask or --tasks says how many")
        try:
            shlex.split(self.slurm_options or "")
        except ValueError as fault:
            raise UserError(f"--slurm-options: {fault}: {self.slurm_options}") from None


def asked(arguments) -> dict:
    """The fields of Where that a command line gives."""
    return {field.name: getattr(arguments, field.name) for field in dataclasses.fields(Where)}


def open_executor(where, table, force=False):
    """A context manager that gives the executor asked for; `table`: its path, beside which Slurm's tasks leave their
    rows."""
    if where.dask:
        from milltools.study.remote.cluster_dask import DaskExecutor

        return DaskExecutor(where.dask, where.workers)
    if where.slurm:
        from milltools.study.remote.slurm import SlurmExecutor

        options = where.slurm_options or ""
        return SlurmExecutor(f"{table}.slurm", options, where.bundle, where.tasks, where.detach, force)
    return Local(where.workers or processes.cores())


class Local(concurrent.futures.ThreadPoolExecutor):
    """`workers` runs at once on this machine. Threads will do: each run is a process of its own."""

    def __init__(self, workers):
        super().__init__(workers, thread_name_prefix="run")
        self.workers, self.width = workers, workers + 2  # a worker never waits for the driver

    def __exit__(self, kind, fault, trace):
        if kind:
            from milltools.study.plan import job  # h5py: not for --help

            self.shutdown(wait=False, cancel_futures=True)
            job.end_all()
        self.shutdown()
