"""Makes a picture or a film of a run: chooses the states, the look and the processes, and writes the file."""

import contextlib
import dataclasses
import functools
import io
import os

import numpy as np
import psutil
from PIL import Image

from milltools.base import extras, files, processes, progress
from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.text import plural, size
from milltools.geometry import rerun
from milltools.geometry.bodies import Mill
from milltools.read.runfile import Run
from milltools.read.values import seconds
from milltools.render import camera, colour, encode, footage, pov, scene, states, team, times

PROCESS, PIXEL = 3.2e8, 12.0  # bytes that a process needs, and bytes for each pixel it draws
EYE = {"eye": 3, "target": 3, "up": 3, "angle": 1}  # how many numbers each option has
EXAMPLES = {1: "30", 2: "0,4", 3: "0.3,-0.2,0.1"}

say = functools.partial(progress.say, "mill render")


def still(arguments, path) -> Answer:
    """Writes the picture of a `mill render` command, or its scene for POV-Ray, to `path`."""
    with Run(arguments.run) as run:
        plan = times.still(run, arguments.time, _again(arguments, run))
        look = _look(arguments, run, _size(arguments))
        with _moving(arguments, run, plan) as moving:
            (state,) = moving.states(plan.times)
        if path.suffix.lower() == ".pov":
            text = pov.scene(run, state, look.view(run, 0.0, state.poses), look.colour, look.size)
            files.write_text(path, text)
            return _written(path, "a scene for POV-Ray", size=look.size, time=state.time)
        with look.drawing() as draw:
            picture = draw(state)
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    with files.whole(path) as draft:
        draft.write_bytes(content.getvalue())
    words = f"{look.size[0]} x {look.size[1]} pixels at {state.time:.6g} s"
    return _written(path, words, pictures=1, size=look.size, time=state.time)


def film(arguments, path) -> Answer:
    """Writes the film of a `mill render` command to `path`."""
    encode.program()  # before anything is drawn
    with Run(arguments.run) as run:
        again, (width, height) = _again(arguments, run), _size(arguments)
        if not arguments.beside:
            plan = times.film(run, arguments, again, say)
            return _write(arguments, path, run, plan, _look(arguments, run, (width, height)))
        shot = footage.open_film(arguments.beside, arguments.crop)
        offset = seconds({"--offset": arguments.offset}, negative=True)[0] if arguments.offset else 0.0
        rate = arguments.camera_fps or shot.rate
        plan, first = times.camera(run, offset, rate, shot.rate, shot.pictures, again)
        if arguments.end is not None:
            plan = times.until(plan, *seconds({"--to": arguments.end}))
        if (arguments.size or scene.DEFAULT).lower() in scene.SIZES:
            width = shot.width(height)  # both see as much
        look = _look(arguments, run, (width, height))
        more = footage.GAP + shot.width(height)
        return _write(arguments, path, run, plan, look, more, lambda mine: footage.beside(mine, height, shot, first))


def _again(arguments, run) -> bool:
    """Whether the deck can be run again, and --no-rerun does not forbid it."""
    return not arguments.no_rerun and rerun.why_not(run) is None


@contextlib.contextmanager
def _moving(arguments, run, plan):
    """Yields the Motion with the states of a plan; reports at the end which share of the states is estimated."""
    told = None if arguments.quiet else lambda line: say(f"running the deck again: {line}")
    wanted = arguments.flashes if arguments.flashes is not None else len(plan.times) > 1
    wanted = wanted and arguments.colour not in colour.WEAR
    life = states.SEEN / (plan.slow if np.isfinite(plan.slow) else times.STILL) if wanted else 0.0
    with states.of(run, plan, arguments.colour == "impact", life, not arguments.no_rerun, say, told) as moving:
        yield moving
    if moving.trajectory.asked:
        say(
            f"between stored frames {100 * moving.guessed:.2g} % of the balls' positions are estimates: "
            "after more than one contact between two frames, a smooth curve joins the two states"
        )


def _written(path, what, **facts) -> Answer:
    """The last line about the file written, and its facts for --json."""
    total = os.path.getsize(path)
    return Answer(f"{path}: {what}, {size(total)}", {"files": [path], "bytes": total} | facts)


def _write(arguments, path, run, plan, look, more=0, change=iter) -> Answer:
    """Draws the pictures of a plan and writes them as a film. `change`: a function applied to the iterable of pictures,
    which makes them `more` pixels wider."""
    count, drawn = len(plan.times), 0
    chosen = "" if arguments.slow or arguments.beside else "; --slow sets it"
    say(f"{count} pictures at {plan.fps:g} a second, {times.words(plan.slow)}{chosen}")
    workers = min(arguments.workers or look.painters(), count)
    with _moving(arguments, run, plan) as moving:
        tasks = ((state, number / count) for number, state in enumerate(moving.states(plan.times)))
        with (
            encode.encoder(path, (look.size[0] + more, look.size[1]), plan.fps) as add,
            progress.Progress("mill render", count, arguments.quiet) as watch,
            contextlib.closing(team.results(look.drawing, workers, tasks)) as pictures,
        ):
            for drawn, picture in enumerate(change(pictures), 1):
                add(picture)
                watch(drawn, f"{drawn} of {count} pictures")
            if not drawn:
                raise UserError(f"{path}: the film would have no picture")
    facts = {"pictures": drawn, "fps": plan.fps, "duration": drawn / plan.fps, "slow": plan.slow}
    facts |= {"size": (look.size[0] + more, look.size[1]), "from": plan.times[0], "to": plan.times[drawn - 1]}
    return _written(path, f"{drawn} pictures, {drawn / plan.fps:.3g} s", **facts)


# ---- how it looks


@dataclasses.dataclass(frozen=True)
class Look:
    """The look of all pictures of a film. It is sent to every process that draws, so it is small.

    `path` of the run, `size` (width, height) [pixels], `quality` of scene.QUALITIES, `camera` as for camera.of();
    `pov`: drawn by POV-Ray instead of VTK; `rides`: the camera moves with the container."""

    path: str
    size: tuple[int, int]
    quality: str
    camera: str | camera.Camera
    colour: colour.Colour
    pov: bool
    rides: bool

    def view(self, run, fraction=0.0, poses=None) -> camera.Camera:
        """The camera at a share of the film, for the `poses` of the motions."""
        return camera.of(self.camera, run, fraction, (poses or {}) if self.rides else None)

    @contextlib.contextmanager
    def drawing(self):
        """A function of (state, share of the film) that gives its picture, uint8 (h, w, 3)."""
        with Run(self.path) as run:
            if self.pov:
                yield lambda state, fraction=0.0: pov.draw(
                    run, state, self.view(run, fraction, state.poses), self.colour, self.size
                )
                return
            moves = self.camera == "orbit" or self.rides
            with scene.Scene(run, self.size, self.quality, self.view(run), self.colour) as drawn:

                def draw(state, fraction=0.0):
                    if moves:
                        drawn.look(self.view(run, fraction, state.poses))
                    return drawn.draw(state)

                yield draw

    def painters(self) -> int:
        """Default number of processes that draw: one per core, fewer if the memory is not sufficient."""
        if self.pov:
            return processes.cores()
        pixels = self.size[0] * self.size[1] * scene.QUALITIES[self.quality] ** 2
        room = psutil.virtual_memory().available * 0.7
        return max(1, min(processes.cores(), int(room / (PROCESS + PIXEL * pixels))))


def _size(arguments) -> tuple[int, int]:
    return scene.size_of(arguments.size or scene.DEFAULT)


def _look(arguments, run, pixels) -> Look:
    """The Look from the options; UserError for options that are wrong, before anything is drawn."""
    suffix = os.path.splitext(arguments.file)[1].lower()
    if arguments.pov and suffix != ".pov":
        extras.program("povray", "povray")
    view = arguments.camera or "front"
    if arguments.eye:
        given = {name: getattr(arguments, name) for name in EYE if getattr(arguments, name) is not None}
        view = camera.free(**{name: _numbers(text, name, EYE[name]) for name, text in given.items()})
    mill, rides = Mill.of(run), arguments.ride
    if rides and not mill.carrier:
        say("--ride has no effect: the container does not move")
    elif rides is None and not arguments.eye and mill.wanders:
        rides = True
        say("the camera moves with the container because its path is long (--no-ride: the camera stands still)")
    limits = None
    if arguments.limits and os.path.exists(arguments.limits):
        with Run(arguments.limits) as other:
            limits = colour.shared([run, other], arguments.colour)
    elif arguments.limits:
        limits = _numbers(arguments.limits, "limits", 2)
    colours = colour.of(run, arguments.colour, limits, arguments.colour_map)
    quality = arguments.quality or ("final" if suffix in (".png", ".pov") else "draft")
    return Look(run.path, pixels, quality, view, colours, arguments.pov, bool(rides))


def _numbers(text, name, count):
    """The `count` numbers of an option, in the form for camera.free() and colour.of(): a list, or a single number."""
    try:
        found = [float(word) for word in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        raise UserError(f"--{name}: expected {plural(count, 'number')} such as {EXAMPLES[count]}, got '{text}'")
    return found if count > 1 else found[0]
