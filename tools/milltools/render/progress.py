"""How far a film is: a bar on a terminal, a line now and then elsewhere."""

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from milltools.base.text import duration

FIRST, PLAIN = 2.0, 10.0  # [s] until the first line, and between lines, where there is no terminal


def say(line):
    """A line for the user."""
    print(f"mill render: {line}", file=sys.stderr, flush=True)


def written(path, what):
    """The last line: what has been written."""
    print(f"{path}: {what}, {path.stat().st_size / 1e6:.3g} MB", flush=True)


class Watch:
    """A context manager; step() is told of each picture."""

    def __init__(self, count, quiet=False):
        self.count, self.done, self.quiet = count, 0, quiet
        self.first = None  # when the first picture was there: starting takes time of its own
        self.due = time.monotonic() + FIRST
        self.bar = self.task = None
        console = Console(stderr=True)
        if not quiet and console.is_terminal:
            columns = (BarColumn(bar_width=24), TextColumn("{task.description}"))
            self.bar = Progress(*columns, console=console, transient=True)
            self.task = self.bar.add_task("", total=count)

    def __enter__(self):
        if self.bar:
            self.bar.start()
        return self

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    def step(self):
        """One picture more."""
        self.done += 1
        self.first = self.first or time.monotonic()
        if self.bar:
            self.bar.update(self.task, completed=self.done, description=self.line())
        elif not self.quiet and time.monotonic() >= self.due and 1 < self.done < self.count:
            self.due = time.monotonic() + PLAIN
            say(self.line())

    def line(self) -> str:
        """12 of 200 pictures, 4 min left."""
        words = f"{self.done} of {self.count} pictures"
        if self.done < 2:
            return words
        each = (time.monotonic() - self.first) / (self.done - 1)
        return f"{words}, {duration(each * (self.count - self.done))} left"
