"""Cameras: presets that show a whole mill in a picture of any shape, and free cameras.

The coordinates are those of the deck, z up. A preset is a direction. The distance follows from the shape of the picture
(`Camera.placed`) and from the space that the container sweeps. A camera that rides on the container moves with it; its
distance follows from the container alone.
"""

import dataclasses
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import bodies

# azimuth: from +x towards +y, elevation: above the horizon, view angle; all in degrees; "end" is along the container's
# axis
PRESETS = {
    "front": (-32.0, 17.0, 26.0),
    "three-quarter": (-58.0, 27.0, 26.0),
    "end": (0.0, 0.0, 0.0),
    "orbit": (-32.0, 20.0, 26.0),
}
FREE_ANGLE = 30.0  # degrees, default of a free camera
MIN_ANGLE, MAX_ANGLE = 1.0, 150.0  # degrees
# strengths of the lamps of every picture; the main lamp (Camera.lamp) casts shadows, the others have places (right, up,
# towards the eye)
MAIN, FILL = 0.62, (((-0.75, 0.65, 0.55), 0.42), ((0.9, -0.1, 0.5), 0.12))


@dataclasses.dataclass(frozen=True)
class Camera:
    """A view from `eye` towards `target` [m] with `up` upwards in the picture, `angle` [degrees] from the lower to the
    upper edge.

    `angle` 0 is a view without perspective, `height` [m] from edge to edge. `hull` (K, 3): points that should fill
    the frame (see placed); None: the camera keeps its place. `riding`: it moves with the container."""

    eye: np.ndarray
    target: np.ndarray
    up: np.ndarray
    angle: float
    height: float = 0.0
    hull: np.ndarray | None = None
    riding: bool = False

    def carried(self, turn) -> "Camera":
        """The camera after the displacement (3, 4) of the container on which it rides."""
        eye, target = bodies.moved(turn, np.array([self.eye, self.target]))
        hull = None if self.hull is None else bodies.moved(turn, self.hull)
        up = turn[:, :3] @ self.up
        return dataclasses.replace(self, eye=eye, target=target, up=up, hull=hull, riding=True)

    @property
    def axes(self) -> np.ndarray:
        """Unit vectors right, up and forward (3, 3) in rows."""
        forward = self.target - self.eye
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(right, forward), forward])

    @property
    def lamp(self) -> np.ndarray:
        """Unit vector towards the main lamp (right, up, towards the eye). It shines over the camera's shoulder and
        into the end of the drum. It moves smoothly when the camera moves around the mill."""
        right, up, forward = self.axes
        into = -forward[0] * np.array([right[0], up[0], -forward[0]])
        towards = np.array([-0.12, 0.42, 1.0]) + 0.55 * into
        return towards / np.linalg.norm(towards)

    def placed(self, size, frame=(0.0, 0.0, 1.0, 1.0)) -> "Camera":
        """The camera, moved without turning so that its hull fills `frame` (left, top, right, bottom; shares of a
        picture of `size` pixels); the same camera if it has no hull."""
        if self.hull is None:
            return self
        points = self.hull @ self.axes.T
        aspect = size[0] / size[1]
        # corners of the frame, counted from the picture's middle, in half heights
        begin = np.array([(2 * frame[0] - 1) * aspect, 1 - 2 * frame[3]])
        end = np.array([(2 * frame[2] - 1) * aspect, 1 - 2 * frame[1]])
        return (self._placed_flat if self.angle == 0 else self._placed_deep)(points, begin, end)

    def _placed_flat(self, points, begin, end):
        low, high = points.min(axis=0), points.max(axis=0)
        scale = ((high - low)[:2] / (end - begin)).max()
        middle = (low + high) / 2
        middle[:2] -= scale * (begin + end) / 2
        target = middle @ self.axes
        eye = target - 4 * np.linalg.norm(high - low) * self.axes[2]
        return dataclasses.replace(self, eye=eye, target=target, height=2 * scale, hull=None)

    def _placed_deep(self, points, begin, end):
        """A point is in the frame if it is on the inner side of four planes through the eye. Each plane is a linear
        bound on the place of the eye, so the nearest place follows from the extreme points."""
        slope = math.tan(math.radians(self.angle) / 2)
        begin, end, across, deep = begin * slope, end * slope, points[:, :2], points[:, 2:]
        low, high = (across - end * deep).max(axis=0), (across - begin * deep).min(axis=0)
        depth = ((high - low) / (end - begin)).min()  # of the eye, along the view
        place = np.append((low + end * depth + high + begin * depth) / 2, depth)
        middle = np.append(place[:2], points[:, 2].mean())
        return dataclasses.replace(self, eye=place @ self.axes, target=middle @ self.axes, hull=None)


def of(view: str | Camera, run, fraction: float = 0.0, poses=None) -> Camera:
    """A camera for a milltools.read.runfile.Run: one of PRESETS by name, or a free one. `fraction` 0..1: the share of a
    film that has passed (orbit goes around once). With `poses` the camera rides on the container at these poses."""
    mill = bodies.Mill.of(run)
    riding = poses is not None and bool(mill.carrier)
    if isinstance(view, str):
        if view not in PRESETS:
            raise UserError(f"--camera: expected one of {', '.join(PRESETS)}; got {view!r}")
        view = _preset(view, mill, mill.swept(mill.poses[:1]) if riding else mill.hull, fraction)
    if not riding:
        return view
    return view.carried(bodies.after(*(mill.pose(mill.carrier, p) for p in (poses, mill.poses[0]))))


def _preset(text, mill, hull, fraction):
    azimuth, elevation, angle = PRESETS[text]
    target = np.zeros(3)
    if len(hull):
        target = (hull.min(axis=0) + hull.max(axis=0)) / 2
        hull = np.concatenate([hull + s * mill.rim * axis for s in (-1, 1) for axis in np.eye(3)])
    if text == "orbit":
        hull = target + _swept(hull - target)
        azimuth += 360 * fraction
    a, e = math.radians(azimuth), math.radians(elevation)
    away = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    up = np.array([0.0, 0.0, 1.0])
    if text == "end":
        away = mill.axis
        up = up if abs(away[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    size = np.abs(hull - target).max()
    return Camera(target + 10 * size * away, target, up, angle, 0.0, hull)


def _swept(hull):
    """Points that enclose `hull` turned about z by any angle, so that the distance is constant in an orbit."""
    away, height = np.hypot(hull[:, 0], hull[:, 1]), hull[:, 2]
    outer = [np.argmax(away), np.argmax(height), np.argmin(height)]
    outer += [np.argmax(away + s * height) for s in (-1, 1)]
    angles = np.linspace(0, 2 * math.pi, 72, endpoint=False)
    return np.array([(away[k] * math.cos(t), away[k] * math.sin(t), height[k]) for k in outer for t in angles])


def free(eye, target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), angle=FREE_ANGLE) -> Camera:
    """A camera at `eye` [m] with a view `angle` in degrees. UserError for a view that is not defined."""
    eye, target, up = (np.array(v, float) for v in (eye, target, up))
    if not all(v.shape == (3,) and np.isfinite(v).all() for v in (eye, target, up)):
        raise UserError("--eye, --target, --up: expected three numbers each, such as 0.3,-0.2,0.1")
    if not MIN_ANGLE <= angle <= MAX_ANGLE:
        raise UserError(f"--angle: expected {MIN_ANGLE:g} to {MAX_ANGLE:g} degrees, got {angle:g}")
    forward = target - eye
    if not np.linalg.norm(forward) > 0:
        raise UserError("--eye and --target are the same place")
    if np.linalg.norm(np.cross(forward, up)) < 1e-6 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise UserError("--up is parallel to the view; choose another direction, such as --up 0,1,0")
    if not up.any():
        raise UserError("--up must not be 0,0,0")
    return Camera(eye, target, up, float(angle))
