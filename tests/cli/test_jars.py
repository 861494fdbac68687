"""Mills whose walls move, held against theory in seconds; validation/jars is the long form of it."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "validation"))

import ladder
from jars import common, release, scaling, shaken, twins


@pytest.fixture
def case(tmp_path):
    return ladder.Case(ROOT / "validation" / "jars", tmp_path)


def assert_held(case):
    assert case.claims
    wrong = [claim for claim in case.claims if not claim.as_known]
    assert not wrong, wrong


@pytest.mark.slow
def test_a_ball_in_a_shaken_box_hits_each_end_once_a_period_with_the_speed_of_theory(case):
    for e, ratio, table in shaken.BOX:
        mill = shaken.in_box(e, ratio)
        log, _ = shaken.run(case, mill, 0.1, -1.5 * table * shaken.A, 10.0, **common.NO_GRAVITY)
        unit = float(mill.amplitude * mill.omega)
        assert log["normal_speed"][-20:] / unit == pytest.approx(table, abs=6e-7)


@pytest.mark.slow
def test_a_ball_in_a_box_too_short_for_even_hits_hits_its_ends_unevenly(case):
    shaken.box_uneven(case)
    assert_held(case)


@pytest.mark.parametrize("row", release.CASES, ids=[row[0] for row in release.CASES])
def test_a_ball_released_from_the_wall_of_a_planetary_jar_meets_it_again_as_theory_says(case, row):
    release.one(case, *row)
    assert_held(case)


@pytest.mark.slow
def test_a_planetary_mill_at_twice_the_speed_has_the_same_impacts_and_eight_times_the_power(case):
    scaling.same_impacts(case)
    assert_held(case)


@pytest.mark.slow
def test_mirrored_turned_and_shifted_twins_of_a_planetary_mill_have_the_same_impacts(case):
    _, curves = twins.mirrored_and_turned(case)
    twins.not_turning(case, curves)
    twins.own_spin(case, curves)
    assert_held(case)
