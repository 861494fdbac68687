"""Work done by several processes at once, handed out and taken back in its order.

Each process has what it needs to itself (a scene has a context of its own, and draws on one core). It gets tasks and gives results
through a pair of sockets; few of either are on the way at any time, so memory does not grow with the film. A process ends when its
socket does, so none outlives the command that started it, whatever ends that.
"""

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import subprocess
import sys
import tempfile

from milltools.base import processes
from milltools.base.errors import UserError

ONE_CORE = {
    "LP_NUM_THREADS": "1",
    "MILL_POVRAY_THREADS": "1",
}  # of Mesa's and POV-Ray's: the other cores have their own process
AHEAD = 2  # tasks a process may have: one in hand, one that waits


class Worker:
    """One process, in which `opens()` is entered: what it yields is called with the arguments of every task."""

    def __init__(self, opens):
        self.here, there = multiprocessing.Pipe()
        self.busy = 0
        self.said = tempfile.TemporaryFile()
        path = os.pathsep.join(folder for folder in sys.path if folder)
        with there:
            self.process = subprocess.Popen(
                [*processes.guard(), sys.executable, "-m", "milltools.render.worker", str(there.fileno())],
                pass_fds=[there.fileno()],
                env={**os.environ, **ONE_CORE, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self.said,
                start_new_session=True,  # Ctrl-C is ours to handle
            )
        self.give(opens)

    def give(self, thing):
        """Sends a task: (number, *arguments)."""
        try:
            self.here.send(thing)
        except (BrokenPipeError, ConnectionResetError):
            raise self._fault() from None

    def take(self):
        """(number, result) that is ready; the process's UserError is raised here."""
        try:
            kind, *rest = self.here.recv()
        except (EOFError, ConnectionResetError):
            raise self._fault() from None
        if kind == "error":
            raise UserError(*rest)
        return rest

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

    def end(self):
        self.kill()
        self.here.close()
        self.said.close()


def results(opens, count, tasks):
    """Yields the result of every task (tuples of arguments) of an iterable, in order, by `count` processes."""
    workers, tasks = [], enumerate(tasks)
    ready, given, shown = {}, 0, 0
    try:
        for _ in range(count):
            workers.append(Worker(opens))  # one by one: those there are end whatever happens
        sockets = {worker.here: worker for worker in workers}
        while True:
            while tasks and given - shown < AHEAD * len(workers):
                if (task := next(tasks, None)) is None:
                    tasks = None
                    break
                worker = min(workers, key=lambda one: one.busy)
                worker.give((task[0], *task[1]))
                worker.busy += 1
                given += 1
            if shown == given:
                return
            for socket in multiprocessing.connection.wait(list(sockets)):
                number, result = sockets[socket].take()
                sockets[socket].busy -= 1
                ready[number] = result
            while shown in ready:
                yield ready.pop(shown)
                shown += 1
    finally:
        for worker in workers:
            worker.end()
