"""make validate-tumbling: does it compare what it says?"""

import pathlib
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation" / name) for name in ("tumbling", "", "dem")]

import charges
import mills
import points

from milltools.read.runfile import Run


def test_an_angle_is_off_by_its_difference_also_below_zero():
    toe = next(quantity for quantity in charges.QUANTITIES if quantity.key == "toe")

    class Seen:
        def __init__(self, angle):
            self.values = {"toe": angle}

        def error(self, key):
            return np.nan

    for angle in (-25.0, 25.0):
        hard = [Seen(angle + off) for off in (2.0, 3.0, 4.0)]
        verdict = charges.in_degrees(mills.judge(toe, [Seen(angle)], hard))
        assert verdict.off == pytest.approx(3) and verdict.scatter == pytest.approx(1)
        assert verdict.error == pytest.approx(np.hypot(1, np.sqrt(1 / 3)))


@pytest.mark.slow
def test_a_charge_has_millsims_angles_in_degrees_and_the_fast_impacts_of_all_kinds(millsim, tmp_path):
    path = tmp_path / "run.h5"
    short = ("-s", "run.time=1 s", "-s", "run.sample_from=0.5 s", "-s", "run.starts=1")
    assert millsim("-q", "-o", path, *short, points.DECK).returncode == 0
    seen = charges.Charge(path).values
    with Run(path) as run:
        assert seen["toe"] == pytest.approx(np.degrees(run.charge["toe"][0]))
    assert seen["fast"] == pytest.approx(seen["ball_1"] + seen["drum_1"]) and seen["drum_1"] > 0


def test_the_points_differ_in_speed_and_filling_alone(the_program):
    mills_of = [points.mill(speed, filling) for speed, filling in ((60, 20), (90, 40))]
    assert [one.speed for one in mills_of] == pytest.approx([0.621, 0.932], abs=0.001)  # of a point at the wall
    assert [one.filling for one in mills_of] == pytest.approx([0.2, 0.4], abs=0.003)
    assert mills_of[0].diameter == mills_of[1].diameter == 0.3
