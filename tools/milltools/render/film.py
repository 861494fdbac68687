"""A picture or a film of a run: what it shows, who draws it, where it goes."""

import contextlib
import functools
import io
import itertools
import os

import psutil
from PIL import Image

from milltools.base import files, processes, progress
from milltools.base.errors import UserError
from milltools.base.text import plural, size
from milltools.geometry import rerun
from milltools.geometry.bodies import Mill
from milltools.read.runfile import Run
from milltools.read.values import seconds
from milltools.render import camera, colour, encode, footage, pov, scene, states, team, times
from milltools.render.settings import Settings

PROCESS, PIXEL = 3.2e8, 12.0  # bytes that a process takes, and more for each pixel it draws
EYE = {"eye": (3, "0.3,-0.2,0.1"), "target": (3, "0.3,-0.2,0.1"), "up": (3, "0.3,-0.2,0.1"), "angle": (1, "30")}

say = functools.partial(progress.say, "mill render")


def still(arguments, path):
    """Writes the picture that `mill render` was asked for, or the scene of one for POV-Ray, to `path`."""
    with Run(arguments.run) as run:
        plan = times.still(run, arguments.time, _again(arguments, run))
        look = _settings(arguments, run, _size(arguments))
        with _moving(arguments, run, plan) as moving:
            (state,) = moving.states(plan.times)
        if path.suffix.lower() == ".pov":
            pov.write(run, state, path, look.view(run, 0.0, state.poses), look.colour, look.size)
            _written(path, "a scene for POV-Ray")
            return
        with look.drawing() as draw:
            picture = draw(state)
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    with files.whole(path) as draft:
        draft.write_bytes(content.getvalue())
    height, width = picture.shape[:2]
    _written(path, f"{width} x {height} pixels at {state.time:.6g} s")


def film(arguments, path):
    """Writes the film that `mill render` was asked for to `path`."""
    encode.program()  # before anything is drawn
    with Run(arguments.run) as run:
        if not arguments.beside:
            plan = times.film(run, arguments, _again(arguments, run))
            look = _settings(arguments, run, _size(arguments))
            _write(arguments, path, run, plan, look, look.size)
            return
        shot = footage.open_film(arguments.beside, arguments.crop)
        offset, end = arguments.offset, arguments.end
        offset = seconds({"--offset": offset}, negative=True)[0] if offset else 0.0
        rate = arguments.camera_fps or shot.rate
        plan, first = times.camera(run, offset, rate, shot.rate, shot.pictures, _again(arguments, run))
        if end is not None:
            plan = times.until(plan, *seconds({"--to": end}))
        width, height = _size(arguments)
        if (arguments.size or scene.DEFAULT).lower() in scene.SIZES:
            width = shot.width(height)  # both see as much
        look = _settings(arguments, run, (width, height))
        joined = footage.beside(look.size, shot, first)
        _write(arguments, path, run, plan, look, footage.size(look.size, shot), joined)


def _again(arguments, run) -> bool:
    """Whether the deck may and can be run again."""
    return not arguments.no_rerun and rerun.why_not(run) is None


@contextlib.contextmanager
def _moving(arguments, run, plan):
    """The Motion that tells the states of a plan; says at the end how much of what was shown is not known."""
    told = None if arguments.quiet else lambda line: say(f"running the deck again: {line}")
    with states.of(run, plan, arguments.colour == "impact", not arguments.no_rerun, say, told) as moving:
        yield moving
    if moving.trajectory.asked:
        say(
            f"between stored frames {100 * moving.guessed:.2g} % of the balls' places are not known "
            "(more than one contact in a gap): a smooth curve joins the frames there"
        )


def _written(path, what):
    """The last line: what has been written."""
    print(f"{path}: {what}, {size(os.path.getsize(path))}", flush=True)


def painters(look) -> int:
    """How many draw at once, if nobody says: one a core, fewer where memory would not do."""
    if look.pov:
        return processes.cores()
    pixels = look.size[0] * look.size[1] * (4 if look.quality == "final" else 1)
    room = psutil.virtual_memory().available * 0.7
    return max(1, min(processes.cores(), int(room / (PROCESS + PIXEL * pixels))))


def _write(arguments, path, run, plan, look, pixels, change=iter):
    """Draws the pictures of a plan, changes them (a function of the iterable), writes them, `pixels` large."""
    if any(side % 2 for side in pixels):
        raise UserError(f"--size: films have even sizes, got {pixels[0]}x{pixels[1]}")
    count, drawn = len(plan.times), 0
    say(f"{count} pictures at {plan.fps:g} a second, {times.words(plan.slow)}")
    workers = min(arguments.workers or painters(look), count)
    with _moving(arguments, run, plan) as moving:
        tasks = ((state, number / count) for number, state in zip(itertools.count(), moving.states(plan.times)))
        pictures = team.results(look.drawing, workers, tasks)
        with (
            encode.encoder(path, pixels, plan.fps) as add,
            progress.Progress("mill render", count, arguments.quiet) as watch,
        ):
            try:
                for drawn, picture in enumerate(change(pictures), 1):
                    add(picture)
                    watch(drawn, f"{drawn} of {count} pictures")
            finally:
                pictures.close()
            if not drawn:
                raise UserError(f"{path}: there is no picture to show")
        _written(path, f"{drawn} pictures, {drawn / plan.fps:.3g} s")


# ---- how it looks


def _size(arguments) -> tuple[int, int]:
    return scene.size_of(arguments.size or scene.DEFAULT)


def _settings(arguments, run, pixels) -> Settings:
    """How a run's pictures look. UserError for what cannot be shown, before anything is drawn."""
    if arguments.pov and not arguments.file.lower().endswith(".pov"):
        pov.program()
    view = arguments.camera or "front"
    if arguments.eye:
        given = {name: getattr(arguments, name) for name in EYE if getattr(arguments, name) is not None}
        view = camera.free(**{name: _numbers(text, name, *EYE[name]) for name, text in given.items()})
    mill, rides = Mill.of(run), arguments.ride
    if rides and not mill.carrier:
        say("--ride: the container stands still, and so does the camera")
    elif rides is None and not arguments.eye and mill.wanders:
        rides = True
        say("the camera rides on the container, whose path is long (--no-ride: it stands still)")
    limits = _numbers(arguments.limits, "limits", 2, "0,4") if arguments.limits else None
    colours = colour.of(run, arguments.colour, limits)
    drawn = arguments.file.lower().endswith((".png", ".pov"))
    quality = arguments.quality or ("final" if drawn else "draft")
    return Settings(run.path, pixels, quality, view, colours, pov=arguments.pov, rides=bool(rides))


def _numbers(text, name, count, example):
    """As camera.free() and colour.of() take them: one number alone is no list."""
    try:
        found = [float(word) for word in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise UserError(f"--{name}: expected {plural(count, 'number')} such as {example}, got '{text}'")
    return found if count > 1 else found[0]
