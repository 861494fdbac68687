"""The charge of a tumbling mill in the output file and in the summary: docs/tumbling.md."""

import json
import math
import pathlib
import re
import subprocess

import h5py
import numpy as np
import pytest
from conftest import PROGRAM
from results import OWN, differences
from test_resume import INTERVAL, Folder

INPUT = pathlib.Path(__file__).resolve().parents[2] / "input"
# 30 % filled, with lifters
DRUM = """\
[run]
time = 4 s
sample_from = 1 s
starts = 4
[drum]
radius = 100 mm
length = 45 mm
ends = periodic
motion = roll
[motion.roll]
kind = turn
axis = 1 0 0
speed = 70 rpm
[body.lifter]
shape = box
motion = roll
centre = 0 98 0 mm
size = 55 20 10 mm
copies = 8
turn_by = 45 deg
turn_about = 1 0 0
[balls]
bulk_fill = 30 %
diameter = 14 mm
density = 7800 kg/m^3
[contact]
restitution = 0.5
friction = 0.4
tangential_restitution = 0.4
[output]
frames = 0 s
series = 10 ms
checkpoint = 1 h
"""
NUMBERS = ("toe", "shoulder", "repose", "in_flight", "circulation_across", "circulation_up")


def run(folder, *sets, deck=DRUM, name="mill"):
    """The open output file and the summary of a run."""
    path = folder / f"{name}.ini"
    path.write_text(deck)
    orders = [word for order in sets for word in ("-s", order)]
    done = subprocess.run([PROGRAM, "-q", "-j", "-f", "-o", folder / f"{name}.h5", *orders, path], capture_output=True)
    assert done.returncode == 0, done.stderr
    return h5py.File(folder / f"{name}.h5"), json.loads(done.stdout)


@pytest.fixture(scope="module")
def seeds(tmp_path_factory):
    """Runs of DRUM with two seeds."""
    folder = tmp_path_factory.mktemp("charge")
    return [run(folder, f"run.seed={seed}", name=f"seed{seed}") for seed in (1, 2)]


def known(file, name):
    return tuple(float(file[f"statistics/charge/{name}/{part}"][()]) for part in ("value", "standard_error"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NUMBERS)
def test_two_seeds_agree_within_their_errors(seeds, name):
    (one, error), (other, its) = (known(file, name) for file, _ in seeds)
    assert 0 < error < 0.1
    assert abs(one - other) < 4 * math.hypot(error, its)


@pytest.mark.slow
def test_a_drum_filled_by_30_percent_has_toe_and_shoulder_where_the_trade_expects_them(seeds):
    toe, shoulder = (math.degrees(known(seeds[0][0], name)[0]) for name in ("toe", "shoulder"))
    assert -60 < toe < -10
    assert 100 < shoulder < 170


@pytest.mark.slow
def test_the_weight_times_the_arm_of_the_centre_of_mass_is_the_torque_of_the_drive(seeds):
    file, _ = seeds[0]
    mass = 7800 * math.pi / 6 * 0.014**3 * file["particles/trajectory/id"].size
    torque = file["statistics/motions/roll/torque"][()]
    assert mass * 9.81 * known(file, "mass_across")[0] == pytest.approx(torque, rel=0.01)


@pytest.mark.slow
def test_the_summary_for_programs_has_the_charge(seeds):
    file, summary = seeds[0]
    assert summary["statistics"]["charge"]["toe"]["value"] == pytest.approx(known(file, "toe")[0], rel=1e-6)


@pytest.mark.slow
def test_the_series_are_of_whole_turns_and_have_the_mean_of_the_window(seeds):
    file, _ = seeds[0]
    series = file["observables/charge/mass_across"]
    times, turn = series["time"][()], 60 / 70
    assert np.allclose(np.diff(times) / turn, np.round(np.diff(times) / turn), atol=1e-9)
    assert times[0] == pytest.approx(1 + np.diff(times)[0])
    of_starts = known(file, "mass_across")
    assert np.mean(series["value"]) == pytest.approx(of_starts[0], rel=0.05)
    assert all(file[f"observables/charge/{name}/value"].shape == times.shape for name in file["observables/charge"])


@pytest.mark.slow
def test_a_drum_that_turns_the_other_way_has_its_mirror_image(seeds, tmp_path):
    file, _ = run(tmp_path, "motion.roll.speed=-70 rpm")
    for name in ("toe", "shoulder", "mass_across"):
        (one, error), (other, its) = (known(one, name) for one in (file, seeds[0][0]))
        assert abs(one - other) < 4 * math.hypot(error, its)


@pytest.mark.slow
def test_an_axis_along_y_changes_nothing_but_the_noise(seeds, tmp_path):
    """A container that is a body, with its axis along y."""
    pot = "[body.pot]\nshape = cylinder\nside = inside\nradius = 100 mm\nlength = 30 mm\naxis = 0 1 0\nmotion = roll\n"
    deck = re.sub(r"\[drum\].*?(?=\[motion)", pot, DRUM, flags=re.S)
    deck = re.sub(r"\[body.lifter\].*?\[balls\]\nbulk_fill = 30 %", "[balls]\ncount = 120", deck, flags=re.S)
    deck = deck.replace("axis = 1 0 0", "axis = 0 1 0")
    file, _ = run(tmp_path, deck=deck)
    mass = 7800 * math.pi / 6 * 0.014**3 * 120
    torque = file["statistics/motions/roll/torque"][()]
    assert mass * 9.81 * known(file, "mass_across")[0] == pytest.approx(torque, rel=0.01)


@pytest.mark.slow
def test_of_one_start_pieces_of_time_give_the_errors(tmp_path):
    """Balls that bounce, so that the errors of one start are right."""
    sets = ("run.starts=1", "contact.restitution=0.9", "contact.friction=0.2", "balls.bulk_fill=4 %")
    file, _ = run(tmp_path, *sets, "motion.roll.speed=50 rpm", "run.time=4 s", "run.sample_from=0.4 s")
    assert known(file, "mass_across")[1] > 0
    assert file["statistics/charge/mass_across/degrees_of_freedom"][()] == 7


@pytest.mark.slow
def test_balls_that_rest_on_the_wall_give_one_start_no_errors(tmp_path):
    file, _ = run(tmp_path, "run.starts=1", "run.time=2 s")
    assert math.isfinite(known(file, "mass_across")[0])
    assert all(math.isnan(known(file, name)[1]) for name in NUMBERS)


@pytest.mark.slow
def test_soft_spheres_do_not_tell_flights(tmp_path):
    file, _ = run(
        tmp_path, "run.spheres=soft", "soft.modulus=1 MPa", "run.time=1.2 s", "run.starts=1", "balls.bulk_fill=3 %"
    )
    assert math.isnan(known(file, "in_flight")[0])
    assert math.isfinite(known(file, "mass_across")[0])


@pytest.mark.parametrize(
    "sets",
    [
        pytest.param(["gravity.acceleration=-9.81 0 0 m/s^2"], id="axis-upright"),
        pytest.param(["gravity.acceleration=-1 0 -9.8 m/s^2"], id="axis-inclined"),
        pytest.param(["gravity.acceleration=0 0 0 m/s^2"], id="no-gravity"),
        pytest.param(["motion.roll.centre=0 0 5 mm"], id="not-about-its-own-axis"),
        pytest.param(["motion.roll.speed=0 rpm"], id="at-rest"),
    ],
)
def test_a_mill_that_does_not_tumble_has_no_charge(tmp_path, sets):
    deck = re.sub(r"ends = periodic\n|\[body.lifter\].*?(?=\[balls\])", "", DRUM, flags=re.S)
    file, summary = run(tmp_path, "run.time=60 ms", "run.sample_from=20 ms", "run.starts=1", *sets, deck=deck)
    assert "charge" not in file["statistics"] and "charge" not in file["observables"]
    assert "charge" not in summary["statistics"]


def test_people_read_the_angles_from_6_and_from_3_o_clock(tmp_path):
    (tmp_path / "mill.ini").write_text(DRUM)
    sets = ("-s", "run.time=1.2 s", "-s", "run.starts=1", "-s", "run.sample_from=0.5 s")
    done = subprocess.run([PROGRAM, "-q", *sets, "mill.ini"], cwd=tmp_path, capture_output=True, text=True)
    said = re.search(
        r"charge +toe (\S+) deg, shoulder (\S+) deg from 6 o'clock\n +\(as Morrell counts (\d+), (\d+)\).*", done.stdout
    )
    toe, shoulder, its_toe, its_shoulder = map(float, said.groups())
    assert (its_toe - toe) % 360 == pytest.approx(270, abs=0.6)
    assert (its_shoulder - shoulder) % 360 == pytest.approx(270, abs=0.6)
    assert max(map(len, said[0].splitlines())) <= 80


# ---- the same bits


SHORT = DRUM.replace("time = 4 s", "time = 3 s").replace("starts = 4", "starts = 1").replace("1 h", "20 ms")
SEARCHED = SHORT.replace("sample_from = 1 s\n", "")


@pytest.mark.slow
@pytest.mark.parametrize("deck", [SHORT, SEARCHED], ids=["window-given", "window-found"])
def test_an_interrupted_run_goes_on_to_the_same_charge(tmp_path, tmp_path_factory, deck):
    mill, whole = Folder(tmp_path, deck), Folder(tmp_path_factory.mktemp("whole"), deck)
    whole.finish("-s", "output.checkpoint=1 h")
    assert mill.stop(after=0.1)[0] == 130
    mill.finish("--resume")
    assert "charge" in h5py.File(mill.file)["statistics"]
    assert differences(mill.file, whole.file, (*OWN, *INTERVAL)) == []


@pytest.mark.slow
def test_threads_do_not_change_the_charge(tmp_path):
    sets = ("run.time=1.5 s", "drum.length=350 mm", "body.lifter.size=360 20 10 mm", "run.starts=1",
            "balls.bulk_fill=8 %", "balls.diameter=8 mm", "run.time=0.3 s", "run.sample_from=0.1 s")  # fmt: skip
    files = [run(tmp_path, *sets, f"run.threads={n}", name=f"threads{n}")[0].filename for n in (1, 2)]
    assert differences(*files, (*OWN, "/deck/run/threads", "/deck/text")) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "sets, noted",
    [
        ((), True),
        (("motion.turn.speed=70 % critical",), False),
        (("balls.sizes=bond", "balls.smallest=12 mm", "balls.classes=2"), False),
        (("run.spheres=soft", "soft.modulus=10 MPa"), False),
    ],
)
def test_a_charge_of_one_size_that_the_wall_carries_nearly_to_the_top_is_noted(tmp_path, sets, noted):
    fast = ("run.starts=1", "run.time=2 s", "run.sample_from=1 s", "motion.turn.speed=92 % critical")
    file, _ = run(tmp_path, *fast, "balls.bulk_fill=25 %", *sets, deck=(INPUT / "ballmill.ini").read_text())
    with file:
        assert ("the wall carries the charge" in str(file["run/notes"].asstr()[()])) == noted
        assert known(file, "shoulder")[0] > math.radians(140)
