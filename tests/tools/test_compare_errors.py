"""How sure a comparison is: the error is what it says it is, by experiment on made-up series."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from milltools.compare import agreement as errors
from milltools.compare import rows
from milltools.compare.agreement import Estimate
from milltools.read import sums


def said_to_differ(make, trials, seed):
    """Share of comparisons of two equal runs that are said to differ."""
    random = np.random.default_rng(seed)
    wrong = 0
    for _ in range(trials):
        pair = [make(random) for _ in range(2)]
        found = errors.difference(*(errors.from_blocks(100 + b.mean(), b) for b in pair), "unknown")
        wrong += found.mood == "differ"
    return wrong / trials


@pytest.mark.slow
@pytest.mark.parametrize("blocks", [2, 4, 6, 12, 60])
def test_equal_runs_are_said_to_differ_once_in_a_hundred(blocks):
    """4000 trials of independent blocks: 0.01 +- 0.0016; fewer than that is allowed, for Welch's freedom is
    cautious."""
    share = said_to_differ(lambda random: random.normal(size=blocks), 4000, seed=blocks)
    assert share < 0.0155


def series(random, count, r):
    """First-order autoregressive blocks of correlation r."""
    value, out = random.normal(), np.empty(count)
    for k in range(count):
        out[k] = value
        value = r * value + math.sqrt(1 - r * r) * random.normal()
    return out


@pytest.mark.slow
def test_blocks_that_go_together_widen_the_error():
    """r = 0.5: without the correction one comparison in seven of equal runs is said to differ, with it fewer than
    one in 25."""
    share = said_to_differ(lambda random: series(random, 30, 0.5), 2000, seed=5)
    assert share < 0.04
    random = np.random.default_rng(6)
    found = [errors.lag_correlation(series(random, 500, 0.5)) for _ in range(20)]
    assert np.mean(found) == pytest.approx(0.5, abs=0.03)


def test_the_error_of_a_mean_is_that_of_its_scatter():
    random = np.random.default_rng(7)
    runs = random.normal(10, 2, size=(2000, 12))
    told = np.sqrt(np.mean([errors.from_blocks(run.mean(), run).error ** 2 for run in runs]))
    assert told == pytest.approx(runs.mean(axis=1).std(ddof=1), rel=0.15)


@pytest.mark.parametrize("freedom", [3.5, 20.0])
def test_an_error_is_shown_as_the_file_tells_it(freedom):
    assert errors.from_file((850.0, 12.5, freedom)).told == pytest.approx(12.5)


def test_a_real_difference_is_found():
    found = errors.difference(Estimate(100, 1, 10), Estimate(105, 1, 10), "unknown")
    assert (found.verdict, found.mood) == ("differ by 3.2 standard errors", "differ")
    assert found.relative == pytest.approx(0.05)
    assert found.error == pytest.approx(math.hypot(1.05, 1) / 100 * 2.08596 / 1.96, rel=1e-3)
    assert found.dof == pytest.approx(20, rel=0.01)


def test_the_error_of_a_ratio_is_that_of_ratios():
    random = np.random.default_rng(3)
    a, b = random.normal(240, 2, 4000), random.normal(572, 3, 4000)
    found = errors.difference(Estimate(240, 2, math.inf), Estimate(572, 3, math.inf), "unknown")
    assert found.error == pytest.approx(np.std(b / a), rel=0.05)


@pytest.mark.parametrize(
    "a, b, verdict",
    [
        (Estimate(100, 1, 10), Estimate(101, 1, 10), "agree"),
        (Estimate(100, 1, 1), Estimate(101, 1, 1), "undecided: error too large"),
        (Estimate(100, 20, 10), Estimate(101, 20, 10), "undecided: error too large"),
        (Estimate(0.0, 1, 10), Estimate(0.1, 1, 10), "undecided: error too large"),
        (Estimate(100), Estimate(200), "unknown"),
        (Estimate(math.nan), Estimate(200), "no value"),
    ],
)
def test_what_cannot_be_told_is_not_said(a, b, verdict):
    assert errors.difference(a, b, "unknown").verdict == verdict


@pytest.mark.parametrize(
    "a, b, verdict",
    [
        (Estimate(100, 1, math.inf), Estimate(104, 1, math.inf), "higher"),
        (Estimate(100, 1, math.inf), Estimate(96, 1, math.inf), "lower"),
        (Estimate(100, 1, math.inf), Estimate(102, 1, math.inf), "tied"),
        (Estimate(100, 20, math.inf), Estimate(101, 20, math.inf), "undecided: error too large"),
    ],
)
def test_of_two_designs_the_interval_gives_the_verdict(a, b, verdict):
    found = errors.difference(a, b, "unknown", designs=True)
    assert found.verdict == verdict
    contains_zero = abs(found.relative) <= 1.96 * found.error
    assert contains_zero == (found.mood != "apart")


def test_a_value_that_was_zero_is_higher_without_a_size():
    found = errors.difference(Estimate(0.01, 0.02, math.inf), Estimate(5, 0.1, math.inf), "unknown", designs=True)
    assert found.verdict == "higher" and math.isnan(found.relative) and math.isnan(found.error)


def test_replicates_share_their_relative_scatter():
    first, second = [Estimate(v) for v in (98.0, 100.0, 102.0)], [Estimate(200.0)]
    a, b = errors.from_replicates(first, second)
    assert (a.value, a.error, a.dof) == (100, pytest.approx(2 / math.sqrt(3)), 2)
    assert (b.value, b.error, b.dof) == (200, pytest.approx(4), 2)


def test_four_replicates_are_trusted_more_than_blocks():
    first = [Estimate(v, 50, 10) for v in (99.0, 100.0, 101.0, 100.0)]
    for steady in (True, False):
        assert errors.combine(first, [Estimate(100, 50, 10)], steady)[0].error < 1
    assert errors.combine(first[:2], [Estimate(100, 50, 10)], True)[0].error == pytest.approx(50 / math.sqrt(2))


def run_of(hard, lost, power):
    """As much of a run as sums need: in each block of 0.1 s so many impacts of 2 mJ, which are in the middle of three
    bins, and so many that lose as much; the power of its rotor [W]."""
    edges, none = np.array([-np.inf, 1e-3, 4e-3, np.inf]), np.zeros_like(hard)
    blocks = {
        name: np.stack([none, x, none], axis=-1)[:, None, None] for name, x in (("normal", hard), ("dissipated", lost))
    }
    data = {"statistics/energies/edges": edges, "statistics/energies/blocks/edges": edges,
            "statistics/energies/blocks/duration": 0.1, "statistics/energies/blocks/period": 0}  # fmt: skip
    for name, counts in blocks.items():
        data |= {
            f"statistics/energies/blocks/ball_ball/{name}": counts,
            f"statistics/energies/ball_ball/{name}": counts.sum(axis=0),
        }
    return SimpleNamespace(
        kinds=("ball_ball",), as_deck=SimpleNamespace(species=[SimpleNamespace(mass=1e-3, diameter=1e-3)]),
        duration=0.1 * len(hard), driven="rotor", known=lambda name: None, has=data.__contains__, read=data.__getitem__,
        need_statistics=lambda: None, has_series=lambda name: True, statistic=lambda path: power,
        histogram=lambda *_: SimpleNamespace(above=lambda speed: hard.sum()),
        rates=lambda name, column: (10 * hard.mean(), 10 * hard.astype(float)),
    )  # fmt: skip


@pytest.mark.parametrize("measure", [rows.fast("all", 1), rows.energetic], ids=["fast", "energetic"])
def test_a_rate_of_few_impacts_has_at_least_the_error_of_their_count(measure):
    """36 impacts in 3.6 s, one in each block, as regular as no chance would make them: 10 +- 36**0.5 / 3.6 per s."""
    found = measure(run_of(np.ones(36, int), np.ones(36, int), 1.0))
    assert (found.value, found.error) == pytest.approx((10, 6 / 3.6), rel=1e-3)


def test_impacts_per_joule_have_the_relative_error_of_impacts_whatever_part_of_the_power_is_lost():
    """Half of the power of the rotor goes into impacts; impacts scatter by 20 %, losses do not."""
    hard = np.random.default_rng(4).normal(1000, 200, 96).round().astype(int)
    run = run_of(hard, np.full(96, 1000), 50.0)
    value, error, _ = sums.per_work(run, sums.total(run, sums.above(1e-3)))
    assert value == pytest.approx(10 * hard.mean() / 50)
    assert error / value == pytest.approx(hard.std(ddof=1) / hard.mean() / math.sqrt(96), rel=0.3)


@pytest.mark.parametrize("freedom", [1, 1.3, 2, 6.5, 40, 9e4, 2e5, 1e9])
@pytest.mark.parametrize("share", [0.9, 0.975, 0.995])
def test_students_quantile_is_that_of_scipy(freedom, share):
    assert errors.student(freedom, share) == pytest.approx(stdtrit(freedom, share), rel=1e-8)
