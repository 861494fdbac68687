"""An elastic atmosphere of hard spheres."""

import numpy as np
from balances.common import Mill, properties
from scipy.optimize import brentq

SEEDS = range(1, 9)  # of the atmosphere: its standard errors come from independent runs
SLICES = 20  # of the atmosphere, of one ball diameter each
INNER = range(4, 17)  # those of them far enough from floor and lid for the equation of state
ACCELERATION = 45.0  # [m/s^2] of the atmosphere
CORE = 0.6  # of the drum's radius: the part of the atmosphere away from the curved wall
SIZE = ("radius", "length")


def compressibility(phi):
    """Z of Carnahan and Starling."""
    return (1.0 + phi + phi**2 - phi**3) / (1.0 - phi) ** 3


def chemical_potential(phi):
    """mu/T of Carnahan and Starling, up to a constant."""
    return np.log(phi) + (8.0 * phi - 9.0 * phi**2 + 3.0 * phi**3) / (1.0 - phi) ** 3


class Atmosphere:
    """One run: the core's slices (bottom first), and pressures at its floor and its lid."""

    def __init__(self, mill, weight):
        self.count, self.mass, radius, _ = properties(mill)
        drum, length = (float(mill.file["deck/drum"][k].asstr()[()].split()[0]) for k in SIZE)
        self.area = np.pi * (CORE * drum) ** 2
        self.edges = np.linspace(0.0, length, SLICES + 1)
        self.ball = 4.0 / 3.0 * np.pi * radius**3
        self.weight = weight * self.mass  # of one ball [N]
        time, r, v = mill.frames("position", "velocity")
        core = np.hypot(r[..., 1], r[..., 2]) < CORE * drum
        height = r[core][:, 0] + 0.5 * length
        square = (v[core] ** 2).sum(axis=1)
        self.number = np.histogram(height, self.edges)[0] / len(time)
        energy = np.histogram(height, self.edges, weights=square)[0] / len(time)
        self.temperature = self.mass * energy / (3.0 * self.number)  # [J]
        self.mean_temperature = self.mass * (v**2).sum() / (3.0 * len(time) * self.count)
        self.walls(mill, drum)
        momentum = self.mass * v[..., 0].sum(axis=1)
        self.force_less_change = self.force - (momentum[-1] - momentum[0]) / mill.duration

    def walls(self, mill, drum):
        """The outermost cells of the axial map are thinner than a ball's radius: only wall contacts are in them."""
        speeds = mill.file["statistics/maps/axial/normal_speed_sum"][:]
        radii = mill.file["statistics/maps/axial/r_edges"][1:]
        inner = radii < CORE * drum * (1.0 + 1e-9)
        push = 2.0 * self.mass / mill.duration
        self.force = push * (speeds[0].sum() - speeds[-1].sum())
        self.floor = push * speeds[0][inner].sum() / self.area
        self.lid = push * speeds[-1][inner].sum() / self.area

    @property
    def packing(self):
        return self.number * self.ball / (self.area * np.diff(self.edges))

    @property
    def pressure(self):
        """In the middle of each slice: the lid's, and the weight of what is above."""
        above = self.number[::-1].cumsum()[::-1] - 0.5 * self.number
        return self.lid + above * self.weight / self.area

    def theory(self, part):
        """Packing of the slices of `part`: mu(phi) + m g h / T is the same everywhere; as many balls as counted."""
        phi = np.geomspace(1e-4, 0.5, 20000)
        fine = np.linspace(self.edges[part.start], self.edges[part.stop], 20 * len(part) + 1)
        fine = 0.5 * (fine[1:] + fine[:-1])
        wanted = self.packing[part.start : part.stop].sum()

        def slices(constant):
            level = constant - self.weight * fine / self.mean_temperature
            return np.interp(level, chemical_potential(phi), phi).reshape(len(part), 20).mean(1)

        constant = brentq(lambda c: slices(c).sum() - wanted, -5.0, 15.0, xtol=1e-10)
        return slices(constant)


def over_seeds(values):
    values = np.array(values)
    return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))


def atmosphere(case):
    runs = []
    for seed in SEEDS:
        mill = Mill(case.run("column.ini", run__seed=seed))
        runs.append(Atmosphere(mill, ACCELERATION))
        mill.file.close()
    first = runs[0]
    weight = first.count * first.weight
    case.bound(
        "force on the bottom minus force on the lid minus change of momentum: "
        "largest relative deviation from the weight, all runs",
        max(abs(run.force_less_change / weight - 1.0) for run in runs),
        1e-8,
        against="weight of the balls",
    )
    step, error = over_seeds([run.floor - run.lid for run in runs])
    carried, carried_error = over_seeds([run.number.sum() * run.weight / run.area for run in runs])
    error = np.hypot(error, carried_error)
    case.claim(
        "pressure on the bottom minus pressure on the lid, in the core",
        step,
        carried,
        4.0 * error,
        against="weight of the core",
        error=error,
        unit="Pa",
    )
    third = SLICES // 3
    ratio, error = over_seeds(
        [
            np.average(run.temperature[:third], weights=run.number[:third])
            / np.average(run.temperature[-third:], weights=run.number[-third:])
            for run in runs
        ]
    )
    case.claim(
        "ratio of the temperature in the lowest third to that in the uppermost third",
        ratio,
        1.0,
        4.0 * error,
        against="equal in equilibrium",
        error=error,
    )
    state_equation(case, runs)
    return runs


def state_equation(case, runs):
    packing = np.mean([run.packing for run in runs], axis=0)
    for wanted in (0.25, 0.15, 0.07):
        k = INNER[np.argmin(np.abs(packing[INNER.start : INNER.stop] - wanted))]
        near = slice(k - 1, k + 2)
        values = [
            np.mean((run.pressure * run.ball / run.packing / run.mean_temperature)[near])
            / np.mean(compressibility(run.packing)[near])
            for run in runs
        ]
        ratio, error = over_seeds(values)
        case.claim(
            f"ratio of p/nT to the theoretical value, at a packing of {packing[near].mean():.3f}",
            ratio,
            1.0,
            0.005 + 4.0 * error,
            against="Carnahan and Starling 1969",
            error=error,
            headline=wanted == 0.25,
        )
    span = len(INNER)
    values = [
        np.log(run.packing[INNER.stop - 1] / run.packing[INNER.start])
        - np.log(run.theory(INNER)[span - 1] / run.theory(INNER)[0])
        for run in runs
    ]
    off, error = over_seeds(values)
    case.claim(
        "ln(packing at the top / packing at the bottom) minus the theoretical value",
        off,
        0.0,
        0.01 + 4.0 * error,
        against="mu(phi) + m g h / T = const., Carnahan and Starling",
        error=error,
    )
