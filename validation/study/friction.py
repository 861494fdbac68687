"""The study of Figure 7 with friction 0.3: how much of the increase of the median remains."""

from figure7 import check_grid
from study_case import FRICTION, KEPT, MEDIAN, H

NAMES = ("figure7", "friction")


def gain(table):
    """Largest median of the designs that are done over the median of the smooth drum (h = 0)."""
    smooth = table[table[H] == 0][MEDIAN].median()
    return table[table.status == "done"][MEDIAN].max() / smooth, smooth


def check(case):
    without, _ = case.study("figure7", "sweep")
    options = [word for text in FRICTION for word in ("--set", text)]
    table, wall = case.study("friction", "sweep", *options)
    check_grid(case, "friction", table, wall, "friction 0.3")
    gains = [gain(t) for t in (without, table)]
    case.tell(
        "Ratio of the median impact speed of the best wavy chamber to that of the smooth chamber: "
        f"{gains[0][0]:.2f} without friction (smooth chamber: {gains[0][1]:.3f} m/s), "
        f"{gains[1][0]:.2f} with friction 0.3 (smooth chamber: {gains[1][1]:.3f} m/s)."
    )
    case.picture("figure7", "beside", "beside.png", "--beside", KEPT / "friction.parquet")
