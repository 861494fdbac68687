"""One picture of the balls, for where there is no WebGL and for paper: VTK's where it can draw, else matplotlib's."""

import io

from matplotlib.figure import Figure as Canvas

from milltools.base.errors import UserError
from milltools.figures import overview

SIZE = 960, 540


def picture(run) -> bytes | None:
    """The last stored frame as a PNG; None where the run has no frames."""
    if not len(run.frame_times()):
        return None
    return _scene(run) or _flat(run)


def _scene(run) -> bytes | None:
    """As `mill render` draws it; None where nothing here can draw in 3D without a display."""
    try:
        from PIL import Image

        from milltools.geometry.bodies import Mill
        from milltools.geometry.trajectory import State
        from milltools.render import camera, colour, scene
    except ImportError:
        return None
    last = len(run.frame_times()) - 1
    names = ("position", "velocity", "angular_velocity")
    values = [run.frame(last, name).astype(float) for name in names]
    state = State(float(run.frame_times()[last]), *values, poses=run.poses(last))
    try:
        riding = state.poses if Mill.of(run).wanders else None  # as the player begins
        look = camera.of("front", run, poses=riding), colour.of(run, "speed")
        with scene.Scene(run, SIZE, "draft", *look, background="studio") as drawing:
            pixels = drawing.draw(state)
    except UserError:
        return None
    store = io.BytesIO()
    Image.fromarray(pixels).save(store, format="png")
    return store.getvalue()


def _flat(run) -> bytes:
    """Seen along the axis, the ones in front last."""
    figure = Canvas(figsize=(8, 6.4), layout="constrained")
    ax = figure.subplots()
    overview.mill(ax, run)
    overview.draw_balls(ax, run)
    store = io.BytesIO()
    figure.savefig(store, format="png", dpi=100)
    return store.getvalue()
