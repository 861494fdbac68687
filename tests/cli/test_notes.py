"""What the summary warns of."""

import json

from conftest import ROOT


def notes(done):
    assert done.returncode == 0, done.stderr
    return " ".join(json.loads(done.stdout)["notes"])


def test_a_window_in_which_the_charge_still_gains_energy_is_called_unsteady(millsim):
    window = ["-s", "run.time=50ms", "-s", "run.sample_from=20ms"]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *window)
    assert "not steady" in notes(done)


def test_a_charge_in_its_steady_state_is_not(millsim):
    window = ["-s", "run.time=160ms", "-s", "run.sample_from=100ms"]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *window)
    assert "not steady" not in notes(done)


def test_few_balls_in_a_smooth_drum_without_friction_end_as_a_ring(millsim):
    options = ["balls.count=100", "contact.friction=0", "run.time=3s", "run.sample_from=2s"]
    sets = [word for option in options for word in ("-s", option)]
    done = millsim(ROOT / "input/simoloyer.ini", "-q", "--json", *sets)
    assert "turns as a ring" in notes(done)
