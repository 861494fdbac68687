"""A run in words, and as HTML for notebooks: what it is, what came out, and what to mind."""

import html

from milltools.api.measurement import Measurement
from milltools.read import motions
from milltools.read.runfile import Run

COLUMNS = (  # of tables.summary: head, unit, format
    ("contacts", "count", ",.0f", ""),
    ("rate", "rate", ".4g", "1/s"),
    ("median v_n > 50 mm/s", "median_above_50mm_s", ".4g", "m/s"),
    ("mean v_n", "mean", ".4g", "m/s"),
    ("at the floor", "floor_share", ".1%", ""),
    ("dissipated power", "dissipated_power", ".4g", "W"),
)
ANOMALIES = {
    "overlaps": "balls deep in other bodies",
    "reliefs": "pinched balls let go",
    "smoothed": "contacts made smooth because time stood still",
    "not_closing": "due contacts found opening",
}


def facts(result) -> dict[str, str]:
    """What is told of a run, a line each: {head: text}."""
    run: Run = result.file
    state = "" if run.status == "complete" else f", {run.status}"
    found = {"run": f"{result.name}: {run.program}{state}, {run.time:.4g} s simulated"}
    balls = len(run.balls("diameter")) if run.has("particles/trajectory/diameter") else 0
    found["mill"] = f"{balls} balls" + f", {_driven(run)}"
    if not run.has_statistics or not run.duration > 0:
        found["statistics"] = f"none: status '{run.status}', nothing sampled so far"
        return found
    begin, end = run.window
    found["sampled"] = f"{run.duration:.4g} s, from {begin:.4g} s to {end:.4g} s"
    found["impact speed"] = f"{result.median_impact_speed}, median v_n of impacts above 50 mm/s"
    for head, name, unit, what in (
        ("median", "median", "m/s", "of all impacts"),
        ("rate", "rate_above_1/all", "1/s", "of impacts above 1 m/s"),
    ):
        known = run.known(name)
        if known:
            found[head] = f"{Measurement(*known[:2], unit)}, {what}"
    if run.driven == "drive":
        found["drive power"] = str(result.drive)
    elif run.has_rotor:
        found["rotor power"], found["rotor torque"] = str(result.power), str(result.torque)
    found["anomalies"] = anomalies(run)
    if run.notes:
        found["notes"] = " ".join(run.notes)
    return found


def _driven(run) -> str:
    if run.driven == "drive":
        return ", ".join(f"{name} {motions.words(run, name)}" for name in run.motions)
    if not run.has_rotor:
        return "nothing moves"
    return f"rotor at {motions.speed(run, 'rotor')} with {len(run.blades())} blades"


def anomalies(run: Run) -> str:
    """What should not have happened, counted; "none"."""
    counts = {n: int(run.read(f"run/{n}")) for n in ANOMALIES if run.has(f"run/{n}")}
    return ", ".join(f"{count} {ANOMALIES[n]}" for n, count in counts.items() if count) or "none"


def rows(run: Run) -> list[list[str]]:
    """The table of contact kinds as texts, its head first; empty where nothing was sampled."""
    if not run.has_statistics or not run.duration > 0:
        return []
    from milltools.api import tables

    table = tables.summary(run)
    head = ["kind"] + [f"{name} [{unit}]" if unit else name for name, _, _, unit in COLUMNS]
    body = [
        [kind] + [format(float(row[column]), form) for _, column, form, _ in COLUMNS] for kind, row in table.iterrows()
    ]
    return [head, *body]


def as_text(result) -> str:
    """Several lines for a terminal."""
    told = facts(result)
    width = max(map(len, told))
    lines = [f"{head:<{width}}  {text}" for head, text in told.items()]
    cells = rows(result.file)
    if cells:
        widths = [max(map(len, column)) for column in zip(*cells)]
        lines.append("")
        for first, *rest in cells:
            numbers = "  ".join(f"{cell:>{w}}" for cell, w in zip(rest, widths[1:]))
            lines.append(f"{first:<{widths[0]}}  {numbers}")
    return "\n".join(lines)


def as_html(result) -> str:
    """The same as HTML, everything from the file escaped."""
    lines = [f"<div><b>{_safe(head)}</b>: {_safe(text)}</div>" for head, text in facts(result).items()]
    cells = rows(result.file)
    if cells:
        head, *body = cells
        made = [_row("th", head), *(_row("td", row) for row in body)]
        lines.append(f"<table>{''.join(made)}</table>")
    return f"<div>{''.join(lines)}</div>"


def _row(tag, cells) -> str:
    first, *rest = (f"<{tag}>{_safe(cell)}</{tag}>" for cell in cells)
    left = first.replace(f"<{tag}>", f'<{tag} style="text-align: left">', 1)
    return f"<tr>{left}{''.join(rest)}</tr>"


def _safe(text) -> str:
    return html.escape(str(text), quote=True)
