"""Work done by several processes at once. Each has what it needs to itself (a scene has a context of its own, and draws
on one core), and a thread here that hands it one task after the other, through a pair of sockets.

This module is both ends: `python -m milltools.render.team SOCKET` is such a process. It ends when its socket does,
so none outlives the command that started it, whatever ends that.
"""

import collections
import concurrent.futures
import contextlib
import multiprocessing
import os
import queue
import signal
import subprocess
import sys
import tempfile
from multiprocessing.connection import Connection

from milltools.base import processes
from milltools.base.errors import UserError

# threads of Mesa and of POV-Ray: the other cores have their own process
ONE_CORE = {"LP_NUM_THREADS": "1", "MILL_POVRAY_THREADS": "1"}
AHEAD = 2  # tasks for a process that are under way: one in hand, one that waits


@contextlib.contextmanager
def team(opens, count):
    """A function that has one of `count` processes do a task, given its arguments, and returns the Future of its
    result. In each process `opens()` is entered, and what that yields is called. UserError of a task or of a process
    that died comes with the result."""
    with contextlib.ExitStack() as stack:
        workers, idle = [], queue.SimpleQueue()
        for _ in range(count):
            workers.append(stack.enter_context(contextlib.closing(_Worker(opens))))
            idle.put(workers[-1])
        pool = concurrent.futures.ThreadPoolExecutor(count)
        stack.callback(pool.shutdown, cancel_futures=True)
        for worker in workers:
            stack.callback(worker.kill)  # first of all: then no thread waits for it

        def do(*task):
            worker = idle.get()
            try:
                return worker.do(task)
            finally:
                idle.put(worker)

        yield lambda *task: pool.submit(do, *task)


def results(opens, count, tasks):
    """Yields the result of every task (tuples of arguments) of an iterable, in order, by a team of `count` processes.
    Few are under way at any time, so memory does not grow with their number."""
    with team(opens, count) as submit:
        waiting = collections.deque()
        for task in tasks:
            waiting.append(submit(*task))
            if len(waiting) == AHEAD * count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


class _Worker:
    """One process, until it is closed."""

    def __init__(self, opens):
        self.said = tempfile.TemporaryFile()
        self.here, there = multiprocessing.Pipe()
        path = os.pathsep.join(folder for folder in sys.path if folder)
        with there:
            self.process = subprocess.Popen(
                [*processes.guard(), sys.executable, "-m", "milltools.render.team", str(there.fileno())],
                pass_fds=[there.fileno()],
                env={**os.environ, **ONE_CORE, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self.said,
                start_new_session=True,  # Ctrl-C is ours to handle
            )
        self._send(opens)

    def close(self):
        self.kill()
        self.here.close()
        self.said.close()

    def _send(self, thing):
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # what it ended of is there to be read
            self.here.send(thing)

    def do(self, task):
        """The result of a task; the process's UserError is raised here."""
        self._send(task)
        try:
            result = self.here.recv()
        except (EOFError, ConnectionResetError):
            raise self._fault() from None
        if isinstance(result, UserError):
            raise result
        return result

    def _fault(self):
        status = self.process.wait()
        how = f"signal {-status} ({signal.Signals(-status).name})" if status < 0 else f"status {status}"
        self.said.seek(0)
        lines = self.said.read().decode(errors="replace").strip().splitlines()
        return UserError(f"a drawing process died of {how}{': ' + lines[-1] if lines else ''}", status=1)

    def kill(self):
        """Ends the process, whatever it does, and what it has started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # its session is its own
        self.process.wait()


def main() -> int:
    """What such a process does: gives the result of each task that comes, or the UserError that ends it."""
    with Connection(int(sys.argv[1])) as socket:
        try:
            opens = socket.recv()
            with opens() as do:
                while True:
                    socket.send(do(*socket.recv()))
        except UserError as fault:
            socket.send(fault)
            return 1
        except (EOFError, BrokenPipeError, ConnectionResetError):
            return 0  # nobody wants the result any more


if __name__ == "__main__":
    sys.exit(main())
