"""Several starts of one deck (run.starts): side by side, added into one file, with errors from their scatter."""

import json
import math
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM
from results import OWN, assert_same, status

from milltools.read import sums
from milltools.read.runfile import Run

# Eight balls that fly through a shaken box, a few milliseconds of processor time
SHAKEN = """\
[run]
time = 1 s
sample_from = 0.2 s
seed = 5
[balls]
count = 8
diameter = 8 mm
density = 7800 kg/m^3
[motion.shaker]
kind = shift
amplitude = 0 0 4 mm
frequency = 30 Hz
[body.box]
shape = box
side = inside
size = 40 40 40 mm
motion = shaker
[contact]
restitution = 0.8
friction = 0.3
rebound_floor = 20 mm/s
[output]
frames = 100 ms
series = 10 ms
"""
# A heap that rides on the wall of a planetary jar: each start keeps its own arrangement
HEAP = """\
[run]
time = 0.6 s
sample_from = 0.3 s
[balls]
count = 25
diameter = 10 mm
density = 7850 kg/m^3
[motion.sun]
kind = turn
speed = 500 rpm
[motion.jar]
kind = turn
on = sun
centre = 125 0 0 mm
speed = -1000 rpm
[body.jar]
shape = cylinder
side = inside
centre = 125 0 0 mm
radius = 30 mm
length = 50 mm
motion = jar
[contact]
restitution = 0.8
friction = 0.3
rebound_floor = 100 mm/s
[output]
frames = 0 s
"""


@pytest.fixture
def run(tmp_path):
    """run(deck, file, *sets) -> summary, as a dictionary."""

    def start(text, file, *sets, more=()):
        (tmp_path / "mill.ini").write_text(text)
        words = [word for one in sets for word in ("-s", one)]
        done = subprocess.run(
            [PROGRAM, "-q", "-j", "-o", file, *words, *more, "mill.ini"], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return start


@pytest.mark.parametrize(
    "text, sets, starts",
    [
        (SHAKEN, [], "8"),
        (SHAKEN, ["run.max_collisions=1000"], "1"),
        (SHAKEN.replace("motion = shaker\n", ""), [], "1"),
        (SHAKEN, ["run.threads=1"], "8"),
        (SHAKEN, ["run.starts=3"], "3"),
    ],
)
def test_a_container_that_moves_is_started_eight_times_and_one_that_stands_once(
    printed, write_deck, text, sets, starts
):
    words = [word for one in sets for word in ("-s", one)]
    assert printed(write_deck(text), *words)["run.starts"] == starts


def test_starts_from_one_file_or_that_end_at_other_times_are_refused(refused, write_deck, tmp_path):
    (tmp_path / "balls.txt").write_text("0 0 0\n")
    deck = write_deck(SHAKEN.replace("count = 8", "count = 1\nstart = balls.txt").replace("seed = 5", "starts = 8"))
    wanted = "[run] starts: with [balls] start all starts would be the same: give 1, or leave out [balls] start"
    assert refused(deck).endswith(wanted)
    deck = write_deck(SHAKEN.replace("seed = 5", "starts = 8\nmax_collisions = 9"))
    assert "with max_collisions the starts would end at other times" in refused(deck)


def test_the_bits_do_not_depend_on_the_number_of_threads(run, tmp_path):
    for threads in (1, 2, 5):
        run(SHAKEN, f"{threads}.h5", f"run.threads={threads}")
    for threads in (2, 5):
        own = (*OWN, "/deck/run/threads", "/deck/text")
        assert_same(tmp_path / "1.h5", tmp_path / f"{threads}.h5", own)


def test_the_statistics_are_those_of_runs_with_the_seeds_that_the_file_names(run, tmp_path):
    run(SHAKEN, "all.h5", "run.starts=4")
    with h5py.File(tmp_path / "all.h5") as file:
        seeds = file["starts/seed"][:]
        whole = {name: file[f"statistics/impacts/all/{name}"][()] for name in ("count", "dissipated_power")}
        histogram = file["statistics/impacts/all/normal_speed/histogram/count"][:]
        each = file["starts/dissipated_power/all"][:]
        assert file["statistics/duration"][()] == pytest.approx(4 * 0.8)
        assert file["starts/speeds"][:].sum() == whole["count"]
    assert seeds[0] == 5 and len(set(seeds)) == 4
    count, power, bins = 0, [], 0
    for k, seed in enumerate(seeds):
        run(SHAKEN, f"{k}.h5", f"run.seed={seed}", "run.starts=1")
        with h5py.File(tmp_path / f"{k}.h5") as file:
            count += file["statistics/impacts/all/count"][()]
            power.append(file["statistics/impacts/all/dissipated_power"][()])
            bins = bins + file["statistics/impacts/all/normal_speed/histogram/count"][:]
    assert count == whole["count"] and np.array_equal(bins, histogram)
    assert np.mean(power) == pytest.approx(whole["dissipated_power"], rel=1e-12)
    assert each == pytest.approx(power, rel=1e-9)


def test_frames_and_series_are_of_the_first_start(run, tmp_path):
    run(SHAKEN, "all.h5")
    run(SHAKEN, "one.h5", "run.starts=1")
    with h5py.File(tmp_path / "all.h5") as all_, h5py.File(tmp_path / "one.h5") as one:
        for name in ("particles/trajectory/position/value", "observables/kinetic_energy/value"):
            assert all_[name][:].tobytes() == one[name][:].tobytes()


def test_an_error_is_the_scatter_of_the_starts_with_students_t(run, tmp_path):
    known = run(SHAKEN, "mill.h5")["statistics"]["precision"]
    with h5py.File(tmp_path / "mill.h5") as file:
        for name, values in (
            ("drive_power", file["starts/drive_power"][:]),
            ("dissipated_power/all", file["starts/dissipated_power/all"][:]),
        ):
            told = known
            for part in name.split("/"):
                told = told[part]
            error, freedom = sums.spread(values, sums.APART)
            assert told["standard_error"] == pytest.approx(error, rel=1e-6) and freedom == 7
            assert told["degrees_of_freedom"] == 7


def test_one_start_of_a_heap_on_a_moving_wall_has_no_errors_and_says_what_gives_them(run, tmp_path):
    found = run(HEAP, "one.h5", "run.starts=1")
    assert found["statistics"]["drive"]["power"] > 10 and found["statistics"]["drive"]["power_error"] is None
    (note,) = [note for note in found["notes"] if "one start" in note]
    assert "run.starts = 8" in note
    with Run(tmp_path / "one.h5") as file:
        assert file.doubt == "one start"
        assert math.isnan(sums.total(file, sums.every).error)


def test_a_run_that_is_stopped_before_all_starts_are_alike_gives_no_errors_and_says_why(run, tmp_path):
    (tmp_path / "mill.ini").write_text(HEAP)
    words = [PROGRAM, "-q", "-o", "cut.h5", "-s", "run.time=60 s", "-s", "run.threads=1", "mill.ini"]
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    said = " ".join(process.communicate()[0].split())
    with Run(tmp_path / "cut.h5") as cut:
        assert cut.starts == 1 and (cut.doubt == "one start" or not cut.has_statistics)
    assert "results are of the first starts alone, without errors" in said and "--resume goes on with all" in said


@pytest.mark.parametrize("end", [0.4, 0.7, 1.1, 1.9])
def test_impacts_of_a_window_that_the_run_finds_are_those_of_the_window_that_a_deck_gives(run, end):
    """12 batches are a period, so that two or three portions are joined."""
    found = run(SHAKEN.replace("sample_from = 0.2 s\n", ""), "found.h5", f"run.time={end} s")["statistics"]
    begin = found["precision"]["warm_up"]
    given = run(SHAKEN, "given.h5", f"run.time={end} s", f"run.sample_from={begin!r} s")["statistics"]
    for name in ("count", "dissipated_power"):
        assert found["impacts"]["all"][name] == pytest.approx(given["impacts"]["all"][name], rel=1e-3), name


def test_two_seeds_of_a_heap_agree_within_their_errors(run):
    found = [run(HEAP, f"{seed}.h5", f"run.seed={seed}")["statistics"]["precision"]["drive_power"] for seed in (1, 2)]
    off = abs(found[0]["value"] - found[1]["value"])
    error = math.hypot(*(one["standard_error"] for one in found))
    assert off < 3 * error and error > 0.01 * found[0]["value"]


def test_three_starts_have_means_and_no_errors_where_balls_rest(run):
    found = run(HEAP, "mill.h5", "run.starts=3")
    assert found["statistics"]["drive"]["power_error"] is None
    assert "the scatter of fewer than 4 starts gives no errors: run.starts = 8." in found["notes"]


def test_no_precision_is_reached_where_errors_are_not_known(run):
    """Two starts of a heap: no error, so the run goes on to its time."""
    found = run(HEAP.replace("time = 0.6 s", "time = 2 s"), "mill.h5", "run.precision=20 %", "run.starts=2")
    known = found["statistics"]["precision"]
    assert found["run"]["ended_by"] == "time" and found["time"] == 2
    assert known["doubt"] == "few starts" and known["reached"] == 0


def test_the_errors_of_a_few_starts_come_from_eight_pieces_of_each_where_balls_mix(run, tmp_path):
    found = run(SHAKEN, "mill.h5", "run.starts=3", "run.time=4 s")["statistics"]["precision"]
    assert found["drive_power"]["degrees_of_freedom"] == 23 and found["doubt"] == "none"
    with Run(str(tmp_path / "mill.h5")) as opened:
        hard = sums.total(opened, sums.above(1e-4))
        assert hard.starts == 3 and hard.spread[1] == 23
        again = sums.total(opened, sums.above(opened.statistic("hard_energy")))
    one = run(SHAKEN, "one.h5", "run.starts=1", "run.time=4 s")["statistics"]["precision"]
    for name in ("drive_power", "median_above_floor"):  # a third of the time, and of the square of the error
        assert 1 < one[name]["standard_error"] / found[name]["standard_error"] < 4, name
    assert again.error > 0


def test_a_start_up_that_all_starts_share_is_told_and_errors_are_not(run):
    """All balls start with 5 m/s, which they lose within a second."""
    found = run(SHAKEN, "mill.h5", "balls.speed=5 m/s", "run.sample_from=0 s", "run.time=0.6 s")
    assert found["statistics"]["precision"]["doubt"] == "not settled"
    assert found["statistics"]["drive"]["power_error"] is None
    assert any(note.startswith("not settled: ") and "run.sample_from" in note for note in found["notes"])


LONG = SHAKEN.replace("time = 1 s", "time = 60 s").replace("frames = 100 ms", "checkpoint = 10 ms\nframes = 1 s")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_run_goes_on_to_the_same_bits(run, tmp_path, number):
    run(LONG, "whole.h5")
    with subprocess.Popen([PROGRAM, "-q", "-o", "cut.h5", "mill.ini"], cwd=tmp_path, stdout=subprocess.DEVNULL) as cut:
        begin = time.monotonic()
        while not (tmp_path / "cut.h5").exists() or not status(tmp_path / "cut.h5")[1]:
            assert time.monotonic() < begin + 20 and cut.poll() is None
            time.sleep(0.01)
        time.sleep(0.2)
        cut.send_signal(number)
    assert status(tmp_path / "cut.h5")[0] == ("stopped" if number == signal.SIGINT else "running")
    run(LONG, "cut.h5", more=["--resume"])
    assert_same(tmp_path / "whole.h5", tmp_path / "cut.h5", OWN)


def test_a_precision_is_reached_by_longer_starts_where_balls_mix(run, tmp_path):
    found = run(SHAKEN.replace("sample_from = 0.2 s\n", ""), "mill.h5", "run.precision=3 %", "run.time=60 s")
    known = found["statistics"]["precision"]
    assert found["run"]["ended_by"] == "precision" and known["reached"] == 1
    assert found["statistics"]["starts"] == 8 and 1 < found["time"] < 60
    for name in ("drive_power", "median_above_floor"):
        assert known[name]["standard_error"] <= 0.03 * known[name]["value"]


def test_a_precision_is_reached_by_more_starts_where_each_keeps_its_arrangement(run, tmp_path):
    text = HEAP.replace("time = 0.6 s", "time = 3 s").replace("count = 25", "count = 12").replace("100 mm/s", "60 mm/s")
    found = run(text, "mill.h5", "run.precision=1.2 %")
    assert found["run"]["ended_by"] == "precision"
    assert 8 < found["statistics"]["starts"] <= 64
    run(text, "again.h5", "run.precision=1.2 %", "run.threads=1")
    assert_same(tmp_path / "mill.h5", tmp_path / "again.h5", (*OWN, "/deck/run/threads", "/deck/text"))
