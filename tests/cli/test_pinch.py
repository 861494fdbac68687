"""A blade that presses balls against something lets them go instead of stopping the run."""

import json

import pytest

DECK = """
[run]
time = 0.22 s
seed = 3
[balls.big]
count = 150
diameter = 8 mm
density = 7800 kg/m^3
[balls.little]
count = 150
diameter = 5 mm
density = 2500 kg/m^3
[drum]
radius = 50 mm
length = 60 mm
[rotor]
speed = 1200 rpm
shaft_radius = {shaft} mm
[blades]
count = {blades}
tip_radius = 38 mm
width = 10 mm
thickness = 6 mm
[contact]
restitution = 0.7
friction = 0.3
tangential_restitution = 0.4
rebound_floor = 0.02 m/s
"""


@pytest.mark.parametrize(
    "shaft, blades",
    [
        # tip gap 12 mm: a small ball and a large one in a row do not fit between tip and drum
        (20, 2),
        # the gap between a blade's side and the end wall is exactly one small ball
        (10, 3),
    ],
)
def test_a_pinched_ball_is_let_go_and_counted(millsim, tmp_path, shaft, blades):
    (tmp_path / "deck.ini").write_text(DECK.format(shaft=shaft, blades=blades))
    done = millsim("deck.ini", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    run = json.loads(done.stdout)["run"]
    assert run["reliefs"] > 0
    assert run["overlaps"] == 0
    assert run["largest_overlap"] < 1e-9
