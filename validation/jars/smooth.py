"""Smooth balls in a planetary mill: what is conserved, where the power goes, and the pendulum that one ball is."""

import h5py
import numpy as np
from jars.common import NO_GRAVITY, RPM, log_of, mean, series, start, value
from scipy.optimize import curve_fit
from scipy.special import ellipk

SUN, R, RADIUS, A = 650 * RPM, 0.07, 0.02, 7.5e-3
SEEDS = range(1, 5)
SMOOTH = {"contact__friction": 0, "contact__tangential_restitution": 0}
SWING = np.radians(3)


def jacobi(case):
    """Elastic smooth balls: kinetic energy less W times the angular momentum about the sun's axis never changes."""
    path = case.run(
        "planetary.ini",
        **SMOOTH,
        contact__restitution=1,
        contact__rebound_floor="0 m/s",
        run__time="0.5 s",
        output__frames="1 ms",
        output__series="1 ms",
        output__impacts="statistics",
    )
    with h5py.File(path) as f:
        places = f["particles/trajectory/position/value"][:].astype(float)
        speeds = f["particles/trajectory/velocity/value"][:].astype(float)
    energy = series(path, "kinetic_energy") + series(path, "potential_energy")
    mass = 7800.0 * 4 / 3 * np.pi * A**3
    momentum = mass * (places[..., 0] * speeds[..., 1] - places[..., 1] * speeds[..., 0]).sum(axis=1)
    kept = energy - SUN * momentum
    what = f"elastic smooth balls in a planetary mill, {value(path, 'run/events/collisions/ball_jar')} hits of the jar"
    case.bound(
        f"{what}: largest change of E - W L, divided by the largest E",
        np.abs(kept - kept[0]).max() / energy.max(),
        3e-6,
        against="constant; frames are float32: 7 balls, position and velocity to 6e-8",
        headline=True,
    )
    case.bound(f"{what}: 10 % of the largest E, divided by the change of E in the same time",
               0.1 * energy.max() / np.ptp(energy), 1, against="E itself is not conserved")  # fmt: skip


def work(path):
    """Work of the two motions, disk and jar, in each row of the series of 0.1 s [J]."""
    return series(path, "motion_work/sun"), series(path, "motion_work/jar")


def idle(case):
    """With restitution below 1 and no friction: the balls settle about the outermost point, and the mill does nothing.

    As a heap they swing there undamped, and give and take back up to a tenth of a joule: so work is taken over
    fifteen seconds.
    """
    powers, spin = {}, 0.0
    for name, law in (("smooth", SMOOTH), ("rough", {})):
        powers[name] = []
        for seed in SEEDS:
            path = case.run("planetary.ini", **law, run__time="16 s", output__series="0.1 s",
                            output__impacts="statistics", run__seed=seed)  # fmt: skip
            sun, jar = work(path)
            powers[name].append(((sun + jar)[-1] - (sun + jar)[10]) / 15)
            spin = max(spin, np.abs(jar).max()) if name == "smooth" else spin
    smooth, error = mean(powers["smooth"])
    rough = np.mean(powers["rough"])
    what = f"planetary mill, smooth balls, e = 0.8, 1 s to 16 s, {len(SEEDS)} starts"
    case.claim(
        f"{what}: ratio of its power to that of rough balls, {rough:.3g} W",
        smooth / rough,
        0,
        1e-3,
        against="the balls settle, the mill does no work",
        error=error / rough,
        headline=True,
    )
    case.bound(
        f"{what}: largest work of the turn of the jar",
        spin,
        1e-9,
        against="a smooth round jar does no work when it turns",
        unit="J",
    )


def swinging(case, rolls):
    """Angle about the outermost point at each contact of a ball let go at 3 deg; its jar's speed relative to the
    disk is k."""
    angle = SWING
    x, y = R + (RADIUS - A) * np.cos(angle), (RADIUS - A) * np.sin(angle)
    velocity = np.array([-SUN * y, SUN * x])
    spin = 0.0
    whole = -SUN  # of the jar, k = -2
    if rolls:
        along = np.array([-np.sin(angle), np.cos(angle)])
        point = np.array([R + RADIUS * np.cos(angle), RADIUS * np.sin(angle)])
        centre = np.array([R, 0.0])
        arm = point - centre
        surface = np.array([0.0, SUN * R]) + whole * np.array([-arm[1], arm[0]])
        spin = (surface - velocity) @ along / A
    law = {"contact__friction": 0.3, "contact__tangential_restitution": 0} if rolls else SMOOTH
    path = case.run(
        "planetary.ini",
        **start(case, "swing.txt", [[x, y, 0.0, *velocity, 0.0, 0.0, 0.0, spin]]),
        **NO_GRAVITY,
        **law,
        contact__rebound_floor="0.2 mm/s",
        run__time="0.5 s",
    )
    log = log_of(path)
    turn = np.exp(-1j * SUN * log["time"])
    place = (log["position"][:, 0] + 1j * log["position"][:, 1]) * turn - R
    return log["time"], np.angle(place)


def pendulum(case):
    told = {}
    for rolls, factor in ((False, 1.0), (True, 5 / 7)):
        time, angle = swinging(case, rolls)
        omega = np.sqrt(factor * SUN**2 * R / (RADIUS - A))
        small = omega / (2 * np.pi)
        frequency = small * np.pi / (2 * ellipk(np.sin(SWING / 2) ** 2))

        def law(t, size, rate, late, fades):
            return size * np.exp(-fades * t) * np.cos(2 * np.pi * rate * t + late)

        found, spread = curve_fit(law, time, angle, p0=(SWING, frequency, 0.0, 0.0))
        name = "rolls" if rolls else "slides without friction"
        case.claim(
            f"one ball that {name} in a planetary jar: frequency of its swing about the outermost point",
            found[1],
            frequency,
            1e-4 * frequency,
            against="sqrt(W^2 R/l), 5/7 of the square if it rolls; amplitude 3 deg",
            error=np.sqrt(spread[1, 1]),
            unit="Hz",
            headline=rolls,
        )
        told[name] = (time, angle, frequency)
    return told


def check(case):
    jacobi(case)
    idle(case)
    return pendulum(case)
