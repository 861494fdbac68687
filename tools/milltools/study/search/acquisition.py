"""Chooses the next design to run from all results so far: first a few spread points, then designs with an expected
improvement, and at the end again the designs that may be the best.

    start     the first points of a scrambled Sobol sequence
    search    the knowledge gradient for correlated beliefs (Frazier, Powell & Dayanik, INFORMS J. Comput. 21 (2009)
              599): the expected increase of the best expected value by one more noisy run. It includes the noise of a
              run, so it also shows when to run a design again. For unfinished runs the value that the model expects
              is used (kriging believer: Ginsbourger, Le Riche & Carraro 2010)
    confirm   the last fifth of the runs: the best design or its most likely rival, whichever is known less well, is
              run with another seed, until no rival is left in doubt

A capped run cost its whole budget and a failed run gave no result, so the search avoids designs near both: the gradient
is multiplied by the expected share of good runs, which is 1 far away from them. A failed design is not run again. A
capped design is never the leader if another design has a value.

Requirements such as `power <= 225 W` have a Gaussian process each. The gradient counts only designs that are expected
to meet them as the best, and is multiplied by the probability that a design meets them (Gardner et al., Bayesian
optimization with inequality constraints, ICML 2014). Until one is expected to, the most probable one is run. All
choices are functions of the runs, the seed and
the number of the run: a restart changes nothing.
"""

import collections
import dataclasses
import math

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.stats import norm, qmc
from sklearn.gaussian_process.kernels import Matern

from milltools.base.errors import UserError
from milltools.study.search.gp import ALIKE, REACH, Surface, candidates
from milltools.study.search.space import Space

CONFIRM = 0.2  # of the runs, at the end
LISTED = 1000  # designs of a space up to which each is evaluated
MOST_POINTS = 2**16  # of the spread ones, where few meet what is required of keys
CLOUD = 512  # designs evaluated first in a larger space
HEADS, NEIGHBOURS = 4, 64  # the best of these, and the number of designs around each, for each of STEPS
STEPS = (0.1, 0.03, 0.01)  # of a key's range
NORMAL = np.polynomial.hermite_e.hermegauss(21)  # places and weights
NORMAL = (NORMAL[0], NORMAL[1] / NORMAL[1].sum())
REPELLED = 0.3  # largest distance at which a capped or failed run has an effect, in the unit cube


@dataclasses.dataclass(frozen=True)
class Tried:
    """A run: its design; value and standard error (NaN: unknown); done, capped, failed, or running; for every
    requirement by how much it is violated (below 0: met), with its standard error."""

    design: tuple
    value: float = math.nan
    error: float = math.nan
    status: str = "done"
    excess: tuple = ()


@dataclasses.dataclass(frozen=True)
class Budget:
    """Largest number of runs, smallest number of runs per design, whether to maximise, and the seed."""

    runs: int
    replicates: int = 1
    maximise: bool = True
    seed: int = 1

    def start(self, space: Space) -> int:
        """Designs of the first, spread points."""
        return max(1, min(4 + 2 * len(space), self.runs // (3 * self.replicates)))

    @property
    def confirm_from(self) -> int:
        """Number of the first run (from 0) of the last part, where known designs are repeated."""
        return self.runs - max(2, round(CONFIRM * self.runs)) if self.runs > 4 else self.runs


def choose(space: Space, runs: list[Tried], budget: Budget) -> tuple | None:
    """The design of the next run (number len(runs)); None if the optimum is known well enough to stop."""
    number = len(runs)
    again = unfinished(runs, budget.replicates)
    if again is not None:
        return again
    good = [r for r in runs if math.isfinite(r.value)]
    asked = list(dict.fromkeys(r.design for r in runs))
    if len(asked) < budget.start(space) or len({r.design for r in good}) < 2:
        return spread(space, asked, budget)
    generator = np.random.default_rng([budget.seed, number])
    surface = fit(space, good, budget)
    pending = [r.design for r in runs if r.status == "running"]
    if pending:
        surface = surface.believing(pending)
    meets = requirements(space, good, budget)
    if number >= budget.confirm_from:
        return rival(surface, runs, pending, meets)
    return _search(space, surface, runs, generator, meets)


def fit(space: Space, runs: list[Tried], budget: Budget) -> Surface:
    """The surface through the runs."""
    columns = zip(*((r.design, r.value, r.error) for r in runs))
    return Surface(space, *columns, budget.maximise, budget.seed)


def certain(designs) -> np.ndarray:
    """The probability to meet no requirement at all."""
    return np.ones(len(designs))


def requirements(space: Space, runs: list[Tried], budget: Budget):
    """A function of designs: the probability that each of them meets all requirements."""
    fits = []
    for columns in zip(*(r.excess for r in runs)):
        excess, error = zip(*columns)
        if not np.isfinite(excess).any():  # no results are kept in a table of an earlier version
            continue
        fits.append(Surface(space, [r.design for r in runs], excess, error, False, budget.seed))

    def probability(designs):
        found = certain(designs)
        for fit_ in fits:
            mean, spread = fit_.predict(designs)
            found = found * norm.cdf(-mean / np.maximum(spread, 1e-300))
        return found

    return probability


def eligible(runs: list[Tried], meets=certain) -> list[tuple]:
    """The designs among which the best is chosen: of those expected to meet the requirements, if there are any."""
    found = candidates([r.design for r in runs], [r.value for r in runs], [r.status for r in runs])
    return [design for design, chance in zip(found, meets(found)) if chance >= 0.5] or found


def rival(surface: Surface, runs: list[Tried], pending=(), meets=certain) -> tuple | None:
    """The design to run once more to find out which one is best, or None if this is clear: the leader was run
    twice and every other is worse beyond doubt, or certainly within 2 % of it."""
    among = eligible(runs, meets)
    leader = surface.best(among)
    if sum(r.design == leader and r.status in ("done", "running") for r in runs) < 2:
        return leader
    others = [design for design in among if design != leader]
    if not others:
        return None
    gap, spread = surface.gaps(others, leader)
    value = abs(surface.predict([leader])[0][0])
    doubt = (gap <= REACH * spread) & (gap + REACH * spread >= ALIKE * value)
    if not doubt.any():
        return leader if leader in pending else None
    better = norm.cdf(-gap / np.maximum(spread, 1e-300)) * doubt
    challenger = others[int(np.argmax(better))]
    _, spreads = surface.predict([leader, challenger])
    return leader if spreads[0] > spreads[1] else challenger


def gain(surface: Surface, designs, among=slice(None)) -> np.ndarray:
    """The knowledge gradient of one more run at each design, in the objective's unit: the expected increase of the best
    expected value of the designs `among` (a mask). The run moves all means by `shift` times a standard normal number;
    Gauss-Hermite quadrature integrates over this number."""
    mean, cov = surface.covariance(designs)
    mean = surface.sign * mean
    shift = cov / np.sqrt(np.diag(cov) + surface.noise**2 + 1e-300)
    mean, shift = mean[among], shift[among]
    risen = sum(weight * (mean[:, None] + z * shift).max(axis=0) for z, weight in zip(*NORMAL))
    return risen - mean.max()


def soundness(surface: Surface, runs: list[Tried], designs) -> np.ndarray:
    """Expected share of runs at designs that are neither capped nor failed; 1 if nothing is known."""
    ended = [r for r in runs if r.status != "running"]
    bad = np.array([r.status in ("capped", "failed") for r in ended], float)
    if not bad.any() or bad.all():
        return np.ones(len(designs))
    kernel = Matern(np.minimum(surface.process.kernel_.k2.length_scale, REPELLED), nu=2.5)
    codes = surface.space.encode([r.design for r in ended])
    factor = cho_factor(kernel(codes) + 0.05 * np.eye(len(codes)))
    expected = kernel(surface.space.encode(designs), codes) @ cho_solve(factor, bad)
    return 1 - np.clip(expected, 0, 1)


def unfinished(runs, replicates) -> tuple | None:
    """The first design that needs more runs; a failed design needs none."""
    counts, failed = collections.Counter(r.design for r in runs), {r.design for r in runs if r.status == "failed"}
    return next((design for design, count in counts.items() if count < replicates and design not in failed), None)


def spread(space: Space, known, budget: Budget, skip=0) -> tuple:
    """The next point of the Sobol sequence that is not among the known designs, or one `skip` points later."""
    known = set(known)
    count = 2 ** max(6, math.ceil(math.log2(2 * len(known) + 2)))
    while True:
        points = space.allowed(space.at(qmc.Sobol(len(space), seed=budget.seed).random(count)))
        fresh = [point for point in dict.fromkeys(points) if point not in known]
        if fresh or not space.met or count >= MOST_POINTS:
            break
        count *= 2
    if not points:
        raise UserError("no design was found that meets what is required of keys")
    return fresh[skip % len(fresh)] if fresh else points[len(known) % len(points)]


def _search(space, surface, runs, generator, meets=certain) -> tuple:
    failed = {r.design for r in runs if r.status == "failed"}

    def by_worth(designs):
        chance = meets(designs)
        among = chance >= 0.5
        worth = (gain(surface, designs, among) * chance if among.any() else chance) * soundness(surface, runs, designs)
        return [designs[i] for i in np.argsort(-worth, kind="stable")]

    designs = space.everything(LISTED)
    if designs is not None:
        designs = space.allowed(designs)
    else:
        tested = surface.tested()
        shares = qmc.Sobol(len(space), seed=generator).random(CLOUD)
        designs = list(dict.fromkeys(tested + space.allowed(space.at(shares))))
        for step in STEPS:
            heads = by_worth(designs)[:HEADS] + [surface.best()]
            near = space.allowed(space.near(h, step, generator) for h in heads for _ in range(NEIGHBOURS))
            designs = list(dict.fromkeys(tested + heads + near))
    return next((design for design in by_worth(designs) if design not in failed), surface.best())
