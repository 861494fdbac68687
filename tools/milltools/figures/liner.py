"""The liner of a tumbling mill: power of the impacts along the developed length of its contour, with the contour below,
and the force on a lifter over its turn."""

import numpy as np

from milltools.base.text import literal, number
from milltools.dose import liner
from milltools.figures.base import WIDTH, Figure, labels, sampled, subtitle
from milltools.figures.style import COLOURS, INK, SMALL, legend

CURVES = (("sliding", "power lost by sliding", "-"), ("normal", "power lost along the normal", "--"))


class LinerFigure(Figure):
    name, group, title = "liner", "liner", "The liner: along its contour, and over a turn"
    caption = (
        "Power that impacts lose by sliding (solid) and along the normal (dashed), per area, along one of the equal "
        "parts of the contour, averaged over a ball's radius; below it the contour, as height above its outermost "
        "points, with its leading faces marked. Then the mean force on a lifter at each angle after the lowest place, "
        "outwards (solid) and against the turning (dashed), and the impulse of single impacts on lifters that 99 % of "
        "all that they get there is below; grey: above the charge, from the toe over the highest place to the shoulder."
    )

    def why_not(self, run):
        return liner.why_not(run)

    def finding(self, runs):
        one = liner.Liner(runs[0])
        k, times = one.worst()
        alone = len(runs) == 1 and times > 0
        return f"Sliding wears the {one.face[k]} most, {number(times)} times the mean" if alone else self.title

    def paint(self, figure, runs):
        found = [liner.Liner(run) for run in runs]
        turns = [None if liner.why_no_turn(run) else liner.Turn(run, one.lifters) for run, one in zip(runs, found)]
        heights = [2.2, 1.1, 2.2, 1.1] if any(turns) else [2.2, 1.1]
        figure.set_size_inches(WIDTH, 1.0 + 1.3 * sum(heights))
        along, shape, *over = figure.subplots(len(heights), 1, height_ratios=heights)
        for k, (one, name) in enumerate(zip(found, labels(runs))):
            colour = COLOURS[k % len(COLOURS)] if len(runs) > 1 else INK
            s = 1e3 * one.s
            for column, words, line in CURVES:
                # of several runs, the caption tells what is dashed
                label = words if len(runs) == 1 else literal(name, 50) if line == "-" else None
                along.plot(s, 1e-3 * one.smoothed(one.density(column)), ls=line, color=colour, label=label)
            shape.plot(s, 1e3 * one.raised, color=colour)
            leads = np.where(one.face == "leading face", 1e3 * one.raised, np.nan)
            shape.plot(s, leads, color="#d55e00", lw=3, label=None if k else "leading faces")
            if turns[k]:
                self._turn(over, turns[k], colour, len(runs) == 1)
        if shape.get_legend_handles_labels()[0]:
            shape.legend(frameon=False, loc="best", fontsize=SMALL)
        along.set_ylabel("power [kW/m²]")
        along.set_ylim(bottom=0)
        shape.set(xlabel="developed length of one part [mm]", ylabel="height [mm]")
        shape.set_xlim(along.get_xlim())
        for ax, words in zip(over, ("force on a lifter [N]", "99 % [N s]")):
            ax.set(ylabel=words, xlim=(-180, 180), xticks=range(-180, 181, 60))
            ax.set_xlabel("angle after the lowest place [°]" if ax is over[-1] else "")
        subtitle(along, f"{labels(runs)[0]}, {sampled(runs[0])}" if len(runs) == 1 else "")
        legend(figure, *along.get_legend_handles_labels(), 1, rest=2.0)

    def _turn(self, axes, turn, colour, alone):
        angle, (wide, sizes, _) = np.degrees(turn.angle), turn.sizes
        axes[0].plot(angle, turn.outward, color=colour, label="outwards")
        axes[0].plot(angle, -turn.forward, color=colour, ls="--", label="against the turning")
        axes[1].plot(np.degrees(wide), sizes, ".-", color=colour)
        axes[1].set_ylim(bottom=0)
        toe, shoulder = (np.degrees(turn.run.charge[name][0]) for name in ("toe", "shoulder"))
        for ax in axes if alone and np.isfinite(toe + shoulder) else ():
            for ends in ((-180, toe), (shoulder, 180)):
                words = "above the charge" if ends[1] == 180 else None
                ax.axvspan(*ends, color=INK, alpha=0.08, lw=0, label=words)
        if alone:
            axes[0].legend(frameon=False, loc="upper left", fontsize=SMALL)

    def columns(self, run):
        found = liner.Liner(run)
        return {
            "developed length [m]": found.s,
            "height [m]": found.raised,
            "face": found.face,
            "impacts [1/(m2 s)]": found.density("count"),
            "power lost along the normal [W/m2]": found.density("normal"),
            "power lost by sliding [W/m2]": found.density("sliding"),
        }


FIGURES = (LinerFigure(),)
