"""A film of a run, alone or beside a camera's."""

import itertools

import psutil

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.read.runfile import Run
from milltools.render import encode, prepare, team, times
from milltools.render import footage as beside
from milltools.render import states as motion
from milltools.render.progress import Watch, say, written

PROCESS, PIXEL = 3.2e8, 12.0  # bytes that a process takes, and more for each pixel it draws


def make(arguments, path):
    """Writes the film that `mill render` was asked for to `path`."""
    encode.program()  # before anything is drawn
    with Run(arguments.run) as run:
        again = not arguments.no_rerun and rerun.why_not(run) is None
        if arguments.beside:
            _beside(arguments, path, run, again)
        else:
            plan = times.film(run, arguments, again)
            look = prepare.look(arguments, run)
            _write(arguments, path, run, plan, look, look.size, None)


def _beside(arguments, path, run, again):
    from milltools.render import scene

    camera = beside.open_film(arguments.beside, arguments.crop)
    offset = times.seconds(arguments.offset, "--offset", least=-1e9) if arguments.offset else 0.0
    camera_fps = arguments.camera_fps or camera.rate
    plan, first = times.camera(run, offset, camera_fps, camera.rate, camera.pictures, again)
    if arguments.end:
        end = times.seconds(arguments.end, "--to")
        plan = times.until(plan, end)
    named = (arguments.size or prepare.DEFAULT).lower() in scene.SIZES
    width, height = scene.size_of(arguments.size or prepare.DEFAULT)
    if named:
        width = camera.width(height)  # both see as much
    look = prepare.look(arguments, run, (width, height))
    whole = beside.size(look.size, camera)
    joined = zip_with(beside.Joiner(height), beside.pictures(camera, height, first))
    _write(arguments, path, run, plan, look, whole, joined)


def zip_with(joiner, others):
    """A function that joins each of an iterable of pictures with the next of `others`; it ends when either does."""

    def join(pictures):
        try:
            for mine, its in zip(pictures, others):
                yield joiner.join(mine, its)
        finally:
            others.close()

    return join


def painters(look) -> int:
    """How many draw at once, if nobody says: one a core, fewer where memory would not do."""
    pixels = look.size[0] * look.size[1] * (4 if look.quality == "final" else 1)
    each = 0 if look.pov else PROCESS + PIXEL * pixels
    room = psutil.virtual_memory().available * 0.7
    cores = processes.cores()
    return max(1, min(cores, int(room / each) if each else cores))


def _write(arguments, path, run, plan, look, size, change):
    """Draws the pictures of a plan, changes them (a function of the iterable), writes them."""
    if any(pixels % 2 for pixels in size):
        raise UserError(f"--size: films have even sizes, got {size[0]}x{size[1]}")
    count = len(plan.times)
    say(f"{count} pictures at {plan.fps:g} a second, {times.words(plan.slow)}")
    workers = min(arguments.workers or painters(look), count)
    quiet = arguments.quiet
    with motion.of(run, plan, arguments.colour == "impact", not arguments.no_rerun, say, prepare.told(arguments)) as moving:  # fmt: skip
        tasks = zip(itertools.count(), moving.states(plan.times))
        tasks = ((number / count, state) for number, state in tasks)
        pictures = team.draw([look] * workers, tasks)
        drawn = 0
        with encode.Encoder(path, size, plan.fps) as encoder, Watch(count, quiet) as watch:
            try:
                for picture in change(pictures) if change else pictures:
                    encoder.write(picture)
                    watch.step()
                    drawn += 1
            finally:
                pictures.close()
            if not drawn:
                raise UserError(f"{path}: there is no picture to show")
        prepare.tell_guessed(moving)
        written(path, f"{drawn} pictures, {drawn / plan.fps:.3g} s")
