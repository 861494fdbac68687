"""Figures as they stand in a page, and a second process that draws some while the first is busy with the balls: they take most of
a report's time. Should it die, its figures are drawn by the first, which then meets whatever it died of."""

import contextlib
import dataclasses
import functools
import queue
import threading

from markupsafe import escape

from milltools.base import processes
from milltools.base.errors import UserError
from milltools.base.progress import Progress
from milltools.figures import FIGURES, svg
from milltools.read.runfile import Run
from milltools.render.team import Worker

SHARE = 0.6  # of the figures are the second process's; the balls take the first as long as the rest of them


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure of milltools.figures as SVG that is part of a page; `svg` is empty where it cannot be drawn; then `why` says so."""

    name: str
    title: str
    caption: str
    svg: str
    why: str = ""


def names(group: str) -> list[str]:
    """Of the figures that belong to a group: "spectra", "energy", "maps", "time"."""
    return [name for name, figure in FIGURES.items() if figure.group == group]


def draw(name: str, runs: list[Run]) -> Picture:
    """A figure of open runs together."""
    figure = FIGURES[name]
    for run in runs:
        why = figure.why_not(run)
        if why:
            who = f"{run.path}: " if len(runs) > 1 else ""
            return Picture(name, figure.title, figure.caption, "", f"{who}{why}")
    try:
        drawing, caption = figure.draw(runs, titled=False), figure.says(runs)
    except UserError as fault:
        return Picture(name, figure.title, figure.caption, "", str(fault))
    label = escape(f"{figure.title}: {caption}")
    markup = svg(drawing, f"figure-{name}").replace('role="img"', f'role="img" aria-label="{label}"', 1)
    return Picture(name, figure.title, caption, markup)


@contextlib.contextmanager
def drawing(paths: list[str]):
    """draw() of the runs at paths, which is what the second process is for."""
    with contextlib.ExitStack() as stack:
        runs = [stack.enter_context(Run(path)) for path in paths]
        yield lambda name: draw(name, runs)


class Painter:
    """A context manager. `runs`: open Runs that are drawn together; `names`: all figures, of which some are begun at once."""

    def __init__(self, runs: list[Run], names: list[str]):
        self.runs, self.names, self.taken = runs, names, queue.Queue()
        worth_it = processes.cores() > 1 and any(run.has_statistics and run.duration > 0 for run in runs)
        self.theirs = names[: round(SHARE * len(names))] if worth_it else []
        self.worker = self.thread = None

    def __enter__(self):
        if self.theirs:
            try:
                self.worker = Worker(functools.partial(drawing, [run.path for run in self.runs]))
            except UserError:  # dead already
                self.theirs = []
                return self
            self.thread = threading.Thread(target=self._take)
            self.thread.start()
        return self

    def __exit__(self, *_):
        if self.worker:
            self.worker.kill()
            self.thread.join()
            self.worker.end()

    def _take(self):
        """In a thread, for a socket holds few figures, and the first process reads late: None for what does not come."""
        for name in self.theirs:
            with contextlib.suppress(UserError):
                self.worker.give((name, name))
        for _ in self.theirs:
            try:
                self.taken.put(self.worker.take()[1])
            except (UserError, OSError):
                self.taken.put(None)

    def all(self, watch: Progress) -> dict[str, Picture]:
        """Every figure by its name; `watch` is told of each."""
        found = {}
        for name in sorted(self.names, key=self.theirs.__contains__):  # our own first
            with watch.step("pictures"):
                theirs = self.taken.get() if name in self.theirs else None
                found[name] = theirs or draw(name, self.runs)
        return found
