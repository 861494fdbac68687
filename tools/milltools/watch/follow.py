"""Follows the file of a run, which millsim replaces as a whole at each checkpoint (docs/file-format.md).

The file is only read, and its lock only looked at, so the run is never disturbed. Nothing in the file is trusted: it
may be missing, half copied, damaged, or of another run than before.
"""

import dataclasses
import hashlib
import math
import os
import pathlib
import threading
import time

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.text import duration, plain
from milltools.read.runfile import Run
from milltools.watch import messages
from milltools.watch.left import Pace, Precision, told

MOST_STATES = 60  # in one answer, or, if the next one comes late,
RATE = 15.0  # [1/s] of the time until then
MOST_BYTES = 24_000_000  # of their positions
REPLAYED = 300  # states of a run that has ended
PER_SECOND = 20  # of them
LOCKS = pathlib.Path("/proc/locks")  # Linux
ENDED = ("complete", "stopped", "failed")


@dataclasses.dataclass
class Publication:
    """What the file said when it was last replaced. `number`: of publications seen so far; `mill`: differs for another
    run; `time` reached, planned `end` [s]."""

    run: Run
    number: int
    mill: str
    status: str
    time: float
    end: float
    frames: int
    written: float  # [s] since the epoch
    precision: Precision | None
    results: dict | None = None

    @classmethod
    def of(cls, run, number, written):
        about = f"{run.about('started')}\n{run.deck_text()}"
        return cls(
            run,
            number,
            hashlib.sha256(about.encode()).hexdigest()[:16],
            run.status,
            run.time,
            run.quantity("run/time"),
            len(run.frame_times()),
            written,
            Precision.of(run) if run.has_statistics else None,
        )


def held(path) -> bool | None:
    """Whether a run holds the lock of the output file at a path; None if this system does not tell."""
    try:
        locks = LOCKS.read_text()
        return f":{os.stat(os.path.realpath(path) + '.lock').st_ino} " in locks
    except FileNotFoundError:
        return False if LOCKS.exists() else None
    except OSError:
        return None


class Follower:
    """The run whose output file is at `path`. `ignored`: what identify() said of an old file there, which a new run
    will replace. `child`: the run, if this process started it (launch.Child). Safe to use from several threads."""

    def __init__(self, path, ignored=None, child=None):
        self.path, self.child = str(path), child
        self.seen = ignored  # what the file was when it was last looked at
        self.now: Publication | None = None
        self.fault = ""  # why the file could not be read
        self.pace = Pace()
        self.lock = threading.Lock()
        self._mill = ("", None)
        self._alive = None
        self._elsewhere = False  # the run writes the file from another computer: its lock is not seen here

    @staticmethod
    def identify(path):
        """What changes when a file is replaced; None if there is none."""
        try:
            about = os.stat(path)
        except OSError:
            return None
        return about.st_dev, about.st_ino, about.st_mtime_ns, about.st_size

    def look(self) -> Publication | None:
        """Reads the file if it was replaced; the last publication that could be read."""
        # first: the last publication comes before the lock is gone
        before, self._alive = self._alive, self.child.alive if self.child else held(self.path)
        found = self.identify(self.path)
        if found is None or found == self.seen:
            return self.now
        self.seen, last = found, self.now
        try:
            run = Run(self.path)
            try:
                now = Publication.of(run, last.number + 1 if last else 1, found[2] / 1e9)
                if last and now.mill != last.mill:
                    self.pace = Pace()
                if now.time > 0:
                    self.pace.add(float(run.about("wall_time", math.nan)), now.time, run.contacts)
            except BaseException:
                run.close()
                raise
        except UserError as fault:  # perhaps half written: it will change again
            self.fault = fault.line
            return self.now
        self._elsewhere = bool(last) and now.status == "running" and before is self._alive is False
        self.now, self.fault = now, ""
        if last:
            last.run.close()
        return now

    # ---- the state of the run

    @property
    def state(self) -> str:
        """missing, starting (no checkpoint yet), running, complete, stopped, failed, or killed."""
        now = self.now
        if now is None:
            return "failed" if self.child and not self.child.alive else "missing"
        if now.status in ENDED and not (self._alive and now.status != "complete"):
            return now.status
        if self._alive is False and not self._elsewhere:
            return "killed"
        return "running" if now.time > 0 else "starting"

    @property
    def ended(self) -> bool:
        return self.state in (*ENDED, "killed")

    def failure(self) -> list[str]:
        """Lines about a run that has failed."""
        if self.child and not self.child.alive and self.child.status not in (0, None):
            return self.child.complaints
        if self.state == "failed":
            return [f"{self.path}: the run failed at {self.now.time:.6g} s; its file has the results up to then"]
        if self.state == "killed":
            kept = f"has the results up to {self.now.time:.6g} s" if self.now.time > 0 else "has no results yet"
            return [
                f"{self.path}: no run writes it any more on this computer (killed, or the disk was full); it {kept}, "
                f"and '{engine.MILLSIM} --resume' with its deck goes on"
            ]
        return []

    def progress(self) -> dict:
        """The message "progress"."""
        now, state, live = self.now, self.state, self.child.live if self.child else None
        message = {"type": "progress", "left": None, "done": 0.0, "note": ""}
        if now is None and state == "failed":
            return message | {"note": "failed"}
        if state in ("missing", "starting"):
            note = self.fault and f"waiting: {self.fault}"
            if live and live["time"] is not None:
                return message | self._live(live)
            if live and live["what"]:
                note = f"{live['what']}: {100 * live['share']:.0f} %"
            waits = "does not exist yet: waiting for its run" if now is None else "waiting for the first checkpoint"
            return message | {"note": note or f"{plain(self.path)}: {waits}"}
        if state != "running":
            share = min(now.time / now.end, 1.0) if now.end > 0 else 1.0
            words = f"{state} at {now.time:.4g} s" + f" of {now.end:.4g} s" * (now.time < now.end)
            known = f"; {now.precision}" if now.precision else ""
            return message | {"done": 1.0 if state == "complete" else share, "note": words + known}
        if live and live["time"] is not None and not now.precision:
            return message | self._live(live)
        return message | self._estimate(now)

    def _live(self, live):
        """From millsim's own progress, which takes the growth of the contact rate into account."""
        left = live["left"]
        words = f"{live['state']}: {live['time']:.4g} s of {live['end']:.4g} s"
        early = self.now is not None and self.now.run.quantity("run/precision", 0.0) > 0  # it may end before
        note = "; ".join(filter(None, [words, told(0.0 if early else left, left) if left else "", live["what"]]))
        return {"left": left, "done": live["share"], "note": note}

    def _estimate(self, now):
        age = max(time.time() - now.written, 0.0)
        ends = now.precision.ends(now.end) if now.precision else (now.end, now.end)
        left = self.pace.left(*ends, age)
        words = [f"{now.time:.4g} s of {'at most ' * bool(now.precision)}{now.end:.4g} s"]
        words += [told(*left)] if left else []
        words += [str(now.precision)] if now.precision else []
        if age > 2 * max(self.pace.interval, 30):
            words.append(f"no news for {duration(age)}")
        done = min(now.time / (sum(ends) / 2), 1.0) if sum(ends) > 0 else 0.0
        return {"left": sum(left) / 2 if left else None, "done": done, "note": "; ".join(words)}

    # ---- answers

    def tell(self) -> tuple[str, dict]:
        """The state, and the message "progress"."""
        with self.lock:
            self.look()
            return self.state, self.progress()

    def mill(self) -> tuple[str, dict | None]:
        """(Publication.mill, the message "mill"); ("", None) before the file can be read."""
        with self.lock:
            now = self.look()
            if now and self._mill[0] != now.mill:
                self._mill = now.mill, messages.mill(now.run)
            return self._mill if now else ("", None)

    def answer(self, since: int, seen: int) -> dict:
        """What is new for a page that has the states before the stored frame `since` (-1: none yet) and the publication
        `seen`: `states`; `news`, other messages; `next` and `seen` for the next question; `mill`: a name of this mill,
        "" if it is not known yet; `every` [s]: in which time the states should be shown; `ended`."""
        with self.lock:
            now = self.look()
            lines, news, states, after = self.failure(), [self.progress()], [], max(since, 0)
            every, ended = min(max(self.pace.interval, 0.5), 60.0), self.ended
            if now:
                try:
                    states, after = self._states(now, since)
                    if seen != now.number:
                        now.results = now.results or messages.results(now.run)
                        news += [now.results] if now.results else []
                except UserError as fault:  # a file from anywhere may be damaged
                    lines = [*lines, *fault.lines]
            if lines:
                news.append({"type": "failed", "lines": [plain(line) for line in lines]})
            return {
                "mill": now.mill if now else "",
                "next": after,
                "seen": now.number if now else 0,
                "every": len(states) / PER_SECOND if ended else every,
                "ended": ended,
                "news": news,
                "states": states,
            }

    def _states(self, now, since):
        index, after = self._index(now, since)
        states = messages.states(now.run, index, list(now.run.kinds), self.pace.rates)
        if states and self.ended and after >= now.frames:
            states[-1]["ended"] = now.status == "complete"
        return states, after

    def _index(self, now, since):
        """Which stored frames to show, and the first one after them: the newest ones of a run that goes on; of one that
        has ended all, from the first on."""
        drawn = len(messages.chosen(now.run))
        room = max(MOST_BYTES // (16 * max(drawn, 1)), 1)
        most = min(room, MOST_STATES if self.ended else max(MOST_STATES, int(RATE * self.pace.interval)))
        if self.ended:
            step = -(-now.frames // REPLAYED)
            index = np.arange(max(since, 0), now.frames, max(step, 1))[:most]
            after = int(index[-1]) + step if len(index) else now.frames
            if len(index) and after >= now.frames:
                index[-1] = now.frames - 1
            return index, min(after, now.frames)
        first = since if since >= 0 else max(now.frames - most, 0)
        step = max(-(-(now.frames - first) // most), 1)
        return np.arange(now.frames - 1, first - 1, -step)[::-1], now.frames
