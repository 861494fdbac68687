"""How far a study is: a bar on a terminal, a line now and then elsewhere."""

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

PLAIN = 10.0  # [s] between lines where there is no terminal


def duration(seconds) -> str:
    """In words that are short: 42 s, 12 min, 3.5 h."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


class Watch:
    """A context manager; row() is told each row, tick() that time goes on."""

    def __init__(self, command, planned, kept, objective, quiet=False):
        """`planned` runs (None: not known) of which `kept` rows are there; the best of `objective` is shown."""
        self.command, self.planned, self.objective, self.quiet = command, planned, objective, quiet
        self.count = {"done": 0, "capped": 0, "failed": 0}
        self.kept, self.new, self.best = len(kept), 0, None
        for row in kept:
            self._note(row)
        self.begin = self.said = time.monotonic()
        self.bar = self.task = None
        console = Console(stderr=True)
        if not quiet and console.is_terminal:
            columns = (BarColumn(bar_width=24), TextColumn("{task.description}"))
            self.bar = Progress(*columns, console=console, transient=True)
            self.task = self.bar.add_task("", total=planned, completed=self.kept)

    def __enter__(self):
        if self.bar:
            self.bar.start()
        return self

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    def _note(self, row):
        self.count[row["status"]] += 1
        value = row[self.objective.path]
        better = self.best is None or (value - self.best) * self.objective.sign > 0
        if row["status"] == "done" and value == value and better:
            self.best = value

    def row(self, row):
        self.new += 1
        self._note(row)
        self.tick()

    def tick(self):
        now = time.monotonic()
        if self.quiet or now - self.said < (0.2 if self.bar else PLAIN):
            return
        self.said = now
        if self.bar:
            self.bar.update(self.task, completed=self.kept + self.new, description=self.line())
        else:
            print(f"{self.command}: {self.line()}", file=sys.stderr, flush=True)

    def line(self) -> str:
        """12 of 399 runs, 1 failed, best 0.512 m s-1, 4 min left."""
        runs = self.kept + self.new
        words = [f"{runs} of {self.planned} runs" if self.planned else f"{runs} runs"]
        words += [f"{self.count[name]} {name}" for name in ("failed", "capped") if self.count[name]]
        if self.best is not None:
            unit = "" if self.objective.unit in ("", "1") else f" {self.objective.unit}"
            words.append(f"best {self.best:.4g}{unit}")
        if self.planned and self.new:
            left = (time.monotonic() - self.begin) / self.new * (self.planned - runs)
            words.append(f"{duration(left)} left")
        return ", ".join(words)
