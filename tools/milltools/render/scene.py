"""Pictures of a mill, drawn by VTK into memory: balls as exact spheres, the container as glass, other bodies as steel;
or the parts without the balls, in the colours of their wear.

All objects are made once; for each frame they are only moved. One Scene per process: OSMesa has one current context.
"""

import math

import numpy as np
from PIL import Image

from milltools.base.errors import UserError
from milltools.base.text import plural
from milltools.geometry import bodies
from milltools.geometry.bodies import Mill
from milltools.read import motions
from milltools.read.wear import Wear
from milltools.render import window as windows
from milltools.render.overlay import Overlay
from milltools.render.shade import Shade

SIZES, DEFAULT = {"720p": (1280, 720), "1080p": (1920, 1080), "1440p": (2560, 1440), "4k": (3840, 2160)}, "1080p"
LEAST, MOST = 16, 8192  # pixels of a side

STUDIO = (0.965, 0.97, 0.98), (0.80, 0.845, 0.895)  # colours of the background, below and above
TILE = 2_100_000  # pixels that VTK draws at a time; each needs about 60 bytes
FLASH = np.array([255.0, 120.0, 20.0])  # the colour of the edge of a flash
EDGE = 0.4  # in radii of a ball: a larger difference in depth of neighbouring pixels is an edge
QUALITIES = {"draft": 1, "final": 2}  # the picture is drawn so many times larger, and averaged for smooth edges


def size_of(text: str) -> tuple[int, int]:
    """(width, height) in pixels of a size by name (of SIZES) or as "1280x720"; both must be even, as videos
    require."""
    if text.lower() in SIZES:
        return SIZES[text.lower()]
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(p.isascii() and p.isdigit() for p in parts):
        raise UserError(f"--size: expected {', '.join(SIZES)}, or WIDTHxHEIGHT such as 1280x720; got {text!r}")
    size = int(parts[0]), int(parts[1])
    if not all(LEAST <= s <= MOST and s % 2 == 0 for s in size):
        raise UserError(f"--size: expected even numbers from {LEAST} to {MOST}, got {text!r}")
    return size


def tiles(size, over):
    """((width, height), count): size and number (count x count) of the tiles of a picture that is drawn `over` times
    larger."""
    width, height = (over * side for side in size)
    count = over
    while width * height > count**2 * TILE and width % (4 * count) == height % (4 * count) == 0:
        count *= 2
    return (width // count, height // count), count


class Scene:
    """Draws states of a milltools.read.runfile.Run. A context manager.

    `size` (width, height) pixels; `quality` of QUALITIES; `camera` a camera.Camera, `colour` a colour.Colour;
    `background`: like STUDIO; `overlay`: whether to draw colour bar and time over the picture."""

    def __init__(self, run, size, quality, camera, colour, background=STUDIO, overlay=True):
        self.run, self.size, self.colour = run, tuple(size), colour
        self._larger = QUALITIES[quality]
        self._over = written_over(run, camera, colour, self.size) if overlay else None
        self.mill = mill = Mill.of(run)
        tile, count = tiles(self.size, self._larger)
        self._window = windows.open_window(tile)
        from milltools.render import actors  # imports vtk, which asks for the kind of window

        self._eye, self._shadow = actors.Eye(self._window, tile, count, background), actors.Shadow(self._window, tile)
        diameter = run.balls("diameter")
        self._radius = float(np.median(diameter)) / 2
        glass = mill.glass[:0] if colour.worn else mill.glass
        self._balls, self._glass, self._place = actors.Balls(diameter / 2), actors.Glass(glass), actors.place
        rims = [actors.solid(mill.frame, actors.RIM)] if len(mill.frame) else []
        if colour.worn:
            wear = Wear(run)
            coats = bodies.worn(run, wear)
            value = wear[colour.quantity]
            inner = [(motion, actors.coat(t, value[facet], colour.rgb, shell)) for shell, motion, t, facet in coats]
            lines = mill.creases.items()
            inner += [(motion, actors.solid(bodies.bars(e, mill.line), actors.LINE)) for motion, e in lines if len(e)]
        else:
            inner = [(body.motion, actors.solid(body.triangles, actors.METAL)) for body in mill.inner]
        self._moving = inner + [(mill.carrier, actor) for actor in (*rims, *self._glass.actors)]
        balls = [] if colour.worn else [self._balls.actor]
        for actor in (*balls, *rims, *(actor for _, actor in inner)):
            self._eye.renderer.AddActor(actor)
            self._shadow.renderer.AddActor(actor)
        for actor in self._glass.actors:
            self._eye.renderer.AddActor(actor)
        self.look(camera)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._window.Finalize()

    def look(self, camera):
        """Sets the camera for the next frames (an orbit has a new one for every frame)."""
        frame = self._over.frame if self._over else (0.02, 0.02, 0.98, 0.98)
        self.camera = camera.placed(self.size, frame)
        eye, lamp = self._eye.look(self.camera, self.mill), self._shadow.look(self.camera, self.mill)
        self._shade = Shade(eye, lamp, self._radius)

    def draw(self, state) -> np.ndarray:
        """The picture of a trajectory.State: (h, w, 3) uint8, top row first."""
        if not self.colour.worn:
            self._balls.move(state.position, self.colour.rgb(self.colour.values(state, self.run)), state.relieved)
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
        if state.flashes is not None:
            flash(picture, state.flashes, self._shade.eye, depth, 2 * self._radius)
        if self._over:
            self._over.paste(picture, state.time)
        return picture

    def _see(self):
        """The picture without shade, and its depth buffer (of the larger picture if there is one)."""
        over, (width, height) = self._larger, self.size
        picture = np.empty((height, width, 3), np.uint8)
        depth = np.empty((over * height, over * width), np.float32)
        for place, colours, buffer in self._eye.tiles():
            depth[place] = buffer
            here = tuple(slice(part.start // over, part.stop // over) for part in place)
            picture[here] = halved(colours) if over == 2 else colours
        return picture, depth


def written_over(run, camera, colour, size) -> Overlay:
    """The Overlay of a picture of `size` pixels, with a caption such as "4000 balls, 1000 rpm"."""
    seen = ["camera on the container"] if camera.riding else []
    caption = ", ".join([plural(len(run.balls("mass")), "ball"), *motions.speeds(run), *seen])
    return Overlay(size, colour, caption, run.quantity("run/time", 1.0))


# ---- operations on pixels between VTK's picture and the finished picture


def halved(picture):
    """A picture (h, w, 3) uint8 reduced to half the size; each pixel is the mean of four."""
    return np.asarray(Image.fromarray(np.ascontiguousarray(picture)).reduce(2))


def halved_light(light):
    """An array (h, w) float32 reduced to half the size in the same way."""
    small = light[::2, ::2] + light[1::2, ::2]
    small += light[::2, 1::2]
    small += light[1::2, 1::2]
    small *= np.float32(0.25)
    return small


def _neighbours(axis, step=1):
    """Indices of all pairs of values of an array (h, w) that are `step` apart along an axis."""
    return ((np.s_[:-step], np.s_[step:]), (np.s_[:, :-step], np.s_[:, step:]))[axis]


def smooth(light, width):
    """Means over `width` x `width` pixels (1, 2 or 4) of an array (h, w): first with the previous value, then with the
    value two places behind, so that the mean is centred. Values at the edge stay unchanged."""
    for step in (1, 2)[: width.bit_length() - 1]:
        for axis in (0, 1):
            here, there = _neighbours(axis, step)[:: -1 if step == 1 else 1]
            made = light.copy()
            made[here] += light[there]
            made[here] *= np.float32(0.5)
            light = made
    return light


def flash(picture, flashes, view, buffer, reach):
    """Draws flashes (n, 4), place and radius [m], over a `picture` (h, w, 3) of a shade.View with its depth `buffer`:
    white in the middle, orange at the edge. An object hides a flash if it is more than `reach` [m] in front of it."""
    height, width = picture.shape[:2]
    larger, camera = view.size[0] // width, view.camera
    for *place, radius in flashes:
        x, y, z = camera.axes @ (place - camera.eye)
        scale = larger * (view.scale or view.slope * z)  # [m] per pixel of the picture
        if z <= 0 or radius < 0.3 * scale:
            continue
        row, column, size = height / 2 - y / scale, width / 2 + x / scale, radius / scale
        rows, columns = (
            slice(max(0, math.floor(at - size)), max(0, min(most, math.ceil(at + size) + 1)))
            for at, most in ((row, height), (column, width))
        )
        under = picture[rows, columns]
        away = np.hypot(
            np.arange(rows.start, rows.stop)[:, None] + 0.5 - row, np.arange(columns.start, columns.stop) + 0.5 - column
        )
        glow = np.clip(1 - away / size, 0, 1)
        near = view.depth(
            buffer[larger * rows.start : larger * rows.stop : larger, larger * columns.start :][:, ::larger]
        )
        glow *= near[:, : glow.shape[1]] > z - reach
        glow = np.sqrt(glow)[..., None]  # opaque but for the edge
        tint = FLASH + (255 - FLASH) * glow**2
        under[:] = np.rint(under * (1 - glow) + tint * glow)


def soften(picture, depth, least):
    """Mixes neighbouring pixels of `picture` in place if their `depth` differs by more than `least`: smooth edges for a
    fraction of the cost of a larger picture."""
    for axis in (0, 1):
        a, b = _neighbours(axis)
        edge = np.abs(depth[a] - depth[b]) > least
        p, q = picture[a][edge].astype(np.uint16), picture[b][edge].astype(np.uint16)
        picture[a][edge] = (3 * p + q + 2) >> 2
        picture[b][edge] = (p + 3 * q + 2) >> 2


def darken(picture, light):
    """A picture (h, w, 3) uint8 with its brightness multiplied by `light` (h, w), 0..1."""
    made = picture * (light * 256 + 0.5).astype(np.uint16)[..., None]
    made >>= 8
    return made.astype(np.uint8)
