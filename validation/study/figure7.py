"""Figure 7 of the paper: median normal impact speed against number and height of buckles, frictionless, 1000 rpm."""

from study_case import MEDIAN, H, N, best, named

WALL = 15 * 60.0  # [s]


def check_grid(case, name, table, wall, what):
    """Claims that hold for the grid with and without friction."""
    done = table[table.status == "done"]
    capped = int((table.status == "capped").sum())
    case.bound(
        f"{what}: number of the 19 x 21 designs that are missing or failed",
        399 - len(table) + int((table.status == "failed").sum()), 0,
        against="the grid is complete",
    )  # fmt: skip
    case.bound(
        f"{what}: largest relative standard error of the median, {len(done)} designs that were not capped",
        100 * float((done[f"{MEDIAN}:error"] / done[MEDIAN]).max()), 2, unit="%",
        against="required: each median known to 2 %", headline=name == "figure7",
    )  # fmt: skip
    case.bound(
        f"{what}: wall time of `mill sweep` on two cores", wall, WALL, unit="s",
        against="required: at most 15 minutes", headline=name == "figure7",
    )  # fmt: skip
    top = best(table)
    low = table.loc[table[MEDIAN].idxmin()]
    case.tell(
        f"{what}: {len(done)} designs done, {capped} capped; largest median at {named(top)}: "
        f"{done[MEDIAN].max():.3f} m/s; smallest at {named((int(low[N]), low[H]))}: {low[MEDIAN]:.3f} m/s; "
        f"{table.cpu.sum():.0f} CPU s and {table.collisions.sum() / 1e9:.2f}e9 contacts in total"
    )
    return top


def check(case):
    table, wall = case.study("figure7", "sweep")
    check_grid(case, "figure7", table, wall, "frictionless")
    flat, others = table[table[H] == 0], table[table[H] > 0]
    cut = others[others.status == "capped"]
    case.tell(
        "The capped designs with buckles, whose charge is a ring when the run ends, have medians of "
        f"{cut[MEDIAN].min():.3f} to {cut[MEDIAN].max():.3f} m/s; the charge of the smooth drum is a ring as well, its "
        f"median is {flat[MEDIAN].max():.3f} m/s. The medians of such designs depend on the time at which the run "
        "ends, not on the wall."
    )
    alike = case.alike("figure7")
    case.tell(
        f"Within 2 % of the best design: n = {min(a for a, _ in alike)}..{max(a for a, _ in alike)}, "
        f"h = {1e3 * min(b for _, b in alike):g}..{1e3 * max(b for _, b in alike):g} mm; "
        f"{len(alike)} of {len(table)} designs"
    )
    case.picture("figure7", "contour", "figure7.png")
    case.picture("figure7", "slices", "slices.png")
