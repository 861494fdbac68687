"""The states of the balls for the pictures of a film: stored states, states from running the deck again, or, if that is
not possible, states computed from free flights.

States are read when they are needed, so the memory does not grow with the run or the film.
"""

import bisect
import contextlib
import dataclasses
import functools

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import size
from milltools.geometry import rerun
from milltools.geometry.bodies import Mill, inverse, moved
from milltools.geometry.trajectory import SAME_TIME, Trajectory, between

ROWS = 1 << 18  # rows of the log of impacts read at a time
# flashes of impacts: how long one is seen [s of the film], how many are seen at a time, or fewer: one of so many balls;
# the radius of a hard one in radii of a ball, the share of the flashes that are harder, and how much larger they can be
SEEN, MANY, BALLS, GLOW, HARDER, LARGEST = 0.15, 60, 20, 1.6, 0.05, 1.2


def _row(run, rows, time) -> int:
    """The number of impacts before a time [s] among some rows of the log."""
    return bisect.bisect_left(rows, time, key=lambda row: float(run.read("impacts/time", row)))


class LastImpacts:
    """Normal speed of the last impact of every ball [m/s], from the log of a run; NaN before its first."""

    def __init__(self, run):
        self.run, self.count = run, run.length("impacts/time")
        self.kinds = run.index_names("impacts/kind")
        self.speed = np.full(len(run.balls("id")), np.nan)
        self.next = 0  # the first row not read yet

    def until(self, time) -> np.ndarray:
        """The speeds (N,) for a time; times must rise. Rows are read backwards, until each ball has an impact in
        them."""
        rows = range(self.next, self.count)
        end = begin = self.next + _row(self.run, rows, time)
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
        found[np.stack([ball, np.where(np.array(self.kinds)[kind] == "ball_ball", partner, ball)], axis=1).ravel()] = (
            np.repeat(speed, 2)
        )
        return found


class Flashes:
    """Flashes where balls hit hard between two times [s], from the `log` of a run: `time` (n,) [s], rising; `place`
    (n, 3) [m] in the frame of the container's motion, with which they move (`run` has its poses); `radius` (n,) [m], as
    the cube root of the dissipated energy; `least` [J]: impacts of less energy have none. A flash is seen, and shrinks,
    for `life` [s]; at most about MANY are seen at a time."""

    def __init__(self, log, run, begin, end, life):
        rows, self.life = range(log.length("impacts/time")), life
        first, last = (_row(log, rows, time) for time in (begin, end))
        diameter, found = run.balls("diameter"), [np.empty(0), np.empty((0, 3)), np.empty(0)]
        count = round(np.clip(len(diameter) / BALLS, 1, MANY) * max((end - begin) / life, 1))
        for start in range(first, last, ROWS):
            part = slice(start, min(start + ROWS, last))
            more = [log.read(f"impacts/{name}", part) for name in ("time", "position", "dissipation")]
            found = [np.concatenate(both).astype(float) for both in zip(found, more, strict=True)]
            keep = np.sort(np.argsort(-found[2], kind="stable")[:count])
            found = [one[keep] for one in found]
        self.time, self.place, self.energy = found
        self.least = float(self.energy.min(initial=np.inf))
        self.hard = float(np.quantile(self.energy, 1 - HARDER)) if len(self.energy) else 1.0
        self.size = GLOW * float(np.median(diameter)) / 2
        self.carrier = Mill.of(run).carrier if len(run.frame_times()) > 1 else ""
        if self.carrier:
            pose = functools.lru_cache(2)(lambda index: run.poses(index)[self.carrier])
            frames = run.frame_times()
            after = np.clip(np.searchsorted(frames, self.time), 1, len(frames) - 1)
            share = np.clip((self.time - frames[after - 1]) / (frames[after] - frames[after - 1]), 0, 1)
            for k, index in enumerate(map(int, after)):
                self.place[k] = moved(inverse(between(pose(index - 1), pose(index), share[k])), self.place[k])

    @property
    def radius(self) -> np.ndarray:
        return self.size * np.cbrt(np.minimum(self.energy / (self.hard or 1.0), LARGEST**3))

    def beside(self, others: list["Flashes"]):
        """Leaves the flashes that all of the others would show too, in one scale: for runs that are shown together."""
        self.least, self.hard = (max(getattr(one, name) for one in others) for name in ("least", "hard"))
        keep = self.energy >= self.least
        self.time, self.place, self.energy = self.time[keep], self.place[keep], self.energy[keep]

    def at(self, time, poses) -> np.ndarray:
        """Place in the laboratory and present radius (n, 4) [m] of the flashes that are seen at a time, for the poses
        of the motions."""
        seen = slice(*np.searchsorted(self.time, [time - self.life, time + SAME_TIME]))
        left = 1 - np.clip((time - self.time[seen]) / self.life, 0, 1)
        place = moved(poses[self.carrier], self.place[seen]) if self.carrier else self.place[seen]
        return np.column_stack([place, self.radius[seen] * left])


class Motion:
    """Source of the states: a `run` with frames at all times, or with frames to compute flights from; and a run with a
    `log` of impacts for `flashes` [s: how long they are seen; 0: none] and the values of the balls (`last`)."""

    def __init__(self, run, log=None, last=False, flashes=0.0):
        self.trajectory, self.log, self.last, self.life = Trajectory(run), log, last, flashes

    def states(self, times):
        """Yields the State at each of the times."""
        impacts, flashes = LastImpacts(self.log) if self.log and self.last else None, None
        if self.log and self.life:
            flashes = Flashes(
                self.log, self.trajectory.run, float(times[0]) - self.life, float(times[-1]) + SAME_TIME, self.life
            )
        for time in map(float, times):
            state, value = self.trajectory.at(time), impacts and impacts.until(time)
            yield dataclasses.replace(state, value=value, flashes=flashes and flashes.at(time, state.poses))

    @property
    def guessed(self) -> float:
        """Share of the states between stored frames so far that are only estimates."""
        return self.trajectory.unknown / max(self.trajectory.asked, 1)


@contextlib.contextmanager
def of(run, plan, impacts, flashes, allowed, say, watch):
    """Yields the Motion of a run for a Plan. impacts: the colours need the log; flashes: how long they are seen [s], if
    there is a log; allowed: the deck can be run again; say(line) prints a line for the user; watch(line) gets the
    progress of that run."""
    log = run if (impacts or flashes) and run.has("impacts/time") else None
    wants_log = not log and (impacts or bool(flashes))
    if not plan.step and not wants_log:
        yield Motion(run, log, impacts, flashes)
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
            yield Motion(other if plan.step else run, other if wants_log else log, impacts, flashes)
            return
        if impacts and not log:
            raise UserError(f"{run.path}: --colour impact needs all impacts (output.impacts = all): {reason}")
        if not len(run.frame_times()):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s): {reason}")
        if allowed:
            what = ["the balls between stored frames are computed from their free flights"] * bool(plan.step)
            say(f"{' and '.join(what + ['hard impacts do not flash'] * wants_log)} ({reason})")
        yield Motion(run, log, impacts, flashes)


def _announce(run, plan, until, impacts):
    needed, cost = rerun.size(run, until, plan.step, impacts), run.cost * until
    what = " and ".join(["exact states"] * bool(plan.step) + ["impacts"] * impacts)
    takes = [f"about {cost:.0f} s of CPU time"] if cost >= 1 else []
    takes += [f"{size(needed)} of temporary disk"] if needed > 1e6 else []
    return f"running the deck again up to {until:.4g} s for {what}" + (f": {', '.join(takes)}" if takes else "")
