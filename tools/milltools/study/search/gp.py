"""A Gaussian process through noisy runs: estimates an objective at designs that were not run.

It has a Matern 5/2 kernel with a length for every column of the space (`space.py`). The noise variance of each run is
the square of its standard error, plus a fitted scatter between runs. This scatter covers runs without a known error
and errors that the runs do not include (the random start). Kernel and scatter are at the maximum of the posterior:
marginal likelihood times wide log-normal priors, because forty runs alone cannot distinguish a long length from an
infinite one (Rasmussen & Williams 2006, sections 4.2, 5.4; priors as in Hvarfner, Hellsten & Nardi, ICML 2024).
`Surface` is fitted once. Then it gives the mean and standard deviation at any design, differences between designs, and
`optimum`: the best design with confidence intervals of its value and of its keys.
"""

import contextlib
import copy
import dataclasses
import itertools
import math
import warnings

import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm, qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from threadpoolctl import ThreadpoolController

from milltools.study.search.space import Space

CONFIDENCE = 0.95
REACH = float(norm.ppf((1 + CONFIDENCE) / 2))  # standard errors on either side of an interval
ALIKE = 0.02  # designs this close to the best (share of its value) count as equally good
FLAT = 0.25  # of a key's range: if equally good designs span more, the optimum is called flat
MOST_RUNS = 1500  # of a surface: its time grows with the cube of their number
MOST_FITTED = 200  # of these for fitting kernel and scatter, which takes some hundred evaluations
MOST_ASKED = 2000  # designs evaluated at once: their covariance is a full matrix
JITTER = 1e-10  # of the variance, so that the equations can be solved with equal designs
TRIES = 4  # starts of the search for kernel and scatter
# limit(limits=1) gives linear algebra one thread: more threads do not help with small matrices, and the runs need
# the cores
THREADS = ThreadpoolController()


def candidates(designs, values, statuses) -> list[tuple]:
    """The designs among which the best is chosen, each once: those with a value from a run that was not capped; if
    there are none, all designs with a value."""
    known = [(tuple(d), s) for d, v, s in zip(designs, values, statuses) if math.isfinite(v)]
    done = [design for design, status in known if status == "done"]
    return list(dict.fromkeys(done or [design for design, _ in known]))


def of_table(table, objective=0, seed=0, good=None, allowed=None) -> tuple["Surface", "Optimum"]:
    """The surface through the runs of a table, and its optimum, for one of its objectives (by number). `good` marks the
    rows that meet the requirements, `allowed(designs)` the designs that do. ValueError if no run has a value."""
    frame, meta = table.frame(), table.meta
    about, space = meta["objectives"][objective], Space(meta["vary"])
    designs = list(zip(*(frame[key].tolist() for key in space.keys)))
    values, errors = frame[about["path"]].to_numpy(), frame[f"{about['path']}:error"].to_numpy()
    values = np.where(frame["status"] == "failed", np.nan, values)
    surface = Surface(space, designs, values, errors, about["goal"] == "maximise", seed)
    among = values if good is None else np.where(good, values, np.nan)
    return surface, surface.optimum(candidates(designs, among, frame["status"]), allowed)


@dataclasses.dataclass(frozen=True)
class Interval:
    """The values of one key in the designs that may be the best: low..high, or a list of words."""

    low: float | None
    high: float | None
    words: tuple = ()


@dataclasses.dataclass(frozen=True)
class Optimum:
    """The best design, its value with standard error and 95 % interval (from all runs together), and its place.

    `place`: one Interval per key, of the designs that do not differ significantly from the best at 95 % (each compared
    with the best); `place_share`: their share of the space. `alike`: Intervals of designs expected within 2 % of the
    best; `flat`: keys along which these span a quarter of the range or more. `runs`: runs of the best design."""

    design: tuple
    value: float
    error: float
    low: float
    high: float
    runs: int
    place: list[Interval]
    place_share: float
    alike: list[Interval]
    flat: list[str]


class Surface:
    """The process fitted to runs: `designs` (tuples in the order of space.keys), `values`, `errors` (standard errors,
    NaN where unknown) in the objective's unit, `maximise` or minimise. Rows without a value are left out; of more
    than MOST_RUNS a random choice is taken. Deterministic for one seed. Raises ValueError without any value."""

    def __init__(self, space: Space, designs, values, errors, maximise=True, seed=0):
        values, errors = np.asarray(values, float), np.asarray(errors, float)
        use = np.flatnonzero(np.isfinite(values))
        if len(use) == 0:
            raise ValueError("no run has a value")
        self.generator = np.random.default_rng(seed)
        if len(use) > MOST_RUNS:
            use = np.sort(self.generator.choice(use, MOST_RUNS, replace=False))
        self.space, self.sign = space, 1.0 if maximise else -1.0
        self.designs = [tuple(designs[i]) for i in use]
        self.values, self.errors = values[use], errors[use]
        self.codes = space.encode(self.designs)
        self.middle = float(self.values.mean())
        self.scale = float(self.values.std()) or abs(self.middle) or 1.0
        with THREADS.limit(limits=1):
            kernel, self.scatter = self._kernel()
        known = np.where(np.isfinite(self.errors), self.errors, 0.0)
        self.process = self._process(kernel, np.hypot(known, self.scatter))

    def _kernel(self):
        """Kernel of the objective (variance and lengths, of values less their mean, in their deviation) and scatter
        of a run."""
        some = np.arange(len(self.values))
        if len(some) > MOST_FITTED:
            some = self.generator.choice(some, MOST_FITTED, replace=False)
        codes, values, errors = self.codes[some], self.values[some], self.errors[some]
        known = np.where(np.isfinite(errors), errors, 0.0) / self.scale
        all_known = bool(np.all(np.isfinite(errors)))
        lengths = np.full(codes.shape[1], 0.5)
        kernel = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(lengths, (0.05, 20.0), nu=2.5)
        kernel += WhiteKernel(1e-3 if all_known else 1e-2, (1e-6, 1.0))
        # log-normal priors of (variance, lengths, scatter^2): centres and widths of theta, their logarithm
        usual = 0.5 * math.sqrt(len(self.space))
        centre = np.log([1.0, *np.full(len(lengths), usual), 1e-3 if all_known else 3e-2])
        width = np.array([1.0, *np.ones_like(lengths), 1.5 if all_known else 2.0])

        def search(objective, start, bounds):
            """The maximum of the posterior instead of the likelihood: what GaussianProcessRegressor calls an
            optimizer."""

            def lost(theta):
                value, slope = objective(theta, eval_gradient=True)
                off = (theta - centre) / width
                return value + 0.5 * float(off @ off), slope + off / width

            starts = [start, centre, *(centre + width * self.generator.standard_normal((TRIES - 2, len(centre))))]
            tries = (np.clip(theta, bounds[:, 0], bounds[:, 1]) for theta in starts)
            found = [minimize(lost, theta, jac=True, bounds=bounds, method="L-BFGS-B") for theta in tries]
            best = min(found, key=lambda one: one.fun)
            return best.x, best.fun

        process = GaussianProcessRegressor(kernel, alpha=known**2 + JITTER, optimizer=search)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a parameter at its bound is acceptable: the prior decides
            process.fit(codes, (values - self.middle) / self.scale)
        # the objective itself is wanted, not another run: without the scatter of runs
        return process.kernel_.k1, math.sqrt(process.kernel_.k2.noise_level) * self.scale

    def _process(self, kernel, noises):
        """The process through the runs of this surface, with a given kernel and a noise for each run."""
        self.noises = noises
        alpha = (noises / self.scale) ** 2 + JITTER
        process = GaussianProcessRegressor(kernel, alpha=alpha, optimizer=None)
        with THREADS.limit(limits=1):
            return process.fit(self.codes, (self.values - self.middle) / self.scale)

    @property
    def noise(self) -> float:
        """Typical standard error of one more run, its scatter included."""
        known = self.errors[np.isfinite(self.errors)]
        return math.hypot(self.scatter, float(np.median(known)) if len(known) else 0.0)

    def predict(self, designs) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of the objective itself at designs, in its unit."""
        codes = self.space.encode(designs)
        parts = (codes[k : k + MOST_ASKED] for k in range(0, len(codes), MOST_ASKED))
        with THREADS.limit(limits=1):
            told = [self.process.predict(part, return_std=True) for part in parts]
        mean, spread = map(np.concatenate, zip(*told))
        return self.middle + self.scale * mean, self.scale * spread

    def covariance(self, designs) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of the objective at (at most MOST_ASKED) designs."""
        with THREADS.limit(limits=1):
            mean, cov = self.process.predict(self.space.encode(designs), return_cov=True)
        return self.middle + self.scale * mean, self.scale**2 * cov

    def realisations(self, designs, count, seed=0) -> np.ndarray:
        """Random functions from the posterior, evaluated at designs: shape (count,
        len(designs))."""
        mean, cov = self.covariance(designs)
        draws = np.random.default_rng(seed).standard_normal((count, len(mean)))
        # rounding makes some eigenvalues slightly negative; the correction is far below any error
        lift, whole = 1e-10 * self.scale**2, np.eye(len(mean))
        while True:
            with contextlib.suppress(np.linalg.LinAlgError), THREADS.limit(limits=1):
                return mean + draws @ np.linalg.cholesky(cov + lift * whole).T
            lift *= 10

    def gaps(self, designs, best) -> tuple[np.ndarray, np.ndarray]:
        """By how much `best` is better than each of designs (> 0: better), and the standard deviation of that."""
        means, spreads = [], []
        for k in range(0, len(designs), MOST_ASKED):
            mean, cov = self.covariance([best, *designs[k : k + MOST_ASKED]])
            variance = np.diag(cov)
            means.append(self.sign * (mean[0] - mean[1:]))
            spreads.append(np.sqrt(np.maximum(variance[0] + variance[1:] - 2 * cov[0, 1:], 0)))
        return np.concatenate(means), np.concatenate(spreads)

    def believing(self, pending) -> "Surface":
        """The same surface (same kernel and scatter), as if runs at `pending` had ended with their expected values."""
        other = copy.copy(self)
        other.designs = self.designs + list(pending)
        other.codes = self.space.encode(other.designs)
        other.values = np.concatenate([self.values, self.predict(pending)[0]])
        noises = np.concatenate([self.noises, np.full(len(pending), self.noise)])
        other.process = other._process(self.process.kernel_, noises)
        return other

    def tested(self) -> list[tuple]:
        """The designs that were run, each once, in the order of the runs."""
        return list(dict.fromkeys(self.designs))

    def best(self, among=None) -> tuple:
        """The design with the best mean, among those that were run or those given."""
        among = list(among) if among else self.tested()
        return among[int(np.argmax(self.sign * self.predict(among)[0]))]

    def optimum(self, among=None, allowed=None) -> Optimum:
        """The best design (of those run, or of those given) and how well it and its place are known, compared with all
        designs that `allowed(designs, doubt)` marks: those that may meet the requirements are open if they are not
        certainly worse than the best one that certainly meets them."""
        best = self.best(among)
        (value,), (error,) = self.predict([best])
        # for a space too large to list: evenly spread designs
        around = self.space.everything() or self.space.at(qmc.Sobol(len(self.space), seed=0).random_base2(11))
        rival, met = best, np.ones(len(around), bool)
        if allowed is not None:
            around = [*itertools.compress(around, allowed(around, REACH))] or [best]
            met = allowed(around)
            if not allowed([best], -REACH)[0]:
                rival = self.best([*itertools.compress(around, allowed(around, -REACH))] or [best])
        gap, spread = self.gaps(around, rival)
        # one-sided at 97.5 %: certainly worse than the best, or not
        open_ = gap <= REACH * np.maximum(spread, 1e-12 * abs(value))
        alike = met & (self.gaps(around, best)[0] <= ALIKE * abs(value))
        places, near = (self._intervals([best, *itertools.compress(around, which)]) for which in (open_, alike))
        wide = ((r, r.share(part.high) - r.share(part.low)) for r, part in zip(self.space.ranges, near) if r.numeric)
        return Optimum(
            best, float(value), float(error), float(value - REACH * error), float(value + REACH * error),
            self.designs.count(best), places, float(open_.mean()), near,
            flat=[r.key for r, share in wide if share >= FLAT],
        )  # fmt: skip

    def _intervals(self, designs) -> list[Interval]:
        return [
            Interval(min(column), max(column))
            if r.numeric
            else Interval(None, None, tuple(word for word in r.values if word in column))
            for r, column in zip(self.space.ranges, zip(*designs))
        ]
