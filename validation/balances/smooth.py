"""Forces and torques of a mill with smooth surfaces, from the log."""

import numpy as np
from balances.common import (
    GRAVITY,
    ROTOR,
    claim_weight,
    momentum,
    properties,
    rotor_torque,
    sampling_error,
    steady_error,
)

LAW = (("contact", "restitution"), ("contact", "rebound_floor"))


def smooth(case, mill):
    """Without friction at the surfaces the log has their whole impulses."""
    count, mass, _, inertia = properties(mill)
    weight = np.array([0.0, 0.0, count * mass * GRAVITY])
    kind, place, normal, speed, time = mill.log("kind", "position", "normal", "normal_speed", "time")
    inside = (kind != 0) & (time >= mill.begin) & (time < mill.end)
    law = [float(mill.file["deck"][s][k].asstr()[()].split()[0]) for s, k in LAW]
    impulse = mass * (speed + np.maximum(law[0] * speed, law[1]))
    impulse = (impulse[:, None] * normal.astype(float))[inside]
    kind, place = kind[inside], place[inside].astype(float)
    moments = place[:, 1] * impulse[:, 2] - place[:, 2] * impulse[:, 1]
    force = impulse.sum(axis=0) / mill.duration
    frames, linear, angular, weight_torque = momentum(mill, mass, inertia)
    error = steady_error(linear[:, 2], mill.duration)
    claim_weight(case, "mill with smooth surfaces", force[2], weight[2], error)
    change = (linear[-1] - linear[0]) / mill.duration
    case.bound(
        "force minus weight minus change of momentum: largest component, divided by the weight",
        np.abs(force - weight - change).max() / weight[2],
        1e-7,
        against="momentum balance",
    )
    rotor = rotor_torque(mill)
    case.bound(
        "torque of shaft and blades, computed from the log: relative deviation from that of the series",
        moments[np.isin(kind, ROTOR)].sum() / mill.duration / rotor - 1.0,
        1e-8,
        against="rotor_torque of the series",
    )
    change = (angular[-1] - angular[0]) / mill.duration
    case.claim(
        "smooth drum: torque of the rotor minus change of angular momentum",
        rotor - change,
        -weight_torque,
        sampling_error(mill, weight[2]),
        against="- moment of the weight (from the frames)",
        unit="N m",
        headline=True,
    )
    error = steady_error(angular, mill.duration)
    case.claim(
        "smooth drum: torque of the rotor, steady mean",
        rotor,
        -weight_torque,
        4.0 * error,
        against="- moment of the weight (from the frames)",
        error=error,
        unit="N m",
    )
    bins = np.arange(mill.begin, mill.end + 1e-9, 0.05)
    blocks = [np.histogram(time[inside], bins, weights=impulse[:, 2])[0] / 0.05]
    blocks.append(np.histogram(time[inside], bins, weights=moments)[0] / 0.05)
    return bins[1:], blocks, weight[2], weight_torque
