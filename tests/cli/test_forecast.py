"""What `--check` says that a run will cost, and where it will leave the model's reach."""

import json
import re

import h5py
import pytest
from conftest import PROGRAM, ROOT

MILL = ROOT / "input/simoloyer.ini"
FORECAST = re.compile(
    r"millsim: balls .*\n(?:millsim: \w+ +(?:tip speed|surfaces) .*\n)*"
    r"millsim: forecast: (.*?)(\S+) contacts, (\S+) s of processor time, (\S+) MB of memory, "
    r"a file of (\S+) MB; from a trial of (\S+) s of simulated time; "
    r"(?:right within a factor of 2|not known better, because the rate of contacts has not settled)\n"
)


def sets(*values):
    return [word for value in values for word in ("-s", value)]


def test_a_run_shorter_than_the_trial_is_forecast_as_it_is(millsim, tmp_path):
    short = sets("balls.count=500", "run.time=30 ms", "run.sample_from=0 s")
    words, *numbers = FORECAST.fullmatch(millsim("--check", *short, MILL).stderr).groups()
    contacts, _, memory, size, trial = map(float, numbers)
    summary = json.loads(millsim("--json", "-q", *short, "-o", "short.h5", MILL).stdout)
    met = sum(summary["run"]["collisions"].values())
    assert (words, trial) == ("", 0.03)
    assert abs(contacts - met) <= 0.05 * met  # two digits
    if "asan" not in PROGRAM.parts:  # the sanitizer's own memory counts too
        assert 0.5 < memory * 1e6 / summary["run"]["peak_memory"] < 2
    assert 0.5 < size * 1e6 / (tmp_path / "short.h5").stat().st_size < 2


def test_the_filling_of_a_jar_that_has_moved_is_that_of_the_forecast(millsim):
    jar = (ROOT / "input/planetary.ini", *sets("run.time=0.2 s", "run.sample_from=0 s"))
    before, after = millsim("--check", *jar).stderr, millsim("-q", *jar).stdout
    told = [re.search(r"balls  .*", text).group() for text in (before, after)]
    assert told[0] == told[1] and ": 27.5 % of the free room, 45.8 %" in told[0]


def test_the_deck_is_printed_as_without_a_forecast(millsim):
    short = ["--check", *sets("balls.count=50", "run.time=1 ms", "run.sample_from=0 s"), MILL]
    loud, quiet = millsim(*short), millsim(*short, "--quiet")
    assert loud.stdout == quiet.stdout
    assert FORECAST.fullmatch(loud.stderr) and quiet.stderr == ""


@pytest.mark.slow
def test_a_trial_that_does_not_see_the_charge_swept_up_gives_a_lower_bound(millsim):
    """Two million contacts are made before the charge of a full drum has turned once."""
    full = sets("balls.count=12000", "contact.restitution=0.7", "run.sample_from=0 s")
    found = FORECAST.search(millsim("--check", *full, MILL).stderr)
    assert found.group(1) == "at least " and "has not settled" in found.group()
    assert float(found.group(6)) < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("deck", ["attritor", "planetary", "simoloyer"])
def test_the_forecast_of_a_trial_that_has_settled_is_right_within_a_factor_of_2(millsim, deck):
    path = ROOT / f"input/{deck}.ini"
    longer = sets("run.time=4 s" if deck == "attritor" else "run.time=0.6 s", "run.starts=1", "output.frames=0 s")
    said = FORECAST.search(millsim("--check", *longer, path).stderr)
    met = sum(
        json.loads(millsim("--json", "-q", *longer, "-o", f"{deck}.h5", path).stdout)["run"]["collisions"].values()
    )
    assert said.group(1) == "" and 0.5 < float(said.group(2)) / met < 2


def test_a_run_that_may_end_sooner_costs_that_at_most(millsim):
    few = sets("run.max_collisions=10", "balls.count=50", "run.time=5 ms", "run.sample_from=0 s")
    words, contacts, *_ = FORECAST.fullmatch(millsim("--check", *few, MILL).stderr).groups()
    assert (words, float(contacts) <= 11) == ("at most ", True)


def test_a_charge_that_nothing_brakes_costs_more(millsim):
    smooth = sets("contact.friction=0", "balls.count=50", "run.time=5 ms", "run.sample_from=0 s")
    assert FORECAST.fullmatch(millsim("--check", *smooth, MILL).stderr).group(1) == "at least "


def test_a_deck_beyond_the_models_reach_says_so_before_it_is_run(millsim):
    soft = sets("balls.count=50", "run.time=5 ms", "run.sample_from=0 s", "contact.restitution=0.6")
    said = millsim("--check", *soft, MILL).stderr
    assert "millsim: note: contacts with friction have a restitution of 0.6 (ball_ball)" in said


@pytest.mark.slow
def test_a_bed_so_dense_that_contacts_overlap_says_so_before_it_is_run(millsim):
    said = millsim("--check", *sets("balls.count=12500", "run.time=20 ms", "run.sample_from=0 s"), MILL).stderr
    assert "millsim: note: a ball is hit every" in said


@pytest.mark.slow
def test_blades_that_jam_balls_say_so_before_the_run(millsim):
    jammed = sets("blades.tip_radius=70.5 mm", "blades.width=17 mm", "run.time=40 ms", "run.sample_from=0 s")
    said = millsim("--check", *jammed, MILL).stderr
    assert "% of the rotor's power goes to balls that it presses" in said
    assert "follow the last one of the same two bodies" in said


def test_the_file_holds_the_notes_of_the_summary_and_what_they_judge(millsim, tmp_path):
    soft = sets("contact.restitution=0.65", "run.time=20 ms", "run.sample_from=0 s")
    done = millsim("--json", "-q", *soft, "-o", "soft.h5", MILL)
    summary = json.loads(done.stdout)
    with h5py.File(tmp_path / "soft.h5") as file:
        assert file["run/notes"].asstr()[()].splitlines() == summary["notes"]
        reach = file["run/reach"]
        assert reach["restitution/value"][()] == 0.65 < reach["restitution/limit"][()]
        for code, rule in summary["run"]["reach"].items():
            assert reach[f"{code}/limit"][()] == rule["limit"]
            assert rule["value"] is None or reach[f"{code}/value"][()] == rule["value"]
    assert any("restitution of 0.65" in note for note in summary["notes"])
