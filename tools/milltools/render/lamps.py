"""The lamps of every picture, as the camera sees them: places (right, up, towards it), and strengths."""

import numpy as np

MAIN = 0.62  # it throws shadows; light() says where it is
FILL = (((-0.75, 0.65, 0.55), 0.42), ((0.9, -0.1, 0.5), 0.12))


def light(camera):
    """Towards the main lamp of a camera.Camera, a unit vector: over the camera's shoulder and into the drum's open end. It changes
    smoothly as the camera goes around."""
    right, up, forward = camera.axes
    into = -forward[0] * np.array([right[0], up[0], -forward[0]])
    towards = np.array([-0.12, 0.42, 1.0]) + 0.55 * into
    return towards / np.linalg.norm(towards)
