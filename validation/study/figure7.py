"""Figure 7 of the paper: median normal impact speed over number and height of buckles, frictionless, 1000 rpm."""

from study_case import MEDIAN, H, N, best, named

WALL = 15 * 60.0  # [s]


def check_grid(case, name, table, wall, what):
    """Claims that hold for the grid with and without friction."""
    done = table[table.status == "done"]
    capped = int((table.status == "capped").sum())
    case.bound(
        f"{what}: designs missing or failed, of 19 x 21",
        399 - len(table) + int((table.status == "failed").sum()), 0, against="the grid",
    )  # fmt: skip
    case.bound(
        f"{what}: largest standard error of the median of the {len(done)} designs that were not capped",
        100 * float((done[f"{MEDIAN}:error"] / done[MEDIAN]).max()), 2, unit="%",
        against="asked: each point to 2 %", headline=name == "figure7",
    )  # fmt: skip
    case.bound(
        f"{what}: wall time of mill sweep, two cores", wall, WALL, unit="s",
        against="asked: 15 minutes", headline=name == "figure7",
    )  # fmt: skip
    top = best(table)
    low = table.loc[table[MEDIAN].idxmin()]
    case.tell(
        f"{what}: {len(done)} designs done, {capped} capped; best {named(top)} with {done[MEDIAN].max():.3f} m/s, "
        f"lowest {named((int(low[N]), low[H]))} with {low[MEDIAN]:.3f} m/s; {table.cpu.sum():.0f} CPU s in all, "
        f"{table.collisions.sum() / 1e9:.2f}e9 contacts"
    )
    return top


def check(case):
    table, wall = case.study("figure7", "sweep")
    check_grid(case, "figure7", table, wall, "frictionless")
    flat, others = table[table[H] == 0], table[table[H] > 0]
    cut = others[others.status == "capped"]
    case.tell(
        f"In the dead corner, where the charge is a ring when the run is cut off, medians are {cut[MEDIAN].min():.3f} to "
        f"{cut[MEDIAN].max():.3f} m/s; that of the smooth drum, a ring as well, is {flat[MEDIAN].max():.3f} m/s. What tells such designs apart is the cut, not the wall."
    )
    alike = case.alike("figure7")
    case.tell(
        f"Within 2 % of the best: n {min(a for a, _ in alike)}..{max(a for a, _ in alike)}, "
        f"h {1e3 * min(b for _, b in alike):g}..{1e3 * max(b for _, b in alike):g} mm, {len(alike)} of {len(table)} designs"
    )
    case.picture("figure7", "contour", "figure7.png")
    case.picture("figure7", "slices", "slices.png")
