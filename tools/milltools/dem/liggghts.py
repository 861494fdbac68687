"""One LIGGGHTS process and what comes out of it while it runs, through named pipes: nothing is left on the disk.

LIGGGHTS 3.8 ends with status 0 after much that is no success (lost balls, a broken mesh); `Process.finish` turns all that
it is known to keep silent about into errors.
"""

import contextlib
import fcntl
import os
import re
import select
import shutil
import subprocess
import time

import numpy as np

from milltools.errors import UserError

HEADER = 100  # bytes before the numbers of a binary dump
PIPE = 1 << 20  # [bytes] that wait in a pipe: a few samples
WAIT = 0.2  # [s] between looks at whether the process still lives


def command(ranks):
    """The words that start LIGGGHTS on so many ranks."""
    if not shutil.which("liggghts"):
        raise UserError("LIGGGHTS is not installed; on Debian: sudo apt-get install liggghts", 1)
    if ranks == 1:
        return ["liggghts"]
    if not shutil.which("mpirun"):
        raise UserError("mpirun is not installed; on Debian: sudo apt-get install openmpi-bin", 1)
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return ["mpirun", *root, "--oversubscribe", "-np", str(ranks), "liggghts"]


class Pipe:
    """The reading end of a named pipe that LIGGGHTS opens as one of its dump files."""

    def __init__(self, path):
        os.mkfifo(path)
        self.file = os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb", buffering=0)
        with contextlib.suppress(OSError):
            fcntl.fcntl(self.file, fcntl.F_SETPIPE_SZ, PIPE)
        self.started = False

    def close(self):
        """Whoever writes into it from now on is ended by SIGPIPE."""
        self.file.close()

    def _ready(self, alive):
        """Waits for the first bytes; False: the writer ended without any."""
        poll = select.poll()
        poll.register(self.file, select.POLLIN)
        while not any(event & select.POLLIN for _, event in poll.poll(WAIT * 1000)):
            if not alive():
                return any(event & select.POLLIN for _, event in poll.poll(0))
            time.sleep(0.001)
        os.set_blocking(self.file.fileno(), True)
        self.started = True
        return True

    def read(self, size, alive):
        """Exactly `size` bytes, or None at the end."""
        if not self.started and not self._ready(alive):
            return None
        whole = bytearray(size)
        view, done = memoryview(whole), 0
        while done < size:
            got = self.file.readinto(view[done:])
            if not got:
                return None
            done += got
        return whole


class Process:
    """LIGGGHTS at work on `in.txt` in `folder`; `balls` that it must never lose.

    state() and walls() return what the next dump of that name holds, None at the end. Use as a context manager:
    on leaving, whatever happened, no process is left.
    """

    def __init__(self, folder, script, balls, triangles=0, ranks=1, dumps=("state.bin",)):
        self.folder, self.balls, self.triangles, self.ranks = folder, balls, triangles, ranks
        (folder / "in.txt").write_text(script)
        self.pipes = {name: Pipe(folder / name) for name in dumps}
        words = [
            *command(ranks),
            "-in",
            "in.txt",
            "-screen",
            "screen.txt",
            "-log",
            "none",
            "-nocite",
        ]
        with open(folder / "stderr.txt", "wb") as errors:
            # a session of its own: Ctrl-C at the terminal reaches millsim's tool alone, which then ends this one
            self.process = subprocess.Popen(
                words,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                stdout=errors,
                stderr=errors,
                start_new_session=True,
                env={**os.environ, "OMP_NUM_THREADS": "1"},
            )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.process.pid, 9)  # a SIGTERM would make it write restart files first
            self.process.wait()
        for pipe in self.pipes.values():
            pipe.close()

    def alive(self):
        """Whether the process still runs."""
        return self.process.poll() is None

    def _binary(self, name):
        head = self.pipes[name].read(HEADER, self.alive)
        if head is None:
            return None
        step, rows = np.frombuffer(head, np.int64, 2)
        columns, chunks = np.frombuffer(head, np.int32, 2, HEADER - 8)
        parts = []
        for _ in range(chunks):
            size = self.pipes[name].read(4, self.alive)
            data = size and self.pipes[name].read(
                8 * int(np.frombuffer(size, np.int32)[0]), self.alive
            )
            if data is None:
                return None
            parts.append(np.frombuffer(data, np.float64).reshape(-1, columns))
        if rows != self.balls:
            raise UserError(
                f"LIGGGHTS lost {self.balls - rows} of {self.balls} balls by step {step}: "
                "a stiffer --modulus or a shorter time step keeps them inside",
                1,
            )
        return int(step), parts[0] if len(parts) == 1 else np.concatenate(parts)

    def state(self, into):
        """The step of the next sample; its state goes into the array (N, 9): place, velocity, spin. None: it ended."""
        found = self._binary("state.bin")
        if found is None:
            return None
        step, rows = found
        into[rows[:, 0].astype(np.int64) - 1] = rows[:, 1:]
        return step

    def walls(self):
        """Forces (N, 3 W) [N] of the W walls on each ball."""
        found = self._binary("walls.bin")
        if found is None:
            return None
        rows = found[1]
        forces = np.empty((self.balls, rows.shape[1] - 1))
        forces[rows[:, 0].astype(np.int64) - 1] = rows[:, 1:]
        return forces

    def torque(self, row):
        """Mean torque [N m] of the balls on the blades about +x over the `row`-th interval of the series, from 1."""
        path = self.folder / "torque.txt"
        lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
        return float(lines[row - 1].split()[1])

    def screen(self):
        """What LIGGGHTS has printed so far."""
        path = self.folder / "screen.txt"
        return path.read_text(errors="replace") if path.exists() else ""

    def version(self):
        """LIGGGHTS' version, as it prints it."""
        found = re.search(r"LIGGGHTS \(Version (\S+ \S+?),", self.screen())
        return found[1] if found else "unknown"

    def finish(self):
        """Waits for the end and returns the processor time [s] that LIGGGHTS has taken; raises UserError for every way
        in which it can have failed."""
        for pipe in self.pipes.values():
            pipe.close()
        _, state, used = os.wait4(self.process.pid, 0)
        self.process.returncode = status = os.waitstatus_to_exitcode(state)
        self._assert_success(status)
        return used.ru_utime + used.ru_stime

    def _assert_success(self, status):
        text = self.screen()
        errors = [line for line in text.splitlines() if "ERROR" in line]
        said = (self.folder / "stderr.txt").read_text(errors="replace").strip().splitlines()
        if errors or status != 0:
            what = errors[0].strip() if errors else (said[-1] if said else "it said nothing")
            raise UserError(f"LIGGGHTS failed with status {status}: {what}", 1)
        if self.triangles and f"containing {self.triangles} triangle(s)" not in text:
            raise UserError(
                f"LIGGGHTS did not read all {self.triangles} triangles of the blades", 1
            )
        loop = re.search(r"Loop time of \S+ on \d+ procs for \d+ steps with (\d+) atoms", text)
        if not loop:
            raise UserError("LIGGGHTS ended before its run was over", 1)
        if int(loop[1]) != self.balls:
            raise UserError(f"LIGGGHTS ended with {loop[1]} of {self.balls} balls", 1)
        dangerous = re.findall(r"Dangerous builds = (\d+)", text)
        if any(int(count) for count in dangerous):
            raise UserError(
                f"LIGGGHTS saw neighbours too late ({dangerous[-1]} dangerous builds)", 1
            )
