"""Jobs through Dask distributed, behind `concurrent.futures.Executor`.

The scheduler hands a job of a worker that died to another one, up to three times by its own default; after that it is
`Lost`. Nothing is repeated otherwise. Every worker says, with its first job, which milltools and millsim it has: one
that has others ends the study with one line. At most WAVE jobs are to be with the scheduler at once (`width`): with
millions it does not start.
"""

import collections
import concurrent.futures
import contextlib
import functools
import hashlib
import importlib
import logging
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import threading
import uuid

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.study.plan import job as one_job
from milltools.study.plan.job import Lost
from milltools.study.remote.spool import one_line

WAVE = 10_000  # jobs with the scheduler at once
TOOLS = pathlib.Path(__file__).resolve().parents[3]
# What is sent names our functions by words: the scheduler then needs no milltools, and a worker without it says so. (Of a
# message that it cannot unpack a worker dies, and nobody is told.)
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
    """One job on a worker: {"row": row}, {"lost": why}, or {"refused": why} if it would not be what the driver means."""
    here = versions(job["program"]) if "program" in job else {}
    for name, version in expected.items():
        if here.get(name) != version:
            return {
                "refused": f"{name} is another one on {socket.gethostname()} ({here.get(name)}) than here ({version})"
            }
    thread = threading.get_ident()
    if study in _ended:
        return {"lost": "the study was ended"}
    _threads[study].add(thread)
    try:
        module, name = call.split(":")
        return {"row": getattr(importlib.import_module(module), name)(job)}
    except Lost as fault:
        return {"lost": one_line(fault)}
    finally:
        _threads[study].discard(thread)


def end_runs(study):
    """Ends the runs of a study on this worker; those of others go on."""
    _ended.add(study)
    one_job.end_of(list(_threads[study]))


# ---- the driver


def settle(future, row=None, fault=None):
    """Its result, unless it has one: an answer may come while the study is being ended."""
    with contextlib.suppress(concurrent.futures.InvalidStateError):
        if fault is None:
            future.set_result(row)
        else:
            future.set_exception(fault)


def refused(address):
    """Does nobody listen at HOST:PORT? Dask itself would go on trying for its whole patience."""
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), PATIENCE).close()
    except ConnectionRefusedError:
        return True
    except (OSError, ValueError, OverflowError):
        return False  # for Dask to find out
    return False


class DaskExecutor(concurrent.futures.Executor):
    """Jobs of module-level functions, through the scheduler at `address` (host:port, a scheduler file, or "local": one of our own, with
    `workers` processes, all cores if None)."""

    def __init__(self, address, workers=None):
        needs("cluster", "dask", "distributed")
        import distributed

        self.address, self.cluster = address, None
        self.lock = threading.RLock()
        self.sent = {}  # key: (future, Dask's future)
        self.study, self.count, self.fault, self.closed = uuid.uuid4().hex, 0, None, False
        self.idle = threading.Condition(self.lock)
        # what goes wrong is told by us, once; it would write pages
        for name in list(logging.root.manager.loggerDict):
            if name.startswith("distributed"):
                logging.getLogger(name).setLevel(SILENT)
        if address == "local":
            self._start(distributed, workers or processes.cores())
        else:
            self.client = self._connect(distributed.Client)

    def _start(self, distributed, workers):
        """A cluster of one's own. Ctrl-C at the terminal is meant for the driver alone: processes started while it is ignored
        go on ignoring it."""
        main = threading.current_thread() is threading.main_thread()
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if main else None
        try:
            self.cluster = distributed.LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=SILENT
            )
            self.client = distributed.Client(self.cluster)
        finally:
            if main:
                signal.signal(signal.SIGINT, before)

    def _connect(self, client):
        where = {"address": self.address}
        if os.path.isfile(self.address):
            where = {"scheduler_file": self.address}
        elif "://" not in self.address:
            where = {"address": f"tcp://{self.address}"}
        try:
            if "address" in where and refused(where["address"]):
                raise OSError("connection refused")
            return client(**where, timeout=PATIENCE)
        except (OSError, ValueError, TypeError) as fault:
            raise UserError(f"--dask: no scheduler at {self.address} ({one_line(fault)}): start one with 'dask scheduler'", 1) from None  # fmt: skip

    @property
    def width(self):
        """How many jobs it wants at once."""
        return WAVE

    @property
    def workers(self):
        """How many runs go on at once, with the workers there are now."""
        with contextlib.suppress(Exception):
            return max(1, sum(self.client.nthreads().values()))
        return 1

    def submit(self, call, job):
        future = concurrent.futures.Future()
        future.set_running_or_notify_cancel()
        expected = versions(job["program"]) if "program" in job else {}
        with self.lock:
            if self.closed:
                raise RuntimeError("cannot schedule new futures after shutdown")
            self.count += 1
            key = f"mill-{self.study}-{self.count}"
            words = {"it": (f"{call.__module__}:{call.__qualname__}", job, self.study, expected)}
            theirs = None
            if not self.fault:
                try:
                    theirs = self.client.submit(eval, ASK.format("perform"), words, key=key, pure=False)
                except Exception:
                    self.fault = self._gone()
            if theirs is None:
                settle(future, fault=self.fault)
                return future
            self.sent[key] = (future, theirs)
        theirs.add_done_callback(self._receive)
        return future

    def _receive(self, theirs):
        """A job has come back: called by Dask in a thread of its own."""
        with self.lock:
            future, _ = self.sent.get(theirs.key, (None, None))
        if future is None:
            return
        fault = row = None
        try:
            answer = theirs.result()
            if "refused" in answer:
                fault = self._refused(f"--dask {self.address}: {answer['refused']}")
            elif "lost" in answer:
                fault = Lost(answer["lost"])
            else:
                row = answer["row"]
        except (Exception, concurrent.futures.CancelledError) as raised:
            fault = self._explain(raised)
        with self.idle:
            self.sent.pop(theirs.key, None)
            self.idle.notify_all()
        settle(future, row, fault)

    def _explain(self, raised):
        """What a user or the driver can do something about."""
        import distributed

        if isinstance(raised, UserError):
            return raised
        if isinstance(raised, distributed.scheduler.KilledWorker):
            return Lost("several Dask workers died while it ran")
        said = f"{one_line(raised)} {one_line(raised.__cause__ or '')}"
        if missing := re.search(r"No module named '?([\w.]+)|cannot import name '(\w+)'", said):
            return self._refused(
                f"--dask {self.address}: a worker has no {missing[1] or missing[2]} such as here: start them "
                f"with PYTHONPATH={TOOLS} {os.path.dirname(sys.executable)}/dask",
            )  # fmt: skip
        if isinstance(raised, concurrent.futures.CancelledError | OSError | RuntimeError):
            with self.lock:
                if not self.closed:
                    self.fault = self.fault or self._gone()
                return self.fault or Lost("cancelled")
        return UserError(f"--dask {self.address}: {one_line(raised)}", 1)

    def _refused(self, said):
        """All else would be refused, too."""
        with self.lock:
            self.fault = self.fault or UserError(said, 1)
        return self.fault

    def _gone(self):
        return UserError(f"the Dask scheduler at {self.address} is gone; the same command goes on once there is one again", 1)  # fmt: skip

    def _end_runs(self, sent):
        with contextlib.suppress(Exception):
            self.client.cancel([theirs for _, theirs in sent], force=True)
            if not self.fault:
                self.client.run(eval, ASK.format("end_runs"), {"it": (self.study,)}, on_error="ignore")

    def __exit__(self, kind, fault, trace):
        self.shutdown(cancel_futures=kind is not None)

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Without cancel_futures waits for all results; with it ends the runs on the workers."""
        with self.lock:
            if self.closed:
                return
            self.closed = True
        if cancel_futures:
            with self.lock:
                sent, self.sent = list(self.sent.values()), {}
            # a worker that cannot even read the question does not answer: not waited for
            ending = threading.Thread(target=self._end_runs, args=(sent,), daemon=True)
            ending.start()
            ending.join(PATIENCE)
            for future, _ in sent:
                settle(future, fault=Lost("interrupted"))
        with self.idle:
            while self.sent and not self.fault:
                self.idle.wait(1)
        closing = threading.Thread(target=self._leave, daemon=True)
        closing.start()
        closing.join(PATIENCE)

    def _leave(self):
        with contextlib.suppress(Exception):
            self.client.close(timeout=5)
        if self.cluster is not None:
            with contextlib.suppress(Exception):
                self.cluster.close(timeout=5)
