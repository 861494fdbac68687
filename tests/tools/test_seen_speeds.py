"""Speeds of balls as seen from the frame in which the charge is steady."""

import subprocess

import numpy as np
import pytest
from conftest import PROGRAM, ROOT

from milltools.compare import load
from milltools.geometry.trajectory import stored
from milltools.player import finer
from milltools.read.runfile import Run
from milltools.render import colour


def run_of(folder, deck, *sets):
    words = [word for one in ("run.starts=1", "run.sample_from=0 s", *sets) for word in ("-s", one)]
    path = folder / f"{deck}.h5"
    subprocess.run([PROGRAM, "-q", *words, "-o", path, ROOT / f"input/{deck}.ini"], check=True, capture_output=True)
    return path


def in_frame(run, index, motion):
    """Places of the balls in the frame of a motion."""
    pose = run.poses(index)[motion]
    return (run.frame(index, "position").astype(float) - pose[:, 3]) @ pose[:, :3]


@pytest.mark.parametrize(("deck", "motion"), [("mixer", "arm"), ("planetary", "sun")])
def test_speeds_are_those_of_the_places_in_the_frame_of_the_charge(tmp_path, deck, motion):
    """Of balls that fly between two frames that are 20 us apart; a jar is seen from its sun."""
    with Run(run_of(tmp_path, deck, "run.time=0.1 s", "output.frames=20 us")) as run:
        last = len(run.frame_times()) - 2
        moved = np.linalg.norm(in_frame(run, last + 1, motion) - in_frame(run, last, motion), axis=1) / 20e-6
        seen = (stored(run, last).speed + stored(run, last + 1).speed) / 2
        assert np.median(abs(seen / moved - 1)) < 5e-3
        assert abs(np.linalg.norm(run.frame(last), axis=1) / moved - 1).max() > 0.3
        assert colour.of(run, "speed").title == "speed in the container [m/s]"
        assert load.Member(str(run.path)).speeds[-1, 0] == pytest.approx(stored(run, last + 1).speed.mean())


def test_speeds_in_a_drum_that_turns_about_its_axis_are_those_in_the_laboratory(tmp_path):
    with Run(run_of(tmp_path, "tumbling", "run.time=50 ms")) as run:
        assert run.twist(1) is None
        assert (stored(run, 1).speed == np.linalg.norm(run.frame(1).astype(float), axis=1)).all()
        assert colour.of(run, "speed").title.startswith("speed [")


def test_a_player_with_finer_frames_has_the_motion_of_the_frame_of_each(tmp_path):
    with Run(run_of(tmp_path, "planetary", "run.time=0.1 s", "output.frames=50 ms")) as run:
        other = Run(run_of(tmp_path, "mixer", "run.time=0.1 s", "output.frames=1 ms"))
        fine = finer.Finer(run, other, 0.0)
        assert len(fine.frame_times()) == 101
        assert (fine.twist(100) == other.twist(100)).all() and fine.twist(0) is not None
