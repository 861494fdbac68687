"""One run of millsim from Python: starts it, shows its progress, ends it after an interrupt."""

import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

from milltools.api import decks
from milltools.api.result import Result
from milltools.base import engine, processes
from milltools.base.errors import InputError, MillsimError
from milltools.base.progress import Progress, in_notebook
from milltools.base.text import number
from milltools.read import deck_text

NAME = "deck.ini"  # of a deck that is not a file
NAME_MOST = 32  # letters in the name of a temporary output: what fits above a figure
PATIENCE = 120.0  # [s] time for an interrupted run to write its results
Path = str | os.PathLike[str]
Deck = Path | decks.Sections


def run(
    deck: Deck, output: Path | None = None, *, force: bool = False, resume: bool = False, progress: bool | None = None,
    **overrides: decks.Value,
) -> Result:  # fmt: skip
    """Runs millsim on a deck and returns the result.

    Values of keys are texts as in a deck, with their units, or numbers if the key is dimensionless. If a text or
    dictionary names a start file, the name is relative to the current folder. Notes of millsim become warnings. A
    wrong deck is an InputError with its line, a missing deck a MissingFileError. After an interrupt (Ctrl-C, the
    notebook's stop button) millsim saves its results: `output` contains them and can be resumed. Then KeyboardInterrupt
    is raised.

    Args:
        deck: path of a deck, the text of one, or a dictionary {"rotor": {"speed": "1500 rpm"}, ...}
        output: the file to write; by default a temporary file that exists as long as the result
        force: overwrite an existing output file; without `force` an existing file is an InputError
        resume: continue an interrupted run of this output file, or start it
        progress: show the progress; by default in a terminal or notebook, when the run takes longer than 2 s
        overrides: keys of the deck, section__key=value: rotor__speed="1500 rpm", contact__restitution=0.7; for names
            that Python does not allow use a dictionary, **{"blade.left-1.pitch": "10 deg"}
    """
    sets, text = [decks.override(name, value) for name, value in overrides.items()], decks.text_of(deck)
    if text is None and not isinstance(deck, str | os.PathLike):
        raise TypeError(f"deck: expected a path, a text or a dictionary, got {type(deck).__name__}")
    if output is not None:
        output = pathlib.Path(output)
        if output.exists() and not (force or resume):
            raise InputError(
                f"{output}: exists already; force=True overwrites it, resume=True continues an interrupted run, "
                "milltools.load opens it"
            )
    folder = pathlib.Path(tempfile.mkdtemp(prefix="mill-"))
    try:
        target = output.absolute() if output else folder / _name(deck, sets)
        if text is None:
            source, place = os.fspath(deck), None  # type: ignore[arg-type] # a dictionary has been converted to a text
        else:
            source, place = NAME, folder  # the folder where it is started
            (folder / NAME).write_text(text, encoding="utf-8")
            sets = list(_placed(sets, text))
        words: list[Path] = [*processes.guard(), engine.program().absolute(), "--json", "--output", target]
        words += [flag for flag, on in (("--force", force), ("--resume", resume)) if on]
        words.append("--progress=json" if shown(progress) else "--quiet")
        for one in sets:
            words += ["--set", one]
        try:
            notes = _execute([*words, "--", source], place, not shown(progress))
        except MillsimError as fault:
            own = MillsimError([_own(deck, line) for line in fault.lines], fault.status)
            raise (own if place else decks.located(own, source)) from None
        for note in notes:
            warnings.warn(_own(deck, note), stacklevel=2)
        return Result(output) if output else Result(target, folder)
    except BaseException as fault:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(fault, KeyboardInterrupt) and output and target.exists():
            fault.add_note(f"{output} contains everything up to then; resume=True continues")
        raise
    finally:
        if output:
            shutil.rmtree(folder, ignore_errors=True)


def shown(progress: bool | None) -> bool:
    """Should progress be shown? By default in terminals and notebooks."""
    return sys.stderr.isatty() or in_notebook() if progress is None else bool(progress)


def _name(deck: Deck, sets: list[str]) -> str:
    """The name of a temporary output: a short description of the run, for figures and summaries."""
    words = [one.partition(".")[2] for one in sets]
    if isinstance(deck, str | os.PathLike) and os.path.exists(deck):
        words.insert(0, pathlib.Path(deck).stem)
    name = ", ".join(words or ["deck"]).replace("/", " per ")
    return (name if len(name) <= NAME_MOST else name[: NAME_MOST - 3] + "...") + ".h5"


def _placed(sets: list[str], text: str) -> Iterator[str]:
    """Overrides of a deck that is not a file: the name of its start file is relative to the current folder."""
    start = ""
    with contextlib.suppress(MillsimError):  # millsim gives a better message about a wrong text
        start = deck_text.sections(text, "deck").get("balls", {}).get("start", "")
    if start not in ("", "random") and not any(one.startswith(f"{decks.START}=") for one in sets):
        sets = [*sets, f"{decks.START}={start}"]
    for one in sets:
        key, _, value = one.partition("=")
        file = key == decks.START and value != "random"
        yield f"{key}={os.path.abspath(value)}" if file else one


def _own(deck: Deck, line: str) -> str:
    """A message of millsim about a file that we wrote: lines are those of the user's text, a dictionary has none."""
    if decks.text_of(deck) is None:
        return line
    return re.sub(rf"^{re.escape(NAME)}(:\d+)?:", "deck:" if isinstance(deck, Mapping) else r"deck\1:", line)


# ---- the process


def _execute(words: list[Path], place: pathlib.Path | None, quiet: bool) -> list[str]:
    """Runs it; returns its warnings and the notes of its summary."""
    said: list[str] = []
    with tempfile.TemporaryFile("w+", encoding="utf-8") as summary, Progress("millsim", 1.0, quiet) as progress:
        try:
            process = subprocess.Popen(
                [os.fspath(word) for word in words],
                cwd=place,
                stdin=subprocess.DEVNULL,
                stdout=summary,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,  # we pass on an interrupt
            )
        except OSError as fault:
            raise MillsimError(f"{words[0]}: {fault.strerror}", status=1) from None
        with process:
            try:
                for line in process.stderr or ():
                    if line.startswith("{"):
                        _show(progress, json.loads(line))
                    elif line.startswith("millsim: "):
                        said.append(line.removeprefix("millsim: ").rstrip())
                process.wait()
            except BaseException:
                _end(process)
                raise
        status = process.returncode
        if status != 0:
            ended = status < 0 or status > 128
            how = f"millsim was ended by signal {abs(status) % 128}" if ended else f"millsim ended with status {status}"
            raise MillsimError(engine.complaints(status, "\n".join(said)) if said else how, 1 if ended else status)
        summary.seek(0)
        text = summary.read()  # empty if the run was complete already
    warned = [one.removeprefix(engine.WARNING) for one in said if one.startswith(engine.WARNING)]
    return warned + (json.loads(text)["notes"] if text else [])


def _show(progress: Progress, now: dict[str, Any]) -> None:
    """Shows the output of millsim --progress=json (docs/running.md)."""
    words = [now["what"]]
    if now["time"] is not None:
        rate = now["contacts_per_second"]
        words = [f"{now['time']:.4g} s of {now['end']:.4g} s", f"{number(rate)} contacts/s" if rate else "", *words]
    progress(now["share"], ", ".join(filter(None, words)), now["left"])


def _end(process: subprocess.Popen[str]) -> None:
    """Ends a run so that it saves its results, or at once after a second interrupt or a long wait."""
    try:
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=PATIENCE)
    finally:
        process.kill()  # no effect if it has ended
        process.communicate()
