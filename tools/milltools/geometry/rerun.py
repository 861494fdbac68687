"""A finished run once more, for what its file does not hold: ball states in finer steps, every impact.

millsim gives the same bits for the same deck, whatever it stores, so what comes out is the run and not another one
like it. That is not taken on trust: its energies, counts and frames are compared with those in the file.
"""

import contextlib
import pathlib
import shutil
import subprocess
import tempfile

import numpy as np

from milltools.base import engine, processes
from milltools.base.errors import UserError
from milltools.geometry.trajectory import HALF_ULP, SAME_TIME, stored
from milltools.read.runfile import Run

BESIDE = 1e-3  # of an interval: how far behind its last frame the run ends
ULPS = 4.0  # frames may differ by that many units in the last place of the largest value
ENERGIES = 1e-9  # relative: the same events give the same bits, a single other one soon much more
SERIES = ("kinetic_energy", "rotational_energy", "rotor_work")
STATE_BYTES = 36  # a ball in a frame: three vectors of three float32
IMPACT_BYTES = 54


def why_not(run) -> str | None:
    """Why a run cannot be run again, or None."""
    if run.program != "millsim":
        return f"it is {run.program}'s run"
    if not run.deck_text():
        return "the file holds no deck"
    return None


def size(run, until, interval, impacts) -> float:
    """About how large the new file gets [bytes]."""
    found = 0.0
    if interval:
        found += STATE_BYTES * len(run.balls("id")) * (until / interval + 2)
    if impacts:
        count = run.contacts
        found += IMPACT_BYTES * count * min(1.0, until / run.time if run.time > 0 else 1.0)
    return found


def cost(run, until) -> float:
    """About how many seconds of CPU time it takes; NaN if the file does not tell."""
    return run.cost * until


def _need_room(folder, needed):
    free = shutil.disk_usage(folder).free
    if needed > 0.95 * free:
        raise UserError(
            f"{folder}: running the deck again needs {needed / 1e9:.2g} GB there, {free / 1e9:.2g} GB are free: "
            "set TMPDIR to a larger disk, end earlier (--to), or take --no-rerun",
            status=1,
        )


class OtherRun(UserError):
    """What came of running a deck again is not the same run."""


@contextlib.contextmanager
def again(run, until, interval=0.0, impacts=False, watch=None):
    """The Run that comes of running a run's deck again to `until` [s], with frames every `interval` [s] (0: none) and, if
    asked for, all impacts; its file is gone afterwards. `watch(line)` gets millsim's own lines of progress.

    UserError if millsim fails, OtherRun if that is not the same run up to then."""
    with tempfile.TemporaryDirectory(prefix="mill-") as name:
        folder = pathlib.Path(name)
        _need_room(folder, size(run, until, interval, impacts))
        (folder / "deck.ini").write_text(run.deck_text(), encoding="utf-8")
        changes = frames_only(until, interval)
        changes["output.impacts"] = "all" if impacts else "statistics"
        millsim(folder, changes, watch)
        with Run(folder / "run.h5") as other:
            where = _series_differ(run, other, until) or _frames_differ(run, other, until)
            if where:
                raise OtherRun(f"run again, {where}")
            yield other


def frames_only(until, interval) -> dict[str, str]:
    """What is changed in a deck that is run to `until` [s] for nothing but frames every `interval` [s]."""
    beyond = BESIDE * (interval or until) or SAME_TIME  # millsim runs no deck for 0 s
    return {
        "run.time": f"{until + beyond!r} s",
        "run.sample_from": "0 s",  # the window may begin beyond the new end; it has no influence
        "run.precision": "0",
        "run.max_collisions": "0",
        "output.frames": f"{float(interval)!r} s",
        "output.impacts": "statistics",
        "output.checkpoint": "1e6 s",
    }


def millsim(folder, changes, watch=None):
    """Runs folder/deck.ini into folder/run.h5."""
    words = [word for key, value in changes.items() for word in ("-s", f"{key}={value}")]
    command = [*processes.guard(), engine.program(), "-o", "run.h5", *words, "--", "deck.ini"]
    said = folder / "said"
    with said.open("wb") as errors:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            start_new_session=True,  # Ctrl-C is ours to handle
        )
    try:
        status = _wait(process, said, watch)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    if status != 0:
        lines = _lines(said) or [f"it ended with status {status}"]
        raise UserError(f"running the deck again failed (--no-rerun does without): {lines[-1]}", status=1)


def _lines(said):
    text = said.read_text(encoding="utf-8", errors="replace")
    return [line.removeprefix("millsim: ") for line in text.splitlines() if line.strip()]


def _wait(process, said, watch):
    known = 0
    while True:
        try:
            return process.wait(timeout=0.2)
        except subprocess.TimeoutExpired:
            lines = _lines(said)
            for line in lines[known:]:
                if watch:
                    watch(line)
            known = len(lines)


def _series_differ(run, other, until):
    """Where the series of another run are not those of `run` up to `until` [s], in words; None if they are."""
    for name in SERIES:
        if not (run.has_series(name) and other.has_series(name)):
            continue
        (times, mine), (_, its) = run.series(name), other.series(name)
        count = min(len(mine), len(its), int((times <= until + SAME_TIME).sum()))
        scale = np.maximum(np.abs(mine[:count]), np.abs(its[:count])) * ENERGIES
        wrong = np.flatnonzero(~(np.abs(mine[:count] - its[:count]) <= scale))
        if len(wrong):
            return f"its {name.replace('_', ' ')} is another from {times[wrong[0]]:.6g} s on"
    return None


def _frames_differ(run, other, until):
    """The same of the balls in frames at the same times."""
    mine, its = run.frame_times(), other.frame_times()
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
                return f"it has {len(two)} balls, not {len(one)}"
            most = 2 * ULPS * HALF_ULP * np.abs(one).max(initial=0.0)
            if not np.abs(one - two).max(initial=0.0) <= most:
                return f"the balls are elsewhere at {time:.6g} s"
    return None
