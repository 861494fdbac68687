"""The program against the slow oracle of tests/oracle on mills of any bodies and motions, impact by impact.

Every impact agrees in kind and partners, to 1e-9 s and 1e-7 m/s, as far as rounding lets a mill's future be known:
how far that is the oracle finds out from twins, as tests/oracle/few_balls.py tells.
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from conftest import some

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracle"))

from few_balls import census, compare, predict
from mill_decks import BODIES, random_mill

SEEDS = range(1, 71)

case_of = cache(random_mill)


@cache
def prediction(seed):
    return predict(case_of(seed))


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize("seed", some(SEEDS, 70))
def test_the_program_finds_every_impact_of_the_oracle(seed, tmp_path):
    story = compare(case_of(seed), prediction(seed), tmp_path)
    assert story is None, story


@pytest.mark.slow
@pytest.mark.thorough
def test_the_mills_meet_all_parts_of_all_bodies():
    runs = [prediction(seed) for seed in SEEDS]
    count = census(runs)
    assert min(len(run) for run in runs) >= 3
    assert sum(len(run) for run in runs) >= 2000
    inner = sum(n for kind, n in count.items() if kind.startswith(("ball_part", "ball_inner")))
    assert inner >= 100, count
    for kind, least in {"ball_ball": 100, "ball_jar": 500, "ball_drum": 100, "ball_wall": 50, "ball_lifter": 10,
                        "ball_pin": 3, "ball_baffle": 10, "ball_inner": 10}.items():  # fmt: skip
        assert count[kind] >= least, (kind, count)
    for part in ("Box face", "Box edge", "Frustum side", "Frustum end", "Frustum edge", "Capsule end",
                 "Mesh face", "Mesh edge", "CapsuleInside side", "CapsuleInside end", "FrustumInside side",
                 "FrustumInside end", "BoxInside x+", "Drum mantle"):  # fmt: skip
        assert count[part] >= 3, (part, count)
    assert min(count[grip] for grip in ("smooth", "sticking", "sliding")) >= 200, count
    assert count["bounced"] >= 1000 and count["floored"] >= 100, count


@pytest.mark.slow
@pytest.mark.thorough
def test_the_mills_use_all_of_bodies_and_motions():
    decks = [case_of(seed).deck(0.1) for seed in SEEDS]
    mills = [case_of(seed).mill for seed in SEEDS]
    for line in (
        *(f"shape = {way.split()[-1]}\n" for way in BODIES),
        *(f"kind = {kind}\n" for kind in ("turn", "swing", "shift", "table")),
        *("on = ", "side = inside", "copies = ", "turn_by = ", "shift_by = ", "turn_about = "),
        *("rounding = ", "angle = ", "phase = ", "kind = ball_inner", "motion = rotor", "wavy"),
        *("deg/s", "rad/s", "rpm", "1/min", "Hz", "1/s", "[contact.ball_"),
    ):
        assert sum(line in deck for deck in decks) >= 2, line
    assert {len(mill.radius) for mill in mills} == {1, 2, 3, 4, 5, 6}
    speeds = [max(mill.wall_speed(surface) for surface in mill.surfaces) for mill in mills]
    assert np.min(speeds) > 0.3 and np.max(speeds) < 5.0
