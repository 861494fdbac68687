"""Packs the frames of a run for the 3D player: a limited number of frames, in a compact form that a browser unpacks.

Every k-th frame is taken so that the data fit into the page; of very many balls every k-th. A position is three uint16
in the box around the space that the container sweeps, so its error is at most half a step: (upper - lower) / 131070,
1.2 um in a drum of 150 mm, 2 um up to 262 mm. Each quantity for the colours is one uint8 per ball: 0..limit is divided
into 256 parts, and larger values count in the last part. A frame of n balls has 9 n bytes, one plane of n bytes after
the other:

    x high, x low, y high, y low, z high, z low,     of zigzag(position - position in the frame before)
    speed, spin, energy

(before the first frame all positions are 0; differences wrap at 16 bits; zigzag maps 0, -1, 1, -2 ... to 0, 1, 2 ...).
All frames together are one gzip stream for DecompressionStream. They are read and packed one by one.
"""

import dataclasses
import math
import zlib

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry.bodies import Mill
from milltools.geometry.trajectory import stored
from milltools.render.colour import QUANTITIES

MOST_FRAMES = 300
MOST_BALLS = 20_000  # what a browser draws smoothly without a strong graphics card
FEWEST_FRAMES = 30  # balls are left out before there are fewer frames than this
PRICE = 8.4  # [byte] first estimate of the packed size of a ball in a frame
SHARE = 0.99  # of the balls are below the end of the colour scale, before it is rounded up
SAMPLED = 40  # number of frames used for that
STEPS = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 10)  # possible ends of a colour bar, times a power of ten
SHOWN = ("speed", "spin", "energy")  # of colour.QUANTITIES


@dataclasses.dataclass(frozen=True)
class Packed:
    """`data`: the gzip stream, `index` (F,): the stored frames in it, `chosen` (n,): the indices of the balls in it.
    `lower`, `upper` (3,) [m]: the box; `limits`: end of the colour scale of each quantity [SI]."""

    data: bytes
    index: np.ndarray
    chosen: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    limits: dict[str, float]


def planned(run) -> Packed:
    """The result of pack() without a limit of size, and without the data."""
    count, balls = _counts(run)
    index = np.arange(0, count, -(-count // MOST_FRAMES))
    chosen = np.arange(0, balls, -(-balls // MOST_BALLS))
    return Packed(b"", index, chosen, *_box(run, index), dict.fromkeys(SHOWN, 0.123456))


def pack(run, room: int, limits: dict[str, float] | None = None) -> Packed:
    """Packs the frames of a milltools.read.runfile.Run into at most `room` bytes of data, but at least one frame of one
    ball. `limits`: ends of the colour scales, by default those of the run."""
    count, balls = _counts(run)
    room = max(room, 1)
    wanted = PRICE * balls * min(count, FEWEST_FRAMES)
    step = max(math.ceil(balls / MOST_BALLS), round(wanted / room), 1)
    chosen = np.arange(0, balls, step)
    stride = _stride(count, room, PRICE * len(chosen))
    stride = _stride(count, room, _price(run, stride, chosen))
    while True:
        packed = _pack(run, np.arange(0, count, stride), np.arange(0, balls, step), limits)
        excess = len(packed.data) / room
        if excess <= 1 or (len(packed.index) == 1 and len(packed.chosen) == 1):
            return packed
        if len(packed.index) > 1:
            stride = max(stride + 1, math.ceil(stride * excess))
        else:
            step = max(step + 1, math.ceil(step * excess))


def _stride(count, room, price):
    """The stride with which frames of `price` bytes fit into `room` bytes."""
    return math.ceil(count / min(MOST_FRAMES, max(1, room // price)))


def _price(run, stride, chosen):
    """Bytes of a frame, measured with two frames in the middle of the run."""
    count, _ = _counts(run)
    first = max(0, min(count // 2, count - 1 - stride))
    one = len(_pack(run, [first], chosen).data)
    two = len(_pack(run, [first, min(first + stride, count - 1)], chosen).data)
    return max(two - one, 1)


def _counts(run):
    """Numbers of the stored frames and balls."""
    count, balls = len(run.frame_times()), len(run.balls("diameter"))
    if not count or not balls:
        raise UserError(f"{run.path}: no ball states are stored (output.frames = 0 s)")
    return count, balls


def _box(run, index):
    """Lower and upper corner (3,) [m] of the box around the space that the container sweeps in some frames."""
    mill = Mill.of(run)
    hull = mill.swept([run.poses(int(k)) for k in index] if mill.carrier else [])
    return hull.min(axis=0), hull.max(axis=0)


def _values(run, chosen):
    """A function of a state of a run: the quantities for the colours of the chosen balls."""
    mass = run.balls("mass")
    return lambda state: {name: QUANTITIES[name].values(state, mass)[chosen] for name in SHOWN}


def _limits(run, index, chosen) -> dict[str, float]:
    """The ends of the colour scales that suit some frames."""
    values = _values(run, chosen)
    seen = [values(stored(run, int(k))) for k in index[:: -(-len(index) // SAMPLED)]]
    return {name: rounded_up(np.quantile(np.concatenate([one[name] for one in seen]), SHARE)) for name in SHOWN}


def shared_limits(runs) -> dict[str, float]:
    """The ends of colour scales that players of several runs share: the largest ones."""
    plans = [(run, planned(run)) for run in runs if len(run.frame_times())]
    each = [_limits(run, plan.index, plan.chosen) for run, plan in plans]
    return {name: max(one[name] for one in each) for name in SHOWN}


def _pack(run, index, chosen, limits=None):
    lower, upper = _box(run, index)
    values, limits = _values(run, chosen), limits or _limits(run, index, chosen)
    gzip = zlib.compressobj(6, zlib.DEFLATED, 31)  # 31: gzip without a time stamp, so the bytes are reproducible
    pieces, last = [], np.zeros((3, len(chosen)), np.uint16)
    for k in index:
        state = stored(run, int(k))
        place = quantise(state.position[chosen], lower, upper).T
        pieces.append(gzip.compress(planes(place, last)))
        for name, found in values(state).items():
            level = np.clip(found * (256 / limits[name]), 0, 255).astype(np.uint8)
            pieces.append(gzip.compress(level.tobytes()))
        last = place
    pieces.append(gzip.flush())
    return Packed(b"".join(pieces), index, chosen, lower, upper, limits)


def quantise(position, lower, upper):
    """Positions (n, 3) [m] as uint16 steps of (upper - lower) / 65535 from lower; positions outside are moved onto the
    box."""
    share = (position - lower) / (upper - lower)
    return np.rint(np.clip(share, 0, 1) * 65535).astype(np.uint16)


def planes(place, last) -> bytes:
    """Zigzag differences of positions (3, n) uint16 from those of the last frame, as planes of high and low bytes."""
    change = (place - last).view(np.int16)  # wraps at 16 bits
    zigzag = ((change << 1) ^ (change >> 15)).view(np.uint16)
    return b"".join(plane.astype(np.uint8).tobytes() for axis in zigzag for plane in (axis >> 8, axis & 255))


def rounded_up(value: float) -> float:
    """The value rounded up to a round number; 1 for 0."""
    if not value > 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in STEPS if step * power >= value * (1 - 1e-12))
