"""One picture of the balls, for where there is no WebGL and for paper: VTK's where it can draw, else matplotlib's."""

import io

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from milltools import plot
from milltools.profile import Profile


def picture(run) -> bytes | None:
    """The last stored frame as a PNG; None where the run has no frames."""
    if not len(run.frame_times()):
        return None
    figure, ax = plt.subplots(figsize=(8, 6.4), layout="constrained")
    profile = Profile.of(run.deck().get)
    ax.add_patch(plot.drum_rim(profile))
    ax.set_aspect("equal")
    reach = 1.02 * profile.outermost
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_xlabel("y [m]")
    ax.set_ylabel("z [m]")
    plot.draw_balls(ax, run)
    store = io.BytesIO()
    figure.savefig(store, format="png", dpi=100)
    plt.close(figure)
    return store.getvalue()
