"""Start files, logs and series of the runs; how long two runs are the same."""

import json
import subprocess

import h5py
import mpmath
import numpy as np

mpmath.mp.dps = 40

TIME_BOUND = 1e-12  # [s] what a contact time may be off, wherever it has an exact answer
NO_GRAVITY = {"gravity__acceleration": "0 0 0 m/s^2"}
NO_FLOOR = {"contact__rebound_floor": "0 m/s"}
RPM = 2 * np.pi / 60  # [rad/s]


def start(case, name, rows):
    """Writes a start file; returns the settings that name it."""
    text = "".join(" ".join(repr(float(x)) for x in row) + "\n" for row in rows)
    return {"balls__start": case.write(name, text), "balls__count": len(rows)}


def as_started(case, deck, **settings):
    """The state that the program starts this deck from, as rows (N, 6 or 9), by --export-start."""
    path = case.scratch / "exported.txt"
    options = [f"--set={key.replace('__', '.')}={value}" for key, value in settings.items()]
    words = [case.program, "-q", "-f", "--export-start", path, *options, case.folder / deck]
    subprocess.run(words, check=True, capture_output=True)
    return np.loadtxt(path, ndmin=2)


def log_of(path):
    """The impact log as columns, with the kinds by name."""
    with h5py.File(path) as f:
        log = {name: f["impacts"][name][:] for name in f["impacts"]}
        kinds = np.array([str(kind) for kind in f["impacts"].attrs["kinds"]])
    log["kind"] = kinds[log["kind"]]
    return log


def value(path, *names):
    """Numbers of the file, in order; a name counts from its root."""
    with h5py.File(path) as f:
        found = [f[name][()] for name in names]
    return found if len(found) > 1 else found[0]


def series(path, name):
    return value(path, f"observables/{name}/value")


def summary(path):
    """What --json printed."""
    return json.loads(path.with_suffix(".json").read_text())


def alike(one, other, stretch=1.0):
    """How many impacts from the first on are of the same kind, balls and partners, at times that differ by less than
    1e-6 s; times of `other` are multiplied by `stretch` first."""
    count = min(len(one["time"]), len(other["time"]))
    same = np.abs(other["time"][:count] * stretch - one["time"][:count]) < 1e-6
    for name in ("kind", "ball", "partner"):
        same &= one[name][:count] == other[name][:count]
    return count if same.all() else int(np.argmin(same))


def apart(one, other, stretch=1.0):
    """|time - time| [s] of the impacts that both have."""
    count = alike(one, other, stretch)
    return np.abs(other["time"][:count] * stretch - one["time"][:count])


NUDGE = 1e-13  # [m], and of velocities relative: two runs that part as these do, or later, differ by rounding
GROWN = 1e-10  # [s] from here on a deviation has clearly grown


def nudged(rows, seed=1):
    """A start moved by NUDGE at random."""
    rng = np.random.default_rng(seed)
    moved = np.array(rows, float)
    moved[:, :3] += NUDGE * rng.standard_normal((len(rows), 3))
    moved[:, 3:] *= 1 + NUDGE * rng.standard_normal(moved[:, 3:].shape)
    return moved


def claim_same(case, what, base, other, twin, stretch=1.0, headline=False):
    """Two runs have the same impacts, as far as rounding lets them: compared with a twin that was nudged at the start.

    Returns the deviations of `other` and of the twin [s].
    """
    off, beside = apart(base, other, stretch), apart(base, twin)
    count = min(len(off), len(beside))
    early = off[: max(int(np.argmax(beside > GROWN)), 1)]
    case.bound(f"{what}: first {len(early)} impacts, largest difference of the times", early.max(), GROWN,
               against="equal impacts; in this time 1e-13 m at the start grow to 1e-10 s", unit="s")  # fmt: skip
    grown = np.maximum(off[:count], 1e-17) / np.maximum(np.maximum.accumulate(beside[:count]), 1e-17)
    size = NUDGE * np.exp(np.mean(np.log(grown[beside[:count] > 1e-14])))
    case.bound(
        f"{what}: {len(off)} equal impacts, deviation at the start that would grow to the deviation found",
        size,
        NUDGE,
        against="rounding; the program treats a gap of 1e-15 m as closed",
        unit="m",
        headline=headline,
    )
    return off, beside


def mean(values):
    """Mean and its standard error."""
    values = np.asarray(values, float)
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values))
