"""Computing cost of one simulated second of the mill."""

import json

import numpy as np
from log import REFERENCE, SEEDS
from speeds import SMOOTH

PRICE = "One simulated second of the mill takes no more than six minutes of computing"
MILLS = {"the reference mill, with friction": {}, "the reference mill, without friction": SMOOTH}


def check(case):
    def all_of_it():
        found = {}
        for words, settings in MILLS.items():
            for seed in SEEDS[:3]:
                path = case.run(
                    REFERENCE, output="price.h5", run__seed=seed, run__time="0.2 s", run__sample_from="0.1 s",
                    output__frames="0 s", **settings,
                )  # fmt: skip
                run = json.loads(path.with_suffix(".json").read_text())
                found.setdefault(words, []).append(run["run"]["cpu_time"] / run["time"])
        return found

    for words, values in case.kept("price", all_of_it).items():
        case.ask(
            PRICE,
            f"CPU time per simulated second, {words}, first 0.2 s",
            values,
            below=360,
            unit="s",
        )
        case.tell(f"Six minutes on a machine of 2007 are {360 / np.mean(values):.0f} times this CPU time ({words}).")
