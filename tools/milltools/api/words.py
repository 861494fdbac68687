"""A run as text, and as HTML for notebooks: its description, results and warnings."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

from milltools.api.measurement import Measurement
from milltools.read.runfile import Run
from milltools.report import facts as report

if TYPE_CHECKING:
    import pandas

COLUMNS = (  # of Result.summary: head, column, format, unit
    ("contacts", "count", ",.0f", ""),
    ("rate", "rate", ".4g", "1/s"),
    ("median v_n above the floor", "median_above_floor", ".4g", "m/s"),
    ("mean v_n", "mean", ".4g", "m/s"),
    ("at the floor", "floor_share", ".1%", ""),
    ("dissipated power", "dissipated_power", ".4g", "W"),
)


def facts(result: Any) -> dict[str, str]:
    """The lines about a run: {head: text}."""
    run: Run = result.file
    state = "" if run.status == "complete" else f", {run.status}"
    found = {"run": f"{result.name}: {run.program}{state}, {run.time:.4g} s simulated"}
    found["mill"] = f"{report.charge(run)} in {report.mill(run)}"
    if run.unsampled:
        found["statistics"] = f"none: status '{run.status}', nothing sampled so far"
        return found
    begin, end = run.window
    each = f", in each of {run.starts} starts" if run.starts > 1 else ""
    found["sampled"] = f"{end - begin:.4g} s, from {begin:.4g} s to {end:.4g} s{each}"
    found["impact speed"] = (
        f"{result.median_impact_speed}, median v_n of impacts above {1e3 * run.above_floor:.3g} mm/s"
    )
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
    found["anomalies"] = ", ".join(f"{times} {what}" for what, times, _ in report.anomalies(run) or []) or "none"
    if run.notes:
        found["notes"] = " ".join(run.notes)
    return found


def table(result: Any) -> pandas.DataFrame | None:
    """The table of contact kinds as texts; None if nothing was sampled."""
    if result.file.unsampled:
        return None
    found = result.summary.rename_axis(None)
    cells = {
        f"{head} [{unit}]" if unit else head: found[name].map(lambda value, form=form: format(float(value), form))
        for head, name, form, unit in COLUMNS
    }
    return found[[]].assign(**cells)


def as_text(result: Any) -> str:
    """Several lines for a terminal."""
    told = facts(result)
    width = max(map(len, told))
    lines = [f"{head:<{width}}  {text}" for head, text in told.items()]
    cells = table(result)
    return "\n".join(lines if cells is None else [*lines, "", cells.to_string()])


def as_html(result: Any) -> str:
    """The same as HTML; all text from the file is escaped."""
    lines = [f"<div><b>{html.escape(head)}</b>: {html.escape(text)}</div>" for head, text in facts(result).items()]
    cells = table(result)
    return f"<div>{''.join(lines)}{'' if cells is None else cells.to_html(border=0)}</div>"
