"""Figure 7: median normal impact speed against number and height of the buckles, up to 120 buckles, several seeds."""

import matplotlib.pyplot as plt
import numpy as np
from study_case import FRICTION, MEDIAN, H, N, named

LOWEST = "The smooth chamber (h = 0) has the lowest median impact speed"
TWICE = "Buckles double the median impact speed"
INSIDE = "The maximum is inside the range of the paper, 2 to 20 buckles"
FLAT = "The maximum is flat"
ROUGH = "Leaving out friction and rotation of the balls is an oversimplification (Reichardt, Adam & Wiechert)"
SEEDS = tuple(range(1001, 1007))  # of no study
GRID = (
    "vary.drum.buckles=8, 12, 16, 20, 24, 28, 32, 36, 40, 50, 60, 80, 120",
    "vary.drum.buckle_height=1, 2, 3, 4, 5, 6, 8 mm",
    "study.max_collisions=4e6",
)
SMOOTH = (2, 0.0)
# With friction, the lowest of the grid of 19 x 21 by one run each, so twice as many seeds: few low buckles, and many
# high ones
LOW = ((2, 1e-3), (3, 1e-3), (18, 10e-3))
LOW_SEEDS = tuple(range(1001, 1013))
# The best designs of that grid; better ones of the wide grid, first without and then with overhanging buckles; one past
# the maximum
WITHIN = {"smooth": (20, 4e-3), "rough": (20, 2.5e-3)}
BEYOND = {"smooth": ((28, 4e-3), (40, 8e-3)), "rough": ((28, 4e-3), (36, 5e-3))}
PAST = {"smooth": (120, 1e-3), "rough": (60, 5e-3)}


def tables(case):
    """Tables of the wide grid without and with friction."""
    options = [word for text in GRID for word in ("--set", text)]
    rough = [*options, *(word for text in FRICTION for word in ("--set", text))]
    return {
        "smooth": case.study("wide", "sweep", "--no-picture", *options)[0],
        "rough": case.study("wide-friction", "sweep", "--no-picture", *rough)[0],
    }


def anew(case, name, designs, precision, *sets, seeds=SEEDS):
    """{design: medians, one a seed} of designs (n, h [m])."""
    values = case.kept(f"anew-{name}", lambda: case.measure(designs, seeds, precision, *sets).tolist())
    return dict(zip(designs, map(np.array, values)))


def crest(table):
    """(n, largest median, its error, its h [m]) over the heights of each number of buckles that are done."""
    done = table[table.status == "done"]
    rows = done.loc[done.groupby(N)[MEDIAN].idxmax()]
    return [rows[key].to_numpy() for key in (N, MEDIAN, f"{MEDIAN}:error", H)]


def draw(found):
    figure, ax = plt.subplots(figsize=(7.2, 4), layout="constrained")
    for k, (name, words) in enumerate((("smooth", "without friction"), ("rough", "friction 0.3"))):
        n, v, error, h = crest(found[name])
        ax.errorbar(n, v, error, fmt=f"C{k}o-", ms=4, label=words)
        for x, y, z in zip(n, v, h):
            ax.annotate(f"{1e3 * z:g}", (x, y), (0, 6), textcoords="offset points", fontsize=7)
    ax.axvspan(2, 20, color="0.92", label="range of the paper")
    ax.set(
        xlabel="number of buckles [1] (at the points: best height [mm])",
        ylabel="median impact speed above 50 mm/s [m/s]",
        title="The best chamber has more buckles than the paper's 20",
        ylim=(0, 1.4),
    )
    ax.legend(frameon=False)
    return figure


def told(values):
    return f"{values.mean():.4f} +- {values.std(ddof=1) / np.sqrt(len(values)):.4f} m/s"


def ask_lowest(case, table, ring, low):
    done = table[table.status == "done"]
    least = done.loc[done[MEDIAN].idxmin()]
    case.ask(
        LOWEST, f"without friction: ratio of the lowest median of the {len(done)} designs that were not capped "
        f"(n = {int(least[N])}, h = {1e3 * least[H]:g} mm) to that of the smooth chamber, whose charge becomes a ring",
        least[MEDIAN] / ring.mean(), above=1, error=least[f"{MEDIAN}:error"] / ring.mean(),
    )  # fmt: skip
    case.ask(
        LOWEST, "without friction: designs with few low buckles",
        reason="their charge ends as a ring, too; the medians depend on the time at which the run ends",
    )  # fmt: skip
    for design in LOW:
        case.ask(
            LOWEST, f"with friction 0.3: ratio of the median at {named(design)} to that of the smooth chamber",
            low[design] / low[SMOOTH], above=1, headline=design == LOW[-1],
        )  # fmt: skip
    case.tell(
        "Medians with friction 0.3: "
        + "; ".join(f"{named(d) if d[1] else 'smooth'}: {told(v)}" for d, v in low.items()) + "."
    )  # fmt: skip


def ask_largest(case, words, name, found):
    within, best = WITHIN[name], found[WITHIN[name]]
    for design in BEYOND[name]:
        case.ask(
            INSIDE, f"{words}: ratio of the median at {named(design)} to that at {named(within)}, "
            "the best of 2..20 buckles",
            found[design] / best, below=1,
        )  # fmt: skip
    past = found[PAST[name]] / found[BEYOND[name][-1]]
    case.tell(
        f"Medians {words}: {'; '.join(f'{named(d)}: {told(v)}' for d, v in found.items())}. "
        f"Beyond the maximum the median decreases: at {named(PAST[name])} it is "
        f"{past.mean():.3f} +- {past.std(ddof=1) / np.sqrt(len(past)):.3f} times that at {named(BEYOND[name][-1])}."
    )


def check(case):
    found = tables(case)
    ring = anew(case, "ring", [SMOOTH], "2 %", seeds=SEEDS[:3])[SMOOTH]
    low = anew(case, "low", [SMOOTH, *LOW], "1 %", *FRICTION, seeds=LOW_SEEDS)
    ask_lowest(case, found["smooth"], ring, low)
    flat = [(20, 3e-3), (20, 5e-3), (16, 4e-3)]
    smooth = anew(case, "smooth", [WITHIN["smooth"], *BEYOND["smooth"], PAST["smooth"], *flat], "2 %")
    rough = anew(
        case,
        "rough",
        [WITHIN["rough"], WITHIN["smooth"], *BEYOND["rough"], PAST["rough"]],
        "2 %",
        *FRICTION,
    )
    gain = {
        "without friction": smooth[WITHIN["smooth"]] / ring.mean(),
        "with friction 0.3": rough[WITHIN["rough"]] / low[SMOOTH][: len(SEEDS)],
    }
    for words, values in gain.items():
        case.ask(
            TWICE, f"{words}: ratio of the median of the best chamber with 2..20 buckles to that of the smooth chamber",
            values, above=2, headline=words.startswith("with "),
        )  # fmt: skip
    ask_largest(case, "without friction", "smooth", smooth)
    ask_largest(case, "with friction 0.3", "rough", rough)
    for design in flat:
        case.ask(
            FLAT, f"without friction: ratio of the median at {named(design)} to that at {named(WITHIN['smooth'])}",
            smooth[design] / smooth[WITHIN["smooth"]], expected=1, band=0.03,
        )  # fmt: skip
    case.ask(
        ROUGH, f"{named(WITHIN['smooth'])}: ratio of the median with friction 0.3 to that without friction",
        rough[WITHIN["smooth"]] / smooth[WITHIN["smooth"]], below=0.95,
    )  # fmt: skip
    case.ask(
        ROUGH, "ratio of the medians of the best and the smooth chamber: with friction 0.3, divided by that without",
        gain["with friction 0.3"] / gain["without friction"], below=0.95,
    )  # fmt: skip
    case.save(draw(found), "buckles.png")
    plt.close("all")
