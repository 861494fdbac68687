"""Child processes of a command: how many to run at once, how to end them with the command, and how to stop in order
after a signal."""

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
    """Words to put in front of a command, so that it gets the signal `how` when the process (thread) that started it
    ends; empty where setpriv is missing (it is Linux only)."""
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
    """Raised after SIGTERM or SIGHUP. It is not an Exception, so that no handler takes it for a failure."""

    def __init__(self, number):
        super().__init__(number)
        self.number = number


_asked = None  # number of the signal that asked to stop
_waits = False  # True: a signal takes effect only between two steps, so that no step is interrupted
_patient = False  # True: a second signal does not interrupt a step either


@contextlib.contextmanager
def stops_in_order():
    """Within it SIGINT raises KeyboardInterrupt, and SIGTERM and SIGHUP raise Stopped. They do so at once, but within
    between_steps() only between two steps, unless a second signal comes. In threads other than the main thread,
    which cannot handle signals, nothing changes."""
    if threading.current_thread() is not threading.main_thread():
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
        """Python drops exceptions raised in a finalizer or a callback. A timer raises a dropped stop once more."""
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
        _asked = None  # the next command in this process was not asked to stop
        sys.unraisablehook = hook
        signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


def raise_if_asked():
    """Raises the stop that a signal asked for, if any. To be called between two steps."""
    if _asked == signal.SIGINT:
        raise KeyboardInterrupt
    if _asked is not None:
        raise Stopped(_asked)


@contextlib.contextmanager
def between_steps(patient=False):
    """Within it a signal takes effect only in raise_if_asked() or at_once(); patient: so does a second signal."""
    global _waits, _patient
    _waits, _patient = True, patient
    try:
        yield
    finally:
        _waits = _patient = False


@contextlib.contextmanager
def at_once():
    """For waiting inside of between_steps(): within it a signal raises at once, and an earlier signal raises at the
    start."""
    global _waits
    raise_if_asked()
    before, _waits = _waits, False
    try:
        yield
    finally:
        _waits = before
