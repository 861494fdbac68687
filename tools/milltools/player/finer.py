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

FLASHES = 400.0  # [byte] of the flashes of impacts, for each frame
STILL = 1e6, 1 / 8  # largest size of the still picture in a page: [byte], and share of the player


class Finer:
    """A run whose frames come from another run, from a time [s] on, and its `log` of impacts; all other data are its
    own."""

    def __init__(self, run, other, begin):
        self._run, self._other = run, other
        self.log = other if other.has("impacts/time") else run
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

    def twist(self, index):
        return self._other.twist(int(index) + self._first)


def still_room(most_bytes) -> int:
    """Largest size [byte] of the PNG of the still picture in a player of `most_bytes`."""
    return int(0.75 * min(STILL[0], STILL[1] * most_bytes))  # base64


def _count(run, most_bytes):
    """The number of frames that fit into a page together with the still picture."""
    drawn = min(len(run.balls("diameter")), frames.MOST_BALLS)
    room = 0.75 * most_bytes - still_room(most_bytes)  # base64
    return int(np.clip(0.9 * room / (frames.PRICE * drawn + FLASHES), frames.FEWEST_FRAMES, frames.MOST_FRAMES))


def _too_dear(run, until, step):
    """Why the deck is not run again by default; None if it is."""
    takes = rerun.too_dear(run, until, step, True)
    return f"running the deck again for more frames takes {takes}: use --rerun always to do it" if takes else None


@contextlib.contextmanager
def frames_of(run, most_bytes, wanted, say, watch, until=None):
    """Yields the run, or a Finer one if its frames are too far apart. `wanted`: auto, always, never; say(line) prints a
    line for the user, watch(line) gets the progress; finer frames end at `until` [s] or with the run's own."""
    times = run.frame_times()
    step = rerun.interval(run) if wanted != "never" else math.inf
    stored = float(np.median(np.diff(times))) if len(times) > 1 else math.inf
    if len(times) < 2 or stored <= 1.5 * step:
        yield run
        return
    until = until or float(times[-1])
    reason = rerun.why_not(run) or (wanted == "auto" and _too_dear(run, until, step))
    with contextlib.ExitStack() as stack:
        if not reason:
            try:
                told = lambda line: watch(f"more frames for the player, the deck again: {line}")  # noqa: E731
                other = stack.enter_context(rerun.again(run, until, step, True, watch and told, "--rerun never"))
            except UserError as fault:
                reason = str(fault)
        if reason:
            say(f"{run.path}: the player shows the stored frames, {stored * 1e3:.4g} ms apart; {reason}")
            yield run
        else:
            yield Finer(run, other, until - step * (_count(run, most_bytes) - 1))
