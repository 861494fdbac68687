"""Power and hard impacts of a planetary mill over the speed ratio of jar and disk."""

import numpy as np
from jars.common import RPM, mean, series, value

SUN, R, RADIUS = 650 * RPM, 0.07, 0.02
RATIOS = (-1, -1.5, -2, -2.25, -2.5, -2.75, -3, -3.25, -3.5, -3.75, -4, -4.5)
SEEDS = range(1, 7)
CHARGES = {"7 balls of 15 mm": (7, 0.015), "20 balls of 10 mm": (20, 0.010)}
TIME, FROM = 2.0, 0.5


def run(case, k, count, diameter, seed):
    """Power [W], and impacts above 1 m/s [1/s]."""
    path = case.run(
        "planetary.ini",
        output="ratio.h5",
        motion__jar__speed=f"{float(k) * SUN!r} rad/s",
        balls__count=count,
        balls__diameter=f"{diameter!r} m",
        run__time=f"{TIME} s",
        run__sample_from=f"{FROM} s",
        run__seed=seed,
        output__impacts="statistics",
    )
    hard = sum(series(path, f"fast_collisions/{kind}")[:, 1] for kind in ("ball_ball", "ball_jar"))
    return value(path, "statistics/drive/power"), np.subtract(*hard[[-1, round(FROM / 1e-3)]]) / (TIME - FROM)


def peak(ratios, values):
    """Where the parabola through the largest of the values and two neighbours on each side has its top, of each
    start."""
    middle = int(np.clip(np.argmax(values.mean(axis=0)), 2, len(ratios) - 3))
    near = slice(middle - 2, middle + 3)
    tops = []
    for row in values:
        a, b, _ = np.polyfit(ratios[near], row[near], 2)
        tops.append(-b / (2 * a))
    return mean(tops)


def check(case):
    told = {}
    early = (
        "in the theory the wall holds the ball, these balls bounce and leave it earlier; "
        "with e = 0.5 the power is largest near -3.0"
    )
    for name, (count, diameter) in CHARGES.items():
        ratios = np.array(RATIOS, float)
        both = np.array([[run(case, k, count, diameter, seed) for k in ratios] for seed in SEEDS])
        critical = -(1 + np.sqrt(R / (RADIUS - diameter / 2)))
        what = f"planetary mill, {name}, {len(SEEDS)} starts at each of {len(ratios)} ratios"
        for column, quantity in enumerate(("power of the drive", "rate of impacts above 1 m/s")):
            top, error = peak(ratios, both[..., column])
            case.claim(
                f"{what}: ratio k at which the {quantity} is largest",
                top,
                critical,
                0.1 * abs(critical),
                error=error,
                against="-(1 + sqrt(R/(r - a))); 10 %",
                headline=count == 20 and column == 0,
                known=early if count == 7 and column == 0 else "",
            )
        told[name] = (ratios, both, critical)
    power = told["20 balls of 10 mm"][1][..., 0].mean(axis=0)
    case.bound(
        "planetary mill, 20 balls of 10 mm: power at k = -4.5 divided by the largest power",
        power[-1] / power.max(),
        0.1,
        against="the wall holds the balls all the way round",
    )
    return told
