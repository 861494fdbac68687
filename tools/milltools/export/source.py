"""The source of an export: a run or a deck, and the selected frames."""

import pathlib

import numpy as np

from milltools.base.engine import MILLSIM, command_line
from milltools.base.errors import UserError
from milltools.base.progress import Progress
from milltools.base.text import plural
from milltools.read.deck import Deck
from milltools.read.deck_text import read_text
from milltools.read.runfile import Run, kind_of
from milltools.read.values import seconds

SLACK = 1e-6  # of the interval of frames: a time this close to a frame counts as its time


def open_run(arguments) -> Run:
    """The requested run; UserError for a deck, which has no results."""
    path = arguments.source
    if kind_of(path) == "deck":
        read_text(path)
        again = command_line(pathlib.Path(path), program=MILLSIM)
        raise UserError(f"{path}: expected the output file of a run, got a deck; this runs it: {again}")
    if arguments.set and arguments.what not in ("dose", "wear"):
        raise UserError(f"{path}: --set: a finished run cannot be changed; give its deck")
    return Run(path)


def deck_of(arguments) -> Deck:
    """The deck of a run, or the given deck."""
    if kind_of(arguments.source) == "deck":
        return Deck.check(arguments.source, arguments.set)
    with open_run(arguments) as run:
        if not run.deck_text():
            raise UserError(f"{run.path}: has no /deck/text")
        return Deck(run.deck_text(), run.path, digest=run.digest, outlines=run.as_deck.outlines)


def steps(items, arguments):
    """The items one after the other, with the progress on standard error."""
    return Progress("mill export", len(items)).each(items, arguments.file)


def count(chosen, balls) -> str:
    """Words such as "31 frames of 4000 balls"."""
    return f"{plural(len(chosen), 'frame')} of {plural(balls, 'ball')}"


# ---- frames


def interval(times):
    """Interval of frames [s]; 0 for a single frame."""
    return float(np.diff(times).mean()) if len(times) > 1 else 0.0


def stored(run) -> np.ndarray:
    """Times of all frames [s]; UserError where there are none."""
    times = run.frame_times()
    if not len(times):
        why = "output.frames = 0 s" if run.quantity("output/frames", 0.0) == 0 else "the run has just begun"
        raise UserError(f"{run.path}: no ball states are stored ({why})")
    return times


def one(run, arguments) -> int:
    """Number of the frame chosen by --frame or --time; without these options the last frame."""
    times = stored(run)
    last = len(times) - 1
    span = f"{run.path} has frames 0 to {last}, from {times[0]:.6g} to {times[-1]:.6g} s"
    if arguments.frame is not None:
        if not -len(times) <= arguments.frame <= last:
            raise UserError(f"--frame {arguments.frame}: {span}")
        return arguments.frame % len(times)
    if arguments.time is None:
        return last
    (time,) = seconds({"--time": arguments.time})
    slack = SLACK * interval(times)
    if not times[0] - slack <= time <= max(times[-1], run.time) + slack:
        raise UserError(f"--time {arguments.time}: {span}")
    return int(np.abs(times - time).argmin())


def many(run, arguments) -> np.ndarray:
    """Numbers of the chosen frames, at least one."""
    if arguments.frame is not None or arguments.time is not None:
        return np.array([one(run, arguments)])
    times = stored(run)
    every = 1 if arguments.every is None else arguments.every
    if every < 1:
        raise UserError(f"--every: expected 1 or more, got {every}")
    low, high = window(arguments, SLACK * interval(times))
    chosen = np.flatnonzero((times >= low) & (times <= high))[::every]
    if not len(chosen):
        raise UserError(
            f"--from, --to: no frame in this span; {run.path} has {len(times)} frames, "
            f"{times[0]:.6g} to {times[-1]:.6g} s"
        )
    return chosen


def window(arguments, slack=0.0) -> tuple[float, float]:
    """--from and --to [s], widened by `slack` [s]; infinite if not given."""
    low, high = seconds({"--from": arguments.begin, "--to": arguments.end})
    if low is not None and high is not None and low > high:
        raise UserError(f"--from {arguments.begin}: is after --to {arguments.end}")
    return -np.inf if low is None else low - slack, np.inf if high is None else high + slack
