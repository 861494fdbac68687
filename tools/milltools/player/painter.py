"""Figures drawn by a second process while the first is busy with the balls: they take most of a report's time.

The second one gets the runs' paths and the names of the first figures, and hands back a Picture each. Should it die, its figures
are drawn by the first, which then meets whatever it died of. It ends when its socket does, so it outlives nobody.
"""

import contextlib
import multiprocessing
import os
import queue
import signal
import subprocess
import sys
import threading
from multiprocessing.connection import Connection

from milltools.base import processes
from milltools.player import pictures
from milltools.read.runfile import Run

SHARE = 0.6  # of the figures are the second process's; the balls take the first as long as the rest of them


class Painter:
    """A context manager. `runs`: open Runs that are drawn together; `names`: all figures, of which some are begun at once."""

    def __init__(self, runs: list[Run], names: list[str]):
        self.runs, self.names = runs, names
        worth_it = processes.cores() > 1 and any(run.has_statistics and run.duration > 0 for run in runs)
        self.theirs = names[: round(SHARE * len(names))] if worth_it else []
        self.process = self.socket = None

    def __enter__(self):
        if self.theirs:
            self._start()
        return self

    def __exit__(self, *_):
        if not self.process:
            return
        self.socket.close()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)  # its session is its own
        self.process.wait()

    def _start(self):
        self.socket, there = multiprocessing.Pipe()
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
        with there:
            self.process = subprocess.Popen(
                [*processes.guard(), sys.executable, "-m", "milltools.player.painter", str(there.fileno())],
                pass_fds=[there.fileno()],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is ours to handle
            )  # fmt: skip
        with contextlib.suppress(OSError):
            self.socket.send(([run.path for run in self.runs], self.theirs))

    def all(self, watch) -> dict[str, pictures.Picture]:
        """Every figure by its name; `watch` is told of each."""
        found = {}
        for name in self.names:
            if name not in self.theirs:
                with watch.step("pictures"):
                    found[name] = pictures.draw(name, self.runs)
        for name in self.theirs:
            with watch.step("pictures"):
                found[name] = self._take() or pictures.draw(name, self.runs)
        return found

    def _take(self) -> pictures.Picture | None:
        """The next one of the second process; None once that is dead."""
        try:
            return self.socket.recv()
        except (EOFError, OSError):
            return None


def _hand_over(socket, drawn: queue.Queue):
    """Sends what is drawn, in a thread: the first process reads late, and a socket holds few figures."""
    with contextlib.suppress(OSError):
        while (one := drawn.get()) is not None:
            socket.send(one)


def main() -> int:
    socket, drawn = Connection(int(sys.argv[1])), queue.Queue()
    with contextlib.ExitStack() as stack, contextlib.suppress(EOFError, OSError):
        paths, names = socket.recv()
        runs = [stack.enter_context(Run(path)) for path in paths]
        sender = threading.Thread(target=_hand_over, args=(socket, drawn))
        sender.start()
        stack.callback(sender.join)
        stack.callback(drawn.put, None)
        for name in names:
            drawn.put(pictures.draw(name, runs))
    return 0


if __name__ == "__main__":
    sys.exit(main())
