"""The mill's bodies in the two views of the maps: the container along its wall, shaft, and what blades and other
bodies sweep over."""

import math

import numpy as np
from matplotlib.patches import Circle, Polygon, Rectangle

from milltools import vessel
from milltools.bodies import Mill, inverse, moved, outermost
from milltools.style import INK

STEEL = "#8c8c8c"  # stands out on white and on black
# a line that is seen on every colour of a field: light upon dark; neither may turn with the page's ink
UNDER, OVER = {"color": "#101010", "lw": 1.8, "alpha": 0.55}, {"color": "#f4f4f4", "lw": 0.9}
DASHES = (0, (5, 3))


def sweeps(run) -> list[tuple[float, float, float]]:
    """(from, to along the axis, reach from it) [m] of the bodies that the blades sweep over, corners included."""
    found = []
    for blade in run.blades():
        sine, cosine = abs(math.sin(blade.pitch)), abs(math.cos(blade.pitch))
        half = (cosine * blade.width + sine * blade.thickness) / 2
        across = (sine * blade.width + cosine * blade.thickness) / 2
        reach = math.hypot(blade.tip_radius, across)
        found.append((blade.position - half, blade.position + half, reach))
    return found


def bodies(run):
    """(body, the triangles (T, 3, 3) of one copy in its motion's frame) of the bodies in the container."""
    for body in Mill.of(run).inner:
        for number in np.unique(body.number):
            yield body, body.triangles[body.number == number]


def _seen(run, body, triangles, poses):
    """Corners and middles of triangles (N, 3) in the container's own frame, where motions are at `poses`."""
    points = np.concatenate([triangles.reshape(-1, 3), triangles.mean(axis=1)])
    if body.motion != run.carrier:
        ride, own = (Mill.pose(motion, poses) for motion in (run.carrier, body.motion))
        points = moved(inverse(ride), moved(own, points))
    return moved(inverse(run.vessel_frame()), points)


def swept(run):
    """((least, most), (from, to)) of the distances from the axis and of the places along it [m] of every body, and whether it moves
    in the container."""
    poses = Mill.of(run).poses
    poses = poses[:: max(1, len(poses) // 12)]
    for body, triangles in bodies(run):
        if run.has_rotor and body.kind in ("ball_shaft", "ball_blade"):  # the deck tells them
            continue
        moves = body.motion != run.carrier
        seen = [_seen(run, body, triangles, one) for one in (poses if moves else poses[:1])]
        x, y, z = np.concatenate(seen).T
        away = np.hypot(y, z)
        yield (away.min(), away.max()), (x.min(), x.max()), moves


def stand(ax, run, poses, moving=True):
    """Outlines over (y, z) of the bodies where motions are at `poses`; without `moving` of those alone that the container carries."""
    for body, triangles in reversed(list(bodies(run))):  # the shaft on top
        if moving or body.motion == run.carrier:
            points = outermost(_seen(run, body, triangles, poses)[:, 1:])
            middle = points.mean(axis=0)
            order = np.argsort(np.arctan2(*(points - middle).T[::-1]))
            ax.add_patch(
                Polygon(
                    points[order],
                    fc=STEEL,
                    ec=INK,
                    lw=0.6,
                    zorder=0.5 if moving else 3,
                    label="_body",
                )
            )


def section(ax, run):
    """Container, shaft and sweep over (y, z); returns the container's patch, which is what the field is clipped to."""
    rim = _wall(ax, run, "cross_section")
    reach = 0.0
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        ax.add_patch(Circle((0, 0), radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft"))
        reach = max((r for *_, r in sweeps(run)), default=0)
    stand(ax, run, Mill.of(run).poses[0], moving=False)
    reach = max([reach, *(far for (_, far), _, moves in swept(run) if moves)])
    if reach:
        turn = np.linspace(0, 2 * math.pi, 361)
        _line(ax, reach * np.cos(turn), reach * np.sin(turn), "_sweep")
    edge = 1.02 * vessel.of(run).outermost
    ax.set_xlim(-edge, edge)
    ax.set_ylim(-edge, edge)
    return rim


def axial(ax, run):
    """Container, shaft and the sweeps of blades and bodies over (x, r); returns the container's patch. Where a wall is wavy, the
    drum ends at its outermost radius, and a line is at the innermost."""
    holds, radius = vessel.of(run), 0.0
    rim = _wall(ax, run, "axial")
    low, high = holds.low, holds.high
    if not run.vessel and holds.profile.innermost < holds.outermost:
        ax.plot(
            [low, high], [holds.profile.innermost] * 2, color=INK, lw=0.6, ls=":", label="_wavy"
        )
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        shaft = Rectangle(
            (low, 0), high - low, radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft"
        )
        ax.add_patch(shaft)
        for begin, end, reach in sweeps(run):
            _line(ax, [begin, begin, end, end], [radius, reach, reach, radius], "_sweep")
    for (near, far), (begin, end), _ in swept(run):
        _line(ax, [begin, begin, end, end, begin], [near, far, far, near, near], "_sweep")
    ax.set_xlim(low - 0.01 * (high - low), high + 0.01 * (high - low))
    ax.set_ylim(0, 1.02 * holds.outermost)
    return rim


def _wall(ax, run, view):
    holds = vessel.of(run)
    paper(ax, holds.rim(view))
    return ax.add_patch(holds.rim(view, ec=INK, lw=1.0, zorder=4, label="_drum"))


def paper(ax, patch):
    """What lies beneath the field: cells where nothing was are told from the darkest colour on dark pages too."""
    patch.set(fill=True, facecolor=INK, edgecolor="none", alpha=0.08, zorder=0)
    ax.add_patch(patch)


def _line(ax, x, y, label):
    ax.plot(x, y, **UNDER, zorder=3.4, label="_under")
    ax.plot(x, y, **OVER, ls=DASHES, zorder=3.5, label=label)
