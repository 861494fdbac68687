"""Ending a run when a signal asks for it, at a moment at which nothing is half done.

Between `watched()` and its end INT, TERM and HUP are taken note of, and raise Stopped only where the run waits for
something, inside `waiting()`: so results are never left in the middle of a change, and no process between its start
and the code that ends it. The first signal counts; later ones do not disturb what clears up.
"""

import contextlib
import signal

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stopped(Exception):
    """A signal, `number`, asked for the end."""

    def __init__(self, number):
        super().__init__(number)
        self.number = number


class _State:
    asked = None
    waits = False


def _take(number, _frame):
    _State.asked = _State.asked or number
    if _State.waits:
        _State.waits = False
        raise Stopped(_State.asked)


@contextlib.contextmanager
def watched():
    """Signals that are ignored stay so: that is what nohup asks for."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    before = {number: handler for number, handler in before.items() if handler != signal.SIG_IGN}
    _State.asked, _State.waits = None, False
    for number in before:
        signal.signal(number, _take)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _State.asked = None


@contextlib.contextmanager
def waiting():
    """Here a signal may raise Stopped; one that came before does so at once."""
    _State.waits = True
    try:
        if _State.asked:
            raise Stopped(_State.asked)
        yield
    finally:
        _State.waits = False
