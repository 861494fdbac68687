"""The states of a film's pictures, one after the other: stored ones, those of the deck run again, or, where that cannot
be, flights.

All are read when they are needed; nothing grows with the run or the film.
"""

import bisect
import contextlib
import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import size
from milltools.geometry import rerun
from milltools.geometry.trajectory import Trajectory

ROWS = 1 << 18  # of the log of impacts, read at a time


class LastImpacts:
    """Normal speed of the last impact of every ball [m/s], from the log of a run; NaN before its first."""

    def __init__(self, run):
        self.run, self.count = run, run.length("impacts/time")
        self.pair = list(run.attribute("impacts/kind", "kinds")).index("ball_ball")
        self.speed = np.full(len(run.balls("id")), np.nan)
        self.next = 0  # the first row not looked at

    def until(self, time) -> np.ndarray:
        """(N,) of the impacts before a time; times must rise. Rows are read backwards, until every ball has been
        met."""
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
        # both balls of a row, rows in their order: of several the last one stays
        found[np.stack([ball, np.where(kind == self.pair, partner, ball)], axis=1).ravel()] = np.repeat(speed, 2)
        return found


class Motion:
    """Where the states come from: a `run` whose frames hold all times or are asked for flights, another with a `log`
    of impacts."""

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
        """Share of the places between stored frames that were not known, so far."""
        return self.trajectory.unknown / max(self.trajectory.asked, 1)


@contextlib.contextmanager
def of(run, plan, impacts, allowed, say, watch):
    """The Motion of a run for a Plan. impacts: the log is wanted too; allowed: the deck may be run again; say(line)
    tells the user; watch(line) gets the progress of that run."""
    log = run if impacts and run.has("impacts/time") else None
    wants_log = impacts and not log
    if not plan.step and not wants_log:
        yield Motion(run, log)
        return
    reason = rerun.why_not(run) if allowed else "--no-rerun"
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
            raise UserError(f"{run.path}: --colour impact needs every impact (output.impacts = all), and {reason}")
        if not len(run.frame_times()):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s), and {reason}")
        if allowed:
            say(f"between stored frames balls are where their flights say ({reason})")
        yield Motion(run, log)


def _announce(run, plan, until, impacts):
    needed, cost = rerun.size(run, until, plan.step, impacts), run.cost * until
    what = " and ".join(["exact states"] * bool(plan.step) + ["impacts"] * impacts)
    takes = [f"about {cost:.0f} s of CPU time"] if cost >= 1 else []
    takes += [f"{size(needed)} of temporary disk"] if needed > 1e6 else []
    return f"runs the deck again up to {until:.4g} s for {what}" + (f": {', '.join(takes)}" if takes else "")
