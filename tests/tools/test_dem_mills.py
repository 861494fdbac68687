"""`mill dem` of jars, shaken boxes and drums that ride, beside millsim: the same first impacts, and a file that
readers know."""

import shutil

import numpy as np
import pytest
from conftest import some
from test_dem import first_impacts

from milltools.read.runfile import Run

pytestmark = [pytest.mark.dem, pytest.mark.skipif(not shutil.which("liggghts"), reason="LIGGGHTS is not installed")]

BALLS = """\
[run]
time = 12 ms
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.467
[output]
impacts = all
frames = 1 ms
[balls]
count = 25
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
"""
MILLS = {
    "planetary": """\
[motion.sun]
kind = turn
speed = 500 rpm
angle = 40 deg
[motion.jar]
kind = turn
on = sun
centre = 70 0 0 mm
speed = -1100 rpm
[body.jar]
shape = cylinder
side = inside
motion = jar
centre = 70 0 0 mm
radius = 20 mm
length = 36 mm
""",
    "box": """\
[motion.path]
kind = shift
amplitude = 9 9 2 mm
phase = 90 0 30 deg
frequency = 25 Hz
[body.box]
shape = box
side = inside
motion = path
axis = 1 2 3
size = 32 28 30 mm
""",
    "tumbler": """\
[motion.roll]
kind = turn
axis = 0 1 0
speed = 400 rpm
[body.box]
shape = box
side = inside
motion = roll
angle = 20 deg
size = 32 28 30 mm
[body.bar]
shape = box
motion = roll
centre = 0 0 14 mm
size = 8 9 10 mm
""",
    "drum with lifters": """\
[motion.roll]
kind = turn
axis = 1 0 0
speed = 500 rpm
[drum]
radius = 20 mm
length = 30 mm
motion = roll
[body.lifter]
shape = box
motion = roll
centre = 0 18 0 mm
size = 40 10 4 mm
copies = 3
turn_by = 120 deg
turn_about = 1 0 0
kind = ball_blade
""",
    "slice of a drum with lifters": """\
[motion.roll]
kind = turn
axis = 1 0 0
speed = 500 rpm
[drum]
radius = 22 mm
length = 20 mm
ends = periodic
motion = roll
profile = lifters
lifters = 4
lifter_height = 5 mm
lifter_width = 4 mm
lifter_front = 20 deg
lifter_rounding = 0 mm
""",
    "paddle in a box": """\
[motion.shaft]
kind = swing
axis = 1 0 0
amplitude = 70 deg
frequency = 15 Hz
[body.box]
shape = box
side = inside
size = 40 42 44 mm
axis = 1 0 0
[body.paddle]
shape = box
motion = shaft
size = 30 20 4 mm
""",
}


TWO_KINDS = """\
[balls.large]
count = 8
diameter = 6 mm
density = 7800 kg/m^3
[balls.small]
count = 15
diameter = 4 mm
density = 3000 kg/m^3
"""
CASES = {name: BALLS + text for name, text in MILLS.items()}
CASES["two kinds of balls"] = BALLS[: BALLS.index("[balls]")] + TWO_KINDS + MILLS["planetary"]


@pytest.mark.parametrize("name", some(CASES, 6))
def test_first_impacts_are_millsims_and_so_are_poses(name, mill, millsim, write_deck, tmp_path):
    """Up to a ball's first impact both fly freely: geometry, motions, frame and solving back are the same."""
    write_deck(CASES[name])
    done = mill("dem", "deck.ini", "--quiet", "--modulus", "1e9", "-o", "soft.h5")
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    assert millsim("deck.ini", "-q", "-o", "hard.h5").returncode == 0
    with Run(tmp_path / "soft.h5") as soft, Run(tmp_path / "hard.h5") as hard:
        for state in ("position", "velocity", "angular_velocity"):
            assert soft.frame(0, state) == pytest.approx(hard.frame(0, state), abs=1e-7)
        kinds = [[str(kind) for kind in run.attribute("impacts", "kinds")] for run in (soft, hard)]
        assert kinds[0] == kinds[1]
        ours, theirs = first_impacts(soft, 0.0115), first_impacts(hard, 0.0115)
        for motion, pose in hard.poses(7).items():
            assert soft.poses(7)[motion] == pytest.approx(pose, abs=1e-3)  # a frame is off by half a sample
    # a ball that another one just misses, after its first impact, may be hit in the other program
    shared = ours.keys() & theirs.keys()
    assert len(shared) > 8 and len(shared) >= 0.9 * max(len(ours), len(theirs))
    for key in shared:
        (time, normal_speed, slip, normal), wanted = ours[key], theirs[key]
        assert time == pytest.approx(wanted[0], abs=2e-6), key
        assert normal_speed == pytest.approx(wanted[1], rel=0.02, abs=0.004), key
        assert slip == pytest.approx(wanted[2], rel=0.02, abs=0.02), key
        assert normal == pytest.approx(wanted[3], abs=0.01), key


def test_the_file_of_a_jar_tells_its_drive_as_millsims_does(mill, millsim, write_deck, tmp_path):
    write_deck(BALLS + MILLS["planetary"])
    done = mill("dem", "deck.ini", "--quiet", "--modulus", "1e8", "-o", "soft.h5")
    assert done.returncode == 0, done.stderr
    assert "\ndrive power" in done.stdout and "\nball_jar " in done.stdout
    assert millsim("deck.ini", "-q", "-o", "hard.h5").returncode == 0
    with Run(tmp_path / "soft.h5") as soft, Run(tmp_path / "hard.h5") as hard:
        assert soft.kinds == hard.kinds == ("ball_ball", "ball_jar")
        assert soft.driven == "drive"
        time, work = soft.drive_work()
        power = soft.read("statistics/drive/power")
        assert power == pytest.approx(work[-1] / time[-1], rel=1e-9)
        each = [soft.read(f"statistics/motions/{name}/power") for name in ("sun", "jar")]
        assert sum(each) == pytest.approx(power)
        assert each[1] == pytest.approx(soft.read("statistics/motions/jar/torque") * -1100 * np.pi / 30)  # fmt: skip
        for name in ("cross_section/y_edges", "axial/x_edges"):
            path = f"statistics/maps/{name}"
            assert soft.read(path) == pytest.approx(hard.read(path))
    compared = mill("compare", "hard.h5", "soft.h5")
    assert compared.returncode == 0, compared.stderr
    assert "drive power" in compared.stdout
