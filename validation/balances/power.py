"""Power of the rotor against what impacts lose, and against its torque."""

import numpy as np
from balances.common import steady_error


def power(case, mill):
    time, work = mill.series("rotor_work")
    energy = mill.total(["kinetic_energy", "rotational_energy", "potential_energy"])
    kinds = mill.file["observables/dissipation"]
    loss = mill.total([f"dissipation/{kind}" for kind in kinds])
    rows = mill.window(time)
    imbalance = np.abs(work - work[0] - (energy - energy[0]) - (loss - loss[0]))
    case.bound(
        "energy balance: largest error of all rows of the series, divided by the energy turned over",
        imbalance.max() / mill.summary["run"]["energy_turnover"],
        1e-11,
        against="rotor work = change of energy + losses",
    )
    draw = np.ptp(work[rows]) / mill.duration
    lost = np.ptp(loss[rows]) / mill.duration
    error = steady_error(energy[rows], mill.duration)
    case.claim(
        "power lost in impacts, steady mean",
        lost,
        draw,
        4.0 * error,
        against="power of the rotor",
        error=error,
        unit="W",
        headline=True,
    )
    torque(case, mill, time, work)
    halves(case, mill)
    return time[rows], work[rows], loss[rows], energy[rows]


def torque(case, mill, time, work):
    speed = 1000.0 * 2.0 * np.pi / 60.0
    turned = speed * np.cumsum(mill.series("rotor_torque")[1][1:] * np.diff(time))
    case.bound(
        "sum of rotor torque x speed compared with rotor work: largest error of all rows, divided by the work",
        np.abs(turned - np.diff(work).cumsum()).max() / np.ptp(work),
        1e-12,
        against="power = torque x speed",
    )


def halves(case, mill):
    """Is it steady, and are the blocks' errors right? Both halves draw the same power."""
    blocks = mill.file["statistics/rotor/block_power"][:]
    first, second = np.array_split(blocks, 2)
    error = np.sqrt(sum(half.var(ddof=1) / len(half) for half in (first, second)))
    case.claim(
        "mean power of the rotor in the second half of the window",
        second.mean(),
        first.mean(),
        4.0 * error,
        against="mean power in the first half",
        error=error,
        unit="W",
    )
