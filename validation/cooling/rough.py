"""Rough spheres: how velocities and spins share the energy while both cool."""

import h5py
import numpy as np
from cooling.common import (
    BALLS,
    COUNTS,
    LENGTH,
    RADIUS,
    at_counts,
    collisions,
    mean_and_error,
    write_start,
)
from cooling.direct_simulation import FREE_PATH, FRICTION, direct_simulation
from scipy.integrate import solve_ivp

ROUGH = {(0.95, 0.9): 2.9, (0.9, 0.5): 5.0, (0.8, -0.5): 5.4}  # until 20 collisions per ball
ROUGH_SEEDS = 20
# Boltzmann's equation is the limit of many balls in a cube of the mean free path; here there are 140
DILUTION = np.pi * RADIUS**2 * LENGTH / (BALLS * FREE_PATH**3)
ORACLE_RUNS = 4


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
    source = "direct simulation Monte Carlo with the same contact law and walls"
    for row, what in enumerate(("ln T_tr", "R = T_rot / T_tr")):
        case.claim(
            f"rough spheres, {name}: {what} at C = {COUNTS[-1]:g} collisions per ball",
            mean[row, -1],
            truth[row, -1],
            band[row, -1],
            error=error[row, -1],
            against=source,
            headline=beta == 0.5 and row == 1,
        )
        case.bound(
            f"rough spheres, {name}: {what}, C = {COUNTS[0]:g} to {COUNTS[-1]:g}, "
            "largest deviation divided by its band",
            np.abs((mean - truth) / band)[row].max(),
            1,
            against=source,
        )
    field = result["mean_field"][1]
    worst = np.abs(truth[1] / field - 1).argmax()
    case.claim(
        f"rough spheres, {name}: relative deviation of R from Gaussian mean-field theory where it is largest, "
        f"C = {COUNTS[worst]:g}",
        100 * (mean[1, worst] / field[worst] - 1),
        100 * (truth[1, worst] / field[worst] - 1),
        100 * band[1, worst] / field[worst],
        error=100 * error[1, worst] / field[worst],
        unit="%",
        against="deviation of the direct simulation; mean-field theory: Huthmann and Zippelius 1997",
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
