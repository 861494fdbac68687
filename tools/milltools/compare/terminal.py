"""The table on the terminal and as CSV."""

import csv
import math
import os
import sys

from rich.console import Console
from rich.table import Table
from rich.text import Text

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.compare.rows import deck_differences

COLOUR = {"agree": "green", "differ": "bold red", "open": "yellow"}


def number(value: float) -> str:
    """Five digits; nothing for NaN."""
    if not math.isfinite(value):
        return ""
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        return f"{value:.{max(0, 4 - math.floor(math.log10(abs(value))))}f}"
    return f"{value:.4e}"


def percent(value: float, sign: str = "+") -> str:
    if not math.isfinite(value):
        return ""
    return f"{100 * value:{sign}.2f}" if abs(value) < 10 else f"{100 * value:{sign}.3g}"


def cells(row) -> list[str]:
    unsigned = row.group == "maps"
    return [
        row.label,
        number(row.a.value),
        number(row.b.value),
        row.unit,
        percent(row.difference, "" if unsigned else "+"),
        percent(row.difference_error, ""),
        row.verdict,
    ]


def heads(table) -> list[str]:
    return ["", table.a.letter, table.b.letter, "unit", "diff. [%]", "+- [%]", "verdict"]


def title(table) -> str:
    return f"{table.b.letter} against {table.a.letter}"


def header_lines(sides) -> list[str]:
    """Who is compared, and what differs between the decks."""
    lines = []
    for side in sides:
        for k, run in enumerate(side.runs):
            window = f"sampled {run.window[0]:.6g} .. {run.window[1]:.6g} s"
            lead = side.letter if k == 0 else " "
            lines.append(f"{lead}  {run.path}: {run.made_by}, {window}, {run.status}")
    differ = deck_differences(sides)
    if not differ:
        return [*lines, "", "The decks are the same."]
    lines += ["", "The decks differ:"]
    width = max(len(key) for key, _ in differ)
    for key, values in differ:
        lines.append(f"  {key:<{width}}  " + " | ".join(value or "-" for value in values))
    return lines


def show(sides, tables, notes, stream=None):
    """Prints everything: with colours and rules where it is a terminal wide enough, else as aligned text."""
    stream = stream or sys.stdout
    for line in header_lines(sides):
        print(plain(line), file=stream)
    print(file=stream)
    for note in notes:
        print(plain(note), file=stream)
    for table in tables:
        print(file=stream)
        if not (stream.isatty() and _show_rich(table, stream)):
            _show_plain(table, stream)


def _show_plain(table, stream):
    lines = [heads(table)]
    groups = [None]
    for row in table.rows:
        lines.append(cells(row))
        groups.append(row.group)
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]) - 1)]
    print(title(table), file=stream)
    for line, group, before in zip(lines, groups, [None, *groups]):
        if group != before:
            print(file=stream)
        fields = [
            f"{field:<{width}}" if k in (0, 3) else f"{field:>{width}}"
            for k, (field, width) in enumerate(zip(line, widths))
        ]
        print("  ".join([*fields, line[-1]]).rstrip(), file=stream)


def _show_rich(table, stream) -> bool:
    """False, with nothing shown, where the terminal is too narrow for it."""
    console = Console(file=stream, highlight=False)
    grid = Table(title=Text(title(table)), title_justify="left")
    for k, head in enumerate(heads(table)):
        grid.add_column(head, justify="left" if k in (0, 3, 6) else "right", no_wrap=True)
    for k, row in enumerate(table.rows):
        if k and row.group != table.rows[k - 1].group:
            grid.add_section()
        *fields, verdict = cells(row)
        grid.add_row(*map(Text, fields), Text(verdict, COLOUR[row.mood]))
    endless = console.options.update(width=10_000)
    if console.measure(grid, options=endless).maximum > console.width:
        return False
    console.print(grid)
    return True


COLUMNS = (
    "reference", "run", "group", "quantity", "label", "unit", "reference_value", "reference_error", "value", "error",
    "difference_percent", "difference_error_percent", "degrees_of_freedom", "verdict", "remark",
)  # fmt: skip


def write_csv(tables, path):
    """All rows of all tables, numbers with all digits, empty where unknown; replaced as a whole."""

    def digits(value, scale=1):
        return repr(float(value * scale)) if math.isfinite(value) else ""

    part = f"{path}.part"
    try:
        with open(part, "w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(COLUMNS)
            for table in tables:
                names = [",".join(r.path for r in side.runs) for side in (table.a, table.b)]
                for row in table.rows:
                    writer.writerow(
                        [*names, row.group, row.key, row.label.strip(), row.unit]
                        + [digits(x) for e in (row.a, row.b) for x in (e.value, e.told)]
                        + [digits(row.difference, 100), digits(row.difference_error, 100)]
                        + [digits(row.dof) if row.dof else "", row.verdict, row.remark]
                    )
        os.replace(part, path)
    except OSError as fault:
        raise UserError(f"{path}: {fault.strerror}", status=1) from None
