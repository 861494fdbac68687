"""Several processes that draw at the same time. Each has its own scene (which needs its own context and draws on one
core). In this process a thread for each of them sends it one task after the other through a pair of sockets.

This module is both ends: `python -m milltools.render.team SOCKET` is such a process. It ends when its socket is closed,
so it always ends with the command that started it.
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

# one thread of Mesa and of POV-Ray, because each core has its own process
ONE_CORE = {"LP_NUM_THREADS": "1", "MILL_POVRAY_THREADS": "1"}
AHEAD = 2  # tasks per process: one in work, one that waits


@contextlib.contextmanager
def team(opens, count):
    """Yields a function that gives the arguments of a task to one of `count` processes and returns the Future of its
    result. Each process enters the context `opens()` and calls what it yields. The UserError of a task, or of a process
    that died, is raised by the Future."""
    with contextlib.ExitStack() as stack:
        workers, idle = [], queue.SimpleQueue()
        for _ in range(count):
            workers.append(stack.enter_context(contextlib.closing(_Worker(opens))))
            idle.put(workers[-1])
        pool = concurrent.futures.ThreadPoolExecutor(count)
        stack.callback(pool.shutdown, cancel_futures=True)
        for worker in workers:
            stack.callback(worker.kill)  # runs before the pool shuts down, so that no thread waits for the process

        def do(*task):
            worker = idle.get()
            try:
                return worker.do(task)
            finally:
                idle.put(worker)

        yield lambda *task: pool.submit(do, *task)


def results(opens, count, tasks):
    """Yields the results of the tasks (tuples of arguments) of an iterable in order, from a team of `count` processes.
    Only few tasks are started at a time, so the memory does not grow with their number."""
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
                start_new_session=True,  # the parent process handles Ctrl-C
            )
        self._send(opens)

    def close(self):
        self.kill()
        self.here.close()
        self.said.close()

    def _send(self, thing):
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # do() reads why the process ended
            self.here.send(thing)

    def do(self, task):
        """The result of a task; raises the UserError of the process."""
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
        return UserError(f"a drawing process ended with {how}{': ' + lines[-1] if lines else ''}", status=1)

    def kill(self):
        """Kills the process and its children."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # it has its own session
        self.process.wait()


def main() -> int:
    """The process of a worker: sends the result of each task that it receives, or the UserError that ends it."""
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
            return 0  # the parent process has closed the connection


if __name__ == "__main__":
    sys.exit(main())
