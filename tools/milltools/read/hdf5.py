"""Reads HDF5 files from any source safely. Links into other files are refused, nothing larger is read than the file can
hold, and every error of HDF5 or h5py on damaged bytes becomes a UserError, "FILE: damaged: /path: ...".
"""

import contextlib
import errno
import math
import mmap
import os
import re
import zlib

import h5py
import numpy as np

from milltools.base.engine import MILLSIM
from milltools.base.errors import UserError
from milltools.base.files import opened
from milltools.base.text import plain

RATIO = 1032  # the largest possible compression by deflate
ROOM = 1 << 26  # [bytes] limit of one read, or, if that is more,
PACKED = 8  # times the stored bytes
SMALL = 1 << 20  # [bytes] limit of a dataset without stored values
SCANNED = 1 << 28  # [bytes] the heaps of texts in larger files are not checked
HEAP = b"GCOL\1\0\0\0"
HOPS = 16  # limit of soft links in one path
TEXTS = 512  # limit of texts of variable length in one attribute, or, if that is more,
MOST_TEXT = 1 << 32  # [bytes] limit of their number times the size of the file
FILTERS = {getattr(h5py.h5z, f"FILTER_{name}") for name in ("DEFLATE", "SHUFFLE", "FLETCHER32", "SZIP", "LZF")}
# what h5py raises for damaged bytes
FAULTS = (
    ArithmeticError, AttributeError, LookupError, MemoryError, OSError, RuntimeError, TypeError, ValueError, zlib.error
)  # fmt: skip


def _opened(path: str) -> h5py.File:
    """The file; without a lock where the file system has none. Within a process HDF5 opens a file only with a lock or
    only without one, and h5py of the user takes locks."""
    try:
        return h5py.File(path, "r")
    except OSError as fault:
        if not re.search("unable to lock|locking flag values", str(fault)):  # the second: it is open without a lock
            raise
        if fault.errno == errno.EAGAIN:
            raise UserError(f"{path}: another program is writing in it; try again when it has ended") from None
        return h5py.File(path, "r", locking=False)


class Store(contextlib.AbstractContextManager):
    """An open file: a context manager, or use close()."""

    def __init__(self, path):
        self.path = str(path)
        self._found = {}  # path -> what find() returned: an open file does not change
        self._sound = {}  # path -> dataset that has been checked
        try:
            with opened(self.path, "the output file of a run") as file:
                self._size, begin = os.fstat(file.fileno()).st_size, file.read(4096).lstrip()
            self._file = _opened(self.path)
        except UserError:
            raise
        except FAULTS as fault:
            text = begin[:1] in (b"[", b"#", b";") and b"\0" not in begin
            why = f"if it is a deck, '{MILLSIM} DECK' runs it" if text else fault
            raise UserError(f"{self.path}: not a readable HDF5 file: {why}") from None
        try:
            self._check_heaps()
        except UserError:
            self.close()
            raise

    def __exit__(self, *exception):
        self.close()

    def close(self):
        self._file.close()

    @property
    def closed(self) -> bool:
        return not self._file

    def damaged(self, path: str, why) -> UserError:
        """The error for a dataset or group at a path that is not as in output files of runs."""
        return UserError(f"{self.path}: damaged: /{plain(path)}: {plain(why)}")

    @contextlib.contextmanager
    def _reading(self, path: str):
        try:
            yield
        except UserError:
            raise
        except FAULTS as fault:
            raise self.damaged(path, str(fault) or type(fault).__name__) from None

    # ---- links

    def find(self, path: str):
        """The group or dataset at a path; None if there is none. Links into other files are refused."""
        if self.closed:
            raise UserError(f"{self.path}: the file was closed: load it again")
        if path not in self._found:
            group, _, name = path.rpartition("/")
            with self._reading(path):
                self._found[path] = self._follow(name, self.find(group) if group else self._file)
        return self._found[path]

    def _follow(self, name, here):
        """The member of a group, by way of soft links; None if there is none."""
        hops, left = 0, [name]
        while left:
            name = left.pop()
            if name in ("", "."):
                continue
            if not isinstance(here, h5py.Group) or name not in here.id:
                return None
            kind = here.id.links.get_info(name.encode()).type
            if kind == h5py.h5l.TYPE_SOFT:
                if (hops := hops + 1) > HOPS:
                    raise ValueError("its links form a circle")
                target = here.id.links.get_val(name.encode()).decode()
                here = self._file if target.startswith("/") else here
                left += target.split("/")[::-1]
            elif kind == h5py.h5l.TYPE_HARD:
                here = here[name]
            else:
                raise ValueError("a link into another file, which is not followed")
        return here

    def has(self, path: str) -> bool:
        return self.find(path) is not None

    def names(self, path: str) -> list[str]:
        """Names of the members of the group at a path, in alphabetical order; empty if there is no such group."""
        thing = None if self.closed else self.find(path)
        with self._reading(path):
            return sorted(thing) if isinstance(thing, h5py.Group) else []

    def paths(self, group: str) -> list[str]:
        """Paths of all datasets below a group, in order; a group that contains itself is searched once."""
        found, seen, left = [], set(), [(group, self.find(group))]
        with self._reading(group):
            while left:
                path, thing = left.pop()
                if isinstance(thing, h5py.Dataset):
                    found.append(path)
                elif isinstance(thing, h5py.Group) and (place := h5py.h5o.get_info(thing.id).addr) not in seen:
                    seen.add(place)
                    links = ((name, thing.id.links.get_info(name.encode()).type) for name in thing)
                    left += [(f"{path}/{name}", thing[name]) for name, kind in links if kind == h5py.h5l.TYPE_HARD]
        return sorted(found)

    def datasets(self, group: str) -> list[tuple[str, str, str]]:
        """(path, unit, description) of all datasets below a group, in the order of their paths."""
        return [(p, self.attribute(p, "unit", ""), self.attribute(p, "description", "")) for p in self.paths(group)]

    def _check_heaps(self):
        """UserError for a heap of texts with an entry of no size: HDF5 would read such a heap in an endless loop."""
        if not 0 < self._size <= SCANNED:
            return
        with self._reading(""):
            wide = self._file.id.get_create_plist().get_sizes()[1]  # bytes of a length
        with open(self.path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:

            def number(at, length):
                return int.from_bytes(content[at : at + length], "little")

            heap = content.find(HEAP)
            while heap >= 0:
                at = heap + len(HEAP) + wide
                end = min(heap + number(heap + len(HEAP), wide), self._size)
                while at + 8 + wide <= end:
                    length = number(at + 8, wide)
                    step = 8 + wide + (length + 7) // 8 * 8 if number(at, 2) else length
                    if not step:
                        raise self.damaged("", f"an entry without size in the heap of texts at byte {heap}")
                    at += step
                heap = content.find(HEAP, heap + 8)

    # ---- datasets

    def dataset(self, path: str, why: str = "") -> h5py.Dataset:
        """The dataset at a path, checked without reading its values. If it is missing: UserError, with `why`."""
        thing = self._sound.get(path) or self.find(path)
        if not isinstance(thing, h5py.Dataset):
            raise UserError(f"{self.path}: has no /{plain(path)}{': ' + why if why else ''}")
        if path not in self._sound:
            with self._reading(path):
                self._check(thing)
                self._expect(path, thing)
            self._sound[path] = thing
        return thing

    def _expect(self, path, thing):
        """ValueError if the dataset at a path has the wrong type or shape: for derived classes."""

    def _check(self, thing):
        """ValueError if a dataset claims to hold more than this file can hold, or something that runs do not have."""
        text = h5py.check_string_dtype(thing.dtype)
        if not text and thing.dtype.kind not in "iufb":
            raise ValueError(f"values of a type that runs do not use ({thing.dtype})")
        plan = thing.id.get_create_plist()
        if plan.get_layout() == h5py.h5d.VIRTUAL or plan.get_external_count():
            raise ValueError("its values are stored outside the dataset, perhaps in another file, which is not read")
        if text and text.length is None and thing.size != 1:
            raise ValueError(f"expected one text, got {thing.size}")
        if text and text.length is None and (place := thing.id.get_offset()) is not None:
            with open(self.path, "rb") as file:  # HDF5 allocates as many bytes as are written there
                file.seek(place)
                length = int.from_bytes(file.read(4), "little")
            if length > self._size:
                raise ValueError(f"a text of {length} bytes, in a file of {self._size}")
        filters = [plan.get_filter(k)[0] for k in range(plan.get_nfilters())]
        if not FILTERS.issuperset(filters) or len(set(filters)) < len(filters):
            raise ValueError(f"unknown compression (filters {filters}); repack it: 'h5repack -f GZIP=1 FILE NEW'")
        stored, largest = thing.id.get_storage_size(), 0
        size = math.prod(thing.shape) * thing.dtype.itemsize
        if filters and stored:
            stored, largest = self._look_at_chunks(thing)
        if stored > self._size or size > max(RATIO * stored, SMALL):
            raise ValueError(f"{size} bytes by its shape, but the file, of {self._size} bytes, stores {stored}")
        chunk = math.prod(thing.chunks or ()) * thing.dtype.itemsize
        if chunk > max(ROOM, PACKED * largest):
            raise ValueError(f"chunks of {chunk} bytes: too large for what is stored")

    def _look_at_chunks(self, thing):
        """Stored bytes of all chunks and of the largest one. ValueError if a chunk unpacks to more bytes than it
        should: HDF5 unpacks the whole chunk before it checks the size."""
        sizes, suspects = [], []
        whole = math.prod(thing.chunks) * thing.dtype.itemsize

        def note(chunk):
            sizes.append(chunk.size)
            if chunk.size * RATIO > ROOM and chunk.size <= self._size:
                suspects.append(chunk.chunk_offset)

        thing.id.chunk_iter(note)
        for offset in suspects:
            _, packed = thing.id.read_direct_chunk(offset)
            with contextlib.suppress(zlib.error):  # not compressed
                if len(zlib.decompressobj().decompress(packed, 2 * whole + 1)) > 2 * whole:
                    raise ValueError(f"a chunk of {whole} bytes unpacks to more bytes")
        return sum(sizes), max(sizes, default=0)

    def layout(self, path: str) -> tuple[tuple[int, ...], np.dtype]:
        """(shape, type) of the dataset at a path, without reading it. If it is missing: UserError."""
        thing = self.dataset(path)
        return thing.shape, thing.dtype

    def length(self, path: str) -> int:
        """Number of rows of the dataset at a path, without reading it. If it is missing or a scalar: UserError."""
        shape = self.layout(path)[0]
        if not shape:
            raise UserError(f"{self.path}: /{path} is a single value without rows")
        return shape[0]

    def read(self, path: str, index=(), why: str = ""):
        """The values of the dataset at a path, or of its part `index`: numpy arrays, texts as str. If it is missing:
        UserError, with `why`."""
        thing = self.dataset(path, why)
        keys = index if isinstance(index, tuple) else (index,)
        with self._reading(path):
            rows = (
                len(range(*k.indices(n))) if isinstance(k, slice) else n if k is Ellipsis else np.size(k)
                for n, k in zip(thing.shape, keys)
            )
            size = math.prod([*rows, *thing.shape[len(keys) :]]) * thing.dtype.itemsize
            if size > max(ROOM, PACKED * thing.id.get_storage_size()):
                raise ValueError(f"{size} bytes, compressed into {thing.id.get_storage_size()}")
            return thing.asstr()[index] if h5py.check_string_dtype(thing.dtype) else thing[index]

    # ---- attributes

    def attribute(self, path: str, name: str, default=None):
        """An attribute: a number, a str, or an array of them; of the same type as `default`, which is returned if there
        is no attribute."""
        thing = self.find(path)
        with self._reading(path):
            if thing is None or name not in thing.attrs:
                return default
            about = thing.attrs.get_id(name)
            text = h5py.check_string_dtype(about.dtype)
            count = math.prod(about.shape)
            if not text and about.dtype.kind not in "iufb":
                raise ValueError(f"its attribute '{name}' has values of a type that runs do not use ({about.dtype})")
            free = text and text.length is None
            if count * about.dtype.itemsize > self._size or (free and count > TEXTS and count * self._size > MOST_TEXT):
                raise ValueError(f"its attribute '{name}' has {count} values")
            value = thing.attrs[name]
            return _like(default, _decoded(value) if text else value, name)


def _decoded(value):
    if isinstance(value, np.ndarray):
        return np.array([_decoded(v) for v in value.ravel()], object).reshape(value.shape)
    return value.decode() if isinstance(value, bytes) else str(value)


def _like(default, value, name):
    """An attribute in the form of its default: one text, one number, or several of them; else ValueError."""
    if default is None:
        return value
    several = not isinstance(default, str | int | float)
    first = next(iter(default), "") if several else default
    texts = isinstance(first, str)
    if not several and np.size(value) == 1:
        value = np.ravel(value)[0]
    if np.ndim(value) != several or (np.size(value) and isinstance(np.ravel(value)[0], str) != texts):
        wanted = ("number", "text")[texts]
        raise ValueError(
            f"its attribute '{name}': expected {f'{wanted}s' if several else f'one {wanted}'}, got {value!r:.60}"
        )
    return value
