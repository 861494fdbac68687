"""Lines of a study: the objective along each varied key through the optimum, error bars on every point; which
key matters."""

import numpy as np
from matplotlib.transforms import ScaledTranslation

from milltools.base.text import literal
from milltools.study.show import canvas, optimum, summary

FEW = 6  # values of another key, for each of which a line is drawn
BARS = {"elinewidth": 0.8, "capsize": 1.8, "capthick": 0.8}
SURFACE = "0.25"
SMOOTH = "fit, 95 %"


def draw(view, objective):
    """The objective along each key."""
    count = len(view.axes)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = canvas.new(3.4 * columns + 0.8 if count > 1 else 5.6, 3.0 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    best = optimum.find(view, objective)
    handles = {}
    for number, (ax, axis) in enumerate(zip(axes, view.axes)):
        _slice(ax, view, objective, axis, best)
        if number % columns == 0:
            ax.set_ylabel(canvas.value_label(objective))
        for handle, label in zip(*ax.get_legend_handles_labels()):
            handles.setdefault(label, handle)
    for ax in axes[count:]:
        ax.remove()
    canvas.title(figure, summary.finding(view, objective) or view.name)
    canvas.legend(figure, handles.values(), 3 if count > 1 else 2)
    return figure


def _slice(ax, view, objective, axis, best):
    """One panel."""
    found, frame = view.estimate(objective.path), view.designs
    canvas.dress(ax, axis, "x")
    ax.grid(alpha=0.25, lw=0.6)
    if best is None:
        ax.text(0.5, 0.5, "no run has a value", ha="center", transform=ax.transAxes)
        return
    grid = view.is_grid() or len(view.axes) == 1
    rest = [a for a in view.axes if a.key != axis.key]
    several = next((a for a in rest if grid and a.values and 1 < len(a.values) <= FEW), None)
    cut = [a for a in rest if a is not several] if grid else []
    take = view.having({a.key: frame[a.key][best.design] for a in cut})
    if best.surface is not None:
        known = take & view.usable & np.isfinite(found.mean)
        _surface(ax, view, axis, best, frame[axis.key].to_numpy()[known])
    if several:  # each panel has its own legend, because the colours mean other values in each panel
        bars = []
        for number, value in enumerate(several.values):
            which = take & (frame[several.key] == value).to_numpy()
            bars.append(_points(ax, view, axis, found, which, number, None, grid))
        names = [literal(f"{several.short} = {several.tell(value)}") for value in several.values]
        above = ax.transAxes + ScaledTranslation(0, 0.42 if ax.child_axes else 0, ax.figure.dpi_scale_trans)
        place = {"loc": "lower left", "bbox_to_anchor": (0, 1), "bbox_transform": above}
        ax.legend(bars, names, fontsize=6.5, handlelength=1.2, ncols=2, frameon=False, **place)
    else:
        _points(ax, view, axis, found, take, 0, "means of the runs, 95 %", grid)
        if grid:
            _forbidden(ax, view, axis, np.flatnonzero(take & view.usable))
    at = canvas.places(axis, [frame[axis.key][best.design]])[0]
    ax.plot(at, best.value, "*", ms=15, mfc="none", mec=canvas.INK, zorder=6, ls="", label="best")


def _forbidden(ax, view, axis, which):
    """Shades what each requirement forbids along the key: between two designs the limit is interpolated linearly, as
    the line of the objective is."""
    x = canvas.places(axis, view.designs[axis.key].to_numpy()[which])
    order = np.argsort(x)
    x, which, ends = x[order], which[order], ax.get_xlim()
    for one in view.require:
        excess = one.sign * (view.estimate(one.expression.text).mean[which] - one.limit)
        if axis.numeric:
            k = np.flatnonzero(excess[:-1] * excess[1:] < 0)
            fine = np.unique([*ends, *x, *(x[k] + np.diff(x)[k] * excess[k] / (excess[k] - excess[k + 1]))])
            bad = np.interp(fine, x, excess) >= -1e-9 * np.nanmax(np.abs(excess))
        else:
            fine, bad = np.add.outer(x, (-0.5, 0.5)).ravel(), (excess > 0).repeat(2)
        if bad.any():
            ax.fill_between(fine, 0, 1, bad, transform=ax.get_xaxis_transform(), **canvas.forbidden(one))
    ax.set_xlim(ends)


def _points(ax, view, axis, found, which, number, name, joined):
    """Points with error bars, hollow where they do not meet a requirement; joined along a grid, single where designs
    are scattered."""
    frame = view.designs
    state, colour = frame["state"].to_numpy(), canvas.LINES[number % len(canvas.LINES)]
    done = np.flatnonzero(which & (state == "done") & np.isfinite(found.mean))
    x = canvas.places(axis, frame[axis.key].to_numpy()[done])
    order = np.argsort(x, kind="stable")
    x, done = x[order], done[order]
    many = len(x) > 60
    bars = ax.errorbar(
        x, found.mean[done], np.nan_to_num(found.half[done]), color=colour, lw=1, label=name, zorder=3, **BARS,
        ls="-" if joined and axis.numeric and not many else "", marker=canvas.MARKS[number % len(canvas.MARKS)],
        ms=2.2 if many else 3.8,
    )  # fmt: skip
    if many or not joined:
        for part in bars[1] + bars[2]:
            part.set_alpha(0.15 if many and joined else 0.35)
    if (bad := ~view.feasible[done]).any():
        label = f"does not meet {summary.required(view)}" if name is None or not joined else None
        ax.plot(x[bad], found.mean[done][bad], ls="", marker=bars[0].get_marker(), ms=bars[0].get_markersize(),
                mfc="white", mec=colour, zorder=4, label=label)  # fmt: skip
    capped = np.flatnonzero(which & (state == "capped") & np.isfinite(found.mean))
    if len(capped):
        at = canvas.places(axis, frame[axis.key].to_numpy()[capped])
        ax.plot(at, found.mean[capped], "x", color=colour, ms=5, label="capped")
    return bars


def _surface(ax, view, axis, best, known):
    """The surface along the key, with all others at the optimum, within the `known` values of the key: beyond the last
    run that was not capped it would be a guess."""
    line = view.designs.iloc[best.design]
    low, high = (min(known), max(known)) if axis.numeric else axis.span
    if not axis.numeric:
        values = list(axis.choices)
    elif axis.whole:
        values = list(range(round(low), round(high) + 1, max(1, round((high - low) / 200))))
    else:
        values = (np.geomspace if axis.log and low > 0 else np.linspace)(low, high, 101).tolist()
    mean, spread = best.surface.predict([tuple(v if a is axis else line[a.key] for a in view.axes) for v in values])
    x, reach = canvas.places(axis, values), optimum.REACH * spread
    if axis.numeric:
        ax.fill_between(x, mean - reach, mean + reach, color="0.86", lw=0, zorder=1, label=SMOOTH)
        ax.plot(x, mean, color=SURFACE, lw=1, zorder=4)
    else:
        ax.errorbar(x + 0.12, mean, reach, color=SURFACE, ls="", marker="_", label=SMOOTH, **BARS)


def draw_sensitivity(view, entries):
    """Sobol indices of each key, alone and with its interactions."""
    figure = canvas.new(5.6, 1.4 + 0.5 * len(entries))
    ax = figure.subplots()
    rows = np.arange(len(entries))
    for shift, k, name, colour in (
        (-0.18, 1, "alone (first order)", canvas.LINES[0]),
        (0.18, 3, "with interactions (total)", canvas.LINES[1]),
    ):
        size = np.array([entry[k] for entry in entries], float)
        error = np.nan_to_num([entry[k + 1] for entry in entries])
        if np.isfinite(size).any():
            ax.barh(rows + shift, np.nan_to_num(size), 0.32, xerr=error, color=colour, label=name,
                    error_kw={"elinewidth": 0.9, "capsize": 2})  # fmt: skip
    words = {a.key: a.words for a in view.axes}
    ax.set_yticks(rows, [literal(words.get(entry[0], entry[0]), 34) for entry in entries])
    ax.invert_yaxis()
    ax.set_xlim(left=0)
    ax.set_xlabel("share of the variance [1], with 95 % confidence")
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    methods = ", ".join(dict.fromkeys(str(entry[5]) for entry in entries))
    canvas.title(figure, f"{view.name}: which key matters ({methods})")
    canvas.legend(figure, ax.get_legend_handles_labels()[0], 2)
    return figure
