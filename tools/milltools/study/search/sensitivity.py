"""The influence of each varied key: Sobol indices of an objective of a study, computed with SALib.

The first-order index of a key is the share of the objective's variance over the ranges that disappears if this key is
fixed. The total index is the share that remains if all other keys are fixed (Sobol' 2001; Saltelli et al., Comput.
Phys. Commun. 181 (2010) 259). Each key is assumed to be uniformly distributed over its range, or over the values of
its list, and independent of the others.

    saltelli    the study was planned for it (`method = saltelli`): directly from the runs, with 95 % intervals from
                SALib's bootstrap
    surface     all other studies: from realisations of a Gaussian process through the runs (gp.py); the interval
                includes the uncertainty of the surface and of the sampling (Le Gratiet, Cannamela & Iooss, SIAM/ASA J.
                Uncertainty Quantification 2 (2014) 336)
"""

import math
import warnings

import numpy as np

from milltools.study.plan.designs import saltelli, unit_problem
from milltools.study.plan.ranges import Range
from milltools.study.search import gp
from milltools.study.search.space import Space

BASE = 256  # base points on a surface
BATCHES = 6  # of base points: more batches reduce the effect of their random choice
REALISATIONS = 10  # of the surface, for each of them
RESAMPLES = 30  # of the base points, for each realisation
MOST_POINTS = 2000  # of one realisation of a surface: their covariance is a full matrix


def indices(table, objective=0, seed=0, surface=None) -> list[tuple]:
    """For each varied key (key, first, first_ci, total, total_ci, method): Sobol indices of one of the objectives (by
    number; None: another one, with its surface) with the half widths of their 95 % intervals, and "saltelli" or
    "surface". Empty if fewer than two keys have more than one value, or if there are too few runs (fewer than three
    designs per key). A caller that has a surface through the runs can pass it."""
    space = Space(table.meta["vary"])
    active = [k for k, r in enumerate(space.ranges) if r.values is None or len(r.values) > 1]
    if len(active) < 2:
        return []
    found = _planned(table, space, objective, seed)
    method = "saltelli"
    if found is None:
        found, method = _surface(table, space, active, objective, seed, surface), "surface"
    if found is None:
        return []
    return [(key, *map(float, row), method) for key, row in zip(space.keys, found)]


def lines(table) -> list[str]:
    """The indices of the first objective as text; empty if they are not known."""
    found = indices(table)
    if not found:
        return []
    how = "the runs" if found[0][5] == "saltelli" else "a fit through the runs"
    width = max(len(row[0]) for row in found)
    text = [f"which key matters: share of the variance (Sobol indices with 95 % intervals, from {how}):", ""]
    text.append(f"    {'':<{width}}  {'alone':<16}with interactions")
    for key, first, first_ci, total, total_ci, _ in found:
        alone, whole = f"{first:.2f} +- {first_ci:.2f}", f"{total:.2f} +- {total_ci:.2f}"
        text.append(f"    {key:<{width}}  {alone:<16}{whole}")
    return [*text, ""]


def _analyse(size, values, resamples, seed):
    """SALib's indices of values at saltelli(size, ...): shape (size, 4)."""
    from SALib.analyze import sobol

    with warnings.catch_warnings():  # a constant gives a division by zero variance; SALib takes seed 0 as no seed
        warnings.simplefilter("ignore")
        found = sobol.analyze(
            unit_problem(size), values, calc_second_order=False, num_resamples=resamples, seed=seed + 1
        )
    return np.array([found[name] for name in ("S1", "S1_conf", "ST", "ST_conf")]).T


def _planned(table, space, objective, seed):
    """From the runs of a study with `method = saltelli`; None for other methods, or if a design has no value (yet)."""
    meta, frame = table.meta, table.frame()
    if meta.get("method") != "saltelli" or objective is None:
        return None
    path = meta["objectives"][objective]["path"]
    good = frame[frame["status"] != "failed"]
    values = good.groupby(space.keys)[path].mean().to_dict()
    parts = [Range.of(entry) for entry in meta["vary"]]
    shares = saltelli(len(parts), meta["samples"], meta["seed"])
    designs = [tuple(r.at(float(u)) for r, u in zip(parts, row)) for row in shares]
    found = np.array([values.get(design, math.nan) for design in designs])
    if not np.all(np.isfinite(found)) or not np.ptp(found):
        return None
    return _analyse(len(parts), found, 10 * RESAMPLES, seed)


def _surface(table, space, active, objective, seed, surface=None):
    """From realisations of the surface through the runs; keys with only one value have no share."""
    frame = table.frame()
    designs = frame.loc[frame["status"] != "failed", space.keys].drop_duplicates()
    if len(designs) < 3 * len(active) + 1:
        return None
    if surface is None:
        try:
            surface, _ = gp.of_table(table, objective)
        except ValueError:
            return None
    if not np.ptp(surface.values):
        return None
    size, base = len(active), BASE
    while base > 32 and base * (size + 2) > MOST_POINTS:
        base //= 2
    each = []
    for batch in range(BATCHES):
        shares = np.full((base * (size + 2), len(space)), 0.5)
        shares[:, active] = saltelli(size, base, seed + batch)
        draws = surface.realisations(space.at(shares), REALISATIONS, seed + batch)
        each += [_analyse(size, draw, RESAMPLES, seed + batch) for draw in draws]
    each = np.array(each)
    sampling = np.mean((each[:, :, [1, 3]] / gp.REACH) ** 2, axis=0)
    left_open = np.maximum(each[:, :, [0, 2]].var(axis=0, ddof=1) - sampling, 0)
    ci = gp.REACH * np.sqrt(left_open + sampling / BATCHES)
    mean = each[:, :, [0, 2]].mean(axis=0)
    found = np.zeros((len(space), 4))
    found[active] = np.column_stack([mean[:, 0], ci[:, 0], mean[:, 1], ci[:, 1]])
    return found
