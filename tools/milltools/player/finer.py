"""Frames close enough together that the player turns instead of jumping.

Stored frames are often so far apart that the rotor turns by a sixth of a revolution and a ball collides forty times
from one to the next. So the deck is run again for the last stretch of the run (rerun.py: the same bits, and held
against the file), if that is cheap; else the stored frames are shown.
"""

import contextlib
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.player import frames

TURN = 8 / 360  # of a turn of the rotor from one frame to the next, at most
STILL = 1e6  # [byte] of a page for the picture, at most
CHEAP = 30.0  # [s] of CPU time, at most, unless it is asked for
ROOM = 2e9  # [byte] of temporary disk, likewise
STEPS = (1.0, 2.0, 5.0)


class Finer:
    """A run whose frames come from another one, from a time [s] on; for all else it is itself."""

    def __init__(self, run, other, begin):
        self._run, self._other = run, other
        self._first = int(np.searchsorted(other.frame_times(), begin - 1e-9))

    def __getattr__(self, name):
        return getattr(self._run, name)

    def frame_times(self):
        return self._other.frame_times()[self._first :]

    def frame_time(self, index):
        return float(self.frame_times()[index])

    def frame(self, index, name="velocity"):
        return self._other.frame(int(index) + self._first, name)

    def poses(self, index):
        return self._other.poses(int(index) + self._first)


def interval(run) -> float:
    """How far frames may be apart [s]: 1, 2 or 5 times a power of ten, in which the slowest motion goes by no more than
    TURN of its period and a ball of usual speed moves by no more than its diameter. Infinite where nothing moves."""
    speed = np.linalg.norm(run.frame(len(run.frame_times()) - 1, "velocity").astype(float), axis=1)
    usual = math.sqrt(float((speed**2).mean()))
    limits = [TURN * run.period] if math.isfinite(run.period) else []
    if usual > 0:
        limits.append(float(np.median(run.balls("diameter"))) / usual)
    if not limits:
        return math.inf
    longest = min(limits)
    power = 10.0 ** math.floor(math.log10(longest))
    return max(m * power for m in STEPS if m * power <= longest * (1 + 1e-9))


def _count(run, most_bytes):
    """How many frames there is room for beside the still picture, so that none has to be left out."""
    drawn = min(len(run.balls("diameter")), frames.MOST_BALLS)
    room = 0.75 * (most_bytes - min(STILL, most_bytes / 4))  # base64
    return int(np.clip(0.9 * room / (frames.PRICE * drawn), 30, frames.MOST_FRAMES))


def _too_dear(run, until, step):
    """Why it is not done without being asked for, or None."""
    cost = run.cost * until
    if not cost <= CHEAP:
        takes = f"some {cost:.0f} s" if cost == cost else "nobody knows how long"
        return f"running the deck again for finer ones takes {takes} of CPU time: --rerun always does it"
    needed = rerun.size(run, until, step, False)
    if needed > ROOM:
        return f"running the deck again for finer ones takes {needed / 1e9:.2g} GB of temporary disk: --rerun always does it"
    return None


@contextlib.contextmanager
def frames_of(run, most_bytes, wanted, say, watch):
    """The run itself, or, where its frames are too far apart, a Finer one. `wanted`: one of report.RERUN; say(line)
    tells the user, watch(line) gets the progress."""
    times = run.frame_times()
    step = interval(run) if wanted != "never" else math.inf
    stored = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    if len(times) < 2 or stored <= 1.5 * step:
        yield run
        return
    until = float(times[-1])
    reason = rerun.why_not(run) or (wanted == "auto" and _too_dear(run, until, step)) or None
    with contextlib.ExitStack() as stack:
        if not reason:
            try:
                other = stack.enter_context(rerun.again(run, until, step, watch=watch))
            except UserError as fault:
                reason = str(fault)
        if reason:
            say(f"{run.path}: the player shows the stored frames, {stored * 1e3:.4g} ms apart; {reason}")
            yield run
        else:
            yield Finer(run, other, until - step * (_count(run, most_bytes) - 1))
