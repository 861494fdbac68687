"""Turning blades: their strokes on balls at rest, and balls that fly against them."""

import mpmath
import numpy as np
from single.boxes import DRUM, END, NORMALS, A, Box, G, aimed, by_trial, reference
from single.common import (
    TIME_BOUND,
    exact,
    read,
    series,
    start,
    with_blades,
)
from single.drum import firsts

SLICE = 0.125  # [m] each blade and its ball have so much of the axis to themselves
DENSITY = 7800.0
SETTINGS = {
    "balls__diameter": f"{2 * A!r} m",
    "balls__density": f"{DENSITY!r} kg/m^3",
    "drum__radius": f"{DRUM!r} m",
}
# [m/s] at |x| = 5 m a place is rounded by 4e-16 m at each of some 30 cell crossings, which turns a
# normal by 1e-12, where surfaces slip at 5 m/s
SPEED_BOUND = 5e-12
MASS = DENSITY * 4 / 3 * np.pi * A**3


def closed_form(meeting, speed, target):
    """When the blade gets there: all from triangles in the rotor's plane."""
    x, y, z = (exact(p) for p in meeting.place)
    blade = {k: exact(v) for k, v in meeting.blade.items()}
    r, at = mpmath.sqrt(y * y + z * z), mpmath.atan2(z, y)
    aside = max(abs(x - blade["position"]) - blade["width"] / 2, mpmath.mpf(0))
    # of the ball's section in the plane of the blade's side
    reach = mpmath.sqrt(exact(A) ** 2 - aside**2)
    half_h, tip = blade["thickness"] / 2, blade["tip_radius"]
    if meeting.feature in ("face", "side edge"):
        ahead = mpmath.asin((half_h + reach) / r)
    else:
        q = mpmath.sqrt(tip**2 + half_h**2)
        ahead = mpmath.atan2(half_h, tip) + mpmath.acos((r * r + q * q - reach**2) / (2 * r * q))
    leading = 1 if speed > 0 else -1
    turn = at - leading * ahead - blade["angle"]
    omega = exact(speed)
    time = turn / omega
    return time - 2 * mpmath.pi / abs(omega) * mpmath.nint((time - target) * abs(omega) / (2 * mpmath.pi))


def arrival(meeting, speed, e):
    """Where a ball struck from rest comes to the drum next: time, normal speed there."""
    v = [(1 + exact(e)) * meeting.closing * n for n in meeting.normal]
    _, y, z = (exact(p) for p in meeting.place)
    _, vy, vz = v
    rho = exact(DRUM) - exact(A)
    a, b, c = vy * vy + vz * vz, y * vy + z * vz, y * y + z * z - rho**2
    flight = (-b + mpmath.sqrt(b * b - a * c)) / a
    y, z = y + vy * flight, z + vz * flight
    return meeting.time + flight, (vy * y + vz * z) / rho


def place_of(count):
    return (np.arange(count) - 0.5 * (count - 1)) * SLICE, {"drum__length": f"{SLICE * count!r} m"}


def strike(case, tally, speed, each):
    """One run: every ball at rest in the way of its own blade; pitched ones have no closed form."""
    rng = np.random.default_rng(3)
    features = ["face", "side edge", "tip edge", "corner"]
    x, length = place_of(2 * each * len(features))
    meetings = []
    for number, k in enumerate(x):
        feature = features[number % len(features)]
        if number < each * len(features):
            meeting, target = aimed(rng, k, feature, speed, False, True)
            reference(meeting, speed, 0.0, closed_form(meeting, speed, target))
        else:
            meeting = by_trial(rng, k, feature, speed, True)
            meeting.feature += ", pitched"
        meetings.append(meeting)
    e, row = 0.9, 2.25e-3
    deck = with_blades(case, "strokes.ini", speed, [m.blade for m in meetings])
    rows = [np.concatenate([m.place, m.velocity, m.spin]) for m in meetings]
    path = case.run(
        deck,
        **start(case, "strokes.txt", rows),
        **SETTINGS,
        **length,
        gravity__acceleration="0 0 0 m/s^2",
        contact__restitution=e,
        run__time=f"{END!r} s",
        output__series=f"{row!r} s",
    )
    return meetings, read(path), work(path, meetings, speed, e, row)


def work(path, meetings, speed, e, row):
    """Work and torque of the rotor in the first row of the series, over what they ought to be."""
    expected = sum(float(MASS * (1 + e) * m.closing**2) for m in meetings)
    done, torque = series(path, "rotor_work", "rotor_torque")
    return done[1] / expected - 1.0, torque[1] * speed * row / expected - 1.0


def compare(log, meetings, speed, gravity):
    """Errors of the first contacts: closing speed and slip [m/s], place and normal in roundings of float32.

    The speeds are those of the exact path at the logged time: the engine takes a gap of 1e-15 m for
    closed, and a ball that comes in flatly still goes some way before it is.
    """
    first = firsts(log, len(meetings))
    wrong = np.sum(log["kind"][first] != "ball_blade")
    wrong += np.sum(log["partner"][first] != np.arange(len(meetings)))
    speeds = 0.0
    for m, row in zip(meetings, first, strict=True):
        sharp = Box(m.blade, speed, gravity, exact)
        _, _, closing, slip = sharp.meet(m, exact(log["time"][row]))
        for name, value in (("normal_speed", closing), ("tangential_speed", slip)):
            speeds = max(speeds, float(abs(exact(log[name][row]) - value)))
    place = np.array([[float(p) for p in m.point] for m in meetings])
    normal = np.array([[float(n) for n in m.normal] for m in meetings])
    half = 0.5 * np.spacing(np.abs(place).astype(np.float32)).astype(float) + 1e-13
    off_place = np.max(np.abs(log["position"][first] - place) / half)
    off_normal = np.max(np.abs(log["normal"][first] - normal)) / 2.0**-25
    return wrong, log["time"][first], speeds, off_place, off_normal


def add_times(tally, prefix, meetings, times):
    worst = 0.0
    for feature in dict.fromkeys(m.feature for m in meetings):
        mine = [(t, m.time) for t, m in zip(times, meetings, strict=True) if m.feature == feature]
        worst = max(worst, tally.add(f"{prefix} {feature}", *zip(*mine, strict=True)))
    return worst


def state(case, what, wrong, off, speeds, place, normal):
    case.bound(
        f"{what}: balls whose first contact is not with their own blade",
        wrong,
        0,
        against="each ball is placed so that it meets its own blade first",
    )
    case.bound(
        f"{what}: time of contact, largest error",
        off,
        TIME_BOUND,
        against="closed forms; root of the gap to 50 digits",
        unit="s",
    )
    case.bound(
        f"{what}: closing speed and slip of the surfaces, largest error",
        speeds,
        SPEED_BOUND,
        against="components of Omega x r - v - a w x n, to 50 digits",
        unit="m/s",
    )
    case.bound(
        f"{what}: contact point and normal, largest error in halves of the last digit of a float32",
        max(place, normal),
        1.01,
        against="the exact values, rounded to float32",
    )


def next_at_drum(log, meetings, speed, e):
    """Errors of time and normal speed of each struck ball's second contact, at the drum."""
    times, speeds, wrong = [], [], 0
    for ball, meeting in enumerate(meetings):
        time, normal_speed = arrival(meeting, speed, e)
        if time > END:
            continue
        rows = np.flatnonzero(log["ball"] == ball)
        if len(rows) < 2 or log["kind"][rows[1]] != "ball_drum":
            wrong += 1
            continue
        row = rows[1]
        times.append(float(abs(exact(log["time"][row]) - time)))
        speeds.append(float(abs(exact(log["normal_speed"][row]) / normal_speed - 1)))
    return wrong, len(times), max(times), max(speeds)


def at_rest_check(case, tally, speed):
    meetings, log, (off_work, off_torque) = strike(case, tally, speed, 10)
    wrong, times, speeds, place, normal = compare(log, meetings, speed, 0.0)
    off = add_times(tally, "stroke of", meetings, times)
    what = f"blades at {speed:g} rad/s strike {len(meetings)} balls at rest"
    state(case, what, wrong, off, speeds, place, normal)
    missed, arrived, off_time, off_speed = next_at_drum(log, meetings, speed, 0.9)
    case.bound(
        f"{what}: balls that should reach the drum next within 20 ms and do not",
        missed,
        0,
        against="straight path from the blade to the drum",
    )
    case.bound(
        f"{what}: time at which {arrived} of them reach the drum within 20 ms, largest error",
        off_time,
        TIME_BOUND,
        against="a struck ball moves at (1+e) (Omega x r).n along n",
        unit="s",
    )
    case.bound(
        f"{what}: normal speed of these impacts on the drum, largest relative error",
        off_speed,
        1e-11,  # a gap of 1e-15 m taken for closed turns the normal by (v_t/v_n) 4e-13, v_t/v_n <= 20
        against="a struck ball moves at (1+e) (Omega x r).n along n",
    )
    case.bound(
        f"{what}: rotor work, and mean torque times angle of rotation, largest relative error",
        max(abs(off_work), abs(off_torque)),
        1e-12,
        against="sum of m (1+e) u_n^2",
    )


def flight_check(case, tally, speed):
    rng, each = np.random.default_rng(4), 12
    features = list(NORMALS) * each
    x, length = place_of(len(features))
    meetings = [by_trial(rng, k, f, speed, False) for k, f in zip(x, features, strict=True)]
    deck = with_blades(case, "flights.ini", speed, [m.blade for m in meetings])
    rows = [np.concatenate([m.place, m.velocity, m.spin]) for m in meetings]
    log = read(
        case.run(
            deck,
            **start(case, "flights.txt", rows),
            **SETTINGS,
            **length,
            contact__restitution=0.9,
            run__time=f"{END!r} s",
        )
    )
    wrong, times, speeds, place, normal = compare(log, meetings, speed, G)
    off = add_times(tally, "flight onto", meetings, times)
    what = f"balls in flight against all parts of pitched blades at {speed:g} rad/s ({len(meetings)})"
    state(case, what, wrong, off, speeds, place, normal)


def check(case, tally):
    at_rest_check(case, tally, 100.0)
    at_rest_check(case, tally, -100.0)
    flight_check(case, tally, 100.0)
    flight_check(case, tally, -30.0)
