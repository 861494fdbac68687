"""The two figures."""

import matplotlib.pyplot as plt
import numpy as np
from experiments.gas import (
    CLOCK,
    FRICTIONS,
    RATIO_BAND,
    mean_and_error,
)
from experiments.impacts import (
    ALUMINA,
    DIAMETER,
    PAIRS,
    RATIOS,
    SPEED,
    STEEP,
    reversal,
)
from experiments.measured import KEPT, SPIN, TRITTEL_ENERGY, TRITTEL_RATIO
from single.oblique import Law

COLOURS = {"glass": "C0", "acetate": "C1"}
MARKERS = {"MFIX": "s", "Lethe": "o"}


def draw_impacts(case, curves, plate):
    figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
    draw_pairs(axes[0, 0], curves)
    draw_kept(axes[0, 1], plate)
    draw_spin(axes[1, 0], plate)
    draw_reversal(axes[1, 1], plate)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=9)
    case.save(figure, "impacts.png")
    plt.close(figure)


def draw_pairs(axis, curves):
    fine = np.linspace(0, 4, 401)
    for name, rebound in curves.items():
        law, error, _ = PAIRS[name]
        corners = [
            Law(law.e + i * error.e, law.mu + j * error.mu, law.beta + k * error.beta)
            for i in (-1, 1)
            for j in (-1, 1)
            for k in (-1, 1)
        ]
        after = [corner.slip_after(1, fine) for corner in corners]
        colour = COLOURS[name]
        axis.fill_between(fine, np.min(after, axis=0), np.max(after, axis=0), color=colour, alpha=0.2)
        axis.plot(fine, law.slip_after(1, fine), color=colour, lw=1)
        shown = fine[-1] >= RATIOS
        label = f"millsim, {name}: {law.e:g}, {law.mu:g}, {law.beta:g}"
        axis.plot(RATIOS[shown], rebound.slip[shown], "o", ms=4, color=colour, label=label)
    axis.plot([], [], color="grey", lw=1, label="Walton's law")
    axis.fill_between([], [], [], color="grey", alpha=0.2, label="errors of the measured coefficients")
    axis.axhline(0, color="0.7", lw=0.8, zorder=0)
    axis.set(
        title="Impacts of two spheres: millsim follows Walton's law\n"
        "with Foerster's restitution, friction, tangential restitution",
        xlabel=r"slip before / normal speed before, $\psi_1$ [1]",
        ylabel=r"slip after / normal speed before, $\psi_2$ [1]",
        xlim=(0, fine[-1]),
    )


def draw_measured(axis, readings):
    for name, (angle, value) in readings.items():
        axis.plot(
            angle,
            value,
            MARKERS[name],
            ms=6,
            mfc="none",
            color="k",
            label=f"measured, as read by {name}",
        )


def draw_kept(axis, plate):
    draw_measured(axis, KEPT)
    angle, _, predicted = plate["kept"]
    axis.plot(angle, predicted, "x", ms=7, color="C3", label="millsim")
    fine = np.linspace(0.5, 62, 300)
    ratio = np.tan(np.radians(fine))
    kept = 1 - 2 / 7 * (1 - ALUMINA.slip_after(1, ratio) / ratio)
    axis.plot(fine, kept, color="C3", lw=1, label="Walton's law")
    axis.set(
        title=f"Alumina on glass: as predicted above {STEEP:g} deg,\n"
        "below, one value of the tangential restitution is not enough",
        xlabel="angle from the normal, before [deg]",
        ylabel="tangential speed of the centre, after / before [1]",
    )


def draw_spin(axis, plate):
    draw_measured(axis, SPIN)
    angle, _, predicted = plate["spin"]
    axis.plot(angle, predicted, "x", ms=7, color="C3", label="millsim")
    fine = np.linspace(0, 62, 300)
    ratio = np.tan(np.radians(fine))
    kick = 5 / 7 * (ratio - ALUMINA.slip_after(1, ratio)) * SPEED * np.cos(np.radians(fine))
    axis.plot(fine, kick / (DIAMETER / 2), color="C3", lw=1, label="Walton's law")
    axis.set(
        title="Alumina on glass: the spin agrees with friction 0.092",
        xlabel="angle from the normal, before [deg]",
        ylabel="spin after [rad/s]",
    )


def draw_reversal(axis, plate):
    for name, (angle, kept) in KEPT.items():
        sticks = np.array(angle) < STEEP
        axis.plot(
            np.array(angle)[sticks],
            reversal(np.array(kept)[sticks]),
            MARKERS[name],
            ms=6,
            mfc="none",
            color="k",
            label=f"measured, as read by {name}",
        )
    axis.axhline(ALUMINA.beta, color="C3", lw=1, label="Walton's law with 0.44 (glass on glass)")
    axis.axhline(0, color="0.7", lw=0.8, zorder=0)
    axis.set(
        title="Reason: the slip of nearly normal impacts is not reversed;\n0.44 is reached only near the kink",
        xlabel="angle from the normal, before [deg]",
        ylabel=r"tangential restitution $\beta_0$ of the impact [1]",
        xlim=(0, STEEP),
    )


def draw_gas(case, runs, scan):
    figure, axes = plt.subplots(1, 3, figsize=(16, 5.2), layout="constrained")
    draw_ratio(axes[0], runs)
    draw_energy(axes[1], runs)
    draw_scan(axes[2], scan)
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.legend(fontsize=9)
    case.save(figure, "gas.png")
    plt.close(figure)


def band(axis):
    axis.axhspan(
        TRITTEL_RATIO - RATIO_BAND,
        TRITTEL_RATIO + RATIO_BAND,
        color="0.85",
        zorder=0,
        label="measured: roughly 2/3, taken as +-10 %",
    )


def draw_ratio(axis, runs):
    band(axis)
    for name, starts in runs.items():
        for number, run in enumerate(starts):
            mean, _ = mean_and_error(run.ratio)
            spread = run.ratio.std(axis=0, ddof=1)
            label = f"millsim, contacts of {name}" if number == 0 else None
            axis.plot(CLOCK, mean, color=COLOURS[name], label=label)
            axis.fill_between(CLOCK, mean - spread, mean + spread, color=COLOURS[name], alpha=0.2)
    axis.set(
        title="Contacts of acetate: the ratio stays as measured,\nof glass: it falls (shaded: scatter of single runs)",
        xlabel="time / Haff time [1]",
        ylabel="rotational / translational energy [1]",
        xlim=(0, CLOCK[-1]),
        ylim=(0, 1.35),
    )


def draw_energy(axis, runs):
    axis.plot(CLOCK, (1 + CLOCK) ** -2, color="k", lw=1, label="Haff's law")
    for name, starts in runs.items():
        mean, error = mean_and_error(starts[1].energy)
        some = slice(None, None, 4)
        axis.errorbar(
            CLOCK[some],
            mean[some],
            error[some],
            fmt="o",
            ms=4,
            color=COLOURS[name],
            label=f"millsim, contacts of {name}",
        )
    axis.plot(CLOCK[-1], TRITTEL_ENERGY, "k*", ms=11, label="measured: about 5 %", clip_on=False)
    axis.set(
        title="Energy follows Haff's law:\n6 % are left after three Haff times",
        xlabel="time / Haff time [1]",
        ylabel="energy / energy at the start [1]",
        yscale="log",
        xlim=(0, CLOCK[-1] * 1.03),
    )
    ticks = (0.05, 0.1, 0.2, 0.5, 1)
    axis.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_yticks([], minor=True)


def draw_scan(axis, scan):
    band(axis)
    for name, points in scan.items():
        law, _, _ = PAIRS[name]
        value, error = np.transpose(points)
        axis.errorbar(
            FRICTIONS,
            value,
            error,
            fmt="o-",
            ms=4,
            capsize=2,
            color=COLOURS[name],
            label=f"millsim, e {law.e:g}, $\\beta_0$ {law.beta:g}",
        )
        none = np.isnan(value)
        label = "no lasting ratio: it rises from all starts" if none.any() else None
        height = np.full(none.sum(), 0.97)
        axis.plot(np.array(FRICTIONS)[none], height, "^", color=COLOURS[name], label=label)
        axis.axvline(law.mu, color=COLOURS[name], ls=":", label=f"friction of {name}")
    axis.set(
        title="The lasting ratio depends on restitution and friction:\ncontacts of glass are excluded",
        xlabel="friction of the spheres and walls [1]",
        ylabel="lasting ratio of rotational / translational energy [1]",
        xscale="log",
        ylim=(0, 1.5),
    )
    axis.set_xticks(FRICTIONS, [f"{mu:g}" for mu in FRICTIONS])
    axis.set_xticks([], minor=True)
