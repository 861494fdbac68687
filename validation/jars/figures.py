"""The figures: power and hard impacts over the ratio, how same mills part, one ball's swing, and prisms."""

import matplotlib.pyplot as plt
import numpy as np
from jars.prisms import FACETS, RADIUS, A


def ratio(case, told):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    names = ("power [W]", "impacts above 1 m/s [1/s]")
    for column, (axis, name) in enumerate(zip(axes, names)):
        for number, (charge, (ratios, both, critical)) in enumerate(told.items()):
            values = both[..., column]
            error = values.std(axis=0, ddof=1) / np.sqrt(len(values))
            axis.errorbar(
                ratios,
                values.mean(axis=0),
                2 * error,
                fmt="o-",
                ms=4,
                lw=1,
                color=f"C{number}",
                label=charge,
            )
            axis.axvline(critical, color=f"C{number}", ls="--", lw=1)
        axis.plot([], [], "k--", lw=1, label=r"$-(1 + \sqrt{R/(r-a)})$: the wall holds a ball all the way round")
        axis.set(
            xlabel="ratio k of jar to disk speed, as seen from the disk [1]",
            ylabel=name,
            ylim=(0, None),
        )
        axis.legend(fontsize=8, loc="lower center")
    axes[0].set_title("With 20 balls the power is largest near this ratio")
    axes[1].set_title("Beyond this ratio the wall holds the balls")
    case.save(figure, "ratio.png")
    plt.close(figure)


def same(case, curves, mixed):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained", sharey=True)
    for name, curve in curves.items():
        axes[0].plot(np.maximum(curve, 1e-18), "." if "nudged" not in name else "k-", ms=2, lw=1, label=name)
    axes[0].set(yscale="log", xlabel="impact [1]", ylabel="difference of the times [s]", ylim=(1e-18, 1e-5))
    axes[0].set_title("Equivalent mills differ only by rounding errors")
    for number, one in enumerate(mixed):
        axes[1].plot(np.maximum(one["off"], 1e-18), "o", ms=3, color=f"C{number}")
        axes[1].plot(np.maximum(one["twin"], 1e-18), "-", lw=1, color=f"C{number}")
    axes[1].plot([], [], "ko", ms=3, label="program compared with 40 digits")
    axes[1].plot([], [], "k-", lw=1, label="40 digits, two starts 1e-15 m apart")
    axes[1].set(xlabel="impact [1]")
    axes[1].set_title("Ball in a mixer mill: rounding errors that have grown")
    axes[0].legend(fontsize=8, loc="lower right", markerscale=5)
    axes[1].legend(fontsize=8, loc="lower right")
    case.save(figure, "same.png")
    plt.close(figure)


def swing_and_prisms(case, swings, sizes):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    for number, (name, (time, angle, frequency)) in enumerate(swings.items()):
        shown = time < 0.1
        axes[0].plot(
            1e3 * time[shown],
            np.degrees(angle[shown]),
            color=f"C{number}",
            lw=2.5,
            alpha=0.5,
            label=name,
        )
        axes[0].plot(1e3 * time[shown], 3 * np.cos(2 * np.pi * frequency * time[shown]), "k--", lw=0.8)
    axes[0].plot([], [], "k--", lw=0.8, label="pendulum")
    axes[0].set(xlabel="time [ms]", ylabel="from the outermost point [deg]")
    axes[0].set_title("One ball swings about the outermost point")
    axes[0].legend(fontsize=8, loc="lower left")
    n = np.array(FACETS, float)
    axes[1].loglog(n, 1e6 * sizes, "o", label=f"jar of {2e3 * RADIUS:g} mm, balls of {2e3 * A:g} mm")
    line = 1e6 * sizes[-1] * (n[-1] / n) ** 2
    axes[1].loglog(n, line, "k--", lw=1, label=r"$\sim 1/n^2$")
    axes[1].set(xlabel="number of facets n [1]", ylabel=r"mean difference of the first impact times [$\mu$s]")
    axes[1].set_title("Prism instead of cylinder: difference ~ 1/n^2")
    axes[1].set_xticks(FACETS, [f"{count}" for count in FACETS])
    axes[1].minorticks_off()
    axes[1].legend(fontsize=8)
    case.save(figure, "swing.png")
    plt.close(figure)
