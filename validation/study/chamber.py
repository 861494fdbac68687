"""A free line around the drum, searched for hard impacts per joule: is it better than every wavy chamber?"""

import concurrent.futures
import os
import subprocess

import numpy as np
from study_case import KEPT, ROOT

from milltools.read import expression
from milltools.read.runfile import Run
from milltools.study.plan.job import results_of

HARD, SOFTER, WEAR = "rate_above(1 mJ) / power", "rate_above(0.5 mJ) / power", "wear/ball_drum/sliding / power"
RUNS, SEEDS = 120, tuple(range(1001, 1009))  # no search used these seeds
SHORT = ("run.time=0.3 s", "run.sample_from=0.12 s")  # soft spheres take 15 times as long
SOFT = ("run.spheres=soft", "soft.modulus=10 GPa", *SHORT)
SHAPES = {
    "the best free line": ("chamber", ()),
    "the best wavy chamber": ("wavy", ()),
    "18 buckles of 2.5 mm": ("wavy", ("drum.buckles=18", "drum.buckle_height=2.5 mm")),
    "the smooth drum": ("wavy", ("drum.buckle_height=0 mm",)),
}


def measured(case, seeds, *sets, shapes=tuple(SHAPES)):
    """{shape: HARD, SOFTER and WEAR (3, seeds)} of runs with these overrides."""

    def one(job):
        shape, seed = job
        deck, own = SHAPES[shape]
        path = case.scratch / f"{shape}-{seed}.h5"
        options = [word for text in (*own, *sets, f"run.seed={seed}", "output.frames=0 s") for word in ("-s", text)]
        command = [case.program, "-q", "-f", "-o", path, *options, case.scratch / f"{deck}.ini"]
        subprocess.run(command, check=True, capture_output=True)
        with Run(path) as run:
            results = results_of(run)
            return [float(expression.parsed(text).of(results).value) for text in (HARD, SOFTER, WEAR)]

    jobs = [(shape, seed) for shape in shapes for seed in seeds]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = np.array(list(pool.map(one, jobs))).reshape(len(shapes), len(seeds), 3)
    return {shape: values.T for shape, values in zip(shapes, found)}


def mean(values):
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values))


def gain(better, than):
    """How much larger one mean is [%], and its standard error."""
    (a, da), (b, db) = mean(better), mean(than)
    return 100 * (a / b - 1), 100 * a / b * np.hypot(da / a, db / b)


def check(case):
    for name, file in (("chamber", ROOT / "input" / "chamber.study"), ("wavy", case.folder / "wavy.study")):
        case.study(name, "optimize", "--runs", RUNS, file=file)
        case.mill("study", KEPT / f"{name}.parquet", "--deck", case.scratch / f"{name}.ini")
    case.picture("chamber", "wall", "chamber.png")
    hard = measured(case, SEEDS)
    for shape, (values, softer, wear) in hard.items():
        (a, da), (b, db), (c, _) = mean(values), mean(softer), mean(wear)
        case.tell(
            f"{shape}: {a:.1f} +- {da:.1f} impacts of 1 mJ or more per joule of the rotor's work, {b:.1f} +- {db:.1f} "
            f"of 0.5 mJ; {100 * c:.2f} % of the work is lost by sliding on the drum"
        )
    best, wavy = hard["the best free line"], hard["the best wavy chamber"]
    more, error = gain(best[0], wavy[0])
    case.bound(
        "impacts of 1 mJ or more per joule: how far the 95 % interval of the gain of the best free line over the best "
        f"wavy chamber reaches below 0 (the gain is {more:.1f} %)",
        max(0.0, 1.96 * error - more), 0, error=error, unit="%", against="required: better than every wavy chamber",
        headline=True,
    )  # fmt: skip
    share, error = mean(best[2])
    case.bound(
        "part of the work that is lost by sliding on the best free line", 100 * share, 5, error=100 * error, unit="%",
        against="required by the study",
    )  # fmt: skip
    both = [shape for shape in SHAPES if not shape.startswith("18")]
    soft, short = measured(case, SEEDS[:2], *SOFT, shapes=both), measured(case, SEEDS, *SHORT, shapes=both)
    for shape in both[:2]:
        (a, da), (b, db) = (gain(found[shape][0], found["the smooth drum"][0]) for found in (soft, short))
        case.tell(
            f"{shape}: {b:.1f} +- {db:.1f} % better than the smooth drum; with soft spheres {a:.1f} +- {da:.1f} %"
        )
        case.bound(
            f"{shape}: impacts of 1 mJ or more per joule over the smooth drum, soft spheres (10 GPa) less hard "
            "ones",
            100 * ((100 + a) / (100 + b) - 1), 10, error=float(np.hypot(da, db)), unit="%",
            against="`--soft`: both kinds of spheres", headline=shape == "the best free line",
        )  # fmt: skip
