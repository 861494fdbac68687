"""Means, errors and confidence of the designs of a study.

A run tells the standard error s of its value (block averages); replicates tell their scatter. Both are used: the mean of k runs
has the error sqrt(sum s^2)/k, enlarged for all designs alike when replicates of designs scatter more than their errors say
(the scale factor of the Particle Data Group, Review of Particle Physics, section 5.2.2: sqrt(chi^2/dof) where above 1); then
Student's t with these degrees of freedom holds. Where runs have no errors, the scatter of the replicates is pooled over all designs,
relative to their means (the pure error of Box, Hunter & Hunter, Statistics for Experimenters, 2005, section 5.6): two or three replicates
of one design often agree by chance. Student's t then has as many degrees of freedom as there are runs less designs.
"""

import dataclasses
import functools
import math

import numpy as np
from scipy import integrate, optimize, stats

LEVEL = 0.95


@dataclasses.dataclass(frozen=True)
class Means:
    """Per design: mean, standard error (NaN if unknown), degrees of freedom of the latter (inf: normal), runs that made it.
    `factor` is by how much the errors were enlarged."""

    mean: np.ndarray
    error: np.ndarray
    dof: np.ndarray
    runs: np.ndarray
    factor: float = 1.0

    @property
    def half(self) -> np.ndarray:
        """Half width of the 95 % confidence interval of each mean; NaN if unknown."""
        return stats.t.ppf((1 + LEVEL) / 2, self.dof) * self.error


def estimate(group, value, error, count) -> Means:
    """Runs (group 0..count-1, value, standard error; NaN: not known) -> `Means` of each group."""
    good = np.isfinite(value)
    group, value, error = group[good], value[good], error[good]
    runs = np.bincount(group, minlength=count)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(runs > 0, np.bincount(group, value, count) / runs, np.nan)
        told = np.sqrt(np.bincount(group, error**2, count)) / runs
    off, known = value - mean[group], np.isfinite(told) & (told > 0)
    factor, dof = 1.0, np.full(count, np.inf)
    pool = (known & (runs > 1))[group]
    if pool.any():
        free = int((runs[known & (runs > 1)] - 1).sum())
        ratio = math.sqrt(float(np.sum((off[pool] / error[pool]) ** 2)) / free)
        if ratio > 1:
            factor, dof = ratio, np.full(count, float(free))
    silent = ~known & (runs > 1)
    scatter = np.full(count, np.nan)
    if silent.any():
        # absolute where values have both signs
        oriented = np.all(mean[runs > 0] > 0) or np.all(mean[runs > 0] < 0)
        size = np.abs(mean) if oriented else np.ones(count)
        pool, free = silent[group], int((runs[silent] - 1).sum())
        share = math.sqrt(float(np.sum((off[pool] / size[group][pool]) ** 2)) / free)
        scatter[runs > 0] = share * size[runs > 0] / np.sqrt(runs[runs > 0])
        dof[~known] = free
    return Means(mean, np.where(known, factor * told, scatter), dof, runs, factor)


@functools.lru_cache
def subset_quantile(count: int, level: float = LEVEL) -> float:
    """How many standard errors of a difference the best of `count` designs may lie below the one that looks best:
    Gupta, Technometrics 7 (1965) 225, eq. 2.4, for equal known errors; 1.64 for two designs, 3.3 for 400."""
    if count < 2:
        return 0.0

    def lacking(d):
        def density(z):
            return stats.norm.pdf(z) * stats.norm.cdf(z + d * math.sqrt(2)) ** (count - 1)

        return integrate.quad(density, -9, 9, limit=200)[0] - level

    return optimize.brentq(lacking, 0.0, 12.0)


def best_of(found: Means, sign: int, usable) -> int | None:
    """The design that looks best among the usable ones, None if there is none."""
    score = np.where(usable & np.isfinite(found.mean), sign * found.mean, -np.inf)
    return int(np.argmax(score)) if np.isfinite(score).any() else None


def not_told_apart(found: Means, sign: int, usable) -> np.ndarray:
    """Which designs hold the truly best one with 95 % confidence (Gupta's subset; errors may differ, as in Hsu, Ann. Statist. 9
    (1981) 1026). A design without known error counts by its mean alone."""
    best = best_of(found, sign, usable)
    if best is None:
        return np.zeros(len(found.mean), bool)
    inside = usable & np.isfinite(found.mean)
    quantile = subset_quantile(int(inside.sum()))
    dof = float(found.dof[best])
    if math.isfinite(dof):  # the same tail under Student's t
        quantile = stats.t.isf(stats.norm.sf(quantile), dof)
    error = np.nan_to_num(found.error)
    reach = quantile * np.hypot(error, error[best])
    with np.errstate(invalid="ignore"):
        return inside & (sign * (found.mean[best] - found.mean) <= reach)


def pareto(scores: np.ndarray) -> np.ndarray:
    """Which lines of scores (designs x objectives, all to be large) no other line beats: as good in all, better in
    one. Lines with NaN are out. Sorted by the first, a line is kept out by those before it: n log n for two, n k for more."""
    front = np.zeros(len(scores), bool)
    sound = np.flatnonzero(np.isfinite(scores).all(axis=1))
    order = sound[np.lexsort([-scores[sound, k] for k in reversed(range(scores.shape[1]))])]
    kept = np.empty((0, scores.shape[1]))
    for line in order:
        here = scores[line]
        beaten = (kept >= here).all(axis=1) & (kept > here).any(axis=1)
        if not beaten.any():
            front[line] = True
            kept = np.vstack([kept, here])
    return front
