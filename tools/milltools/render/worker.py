"""A process that draws: `python -m milltools.render.worker SOCKET`, started by team.py and by nobody else.

It gets a look, then (number, fraction, state) again and again, and gives ("picture", number, shape) and its bytes, or
("error", line, status). The end of the socket is its own.
"""

import queue
import sys
import threading
from multiprocessing.connection import Connection

from milltools.base.errors import UserError


def _listen(socket, tasks):
    """Takes what comes while a picture is drawn: whoever sends must not wait for it, for it may be waited for itself."""
    try:
        while True:
            tasks.put(socket.recv())
    except (EOFError, OSError):
        tasks.put(None)


def main() -> int:
    socket = Connection(int(sys.argv[1]))
    tasks = queue.Queue()
    try:
        look = socket.recv()
        threading.Thread(target=_listen, args=(socket, tasks), daemon=True).start()
        with look.open() as drawing:
            while (task := tasks.get()) is not None:
                number, fraction, state = task
                picture = drawing.draw(state, fraction)
                socket.send(("picture", number, picture.shape))
                socket.send_bytes(picture.tobytes())
    except UserError as fault:
        socket.send(("error", str(fault), fault.status))
        return 1
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass  # nobody wants the picture any more
    return 0


if __name__ == "__main__":
    sys.exit(main())
