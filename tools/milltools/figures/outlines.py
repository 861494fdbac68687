"""The bodies of the mill in the two views of the maps: the wall of the container, the shaft, and the space that blades
and other bodies sweep."""

import math

import numpy as np
from matplotlib.patches import Circle, PathPatch, Polygon, Rectangle
from matplotlib.path import Path

from milltools.figures.style import INK
from milltools.geometry import vessel
from milltools.geometry.bodies import Mill, seen, silhouette

STEEL = "#8c8c8c"  # visible on white and on black
# a light line on a dark line is visible on every colour of a field; both must keep their colour on dark pages
UNDER, OVER = {"color": "#101010", "lw": 1.8, "alpha": 0.55}, {"color": "#f4f4f4", "lw": 0.9}
DASHES = (0, (5, 3))


def sweeps(run):
    """(from, to along the axis, largest distance from it) [m] of the space that each blade sweeps, with its corners."""
    for blade in run.as_deck.blades:
        sine, cosine = abs(math.sin(blade.pitch)), abs(math.cos(blade.pitch))
        half = (cosine * blade.width + sine * blade.thickness) / 2
        across = (sine * blade.width + cosine * blade.thickness) / 2
        yield blade.position - half, blade.position + half, math.hypot(blade.tip_radius, across)


def bodies(run):
    """(body, the triangles (T, 3, 3) of one copy in its motion's frame) of the bodies in the container."""
    for body in Mill.of(run).inner:
        for number in np.unique(body.number):
            yield body, body.triangles[body.number == number]


def _nearest(corners):
    """Smallest distance of triangles (T, 3, 2) from the origin: that of their sides, or 0 if the origin is in one. The
    corners are not enough: an arm through the axis has none near it."""
    side = np.roll(corners, -1, axis=1) - corners
    length = np.maximum((side**2).sum(axis=2), 1e-300)
    share = np.clip(-(corners * side).sum(axis=2) / length, 0, 1)
    way = corners[..., 0] * side[..., 1] - corners[..., 1] * side[..., 0]
    if (np.abs(np.sign(way).sum(axis=1)) == 3).any():
        return 0.0
    return np.linalg.norm(corners + share[..., None] * side, axis=2).min()


def swept(run):
    """For every body: (smallest, largest) distance from the axis and (from, to) along it [m], and whether the body
    moves in the container."""
    poses = Mill.of(run).poses
    poses = poses[:: max(1, len(poses) // 12)]
    for body, triangles in bodies(run):
        if run.has_rotor and body.kind in ("ball_shaft", "ball_blade"):  # drawn from the deck
            continue
        moves = body.motion != run.carrier
        there = [seen(run, body.motion, triangles, one) for one in (poses if moves else poses[:1])]
        x, across = np.concatenate(there)[..., 0], np.concatenate(there)[..., 1:]
        yield (_nearest(across), np.linalg.norm(across, axis=2).max()), (x.min(), x.max()), moves


def stand(ax, run, poses, moving=True):
    """Draws outlines over (y, z) of the bodies at `poses` of the motions; without `moving` only of bodies fixed to the
    container."""
    for body, triangles in reversed(list(bodies(run))):  # the shaft on top
        if moving or body.motion == run.carrier:
            ax.add_patch(shadow(seen(run, body.motion, triangles, poses)[..., 1:], zorder=0.5 if moving else 3))


def shadow(corners, **look):
    """A patch with the outline of a body, of its triangles (T, 3, 2)."""
    lines = [Path([*line, line[0]], closed=True) for line in silhouette(corners)]
    return PathPatch(Path.make_compound_path(*lines), fc=STEEL, ec=INK, lw=0.6, label="_body", **look)


def signs(run, view) -> str:
    """Explains the outlines in a view, in one sentence."""
    inner = Mill.of(run).inner
    found = []
    if run.as_deck.blades or any(view == "axial" or body.motion != run.carrier for body in inner):
        found.append("dashed: the space that moving bodies sweep")
    if run.has_rotor:
        found.append("grey: the shaft")
    elif view != "axial" and any(body.motion == run.carrier for body in inner):
        passing = run.carrier != run.mapped
        found.append("grey: bodies fixed to the container" + ", which turn with it" * bool(passing))
    if view != "axial" and vessel.of(run).turns:
        found.append("the wall turns; it is drawn as at the start")
    said = "; ".join([*found, "blank: no impacts or balls in the cell during the window."])
    return said[0].upper() + said[1:]


def section(ax, run):
    """Draws container, shaft and swept space over (y, z); returns a patch to clip the field with."""
    wall = _wall(ax, run, "cross_section")
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        ax.add_patch(Circle((0, 0), radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft"))
    stand(ax, run, Mill.of(run).poses[0], moving=False)
    reaches = [reach for *_, reach in sweeps(run)] if run.has_rotor else []
    reaches += [far for (_, far), _, moves in swept(run) if moves]
    if reach := max(reaches, default=0):
        turn = np.linspace(0, 2 * math.pi, 361)
        _line(ax, reach * np.cos(turn), reach * np.sin(turn), "_sweep")
    edge = 1.02 * vessel.of(run).outermost
    ax.set(xlim=(-edge, edge), ylim=(-edge, edge))
    return wall


def axial(ax, run):
    """Draws container, shaft and swept space over (x, r); returns the container's patch. A drum that is no circle is
    drawn with its outermost radius, and a dotted line at its innermost radius."""
    holds = vessel.of(run)
    wall = _wall(ax, run, "axial")
    low, high = holds.low, holds.high
    if holds.innermost < holds.outermost:
        ax.plot([low, high], [holds.innermost] * 2, color=INK, lw=0.6, ls=":", label="_wavy")
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        shaft = Rectangle((low, 0), high - low, radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft")
        ax.add_patch(shaft)
        for begin, end, reach in sweeps(run):
            _line(ax, [begin, begin, end, end], [radius, reach, reach, radius], "_sweep")
    for (near, far), (begin, end), _ in swept(run):
        _line(ax, [begin, begin, end, end, begin], [near, far, far, near, near], "_sweep")
    edge = 0.01 * (high - low)
    ax.set(xlim=(low - edge, high + edge), ylim=(0, 1.02 * holds.outermost))
    return wall


def room(holds, view="cross_section", **look):
    """A patch with the outline of the room of a vessel's map, to clip it with: of all places where its wall turns."""
    if view == "axial" or not holds.turns:
        return rim(holds, view, **look)
    return Circle((0, 0), holds.outermost, fill=False, **look)


def rim(holds, view="cross_section", **look):
    """A patch with the outline of a vessel's wall; in the view "axial" it ends at the axis."""
    return Polygon(holds.placed if view == "cross_section" else holds.radial, closed=True, fill=False, **look)


def _wall(ax, run, view):
    holds = vessel.of(run)
    # behind the field, so that blank cells differ from the darkest colour on dark pages too
    paper = room(holds, view, fc=INK, ec="none", alpha=0.08, zorder=0)
    paper.set_fill(True)
    ax.add_patch(paper)
    wall = ax.add_patch(rim(holds, view, ec=INK, lw=1.0, zorder=4, label="_drum"))
    if view == "axial" and run.slice_length:  # it has no end walls
        wall.set_edgecolor("none")
        ax.plot([holds.low, holds.high], [holds.outermost] * 2, color=INK, lw=1.0, zorder=4, label="_mantle")
    return paper if holds.turns else wall


def _line(ax, x, y, label):
    ax.plot(x, y, **UNDER, zorder=3.4, label="_under")
    ax.plot(x, y, **OVER, ls=DASHES, zorder=3.5, label=label)
