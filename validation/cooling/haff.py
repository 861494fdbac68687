"""Smooth spheres: Haff's law, and the shape of the velocities' distribution."""

import functools

import h5py
import numpy as np
from cooling.common import BALLS, collisions, mean_and_error, write_start
from scipy.optimize import fsolve
from scipy.special import eval_genlaguerre, roots_genlaguerre

RELAXED = 8.0  # collisions per ball after which the shape of the distribution is its own

SMOOTH = {0.95: 4.9, 0.9: 7.4, 0.8: 17.0}  # restitution: seconds until some 45 collisions per ball
SMOOTH_SEEDS = 16
# What theory leaves out: a4 and beyond, 1/N, velocities that go together over a mean free path
RATE_BIAS = 5e-4  # of the rate
SHAPE_BIAS = 6e-4  # of a2, absolute


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
            f"Haff's law, e = {e:g}: rate of cooling, -d ln T / dC",
            rate,
            theory,
            4 * error + RATE_BIAS * theory,
            error=error,
            against="(1 - e^2)(1 + a2/4 + a3/32)/3, Haff 1983 with Sonine corrections",
            headline=e == 0.9,
        )
        shape, error = mean_and_error(np.array([r["shape"] for r in results]))
        case.claim(
            f"a2 from the fourth moment of the velocities, e = {e:g}",
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
        "ratio of the measured a2 to the theoretical a2, e = 0.95, 0.9, 0.8 together",
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
        "effect of the shape of the distribution on the rate of cooling: "
        "ratio of the measured to the theoretical effect, e = 0.95, 0.9, 0.8 together",
        ratio,
        1,
        4 * error + RATE_BIAS / np.abs(shift).mean(),
        error=error,
        against="a2/4 + a3/32; of a2/4, 3/16 a2 from the loss per time, 1/16 a2 from the collision rate",
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
