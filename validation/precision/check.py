"""Precision: are the standard errors that a run reports correct?"""

import json
import math

import h5py
import matplotlib.pyplot as plt
import numpy as np
from precision import short

SEEDS = 32  # of each mill that ends when it is known
ASKED = 0.02
# rpm: from when to when [s], in how many runs, the true means are taken
MILLS = {1000: (0.3, 1.5, 8), 300: (0.8, 3.0, 6)}
MEANS = {
    "rotor_power": ("mean power of the rotor", "rotor/power"),
    "median_above_floor": (
        "median v_n above the floor",
        "impacts/all/normal_speed/median_above_floor",
    ),
}
# Root mean square of the true errors over that of those told
LEAST, MOST = 0.4, 1.5
NEED = {1000: 0.5, 300: 1.6}  # [s] of simulated time for ASKED, on average


def check(case):
    found = {rpm: study(case, rpm) for rpm in MILLS}
    for rpm, mill in found.items():
        claim(case, rpm, mill)
    draw(case, found)
    short.check(case)


# --- The runs -----------------------------------------------------------------------------------------------------


def study(case, rpm):
    """True means, and of each run [value, told error] of both; cuts and ends [s]."""
    begin, end, runs = MILLS[rpm]
    speed = f"{rpm} rpm"
    truth = {name: [] for name in MEANS}
    for seed in range(1001, 1001 + runs):
        path = case.run(
            output="run.h5",
            run__seed=seed,
            rotor__speed=speed,
            run__sample_from=f"{begin} s",
            run__time=f"{end} s",
        )
        with h5py.File(path) as file:
            for name, (_, where) in MEANS.items():
                truth[name].append(file[f"statistics/{where}"][()])
    told = {name: [] for name in MEANS}
    mill = {"cut": [], "end": [], "reached": 0}
    for seed in range(1, 1 + SEEDS):
        path = case.run(output="run.h5", run__seed=seed, rotor__speed=speed, run__precision=f"{ASKED}")
        summary = json.loads(path.with_suffix(".json").read_text())
        precision = summary["statistics"]["precision"]
        for name, of in told.items():
            of.append([precision[name]["value"], precision[name]["standard_error"]])
        mill["cut"].append(precision["warm_up"])
        mill["end"].append(summary["time"])
        mill["reached"] += precision["reached"]
    mill["truth"] = {name: (np.mean(of), np.std(of, ddof=1) / math.sqrt(len(of))) for name, of in truth.items()}
    mill["told"] = {name: np.array(of) for name, of in told.items()}
    return mill


# --- Claims -------------------------------------------------------------------------------------------------------


def errors_of(mill, name):
    """Of each run, relative: the true error, the one told."""
    value, told = mill["told"][name].T
    return value / mill["truth"][name][0] - 1, told / value


def claim(case, rpm, mill):
    for name, (what, _) in MEANS.items():
        true, told = errors_of(mill, name)
        rms, rms_told = (math.sqrt(np.mean(e**2)) for e in (true, told))
        spread = rms / math.sqrt(2 * SEEDS)
        case.bound(
            f"{rpm} rpm, {100 * ASKED:g} % requested: true error of the {what}, rms of {SEEDS} runs",
            100 * rms,
            100 * ASKED,
            error=100 * spread,
            unit="%",
            against="run.precision",
            headline=rpm == 1000,
        )
        case.claim(
            f"{rpm} rpm, {what}: ratio of the true error to the reported error, both rms",
            rms / rms_told,
            (LEAST + MOST) / 2,
            (MOST - LEAST) / 2,
            error=spread / rms_told,
            against="the reported error is the true error",
        )
    case.claim(
        f"{rpm} rpm: fraction of the runs that end by themselves",
        mill["reached"] / SEEDS,
        1,
        0,
        against="run.precision",
    )
    case.bound(
        f"{rpm} rpm: mean simulated time to reach {100 * ASKED:g} %, including the start-up",
        np.mean(mill["end"]),
        NEED[rpm],
        error=np.std(mill["end"], ddof=1) / math.sqrt(SEEDS),
        unit="s",
        against="studies need many runs",
        headline=rpm == 1000,
    )


# --- Figure -------------------------------------------------------------------------------------------------------


def draw(case, found):
    figure, axes = plt.subplots(1, len(found), figsize=(12, 5), layout="constrained")
    for axis, (rpm, mill) in zip(axes, found.items(), strict=True):
        for name, colour, shift in (("rotor_power", "C0", -4), ("median_above_floor", "C1", 4)):
            true, told = errors_of(mill, name)
            axis.errorbar(
                1000 * np.array(mill["end"]) + shift,
                100 * true,
                100 * told,
                fmt="o",
                ms=4,
                capsize=2,
                lw=0.8,
                color=colour,
                label=MEANS[name][0],
            )
        axis.axhspan(-100 * ASKED, 100 * ASKED, color="C2", alpha=0.12, label="requested precision")
        axis.axhline(0, color="grey", lw=0.8)
        axis.set(
            xlabel="simulated time at the end of the run [ms]",
            ylabel="true error, with the reported error as a bar [%]",
            title=f"{rpm} rpm, {SEEDS} seeds, {100 * ASKED:g} % requested",
        )
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=9)
    case.save(figure)
    plt.close(figure)
