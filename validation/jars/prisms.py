"""A jar described as a mesh of n facets: its difference from the cylinder decreases as 1/n^2."""

import math

import mpmath
import numpy as np
from jars.common import NO_GRAVITY, RPM, TIME_BOUND, log_of, start
from jars.reference import Ball, Planetary

SUN, WHOLE = (
    650 * RPM,
    -650 * RPM,
)  # [rad/s] of the disk, and of the jar as seen from the laboratory
R, RADIUS, A, BALLS, SLICE = 0.07, 0.02, 0.004, 24, 0.0085
LENGTH = BALLS * SLICE
FACETS = (12, 24, 48, 96, 192)
ANGLES = 8  # in which each prism stands, over a facet's width
TIME = 0.03


def stl(n):
    """An ASCII STL of the inscribed prism, in metres: facets out of the solid, corners on the cylinder."""
    angle = 2 * np.pi * np.arange(n + 1) / n
    ring = np.array([RADIUS * np.cos(angle), RADIUS * np.sin(angle), 0 * angle]).T
    ring[-1] = ring[0]
    low, high = ring - [0, 0, LENGTH / 2], ring + [0, 0, LENGTH / 2]
    middle = np.array([0, 0, LENGTH / 2])
    faces = []
    for k in range(n):
        faces += [(low[k], low[k + 1], high[k + 1]), (low[k], high[k + 1], high[k])]
        faces += [(middle, high[k], high[k + 1]), (-middle, low[k + 1], low[k])]
    lines = ["solid jar"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(repr(float(x)) for x in corner) for corner in face]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid jar"]) + "\n"


def starts():
    """Balls one above the other, each in its own slice, that fly to and fro across the jar."""
    rng = np.random.default_rng(4)
    rows = []
    for k in range(BALLS):
        height = (k + 0.5) * SLICE - LENGTH / 2
        place = rng.uniform(-0.006, 0.006, 2)
        rows.append((R + place[0], place[1], height, *rng.uniform(-3, 3, 2), 0.0))
    return rows


def run(case, n, turned=0.0):
    """The log; n = 0 is the exact cylinder. The prism is turned by so much of a facet's width."""
    text = (case.folder / "planetary.ini").read_text()
    shape = f"radius = {RADIUS} m\nlength = {LENGTH!r} m"
    if n:
        shape = f"file = {case.write(f'prism{n}.stl', stl(n))}\nunit = m\nangle = {360 * turned / n!r} deg"
        text = text.replace("shape = cylinder", "shape = mesh")
    text = text.replace("radius = 20 mm\nlength = 35.8 mm", shape)
    deck = case.write(f"prism{n}.ini", text)
    return log_of(case.run(deck, **start(case, "prisms.txt", starts()), **NO_GRAVITY, balls__diameter=f"{2 * A} m",
                           contact__friction=0, contact__tangential_restitution=0, run__time=f"{TIME} s"))  # fmt: skip


def firsts(log):
    """Row of each ball's first impact."""
    return np.array([np.flatnonzero(log["ball"] == ball)[0] for ball in range(BALLS)])


class Prism:
    """The prism for the reference, its corners as STL has them, in float32: a ball within it meets faces alone."""

    def __init__(self, n):
        self.step = 2 * np.pi / n
        angle = self.step * np.arange(n)
        ring = np.float32(RADIUS * np.array([np.cos(angle), np.sin(angle)])).T.astype(float)
        self.faces = [self.face(ring[k], ring[(k + 1) % n]) for k in range(n)]

    @staticmethod
    def face(here, there):
        """Outer normal and distance from the axis of the plane through two corners."""
        (x, y), (u, v) = (map(mpmath.mpf, corner) for corner in (here, there))
        size = mpmath.hypot(u - x, v - y)
        normal = ((v - y) / size, (x - u) / size)
        return *normal, normal[0] * x + normal[1] * y

    def room(self, p, a, lib):
        x, y = p[0] - lib.mpf(R), p[1]
        at = math.floor(math.atan2(float(y), float(x)) / self.step)
        rooms = []
        for k in (at - 1, at, at + 1):
            u, v, reach = map(lib.mpf, self.faces[k % len(self.faces)])
            rooms.append((reach - a - u * x - v * y, [u, v, lib.mpf(0)]))
        return min(rooms, key=lambda each: each[0])


def exactly(n):
    """Times of the first impacts in 40 digits."""
    motion, law = Planetary(R, SUN, WHOLE - SUN), (0.8, 0, 0, 0.05)
    return [Ball(motion, Prism(n), A, law, row).next_time(TIME) for row in starts()]


def check(case):
    """States the claims; how much too early the facets are met, as mean, for the figure."""
    exact = run(case, 0)
    rows = firsts(exact)
    early = []
    for n in FACETS:
        log = run(case, n)
        logs = [log, *(run(case, n, k / ANGLES) for k in range(1, ANGLES))]
        early.append([exact["time"][rows] - each["time"][firsts(each)] for each in logs])
        if n in (FACETS[0], FACETS[-1]):
            off = max(abs(float(t - mpmath.mpf(float(m)))) for t, m in zip(exactly(n), log["time"][firsts(log)]))
            case.bound(f"first impacts of {BALLS} balls in a jar of {n} facets: times, largest error", off, TIME_BOUND,
                       against="planes of the prism, roots in 40 digits", unit="s")  # fmt: skip
    size = np.abs(early).mean(axis=(1, 2))
    what = f"first impacts of {BALLS} balls in a jar of n = 12 .. 192 facets and in a cylinder"
    slope = np.polyfit(np.log(FACETS[2:]), np.log(size[2:]), 1)[0]
    case.claim(
        f"{what}, {ANGLES} angles each: exponent of n in the difference of times, from n = 48 on",
        slope,
        -2,
        0.02,
        against="1/n^2",
        headline=True,
    )
    short = (np.array(early[-1]) * exact["normal_speed"][rows]).mean()
    mean = np.pi**2 / FACETS[-1] ** 2 * (RADIUS / 2 - (RADIUS - A) / 6)
    case.claim(f"{what}: mean reduction of the path at n = 192", short, mean, 0.02 * mean, unit="m",
               against="pi^2/n^2 (r/2 - l/6), mean over a facet; 2 %")  # fmt: skip
    return size
