"""The folder through which a driver and the tasks of Slurm job arrays talk, on a file system they share.

    TABLE.slurm/token            names the study in Slurm's queue: no other has the same
    TABLE.slurm/00003/           one array; its name in the queue is mill-TABLE-TOKEN-00003
        job                      what sbatch said: the number of the array, empty while it is not known
        12.jobs                  what task 12 is to do, one job a line (JSON): {"call": "module:function", "job": {...}}
        12.rows                  what task 12 says, one line (JSON) each time, see below
        12.out                   standard output and error of task 12

A task says {"start": id, "host": ...} before a job and then one of {"row": row}, {"lost": id, "why": ...},
{"error": id, "why": ...}; {"end": true} when nothing is left to do. Each line is one write() and on the disk before the
next job begins, so whatever ends a task, what it finished is kept, and it is known which jobs it had in hand. A line
torn by a crash is not a line: the next one begins anew.
"""

import contextlib
import json
import os
import pathlib
import re
import secrets
import shutil


def one_line(fault):
    """What went wrong, as one line."""
    return " ".join(str(fault).split()) or type(fault).__name__


class Sayer:
    """Appends lines to a file so that none is lost or torn, whoever dies: the writing end of NAME.rows."""

    def __init__(self, path):
        self.file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o666)
        size = os.fstat(self.file).st_size
        if size and os.pread(self.file, 1, size - 1) != b"\n":
            os.write(self.file, b"\n")

    def say(self, line):
        text = memoryview(json.dumps(line).encode() + b"\n")
        while text:
            text = text[os.write(self.file, text) :]
        os.fsync(self.file)

    def close(self):
        os.close(self.file)


class Listener:
    """What has been appended to a file since the last look: the reading end of NAME.rows."""

    def __init__(self, path):
        self.path, self.offset, self.rest = path, 0, b""

    def listen(self):
        """The new whole lines, as dicts; a file that is not there says nothing. Opening it anew each time makes a network
        file system ask its server."""
        try:
            with open(self.path, "rb") as file:
                file.seek(self.offset)
                new = file.read()
        except FileNotFoundError:
            return []
        self.offset += len(new)
        *whole, self.rest = (self.rest + new).split(b"\n")
        said = []
        for line in whole:
            try:
                value = json.loads(line)
            except ValueError:
                continue  # torn: whoever wrote it died
            if isinstance(value, dict):
                said.append(value)
        return said


class Array:
    """One array's folder. create() writes it before sbatch is called; open() finds it again."""

    def __init__(self, folder, name):
        self.folder, self.name = pathlib.Path(folder), name

    def write(self, bundles):
        """bundles: per task the list of its entries {"call":, "job":}."""
        self.folder.mkdir()
        for number, entries in enumerate(bundles):
            lines = "".join(json.dumps(entry) + "\n" for entry in entries)
            (self.folder / f"{number}.jobs").write_text(lines)
            # known to every host before a task writes to it: who reads in vain remembers that for a while on NFS
            self.rows(number).touch()

    def rows(self, number):
        return self.folder / f"{number}.rows"

    def entries(self, number):
        """The jobs of a task, as written; a task without a readable list is a ValueError."""
        with open(self.folder / f"{number}.jobs") as file:
            return [json.loads(line) for line in file]

    def tasks(self):
        return sorted(int(path.stem) for path in self.folder.glob("*.jobs"))

    @property
    def job(self):
        """Slurm's number of the array, as sbatch said; None while it is not known."""
        try:
            said = (self.folder / "job").read_text()
        except OSError:
            return None
        found = re.match(r"(\d+)", said)
        return found[1] if found else None

    def last_words(self, number):
        """The last line of what a task printed, to tell why it ended; empty if it said nothing."""
        try:
            lines = (self.folder / f"{number}.out").read_text(errors="replace").splitlines()
        except OSError:
            return ""
        return next((one_line(line) for line in reversed(lines) if line.strip()), "")


class Spool:
    """The folder as a whole. It is made when the first array is."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        word = re.sub(r"[^A-Za-z0-9_.-]+", "_", self.folder.with_suffix("").stem)[:24] or "study"
        token = None
        with contextlib.suppress(OSError):
            token = (self.folder / "token").read_text().strip()
        self.token = token or secrets.token_hex(4)
        self.prefix = f"mill-{word}-{self.token}"

    def arrays(self):
        """Those that an earlier driver left, oldest first."""
        found = [path for path in self.folder.glob("[0-9]*") if (path / "0.jobs").exists()]
        return [Array(path, f"{self.prefix}-{path.name}") for path in sorted(found)]

    def create(self, bundles):
        """A new array, written whole."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "token").write_text(self.token + "\n")
        number = 1 + max((int(p.name) for p in self.folder.glob("[0-9]*")), default=0)
        array = Array(self.folder / f"{number:05d}", f"{self.prefix}-{number:05d}")
        array.write(bundles)
        return array

    def remove(self):
        shutil.rmtree(self.folder, ignore_errors=True)
