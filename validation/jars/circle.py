"""A ball in a jar that is carried on a circle without turning, as in an Emax: impacts, work at each of them, the
rolling pendulum's rest."""

import mpmath
import numpy as np
from jars.common import TIME_BOUND, log_of, series, start
from jars.reference import Ball, Circle, Cylinder

AMPLITUDE, FREQUENCY, RADIUS, LENGTH, A = 0.017, 100 / 3, 0.025, 0.064, 0.005
OMEGA = 2 * np.pi * FREQUENCY
MASS = 7800.0 * 4 / 3 * np.pi * A**3
STARTS, COUNT = 6, 12
LAW = (0.8, 0.3, 0.484, 0.1)


def run(case, state, law, time, **settings):
    e, mu, beta, floor = law
    return case.run(
        "circle.ini",
        **start(case, "circle.txt", [state]),
        motion__path__frequency=f"{FREQUENCY!r} Hz",
        motion__path__amplitude=f"{AMPLITUDE} {AMPLITUDE} 0 m",
        body__jar__radius=f"{RADIUS} m",
        body__jar__length=f"{LENGTH} m",
        balls__diameter=f"{2 * A} m",
        contact__restitution=e,
        contact__friction=mu,
        contact__tangential_restitution=beta,
        contact__rebound_floor=f"{floor!r} m/s",
        run__time=f"{time!r} s",
        **settings,
    )


def first_impacts(case):
    """Times, speeds and the work of the shift over the first impacts, against 40 digits."""
    rng = np.random.default_rng(9)
    time_off, speed_off, work_off = 0.0, 0.0, 0.0
    for _ in range(STARTS):
        place = (
            AMPLITUDE + rng.uniform(-0.01, 0.01),
            rng.uniform(-0.01, 0.01),
            rng.uniform(-0.02, 0.02),
        )
        state = (*place, *rng.uniform(-2, 2, 3), *rng.uniform(-50, 50, 3))
        ball = Ball(Circle(AMPLITUDE, FREQUENCY), Cylinder(0, RADIUS, LENGTH), A, LAW, state)
        times, speeds, slips = ball.impacts(COUNT)
        end = float(times[-1] + ball.next_time(1e9)) / 2
        path = run(case, state, LAW, end, output__series=f"{end!r} s")
        log = log_of(path)
        if len(log["time"]) != COUNT:
            time_off = np.inf
            continue
        exact = zip(times, log["time"])
        time_off = max(time_off, *(abs(float(t - mpmath.mpf(float(m)))) for t, m in exact))
        for mine, name in ((speeds, "normal_speed"), (slips, "tangential_speed")):
            off = [abs(float(s - mpmath.mpf(float(m)))) for s, m in zip(mine, log[name])]
            speed_off = max(speed_off, *off)
        work_off = max(work_off, abs(series(path, "motion_work/path")[-1] / (float(ball.work) * MASS) - 1))
    what = f"jar on a circle, one spinning ball, {STARTS} starts, first {COUNT} impacts"
    case.bound(
        f"{what}: times, largest error (inf: another number)",
        time_off,
        TIME_BOUND,
        against="roots in 40 digits",
        unit="s",
        headline=True,
    )
    case.bound(
        f"{what}: normal speeds and slips, largest error",
        speed_off,
        1e-10,
        against="Walton's law",
        unit="m/s",
    )
    case.bound(f"{what}: work of the shift, largest relative error", work_off, 1e-10,
               against="sum of J . v_wall in 40 digits")  # fmt: skip


def each_hit(case):
    """Smooth and elastic: the energy changes by J . v_wall, J = 2 m g_n, at each hit of the log, and by nothing
    else."""
    state = (AMPLITUDE, 0.005, 0.001, 0.7, 1.1, 0.3)
    step = 1e-5
    path = run(case, state, (1, 0, 0, 0), 0.3, output__series=f"{step!r} s")
    log = log_of(path)
    energy = series(path, "kinetic_energy")
    angle = OMEGA * log["time"]
    wall = AMPLITUDE * OMEGA * np.array([-np.sin(angle), np.cos(angle), 0 * angle]).T
    gains = 2 * MASS * log["normal_speed"] * (log["normal"] * wall).sum(axis=1)
    row = np.ceil(log["time"] / step).astype(int)
    expected = energy[0] + np.bincount(row, gains, len(energy))[: len(energy)].cumsum()
    what = "jar on a circle, smooth elastic ball"
    case.bound(f"{what}: energy after each of {len(gains)} hits, largest error divided by the largest gain in one hit",
               np.abs(energy - expected).max() / np.abs(gains).max(), 1e-7 * len(gains),
               against="dE = J . v_wall; normals of the log are float32")  # fmt: skip


def rest(case):
    """A ball that rolls at the outermost point all the way round, held there: the drive need not do anything."""
    reach = RADIUS - A
    state = (AMPLITUDE + reach, 0, 0, 0, OMEGA * (AMPLITUDE + reach), 0, 0, 0, -OMEGA * reach / A)
    floor = 1e-3
    path = run(case, state, (0.8, 0.3, 0.484, floor), 0.3, output__series="0.3 s")
    log = log_of(path)
    hop = 2 * floor / (OMEGA**2 * (AMPLITUDE + reach))
    hops = np.diff(log["time"])
    what = "ball that rolls at the outermost point of a jar on a circle"
    case.claim(f"{what}: mean time of a hop with the speed of the rebound floor", hops.mean(), hop, 1e-3 * hop,
               against="2 v_r/(w^2 (A + l))", unit="s")  # fmt: skip
    turned = np.angle((log["position"][:, 0] + 1j * log["position"][:, 1]) * np.exp(-1j * OMEGA * log["time"]))
    case.bound(f"{what}: largest deviation from this point in {log['time'][-1] * FREQUENCY:.1f} turns",
               np.degrees(np.abs(turned).max()), 0.1, against="stable equilibrium", unit="deg")  # fmt: skip
    turnover = 0.5 * MASS * (OMEGA * (AMPLITUDE + reach)) ** 2
    case.bound(f"{what}: work of the drive divided by the energy of the ball",
               series(path, "motion_work/path")[-1] / turnover, 1e-3, against="the drive does no work")  # fmt: skip


def check(case):
    first_impacts(case)
    each_hit(case)
    rest(case)
