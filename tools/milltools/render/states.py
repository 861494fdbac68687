"""The states of a film's pictures, one after the other: stored ones, those of the deck run again, or, where that cannot be, flights.

All are read when they are needed; nothing grows with the run or the film.
"""

import bisect
import contextlib
import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.geometry.trajectory import Trajectory

ROWS = 1 << 18  # of the log of impacts, read at a time


class LastImpacts:
    """Normal speed of the last impact of every ball [m/s], from the log of a run; NaN before its first."""

    def __init__(self, run):
        self.run = run
        self.count = run.length("impacts/time")
        kinds = list(run.attribute("impacts/kind", "kinds"))
        self.pair = kinds.index("ball_ball")
        self.speed = np.full(len(run.balls("id")), np.nan)
        self.next = None  # the first row not looked at

    def until(self, time) -> np.ndarray:
        """(N,) of the impacts before a time; times must rise."""
        rows = range(self.next or 0, self.count)
        end = rows.start + bisect.bisect_left(rows, time, key=lambda row: float(self.run.read("impacts/time", row)))
        if self.next is None:
            self._look_back(end)
        else:
            for begin in range(self.next, end, ROWS):
                self._take(self.speed, begin, min(begin + ROWS, end))
        self.next = max(end, self.next or 0)
        return self.speed.copy()

    def _look_back(self, end):
        """From a row backwards until every ball has been met."""
        while end > 0 and np.isnan(self.speed).any():
            begin = max(0, end - ROWS)
            earlier = np.full_like(self.speed, np.nan)
            self._take(earlier, begin, end)
            self.speed = np.where(np.isnan(self.speed), earlier, self.speed)
            end = begin

    def _take(self, speed, begin, end):
        rows = slice(begin, end)
        ball, partner, kind = (self.run.read(f"impacts/{n}", rows) for n in ("ball", "partner", "kind"))  # fmt: skip
        # both balls of a row, rows in their order: of several the last one stays
        balls = np.stack([ball, np.where(kind == self.pair, partner, ball)], axis=1).ravel()
        speed[balls] = np.repeat(self.run.read("impacts/normal_speed", rows), 2)


@dataclasses.dataclass
class Motion:
    """Where the states come from: `run`, whose frames hold all times or are asked for flights, `log` of impacts or None.
    `reason`: why the deck was not run again, where it should have been."""

    run: object
    log: object = None
    reason: str | None = None

    def __post_init__(self):
        self.trajectory = Trajectory(self.run)

    def states(self, times):
        """Yields the State at each of the times."""
        impacts = LastImpacts(self.log) if self.log else None
        for time in times:
            state = self.trajectory.at(float(time))
            if impacts:
                state = dataclasses.replace(state, value=impacts.until(float(time)))
            yield state

    @property
    def guessed(self) -> float:
        """Share of the places between stored frames that were not known, so far."""
        return self.trajectory.unknown / max(self.trajectory.asked, 1)


@contextlib.contextmanager
def of(run, plan, impacts, allowed, say, watch):
    """The Motion of a run for a Plan. impacts: the log is wanted too; allowed: the deck may be run again; say(line) tells
    the user; watch(line) gets the progress of that run."""
    log = run if impacts and run.has("impacts/time") else None
    wants_log = impacts and not log
    if not plan.step and not wants_log:
        yield Motion(run, log)
        return
    reason = None if allowed else "--no-rerun"
    reason = reason or rerun.why_not(run)
    with contextlib.ExitStack() as stack:
        other = None
        if not reason:
            until = float(plan.times[-1])
            say(_announce(run, plan, until, wants_log))
            other = stack.enter_context(rerun.again(run, until, plan.step, wants_log, watch))
            differs = rerun.differs(run, other, until)
            reason = f"run again, {differs}" if differs else None
        if not reason:
            yield Motion(other if plan.step else run, other if wants_log else log)
            return
        if wants_log:
            raise UserError(f"{run.path}: --colour impact needs every impact (output.impacts = all), and {reason}")  # fmt: skip
        if not len(run.frame_times()):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s), and {reason}")  # fmt: skip
        if allowed:
            say(f"between stored frames balls are where their flights say ({reason})")
        yield Motion(run, log, reason)


def _announce(run, plan, until, impacts):
    needed = rerun.size(run, until, plan.step, impacts)
    cost = rerun.cost(run, until)
    what = " and ".join(["exact states"] * bool(plan.step) + ["impacts"] * impacts)
    takes = [f"about {cost:.0f} s of CPU time"] if cost >= 1 else []
    if needed > 1e6:
        size = f"{needed / 1e9:.2g} GB" if needed > 1e9 else f"{needed / 1e6:.3g} MB"
        takes.append(f"{size} of temporary disk")
    words = f"runs the deck again up to {until:.4g} s for {what}"
    return words + (f": {', '.join(takes)}" if takes else "")
