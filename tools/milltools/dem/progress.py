"""How far a run of LIGGGHTS is, and how long it will take."""

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

PLAIN = 10.0  # [s] between lines of progress where there is no terminal


class Watch:
    """Progress on standard error: a bar on a terminal, a line now and then elsewhere, nothing if quiet."""

    def __init__(self, end, work, quiet):
        """end [s] of simulated time; work(time): share of all time steps up to then, 0 to 1."""
        self.end, self.work, self.quiet = end, work, quiet
        self.bar = self.task = None
        self.begin = self.said = time.monotonic()
        console = Console(stderr=True)
        if not quiet and console.is_terminal:
            self.bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                TextColumn("{task.percentage:.1f} %"),
                TimeRemainingColumn(elapsed_when_finished=True),
                console=console,
                transient=True,
            )
            self.task = self.bar.add_task("LIGGGHTS", total=1.0)
            self.bar.start()

    def stop(self):
        """Takes the bar away."""
        if self.bar:
            self.bar.stop()

    def __call__(self, reached):
        """reached [s] of simulated time."""
        now = time.monotonic()
        if self.quiet or now - self.said < (0.2 if self.bar else PLAIN):
            return
        self.said = now
        if self.bar:
            text = f"LIGGGHTS {reached * 1e3:.2f} of {self.end * 1e3:g} ms"
            self.bar.update(self.task, completed=self.work(reached), description=text)
            return
        share = self.work(reached)
        if share == 0:
            return
        left = (now - self.begin) * (1 / share - 1)
        print(
            f"mill dem: {reached * 1e3:.2f} of {self.end * 1e3:g} ms, {100 * share:.1f} %, {left:.0f} s left",
            file=sys.stderr,
            flush=True,
        )
