"""Start files, logs and series of the runs; how long two runs are the same."""

import json

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
    import subprocess

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


def contacts_alike(one, other, stretch=1.0):
    """How many impacts from the first on are of the same kind, balls and partners, and at times (times `stretch`) within 1e-6 of
    the mean time between impacts."""
    count = min(len(one["time"]), len(other["time"]))
    same = np.ones(count, bool)
    for name in ("kind", "ball", "partner"):
        same &= one[name][:count] == other[name][:count]
    step = one["time"][count - 1] / count
    same &= np.abs(other["time"][:count] * stretch - one["time"][:count]) < 1e-6 * step
    return count if same.all() else int(np.argmin(same))


def deviation(one, other, stretch=1.0):
    """Of each impact that both runs have: |time - time| [s], and |v_n - v_n| [m/s]; `other` is told in the units of `one`."""
    count = contacts_alike(one, other, stretch)
    time = np.abs(other["time"][:count] * stretch - one["time"][:count])
    speed = np.abs(other["normal_speed"][:count] / stretch - one["normal_speed"][:count])
    return time, speed


def mean(values):
    """Mean and its standard error."""
    values = np.asarray(values, float)
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values))
