"""The table on the terminal and as CSV."""

import itertools
import math
import sys

from rich.console import Console
from rich.table import Table
from rich.text import Text

from milltools.base import files, text
from milltools.base.text import columns, plain
from milltools.compare import finding
from milltools.compare.rows import deck_differences

COLOUR = {"agree": "green", "differ": "bold red", "open": "yellow", "apart": "bold", "tied": ""}
LEFT = (0, 3, 6)  # columns flush left


def number(value: float) -> str:
    """Five digits; nothing for NaN."""
    return text.number(value, 5) if math.isfinite(value) else ""


def percent(value: float, sign: str = "+") -> str:
    if not math.isfinite(value):
        return ""
    return f"{100 * value:{sign}.2f}" if abs(value) < 10 else f"{100 * value:{sign}.3g}"


def cells(row, designs: bool) -> list[str]:
    values = [number(row.a.value), number(row.b.value), row.unit]
    off, error = percent(row.difference, "" if row.group == "maps" else "+"), percent(row.difference_error, "")
    if designs and error and row.group != "maps":
        off, error = (told(row).removesuffix(" %") for told in (finding.percent, finding.interval))
    return [row.label, *values, off, error, row.verdict]


def heads(table) -> list[str]:
    error = "95 % interval [%]" if table.designs else "+- [%]"
    return ["", table.a.letter, table.b.letter, "unit", "diff. [%]", error, "verdict"]


def header_lines(sides) -> list[str]:
    """The runs that are compared, and the differences of their decks."""
    lines = []
    for side in sides:
        for k, run in enumerate(side.runs):
            window = f"sampled {run.window[0]:.6g} .. {run.window[1]:.6g} s"
            lines.append(f"{side.letter if k == 0 else ' '}  {run.path}: {run.made_by}, {window}, {run.status}")
    if not (differ := deck_differences(sides)):
        return [*lines, "", "The decks are the same."]
    pairs = [(key, " | ".join(value or "-" for value in values)) for key, values in differ]
    return [*lines, "", "The decks differ:", *(f"  {line}" for line in columns(pairs, left=(0, 1)))]


def show(sides, tables, notes):
    """Prints everything, the finding first: with colours and rules on a terminal that is wide enough, else as aligned
    text."""
    found = [line for table in tables for line in (finding.title(table), *finding.sentences(table), "")]
    for line in (*found, *header_lines(sides), "", *notes):
        print(plain(line))
    for table in tables:
        print()
        if not (sys.stdout.isatty() and _show_rich(table)):
            print("\n".join(_plain_table(table)))
        if table.zeros:
            print(f"\n{plain(table.zeros)}")


def _plain_table(table) -> list[str]:
    head, *lines = columns([heads(table), *(cells(row, table.designs) for row in table.shown)], LEFT)
    found = [table.title, head]
    for _, group in itertools.groupby(zip(table.shown, lines), key=lambda pair: pair[0].group):
        found += ["", *(line for _, line in group)]
    return found


def _show_rich(table) -> bool:
    """Shows the table; False, with nothing shown, if the terminal is too narrow."""
    console = Console(highlight=False)
    grid = Table(title=Text(table.title), title_justify="left")
    for k, head in enumerate(heads(table)):
        grid.add_column(head, justify="left" if k in LEFT else "right", no_wrap=True)
    for _, group in itertools.groupby(table.shown, key=lambda row: row.group):
        grid.add_section()
        for row in group:
            *fields, verdict = map(plain, cells(row, table.designs))
            look = "dim" if table.designs and row.mood == "open" else COLOUR[row.mood]
            grid.add_row(*map(Text, fields), Text(verdict, look))
    endless = console.options.update(width=10_000)
    if console.measure(grid, options=endless).maximum > console.width:
        return False
    console.print(grid)
    return True


COLUMNS = (
    "reference", "run", "group", "quantity", "label", "unit", "reference_value", "reference_error", "value", "error",
    "difference_percent", "difference_error_percent", "low_percent", "high_percent", "degrees_of_freedom", "verdict",
    "remark",
)  # fmt: skip


def rows(tables):
    """All rows of all tables with the cells of COLUMNS; None where a number is not known."""
    for table in tables:
        names = [",".join(run.path for run in side.runs) for side in (table.a, table.b)]
        for row in table.rows:
            numbers = [x for e in (row.a, row.b) for x in (e.value, e.told)]
            ends = row.interval if row.group != "maps" else (math.nan, math.nan)  # of the 95 % interval
            numbers += [100 * share for share in (row.difference, row.difference_error, *ends)] + [row.dof or math.nan]
            known = [value if math.isfinite(value) else None for value in numbers]
            yield [*names, row.group, row.key, row.label.strip(), row.unit, *known, row.verdict, row.remark]


def write_csv(tables, path):
    """All rows as CSV, numbers with all digits, empty where unknown."""
    files.write_csv(path, COLUMNS, rows(tables))
