"""`mill watch`: a page that shows a run while it goes on, and how long it still takes.

follow.py reads the file of the run, left.py estimates the time left, messages.py says what the page is told, server.py
serves it; source.js is the part of the page that asks. launch.py starts a run.
"""

import contextlib
import os
import pathlib
import sys
import tempfile
import time
import webbrowser

from milltools.base import engine
from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.processes import stops_in_order
from milltools.base.progress import Progress
from milltools.base.text import plain
from milltools.read.deck import Deck
from milltools.watch import page
from milltools.watch.follow import Follower
from milltools.watch.launch import Child
from milltools.watch.server import Server

SUMMARY = """Shows a run while it goes on, in the browser: the moving balls, the results so far, the time left. Give the
output file of a run that somebody has started, or a deck, which is then run. Only this computer can open the page."""

CHECKPOINT = 2.0  # [s] longest interval of checkpoints of a run that this command starts
OUTPUTS = (".h5", ".hdf5", ".vtkhdf")
BEGINS = b"\x89HDF\r\n\x1a\n"
OFTEN = 0.25  # [s] between two looks at the run
LINGER = 5.0  # [s] for the page to learn that the run has ended
COMMAND = "mill watch"


def add_arguments(parser):
    add = parser.add_argument
    add("what", metavar="DECK|RUN", help="deck to run, or output file of a run, which need not exist yet")
    add(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="override one value of the deck; may be repeated",
    )  # fmt: skip
    add("-o", "--output", metavar="FILE", help="output file of the deck's run; default: as for millsim")
    add("-f", "--force", action="store_true", help="overwrite an existing output file of the deck's run")
    add("--port", type=int, default=0, help="port of the page; default: a free one")
    add("--no-browser", action="store_true", help="do not open a browser, only print the address")
    add("--until-done", action="store_true", help="end when the run has ended; default: Ctrl-C ends the page")


def is_run(path) -> bool:
    """Whether a path names the output file of a run, not a deck."""
    try:
        with open(path, "rb") as file:
            return file.read(len(BEGINS)) == BEGINS
    except OSError:
        return pathlib.Path(path).suffix in OUTPUTS


def run(arguments) -> Answer:
    watched = is_run(arguments.what)
    if watched and (arguments.set or arguments.output or arguments.force):
        raise UserError(f"{arguments.what}: is the output file of a run; -s, -o and -f are for decks")
    with stops_in_order():
        return _watch(arguments, Follower(arguments.what)) if watched else _run_deck(arguments)


def _run_deck(arguments):
    deck = Deck.check(arguments.what, arguments.set)
    output = arguments.output or f"{pathlib.Path(arguments.what).stem}.h5"
    if os.path.exists(output) and not arguments.force:
        raise UserError(
            f"{output}: exists already; --force overwrites it, -o gives another name, and "
            f"this shows it: {engine.command_line('watch', pathlib.Path(output))}"
        )
    changes = list(arguments.set)
    if deck.number("output.checkpoint", CHECKPOINT) > CHECKPOINT and not any(_sets(one) for one in changes):
        changes.append(f"output.checkpoint={CHECKPOINT:g} s")
    own = [word for one in changes for word in ("--set", one)]
    before = Follower.identify(output)
    child = Child([*own, "--output", output, *["--force"] * arguments.force, "--", arguments.what])
    try:
        return _watch(arguments, Follower(output, before, child))
    except KeyboardInterrupt as stop:
        child.end()
        again = engine.command_line("--resume", *own, "-o", output, "--", arguments.what, program=engine.MILLSIM)
        raise KeyboardInterrupt(f"the run is stopped; this goes on with it: {again}") from stop
    finally:
        child.end()


@contextlib.contextmanager
def _browser(address, wanted):
    """Opens the page in the browser, if this session has windows. Other users see the command lines of processes, so
    the browser gets a file that only this user can read, and not the address with its token."""
    windows = any(os.environ.get(name) for name in ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY"))
    if not wanted or (sys.platform.startswith("linux") and not windows):
        yield
        return
    with tempfile.TemporaryDirectory(prefix="mill-") as folder:
        file = pathlib.Path(folder, "watch.html")
        file.write_text(f'<meta http-equiv="refresh" content="0; url={address}"><a href="{address}">mill watch</a>')
        webbrowser.open(file.as_uri())
        yield


def _sets(change) -> bool:
    return change.partition("=")[0].strip() == "output.checkpoint"


def _watch(arguments, follower):
    """Serves the page until the run ends, or until Ctrl-C. KeyboardInterrupt if this stops a run."""
    child, said = follower.child, ""
    with (
        Server(follower, page.text, arguments.port) as server,
        _browser(server.address, not arguments.no_browser),
        Progress(COMMAND, 1.0) as bar,
    ):
        bar.uneven = True  # the text says what is known of the time left
        print(server.address, flush=True)
        try:
            while True:
                state, progress = follower.tell()
                if child and not child.alive and follower.now is None:
                    break  # wrong from the start; millsim has said why
                if state != said and (follower.ended or (state == "missing" and not child)):
                    bar.say(_line(follower, progress))
                said = state
                if follower.ended and arguments.until_done:
                    server.linger(LINGER)
                    break
                if not follower.ended:
                    bar(progress["done"], progress["note"])
                time.sleep(OFTEN)
        except KeyboardInterrupt:
            if child and child.alive:
                raise
    now = follower.now
    facts = {"files": [], "run": follower.path, "state": follower.state, "time": now.time if now else 0.0}
    return Answer(lambda: None, facts, _status(follower))


def _line(follower, progress) -> str:
    """What is said when the run begins or ends."""
    if lines := follower.failure():
        return "; ".join(lines)
    return progress["note"] if follower.state == "missing" else f"{plain(follower.path)}: {progress['note']}"


def _status(follower) -> int:
    """The exit status of millsim if this command started it; else 1 for a run that has failed."""
    status = follower.child.status if follower.child else 0
    if status:
        return status if status > 0 else 128 - status
    return 1 if follower.failure() else 0
