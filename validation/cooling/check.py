"""Cooling: Haff's law, the velocity distribution's shape, and how rough spheres share energy with their spin."""

import functools

import h5py
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial import cKDTree
from scipy.special import eval_genlaguerre, roots_genlaguerre

BALLS, DIAMETER, RADIUS, LENGTH = 2000, 0.005, 0.188, 0.250  # as in deck.ini
RELAXED = 8.0  # collisions per ball after which the shape of the distribution is its own

SMOOTH = {0.95: 4.9, 0.9: 7.4, 0.8: 17.0}  # restitution: seconds until some 45 collisions per ball
SMOOTH_SEEDS = 16
# What theory leaves out: a4 and beyond, 1/N, velocities that go together over a mean free path
RATE_BIAS = 5e-4  # of the rate
SHAPE_BIAS = 6e-4  # of a2, absolute

ROUGH = {(0.95, 0.9): 2.9, (0.9, 0.5): 5.0, (0.8, -0.5): 5.4}  # until 20 collisions per ball
ROUGH_SEEDS = 20
FRICTION = 10.0  # the most a deck may have: all but 1 contact in 2000 stick
# Boltzmann's equation is the limit of many balls in a cube of the mean free path; here there are 140
FREE_PATH = np.pi * RADIUS**2 * LENGTH / (np.sqrt(2) * np.pi * DIAMETER**2 * BALLS)
DILUTION = np.pi * RADIUS**2 * LENGTH / (BALLS * FREE_PATH**3)
COUNTS = np.array([0.5, 1, 2, 3, 4, 6, 8, 10, 13, 16, 19])  # collisions per ball, compared there

ORACLE_BALLS, ORACLE_BATCH, ORACLE_RUNS = 100_000, 2000, 4
# Hits on walls per collision with a ball, both per ball: surface <v> / 4 volume over <v> / free path, of the
# volume that is open to centres
_RADIUS, _LENGTH = RADIUS - DIAMETER / 2, LENGTH - DIAMETER
WALL_HITS = (
    (2 / _RADIUS + 2 / _LENGTH) / 4 * FREE_PATH * _RADIUS**2 * _LENGTH / (RADIUS**2 * LENGTH)
)


def check(case):
    # A start file is looked for beside the deck
    case.write("deck.ini", (case.folder / "deck.ini").read_text())
    smooth = check_smooth(case)
    rough = check_rough(case)
    draw(case, smooth, rough)


# --- Smooth spheres -----------------------------------------------------------------------------------------------


def van_noije_ernst(e):
    """a2 to first order, a3 left out: van Noije and Ernst 1998, in three dimensions."""
    return 16 * (1 - e) * (1 - 2 * e**2) / (81 - 17 * e + 30 * e**2 * (1 - e))


@functools.cache
def cooling_state(e):
    """a2, a3, and the loss per collision over that of Maxwell's distribution, of the homogeneous cooling state.

    f(c) = Maxwell(c) (1 + a2 S2 + a3 S3): Boltzmann's equation multiplied by c^4 and c^6 (Brilliantov and Poeschel
    2006). The collision integrals are done by Gauss's rules, exactly. Without a3 they give van Noije and Ernst's a2.
    """
    (centre, relative, turn, hit, round_), weight = quadrature()
    zero = np.zeros_like(turn)
    big = centre * np.array([np.sqrt(1 - turn**2), zero, turn])
    small = relative * np.array([zero, zero, zero + 1])
    n = np.array([np.sqrt(1 - hit**2) * np.cos(round_), np.sqrt(1 - hit**2) * np.sin(round_), hit])
    one, two = (big + small) / np.sqrt(2), (big - small) / np.sqrt(2)
    kick = (1 + e) / 2 * ((one - two) * n).sum(axis=0) * n
    before = [(c**2).sum(axis=0) for c in (one, two)]
    after = [(c**2).sum(axis=0) for c in (one - kick, two + kick)]
    gain = [sum(c**p for c in after) - sum(c**p for c in before) for p in range(4)]
    terms = [[eval_genlaguerre(p, 0.5, c) for p in (2, 3)] for c in before]

    def change(a2, a3):
        weights = weight.copy()
        for s2, s3 in terms:
            weights *= 1 + a2 * s2 + a3 * s3
        return np.array([(weights * g).sum() for g in gain]), weights.sum()

    def unsteady(a):
        loss, _ = change(*a)
        moments = 1.5, 15 / 4 * (1 + a[0]), 105 / 8 * (1 + 3 * a[0] - a[1])
        return [loss[p] / moments[p - 1] - p * loss[1] / moments[0] for p in (2, 3)]

    a2, a3 = fsolve(unsteady, [van_noije_ernst(e), 0.0], xtol=1e-12)
    (loss, rate), (maxwell, maxwell_rate) = change(a2, a3), change(0, 0)
    return a2, a3, loss[1] / rate / (maxwell[1] / maxwell_rate)


def quadrature():
    """Nodes and weights for two colliding balls of Maxwell's gas.

    Sizes of (c1 + c2)/sqrt(2) and of (c1 - c2)/sqrt(2), the cosine between them, the cosine of the place hit, and the
    angle around; the weight of the relative speed and of the cosine, that is how often they meet, is in.
    """
    centre, centre_weight = roots_genlaguerre(10, 0.5)
    relative, relative_weight = roots_genlaguerre(10, 1.0)
    turn, turn_weight = np.polynomial.legendre.leggauss(12)
    round_ = 2 * np.pi * np.arange(16) / 16
    hit, hit_weight = (turn + 1) / 2, turn_weight * (turn + 1)
    nodes = np.meshgrid(np.sqrt(centre), np.sqrt(relative), turn, hit, round_, indexing="ij")
    weights = [centre_weight, relative_weight, turn_weight, hit_weight, np.ones(16)]
    weight = functools.reduce(np.multiply.outer, [w / w.sum() for w in weights])
    return [node.ravel() for node in nodes], weight.ravel()


def check_smooth(case):
    runs = {e: [] for e in SMOOTH}
    for seed in range(SMOOTH_SEEDS):
        write_start(case, seed)
        for e, time in SMOOTH.items():
            runs[e].append(smooth_run(case, e, time))
    for e, results in runs.items():
        a2, _, loss = cooling_state(e)
        rate, error = mean_and_error(np.array([r["rate"] for r in results]))
        theory = (1 - e**2) / 3 * loss
        case.claim(
            f"Haff's law, e = {e:g}: -d ln T / dC",
            rate,
            theory,
            4 * error + RATE_BIAS * theory,
            error=error,
            against="(1 - e^2)(1 + a2/4 + a3/32)/3, Haff 1983 with Sonine corrections",
            headline=e == 0.9,
        )
        shape, error = mean_and_error(np.array([r["shape"] for r in results]))
        case.claim(
            f"fourth moment of the velocities, e = {e:g}: a2",
            shape,
            a2,
            4 * error + SHAPE_BIAS,
            error=error,
            against="Boltzmann's equation with a2 and a3, Brilliantov and Poeschel 2006",
        )
    claim_together(case, runs)
    return runs


def claim_together(case, runs):
    """The three e together, weighted for the least error: what of a2 there is, and what goes into the rate."""
    theory = [cooling_state(e) for e in SMOOTH]
    a2 = np.array([t[0] for t in theory])
    shapes = np.array([[r["shape"] for r in rows] for rows in runs.values()])
    ratio, error = mean_and_error(a2 @ shapes / (a2 @ a2))
    case.claim(
        "a2 over that of theory, e = 0.95, 0.9, 0.8 together",
        ratio,
        1,
        4 * error + SHAPE_BIAS / np.abs(a2).mean(),
        error=error,
        against="Boltzmann's equation with a2 and a3, Brilliantov and Poeschel 2006",
    )
    rates = np.array([[r["rate"] / (1 - e**2) * 3 - 1 for r in runs[e]] for e in SMOOTH])
    shift = np.array([t[2] - 1 for t in theory])
    # The error of a rate goes with 1 - e^2, so that all three excesses have the same
    ratio, error = mean_and_error(shift @ rates / (shift @ shift))
    case.claim(
        "what the shape adds to the rate over that of theory, e = 0.95, 0.9, 0.8 together",
        ratio,
        1,
        4 * error + RATE_BIAS / np.abs(shift).mean(),
        error=error,
        against="a2/4 + a3/32: 3/16 a2 from the loss in time, 1/16 from the collision rate",
    )


def smooth_run(case, e, time):
    path = case.run(
        case.scratch / "deck.ini",
        output="smooth.h5",
        run__time=f"{time} s",
        output__series=f"{time / 200} s",
        output__frames=f"{time / 90} s",
        contact__ball_ball__restitution=e,
    )
    with h5py.File(path) as file:
        energy = file["observables/kinetic_energy/value"][:]
        count = collisions(file)
        velocity = file["particles/trajectory/velocity/value"][:].astype(float)
        count_at_frames = np.interp(
            file["particles/trajectory/velocity/time"][:],
            file["observables/kinetic_energy/time"][:],
            count,
        )
    first = np.searchsorted(count, RELAXED)
    squares = (velocity[count_at_frames > RELAXED] ** 2).sum(axis=2)
    moment = (squares**2).mean(axis=1) / squares.mean(axis=1) ** 2
    # At a fixed energy N balls have a moment lower by the factor 3N / (3N + 2)
    shape = 0.6 * (1 + 2 / (3 * BALLS)) * moment.mean() - 1
    rate = np.log(energy[first] / energy[-1]) / (count[-1] - count[first])
    return {"count": count, "temperature": energy / energy[0], "rate": rate, "shape": shape}


# --- Rough spheres ------------------------------------------------------------------------------------------------


def check_rough(case):
    runs = {pair: [] for pair in ROUGH}
    for seed in range(ROUGH_SEEDS):
        write_start(case, 1000 + seed)
        for pair, time in ROUGH.items():
            runs[pair].append(rough_run(case, *pair, time))
    results = {}
    for pair, rows in runs.items():
        oracle = [direct_simulation(*pair, seed) for seed in range(ORACLE_RUNS)]
        results[pair] = {
            "millsim": mean_and_error(np.array(rows)),
            "oracle": mean_and_error(np.array(oracle)),
            "mean_field": mean_field(*pair, COUNTS),
        }
        claim_rough(case, *pair, results[pair])
    return results


def claim_rough(case, e, beta, result):
    """Rows of a result: ln(T_tr / T_0) and R, over COUNTS."""
    (mean, error), (truth, truth_error) = result["millsim"], result["oracle"]
    both = np.hypot(error, truth_error)
    name = f"e = {e:g}, beta = {beta:g}"
    band = 4 * both + DILUTION * np.abs(truth)
    source = "direct simulation Monte Carlo of the same contact law and walls"
    for row, what in enumerate(("ln T_tr", "R = T_rot / T_tr")):
        case.claim(
            f"rough spheres, {name}: {what} at C = {COUNTS[-1]:g}",
            mean[row, -1],
            truth[row, -1],
            band[row, -1],
            error=error[row, -1],
            against=source,
            headline=beta == 0.5 and row == 1,
        )
        case.bound(
            f"rough spheres, {name}: {what}, C = {COUNTS[0]:g} to {COUNTS[-1]:g}, most that is off, in bands",
            np.abs((mean - truth) / band)[row].max(),
            1,
            against=source,
        )
    field = result["mean_field"][1]
    worst = np.abs(truth[1] / field - 1).argmax()
    case.claim(
        f"rough spheres, {name}: what R has over Gaussian mean field where that is worst, C = {COUNTS[worst]:g}",
        100 * (mean[1, worst] / field[worst] - 1),
        100 * (truth[1, worst] / field[worst] - 1),
        100 * band[1, worst] / field[worst],
        error=100 * error[1, worst] / field[worst],
        unit="%",
        against="direct simulation; mean field: Huthmann and Zippelius 1997",
    )


def rough_run(case, e, beta, time):
    path = case.run(
        case.scratch / "deck.ini",
        output="rough.h5",
        run__time=f"{time} s",
        contact__ball_ball__restitution=e,
        contact__ball_ball__friction=FRICTION,
        contact__ball_ball__tangential_restitution=beta,
    )
    with h5py.File(path) as file:
        energy = file["observables/kinetic_energy/value"][:]
        spin = file["observables/rotational_energy/value"][:]
        count = collisions(file)
    return at_counts(count, np.log(energy / energy[0]), spin / energy)


def mean_field(e, beta, counts):
    """ln(T_tr / T_0) and R for Maxwell's distributions of velocity and spin, without Coulomb's limit."""
    q = 2 / 5
    eta = q * (1 + beta) / (2 * (1 + q))
    a = (1 - e**2) / 4 + eta * (1 - eta)
    b = eta**2 / q
    c = eta / q * (1 - eta / q)

    def rates(_, state):
        ratio = state[1]
        return [-4 / 3 * (a - b * ratio), 4 / 3 * (b + (a - c) * ratio - b * ratio**2)]

    counts = np.asarray(counts, dtype=float)
    return solve_ivp(rates, (0, counts.max()), [0, 0], t_eval=counts, rtol=1e-10, atol=1e-12).y


# --- Direct simulation Monte Carlo --------------------------------------------------------------------------------


def direct_simulation(e, beta, seed):
    """Boltzmann's equation of a homogeneous gas, solved by chance (Bird): unit mass, unit radius, no places.

    Pairs and directions n are drawn at random and collide with a probability in proportion to |g.n|. No mean
    field, no assumption on distributions or on how spins and velocities go together. Smooth walls turn velocities
    but not spins, which they leave less alike than they were: so there are walls too.
    """
    rng = np.random.default_rng([seed, 77])
    v, w = rng.normal(size=(ORACLE_BALLS, 3)), np.zeros((ORACLE_BALLS, 3))
    start = (v**2).sum()
    count, hits, rows, batch = 0, 0, [], 0
    while not rows or rows[-1][0] < COUNTS[-1]:
        if batch % 10 == 0:
            energy, spin = (v**2).sum(), 0.4 * (w**2).sum()
            rows.append((2 * count / ORACLE_BALLS, np.log(energy / start), spin / energy))
            fastest = 7 * np.sqrt(2 * energy / (3 * ORACLE_BALLS))
            hits += turn_back(v, round(2 * count * WALL_HITS) - hits, fastest, rng)
        count += collide_some(v, w, e, beta, fastest, rng)
        batch += 1
    return at_counts(*np.array(rows).T)


def turn_back(v, number, fastest, rng):
    """So many velocities are mirrored at walls, with a probability in proportion to |v.n|; returns how many."""
    done = 0
    while done < number:
        some = 16 * (number - done)  # one in some twelve is accepted
        ball = rng.integers(ORACLE_BALLS, size=some)
        n = rng.normal(size=(some, 3))
        n /= np.sqrt((n**2).sum(axis=1))[:, None]
        v_n = (v[ball] * n).sum(axis=1)
        hit = np.flatnonzero(np.abs(v_n) > fastest * rng.random(some))
        hit = hit[np.sort(np.unique(ball[hit], return_index=True)[1])][: number - done]
        v[ball[hit]] -= 2 * v_n[hit, None] * n[hit]
        done += len(hit)
    return done


def collide_some(v, w, e, beta, fastest, rng):
    """Of ORACLE_BATCH random pairs those collide that chance lets; returns how many."""
    pairs = rng.integers(ORACLE_BALLS, size=2 * ORACLE_BATCH)
    once = np.zeros(2 * ORACLE_BATCH, dtype=bool)
    once[np.unique(pairs, return_index=True)[1]] = True
    pairs, once = pairs.reshape(2, -1), once.reshape(2, -1).all(axis=0)
    n = rng.normal(size=(ORACLE_BATCH, 3))
    n /= np.sqrt((n**2).sum(axis=1))[:, None]
    g_n = ((v[pairs[0]] - v[pairs[1]]) * n).sum(axis=1)
    if np.abs(g_n).max() > fastest:
        raise RuntimeError("direct simulation: a pair was faster than thought possible")
    # n may point either way: half of the directions are parting, turn them round
    hit = once & (np.abs(g_n) > fastest * rng.random(ORACLE_BATCH))
    (i, j), n, g_n = pairs[:, hit], (n * np.sign(g_n)[:, None])[hit], np.abs(g_n)[hit]

    slip = v[i] - v[j] + np.cross(w[i] + w[j], n)
    slip -= (slip * n).sum(axis=1)[:, None] * n
    normal = (1 + e) / 2 * g_n
    tangential = (1 + beta) / 7 * slip
    size = np.sqrt((tangential**2).sum(axis=1))
    tangential *= np.minimum(1, FRICTION * normal / np.maximum(size, 1e-300))[:, None]
    kick = normal[:, None] * n + tangential
    twist = 2.5 * np.cross(n, kick)
    v[i] -= kick
    v[j] += kick
    w[i] -= twist
    w[j] -= twist
    return len(i)


# --- What both need -----------------------------------------------------------------------------------------------


def write_start(case, seed):
    """start.txt: balls anywhere, Maxwell's velocities with T = m (m/s)^2, no spin.

    The sum of the momenta is zero, and so is the angular momentum about the axis, which smooth walls keep: it
    would stay while all else cools.
    """
    rng = np.random.default_rng([seed, 11])
    place = random_places(rng, BALLS)
    while len(close := cKDTree(place).query_pairs(1.000001 * DIAMETER, output_type="ndarray")):
        place[close[:, 0]] = random_places(rng, len(close))
    v = rng.normal(size=(BALLS, 3))
    modes = np.zeros((4, BALLS, 3))
    modes[[0, 1, 2], :, [0, 1, 2]] = 1
    modes[3] = np.cross([1.0, 0, 0], place)
    modes = modes.reshape(4, -1).T
    v -= (modes @ np.linalg.lstsq(modes, v.ravel(), rcond=None)[0]).reshape(BALLS, 3)
    v *= np.sqrt(3 / (v**2).sum(axis=1).mean())
    lines = (" ".join(map(repr, row)) for row in np.column_stack([place, v]).tolist())
    case.write("start.txt", "\n".join(lines) + "\n")


def random_places(rng, number):
    radius = (RADIUS - DIAMETER / 2) * np.sqrt(rng.random(number))
    angle = 2 * np.pi * rng.random(number)
    x = (LENGTH - DIAMETER) * (rng.random(number) - 0.5)
    return np.column_stack([x, radius * np.cos(angle), radius * np.sin(angle)])


def collisions(file):
    """C, contacts with other balls that each ball has had."""
    return 2 / BALLS * file["observables/collisions/ball_ball/value"][:].astype(float)


def at_counts(count, *rows):
    if count[-1] < COUNTS[-1]:
        raise RuntimeError(f"only {count[-1]:g} collisions per ball")
    return [np.interp(COUNTS, count, row) for row in rows]


def mean_and_error(samples):
    """Mean over the first axis, the seeds, and its standard error."""
    return samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(len(samples))


# --- Figure -------------------------------------------------------------------------------------------------------


def draw(case, smooth, rough):
    figure, axes = plt.subplots(2, 2, figsize=(12, 9), layout="constrained")
    for colour, (e, runs) in zip(("C0", "C1", "C2"), smooth.items(), strict=True):
        draw_smooth(axes[:, 0], colour, e, runs)
    for colour, ((e, beta), result) in zip(("C0", "C1", "C2"), rough.items(), strict=True):
        draw_rough(axes[:, 1], colour, (e, beta), result)
    names = (
        ("Haff's law", "$T/T_0$", "ln T over Haff's law with $a_2 = 0$"),
        ("Rough spheres", "$R = T_{rot}/T_{tr}$", "R over mean field - 1 [%]"),
    )
    for column, (title, top, bottom) in enumerate(names):
        axes[0, column].set(title=title, ylabel=f"{top} [1]")
        axes[1, column].set(ylabel=bottom if "%" in bottom else f"{bottom} [1]")
        for axis in axes[:, column]:
            axis.set_xlabel("C, collisions per ball [1]")
            axis.grid(alpha=0.3)
    axes[0, 0].set_yscale("log")
    for style, label in (("-", "mean field"), ("--", "direct simulation")):
        axes[0, 1].plot([], [], style, color="grey", label=label)
    axes[0, 0].legend(fontsize=9)
    axes[1, 0].legend(fontsize=9)
    axes[0, 1].legend(fontsize=9, loc="center right", bbox_to_anchor=(1, 0.57))
    case.save(figure)
    plt.close(figure)


def draw_smooth(axes, colour, e, runs):
    counts = np.arange(2, 43, 2.5)
    logs = np.array([np.interp(counts, r["count"], np.log(r["temperature"])) for r in runs])
    mean, error = mean_and_error(logs)
    haff = -(1 - e**2) / 3 * counts
    loss = cooling_state(e)[2]
    axes[0].plot(counts, np.exp(haff * loss), color=colour, label=f"theory, e = {e:g}")
    axes[0].plot(counts, np.exp(mean), "o", ms=4, color=colour, label=f"millsim, e = {e:g}")
    # Theory is of the cooling state: it starts from millsim where that is reached
    start = np.interp(RELAXED, counts, mean - haff)
    late = counts[counts >= RELAXED]
    axes[1].plot(
        late,
        start - (1 - e**2) / 3 * (loss - 1) * (late - RELAXED),
        color=colour,
        label=f"theory with $a_2$, $a_3$, e = {e:g}",
    )
    axes[1].errorbar(
        counts,
        mean - haff,
        error,
        fmt="o",
        ms=4,
        capsize=2,
        color=colour,
        label=f"millsim, e = {e:g}",
    )


def draw_rough(axes, colour, pair, result):
    name = f"e = {pair[0]:g}, $\\beta_0$ = {pair[1]:g}"
    (mean, error), (truth, _) = result["millsim"], result["oracle"]
    fine = np.linspace(0, COUNTS[-1], 200)
    axes[0].plot(fine, mean_field(*pair, fine)[1], color=colour)
    field = result["mean_field"][1]
    for axis, scale, shift in ((axes[0], 1, 0), (axes[1], 100 / field, -100)):
        axis.plot(COUNTS, truth[1] * scale + shift, "--", color=colour)
        axis.errorbar(
            COUNTS,
            mean[1] * scale + shift,
            error[1] * scale,
            fmt="o",
            ms=4,
            capsize=2,
            color=colour,
            label=f"millsim, {name}",
        )
