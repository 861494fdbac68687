"""What is compared of two mills: powers, energies, rates of fast impacts, maps; and how well each is known.

A steady mill is measured over its sampled window. LIGGGHTS runs once; its standard error is the larger of two: that
of its own blocks of whole revolutions, and the scatter of one run of millsim from seed to seed. millsim runs with
several seeds: its value is their mean.
"""

import dataclasses

import numpy as np

from milltools.read.runfile import Run

DENSE = 0.02  # solid fraction from which on a cell of a map counts
FAST = {0.5: 0, 1.0: 1, 2.0: 2}  # columns of fast_collisions


@dataclasses.dataclass(frozen=True)
class Quantity:
    """One thing that is compared: its name, unit, allowed deviation [%], and whether the summary of RESULTS.md has
    it."""

    key: str
    name: str
    unit: str
    band: float
    headline: bool = False


STEADY = [
    Quantity("power", "rotor power", "W", 5, True),
    Quantity("kinetic", "kinetic energy", "J", 2, True),
    Quantity("rotational", "rotational energy", "J", 8, True),
    Quantity("normal", "power lost in normal direction", "W", 8, True),
    Quantity("ball_1", "ball-ball impacts above 1 m/s", "/s", 6, True),
    Quantity("ball_2", "ball-ball impacts above 2 m/s", "/s", 3, True),
    Quantity("drum_1", "drum impacts above 1 m/s", "/s", 8, True),
    Quantity("wall_1", "end-wall impacts above 1 m/s", "/s", 10),
    Quantity("blade_strikes", "blade strikes above 1 m/s", "/s", 10, True),
]


class Window:
    """The sampled window of a run, whole and in blocks of revolutions."""

    def __init__(self, path):
        self.path = path
        with Run(path) as run:
            self.begin, self.end = run.window
            period = run.period  # of the slowest motion
            blocks = int((self.end - self.begin) / period * (1 + 1e-9))
            self.edges = self.begin + period * np.arange(blocks + 1)
            self.values = {}  # of the whole window
            self.blocks = {}  # of each block
            self._measure(run)

    def _rate(self, key, time, sums):
        self.values[key] = np.diff(np.interp([self.begin, self.end], time, sums))[0] / (self.end - self.begin)
        self.blocks[key] = np.diff(np.interp(self.edges, time, sums)) / np.diff(self.edges)

    def _mean(self, key, time, values):
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(time)
        self._rate(key, time, np.concatenate([[0.0], np.cumsum(steps)]))

    def _measure(self, run):
        self._rate("power", *run.drive_work())
        self._mean("kinetic", *run.series("kinetic_energy"))
        self._mean("rotational", *run.series("rotational_energy"))
        for key, name in (("normal", "dissipation_normal"), ("loss", "dissipation")):
            losses = [run.series(f"{name}/{kind}") for kind in run.kinds]
            self._rate(key, losses[0][0], sum(loss for _, loss in losses))
        for kind in run.kinds:
            time, fast = run.series(f"fast_collisions/{kind}")
            for speed, column in FAST.items():
                self._rate(f"{kind.removeprefix('ball_')}_{speed:g}", time, fast[:, column])
                if run.vessel and kind in run.vessel_kinds:
                    self._rate(f"vessel_{speed:g}", time, fast[:, column])
        for kind in run.kinds:
            self._strikes(run, kind, kind.removeprefix("ball_"), 1.0)
        if run.vessel:
            self._strikes(run, run.vessel_kinds[0], "vessel", 0.5)
            self._strikes(run, "ball_ball", "ball", 0.5, "ball_slow_strikes")
        self.values["all"] = float(run.statistic("impacts/all/rate"))
        slow = run.histogram("all")
        self.values["slow"] = self.values["all"] - slow.above(0.05) / run.duration

    def _strikes(self, run, kind, name, speed, key=None):
        """Of the whole window, for that is all that is told of them: the blocks are those of all impacts, scaled."""
        strikes = run.histogram(kind, "strikes").above(speed) / run.duration
        impacts, blocks = (of[f"{name}_{speed:g}"] for of in (self.values, self.blocks))
        key = key or f"{name}_strikes"
        self.values[key], self.blocks[key] = (
            strikes,
            blocks * (strikes / impacts if impacts else np.nan),
        )

    def error(self, key):
        """Standard error of the mean from the blocks; NaN of fewer than two."""
        blocks = self.blocks[key]
        return blocks.std(ddof=1) / np.sqrt(len(blocks)) if len(blocks) > 1 else np.nan


@dataclasses.dataclass(frozen=True)
class Verdict:
    """One quantity of both programs, and how far millsim is off LIGGGHTS [%], with its standard error [%]."""

    quantity: Quantity
    hard: float
    soft: float
    off: float
    error: float
    scatter: float  # [%] of one run of millsim, from seed to seed
    blocks: float  # [%] standard error of LIGGGHTS' run from its own blocks; NaN: too few


def judge(quantity, soft, hard):
    """soft: the Windows of LIGGGHTS; hard: those of millsim's seeds, more than one."""
    key = quantity.key
    values = np.array([run.values[key] for run in hard])
    reference = np.mean([run.values[key] for run in soft])
    scatter = values.std(ddof=1)
    blocks = np.sqrt(np.mean([run.error(key) ** 2 for run in soft]))
    own = np.fmax(scatter, blocks) / np.sqrt(len(soft))
    error = np.hypot(own, scatter / np.sqrt(len(hard)))
    percent = 100 / reference
    return Verdict(
        quantity,
        values.mean(),
        reference,
        percent * (values.mean() - reference),
        percent * error,
        percent * scatter,
        percent * blocks,
    )


def claim(case, verdict, against, band=None, suffix="", headline=None, known=""):
    """States a Verdict; band [%]: another than the quantity's."""
    quantity = verdict.quantity
    case.claim(
        f"{quantity.name}{suffix}: millsim {verdict.hard:.5g} {quantity.unit}",
        verdict.off,
        0,
        quantity.band if band is None else band,
        error=verdict.error,
        unit="%",
        against=f"{against}: {verdict.soft:.5g} {quantity.unit}",
        headline=quantity.headline if headline is None else headline,
        known=known,
    )


# --- Maps ---------------------------------------------------------------------------------------------------------

COMPONENTS = {
    "cross_section": ("velocity_x", "velocity_y", "velocity_z"),
    "axial": ("velocity_x", "velocity_r", "velocity_phi"),
}


@dataclasses.dataclass(frozen=True)
class Map:
    """Mean solid fraction (A, B) and velocity (A, B, 3) [m/s] of balls in the cells of a view."""

    solid: np.ndarray
    velocity: np.ndarray


def read_map(path, view):
    """The Map of a run; zero where no ball ever was and outside the drum."""
    with Run(path) as run:
        solid = np.nan_to_num(run.map("solid_fraction", view))
        velocity = np.stack([run.map(name, view) for name in COMPONENTS[view]], axis=-1)
    return Map(solid, np.nan_to_num(velocity))


def mean_map(maps):
    """Mean over runs; velocities weigh as the balls that have them."""
    solid = np.mean([m.solid for m in maps], axis=0)
    flow = np.mean([m.solid[..., None] * m.velocity for m in maps], axis=0)
    return Map(solid, flow / np.where(solid > 0, solid, 1.0)[..., None])


def velocity_off(one, other):
    """sqrt(sum phi |v - v'|^2 / sum phi |v'|^2) over the cells where the solid fractions of both exceed DENSE; phi is
    that of `other`."""
    cells = (one.solid > DENSE) & (other.solid > DENSE)
    weight = np.where(cells, other.solid, 0.0)
    difference = ((one.velocity - other.velocity) ** 2).sum(axis=-1)
    return np.sqrt((weight * difference).sum() / (weight * (other.velocity**2).sum(axis=-1)).sum())


def solid_off(one, other):
    """sqrt(sum (phi - phi')^2 / sum phi'^2) over the same cells."""
    cells = (one.solid > DENSE) & (other.solid > DENSE)
    return np.sqrt(((one.solid - other.solid)[cells] ** 2).sum() / (other.solid[cells] ** 2).sum())


def map_verdict(soft, hard, view, measure):
    """How far the mean map of millsim's runs is off that of LIGGGHTS' run, and how far noise alone would put it.

    Noise: what single runs of millsim are off the mean of the others, in quadrature as seen by one run against a
    mean of n.
    """
    maps = [read_map(path, view) for path in hard]
    off = measure(mean_map(maps), read_map(soft, view))
    others = [mean_map(maps[:k] + maps[k + 1 :]) for k in range(len(maps))]
    squares = [measure(single, rest) ** 2 for single, rest in zip(maps, others, strict=True)]
    return off, np.sqrt(np.mean(squares))
