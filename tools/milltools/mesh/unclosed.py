"""Tells what of a surface is not closed after mending."""

import numpy as np

from milltools.base.text import plural
from milltools.mesh.surface import components

OUT = " in the program that made the mesh"


def faults(surface) -> list[str]:
    """What is not closed or not a surface, a line each, and how to mend it, after a colon."""
    said, sheets = [], np.unique(surface.facets[surface.loose()])
    for loop in surface.holes():
        middle = surface.points[loop].mean(axis=0)
        said.append(
            f"a hole of {len(loop)} sides, {surface.across(loop):.6g} across, around {place(middle)}: if a face is "
            f"missing there, close it with --hole {_above(surface.across(loop))}; else give the sheet that ends there "
            "a thickness"
        )
    for many, ends in _unfit(surface):
        points = surface.points[ends]
        across = np.ptp(points, axis=(0, 1)).max()
        where = f"{plural(len(ends), 'edge')}, {across:.6g} across, from {place(points[0, 0])}"
        if many == 1:
            said.append(f"not closed along {where}: give the sheet that ends there a thickness, or close the gap,{OUT}")
        elif many == 2:
            said.append(f"has one side only, as a Moebius strip, at {where}: mend it{OUT}")
        elif np.isin(ends, sheets).all(axis=1).any():
            said.append(f"{many} facets meet at each of {where}: give the sheet that begins there a thickness{OUT}")
        else:
            said.append(
                f"{many} facets meet at each of {where}, and bound no solid between them: take out inner walls{OUT}"
            )
    return said


def _unfit(surface):
    """(number of facets, ends (N, 2) of edges) of edges that hang together, at which sides have no partner and
    which are not around a hole."""
    start, end = surface.sides()
    order, begins, counts = surface.edges()
    alone = np.add.reduceat(surface.partner[order] < 0, begins) > 0
    around = {frozenset(pair) for loop in surface.holes() for pair in zip(loop, [*loop[1:], loop[0]])}
    for many in np.unique(counts[alone]):
        sides = [s for s in order[begins[alone & (counts == many)]] if frozenset((start[s], end[s])) not in around]
        if sides:
            ends = np.stack([start[sides], end[sides]], axis=1)
            group = components(len(surface.points), *ends.T)[ends[:, 0]]
            for one in np.unique(group):
                yield int(many), ends[group == one]


def place(point) -> str:
    return "({:.6g}, {:.6g}, {:.6g})".format(*(float(x) + 0.0 for x in point))


def _above(length: float) -> str:
    """A short number that is not smaller."""
    text = f"{length:.3g}"
    return text if float(text) >= length else f"{length * 1.005:.3g}"
