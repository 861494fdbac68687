"""A blade that presses balls against something lets them go instead of stopping the run."""

import json

import pytest

DECK = """
[run]
time = 0.3 s
[balls]
count = 200
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 40 mm
length = 40 mm
[rotor]
speed = 1000 rpm
shaft_radius = 8 mm
[blades]
count = 2
tip_radius = 30 mm
width = 10 mm
thickness = 6 mm
pitch = {pitch} deg
[contact]
restitution = 0.8
friction = 0.3
"""


@pytest.mark.parametrize(
    "pitch"end wall"),  # gap of 4.3 mm beside the blades
        0,  # of just a ball's diameter
    ],
)
def test_a_pinched_ball_is_let_go_and_counted(millsim, tmp_path, pitch):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=pitch))
    done = millsim("deck.ini", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    assert "between blade and end wall" in done.stderr  # the warning beforehand
    summary = json.loads(done.stdout)
    assert summary["run"]["reliefs"] > 0
    assert summary["run"]["overlaps"] == 0
    assert "pinched balls were let go" in " ".join(summary["notes"])
