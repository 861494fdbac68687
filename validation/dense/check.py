"""A dense gas in the bulk: Enskog's contact rate, Carnahan and Starling's pressure

Contacts, balls and temperature are counted in a core of the drum, far from the walls. The README beside this file
says why, and where each formula is from.
"""

import dataclasses

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy import special, stats

SEEDS = 10
RAMP = (2, 5)  # [diameters] from a wall: the core counts nothing before, all beyond
BINS = 40  # equally probable bins of every chi-square test
THIN = 50  # of the log, every 50th ball contact is taken for the tests of distributions
BLOCK = 2000  # of these to a test, 50 to a bin
LEVEL = 0.9
KS_LIMIT = 2.225  # sqrt(n) D exceeds it once in 10 000 times


@dataclasses.dataclass
class Filling:
    """One packing, and what makes it."""

    packing: float  # in the core, nearly
    radius: float  # [m] of the drum, which is twice as long
    relaxed: float  # [s]
    time: float  # [s]
    frames: float  # [s] between frames


FILLINGS = (
    Filling(0.05, 0.0962, 0.80, 1.80, 5e-3),
    Filling(0.20, 0.0607, 0.36, 0.76, 2e-3),
    Filling(0.30, 0.0528, 0.30, 0.60, 2e-3),
    Filling(0.40, 0.0478, 0.22, 0.42, 2e-3),
)


def carnahan_starling(phi):
    return (1 + phi + phi**2 - phi**3) / (1 - phi) ** 3


def kolafa(phi):
    return (1 + phi + phi**2 - 2 / 3 * phi**3 * (1 + phi)) / (1 - phi) ** 3


def enskog(phi, pressure, t, diameter):
    """Contacts of a ball a second at packing phi, T/m = t, with the pair correlation that goes with the pressure."""
    chi = (pressure(phi) - 1) / (4 * phi)
    return 24 / np.sqrt(np.pi) * phi * chi * np.sqrt(t) / diameter


@dataclasses.dataclass
class Run:
    """What a run is needed for, read once."""

    diameter: float
    radius: float
    length: float
    t: float  # T/m of all balls, from the kinetic energy
    virial: float  # how far Clausius' theorem is missed
    times: np.ndarray
    position: np.ndarray  # of the frames
    velocity: np.ndarray
    ball: dict  # log of the contacts of balls, once relaxed
    wall: dict  # and of those with end walls


def read(path, filling):
    with h5py.File(path) as file:
        balls = file["particles/trajectory"]
        mass, count = balls["mass"][0], len(balls["id"])
        times = balls["position/time"][:]
        log = {key: file["impacts"][key][:] for key in ("time", "kind", "position", "normal_speed", "tangential_speed")}
        kinds = list(file["impacts"].attrs["kinds"])
        late = log["time"] >= filling.relaxed
        of = {
            kind: {key: column[late & (log["kind"] == kinds.index(kind))] for key, column in log.items()}
            for kind in ("ball_ball", "ball_wall", "ball_drum")
        }
        from_here = times >= filling.relaxed - 1e-9
        position, velocity = (balls[f"{key}/value"][:][from_here].astype(float) for key in ("position", "velocity"))
        run = Run(
            balls["diameter"][0],
            filling.radius,
            2 * filling.radius,
            2 * file["observables/kinetic_energy/value"][0] / (3 * mass * count),
            0.0,
            times[from_here],
            position,
            velocity,
            of["ball_ball"],
            of["ball_wall"],
        )
    run.virial = clausius(run, of["ball_drum"], count)
    return run


def clausius(run, drum, count):
    """Change of sum(r.v) less what flight and impulses make of it, over twice the kinetic energy times time."""
    moment = np.sum(run.position[[0, -1]] * run.velocity[[0, -1]], axis=(1, 2))
    flight = 3 * count * run.t * (run.times[-1] - run.times[0])
    pairs = run.diameter * run.ball["normal_speed"].sum()
    walls = 2 * (run.length - run.diameter) / 2 * run.wall["normal_speed"].sum()
    round_wall = 2 * (run.radius - run.diameter / 2) * drum["normal_speed"].sum()
    return (moment[1] - moment[0] - flight - pairs + walls + round_wall) / flight


def ramp(depth, diameter):
    """0 up to RAMP[0] diameters from a wall, 1 from RAMP[1] on, between them smooth to the second derivative."""
    u = np.clip((depth / diameter - RAMP[0]) / (RAMP[1] - RAMP[0]), 0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


def weight_across(position, run):
    return ramp(run.radius - np.hypot(position[..., 1], position[..., 2]), run.diameter)


def weight(position, run):
    """How much a point belongs to the core, 0..1."""
    return weight_across(position, run) * ramp(run.length / 2 - np.abs(position[..., 0]), run.diameter)


def weighted_area(run):
    """Integral of weight_across over the cross-section: the ramp's mean is 1/2, its first moment 5/14."""
    near, far = (depth * run.diameter for depth in RAMP)
    edge = 2 * np.pi * (far - near) * ((run.radius - near) / 2 - (far - near) * 5 / 14)
    return np.pi * (run.radius - far) ** 2 + edge


def bulk(run):
    """Packing, temperature, rate and pressures of the core of one run, each over theory's."""
    core = weight(run.position, run)
    area = weighted_area(run)
    duration = run.times[-1] - run.times[0]
    balls = core.sum() / len(core)
    t = np.sum(core[..., None] * run.velocity**2) / (3 * core.sum())
    density = balls / (area * (run.length - sum(RAMP) * run.diameter))
    phi = density * np.pi / 6 * run.diameter**3
    contacts = weight(run.ball["position"], run)
    hits = weight_across(run.wall["position"], run)
    z = 1 + run.diameter * contacts @ run.ball["normal_speed"] / (3 * t * duration * balls)
    z_wall = 2 * (hits @ run.wall["normal_speed"]) / (2 * area * duration) / (density * t)
    rate = 2 * contacts.sum() / duration / balls
    found = {"packing": phi, "t": t / run.t, "contacts": contacts.sum(), "z": z}
    for name, law in (("cs", carnahan_starling), ("kolafa", kolafa)):
        found[f"rate_{name}"] = rate / enskog(phi, law, t, run.diameter)
        found[f"z_{name}"] = z / law(phi)
        found[f"wall_{name}"] = z_wall / law(phi)
    return found


def collision_geometry(run):
    """Every THIN-th contact of balls: (b/s)^2 and the relative speed squared over 4 T/m."""
    normal, slip = (run.ball[f"{way}_speed"][::THIN] ** 2 for way in ("normal", "tangential"))
    return np.array([slip / (normal + slip), (normal + slip) / (4 * run.t)])


def gather(case):
    found, geometry, virial = {}, [], []
    for filling in FILLINGS:
        runs = []
        for seed in range(1, SEEDS + 1):
            path = case.run(
                run__seed=seed,
                run__time=f"{filling.time} s",
                run__sample_from=f"{filling.relaxed} s",
                drum__radius=f"{filling.radius} m",
                drum__length=f"{2 * filling.radius} m",
                output__frames=f"{filling.frames} s",
            )
            run = read(path, filling)
            path.unlink()
            runs.append(bulk(run))
            geometry.append(collision_geometry(run))
            virial.append(run.virial)
        found[filling.packing] = {key: np.array([one[key] for one in runs]) for key in runs[0]}
    return found, geometry, virial


def standard_error(values):
    return values.std(ddof=1) / np.sqrt(len(values))


LAWS = {
    "rate": "ratio of the contact rate in the bulk to Enskog's",
    "z": "ratio of the pressure in the bulk (from the virial) to the theoretical pressure",
    "wall": "ratio of the pressure on the end walls to the theoretical pressure",
}


def claim_bulk(case, found):
    for values in found.values():
        at = f"at packing {values['packing'].mean():.4f}"
        for key in ("rate", "z"):
            case.claim(
                f"{LAWS[key]}, {at}",
                values[f"{key}_cs"].mean(),
                1,
                0.01,
                against="Carnahan & Starling 1969",
                error=standard_error(values[f"{key}_cs"]),
            )
        for key in ("rate", "z", "wall"):
            error = standard_error(values[f"{key}_kolafa"])
            case.claim(
                f"{LAWS[key]}, {at}",
                values[f"{key}_kolafa"].mean(),
                1,
                4 * error + 0.001,
                against="Kolafa, in Boublik & Nezbeda 1986",
                error=error,
            )
    for key, what in (
        ("rate", "contact rate in the bulk from Enskog's"),
        ("z", "pressure in the bulk from Carnahan-Starling's"),
    ):
        means = np.array([values[f"{key}_cs"].mean() - 1 for values in found.values()])
        worst = np.argmax(np.abs(means))
        case.bound(
            f"largest relative deviation of the {what}, packings {', '.join(map(str, found))}",
            means[worst],
            0.01,
            against="Enskog, Carnahan & Starling 1969",
            error=standard_error(list(found.values())[worst][f"{key}_cs"]),
            headline=True,
        )


def chi_square(uniform):
    counts = np.bincount(np.minimum((uniform * BINS).astype(int), BINS - 1), minlength=BINS)
    expected = len(uniform) / BINS
    return np.sum((counts - expected) ** 2) / expected


def claim_geometry(case, geometry):
    columns = np.concatenate(geometry, axis=1)
    for title, column, against in (
        ("impact parameter squared, (b/s)^2", columns[0], "uniform on [0, 1]"),
        ("relative speed at impact", special.gammainc(2, columns[1]), "v^3 exp(-m v^2/4T)"),
    ):
        blocks = column[: len(column) // BLOCK * BLOCK].reshape(-1, BLOCK)
        p = stats.chi2.sf([chi_square(block) for block in blocks], BINS - 1)
        error = np.sqrt(LEVEL * (1 - LEVEL) / len(p))
        case.claim(
            f"{title}: fraction of {len(p)} chi-square tests that pass at level {LEVEL}",
            np.mean(p > 1 - LEVEL), LEVEL, 4 * error, against=against, error=error,
        )  # fmt: skip
        case.bound(
            f"{title}: Kolmogorov-Smirnov sqrt(n) D of the {len(p)} p-values against a uniform distribution",
            np.sqrt(len(p)) * stats.kstest(p, "uniform").statistic, KS_LIMIT, against=against,
        )  # fmt: skip
        case.bound(
            f"{title}: one chi-square test of all {len(column)} contacts, p-value expressed as a normal deviate",
            stats.norm.isf(stats.chi2.sf(chi_square(column), BINS - 1)), 4, against=against, error=1,
        )  # fmt: skip
    error = 1 / np.sqrt(columns.shape[1])
    case.bound(
        "correlation of (b/s)^2 with the square of the relative speed",
        np.corrcoef(columns)[0, 1], 4 * error, against="independent quantities", error=error,
    )  # fmt: skip


def draw(case, found, geometry):
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    draw_pressure(axes[0, 0], found)
    draw_deviations(axes[0, 1], found)
    squares, energies = np.concatenate(geometry, axis=1)
    draw_histogram(
        axes[1, 0],
        squares,
        np.linspace(0, 1, 41),
        np.ones_like,
        "uniform",
        "(b/s)² at impact [1]",
        "1",
    )
    draw_histogram(
        axes[1, 1], 2 * np.sqrt(energies), np.linspace(0, 6.5, 53), lambda v: v**3 / 8 * np.exp(-(v**2) / 4),
        "v³ exp(−m v²/4T)", "relative speed at impact / √(T/m) [1]", "1",
    )  # fmt: skip
    case.save(figure)
    plt.close(figure)


def draw_pressure(axis, found):
    phi = np.linspace(0, 0.45, 200)
    axis.plot(phi, carnahan_starling(phi), "C3", label="Carnahan & Starling")
    axis.errorbar(
        [values["packing"].mean() for values in found.values()],
        [values["z"].mean() for values in found.values()],
        [standard_error(values["z"]) for values in found.values()],
        fmt="ko", ms=5, label="millsim, virial in the bulk",
    )  # fmt: skip
    axis.set(xlabel="packing in the core [1]", ylabel="p V / N T [1]", xlim=(0, 0.45), ylim=(0, None))
    axis.legend(frameon=False)


def draw_deviations(axis, found):
    phi = np.linspace(1e-3, 0.45, 200)
    cs, better = carnahan_starling(phi), kolafa(phi)
    axis.axhspan(-1, 1, color="0.93", label="band of the claim, 1 %")
    axis.axhline(0, color="C3", label="Enskog, Carnahan & Starling")
    axis.plot(phi, 100 * ((better - 1) / (cs - 1) - 1), "C0-", lw=1, label="Kolafa, rate")
    axis.plot(phi, 100 * (better / cs - 1), "C0--", lw=1, label="Kolafa, pressure")
    for key, mark, shift, label in (
        ("rate", "ko", -0.004, "contact rate"),
        ("z", "C2s", 0, "pressure in the bulk"),
        ("wall", "C1^", 0.004, "pressure on end walls"),
    ):
        axis.errorbar(
            [values["packing"].mean() + shift for values in found.values()],
            [100 * (values[f"{key}_cs"].mean() - 1) for values in found.values()],
            [100 * standard_error(values[f"{key}_cs"]) for values in found.values()],
            fmt=mark, ms=5, label=label,
        )  # fmt: skip
    axis.set(xlabel="packing in the core [1]", ylabel="deviation from Carnahan & Starling [%]")
    axis.set(xlim=(0, 0.45), ylim=(-1.6, 2.2))
    axis.legend(frameon=False, ncols=2, fontsize=8)


def draw_histogram(axis, values, edges, law, name, label, unit):
    counts = np.histogram(values, edges)[0]
    per = len(values) * np.diff(edges)
    middle = (edges[1:] + edges[:-1]) / 2
    axis.errorbar(
        middle,
        counts / per,
        np.sqrt(counts) / per,
        fmt="k.",
        ms=4,
        label=f"millsim, {len(values)} contacts",
    )
    v = np.linspace(edges[0], edges[-1], 300)
    axis.plot(v, law(v), "C3", label=name)
    axis.set(xlabel=label, ylabel=f"probability density [{unit}]", xlim=(edges[0], edges[-1]))
    axis.set_ylim(0, 1.25 * max(counts / per))
    axis.legend(frameon=False)


def check(case):
    found, geometry, virial = gather(case)
    claim_bulk(case, found)
    claim_geometry(case, geometry)
    case.bound(
        "Clausius' virial theorem (impulses of balls and walls, kinetic energy): largest relative error of all runs",
        np.abs(virial).max(),
        1e-7,
        against="exact identity of the motion",
    )
    draw(case, found, geometry)
