"""Does the true value lie within the 95 % interval that a short run reports?"""

import h5py
import matplotlib.pyplot as plt
import numpy as np

REVOLUTION, BEGIN = 0.05, 0.15  # [s]
WINDOWS = (5, 7.5, 10, 15)  # revolutions, one of them not whole
SEEDS = 50  # of each window
LEAST, MOST = 92, 98  # [%] of the runs that tell an error
QUANTITIES = {  # name -> (group below /statistics/precision, column, unit)
    "rotor power": ("rotor_power", (), "W"),
    "median v_n above the floor": ("median_above_floor", (), "m/s"),
    "rate of impacts above 1 m/s": ("fast_rate/all", 1, "1/s"),
}
HISTOGRAM = "statistics/impacts/all/normal_speed/histogram"


def check(case):
    windows, told, true = runs(case)
    for name in QUANTITIES:
        known = np.isfinite(told[name][:, 1])
        off, reach = told[name][known, 0] - true[name], 1.96 * told[name][known, 1]
        case.claim(
            f"{len(off)} runs of 5 to 15 revolutions: fraction whose 95 % interval of the {name} "
            "contains the true value",
            100 * np.mean(abs(off) <= reach),
            (LEAST + MOST) / 2,
            (MOST - LEAST) / 2,
            unit="%",
            error=100 * np.sqrt(0.05 * 0.95 / len(off)),
            against="value +- 1.96 standard errors",
            headline=True,
        )
    draw(case, windows, told, true)


def runs(case):
    """Revolutions of the window of each run; of each quantity (value, standard error); the true values: of all runs
    together, which are 200 times as long as one of them on average."""
    windows = np.repeat(WINDOWS, SEEDS)
    told = {name: np.empty((len(windows), 2)) for name in QUANTITIES}
    counts = 0
    for run, turns in enumerate(windows):
        path = case.run(
            "short.ini",
            output="short.h5",
            run__seed=run + 1,
            run__time=f"{BEGIN + turns * REVOLUTION} s",
        )
        with h5py.File(path) as file:
            for name, (group, column, _) in QUANTITIES.items():
                mean = file[f"statistics/precision/{group}"]
                told[name][run] = mean["value"][column], mean["standard_error"][column]
            edges = file[f"{HISTOGRAM}/edges"][:]
            least = file["statistics/above_floor"][()]
            counts = counts + file[f"{HISTOGRAM}/count"][:]
    true = {name: np.average(of[:, 0], weights=windows) for name, of in told.items()}
    true["median v_n above the floor"] = median_above(edges, counts, least)
    return windows, told, true


def median_above(edges, counts, least):
    """Log-linear within its bin."""
    counts = np.where(edges[:-1] >= least * (1 - 1e-9), counts, 0)
    below = np.concatenate([[0], np.cumsum(counts)])
    keep = np.concatenate([[True], np.diff(below) > 0])
    return float(np.exp(np.interp(below[-1] / 2, below[keep], np.log(edges[keep]))))


def draw(case, windows, told, true):
    figure, axes = plt.subplots(1, len(QUANTITIES), figsize=(13, 5), layout="constrained")
    shares = []
    for axis, name in zip(axes, QUANTITIES, strict=True):
        off = 100 * (told[name][:, 0] / true[name] - 1)
        reach = 1.96 * 100 * told[name][:, 1] / true[name]
        inside = abs(off) <= reach
        known = np.isfinite(reach)
        shares.append(100 * inside[known].mean())
        order = np.arange(len(off))
        for which, colour, words in (
            (inside, "C0", "contains"),
            (known & ~inside, "C3", "does not contain"),
        ):
            axis.errorbar(
                order[which], off[which], reach[which], fmt=".", ms=3, lw=0.8, color=colour,
                label=f"{which.sum()} runs whose interval {words} the true value",
            )  # fmt: skip
        axis.axhline(0, color="grey", lw=0.8)
        places = SEEDS * (np.arange(len(WINDOWS)) + 0.5)
        axis.set_xticks(places, [f"{turns:g}" for turns in WINDOWS])
        axis.set(xlabel="sampled revolutions, 50 runs each", title=name)
        axis.legend(fontsize=8)
    axes[0].set_ylabel("relative deviation from the true value, with 95 % interval [%]")
    figure.suptitle(
        "The 95 % interval of a short run contains the true value "
        f"in {min(shares):.1f} to {max(shares):.1f} % of 200 runs"
    )
    case.save(figure, "short.png")
    plt.close(figure)
