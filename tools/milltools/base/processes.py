"""Processes that a command starts: how many at once, how none outlives it, and how all end in order when a signal
asks for it."""

import contextlib
import functools
import os
import shutil
import signal
import subprocess
import sys
import threading


@functools.cache
def guard(how: str = "KILL") -> tuple[str, ...]:
    """The words in front of a command that end it, by the signal `how`, with the process (thread) that started it:
    Linux only."""
    setpriv = shutil.which("setpriv")
    if not setpriv:
        return ()
    words = (setpriv, "--pdeathsig", how)
    known = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    return (*words, "--") if known else ()


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# ---- ending in order: files whole or not at all, no process left


class Stopped(BaseException):
    """SIGTERM or SIGHUP asks for an end; no Exception, so that nothing mistakes it for a failure."""

    def __init__(self, number):
        super().__init__(number)
        self.number = number


_asked = None  # the signal that asks for an end
_waits = False  # then it is looked at between two steps, so that none is torn in two
_patient = False  # then a second signal does not end a step either


@contextlib.contextmanager
def stops_in_order():
    """Within it SIGINT raises KeyboardInterrupt, SIGTERM and SIGHUP raise Stopped: within between_steps() between two
    of them, otherwise, and for an impatient second signal, at once. Outside of the main thread, which alone may take
    signals, nothing changes."""
    if threading.current_thread() is not threading.main_thread():  # signals are the business of who owns it
        yield
        return
    global _asked
    _asked = None

    def stop(number, _):
        global _asked
        impatient = _asked is not None and not _patient
        _asked = _asked if _patient and _asked is not None else number
        if impatient or not _waits:
            raise_if_asked()

    def lost(what):
        """Python drops what is raised in a finalizer or a callback, an end that is asked for, too: it comes again."""
        if issubclass(what.exc_type, (KeyboardInterrupt, Stopped)):
            signal.setitimer(signal.ITIMER_REAL, 0.01)
        else:
            hook(what)

    wanted = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    signals = [number for number in wanted if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in signals}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, lambda *_: raise_if_asked())
    hook, sys.unraisablehook = sys.unraisablehook, lost
    try:
        yield
    finally:
        _asked = None  # whoever drives next in this process was not asked to end
        sys.unraisablehook = hook
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


def raise_if_asked():
    """To be called between two steps."""
    if _asked == signal.SIGINT:
        raise KeyboardInterrupt
    if _asked is not None:
        raise Stopped(_asked)


@contextlib.contextmanager
def between_steps(patient=False):
    """Within it a signal waits for raise_if_asked() or at_once(); patient: a second one waits as well."""
    global _waits, _patient
    _waits, _patient = True, patient
    try:
        yield
    finally:
        _waits = _patient = False


@contextlib.contextmanager
def at_once():
    """Within it, inside of between_steps(), a signal raises at once, and one that came before does so now: for
    waiting."""
    global _waits
    raise_if_asked()
    before, _waits = _waits, False
    try:
        yield
    finally:
        _waits = before
