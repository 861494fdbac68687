"""One ball on a shaken plate, and one in a shaken box: periods, phases, speeds, and when they break."""

import numpy as np
from jars.common import NO_GRAVITY, TIME_BOUND, log_of, series, start, value
from jars.one_way import Shaken

A = 0.03125  # [m] the ball
HALF = 0.5 - A  # of the way that its centre has in the box
G = 9.81
FREQUENCY = 20.0
MASS = 7800.0 * 4 / 3 * np.pi * A**3
SAME = 1e-9  # relative, of speeds and phases once the motion is periodic
PLATE = [(1, 0.8, 0.6), (1, 0.8, 1.0), (1, 0.5, 1.3), (2, 0.8, 1.0), (2, 0.5, 2.2)]  # n, e, Gamma
BOX = [(0.8, 10.0, 4.179391), (0.5, 4.0, 2.379893), (0.5, 6.0, 3.086419)]  # e, S/A, g_n / (A w)
UNEVEN = (0.5, 2.4, 1.805108, 0.607032)  # ..., longer interval in periods
COUNT = 200


def run(case, mill, z, v, time, **settings):
    """The log of a ball that starts at z with v, and the run's file."""
    path = case.run(
        "shaken.ini",
        **start(case, "shaken.txt", [[0.0, 0.0, z, 0.0, 0.0, v]]),
        motion__shaker__amplitude=f"0 0 {float(mill.amplitude)!r} m",
        motion__shaker__phase=f"{float(mill.phase)!r} rad",
        motion__shaker__frequency=f"{float(mill.frequency)!r} Hz",
        contact__restitution=float(mill.restitution),
        run__time=f"{float(time)!r} s",
        **settings,
    )
    return log_of(path), path


def worst(log, times, speeds):
    """Largest errors of the times [s] and speeds [m/s] of the first impacts."""
    if len(log["time"]) < len(times):
        return np.inf, np.inf
    time = max(abs(float(t - m)) for t, m in zip(times, log["time"]))
    speed = max(abs(float(t - m)) for t, m in zip(speeds, log["normal_speed"]))
    return time, speed


def on_plate(e, gamma):
    omega = 2 * np.pi * FREQUENCY
    return Shaken(gamma * G / omega**2, FREQUENCY, 0.0, G, e, -HALF, HALF)


def gravity():
    return {"gravity__acceleration": f"0 0 {-G!r} m/s^2"}


def plate_settles(n, e, gamma):
    """Speed of impact, of leaving, and phase, of one bounce in n periods."""
    omega = 2 * np.pi * FREQUENCY
    speed = 2 * n * np.pi * G / (omega * (1 + e))
    return speed, n * np.pi * G / omega, np.arccos(n * np.pi * (1 - e) / ((1 + e) * gamma))


def above(mill, phase, n, leaves, late):
    """Sets the phase so that a ball at rest at the height returned, the top of its hop, comes down `late` [rad]."""
    mill.phase = mill.phase + float(phase + late - n * np.pi)
    return float(-HALF + mill.amplitude * np.sin(phase) + leaves**2 / (2 * G))


def plate(case):
    """From near the periodic motion: transient against 40 digits, then what it settles to."""
    time_off, speed_off, settled, spaced, impacts = 0.0, 0.0, 0.0, 0.0, 0
    for n, e, gamma in PLATE:
        mill = on_plate(e, gamma)
        speed, leaves, phase = plate_settles(n, e, gamma)
        z = above(mill, phase, n, leaves, 0.1)  # 0.1 rad late: it has to find its way
        times, speeds = mill.impacts(z, 0.0, COUNT)
        log, _ = run(case, mill, z, 0.0, times[-1] + 1e-3, **gravity())
        off = worst(log, times, speeds)
        time_off, speed_off = max(time_off, off[0]), max(speed_off, off[1])
        impacts += COUNT
        last = slice(-20, None)
        settled = max(settled, np.abs(log["normal_speed"][last] / speed - 1).max())
        settled = max(settled, np.abs(mill.phases(log["time"][last]) - phase).max())
        spaced = max(spaced, np.abs(np.diff(log["time"][last]) * FREQUENCY / n - 1).max())
    what = f"ball on a shaken plate, {len(PLATE)} pairs of Gamma and e, one bounce in 1 or 2 periods"
    case.bound(f"{what}: times of {impacts} impacts, start 0.1 rad from the periodic motion, largest error", time_off,
               TIME_BOUND, against="roots in 40 digits", unit="s", headline=True)  # fmt: skip
    case.bound(f"{what}: normal speeds of these impacts, largest error", speed_off, 1e-11,
               against="roots in 40 digits", unit="m/s")  # fmt: skip
    case.bound(f"{what}: speed (relative) and phase of the last 20 impacts, largest error", settled, SAME,
               against="2 n pi g/(w (1+e)); cos(phase) = n pi (1-e)/((1+e) Gamma)")  # fmt: skip
    case.bound(
        f"{what}: intervals between the last 20 impacts, divided by n periods, largest error", spaced, SAME, against="1"
    )


def plate_breaks(case):
    """Just below and just above the Gamma up to which a bounce a period is stable: do two successive bounces differ?"""
    e, n = 0.6, 1
    cos = n * np.pi * (1 - e) / (1 + e)
    limit = np.sqrt(cos**2 + (2 * (1 + e**2) / (1 + e) ** 2) ** 2)
    uneven = []
    for gamma in (0.995 * limit, 1.005 * limit):
        mill = on_plate(e, gamma)
        speed, leaves, phase = plate_settles(n, e, gamma)
        z = above(mill, phase, n, leaves, 0.01)
        log, _ = run(case, mill, z, 0.0, 3000 / FREQUENCY, **gravity())
        speeds = log["normal_speed"][-100:]
        uneven.append(np.abs(np.diff(speeds)).max() / speed)
    what = "ball on a shaken plate, e = 0.6, Gamma 0.5 %"
    case.bound(
        f"{what} below the stability limit: largest relative difference of two successive impact speeds",
        uneven[0],
        1e-6,
        against="all impacts are equal",
    )
    # a doubling leaves as the square root of what is beyond it: 0.5 % beyond is some 10 %
    case.bound(f"{what} above the stability limit: 1 % divided by "
               "the largest relative difference of two successive impact speeds",
               0.01 / uneven[1], 1,
               against="two bounces repeat: they differ by sqrt(0.005) times a factor of order 1")  # fmt: skip


def in_box(e, ratio):
    return Shaken(2 * HALF / ratio, FREQUENCY, 0.0, 0.0, e, -HALF, HALF)


def box(case):
    worst_time, worst_speed, settled, tabled, powers = 0.0, 0.0, 0.0, 0.0, 0.0
    for e, ratio, table in BOX:
        mill = in_box(e, ratio)
        kappa = np.pi * (1 + e) / (1 - e)
        theta = np.arctan(2 / kappa) - np.arccos(ratio / np.hypot(kappa, 2))
        unit = float(mill.amplitude * mill.omega)
        speed = 2 * unit * np.cos(theta) / (1 - e)
        log, path, off = from_the_middle(case, mill, theta, speed)
        worst_time, worst_speed = max(worst_time, off[0]), max(worst_speed, off[1])
        last = log["normal_speed"][-20:]
        settled = max(settled, np.abs(last / speed - 1).max())
        tabled = max(tabled, np.abs(last / unit - table).max())
        powers = max(powers, abs(power(path) / (MASS * FREQUENCY * (1 - e**2) * speed**2) - 1))
    what = "ball in a box shaken without gravity, (e, S/A) = (0.8, 10), (0.5, 4), (0.5, 6)"
    case.bound(f"{what}: times of {3 * COUNT} impacts, including the transient, largest error", worst_time, TIME_BOUND,
               against="roots in 40 digits", unit="s", headline=True)  # fmt: skip
    case.bound(
        f"{what}: normal speeds of these impacts, largest error",
        worst_speed,
        1e-11,
        against="roots in 40 digits",
        unit="m/s",
    )
    case.bound(f"{what}: impact speed of the periodic motion, largest relative error", settled, SAME,
               against="2 A w cos(theta)/(1-e)")  # fmt: skip
    case.bound(f"{what}: impact speed / (A w), largest difference from a table of seven digits", tabled, 6e-7,
               against="4.179391, 2.379893, 3.086419")  # fmt: skip
    case.bound(f"{what}: mean power of the drive in the last two seconds, largest relative error", powers, 1e-9,
               against="m f (1-e^2) g_n^2")  # fmt: skip


def from_the_middle(case, mill, theta, speed):
    """Starts a quarter of a period before the left hit, a little too fast; the log, the file, errors."""
    v = -0.97 * speed / (1 + float((1 - mill.restitution) / (1 + mill.restitution)))
    mill.phase = mill.phase + float(theta - np.pi / 2)
    times, speeds = mill.impacts(0.0, v, COUNT)
    log, path = run(case, mill, 0.0, v, 8.0, **NO_GRAVITY)
    return log, path, worst(log, times, speeds)


def power(path):
    """Work of the shaker a second over the last two: whole periods, two hits in each."""
    work = series(path, "motion_work/shaker")
    return (work[-1] - work[-3]) / 2.0


def box_uneven(case):
    e, ratio, table, longer = UNEVEN
    mill = in_box(e, ratio)
    unit = float(mill.amplitude * mill.omega)
    mill.phase = mill.phase + 0.3
    log, path = run(case, mill, 0.1, -1.5 * unit, 50.0, **NO_GRAVITY)
    intervals = np.diff(log["time"][-21:]) * FREQUENCY
    what = "ball in a box shaken without gravity, e = 0.5, S/A = 2.4"
    case.claim(f"{what}, below the limit 2.59997: longer of two successive intervals between hits, in periods",
               intervals.max(), longer, 6e-7, against="unequal intervals; table of six digits")  # fmt: skip
    case.bound(f"{what}: difference between an interval and the next but one, largest, in periods",
               np.abs(intervals[2:] - intervals[:-2]).max(), SAME, against="two intervals repeat")  # fmt: skip
    case.claim(f"{what}: mean impact speed divided by A w", log["normal_speed"][-20:].mean() / unit, table, 6e-7,
               against="table of seven digits", headline=True)  # fmt: skip
    count = 60
    times, speeds = mill.impacts(0.1, -1.5 * unit, count)
    case.bound(f"{what}: times of the first {count} impacts, largest error", worst(log, times, speeds)[0],
               TIME_BOUND, against="roots in 40 digits", unit="s")  # fmt: skip
    case.bound(f"{what}: error of the energy balance, divided by the energy turned over",
               value(path, "run/energy_balance_error"), 1e-12, against="work = change of energy + losses")  # fmt: skip


def check(case):
    plate(case)
    plate_breaks(case)
    box(case)
    box_uneven(case)
