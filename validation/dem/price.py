"""Computing cost of the two programs: processor seconds per simulated second of the steady reference mill."""

import os

import numpy as np
from runs import LABELS, STIFFNESSES, say, sets
from steady import DECK, SETTINGS, soft_run, stiff_run

from milltools.dem.model import Model, tangential_damping
from milltools.dem.soft_mill import PRICED, SoftMill
from milltools.read.deck import Deck
from milltools.read.runfile import Run

ROUNDS = 5
BEGIN, END = 0.1, 0.5  # [s] of millsim's steady mill
SPAN = {"1e9": 0.02, "steel": 0.004}  # [s] simulated by LIGGGHTS in one round, twice over
LEAST = {"1e9": (18, ""), "steel": (120, ", aim 200")}


def check(case):
    say("    computing cost")
    paths = {"1e9": soft_run(case), "steel": stiff_run(case)[0]}
    load = os.getloadavg()[0]
    for modulus, path in paths.items():
        measure(case, modulus, path)
    case.tell(f"Load of the machine at the start of this part: {load:.1f}, on {os.cpu_count()} cores.")


def measure(case, modulus, path):
    """millsim is so many times as cheap as LIGGGHTS at a modulus (key of STIFFNESSES), from the last frame of its run
    at `path` on.

    Like with like: the steady mill alone, what two runs of different length differ by, so neither start nor end
    counts; no output of either, and no statistics, which LIGGGHTS has none of. What millsim takes for a run with
    all of that is told beside it. In turn, and of each the cheapest round counts: what else the machine does
    can only add to it.
    """
    checked = Deck.check(DECK, sets(SETTINGS))
    with Run(path) as run:
        state = [run.frame(-1, name).astype(float) for name in ("position", "velocity", "angular_velocity")]
        time = run.frame_times()[-1]
    mill = SoftMill(checked, state, tangential_damping(checked)[0], None)
    mill.model, mill.time = Model(checked, STIFFNESSES[modulus]), time
    steps = SPAN[modulus] / mill.model.time_step / PRICED
    soft, hard, whole = [], [], []
    for k in range(ROUNDS):
        say(f"    computing cost at {LABELS[modulus]}, round {k + 1} of {ROUNDS}")
        soft.append(mill.price(steps))
        with Run(case.run(DECK, output="price.h5", **SETTINGS)) as run:
            whole.append(run.cost)
        hard.append(steady_cost(case))
    ratio, (least, aim) = min(soft) / min(hard), LEAST[modulus]
    # how well the least of the rounds is known: what the second is above it
    error = np.hypot(*(np.diff(np.sort(costs)[:2])[0] / min(costs) for costs in (soft, hard)))
    case.bound(
        f"ratio of the processor time of millsim to that of LIGGGHTS at {LABELS[modulus]}; "
        f"LIGGGHTS needs {ratio:.0f} times as much",
        100 / ratio,
        100 / least,
        error=100 / ratio * error,
        unit="%",
        against=f"at least {least} times as much{aim}; {min(soft):.4g} and {min(hard):.3g} CPU s per simulated second",
        headline=True,
    )
    case.tell(
        f"CPU seconds per simulated second at {LABELS[modulus]}, one value per round: LIGGGHTS "
        + ", ".join(f"{cost:.4g}" for cost in soft)
        + "; millsim "
        + ", ".join(f"{cost:.3g}" for cost in hard)
        + f". With start-up, statistics, frames and output file, millsim takes {min(whole):.3g} CPU s per simulated "
        f"second of a run of {END} s; LIGGGHTS without any of them needs {min(soft) / min(whole):.0f} times as much."
    )


def steady_cost(case):
    """Processor seconds of millsim for one simulated second of the steady mill, without output and statistics."""
    taken = []
    for end in (BEGIN, END):
        settings = {
            "run__time": f"{end} s",
            "run__sample_from": f"{end - 1e-6} s",
            "output__frames": "0 s",
        }
        with Run(case.run(DECK, output="price.h5", **{**SETTINGS, **settings})) as run:
            taken.append(float(run.read("run/cpu_time")))
    return (taken[1] - taken[0]) / (END - BEGIN)
