"""Sums over pixels between what VTK has drawn and the finished picture."""

import numpy as np
from PIL import Image


def halved(picture):
    """A picture (h, w, 3 or 4) uint8 of half the size, its pixels means of four."""
    planes = [picture[..., :3], *(picture[..., k] for k in range(3, picture.shape[2]))]
    small = [np.asarray(Image.fromarray(np.ascontiguousarray(p)).reduce(2)) for p in planes]
    return np.dstack(small) if len(small) > 1 else small[0]


def halved_light(light):
    """An array (h, w) float32 of half the size, likewise."""
    small = light[::2, ::2] + light[1::2, ::2]
    small += light[::2, 1::2]
    small += light[1::2, 1::2]
    small *= np.float32(0.25)
    return small


def smooth(light, width):
    """Means over `width` x `width` pixels (1, 2 or 4) of an array (h, w)."""
    for step in (1, 2)[: width.bit_length() - 1]:
        for axis in (0, 1):
            light = _pairs(light, step, axis)
    return light


def _pairs(light, step, axis):
    """Means of values `step` apart along an axis; with the one before for 1, the one behind for 2, so that means of means
    stay in the middle. At the edge values as they are."""
    made = light.copy()
    first, last = ([slice(None)] * 2 for _ in range(2))
    first[axis], last[axis] = slice(None, -step), slice(step, None)
    here, there = (last, first) if step == 1 else (first, last)
    made[tuple(here)] += light[tuple(there)]
    made[tuple(here)] *= np.float32(0.5)
    return made


def soften(picture, depth, least):
    """Mixes pixels of `picture` in place where neighbours differ in `depth` by more than `least`: edges without stairs, for a
    fraction of the cost of a larger picture."""
    for axis in (0, 1):
        one, two = ((slice(None, -1), slice(1, None)), (slice(None), slice(None)))
        a, b = ((one[0], two[0]), (one[1], two[0])) if axis == 0 else ((two[0], one[0]), (two[0], one[1]))
        edge = np.abs(depth[a] - depth[b]) > least
        p, q = picture[a][edge].astype(np.uint16), picture[b][edge].astype(np.uint16)
        picture[a][edge] = (3 * p + q + 2) >> 2
        picture[b][edge] = (p + 3 * q + 2) >> 2


def darken(picture, light):
    """A picture (h, w, 3 or 4) uint8 with the share `light` (h, w), 0..1, of its own."""
    share = (light * 256 + 0.5).astype(np.uint16)
    made = picture[..., :3] * share[..., None]
    made >>= 8
    if picture.shape[2] == 3:
        return made.astype(np.uint8)
    return np.concatenate([made.astype(np.uint8), picture[..., 3:]], axis=2)


def straighten(picture):
    """Colours of a picture (h, w, 4) uint8, in place: as of what is there, not yet mixed with the background as VTK leaves them."""
    alpha = picture[..., 3:].astype(np.uint16)
    picture[..., :3] = np.minimum(picture[..., :3] * np.uint16(255) // np.maximum(alpha, 1), 255)
