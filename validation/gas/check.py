"""The paper's test: an elastic gas in the cylinder reaches Maxwell's distribution

The tests of Reichardt and Wiechert (2007), with the dependences of the samples minded. The README beside this
file says why each statistic is the right one.
"""

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy import spatial, stats

SEEDS = 40  # runs of deck.ini
DILUTE_SEEDS = 80  # runs of dilute.ini
FIRST = 0.2  # [s] samples count from here, after 57 contacts a ball
BINS = 40  # equally probable bins of every test of speeds
LEVEL = 0.9  # of the paper's chi-square tests
THIN = 20  # of the log, every 20th ball contact is taken
BLOCK = 850  # impacts to a test, 21 to a bin
ELEMENTS = (4, 4, 8)  # equal volume elements along x, r, angle
KS_LIMIT = 2.225  # sqrt(n) D exceeds it once in 10 000 times
PAPER, MAXWELL = "Reichardt & Wiechert 2007", "Maxwell's distribution"
QUANTITIES = {
    "speed": ("absolute speeds", MAXWELL),
    "relative": ("relative speeds of disjoint pairs", MAXWELL),
    "component": ("velocity components", "Gauss's distribution"),
    "impact": ("normal impact speeds", "Rayleigh's distribution"),
    "position": ("positions", "equal counts in equal volumes"),
}


def residuals(uniform, bins=BINS):
    """(observed - expected) / sqrt(expected) in equal bins of [0, 1): its square is the chi-square."""
    index = np.minimum((np.asarray(uniform) * bins).astype(int), bins - 1)
    expected = len(uniform) / bins
    return (np.bincount(index, minlength=bins) - expected) / np.sqrt(expected)


def freedom_left(half_dof, bins, share):
    """What is left of the degree of freedom that the fixed total energy takes, 0..1.

    Energies are gamma distributed with shape half_dof; the bins, equally probable in energy, see all of their
    variance but that within a bin. `share` is the part of the total energy in what is tested.
    """
    edges = stats.gamma.ppf(np.arange(bins + 1) / bins, half_dof)
    means = bins * half_dof * np.diff(stats.gamma.cdf(edges, half_dof + 1))
    return 1 - share * np.var(means) / half_dof


LEFT = {
    "speed": freedom_left(1.5, BINS, 1),
    "relative": freedom_left(1.5, BINS, 1 / 2),
    "component": freedom_left(0.5, BINS // 2, 1 / 3),
    "impact": 1.0,
    "position": 1.0,
}


def p_value(residual, left):
    """Of chi-square with bins - 2 degrees of freedom plus `left` of one more."""
    dof = len(residual) - 2
    one = stats.chi2.ppf((np.arange(400) + 0.5) / 400, 1)
    return np.mean(stats.chi2.sf(np.sum(residual**2) - left * one, dof))


def temperature(file):
    """T/m [m^2/s^2] from the kinetic energy at the start, and how far energy strays from it."""
    energy = file["observables/kinetic_energy/value"][:]
    mass = file["particles/trajectory/mass"][:].sum()
    return 2 * energy[0] / (3 * mass), np.abs(energy / energy[0] - 1).max()


def of_velocities(velocity, t, random):
    """Residuals of one sample; each ball is in one pair, drawn anew."""
    order = random.permutation(len(velocity))
    pairs = np.linalg.norm(velocity[order[0::2]] - velocity[order[1::2]], axis=1)
    speeds = np.linalg.norm(velocity, axis=1)
    return {
        "speed": residuals(stats.maxwell.cdf(speeds / np.sqrt(t))),
        "relative": residuals(stats.maxwell.cdf(pairs / np.sqrt(2 * t))),
        "component": [residuals(stats.norm.cdf(v / np.sqrt(t))) for v in velocity.T],
    }


def thinned_impacts(file, t):
    """Every THIN-th ball contact after FIRST: its probability under Rayleigh's distribution, and its balls."""
    log = file["impacts"]
    kind = list(log.attrs["kinds"]).index("ball_ball")
    taken = np.flatnonzero((log["kind"][:] == kind) & (log["time"][:] >= FIRST))[::THIN]
    speeds, *balls = (log[key][:][taken] for key in ("normal_speed", "ball", "partner"))
    return -np.expm1(-(speeds**2) / (4 * t)), balls


def of_same_ball(impacts, balls):
    """Pairs of successive taken impacts of one ball, less their mean."""
    ball = np.concatenate(balls)
    impact = np.tile(np.arange(len(impacts)), 2)
    order = np.lexsort((impact, ball))
    ball, value = ball[order], impacts[impact[order]] - 0.5
    same = ball[1:] == ball[:-1]
    return value[:-1][same], value[1:][same]


def all_pairs(velocity, t):
    """Chi-square over its degrees of freedom, wrongly taken over all n(n-1)/2 pairs."""
    edges = np.sqrt(2 * t) * stats.maxwell.ppf(np.arange(BINS + 1) / BINS)
    counts = np.histogram(spatial.distance.pdist(velocity), edges)[0]
    return np.sum((counts - counts.mean()) ** 2) / counts.mean() / (BINS - 1)


def about_axis(position, velocity):
    """(r x v)_x of each ball [m^2/s]."""
    return position[:, 1] * velocity[:, 2] - position[:, 2] * velocity[:, 1]


def one_gas(path, random, found):
    """Adds the samples of one run to `found`."""
    with h5py.File(path) as file:
        t, strays = temperature(file)
        balls = file["particles/trajectory"]
        times = balls["velocity/time"][:]
        velocities = balls["velocity/value"][:].astype(float)
        positions = balls["position/value"][:].astype(float)
        impacts, partners = thinned_impacts(file, t)
        found["mean_impact"].append(file["statistics/impacts/ball_ball/normal_speed/mean"][()] / np.sqrt(np.pi * t))
        found["rate"].append(2 * file["statistics/impacts/ball_ball/rate"][()] / len(balls["id"]))
    samples = [of_velocities(v, t, random) for v in velocities[times >= FIRST - 1e-9]]
    found["speed"].append([sample["speed"] for sample in samples])
    found["relative"].append([sample["relative"] for sample in samples])
    found["component"].append([one for sample in samples for one in sample["component"]])
    blocks = len(impacts) // BLOCK
    found["impact"].append([residuals(one) for one in impacts[: blocks * BLOCK].reshape(blocks, -1)])
    found["same_ball"].append(of_same_ball(impacts, partners))
    found["strays"].append(strays)
    before, after = (
        about_axis(positions[0], velocities[0]),
        about_axis(positions[-1], velocities[-1]),
    )
    found["spin"].append((after.sum() - before.sum()) / np.abs(before).sum())
    found["all_pairs"].append(all_pairs(velocities[-1], t))
    found["last"] = (velocities[-1], impacts, t)


def one_dilute(path):
    """Residuals of the counts in equal elements of the space open to centres, at the end of a run."""
    with h5py.File(path) as file:
        balls = file["particles/trajectory"]
        x, y, z = balls["position/value"][-1].astype(float).T
        radius, length = (float(file[f"deck/drum/{key}"].asstr()[()].split()[0]) for key in ("radius", "length"))
        diameter = balls["diameter"][0]
    where = (
        x / (length - diameter) + 0.5,
        (y**2 + z**2) / (radius - diameter / 2) ** 2,
        np.arctan2(z, y) / (2 * np.pi) + 0.5,
    )
    cells = [np.clip((u * n).astype(int), 0, n - 1) for u, n in zip(where, ELEMENTS)]
    element = np.ravel_multi_index(cells, ELEMENTS)
    return residuals((element + 0.5) / np.prod(ELEMENTS), np.prod(ELEMENTS))


def gather(case):
    random = np.random.default_rng(1)
    names = ("same_ball", "strays", "spin", "mean_impact", "rate", "all_pairs", *QUANTITIES)
    found = {name: [] for name in names}
    for seed in range(1, SEEDS + 1):
        path = case.run(run__seed=seed)
        one_gas(path, random, found)
        path.unlink()
    for seed in range(1, DILUTE_SEEDS + 1):
        path = case.run("dilute.ini", run__seed=seed)
        found["position"].append([one_dilute(path)])
        path.unlink()
    return found


def claim_distributions(case, found):
    """Three claims for each quantity; returns the p-values."""
    p_values = {}
    for name, (title, against) in QUANTITIES.items():
        tests = np.concatenate([np.asarray(run) for run in found[name]])
        p = np.array([p_value(one, LEFT[name]) for one in tests])
        case.claim(
            f"{title}: fraction of {len(p)} chi-square tests that pass at level {LEVEL}",
            np.mean(p > 1 - LEVEL),
            LEVEL,
            4 * np.sqrt(LEVEL * (1 - LEVEL) / len(p)),
            against=f"{against} ({PAPER})",
            error=np.sqrt(LEVEL * (1 - LEVEL) / len(p)),
        )
        case.bound(
            f"{title}: Kolmogorov-Smirnov sqrt(n) D of the {len(p)} p-values against a uniform distribution",
            np.sqrt(len(p)) * stats.kstest(p, "uniform").statistic,
            KS_LIMIT,
            against=against,
        )
        pooled = p_value(tests.sum(axis=0) / np.sqrt(len(tests)), LEFT[name])
        case.bound(
            f"{title}: one chi-square test of all samples, p-value expressed as a normal deviate",
            stats.norm.isf(pooled),
            4,
            against=against,
            error=1,
        )
        p_values[name] = p
    return p_values


def claim_all_together(case, p_values):
    p = np.concatenate(list(p_values.values()))
    error = np.sqrt(LEVEL * (1 - LEVEL) / len(p))
    case.claim(
        f"elastic gas: fraction of all {len(p)} chi-square tests (speeds, impact speeds, positions) that pass at "
        f"level {LEVEL}",
        np.mean(p > 1 - LEVEL),
        LEVEL,
        4 * error,
        against=f"Maxwell, Rayleigh, uniform ({PAPER})",
        error=error,
        headline=True,
    )


def claim_independence(case, found):
    speed = np.array(found["speed"])
    steps = speed[:, :-1], speed[:, 1:]
    case.bound(
        "absolute speeds: correlation of the residuals of the bins with those 30 ms later",
        np.sum(steps[0] * steps[1]) / np.sqrt(np.sum(steps[0] ** 2) * np.sum(steps[1] ** 2)),
        0.1,
        against="independent samples",
        error=1 / np.sqrt(steps[0].size),
    )
    first, second = np.concatenate(found["same_ball"], axis=1)
    case.bound(
        "correlation of the normal speeds of successive sampled impacts of one ball",
        12 * np.mean(first * second),  # 1/12 is the variance of a uniform number
        0.05,
        against="independent samples",
        error=1 / np.sqrt(len(first)),
    )


def claim_exact(case, found):
    mean = np.array(found["mean_impact"])
    error = mean.std(ddof=1) / np.sqrt(len(mean))
    case.claim(
        "mean normal impact speed of all ball contacts, divided by sqrt(pi T/m)",
        mean.mean(),
        1,
        4 * error,
        against="Rayleigh's distribution",
        error=error,
        headline=True,
    )
    case.bound(
        "largest relative change of the kinetic energy",
        max(found["strays"]),
        1e-12,
        against="conservation of energy",
    )
    case.bound(
        "largest change of the angular momentum about the axis, divided by sum |L|",
        np.abs(found["spin"]).max(),
        1e-8,
        against="conservation: a smooth drum exerts no torque",
    )


def draw_speeds(case, found):
    """The paper's Figure 3: one sample of one run."""
    velocity, impacts, t = found["last"]
    speeds = np.linalg.norm(velocity, axis=1)
    pairs = np.linalg.norm(velocity[0::2] - velocity[1::2], axis=1)
    normal = np.sqrt(-4 * t * np.log1p(-impacts))
    panels = (
        ("absolute speed", speeds, stats.maxwell(scale=np.sqrt(t)), "Maxwell"),
        ("relative speed, disjoint pairs", pairs, stats.maxwell(scale=np.sqrt(2 * t)), "Maxwell"),
        ("normal impact speed", normal, stats.rayleigh(scale=np.sqrt(2 * t)), "Rayleigh"),
    )
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    for axis, (title, values, law, name) in zip(axes, panels):
        edges = np.linspace(0, law.ppf(0.9995), 31)
        counts = np.histogram(values, edges)[0]
        per = len(values) * np.diff(edges)
        middle = (edges[1:] + edges[:-1]) / 2
        v = np.linspace(0, edges[-1], 300)
        axis.bar(middle, counts / per, np.diff(edges), color="0.85", edgecolor="0.7")
        axis.errorbar(
            middle, counts / per, np.sqrt(counts) / per, fmt="k.", ms=4, lw=1,
            label=f"millsim, {len(values)} values",
        )  # fmt: skip
        axis.plot(v, law.pdf(v), "C3", lw=1.8, label=name)
        axis.set(xlabel=f"{title} [m/s]", ylabel="probability density [s/m]", xlim=(0, edges[-1]))
        axis.legend(frameon=False)
    case.save(figure)
    plt.close(figure)


def draw_p_values(case, p_values, pairs):
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
    for name, p in p_values.items():
        left.step(np.sort(p), (np.arange(len(p)) + 1) / len(p), label=f"{QUANTITIES[name][0]}, {len(p)}")
    left.plot([0, 1], [0, 1], "k--", lw=1, label="uniform")
    left.set(xlabel="p-value of a chi-square test [1]", ylabel="fraction of tests below [1]")
    left.legend(frameon=False, fontsize=8)
    x = np.logspace(-0.4, 2, 400)
    right.step(
        np.sort(pairs),
        (np.arange(len(pairs)) + 1) / len(pairs),
        label=f"all pairs, {len(pairs)} tests",
    )
    right.plot(x, stats.chi2.cdf(x * (BINS - 1), BINS - 1), "k--", lw=1, label="if the pairs were independent")
    right.set(
        xscale="log",
        xlabel="chi-square / degrees of freedom [1]",
        ylabel="fraction of tests below [1]",
    )
    right.legend(frameon=False)
    case.save(figure, "p_values.png")
    plt.close(figure)


def check(case):
    found = gather(case)
    p_values = claim_distributions(case, found)
    claim_all_together(case, p_values)
    claim_independence(case, found)
    claim_exact(case, found)
    draw_speeds(case, found)
    draw_p_values(case, p_values, np.array(found["all_pairs"]))
