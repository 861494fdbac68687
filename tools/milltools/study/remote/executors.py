"""All runs are submitted through one interface, a concurrent.futures.Executor.

    with open_executor(Where(workers=4), "a.parquet") as executor:
        filling.send(jobs, executor, take)

An executor has two more attributes: `workers`, the number of simultaneous runs (to estimate the time left), and
`width`, the largest number of submitted jobs. If an exception leaves the block, all runs are ended.
"""

import concurrent.futures
import dataclasses
import shlex

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.extras import needs


def add_arguments(parser):
    """The options for the place of the runs."""
    parser.add_argument(
        "--workers", type=int, metavar="N", help="runs at once on this machine (default: one for each core)"
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS",
        help="send runs to the Dask scheduler at HOST:PORT or of this scheduler file; local: start one on this machine",
    )  # fmt: skip
    parser.add_argument("--slurm", action="store_true", help="send runs to Slurm, in job arrays")
    parser.add_argument("--slurm-options", metavar="OPTIONS",
        help="options for sbatch: --slurm-options='--time=60 --partition=short'")  # fmt: skip
    parser.add_argument("--bundle", type=int, metavar="K",
        help="runs in one Slurm task (default: so that a task takes minutes)")  # fmt: skip
    parser.add_argument("--tasks", type=int, metavar="N", help="largest number of Slurm tasks at once")
    parser.add_argument("--detach", action="store_true",
        help="if interrupted, leave the tasks in the queue; the same command later collects their results")  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Where:
    """The place of the runs, by the options of the same names. Options that do not fit together are a UserError."""

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
                raise UserError(f"--{name.replace('_', '-')}: only with --slurm")
        if self.dask and self.slurm:
            raise UserError("--dask or --slurm, not both")
        if self.dask:
            needs("cluster", "dask", "distributed")  # before a table is begun
        if self.workers and (self.slurm or self.dask not in (None, "local")):
            raise UserError("--workers is for runs on this machine; on a cluster Dask or --tasks sets the number")
        try:
            shlex.split(self.slurm_options or "")
        except ValueError as fault:
            raise UserError(f"--slurm-options: {fault}: {self.slurm_options}") from None

    @property
    def at_once(self) -> int:
        """The number of runs at a time, as far as it is known."""
        return self.workers or (self.tasks if self.slurm and self.tasks else processes.cores())


def asked(arguments) -> dict:
    """The fields of Where that a command line gives."""
    return {field.name: getattr(arguments, field.name) for field in dataclasses.fields(Where)}


def open_executor(where, table, force=False):
    """A context manager that gives the requested executor; `table`: the path of the table; Slurm's tasks write their
    rows into a folder next to it."""
    if where.dask:
        from milltools.study.remote.cluster_dask import DaskExecutor

        return DaskExecutor(where.dask, where.workers)
    if where.slurm:
        from milltools.study.remote.slurm import SlurmExecutor

        options = where.slurm_options or ""
        return SlurmExecutor(f"{table}.slurm", options, where.bundle, where.tasks, where.detach, force)
    return Local(where.workers or processes.cores())


class Local(concurrent.futures.ThreadPoolExecutor):
    """`workers` simultaneous runs on this machine. Threads are enough, because each run is a process of its own."""

    def __init__(self, workers):
        super().__init__(workers, thread_name_prefix="run")
        self.workers, self.width = workers, workers + 2  # two more, so that a worker never waits for the driver

    def __exit__(self, kind, fault, trace):
        if kind:
            from milltools.study.plan import job  # imports h5py: not for --help

            self.shutdown(wait=False, cancel_futures=True)
            job.end_all()
        self.shutdown()
