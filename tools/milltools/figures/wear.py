"""Wear of the parts: the energy that impacts leave on each facet, with round parts unrolled and the faces of flat parts
beside each other."""

import dataclasses
import math

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm

from milltools.base.text import plain
from milltools.dose import wear
from milltools.figures.base import WIDTH, Figure, labels, sampled, subtitle
from milltools.figures.maps import RANGE
from milltools.figures.style import SPEEDS, beyond, colour_bar, log_ticks
from milltools.read.wear import FACES, Part, Wear, why_not

MOST = 6  # faces, besides those of the container
LEAST = 1e-3  # faces with a smaller share of the power are left out
ENDS = (0.05, 1.0)  # the ends of the scale are these quantiles by area: the worst spot is resolved
ARC = np.radians(3)  # an arc of a cell has a corner each 3 degrees
ANGLE = "angle [°]"
COLOURS = SPEEDS.with_extremes(bad="#969696")  # as in 3D, where a part without impacts is grey too
FLAT = 0.35  # a panel whose height is a smaller share of its width has a row of its own


@dataclasses.dataclass(frozen=True, eq=False)  # arrays cannot be compared in a test of equality
class Sheet:
    """A face, or the whole side of a round part, in a plane: an outline [mm or degrees] and the facet of each cell of
    its lattice, and the words of the two axes."""

    name: str
    part: Part
    outlines: list[np.ndarray]
    facet: np.ndarray
    words: tuple[str, str]

    @property
    def unrolled(self) -> bool:
        return self.words[1] == ANGLE


def sheets(found: Wear) -> list[Sheet]:
    """All faces, in the order of the parts."""
    done = []
    for k, part in enumerate(found.parts):
        cells = found.cells[found.part[found.cells[:, 0]] == k]
        face = np.where((cells[:, 5] > 2) & part.round, 2, cells[:, 5])  # the side of a round part is one sheet
        for one in np.unique(face).tolist():
            own = cells[face == one]
            face_name = found.face_name(part, int(own[:, 5].max()))
            if face_name == "inside" and not part.round:  # a contour, seen from four sides
                face_name += f", facing own {FACES[one]}"
            name = plain(f"{found.part_name(part)}, {face_name}")
            low, high = part.boxes(own)
            if part.kind == "ball_blade":  # its middle is on the arm
                low, high = (ends + [0, part.axes[:, 1] @ part.axes[:, 3], 0] for ends in (low, high))
            outlines, words = _flat(part, one, low, high)
            done.append(Sheet(name, part, outlines, own[:, 0], words))
    return done


def _flat(part: Part, face: int, low: np.ndarray, high: np.ndarray):
    """Outlines of cells from low to high (C, 3) [m] of the coordinates of a part, in the plane of a face; and the words
    of its axes. The longer side is along the first axis."""
    if part.round and face < 2:  # rings
        return [_sector(*ends) for ends in zip(1e3 * low[:, 1], 1e3 * high[:, 1], low[:, 2], high[:, 2])], (
            "y [mm]",
            "z [mm]",
        )
    scale = np.array([1e3, 1e3, np.degrees(1) if part.round else 1e3])
    axes = [0, 2] if part.round else [k for k in range(3) if k != face // 2]
    words = {"ball_blade": ("width [mm]", "from the axis [mm]", "thickness [mm]")}.get(part.kind)
    words = ("along the axis [mm]", "", ANGLE) if part.round else words or [f"own {axis} [mm]" for axis in "xyz"]
    a, b = (scale * ends for ends in (low, high))
    if not part.round and np.ptp([a[:, axes[1]], b[:, axes[1]]]) > np.ptp([a[:, axes[0]], b[:, axes[0]]]):
        axes.reverse()
    x, y = axes
    corners = np.stack([[a[:, x], a[:, y]], [b[:, x], a[:, y]], [b[:, x], b[:, y]], [a[:, x], b[:, y]]])
    return list(corners.transpose(2, 0, 1)), (words[x], words[y])


def _sector(inner: float, outer: float, first: float, last: float) -> np.ndarray:
    """The outline of a part of a ring: radii, and angles [rad]."""
    angle = np.linspace(first, last, int(min(abs(last - first), math.tau) / ARC) + 2)
    arc = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.concatenate([outer * arc, inner * arc[::-1]])


def limits(all_found: list[Wear], column: str) -> tuple[float, float]:
    """The ends [SI] of a logarithmic scale of a column, the same for several runs."""
    value, area, count = (np.concatenate([found[name] for found in all_found]) for name in (column, "area", "count"))
    good = (value > 0) & (count >= wear.ENOUGH)
    if not good.any():
        good = value > 0
    if not good.any():
        return 1.0, 10.0
    low, high = map(float, np.quantile(value[good], ENDS, weights=area[good], method="inverted_cdf"))
    return min(max(low, high / RANGE), high / 2), high


class WearFigure(Figure):
    group = "wear"

    def __init__(self, name, column, title, caption):
        self.name, self.column, self.title, self.caption = name, column, title, caption

    def why_not(self, run):
        return why_not(run) or (None if run.read("statistics/wear/count").any() else "no impacts on the parts")

    def says(self, runs):
        if len(runs) == 1:
            return self.caption
        return " ".join([self.caption, *(f"{wear.finding(wear.faces(run))}." for run in runs)])

    def paint(self, figure, runs):
        shown = [self._chosen(run) for run in runs]
        label, unit, scale = wear.SHOWN[self.column]
        norm = LogNorm(*(scale * end for end in limits([found for found, _ in shown], self.column)), clip=True)
        rows = [self._rows(drawn) for _, drawn in shown]
        heights = [height for some in rows for _, height in some]
        figure.set_size_inches(WIDTH, 0.3 + sum(heights) + 0.75 * len(heights))
        grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
        places = iter(range(len(heights)))
        for run, name, (found, drawn), some in zip(runs, labels(runs), shown, rows):
            axes = self._panels(grid, places, found, some, norm)
            subtitle(axes[0], f"{name}, {sampled(run)}: {drawn[0].name}")
            words = f"{label} [{unit}]; grey: no impacts"
            values = np.concatenate([np.ma.filled(ax.collections[0].get_array(), np.nan) for ax in axes])
            extend = beyond(values, norm.vmin, norm.vmax)
            bar = colour_bar(axes[0].collections[0], axes, label=words, extend=extend)
            log_ticks(bar.ax.yaxis, norm.vmin, norm.vmax)

    def _chosen(self, run):
        """The wear and the sheets to draw: unrolled sides of the container, its ends, the faces with the most power."""
        found = Wear(run)
        power = found[self.column] * found.area
        every = [sheet for sheet in sheets(found) if found["count"][np.unique(sheet.facet)].any()]
        holds = [sheet for sheet in every if sheet.part.kind in run.vessel_kinds]
        others = [sheet for sheet in every if sheet not in holds]
        others = [sheet for sheet in others if power[np.unique(sheet.facet)].sum() > LEAST * power.sum()]
        others.sort(key=lambda sheet: -power[np.unique(sheet.facet)].sum())
        worst = {}  # of equal parts, such as blades, only the one with the most power
        for sheet in others:
            alike = sum(part.kind == sheet.part.kind for part in found.parts)
            more = f" (most of {alike} {found.part_name(sheet.part).rpartition(' ')[0]}s)" if alike > 1 else ""
            named = dataclasses.replace(sheet, name=sheet.name + plain(more))
            worst.setdefault((sheet.part.kind, sheet.name.partition(",")[2]), named)
        return found, sorted(holds, key=lambda sheet: not sheet.unrolled) + list(worst.values())[:MOST]

    def _rows(self, drawn):
        """The sheets of each row, with its height [inch]: the first one and flat ones alone, others two beside each
        other."""
        wide, narrow = WIDTH - 1.1, WIDTH / 2 - 1.1
        alone = [k == 0 or self._tall(sheet, wide) < FLAT * wide for k, sheet in enumerate(drawn)]
        rest = [sheet for sheet, own in zip(drawn, alone) if not own]
        pairs = [rest[k : k + 2] for k in range(0, len(rest), 2)]
        rows = [[sheet] for sheet, own in zip(drawn, alone) if own]
        return [(row, self._tall(row[0], wide)) for row in rows] + [
            (row, max(self._tall(sheet, narrow) for sheet in row)) for row in pairs
        ]

    def _tall(self, sheet, width):
        """[inch] height of a panel of this width"""
        if sheet.unrolled:
            return 1.3
        points = np.concatenate(sheet.outlines)
        across, along = np.ptp(points, axis=0)[::-1] + 1e-9
        return float(np.clip(width * across / along, 0.2, 1.3))

    def _panels(self, grid, places, found, rows, norm):
        """Draws rows of sheets into the next `places` of a grid; returns their axes."""
        value, axes = wear.SHOWN[self.column][2] * found[self.column], []
        for (row, height), r in zip(rows, places):
            for c, sheet in enumerate(row):
                ax = grid.figure.add_subplot(grid[r, :] if len(row) == 1 else grid[r, c])
                colour = np.where(value[sheet.facet] > 0, value[sheet.facet], np.nan)
                cells = PolyCollection(
                    sheet.outlines, array=colour, norm=norm, cmap=COLOURS, edgecolors="face",
                    linewidths=0.3, rasterized=True,
                )  # fmt: skip
                ax.add_collection(cells)
                ax.autoscale_view()
                ax.margins(0.01)
                ax.set(xlabel=sheet.words[0], ylabel=sheet.words[1])
                if sheet.unrolled:
                    ax.set_yticks([-180, -90, 0, 90, 180])
                else:
                    ax.set_aspect("equal", anchor="W" if len(row) == 1 else "C")
                    ax.locator_params(axis="y", nbins=3)
                    if height < 0.75:  # there is room for two labels
                        ax.set_yticks([round(end, 1) for end in ax.dataLim.intervaly])
                if axes:
                    subtitle(ax, sheet.name, 52 if len(row) == 1 else 24)
                ax.grid(False)
                ax.locator_params(axis="x", nbins=5 if sheet.unrolled or len(row) == 1 else 3)
                axes.append(ax)
        return axes

    def columns(self, run):
        found = Wear(run)
        names = [found.part_name(part) for part in found.parts]
        faces = [found.face_name(found.parts[p], f) for p, f in zip(found.part, found.face)]
        centre = found["centre"]
        return {
            "part": np.array([names[p] for p in found.part]),
            "face": np.array(faces),
            **{f"{axis} [m]": centre[:, k] for k, axis in enumerate("xyz")},
            "area [m2]": found.area,
            "impacts [1]": found["count"],
            "power lost along the normal [W/m2]": found["normal_power"],
            "power lost by sliding [W/m2]": found["sliding_power"],
            "depth removed by sliding wear [m/s]": found["archard_rate"],
            "mass removed by erosion [kg/(m2 s)]": found["finnie_rate"],
        }


FIGURES = (
    WearFigure(
        "wear", "sliding_power", "Wear: where balls slide on the parts",
        "Power that impacts lose by sliding, per area of the parts, logarithmic. Archard's depth of wear is "
        "proportional to it. Grey: no impacts. Round parts are unrolled; blades and other parts are seen from the side "
        "of the balls, of equal parts the one with the most power.",
    ),
    WearFigure(
        "wear-normal", "normal_power", "Wear: where balls hit the parts hard",
        "Power that impacts lose along the normal, per area of the parts, logarithmic: it measures pitting and cracks. "
        "Grey: no impacts.",
    ),
)  # fmt: skip
