"""What the summary warns of."""

import json

import h5py
import pytest
from conftest import ROOT


def notes(done):
    assert done.returncode == 0, done.stderr
    return " ".join(json.loads(done.stdout)["notes"])


def test_a_window_in_which_the_charge_still_gains_energy_is_called_unsteady(millsim):
    window = ["-s", "run.time=50ms", "-s", "run.sample_from=20ms"]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *window)
    assert "not steady" in notes(done)


@pytest.mark.slow
def test_a_charge_in_its_steady_state_is_not(millsim):
    window = ["-s", "run.time=160ms", "-s", "run.sample_from=100ms"]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *window)
    assert "not steady" not in notes(done)


@pytest.mark.thorough
def test_few_balls_in_a_smooth_drum_without_friction_end_as_a_ring(millsim):
    options = ["balls.count=100", "contact.friction=0", "run.time=3s", "run.sample_from=2s"]
    sets = [word for option in options for word in ("-s", option)]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *sets)
    assert "turns as a ring" in notes(done)


PLANETARY = (ROOT / "input/planetary.ini", "-s", "run.time=1.5 s", "-s", "output.frames=0 s")
BED = ("balls.count=50", "balls.diameter=10 mm", "body.jar.radius=37 mm", "body.jar.length=58.1 mm")
SLOW = ("motion.sun.speed=300 rpm", "motion.jar.speed=-600 rpm")


@pytest.mark.slow
def test_no_error_is_given_of_one_start_of_a_charge_pressed_to_a_moving_wall(millsim):
    sets = [word for order in (*BED, *SLOW, "run.starts=1") for word in ("-s", order)]
    assert "no errors are known from one start" in notes(millsim("--json", *PLANETARY, *sets))
    said = notes(millsim("--json", "-f", *PLANETARY, "-s", "run.starts=1"))
    assert "one start" not in said  # seven balls fly


def test_balls_that_a_bowl_presses_are_not_said_to_be_hit_several_times_at_once(millsim):
    said = notes(millsim("--json", ROOT / "input/vibratory.ini", "-s", "run.time=1 s"))
    assert "a ball is hit every" not in said


@pytest.mark.slow
def test_a_ball_that_runs_along_a_wall_is_not_known_from_one_start(millsim):
    sets = ("motion.arm.frequency=25 Hz", "balls.count=1", "balls.diameter=10 mm", "run.starts=1")
    words = [word for order in sets for word in ("-s", order)]
    said = notes(millsim("--json", ROOT / "input/mixer.ini", *words))
    assert "no errors are known from one start" in said


@pytest.mark.slow
def test_a_body_that_no_ball_has_met_is_named(millsim):
    sets = ("-s", "body.rotor.unit=um", "-s", "run.time=0.3 s")
    said = notes(millsim("--json", ROOT / "input/stl.ini", *sets))
    assert "no ball has met a surface of the kind ball_rotor" in said


# Two balls across a gap of 1.875 diameters. 27 us later they are locked, and the power is one of the program.
BRIDGE = """
[run]
time = 100 us
[drum]
radius = 40 mm
length = 15 mm
[motion.shaft]
kind = turn
axis = 1 0 0
speed = 4000 rpm
[body.disc]
shape = cylinder
motion = shaft
axis = 1 0 0
centre = -2.5 0 0 mm
radius = 30 mm
length = 5 mm
[balls]
count = 2
start = start.txt
diameter = 4 mm
density = 6050 kg/m^3
[contact]
restitution = 0.9
friction = 0.3
tangential_restitution = 0.4
"""


def test_two_balls_that_bridge_a_disc_and_a_wall_are_said_to_make_the_power_depend_on_stiffness(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(BRIDGE)
    (tmp_path / "start.txt").write_text("0.002001 -0.00378 0.00954 -0.3 -0.4 -0.8\n0.0055 -0.00572 0.00972 0.4 -0.3 0")
    done = millsim("deck.ini", "--json", "--quiet")
    run, said = json.loads(done.stdout)["run"], notes(done)
    assert run["smoothed"] == 0 and run["bridges"] == 1
    assert run["reach"]["bridges"]["value"] == run["bridge_work"] / run["drive_work"] > run["reach"]["bridges"]["limit"]
    assert "in gaps of 1.83 to 2 diameters" in said and "depends on the stiffness" in said and "mill check" in said
    with h5py.File(tmp_path / "deck.h5") as file:
        assert " ".join(file["run/notes"].asstr()[()].splitlines()) == said
