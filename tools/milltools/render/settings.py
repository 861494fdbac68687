"""How all pictures of a film look: what every process that draws must know, and small enough to be sent to it."""

import contextlib
import dataclasses

from milltools.read.runfile import Run
from milltools.render import camera, colour


@dataclasses.dataclass(frozen=True)
class Settings:
    """`path` of the run, `size` (width, height) [pixels], `quality` and `background` of scene.py, `camera` as camera.of() takes it;
    `pov`: traced by POV-Ray, not drawn by VTK; `rides`: the camera does, on the container."""

    path: str
    size: tuple[int, int]
    quality: str
    camera: str | camera.Camera
    colour: colour.Colour
    background: str = "studio"
    pov: bool = False
    rides: bool = False

    def view(self, run, fraction=0.0, poses=None) -> camera.Camera:
        """The camera at a share of the film, where motions are at `poses`."""
        return camera.of(self.camera, run, fraction, (poses or {}) if self.rides else None)

    @contextlib.contextmanager
    def drawing(self):
        """A function of (state, share of the film) that gives its picture, uint8 (h, w, 3 or 4)."""
        # both import what is slow, or not installed everywhere
        with Run(self.path) as run:
            if self.pov:
                from milltools.render import pov

                yield lambda state, fraction=0.0: pov.draw(
                    run, state, self.view(run, fraction, state.poses), self.colour, self.size, self.background
                )
                return
            from milltools.render import scene

            moves = self.camera == "orbit" or self.rides
            with scene.Scene(run, self.size, self.quality, self.view(run), self.colour, self.background) as drawn:

                def draw(state, fraction=0.0):
                    if moves:
                        drawn.look(self.view(run, fraction, state.poses))
                    return drawn.draw(state)

                yield draw
