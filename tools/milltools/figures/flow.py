"""Where the power goes, as a flow: from what moves, and from energy that the charge gives up, to the impacts by contact kind,
each parted into what the normal and the tangential motion lost, and into energy that the charge takes up."""

import numpy as np

from milltools.base.text import number, quantity
from milltools.figures import sankey
from milltools.figures.account import ENERGIES, Account, account, why_not
from milltools.figures.base import WIDTH, Figure, labels, not_sampled, subtitle
from milltools.figures.style import INK, kind_look
from milltools.read.kinds import label

PARTS = {"normal": 0.85, "tangential": 0.5, "": 0.7}  # how solid a band is
STORED = "#8c8c8c"


class Flow(Figure):
    name, group, title = "flow", "energy", "Energy account"
    caption = (
        "Mean powers over the sampled window, widths true to scale. Left: what gives energy (each motion; the charge, where "
        "its kinetic or potential energy falls; the rebound floor at slow impacts); right: what takes it. All that is given "
        "is 100 %."
    )

    def why_not(self, run):
        why = not_sampled(run) or why_not(run)
        if why:
            return why
        return None if account(run).turnover > 0 else "no energy was turned over in the sampled window"

    def paint(self, figure, runs):
        accounts = [account(run) for run in runs]
        rows = [max(len(a.sinks), 6) for a in accounts]
        heights = [0.75 + 0.195 * n for n in rows]
        figure.set_size_inches(WIDTH, 0.35 + sum(heights))
        axes = figure.subplots(len(runs), 1, squeeze=False, height_ratios=heights)[:, 0]
        for ax, name, found, height in zip(axes, labels(runs), accounts, heights):
            panel(ax, found, height)
            subtitle(ax, f"{name}, {_words(found)}")

    def columns(self, run):
        found = account(run)
        rows = [("gives", *s) for s in found.sources] + [("takes", *s) for s in found.sinks]
        way, what, kind, part, power = zip(*rows)
        power = np.array(power)
        return {
            "way": np.array(way),
            "what": np.array(what),
            "kind": np.array(kind),
            "part": np.array(part),
            "power [W]": power,
            "share [1]": power / found.turnover,
            "from [s]": np.full(len(power), found.window[0]),
            "to [s]": np.full(len(power), found.window[1]),
        }


def _words(found: Account) -> str:
    begin, end = found.window
    off = abs(found.residual) / found.turnover
    error = "<0.001 %" if off < 1e-5 else f"{number(100 * off)} %"
    return f"mean of {number(begin, 4)} to {number(end, 4)} s; 100 % = {quantity(found.turnover, 'W')}, balance error {error}"


def panel(ax, found: Account, height: float):
    """One account in axes of its own, `height` [inch] high."""
    whole = found.turnover
    kinds = tuple(found.dissipation)
    sources = [_source(term, whole, kinds) for term in found.sources]
    sinks, seen = [], set()
    for term in found.sinks:
        sinks.append(_sink(term, whole, kinds, first=term[1] not in seen))
        seen.add(term[1])
    line = 0.168 / (height - 0.45)
    extent = sankey.draw(ax, sources, sinks, line=line)
    ax.set_axis_off()
    ax.set_xlim(sankey.LEFT, sankey.COLUMNS[-1])
    ax.set_ylim(extent, -line / 2)


def _numbers(power, whole):
    percent = 100 * power / whole
    return quantity(power, "W"), f"{percent:.1f} %" if percent >= 0.05 else "<0.1 %"


def _source(term, whole, kinds) -> sankey.Band:
    what, kind, part, power = term
    words = {"rotor": "rotor", "residual": "balance error"}.get(what)
    if what in ENERGIES:
        words = ENERGIES[what]
    if what == "motion":
        words = kind
    if what == "dissipation":
        words = f"{label(kind)} {part}".strip()
    colour = INK if what in ("rotor", "motion") else STORED
    if what == "dissipation":
        colour = kind_look(kind, kinds)["color"]
    return sankey.Band(power, colour, 0.55, (words, *_numbers(power, whole)), what)


def _sink(term, whole, kinds, first) -> sankey.Band:
    what, kind, part, power = term
    if what == "dissipation":
        colour, words = kind_look(kind, kinds)["color"], (label(kind) if first else "", part)
        return sankey.Band(power, colour, PARTS[part], (*words, *_numbers(power, whole)), kind)
    words = {"rotor": "rotor, braked", "motion": f"{kind}, braked", "residual": "balance error"}.get(
        what
    ) or f"{ENERGIES[what]} rises"
    return sankey.Band(power, STORED, 0.7, (words, "", *_numbers(power, whole)), what)


FIGURES = (Flow(),)
