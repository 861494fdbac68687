"""Passes the run of another program to `millsim --digest`, which writes a file in millsim's own schema.

docs/file-format.md describes the stream. All values are in SI.
"""

import contextlib
import math
import struct
import subprocess
import tempfile
import typing

import numpy as np

from milltools.base.engine import program
from milltools.base.errors import UserError

IMPACT = np.dtype([
    ("time", "<f8"), ("normal_speed", "<f8"), ("tangential_speed", "<f8"), ("dissipation", "<f8"),
    ("position", "<f8", 3), ("normal", "<f8", 3),
    ("kind", "<i4"), ("ball", "<i4"), ("partner", "<i4"), ("nothing", "<i4"),
])  # fmt: skip
MOST = 1 << 20  # impacts in a record
PIPE = 1 << 20  # [bytes] that wait before they are written: many samples at once are cheaper
FACTS = {  # of /run: unit, meaning
    "program": ("", "program that made the run"),
    "version": ("", "version of the program"),
    "command": ("", "command line"),
    "started": ("", "when the run was started, UTC"),
    "notes": ("", "what to know before comparing, a line each"),
    "wall_time": ("s", "wall-clock time"),
    "cpu_time": ("s", "processor time"),
    "peak_memory": ("byte", "largest resident memory"),
    "largest_overlap": ("m", "largest overlap seen"),
    "energy_turnover": ("J", "energy turned over: the energy balance error is relative to it"),
    "energy_balance_error": ("1", "|rotor work - change of energy - dissipation| over the energy turned over"),
}


def impacts_of(**columns):
    """An array of IMPACT from columns of the same length, by name."""
    rows = np.zeros(len(columns["time"]), IMPACT)
    for name, values in columns.items():
        rows[name] = values
    return rows


def snapshot_times(deck):
    """Times [s] at which the maps need the balls, all within the window of `deck`, a milltools.read.deck.Deck."""
    begin, end = deck.number("run.sample_from", 0.0), deck.number("run.time")
    if not end > begin:
        return np.empty(0)
    step = min(1e-3, (end - begin) / 100)
    times = begin + (np.arange(int((end - begin) / step) + 2) + 0.5) * step
    return times[times <= end]


def _bytes(text):
    return text.encode("utf-8", "surrogateescape")  # command lines may hold any byte


class Answer(typing.NamedTuple):
    """elastic: energy in the springs [J]; deepest: largest overlap with these springs [m]; since the first sample, [J]:
    work of the motions that move the container, and by kind normal: loss in the dashpots, rubbed: by friction, only of
    surfaces, isolated: if every impact had happened alone; state: place, velocity, spin (3, N, 3) in the laboratory."""

    elastic: float
    deepest: float
    work: np.ndarray
    normal: np.ndarray
    rubbed: np.ndarray
    isolated: np.ndarray
    state: np.ndarray


class Digest(contextlib.AbstractContextManager):
    """Takes a run of `deck` (milltools.read.deck.Deck, read from its path) and writes the file `output`; a context
    manager.

    The facts come first, then states, impacts and accounts in the order of time. `end` completes the file; without it
    the file is that of a failed run. apart [s]: the largest distance in time between a sample of the observers and
    the nearest state; springs: whether accounts contain `elastic_energy`; force: overwrite the file. Errors are a
    UserError with the message of millsim.
    """

    def __init__(self, deck, output, apart=0.0, springs=False, force=False):
        self.motions, self.kinds = deck.motions, deck.kinds
        self.balls = len(deck.species_of_ball)
        sets = [word for override in deck.overrides for word in ("--set", override)]
        words = [program(), "--digest", "--quiet", "-o", output, *["-f"] * force, *sets, "--", deck.path]  # fmt: skip
        self.said = tempfile.TemporaryFile()  # a file: a pipe that nobody reads could fill up and block
        self.engine = subprocess.Popen(
            words, PIPE, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.said,
            start_new_session=True,  # Ctrl-C is for the program that makes the run
        )  # fmt: skip
        self._write(b"millsim stream 1\n")
        counts = self.balls, len(self.kinds), len(self.motions)
        self._record("begin", struct.pack("<3QdQ", *counts, apart, springs))

    def __exit__(self, *_):
        self.close()

    def facts(self, run):
        """Facts of /run by name, each a value or (value, unit, meaning); they may be given again, and the last values
        count. Required at the beginning: program, version, command, started, wall_time, cpu_time."""
        for name, fact in run.items():
            if not isinstance(fact, tuple):
                if name not in FACTS:
                    raise ValueError(f"run: {name}: expected (value, unit, description)")
                fact = (fact, *FACTS[name])
            value, unit, meaning = fact
            if isinstance(value, str):
                kind, value = "text", _bytes(value)
            elif isinstance(value, (int, np.integer)):
                kind, value = "u8", struct.pack("<Q", value)
            else:
                kind, value = "f8", struct.pack("<d", value)
            head = b"".join(_bytes(text) + b"\0" for text in (name, unit, meaning, kind))
            self._record("fact", head + value)

    def state(self, time, place, velocity, spin):
        """The balls (N, 3) in the laboratory frame at `time`, which must not be before the last state."""
        for given in (place, velocity, spin):
            if np.shape(given) != (self.balls, 3):
                raise ValueError(f"expected an array {(self.balls, 3)}, got {np.shape(given)}")
        self._record("state", struct.pack("<d", time), np.array([place, velocity, spin], "<f8"))

    def impacts(self, rows):
        """Impacts in order of time, an array of IMPACT (see impacts_of); none may be before the last call or the last
        account.

        kind: index into deck.kinds; partner: the other ball, the number of blade, end wall or copy, or -1; position
        [m] and normal, into the ball `ball`, in the laboratory; dissipation [J]: its normal part."""
        for first in range(0, len(rows), MOST):
            part = np.ascontiguousarray(rows[first : first + MOST], IMPACT)
            self._record("impacts", part.view(np.uint8))

    # ---- a program that computes soft spheres: it gives samples, and millsim finds the impacts

    def springs(self, interval, damped, springs):
        """The linear springs from now on, and the time [s] between samples. springs (K, S, S, 2): stiffness [N/m] and
        dashpot [kg/s] of all kinds of contact and species. The tangential spring is 2/7 of the normal one;
        damped: with the same dashpot, or with none."""
        self._record("springs", struct.pack("<3d", interval, 2 / 7, damped), np.array(springs, "<f8"))

    def sample(self, time, keep, frame, rows):
        """The balls at `time` as rows (N, 10) of float64: number from 1, place, velocity, spin, in any order. frame
        (15,): origin, velocity and directions of their frame. keep: the observers may need it, as a state."""
        self._record("sample", struct.pack("<17d", time, keep, *frame), rows)

    def part(self):
        """Moves balls of the last sample that overlap apart; their velocities stay."""
        self._record("part")

    def ask(self):
        """The Answer: what the samples so far have shown."""
        self._record("ask")
        self._write(flush=True)
        motions, kinds = len(self.motions), len(self.kinds)
        size = 8 * (2 + motions + 3 * kinds + 9 * self.balls)
        told = self.engine.stdout.read(size)
        if len(told) < size:
            self._check()
        elastic, deepest, *_ = told = np.frombuffer(told, "<f8")
        losses = told[2 + motions :][: 3 * kinds].reshape(kinds, 3).T
        return Answer(elastic, deepest, told[2 : 2 + motions], *losses, told[-9 * self.balls :].reshape(3, -1, 3))

    # ---- sums over time

    def account(self, time, values):
        """Work done and energy lost from t = 0 to `time`; all earlier impacts and states must have been given.

        values: `motion_work/MOTION` and `motion_impulse/MOTION` (about its axis), `dissipation/KIND` and
        `dissipation_normal/KIND`, `elastic_energy`; values that are not given are NaN in the file."""
        left = dict(values)
        told = [time, left.pop("elastic_energy", math.nan)]
        names = [f"{one}/{name}" for name in self.motions for one in ("motion_work", "motion_impulse")]
        names += [f"{one}/{name}" for name in self.kinds for one in ("dissipation", "dissipation_normal")]
        told += [left.pop(name, math.nan) for name in names]
        if left:
            raise ValueError(f"{min(left)}: an account has no value of this name")
        self._record("account", np.array(told, "<f8"))

    def publish(self):
        """Writes a checkpoint: the file on the disk contains everything given so far."""
        self._record("publish")
        self._write(flush=True)

    def end(self, status="complete", time=None):
        """The run has ended at `time`: `complete`, `stopped` or `failed`. The file is complete when this returns."""
        self._record("end", struct.pack("<d", time), status.encode())
        self._write(flush=True)
        with contextlib.suppress(BrokenPipeError):
            self.engine.stdin.close()
        self._check()

    def close(self):
        """Closes without an end: the run has failed, and its file contains what was given so far. Waits only for the
        engine to end."""
        with contextlib.suppress(BrokenPipeError):
            self.engine.stdin.close()
        self.engine.wait()
        self.said.close()

    # ---- the stream

    def _record(self, kind, *parts):
        parts = [memoryview(part).cast("B") for part in parts]
        size = sum(len(part) for part in parts)
        self._write(struct.pack("<8sQ", kind.ljust(8).encode(), size), *parts)

    def _write(self, *parts, flush=False):
        try:
            for part in parts:
                self.engine.stdin.write(part)
            if flush:
                self.engine.stdin.flush()
        except BrokenPipeError:
            self._check()

    def _check(self):
        """Waits for the engine; if it failed, UserError with its message."""
        status = self.engine.wait()
        self.said.seek(0)
        lines = self.said.read().decode(errors="replace").splitlines()
        if status != 0:
            line = lines[-1] if lines else f"millsim --digest ended with status {status}"
            raise UserError(line.removeprefix("millsim: "), status if status > 0 else 1)
