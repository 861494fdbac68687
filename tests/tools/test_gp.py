"""A surface through noisy runs: it knows what it was told, says how well, and never mistakes the noise for the
objective."""

import math

import numpy as np
import pytest
from conftest import slow
from scipy.stats import qmc

from milltools.study.search import gp
from milltools.study.search.space import Space

LINE = [{"key": "x", "unit": "m", "low": 0.0, "high": 2.0, "values": None}]
GRID = [
    {"key": "n", "unit": "1", "kind": "whole", "whole": True, "low": 2, "high": 20, "values": list(range(2, 21))},
    {"key": "h", "unit": "m", "low": 0.0, "high": 0.01, "values": [k * 5e-4 for k in range(21)]},
]


def wave(x):
    return 3 + math.sin(2 * x)


def surface(count=25, error=0.05, seed=0, known=True, maximise=True, vary=LINE, function=wave):
    rng = np.random.default_rng(seed)
    space = Space(vary)
    designs = space.at(rng.random((count, len(space))))
    values = [function(*design) + error * rng.standard_normal() for design in designs]
    errors = np.full(count, error if known else math.nan)
    return gp.Surface(space, designs, values, errors, maximise, seed)


# ---- the space


def test_a_whole_key_is_one_of_its_values_before_it_is_a_number():
    space = Space([{"key": "n", "unit": "1", "kind": "whole", "whole": True, "low": 2, "high": 5, "values": None}])
    designs = space.at([[0.0], [0.24], [0.26], [0.99], [1.0]])
    assert designs == [(2,), (2,), (3,), (5,), (5,)]
    assert space.encode([(2,), (3,), (5,)]).ravel() == pytest.approx([0, 1 / 3, 1])


def test_a_logarithmic_key_is_even_in_its_logarithm():
    space = Space([{"key": "d", "unit": "m", "low": 0.001, "high": 0.1, "values": None, "log": True}])
    assert space.at([[0.5]])[0] == pytest.approx((0.01,)) and space.encode([(0.01,)]) == pytest.approx(0.5)


def test_words_are_as_far_from_each_other_as_the_ends_of_a_number():
    space = Space([{"key": "p", "unit": "", "kind": "choice", "values": ["a", "b", "c"]}])
    codes = space.encode([("a",), ("b",), ("c",)])
    gaps = [np.linalg.norm(codes[i] - codes[j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    assert gaps == pytest.approx([1, 1, 1])


def test_a_neighbour_is_a_design_of_the_space_and_near():
    space, rng = Space(GRID), np.random.default_rng(0)
    near = [space.near((10, 0.005), 0.03, rng) for _ in range(200)]
    assert set(near) <= set(space.everything())
    assert max(abs(n - 10) for n, _ in near) <= 3 and len(set(near)) > 5
    far = [space.near((10, 0.005), 0.5, rng) for _ in range(400)]  # each key in three of four
    assert all(0.17 < np.mean([one[k] == (10, 0.005)[k] for one in far]) < 0.38 for k in (0, 1))


# ---- the surface


@pytest.mark.parametrize("known", slow([True, False], True))
def test_its_interval_covers_the_truth_as_often_as_it_says(known):
    covered, asked = 0, [(x,) for x in np.linspace(0.05, 1.95, 20)]
    for seed in range(10):
        mean, spread = surface(seed=seed, known=known).predict(asked)
        covered += sum(abs(m - wave(*x)) <= 1.96 * s for m, s, x in zip(mean, spread, asked))
    assert 0.85 * 200 <= covered <= 200


def test_an_unknown_scatter_is_found():
    found = surface(60, error=0.2, known=False)
    assert 0.12 < found.scatter < 0.3


def by_formula(found, designs, runs, values, noises):
    """Mean and covariance of the objective: Rasmussen & Williams, equations 2.25 and 2.26."""
    kernel, size = found.process.kernel_, found.scale**2
    one, two = found.space.encode(designs), found.space.encode(runs)
    whole = size * (kernel(two) + gp.JITTER * np.eye(len(runs))) + np.diag(np.square(noises))
    share = np.linalg.solve(whole, size * kernel(two, one)).T
    return found.middle + share @ (np.array(values) - found.middle), size * (kernel(one) - share @ kernel(two, one))


def test_mean_covariance_and_gaps_are_those_of_the_formulas():
    runs, values, errors = (
        [(0.2,), (0.6,), (1.1,), (1.1,), (1.9,)],
        [4.0, 2.0, 3.0, 3.3, 1.0],
        [0.1, 0.2, np.nan, 0.3, 0.4],
    )
    found = gp.Surface(Space(LINE), runs, values, errors, False, 1)
    noises = np.hypot(np.nan_to_num(errors), found.scatter)
    asked = [(0.4,), (1.0,), (1.5,)]
    assert (found.middle, found.scale) == pytest.approx((np.mean(values), np.std(values)))
    assert found.noise == pytest.approx(math.hypot(found.scatter, 0.25))
    mean, cov = by_formula(found, asked, runs, values, noises)
    for told in (found.predict(asked)[0], found.covariance(asked)[0]):
        assert told == pytest.approx(mean)
    assert found.predict(asked)[1] ** 2 == pytest.approx(np.diag(cov))
    assert found.covariance(asked)[1] == pytest.approx(cov)
    gap, spread = found.gaps(asked[1:], asked[0])  # of what is minimised
    assert gap == pytest.approx(mean[1:] - mean[0])
    assert spread**2 == pytest.approx([cov[0, 0] + cov[k, k] - 2 * cov[0, k] for k in (1, 2)])
    assert found.best(asked) == asked[int(np.argmin(mean))] and found.best() in runs
    pending = [(1.5,), (0.1,)]
    believed = found.believing(pending)
    expected = [*values, *by_formula(found, pending, runs, values, noises)[0]]
    mean, cov = by_formula(found, asked, runs + pending, expected, [*noises, found.noise, found.noise])
    assert found.designs == runs and believed.predict(asked)[0] == pytest.approx(mean)
    assert believed.predict(asked)[1] ** 2 == pytest.approx(np.diag(cov))


def test_the_place_of_an_optimum_on_a_limit_is_as_wide_as_the_limit_is_uncertain():
    found = surface(40, 0.01, 3, function=lambda x: x)

    def allowed(designs, doubt=0.0):  # the limit is 1 +- 0.1
        return np.array([x - 1 - 0.1 * doubt <= 0 for (x,) in designs])

    (place,) = found.optimum([d for d in found.tested() if d[0] <= 1], allowed).place
    assert (place.low, place.high) == pytest.approx((0.8, 1.2), abs=0.03)


@pytest.mark.parametrize("vary, limit", [(GRID, 0), (GRID, 5), pytest.param(LINE, 0, marks=pytest.mark.slow)])
def test_the_place_of_the_optimum_is_that_of_designs_not_certainly_worse(vary, limit):
    found = surface(40, 0.05, 3, vary=vary, function=hill if vary == GRID else wave)
    best = found.optimum(allowed=(lambda designs, _=0: np.array([d[0] > limit for d in designs])) if limit else None)
    around = found.space.everything() or found.space.at(qmc.Sobol(1, seed=0).random(2048))
    around = [d for d in around if d[0] > limit]
    (value,), (error,) = found.predict([best.design])
    gap, spread = found.gaps(around, best.design)
    open_ = [d for d, g, s in zip(around, gap, spread) if g <= gp.REACH * s] + [best.design]
    alike = [d for d, g in zip(around, gap) if g <= 0.02 * value] + [best.design]
    assert (best.value, best.error, best.runs) == (value, error, found.designs.count(best.design))
    assert (best.low, best.high) == pytest.approx((value - 1.959964 * error, value + 1.959964 * error))
    assert best.place_share == pytest.approx((len(open_) - 1) / len(around), abs=1.1 / len(around))
    for places, designs in ((best.place, open_), (best.alike, alike)):
        assert [(one.low, one.high) for one in places] == [(min(column), max(column)) for column in zip(*designs)]
    wide = [(one.high - one.low) / (r.high - r.low) >= 0.25 for one, r in zip(best.alike, found.space.ranges)]
    assert best.flat == [key for key, is_wide in zip(found.space.keys, wide) if is_wide]


def test_rows_without_a_value_are_left_out_and_none_at_all_is_an_error():
    space = Space(LINE)
    found = gp.Surface(space, [(0.5,), (1.0,)], [1.0, math.nan], [0.1, math.nan])
    assert found.designs == [(0.5,)]
    with pytest.raises(ValueError, match="no run has a value"):
        gp.Surface(space, [(0.5,)], [math.nan], [math.nan])


def test_the_same_runs_and_seed_give_the_same_bits():
    one, two = surface(), surface()
    assert np.array_equal(one.predict([(0.3,)]), two.predict([(0.3,)]))


def test_realisations_scatter_as_the_posterior_does():
    found = surface(10, error=0.1)
    asked = [(0.2,), (0.9,), (1.9,)]
    mean, cov = found.covariance(asked)
    draws = found.realisations(asked, 4000)
    assert draws.mean(axis=0) == pytest.approx(mean, abs=4 * math.sqrt(cov.max() / 4000))
    assert np.cov(draws.T) == pytest.approx(cov, abs=0.1 * cov.max())


# ---- the optimum


def hill(n, h):
    return 1 - ((n - 7) / 20) ** 2 - ((h - 0.006) / 0.01) ** 2


def ridge(n, h):
    return 1 - ((n - 7) / 10) ** 2


@pytest.mark.parametrize("maximise", [True, False])
def test_the_optimum_is_found_with_intervals_that_hold_the_truth(maximise):
    sign = 1 if maximise else -1
    found = surface(60, 0.02, 3, maximise=maximise, vary=GRID, function=lambda *d: sign * hill(*d))
    best = found.optimum()
    assert best.low <= sign * hill(*best.design) <= best.high
    assert best.high - best.low == pytest.approx(2 * 1.96 * best.error, rel=1e-3)
    (n, h) = best.place
    assert n.low <= 7 <= n.high and h.low <= 0.006 <= h.high
    assert 0 < best.place_share < 0.5


def test_a_flat_key_is_called_flat_and_no_other():
    best = surface(60, 0.01, 4, vary=GRID, function=ridge).optimum()
    assert best.flat == ["h"]
    assert best.alike[1].high - best.alike[1].low > 0.008


def test_where_noise_hides_everything_the_place_is_everywhere():
    best = surface(10, 5.0, 5, vary=GRID, function=hill).optimum()
    assert best.place_share > 0.9


def test_a_capped_design_is_the_best_only_if_all_are_capped():
    designs, values = [("a",), ("b",), ("b",), ("c",)], [3.0, 2.0, math.nan, 1.0]
    statuses = ["capped", "done", "failed", "done"]
    assert gp.candidates(designs, values, statuses) == [("b",), ("c",)]
    assert gp.candidates(designs[:1], values[:1], statuses[:1]) == [("a",)]
