"""A process that does what another one asks: `python -m milltools.render.worker SOCKET`, started by team.py and by nobody else.

It gets a function that opens a context manager, which yields another function; then (number, *arguments) of that one again and
again, and gives ("done", number, result), or ("error", line, status). The end of the socket is its own.
"""

import queue
import sys
import threading
from multiprocessing.connection import Connection

from milltools.base.errors import UserError


def _listen(socket, tasks):
    """Takes what comes while one task is being done: whoever sends must not wait for it, for it may be waited for itself."""
    try:
        while True:
            tasks.put(socket.recv())
    except (EOFError, OSError):
        tasks.put(None)


def main() -> int:
    socket = Connection(int(sys.argv[1]))
    tasks = queue.Queue()
    try:
        opens = socket.recv()
        threading.Thread(target=_listen, args=(socket, tasks), daemon=True).start()
        with opens() as do:
            while (task := tasks.get()) is not None:
                number, *arguments = task
                socket.send(("done", number, do(*arguments)))
    except UserError as fault:
        socket.send(("error", str(fault), fault.status))
        return 1
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass  # nobody wants the result any more
    return 0


if __name__ == "__main__":
    sys.exit(main())
