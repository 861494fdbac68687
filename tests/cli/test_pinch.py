"""A blade that presses balls against something lets them go instead of stopping the run."""

import json
import re

import h5py
import numpy as np
import pytest
from conftest import ROOT

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
rebound_floor = 5 mm/s
"""


@pytest.mark.parametrize("pitch", [20, 0])  # gaps of 4.3 mm and of just a ball's diameter
def test_a_pinched_ball_is_let_go_and_booked(millsim, tmp_path, pitch):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=pitch))
    done = millsim("deck.ini", "--json", "--quiet", "-s", "run.sample_from=0 s")
    assert done.returncode == 0, done.stderr
    assert "[blades]: comes as near as" in done.stderr and "to an end wall of [drum]" in done.stderr  # beforehand
    summary = json.loads(done.stdout)
    assert summary["run"]["reliefs"] > 0
    assert summary["run"]["overlaps"] == 0 < summary["run"]["largest_overlap"] < 1e-12
    run = summary["run"]
    assert run["pinch_contacts"] > 0 and run["pinch_time"] > 0
    told = "balls that it presses against others and walls" in " ".join(summary["notes"])
    rotor = summary["statistics"]["rotor"]
    assert told == (rotor["pinch_power"] > 0.2 * rotor["power"])
    assert rotor["pinch_power"] == summary["statistics"]["drive"]["pinch_power"] > 0
    assert rotor["pinch_power"] * 0.3 == pytest.approx(run["pinch_work"])


def test_which_of_several_motions_presses_balls_is_not_known(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=20))
    done = millsim("deck.ini", "--json", "--quiet", "-s", "motion.idle.kind=turn", "-s", "motion.idle.speed=60 rpm")
    statistics = json.loads(done.stdout)["statistics"]
    assert statistics["rotor"]["pinch_power"] is None and statistics["drive"]["pinch_power"] > 0


def test_the_summary_says_how_much_power_presses_balls_and_when_it_matters(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=20))
    done = millsim("deck.ini", "-q")
    with h5py.File(tmp_path / "deck.h5") as file:
        power, share = (file[f"statistics/rotor/{name}"][()] for name in ("power", "pinch_power"))
    line = re.search(
        r"^pinches +\S+ \S*W \(([\d.]+) %\) go to balls that parts press; harmless below 20 %$", done.stdout, re.M
    )
    assert float(line[1]) == pytest.approx(100 * share / power, rel=0.06)


def test_contacts_of_pressed_balls_are_neither_counted_nor_logged(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=20))
    wide = ["-s", "blades.width=12 mm", "-s", "output.impacts=all"]
    done = millsim("deck.ini", "--json", "--quiet", *wide)
    run = json.loads(done.stdout)["run"]
    assert run["pinch_contacts"] > 1000
    with h5py.File(tmp_path / "deck.h5") as file:
        rows = file["impacts/time"].shape[0]
        counted = file["statistics/impacts/all/count"][()]
        lost = file["statistics/impacts/all/dissipated_power"][()] * file["statistics/duration"][()]
        told = sum(series["value"][-1] for series in file["observables/dissipation"].values())
        logged = file["impacts/dissipation"][:].sum()
    assert rows == counted == sum(run["collisions"].values())
    assert lost == pytest.approx(told, rel=1e-9)  # what they lose is in the books
    assert logged < lost


def test_a_blade_that_jams_balls_gives_them_no_speeds_beyond_its_own(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(pitch=20))
    millsim("deck.ini", "--json", "--quiet", "-s", "output.impacts=all")
    tip = 30e-3 * 2 * np.pi * 1000 / 60
    with h5py.File(tmp_path / "deck.h5") as file:
        speed = file["impacts/normal_speed"][:]
    assert np.quantile(speed, 0.9999) < (1 + 0.8) * tip


# gap [mm]; LIGGGHTS has 1.05 and 1.3 times the power, rigid balls that jam 1.8 and 2.6 times
@pytest.mark.slow
@pytest.mark.long
def test_balls_squeezed_through_a_gap_take_little_more_power_than_those_that_fit(millsim):
    powers = []
    for mm in (5.3, 4.9, 4.65):
        tip = np.sqrt((75 - mm) ** 2 - 3.5**2)  # of corners 3.5 mm off the middle
        orders = ["-s", f"blades.tip_radius={tip:.9g} mm", "-s", "run.time=100 ms", "-s", "run.sample_from=50 ms"]
        done = millsim(ROOT / "input/simoloyer.ini", *orders, "--json", "-q", "-o", f"{mm}.h5")
        powers.append(json.loads(done.stdout)["statistics"]["rotor"]["power"])
    assert 1 < powers[1] / powers[0] < 1.3
    assert 1 < powers[2] / powers[0] < 1.5


PADDLE = """
[run]
time = 100 ms
[balls]
count = 1
diameter = {diameter} mm
density = 7800 kg/m^3
start = start.txt
[drum]
radius = 50 mm
length = 60 mm
[rotor]
speed = 600 rpm
shaft_radius = 5 mm
angle = -150 deg
[contact]
restitution = 0.8
friction = 0.5
"""
SIDE_BY_SIDE = """
[blades]
count = 2
tip_radius = 45.2 mm
width = 30 mm
thickness = 5 mm
angle_step = 0 deg
"""
APART = """
[blade.a]
position = -3 mm
angle = 0 deg
tip_radius = 40 mm
width = 1 mm
thickness = 5 mm
[blade.b]
position = 3 mm
angle = 0 deg
tip_radius = 40 mm
width = 1 mm
thickness = 5 mm
"""


@pytest.mark.parametrize(
    "blades, diameter, start",
    [(SIDE_BY_SIDE, 5, "0 0 -0.0475"), (APART, 12, "0 0 -0.044")],
)
def test_a_ball_pinched_by_two_blades_at_once_is_let_go_by_both(millsim, tmp_path, blades, diameter, start):
    (tmp_path / "deck.ini").write_text(PADDLE.format(diameter=diameter) + blades)
    (tmp_path / "start.txt").write_text(start)
    done = millsim("deck.ini", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["run"]["reliefs"] > 0


CORNER = """
[run]
time = 10 ms
[balls]
count = 1
diameter = 5 mm
density = 7800 kg/m^3
start = start.txt
[drum]
radius = 50 mm
length = 60 mm
[contact]
restitution = 0.8
friction = 1
tangential_restitution = 0.8
"""


def test_a_ball_that_friction_keeps_in_a_corner_does_not_stop_time(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(CORNER)
    (tmp_path / "start.txt").write_text("0.0275 0 -0.0475 0.0030 0 0.0058 0 -5.854 0")
    done = millsim("deck.ini", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    run = json.loads(done.stdout)["run"]
    assert run["smoothed"] > 0
    assert run["energy_balance_error"] < 1e-9


def test_the_books_of_a_ball_at_rest_close(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(CORNER)
    (tmp_path / "start.txt").write_text("0 0 -0.0475")
    heavy = ["-s", "gravity.acceleration=0 0 -981 m/s^2", "-s", "contact.rebound_floor=0.1 mm/s"]
    run = json.loads(millsim("deck.ini", "--json", "--quiet", *heavy).stdout)["run"]
    assert run["energy_balance_error"] < 1e-9
    assert run["not_closing"] == 0
