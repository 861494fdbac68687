"""`mill render`: pictures and films of a run in 3D, off-screen.

The steps, called in film.py: times of the pictures (times.py) -> states of the balls (states.py) -> pictures (film.py,
in several processes by team.py) -> a file (films by encode.py, joined with a camera's film by footage.py).
"""

import argparse
import pathlib

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.base.files import check_writable
from milltools.base.processes import stops_in_order

SUMMARY = """Draws a run in 3D as a picture (FILE.png) or a film (FILE.mp4, FILE.webm; FILE.webp and FILE.gif
repeat in web pages). It needs no display. A film is so slow that the motion can be seen, and lasts about ten seconds
(--slow changes this). For exact states between the stored frames, millsim runs the deck again. An old file is
replaced."""

STILLS, FILMS = (".png", ".pov"), (".mp4", ".webm", ".webp", ".gif")
FILM_ONLY = ("fps", "slow", "begin", "end", "beside")
BESIDE_ONLY = ("offset", "crop", "camera_fps")
TIMED = ("slow", "fps", "begin")
CAMERAS = ("front", "three-quarter", "end", "orbit")
WORN = ("sliding_power", "normal_power", "archard_rate")  # colour.WEAR
EYE_ONLY = ("target", "up", "angle")


def add_arguments(parser):
    # fmt: off
    parser.add_argument("run", metavar="RUN", help="output file of a run")
    parser.add_argument("file", metavar="FILE",
        help="file to write: FILE.png, .mp4, .webm, .webp, .gif; with --pov also FILE.pov")
    add = parser.add_argument_group("times").add_argument
    add("--time", metavar="T", help="time of a picture, such as '123 ms' (default: the last stored frame)")
    add("--from", dest="begin", metavar="T",
        help="first time of a film (default: 0 s; without --slow the last part of the run that fits)")
    add("--to", dest="end", metavar="T", help="last time of a film (default: the end of the run)")
    add("--slow", type=_positive, metavar="N",
        help="play N times slower than real time (default: slow enough to see the motion)")
    add("--fps", type=_positive, metavar="F", help="pictures per second of a film (default: 25)")
    add("--no-rerun", action="store_true",
        help="do not run the deck again; compute the balls between stored frames from their free flights")
    add = parser.add_argument_group("look").add_argument
    add("--size", default=None, help="720p, 1080p (default), 1440p, 4k or WIDTHxHEIGHT")
    add("--quality", choices=("draft", "final"),
        help="'final' has smoother edges and shades (default of pictures), 'draft' is twice as fast (default of films)")
    add("--camera", choices=CAMERAS, help="default: front, as in Figure 4 of Reichardt and Wiechert")
    add("--ride", action=argparse.BooleanOptionalAction,
        help="move the camera with the container, which then does not move in the picture (default without --eye: yes "
        "if the path of the container is more than twice as large as the container)")
    add("--eye", metavar="X,Y,Z", help="position of a free camera [m]")
    add("--target", metavar="X,Y,Z", help="point that the free camera looks at [m] (default: 0,0,0)")
    add("--up", metavar="X,Y,Z", help="direction that is upwards in the picture (default: 0,0,1)")
    add("--angle", metavar="DEGREES", help="view angle from the lower to the upper edge (default: 30)")
    add("--colour", "--color", choices=("speed", "spin", "energy", "impact", *WORN), default="speed",
        help="what colours the balls: speed (default), spin, kinetic energy, normal speed of the last impact; or, "
        "without the balls, the parts: power lost on them by sliding or along the normal, depth of sliding wear")
    add("--limits", metavar="LOW,HIGH|RUN",
        help="range of the colours, in SI units, or the file of another run, for a range that fits both (default: a "
        "range that holds almost all balls)")
    add("--colour-map", "--color-map", choices=("speeds", "turbo"), default="speeds",
        help="colours: 'speeds' (default: lighter is more, in grey too) or 'turbo' (rainbow)")
    add("--flashes", action=argparse.BooleanOptionalAction,
        help="show where balls hit hard, from the log of impacts or by running the deck again (default: in films)")
    add("--pov", action="store_true",
        help="draw with the ray tracer POV-Ray, with shadows and reflections; FILE.pov: write only the scene")
    add = parser.add_argument_group("side by side with a film of a camera").add_argument
    add("--beside", metavar="VIDEO", help="film of a camera, shown on the right")
    add("--offset", metavar="T",
        help="time in the run of the first picture of VIDEO, such as '120 ms' or '-5 ms' (default: 0 s)")
    add("--camera-fps", type=_positive, metavar="F",
        help="pictures per second that the camera took (default: the rate at which VIDEO plays)")
    add("--crop", metavar="WxH+X+Y", help="part of the pictures of VIDEO to show [pixels]")
    add = parser.add_argument_group("running").add_argument
    add("--workers", type=_whole, metavar="N", help="number of processes that draw (default: one per core)")
    add("-q", "--quiet", action="store_true", help="show no progress")
    # fmt: on


def _positive(text):
    value = float(text)
    if not 0 < value < 1e9:
        raise ValueError
    return value


def _whole(text):
    value = int(text)
    if not 1 <= value <= 1024:
        raise ValueError
    return value


_positive.__name__, _whole.__name__ = "positive number", "number of processes"  # argparse's errors name them


def run(arguments) -> Answer:
    suffix, path = _suffix(arguments), pathlib.Path(arguments.file)
    check_writable(path, [other for other in (arguments.run, arguments.beside) if other])
    needs("render")
    with stops_in_order():
        from milltools.render import film

        return (film.still if suffix in STILLS else film.film)(arguments, path)


def _suffix(arguments):
    """The suffix of the file; UserError for options that do not go together."""
    suffix = pathlib.Path(arguments.file).suffix.lower()
    known = (*STILLS, *FILMS) if arguments.pov else (STILLS[0], *FILMS)
    if suffix not in known:
        mend = "; to write a scene, add --pov" if suffix == ".pov" else ""
        raise UserError(f"{arguments.file}: expected a name ending in {', '.join(known)}{mend}")
    if arguments.pov and arguments.colour in WORN:
        raise UserError(f"--colour {arguments.colour}: not with --pov")
    beside, eye = arguments.beside is not None, arguments.eye is not None
    for words, allowed, why in (
        (FILM_ONLY, suffix in FILMS, f"only for {' and '.join(FILMS)}"),
        (("time",), suffix in STILLS, f"only for {' and '.join(STILLS)}"),
        (BESIDE_ONLY, beside, "only with --beside"),
        (EYE_ONLY, eye, "only with --eye"),
        (TIMED, not beside, "not with --beside: the times come from the camera's film (see --offset, --camera-fps)"),
        (("eye",), not arguments.camera, "not with --camera: choose one of the two"),
    ):
        for word in words:
            if getattr(arguments, word) is not None and not allowed:
                name = {"begin": "from", "end": "to"}.get(word, word.replace("_", "-"))
                raise UserError(f"--{name}: {why}")
    return suffix
