"""What the executors of clusters share."""

import concurrent.futures
import contextlib

from milltools.study.plan.job import Lost


class ClusterExecutor(concurrent.futures.Executor):
    """Futures without a result yet, and a fault after which nothing comes any more. Each cluster has its own submit(),
    `workers` and leave(interrupted), which ends what nobody waits for."""

    width = 10_000  # jobs under way at once: schedulers do not start with millions

    def __init__(self):
        self.open = set()  # futures without a result
        self.fault, self.closed = None, False

    def new_future(self):
        """A future that runs; with a fault it is over at once."""
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
        """Nothing will come any more: all who wait get the first such fault, which is returned."""
        self.fault = self.fault or fault
        for future in list(self.open):
            settle(future, fault=self.fault)
        return self.fault

    def __exit__(self, kind, fault, trace):
        self.shutdown(cancel_futures=kind is not None)

    def shutdown(self, wait=True, *, cancel_futures=False):
        """Without cancel_futures waits for all results (whatever `wait`)."""
        if self.closed:
            return
        if not cancel_futures:
            concurrent.futures.wait(list(self.open))
        self.closed = True
        self.leave(cancel_futures or self.fault is not None)
        for future in list(self.open):
            settle(future, fault=Lost("interrupted"))


def settle(future, row=None, fault=None):
    """Its result, unless it has one: an answer may come while the study is being ended."""
    with contextlib.suppress(concurrent.futures.InvalidStateError):
        if fault is None:
            future.set_result(row)
        else:
            future.set_exception(fault)


def one_line(fault):
    """What went wrong, as one line."""
    return " ".join(str(fault).split()) or type(fault).__name__
