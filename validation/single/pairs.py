"""Two balls in flight: a quadratic, central and grazing."""

import mpmath
import numpy as np
from single.common import TIME_BOUND, exact, read, start

A = 1 / 64  # [m]
COUNT = 200
PITCH = 0.25  # [m] of the axis for each pair


def meeting(first, second):
    """When two of one radius meet: gravity drops out."""
    d = [exact(q) - exact(p) for p, q in zip(first[:3], second[:3], strict=True)]
    u = [exact(q) - exact(p) for p, q in zip(first[3:], second[3:], strict=True)]
    a = sum(q * q for q in u)
    b = sum(p * q for p, q in zip(d, u, strict=True))
    c = sum(p * p for p in d) - 4 * exact(A) ** 2
    root = mpmath.sqrt(b * b - a * c)
    return c / (root - b), root / (2 * exact(A))


def pair(rng, x, share):
    """A pair that meets with this impact parameter, over the diameter."""
    along, aside = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    speed = rng.uniform(1.0, 5.0)
    distance = 2 * A * rng.uniform(1.5, 3.0)
    middle = np.array([x, rng.uniform(-0.3, 0.3), rng.uniform(0.0, 0.3)])
    apart = along * distance + aside * 2 * A * share
    drift = np.array([0.0, *rng.normal(size=2)])
    return (
        np.concatenate([middle - apart / 2, drift + along * speed / 2]),
        np.concatenate([middle + apart / 2, drift - along * speed / 2]),
    )


def check(case, tally):
    rng = np.random.default_rng(5)
    shares = 1.0 - np.geomspace(1.0, 1e-3, COUNT)  # impact parameter over diameter: 0 .. 0.999
    x = (np.arange(COUNT) - 0.5 * (COUNT - 1)) * PITCH
    pairs = [pair(rng, *both) for both in zip(x, shares, strict=True)]
    log = read(
        case.run(
            **start(case, "meet.txt", [row for both in pairs for row in both]),
            balls__diameter=f"{2 * A!r} m",
            drum__length=f"{PITCH * COUNT!r} m",
            run__time="0.1 s",
        )
    )
    met = log["kind"] == "ball_ball"
    ball, time, speed = (log[name][met] for name in ("ball", "time", "normal_speed"))
    first = [np.flatnonzero(ball == 2 * k)[0] for k in range(COUNT)]
    expected = [meeting(*both) for both in pairs]
    off = tally.add("ball on ball", time[first], [t for t, _ in expected])
    off_speed = max(abs(float(s - v)) for s, (_, v) in zip(speed[first], expected, strict=True))
    what = f"{COUNT} pairs in flight, impact parameter 0 .. 0.999 diameters"
    case.bound(
        f"{what}: time of contact, largest error",
        off,
        TIME_BOUND,
        against="root of |d + u t| = 2a to 50 digits",
        unit="s",
    )
    case.bound(
        f"{what}: normal speed, largest error",
        off_speed,
        # |x| <= 25 m is rounded to 2e-15 m for each ball: 1e-13 of 2a, at 5 m/s; some roundings of it
        5e-12,
        against="sqrt((d.u)^2 - u^2 (d^2 - 4a^2)) / 2a",
        unit="m/s",
    )
