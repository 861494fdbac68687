"""Runs the deck of a finished run again for data that its file does not have: more frames, or all impacts.

millsim gives the same bits for the same deck, whatever it stores, so the result is exactly the same run. This is
checked: energies and frames of the new file are compared with those in the old one.
"""

import contextlib
import math
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

from milltools.base import engine, files, processes
from milltools.base.errors import UserError
from milltools.geometry.trajectory import HALF_ULP, SAME_TIME, stored
from milltools.read.runfile import Run

BESIDE = 1e-3  # the run ends this share of an interval after its last frame
ULPS = 4.0  # frames can differ by that many units in the last place of the largest value
SAME_ENERGY = 1e-9  # relative tolerance; a single different event soon changes the energies by much more
SERIES = ("kinetic_energy", "rotational_energy", "rotor_work")
STATE_BYTES = 36  # of a ball in a frame: three vectors of three float32
IMPACT_BYTES = 54
TURN = 4 / 360  # largest part of a rotor turn from one frame to the next
CHEAP = 30.0  # [s] largest CPU time of a second run that nobody asked for
ROOM = 2e9  # [byte] largest temporary disk space, likewise
STEPS = (1.0, 2.0, 5.0)


def why_not(run) -> str | None:
    """Why the deck of a run cannot be run again; None if it can."""
    if run.program != "millsim":
        return f"{run.program} made the run, not millsim"
    return None if run.deck_text() else "the file holds no text of the deck"


def size(run, until, interval, impacts) -> float:
    """Approximate size of the new file [bytes]."""
    found = 0.0
    if interval:
        found += STATE_BYTES * len(run.balls("id")) * (until / interval + 2)
    if impacts:
        found += IMPACT_BYTES * run.contacts * min(1.0, until / run.time if run.time > 0 else 1.0)
    return found


def interval(run) -> float:
    """Largest interval of frames [s] that shows the motion: 1, 2 or 5 times a power of ten. In this time the slowest
    motion moves by at most TURN of its period, and a ball of mean speed by at most its radius. Infinite if nothing
    moves or no frame is stored."""
    limits, last = [TURN * run.period] if math.isfinite(run.period) else [], len(run.frame_times()) - 1
    if last >= 0:
        speed = np.linalg.norm(run.frame(last, "velocity").astype(float), axis=1)
        usual = math.sqrt(float((speed**2).mean()))
        limits += [float(np.median(run.balls("diameter"))) / 2 / usual] if usual > 0 else []
    if not limits:
        return math.inf
    longest = min(limits)
    power = 10.0 ** math.floor(math.log10(longest))
    return max(m * power for m in STEPS if m * power <= longest * (1 + 1e-9))


def too_dear(run, until, step, impacts) -> str:
    """What it takes to run a deck again to `until` [s], if that is too much for nobody having asked; else ""."""
    cost = run.cost * until
    if not cost <= CHEAP:
        return (f"about {cost:.0f} s" if cost == cost else "an unknown amount") + " of CPU time"
    needed = size(run, until, step, impacts)
    return f"{needed / 1e9:.2g} GB of temporary disk" if needed > ROOM else ""


class OtherRun(UserError):
    """Running a deck again gave a different run."""


@contextlib.contextmanager
def again(run, until, interval=0.0, impacts=False, watch=None, never="--no-rerun"):
    """Runs the deck of a run again to `until` [s], with frames every `interval` [s] (0: none) and, with `impacts`, all
    impacts. Yields the new Run; its file is deleted afterwards. `watch(line)` gets millsim's lines of progress.
    `never`: the option that avoids this run.

    UserError if millsim fails, OtherRun if the two runs differ up to `until`."""
    folder = tempfile.gettempdir()
    needed, free = size(run, until, interval, impacts), shutil.disk_usage(folder).free
    if needed > 0.95 * free:
        raise UserError(
            f"{folder}: running the deck again needs {needed / 1e9:.2g} GB there, but {free / 1e9:.2g} GB are free: "
            f"set TMPDIR to a folder on a larger disk, or use {never}",
            status=1,
        )
    changes = frames_only(until, interval) | {"output.impacts": "all" if impacts else "statistics"}
    with run_of(run.as_deck, changes, watch, f" ({never} avoids it)") as other:
        where = _differs(run, other, until)
        if where:
            raise OtherRun(f"the deck, run again, gave other results: {where}")
        yield other


def frames_only(until, interval) -> dict[str, str]:
    """The changes of a deck that is run to `until` [s] only for frames every `interval` [s]."""
    beyond = BESIDE * (interval or until) or SAME_TIME  # millsim does not accept 0 s
    return {
        "run.time": f"{until + beyond!r} s",
        "run.sample_from": "0 s",  # the old value can be after the new end; it has no influence on the states
        "run.precision": "0",
        "run.starts": "1",  # frames are of the first
        "run.max_collisions": "0",
        "output.frames": f"{float(interval)!r} s",
        "output.impacts": "statistics",
        "output.checkpoint": "1e6 s",
    }


@contextlib.contextmanager
def run_of(deck, changes, watch=None, mend=""):
    """Yields the Run of a Deck with some values changed; its file is deleted afterwards. The deck of a run may be a
    stranger's, and name any mesh of this computer: UserError if its tables and meshes are not those of the run."""
    words = [word for key, value in changes.items() for word in ("-s", f"{key}={value}")]
    command = [*processes.guard(), engine.program(), "-o", "run.h5", *words, "--", "deck.ini"]
    none, line = subprocess.DEVNULL, ""
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        with files.faults(folder):
            pathlib.Path(folder, "deck.ini").write_text(deck.text, encoding="utf-8")
        with subprocess.Popen(
            command, cwd=folder, stdin=none, stdout=none, stderr=subprocess.PIPE, start_new_session=True,
            encoding="utf-8", errors="replace",
        ) as process:  # fmt: skip  # in its own session: this process handles Ctrl-C
            try:
                for line in filter(str.strip, process.stderr):
                    if watch:
                        watch(engine.own_words(line))
            except BaseException:
                process.kill()
                raise
        if process.returncode != 0:
            why = engine.own_words(line) or f"it ended with status {process.returncode}"
            raise UserError(f"running the deck again failed{mend}: {why}", status=1)
        with Run(pathlib.Path(folder, "run.h5")) as run:
            if deck.digest not in (None, run.digest):
                raise UserError(f"{deck.path}: the tables and meshes that its deck names are not those of the run", 1)
            yield run


def _differs(run, other, until) -> str | None:
    """The first difference of the two runs up to `until` [s], in words; None if they are the same."""
    for name in SERIES:
        if not (run.has_series(name) and other.has_series(name)):
            continue
        (times, mine), (_, its) = run.series(name), other.series(name)
        count = min(len(mine), len(its), int((times <= until + SAME_TIME).sum()))
        scale = np.maximum(np.abs(mine[:count]), np.abs(its[:count])) * SAME_ENERGY
        wrong = np.flatnonzero(~(np.abs(mine[:count] - its[:count]) <= scale))
        if len(wrong):
            return f"the {name.replace('_', ' ')} differs from {times[wrong[0]]:.6g} s on"
    mine, its = run.frame_times(), other.frame_times()
    if len(mine) and len(its) and abs(mine[0] - its[0]) > SAME_TIME:  # the start of the balls may be from a file
        return f"its first frame is at another time, {its[0]:.6g} s"
    for index, time in enumerate(mine):
        if time > until + SAME_TIME or not len(its):
            break
        twin = int(np.argmin(np.abs(its - time)))
        if abs(its[twin] - time) > SAME_TIME:
            continue
        a, b = stored(run, index), stored(other, twin)
        for name in ("position", "velocity", "angular_velocity"):
            one, two = getattr(a, name), getattr(b, name)
            if one.shape != two.shape:
                return f"{len(two)} balls, not {len(one)}"
            most = 2 * ULPS * HALF_ULP * np.abs(one).max(initial=0.0)
            if not np.abs(one - two).max(initial=0.0) <= most:
                return f"the states of the balls differ at {time:.6g} s"
    return None
