"""Figure 5: where and how hard the balls hit, in the smooth and in the best wavy chamber."""

import h5py
import matplotlib.pyplot as plt
import numpy as np
from buckles import SMOOTH, WITHIN
from matplotlib.colors import LogNorm
from study_case import FIGURE7, FRICTION, MEDIAN, H, N, named

from milltools.study.plan.study_deck import Study

KINDS = ("ball_drum", "ball_wall")


def mill(case, design, name, *sets):
    """File of one mill of the study, known to 2 %."""
    study = Study(FIGURE7, list(sets))
    orders = [value.order for value in study.fixed]
    orders += [f"{N}={design[0]}", f"{H}={design[1]!r} m"]
    settings = dict(order.split("=", 1) for order in orders)
    return case.run(study.deck, output=f"{name}.h5", **{k.replace(".", "__"): v for k, v in settings.items()})


def border(path):
    """Share of all contacts at drum and end walls, and the median above 50 mm/s [m/s]."""
    with h5py.File(path) as file:
        statistics = file["statistics"]
        counts = {kind: int(statistics[f"impacts/{kind}/count"][()]) for kind in (*KINDS, "all")}
        return sum(counts[kind] for kind in KINDS) / counts["all"], float(statistics[MEDIAN][()])


def panels(axes, path, title):
    """The axial cut: impacts per second and volume, and their mean normal speed."""
    with h5py.File(path) as file:
        maps = file["statistics/maps/axial"]
        x, r = maps["x_edges"][:], maps["r_edges"][:]
        count, speed = maps["impact_count"][:], maps["normal_speed_sum"][:]
        duration = float(file["statistics/duration"][()])
    volume = np.outer(np.diff(x), np.pi * np.diff(r**2))
    with np.errstate(invalid="ignore", divide="ignore"):
        density = np.where(count > 0, count / volume / duration, np.nan)
        mean = np.where(count > 0, speed / count, np.nan)
    return [(axes[0], density, x, r, title), (axes[1], mean, x, r, title)]


def draw(rows):
    figure, axes = plt.subplots(
        len(rows), 2, figsize=(11, 2.6 * len(rows)), layout="constrained", sharex=True, sharey=True
    )
    all_of_it = [panels(axes[k], path, title) for k, (title, path) in enumerate(rows)]
    labels = ("impacts per time and volume [1/(s m$^3$)]", "mean normal impact speed [m/s]")
    for column, (label, cmap) in enumerate(zip(labels, ("inferno", "viridis"))):
        values = np.concatenate([row[column][1].ravel() for row in all_of_it])
        values = values[np.isfinite(values)]
        low, high = np.quantile(values, (0.02, 0.98))
        norm = LogNorm(low, high) if column == 0 else plt.Normalize(0, high)
        for row in all_of_it:
            ax, value, x, r, title = row[column]
            image = ax.pcolormesh(x, r, value.T, norm=norm, cmap=cmap, rasterized=True)
            ax.set_title(title, fontsize=9)
            ax.set_ylabel("r [m]")
        axes[-1, column].set_xlabel("x [m]")
        figure.colorbar(image, ax=axes[:, column], label=label, extend="both")
    return figure


def check(case):
    rows = []
    for words, sets, best in (("frictionless", (), "smooth"), ("friction 0.3", FRICTION, "rough")):
        for design in (SMOOTH, WITHIN[best]):
            title = f"{words}, {named(design) if design[1] else 'smooth'}"
            path = mill(case, design, title.replace(" ", "-"), *sets)
            rows.append((title, path))
            share, median = border(path)
            case.tell(
                f"{title}: {100 * share:.1f} % of all contacts are with drum or end walls; "
                f"median of the normal speeds above 50 mm/s: {median:.3f} m/s."
            )
    case.save(draw(rows), "figure5.png")
    plt.close("all")
