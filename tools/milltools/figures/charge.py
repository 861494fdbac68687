"""The charge of a tumbling mill seen along its axis, from the end where the mill turns anticlockwise: the balls of the
last stored frame, where the charge is on average, its toe and shoulder, and the path of a ball that a lifter throws."""

import math

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.patheffects import Normal, Stroke

from milltools.base.text import degrees, number
from milltools.dose import liner
from milltools.figures import outlines
from milltools.figures.base import WIDTH, Figure, labels, sampled, subtitle
from milltools.figures.style import INK, SMALL, SPEEDS, colour_bar, legend, millimetres, rounded_up
from milltools.geometry import throw, vessel
from milltools.geometry.bodies import Mill, moved
from milltools.geometry.trajectory import stored
from milltools.read import motions

FULL = 0.5  # of the fullest place: the contour
TOE, SHOULDER, THROW = "#d55e00", "#0072b2", "#c2185b"


class View:
    """The mill of a run along its axis. `axes` (3, 3): the directions across, to the side where the wall rises, up, and
    to the viewer, in the laboratory; `centre` [m]: a point of the axis."""

    def __init__(self, run):
        self.run, frame = run, run.vessel_frame()
        down = run.vector("gravity/acceleration")
        spin = run.vector(f"motion.{run.carrier}/axis") * motions.rate(run, run.carrier)
        up = -down / np.linalg.norm(down)
        across = np.cross(spin, -up)
        self.axes = np.array([across / np.linalg.norm(across), up, spin / np.linalg.norm(spin)])
        self.centre = moved(Mill.of(run).poses[0][run.carrier], frame[:, 3])
        self.speed = np.linalg.norm(spin)
        self.gravity = np.linalg.norm(down)
        self.radius = vessel.of(run).outermost
        self.largest = max(kind.diameter for kind in run.as_deck.species)

    def seen(self, points):
        """(..., 3) [m] across, up and towards the viewer, of points of the laboratory."""
        return (points - self.centre) @ self.axes.T

    def fullness(self):
        """The solid fraction of the maps, a mean over squares as wide as the largest ball: places across and up (n, m)
        [m], and values; None where the maps turn with the container."""
        run = self.run
        if run.has("observables/frame_spin/value") or not run.has("statistics/maps/cross_section"):
            return None
        edges = run.edges()
        y, z = np.meshgrid(*(0.5 * (one[:-1] + one[1:]) for one in edges), indexing="ij")
        places = self.axes[:2] @ run.vessel_frame()[:, 1:3] @ np.array([y.ravel(), z.ravel()])
        room = np.maximum(vessel.of(run).volume("cross_section", edges), 0)
        reach = round(self.largest / 2 / (edges[0][1] - edges[0][0]))
        balls = _spread(np.nan_to_num(run.map("solid_fraction")) * room, reach)
        return *places.reshape(2, *y.shape), balls / np.maximum(_spread(room, reach), 1e-9 * room.max())

    def thrown(self):
        """The throw.Throw of the largest ball by a lifter, a body's with a radial face, that of another contour with
        the mean angle of its leading faces; None without lifters."""
        run = self.run
        height, largest = self.radius - float(run.statistic("charge/layer")) - self.largest, self.largest
        own = [body.kind for body in Mill.of(run).inner if body.motion == run.carrier]
        face = 0.0
        if run.text("drum/profile", "circle") == "lifters":
            own, face = ["ball_drum"], run.quantity(f"drum/lifter_{'front' if self.axes[2, 0] > 0 else 'back'}")
        elif not liner.why_not(run):
            own, face = run.vessel_kinds[:1], liner.Liner(run).front
        if not own or not 0.05 * largest < height or not math.isfinite(face):
            return None
        friction = run.as_deck.contact(own[0]).friction
        return throw.throw(self.radius, self.speed, largest, height, face, friction, self.gravity)


class ChargeFigure(Figure):
    name, group, title = "charge", "charge", "The charge along the axis"
    caption = (
        "Seen from the end where the mill turns anticlockwise. Balls: the last stored frame of the first start. Line: "
        "where the charge is on average half as dense as at its densest. Plus: its centre of mass; circle: its centre "
        "of circulation. Toe and shoulder: where the layer at the wall is half as full as at its fullest place, from 6 "
        "o'clock to the rising side; in parentheses from 3 o'clock, as Morrell counts. Dashed: the dynamic angle "
        "of repose."
    )
    dotted = (
        " Dotted: the path of a ball, alone, that a lifter throws; a body with a radial face, a contour of a file with "
        "the mean angle of its leading faces."
    )

    def says(self, runs):
        return self.caption + self.dotted * any(View(run).thrown() is not None for run in runs)

    def finding(self, runs):
        toe, shoulder, flying = (runs[0].charge[name][0] for name in ("toe", "shoulder", "in_flight"))
        if len(runs) > 1 or not math.isfinite(toe + shoulder):
            return self.title
        places = f"Toe at {math.degrees(toe):.0f}°, shoulder at {math.degrees(shoulder):.0f}° from 6 o'clock"
        return places.replace("-", "−") + (f", {100 * flying:.0f} % in flight" if math.isfinite(flying) else "")

    def why_not(self, run):
        if run.unsampled:
            return run.unsampled
        return None if run.charge else "only for a container that turns steadily about its own horizontal axis"

    def paint(self, figure, runs):
        figure.set_size_inches(WIDTH, 0.3 + 4.4 * len(runs))
        axes = figure.subplots(len(runs), 1, squeeze=False)[:, 0]
        shown = [stored(run, len(run.frame_times()) - 1) if len(run.frame_times()) else None for run in runs]
        top = rounded_up(max((np.quantile(state.speed, 0.99) for state in shown if state), default=1.0))
        balls = [self._panel(ax, View(run), state, top) for ax, run, state in zip(axes, runs, shown)]
        for ax, run, name, state in zip(axes, runs, labels(runs), shown):
            subtitle(ax, f"{name}, {sampled(run)}" + (f"; balls at {number(state.time, 4)} s" if state else ""))
            ax.set_ylabel("up [mm]")
            ax.locator_params(nbins=5)
        axes[-1].set_xlabel("across, to the side where the wall rises [mm]")
        handles, words = axes[0].get_legend_handles_labels()
        legend(figure, handles, words, 2)
        for image in [one for one in balls if one][:1]:
            colour_bar(image, axes, label="speed of the balls [m/s]", extend="max")

    def _panel(self, ax, view, state, top):
        """Draws a mill; returns its balls, None without a frame."""
        run, balls = view.run, None
        poses = state.poses if state else Mill.of(run).poses[-1]
        round_about = np.pad(vessel.of(run).across, ((0, 0), (1, 0)))  # in the container's own frame
        rim = view.seen(moved(poses[run.carrier], moved(run.vessel_frame(), round_about)))[:, :2]
        ax.add_patch(Polygon(rim, fc=INK, alpha=0.06, ec="none", zorder=0))
        wall = ax.add_patch(Polygon(rim, fill=False, ec=INK, lw=1.2, zorder=4))
        for body, triangles in outlines.bodies(run):
            corners = view.seen(moved(Mill.pose(body.motion, poses), triangles))[..., :2]
            patch = ax.add_patch(outlines.shadow(corners, zorder=1))
            patch.set_clip_path(wall)
        if state:
            seen = view.seen(state.position)
            order = np.argsort(seen[:, 2])  # the ones in front last
            balls = EllipseCollection(
                *(run.balls("diameter")[order],) * 2, 0, units="x", offsets=seen[order, :2],
                transOffset=ax.transData, cmap=SPEEDS, edgecolors="k", linewidths=0.15, zorder=2,
            )  # fmt: skip
            balls.set_array(state.speed[order])
            balls.set_clim(0, top)
            ax.add_collection(balls)
        self._average(ax, view, wall)
        self._edges(ax, view)
        reach = 1.2 * view.radius
        turn = [1.06 * view.radius * np.array([-math.sin(a), math.cos(a)]) for a in (0.55, 0.9)]
        look = {"arrowstyle": "->", "connectionstyle": "arc3,rad=0.09", "mutation_scale": 10}
        ax.add_patch(FancyArrowPatch(*turn, color=INK, **look))
        ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
        ax.set_aspect("equal")
        ax.grid(False)
        millimetres(ax)
        return balls

    def _average(self, ax, view, wall):
        """Draws where the charge is, its centres and slope, and the path of a ball that is thrown."""
        line = Line2D([], [], color="#f4f4f4", lw=1.3, label="half as dense as at its densest")
        line.set_path_effects([Stroke(linewidth=2.6, foreground="#101010"), Normal()])
        if found := view.fullness():
            ax.add_line(line)
            *places, full = found
            level = FULL * np.quantile(full[full > 0], 0.95) if (full > 0).any() else 0
            for look in ({"colors": "#101010", "linewidths": 2.6}, {"colors": "#f4f4f4", "linewidths": 1.3}):
                ax.contour(*places, full, [level], zorder=3, **look).set_clip_path(wall)
        for name, mark in (("mass", "P"), ("circulation", "o")):
            place = [view.run.charge[f"{name}_{way}"][0] for way in ("across", "up")]
            ax.plot(*place, mark, label=f"centre of {name}", ls="", ms=6.5, mfc="w", mec="k", mew=1.2, zorder=6)
            if name == "mass":
                half = math.sqrt(max(view.radius**2 - place[0] ** 2 - place[1] ** 2, 0))
                slope = half / math.hypot(*place) * np.array([-place[1], place[0]])
                ax.plot(*np.transpose([place - slope, place + slope]), "--", color=INK, lw=1.0, zorder=4,
                        label="dynamic angle of repose")  # fmt: skip
        if thrown := view.thrown():
            ax.plot(*thrown.path.T, ":", color=THROW, lw=1.8, zorder=5, label="path of a ball, alone, from a lifter")

    def _edges(self, ax, view):
        """Marks toe and shoulder."""
        for name, colour in (("toe", TOE), ("shoulder", SHOULDER)):
            angle, error = view.run.charge[name]
            if not math.isfinite(angle):
                continue
            way = view.radius * np.array([math.sin(angle), -math.cos(angle)])
            ax.plot(*np.outer(way, (0.82, 1)), color="w", lw=4.5, zorder=5)
            ax.plot(*np.outer(way, (0.8, 1)), color=colour, lw=2.5, zorder=5)
            side, above = np.sign(way)  # the corners are free
            ax.text(
                *(1.18 * view.radius * np.sign(way)),
                f"{name}\n{degrees(angle, error)}\n({(math.degrees(angle) + 270) % 360:.0f}°)",
                ha="right" if side > 0 else "left", va="top" if above > 0 else "bottom", color=colour,
                fontsize=SMALL, linespacing=1.15, zorder=7,
                bbox={"boxstyle": "round,pad=0.25", "fc": "w", "ec": colour, "lw": 0.8, "alpha": 0.9},
            )  # fmt: skip

    def columns(self, run):
        known = run.charge
        return {
            "number": np.array(list(known), object),
            "value [rad, m or 1]": np.array([value for value, _ in known.values()]),
            "standard error": np.array([error for _, error in known.values()]),
        }


def _spread(values, reach):
    """Sums over squares of so many cells to each side."""
    for axis in (0, 1):
        wide = np.cumsum(np.pad(values, [(reach + 1, reach) if k == axis else (0, 0) for k in (0, 1)]), axis=axis)
        low, high = (np.take(wide, range(k, k + values.shape[axis]), axis) for k in (0, 2 * reach + 1))
        values = high - low
    return values


FIGURES = (ChargeFigure(),)
