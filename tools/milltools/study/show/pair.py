"""Two studies of the same keys side by side, on one scale, and a plain sentence on how much of the gain of one is left in the other.

The gain of a study is its best design over a reference: the designs named by --reference, else the circular drum (buckle height
0) where that was varied, else the median of all designs.
"""

import dataclasses
import math
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.read import deck_text as lines
from milltools.study.show import contour as show_contour
from milltools.study.show import draw as show_draw
from milltools.study.show import optimum as show_optimum
from milltools.study.show import terminal as show_text

CIRCLE = "drum.buckle_height"


@dataclasses.dataclass(frozen=True)
class Gain:
    """Best over reference less 1, with its standard error (NaN if unknown), SI; `words` names the reference."""

    best: str
    value: float
    error: float
    reference: float
    words: str


def reference_of(view, objective, wanted=None) -> tuple[float, float, str]:
    """(value, standard error, its name): mean over all designs that match `wanted` {key: SI value}."""
    found = view.estimate(objective.path)
    known = np.isfinite(found.mean)
    usable = show_optimum.usable(view) & known
    circle = known & np.asarray(view.designs.get(CIRCLE, np.nan) == 0)
    if wanted is None and circle.any():
        # without friction a circular drum never settles: what it was when it was cut off is the only reference there is
        capped = not (usable & circle).any()
        usable = known if capped else usable
        wanted, words = {CIRCLE: 0.0}, f"the circular drum (h = 0{', capped' if capped else ''})"
    elif wanted is None:
        value = float(np.median(found.mean[usable]))
        error = 1.2533 * math.sqrt(float(np.mean(found.error[usable] ** 2)) / usable.sum())
        return value, error, "the median design"
    else:
        words = ", ".join(f"{view.axis(k).short} = {view.axis(k).tell(v)}" for k, v in wanted.items())
    match = usable.copy()
    for key, value in wanted.items():
        column = view.designs[key]
        close = np.isclose(column.astype(float), value, rtol=1e-9) if view.axis(key).numeric else column == value
        match &= np.asarray(close, bool)
    if not match.any():
        raise UserError(f"--reference: no design of {view.name} that ran has {words}")
    # with shared seeds the circular drum is the same run at every n: equal to the last digit, so one and not many
    runs = len(np.unique(found.mean[match]))
    error = math.sqrt(float(np.mean(found.error[match] ** 2)) / runs)
    return float(found.mean[match].mean()), error, words


def gain_of(view, objective, wanted=None) -> Gain | None:
    optimum = show_optimum.find(view, objective)
    if optimum is None:
        return None
    reference, error, words = reference_of(view, objective, wanted)
    ratio = optimum.value / reference
    relative = math.hypot(optimum.half / show_optimum.REACH / optimum.value, error / reference)
    return Gain(
        view.tell(optimum.design),
        objective.sign * (ratio - 1),
        abs(ratio) * relative,
        reference,
        words,
    )


def share(value: float, error: float) -> str:
    """ "41 +- 3 %" of a share and its standard error, the interval at 95 %."""
    if not math.isfinite(error):
        return f"{100 * value:.{0 if abs(value) >= 1 else 1}f} %"
    value, half = show_text.told(100 * value, 100 * show_optimum.REACH * error)
    return f"{value}{' +- ' + half if half else ''} %"


def left(first: Gain, second: Gain) -> tuple[float, float]:
    """How much of the first gain the second is, with its standard error."""
    ratio = second.value / first.value
    error = math.hypot(second.error / first.value, ratio * first.error / first.value)
    return ratio, error


def differences(views) -> list[tuple[str, str, str]]:
    """What [set] of the study decks and their base decks say differently: ("contact.friction", "0", "0.3")."""
    decks = [_keys(v.meta.get("deck", "")) | _settings(v.meta.get("study", "")) for v in views]
    return [
        (key, *((deck.get(key) or "not given") for deck in decks))
        for key in sorted(set(decks[0]) | set(decks[1]))
        if decks[0].get(key) != decks[1].get(key)
    ]


def difference_lines(views) -> list[str]:
    return [f"they differ in {key}: {a} in {views[0].name}, {b} in {views[1].name}" for key, a, b in differences(views)]


def _entries(text) -> list:
    try:
        return lines.entries(text, "")
    except UserError:
        return []


def _keys(text) -> dict:
    return {f"{e.section}.{e.key}": e.value for e in _entries(text)}


def _settings(text) -> dict:
    return {e.key: e.value for e in _entries(text) if e.section == "set"}


def sentences(views, objective, wanted=None) -> list[str]:
    """In plain words: the gain of each, how much of it is left, what the best of the first is worth in the second."""
    gains = [gain_of(view, objective, wanted) for view in views]
    if None in gains:
        return [f"{objective.words}: one of the studies has no value of it"]
    what = "higher" if objective.sign > 0 else "lower"
    names = [view.name for view in views]
    shares = [share(gain.value, gain.error) for gain in gains]
    line = f"{objective.words} of the best design over {gains[0].words}: {shares[0]} {what} in {names[0]}, {shares[1]} in {names[1]}"
    if gains[0].value > 0:
        line += f"; {share(*left(*gains))} of the gain is left"
    known = any(math.isfinite(gain.error) for gain in gains)  # shown as +-
    told = [line + (" (95 % confidence)" if known else "; how sure that is nothing tells")]
    same = _same_design(views, show_optimum.find(views[0], objective).design)
    if same is not None:
        second = show_optimum.find(views[1], objective)
        value = objective.sign * (second.mean[same] / gains[1].reference - 1)
        if math.isfinite(value):
            told.append(
                f"the best design of {names[0]}, {gains[0].best}, is {100 * value:.3g} % {what} than {gains[1].words} in {names[1]}, "
                f"where it {'cannot' if second.open[same] else 'can'} be told from the best one, {gains[1].best}"
            )
    return told


def _same_design(views, design) -> int | None:
    """The index in the second study of a design of the first, None if it was not run there."""
    match = np.ones(len(views[1].designs), bool)
    for axis in views[0].axes:
        match &= (views[1].designs[axis.key] == views[0].designs[axis.key][design]).to_numpy()
    return int(np.flatnonzero(match)[0]) if match.any() else None


def check(views, objective):
    """Two studies that cannot stand side by side are a UserError."""
    keys = [[axis.key for axis in view.axes] for view in views]
    if sorted(keys[0]) != sorted(keys[1]):
        raise UserError(f"--beside: {views[1].name} varies {', '.join(keys[1])}, not {', '.join(keys[0])}")
    if objective.path not in [o.path for o in views[1].objectives]:
        raise UserError(f"--beside: {views[1].name} has no {objective.path}")


def draw(views, objective, x=None, y=None, average=False, sensitivities=(), wanted=None):
    """Both planes on one colour scale, and below them the sentence."""
    x, y = show_contour.main_keys(views[0], objective, x, y, sensitivities)
    planes = [show_contour.plane(view, objective, view.axis(x.key), view.axis(y.key), average) for view in views]
    levels = show_contour.levels_of(planes)
    figure = show_draw.new(9.2, 5.2)
    axes = figure.subplots(1, 2)
    kept = {}
    differ = differences(views)
    for number, (ax, plane, view) in enumerate(zip(axes, planes, views), 1):
        image, handles = show_contour.paint(ax, plane, levels)
        settings = [f"{entry[0]} = {entry[number]}" for entry in differ[:3]]
        ax.set_title(
            show_draw.broken(", ".join([show_contour.title(view, plane), *settings]), 60),
            loc="left",
        )
        if plane.best:
            ax.set_xlabel(ax.get_xlabel() + "\n" + "; ".join(show_contour.best_words(view, objective)))
        for handle in handles:
            name = re.sub(r" \(\d+\)$", "", handle.get_label())  # counts are those of one of the two
            handle.set_label(name)
            kept.setdefault(name, handle)
    for get, put in (
        ("get_xlim", "set_xlim"),
        ("get_ylim", "set_ylim"),
    ):  # cells of both may be of other sizes
        low, high = zip(*(getattr(ax, get)() for ax in axes))
        for ax in axes:
            getattr(ax, put)(max(low), min(high))
    axes[1].set_ylabel("")
    axes[1].tick_params(labelleft=False)
    figure.colorbar(image, ax=axes, label=show_draw.value_label(objective, 60), pad=0.015, aspect=28)
    line = sentences(views, objective, wanted)[0]
    figure.suptitle(
        show_draw.broken(line.replace("+-", "\N{PLUS-MINUS SIGN}"), 110),
        fontsize=9.5,
        x=0.01,
        ha="left",
    )
    figure.legend(handles=list(kept.values()), loc="outside lower left", ncols=4, frameon=False)
    return figure
