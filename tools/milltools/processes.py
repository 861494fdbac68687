"""Processes that a command starts: how many at once, and how none outlives it."""

import functools
import os
import shutil
import subprocess


@functools.cache
def guard() -> tuple[str, ...]:
    """The words in front of a command that end it with the process (thread) that started it: Linux only."""
    setpriv = shutil.which("setpriv")
    if not setpriv:
        return ()
    words = (setpriv, "--pdeathsig", "KILL")
    known = subprocess.run([*words, "true"], capture_output=True).returncode == 0
    return (*words, "--") if known else ()


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
