"""Files that are there whole or not at all, and how far their writing is."""

import contextlib
import os
import pathlib
import shutil
import sys
import time

from milltools.base.errors import UserError

PATIENCE = 2.0  # [s] nothing is said of what takes no longer
PLAIN = 10.0  # [s] between lines where there is no terminal


@contextlib.contextmanager
def file(path):
    """The name to write to, which becomes `path` at the end; after a fault, or Ctrl-C, nothing is left behind."""
    path = pathlib.Path(path)
    draft = path.with_name(f"{path.name}.part")
    try:
        with _faults(path):
            yield draft
            os.replace(draft, path)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise


@contextlib.contextmanager
def folder(path, own):
    """The same for a folder of files. An old one is replaced if own(name) is true of all that is in it, else it is
    a UserError before anything is written."""
    path = pathlib.Path(path)
    draft, old = (path.with_name(f"{path.name}.{word}") for word in ("part", "old"))
    if path.exists() or path.is_symlink():
        strange = [] if path.is_dir() else [path.name]
        strange += [p.name for p in path.iterdir() if not own(p.name)] if path.is_dir() else []
        if strange:
            raise UserError(
                f"{path}: is in the way, with '{min(strange)}' that is not of an export; choose another name"
            )
    try:
        with _faults(path):
            for leftover in (draft, old):
                shutil.rmtree(leftover, ignore_errors=True)
            draft.mkdir()
            yield draft
            if path.exists():
                os.rename(path, old)
            os.rename(draft, path)
    finally:
        for leftover in (draft, old):
            shutil.rmtree(leftover, ignore_errors=True)


@contextlib.contextmanager
def _faults(path):
    try:
        yield
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None


def size(count) -> str:
    """6.2 MB"""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 999.5 or unit == "GB":
            return f"{count:.0f} {unit}" if unit == "bytes" else f"{count:.3g} {unit}"
        count /= 1000
    return ""


def words(path, frames, balls) -> str:
    """31 frames of 4000 balls, 6.2 MB"""
    what = f"{frames} frame{'s' if frames > 1 else ''} of {balls} ball{'s' if balls > 1 else ''}"
    return f"{what}, {size(os.path.getsize(path))}"


def steps(items, name):
    """The items, one after the other, while standard error says how far it is: a bar on a terminal, else a line now and
    then; nothing if it is quick."""
    items = list(items)
    watch = Watch(name, len(items))
    try:
        for done, item in enumerate(items):
            watch(done)
            yield item
    finally:
        watch.stop()


class Watch:
    """Told how much of `total` is done; says so on standard error."""

    def __init__(self, name, total):
        self.name, self.total = name, total
        self.begin, self.said, self.bar = time.monotonic(), None, None

    def __call__(self, done):
        now = time.monotonic()
        if now - self.begin < PATIENCE or not done:
            return
        if sys.stderr.isatty():
            if not self.bar:
                self._show()
            self.bar.update(self.task, completed=done)
        elif self.said is None or now - self.said >= PLAIN:
            self.said = now
            left = (now - self.begin) * (self.total / done - 1)
            print(f"mill export: {self.name}: {100 * done / self.total:.0f} %, {left:.0f} s left",
                  file=sys.stderr, flush=True)  # fmt: skip

    def _show(self):
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self.bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:.0f} %"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        self.task = self.bar.add_task(self.name, total=self.total)
        self.bar.start()

    def stop(self):
        if self.bar:
            self.bar.stop()
