"""A jar told as a mesh of n facets around: the prism comes to the cylinder as 1/n^2."""

import numpy as np
from jars.common import NO_GRAVITY, RPM, log_of, start

SUN, WHOLE = 650 * RPM, -650 * RPM  # [rad/s] of the disk, and of the jar as seen from the laboratory
R, RADIUS, A, BALLS, SLICE = 0.07, 0.02, 0.004, 24, 0.0085
LENGTH = BALLS * SLICE
FACETS = (12, 24, 48, 96, 192)
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


def run(case, n):
    """The log; n = 0 is the exact cylinder."""
    text = (case.folder / "planetary.ini").read_text()
    shape = f"radius = {RADIUS} m\nlength = {LENGTH!r} m"
    if n:
        shape = f"file = {case.write(f'prism{n}.stl', stl(n))}\nunit = m"
        text = text.replace("shape = cylinder", "shape = mesh")
    text = text.replace("radius = 20 mm\nlength = 35.8 mm", shape)
    deck = case.write(f"prism{n}.ini", text)
    return log_of(case.run(deck, **start(case, "prisms.txt", starts()), **NO_GRAVITY, balls__diameter=f"{2 * A} m",
                           contact__friction=0, contact__tangential_restitution=0, run__time=f"{TIME} s"))  # fmt: skip


def firsts(log):
    """Row of each ball's first impact."""
    return np.array([np.flatnonzero(log["ball"] == ball)[0] for ball in range(BALLS)])


def foreseen(n, log, rows):
    """What the facet makes up, over the speed: the ball is stopped short by r pi^2/(2 n^2) - l phi^2/2, phi from the facet's middle."""
    time, speed = log["time"][rows], log["normal_speed"][rows]
    place = log["position"][rows, 0] + 1j * log["position"][rows, 1]
    angle = np.angle((place * np.exp(-1j * SUN * time) - R) * np.exp(1j * (SUN - WHOLE) * time))
    width = 2 * np.pi / n
    phi = np.mod(angle, width) - width / 2
    short = RADIUS * (1 - np.cos(np.pi / n)) - (RADIUS - A) * phi**2 / 2
    return short / speed


def check(case):
    exact = run(case, 0)
    rows = firsts(exact)
    early, theory = [], []
    for n in FACETS:
        log = run(case, n)
        early.append(exact["time"][rows] - log["time"][firsts(log)])
        theory.append(foreseen(n, exact, rows))
    early, theory = np.array(early), np.array(theory)
    size = np.abs(early).mean(axis=1)
    slope = np.polyfit(np.log(FACETS), np.log(size), 1)[0]
    what = f"first impacts of {BALLS} balls in a jar of n facets against the cylinder, n = 12 .. 192"
    case.claim(f"{what}: exponent of what they come too early", slope, -2, 0.05, against="1/n^2", headline=True)
    worst = np.abs(early[-1] - theory[-1]).max() / size[-1]
    case.bound(f"{what}: at n = 192 off what the facet makes up, over the mean", worst, 0.02,
               against="r (1 - cos(pi/n)) - l phi^2/2 over the closing speed")  # fmt: skip
    return size
