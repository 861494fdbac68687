"""One picture of the balls, for where there is no WebGL and for paper: VTK's where it can draw, else matplotlib's."""

import io

from matplotlib.figure import Figure as Canvas
from PIL import Image

from milltools.base.errors import UserError
from milltools.figures import overview
from milltools.geometry.bodies import Mill
from milltools.geometry.trajectory import stored
from milltools.render import camera, colour, scene

SIZE = 960, 540


def picture(run) -> bytes | None:
    """The last stored frame as a PNG; None where the run has no frames."""
    last = len(run.frame_times()) - 1
    if last < 0:
        return None
    store = io.BytesIO()
    try:  # as `mill render` draws it
        state = stored(run, last)
        riding = state.poses if Mill.of(run).wanders else None  # as the player begins
        look = camera.of("front", run, poses=riding), colour.of(run, "speed")
        with scene.Scene(run, SIZE, "draft", *look) as drawing:
            Image.fromarray(drawing.draw(state)).save(store, format="png")
    except UserError:  # nothing here can draw in 3D without a display: seen along the axis, the ones in front last
        figure = Canvas(figsize=(8, 6.4), layout="constrained")
        ax = figure.subplots()
        overview.mill(ax, run)
        overview.draw_balls(ax, run)
        figure.savefig(store, format="png", dpi=100)
    return store.getvalue()
