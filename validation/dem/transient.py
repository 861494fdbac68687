"""The first 100 ms of the reference mill without friction, from rest, in LIGGGHTS and millsim from the same positions.

A smooth mill has no useful steady state, so the start is compared. There is one start for each seed; millsim runs
with many.
"""

import matplotlib.pyplot as plt
import numpy as np
from mills import Quantity, claim, judge
from runs import LABELS, ROOT, STIFFNESSES, contact_duration, say

from milltools.read.runfile import Run

DECK = ROOT / "input" / "simoloyer.ini"
SETTINGS = {"run__time": "0.1 s", "run__sample_from": "0 s", "contact__friction": 0}
SEEDS = 3  # of LIGGGHTS at each stiffness
HARD_SEEDS = 16  # of millsim
END, HALF = 0.1, 0.05  # [s]
MASS = 7800 * np.pi / 6 * 0.005**3

QUANTITIES = [
    Quantity("power", "rotor power, 0 to 100 ms", "W", 3, True),
    Quantity("first", "rotor power, 0 to 50 ms", "W", 3),
    Quantity("second", "rotor power, 50 to 100 ms", "W", 3),
    Quantity("kinetic", "kinetic energy, mean of 0 to 100 ms", "J", 2, True),
    Quantity("end", "kinetic energy at 100 ms", "J", 2),
    Quantity("loss", "dissipated power, 0 to 100 ms", "W", 3, True),
    Quantity("ball_1", "ball-ball impacts above 1 m/s", "/s", 4, True),
]
SCATTERS = ("power", "kinetic", "loss", "ball_1")


class Transient:
    """What is compared of one run; no blocks: there is only one start in it."""

    def __init__(self, path):
        with Run(path) as run:
            time, work = run.series("rotor_work")
            self.time, self.work = time, work
            _, self.kinetic = run.series("kinetic_energy")
            self.loss = sum(run.series(f"dissipation/{kind}")[1] for kind in run.kinds)
            _, fast = run.series("fast_collisions/ball_ball")
            self.spectrum = run.histogram("ball_ball")
            self.cost = run.cost
        if abs(time[-1] - END) > 1e-9:
            raise RuntimeError(f"{path}: ends at {time[-1]} s, not at {END} s")
        half = int(np.argmin(np.abs(time - HALF)))
        self.values = {
            "power": work[-1] / END,
            "first": work[half] / HALF,
            "second": (work[-1] - work[half]) / (END - HALF),
            "kinetic": np.trapezoid(self.kinetic, time) / END,
            "end": self.kinetic[-1],
            "loss": self.loss[-1] / END,
            "ball_1": fast[-1, 1] / END,
        }

    def error(self, _):
        """See the class."""
        return np.nan


def check(case):
    say("    frictionless transient")
    hard = [Transient(path) for path in case.seeds(HARD_SEEDS, DECK, **SETTINGS)]
    soft = {}
    for name, modulus in STIFFNESSES.items():
        window = f"{contact_duration((DECK, ()), modulus)} s"
        settings = SETTINGS | {"output__strike_window": window}
        paths = [
            case.dem(f"transient-{name}-{seed}", DECK, name, **settings, run__seed=seed) for seed in range(1, SEEDS + 1)
        ]
        soft[name] = [Transient(path) for path in paths]
        compare(case, name, soft[name], hard)
    scatter(case, soft, hard)
    same_place(case, paths[0], case.run(DECK, **SETTINGS, run__seed=1))
    draw(case, soft, hard)


def compare(case, name, soft, hard):
    """Claims at steel; what softer balls do is told."""
    verdicts = [judge(quantity, soft, hard) for quantity in QUANTITIES]
    if name == "steel":
        for verdict in verdicts:
            claim(case, verdict, f"LIGGGHTS, {LABELS[name]}, {SEEDS} starts")
        return
    case.tell(
        f"At {LABELS[name]}, softer than steel, millsim deviates from LIGGGHTS by "
        + ", ".join(f"{v.off:+.1f} +- {v.error:.1f} % ({v.quantity.name})" for v in verdicts)
        + "."
    )


def scatter(case, soft, hard):
    """Runs of LIGGGHTS scatter from start to start as those of millsim do: the standard errors rest on that."""
    ratios = []
    for runs in soft.values():
        for key in SCATTERS:
            own = np.std([run.values[key] for run in runs], ddof=1)
            ratios.append((own / np.std([run.values[key] for run in hard], ddof=1)) ** 2)
    freedom = (SEEDS - 1) * len(soft)  # the quantities hang together: one of them counts
    case.claim(
        "ratio of the scatter of LIGGGHTS from start to start to that of millsim, rms of power, energy, loss, rate",
        np.sqrt(np.mean(ratios)),
        1,
        3 / np.sqrt(2 * freedom),
        error=1 / np.sqrt(2 * freedom),
        against="both programs are equally chaotic",
    )


def same_place(case, soft, hard):
    """Both begin with the same balls in the same places."""
    with Run(soft) as one, Run(hard) as other:
        off = np.abs(one.frame(0, "position") - other.frame(0, "position")).max()
    case.bound(
        "positions of the balls at the start, largest difference",
        off,
        0,
        unit="m",
        against="both programs start from the same positions",
    )


def draw(case, soft, hard):
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.4), layout="constrained")
    time = 1e3 * hard[0].time
    power, energy, rates = axes
    width = 4  # rows, for a running mean

    def powers(run):
        return (run.work[width:] - run.work[:-width]) / (run.time[width:] - run.time[:-width])

    middle = 0.5 * (time[width:] + time[:-width])
    for axis, when, values in (
        (power, middle, np.array([powers(run) for run in hard])),
        (energy, time, np.array([run.kinetic for run in hard])),
    ):
        mean, spread = values.mean(axis=0), values.std(axis=0, ddof=1)
        label = f"millsim, {len(hard)} starts, +- 1 standard deviation"
        axis.fill_between(when, mean - spread, mean + spread, color="k", alpha=0.2, lw=0, label=label)
        axis.plot(when, mean, color="k", lw=1)
    for k, (name, runs) in enumerate(soft.items()):
        label = f"LIGGGHTS, {LABELS[name]}, mean of {len(runs)}"
        power.plot(middle, np.mean([powers(r) for r in runs], axis=0), color=f"C{k}", lw=1, label=label)
        energy.plot(time, np.mean([r.kinetic for r in runs], axis=0), color=f"C{k}", lw=1, label=label)
        draw_spectrum(rates, runs, f"C{k}", LABELS[name])
    draw_spectrum(rates, hard, "k", "millsim")
    power.set(xlabel="time [ms]", ylabel="rotor power, mean of 4 ms [W]", title="Frictionless start")
    energy.set(xlabel="time [ms]", ylabel="kinetic energy [J]", title="Frictionless start")
    rates.set(
        xscale="log",
        xlim=(0.02, 12),
        xlabel="normal speed of ball-ball impacts [m/s]",
        ylabel="impacts per second and unit of ln(speed) [1/s]",
        title="Impacts from 0 to 100 ms",
    )
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    case.save(figure, "transient.png")
    plt.close(figure)


def draw_spectrum(axis, runs, colour, label):
    """Rate of impacts by the logarithm of their speed, mean of the runs, five bins in one."""
    edges = runs[0].spectrum.edges[::5]
    count = np.mean([run.spectrum.count for run in runs], axis=0)
    count = count[: 5 * (len(edges) - 1)].reshape(-1, 5).sum(axis=1)
    axis.stairs(count / END / np.diff(np.log(edges)), edges, color=colour, label=label)
