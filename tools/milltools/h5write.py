"""Writing HDF5 files as millsim writes them: labels, texts, columns, and whole files in one step.

Every dataset has `unit` and `description`; columns are chunked, shuffled and deflated (or plain) as src/store/h5_data.c does it.
"""

import contextlib
import os

import h5py
import numpy as np

CHUNK = 65536  # [byte] of rows stored together, about
LARGEST_CHUNK = 262144  # [byte] longer rows are cut
TEXT = h5py.string_dtype("utf-8")
VERSIONS = ("v108", "v110")  # what HDF5 1.10 reads


def _bytes(text):
    return text.encode("utf-8", "surrogateescape")  # command lines may hold any byte


def label(item, unit, description):
    """Gives a dataset its two labels."""
    item.attrs.create("unit", _bytes(unit), dtype=TEXT)
    item.attrs.create("description", _bytes(description), dtype=TEXT)


def put(group, path, values, unit, description, dtype=None, **attributes):
    """A dataset of numbers, or a text, written in one piece; attributes are numbers or texts."""
    if isinstance(values, str):
        item = group.create_dataset(path, data=_bytes(values), dtype=TEXT)
    else:
        item = group.create_dataset(path, data=np.asarray(values, dtype=dtype))
    label(item, unit, description)
    for name, value in attributes.items():
        put_attribute(item, name, value)
    return item


def put_attribute(item, name, value):
    """A number, an array of them, a text or a list of texts."""
    if isinstance(value, str):
        item.attrs.create(name, _bytes(value), dtype=TEXT)
    elif isinstance(value, (list, tuple)) and value and isinstance(value[0], str):
        item.attrs.create(name, [_bytes(text) for text in value], dtype=TEXT, shape=(len(value),))
    else:
        item.attrs.create(name, value)


def make_column(group, path, shape, dtype, unit, description, rows=None, plain=False):
    """An empty dataset that grows by rows of this shape; rows: stored together, instead of about 64 KiB;
    plain: neither shuffled nor deflated."""
    size = np.dtype(dtype).itemsize * int(np.prod(shape))
    chunk, piece = 1, list(shape)
    while 2 * chunk * size <= CHUNK and chunk < CHUNK:
        chunk *= 2
    if chunk == 1 and shape:
        pieces = -(-size // LARGEST_CHUNK)
        piece[0] = -(-shape[0] // max(pieces, 1))
    item = group.create_dataset(
        path,
        shape=(0, *shape),
        maxshape=(None, *shape),
        dtype=dtype,
        chunks=(rows or chunk, *(max(n, 1) for n in piece)),
        shuffle=not plain,
        compression=None if plain else 1,
    )
    label(item, unit, description)
    return item


def append(column, rows):
    """Appends rows (n, ...) to a column."""
    old = column.shape[0]
    column.resize(old + len(rows), axis=0)
    if len(rows):
        column[old:] = rows


def put_column(group, path, rows, dtype, unit, description, **attributes):
    """A column with all its rows."""
    rows = np.asarray(rows, dtype=dtype)
    item = make_column(group, path, rows.shape[1:], dtype, unit, description)
    append(item, rows)
    for name, value in attributes.items():
        put_attribute(item, name, value)
    return item


class Disk:
    """A file for HDF5 to write into, which never fails before its eyes: HDF5 does not survive a full disk, but crashes
    when it closes what it could not write. `check()` raises the first OSError that there was."""

    def __init__(self, path):
        self.file, self.error = open(path, "w+b", buffering=0), None

    def check(self):
        """OSError if anything could not be written or read so far."""
        if self.error:
            raise self.error

    def _try(self, what, *arguments):
        try:
            return what(*arguments)
        except OSError as error:
            self.error = self.error or error

    def write(self, data):
        """All of the bytes, or none: then the error is kept."""
        view = memoryview(data).cast("B")
        done = 0
        while done < len(view):
            count = self._try(self.file.write, view[done:])
            if count is None:
                break
            done += count
        return len(view)

    def readinto(self, buffer):
        """The bytes, zeros where there are none."""
        view = memoryview(buffer).cast("B")
        done = 0
        while done < len(view):
            count = self._try(self.file.readinto, view[done:])
            if not count:
                view[done:] = bytes(len(view) - done)
                break
            done += count
        return len(view)

    def read(self, size):
        """As many bytes, zeros where there are none."""
        whole = bytearray(size)
        self.readinto(whole)
        return bytes(whole)

    def seek(self, place, whence=0):
        """Place from the beginning."""
        return self.file.seek(place, whence)

    def tell(self):
        """Place from the beginning."""
        return self.file.tell()

    def truncate(self, size=None):
        """Makes the file that long."""
        self._try(self.file.truncate, size)
        return size

    def flush(self):
        """Nothing waits here."""

    def sync(self):
        """Brings all of it to the disk; OSError where that fails, or has failed before."""
        self.check()
        os.fsync(self.file.fileno())

    def close(self):
        """Closes the file."""
        self._try(self.file.close)


@contextlib.contextmanager
def whole_file(path):
    """An h5py.File that becomes `path` in one step, brought to the disk, when the block ends without an exception.

    A link stays a link. OSError, one line, where it cannot be written; then `path` is as it was."""
    target = os.path.realpath(path)
    part = target + ".part"
    try:
        with contextlib.closing(Disk(part)) as disk:
            with h5py.File(disk, "w", libver=VERSIONS) as file:
                yield file
            disk.sync()
        os.replace(part, target)
        folder = os.open(os.path.dirname(target), os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except (OSError, RuntimeError) as error:
        why = getattr(error, "strerror", None) or error
        raise OSError(f"{path}: cannot write: {' '.join(str(why).split())}") from error
    finally:
        with contextlib.suppress(OSError):
            os.unlink(part)
