"""Frames of the report's player that are close enough to see the mill turn: the very run, run again, or the stored
ones."""

import math
import shutil

import h5py
import numpy as np
import players
import pytest
from conftest import SMALL
from moving_mills import PLANETARY

from milltools.player import finer, player
from milltools.read.runfile import Run

ROOM = 6_000_000


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """20 balls for 0.2 s, with a frame every 20 ms, in which the rotor turns by 72 degrees."""
    return players.simulate(tmp_path_factory.mktemp("coarse"), SMALL, "output.frames=20 ms", "run.time=0.2 s")


@pytest.fixture
def copy(file, tmp_path):
    return shutil.copy(file, tmp_path / "copy.h5")


def shown(path, wanted="auto", room=ROOM):
    """(times, positions, HTML of the player, lines said)."""
    said = []
    with Run(path) as run, finer.frames_of(run, room, wanted, said.append, None) as source:
        times = source.frame_times()
        places = np.array([source.frame(k, "position") for k in range(len(times))])
        return times, places, player.fragment(source, room), said


def stored(path):
    with Run(path) as run:
        return run.frame_times()


def edit(path, name, value):
    with h5py.File(path, "r+") as f:
        f[name][...] = value


@pytest.mark.slow
def test_the_frames_are_those_of_the_same_run_stored_more_often(file, tmp_path):
    times, places, _, said = shown(file)
    step = times[1] - times[0]
    fine = players.simulate(tmp_path, SMALL, f"output.frames={float(step)!r} s", "run.time=0.2 s")
    with Run(fine) as run:
        at = np.searchsorted(run.frame_times(), times - step / 2)
        assert np.abs(run.frame_times()[at] - times).max() < 1e-9
        twin = np.array([run.frame(k, "position") for k in at])
    assert np.abs(places - twin).max() < 1e-8
    assert said == []


@pytest.mark.slow
def test_from_frame_to_frame_the_rotor_turns_by_few_degrees_and_a_ball_hardly_moves(file):
    times, places, html, _ = shown(file)
    poses = players.poses(players.head(html))[:, 0]
    angles = np.unwrap(np.arctan2(poses[:, 2, 1], poses[:, 1, 1]))
    assert 0 < np.diff(angles).max() <= math.radians(8.01)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=2)
    assert np.sqrt((steps**2).mean()) < 5e-3  # a ball's diameter
    assert len(times) > 30


@pytest.mark.slow
def test_balls_of_a_jar_that_is_carried_are_within_it_in_all_finer_frames(tmp_path):
    path = players.simulate(tmp_path, PLANETARY, "output.frames=20 ms")
    _, _, html, said = shown(path, room=200_000)  # the last stretch alone
    head = players.head(html)
    times = np.array(head["times"])
    assert said == [] and times[0] > 0.02
    with Run(path) as run:
        radius = 0.5 * float(run.balls("diameter").max())
    places, _ = players.decode(html)
    pose = players.poses(head)[:, head["motions"].index("jar")]
    own = np.einsum("fij,fni->fnj", pose[:, :, :3], places - pose[:, None, :, 3])
    assert np.hypot(own[..., 0] - 0.06, own[..., 1]).max() < 0.02 - radius + 1e-4
    assert np.abs(own[..., 2]).max() < 0.015 - radius + 1e-4
    shell = players.points(head, "shell")  # in the frame of the motion
    assert np.hypot(shell[:, 0] - 0.06, shell[:, 1]).max() < 0.0201


@pytest.mark.slow
def test_the_last_stretch_of_the_run_is_shown(file):
    times, *_ = shown(file)
    assert times[-1] == pytest.approx(stored(file)[-1], abs=1e-9)


@pytest.mark.slow
def test_little_room_makes_the_stretch_shorter_and_not_the_steps_longer(tmp_path):
    many = "balls.count=200", "balls.diameter=3 mm"
    path = players.simulate(tmp_path, SMALL, "output.frames=20 ms", "run.time=0.2 s", *many)
    all_, few = shown(path)[0], shown(path, room=150_000)
    times = players.head(few[2])["times"]
    assert 30 < len(times) < len(all_)
    assert np.diff(times).max() == pytest.approx(np.diff(all_).max())
    assert times[-1] == pytest.approx(all_[-1])


@pytest.mark.slow
def test_the_page_says_that_the_deck_was_run_again(file):
    assert "running the deck again" in shown(file)[2]
    assert "running the deck again" not in shown(file, "never")[2]


def test_never_shows_what_is_stored(file):
    times, _, _, said = shown(file, "never")
    assert times.tolist() == stored(file).tolist()
    assert said == []


@pytest.mark.slow
def test_frames_that_are_close_enough_are_shown_as_they_are(tmp_path):
    path = players.simulate(tmp_path, SMALL, "output.frames=1 ms", "run.time=50 ms")
    assert shown(path)[0].tolist() == stored(path).tolist()


@pytest.mark.slow
def test_a_dear_run_is_run_again_only_if_that_is_asked_for(copy):
    edit(copy, "run/cpu_time", 1e6)
    times, _, _, said = shown(copy)
    assert times.tolist() == stored(copy).tolist()
    (line,) = said
    assert "20 ms apart" in line and "--rerun always" in line
    assert len(shown(copy, "always")[0]) > len(times)


@pytest.mark.parametrize(
    "name, index, why",
    [("value", (3, 5), "the states of the balls differ"), ("time", (), "its first frame is at another time")],
)
@pytest.mark.slow
def test_a_run_that_comes_out_otherwise_is_shown_as_stored(copy, name, index, why):
    with h5py.File(copy, "r+") as f:
        f[f"particles/trajectory/position/{name}"][index] += 1e-4
    times, _, _, said = shown(copy)
    assert times.tolist() == stored(copy).tolist()
    assert why in said[0]


def test_a_run_of_another_program_is_shown_as_stored(copy):
    with h5py.File(copy, "r+") as f:
        f["run/program"] = "LIGGGHTS"
    times, _, _, said = shown(copy)
    assert times.tolist() == stored(copy).tolist()
    assert "LIGGGHTS" in said[0]
