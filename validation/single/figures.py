"""The two figures: Foerster's curve of oblique impacts, and the errors of all contact times."""

import matplotlib.pyplot as plt
import numpy as np
from single.common import TIME_BOUND

LOWEST = 1e-18  # [s] errors below are drawn here


def oblique(case, results):
    figure, axis = plt.subplots(figsize=(8.0, 5.4), layout="constrained")
    psi = np.linspace(0, 8, 801)
    for number, (law, result) in enumerate(results):
        colour = f"C{number}"
        before, after = result["curve"]
        shown = before <= psi[-1]
        axis.plot(psi, law.slip_after(1.0, psi), color=colour, linewidth=1)
        sticks = law.sticks(1.0, before)
        label = f"e {law.e:g}, $\\mu$ {law.mu:g}, $\\beta_0$ {law.beta:g}"
        for part, marker, face in ((sticks, "o", colour), (~sticks, "s", "none")):
            axis.plot(
                before[shown & part],
                after[shown & part],
                marker,
                color=colour,
                markerfacecolor=face,
                markersize=4,
                markeredgewidth=0.8,
                label=label if marker == "s" else None,
            )
    axis.plot([], [], "o", color="black", label="sticking", markersize=4)
    axis.plot([], [], "s", color="black", markerfacecolor="none", label="sliding", markersize=4)
    axis.plot([], [], color="black", linewidth=1, label="Walton's law")
    axis.set_xlabel("slip before / normal speed before, $\\tan\\psi_{in}$ [1]")
    axis.set_ylabel("slip after / normal speed before, $\\tan\\psi_{out}$ [1]")
    axis.set_title("Spinning balls on a flat wall")
    axis.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    axis.set_xlim(0, psi[-1])
    axis.set_ylim(-1.2, 8.2)
    axis.legend(fontsize=8, loc="upper left")
    case.save(figure, "oblique.png")
    plt.close(figure)


def times(case, tally):
    figure, axis = plt.subplots(figsize=(8.0, 6.6), layout="constrained")
    rng = np.random.default_rng(6)
    names = list(tally.groups)
    for row, name in enumerate(names):
        errors = np.maximum(tally.groups[name], LOWEST)
        height = row + rng.uniform(-0.3, 0.3, len(errors))
        axis.plot(errors, height, ".", color="C0", markersize=3, alpha=0.6)
    axis.axvline(TIME_BOUND, color="C3", label=f"bound, {TIME_BOUND:g} s")
    axis.axvline(2.0**-53, color="0.5", linestyle="--", label="half the last digit of a double near 1 s")
    axis.set_xscale("log")
    axis.set_xlim(0.6 * LOWEST, 1e-11)
    axis.set_yticks(range(len(names)), [f"{n} ({len(tally.groups[n])})" for n in names])
    axis.invert_yaxis()
    axis.set_xlabel(f"error of the contact time [s] ({LOWEST:g}: this or less)")
    axis.set_title("Contact times that are known exactly (number of contacts)")
    figure.legend(fontsize=8, loc="outside lower center", ncols=2)
    case.save(figure, "times.png")
    plt.close(figure)
