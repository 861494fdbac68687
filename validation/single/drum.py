"""The round drum: multiple roots of its quartic, and flights at random against 50 digits."""

import math

import mpmath
import numpy as np
from single.common import TIME_BOUND, exact, of_ball, read, relative, start

A = 1 / 64  # [m] radius of the balls
SETTINGS = {"balls__diameter": "0.03125 m"}
# Corners of Pythagorean triangles: with these sines and cosines every number of the start is a double
TRIPLES = [
    (3, 4, 5),
    (4, 3, 5),
    (5, 12, 13),
    (12, 5, 13),
    (8, 15, 17),
    (15, 8, 17),
    (7, 24, 25),
    (24, 7, 25),
    (20, 21, 29),
]


def firsts(log, balls):
    """Row of each ball's first impact; a ball without one fails the case."""
    rows = np.full(balls, -1)
    for row in range(len(log["time"]) - 1, -1, -1):
        rows[log["ball"][row]] = row
    if np.any(rows < 0):
        raise RuntimeError(f"{np.sum(rows < 0)} balls had no impact at all")
    return rows


def along(count):
    """x of balls that stay out of each other's way, and the drum's length for them."""
    pitch = 0.0625
    return (np.arange(count) - 0.5 * (count - 1)) * pitch, {"drum__length": f"{pitch * count!r} m"}


def returns(case, tally):
    """A ball thrown up from the bottom."""
    u = np.geomspace(1e-3, 3.0, 60)
    x, length = along(len(u))
    rows = [(k, 0.0, -(1.0 - A), 0.0, 0.0, v) for k, v in zip(x, u, strict=True)]
    log = read(case.run(**start(case, "up.txt", rows), **SETTINGS, **length))
    first = firsts(log, len(u))
    g = exact(9.81)
    off = tally.add("thrown up from the bottom", log["time"][first], [2 * exact(v) / g for v in u])
    case.bound(
        "ball thrown up from the bottom of the drum, 1 mm/s .. 3 m/s: time of return, largest error",
        off,
        TIME_BOUND,
        against="2u/g (u: speed at the start)",
        unit="s",
    )


def detach_exactly(case, tally):
    """v^2 = g rho cos(theta): a triple root at t = 0, in numbers that are exact."""
    times, exact_times, speeds, exact_speeds = [], [], [], []
    for b, a, c in TRIPLES:  # sine b/c, cosine a/c
        shift = math.ceil(math.log2(c))
        rho, v = c * 2.0**-shift, a * c * 2.0**-3
        g = v * v / (rho * a / c)
        scale = 2.0 ** -round(0.5 * math.log2(g / 10.0))
        v, g = v * scale, g * scale**2
        row = (0.0, b * 2.0**-shift, a * 2.0**-shift, 0.0, -v * a / c, v * b / c)
        log = read(
            case.run(
                **start(case, "detach.txt", [row]),
                **SETTINGS,
                drum__radius=f"{rho + A!r} m",
                gravity__acceleration=f"0 0 {-g!r} m/s^2",
                run__time="2 s",
            )
        )
        sine = mpmath.mpf(b) / c
        times.append(log["time"][0])
        speeds.append(log["normal_speed"][0])
        exact_times.append(4 * exact(v) * sine / exact(g))
        exact_speeds.append(8 * exact(v) * sine**3 * a / c)
    off = tally.add("detached, triple root", times, exact_times)
    case.bound(
        f"ball that detaches at theta from the top, v^2 = g rho cos(theta), {len(TRIPLES)} angles without rounding: "
        "time of the first contact, largest error",
        off,
        TIME_BOUND,
        against="4 v sin(theta)/g; triple root at t = 0",
        unit="s",
    )
    case.bound(
        "same case: normal speed at this contact, largest relative error",
        relative(speeds, [float(v) for v in exact_speeds]),
        1e-13,
        against="8 v sin^3(theta) cos(theta)",
    )


def detach_anywhere(case, tally):
    """The same at whole degrees: the start is rounded, and the triple root splits."""
    angles = np.arange(10, 86)
    theta = np.radians(angles)
    x, length = along(len(theta))
    g, rho = 9.81, 1.0 - A
    v = np.sqrt(g * rho * np.cos(theta))
    y, z = rho * np.sin(theta), rho * np.cos(theta)
    rows = np.column_stack([x, y, z, 0 * x, -v * np.cos(theta), v * np.sin(theta)])
    floor = 1e-14  # [m/s] a start that is rounded to closing at 0 m/s would never get away
    log = read(
        case.run(
            **start(case, "degrees.txt", rows),
            **SETTINGS,
            **length,
            contact__rebound_floor=f"{floor!r} m/s",
            run__time="0.8 s",
        )
    )
    landing = 4 * v * np.sin(theta) / g
    late, early = [], 0
    for ball in range(len(theta)):
        times = of_ball(log, ball)["time"]
        early += np.sum(times < 1e-3)
        late.append(times[times > 1e-3][0])
    off = tally.add("detached, start rounded", late, [exact(t) for t in landing])
    case.bound(
        f"ball that detaches at 10, 11 .. 85 deg, start rounded to double precision ({early} contacts at the start): "
        "time of landing, largest error",
        off,
        TIME_BOUND,
        against="4 v sin(theta)/g; a contact at the start with rebound v_r changes it by 2 v_r/(v sin(theta) g t)",
        unit="s",
    )


def threshold(case, tally):
    """At the top with v^2 about g rho: a quadruple root that v splits bit by bit."""
    g, rho = 8.0, 0.5
    slow = [2.0 * (1.0 - 2.0**-k) for k in range(4, 54)]
    fast = [2.0, 2.0 * (1.0 + 2.0**-52), 2.0 * (1.0 + 2.0**-30), 2.001, 2.1]
    speeds = np.array(slow + fast)
    x, length = along(len(speeds))
    rows = [(k, 0.0, rho, 0.0, v, 0.0) for k, v in zip(x, speeds, strict=True)]
    log = read(
        case.run(
            **start(case, "top.txt", rows),
            **SETTINGS,
            **length,
            drum__radius=f"{rho + A!r} m",
            gravity__acceleration="0 0 -8 m/s^2",
            contact__rebound_floor="1 mm/s",
            run__time="0.25 s",
        )
    )
    times = log["time"][firsts(log, len(speeds))]
    falls = [2 * mpmath.sqrt(exact(g) * rho - exact(v) ** 2) / g for v in slow]
    off = tally.add("from the top, v^2 -> g rho", times[: len(slow)], falls)
    case.bound(
        "ball at the top with v = sqrt(g rho) (1 - 2^-k), k = 4 .. 53 (53: the last double below sqrt(g rho)): "
        "time of the first contact, largest error",
        off,
        TIME_BOUND,
        against="2 sqrt(g rho - v^2)/g; quadruple root in the limit of infinite k",
        unit="s",
    )
    case.bound(
        "same case: time of the first contact, largest relative error",
        relative(times[: len(slow)], [float(t) for t in falls]),
        1e-8,
        against="half a rounding of v^2, divided by g rho - v^2, is at most 2e-9 (k = 27)",
    )
    case.bound(
        "ball at the top with v^2 >= g rho, equality included: time of the first contact",
        np.max(np.abs(times[len(slow) :])),
        0,
        against="in contact with the wall from t = 0 on",
        unit="s",
    )


def loops(case):
    """Along the wall from the side upwards, in hops of the rebound floor."""
    g, rho, floor = 9.81, 1.0 - A, 1e-4
    excess = np.array([0.05, 0.1, 0.4, -0.05, -0.1, -0.2, -0.4, -0.8])  # v_top^2 = g rho (1 + excess)
    x, length = along(len(excess))
    v = np.sqrt(g * rho * (3.0 + excess))
    rows = [(k, rho, 0.0, 0.0, 0.0, u) for k, u in zip(x, v, strict=True)]
    log = read(
        case.run(
            **start(case, "loop.txt", rows),
            **SETTINGS,
            **length,
            contact__restitution=0.5,
            contact__rebound_floor=f"{floor!r} m/s",
            run__time="1.1 s",
        )
    )
    stays, falls = [], []
    for ball, more in enumerate(excess):
        mine = of_ball(log, ball)
        hops = np.diff(mine["time"])
        if more > 0:
            stays.append(abs(hops.max() / (2 * floor / (more * g)) - 1.0))
        else:
            falls.append(landing_off(mine["position"][np.argmax(hops) + 1], more, rho, g, floor))
    return stays, falls


def landing_off(place, excess, rho, g, floor):
    """Error of the angle at which a ball lands, over what its last hop can do to it."""
    cosine = 1.0 + excess / 3.0
    theta = np.arccos(cosine)
    speed = np.sqrt(g * rho * cosine)
    flight = 4 * speed * np.sin(theta) / g
    steep = 8 * np.sin(theta) ** 3 * cosine  # normal over full speed at landing
    # the last hop leaves with v_r, and at most sqrt(8 v_r/3k) early, which is another 4/3 v_r
    aside = (1.0 + 4.0 / 3.0) * floor * flight
    allowed = aside * (1.0 + 1.0 / steep) / rho + 1e-6
    angle = np.arctan2(-place[1], place[2])
    return abs(np.angle(np.exp(1j * (angle - 3 * theta)))) / allowed


def centrifuge(case):
    stays, falls = loops(case)
    case.bound(
        "ball that goes up the wall with v_top^2 = 1.05, 1.1, 1.4 g rho and stays on it: "
        "time of the longest hop, largest relative error",
        max(stays),
        1e-3,
        against="2 v_r / (v_top^2/rho - g), at the top",
    )
    case.bound(
        "ball that goes up the wall with v_top^2 = 0.95 .. 0.2 g rho and leaves it: "
        "largest ratio of the error of the landing angle to the effect of the hops",
        max(falls),
        1,
        against="leaves the wall at cos(theta) = 2/3 + v_top^2/(3 g rho), lands 3 theta beyond the top",
    )


def root(y, z, vy, vz, g, rho, rising):
    """First time > 0 at which |p(t)| passes rho, upwards or downwards; mpmath, 50 digits."""
    y, z, vy, vz, g, rho = (exact(q) for q in (y, z, vy, vz, g, rho))
    p = [
        g * g / 4,
        -vz * g,
        vy * vy + vz * vz - z * g,
        2 * (y * vy + z * vz),
        y * y + z * z - rho**2,
    ]
    guess = [mpmath.mpc(t) for t in np.roots([float(q) for q in p])]
    found = mpmath.polyroots(p, maxsteps=200, extraprec=200, roots_init=guess)
    good = []
    for t in (mpmath.re(t) for t in found if abs(mpmath.im(t)) < mpmath.mpf(10) ** -30):
        slope = mpmath.polyval([4 * p[0], 3 * p[1], 2 * p[2], p[3]], t)
        if t > 0 and (slope > 0) == rising:
            good.append(t)
    return min(good, default=mpmath.inf)


def at_random(case, tally):
    """Flights between drum and shaft from anywhere to anywhere."""
    count, g, shaft = 300, 9.81, 0.25
    rng = np.random.default_rng(1)
    r = rng.uniform(shaft + 2 * A, 1.0 - 2 * A, count)
    at, to = rng.uniform(0, 2 * np.pi, (2, count))
    speed = 10.0 ** rng.uniform(-2, 1, count)
    x, length = along(count)
    y, z, vy, vz = r * np.cos(at), r * np.sin(at), speed * np.cos(to), speed * np.sin(to)
    rows = start(case, "random.txt", np.column_stack([x, y, z, 0 * x, vy, vz]))
    deck = case.write(
        "shaft.ini",
        (case.folder / "deck.ini").read_text() + f"\n[rotor]\nspeed = 0 rad/s\nshaft_radius = {shaft!r} m\n",
    )
    log = read(case.run(deck, **rows, **SETTINGS, **length))
    first = firsts(log, count)
    to_drum = [root(*ball, g, 1.0 - A, True) for ball in zip(y, z, vy, vz, strict=True)]
    to_shaft = [root(*ball, g, shaft + A, False) for ball in zip(y, z, vy, vz, strict=True)]
    onto = np.array([d < s for d, s in zip(to_drum, to_shaft, strict=True)])
    wrong = np.sum((log["kind"][first] == "ball_drum") != onto)
    times = log["time"][first]
    off = tally.add("flights onto drum", times[onto], np.array(to_drum)[onto])
    off = max(off, tally.add("flights onto shaft", times[~onto], np.array(to_shaft)[~onto]))
    case.bound(
        f"{count} flights between drum and shaft: balls whose first contact is with the wrong one of the two",
        wrong,
        0,
        against=f"roots of both quartics; {np.sum(onto)} meet the drum",
    )
    case.bound(
        "same case: time of the first contact, largest error",
        off,
        TIME_BOUND,
        against="roots of the quartic to 50 digits",
        unit="s",
    )


def check(case, tally):
    returns(case, tally)
    detach_exactly(case, tally)
    detach_anywhere(case, tally)
    threshold(case, tally)
    centrifuge(case)
    at_random(case, tally)
