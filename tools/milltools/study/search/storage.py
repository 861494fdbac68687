"""The storage of a search: Optuna's journal file, SQLite or PostgreSQL.

    storage, place = open_storage(None, "figure7-optimize.parquet")     # figure7-optimize.optuna.journal
    storage, place = open_storage("postgresql://user@host/name", ...)

The kernel locks the journal file, so a killed driver leaves no lock. An incomplete last line is removed before
anything is added. Several drivers may share one storage (`search.py`).
"""

import contextlib
import fcntl
import logging
import os
import warnings

import optuna
from optuna.storages.journal import JournalFileBackend, JournalStorage

from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.base.files import faults
from milltools.study.plan.sealed import hidden

SCHEMES = ("sqlite", "postgresql")


class KernelLock:
    """flock on the journal itself, which ends with the process that holds it (a BaseJournalFileLock of Optuna)."""

    def __init__(self, path):
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)

    def acquire(self) -> bool:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(self._file, fcntl.LOCK_EX)
        return True

    def release(self) -> None:
        with contextlib.suppress(OSError):
            fcntl.flock(self._file, fcntl.LOCK_UN)


def open_storage(asked: str | None, output):
    """The storage that --storage asks for (a file, sqlite:///..., postgresql://...; None: beside the output), and its
    name for messages, without a password. A UserError says what is wrong with it."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    logging.getLogger("alembic").setLevel(logging.ERROR)
    warnings.filterwarnings("ignore", category=optuna.exceptions.ExperimentalWarning)
    if asked is None:
        asked = str(output).removesuffix(".parquet") + ".optuna.journal"
    scheme, colon, _ = asked.partition("://")
    if not colon:
        return _journal(asked), asked
    scheme = scheme.partition("+")[0]
    if scheme not in SCHEMES:
        raise UserError(f"--storage: expected a file, sqlite:///FILE or postgresql://..., got '{scheme}://'")
    return _database(asked, scheme)


def _journal(path):
    try:
        with faults(path):
            lock = KernelLock(path)
            lock.acquire()
            try:
                with open(path, "rb+") as file:  # text after the last line end is incomplete
                    file.truncate(file.read().rfind(b"\n") + 1)
            finally:
                lock.release()
            return JournalStorage(JournalFileBackend(str(path), lock_obj=lock))
    except ValueError:  # no JSON
        raise UserError(f"{path}: not a journal of Optuna") from None


def _database(url, scheme):
    import sqlalchemy

    try:
        place = sqlalchemy.engine.make_url(url)
        if place.drivername == "postgresql":
            needs("cluster", "psycopg")
            place = place.set(drivername="postgresql+psycopg")
        shown = hidden(place.render_as_string().replace("+psycopg", ""))
        # a broken network connection is detected before use
        storage = optuna.storages.RDBStorage(
            place.render_as_string(hide_password=False), engine_kwargs={"pool_pre_ping": True}
        )
    except (sqlalchemy.exc.SQLAlchemyError, optuna.exceptions.StorageInternalError, ValueError) as fault:
        cause = fault
        while cause.__cause__ is not None:
            cause = cause.__cause__
        text = (str(cause).strip().splitlines() or [type(cause).__name__])[0]
        raise UserError(f"--storage: {scheme}: {hidden(text)}", status=1) from None
    return storage, shown
