"""Two studies of the same keys side by side, on one scale, with a sentence that says how much of the gain of the first
remains in the second.

The gain of a study is its best design over a reference: the designs named by --reference, else the circular drum
(buckle height 0) where that was varied, else the median of all designs.
"""

import dataclasses
import math
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain
from milltools.figures.style import colour_bar
from milltools.study.show import canvas, contour, optimum
from milltools.study.show.data import Scale, deck_entries

CIRCLE = "drum.buckle_height"


@dataclasses.dataclass(frozen=True)
class Gain:
    """Best value divided by the reference, minus 1, with its standard error (NaN: unknown); `words`: the reference."""

    best: str
    value: float
    error: float
    reference: float
    words: str


def gain_of(view, objective, wanted=None) -> Gain | None:
    """The gain over the mean of all designs that match `wanted` {key: SI value}, over the circular drum, or over the
    median of all designs; None without a best design."""
    best, found = optimum.find(view, objective), view.estimate(objective.path)
    if best is None:
        return None
    known = np.isfinite(found.mean)
    match, circle = view.usable & known, known & np.asarray(view.designs.get(CIRCLE, np.nan) == 0)
    if wanted is None and circle.any():
        # without friction a circular drum never becomes steady: its value when it was capped is the only reference
        capped = not (match & circle).any()
        match, words = circle if capped else match & circle, f"the circular drum (h = 0{', capped' if capped else ''})"
    elif wanted is not None:
        words = ", ".join(f"{view.axis(k).short} = {view.axis(k).tell(v)}" for k, v in wanted.items())
        for key, value in wanted.items():
            column = view.designs[key]
            close = np.isclose(column.astype(float), value, rtol=1e-9) if view.axis(key).numeric else column == value
            match &= np.asarray(close, bool)
        if not match.any():
            raise UserError(f"--reference: {view.name} has no design with a result and {words}")
    value, variance = found.mean[match], float(np.mean(found.error[match] ** 2))
    if wanted is None and not circle.any():
        words, reference = "the median design", float(np.median(value))
        error = 1.2533 * math.sqrt(variance / len(value))
    else:
        # with shared seeds the circular drum is the same run at every n: equal values count as one run
        reference, error = float(value.mean()), math.sqrt(variance / len(np.unique(value)))
    ratio = best.value / reference
    error = abs(ratio) * math.hypot(best.half / optimum.REACH / best.value, error / reference)
    return Gain(view.tell(best.design), objective.sign * (ratio - 1), error, reference, words)


def share(value: float, error: float) -> str:
    """ "41 +- 3 %" of a share and its standard error, the interval at 95 %."""
    if not math.isfinite(error):
        return f"{100 * value:.{0 if abs(value) >= 1 else 1}f} %"
    return Scale(0.01, "%").pair(value, optimum.REACH * error)


def left(first: Gain, second: Gain) -> tuple[float, float]:
    """The second gain divided by the first, with its standard error."""
    ratio = second.value / first.value
    error = math.hypot(second.error / first.value, ratio * first.error / first.value)
    return ratio, error


def differences(views) -> list[tuple[str, str, str]]:
    """The differences of the study decks ([set]) and their base decks: ("contact.friction", "0", "0.3")."""
    decks = [_settings(view.meta) for view in views]
    return [
        (key, *(deck.get(key) or "not given" for deck in decks))
        for key in sorted(set(decks[0]) | set(decks[1]))
        if decks[0].get(key) != decks[1].get(key)
    ]


def _settings(meta) -> dict:
    """The values of the base deck, with the changes of [set] in the study deck."""
    deck = {f"{entry.section}.{entry.key}": entry.value for entry in deck_entries(meta, "deck")}
    return deck | {entry.key: entry.value for entry in deck_entries(meta, "study") if entry.section == "set"}


def sentences(views, objective, wanted=None) -> list[str]:
    """As text: the gain of each study, the part that remains, the value of the first study's best design in the second,
    and the differences of the decks."""
    names = [view.name for view in views]
    differ = [f"they differ in {key}: {a} in {names[0]}, {b} in {names[1]}" for key, a, b in differences(views)]
    gains = [gain_of(view, objective, wanted) for view in views]
    if None in gains:
        return [plain(f"{objective.words}: one of the studies has no value of it"), *map(plain, differ)]
    what = "higher" if objective.sign > 0 else "lower"
    shares = [share(gain.value, gain.error) for gain in gains]
    ways = ", ".join(f"{gain} {what} in {name}" for gain, name in zip(shares, names))
    line = f"{objective.words} of the best design, compared with {gains[0].words}: {ways}"
    if gains[0].value > 0:
        line += f"; {share(*left(*gains))} of the gain remains"
    known = any(math.isfinite(gain.error) for gain in gains)  # shown as +-
    told = [line + (" (95 % confidence)" if known else "; the error is not known")]
    first, second = (optimum.find(view, objective) for view in views)
    keys = [axis.key for axis in views[0].axes]
    same = np.flatnonzero(views[1].having(views[0].designs.loc[first.design, keys].to_dict()))[:1]
    for design in same:  # if it was run there
        value = objective.sign * (second.mean[design] / gains[1].reference - 1)
        if math.isfinite(value):
            told.append(
                f"the best design of {names[0]}, {gains[0].best}, is {100 * value:.3g} % {what} than {gains[1].words} "
                f"in {names[1]}, where it {'cannot' if second.open[design] else 'can'} be distinguished from the best, "
                f"{gains[1].best}"
            )
    return [plain(line) for line in [*told, *differ]]


def check(views, objective):
    """UserError if two studies cannot be compared."""
    keys = [[axis.key for axis in view.axes] for view in views]
    if sorted(keys[0]) != sorted(keys[1]):
        raise UserError(f"--beside: {views[1].name} varies {', '.join(keys[1])}, not {', '.join(keys[0])}")
    if objective.path not in [o.path for o in views[1].objectives]:
        raise UserError(f"--beside: {views[1].name} has no {objective.path}")


def draw(views, objective, x=None, y=None, average=False, sensitivities=(), wanted=None):
    """Both planes on one colour scale, with the sentence above them."""
    x, y = contour.main_keys(views[0], x, y, sensitivities)
    planes = []
    for view in views:  # in the units of the first
        ends = [dataclasses.replace(view.axis(axis.key), said=axis.drawn) for axis in (x, y)]
        planes.append(contour.plane(view, objective, *ends, average))
    levels, differ = contour.levels_of(planes), differences(views)
    figure = canvas.new(9.2, 5.2)
    axes = figure.subplots(1, 2)
    kept = {}
    for number, (ax, plane, view) in enumerate(zip(axes, planes, views), 1):
        image, handles = contour.paint(ax, plane, levels)
        settings = [f"{entry[0]} = {entry[number]}" for entry in differ[:3]]
        ax.set_title(canvas.broken(", ".join([contour.title(view, plane), *settings]), 60), loc="left")
        if plane.star:
            ax.set_xlabel(ax.get_xlabel() + "\n" + "; ".join(contour.best_words(view, objective)))
        for handle in handles:
            handle.set_label(re.sub(r" \(\d+\)$", "", handle.get_label()))  # the counts are of one study only
            kept.setdefault(handle.get_label(), handle)
    for end in "xy":  # cells of both may be of other sizes
        low, high = zip(*(getattr(ax, f"get_{end}lim")() for ax in axes))
        for ax in axes:
            ax.set(**{f"{end}lim": (max(low), min(high))})
    axes[1].set_ylabel("")
    axes[1].tick_params(labelleft=False)
    colour_bar(image, axes, label=canvas.value_label(objective, 60))
    canvas.title(figure, sentences(views, objective, wanted)[0])
    canvas.legend(figure, kept.values(), 4)
    return figure
