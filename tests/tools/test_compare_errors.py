"""How sure a comparison is: the error is what it says it is, by experiment on made-up series."""

import functools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from milltools.compare import agreement as errors
from milltools.compare import load, map_deviation, rows
from milltools.compare.agreement import Estimate
from milltools.read import sums
from milltools.read.runfile import Hard


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


@pytest.mark.parametrize(
    "blocks, r",
    [
        ([1, 2, 4, 3, 2, 5, 3], 0),  # too few to tell a correlation
        ([1, 2, 2, 4, 4, 3, 3, 1], None),
        ([1, 3] * 5, 0),
        (range(20), 0.9),
        ([2] * 9, 0),
    ],
)
def test_the_error_of_blocks_is_that_of_their_scatter_and_correlation(blocks, r):
    found, x = errors.from_blocks(9.0, blocks, "said"), np.array(blocks, float)
    off = x - x.mean()
    r = off[1:] @ off[:-1] / (off @ off) + 1 / len(x) if r is None else r
    effective = len(x) * (1 - r) / (1 + r)
    assert (found.value, found.remark) == (9.0, "said")
    assert found.error == pytest.approx(x.std(ddof=1) / math.sqrt(effective))
    assert found.dof == pytest.approx(max(effective - 1, 1))


def test_a_mean_of_runs_has_the_error_of_their_errors_and_the_freedom_of_welch():
    found = errors.mean_of([Estimate(1, 0.1, 5), Estimate(3, 0.2, 7, "said")])
    assert (found.value, found.remark) == (2, "said")
    assert found.error == pytest.approx(math.sqrt(0.05) / 2)
    assert found.dof == pytest.approx(0.05**2 / (0.1**4 / 5 + 0.2**4 / 7))
    assert errors.mean_of([Estimate(1, 0.1, math.inf), Estimate(3, 0.2, math.inf)]).dof == math.inf
    assert math.isnan(errors.mean_of([Estimate(1, 0.1, 5), Estimate(3)]).error)
    assert all(math.isnan(errors.from_blocks(1, x).error) for x in ([3], [1, math.nan]))


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


NONE, SOME = Estimate(0.0), Estimate(227.4, 2.2, math.inf)


@pytest.mark.parametrize(
    "a, b, designs, verdict, relative",
    [
        (NONE, SOME, True, "higher", math.nan),
        (SOME, NONE, True, "lower", -1),
        (NONE, SOME, False, "differ by 103.4 standard errors", math.nan),
        (SOME, NONE, False, "differ by 103.4 standard errors", -1),
        (NONE, Estimate(4, 2.2, math.inf), True, "unknown", math.nan),
        (Estimate(4, 2.2, math.inf), NONE, True, "unknown", -1),
        (NONE, Estimate(227.4), True, "unknown", math.nan),
    ],
)
def test_none_beside_a_count_that_is_certainly_above_zero_is_a_difference_without_a_size(
    a, b, designs, verdict, relative
):
    found = errors.difference(a, b, "unknown", designs)
    assert found.verdict == verdict and math.isnan(found.error)
    assert (found.relative, found.mood == "open") == pytest.approx((relative, verdict == "unknown"), nan_ok=True)


def test_replicates_beside_others_that_count_none_have_their_own_scatter():
    zeros, some = [Estimate(0.0)] * 3, [Estimate(v) for v in (98.0, 100.0, 102.0)]
    for none, found in (errors.from_replicates(zeros, some), errors.from_replicates(some, zeros)[::-1]):
        assert none == Estimate(0.0)
        assert (found.value, found.error, found.dof) == (100, pytest.approx(2 / math.sqrt(3)), 2)


def test_replicates_share_their_relative_scatter():
    first, second = [Estimate(v) for v in (98.0, 100.0, 102.0)], [Estimate(200.0)]
    a, b = errors.from_replicates(first, second)
    assert (a.value, a.error, a.dof) == (100, pytest.approx(2 / math.sqrt(3)), 2)
    assert (b.value, b.error, b.dof) == (200, pytest.approx(4), 2)


def test_replicates_of_zero_have_no_error_and_those_of_one_have():
    zeros, ones = [Estimate(v) for v in (-1.0, 1.0)], [Estimate(v) for v in (0.9, 1.1)]
    assert all(math.isnan(e.error) for pair in ((zeros, ones), (ones, zeros)) for e in errors.from_replicates(*pair))
    assert errors.from_replicates(ones, ones)[0].error == pytest.approx(0.1)


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
        kinds=("ball_ball",), classes=[SimpleNamespace(mass=1e-3, diameter=1e-3)],
        duration=0.1 * len(hard), driven="rotor", known=lambda name: None, has=data.__contains__, read=data.__getitem__,
        need_statistics=lambda: None, hard=Hard(math.nan), doubt="", starts=1,
        has_series=lambda name: True, statistic=lambda path: power,
        histogram=lambda *_: SimpleNamespace(above=lambda speed: hard.sum()),
        rates=lambda name, column: (10 * hard.mean(), 10 * hard.astype(float)),
    )  # fmt: skip


@pytest.mark.parametrize("measure", [rows.fast("all", 1), rows.energetic(Hard(1e-3))], ids=["fast", "energetic"])
def test_a_rate_of_few_impacts_has_at_least_the_error_of_their_count(measure):
    """36 impacts in 3.6 s, one in each block, as regular as no chance would make them: 10 +- 36**0.5 / 3.6 per s."""
    hard = np.ones(36, int)
    found, n = measure(run_of(hard, hard, 1.0)), hard.sum()
    assert found.value == pytest.approx(n / 3.6)
    assert pytest.approx(n**0.5 / 3.6, rel=1e-3) in (found.error, found.told)  # energies tell it as files do


def test_of_three_hard_impacts_only_the_number_is_known():
    hard = np.array(3 * [1, *11 * [0]])
    found = rows.energetic(Hard(1e-3))(run_of(hard, hard, 1.0))
    assert found.value == pytest.approx(3 / 3.6) and math.isnan(found.error)


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


# ---- maps, of a row of cells


def mill_with(*maps, noise=(), frames=40):
    """A side of runs, each with a map: (solid fraction, then components of the velocity) by cell. noise: variance of
    the frames' map and its distance from the map, of the solid fraction and of the velocity."""
    side = SimpleNamespace(runs=[])
    for one in maps:
        stored = dict(zip(("solid_fraction", "velocity_x", "velocity_r", "velocity_phi"), np.array(one)))
        side.runs.append(
            SimpleNamespace(
                map=lambda name, view, stored=stored: stored[name],
                edges=lambda view: (np.arange(2.0), np.arange(4.0)),
                map_noise=dict(zip((("axial", "solid_fraction"), ("axial", "velocity")), np.array(noise))),
                map_frames=frames,
                statistic={"maps/samples": 160}.get,
            )
        )
    side.mean_map = functools.partial(load.Side.mean_map, side)
    return side


FIRST = [[0.5, 0.3, 0.01], [1, 0, 5], [2, 1, 5], [0, 3, 5]]  # the third cell is hardly filled
SECOND = [[0.4, 0.2, 0.5], [1.5, 0, 5], [2, 0, 5], [0, 3, 9]]
PHI = np.array([0.45, 0.25])


def test_the_deviation_of_maps_is_weighted_with_the_solid_fraction_and_noise_is_what_frames_tell():
    known = [[[0.01, 0.02, 9], [0.002, 0.001, 9]], [[0.1, 0.3, 9], [0.2, 0.4, 9]]]
    a, b = mill_with(FIRST, FIRST, noise=known), mill_with(SECOND, noise=known, frames=400)
    found = [map_deviation.deviation(a, b, "axial", name, True) for name in ("solid_fraction", "velocity")]
    fraction, speed = PHI @ PHI**2, PHI @ [(5 + 6.25) / 2, (10 + 9) / 2]
    rough, coarse, fast = PHI @ [0.01, 0.02], PHI @ [0.002, 0.001], PHI @ [0.1, 0.3]
    assert found[0] == pytest.approx(
        [math.sqrt(PHI @ [0.01, 0.01] / fraction), math.sqrt(((rough - coarse) / 2 + rough) / fraction)]
    )
    # at least a quarter of the variance, as many frames as that are of the snapshots
    assert found[1] == pytest.approx([math.sqrt(PHI @ [0.25, 1] / speed), math.sqrt((fast / 8 + fast) / speed)])
    assert map_deviation.deviation(a, mill_with(np.zeros((4, 3))), "axial", "velocity", True) is None
    assert math.isnan(map_deviation.deviation(a, mill_with(SECOND), "axial", "velocity", True)[1])


def test_two_replicates_of_one_side_are_enough_for_the_errors_of_both():
    pair, single = errors.from_replicates([Estimate(9.0), Estimate(11.0)], [Estimate(20.0)])
    scatter = math.sqrt(2) / 10
    assert (pair.error, single.error) == pytest.approx((10 * scatter / math.sqrt(2), 20 * scatter))
    assert (pair.dof, single.dof) == (1, 1)


@pytest.mark.parametrize("modulus, words", [(5e6, "LIGGGHTS 3.8 at 5e+06 Pa"), (math.nan, "LIGGGHTS 3.8")])
def test_a_run_of_soft_spheres_says_how_stiff_they_were(modulus, words):
    run = SimpleNamespace(program="LIGGGHTS", version="3.8", modulus=modulus)
    assert load.Member.made_by.fget(run) == words


@pytest.mark.parametrize("wall, seen", [((1.1, 9), True), ((0.9, 11), True), ((0.9, 9), False)])
def test_a_kind_of_contact_with_a_hundredth_of_the_power_of_its_side_is_important(wall, seen):
    powers = {"dissipated_power": (100, 1000), "dissipated_power_ball_wall": wall}
    found = [
        SimpleNamespace(key=key, a=Estimate(a, 1), b=Estimate(b, 1), difference_error=0.1, verdict="higher")
        for key, (a, b) in powers.items()
    ]
    assert rows.Comparison(None, None, found).important == found[1:] * seen


def test_the_balls_speeds_are_in_forty_bins_a_decade_from_a_tenth_of_a_millimetre_a_second_on():
    assert load.SPEED_EDGES[::40] == pytest.approx([1e-4, 1e-3, 0.01, 0.1, 1, 10, 100, 1000])
    assert np.diff(np.log(load.SPEED_EDGES)) == pytest.approx(math.log(10) / 40)


@pytest.mark.parametrize("solid, counts", [(0.0199, False), (0.0201, True)])
def test_a_cell_counts_if_more_than_a_fiftieth_of_it_is_solid(solid, counts):
    slow, fast = (mill_with([[0.5, solid], [1, speed], [0, 0], [0, 0]]) for speed in (1, 2))
    assert (map_deviation.deviation(slow, fast, "axial", "velocity", True)[0] > 0) == counts


def test_the_noise_of_maps_of_a_transient_is_the_scatter_of_replicates():
    third = [[0.6, 0.1, 0.01], [1, 0, 5], [2, 1, 5], [0, 4, 5]]
    two, one = mill_with(FIRST, third), mill_with(SECOND)
    phi = np.array([(0.55 + 0.4) / 2, (0.2 + 0.2) / 2])
    for a, b in ((two, one), (one, two)):  # that of a single run is twice the variance of the mean of two
        found = map_deviation.deviation(a, b, "axial", "solid_fraction", False)
        assert found[1] == pytest.approx(math.sqrt(3 * (phi @ [0.0025, 0.01]) / (phi @ phi**2)))
    assert map_deviation.deviation(two, two, "axial", "velocity", False) == pytest.approx(
        (0, math.sqrt(2 * 0.2 * 0.25 / ([0.55, 0.2] @ np.array([5, 1 + 3.5**2]))))
    )
    assert math.isnan(map_deviation.deviation(one, one, "axial", "velocity", False)[1])


def test_the_noise_of_a_map_is_the_scatter_of_its_blocks_of_frames():
    random = np.random.default_rng(8)
    samples, room, view = np.array([1, 2, 3, 2]), np.array([[2.0, 4.0]]), {"n": (1, 2), "room": np.array([2.0, 4.0])}
    flow = random.uniform(1, 2, (4, 4, 1, 2)) * samples[:, None, None, None]
    parts = [
        SimpleNamespace(samples=n, **dict.fromkeys(("cross", "axial"), SimpleNamespace(flow=f, **view)))
        for n, f in zip(samples, flow.reshape(4, 4, 2))
    ]
    stored = {
        name: random.random((1, 2)) for names in ("xyz", ("r", "phi")) for name in (f"velocity_{n}" for n in names)
    }
    run = SimpleNamespace(starts=1, map=lambda name, view: (stored | {"solid_fraction": room / 9})[name])
    found = map_deviation.noise(run, parts)
    each = flow / samples[:, None, None, None]
    fraction = each[:, 0] / room
    for name, axes in (("cross_section", "xyz"), ("axial", ("x", "r", "phi"))):
        rough, coarse = found[name, "solid_fraction"]
        assert rough == pytest.approx(fraction.var(axis=0, ddof=1) / 4)
        assert coarse == pytest.approx((fraction.mean(axis=0) - room / 9) ** 2)
        rough, coarse = found[name, "velocity"]
        speed = [each[:, 1 + k].sum(axis=0) / each[:, 0].sum(axis=0) for k in range(3)]
        scatter = [(each[:, 1 + k] - speed[k] * each[:, 0]) / each[:, 0].mean(axis=0) for k in range(3)]
        assert rough == pytest.approx(sum(one.var(axis=0, ddof=1) for one in scatter) / 4)
        assert coarse == pytest.approx(sum((v - stored[f"velocity_{n}"]) ** 2 for v, n in zip(speed, axes)))
    few = [SimpleNamespace(**vars(parts[0]) | {"samples": n}) for n in (1, 2, 2, 2)]
    assert map_deviation.noise(run, few) == map_deviation.noise(run, parts[1:]) == {}
    assert map_deviation.noise(run, [*parts, None]) == {}


def test_common_cells_reach_as_far_as_all_and_are_as_large_as_the_largest():
    def run(low, high, count):
        return SimpleNamespace(edges=lambda view: (np.linspace(low, high, count + 1), np.linspace(0, 1, 11)))

    x, r = map_deviation.common([run(-1, 2, 6), run(-2, 1, 5)], "axial")
    assert x == pytest.approx(np.linspace(-2, 2, 8)) and r == pytest.approx(np.linspace(0, 1, 11))
    assert map_deviation.common([run(-1, 2, 6), run(-1, 2, 6)], "axial") is None
    assert map_deviation.common([run(-1, 2, 6), run(-1, 2.1, 6)], "axial") is not None


@pytest.mark.parametrize(
    "deviation, noise, said",
    [
        (0.2, 0.1, ("noise explains it", "agree")),
        (0.25, 0.07, ("24.0 % beyond noise", "differ")),
        (0.2, math.nan, ("noise unknown", "open")),
    ],
)
def test_a_deviation_of_twice_the_noise_is_noise(deviation, noise, said):
    assert map_deviation.verdict(deviation, noise) == said


# ---- windows in blocks, costs, strikes


@pytest.mark.parametrize(
    "window, end, period, rows, bounds, cut",
    [
        ((0.1, 1.1), 2.0, 0.1, 101, np.linspace(0.1, 1.1, 11), "10 blocks of 1 revolution"),
        ((0.1, 1.1), 0.55, 0.1, 101, 0.1 + 0.1 * np.arange(5), "4 blocks of 1 revolution"),
        ((0.0, 13.0), 13.0, 0.1, 101, 0.3 * np.arange(44), "43 blocks of 3 revolutions"),
        ((0.0, 0.39), 1.0, 0.1, 101, np.linspace(0, 0.39, 5), "4 equal blocks of 0.0975 s"),
        ((0.0, 1.0), 1.0, math.inf, 41, np.linspace(0, 1, 11), "10 equal blocks of 0.1 s"),
        ((0.0, 1.0), 1.0, math.inf, 40, np.linspace(0, 1, 5), "4 equal blocks of 0.25 s"),
        ((0.0, 1.0), 1.0, math.inf, 9, np.linspace(0, 1, 5), "4 equal blocks of 0.25 s"),
        ((0.0, 1.0), 1.0, math.inf, 8, [0, 1], "no blocks: too few rows of the time series"),
    ],
)
def test_a_window_is_cut_into_whole_revolutions_or_equal_parts(window, end, period, rows, bounds, cut):
    run = SimpleNamespace(window=window, period=period, drive="rotor", starts=1)
    run.series = lambda name: (np.linspace(0, end, rows if end == 1 else 2001), None)
    load.Member._cut(run)
    assert (run.cut, run.blocks) == (cut, len(bounds) - 1)
    assert run.bounds == pytest.approx(np.array(bounds)) and run.span == (window[0], min(window[1], end))


@pytest.mark.parametrize(
    "cost, said",
    [
        (1.009, "the same cost"),
        (0.992, "the same cost"),
        (1.02, "B costs 1.02 times as much as A"),
        (0.5, "A costs 2 times as much as B"),
        (0.0, "unknown"),
        (math.nan, "unknown"),
    ],
)
def test_a_cost_that_differs_by_less_than_a_hundredth_is_the_same(cost, said):
    a, b = (SimpleNamespace(letter=x, runs=[SimpleNamespace(cost=c)]) for x, c in (("A", 3.0), ("B", 3 * cost)))
    found = rows.price_row(a, b)
    assert (found.verdict, found.difference) == (said, pytest.approx(cost - 1, nan_ok=True))


@pytest.mark.parametrize(
    "one, other, least",
    [((1e-3, True), (2e-3, True), 1e-3), ((1e-3, True), (2e-3, False), 2e-3), ((1e-3, False), (2e-3, False), 1e-3)],
)
def test_hard_are_the_impacts_that_a_deck_names_else_those_of_the_first_side(one, other, least):
    sides = [SimpleNamespace(hard=Hard(energy, found=found)) for energy, found in (one, other)]
    assert rows.threshold(*sides).energy == least


@pytest.mark.parametrize(
    "soft, lasts, other, said",
    [
        (False, "20e-6", 10e-6, "Contacts last 20 us in B, A counts impacts within 10 us as one strike"),
        (False, "6e-6", 10e-6, "Contacts last 6 us in B"),
        (False, "14e-6", 10e-6, None),
        (False, "7e-6", 10e-6, None),
        (True, "20e-6", 10e-6, None),
        (False, "nan", 10e-6, None),
        (True, "nan", 20e-6, "A counts impacts within 10 us as one strike, B within 20 us"),
        (True, "nan", 0.0, "A counts impacts within 10 us as one strike, B within 0 us"),
        (True, "nan", 10e-6, None),
    ],
)
def test_strikes_are_alike_if_their_window_is_about_the_duration_of_a_contact(soft, lasts, other, said):
    firsts = (SimpleNamespace(strike_window=window, contact_duration=float(lasts)) for window in (10e-6, other))
    a, b = (SimpleNamespace(soft=soft, letter=letter, first=first) for letter, first in zip("AB", firsts))
    found = rows.strike_notes(a, b)
    assert found[0].startswith(said) if said else found == []


@pytest.mark.parametrize(
    "begin, duration, differ", [(0.1, 1, False), (0.05, 1, True), (0.2, 1, True), (0.1, 0.99, True)]
)
def test_windows_that_differ_are_told(begin, duration, differ):
    def side(letter, begin, duration):
        run = SimpleNamespace(
            path="a.h5", window=(begin, begin + duration), duration=duration, status="complete", notes=[], steady=True,
            program="millsim", deck=dict, strike_window=math.nan, contact_duration=math.nan,
        )  # fmt: skip
        return SimpleNamespace(letter=letter, first=run, runs=[run], soft=False)

    said = rows.warnings([side("A", 0.1, 1), side("B", begin, duration)])
    assert said == ["The sampled windows of A and B differ."] * differ


def test_the_trend_of_a_run_is_told():
    time = np.linspace(0, 1, 161)

    def of(kinetic, work):
        series = {"kinetic_energy": (time, kinetic), "drive_work": (time, work * time)}
        run = SimpleNamespace(
            span=(0.0, 1.0),
            drive="rotor",
            starts=1,
            _starts=lambda *_: None,
            series=series.get,
            has_series=series.__contains__,
        )
        run._rates = functools.partial(load.Member._rates, run)
        run.bounds, run.means = np.array([0.0, 1.0]), functools.partial(load.Member.means, run)
        return load.Member._trend(run)

    steady = 1 + 0.01 * np.sin(50 * time)
    assert of(steady, 1.0) == of(1 + 0.009 * time, 0.0) == of(steady + 0.04 * time, -1.0) == ""
    assert of(1 - 0.06 * time, 1.0).startswith("energy of the balls changes by 0.06 J")
    assert of(1 + 0.06 * time, 1.0) == "energy of the balls changes by 0.06 J while the rotor does work of 1 J"
    assert of(1 + 0.011 * time, 0.1).startswith(
        "energy of the balls changes by 0.011 J while the rotor does work of 0.1"
    )
    jump = np.where(time < 0.24, 1.08, 1.0) + 0.08 * (time > 0.999)
    assert of(jump, 10.0) == "kinetic energy in the first quarter differs from the rest by 8 %"
    assert of(np.where(time < 0.24, 1.04, 1.0) + 0.04 * (time > 0.999), 10.0) == ""
