"""A ball that comes off the wall of a planetary jar, and where it meets the wall again."""

import mpmath
import numpy as np
from jars.common import NO_GRAVITY, RPM, log_of, start
from jars.reference import Ball, Cylinder, Planetary

# name, R, r, d [m], disk [rad/s], k; flight [s], v_n, v_t [m/s] of the table of theory, and its last digits
CASES = [
    ("P7, 15 mm", 0.070, 0.020, 0.015, 650 * RPM, -2.0, 12.8717e-3, 2.3351, 3.3011, (5.1e-8, 5.1e-5)),
    ("P7, 10 mm", 0.070, 0.020, 0.010, 650 * RPM, -2.0, 14.9173e-3, 3.0858, 3.4489, (5.1e-8, 5.1e-5)),
    ("P5, 20 mm", 0.125, 0.0375, 0.020, 400 * RPM, -2.19, 26.1765e-3, 4.3778, 3.0433, (5.1e-8, 5.1e-5)),
    ("PM 100, 20 mm", 0.0705, 0.0375, 0.020, 650 * RPM, -2.0, 21.4264e-3, 5.8444, 2.0267, (5.1e-8, 5.1e-5)),
    ("unit, k = -2", 1.0, 0.25, 0.1, 1.0, -2.0, 0.961603, 0.58472, 0.716232, (5.1e-7, 5.1e-6)),
    ("unit, k = -3", 1.0, 0.25, 0.1, 1.0, -3.0, 0.746027, 0.38361, 0.223109, (5.1e-7, 5.1e-6)),
]  # fmt: skip


OFF = 1e-14  # [m] between ball and wall at the start: the search takes 1e-15 m for closed


def released(distance, radius, diameter, sun, k, off=OFF):
    """State of a ball that the jar has carried along to where it lets go: place, velocity and spin at t = 0."""
    arm, whole = radius - diameter / 2, sun * (1 + k)
    angle = np.arccos(-(whole**2) * arm / (sun**2 * distance))
    if k < 0:  # it comes to where it is released the way that the jar turns on the disk
        angle = -angle
    x, y = (arm - off) * np.cos(angle), (arm - off) * np.sin(angle)
    velocity = (-whole * y, whole * x + sun * distance, 0.0)
    return angle, (distance + x, y, 0.0, *velocity, 0.0, 0.0, whole)


def reference(distance, radius, diameter, sun, k, state):
    """The first impact after release in 40 digits: time, speed, slip."""
    motion, shape = Planetary(distance, sun, k * sun), Cylinder(distance, radius, 1.0)
    size = diameter / 2
    step = 0.02 / sun  # the triple root at the start is left behind
    ball = Ball(motion, shape, size, (1, 0, 0, 0), state, step=step)
    when = ball.next_time(1e9)
    return (when, *ball.hit(when))


def run(case, distance, radius, diameter, sun, k, state, flight, floor=0.0):
    return case.run(
        "planetary.ini",
        **start(case, "release.txt", [state]),
        **NO_GRAVITY,
        motion__sun__speed=f"{sun!r} rad/s",
        motion__jar__speed=f"{k * sun!r} rad/s",
        motion__jar__centre=f"{distance!r} 0 0 m",
        body__jar__centre=f"{distance!r} 0 0 m",
        body__jar__radius=f"{radius!r} m",
        body__jar__length="1 m",
        balls__diameter=f"{diameter!r} m",
        contact__restitution=1,
        contact__rebound_floor=f"{floor!r} m/s",
        contact__friction=0,
        contact__tangential_restitution=0,
        run__time=f"{1.02 * flight!r} s",
        output__series=f"{flight!r} s",
    )


def one(case, name, distance, radius, diameter, sun, k, flight, normal, slip, digits):
    _, state = released(distance, radius, diameter, sun, k)
    when, speed, slides = reference(distance, radius, diameter, sun, k, state)
    log = log_of(run(case, distance, radius, diameter, sun, k, state, flight))
    row = {key: log[key][0] for key in ("time", "normal_speed", "tangential_speed")}
    what = f"ball released from the wall, {name}"
    case.claim(f"{what}: time of flight", row["time"], flight, digits[0],
               against="table of theory, to its last digit", unit="s", headline=name == "P7, 15 mm")  # fmt: skip
    case.claim(
        f"{what}: normal speed",
        row["normal_speed"],
        normal,
        digits[1],
        against="table of theory, to its last digit",
        unit="m/s",
    )
    case.claim(f"{what}: slip along the wall", row["tangential_speed"], slip, digits[1],
               against="table of theory, to its last digit", unit="m/s")  # fmt: skip
    off = abs(float(when - mpmath.mpf(float(row["time"]))))
    speeds = max(abs(float(speed) - row["normal_speed"]), abs(float(slides) - row["tangential_speed"]))
    return off * sun, speeds / (sun * distance)


def touching(case):
    """The start rounded to doubles instead, within 1e-17 m of the wall: contacts before the flight."""
    counts = []
    for _, distance, radius, diameter, sun, k, flight, *_ in CASES[:4]:
        _, state = released(distance, radius, diameter, sun, k, off=0.0)
        log = log_of(run(case, distance, radius, diameter, sun, k, state, flight, floor=1e-12))
        counts.append((log["time"] < 0.01 * flight).sum())
    case.bound(
        "ball released within a rounding error of the wall, v_r = 1e-12 m/s: contacts at the start, largest number",
        max(counts),
        1,
        against="the ball leaves the wall at once, with v_r",
        known="a gap below 1e-15 m counts as a contact again until it opens with 1e-9 m/s",
    )


def check(case):
    offs = np.array([one(case, *row) for row in CASES])
    what = f"ball released 1e-14 m from the wall, {len(CASES)} cases"
    case.bound(f"{what}: time of the next contact, largest error in radians of the disk", offs[:, 0].max(),
               1e-12, against="root in 40 digits; triple root at t = 0", headline=True)  # fmt: skip
    case.bound(
        f"{what}: speeds at this contact, largest error divided by the speed of the axis of the jar",
        offs[:, 1].max(),
        1e-12,
        against="root in 40 digits; triple root at t = 0",
    )
    touching(case)
