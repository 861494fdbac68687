"""The same study with friction 0.3: how much of the gain is left."""

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
        f"Without friction the best wavy chamber has {gains[0][0]:.2f} times the median impact speed of the smooth one "
        f"({gains[0][1]:.3f} m/s); with friction 0.3 {gains[1][0]:.2f} times ({gains[1][1]:.3f} m/s)."
    )
    case.picture("figure7", "beside", "beside.png", "--beside", KEPT / "friction.parquet")
