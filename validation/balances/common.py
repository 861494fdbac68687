"""One finished run as the balances read it, and what they all ask of it."""

import json

import h5py
import numpy as np

GRAVITY = 9.81
SURFACES, ROTOR, STILL = [1, 2, 3, 4], [3, 4], [1, 2]  # kinds of contact


def steady_error(values, duration):
    """Standard error of the mean rate of change over a window: both ends are draws of one steady state."""
    return np.sqrt(2.0) * np.std(values) / duration


class Mill:
    """One finished run: series, frames and log, and the window of its statistics."""

    def __init__(self, path, margin=0.0):
        """margin: the window ends so much before the run [s]"""
        self.file = h5py.File(path)
        self.summary = json.loads(path.with_suffix(".json").read_text())
        self.begin, self.end = self.summary["sample_from"], self.summary["time"] - margin
        self.duration = self.end - self.begin

    def series(self, name):
        item = self.file["observables"][name]
        return item["time"][:], item["value"][:]

    def total(self, names):
        return sum(self.series(name)[1] for name in names)

    def window(self, time):
        """Rows from the window's begin to its end; times are multiples of an interval."""
        slack = 1e-9 * self.end
        return np.flatnonzero((time >= self.begin - slack) & (time <= self.end + slack))

    def frames(self, *names):
        """Time and the named states of the window's frames."""
        group = self.file["particles/trajectory"]
        rows = self.window(group["position/time"][:])
        first, last = rows[0], rows[-1] + 1
        states = [group[name]["value"][first:last].astype(float) for name in names]
        return group["position/time"][first:last], *states

    def log(self, *names):
        columns = self.file["impacts"]
        return [columns[name][:] for name in names]

    @property
    def kinds(self):
        return list(self.file["impacts"].attrs["kinds"])


def momentum(mill, mass, inertia):
    """Momentum, its moment about the axis, and the weight's moment about it, in the window's frames."""
    time, r, v, w = mill.frames("position", "velocity", "angular_velocity")
    linear = mass * v.sum(axis=1)
    angular = (mass * (r[..., 1] * v[..., 2] - r[..., 2] * v[..., 1]) + inertia * w[..., 0]).sum(1)
    weight = -mass * GRAVITY * r[..., 1].sum(axis=1)
    return time, linear, angular, np.trapezoid(weight, time) / (time[-1] - time[0])


def properties(mill):
    group = mill.file["particles/trajectory"]
    mass, radius = group["mass"][0], 0.5 * group["diameter"][0]
    return len(group["mass"]), mass, radius, 0.4 * mass * radius**2


def sampling_error(mill, weight):
    """Most that frames at intervals of d can miss of the weight's mean moment: they take the centre of mass to
    move straight between them, and it falls off that by no more than g d^2 / 12 on average."""
    step = mill.file["particles/trajectory/position/time"][1]
    return weight * GRAVITY * step**2 / 12.0


def rotor_torque(mill):
    time, value = mill.series("rotor_torque")
    rows = mill.window(time)[1:]
    return value[rows].mean()


def claim_weight(case, what, force, weight, error, headline=False):
    """The surfaces' mean vertical force is the balls' weight. what: which mill; error: of the force [N]"""
    case.claim(
        f"vertical force of all surfaces, {what}, steady mean",
        force,
        weight,
        4.0 * error,
        against="weight of the balls",
        error=error,
        unit="N",
        headline=headline,
    )
