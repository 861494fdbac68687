"""The states of the balls for the pictures of a film: stored states, states from running the deck again, or, if that is
not possible, states computed from free flights.

States are read when they are needed, so the memory does not grow with the run or the film.
"""

import bisect
import contextlib
import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import size
from milltools.geometry import rerun
from milltools.geometry.trajectory import Trajectory

ROWS = 1 << 18  # rows of the log of impacts read at a time


class LastImpacts:
    """Normal speed of the last impact of every ball [m/s], from the log of a run; NaN before its first."""

    def __init__(self, run):
        self.run, self.count = run, run.length("impacts/time")
        self.pair = list(run.attribute("impacts/kind", "kinds")).index("ball_ball")
        self.speed = np.full(len(run.balls("id")), np.nan)
        self.next = 0  # the first row not read yet

    def until(self, time) -> np.ndarray:
        """The speeds (N,) for a time; times must rise. Rows are read backwards, until each ball has an impact in
        them."""
        rows = range(self.next, self.count)
        end = begin = self.next + bisect.bisect_left(
            rows, time, key=lambda row: float(self.run.read("impacts/time", row))
        )
        latest = np.full_like(self.speed, np.nan)
        while begin > self.next and np.isnan(latest).any():
            first = max(self.next, begin - ROWS)
            earlier = self._within(slice(first, begin))
            latest, begin = np.where(np.isnan(latest), earlier, latest), first
        self.speed, self.next = np.where(np.isnan(latest), self.speed, latest), end
        return self.speed

    def _within(self, rows):
        ball, partner, kind, speed = (
            self.run.read(f"impacts/{name}", rows) for name in ("ball", "partner", "kind", "normal_speed")
        )
        found = np.full_like(self.speed, np.nan)
        # for both balls of a row; numpy assigns the rows in order, so the last impact of a ball stays
        found[np.stack([ball, np.where(kind == self.pair, partner, ball)], axis=1).ravel()] = np.repeat(speed, 2)
        return found


class Motion:
    """Source of the states: a `run` with frames at all times, or with frames to compute flights from; and a run with a
    `log` of impacts."""

    def __init__(self, run, log=None):
        self.trajectory, self.log = Trajectory(run), log

    def states(self, times):
        """Yields the State at each of the times."""
        impacts = LastImpacts(self.log) if self.log else None
        for time in map(float, times):
            state = self.trajectory.at(time)
            yield dataclasses.replace(state, value=impacts.until(time)) if impacts else state

    @property
    def guessed(self) -> float:
        """Share of the states between stored frames so far that are only estimates."""
        return self.trajectory.unknown / max(self.trajectory.asked, 1)


@contextlib.contextmanager
def of(run, plan, impacts, allowed, say, watch):
    """Yields the Motion of a run for a Plan. impacts: the log is needed too; allowed: the deck can be run again;
    say(line) prints a line for the user; watch(line) gets the progress of that run."""
    log = run if impacts and run.has("impacts/time") else None
    wants_log = impacts and not log
    if not plan.step and not wants_log:
        yield Motion(run, log)
        return
    reason = rerun.why_not(run) if allowed else "--no-rerun forbids to run the deck again"
    with contextlib.ExitStack() as stack:
        if not reason:
            until = float(plan.times[-1])
            say(_announce(run, plan, until, wants_log))
            try:
                other = stack.enter_context(rerun.again(run, until, plan.step, wants_log, watch))
            except rerun.OtherRun as fault:
                reason = str(fault)
        if not reason:
            yield Motion(other if plan.step else run, other if wants_log else log)
            return
        if wants_log:
            raise UserError(f"{run.path}: --colour impact needs all impacts (output.impacts = all): {reason}")
        if not len(run.frame_times()):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s): {reason}")
        if allowed:
            say(f"the balls between stored frames are computed from their free flights ({reason})")
        yield Motion(run, log)


def _announce(run, plan, until, impacts):
    needed, cost = rerun.size(run, until, plan.step, impacts), run.cost * until
    what = " and ".join(["exact states"] * bool(plan.step) + ["impacts"] * impacts)
    takes = [f"about {cost:.0f} s of CPU time"] if cost >= 1 else []
    takes += [f"{size(needed)} of temporary disk"] if needed > 1e6 else []
    return f"running the deck again up to {until:.4g} s for {what}" + (f": {', '.join(takes)}" if takes else "")
