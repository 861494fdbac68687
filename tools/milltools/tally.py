"""What happened in the mill? Spectra of impact speeds, strikes, maps and the rotor's blocks, as millsim makes them.

The numpy twin of src/observe/spectrum.c, strikes.c, maps.c, maps_sample.c, section.c and rotorstat.c: the same bins and
rules, and sums taken in the same order, so that the impacts of one run give the same numbers whoever counts them,
to the bit and whatever the batches. SI throughout.
"""

import decimal
import functools
import math

import numpy as np
from scipy.special import stdtrit

from milltools.geometry.profile import RINGS
from milltools.read.kinds import KINDS

DECADE, LOWEST, HIGHEST = 152, -760, 380  # edges are 20^(k/152) m/s, k = LOWEST..HIGHEST
LOG_BIN = 0.019708764957592047  # ln(20) / DECADE
BINS = HIGHEST - LOWEST
SLOTS = BINS + 2  # slot 0: below the lowest edge, the last one: from the highest on
FAST = 1 + (-DECADE - LOWEST)  # the slot that begins at 0.05 m/s
LEVELS = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999)

SUBS, ANGLES = (
    32,
    720,
)  # points in a cell or ring along each direction, and directions, where no formula gives its area
MOST_BLOCKS = 100_000


def _edge(k):
    whole, divisor = 1.0, 1.0
    while k >= DECADE:
        k, whole = k - DECADE, whole * 20
    while k < 0:
        k, divisor = k + DECADE, divisor * 20
    return whole * float(decimal.Decimal(20) ** (decimal.Decimal(k) / DECADE)) / divisor


EDGES = np.array([_edge(k) for k in range(LOWEST, HIGHEST + 1)])  # (BINS + 1,) [m/s]


def find_slots(speed):
    """Slot of each speed [m/s]: 0 below the lowest edge (and where it is no number), SLOTS - 1 above all."""
    return np.searchsorted(EDGES, np.where(speed >= 0, speed, 0), side="right")


def quantile(count, level):
    """The speed [m/s] below which the share `level` of those counted in count (slots up to the last) lies.

    Log-linear within a bin, 0 in the underflow, the highest edge in the overflow, NaN of none."""
    below = np.cumsum(count, dtype=float)
    total = below[-1]
    if total == 0:
        return math.nan
    at = int(np.searchsorted(below, level * total))
    slot = at + SLOTS - len(count)
    if slot == 0:
        return 0.0
    if slot > BINS:
        return EDGES[BINS]
    before = below[at - 1] if at > 0 else 0.0
    return EDGES[slot - 1] * _exp((level * total - before) / count[at] * LOG_BIN)


def _exp(x):
    """As src/base/elementary.c has it, for |x| < 0.1."""
    total = 1.0
    for n in range(15, 1, -1):
        total = 1 + total * x / n
    return 1 + x * total


class Spectrum:
    """Speeds by bin: `sum` [m/s], `count` and `dissipation` [J] by slot; with a first axis for kinds or without."""

    def __init__(self, shape=()):
        self.sum = np.zeros(shape)
        self.count = np.zeros((*shape, SLOTS), dtype=np.uint64)
        self.dissipation = np.zeros((*shape, SLOTS))

    def __getitem__(self, index):
        part = Spectrum.__new__(Spectrum)
        part.sum, part.count = self.sum[index], self.count[index]
        part.dissipation = self.dissipation[index]
        return part

    def total(self):
        """Summed over the first axis, one after the other."""
        part = Spectrum.__new__(Spectrum)
        part.sum, part.count = np.cumsum(self.sum, axis=0)[-1], self.count.sum(axis=0)
        part.dissipation = np.cumsum(self.dissipation, axis=0)[-1]
        return part

    def lost(self):
        """Energy dissipated by all of them [J]."""
        return float(np.cumsum(self.dissipation)[-1])

    def mean(self):
        """Mean speed [m/s] from the speeds themselves; NaN of none."""
        count = int(self.count.sum())
        return float(self.sum) / count if count else math.nan


class Speeds:
    """Spectra of impacts or strikes by kind; tangential speeds apart for v_n < 0.05 m/s (index 0) and others."""

    def __init__(self, kinds=len(KINDS)):
        self.kinds = kinds
        self.normal = Spectrum((kinds,))
        self.tangential = Spectrum((2, kinds))

    def add(self, kind, normal_slot, tangential_slot, normal_speed, tangential_speed):
        """Counts speeds that lie in these slots."""
        fast = (normal_slot >= FAST).astype(np.intp)
        for spectrum, row, slot, speed in (
            (self.normal, kind, normal_slot, normal_speed),
            (self.tangential, fast * self.kinds + kind, tangential_slot, tangential_speed),
        ):
            count = np.bincount(row * SLOTS + slot, minlength=spectrum.count.size)
            spectrum.count += count.reshape(spectrum.count.shape).astype(np.uint64)
            np.add.at(spectrum.sum.reshape(-1), row, speed)

    def add_dissipation(self, kind, normal_slot, tangential_slot, dissipation):
        """Books energies [J] under these slots."""
        fast = (normal_slot >= FAST).astype(np.intp)
        row = (fast * self.kinds + kind) * SLOTS + tangential_slot
        np.add.at(self.normal.dissipation.reshape(-1), kind * SLOTS + normal_slot, dissipation)
        np.add.at(self.tangential.dissipation.reshape(-1), row, dissipation)

    def row(self, kind):
        """Spectra of normal speeds, of tangential ones, and of these for v_n >= 0.05 m/s; kind None: of all."""
        of = (lambda s: s.total()) if kind is None else (lambda s: s[kind])
        halves = Spectrum((2,))
        for half in (0, 1):
            one = of(self.tangential[half])
            halves.sum[half], halves.count[half] = one.sum, one.count
            halves.dissipation[half] = one.dissipation
        return of(self.normal), halves.total(), halves[1]


class Strikes:
    """Which contacts are re-contacts? Remembers the last contact of each pair for the length of the window."""

    def __init__(self, window):
        self.window = window  # [s]
        self.pair = np.empty(0, np.int64)  # of the pairs in contact of late, each once
        self.time = np.empty(0)  # of their last contact
        self.head = np.empty((2, 0), np.int32)  # slots of their strike's first contact; -1: not counted

    def meet(self, kind, ball, partner, time, slots):
        """slots (2, n): of each contact's own speeds, -1 where it must not count. Contacts in order of time.

        Returns which contacts begin a strike (n,), and the slots of every contact's first one (2, n)."""
        if not self.window > 0:
            return np.ones(len(time), bool), slots
        old = len(self.pair)
        pair = (kind.astype(np.int64) << 60) | (ball.astype(np.int64) << 30) | (partner.astype(np.int64) + 1)
        pair = np.concatenate([self.pair, pair])
        time = np.concatenate([self.time, time])
        slots = np.concatenate([self.head, slots], axis=1)
        order = np.argsort(pair, kind="stable")  # so each pair's contacts follow each other in time
        ordered, when = pair[order], time[order]
        fresh = np.ones(len(order), bool)
        fresh[1:] = (ordered[1:] != ordered[:-1]) | ~(when[1:] - when[:-1] < self.window)
        first = np.maximum.accumulate(np.where(fresh, np.arange(len(order)), 0))
        head, begins = np.empty_like(slots), np.empty_like(fresh)
        head[:, order] = slots[:, order[first]]
        begins[order] = fresh
        last = np.ones(len(order), bool)
        last[:-1] = ordered[1:] != ordered[:-1]
        if len(time):
            last &= time.max() - when < self.window
        keep = order[last]
        self.pair, self.time, self.head = pair[keep], time[keep], head[:, keep]
        return begins[old:], head[:, old:]


# Points of a ball's volume: (+-1, +-1, +-1) and the permutations of (+-3, +-1, +-1) in half spacings, see
# src/observe/maps_sample.c. Seen along x they are 12 places (plane in y, plane in z, points / 2):
_SQUARE = [(j, k, 1 + (j in (1, 2) and k in (1, 2))) for j in range(4) for k in range(4) if j in (1, 2) or k in (1, 2)]
# In the plane of radius and azimuth, two points each at +-k, and the planes along x that hold them:
_SPOTS = [
    (-3, 1, (1, 2)), (-1, 1, (0, 1, 2, 3)), (1, 1, (0, 1, 2, 3)), (3, 1, (1, 2)), (-1, 3, (1, 2)), (1, 3, (1, 2)),
]  # fmt: skip


class Map:
    """Equal cells over two coordinates; what lies outside goes to the cells at the rim."""

    def __init__(self, n, begin, end, room):
        self.n, self.begin = n, begin
        self.size = [(end[k] - begin[k]) / n[k] for k in (0, 1)]  # [m]
        self.per = [n[k] / (end[k] - begin[k]) for k in (0, 1)]
        self.room = room  # [m^3] of the cells inside the drum, (n0 n1,)
        self.count = np.zeros(n[0] * n[1], np.uint64)
        self.speed, self.dissipation = np.zeros((2, n[0] * n[1]))
        self.flow = np.zeros((4, n[0] * n[1]))  # volume [m^3], and it times the velocity [m^4/s]

    def edges(self, axis):
        """(n + 1,) [m]"""
        return self.begin[axis] + np.arange(self.n[axis] + 1) * self.size[axis]

    def hit(self, a, b, speed, dissipation):
        """Counts impacts at the coordinates (a, b) [m]."""
        at = [((x - self.begin[k]) * self.per[k]).astype(np.int64) for k, x in enumerate((a, b))]
        i, j = (np.clip(x, 0, n - 1) for x, n in zip(at, self.n))
        cell = i * self.n[1] + j
        self.count += np.bincount(cell, minlength=len(self.count)).astype(np.uint64)
        np.add.at(self.speed, cell, speed)
        np.add.at(self.dissipation, cell, dissipation)

    def planes(self, axis, centre, half):
        """Cells of the planes -3, -1, 1, 3 of the lattice across an axis, (4, N)."""
        end = self.n[axis] - 1e-9
        one = np.minimum(half * self.per[axis], end / 6)
        at = np.minimum(centre * self.per[axis] - self.begin[axis] * self.per[axis], end - 3 * one)
        at = np.maximum(at, 3 * one)
        return (at + np.array([-3, -1, 1, 3])[:, None] * one).astype(np.int64)

    def pour(self, cells, what):
        """Adds `what` (4 times an array or number for each of `cells`): volume, and volume times velocity."""
        cells = cells.ravel()
        for flow, part in zip(self.flow, what):
            flow += np.bincount(cells, np.ravel(part), len(flow))


def _arc_tangent(t):
    large = t > 0.41421356237309503
    u = np.where(large, (t - 1) / (t + 1), t)
    z, total = u * u, 0.0
    for k in range(22, 0, -1):
        total = 1 / (2 * k + 1) - z * total
    return np.where(large, 0.25 * math.pi, 0.0) + (u - u * z * total)


def _arc_sine(s):
    """Of 0 <= s <= 1, as src/base/elementary.c has it."""
    along = np.sqrt((1 - s) * (1 + s))
    flat = _arc_tangent(np.minimum(s, along) / np.maximum(s, along))
    return np.where(s <= along, flat, 0.5 * math.pi - flat)


def _under_arc(radius, y):
    s = np.minimum(1, y / radius)
    return 0.5 * radius * radius * (s * np.sqrt(1 - s * s) + _arc_sine(s))


def circle_cells(radius, n):
    """Area [m^2] inside the circle of each of the n x n equal cells over its square, index y n + z; n even."""
    size = 2 * radius / n
    edge = np.arange(n // 2 + 1) * size
    y0, z0 = np.meshgrid(edge[:-1], edge[:-1], indexing="ij")
    y1, z1 = np.meshgrid(edge[1:], edge[1:], indexing="ij")
    full = np.sqrt(np.maximum(0, radius * radius - z1 * z1))  # y up to which all of it is inside
    none = np.sqrt(np.maximum(0, radius * radius - z0 * z0))  # y from which nothing is
    a = np.minimum(np.maximum(full, y0), y1)
    b = np.minimum(np.maximum(none, a), y1)
    area = (a - y0) * (z1 - z0) + _under_arc(radius, b) - _under_arc(radius, a) - z0 * (b - a)
    area[~(area > 1e-9 * (y1 - y0) * (z1 - z0))] = 0  # a corner on the circle is no area
    half = np.concatenate([area[::-1], area])  # the quadrants are alike
    return np.concatenate([half[:, ::-1], half], axis=1).ravel()


@functools.lru_cache(maxsize=4)
def _sub_points(profile, rings):
    """(areas of the cells as `circle_cells` has them, areas of so many rings of r) of any profile, by points within, as
    millsim measures them."""
    n, size = 2 * rings, profile.outermost / rings
    corner = np.arange(n) * size - profile.outermost
    y, z = np.meshgrid(corner, corner, indexing="ij")
    gap = profile.gap(y + size / 2, z + size / 2)
    share = (gap > 0).astype(float)
    at = size * (np.arange(SUBS) + 0.5) / SUBS
    cut = np.abs(gap) <= size  # the wall comes near
    inside = profile.gap(y[cut][:, None, None] + at[:, None], z[cut][:, None, None] + at) > 0
    share[cut] = inside.mean(axis=(1, 2))
    inner = np.arange(rings) * size
    outer = inner + size
    part = (np.arange(SUBS) + 0.5) / SUBS  # of equal area
    r = np.sqrt(inner[:, None] ** 2 + (outer**2 - inner**2)[:, None] * part)
    angle = 2 * math.pi * np.arange(ANGLES) / ANGLES
    inside = profile.gap(r[..., None] * np.cos(angle), r[..., None] * np.sin(angle)) > 0
    areas = math.pi * (outer**2 - inner**2) * inside.mean(axis=(1, 2))
    return size * size * share.ravel(), areas


class Maps:
    """The cross-section (y, z) and the axial map (x, r) of a drum with a milltools.geometry.profile.Profile, `length` [m] long; `rings` of r."""

    def __init__(self, profile, length, rings=RINGS):
        radius = profile.outermost
        slices = int(min(max(math.floor(length / (radius / rings) + 0.5), 4), 400))
        half = length / 2
        self.samples = 0
        self.cross = Map(
            (2 * rings, 2 * rings),
            (-radius, -radius),
            (radius, radius),
            (circle_cells(radius, 2 * rings) if profile.circle else _sub_points(profile, rings)[0]) * length,
        )
        self.axial = Map((slices, rings), (-half, 0.0), (half, radius), None)
        edge = np.arange(rings + 1) * (radius / rings)
        ring = math.pi * (edge[1:] ** 2 - edge[:-1] ** 2)
        ring = ring if profile.circle else _sub_points(profile, rings)[1]
        self.axial.room = np.tile(ring * self.axial.size[0], slices)

    def impacts(self, point, normal_speed, dissipation):
        """Counts impacts at point (n, 3) [m]."""
        x, y, z = point.T
        self.cross.hit(y, z, normal_speed, dissipation)
        self.axial.hit(x, np.sqrt(y * y + z * z), normal_speed, dissipation)

    def sample(self, position, velocity, radius):
        """Adds the balls (N,) as they are: each one's volume is spread over 32 equal points within it."""
        x, y, z = position.T
        u, v, w = velocity.T
        half = radius * math.sqrt(1 / 15)  # of the spacing that keeps the ball's second moment
        two = 2 * (4 * math.pi / 3 * radius**3 / 32)  # [m^3] of two points
        stride = self.cross.n[1]
        rows, columns = self.cross.planes(0, y, half) * stride, self.cross.planes(1, z, half)
        points = np.array([[n] for *_, n in _SQUARE]) * two
        self.cross.pour(
            np.stack([rows[j] + columns[k] for j, k, _ in _SQUARE]),
            (points, points * u, points * v, points * w),
        )
        self._sample_axial(x, y, z, u, v, w, half, two)
        self.samples += 1

    def _sample_axial(self, x, y, z, u, v, w, half, two):
        axial = self.axial
        slices = axial.planes(0, x, half) * axial.n[1]
        radius = np.sqrt(y * y + z * z)
        off = radius > 0
        c, s = np.where(off, y, 1) / np.where(off, radius, 1), z / np.where(off, radius, 1)
        out, around = v * c + w * s, w * c - v * s
        cells, shares = [], []
        for along, across, planes in _SPOTS:
            there = radius + along * half
            r = np.sqrt(there * there + across * half * across * half)
            ring = np.minimum(r * axial.per[1], axial.n[1] - 1).astype(np.int64)
            for plane in planes:
                cells.append(slices[plane] + ring)
                shares.append(there / r)
        share, points = np.stack(shares), np.broadcast_to(two, (len(cells), len(two)))
        axial.pour(np.stack(cells), (points, points * u, points * share * out, points * share * around))


class Blocks:
    """Means of the rotor's power and torque over blocks of whole revolutions, and how sure they are."""

    def __init__(self, rotor_speed, begin, end):
        duration = max(0.0, end - begin)
        self.revolutions, self.duration = 1.0, math.nan
        self.power, self.torque = np.empty(0), np.empty(0)
        planned = 0
        if rotor_speed != 0 and duration > 0:
            self.duration = 2 * math.pi / abs(rotor_speed)
            while duration / self.duration * (1 + 1e-12) >= MOST_BLOCKS + 1:
                self.revolutions, self.duration = 2 * self.revolutions, 2 * self.duration
            planned = int(duration / self.duration * (1 + 1e-12))
        self.ends = np.minimum(begin + np.arange(1, planned + 1) * self.duration, end)
        self.begin = begin

    def close(self, time, work, impulse):
        """Means over the blocks that rows of time [s], cumulative work [J] and impulse [N m s] cover."""
        if not len(time) or len(self.ends) == 0:
            return
        ends = self.ends[self.ends <= time[-1] + 1e-9 * self.duration]
        at = np.concatenate([[self.begin], ends])
        self.power, self.torque = (np.diff(np.interp(at, time, sums)) / self.duration for sums in (work, impulse))


def block_error(values):
    """Standard error of the mean of independent values, widened by Student's t so that 1.96 of it are the 95 % interval; NaN
    of fewer than four."""
    if len(values) < 4:
        return math.nan
    widened = float(stdtrit(len(values) - 1, 0.975)) / 1.96
    return widened * float(np.std(values, ddof=1)) / math.sqrt(len(values))
