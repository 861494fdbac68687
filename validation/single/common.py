"""Start files, blades and impact logs for runs whose balls never meet unless they are meant to."""

import dataclasses

import h5py
import mpmath
import numpy as np

mpmath.mp.dps = 50

TIME_BOUND = 1e-12  # [s] what a contact time may be off, wherever it has an exact answer


@dataclasses.dataclass
class Tally:
    """Errors of contact times, gathered by group for the figure."""

    groups: dict = dataclasses.field(default_factory=dict)

    def add(self, group, measured, exact):
        """Takes measured [s] and exact (mpmath) times; returns the largest error [s]."""
        errors = [abs(float(mpmath.mpf(float(m)) - e)) for m, e in zip(measured, exact, strict=True)]
        self.groups.setdefault(group, []).extend(errors)
        return max(errors)


def start(case, name, rows):
    """Writes a start file; returns the settings that name it."""
    text = "".join(" ".join(repr(float(x)) for x in row) + "\n" for row in rows)
    return {"balls__start": case.write(name, text), "balls__count": len(rows)}


def with_blades(case, name, speed, blades):
    """A deck of its own: deck.ini, a rotor without shaft, and one [blade.NAME] for each dict."""
    text = (case.folder / "deck.ini").read_text()
    text += f"\n[rotor]\nspeed = {speed!r} rad/s\nshaft_radius = 0 m\n"
    units = {"angle": "rad", "pitch": "rad"}
    for number, blade in enumerate(blades):
        text += f"\n[blade.b{number}]\n"
        text += "".join(f"{k} = {float(v)!r} {units.get(k, 'm')}\n" for k, v in blade.items())
    return case.write(name, text)


def read(path):
    """The impact log as columns, the kinds by name, and the series."""
    with h5py.File(path) as f:
        log = {name: f["impacts"][name][:] for name in f["impacts"]}
        kinds = np.array([str(kind) for kind in f["impacts"].attrs["kinds"]])
        log["kind"] = kinds[log["kind"]]
        return log


def of_ball(log, ball):
    """The rows that belong to one ball, in order of time, as columns."""
    mine = (log["ball"] == ball) | ((log["kind"] == "ball_ball") & (log["partner"] == ball))
    return {name: column[mine] for name, column in log.items()}


def series(path, *names):
    with h5py.File(path) as f:
        return [f[f"observables/{name}/value"][:] for name in names]


def exact(value):
    """A double as it is, in 50 digits."""
    return mpmath.mpf(float(value))


def relative(measured, expected):
    """Largest |measured / expected - 1|."""
    return float(np.max(np.abs(np.asarray(measured, float) / np.asarray(expected, float) - 1.0)))
