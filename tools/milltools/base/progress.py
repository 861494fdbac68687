"""Shows the progress of a command: a bar on a terminal, one line rewritten in place in a notebook, elsewhere a line
every few seconds. Work of less than PATIENCE shows nothing."""

import contextlib
import sys
import time

from milltools.base.text import duration

PATIENCE = 2.0  # [s] before the first output
PLAIN = 10.0  # [s] between lines without a terminal
SHORT = 0.2  # [s] between changes of a bar


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"


def say(command: str, line: str):
    """Prints a lasting line for the user on standard error."""
    print(f"{command}: {line}", file=sys.stderr, flush=True)


class Progress(contextlib.AbstractContextManager):
    """A context manager, called with the amount done of `total` (None: the total is not known).

    `command` ("mill export") begins each line; quiet: no output. `kept`: the amount that an earlier run has done; the
    time left is estimated without it."""

    def __init__(self, command: str, total: float | None = None, quiet: bool = False, kept: float = 0.0):
        self.command, self.total, self.quiet = command, total, quiet
        self.done = self.kept = kept
        self.begin = time.monotonic()
        self.due = self.begin + PATIENCE
        self.bar = None
        self.width = 0  # of the current line in a notebook
        self.known = None  # [s] until the end, if the caller knows it
        self.uneven = False

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        """Removes the bar."""
        if self.bar:
            self.bar.stop()
            self.bar = None
        if self.width:
            self._rewrite("")
            print("\r", end="", flush=True)

    def __call__(self, done: float, text: str = "", left: float | None = None):
        """Shows that `done` of the total is done; `text`: the current work; `left` [s]: the remaining time, if
        known."""
        self.done, self.known = done, left
        now = time.monotonic()
        if self.quiet or now < self.due:
            return
        percent = f"{100 * done / self.total:.0f} %" if self.total else ""
        words, plain = (", ".join(filter(None, said)) for said in ((text, self._left()), (text, percent, self._left())))
        self.due = now + SHORT
        if in_notebook():
            self._rewrite(f"{self.command}: {plain}")
        elif sys.stderr.isatty():
            self.bar = self.bar or self._bar()
            self.bar.update(self.bar.task_ids[0], completed=done, description=words)
        else:
            self.due = now + PLAIN
            say(self.command, plain)

    @contextlib.contextmanager
    def step(self, text: str, share: float = 1.0):
        """A piece of work that is the amount `share` of the total. Steps are uneven, so the time left is not told."""
        self.uneven = True
        self(self.done, text)
        yield
        self(self.done + share, text)

    def each(self, items, text: str = ""):
        """Yields the items; each one is a step."""
        with self:
            for item in items:
                self(self.done, text)
                yield item
                self.done += 1

    def _left(self) -> str:
        """Such as "12 min left"; "" if not known."""
        if self.known is not None:
            return f"{duration(self.known)} left"
        if self.uneven or not self.total or self.done <= self.kept:
            return ""
        spent = time.monotonic() - self.begin
        return f"{duration(max(spent * (self.total - self.done) / (self.done - self.kept), 0))} left"

    def say(self, line: str):
        """Prints a lasting line above the bar."""
        if self.quiet:
            return
        if self.bar:
            self.bar.console.print(f"{self.command}: {line}", markup=False, highlight=False, soft_wrap=True)
        else:
            say(self.command, line)

    def _rewrite(self, line):
        print("\r" + line.ljust(self.width), end="", flush=True)
        self.width = len(line)

    def _bar(self):
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        columns = (BarColumn(bar_width=24), TextColumn("{task.description}", markup=False))
        bar = Progress(*columns, console=Console(stderr=True), transient=True)
        bar.add_task("", total=self.total)
        bar.start()
        return bar
