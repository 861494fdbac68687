"""How all pictures of a film look: what every process that draws must know, and small enough to be sent to it."""

import contextlib
import dataclasses

from milltools.read.runfile import Run


@dataclasses.dataclass(frozen=True)
class Look:
    """`path` of the run, `size` (width, height) [pixels], `quality`, `camera` as camera.of() takes it, `colour` a
    colour.Colour, `background`; `pov`: traced by POV-Ray, not drawn by VTK; `rides`: the camera does, on the container."""

    path: str
    size: tuple[int, int]
    quality: str
    camera: str
    colour: object
    background: str = "studio"
    pov: bool = False
    rides: bool = False

    @contextlib.contextmanager
    def open(self):
        """Something with draw(state, fraction) -> picture, uint8 (h, w, 3 or 4)."""
        with Run(self.path) as run:
            with (Traced if self.pov else Drawn)(self, run) as drawing:
                yield drawing


class _Cameras:
    """The camera at a share of the film, where motions are at `poses`; made anew only if it moves."""

    def __init__(self, look, run):
        from milltools.render import camera

        self._of = lambda fraction, poses: camera.of(look.camera, run, fraction, poses if look.rides else None)
        self.moves = look.camera == "orbit" or look.rides
        self._first = self._of(0.0, {})

    def at(self, fraction=0.0, poses=None):
        return self._of(fraction, poses or {}) if self.moves else self._first


class Drawn:
    """Pictures by VTK. A context manager."""

    def __init__(self, look, run):
        from milltools.render import scene

        self._cameras = _Cameras(look, run)
        self._scene = scene.Scene(run, look.size, look.quality, self._cameras.at(), look.colour, look.background)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._scene.close()

    def draw(self, state, fraction=0.0):
        """The picture of a State at a share of the film."""
        if self._cameras.moves:
            self._scene.look(self._cameras.at(fraction, state.poses))
        return self._scene.draw(state)


class Traced:
    """Pictures by POV-Ray. A context manager."""

    def __init__(self, look, run):
        self._look, self._run = look, run
        self._cameras = _Cameras(look, run)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, state, path, fraction=0.0):
        """Writes the scene of a State, as POV-Ray reads it, to `path`."""
        from milltools.render import pov

        look, camera = self._look, self._cameras.at(fraction, state.poses)
        pov.write(self._run, state, path, camera, look.colour, look.size)

    def draw(self, state, fraction=0.0):
        """The picture of a State at a share of the film."""
        from milltools.render import pov

        look, camera = self._look, self._cameras.at(fraction, state.poses)
        return pov.draw(self._run, state, camera, look.colour, look.size, look.background)
