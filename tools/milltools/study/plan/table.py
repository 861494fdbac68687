"""The table of a study: one row per run, in `NAME.parquet`; `NAME.parquet.journal` is next to it while it grows.

    table = Table.open("figure7.parquet")             # reading, also while a study runs
    table.frame()                                      # pandas.DataFrame, each run once
    with Writer.begin("figure7.parquet", study.about(planned)) as table:     # the driver, and only one
        table.add(row)

Each row is appended to the journal as one JSON line and synced before `add` returns. From time to time, and at the
end, the Parquet file is rewritten and renamed into place; at the end the journal is removed. So no added row is lost,
whichever process is killed, and the Parquet file can be opened at any moment. Opening reads both files; a run that is
in both (same `id`) counts once, and the later row is used. Lines, pages, all rows and the metadata have checksums. A
damaged line is left out and counted in `damaged`; a damaged Parquet file is a UserError. Files of earlier versions
have no checksums: they are checked for the columns, names and types of their study, and get checksums at the next
writing.
"""

import contextlib
import errno
import fcntl
import json
import math
import os
import pathlib
import time

import pandas
import pyarrow
import pyarrow.parquet

from milltools.base.errors import UserError
from milltools.base.files import faults, opened, whole
from milltools.base.text import plural
from milltools.study.plan import sealed

METADATA = b"millsim"
FOLD = 5.0  # [s] smallest time between rewritings of the Parquet file
SHARE = 50  # and at least this multiple of the time of the last rewriting
TEXT, REAL, WHOLE = pyarrow.string(), pyarrow.float64(), pyarrow.int64()
TYPES = {"number": REAL, "whole": WHOLE}
BEFORE = {"design": WHOLE, "replicate": WHOLE, "seed": WHOLE, "id": TEXT}
RESULTS = "results"  # read/results.py; tables of earlier versions do not have them
BEHIND = {
    RESULTS: TEXT, "status": TEXT, "message": TEXT, "time": REAL, "sample_from": REAL, "collisions": WHOLE,
    "cpu": REAL, "wall": REAL, "version": TEXT, "worker": TEXT, "finished": TEXT,
}  # fmt: skip
COLUMNS = (*BEFORE, *BEHIND)
MOST_ROWS = 10_000_000  # of a table to be read
MOST_PACKED = 1000  # largest factor by which pages may grow when unpacked


def schema(meta) -> pyarrow.Schema:
    """The columns of a table, from its metadata."""
    fields = dict(BEFORE)
    for vary in meta["vary"]:
        fields[vary["key"]] = TYPES.get(vary["kind"], TEXT)
    for derived in meta.get("derived", ()):
        fields[derived["key"]] = REAL
    for path in paths(meta):
        fields[path] = fields[f"{path}:error"] = REAL
    fields.update(BEHIND)
    text = json.dumps(meta, ensure_ascii=False).encode()
    return pyarrow.schema(list(fields.items()), metadata={METADATA: text})


def paths(meta) -> list[str]:
    """Objectives and recorded scalars, in the order of the columns."""
    return [*(objective["path"] for objective in meta["objectives"]), *meta["record"]]


def _keys(meta) -> list[dict]:
    """The keys with a column, varied and derived."""
    return [*meta["vary"], *meta.get("derived", ())]


def journal_of(path) -> pathlib.Path:
    return pathlib.Path(f"{path}.journal")


class Table:
    """The rows of a study and its metadata (a dict: file-format in docs/studies.md). `damaged`: lines of the journal
    that were left out."""

    def __init__(self, path, meta, stored, damaged=0):
        self.path, self.meta, self.damaged = pathlib.Path(path), meta, damaged
        self._stored, self._fresh = stored, []  # a pyarrow.Table; one table for each later row
        self._frame = None

    @classmethod
    def open(cls, path) -> "Table":
        """Reads a table without changing it, so a study may run at the same time."""
        return cls(path, *_read(path))

    @property
    def complete(self) -> bool:
        """All planned runs are there, and no driver is working on the table."""
        planned = self.meta["planned"]
        return planned is not None and not journal_of(self.path).exists() and len(self.frame()) >= planned

    @property
    def left_out(self) -> str:
        """What is damaged, in words."""
        return f"{journal_of(self.path)}: {plural(self.damaged, 'damaged line')} left out"

    def frame(self) -> pandas.DataFrame:
        """Each run once, by design and replicate."""
        if self._frame is None:
            self._frame = self._arrow().to_pandas(use_threads=False)
        return self._frame

    def rows(self) -> list[dict]:
        """The rows of frame() as dicts."""
        return self.frame().to_dict("records")

    def __len__(self):
        return len(self.frame())

    def _arrow(self):
        """Both parts, each run once (the later of two), by design and replicate."""
        kind = schema(self.meta)
        stored = pyarrow.concat_tables([self._stored, *self._fresh]).select(kind.names).combine_chunks()
        last = {name: place for place, name in enumerate(stored["id"].to_pylist())}
        stored = stored if len(last) == len(stored) else stored.take(sorted(last.values()))
        return stored.sort_by([("design", "ascending"), ("replicate", "ascending")])


class Writer(Table):
    """A table that is being filled; a context manager that keeps the lock."""

    plan: set | None = None  # ids of the requested runs; None: all runs in the table
    elsewhere = 0  # runs that other drivers of the same search have not finished yet

    @classmethod
    @contextlib.contextmanager
    def begin(cls, path, meta, force=False):
        """Makes the table, or continues a table of the same study (equal `fingerprint`). The table of another study is
        refused, or replaced with `force`. A second driver on the same table is refused."""
        with _locked(path) as journal:
            meta = {**meta, "command": sealed.hidden_command(meta.get("command", ""))}
            if force or not pathlib.Path(path).exists():
                table = cls(path, meta, schema(meta).empty_table())
            else:
                old, *rows = _read(path)
                _check_same(path, old, meta)
                table = cls(path, meta, *rows)
            table._journal, table._folded, table._cost = journal, 0.0, 0.0
            table.fold()
            try:
                yield table
            finally:
                table.fold()

    def ids(self, failed=True) -> set[str]:
        """The runs in the table; failed runs only if requested."""
        frame = self.frame()
        return set(frame["id"] if failed else frame["id"][frame["status"] != "failed"])

    def of_plan(self) -> pandas.DataFrame:
        """The rows of the requested runs."""
        frame = self.frame()
        return frame if self.plan is None else frame[frame["id"].isin(self.plan)]

    def number(self, plan: dict):
        """Gives the rows the design numbers of a plan {id: number}; other rows get the numbers after these."""
        self.plan = set(plan)
        frame = self.frame()
        numbers = frame["id"].map(plan)
        outside = frame.loc[numbers.isna(), [vary["key"] for vary in self.meta["vary"]]]
        behind = outside.groupby(list(outside), sort=False).ngroup() + max(plan.values(), default=-1) + 1
        numbers = numbers.fillna(behind).astype("int64")
        if (numbers != frame["design"]).any():
            frame = frame.assign(design=numbers)
            self._stored, self._fresh = pyarrow.Table.from_pandas(frame, schema(self.meta), preserve_index=False), []
            self._frame = None
            self._write()

    def add(self, row: dict):
        """Stores a row: it is on the disk when this returns."""
        clean = sealed.plain(row)
        try:
            made = _made(clean, schema(self.meta))
            line = sealed.seal(clean) + b"\n"
        except ValueError as fault:
            raise UserError(f"{self.path}: a row that cannot belong to this study: {fault}", status=1) from None
        with faults(journal_of(self.path)):
            written = os.write(self._journal, line)
            os.fsync(self._journal)
            if written != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._fresh.append(made)
        self._frame = None
        now = time.monotonic()
        if now - self._folded > max(FOLD, SHARE * self._cost):
            self.fold()

    def fold(self):
        """Moves the rows of the journal into the Parquet file."""
        begin = time.monotonic()
        self._stored, self._fresh = self._arrow(), []
        self._write()
        self._folded = time.monotonic()
        self._cost = self._folded - begin

    def _write(self):
        text = sealed.seal({**self.meta, "content": sealed.content(self._stored)})
        stored = self._stored.replace_schema_metadata({METADATA: text})
        with whole(self.path) as draft, open(draft, "wb") as file:
            pyarrow.parquet.write_table(stored, file, compression="zstd", write_page_checksum=True)
            file.flush()
            os.fsync(file.fileno())
        with faults(journal_of(self.path)):
            os.ftruncate(self._journal, 0)


def _made(values: dict, kind) -> pyarrow.Table:
    """A row as a table of one row; ValueError if it has other columns or values of other types."""
    values = {RESULTS: "", **values}
    if values.keys() != set(kind.names):
        odd = sorted(values.keys() ^ set(kind.names))
        raise ValueError(f"its columns differ, such as {odd[0][:80]}")
    for name, value in values.items():
        if kind.field(name).type == WHOLE and type(value) is not int:
            raise ValueError(f"{name} is not a whole number")
    # unknown numbers are NaN
    unknown = {name: math.nan for name in kind.names if values[name] is None and kind.field(name).type == REAL}
    try:
        return pyarrow.Table.from_pylist([values | unknown], kind)
    except (pyarrow.ArrowException, OverflowError, TypeError, ValueError) as fault:
        raise ValueError(str(fault)) from None


def _read(path):
    """(metadata, rows of the Parquet file and then of the journal, number of damaged lines in the journal)"""
    # the journal first: rows that move into the file meanwhile are then read twice instead of not at all
    lines = _lines(journal_of(path))
    stored = _read_parquet(path)
    text = (stored.schema.metadata or {}).get(METADATA)
    if text is None:
        raise UserError(f"{path}: a Parquet file, but not the table of a study")
    try:
        meta, stored = _believed(text, stored)
    except ValueError as fault:
        raise UserError(f"{path}: damaged: {fault}; use a backup copy, or run the study with --force") from None
    kind, fresh, damaged = schema(meta), [], 0
    for place, line in enumerate(lines, 1):
        try:
            made = _made(sealed.unseal(line)[0], kind)
            if sealed.wrong_rows(made, _keys(meta))[0]:
                raise ValueError("not a run of this study")
            fresh.append(made)
        except ValueError:
            damaged += place < len(lines)  # the last one was torn when its writer was killed
    return meta, pyarrow.concat_tables([stored, *fresh]), damaged


def _lines(path) -> list[bytes]:
    """The lines of a journal; text after the last line end counts as the last line."""
    with faults(path), contextlib.suppress(FileNotFoundError), opened(path, "the journal of a study") as file:
        *whole_lines, rest = file.read().split(b"\n")
        return [*filter(None, whole_lines), rest]
    return []


def _read_parquet(path) -> pyarrow.Table:
    try:
        with opened(path, "the table of a study") as file:
            # a table is small, and pyarrow's threads may abort a program that ends while they start
            source = pyarrow.parquet.ParquetFile(file, page_checksum_verification=True, pre_buffer=False)
            about = source.metadata
            groups = [about.row_group(number).total_byte_size for number in range(about.num_row_groups)]
            if about.num_rows > MOST_ROWS or sum(groups) > MOST_PACKED * (os.fstat(file.fileno()).st_size + 10**6):
                raise UserError(f"{path}: not the table of a study: it claims to have {about.num_rows} rows")
            stored = source.read(use_threads=False)
            stored.validate(full=True)
            return stored
    except UserError:
        raise
    except (pyarrow.ArrowException, OSError, ValueError, KeyError, TypeError, OverflowError, MemoryError) as fault:
        raise UserError(f"{path}: not a readable Parquet file: {fault}") from None


def _believed(text, stored):
    """The metadata of a table from their text, and its rows; ValueError if they differ from what was written."""
    meta, has_sum = sealed.unseal(text)
    written = meta.pop("content", None) if has_sum else None
    sealed.check_metadata(meta, known_only=not has_sum)
    meta["command"] = sealed.hidden_command(meta.get("command", ""))
    kind, earlier = schema(meta), RESULTS not in stored.schema.names
    if earlier:
        kind = kind.remove(kind.get_field_index(RESULTS))
    if len(kind) + earlier != len(COLUMNS) + len(_keys(meta)) + 2 * len(paths(meta)):
        raise ValueError("two of its columns have the same name")
    for field in kind:
        places = stored.schema.get_all_field_indices(field.name)
        if len(places) != 1 or stored.schema.field(places[0]).type != field.type:
            raise ValueError(f"it has no column {field.name} of type {field.type}")
    stored = stored.select(kind.names)
    if has_sum and sealed.content(stored) != written:
        raise ValueError("the checksum of its rows does not match")
    if sealed.wrong_rows(stored, _keys(meta)).any():
        raise ValueError("it has rows that cannot belong to a study")
    if earlier:
        stored = stored.append_column(RESULTS, pyarrow.array([""] * len(stored), TEXT)).select(schema(meta).names)
    return meta, stored


def _check_same(path, old, new):
    """UserError if two studies differ, with the first difference if the table contains it."""
    if old.get("fingerprint") == new["fingerprint"]:
        return
    there, here = old.get("common", {}), new.get("common", {})
    names = [name for name in there | here if there.get(name) != here.get(name)] if there and here else []
    said = ""
    if names:
        first, second = (about.get(names[0], "not given") for about in (there, here))
        more = f", and {len(names) - 1} more differ" if len(names) > 1 else ""
        said = f": {names[0]} is {first} in the table and {second} in the study deck{more}"
    raise UserError(f"{path}: contains the runs of another study{said}; -o sets another name, --force replaces it")


@contextlib.contextmanager
def _locked(path):
    """The locked file descriptor of the journal; at the end an empty journal is removed."""
    name = journal_of(path)
    while True:
        with faults(name):
            journal = os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o666)
        try:
            fcntl.flock(journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(journal)
            raise UserError(f"{path}: another mill command is writing to it now", status=1) from None
        except OSError:
            pass  # a file system without locks
        with contextlib.suppress(OSError):
            if os.stat(name).st_ino == os.fstat(journal).st_ino:
                break
        os.close(journal)  # removed by its last owner meanwhile
    try:
        yield journal
    finally:
        if os.fstat(journal).st_size == 0:
            with contextlib.suppress(OSError):
                os.unlink(name)
        os.close(journal)
