"""Writes files completely or not at all. Drafts have random names, so nobody can place a link there in advance."""

import contextlib
import csv
import math
import numbers
import os
import pathlib
import shutil
import stat
import tempfile

from milltools.base.errors import MissingFileError, UserError
from milltools.base.text import cell


def keep_apart(output, sources):
    """UserError if the output file is one of the source files, even under another name."""
    for source in sources:
        if os.path.exists(output) and os.path.exists(source) and os.path.samefile(output, source):
            raise UserError(f"{output}: is the input file {source} itself; give another name")


def check_writable(path, sources=()):
    """UserError if `path` cannot be written or is one of `sources`: to be called before the work begins."""
    if str(path) == "-":
        raise UserError("-: expected the name of a file; ./- is one")
    path = pathlib.Path(path)
    if path.is_dir():
        raise UserError(f"{path}: is a folder")
    if not path.parent.is_dir():
        raise UserError(f"{path}: there is no folder {path.parent}")
    if not os.access(path.parent, os.W_OK):
        raise UserError(f"{path}: cannot write into {path.parent}", status=1)
    _check_ordinary(path)
    keep_apart(path, sources)


def opened(path, what, mode="rb", **options):
    """Opens an ordinary file to read it as `what`. A UserError if there is none, and for other kinds: a pipe could
    block."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except FileNotFoundError:
        raise MissingFileError(f"{path}: no such file") from None
    except OSError as fault:
        raise UserError(f"{path}: cannot be read: {fault.strerror}", status=1) from None
    kind = os.fstat(handle).st_mode
    if not stat.S_ISREG(kind):
        os.close(handle)
        raise UserError(f"{path}: is {'a folder' if stat.S_ISDIR(kind) else 'not an ordinary file'}, not {what}")
    return open(handle, mode, **options)


@contextlib.contextmanager
def whole(path):
    """Yields an empty draft file to write to, and renames it to `path` at the end. After an error or Ctrl-C the draft
    is deleted and an old `path` stays. An error of the file system is a UserError. A link at `path` is replaced, not
    followed."""
    path = pathlib.Path(path)
    with faults(path):
        _check_ordinary(path)
        handle, draft = tempfile.mkstemp(prefix=f".{path.name[:100]}.", suffix=".part", dir=path.parent)
    draft = pathlib.Path(draft)
    try:
        with faults(path):
            mask = os.umask(0o077)
            os.umask(mask)
            os.fchmod(handle, 0o666 & ~mask)
            os.close(handle)
            yield draft
            os.replace(draft, path)
    except BaseException:
        with contextlib.suppress(OSError):
            draft.unlink()
        raise


def write_text(path, text: str):
    """Writes a text as UTF-8, whole or not at all."""
    with whole(path) as draft:
        draft.write_text(text, encoding="utf-8", errors="replace", newline="")


def write_csv(path, head, rows):
    """Writes rows of texts and numbers below the names of the columns: numbers with all their digits; None and NaN
    are empty cells."""
    with whole(path) as draft, open(draft, "w", newline="", encoding="utf-8", errors="replace") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(map(cell, head))
        out.writerows([_cell(value) for value in row] for row in rows)


def _cell(value) -> str:
    if isinstance(value, str):
        return cell(value)
    if isinstance(value, numbers.Integral):
        return str(int(value))
    return "" if value is None or math.isnan(value) else repr(float(value))


@contextlib.contextmanager
def whole_folder(path, own):
    """Like `whole`, for a folder of files. An old folder is replaced if own(name) is true for all files in it; else a
    UserError before anything is written."""
    path = pathlib.Path(path)
    if path.exists() or path.is_symlink():
        folder = path.is_dir() and not path.is_symlink()
        strange = [p.name for p in path.iterdir() if not own(p.name)] if folder else [path.name]
        if strange:
            raise UserError(f"{path}: exists and holds '{min(strange)}', which no export wrote; choose another name")
    with faults(path):
        place = pathlib.Path(tempfile.mkdtemp(prefix=f".{path.name[:100]}.", suffix=".part", dir=path.parent))
    try:
        with faults(path):
            draft, old = place / "new", place / "old"
            draft.mkdir()
            yield draft
            if path.exists():
                os.rename(path, old)
            os.rename(draft, path)
    finally:
        shutil.rmtree(place, ignore_errors=True)


@contextlib.contextmanager
def faults(path):
    """Turns an OSError into a UserError about `path`."""
    try:
        yield
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None


def _check_ordinary(path):
    """A device or a pipe must not be replaced by a file."""
    with contextlib.suppress(FileNotFoundError):
        kind = os.lstat(path).st_mode
        if not (stat.S_ISREG(kind) or stat.S_ISLNK(kind)):
            raise UserError(f"{path}: is not an ordinary file; choose another name")
