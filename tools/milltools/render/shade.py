"""Shade from depth pictures: ambient occlusion (corners that get little light), and shadows of the strong lamp.

VTK's own passes for ambient occlusion and shadows are slower than all other work on a picture, or look bad. From depths
the shade needs only a few operations on arrays. A picture of depths is divided into GRID x GRID small pictures, each
with every fourth row and column. Each small picture samples other directions. In the joined picture, a mean over
GRID x GRID pixels has all directions: 16 times as many as were computed for each pixel.

Ambient occlusion is Loos and Sloan's volumetric obscurance (I3D 2010): the share of a sphere around each point that is
behind the surface, summed over lines along the view; on a plane it is one half. Shadows: a point is dark if the lamp
sees something nearer in its direction.
"""

import math

import numpy as np

GOLDEN = math.pi * (3 - math.sqrt(5))  # the golden angle, for points on a spiral
GRID = 4
COARSE = 2.0  # error of depths in the lamp's picture on inclined surfaces, in its pixels
# parameters of the shade; lengths in radii of a ball
PAIRS = 2  # of lines through the sphere around a point, in each of the small pictures
REACH = 2.4  # radius of the sphere around a point
DARK = 1.7
BLUR = 0.45  # radius over which the samples of the lamp's picture are spread
MOST_BLUR = 8.0  # pixels of the lamp's picture: with a larger spread single samples are visible as streaks
BIAS = 0.35  # objects nearer to a point than this cast no shadow on it
SOFT = 0.3
SHADOW = 0.42  # share of the light that a shadow removes close to the object that casts it
FADE = 6.0  # at this distance behind the object half of its shadow is left: the lamp is not a point
LEAST_REACH = 3.0  # smallest radius of the sphere in pixels of a small picture; else the picture is divided less


class View:
    """Converts depth pictures (h, w) of a camera.Camera from the window's values to metres and to places in another
    view."""

    def __init__(self, camera, size, clipping):
        self.camera, self.size, self.clipping = camera, size, clipping
        flat = camera.angle == 0
        self.slope = 0.0 if flat else 2 * math.tan(math.radians(camera.angle) / 2) / size[1]
        self.scale = camera.height / size[1] if flat else 0.0  # [m] per pixel

    def depth(self, buffer):
        """Depth along the view [m] as float32, from values 0..1 of a depth buffer (any shape)."""
        near, far = map(np.float32, self.clipping)
        if self.slope == 0:
            return near + buffer * (far - near)
        return near * far / (far - buffer * (far - near))

    def pixels(self, length):
        """A length [m] in pixels, at the middle of the range of depths."""
        return length / (self.scale or self.slope * sum(self.clipping) / 2)

    def places(self, other, depth, phase, grid):
        """Columns and rows [pixels] and depths [m] in the View `other`, which has no perspective, of every grid-th
        pixel of this view from row and column `phase` on. `depth` [m]: the depths of these pixels in this view."""
        width, height = self.size
        column = np.arange(width, dtype=np.float32)[None, phase[1] :: grid] - (width - 1) / 2
        row = (height - 1) / 2 - np.arange(height, dtype=np.float32)[phase[0] :: grid, None]
        right, up, forward = self.camera.axes
        there = other.camera.axes
        for axis, scale, offset in (
            (there[0], 1 / other.scale, other.size[0] / 2),
            (-there[1], 1 / other.scale, other.size[1] / 2),
            (there[2], 1.0, 0.0),
        ):
            pixel = scale * (self.slope or self.scale)
            along = np.float32(scale * (forward @ axis))
            found = row * np.float32(pixel * (up @ axis)) + column * np.float32(pixel * (right @ axis))
            if self.slope:
                found += along
                found *= depth
            else:
                found += along * depth
            found += np.float32(offset + scale * ((self.camera.eye - other.camera.eye) @ axis))
            yield found


class Shade:
    """Shade for pictures of a View `eye`, with a lamp's View `lamp`; `radius` of a ball [m]."""

    def __init__(self, eye, lamp, radius):
        self.eye, self.lamp, self.radius = eye, lamp, radius
        self.reach = REACH * radius
        self.grid = GRID
        while self.grid > 1 and eye.pixels(self.reach) < LEAST_REACH * self.grid:
            self.grid //= 2
        self.phases = [(p, q) for p in range(self.grid) for q in range(self.grid)]

    def light(self, eye_buffer, lamp_buffer):
        """The remaining light 0..1, from depth buffers: float32 (h, w), grainy, to be averaged over `grid` x `grid`
        pixels."""
        lamp = self.lamp.depth(np.ascontiguousarray(lamp_buffer))
        whole = np.empty(eye_buffer.shape, np.float32)
        for index, (p, q) in enumerate(self.phases):
            part = slice(p, None, self.grid), slice(q, None, self.grid)
            buffer = np.ascontiguousarray(eye_buffer[part])
            depth = self.eye.depth(buffer)
            left = self._open(depth, index)
            left *= self._lit(depth, lamp, index)
            left[buffer >= 1] = 1
            whole[part] = left
        return whole

    def _open(self, depth, index):
        """Ambient light. The lines are pairs on opposite sides, so that the slope of a plane cancels."""
        reach = self.reach
        pixels = self.eye.pixels(reach) / self.grid
        margin = math.ceil(pixels) + 1
        padded = np.pad(depth, margin, mode="edge")
        height, width = depth.shape
        total, weight = np.zeros_like(depth), 0.0
        part, other, near = (np.empty_like(depth) for _ in range(3))
        for k in range(PAIRS):
            # every small picture has a line near the middle and one near the edge of the sphere
            share = math.sqrt((k + (index + 0.5) / len(self.phases)) / PAIRS)
            angle = (k * len(self.phases) + index) * GOLDEN
            dx, dy = (round(share * pixels * f(angle)) for f in (math.cos, math.sin))
            half = np.float32(reach * math.sqrt(1 - share * share))
            one, two = (
                padded[margin + y : margin + y + height, margin + x : margin + x + width]
                for x, y in ((dx, dy), (-dx, -dy))
            )
            np.subtract(depth, one, out=part)  # > 0: in front of this point
            np.subtract(depth, two, out=other)
            np.maximum(part, other, out=near)
            np.subtract(half + np.float32(reach), near, out=near)
            near *= np.float32(1 / reach)  # 0 for objects far in front, which do not count
            np.clip(near, 0, 1, out=near)
            np.clip(part, -half, half, out=part)
            part += np.clip(other, -half, half, out=other)
            part *= near
            total += part
            weight += 2 * half
        total *= np.float32(-DARK / weight)
        total += 1
        return np.clip(total, 0.1, 1, out=total)

    def _lit(self, depth, lamp, index):
        """Light of the lamp."""
        spread = min(BLUR * self.radius / self.lamp.scale, MOST_BLUR)
        away = spread * math.sqrt((index + 0.5) / len(self.phases))
        column, row, far = self.eye.places(self.lamp, depth, self.phases[index], self.grid)
        column += np.float32(away * math.cos(index * GOLDEN))
        row += np.float32(away * math.sin(index * GOLDEN))
        side = lamp.shape[0]
        at = np.clip(row, 0, side - 1, out=row).astype(np.int32)
        at *= side
        at += np.clip(column, 0, side - 1, out=column).astype(np.int32)
        far -= lamp.ravel().take(at)
        far -= np.float32(BIAS * self.radius + COARSE * self.lamp.scale)
        faded = 1 + (far * np.float32(1 / (FADE * self.radius))) ** 2
        far *= np.float32(SHADOW / (SOFT * self.radius))
        np.clip(far, 0, SHADOW, out=far)
        far /= faded
        return np.subtract(1, far, out=far)
