"""The plan of a study: which designs are run, as dicts of SI values by key.

    grid      every combination of the values; the last key changes fastest
    lhs       Latin hypercube (McKay, Beckman & Conover 1979), `samples` designs
    sobol     scrambled Sobol sequence (Sobol' 1967; Owen 1998), `samples` designs; more samples continue the sequence
    saltelli  the designs that Sobol indices need (Saltelli 2010), from `samples` base points: sensitivity.py

Random designs follow from [study] seed. Equal designs (possible with whole numbers and words) are run once, those that
do not meet a requirement on keys never.
"""

import itertools
import math
import warnings

from milltools.base.errors import UserError
from milltools.base.text import plural

MOST = 1_000_000


def plan(study) -> list[dict]:
    """All designs that meet the requirements on keys, in order; `study.left_out` are the others."""
    keys, rules = [r.key for r in study.vary], study.formulas.rules
    if rules and study.method == "saltelli":
        text = f"'{rules[0]}' is of keys: 'method = saltelli' needs all designs; use sobol"
        raise study.fault("require", text, rules[0])
    if study.method == "grid":
        found = _grid(study)
    else:
        points = _points(study)
        found = dict.fromkeys(tuple(r.at(float(share)) for r, share in zip(study.vary, point)) for point in points)
    every = [dict(zip(keys, values, strict=True)) for values in found]
    kept = [design for design in every if study.formulas.met(design)] if rules else every
    study.left_out = len(every) - len(kept)
    if not kept:
        raise study.fault("require", f"none of {plural(len(every), 'design')} meets {' and '.join(rules)}", rules[0])
    return kept


def _grid(study):
    for r in study.vary:
        if r.values is None:
            raise study.fault(r.key, "expected 'step' or 'in' behind the range: 'method = grid' needs single values")
    count = math.prod(len(r.values) for r in study.vary)
    if count * study.replicates > MOST:
        raise UserError(f"{study.file}: [vary]: {count} designs are more than {MOST}")
    return itertools.product(*(r.values for r in study.vary))


def _points(study):
    """Points in the unit cube (N, number of keys)."""
    count, size = study.samples, len(study.vary)
    if study.method == "saltelli":
        return saltelli(size, count, study.seed)
    from scipy.stats import qmc

    if study.method == "lhs":
        return qmc.LatinHypercube(d=size, seed=study.seed).random(count)
    with warnings.catch_warnings():  # a number that is not a power of two is valid, but less balanced
        warnings.simplefilter("ignore", UserWarning)
        return qmc.Sobol(d=size, scramble=True, seed=study.seed).random(count)


def saltelli(size: int, count: int, seed: int):
    """Points (shares 0..1 of the ranges) of a study of `size` keys: `count` base points, rounded to a power of two
    (only then is Sobol's sequence balanced), times size + 2. Equal arguments give equal points."""
    from SALib.sample import sobol

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        base = 2 ** max(0, math.ceil(math.log2(count)))
        return sobol.sample(unit_problem(size), base, calc_second_order=False, seed=seed)


def unit_problem(size) -> dict:
    """A problem of `size` keys between 0 and 1, as SALib takes it."""
    return {"num_vars": size, "names": [str(k) for k in range(size)], "bounds": [[0, 1]] * size}


def jobs(study, designs):
    """Every run of the plan: all designs with the first seed first, then replicate by replicate."""
    for replicate in range(study.replicates):
        for number, values in enumerate(designs):
            yield study.job(number, values, replicate)
