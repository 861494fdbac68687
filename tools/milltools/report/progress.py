"""How far a report is: a bar on a terminal, a line elsewhere; nothing of one that is written in a moment."""

import contextlib
import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

PATIENCE = 2.0  # [s] before anything is said
PLAIN = 10.0  # [s] between lines where there is no terminal


class Watch:
    """A context manager; the work is a number of steps, each with the share of the whole that it takes."""

    def __init__(self, total: float):
        self.total, self.done = total, 0.0
        self.begin = self.said = time.monotonic()
        self.bar = self.task = None
        self.console = Console(stderr=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    @contextlib.contextmanager
    def step(self, what: str, share: float = 1.0):
        self.tell(what)
        yield
        self.done = min(self.total, self.done + share)
        self.tell(what)

    def say(self, line: str):
        """A line that stays."""
        self.console.print(f"mill report: {line}", markup=False, highlight=False, soft_wrap=True)

    def tell(self, what: str):
        """What is being done now, or how far that is."""
        now = time.monotonic()
        if now - self.begin < PATIENCE:
            return
        if not self.console.is_terminal:
            if now - self.said > PLAIN:
                self.said = now
                left = ""
                if self.done:
                    rest = (now - self.begin) * (self.total / self.done - 1)
                    left = f", {100 * self.done / self.total:.0f} %, {rest:.0f} s left"
                text = f"mill report: {what}{left}"
                print(text, file=sys.stderr, flush=True)
            return
        if not self.bar:
            self.bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(bar_width=24),
                TimeRemainingColumn(),
                console=self.console,
                transient=True,
            )
            self.task = self.bar.add_task("", total=self.total)
            self.bar.start()
        self.bar.update(self.task, completed=self.done, description=f"mill report: {what}")
