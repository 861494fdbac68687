"""The mill's bodies in the two views of the maps: drum along its wall, shaft, and what the blades sweep over."""

import math

import numpy as np
from matplotlib.patches import Circle, Polygon, Rectangle

from milltools.profile import Profile
from milltools.style import INK

STEEL = "#8c8c8c"  # stands out on white and on black
# a line that is seen on every colour of a field: light upon dark; neither may turn with the page's ink
UNDER, OVER = {"color": "#101010", "lw": 1.8, "alpha": 0.55}, {"color": "#f4f4f4", "lw": 0.9}
DASHES = (0, (5, 3))


def profile_of(run) -> Profile:
    return Profile.of(run.deck().get)


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


def section(ax, run):
    """Drum, shaft and sweep over (y, z); returns the drum's patch, which is what the field is clipped to."""
    profile = profile_of(run)
    rim = Polygon(
        profile.outline(), closed=True, fill=False, ec=INK, lw=1.0, zorder=4, label="_drum"
    )
    paper(ax, Polygon(profile.outline(), closed=True))
    ax.add_patch(rim)
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        ax.add_patch(Circle((0, 0), radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft"))
        reach = max((r for *_, r in sweeps(run)), default=0)
        if reach:
            turn = np.linspace(0, 2 * math.pi, 361)
            _line(ax, reach * np.cos(turn), reach * np.sin(turn), "_sweep")
    edge = 1.02 * profile.outermost
    ax.set_xlim(-edge, edge)
    ax.set_ylim(-edge, edge)
    return rim


def axial(ax, run):
    """Drum, shaft and the blades' sweeps over (x, r); returns the drum's patch. Where a wall is wavy, the drum ends at its
    outermost radius, and a line is at the innermost."""
    profile, half = profile_of(run), run.quantity("drum/length") / 2
    box = (-half, 0.0), 2 * half, profile.outermost
    paper(ax, Rectangle(*box))
    rim = Rectangle(*box, fill=False, ec=INK, lw=1.0, zorder=4, label="_drum")
    ax.add_patch(rim)
    if profile.innermost < profile.outermost:
        ax.plot([-half, half], [profile.innermost] * 2, color=INK, lw=0.6, ls=":", label="_wavy")
    if run.has_rotor:
        radius = run.quantity("rotor/shaft_radius")
        shaft = Rectangle(
            (-half, 0), 2 * half, radius, fc=STEEL, ec=INK, lw=0.6, zorder=3, label="_shaft"
        )
        ax.add_patch(shaft)
        for begin, end, reach in sweeps(run):
            _line(ax, [begin, begin, end, end], [radius, reach, reach, radius], "_sweep")
    ax.set_xlim(-1.02 * half, 1.02 * half)
    ax.set_ylim(0, 1.02 * profile.outermost)
    return rim


def paper(ax, patch):
    """What lies beneath the field: cells where nothing was are told from the darkest colour on dark pages too."""
    patch.set(facecolor=INK, edgecolor="none", alpha=0.08, zorder=0)
    ax.add_patch(patch)


def _line(ax, x, y, label):
    ax.plot(x, y, **UNDER, zorder=3.4, label="_under")
    ax.plot(x, y, **OVER, ls=DASHES, zorder=3.5, label=label)
