"""What a study has found so far, as text: the best designs with their errors."""

import math

from rich.console import Console
from rich.table import Table as Sheet

BEST = 5


def designs(table):
    """One row a design, replicates averaged: the varied keys, then for each objective `path` and `path:error`, standard error
    of the mean from the scatter of two and more replicates, else the run's own. Only runs that are done: a capped one may not
    have settled.
    A pandas.DataFrame indexed by nothing, best first by the first objective."""
    frame, meta = table.frame(), table.meta
    keys = [vary["key"] for vary in meta["vary"]]
    paths = [objective["path"] for objective in meta["objectives"]]
    good = frame[(frame["status"] == "done") & frame[paths].notna().all(axis=1)]
    groups = good.groupby(keys, sort=False)
    found = groups[[*paths, *(f"{path}:error" for path in paths)]].mean()
    count = groups.size()
    for path in paths:
        scatter = groups[path].std() / count**0.5
        found[f"{path}:error"] = found[f"{path}:error"].where(count < 2, scatter)
    found["runs"] = count
    first = meta["objectives"][0]
    return found.reset_index().sort_values(paths[0], ascending=first["goal"] == "minimise", kind="stable")  # fmt: skip


def number(value) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def with_error(value, error) -> str:
    return f"{value:.5g}" if math.isnan(error) else f"{value:.5g} +- {error:.2g}"


def unit(text) -> str:
    return "" if text in ("1", "") else f" [{text}]"


def show(table):
    """The best designs, on standard output."""
    found, meta = designs(table), table.meta
    if not len(found):
        return
    sheet = Sheet(box=None, pad_edge=False, header_style="bold")
    for vary in meta["vary"]:
        sheet.add_column(f"{vary['key']}{unit(vary['unit'])}".replace("[", r"\["), justify="right")
    for objective in meta["objectives"]:
        name = objective["path"].removeprefix("impacts/")
        sheet.add_column(f"{name}{unit(objective['unit'])}".replace("[", r"\["), justify="right")
    for _, row in found.head(BEST).iterrows():
        cells = [number(row[vary["key"]]) for vary in meta["vary"]]
        cells += [with_error(row[o["path"]], row[f"{o['path']}:error"]) for o in meta["objectives"]]
        sheet.add_row(*cells)
    goal = "largest" if meta["objectives"][0]["goal"] == "maximise" else "smallest"
    print(f"the {goal} {meta['objectives'][0]['path']} of {len(found)} designs:\n")
    Console(highlight=False, width=None if Console().is_terminal else 200).print(sheet)
    print()
