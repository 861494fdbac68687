"""The power of a tumbling mill over its speed: the chart of the trade, of a study that varies the speed, with the
curves of formulas (power.models) beside the runs."""

import dataclasses

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import literal
from milltools.power import drum, models
from milltools.read.deck import Deck
from milltools.study.show import canvas
from milltools.study.show.data import base_of, deck_entries, settings
from milltools.study.show.slices import BARS

POWERS = ("power", "drive/power", "rotor/power")
CURVES = {"-": "Morrell C net", "--": "Hogg & Fuerstenau"}
MOST = 200  # designs: each is a call of millsim


def mills(view, objective) -> list[models.Mill]:
    """The mill of every design, where the objective is the power of a tumbling mill and its speed is varied; else
    empty."""
    turns = any(one.section == "drum" and one.key == "motion" for one in deck_entries(view.meta, "deck"))
    if not turns or objective.path not in POWERS or len(view.designs) > MOST:
        return []
    found = []
    try:
        with base_of(view) as file:
            for design in range(len(view.designs)):
                found.append(drum.mill_of(Deck.check(file, settings(view, design))))
    except UserError:  # not such a mill
        return []
    return found if len({round(mill.speed, 6) for mill in found}) > 2 else []


def draw(view, objective, found):
    """One colour for each design of the other keys; the points are the runs, the lines formulas."""
    figure = canvas.new(6.4, 4.6)
    ax = figure.subplots()
    told = view.estimate(objective.path)
    keys = [axis for axis in view.axes if not axis.key.endswith("speed")]
    groups = {}
    for design in range(len(found)):
        name = ", ".join(f"{axis.short} = {axis.tell(view.designs[axis.key][design])}" for axis in keys)
        groups.setdefault(name, []).append(design)
    for number, (name, designs) in enumerate(groups.items()):
        designs = sorted(designs, key=lambda design: found[design].speed)
        look = {"color": canvas.LINES[number % len(canvas.LINES)]}
        speeds = np.array([found[design].speed for design in designs])
        ax.errorbar(
            100 * speeds, told.mean[designs], np.nan_to_num(told.half[designs]), ls="", ms=4, label=literal(name),
            marker=canvas.MARKS[number % len(canvas.MARKS)], zorder=3, **look, **BARS,
        )  # fmt: skip
        fine = np.linspace(speeds[0], speeds[-1], 201)
        for dash, name in CURVES.items():
            (row,) = (model for model in models.MODELS if model.name == name)
            curve = np.array([row.of(dataclasses.replace(found[designs[0]], speed=speed)) for speed in fine])
            ax.plot(100 * fine, curve, ls=dash, lw=0.8, alpha=0.4, **look)
            known = np.where((row.speeds[0] <= fine) & (fine <= row.speeds[1]), curve, np.nan)
            ax.plot(100 * fine, known, ls=dash, lw=1.3, label=None if number else name, **look)
    ax.set(xlabel="share of the critical speed [%]", ylabel=canvas.value_label(objective))
    ax.set_ylim(bottom=0)
    ax.grid(alpha=0.25, lw=0.6)
    canvas.title(figure, f"{view.name}: simulated power with 95 %, and formulas, faint outside of their speeds")
    canvas.legend(figure, ax.get_legend_handles_labels()[0], 3)
    return figure
