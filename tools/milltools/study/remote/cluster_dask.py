"""Jobs through Dask distributed, behind `concurrent.futures.Executor`.

If a worker dies, the scheduler gives its job to another worker, by default up to three times; then the job is `Lost`.
Nothing else is repeated. With its first job, every worker checks its versions of milltools and millsim: a worker with
other versions ends the study with a message of one line.
"""

import collections
import concurrent.futures
import contextlib
import functools
import hashlib
import logging
import os
import pathlib
import pkgutil
import re
import signal
import socket
import subprocess
import sys
import threading
import uuid

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.study.plan import job as one_job
from milltools.study.plan.job import Lost
from milltools.study.remote.cluster import ClusterExecutor, one_line, settle

TOOLS, DASK = pathlib.Path(__file__).resolve().parents[3], f"{os.path.dirname(sys.executable)}/dask"
# Messages name our functions as text: so the scheduler needs no milltools, and a worker without milltools reports this.
# (A worker that cannot unpack a message dies, and nobody learns why.)
ASK = f"__import__({__name__!r}, fromlist=['*']).{{}}(*it)"
SILENT = logging.CRITICAL + 1
PATIENCE = 15  # [s] to wait for an answer of the scheduler


# ---- on the workers


_threads = collections.defaultdict(set)  # of this worker, with a run: study -> threads
_ended = set()  # studies whose runs are no longer needed


@functools.cache
def versions(program):
    """The programs that determine a result here: digest of the code that runs and reads a job, version of millsim."""
    source = pathlib.Path(one_job.__file__).read_bytes()
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60)
        millsim = said.stdout.strip() if said.returncode == 0 else f"{program} does not run"
    except (OSError, subprocess.TimeoutExpired):
        millsim = f"no {program}"
    return {"milltools": hashlib.sha256(source).hexdigest()[:12], "millsim": millsim}


def perform(call, job, study, expected):
    """One job on a worker: {"row": row}, {"lost": why}, or {"refused": why} if the worker has other programs than the
    driver."""
    here = versions(job["program"]) if "program" in job else {}
    for name, version in expected.items():
        if here.get(name) != version:
            host = socket.gethostname()
            return {"refused": f"{name} differs: {here.get(name)} on {host}, {version} here"}
    thread = threading.get_ident()
    if study in _ended:
        return {"lost": "the study has ended"}
    _threads[study].add(thread)
    try:
        return {"row": pkgutil.resolve_name(call)(job)}
    except Lost as fault:
        return {"lost": one_line(fault)}
    finally:
        _threads[study].discard(thread)


def end_runs(study):
    """Ends the runs of a study on this worker; runs of other studies continue."""
    _ended.add(study)
    one_job.end_of(list(_threads[study]))


# ---- the driver


def knock(address):
    """OSError if nobody listens at HOST:PORT: Dask itself would try again until its time limit."""
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), PATIENCE).close()
    except ConnectionRefusedError:
        raise OSError("connection refused") from None
    except (OSError, ValueError, OverflowError):
        pass  # Dask will find out


class DaskExecutor(ClusterExecutor):
    """Jobs of module-level functions, through the scheduler at `address` (host:port, a scheduler file, or "local": our
    own scheduler, with `workers` processes; None: one for each core)."""

    def __init__(self, address, workers=None):
        import distributed

        super().__init__()
        self.address, self.study = address, uuid.uuid4().hex
        self.sent = {}  # future: Dask's future
        # we report errors once; Dask would write pages
        for name in list(logging.root.manager.loggerDict):
            if name.startswith("distributed"):
                logging.getLogger(name).setLevel(SILENT)
        connect = self._start if address == "local" else self._connect
        self.client = connect(distributed.Client, workers)

    def _start(self, client, workers):
        """A client with its own cluster. Only the driver should react to Ctrl-C at the terminal: processes that start
        while SIGINT is ignored keep ignoring it."""
        main = threading.current_thread() is threading.main_thread()
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
        processes_of = {"n_workers": workers or processes.cores(), "threads_per_worker": 1, "processes": True}
        try:
            return client(**processes_of, dashboard_address=None, silence_logs=SILENT)
        finally:
            if main:
                signal.signal(signal.SIGINT, before)

    def _connect(self, client, _):
        where = {"address": self.address if "://" in self.address else f"tcp://{self.address}"}
        if os.path.isfile(self.address):
            where = {"scheduler_file": self.address}
        try:
            knock(where.get("address", ""))
            return client(**where, timeout=PATIENCE)
        except (OSError, ValueError, TypeError) as fault:
            raise UserError(
                f"--dask: no scheduler at {self.address} ({one_line(fault)}): start one with '{DASK} scheduler'", 1
            ) from None

    @property
    def workers(self):
        """The number of simultaneous runs with the present workers."""
        with contextlib.suppress(Exception):
            return max(1, sum(self.client.nthreads().values()))
        return 1

    def submit(self, call, job):
        future = self.new_future()
        if self.fault:
            return future
        expected = versions(job["program"]) if "program" in job else {}
        words = {"it": (f"{call.__module__}:{call.__qualname__}", job, self.study, expected)}
        try:
            theirs = self.client.submit(eval, ASK.format("perform"), words, key=f"mill-{uuid.uuid4().hex}", pure=False)
        except Exception:
            self._gone()
        else:
            self.sent[future] = theirs
            theirs.add_done_callback(functools.partial(self._receive, future))
        return future

    def _receive(self, future, theirs):
        """A job has ended: called by Dask in a separate thread."""
        if self.fault or self.closed:  # the future has its result, and a client that closes may never answer
            return
        try:
            answer = theirs.result()
        except (Exception, concurrent.futures.CancelledError) as raised:
            settle(future, fault=self._explain(raised))
        else:
            if "refused" in answer:
                self._refuse(answer["refused"])
            settle(future, answer.get("row"), Lost(answer["lost"]) if "lost" in answer else None)
        self.sent.pop(future, None)

    def _explain(self, raised):
        """The error in a form that the user or the driver can act on."""
        import distributed

        if isinstance(raised, UserError):
            return raised
        if isinstance(raised, distributed.scheduler.KilledWorker):
            return Lost("several Dask workers died while it ran")
        said = f"{one_line(raised)} {one_line(raised.__cause__ or '')}"
        if missing := re.search(r"No module named '?([\w.]+)|cannot import name '(\w+)'", said):
            start = f"start the workers with PYTHONPATH={TOOLS} {DASK} worker ..."
            return self._refuse(f"a worker does not find this version of {missing[1] or missing[2]}: {start}")
        if isinstance(raised, concurrent.futures.CancelledError | OSError | RuntimeError):
            return Lost("cancelled") if self.closed else self._gone()
        return UserError(f"--dask {self.address}: {one_line(raised)}", 1)

    def _refuse(self, why):
        """Fails the study: all other jobs would be refused too."""
        return self.fail(UserError(f"--dask {self.address}: {why}", 1))

    def _gone(self):
        why = f"the Dask scheduler at {self.address} is gone; start one, then the same command continues"
        return self.fail(UserError(why, 1))

    def leave(self, interrupted):
        """Ends the runs on the workers, if they are no longer needed, and the connection."""
        if interrupted:
            _in_patience(self._end_runs)
        _in_patience(lambda: self.client.close(timeout=5))

    def _end_runs(self):
        self.client.cancel(list(self.sent.values()), force=True)
        if not self.fault:
            self.client.run(eval, ASK.format("end_runs"), {"it": (self.study,)}, on_error="ignore")


def _in_patience(step):
    """Does a step at the end whose failure does not matter. A worker that cannot read a message never answers:
    it is not waited for."""

    def attempt():
        with contextlib.suppress(Exception):
            step()

    thread = threading.Thread(target=attempt, daemon=True)
    thread.start()
    thread.join(PATIENCE)
