"""A Sankey diagram: bands from sources on the left through a trunk to sinks on the right, in order and without
crossings.

The widths are powers, true to scale. A very thin band is drawn as a hairline. A leader line connects each sink with its
label.
"""

import dataclasses

import numpy as np
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from milltools.figures.style import INK, SMALL


@dataclasses.dataclass(frozen=True)
class Band:
    """A source or a sink: `power` > 0 [W], colour, opacity `solid` (0..1), and the columns of its label. Neighbours
    with the same `group` leave the trunk as one band and split later."""

    power: float
    colour: str
    solid: float
    label: tuple[str, ...]
    group: str = ""


COLUMNS = (1.10, 1.96, 3.22, 3.78)  # x of the texts of a label, the last two right-aligned
LEFT = -1.28  # x of the left end of the labels of sources
HAIR = 0.5  # [pt] outline of a band, which makes very thin bands visible


def draw(ax, sources, sinks, line, whole):
    """Draws bands into empty axes: the bands from x = 0 to 1, their labels to the left and right; y is the power
    divided by `whole` [W], from the top down. `line`: smallest distance of two labels on the right. Returns the largest
    y used."""
    size = sum(b.power for b in sources) / whole
    left = _stack(sources, whole)
    right = _stack(sinks, whole, apart=0.03, within=0.005)
    down = _stack(sinks, whole)
    middle = _stack(sinks, whole, apart=0.012)  # bands of a group without a gap
    extent = max(right[-1][1], size)
    shift = (extent - size) / 2  # centres the trunk
    for band, ends in zip(sources, left + shift):
        _ribbon(ax, (0.0, 0.26), ends, ends, band)
    for band, begin, knee, end in zip(sinks, down + shift, middle + 0.9 * shift, right):
        _ribbon(ax, (0.30, 0.62), begin, knee, band)
        _ribbon(ax, (0.62, 1.0), knee, end, band)
    ax.add_patch(Rectangle((0.26, shift), 0.04, size, fc=INK, ec="none", alpha=0.55))
    lowest = _label_right(ax, sinks, right.mean(axis=1), extent, line)
    _label_left(ax, sources, (left + shift).mean(axis=1), extent, 1.9 * line)
    return max(extent, lowest + line / 2, 1.9 * line * len(sources))


def _stack(bands, whole, apart=0.0, within=0.0):
    """(top, bottom) of each band (N, 2), one below the other, with gaps `apart` between groups and `within` inside a
    group."""
    gaps = [0.0] + [within if a.group == b.group else apart for a, b in zip(bands, bands[1:])]
    sizes = np.array([b.power / whole for b in bands])
    bottom = np.cumsum(sizes + gaps)
    return np.column_stack([bottom - sizes, bottom])


def _ribbon(ax, xs, start, end, band):
    """Draws a band from (top, bottom) `start` at xs[0] to `end` at xs[1]."""
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
    """Places in rising order, moved as little as possible so that they are `least` apart and within [low, high]; closer
    together if there is not enough room."""
    n = len(places)
    steps = min(least, (high - low) / max(n - 1, 1)) * np.arange(n)
    # minus these steps the places must not fall: an isotonic regression. Its solution by least squares is, for each
    # place, the maximum over all starts before it of the minimum over all ends after it of the mean from start to end
    total = np.concatenate([[0.0], np.cumsum(np.asarray(places) - steps)])
    first, last = np.ogrid[:n, :n]
    mean = np.where(first <= last, (total[last + 1] - total[first]) / np.maximum(last + 1 - first, 1), np.inf)
    smallest = np.minimum.accumulate(mean[:, ::-1], axis=1)[:, ::-1]
    found = np.where(first <= last, smallest, -np.inf).max(axis=0, initial=-np.inf)
    return np.clip(found + steps, low + steps, high - steps[::-1])


def _label_right(ax, sinks, wishes, extent, line):
    places = spread(wishes, line, 0.0, max(extent + line, line * (len(sinks) - 1)))
    for band, wish, place in zip(sinks, wishes, places):
        ax.plot(
            [1.0, 1.012, COLUMNS[0] - 0.025, COLUMNS[0] - 0.012], [wish, wish, place, place],
            color=INK, alpha=0.55, lw=0.6, clip_on=False, solid_capstyle="butt",
        )  # fmt: skip
        for x, ha, text in zip(COLUMNS, ("left", "left", "right", "right"), band.label):
            ax.text(x, place, text, ha=ha, va="center", fontsize=SMALL, in_layout=False)
    return max(places)


def _label_left(ax, sources, wishes, extent, line):
    places = spread(wishes, line, line / 2, max(extent, line * len(sources)) - line / 2)
    for band, wish, place in zip(sources, wishes, places):
        ax.plot([-0.05, -0.02, 0], [place, wish, wish], color=INK, alpha=0.55, lw=0.6, clip_on=False)
        text = f"{band.label[0]}\n{', '.join(band.label[1:])}"
        ax.text(-0.07, place, text, ha="right", va="center", fontsize=SMALL, in_layout=False)
