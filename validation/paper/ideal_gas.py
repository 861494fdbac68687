"""The ideal gas with which the paper verifies its program, from 0.06 to 0.09 s as in its Figure 3."""

import h5py
import numpy as np
from gas.check import LEFT, LEVEL, THIN, of_velocities, p_value, residuals, temperature
from study_case import ROOT

GAS = "The speeds in an ideal gas of elastic balls agree with theory in chi-square tests at level 0.9"
SEEDS = 40
WORDS = {
    "speed": "absolute speeds",
    "relative": "relative speeds",
    "impact": "normal impact speeds",
}


def one(path, random):
    """p-values of one gas at 0.09 s, of its impacts from 0.06 s on, and their mean speed over Rayleigh's."""
    with h5py.File(path) as file:
        t, _ = temperature(file)
        velocity = file["particles/trajectory/velocity/value"][-1].astype(float)
        log = file["impacts"]
        kind = list(log.attrs["kinds"]).index("ball_ball")
        taken = (log["kind"][:] == kind) & (log["time"][:] >= 0.06)
        v = log["normal_speed"][:][taken]
    found = of_velocities(velocity, t, random)
    found["impact"] = residuals(-np.expm1(-(v[::THIN] ** 2) / (4 * t)))
    p_values = {key: float(p_value(found[key], LEFT[key])) for key in WORDS}
    return p_values | {"mean": float(v.mean() / np.sqrt(np.pi * t))}


def check(case):
    def all_of_it():
        random = np.random.default_rng(1)
        found = {}
        for seed in range(1, SEEDS + 1):
            path = case.run(
                ROOT / "input" / "gas.ini", output="gas.h5", run__seed=seed, run__time="0.09 s",
                run__sample_from="0.06 s", output__impacts="all", output__frames="0.09 s",
            )  # fmt: skip
            for key, value in one(path, random).items():
                found.setdefault(key, []).append(value)
        return found

    found = {key: np.array(values) for key, values in case.kept("gas", all_of_it).items()}
    passed = np.concatenate([found[key] >= 1 - LEVEL for key in WORDS])
    case.ask(
        GAS, f"0.06 to 0.09 s, {SEEDS} seeds: fraction of {len(passed)} tests that passed "
        f"({', '.join(WORDS.values())})",
        passed.mean(), expected=LEVEL, band=0.1, error=np.sqrt(LEVEL * (1 - LEVEL) / len(passed)),
    )  # fmt: skip
    case.ask(
        GAS, "0.06 to 0.09 s: ratio of the mean normal impact speed to that of Rayleigh's distribution", found["mean"],
        expected=1, band=0.005,
    )  # fmt: skip
    case.tell("The validation case [gas](../gas/README.md) is more exact: 4866 tests of 40 longer runs.")
