"""Expressions of results: values, units and errors; what a table keeps of a run answers as the run itself."""

import math

import numpy as np
import pytest

from milltools.base.errors import UserError
from milltools.read import sums
from milltools.read.expression import Expression, Requirement, split
from milltools.read.results import Results, _edges, _law
from milltools.read.runfile import PRECISION, Run

EDGES = [1e-4, 1e-3, 1e-2]


def results(**changes):
    """Results of 2 s with 300 impacts below and 100 above 1 mJ, of which 20 are above 10 mJ."""
    return Results(
        {
            "duration": 2.0, "mass": 4.0,
            "scalars": {
                "W": {"rotor/power": [50.0, 1.0], "impacts/ball_ball/dissipated_power": [20.0, None]},
                "s-1": {"impacts/all/rate": [200.0, 2.0]},
                "N m": {"rotor/torque": [3.0, 0.1]},
                "rad": {"charge/toe/value": [-0.5, 0.1]},
            },
            "known": {"all": [[200.0, 2.0], [40.0, 1.6], [4.0, 1.0], [0.0, None]], "ball_ball": [[0.0, None]] * 4},
            "bins": {"J": EDGES}, "counts": {"J": {"all": [0, 0, 300, 80, 20], "ball_ball": [0, 0, 0, 0]}},
        } | changes
    )  # fmt: skip


@pytest.fixture
def example(millsim, small_deck, tmp_path):
    done = millsim("deck.ini", "-q", "-s", "run.time=600 ms", "-s", "run.sample_from=10 ms")
    assert done.returncode == 0, done.stderr
    return tmp_path / "deck.h5"


def value(text):
    return Expression(text).of(results())


@pytest.mark.parametrize(
    "text, wanted, unit",
    [
        ("power", 50, "W"),
        ("torque", 3, "N m"),
        ("power / mass", 12.5, "W kg-1"),
        ("rate_above(1 mJ) / power", 1, "J-1"),
        ("rate_above(1000 uJ)/power", 1, "J-1"),
        ("impacts/all/rate / rotor/power", 4, "J-1"),
        ("rate_above(1 mJ, ball_ball)", 0, "s-1"),
        ("-(power - 20 W) * 2", -60, "W"),
        ("power * 1 h - 0.05 kWh", 0, "J"),
        ("mass / (2 kg + 200 g)", 4 / 2.2, "1"),
        ("dissipation(ball_ball) / 5 W", 4, "1"),
        ("1 t + 2 kg", 1002, "kg"),
        ("power*2/10", 10, "W"),
        ("power*3/1.5 + 2 W*10", 120, "W"),
        ("1 m/10 + 3/s2*2 m/1/s-2", 6.1, "m"),
        ("3 1/s + 2 s-1/1", 5, "s-1"),
        ("10" + 249 * "+1", 259, "1"),  # 500 letters, the most
        ("1 min + 1 h", 3660, "s"),
        ("1 mWh + 1 kNm", 1003.6, "J"),
        ("5 %", 0.05, "1"),
        ("1 MPa", 1e6, "N m-2"),
        ("1 GHz + 60 rpm", 1e9 + math.tau, "s-1"),
        ("1 N", 1, "N"),
        ("1 cm + 1 um + 1 µm + 1 μm + 1 nm", 0.010003001, "m"),
        ("1 rad", 1, "1"),
        ("1 mm/s^2", 1e-3, "m s-2"),
    ],
)
def test_an_expression_has_its_value_and_unit(text, wanted, unit):
    found = value(text)
    assert found.value == pytest.approx(wanted) and found.unit == unit


def test_a_threshold_is_exact_at_an_edge_and_logarithmic_within_a_bin():
    assert value("rate_above(10 mJ)").value == 10
    assert value("rate_above(3.16227766 mJ)").value == pytest.approx((40 + 20) / 2, rel=1e-6)


def test_the_error_of_a_quotient_is_that_of_both_relative_errors():
    found = value("impacts/all/rate / power")
    assert found.error / found.value == pytest.approx(math.hypot(2 / 200, 1 / 50))


def test_a_number_that_occurs_twice_has_one_error():
    assert value("power / power").error == pytest.approx(0, abs=1e-12)
    assert value("power + power").error == pytest.approx(2.0)
    speeds = results(bins={"m/s": [0.5, 1.0, 2.0]}, counts={"m/s": {"all": [0, 0, 320, 72, 8]}})
    found = Expression("rate_above(0.5 m/s) / rate_above(1 m/s)").of(speeds)  # two numbers
    assert found.error / found.value == pytest.approx(math.hypot(1.6 / 200, 1.0 / 40))


def blocks(seed=5):
    """48 blocks of a run: impacts below and from 1 mJ on, and the power lost, which follows the hard impacts."""
    random = np.random.default_rng(seed)
    soft, hard = 100 + random.integers(0, 40, 48), 40 + random.integers(0, 20, 48)
    lost = np.rint(200 * hard + random.normal(0, 200, 48)).astype(int)
    counts = {"ball_ball": [soft.tolist(), hard.tolist()], "ball_drum": [[0] * 48, [0] * 48]}
    known = {kind: [[0.0, None]] * 4 for kind in ("all", *counts)}
    counts = {"period": 0, "counts": counts, "lost": {"ball_ball": lost.tolist(), "ball_drum": [0] * 48}}
    spectrum = [0, 0, int(soft.sum()), int(hard.sum()), 0]
    return hard, lost, results(blocks=counts, known=known, counts={"J": {"all": spectrum, "ball_ball": spectrum}})


def test_the_error_of_a_threshold_comes_from_the_impacts_above_it_in_blocks_of_time_and_is_at_least_that_of_counting():
    hard, _, kept = blocks()
    own, counting = hard.std(ddof=1) / hard.mean() / np.sqrt(48), 1 / np.sqrt(hard.sum())
    found = Expression("rate_above(1 mJ)").of(kept)
    assert found.error / found.value == pytest.approx(max(own, counting), rel=0.4)
    assert found.error / found.value >= counting * (1 - 1e-12)
    assert math.isnan(value("rate_above(1 mJ)").error)  # without blocks


def test_what_is_known_in_blocks_of_time_are_rates_losses_and_the_power_that_losses_follow():
    hard, lost, kept = blocks()
    soft = np.array(kept.blocks["counts"]["ball_ball"][0])
    for path, series in {
        "rotor/power": lost, "drive/power": lost, "impacts/all/dissipated_power": lost,
        "impacts/ball_ball/dissipated_power": lost, "impacts/ball_drum/dissipated_power": 0 * lost,
        "impacts/all/rate": soft + hard, "impacts/ball_ball/rate": soft + hard,
    }.items():  # fmt: skip
        assert kept.history(path) == pytest.approx(series), path
    for path in ("rotor/torque", "impacts/all/normal_speed/mean", "impacts/ball_drum/rate", "floor_share/ball_ball"):
        assert kept.history(path) is None, path
    assert results().history("rotor/power") is None


def test_the_error_of_a_quotient_of_what_rises_and_falls_together_is_the_scatter_of_replicates():
    quotient, errors, apart = [], [], []
    for seed in range(200):
        hard, lost, kept = blocks(seed)
        found = Expression("rate_above(1 mJ) / power").of(kept)
        quotient.append(hard.sum() / lost.sum())
        errors.append(found.error / found.value)
        apart.append(np.hypot(*(x.std() / x.mean() / np.sqrt(48) for x in (hard, lost))))
    scatter = np.std(quotient, ddof=1) / np.mean(quotient)
    assert np.median(errors) == pytest.approx(scatter, rel=0.25) and np.mean(apart) > 2 * scatter


def test_a_quotient_is_the_same_however_it_is_written():
    _, _, kept = blocks()
    found = Expression("rate_above(1 mJ) / power").of(kept)
    twice = Expression("(rate_above(1 mJ) + rate_above(1 mJ)) / (2 * power)").of(kept)
    assert twice.error == pytest.approx(found.error) and found.error > 0
    assert Expression("rate_above(1 mJ, ball_ball) / rate_above(1 mJ)").of(kept).error == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("text", ["dissipation(ball_ball) / power", "power / (power - power)", "power * 1e300 * 1e300"])
def test_an_unknown_error_of_one_part_or_a_value_that_is_no_number_makes_the_error_unknown(text):
    assert math.isnan(value(text).error)


@pytest.mark.parametrize(
    "text, says",
    [
        ("power + mass", "W and kg cannot be added"),
        ("powr", "unknown name 'powr'; there are power, torque"),
        ("rate_above(1 xJ)", "unknown unit 'xJ' behind 1"),
        ("rate_above(3 W)", "rate_above needs a speed or an energy"),
        ("power(ball_ball)", "'power' takes nothing in parentheses"),
        ("rate(ball_moon)", "no kind of contact 'ball_moon'; there are all, ball_ball"),
        ("impacts/all/rte", "did you mean 'impacts/all/rate'?"),
        ("rate_above(1 m/s)", "no spectra by speed are kept"),
        ("(power", "expected an expression"),
        ("power ** 2", "expected numbers, names, + - * / and parentheses"),
        ("__import__('os')", "has no meaning here"),
        ("power if power else mass", "expected an expression"),
        ("", "expected an expression"),
        ("power / 0", "'power / 0': divides by zero"),
        ("power * 1 km^999", "unknown unit 'km^999' behind 1"),
        ("power * 1 Gm^9.Gm^9.Gm^9.Gm^9", "the number 1 Gm^9.Gm^9.Gm^9.Gm^9 is too large"),
        ("power * 1 m^" + 5000 * "9", "expected an expression of at most 500 letters, got 5012"),
        ("100" + 249 * "+1", "at most 500 letters, got 501"),
    ],
)
def test_a_wrong_expression_is_said_in_one_line(text, says):
    with pytest.raises(UserError) as fault:
        value(text)
    assert says in str(fault.value) and len(str(fault.value)) < 300


def test_words_are_those_of_people():
    assert Expression("rate_above(1 mJ) / power").words == "impacts of 1 mJ or more per joule"
    assert Expression("rate_above(1 m/s, ball_ball)").words == "rate of ball-ball impacts of 1 m/s or more"
    assert Expression("power * 2").words == "(power * 2)" and Expression("-power").words == "-power"
    assert Expression("mass / 2 kg").words == "mass of the balls per 2 kg"
    assert Expression("dissipation(ball_wall)").words == "dissipated power (ball-wall)"
    path = "impacts/ball_ball/normal_speed/median_above_floor"
    assert Expression(path).words == "median normal ball-ball impact speed above the floor"


def test_the_parts_of_a_quotient_are_expressions():
    assert [part.text for part in Expression("rate_above(1 mJ, ball_ball) / (power - 5 W)").ratio] == [
        "rate_above(1 mJ, ball_ball)", "power - 5 W",
    ]  # fmt: skip


def test_commas_within_parentheses_do_not_divide_a_list():
    assert split("rate_above(1 mJ, ball_ball) / power, mass") == ["rate_above(1 mJ, ball_ball) / power", "mass"]


def test_a_requirement_tells_by_how_much_it_is_violated():
    assert Requirement.read("power <= 45 W").excess(results()) == (5.0, 1.0)
    assert Requirement.read("power >= 0.06 kW").excess(results())[0] == pytest.approx(10)
    for text in ("toe >= -30 deg", "toe >= -0.4 rad", "toe <= 0"):
        Requirement.read(text).check(results())


@pytest.mark.parametrize(
    "text, says",
    [
        ("power", "expected a requirement such as 'power <= 225 W'"),
        ("power <= mass", "expected a number with its unit on the right"),
        ("power <= 1 km^999", "unknown unit 'km^999' behind 1"),
        ("power <= 1e300 * 1e300 W", "the limit is too large"),
        ("power <= 225", "power has the unit W, and the limit has another one"),
        ("toe >= -30", "toe is an angle: give the limit in deg or rad"),
    ],
)
def test_a_wrong_requirement_is_said_in_one_line(text, says):
    with pytest.raises(UserError) as fault:
        Requirement.read(text).check(results())
    assert says in str(fault.value)


def test_what_is_kept_of_a_run_answers_as_the_run(example):
    with Run(example) as run:
        kept = Results.unpack(Results.of(run).pack())
        for kind in ("all", "ball_ball", "ball_drum"):
            for limit in (1e-7, 2.5e-6, 1e-4):
                count = run.histogram(kind, speed="normal_energy").above(limit)
                assert kept.above(limit, "J", kind)[0] == pytest.approx(count / run.duration, rel=1e-9)
            count = run.histogram(kind).above(0.2)
            assert kept.above(0.2, "m/s", kind)[0] == pytest.approx(count / run.duration, rel=1e-9)
        hard = sums.total(run, sums.above(2.0**-16 * 1e-3))
        shown = Expression(f"rate_above({2.0**-16} mJ) / rotor/power").of(kept)
        quotient, error, _ = hard.over(sums.total(run, sums.itself, "dissipated"))
        assert hard.value > 0 and shown.error / shown.value == pytest.approx(error / quotient, rel=0.02)
        for path in (*PRECISION, "impacts/ball_ball/rate", "impacts/all/rate", "impacts/all/count"):
            expected = run.statistic(path), math.nan if path.endswith("count") else run.standard_error(path)
            assert kept.scalar(path) == pytest.approx(expected, nan_ok=True), path
        assert kept.data["mass"] == pytest.approx(run.balls("mass").sum())


@pytest.mark.parametrize("text", ["", "nonsense", "eJyrVkrOzytJrShRslIyVKoFACY4BLc="])
def test_a_text_that_holds_no_results_gives_none(text):
    assert Results.unpack(text) is None


def test_edges_of_bins_that_follow_no_law_are_kept_one_by_one():
    assert _law(np.geomspace(1e-3, 1, 4)) == ["log", 1e-3, 1.0, 4]
    edges = np.array([1e-3, 2e-3, 3e-3, 9e-3])
    assert np.array_equal(_edges(_law(edges)), edges)
