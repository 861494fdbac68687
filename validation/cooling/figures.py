"""The figure."""

import matplotlib.pyplot as plt
import numpy as np
from cooling.common import COUNTS, mean_and_error
from cooling.haff import RELAXED, cooling_state
from cooling.rough import mean_field


def draw(case, smooth, rough):
    figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
    for colour, (e, runs) in zip(("C0", "C1", "C2"), smooth.items(), strict=True):
        draw_smooth(axes[:, 0], colour, e, runs)
    for colour, ((e, beta), result) in zip(("C0", "C1", "C2"), rough.items(), strict=True):
        draw_rough(axes[:, 1], colour, (e, beta), result)
    names = (
        ("Haff's law", "$T/T_0$", "ln T minus Haff's law with $a_2 = 0$"),
        ("Rough spheres", "$R = T_{rot}/T_{tr}$", "deviation of R from mean field [%]"),
    )
    for column, (title, top, bottom) in enumerate(names):
        axes[0, column].set(title=title, ylabel=f"{top} [1]")
        axes[1, column].set(ylabel=bottom if "%" in bottom else f"{bottom} [1]")
        for axis in axes[:, column]:
            axis.set_xlabel("C, collisions per ball [1]")
            axis.grid(alpha=0.3)
    axes[0, 0].set_yscale("log")
    for style, label in (("-", "mean field"), ("--", "direct simulation")):
        axes[0, 1].plot([], [], style, color="grey", label=label)
    axes[0, 0].legend(fontsize=9)
    axes[1, 0].legend(fontsize=9)
    axes[0, 1].legend(fontsize=9, loc="center right", bbox_to_anchor=(1, 0.57))
    case.save(figure)
    plt.close(figure)


def draw_smooth(axes, colour, e, runs):
    counts = np.arange(2, 43, 2.5)
    logs = np.array([np.interp(counts, r["count"], np.log(r["temperature"])) for r in runs])
    mean, error = mean_and_error(logs)
    haff = -(1 - e**2) / 3 * counts
    loss = cooling_state(e)[2]
    axes[0].plot(counts, np.exp(haff * loss), color=colour, label=f"theory, e = {e:g}")
    axes[0].plot(counts, np.exp(mean), "o", ms=4, color=colour, label=f"millsim, e = {e:g}")
    # Theory is of the cooling state: it starts from millsim where that is reached
    start = np.interp(RELAXED, counts, mean - haff)
    late = counts[counts >= RELAXED]
    axes[1].plot(
        late,
        start - (1 - e**2) / 3 * (loss - 1) * (late - RELAXED),
        color=colour,
        label=f"theory with $a_2$, $a_3$, e = {e:g}",
    )
    axes[1].errorbar(
        counts,
        mean - haff,
        error,
        fmt="o",
        ms=4,
        capsize=2,
        color=colour,
        label=f"millsim, e = {e:g}",
    )


def draw_rough(axes, colour, pair, result):
    name = f"e = {pair[0]:g}, $\\beta_0$ = {pair[1]:g}"
    (mean, error), (truth, _) = result["millsim"], result["oracle"]
    fine = np.linspace(0, COUNTS[-1], 200)
    axes[0].plot(fine, mean_field(*pair, fine)[1], color=colour)
    field = result["mean_field"][1]
    for axis, scale, shift in ((axes[0], 1, 0), (axes[1], 100 / field, -100)):
        axis.plot(COUNTS, truth[1] * scale + shift, "--", color=colour)
        axis.errorbar(
            COUNTS,
            mean[1] * scale + shift,
            error[1] * scale,
            fmt="o",
            ms=4,
            capsize=2,
            color=colour,
            label=f"millsim, {name}",
        )
