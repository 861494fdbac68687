"""Twelve points of speed and filling: millsim, LIGGGHTS and the formulas of the trade"""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
from charges import DECK, MODULUS, QUANTITIES, SEEDS, claim, claim_errors, unit, verdicts
from runs import say, sets

from milltools.power import drum, models
from milltools.read.deck import Deck

SPEEDS = (60, 70, 80, 90)  # [%] of critical
FILLINGS = (20, 30, 40)  # [%]
POINTS = [(speed, filling) for filling in FILLINGS for speed in SPEEDS]
CENTRE = (70, 30)
FORMULAS = {"Morrell C": models.morrell_net, "Hogg & Fuerstenau, 35°": models.hogg_fuerstenau}
SCATTER = {"Morrell C": 8.0, "Hogg & Fuerstenau, 35°": 8.9}  # [%] standard deviation on real mills: docs/tumbling.md
SLOWER = 80  # [%] of critical: where Hogg & Fuerstenau stand on mills
COLOURS = dict(zip(FILLINGS, ("tab:blue", "tab:green", "tab:red"), strict=True))


FLOOR = "the rebound floor of 33 mm/s, see part *spheres*"
# by quantity, the points that are known to be off for this reason
KNOWN = {
    "power": [(80, 20), (90, 20), (90, 30), (90, 40)],
    "kinetic": [(60, 20), (70, 20), (60, 30), (70, 30), (80, 30), (60, 40), (70, 40), (80, 40)],
    "toe": [(80, 20), (90, 20), (90, 30)],
    "shoulder": [(70, 20), (80, 20), (90, 20), (70, 30), (80, 30), (90, 30)],
    "fast": [(70, 20), (90, 20), (60, 30), (70, 30), (90, 30), (90, 40)],
}
RARE = "at 90 % of critical and J 20 % their rate differs from turn to turn, and LIGGGHTS runs 18 of them"


def settings(speed, filling):
    """Of the deck, for one point."""
    return {"motion__turn__speed": f"{speed} % critical", "balls__bulk_fill": f"{filling} %"}


def run_of_liggghts(case, speed, filling):
    """The kept run of a point."""
    return case.dem(f"tumbling-{speed}-{filling}", DECK, MODULUS, **settings(speed, filling))


def mill(speed, filling):
    """The Mill of the formulas of a point."""
    return drum.mill_of(Deck.check(DECK, sets(settings(speed, filling))))


def check(case):
    say("    twelve points of speed and filling")
    soft = {point: run_of_liggghts(case, *point) for point in POINTS}
    found = {point: verdicts([soft[point]], case.seeds(SEEDS, DECK, **settings(*point))) for point in POINTS}
    for k, quantity in enumerate(QUANTITIES):
        worst = max(POINTS, key=lambda point, k=k: abs(found[point][k].off))
        for point in POINTS:
            what = f"{point[0]} % of critical, J {point[1]} %"
            known = FLOOR if point in KNOWN[quantity.key] else ""
            claim(case, found[point][k], what, " (largest of 12)" * (point == worst), known)
        off = np.array([found[point][k].off for point in POINTS])
        case.tell(
            f"{quantity.name}: the mean deviation of the twelve points is {off.mean():+.1f} {unit(quantity)}, from "
            f"{off.min():+.1f} to {off.max():+.1f} {unit(quantity)}."
        )
    claim_errors(case, found.values(), {"fast": RARE})
    formulas(case, found)
    draw_power(case, found)
    draw_angles(case, found)


def formulas(case, found):
    """How far the powers of the formulas are off the simulated ones [%]."""
    mills = {point: mill(*point) for point in POINTS}
    for name, power in FORMULAS.items():
        off = {point: 100 * (power(mills[point]) / found[point][0].hard - 1) for point in POINTS}
        inside = [off[point] for point in POINTS if point[0] <= SLOWER]
        case.bound(
            f"{name}: root mean square of its deviations, up to {SLOWER} % of critical",
            np.sqrt(np.mean(np.square(inside))),
            2 * SCATTER[name],
            unit="%",
            against="twice its standard deviation on mills",
            headline=True,
        )
        told = ", ".join(f"{speed} %, J {filling} %: {value:+.0f}" for (speed, filling), value in off.items())
        case.tell(f"{name} divided by millsim, minus 1, in per cent: {told}.")


def curves(value):
    """(filling, speeds [%], value(Mill)) over the speeds, for each filling."""
    at = np.arange(SPEEDS[0], SPEEDS[-1] + 1)
    for filling in FILLINGS:
        base = mill(CENTRE[0], filling)
        faster = [dataclasses.replace(base, speed=base.speed * speed / CENTRE[0]) for speed in at]
        yield filling, at, np.array([value(one) for one in faster])


def largest(found, k):
    """The largest deviations of the k-th quantity: up to SLOWER, and faster."""
    size = {point: abs(verdicts[k].off) for point, verdicts in found.items()}
    return [max(value for (speed, _), value in size.items() if (speed > SLOWER) == fast) for fast in (False, True)]


def draw_both(axes, found, k, label=True):
    """The k-th quantity of both programs over the speed."""
    for filling, colour in COLOURS.items():
        row = [found[speed, filling][k] for speed in SPEEDS]
        name = f"J {filling} %" if label else None
        at = np.array(SPEEDS) + (filling - CENTRE[1]) / 25  # else they hide each other
        axes.plot(at, [v.hard for v in row], "o-", color=colour, ms=5, lw=1.5, label=name)
        axes.plot(at, [v.soft for v in row], "s", mfc="none", mec=colour, ms=9, mew=1.3)


def draw_power(case, found):
    figure, axes = plt.subplots(figsize=(7.5, 5.2), layout="constrained")
    draw_both(axes, found, 0)
    for (_, power), style in zip(FORMULAS.items(), ("-", "--"), strict=True):
        for filling, at, values in curves(power):
            axes.plot(at, values, style, color=COLOURS[filling], lw=0.8, alpha=0.7)
    for label, style in (("millsim", "o-"), ("LIGGGHTS", "s"), *zip(FORMULAS, ("-", "--"), strict=True)):
        thin = label in FORMULAS
        axes.plot(
            [], [], style, color="0.3", mfc="none" if style == "s" else "0.3", lw=0.8 if thin else 1.5, label=label
        )
    slow, fast = largest(found, 0)
    axes.set(
        xlabel="speed [% of critical, of a ball at the wall]",
        ylabel="power [W]",
        title=f"Up to {SLOWER} % of critical hard and soft spheres agree within {slow:.0f} % in power;\n"
        f"near the critical speed hard ones draw up to {fast:.0f} % more",
    )
    axes.set_xticks(SPEEDS)
    axes.set_ylim(0)
    axes.legend(fontsize=8, ncols=2)
    case.save(figure, "power.png")


def draw_angles(case, found):
    figure, axes = plt.subplots(figsize=(7.5, 5.2), layout="constrained")
    names = [quantity.key for quantity in QUANTITIES]
    for key in ("toe", "shoulder"):
        draw_both(axes, found, names.index(key), key == "toe")
    for k, turned in ((0, -270), (1, 90)):
        for filling, at, values in curves(lambda one, k=k: models.toe_and_shoulder(one)[k]):
            axes.plot(at, np.degrees(values) + turned, "-", color=COLOURS[filling], lw=0.8, alpha=0.7)
    for label, style, width in (("millsim", "o-", 1.5), ("LIGGGHTS", "s", 0), ("Morrell", "-", 0.8)):
        axes.plot([], [], style, color="0.3", mfc="none" if style == "s" else "0.3", lw=width, label=label)
    toe, shoulder = (largest(found, names.index(key)) for key in ("toe", "shoulder"))
    axes.set(
        xlabel="speed [% of critical, of a ball at the wall]",
        ylabel="angle from 6 o'clock, rising side [deg]",
        title=f"Up to {SLOWER} % of critical hard and soft spheres have the same toe within {toe[0]:.0f}°;\n"
        f"hard ones leave the lifters up to {max(shoulder):.0f}° earlier",
    )
    axes.set_xticks(SPEEDS)
    axes.text(SPEEDS[0], 60, "shoulder above, toe below", fontsize=9, color="0.3")
    axes.legend(fontsize=8, ncols=2, loc="center right")
    case.save(figure, "angles.png")
