"""Without gravity a planetary mill knows no speed of its own: power goes as the cube of it."""

import numpy as np
from jars.common import (
    NO_GRAVITY,
    RPM,
    as_started,
    claim_same,
    log_of,
    mean,
    nudged,
    series,
    start,
    value,
)

SUN, FLOOR = 650 * RPM, 0.0625
DENSITY = 7800  # [kg/m^3]
TIME = 0.2
SHORT = 0.015  # [s] rounding has not grown by then
SEEDS = range(1, 9)


def run(case, factor, time=TIME, seed=1, **settings):
    """The mill at `factor` times its speed, for as many turns."""
    return case.run(
        "planetary.ini",
        **NO_GRAVITY,
        motion__sun__speed=f"{SUN * factor!r} rad/s",
        motion__jar__speed=f"{-2 * SUN * factor!r} rad/s",
        contact__rebound_floor=f"{FLOOR * factor!r} m/s",
        # so that a contact, within which hits are a burst, lasts for the same part of a turn
        balls__density=f"{DENSITY * factor**-2.5!r} kg/m^3",
        run__time=f"{time / factor!r} s",
        output__series=f"{0.01 * time / factor!r} s",
        run__seed=seed,
        **settings,
    )


def work(path):
    return series(path, "motion_work/sun")[-1] + series(path, "motion_work/jar")[-1]


def same_impacts(case):
    """At 2, 3 and 4 times the speed: the same impacts as long as rounding lets them, and in that time the same work."""
    rows = as_started(case, "planetary.ini", **NO_GRAVITY)
    twin = log_of(run(case, 1.0, **start(case, "twin.txt", nudged(rows))))
    base = log_of(run(case, 1.0, **start(case, "base.txt", rows)))
    done = work(run(case, 1.0, SHORT, **start(case, "base.txt", rows)))
    curves = {}
    for factor in (2.0, 3.0, 4.0):
        fast = rows * np.array([1.0] * 3 + [factor] * (rows.shape[1] - 3))
        begin = start(case, "fast.txt", fast)
        what = f"planetary mill without gravity at {factor:g} times the speed"
        curves[factor], curves[1.0] = claim_same(case, what, base, log_of(run(case, factor, **begin)), twin, factor)
        power = work(run(case, factor, SHORT, **begin)) * factor * factor**2.5 / done
        case.claim(
            f"{what}, while the impacts are equal: exponent of the power",
            np.log(power) / np.log(factor),
            3,
            1e-9,
            against="P ~ W^3, rebound floor ~ W",
            headline=factor == 4,
        )
    return curves


def exponents(case):
    """At 3 times the speed roundings differ, and paths part: the law must hold on average."""
    slow = [value(run(case, 1.0, 4.0, seed, run__sample_from="0.5 s"), "statistics/drive/power") for seed in SEEDS]
    fast = [value(run(case, 3.0, 4.0, 100 + seed, run__sample_from=f"{0.5 / 3} s"), "statistics/drive/power")
            for seed in SEEDS]  # fmt: skip
    (a, error_a), (b, error_b) = mean(slow), mean(fast)
    b, error_b = b * 3**2.5, error_b * 3**2.5  # of balls of the same density
    error = np.hypot(error_a / a, error_b / b) / np.log(3)
    what = f"planetary mill without gravity at 1 and 3 times the speed, {len(SEEDS)} different starts each"
    case.claim(f"{what}: exponent of the mean power", np.log(b / a) / np.log(3), 3, 0.03,
               against="P ~ W^3; 1 %", error=error)  # fmt: skip


def check(case):
    curves = same_impacts(case)
    exponents(case)
    return curves
