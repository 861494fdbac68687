"""What is exported: a run or a deck, and which of its frames."""

import re

import numpy as np

from milltools.base.errors import UserError
from milltools.read.deck import Deck
from milltools.read.runfile import Run

HDF5 = b"\x89HDF\r\n\x1a\n"
LENGTH = {"": 1.0, "m": 1.0, "mm": 1e-3, "um": 1e-6}
TIME = {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}
SLACK = 1e-6  # of the interval of frames: how far a time may be off and still be a frame's


def about(path) -> str:
    """ "run" or "deck"; UserError for files that are neither, as far as their first bytes tell."""
    try:
        with open(path, "rb") as file:
            head = file.read(512)
    except OSError:
        return "deck"  # millsim says it in its own words
    if head.startswith(HDF5):
        return "run"
    if head.startswith(b"PAR1"):
        raise UserError(f"{path}: a table of a study, not a run or a deck; 'mill study {path}' shows it")
    if b"\0" in head:
        raise UserError(f"{path}: neither the output file of a run (HDF5) nor a deck (text)")
    return "deck"


def open_run(arguments) -> Run:
    """The run that is asked for; a deck is a UserError: its balls have not moved yet."""
    path = arguments.source
    if about(path) == "deck":
        with open_file(path):
            pass
        raise UserError(
            f"{path}: expected the output file of a run, got a deck: it has no results before it is run ('millsim {path}')"
        )
    if arguments.set:
        raise UserError(f"{path}: --set: what has been run cannot be changed; give its deck")
    return Run(path)


def open_file(path):
    try:
        return open(path, "rb")
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}") from None


def deck_of(path, overrides) -> Deck:
    """The deck of a run, or the one at a path."""
    if about(path) == "deck":
        return Deck.check(path, overrides)
    if overrides:
        raise UserError(f"{path}: --set: what has been run cannot be changed; give its deck")
    with Run(path) as run:
        text = run.deck_text()
    if not text:
        raise UserError(f"{path}: has no /deck/text")
    return Deck(text, path)


# ---- numbers with units


def _number(text, units):
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([A-Za-z]*)\s*", text)
    try:
        return float(found[1]) * units[found[2]]
    except (TypeError, KeyError, ValueError):
        return np.nan


def length(text, what):
    """[m] from '0.1 mm', '1e-4 m', '1e-4'."""
    value = _number(text, LENGTH)
    if not 0 < value < np.inf:
        raise UserError(f"--{what}: expected a length such as '0.1 mm', got '{text}'")
    return value


def moment(text, what):
    """[s] from '100 ms', '0.1 s', '0.1'; the default, +-inf, for None."""
    value = _number(text, TIME)
    if not 0 <= value < np.inf:
        raise UserError(f"--{what}: expected a time such as '100 ms', got '{text}'")
    return value


# ---- frames


def interval(times):
    """Interval of frames [s], 0 of a single one."""
    return float(np.diff(times).mean()) if len(times) > 1 else 0.0


def stored(run) -> np.ndarray:
    """Times of all frames [s]; UserError where there are none."""
    times = run.frame_times()
    if not len(times):
        why = "output.frames = 0 s" if run.quantity("output/frames", 0.0) == 0 else "the run has just begun"
        raise UserError(f"{run.path}: no ball states are stored ({why})")
    return times


def one(run, arguments, default=None) -> int:
    """Number of the frame asked for by --frame or --time; without them the default, or else the last."""
    times = stored(run)
    last = len(times) - 1
    span = f"{run.path} has frames 0 to {last}, from {times[0]:.6g} to {times[-1]:.6g} s"
    if arguments.frame is not None:
        if not -len(times) <= arguments.frame <= last:
            raise UserError(f"--frame {arguments.frame}: {span}")
        return arguments.frame % len(times)
    if arguments.time is None:
        return last if default is None else default
    time = moment(arguments.time, "time")
    slack = SLACK * interval(times)
    if not times[0] - slack <= time <= max(times[-1], run.time) + slack:
        raise UserError(f"--time {arguments.time}: {span}")
    return int(np.abs(times - time).argmin())


def many(run, arguments) -> np.ndarray:
    """Numbers of the frames asked for, at least one."""
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
            f"--from, --to: no frame in there; {run.path} has {len(times)}, from {times[0]:.6g} to {times[-1]:.6g} s"
        )
    return chosen


def window(arguments, slack=0.0) -> tuple[float, float]:
    """--from and --to [s], widened by `slack` [s]; infinite where they are not given."""
    low = -np.inf if arguments.begin is None else moment(arguments.begin, "from") - slack
    high = np.inf if arguments.end is None else moment(arguments.end, "to") + slack
    if low > high:
        raise UserError(f"--from {arguments.begin}: is after --to {arguments.end}")
    return low, high
