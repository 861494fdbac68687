"""The figures."""

import matplotlib.pyplot as plt
import numpy as np
from balances.atmosphere import INNER, compressibility, over_seeds


def draw_mills(case, mill, steady):
    time, work, loss, energy = mill
    figure, axes = plt.subplots(1, 3, figsize=(13, 4))
    ax = axes[0]
    since = time[50:] - time[0]
    off = (loss[50:] - loss[0] - work[50:] + work[0]) / since
    error = np.sqrt(2.0) * energy.std() / since
    ax.fill_between(since, -4.0 * error, 4.0 * error, color="0.85", label="4 standard errors")
    ax.plot(since, off, color="C0", lw=1, label="measured")
    ax.axhline(0.0, color="k", ls="--", lw=1, label="theory")
    ax.set(
        xlabel="length of the window [s]",
        ylabel="losses minus power of the rotor [W]",
        title=f"reference mill, {np.ptp(work) / np.ptp(time):.0f} W",
    )
    ax.legend()
    bins, (force, moment), weight, weight_torque = steady
    for ax, values, level, text in (
        (axes[1], force, weight, "vertical force of all surfaces [N]"),
        (axes[2], 1e3 * moment, -1e3 * weight_torque, "torque of shaft and blades [mN m]"),
    ):
        mean = values.cumsum() / np.arange(1, len(values) + 1)
        ax.plot(bins - 0.025, values, ".", color="0.7", label="blocks of 50 ms")
        ax.plot(bins, mean, color="C0", label="mean from the beginning on")
        ax.axhline(level, color="k", ls="--", lw=1)
        ax.set(xlabel="time [s]", ylabel=text, title="smooth mill")
    axes[1].plot([], [], "k--", lw=1, label=r"$N m g$")
    axes[2].plot([], [], "k--", lw=1, label=r"$N m g \langle y \rangle$, whole window")
    axes[1].legend(loc="lower right", fontsize=8)
    axes[2].legend(loc="upper right", fontsize=8)
    axes[2].set_ylim(-1.0, 33.0)
    figure.tight_layout()
    case.save(figure, "mills.png")
    plt.close(figure)


def draw_atmosphere(case, runs):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2))
    middle = 500.0 * (runs[0].edges[1:] + runs[0].edges[:-1])
    packing, error = over_seeds([run.packing for run in runs])
    theory, _ = over_seeds([run.theory(INNER) for run in runs])
    inner = slice(INNER.start, INNER.stop)
    ax = axes[0]
    ax.errorbar(packing, middle, xerr=4.0 * error, fmt=".", color="C0", label="slices, 4 standard errors")
    ax.plot(theory, middle[inner], "k-", lw=1, label="Carnahan-Starling")
    ax.set(xlabel="packing", ylabel="height [mm]", title="core of the atmosphere")
    ax.legend()
    ax = axes[1]
    z = [run.pressure * run.ball / run.packing / run.mean_temperature for run in runs]
    off = [100.0 * (v / compressibility(run.packing) - 1.0) for v, run in zip(z, runs)]
    off, error = over_seeds(off)
    ax.errorbar(packing[inner], off[inner], 4.0 * error[inner], fmt=".", label="4 standard errors")
    ax.axhline(0.0, color="k", lw=1, label="Carnahan-Starling")
    ax.set(xlabel="packing", ylabel="deviation of p / nT from theory [%]", title="equation of state")
    ax.legend()
    figure.tight_layout()
    case.save(figure, "atmosphere.png")
    plt.close(figure)
