"""The common part of the executors for clusters."""

import concurrent.futures
import contextlib

from milltools.study.plan.job import Lost


class ClusterExecutor(concurrent.futures.Executor):
    """Keeps the futures without a result and a fault that ended the study. Each cluster has its own submit(), `workers`
    and leave(interrupted), which ends the runs that nobody waits for."""

    width = 10_000  # jobs submitted at once: schedulers cannot cope with millions

    def __init__(self):
        self.open = set()  # futures without a result
        self.fault, self.closed = None, False

    def new_future(self):
        """A running future; after a fault it fails at once."""
        if self.closed:
            raise RuntimeError("cannot schedule new futures after shutdown")
        future = concurrent.futures.Future()
        future.set_running_or_notify_cancel()
        self.open.add(future)
        future.add_done_callback(self.open.discard)
        if self.fault:
            settle(future, fault=self.fault)
        return future

    def fail(self, fault):
        """No more results will come: all waiting futures get the first such fault, which is returned."""
        self.fault = self.fault or fault
        for future in list(self.open):
            settle(future, fault=self.fault)
        return self.fault

    def __exit__(self, kind, fault, trace):
        self.shutdown(cancel_futures=kind is not None)

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Waits for all results unless cancel_futures is given; `wait` has no effect."""
        if self.closed:
            return
        if not cancel_futures:
            concurrent.futures.wait(list(self.open))
        self.closed = True
        self.leave(cancel_futures or self.fault is not None)
        for future in list(self.open):
            settle(future, fault=Lost("interrupted"))


def settle(future, row=None, fault=None):
    """Sets the result of a future, unless it has one: a result may come while the study is ending."""
    with contextlib.suppress(concurrent.futures.InvalidStateError):
        if fault is None:
            future.set_result(row)
        else:
            future.set_exception(fault)


def one_line(fault):
    """The fault as one line."""
    return " ".join(str(fault).split()) or type(fault).__name__
