"""The program against the slow oracle of tests/oracle, impact by impact, on mills of 1 to 6 balls.

How far the two must agree, and why not for ever, is told in tests/oracle/few_balls.py.
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from conftest import some

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracle"))

from decks import random_case
from few_balls import census, compare, predict
from oracle import KINDS, wavy_arcs

SEEDS = range(1, 41)
WAVY_SEEDS = range(1, 19)


@cache
def prediction(seed, wavy=False):
    return predict(random_case(seed, wavy))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", some(SEEDS, 40))
def test_the_program_finds_every_impact_of_the_oracle(seed, tmp_path):
    story = compare(random_case(seed), prediction(seed), tmp_path)
    assert story is None, story


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", some(WAVY_SEEDS, 24))
def test_the_program_finds_every_impact_of_the_oracle_in_a_wavy_drum(seed, tmp_path):
    story = compare(random_case(seed, wavy=True), prediction(seed, True), tmp_path)
    assert story is None, story


@pytest.mark.slow
@pytest.mark.thorough
def test_the_mills_meet_every_kind_of_contact_often():
    runs = [prediction(seed) for seed in SEEDS]
    count = census(runs)
    assert min(len(run) for run in runs) >= 8
    assert sum(len(run) for run in runs) >= 2000
    assert min(count[kind] for kind in KINDS) >= 100, count
    assert min(count[part] for part in ("face", "edge", "corner")) >= 10, count
    assert min(count[grip] for grip in ("smooth", "sticking", "sliding")) >= 300, count
    assert count["bounced"] >= 1500 and count["floored"] >= 100, count


def test_the_mills_use_the_whole_deck():
    cases = [random_case(seed) for seed in SEEDS]
    mills = [case.mill for case in cases]
    assert {len(mill.radius) for mill in mills} == {1, 2, 3, 4, 5, 6}
    assert {case.columns for case in cases} == {3, 6, 9}
    for holds in (
        lambda c: c.mill.rotor_speed > 0,
        lambda c: c.mill.rotor_speed < 0,
        lambda c: "rotor" not in c.sections,
        lambda c: "rotor" in c.sections and not c.mill.blades,
        lambda c: "blades" in c.sections and len(c.mill.blades) > int(c.sections["blades"]["count"]),
        lambda c: "angle_step" in c.sections.get("blades", {}),
        lambda c: any(blade.pitch > 0.5 for blade in c.mill.blades),
        lambda c: any(blade.pitch < -0.5 for blade in c.mill.blades),
        lambda c: len(set(c.mill.radius)) > 1 and len(set(c.mill.density)) > 1,
        lambda c: not c.mill.gravity.any(),
        lambda c: c.mill.gravity[0] != 0,
        lambda c: all(law.friction == 0 for law in c.mill.laws.values()),
        lambda c: len(set(c.mill.laws.values())) > 2,
        lambda c: any(law.friction and law.tangential < 0 for law in c.mill.laws.values()),
        lambda c: c.mill.rebound_floor != 5e-3,
    ):
        assert sum(map(holds, cases)) >= 2


@pytest.mark.slow
@pytest.mark.thorough
def test_the_wavy_mills_meet_both_kinds_of_arcs_often():
    count = census(prediction(seed, True) for seed in WAVY_SEEDS)
    assert min(count["outer"], count["inner"]) >= 80, count
    assert sum(count[kind] for kind in KINDS) >= 500


@pytest.mark.slow
def test_the_wavy_mills_are_shallow_deep_and_overhanging_with_wide_and_narrow_bulges():
    mills = [random_case(seed, wavy=True).mill for seed in WAVY_SEEDS]
    arcs = [wavy_arcs(mill) for mill in mills]
    overhang = [mill.buckle_height / mill.drum_radius / np.sin(np.pi / (2 * mill.buckles)) for mill in mills]
    assert sum(x < 0.3 for x in overhang) >= 3
    assert sum(0.3 < x < 1 for x in overhang) >= 3
    assert sum(x > 1 for x in overhang) >= 3
    # beyond a right angle the mouth of a bulge is narrower than its inside
    assert sum(half[0] > np.pi / 2 for *_, half in arcs) >= 3
    assert sum(rho < mill.radius.max() for (_, rho, _, _), mill in zip(arcs, mills)) >= 3
    assert sum(rho > 5 * mill.radius.max() for (_, rho, _, _), mill in zip(arcs, mills)) >= 3
    assert {mill.buckles for mill in mills} >= {2, 12, 20}
    assert sum(mill.buckle_angle != 0 for mill in mills) >= 10
