"""The bouncing ball, on every kind of surface."""

import mpmath
import numpy as np
from single.common import TIME_BOUND, exact, of_ball, read, relative, start, with_blades

G = 9.81
HEIGHT = 0.25  # [m]
# [m] positions of 1..2 m are rounded to 2e-16 m, a blade's contact to 1e-15 m; 1/(1 - e^2) = 10 adds up
HEIGHT_BOUND = 1e-14
LEAST = 0.05  # [m/s] slower bounces are not followed; the statistics' own threshold
A = 0.03125  # [m]
BLADES = [
    {"position": 1.0, "angle": 0.0, "tip_radius": 0.5, "width": 0.25, "thickness": 0.125},
    {"position": -1.0, "angle": 0.0, "tip_radius": 0.5, "width": 0.25, "thickness": 0.125},
]
# gravity, then where each ball starts HEIGHT above what it falls on
SCENES = {
    "0 -9.81 0 m/s^2": {
        "drum": (0.0, -(1.0 - A) + HEIGHT, 0.0),
        "shaft": (0.0, 0.25 + A + HEIGHT, 0.0),
        "blade tip": (1.0, 0.5 + A + HEIGHT, 0.0),
    },
    "-9.81 0 0 m/s^2": {
        "end wall": (-2.0 + A + HEIGHT, 0.0, 0.5),
        "blade side": (-1.0 + 0.125 + A + HEIGHT, 0.375, 0.0),
    },
}


def fall():
    g, h = exact(G), exact(HEIGHT)
    return mpmath.sqrt(2 * h / g), mpmath.sqrt(2 * h * g)


def impacts_until(e, least):
    """Times and speeds of all impacts that are faster than `least`."""
    t0, v0 = fall()
    e = exact(e)
    count = 1
    while e**count * v0 > least:
        count += 1
    times = [t0 * (1 + 2 * sum(e**k for k in range(1, n + 1))) for n in range(count)]
    return times, [e**n * v0 for n in range(count)]


def run(case, deck, gravity, places, **settings):
    rows = list(places.values())
    rows = start(case, "bounce.txt", rows)
    return read(case.run(deck, gravity__acceleration=gravity, **rows, **settings))


def heights_off(measured, speeds):
    """Speeds as the heights v^2/2g that they are fallen from: largest error [m]."""
    pairs = zip(measured, speeds, strict=False)
    return max(float(abs(exact(m) ** 2 - v**2) / (2 * exact(G))) for m, v in pairs)


def follow(case, tally, deck, e):
    """Largest errors over the five surfaces: of times, relative; of v^2/2g, as a height."""
    times, speeds = impacts_until(e, LEAST)
    end = float(times[-1] + speeds[-1] * exact(e) / exact(G))  # half a hop further
    off_time, off_height, wrong_count = 0.0, 0.0, 0
    for gravity, places in SCENES.items():
        log = run(case, deck, gravity, places, contact__restitution=e, run__time=f"{end!r} s")
        for ball, name in enumerate(places):
            mine = of_ball(log, ball)
            wrong_count += len(mine["time"]) != len(times)
            count = min(len(mine["time"]), len(times))
            tally.add(f"bounces on {name}", mine["time"][:count], times[:count])
            off_time = max(off_time, relative(mine["time"][:count], times[:count]))
            off_height = max(off_height, heights_off(mine["normal_speed"][:count], speeds))
    return len(times), off_time, off_height, wrong_count


def settle(case, deck):
    """With a floor: when it first acts, and the even hops from there on."""
    e, floor = 0.8, 1e-3
    log = run(
        case,
        deck,
        *next(iter(SCENES.items())),
        contact__restitution=e,
        contact__rebound_floor=f"{floor!r} m/s",
        run__time="2.1 s",
    )
    times, _ = impacts_until(e, floor)
    last = len(times) - 1  # the impact from which e v would fall below the floor
    mine = of_ball(log, 0)
    t0, _ = fall()
    whole = t0 * (1 + exact(e)) / (1 - exact(e))
    case.claim(
        f"bouncing ball, e = {e}, v_r = 1 mm/s: time of the first impact at the floor",
        mine["time"][last],
        times[-1],
        TIME_BOUND,
        against="t0 (1 + 2 sum e^k), t0 = sqrt(2h/g)",
        unit="s",
    )
    hop = 2 * floor / G
    case.claim(
        "same case: the same time, compared with the time that all bounces take without a floor",
        mine["time"][last],
        whole,
        hop / (1 - e),
        against="t0 (1+e)/(1-e); band: remainder of the geometric series, below 2 v_r/(g (1-e))",
        unit="s",
    )
    hops = np.diff(mine["time"][last : last + 100])
    case.claim(
        "same case: mean time of flight of the next 99 hops",
        hops.mean(),
        hop,
        1e-6 * hop,
        against="2 v_r/g: a ball thrown up at u returns after 2u/g",
        error=None,
        unit="s",
    )


def check(case, tally):
    deck = with_blades(case, "bounce.ini", 0.0, BLADES)
    deck.write_text(deck.read_text().replace("shaft_radius = 0 m", "shaft_radius = 0.25 m"))
    worst_time, worst_height, wrong, impacts = 0.0, 0.0, 0, 0
    for e in (0.95, 0.9, 0.8, 0.5, 0.1):
        count, off_time, off_height, missing = follow(case, tally, deck, e)
        worst_time, worst_height = max(worst_time, off_time), max(worst_height, off_height)
        wrong += missing
        impacts += 5 * count
    what = "bouncing ball on drum, shaft, end wall, tip and side of a blade, e = 0.1 .. 0.95"
    case.bound(
        f"{what}: balls with a wrong number of impacts",
        wrong,
        0,
        against=f"geometric series: {impacts} impacts down to 50 mm/s",
    )
    case.bound(
        f"{what}: impact times, largest relative error",
        worst_time,
        1e-12,
        against="t_n = t0 (1 + 2e + .. + 2e^n)",
    )
    case.bound(
        f"{what}: impact speeds, expressed as heights v^2/2g, largest error",
        worst_height,
        HEIGHT_BOUND,
        against="e^n v0",
        unit="m",
    )
    settle(case, deck)
