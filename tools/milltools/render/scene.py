"""The picture of a mill at a moment: balls as exact spheres, a container of glass, bodies of steel, drawn by VTK into memory.

Everything is made once; a frame only moves what moves. One Scene per process: OSMesa has one current context.
"""

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plural
from milltools.geometry.bodies import Mill
from milltools.read import motions
from milltools.render import window as windows
from milltools.render.overlay import DARK, LIGHT, Overlay
from milltools.render.pixels import darken, halved, halved_light, smooth, soften, straighten
from milltools.render.shade import Shade

SIZES, DEFAULT = {"720p": (1280, 720), "1080p": (1920, 1080), "1440p": (2560, 1440), "4k": (3840, 2160)}, "1080p"
LEAST, MOST = 16, 8192  # pixels of a side

BACKGROUNDS = {  # colours below and above, and the ink of what is written there
    "studio": ((0.965, 0.97, 0.98), (0.80, 0.845, 0.895), DARK),
    "white": ((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), DARK),
    "dark": ((0.13, 0.15, 0.18), (0.05, 0.06, 0.08), LIGHT),
    "transparent": ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), DARK),
}
TILE = 2_100_000  # pixels that VTK draws at a time; each costs it some 60 bytes
EDGE = 0.4  # neighbours this much deeper are behind an edge; in radii of a ball
QUALITIES = {"draft": 1, "final": 2}  # how many times larger it is drawn, and averaged down for clean edges

METAL, RIM, GLASS = (0.74, 0.76, 0.79), (0.20, 0.25, 0.33), (0.80, 0.87, 0.94)


def size_of(text: str) -> tuple[int, int]:
    """(width, height) in pixels of a size by name (of SIZES) or as "1280x720"; both even, or videos could not have it."""
    if text.lower() in SIZES:
        return SIZES[text.lower()]
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isascii() and p.isdigit() for p in parts):
        raise UserError(f"size: expected {', '.join(SIZES)}, or as 1280x720; got {text!r}")
    size = int(parts[0]), int(parts[1])
    if not all(LEAST <= s <= MOST and s % 2 == 0 for s in size):
        raise UserError(f"size: expected even numbers from {LEAST} to {MOST}, got {text!r}")
    return size


def tiles(size, over):
    """((width, height), count): tiles, count x count of them, that a picture drawn `over` times larger is put together from."""
    width, height = (over * side for side in size)
    count = over
    while width * height > count**2 * TILE and width % (4 * count) == height % (4 * count) == 0:
        count *= 2
    return (width // count, height // count), count


class Scene:
    """Draws states of a milltools.read.runfile.Run. A context manager; close() does as well.

    `size` (width, height) pixels; `quality` of QUALITIES, `background` of BACKGROUNDS; `camera` a camera.Camera, `colour` a
    colour.Colour; `overlay`: whether colour bar and time are written over the picture."""

    def __init__(self, run, size, quality, camera, colour, background="studio", overlay=True):
        self.run, self.size, self.colour = run, tuple(size), colour
        for name, known, what in ((quality, QUALITIES, "quality"), (background, BACKGROUNDS, "background")):
            if name not in known:
                raise UserError(f"{what}: expected one of {', '.join(known)}, got {name!r}")
        self._larger = QUALITIES[quality]
        self._transparent = background == "transparent"
        self._over = None
        ink = BACKGROUNDS[background][2]
        if overlay:
            self._over = Overlay(self.size, colour, caption(run, camera), run.quantity("run/time", 1.0), ink)
        self.mill = Mill.of(run)
        tile, count = tiles(self.size, self._larger)
        self._window = windows.open_window(tile)
        from milltools.render import actors  # imports vtk, which asks for the kind of window

        ground = BACKGROUNDS[background][:2]
        self._eye = actors.Eye(self._window, tile, count, ground, self._transparent)
        diameter = run.balls("diameter")
        self._balls = actors.Balls(diameter / 2)
        self._place = actors.place
        self._glass = actors.Glass(self.mill.glass, GLASS)
        carrier, rims = self.mill.carrier, actors.rims(self.mill.frame, RIM)
        self._moving = [(body.motion, actors.metal(body.triangles, METAL)) for body in self.mill.inner]
        solid = [self._balls.actor, *rims, *(actor for _, actor in self._moving)]
        self._moving += [(carrier, actor) for actor in (*rims, *self._glass.actors)]
        self._shadow = actors.Shadow(self._window, tile, self.mill)
        for actor in (*solid, *self._glass.actors):
            self._eye.renderer.AddActor(actor)
        for actor in solid:
            self._shadow.renderer.AddActor(actor)
        self._radius = float(np.median(diameter)) / 2
        self.look(camera)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()

    def look(self, camera):
        """Another camera from the next frame on (an orbit has one for every frame)."""
        frame = self._over.frame if self._over else (0.02, 0.02, 0.98, 0.98)
        self.camera = camera.placed(self.size, frame)
        eye, lamp = self._eye.look(self.camera, self.mill), self._shadow.look(self.camera)
        self._shade = Shade(eye, lamp, self._radius)

    def draw(self, state) -> np.ndarray:
        """The picture of a trajectory.State: (h, w, 3) uint8, top row first; (h, w, 4) on a transparent background."""
        self._balls.move(state.position, self.colour.rgb(self.colour.values(state, self.run)))
        poses = state.poses or {}
        for motion, actor in self._moving:
            self._place(actor, self.mill.pose(motion, poses))
        self._glass.look(self.camera, self.mill.pose(self.mill.carrier, poses))
        lamp = self._shadow.render()
        picture, depth = self._see()
        light, grid = self._shade.light(depth, lamp), self._shade.grid
        if self._larger == 2:
            light, grid = halved_light(light), max(1, grid // 2)
        else:
            soften(picture, self._shade.eye.depth(depth), EDGE * self._radius)
        picture = darken(picture, smooth(light, grid))
        if self._transparent:
            straighten(picture)
        if self._over:
            self._over.paste(picture, state.time)
        return picture

    def _see(self):
        """The picture without shade, and the depth buffer behind it (of the larger picture where there is one)."""
        over, (width, height) = self._larger, self.size
        picture = np.empty((height, width, 4 if self._transparent else 3), np.uint8)
        depth = np.empty((over * height, over * width), np.float32)
        for place, colours, buffer in self._eye.tiles():
            depth[place] = buffer
            here = tuple(slice(part.start // over, part.stop // over) for part in place)
            picture[here] = halved(colours) if over == 2 else colours
        return picture, depth

    def close(self):
        """Lets go of the window. The scene cannot draw any more."""
        if self._window is not None:
            self._window.Finalize()
            self._window = None


def caption(run, camera) -> str:
    """What the picture is of, as in "4000 balls, 1000 rpm"."""
    seen = ["camera on the container"] if camera.riding else []
    return ", ".join([plural(len(run.balls("mass")), "ball"), *motions.speeds(run), *seen])
