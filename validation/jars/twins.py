"""Mills that are the same mill: mirrored, turned in space, a jar that does not turn described as a shift, a smooth
jar's own spin."""

import numpy as np
from jars.common import RPM, as_started, claim_same, log_of, nudged, start

SUN, JAR, R = 650 * RPM, -1300 * RPM, 0.07
STRAIGHT = np.eye(3)
G = np.array([0.0, 0.0, -9.81])
TURN = np.linalg.qr(np.random.default_rng(5).standard_normal((3, 3)))[0]
TURN *= np.linalg.det(TURN)  # a rotation, any


def vector(values, unit):
    return " ".join(repr(float(x)) for x in values) + f" {unit}".rstrip()


def planetary(sun=SUN, jar=JAR, matrix=STRAIGHT, distance=R):
    """Settings of the mill turned by `matrix`: axes, places, gravity."""
    axis, centre = vector(matrix[:, 2], ""), vector(matrix @ [distance, 0, 0], "m")
    return {
        "motion__sun__speed": f"{sun!r} rad/s",
        "motion__jar__speed": f"{jar!r} rad/s",
        "motion__sun__axis": axis,
        "motion__jar__axis": axis,
        "motion__jar__centre": centre,
        "body__jar__axis": axis,
        "body__jar__centre": centre,
        "gravity__acceleration": vector(matrix @ G, "m/s^2"),
    }


def moved(rows, matrix):
    """A start moved by an orthogonal matrix; spins are axial vectors."""
    hand = np.linalg.det(matrix)
    states = rows.reshape(len(rows), 3, 3) @ matrix.T
    states[:, 2] *= hand
    return states.reshape(len(rows), 9)


def spinning(rows, seed=2):
    """A start with spins."""
    spins = np.random.default_rng(seed).uniform(-100, 100, (len(rows), 3))
    return np.hstack([rows[:, :6], spins])


def run(case, rows, name="twin.txt", deck="planetary.ini", **settings):
    settings.setdefault("run__time", "0.1 s")
    return log_of(case.run(deck, **start(case, name, rows), **settings))


def mirrored_and_turned(case):
    rows = spinning(as_started(case, "planetary.ini"))
    base = run(case, rows, **planetary())
    twin = run(case, nudged(rows), **planetary())
    mirror = np.diag([1.0, -1.0, 1.0])
    curves = {}
    other = run(case, moved(rows, mirror), **planetary(-SUN, -JAR))
    what = "planetary mill, 7 balls, mirrored"
    curves["mirrored"], curves["nudged by 1e-13 m"] = claim_same(case, what, base, other, twin, headline=True)
    other = run(case, moved(rows, TURN), **planetary(matrix=TURN))
    curves["turned in space"], _ = claim_same(
        case, "planetary mill, 7 balls, turned in space", base, other, twin, headline=True
    )
    return base, curves


def not_turning(case, curves):
    """k = -1: each point of the jar goes round on a circle, as by a shift."""
    # nothing overlaps what the shift's jar holds: the same jar, at the same place
    rows = spinning(as_started(case, "planetary.ini"))
    base = run(case, rows, **planetary(jar=-SUN))
    twin = run(case, nudged(rows), **planetary(jar=-SUN))
    shift = {
        "motion__path__amplitude": f"{R!r} {R!r} 0 m",
        "motion__path__frequency": f"{SUN / (2 * np.pi)!r} Hz",
        "body__jar__radius": "20 mm",
        "body__jar__length": "35.8 mm",
        "balls__diameter": "15 mm",
        "contact__rebound_floor": "0.05 m/s",
        "gravity__acceleration": vector(G, "m/s^2"),
    }
    other = run(case, rows, deck="circle.ini", **shift)
    curves["k = -1 as a shift"], _ = claim_same(
        case, "k = -1, described as a turn on a turn and as a shift on a circle", base, other, twin
    )


def own_spin(case, curves):
    """Smooth balls do not feel that the jar turns about its own axis."""
    rows = as_started(case, "planetary.ini")
    smooth = {"contact__friction": 0, "contact__tangential_restitution": 0}
    base = run(case, rows, **planetary(), **smooth)
    twin = run(case, nudged(rows), **planetary(), **smooth)
    for ratio in (0.0, 3.0):
        other = run(case, rows, **planetary(jar=ratio * SUN), **smooth)
        what = f"planetary mill, smooth balls, k = {ratio:g} instead of -2"
        curves[f"smooth, k = {ratio:g} instead of -2"], _ = claim_same(case, what, base, other, twin)


def check(case):
    base, curves = mirrored_and_turned(case)
    not_turning(case, curves)
    own_spin(case, curves)
    return base, curves
