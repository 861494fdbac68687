"""Figure 5 of the paper: where and how hard the balls hit, in the smooth and in the best wavy chamber."""

import h5py
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LogNorm
from runs import FIGURE7, FRICTION, MEDIAN, H, N, best, named

from milltools.study.deck import Study

BORDER = ("ball_drum", "ball_wall")
PRECISION = "1 %"


def mill(case, design, name, *sets):
    """File of one mill of the study, run at a closer precision."""
    study = Study.read(FIGURE7, [f"study.precision={PRECISION}", *sets])
    orders = [value.order for value in study.fixed]
    orders += [f"{N}={design[0]}", f"{H}={design[1]!r} m", f"run.precision={PRECISION}"]
    settings = dict(order.split("=", 1) for order in orders)
    return case.run(
        study.deck, output=f"{name}.h5", **{k.replace(".", "__"): v for k, v in settings.items()}
    )


def border(path):
    """Shares of all contacts at drum and end walls, and at the drum alone, and the median above 50 mm/s [m/s]."""
    with h5py.File(path) as file:
        statistics = file["statistics"]
        counts = {kind: int(statistics[f"impacts/{kind}/count"][()]) for kind in (*BORDER, "all")}
        share = sum(counts[kind] for kind in BORDER) / counts["all"]
        return share, counts["ball_drum"] / counts["all"], float(statistics[MEDIAN][()])


def unmapped(path):
    """Impacts in the axial map less those that the statistics count, without sign."""
    with h5py.File(path) as file:
        statistics = file["statistics"]
        mapped = int(statistics["maps/axial/impact_count"][()].sum())
        return abs(mapped - int(statistics["impacts/all/count"][()]))


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
    for words, sets in (("frictionless", ()), ("friction 0.3", FRICTION)):
        options = [word for text in sets for word in ("--set", text)]
        table, _ = case.study("friction" if sets else "figure7", "sweep", *options)
        top = best(table)
        files = [
            (f"{words}, smooth", mill(case, (2, 0.0), f"smooth-{bool(sets)}", *sets)),
            (f"{words}, {named(top)}", mill(case, top, f"wavy-{bool(sets)}", *sets)),
        ]
        shares = [border(path) for _, path in files]
        for (title, _), (share, drum, median) in zip(files, shares):
            case.tell(
                f"{title}: {100 * share:.1f} % of all contacts at the border (drum {100 * drum:.1f} %), median "
                f"above 50 mm/s {median:.3f} m/s"
            )
        case.bound(
            f"{words}: impacts in the maps less those in the statistics, both mills", sum(map(unmapped, (path for _, path in files))),
            0, against="the same impacts counted twice",
        )  # fmt: skip
        rows += files
    case.save(draw(rows), "figure5.png")
    plt.close("all")
