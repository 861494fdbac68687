"""Jobs through Dask distributed, behind `concurrent.futures.Executor`.

The scheduler hands a job of a worker that died to another one, up to three times by its own default; after that it is
`Lost`. Nothing is repeated otherwise. Every worker says, with its first job, which milltools and millsim it has: one
that has others ends the study with one line.
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

TOOLS = pathlib.Path(__file__).resolve().parents[3]
# What is sent names our functions by words: the scheduler then needs no milltools, and a worker without it says so. (Of
# a message that it cannot unpack a worker dies, and nobody is told.)
ASK = f"__import__({__name__!r}, fromlist=['*']).{{}}(*it)"
SILENT = logging.CRITICAL + 1
PATIENCE = 15  # [s] for a scheduler to answer


# ---- what workers do


_threads = collections.defaultdict(set)  # of this worker, at work: study -> threads
_ended = set()  # studies whose runs are not wanted any more


@functools.cache
def versions(program):
    """What decides a result here: the digest of how a job is run and read, the version of millsim."""
    source = pathlib.Path(one_job.__file__).read_bytes()
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=60)
        millsim = said.stdout.strip() if said.returncode == 0 else f"{program} does not run"
    except (OSError, subprocess.TimeoutExpired):
        millsim = f"no {program}"
    return {"milltools": hashlib.sha256(source).hexdigest()[:12], "millsim": millsim}


def perform(call, job, study, expected):
    """One job on a worker: {"row": row}, {"lost": why}, or {"refused": why} if it would not be what the driver
    means."""
    here = versions(job["program"]) if "program" in job else {}
    for name, version in expected.items():
        if here.get(name) != version:
            host = socket.gethostname()
            return {"refused": f"{name} is another one on {host} ({here.get(name)}) than here ({version})"}
    thread = threading.get_ident()
    if study in _ended:
        return {"lost": "the study was ended"}
    _threads[study].add(thread)
    try:
        return {"row": pkgutil.resolve_name(call)(job)}
    except Lost as fault:
        return {"lost": one_line(fault)}
    finally:
        _threads[study].discard(thread)


def end_runs(study):
    """Ends the runs of a study on this worker; those of others go on."""
    _ended.add(study)
    one_job.end_of(list(_threads[study]))


# ---- the driver


def knock(address):
    """An OSError where nobody listens at HOST:PORT: Dask itself would go on trying for its whole patience."""
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), PATIENCE).close()
    except ConnectionRefusedError:
        raise OSError("connection refused") from None
    except (OSError, ValueError, OverflowError):
        pass  # for Dask to find out


class DaskExecutor(ClusterExecutor):
    """Jobs of module-level functions, through the scheduler at `address` (host:port, a scheduler file, or "local": one
    of our own, with `workers` processes, all cores if None)."""

    def __init__(self, address, workers=None):
        import distributed

        super().__init__()
        self.address, self.study = address, uuid.uuid4().hex
        self.sent = {}  # future: Dask's future
        # what goes wrong is told by us, once; it would write pages
        for name in list(logging.root.manager.loggerDict):
            if name.startswith("distributed"):
                logging.getLogger(name).setLevel(SILENT)
        connect = self._start if address == "local" else self._connect
        self.client = connect(distributed.Client, workers)

    def _start(self, client, workers):
        """A client with a cluster of its own. Ctrl-C at the terminal is meant for the driver alone: processes started
        while it is ignored go on ignoring it."""
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
            raise UserError(f"--dask: no scheduler at {self.address} ({one_line(fault)}): start one with 'dask scheduler'", 1) from None  # fmt: skip

    @property
    def workers(self):
        """How many runs go on at once, with the workers there are now."""
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
        """A job has come back: called by Dask in a thread of its own."""
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
        """What a user or the driver can do something about."""
        import distributed

        if isinstance(raised, UserError):
            return raised
        if isinstance(raised, distributed.scheduler.KilledWorker):
            return Lost("several Dask workers died while it ran")
        said = f"{one_line(raised)} {one_line(raised.__cause__ or '')}"
        if missing := re.search(r"No module named '?([\w.]+)|cannot import name '(\w+)'", said):
            start = f"start them with PYTHONPATH={TOOLS} {os.path.dirname(sys.executable)}/dask"
            return self._refuse(f"a worker has no {missing[1] or missing[2]} such as here: {start}")
        if isinstance(raised, concurrent.futures.CancelledError | OSError | RuntimeError):
            return Lost("cancelled") if self.closed else self._gone()
        return UserError(f"--dask {self.address}: {one_line(raised)}", 1)

    def _refuse(self, why):
        """All else would be refused, too."""
        return self.fail(UserError(f"--dask {self.address}: {why}", 1))

    def _gone(self):
        return self.fail(UserError(f"the Dask scheduler at {self.address} is gone; the same command goes on once there is one again", 1))  # fmt: skip

    def leave(self, interrupted):
        """Ends the runs on the workers, if they are not wanted any more, and the connection."""
        if interrupted:
            _in_patience(self._end_runs)
        _in_patience(lambda: self.client.close(timeout=5))

    def _end_runs(self):
        self.client.cancel(list(self.sent.values()), force=True)
        if not self.fault:
            self.client.run(eval, ASK.format("end_runs"), {"it": (self.study,)}, on_error="ignore")


def _in_patience(step):
    """Does a step of the end whose failure does not matter. A worker that cannot even read a question does not answer:
    it is not waited for."""

    def attempt():
        with contextlib.suppress(Exception):
            step()

    thread = threading.Thread(target=attempt, daemon=True)
    thread.start()
    thread.join(PATIENCE)
