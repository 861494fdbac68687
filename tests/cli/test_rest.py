"""Balls that come to rest fall asleep, and the program says so."""

import json
import re

import h5py
import pytest

DECK = """
[run]
time = {time}
[balls]
count = 12
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 15 mm
length = 20 mm
[contact]
restitution = 0.6
friction = 0.3
"""


def test_summary_json_and_file_tell_how_many_balls_are_asleep(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(time="2 s"))
    told = re.search(r"^at rest +(\d+) of 12 balls asleep at the end$", millsim("deck.ini", "-q").stdout, re.M)
    run = json.loads(millsim("deck.ini", "-q", "-j", "-f").stdout)["run"]
    with h5py.File(tmp_path / "deck.h5") as file:
        assert file["run/asleep"][()] == run["asleep"] == int(told[1]) > 0
        assert file["run/sleep_time"][()] == pytest.approx(run["sleep_time"])
        speeds = file["particles/trajectory/velocity/value"][-1]
    assert (speeds == 0).all(axis=1).sum() == run["asleep"]
    assert run["energy_balance_error"] < 1e-12


def test_a_run_in_which_no_ball_fell_asleep_does_not_mention_sleep(millsim, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK.format(time="50 ms"))
    done = millsim("deck.ini", "-q", "-j")
    assert "sleep" not in done.stdout
    with h5py.File(tmp_path / "deck.h5") as file:
        assert "asleep" not in file["run"]
