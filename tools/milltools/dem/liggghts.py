"""One LIGGGHTS process. Its results come through named pipes while it runs: nothing is left on the disk.

LIGGGHTS 3.8 ends with status 0 also after many failures (lost balls, a broken mesh). `Liggghts.finish` raises an error
for each such failure that is known.
"""

import contextlib
import fcntl
import os
import pathlib
import re
import signal
import struct
import subprocess
import time

import numpy as np

from milltools.base.errors import UserError
from milltools.base.extras import program
from milltools.base.processes import at_once, guard

HEADER = 100  # bytes before the numbers of a binary dump
PIPE = 1 << 20  # [bytes] capacity of a pipe: a few samples
COLUMNS = 10  # of a sample
TOGETHER = 32  # samples that are read at once, at most


def command(ranks):
    """The command that starts LIGGGHTS on this number of ranks."""
    program("liggghts", "liggghts", "LIGGGHTS")
    if ranks == 1:
        return ["liggghts"]
    program("mpirun", "openmpi-bin")
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return ["mpirun", *root, "--oversubscribe", "-np", str(ranks), "liggghts"]


def _garbled(what):
    return UserError(f"what LIGGGHTS writes cannot be read: {what}", 1)


def _pipe(path):
    """(the end to read from, the end to write to) of a new named pipe."""
    os.mkfifo(path)
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    writer = os.open(path, os.O_WRONLY)
    os.set_blocking(reader, True)
    with contextlib.suppress(OSError):
        fcntl.fcntl(reader, fcntl.F_SETPIPE_SZ, PIPE)
    return open(reader, "rb"), open(writer, "wb")


def states(rows):
    """[place, velocity, spin] (N, 3) of the balls in their order, from the rows of a sample."""
    ordered = rows[np.argsort(rows[:, 0])]
    if not np.isfinite(rows).all() or not np.array_equal(ordered[:, 0], np.arange(1, len(rows) + 1)):
        raise _garbled("a sample has numbers that are not finite, or not every ball once")
    return [ordered[:, k : k + 3].copy() for k in (1, 4, 7)]


class Liggghts:
    """LIGGGHTS running `in.txt` in `folder`; `balls`: their number, which must stay; `triangles`: of each mesh.

    Use it as a context manager: at its exit no process is left, also after an error.
    """

    def __init__(self, folder, script, balls, triangles=(), ranks=1):
        self.folder, self.balls, self.ranks = folder, balls, ranks
        self.triangles = [int(count) for count in np.atleast_1d(triangles) if count]
        self.cpu = 0.0  # [s] of processor time, once it has ended
        self.begun, self.told = False, {}
        (folder / "in.txt").write_text(script)
        self.pipe, writer = _pipe(folder / "state.bin")
        words = [*command(ranks), *"-in in.txt -screen screen.txt -log none -nocite".split()]
        # The files of Open MPI are removed with the folder. One rank alone needs no daemon of Open MPI, which would
        # still clear up in the folder after us
        mpi = {"TMPDIR": str(folder), "OMPI_MCA_btl_vader_backing_directory": str(folder)}
        if ranks == 1:
            mpi["OMPI_MCA_ess_singleton_isolated"] = "1"
        with contextlib.ExitStack() as ours:
            errors = ours.enter_context(open(folder / "stderr.txt", "wb"))
            ours.enter_context(writer)
            # a session of its own: Ctrl-C at the terminal reaches only this tool, which then ends LIGGGHTS
            self.process = subprocess.Popen(
                [*guard("KILL" if ranks == 1 else "TERM"), *words], cwd=folder, start_new_session=True,
                stdin=subprocess.DEVNULL, stdout=errors, stderr=errors,
                env={**os.environ, **mpi, "OMP_NUM_THREADS": "1"},
                pass_fds=[writer.fileno()],  # so the pipe ends when the process ends, even if LIGGGHTS never opened it
            )  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._wait(os.WNOHANG) is None:
            self._end()
        for file in (self.pipe, *self.told.values()):
            file.close()

    def _end(self):
        """Kills all processes of its session: mpirun puts its ranks into process groups of their own, which do not end
        with it. Not with SIGTERM: LIGGGHTS would first write restart files, or wait until we read the pipes."""
        killed = {}
        while left := self._session():
            killed |= left
            for pid in left:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            self._wait()
            time.sleep(0.01)
        self._wait()
        self.cpu += sum(cpu for pid, cpu in killed.items() if pid != self.process.pid)

    def _session(self):
        """Processes that live in the session of this one, and the processor time [s] of each."""
        found, tick = {}, os.sysconf("SC_CLK_TCK")
        for entry in filter(str.isdigit, os.listdir("/proc")):
            with contextlib.suppress(OSError):
                if os.getsid(int(entry)) == self.process.pid:
                    words = pathlib.Path("/proc", entry, "stat").read_text().rpartition(")")[2].split()
                    if words[0] not in "ZX":
                        found[int(entry)] = (int(words[11]) + int(words[12])) / tick
        return found

    def _wait(self, options=0):
        """The exit status; with os.WNOHANG None while LIGGGHTS runs."""
        if self.process.returncode is None:
            pid, state, used = os.wait4(self.process.pid, options)
            if pid:
                self.process.returncode = os.waitstatus_to_exitcode(state)
                self.cpu += used.ru_utime + used.ru_stime
        return self.process.returncode

    def samples(self, count):
        """Yields step and rows (N, 10) of so many samples, or fewer if LIGGGHTS ends before: number, place, velocity
        and spin of each ball, in any order. Later samples overwrite the rows. Many are read at once, which is
        cheaper."""
        size = HEADER + 4 * self.ranks + 8 * COLUMNS * self.balls
        most = max(1, min(TOGETHER, PIPE // size))
        read = memoryview(bytearray(size * most))
        while count > 0:
            wanted = min(most, count)
            with at_once():
                got = self.pipe.readinto(read[: size * wanted])
            for begin in range(0, got - HEADER + 1, size):
                step, rows = self._sample(read[begin : min(begin + size, got)], size)
                if rows is None:
                    return
                yield step, rows
            count = count - wanted if got == size * wanted else 0

    def _sample(self, dump, size):
        step, rows, width, chunks = struct.unpack_from(f"<qq{HEADER - 24}xii", dump)
        if width != COLUMNS or chunks != self.ranks or rows > self.balls:
            raise _garbled(f"state.bin begins a dump of {rows} x {width} numbers in {chunks} parts")
        if rows != self.balls:
            lost = f"LIGGGHTS lost {self.balls - rows} of {self.balls} balls by step {step}"
            raise UserError(f"{lost}: use a stiffer --modulus (it also shortens the time step)", 1)
        if len(dump) < size:
            return step, None
        parts, at = [], HEADER
        for _ in range(chunks):
            (numbers,) = struct.unpack_from("<i", dump, at)
            if numbers % COLUMNS or not 0 <= numbers <= (size - at - 4) // 8:
                raise _garbled(f"state.bin has a part of {numbers} numbers at step {step}")
            parts.append(np.frombuffer(dump, "<f8", numbers, at + 4))
            at += 4 + 8 * numbers
        if at != size:
            raise _garbled(f"state.bin does not name every ball once at step {step}")
        if not self.begun:
            self.begun = True
            self._assert_mesh(self.screen(), over=False)
        return step, (parts[0] if chunks == 1 else np.concatenate(parts)).reshape(-1, COLUMNS)

    def told_of(self, file, row, columns):
        """The mean values in `file` over the `row`-th interval of the series: as many as `columns`."""
        try:
            if file not in self.told:
                self.told[file] = open(self.folder / file)
            line = next(line for line in self.told[file] if not line.startswith("#"))
            means = [float(word) for word in line.split()[1 : 1 + columns]]
            means[columns - 1]
        except (OSError, ValueError, IndexError, StopIteration):
            raise _garbled(f"{file} has no row {row}") from None
        return means

    def screen(self):
        """The text that LIGGGHTS has printed so far."""
        path = self.folder / "screen.txt"
        return path.read_text(errors="replace") if path.exists() else ""

    def version(self):
        """LIGGGHTS' version, as it prints it."""
        found = re.search(r"LIGGGHTS \(Version (\S+ \S+?),", self.screen())
        return found[1] if found else "unknown"

    def finish(self):
        """Waits for the end and returns the processor time [s] of LIGGGHTS; raises UserError for every known kind of
        failure."""
        self.pipe.close()
        with at_once():
            status = self._wait()
        text = self.screen()
        said = [line.strip() for line in text.splitlines() if "ERROR" in line]
        errors = (self.folder / "stderr.txt").read_text(errors="replace").splitlines()
        said += [line.strip() for line in errors if re.search(r"[A-Za-z]", line)]
        if status != 0 or "ERROR" in text:
            how = f"failed with status {status}" if status >= 0 else f"was ended by signal {-status}"
            raise UserError(f"LIGGGHTS {how}: {said[0] if said else 'it said nothing'}", 1)
        self._assert_mesh(text, over=True)
        loop = re.search(r"Loop time of \S+ on \d+ procs for \d+ steps with (\d+) atoms", text)
        if not loop:
            raise UserError("LIGGGHTS ended before its run was over", 1)
        if int(loop[1]) != self.balls:
            raise UserError(f"LIGGGHTS ended with {loop[1]} of {self.balls} balls", 1)
        dangerous = re.findall(r"Dangerous builds = (\d+)", text)
        if any(int(count) for count in dangerous):
            raise UserError(f"LIGGGHTS updated its lists of neighbours too late ({dangerous[-1]} dangerous builds)", 1)
        return self.cpu

    def _assert_mesh(self, text, over):
        read = [int(count) for count in re.findall(r"containing (\d+) triangle\(s\)", text)]
        wanted = self.triangles if over else self.triangles[: len(read)]
        if self.triangles and read != wanted:
            some = sum(read) or "none"
            raise UserError(f"LIGGGHTS read {some} of the {sum(self.triangles)} triangles of the meshes", 1)
