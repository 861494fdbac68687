"""Lines of a study: the objective along each varied key through the optimum, error bars on every point; the Pareto front; which
key matters."""

import numpy as np

from milltools.study.show import draw as show_draw
from milltools.study.show import optimum as show_optimum
from milltools.study.show import terminal as show_text

FEW = 6  # values of another key, for each of which a line is drawn
NUMBERED = 20  # designs of the front that bear the number they have in the table
BARS = {"elinewidth": 0.8, "capsize": 1.8, "capthick": 0.8}
SURFACE = "0.25"
SMOOTH = "surface, 95 %"


def draw(view, objective):
    """The objective along each key."""
    count = len(view.axes)
    columns = min(count, 3)
    rows = -(-count // columns)
    figure = show_draw.new(3.4 * columns + 0.8 if count > 1 else 5.6, 3.0 * rows + 0.6)
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
    for ax, axis in zip(axes, view.axes):
        _slice(ax, view, objective, axis)
    for ax in axes[count:]:
        ax.remove()
    for ax in axes[:count:columns]:
        ax.set_ylabel(show_draw.value_label(objective))
    figure.suptitle(_title(view, objective), fontsize=9.5, x=0.01, ha="left")
    handles = {}
    for ax in axes[:count]:
        own = [text.get_text() + ", 95 %" for text in ax.get_legend().get_texts()] if ax.get_legend() else []
        for handle, label in zip(*ax.get_legend_handles_labels()):
            if label not in own:
                handles.setdefault(label, handle)
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside lower left",
        ncols=3 if count > 1 else 2,
        frameon=False,
    )
    return figure


def _title(view, objective) -> str:
    optimum = show_optimum.find(view, objective)
    if optimum is None or len(view.axes) == 1:
        return show_draw.literal(view.name)
    return show_draw.literal(f"{view.name}: through {view.tell(optimum.design)}", 110)


def _slice(ax, view, objective, axis):
    optimum, scale = show_optimum.find(view, objective), show_draw.value_scale(objective)
    found, frame = view.estimate(objective.path), view.designs
    show_draw.dress(ax, axis, "x")
    ax.grid(alpha=0.25, lw=0.6)
    if optimum is None:
        ax.text(0.5, 0.5, "no run has a value", ha="center", transform=ax.transAxes)
        return
    grid = view.is_grid() or len(view.axes) == 1
    rest = [a for a in view.axes if a.key != axis.key]
    several = next((a for a in rest if grid and a.values and 1 < len(a.values) <= FEW), None)
    fixed = [a for a in rest if a is not several]
    take = np.ones(len(frame), bool)
    if grid:
        for other in fixed:
            take &= (frame[other.key] == frame[other.key][optimum.design]).to_numpy()
    if optimum.surface is not None:
        known = take & (frame["state"] == "done").to_numpy() & np.isfinite(found.mean)
        _surface(ax, view, axis, optimum, scale, frame[axis.key].to_numpy()[known])
    for number, value in enumerate(several.values if several else [None]):
        which = take if several is None else take & (frame[several.key] == value).to_numpy()
        colour = show_draw.LINES[number % len(show_draw.LINES)]
        name = f"{several.short} = {several.tell(value)}, 95 %" if several else "means of the runs, 95 %"
        _points(ax, axis, frame, found, which, scale, colour, number, name, grid)
    if several:  # the same colours mean other values in the next panel
        lines = [c for c in ax.containers if c.get_label().endswith("95 %") and c.get_label() != SMOOTH]
        ax.legend(
            lines,
            [c.get_label().removesuffix(", 95 %") for c in lines],
            fontsize=6.5,
            framealpha=0.7,
            handlelength=1.2,
        )
    at = show_draw.places(axis, [frame[axis.key][optimum.design]])[0]
    ax.plot(at, optimum.value / scale.size, "*", ms=12, mfc="white", mec=show_draw.INK, zorder=6,
            ls="", label="best")  # fmt: skip


def _points(ax, axis, frame, found, which, scale, colour, number, name, joined):
    """Points with error bars; joined along a grid, single where designs are scattered."""
    state = frame["state"].to_numpy()
    done = np.flatnonzero(which & (state == "done") & np.isfinite(found.mean))
    x = show_draw.places(axis, frame[axis.key].to_numpy()[done])
    order = np.argsort(x, kind="stable")
    x, done = x[order], done[order]
    many = len(x) > 60
    line = "-" if joined and axis.numeric and not many else ""
    bars = ax.errorbar(
        x, found.mean[done] / scale.size, np.nan_to_num(found.half[done] / scale.size), color=colour, ls=line, lw=1,
        marker=show_draw.MARKS[number % len(show_draw.MARKS)], ms=2.2 if many else 3.8, label=show_draw.literal(name), zorder=3, **BARS,
    )  # fmt: skip
    if many or not joined:
        for part in bars[1] + bars[2]:
            part.set_alpha(0.15 if many and joined else 0.35)
    capped = np.flatnonzero(which & (state == "capped") & np.isfinite(found.mean))
    if len(capped):
        ax.plot(show_draw.places(axis, frame[axis.key].to_numpy()[capped]), found.mean[capped] / scale.size, "x",
                color=colour, ms=5, label="capped")  # fmt: skip


def _surface(ax, view, axis, optimum, scale, known):
    """What the surface says along the key, all others at the optimum, as far as `known` values of the key reach: beyond
    the last run that was not capped it would only guess."""
    line = view.designs.iloc[optimum.design]
    low, high = (min(known), max(known)) if axis.numeric else axis.span
    if not axis.numeric:
        values = list(axis.choices)
    elif axis.whole:
        values = list(range(round(low), round(high) + 1, max(1, round((high - low) / 200))))
    else:
        values = (np.geomspace if axis.log and low > 0 else np.linspace)(low, high, 101).tolist()
    designs = [tuple(v if a is axis else line[a.key] for a in view.axes) for v in values]
    mean, spread = (part / scale.size for part in optimum.surface.predict(designs))
    x, reach = show_draw.places(axis, values), show_optimum.REACH * spread
    if axis.numeric:
        ax.fill_between(x, mean - reach, mean + reach, color="0.86", lw=0, zorder=1, label=SMOOTH)
        ax.plot(x, mean, color=SURFACE, lw=1, zorder=4)
    else:
        ax.errorbar(x + 0.12, mean, reach, color=SURFACE, ls="", marker="_", label=SMOOTH, **BARS)


def draw_front(view):
    """The Pareto front: the first objective against each other one."""
    first, *others = view.objectives
    figure = show_draw.new(5.8 if len(others) == 1 else 4.4 * min(len(others), 3), 4.2)
    axes = np.ravel(figure.subplots(1, len(others), squeeze=False))
    which, usable = show_text.front(view), show_optimum.usable(view)
    ea, sa = view.estimate(first.path), show_draw.value_scale(first)
    beaten = np.setdiff1d(np.flatnonzero(usable), which)
    for ax, other in zip(axes, others):
        eb, sb = view.estimate(other.path), show_draw.value_scale(other)
        ax.errorbar(
            ea.mean[beaten] / sa.size, eb.mean[beaten] / sb.size, np.nan_to_num(eb.half[beaten] / sb.size),
            np.nan_to_num(ea.half[beaten] / sa.size), ls="", marker="o", ms=2.5, color="0.75", zorder=1,
            label=f"other designs ({len(beaten)})", **{**BARS, "elinewidth": 0.4, "capsize": 0},
        )  # fmt: skip
        a, b = ea.mean[which] / sa.size, eb.mean[which] / sb.size
        if len(others) == 1:  # with more the front is no line
            ax.step(
                a,
                b,
                where="pre" if first.sign > 0 else "post",
                color=show_draw.LINES[0],
                lw=0.8,
                alpha=0.6,
            )
        ax.errorbar(
            a, b, np.nan_to_num(eb.half[which] / sb.size), np.nan_to_num(ea.half[which] / sa.size), ls="", marker="o",
            ms=4.5, color=show_draw.LINES[0], label=f"Pareto front ({len(which)}), 95 %", zorder=3, **BARS,
        )  # fmt: skip
        if len(which) <= NUMBERED:
            for place, (x, y) in enumerate(zip(a, b), 1):
                ax.annotate(str(place), (x, y), (3, 4), textcoords="offset points", fontsize=7)
        for objective, label in ((first, ax.set_xlabel), (other, ax.set_ylabel)):
            label(f"{show_draw.value_label(objective, 50)}, {objective.goal}d")
        ax.grid(alpha=0.25, lw=0.6)
        ax.margins(0.06)
    figure.suptitle(show_draw.literal(view.name), fontsize=9.5, x=0.01, ha="left")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=2, frameon=False)
    return figure


def draw_sensitivity(view, entries):
    """Sobol indices of each key, alone and with its interactions."""
    figure = show_draw.new(5.6, 1.4 + 0.5 * len(entries))
    ax = figure.subplots()
    rows = np.arange(len(entries))
    for shift, k, name, colour in (
        (-0.18, 1, "alone (first order)", show_draw.LINES[0]),
        (0.18, 3, "with all its interactions (total)", show_draw.LINES[1]),
    ):
        size = np.array([entry[k] for entry in entries], float)
        error = np.nan_to_num([entry[k + 1] for entry in entries])
        if np.isfinite(size).any():
            ax.barh(rows + shift, np.nan_to_num(size), 0.32, xerr=error, color=colour, label=name,
                    error_kw={"elinewidth": 0.9, "capsize": 2})  # fmt: skip
    words = {a.key: a.words for a in view.axes}
    ax.set_yticks(rows, [show_draw.literal(words.get(entry[0], entry[0]), 34) for entry in entries])
    ax.invert_yaxis()
    ax.set_xlim(left=0)
    ax.set_xlabel("share of the variance [1], with 95 % confidence")
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    methods = ", ".join(dict.fromkeys(str(entry[5]) for entry in entries))
    ax.set_title(show_draw.literal(f"{view.name}: which key matters ({methods})", 90), loc="left")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower left", ncols=2, frameon=False)
    return figure
