"""What stills and films share: the look the command line asks for, and what is said about where states come from."""

from milltools.base.errors import UserError
from milltools.geometry.bodies import Mill
from milltools.render.look import Look
from milltools.render.progress import say

DEFAULT = "1080p"


def look(arguments, run, size=None) -> Look:
    """The Look of a run's pictures. UserError for what cannot be shown, before anything is drawn."""
    from milltools.render import camera, colour, pov, scene

    if arguments.pov and not arguments.file.lower().endswith(".pov"):
        pov.program()  # before anything is drawn
    text = _camera(arguments)
    camera.of(text, run)  # wrong ones are said here, not by a worker
    rides = arguments.ride
    if rides is None and not arguments.eye and Mill.of(run).wanders:
        rides = True
        say("the camera rides on the container, whose path is long (--no-ride: it stands still)")
    limits = _numbers(arguments.limits, "limits", 2) if arguments.limits else None
    colours = colour.of(run, arguments.colour, limits)
    size = size or scene.size_of(arguments.size or DEFAULT)
    still = arguments.file.lower().endswith((".png", ".pov"))
    quality = arguments.quality or ("final" if still else "draft")
    return Look(run.path, size, quality, text, colours, pov=arguments.pov, rides=bool(rides))


def _camera(arguments):
    """As camera.of() takes it."""
    if not arguments.eye:
        return arguments.camera or "front"
    counts = {"eye": 3, "target": 3, "up": 3, "angle": 1}
    words = []
    for name, count in counts.items():
        text = getattr(arguments, name)
        if text is not None:
            words.append(f"{name}={','.join(map(repr, _numbers(text, name, count)))}")
    return " ".join(words)


def _numbers(text, name, count):
    try:
        found = [float(word) for word in text.split(",")]
    except ValueError:
        found = []
    if len(found) != count:
        example = {"limits": "0,4", "angle": "30"}.get(name, "0.3,-0.2,0.1")
        raise UserError(f"--{name}: expected {count} number{'s' * (count > 1)} such as {example}, got '{text}'")  # fmt: skip
    return found


def told(arguments):
    """What is done with a line of progress of the deck run again."""
    return None if arguments.quiet else lambda line: say(f"running the deck again: {line}")


def tell_guessed(moving):
    """Says how much of what was shown is not known."""
    if moving.trajectory.asked:
        say(
            f"between stored frames {100 * moving.guessed:.2g} % of the balls' places are not known "
            "(more than one contact in a gap): a smooth curve joins the frames there"
        )
