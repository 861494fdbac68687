"""Frames at intervals that are short enough for a smooth motion in the player.

Between two stored frames the rotor often turns by a sixth of a revolution, and a ball collides forty times. So the deck
is run again for the last part of the run if that is cheap (rerun.py; the result is compared with the file). Otherwise
the player shows the stored frames.
"""

import contextlib
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.player import frames

TURN = 8 / 360  # largest part of a rotor turn from one frame to the next
STILL = 1e6  # [byte] largest size of the still picture in a page
CHEAP = 30.0  # [s] largest CPU time without the option --rerun always
ROOM = 2e9  # [byte] largest temporary disk space, likewise
STEPS = (1.0, 2.0, 5.0)


class Finer:
    """A run whose frames come from another run, from a time [s] on; all other data are its own."""

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
    """Largest interval of frames [s]: 1, 2 or 5 times a power of ten. In this time the slowest motion moves by at most
    TURN of its period, and a ball of mean speed by at most its diameter. Infinite if nothing moves."""
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
    """The number of frames that fit into a page together with the still picture."""
    drawn = min(len(run.balls("diameter")), frames.MOST_BALLS)
    room = 0.75 * (most_bytes - min(STILL, most_bytes / 4))  # base64
    return int(np.clip(0.9 * room / (frames.PRICE * drawn), 30, frames.MOST_FRAMES))


def _too_dear(run, until, step):
    """Why the deck is not run again by default; None if it is."""
    cost, takes = run.cost * until, None
    if not cost <= CHEAP:
        takes = (f"about {cost:.0f} s" if cost == cost else "an unknown amount") + " of CPU time"
    elif (needed := rerun.size(run, until, step, False)) > ROOM:
        takes = f"{needed / 1e9:.2g} GB of temporary disk"
    return takes and f"running the deck again for more frames takes {takes}: use --rerun always to do it"


@contextlib.contextmanager
def frames_of(run, most_bytes, wanted, say, watch, until=None):
    """Yields the run, or a Finer one if its frames are too far apart. `wanted`: one of report.RERUN; say(line) prints a
    line for the user, watch(line) gets the progress; finer frames end at `until` [s] or with the run's own."""
    times = run.frame_times()
    step = interval(run) if wanted != "never" else math.inf
    stored = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    if len(times) < 2 or stored <= 1.5 * step:
        yield run
        return
    until = until or float(times[-1])
    reason = rerun.why_not(run) or (wanted == "auto" and _too_dear(run, until, step)) or None
    with contextlib.ExitStack() as stack:
        if not reason:
            try:
                other = stack.enter_context(rerun.again(run, until, step, watch=watch, never="--rerun never"))
            except UserError as fault:
                reason = str(fault)
        if reason:
            say(f"{run.path}: the player shows the stored frames, {stored * 1e3:.4g} ms apart; {reason}")
            yield run
        else:
            yield Finer(run, other, until - step * (_count(run, most_bytes) - 1))
