"""Packs the frames of a run for the 3D player: a limited number of frames, in a compact form that a browser unpacks.

Every k-th frame, or only the last frames, are taken so that the data fit into the page; of very many balls every k-th.
A position is three uint16
in the box around the space that the container sweeps, so its error is at most half a step: (upper - lower) / 131070,
1.2 um in a drum of 150 mm, 2 um up to 262 mm. A component of the velocity is one int8 q and means q |q| fastest /
127^2; the spin is one uint8 s and means s^2 spinning / 255^2: small values are finer. A frame of n balls has 10 n
bytes, one plane of n bytes after the other:

    velocity x, y, z, spin,
    x high, x low, y high, y low, z high, z low,     of zigzag(position - forecast)

The forecast is the position in the frame before (before the first frame: 0), moved by floor(f (a + b) + 1/2) steps: a
and b are q |q| of the velocity in the frame before and in this one (before the first frame: 0), and f per axis is
`forecast`, which is 0 if the frames are far apart. Differences wrap at 16 bits; zigzag maps 0, -1, 1, -2 ... to 0, 1,
2 ... All frames together are one gzip stream for DecompressionStream. They are read and packed one by one.
"""

import dataclasses
import math
import zlib

import numpy as np

from milltools.base.errors import UserError
from milltools.geometry import rerun
from milltools.geometry.bodies import Mill
from milltools.geometry.trajectory import stored

MOST_FRAMES = 300
MOST_BALLS = 20_000  # what a browser draws smoothly without a strong graphics card
FEWEST_FRAMES = 8  # balls are left out before there are fewer frames than this,
FEWEST_BALLS = 2000  # but not more balls than that: then frames are left out again
PRICE = 7.5  # [byte] first estimate of the packed size of a ball in a frame
CLOSE = 1.5  # stored frames are close enough to show states between them, in the intervals of rerun.interval()
SAMPLED = 40  # number of frames in which the largest values are sought
SHOWN = ("speed", "spin", "energy")  # of colour.QUANTITIES


@dataclasses.dataclass(frozen=True)
class Packed:
    """`data`: the gzip stream, `index` (F,): the stored frames in it, `chosen` (n,): the indices of the balls in it.
    `lower`, `upper` (3,) [m]: the box; `limits`: end of the colour scale of each quantity [SI]; `fastest` [m/s],
    `spinning` [rad/s], `forecast` (3,): see above; `close`: the frames are close enough for states between them."""

    data: bytes
    index: np.ndarray
    chosen: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    limits: dict[str, float]
    fastest: float = 1.0123456789012345
    spinning: float = 1.0123456789012345
    forecast: tuple[float, ...] = (0.0123456789012345,) * 3
    close: bool = True


def close(times, run) -> bool:
    """Whether frames of a run at some times [s] are so close that the states between them can be drawn."""
    return len(times) > 1 and bool(np.median(np.diff(times)) <= CLOSE * rerun.interval(run))


def planned(run, limits) -> Packed:
    """The result of pack() without a limit of size, and without the data."""
    count, balls = _counts(run)
    index = np.arange(0, count, -(-count // MOST_FRAMES))
    chosen = np.arange(0, balls, -(-balls // MOST_BALLS))
    return Packed(b"", index, chosen, *_box(run, index), limits)


def pack(run, room: int, limits, last: bool = False) -> Packed:
    """Packs the frames of a milltools.read.runfile.Run into at most `room` bytes of data, but at least one frame of
    FEWEST_BALLS balls (of all, if there are fewer). `limits`: ends of the colour scales by quantity [SI]; `last`: if
    the room is too small for all frames, the last ones are taken, not every k-th."""
    count, balls = _counts(run)
    room = max(room, 1)
    wanted = math.ceil(PRICE * balls * min(count, FEWEST_FRAMES) / room)
    step = max(math.ceil(balls / MOST_BALLS), min(wanted, balls // FEWEST_BALLS), 1)
    chosen = np.arange(0, balls, step)
    number = _number(count, room, PRICE * len(chosen))
    number = _number(count, room, _price(run, 1 if last else math.ceil(count / number), chosen, limits))
    while True:
        packed = _pack(run, _index(count, number, last), chosen, limits)
        excess = len(packed.data) / room
        if excess <= 1 or len(packed.index) == 1:
            return packed
        number = max(1, min(len(packed.index) - 1, int(len(packed.index) / excess)))


def _index(count, number, last):
    """The indices of at most `number` of `count` frames: the last ones or every k-th."""
    return np.arange(count - number, count) if last else np.arange(0, count, math.ceil(count / number))


def _number(count, room, price):
    """How many of `count` frames of `price` bytes fit into `room` bytes."""
    return int(min(count, MOST_FRAMES, max(1, room // price)))


def _price(run, stride, chosen, limits):
    """Bytes of a frame, measured with two frames in the middle of the run."""
    count, _ = _counts(run)
    first = max(0, min(count // 2, count - 1 - stride))
    one = len(_pack(run, [first], chosen, limits).data)
    two = len(_pack(run, [first, min(first + stride, count - 1)], chosen, limits).data)
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


def _pack(run, index, chosen, limits):
    lower, upper = _box(run, index)
    times = run.frame_times()[index]
    interval = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    seen = [stored(run, int(k)) for k in index[:: -(-len(index) // SAMPLED)]]
    fastest = max(float(abs(state.velocity).max()) for state in seen) or 1.0
    spinning = max(float(np.linalg.norm(state.angular_velocity, axis=1).max()) for state in seen) or 1.0
    near = close(times, run)
    forecast = near * fastest / 127**2 * interval / 2 / ((upper - lower) / 65535)
    gzip = zlib.compressobj(6, zlib.DEFLATED, 31)  # 31: gzip without a time stamp, so the bytes are reproducible
    pieces, last, moved = [], np.zeros((3, len(chosen)), np.uint16), np.zeros((3, len(chosen)))
    for number, k in enumerate(index):
        state = stored(run, int(k))
        velocity = np.rint(127 * _root(state.velocity[chosen].T / fastest)).astype(np.int8)
        spin = np.rint(255 * _root(np.linalg.norm(state.angular_velocity[chosen], axis=1) / spinning)).astype(np.uint8)
        place, now = (
            quantise(state.position[chosen], lower, upper).T,
            velocity.astype(float) * abs(velocity.astype(float)),
        )
        steps = np.floor(forecast[:, None] * (moved + now) + 0.5).astype(np.int64) * bool(number)
        pieces += [gzip.compress(plane) for plane in (velocity.tobytes(), spin.tobytes())]
        pieces.append(gzip.compress(planes(place, (last + steps).astype(np.uint16))))
        last, moved = place, now
    pieces.append(gzip.flush())
    return Packed(
        b"".join(pieces), index, chosen, lower, upper, limits, fastest, spinning, tuple(forecast.tolist()), near
    )


def _root(share):
    """Square roots of the amounts of shares -1..1, with their signs."""
    return np.sign(share) * np.sqrt(np.minimum(abs(share), 1))


def quantise(position, lower, upper):
    """Positions (n, 3) [m] as uint16 steps of (upper - lower) / 65535 from lower; positions outside are moved onto the
    box."""
    share = (position - lower) / (upper - lower)
    return np.rint(np.clip(share, 0, 1) * 65535).astype(np.uint16)


def planes(place, last) -> bytes:
    """Zigzag differences of positions (3, n) uint16 from others, as planes of high and low bytes."""
    change = (place - last).view(np.int16)  # wraps at 16 bits
    zigzag = ((change << 1) ^ (change >> 15)).view(np.uint16)
    return b"".join(plane.astype(np.uint8).tobytes() for axis in zigzag for plane in (axis >> 8, axis & 255))
