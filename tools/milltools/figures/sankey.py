"""Bands whose widths are powers: from sources on the left through a trunk to sinks on the right, in order, none crossing.

Every width is true to scale. A band too thin to be seen keeps a hair's line, and its label stands apart with a leader.
"""

import dataclasses

import numpy as np
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from milltools.figures.style import INK


@dataclasses.dataclass(frozen=True)
class Band:
    """A source or a sink: `power` > 0 [W], its colour and how solid (0..1), and its label's columns of text. Neighbours
    with the same `group` leave the trunk as one and part later."""

    power: float
    colour: str
    solid: float
    label: tuple[str, ...]
    group: str = ""


COLUMNS = (1.10, 1.84, 2.92, 3.44)  # x of a label's texts
LEFT = -1.0  # how far labels reach on the other side
FONT = 8.2  # [pt]
HAIR = 0.5  # [pt] a band's outline: what is seen of one without width


def draw(ax, sources, sinks, columns=COLUMNS, line=0.06):
    """Draws bands into bare axes: x from 0 to 1 are the bands, their labels left and right of it; y is the power over the
    sum of the sources, from the top down. `columns`: x of the label's texts, the last ones right-aligned; `line`: least
    distance of two labels on the right. Returns the lowest y there is."""
    whole = sum(b.power for b in sources) or 1.0
    left = _stack([b.power / whole for b in sources], _gaps(sources, 0.0))
    right = _stack([b.power / whole for b in sinks], _gaps(sinks, 0.03))
    down = _stack([b.power / whole for b in sinks], [0.0] * len(sinks))
    middle = _groups(sinks, whole)
    extent = max(right[-1][1] if right else 1.0, 1.0)
    shift = (extent - 1) / 2  # the trunk at half height of what it feeds
    for band, (top, low) in zip(sources, left):
        _ribbon(ax, (0.0, 0.26), (top + shift, low + shift), (top + shift, low + shift), band)
    for k, band in enumerate(sinks):
        top, low = (v + shift for v in down[k])
        knee = [v + shift * 0.9 for v in middle[k]]
        _ribbon(ax, (0.30, 0.62), (top, low), knee, band)
        _ribbon(ax, (0.62, 1.0), knee, right[k], band)
    ax.add_patch(Rectangle((0.26, shift), 0.04, 1.0, fc=INK, ec="none", alpha=0.55))
    lowest = _label_right(ax, sinks, right, columns, line)
    _label_left(ax, sources, [(a + shift, b + shift) for a, b in left], extent, 1.9 * line)
    return max(extent, lowest + line / 2)


def _gaps(bands, gap):
    """Room above each band: none within a group."""
    return [0.0] + [gap if a.group != b.group else gap / 6 for a, b in zip(bands, bands[1:])]


def _stack(sizes, gaps):
    """(top, bottom) of each, one below the other."""
    found, at = [], 0.0
    for size, gap in zip(sizes, gaps):
        at += gap
        found.append((at, at + size))
        at += size
    return found


def _groups(sinks, whole):
    """Where the bands are halfway: those of a group side by side, groups apart."""
    gaps = [0.0] + [0.012 if a.group != b.group else 0.0 for a, b in zip(sinks, sinks[1:])]
    return _stack([b.power / whole for b in sinks], gaps)


def _ribbon(ax, xs, start, end, band):
    """A band from (top, bottom) at xs[0] to those at xs[1]."""
    a, b = xs
    half = (a + b) / 2
    points = [
        (a, start[0]), (half, start[0]), (half, end[0]), (b, end[0]),
        (b, end[1]), (half, end[1]), (half, start[1]), (a, start[1]), (a, start[0]),
    ]  # fmt: skip
    codes = [Path.MOVETO, *[Path.CURVE4] * 3, Path.LINETO, *[Path.CURVE4] * 3, Path.CLOSEPOLY]
    patch = PathPatch(Path(points, codes), fc=band.colour, ec="none", alpha=band.solid, label="_band")
    ax.add_patch(patch)
    edge = Path(points[:4], codes[:4])
    ax.add_patch(PathPatch(edge, fc="none", ec=band.colour, lw=HAIR, alpha=band.solid))


def spread(places, least, low, high):
    """Places in rising order, moved as little as need be to be `least` apart and within [low, high]; closer if they do not
    go in."""
    n = len(places)
    if n == 0:
        return []
    least = min(least, (high - low) / max(n - 1, 1))
    # blocks of labels that touch: each at the mean of where its members want to be
    blocks = []  # (where its first label is, how many, sum of wishes less their offsets)
    for place in places:
        blocks.append([place, 1, place])
        while len(blocks) > 1 and blocks[-2][0] + blocks[-2][1] * least > blocks[-1][0]:
            _, count, wish = blocks.pop()
            into = blocks[-1]
            into[2] += wish - into[1] * least * count
            into[1] += count
            into[0] = into[2] / into[1]
    found = np.concatenate([first + least * np.arange(count) for first, count, _ in blocks])
    # from the ends inwards
    floor = low + least * np.arange(n)
    ceiling = high - least * np.arange(n)[::-1]
    return list(np.clip(found, floor, ceiling))


def _label_right(ax, sinks, right, columns, line):
    extent = max([1.0, *(b for _, b in right)])
    wishes = [(a + b) / 2 for a, b in right]
    places = spread(wishes, line, 0.0, max(extent + line, line * (len(sinks) - 1)))
    for band, wish, place in zip(sinks, wishes, places):
        ax.plot(
            [1.0, 1.012, columns[0] - 0.025, columns[0] - 0.012], [wish, wish, place, place],
            color=INK, alpha=0.55, lw=0.6, clip_on=False, solid_capstyle="butt",
        )  # fmt: skip
        for k, (x, text) in enumerate(zip(columns, band.label)):
            ha = "left" if k < 2 else "right"
            ax.text(x, place, text, ha=ha, va="center", fontsize=FONT, clip_on=False)
    return max(places)


def _label_left(ax, sources, left, extent, line):
    wishes = [(a + b) / 2 for a, b in left]
    places = spread(wishes, line, line / 2, max(extent, line * len(sources)) - line / 2)
    for band, wish, place in zip(sources, wishes, places):
        ax.plot([-0.05, -0.02, 0], [place, wish, wish], color=INK, alpha=0.55, lw=0.6, clip_on=False)
        text = f"{band.label[0]}\n{', '.join(band.label[1:])}"
        ax.text(-0.07, place, text, ha="right", va="center", fontsize=FONT, clip_on=False)
