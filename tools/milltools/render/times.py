"""The times of the pictures of a film, and the speed at which it plays."""

import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.geometry.trajectory import SAME_TIME
from milltools.read.values import seconds

FPS = 25.0
LONG = 10.0  # [s] about the length of a film without --slow
LEAST_FPS = 5.0  # of a film of few stored frames
STILL = 50.0  # flashes of a still are those of a film that is so many times slower than real time
ROUND = (1, 1.5, 2, 3, 4, 5, 6, 8, 10)  # possible --slow of a film without it, times a power of ten
MOST = 1_000_000  # pictures of a film
FINER = 20  # largest number of frames per picture when the deck is run again


@dataclasses.dataclass(frozen=True)
class Plan:
    """`times` (n,) [s] of the pictures, rising; `fps`: pictures per second of the film; `slow`: how many times slower
    than real time it plays; `step` [s]: interval of frames that include all times, 0 if stored frames do."""

    times: np.ndarray
    fps: float
    slow: float
    step: float = 0.0


def last_time(run, again) -> float:
    """The last time [s] that can be shown; `again`: the deck can be run again."""
    times = run.frame_times()
    if not len(times) and not again:
        raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s)")
    return max(float(times[-1]) if len(times) else 0.0, run.time if again else 0.0)


def still(run, text, again) -> Plan:
    """The plan of one picture, at a given time or at that of the last frame."""
    times = run.frame_times()
    if text is None:
        if not len(times):
            raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s): give a time with --time")
        return Plan(times[-1:], FPS, np.inf)
    (time,), last = seconds({"--time": text}), last_time(run, again)
    if time > last + SAME_TIME:
        raise UserError(f"--time: the ball states of the run end at {last:.6g} s, got {time:.6g} s")
    time = min(time, last)
    return _plan(run, np.array([time]), FPS, np.inf, time or SAME_TIME)


def film(run, arguments, again, say) -> Plan:
    """The plan of a film. Without --slow it is so slow that nothing moves farther than in rerun.interval() between two
    pictures, and lasts about LONG if only one of --from and --to is given; if the states for that are not to be had,
    it shows every stored frame. say(line) prints a line for the user."""
    last = last_time(run, again)
    begin, end = seconds({"--from": arguments.begin, "--to": arguments.end})
    whole, begin, end = begin is not None, begin or 0.0, last if end is None else end
    if not (begin < end or (arguments.slow and begin == end)):
        raise UserError(f"--to: must be after --from, {begin:.6g} s; got {end:.6g} s")
    if begin > last + SAME_TIME:
        raise UserError(f"--from: the ball states of the run end at {last:.6g} s, got {begin:.6g} s")
    fps, end, slow = arguments.fps or FPS, min(end, last), arguments.slow
    if slow is None:
        frames = run.frame_times()
        frames = frames[(frames >= begin - SAME_TIME) & (frames <= end + SAME_TIME)]
        seen = rerun.interval(run)
        cheap = again and not rerun.too_dear(run, end, seen, True)
        if not cheap and not (len(frames) > 1 and np.diff(frames).max() <= seen):
            return _stored(run, frames, begin, end, arguments.fps)
        slow = max(1 / (fps * seen), LONG / max(end - begin, SAME_TIME))
        power = 10.0 ** np.floor(np.log10(slow))
        slow = float(power * min(ROUND, key=lambda round_: abs(np.log(round_ * power / slow))))
        if not whole and end - begin > 1.2 * LONG / slow:
            begin = end - LONG / slow
            say(f"the film shows the time from {begin:.4g} s to {end:.4g} s (--from and --to choose others)")
    step = 1 / (fps * slow)
    first = round(begin / step)
    count = int((end - first * step) / step + 1e-6) + 1
    return _plan(run, (first + np.arange(_few(count, step))) * step, fps, slow, step)


def _stored(run, times, begin, end, fps) -> Plan:
    """The plan of a film of all stored frames, whose `times` are given."""
    if not len(run.frame_times()):
        raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s): --slow N runs the deck again")
    if len(times) < 2:
        raise UserError(
            f"{run.path}: fewer than two frames are stored from {begin:.6g} s to {end:.6g} s: --slow N makes others"
        )
    fps = fps or float(np.clip(len(times) / LONG, LEAST_FPS, FPS))
    return Plan(times, fps, 1 / (fps * float(np.diff(times).mean())))


def camera(run, offset, camera_fps, play_fps, count, again) -> tuple[Plan, int]:
    """(plan of the pictures to show beside those of a camera, number of the first picture of the camera that is shown).
    Picture k of `count` (None: not known) of the camera is at offset + k / camera_fps [s]."""
    last, step = last_time(run, again), 1 / camera_fps
    first = max(0, int(np.ceil(-offset / step - 1e-6)))
    stop = int(np.floor((last - offset) / step + 1e-6))
    if count is not None:
        stop = min(stop, count - 1)
    if stop < first:
        raise UserError(
            f"--beside: no picture of the camera is in the time of the run: the film starts at {offset:.6g} s, the run "
            f"ends at {last:.6g} s"
        )
    k = np.arange(first, first + _few(stop - first + 1, step))
    fine = step / next((n for n in range(1, FINER) if _whole(offset / step * n)), FINER)
    times = np.round((offset + k * step) / fine) * fine  # so that frames every `fine` include all times
    return _plan(run, times, play_fps, camera_fps / play_fps, fine), first


def until(plan, end) -> Plan:
    """A plan without pictures later than `end` [s]."""
    times = plan.times[plan.times <= end + SAME_TIME]
    if not len(times):
        raise UserError(f"--to: the film has no picture before {end:.6g} s")
    return dataclasses.replace(plan, times=times)


def _whole(number):
    return abs(number - round(number)) < 1e-6


def _few(count, step):
    if count > MOST:
        raise UserError(f"{count} pictures, {step:.3g} s apart, are too many for a film: end earlier (--to)")
    return count


def _plan(run, times, fps, slow, step):
    """A plan; its step is 0 if all times are stored frames, so that the deck need not be run again."""
    stored = run.frame_times()
    near = np.searchsorted(stored, times - SAME_TIME)
    if near.max() < len(stored) and (np.abs(stored[near] - times) <= SAME_TIME).all():
        step = 0.0
    return Plan(times, fps, slow, step)


def words(slow) -> str:
    """The speed at which a film plays, in words."""
    if abs(slow - 1) < 0.01:
        return "in real time"
    much = max(slow, 1 / slow)
    number = f"{much:.3g}" if much < 1000 else f"{much:.0f}"
    return f"{number} times {'slower' if slow > 1 else 'faster'} than real time"
