"""mill plot draws every run there can be."""

import pytest
from conftest import SMALL


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["contact.restitution=1", "contact.friction=0", "contact.rebound_floor=0 m/s"],
        ["output.frames=0 s"],
        ["run.sample_from=49.9 ms"],
        ["rotor.speed=-600 rpm", "blades.pitch=30 deg"],
    ],
)
def test_a_run_becomes_a_picture(millsim, mill, write_deck, tmp_path, options):
    write_deck(SMALL)
    sets = [word for option in options for word in ("-s", option)]
    assert millsim("deck.ini", "-q", *sets).returncode == 0
    done = mill("plot", "deck.h5", "run.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_without_a_known_format_is_one_line(millsim, mill, small_deck):
    assert millsim("deck.ini", "-q").returncode == 0
    done = mill("plot", "deck.h5", "run.mp7")
    assert done.returncode == 2
    assert done.stderr.startswith("mill plot: run.mp7: ")
    assert len(done.stderr.splitlines()) == 1


def test_a_picture_into_a_missing_folder_is_one_line(millsim, mill, small_deck):
    assert millsim("deck.ini", "-q").returncode == 0
    done = mill("plot", "deck.h5", "nowhere/run.png")
    assert done.returncode == 1
    assert done.stderr == "mill plot: nowhere/run.png: No such file or directory\n"
