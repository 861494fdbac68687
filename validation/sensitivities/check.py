"""Sensitivities: what the rebound floor changes, and how long to run."""

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

DEFAULT = 5e-3  # rebound floor [m/s]
FLOORS = (1e-4, 1e-3, DEFAULT, 1e-2, 5e-2)
USEFUL = (1e-4, 1e-3, DEFAULT, 1e-2)  # of these nothing but slow contacts should depend
SEEDS = 7  # of each floor
LOGGED_SEEDS = 8  # of the default, with every impact logged
ALIKE = 0.03  # what a useful floor may change

START, REVOLUTION, REVOLUTIONS = 0.15, 0.06, 6
BLOCKS = (1, 2, 3, 6)  # revolutions

BALL_MASS = 7800 * np.pi / 6 * 0.005**3
SPEED = 1000 * np.pi / 30 * 0.075  # [m/s] of the rotor at the drum
LET_GO = 10 * 2 * BALL_MASS * SPEED**2  # [J] of ten elastic impacts at that speed
SLOW = 0.05  # [m/s], below it a contact is slow

QUANTITIES = {
    "power": "mean power of the rotor",
    "fast": "median v_n above 50 mm/s",
    "strikes": "median v_n of strikes",
    "median": "median v_n of all impacts",
}
COLOURS = {"power": "C0", "fast": "C1", "strikes": "C3", "median": "C2"}


def check(case):
    runs = {floor: floor_runs(case, floor) for floor in FLOORS}
    means, errors = means_by_floor(runs)
    claim_floor(case, runs, means, errors)
    lengths = claim_length(case, runs)
    draw(case, means, errors, lengths)


# --- The runs -----------------------------------------------------------------------------------------------------


def floor_runs(case, floor):
    logged = floor == DEFAULT
    results = []
    for seed in range(1, 1 + (LOGGED_SEEDS if logged else SEEDS)):
        path = case.run(
            output="run.h5",
            run__seed=seed,
            contact__rebound_floor=f"{floor} m/s",
            output__impacts="all" if logged else "statistics",
        )
        with h5py.File(path) as file:
            results.append(measure(file, floor))
            if logged:
                results[-1] |= blocks_of_impacts(file)
        path.unlink()  # a log is large
    return results


def measure(file, floor):
    statistics = file["statistics"]
    speed = statistics["impacts/all/normal_speed"]
    return {
        "power": statistics["rotor/power"][()],
        "power_error": statistics["rotor/power_error"][()],
        "block_power": statistics["rotor/block_power"][:],
        "median": speed["median"][()],
        "fast": speed["median_above_floor"][()],
        "strikes": statistics["strikes/all/normal_speed/median"][()],
        "share": statistics["floor_share/all"][()],
        "given": given_power(statistics, floor) / statistics["impacts/all/dissipated_power"][()],
        "reliefs": file["run/reliefs"][()],
        "work": file["observables/rotor_work/value"][-1],
    }


def given_power(statistics, floor):
    """Power that the floor gives to contacts slower than itself: m* (v_r^2 - v_n^2) / 2 each."""
    given = 0.0
    for kind in sorted(statistics["impacts"].keys() - {"all"}):
        histogram = statistics[f"impacts/{kind}/normal_speed/histogram"]
        edges, count = histogram["edges"][:], histogram["count"][:]
        squares = edges[1:] * edges[:-1]
        mass = BALL_MASS / 2 if kind == "ball_ball" else BALL_MASS
        given += (count * mass / 2 * np.maximum(floor**2 - squares, 0)).sum()
        given += histogram["count"].attrs["underflow"] * mass / 2 * floor**2
    return given / statistics["duration"][()]


def blocks_of_impacts(file):
    """Medians of blocks of one, two, ... revolutions, by the length of the block."""
    time, speed = file["impacts/time"][:], file["impacts/normal_speed"][:]
    result = {"blocks_median": {}, "blocks_fast": {}}
    for length in BLOCKS:
        edges = START + REVOLUTION * np.arange(0, REVOLUTIONS + 1, length)
        parts = np.split(speed, np.searchsorted(time, edges))[1:-1]
        result["blocks_median"][length] = [np.median(part) for part in parts]
        result["blocks_fast"][length] = [np.median(part[part >= SLOW]) for part in parts]
    return result


# --- The rebound floor --------------------------------------------------------------------------------------------


def means_by_floor(runs):
    """Means over the seeds, and standard errors from the scatter of the seeds, pooled over the floors."""
    means, errors = {}, {}
    for name in (*QUANTITIES, "share", "given"):
        samples = [np.array([run[name] for run in runs[floor]]) for floor in FLOORS]
        means[name] = np.array([s.mean() for s in samples])
        freedom = sum(len(s) - 1 for s in samples)
        relative = sum(((s / s.mean() - 1) ** 2).sum() for s in samples) / freedom
        errors[name] = means[name] * np.sqrt(relative / [len(s) for s in samples])
    return means, errors


def claim_floor(case, runs, means, errors):
    default = FLOORS.index(DEFAULT)
    for name in ("power", "fast"):
        value, error = means[name], errors[name] / means[name]
        for k, floor in enumerate(FLOORS):
            if floor not in USEFUL or floor == DEFAULT:
                continue
            case.bound(
                f"{QUANTITIES[name]}: change when the rebound floor is {1000 * floor:g} mm/s instead of 5 mm/s",
                100 * (value[k] / value[default] - 1),
                100 * ALIKE,
                error=100 * np.hypot(error[k], error[default]),
                unit="%",
                against="slow contacts have hardly any energy",
                headline=name == "power" and floor == 1e-4,
            )
    samples = [[run["median"] for run in runs[floor]] for floor in (FLOORS[0], FLOORS[-1])]
    case.bound(
        "median v_n of all impacts does depend on the floor: probability that it does not rise from 0.1 to 50 mm/s",
        stats.ttest_ind(*samples, equal_var=False, alternative="less").pvalue,
        1e-4,
        against="Welch's test, the seeds of both floors",
    )
    case.bound(
        "fraction of impacts that are at the floor, default floor",
        100 * means["share"][default],
        5,
        error=100 * errors["share"][default],
        unit="%",
        against="few contacts are that slow",
    )
    useful = [FLOORS.index(floor) for floor in USEFUL]
    case.bound(
        "energy that the floor adds, divided by the dissipated energy, largest value of the floors up to 10 mm/s",
        means["given"][useful].max(),
        1e-4,
        against="sum of m* (v_r^2 - v_n^2)/2 over the impacts slower than the floor",
    )
    many = [run for floor in USEFUL if floor >= 1e-3 for run in runs[floor]]
    case.bound(
        "largest energy that pinched balls can get when they are let go, divided by the work of the rotor, "
        "floors from 1 to 10 mm/s",
        sum(run["reliefs"] for run in many) * LET_GO / sum(run["work"] for run in many),
        1e-3,
        against="ten elastic impacts of a blade for each relief (docs/physics.md, pinches)",
    )


# --- How long to run ----------------------------------------------------------------------------------------------


def claim_length(case, runs):
    """Standard deviations of block means against the length of a block; returns them for the figure."""
    power = [run for floor in FLOORS for run in centred(runs[floor])]
    sets = {
        "power": [{n: row.reshape(-1, n).mean(axis=1) for n in BLOCKS} for row in power],
        "fast": [relative_blocks(run["blocks_fast"], runs[DEFAULT], "fast") for run in runs[DEFAULT]],
        "median": [relative_blocks(run["blocks_median"], runs[DEFAULT], "median") for run in runs[DEFAULT]],
    }
    groups = {"power": len(FLOORS), "fast": 1, "median": 1}
    lengths = {}
    for name, rows in sets.items():
        deviation, slope, error = scaling(rows, groups[name])
        lengths[name] = deviation
        if name == "power":  # 38 runs; the eight of the medians are too few to say
            case.claim(
                f"{QUANTITIES[name]}: exponent of the sampled time in its standard error",
                slope,
                -0.5,
                4 * error,
                error=error,
                against="independent revolutions: 1/sqrt(time)",
            )
        case.bound(
            f"{QUANTITIES[name]}: sampled time needed for a standard error of 1 %",
            REVOLUTION * (deviation[0] / 0.01) ** 2,
            1.0,
            unit="s",
            error=REVOLUTION * (deviation[0] / 0.01) ** 2 * np.sqrt(2 / (len(rows) * REVOLUTIONS)),
            against="scatter of single revolutions",
            headline=name == "power",
        )
    claim_printed_error(case, runs)
    return lengths


def centred(runs):
    """Powers of the revolutions of each run over the mean of all runs, less 1."""
    rows = np.array([run["block_power"] for run in runs])
    return rows / rows.mean() - 1


def relative_blocks(blocks, runs, name):
    mean = np.mean([run[name] for run in runs])
    return {n: np.array(values) / mean - 1 for n, values in blocks.items()}


def scaling(rows, groups):
    """Standard deviations over BLOCKS, the exponent of a power law, and its error by leaving out runs one by one."""

    def fit(rows):
        deviation = np.array([pooled(np.concatenate([r[n] for r in rows]), groups) for n in BLOCKS])
        weights = 1 / np.sqrt(BLOCKS)  # errors of the deviations go with the square root of the length
        return deviation, np.polyfit(np.log(BLOCKS), np.log(deviation), 1, w=weights)[0]

    deviation, slope = fit(rows)
    without = np.array([fit(rows[:k] + rows[k + 1 :])[1] for k in range(len(rows))])
    error = np.sqrt((len(rows) - 1) / len(rows) * ((without - without.mean()) ** 2).sum())
    return deviation, slope, error


def pooled(values, groups):
    """Standard deviation of values that were centred in so many groups."""
    if groups == 1:
        return values.std(ddof=1)
    return np.sqrt((values**2).sum() / (len(values) - groups))


def claim_printed_error(case, runs):
    """Is the standard error of the power, as each run prints it, what the seeds scatter by?"""
    powers = [np.array([run["power"] for run in runs[floor]]) for floor in FLOORS]
    freedom = sum(len(p) - 1 for p in powers)
    scatter = np.sqrt(sum(((p - p.mean()) ** 2).sum() for p in powers) / freedom)
    said = np.array([run["power_error"] for floor in FLOORS for run in runs[floor]])
    ratio = np.sqrt((said**2).mean()) / scatter
    error = ratio * np.sqrt(1 / (2 * freedom) + 1 / (2 * len(said) * (REVOLUTIONS - 1)))
    case.claim(
        "ratio of the standard error of the power that a run prints to the scatter of the seeds",
        ratio,
        1,
        4 * error,
        error=error,
        against="revolutions are independent of each other",
    )


# --- Figure -------------------------------------------------------------------------------------------------------


def draw(case, means, errors, lengths):
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    default = FLOORS.index(DEFAULT)
    floors = 1000 * np.array(FLOORS)
    # Three of the four lie on each other: the markers are nested
    for (name, label), size in zip(QUANTITIES.items(), (12, 8, 4, 5), strict=True):
        scale = 100 / means[name][default]
        left.errorbar(
            floors,
            scale * means[name],
            scale * errors[name],
            fmt="o-",
            ms=size,
            mfc="none" if size > 5 else None,
            capsize=3,
            color=COLOURS[name],
            label=label,
        )
    left.plot(floors, 100 * means["share"], "s:", color="grey", label="fraction of impacts at the floor")
    left.axhspan(100 - 100 * ALIKE, 100 + 100 * ALIKE, color="C2", alpha=0.12, label="band of the claims")
    left.axvline(1000 * DEFAULT, color="grey", lw=0.8)
    left.text(1000 * DEFAULT, 8, " default", color="grey")
    left.set(
        xscale="log",
        xlabel="rebound floor [mm/s]",
        ylabel="value / value at 5 mm/s [%], fraction [%]",
        title="Power and fast impacts do not depend on the floor",
    )
    time = REVOLUTION * np.array(BLOCKS)
    long = np.geomspace(REVOLUTION, 3, 50)
    for name, deviation in lengths.items():
        right.plot(time, 100 * deviation, "o", color=COLOURS[name], label=QUANTITIES[name])
        line = 100 * deviation[0] * np.sqrt(REVOLUTION / long)
        right.plot(long, line, color=COLOURS[name], lw=1)
    right.plot([], [], color="grey", lw=1, label="1/sqrt(time), through the first point")
    right.axhline(1, color="grey", ls=":", lw=1)
    right.set(
        xscale="log",
        yscale="log",
        xlabel="sampled time [s]",
        ylabel="relative standard error [%]",
        title="Half a second of sampled time gives an error of one per cent",
    )
    percents = [0.3, 0.5, 1, 2, 3]
    right.set_yticks(percents, [f"{p:g}" for p in percents])
    right.set_yticks([], minor=True)
    left.legend(fontsize=9, loc="center right", bbox_to_anchor=(1, 0.45))
    right.legend(fontsize=9)
    for axis in (left, right):
        axis.grid(alpha=0.3, which="both")
    case.save(figure)
    plt.close(figure)
