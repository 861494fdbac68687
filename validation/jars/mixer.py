"""One ball in the capsule of a mixer mill that swings on an arc: impact by impact against an integration in 40
digits."""

import mpmath
import numpy as np
from jars.common import TIME_BOUND, log_of, series, start
from jars.reference import Ball, Capsule, Swing

A = 7.5e-3
MASS = 7800.0 * 4 / 3 * np.pi * A**3
GRAVITY = (0.0, 0.0, -9.81)
LAW = (0.8, 0.3, 0.484, 0.05)  # e, mu, beta0, rebound floor
STARTS, COUNT, FIRST = (
    6,
    40,
    10,
)  # starts, impacts of each, those that rounding has not yet grown in
NUDGE = 1e-15  # [m] a gap that the program takes for closed; of velocities, relative


def states():
    """Places, velocities, spins [m, m/s, rad/s] of balls in flight near the jar's middle."""
    rng = np.random.default_rng(8)
    for _ in range(STARTS):
        place = rng.uniform((0.1185, -0.03, -0.0015), (0.1215, 0.03, 0.0015))
        yield (*place, *rng.uniform(-2, 2, 3), *rng.uniform(-50, 50, 3))


def reference(state, law):
    motion = Swing(np.pi / 30, 30.0)
    shape = Capsule(0.12, 0.01, 0.0662)
    return Ball(motion, shape, A, law, state, GRAVITY)


def run(case, state, law, time):
    e, mu, beta, floor = law
    return case.run(
        "mixer.ini",
        **start(case, "mixer.txt", [state]),
        run__time=f"{time!r} s",
        balls__diameter=f"{2 * A!r} m",
        motion__arm__amplitude=f"{np.pi / 30!r} rad",
        body__jar__centre="0.12 0 0 m",
        body__jar__radius="0.01 m",
        body__jar__length="0.0662 m",
        gravity__acceleration=" ".join(map(repr, GRAVITY)) + " m/s^2",
        contact__restitution=e,
        contact__friction=mu,
        contact__tangential_restitution=beta,
        contact__rebound_floor=f"{floor!r} m/s",
        output__series=f"{time!r} s",
    )


def nudged(state):
    """Beside a state by what the program may be off at a contact."""
    return [x + NUDGE if k < 3 else x * (1 + NUDGE) for k, x in enumerate(state)]


def work_off(case, state):
    """Relative error of the arm's work over the first impacts."""
    ball = reference(state, LAW)
    times = ball.impacts(FIRST)[0]
    end = float(times[-1] + ball.next_time(1e9)) / 2
    done = series(run(case, state, LAW, end), "motion_work/arm")[-1]
    return abs(done / (float(ball.work) * MASS) - 1)


def errors(times, log):
    count = min(len(times), len(log["time"]))
    return np.array([abs(float(t - mpmath.mpf(float(m)))) for t, m in zip(times[:count], log["time"])])


def follow(case, state):
    """One start: the log beside the reference and a twin of that; the file, and the last time."""
    ball = reference(state, LAW)
    times, speeds, slips = ball.impacts(COUNT)
    end = float(times[-1] + ball.next_time(1e9)) / 2
    log = log_of(run(case, state, LAW, end))
    twin = reference(nudged(state), LAW).impacts(COUNT)[0]
    apart = np.array([abs(float(t - o)) for t, o in zip(times, twin)])
    speed = [abs(float(s - mpmath.mpf(float(m)))) for s, m in zip(speeds, log["normal_speed"])]
    slip = [abs(float(s - mpmath.mpf(float(m)))) for s, m in zip(slips, log["tangential_speed"])]
    return {
        "times": np.array(times, float),
        "off": errors(times, log),
        "twin": apart,
        "speed": np.maximum(speed, slip),
        "missed": abs(len(log["time"]) - COUNT),
        "work": work_off(case, state),
    }


def check(case):
    """States the claims; what the figure needs."""
    runs = [follow(case, state) for state in states()]
    what = f"capsule of a mixer mill, one spinning ball, {STARTS} starts"
    case.bound(
        f"{what}: difference of the numbers of impacts, program and reference",
        sum(r["missed"] for r in runs),
        0,
        against=f"{STARTS * COUNT} impacts, roots in 40 digits",
    )
    case.bound(
        f"{what}: times of the first {FIRST} impacts of each, largest error",
        max(r["off"][:FIRST].max() for r in runs),
        TIME_BOUND,
        against="roots in 40 digits",
        unit="s",
        headline=True,
    )
    case.bound(
        f"{what}: normal speeds and slips of these impacts, largest error",
        max(r["speed"][:FIRST].max() for r in runs),
        1e-10,
        against="Walton's law at the exact positions",
        unit="m/s",
    )
    # an error is a rounding that has grown since; the twin's has grown since the start
    grown = [r["off"] / np.maximum.accumulate(np.maximum(r["twin"], 1e-17)) for r in runs]
    case.bound(
        f"{what}: {COUNT} impacts, largest ratio of the time error to that of a reference that starts 1e-15 m away",
        max(g.max() for g in grown),
        10,
        against="the program treats a gap of 1e-15 m as closed",
    )
    case.bound(f"{what}: work of the arm during the first {FIRST} impacts, largest relative error",
               max(r["work"] for r in runs), 1e-10, against="sum of J . v_wall in 40 digits")  # fmt: skip
    return runs
