"""`mill render`: pictures and films of a run in 3D, off-screen.

One way through, in film.py: when (times.py) -> states of the balls then (states.py) -> pictures (film.py, by team.py
in several processes) -> a file (a film by encode.py, beside a camera's by footage.py).
"""

import argparse
import pathlib

from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.base.files import check_writable
from milltools.base.processes import Stopped, stops_in_order
from milltools.base.progress import say

SUMMARY = """Pictures (FILE.png) and films (FILE.mp4, FILE.webm; FILE.webp and FILE.gif for
pages, where they repeat) of a run in 3D; no display is needed. Without --slow a film shows every stored
frame; with it, times between them, exactly: the deck is run again up to there. An old file is replaced."""

STILLS, FILMS = (".png", ".pov"), (".mp4", ".webm", ".webp", ".gif")
FILM_ONLY = ("fps", "slow", "begin", "end", "beside")
BESIDE_ONLY = ("offset", "crop", "camera_fps")
TIMED = ("slow", "fps", "begin")
CAMERAS = ("front", "three-quarter", "end", "orbit")
EYE_ONLY = ("target", "up", "angle")


def add_arguments(parser):
    parser.add_argument("run", metavar="RUN", help="output file of a run")
    parser.add_argument("file", metavar="FILE", help="what to write: FILE.png, .mp4, .webm, .webp, .gif; with --pov FILE.pov too")  # fmt: skip
    add = parser.add_argument_group("when").add_argument
    add("--time", metavar="T", help="of a picture, such as '123 ms' (default: the last stored frame)")  # fmt: skip
    add("--from", dest="begin", metavar="T", help="of a film, its first time (default: 0 s)")
    add("--to", dest="end", metavar="T", help="its last time (default: the end of the run)")
    add("--slow", type=_positive, metavar="N", help="play N times slower than real time")
    add("--fps", type=_positive, metavar="F", help="pictures a second (default: 25)")
    add("--no-rerun", action="store_true",
        help="between stored frames show the balls where their flights say, do not run the deck again")  # fmt: skip
    add = parser.add_argument_group("how it looks").add_argument
    add("--size", default=None, help="720p, 1080p (default), 1440p, 4k or WIDTHxHEIGHT")
    add("--quality", choices=("draft", "final"),
        help="final has smoother edges and shades (default of a picture), draft is twice as fast (default of a film)")  # fmt: skip
    add("--camera", choices=CAMERAS, help="default: front, as in Figure 4 of Reichardt and Wiechert")  # fmt: skip
    add(
        "--ride",
        action=argparse.BooleanOptionalAction,
        help="whether the camera rides on the container, which then does not move in the picture "
        "(default: if the path of the container is more than twice as large as it, and without --eye)",
    )
    add("--eye", metavar="X,Y,Z", help="a camera of your own: its place [m]")
    add("--target", metavar="X,Y,Z", help="what it looks at [m] (default: 0,0,0)")
    add("--up", metavar="X,Y,Z", help="what is upwards in the picture (default: 0,0,1)")
    add("--angle", metavar="DEGREES", help="of its view from the lower to the upper edge")
    add("--colour", "--color", choices=("speed", "spin", "energy", "impact"), default="speed",
        help="of the balls: speed (default), spin, kinetic energy, normal speed of the last impact")  # fmt: skip
    add("--limits", metavar="LOW,HIGH", help="of the colours, in SI units (default: almost all balls are within)")  # fmt: skip
    add("--pov", action="store_true", help="ray-traced by POV-Ray, with shadows and reflections; FILE.pov is its scene only")  # fmt: skip
    add = parser.add_argument_group("beside a camera's film").add_argument
    add("--beside", metavar="VIDEO", help="the camera's film, on the right")
    add("--offset", metavar="T", help="the run's time at its first picture, such as '120 ms' or '-5 ms' (default: 0 s)")  # fmt: skip
    add("--camera-fps", type=_positive, metavar="F", help="pictures a second it took (default: what its file plays at)")  # fmt: skip
    add("--crop", metavar="WxH+X+Y", help="the part of its pictures to show [pixels]")
    add = parser.add_argument_group("running").add_argument
    add("--workers", type=_whole, metavar="N", help="processes that draw (default: one a core)")
    add("-q", "--quiet", action="store_true", help="no progress")


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


def run(arguments) -> int:
    suffix, path = _suffix(arguments), pathlib.Path(arguments.file)
    check_writable(path, [other for other in (arguments.run, arguments.beside) if other])
    needs("render")
    try:
        with stops_in_order():
            from milltools.render import film

            (film.still if suffix in STILLS else film.film)(arguments, path)
    except Stopped as stop:
        say("mill render", "stopped")
        return 128 + stop.number
    return 0


def _suffix(arguments):
    """The file's, after all that does not go together is refused."""
    suffix = pathlib.Path(arguments.file).suffix.lower()
    known = (*STILLS, *FILMS) if arguments.pov else (STILLS[0], *FILMS)
    if suffix not in known:
        mend = "; --pov writes scenes" if suffix == ".pov" else ""
        raise UserError(f"{arguments.file}: expected a name ending in {', '.join(known)}{mend}")
    beside, eye = arguments.beside is not None, arguments.eye is not None
    for words, allowed, why in (
        (FILM_ONLY, suffix in FILMS, f"only for {' and '.join(FILMS)}"),
        (("time",), suffix in STILLS, f"only for {' and '.join(STILLS)}"),
        (BESIDE_ONLY, beside, "only with --beside"),
        (EYE_ONLY, eye, "only with --eye"),
        (TIMED, not beside, "not with --beside: the camera's pictures say when; see --offset, --camera-fps"),
        (("eye",), not arguments.camera, "not with --camera: it is a camera of its own"),
    ):
        for word in words:
            if getattr(arguments, word) is not None and not allowed:
                name = {"begin": "from", "end": "to"}.get(word, word.replace("_", "-"))
                raise UserError(f"--{name}: {why}")
    return suffix
