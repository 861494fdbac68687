"""Pictures drawn by several processes at once, handed out in their order.

Each has a scene of its own and draws on one core. It gets states and gives pictures through a pair of sockets; few of
either are on the way at any time, so memory does not grow with the film. A process ends when its socket does, so none
outlives the command that started it, whatever ends that.
"""

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import subprocess
import sys
import tempfile

import numpy as np

from milltools.base import processes
from milltools.base.errors import UserError

ONE_CORE = {
    "LP_NUM_THREADS": "1",
    "MILL_POVRAY_THREADS": "1",
}  # the other cores have their own process
AHEAD = 2  # states a process may have: one in hand, one that waits


class Worker:
    """One process that draws."""

    def __init__(self, look, folder):
        """folder: for what it writes for itself; whoever draws removes it."""
        self.here, there = multiprocessing.Pipe()
        self.busy = 0
        self.said = tempfile.TemporaryFile()
        environment = {
            **os.environ,
            "LP_NUM_THREADS": "1",
        }  # of Mesa's: the other cores have their own process
        environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
        with there:
            self.process = subprocess.Popen(
                [
                    *processes.guard(),
                    sys.executable,
                    "-m",
                    "milltools.render.worker",
                    str(there.fileno()),
                ],
                pass_fds=[there.fileno()],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self.said,
                start_new_session=True,  # Ctrl-C is ours to handle
            )
        self.give(look)

    def give(self, thing):
        """Sends a state (or, first, the look)."""
        try:
            self.here.send(thing)
        except (BrokenPipeError, ConnectionResetError):
            raise self._fault() from None

    def take(self):
        """(number, picture) that is ready; the worker's UserError is raised here."""
        try:
            kind, *rest = self.here.recv()
            if kind == "error":
                raise UserError(*rest)
            number, shape = rest
            return number, np.frombuffer(self.here.recv_bytes(), np.uint8).reshape(shape)
        except (EOFError, ConnectionResetError):
            raise self._fault() from None

    def _fault(self):
        status = self.process.wait()
        how = f"status {status}"
        if status < 0:
            how = f"signal {-status} ({signal.Signals(-status).name})"
        self.said.seek(0)
        lines = self.said.read().decode(errors="replace").strip().splitlines()
        return UserError(f"a drawing process died of {how}{': ' + lines[-1] if lines else ''}", status=1)  # fmt: skip

    def end(self):
        """Ends the process, whatever it does, and what it has started."""
        self.here.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # its session is its own
        self.process.wait()
        self.said.close()


def draw(looks, tasks):
    """Yields the picture of every task (fraction, state) of the iterable, in order, uint8 (h, w, 3), drawn by one
    process for each of the `looks`."""
    workers = []
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        try:
            for look in looks:
                workers.append(Worker(look, folder))
            yield from _draw(workers, enumerate(tasks))
        finally:
            for worker in workers:
                worker.end()


def _draw(workers, tasks):
    ready, given, shown = {}, 0, 0
    while True:
        while tasks and given - shown < AHEAD * len(workers):
            worker = min(workers, key=lambda one: one.busy)
            task = next(tasks, None)
            if task is None:
                tasks = None
                break
            worker.give((task[0], *task[1]))
            worker.busy += 1
            given += 1
        if shown == given:
            return
        sockets = {worker.here: worker for worker in workers}
        for socket in multiprocessing.connection.wait(list(sockets)):
            number, picture = sockets[socket].take()
            sockets[socket].busy -= 1
            ready[number] = picture
        while shown in ready:
            yield ready.pop(shown)
            shown += 1
