"""One picture of a run, or the scene of one for POV-Ray."""

import io
import pathlib

from PIL import Image

from milltools.export import whole
from milltools.geometry import rerun
from milltools.read.runfile import Run
from milltools.render import prepare, times
from milltools.render import states as motion
from milltools.render.look import Traced
from milltools.render.progress import say, written


def make(arguments, path):
    """Writes the picture that `mill render` was asked for to `path`."""
    with Run(arguments.run) as run:
        allowed = not arguments.no_rerun and rerun.why_not(run) is None
        plan = times.still(run, arguments.time, allowed)
        look = prepare.look(arguments, run)
        with motion.of(run, plan, arguments.colour == "impact", not arguments.no_rerun, say, prepare.told(arguments)) as moving:  # fmt: skip
            (state,) = moving.states(plan.times)
        prepare.tell_guessed(moving)
        if path.suffix.lower() == ".pov":
            with Traced(look, run) as scene:
                draft = path.with_name(f"{path.name}.part")
                try:
                    scene.write(state, draft)
                    draft.replace(path)
                finally:
                    draft.unlink(missing_ok=True)
            written(path, "a scene for POV-Ray")
            return
        with look.open() as drawing:
            picture = drawing.draw(state)
    content = io.BytesIO()
    Image.fromarray(picture).save(content, "PNG")
    with whole.file(path) as draft:
        pathlib.Path(draft).write_bytes(content.getvalue())
    height, width = picture.shape[:2]
    written(path, f"{width} x {height} pixels at {state.time:.6g} s")
