"""Reliefs: the file says which ball was let go, when, and until when."""

import h5py
import pytest
from results import differences
from soundness import check_frames
from test_resume import INTERVAL, OWN, SHORT, Folder
from test_threads import CHOICE

# blades nearer to the wall than a ball is wide; two slabs of threads long
PINCHING = SHORT.replace("tip_radius = 43 mm", "tip_radius = 46 mm").replace("length = 70 mm", "length = 110 mm")


@pytest.fixture(scope="module")
def pinching(tmp_path_factory):
    mill = Folder(tmp_path_factory.mktemp("pinching"), PINCHING)
    finish(mill)
    return mill.file


def finish(mill, *arguments):
    status, said = mill.run("-q", *arguments)
    assert status == 0 and "balls can be pinched there" in said


def reliefs_of(file):
    return list(zip(*(file[f"reliefs/{name}"][()] for name in ("ball", "time", "until"))))


def test_each_relief_begins_at_a_contact_of_its_ball_and_ends_later(pinching):
    with h5py.File(pinching) as file:
        found, log = reliefs_of(file), {name: file[f"impacts/{name}"][()] for name in ("time", "ball", "kind")}
        assert len(found) == file["run/reliefs"][()] > 10
    times = [time for _, time, _ in found]
    assert times == sorted(times)
    assert all(until >= time for _, time, until in found)
    # contacts of pressed balls are not logged as impacts
    logged = [((log["time"] == time) & (log["ball"] == ball)).any() for ball, time, _ in found]
    assert any(logged)


def test_a_ball_in_a_relief_meets_no_blade(pinching):
    with h5py.File(pinching) as file:
        blade = list(file["impacts"].attrs["kinds"]).index("ball_blade")
        log = {name: file[f"impacts/{name}"][()] for name in ("time", "ball", "kind")}
        for ball, time, until in reliefs_of(file):
            hits = log["time"][(log["ball"] == ball) & (log["kind"] == blade)]
            assert not ((hits > time) & (hits < until)).any()


def test_balls_are_in_blades_only_in_reliefs(pinching):
    with h5py.File(pinching) as file:
        assert check_frames(file, 370) > 0


@pytest.mark.slow
@pytest.mark.parametrize("legs", [1, 2])
def test_a_resumed_run_lists_the_same_reliefs(legs, pinching, tmp_path):
    mill = Folder(tmp_path, PINCHING)
    for leg in range(legs):
        assert mill.stop("-q", *["--resume"][:leg])[0] == 130
    finish(mill, "--resume")
    assert differences(mill.file, pinching, (*OWN, *INTERVAL)) == []


@pytest.mark.slow
def test_two_threads_list_the_same_reliefs(pinching, tmp_path):
    mill = Folder(tmp_path, PINCHING)
    finish(mill, "-s", "run.threads=2")
    assert differences(mill.file, pinching, CHOICE) == []
