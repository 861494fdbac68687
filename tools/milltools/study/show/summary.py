"""What a study has found so far, as text: the best designs with their errors."""

import math

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table as Sheet

from milltools.study.show.data import View, spoken

BEST = 5


def designs(table):
    """One row a design: the varied keys, then for each objective `path` (mean of its runs) and `path:half`, half of the 95 %
    interval as `mill study` gives it, and "runs". Only designs of which a run is done: a capped one may not have settled.
    A pandas.DataFrame indexed by nothing, best first by the first objective."""
    view = View.of(table)
    found = view.designs[[axis.key for axis in view.axes]].copy()
    good = (view.designs["state"] == "done").to_numpy()
    for objective in view.objectives:
        estimate = view.estimate(objective.path)
        found[objective.path], found[f"{objective.path}:half"] = estimate.mean, estimate.half
        good = good & np.isfinite(estimate.mean)
        found["runs"] = estimate.runs
    first = view.objectives[0]
    return found[good].sort_values(first.path, ascending=first.sign < 0, kind="stable").reset_index(drop=True)  # fmt: skip


def with_half(value, half) -> str:
    """A value and half of its 95 % interval; with what is not known as `?`."""
    return f"{value:.5g} +- {half:.2g}" if math.isfinite(half) else f"{value:.5g} +- ?"


def heads(view) -> list[str]:
    """Of a table of designs, with units: varied keys, then objectives."""
    names = [(axis.key, axis.scale.unit) for axis in view.axes]
    names += [(o.path.removeprefix("impacts/"), spoken(o.unit)) for o in view.objectives]
    return [f"{name} [{unit}]" if unit not in ("", "1") else name for name, unit in names]


def cells(view, row) -> list[str]:
    """A row of designs() in such a table."""
    values = [axis.tell(row[axis.key], unit=False) for axis in view.axes]
    return values + [with_half(row[o.path], row[f"{o.path}:half"]) for o in view.objectives]


def show(table):
    """The best designs, on standard output."""
    found, view = designs(table), View.of(table)
    if not len(found):
        print("no run is done as asked for, so there is no best design:")
        for message, times in table.frame()["message"].value_counts().head(3).items():
            print(f"    {times} x {message}")
        print()
        return
    sheet = Sheet(box=None, pad_edge=False, header_style="bold")
    for head in heads(view):
        sheet.add_column(escape(head), justify="right")
    for _, row in found.head(BEST).iterrows():
        sheet.add_row(*map(escape, cells(view, row)))
    first = view.objectives[0]
    goal = "largest" if first.sign > 0 else "smallest"
    print(f"the {goal} {first.path} of {len(found)} designs (+-: 95 %):\n")
    Console(highlight=False, width=None if Console().is_terminal else 200).print(sheet)
    print()
