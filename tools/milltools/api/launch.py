"""One run of millsim from Python: start it, show how far it is, end it when it is interrupted."""

import contextlib
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Mapping

from milltools.api import decks
from milltools.api.result import Result
from milltools.base import engine, processes
from milltools.base.errors import UserError

LONG = 2.0  # [s] a run that is over before shows no progress
PAUSE = 0.5  # [s] between two looks at it
NAME = "deck.ini"  # of a deck that is no file
NAME_MOST = 32  # letters in the name of a temporary output: what fits above a figure
PATIENCE = 120.0  # [s] that an interrupted run has to bring what it has to the disk
WARNING = "warning: "


def run(deck, output=None, *, force=False, resume=False, progress=None, **overrides) -> Result:
    """Runs millsim on a deck and returns the result.

    Values of keys are texts as in a deck, with their units, or numbers where the key is dimensionless. If a text or
    dictionary names a start file, the name counts from the current folder. A remark of millsim is a warning; a wrong
    deck is a UserError with its line. An interrupt (Ctrl-C, the notebook's stop button) ends millsim in an orderly way:
    `output` holds what it has and can be resumed. Then KeyboardInterrupt is raised.

    Args:
        deck: path of a deck, the text of one, or a dictionary {"rotor": {"speed": "1500 rpm"}, ...}
        output: the file to write; by default a temporary one that lives as long as the result
        force: overwrite an output file that exists; without it that is a UserError
        resume: continue an interrupted run of this output file, or start it
        progress: show the progress; by default in a terminal or notebook, when the run takes longer than 2 s
        overrides: keys of the deck, section__key=value: rotor__speed="1500 rpm", contact__restitution=0.7; names that
            Python does not allow go into a dictionary, **{"blade.left-1.pitch": "10 deg"}
    """
    sets = [decks.override(name, value) for name, value in overrides.items()]
    if output is not None:
        output = pathlib.Path(output)
        if output.exists() and not (force or resume):
            raise UserError(
                f"{output}: exists already; force=True overwrites it, resume=True goes on with an interrupted run, "
                "milltools.load opens it"
            )
    folder = pathlib.Path(tempfile.mkdtemp(prefix="mill-"))
    try:
        source, place, start = _source(deck, folder)
        target = output.absolute() if output else folder / _name(deck, sets)
        words = [*processes.guard(), engine.program().absolute(), "--json", "--output", target]
        words += [flag for flag, on in (("--force", force), ("--resume", resume)) if on]
        for one in sets if place is None else _placed(sets, start):
            words += ["--set", one]
        try:
            notes = _execute([*words, "--", source], place, _wanted(progress))
        except UserError as fault:
            raise UserError(_own(deck, str(fault)), fault.status) from None
        for note in notes:
            warnings.warn(_own(deck, note), stacklevel=2)
        return Result(output) if output else Result(target, folder)
    except BaseException as fault:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(fault, KeyboardInterrupt) and output and output.exists():
            fault.add_note(f"{output} holds everything up to then; resume=True goes on")
        raise
    finally:
        if output:
            shutil.rmtree(folder, ignore_errors=True)


def _source(deck, folder: pathlib.Path):
    """(the deck as millsim is to be told, the folder to start it in, the start file it names); the last two are None where
    the deck is a file, as millsim sees to them itself."""
    if isinstance(deck, Mapping):
        text = decks.as_text(deck)
    elif isinstance(deck, str) and ("\n" in deck or deck.lstrip().startswith("[")):
        text = deck
    elif isinstance(deck, str | os.PathLike):
        return os.fspath(deck), None, None
    else:
        raise TypeError(f"deck: expected a path, a text or a dictionary, got {type(deck).__name__}")
    (folder / NAME).write_text(text, encoding="utf-8")
    return NAME, folder, decks.start_of(text)


def _name(deck, sets) -> str:
    """Of a temporary output: what is run, in few words, as figures and summaries call it."""
    words = [one.partition(".")[2] for one in sets]
    if isinstance(deck, str | os.PathLike) and os.path.exists(deck):
        words.insert(0, pathlib.Path(deck).stem)
    name = ", ".join(words or ["deck"]).replace("/", " per ")
    return (name if len(name) <= NAME_MOST else name[: NAME_MOST - 3] + "...") + ".h5"


def _placed(sets, start):
    """Overrides of a deck that is no file: its start file, by whomever named, counts from the current folder."""
    if start and not any(one.startswith(f"{decks.START}=") for one in sets):
        sets = [*sets, f"{decks.START}={start}"]
    for one in sets:
        key, _, value = one.partition("=")
        file = key == decks.START and value != "random"
        yield f"{key}={os.path.abspath(value)}" if file else one


def _own(deck, line: str) -> str:
    """A line of millsim's without the line numbers of a text that we wrote."""
    return re.sub(rf"^{re.escape(NAME)}(:\d+)?:", "deck:", line) if isinstance(deck, Mapping) else line


def _wanted(progress) -> bool:
    return sys.stderr.isatty() or _notebook() if progress is None else bool(progress)


def _notebook() -> bool:
    """Is this the kernel of a notebook?"""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"


# ---- the process


def _execute(words, place, shown) -> list[str]:
    """Runs it; what is to be remarked: its warnings, and the notes of its summary."""
    with tempfile.TemporaryFile("w+", encoding="utf-8") as summary:
        reader, writer = _line(shown)
        with os.fdopen(reader, "rb", buffering=0) as stream:
            try:
                process = subprocess.Popen(
                    [os.fspath(word) for word in words],
                    cwd=place,
                    stdin=subprocess.DEVNULL,
                    stdout=summary,
                    stderr=writer,
                    start_new_session=True,  # an interrupt is ours to hand on
                )
            except OSError as fault:
                raise UserError(f"{words[0]}: {fault.strerror}", status=1) from None
            finally:
                os.close(writer)
            said = _Said(shown)
            try:
                said.listen(stream)
                status = process.wait()
            except BaseException:
                _end(process, stream)
                raise
            finally:
                said.clear()
        _judge(status, said.lines)
        summary.seek(0)
        text = summary.read()  # empty where a run was complete already
    warned = [one.removeprefix(WARNING) for one in said.lines if one.startswith(WARNING)]
    return warned + (json.loads(text)["notes"] if text else [])


def _line(shown):
    """What millsim says comes through it. Progress comes often enough to be looked at on a terminal only, so it gets one, where
    the system has any."""
    if shown:
        with contextlib.suppress(OSError):
            return pty.openpty()
    return os.pipe()


def _end(process, stream):
    """Ends a run in good order, or at once if that is asked for again or takes too long; nothing is left behind."""
    try:
        process.send_signal(signal.SIGINT)
        os.set_blocking(stream.fileno(), False)
        until = time.monotonic() + PATIENCE
        while process.poll() is None and time.monotonic() < until:
            with contextlib.suppress(OSError):
                stream.read(4096)  # so that it never waits for us to listen
            time.sleep(0.02)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def _judge(status: int, lines: list[str]):
    """UserError with millsim's own line if it did not end well."""
    if status == 0:
        return
    said = lines[-1] if lines else f"millsim ended with status {status}"
    if status < 0 or status > 128:
        raise UserError(said if lines else f"millsim was ended by signal {abs(status) % 128}", 1)
    raise UserError(said, status)


class _Said:
    """What millsim says on its standard error: `lines` of messages; the progress line is shown once the run is long."""

    def __init__(self, shown: bool):
        self.shown, self.lines, self.width = shown, [], 0
        self.due = time.monotonic() + LONG
        self.out = sys.stdout if _notebook() else sys.stderr

    def listen(self, stream):
        rest = b""
        while True:
            try:
                some = stream.read(4096)
            except OSError:  # so a terminal tells its end
                some = b""
            *whole, rest = re.split(rb"[\r\n]+", rest + some)
            for line in whole if some else [*whole, rest]:
                self._take(line.decode(errors="replace").rstrip())
            if not some:
                return

    def _take(self, line):
        if line.startswith("millsim: "):
            self.lines.append(line.removeprefix("millsim: "))
        elif line and self.shown and time.monotonic() > self.due:
            self.due = time.monotonic() + PAUSE
            print("\r" + line.ljust(self.width), end="", file=self.out, flush=True)
            self.width = len(line)

    def clear(self):
        if self.width:
            print("\r" + " " * self.width + "\r", end="", file=self.out, flush=True)
            self.width = 0
