"""Oblique impacts of spinning balls against Walton's law: on a flat wall, and on another ball."""

import dataclasses

import h5py
import numpy as np
from single.common import of_ball, read, relative, series, start

SMALL, BIG = 1 / 64, 1 / 32  # [m] radii
DENSITY = 7800.0
FLOAT32 = 2.0**-24  # relative rounding of a stored frame
TIGHT = 1e-13  # some hundred roundings of a double
ANGLES = np.radians(np.arange(90))


@dataclasses.dataclass
class Law:
    e: float
    mu: float
    beta: float

    @property
    def settings(self):
        return {
            "contact__restitution": self.e,
            "contact__friction": self.mu,
            "contact__tangential_restitution": self.beta,
        }

    def slip_after(self, closing, slip):
        """Foerster et al. 1994: sticking, or sliding with the same sign as before."""
        return np.maximum(-self.beta * slip, slip - 3.5 * self.mu * (1 + self.e) * closing)

    def sticks(self, closing, slip):
        return (1 + self.beta) * slip <= 3.5 * self.mu * (1 + self.e) * closing


# Like glass; stops the slip; perfectly rough; keeps half of the slip; smooth
LAWS = [
    Law(0.97, 0.092, 0.44),
    Law(0.8, 0.3, 0.0),
    Law(1.0, 0.2, 1.0),
    Law(0.5, 0.6, -0.5),
    Law(0.9, 0.0, 0.0),
]


def mass(radius):
    return DENSITY * 4 / 3 * np.pi * radius**3


def blow(law, n, slip, reduced):
    """Impulse on body 1 (n points from it to body 2), closing speed, slip before and after, loss."""
    closing = slip @ n
    aside = slip - np.outer(closing, n)
    s = np.linalg.norm(aside, axis=1)
    after = law.slip_after(closing, s)
    direction = aside / np.where(s > 0, s, 1.0)[:, None]
    impulse = -reduced * (1 + law.e) * np.outer(closing, n)
    impulse -= 2 / 7 * reduced * (s - after)[:, None] * direction
    loss = 0.5 * reduced * ((1 - law.e**2) * closing**2 + 2 / 7 * (s**2 - after**2))
    return impulse, closing, s, after, loss


def kicked(v, w, impulse, outwards, radius):
    """A ball after an impulse at the end of its radius in direction `outwards`."""
    inertia = 0.4 * mass(radius) * radius**2
    turn = radius / inertia * np.cross(outwards, impulse)
    return v + impulse / mass(radius), w + turn


def spins(rng, radius, tangential):
    """None; about any axis; so that the slip is halved; about any axis and fast."""
    count = len(tangential)
    w = rng.normal(size=(count, 3)) / radius
    w[0::4] = 0.0
    halved = 0.5 * np.cross(tangential, [1.0, 0.0, 0.0]) / radius
    w[2::4] = halved[2::4]
    w[3::4] *= 3.0
    return w


def frame(path, row):
    with h5py.File(path) as f:
        balls = f["particles/trajectory"]
        return [balls[f"{name}/value"][row].astype(float) for name in ("velocity", "angular_velocity")]


def on_wall(case, law, rng):
    """Balls that touch a floor at t = 0 with unit closing speed, and come back to it by gravity."""
    psi = np.repeat(ANGLES, 4)
    count, g = len(psi), 1e5
    way = rng.uniform(0, 2 * np.pi, count)
    v = np.column_stack([-np.ones(count), np.tan(psi) * np.cos(way), np.tan(psi) * np.sin(way)])
    w = spins(rng, SMALL, v * [0, 1, 1])
    grid = np.arange(count)
    y, z = (grid % 20 - 9.5) * 0.078125, (grid // 20 - 8.5) * 0.078125
    rows = np.column_stack([np.full(count, -2.0 + SMALL), y, z, v, w])
    interval = law.e / g  # half of the flight
    path = case.run(
        **start(case, "wall.txt", rows),
        **law.settings,
        balls__diameter=f"{2 * SMALL!r} m",
        drum__radius="2 m",
        gravity__acceleration=f"{-g!r} 0 0 m/s^2",
        run__time=f"{2.5 * interval!r} s",
        output__frames=f"{interval!r} s",
        output__series=f"{interval!r} s",
    )
    log = read(path)
    contacts = [of_ball(log, ball) for ball in range(count)]
    if any(len(c["time"]) != 2 for c in contacts):
        raise RuntimeError("a ball on the wall had more or fewer than two contacts")
    one, two = ({k: np.array([c[k][i] for c in contacts]) for k in log} for i in (0, 1))

    m, n = mass(SMALL), np.array([-1.0, 0.0, 0.0])
    impulse, closing, s, after, loss = blow(law, n, v + SMALL * np.cross(w, n), m)
    v_after, w_after = kicked(v, w, impulse, n, SMALL)
    size = closing + s + np.linalg.norm(SMALL * w, axis=1)
    seen_v, seen_w = frame(path, 1)
    kinetic, rotational = series(path, "kinetic_energy", "rotational_energy")
    flat = v_after * [0, 1, 1]  # at the top of its flight the ball has no normal velocity
    seen_slip = seen_v + SMALL * np.cross(seen_w, n)
    sign = np.sign(np.sum((v + SMALL * np.cross(w, n) - np.outer(closing, n)) * seen_slip, axis=1))
    return {
        "normal": relative(two["normal_speed"], law.e * closing),
        "flight": relative(two["time"], 2 * law.e * closing / g),
        "slip_before": np.max(np.abs(one["tangential_speed"] - s) / size),
        "slip": np.max(np.abs(two["tangential_speed"] - np.abs(after)) / size),
        "loss": np.max(np.abs(one["dissipation"] - loss) / (0.5 * m * size**2)),
        "velocity": np.max(np.abs(seen_v - flat)[:, 1:] / size[:, None]),
        "spin": np.max(SMALL * np.abs(seen_w - w_after) / size[:, None]),
        "kinetic": kinetic[1] / (0.5 * m * np.sum(flat**2)) - 1,
        "rotational": rotational[1] / (0.5 * 0.4 * m * SMALL**2 * np.sum(w_after**2)) - 1,
        "sticking": int(np.sum(law.sticks(closing, s))),
        "count": count,
        "curve": (s / closing, sign * two["tangential_speed"] / closing),
    }


def mixture(case):
    """deck.ini with two kinds of balls."""
    own = ("count", "diameter", "density")
    lines = (case.folder / "deck.ini").read_text().splitlines()
    text = "\n".join(line for line in lines if not line.startswith(own))
    for name, radius in (("small", SMALL), ("big", BIG)):
        text += f"\n[balls.{name}]\ncount = {len(ANGLES)}\ndiameter = {2 * radius!r} m\n"
        text += f"density = {DENSITY!r} kg/m^3\n"
    return case.write("pairs.ini", text)


def on_ball(case, law, rng):
    """Pairs that touch at t = 0 with unit closing speed and then fly to opposite end walls."""
    count = len(ANGLES)
    drift = 0.45  # [m/s] parts the two so that each goes to its own wall
    v1 = np.zeros((count, 3))
    v2 = np.zeros((count, 3))
    v1[:, 0], v2[:, 0] = 0.5 + drift, -0.5 + drift
    v1[:, 2], v2[:, 2] = 0.75 * np.tan(ANGLES), -0.25 * np.tan(ANGLES)
    w1, w2 = spins(rng, SMALL, v1 * [0, 1, 1]), spins(rng, BIG, -v2 * [0, 1, 1])
    y, zero = 0.25 * (np.arange(count) - 44.5), np.zeros(count)
    small = np.column_stack([zero - SMALL, y, zero, v1, w1])
    big = np.column_stack([zero + BIG, y, zero, v2, w2])
    rows = start(case, "pairs.txt", np.vstack([small, big]))
    path = case.run(
        mixture(case),
        balls__start=rows["balls__start"],
        **law.settings,
        drum__radius="32 m",
        drum__length=f"{4 * BIG + 1 / 128!r} m",
        gravity__acceleration="0 0 0 m/s^2",
        run__time="0.13 s",
        output__frames="0.01 s",
        output__series="0.01 s",
    )
    log = read(path)
    met = {k: column[log["kind"] == "ball_ball"][:count] for k, column in log.items()}
    if np.any(met["partner"] - met["ball"] != count) or np.any(met["time"] != 0):
        raise RuntimeError("the pairs did not meet as they should")
    met = {k: column[np.argsort(met["ball"])] for k, column in met.items()}
    ahead = [of_ball(log, ball) for ball in range(2 * count)]
    wall = {k: np.array([c[k][1] for c in ahead]) for k in log}
    if np.any(wall["kind"] != "ball_wall"):
        raise RuntimeError("a ball of a pair did not go to an end wall next")

    m1, m2, n = mass(SMALL), mass(BIG), np.array([1.0, 0.0, 0.0])
    before = v1 - v2 + np.cross(SMALL * w1 + BIG * w2, n)
    impulse, closing, s, after, loss = blow(law, n, before, m1 * m2 / (m1 + m2))
    v1_after, w1_after = kicked(v1, w1, impulse, n, SMALL)
    v2_after, w2_after = kicked(v2, w2, -impulse, -n, BIG)
    v, w = np.vstack([v1_after, v2_after]), np.vstack([w1_after, w2_after])
    radius = np.repeat([SMALL, BIG], count)[:, None]
    m = mass(radius)
    facing = np.repeat([-1.0, 1.0], count)[:, None] * n  # the wall that each flies to
    at_wall = np.linalg.norm((v + radius * np.cross(w, facing))[:, 1:], axis=1)
    size = np.tile(closing + s + np.linalg.norm(SMALL * w1, axis=1) + np.linalg.norm(BIG * w2, axis=1), 2)
    seen_v, seen_w = frame(path, 1)
    kinetic, rotational = series(path, "kinetic_energy", "rotational_energy")
    return {
        "normal": np.max(np.abs(wall["normal_speed"] - np.abs(v[:, 0])) / size),
        "slip_before": np.max(np.abs(met["tangential_speed"] - s) / size[:count]),
        "slip": np.max(np.abs(wall["tangential_speed"] - at_wall) / size),
        "loss": np.max(np.abs(met["dissipation"] - loss) / (0.5 * m1 * size[:count] ** 2)),
        "velocity": np.max(np.abs(seen_v - v) / size[:, None]),
        "spin": np.max(radius * np.abs(seen_w - w) / size[:, None]),
        "kinetic": kinetic[1] / (0.5 * np.sum(m * v**2)) - 1,
        "rotational": rotational[1] / (0.5 * np.sum(0.4 * m * radius**2 * w**2)) - 1,
        "sticking": int(np.sum(law.sticks(closing, s))),
        "count": count,
    }


def state(case, what, results):
    def worst(name):
        return max(abs(result[name]) for result in results)

    total, sticking = (sum(r[name] for r in results) for name in ("count", "sticking"))
    case.bound(
        f"{what}, {total} impacts, 0 .. 89 deg, {sticking} of them sticking: "
        "normal speed after, largest relative error",
        worst("normal"),
        TIGHT,
        against="e g_n (Walton 1993; Foerster et al. 1994)",
    )
    case.bound(
        f"{what}: slip at the impact and at the next impact, largest error divided by the sum of all speeds before",
        max(worst("slip_before"), worst("slip")),
        TIGHT,
        against="max(-beta0 g_t, g_t - (7/2) mu (1+e) g_n)",
        headline=what.endswith("wall"),
    )
    case.bound(
        f"{what}: energy lost, largest error divided by the kinetic energy at the sum of all speeds before",
        worst("loss"),
        TIGHT,
        against="m* [(1-e^2) g_n^2 + (2/7)(g_t^2 - g_t'^2)]/2",
    )
    case.bound(
        f"{what}: velocities and spins after, components in float32, "
        "largest error divided by the sum of all speeds before",
        max(worst("velocity"), worst("spin")),
        2 * FLOAT32,
        against="changes J/m and a n x J/I (J: impulse, I: inertia); two roundings of a float32",
    )
    case.bound(
        f"{what}: translational and rotational energy after, sums in float64, largest relative error",
        max(worst("kinetic"), worst("rotational")),
        TIGHT,
        against="sum m v'^2/2, sum I w'^2/2",
    )


def check(case):
    """Returns (law, result) of the wall for the figure."""
    rng = np.random.default_rng(2)
    wall = [on_wall(case, law, rng) for law in LAWS]
    state(case, "ball on end wall", wall)
    case.bound(
        "ball on end wall: time of flight to the next contact, largest relative error",
        max(result["flight"] for result in wall),
        TIGHT,
        against="2 e g_n / g, independent of the rounding of the position",
    )
    state(case, "ball on a ball eight times as heavy", [on_ball(case, law, rng) for law in LAWS])
    return list(zip(LAWS, wall, strict=True))
