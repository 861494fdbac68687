"""Impacts of a mill, one by one, from several seeds: where they lie, how hard they are, and what is made of them."""

import dataclasses

import h5py
import numpy as np
from study_case import ROOT

from milltools.read.runfile import Run

REFERENCE = ROOT / "input" / "simoloyer.ini"
SEEDS = tuple(range(1, 7))
WINDOW = (0.1, 0.2)  # [s], of the log: the mill is steady by then
BALL, DRUM, END, BLADE = "ball_ball", "ball_drum", "ball_wall", "ball_blade"


@dataclasses.dataclass
class Log:
    """Impacts of one run within a window: speeds `v` [m/s], `loss` [J], distances of the place of contact from drum,
    end walls and the nearest blade [m]."""

    kind: np.ndarray
    v: np.ndarray
    energy: np.ndarray  # of the normal approach, m* v^2 / 2 [J]
    loss: np.ndarray
    from_drum: np.ndarray
    from_ends: np.ndarray
    from_blade: np.ndarray
    diameter: float

    def of(self, kind):
        return self.kind == kind


def box_distance(blade, turned, x, y, z):
    """Distance of places from a blade's box [m], the rotor turned by `turned` [rad]."""
    angle = turned + blade.angle
    out = y * np.cos(angle) + z * np.sin(angle)
    around = z * np.cos(angle) - y * np.sin(angle)
    beyond = (
        np.abs(x - blade.position) - blade.width / 2,
        np.maximum(out - blade.tip_radius, -out),
        np.abs(around) - blade.thickness / 2,
    )
    return np.sqrt(sum(np.maximum(b, 0.0) ** 2 for b in beyond))


def read(path, begin, end):
    """The log of a run of one kind of ball in a round drum, its blades without pitch."""
    with Run(path) as run, h5py.File(path) as file:
        log = file["impacts"]
        time = log["time"][:]
        inside = np.flatnonzero((time >= begin) & (time < end))
        part = slice(inside[0], inside[-1] + 1)
        time = time[part]
        x, y, z = log["position"][part].astype(float).T
        kinds = np.array([str(kind) for kind in log.attrs["kinds"]])
        kind, v, loss = (
            kinds[log["kind"][part]],
            log["normal_speed"][part],
            log["dissipation"][part],
        )
        radius, length = run.quantity("drum/radius"), run.quantity("drum/length")
        diameter = run.quantity("balls/diameter")
        mass = run.quantity("balls/density") * np.pi / 6 * diameter**3
        turned = run.rotor_angle(0.0) + run.rotor_speed * time
        near = np.min([box_distance(blade, turned, x, y, z) for blade in run.as_deck.blades], axis=0)
    energy = 0.5 * np.where(kind == BALL, mass / 2, mass) * v**2
    ends = length / 2 - np.abs(x)
    return Log(kind, v, energy, loss, radius - np.hypot(y, z), ends, near, diameter)


def over_seeds(case, name, measure, window=WINDOW, seeds=SEEDS, deck=REFERENCE, **settings):
    """{quantity: one number a seed} of measure(log), kept by `name`."""

    def all_of_it():
        found = {}
        for seed in seeds:
            path = case.run(
                deck, output="log.h5", run__seed=seed,
                run__time=f"{window[1]!r} s", run__sample_from=f"{window[0]!r} s",
                output__impacts="all", output__frames="0 s", **settings,
            )  # fmt: skip
            for key, value in measure(read(path, *window)).items():
                found.setdefault(key, []).append(value)
            path.unlink()
        return found

    return {key: np.array(values) for key, values in case.kept(f"log-{name}", all_of_it).items()}
