"""A run that ends when it is known: run.precision and run.max_collisions."""

import json
import math
import os
import re
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM
from results import OWN, assert_same, status
from test_command import mostly_halted

from milltools.read.runfile import Run

# Two revolutions of start-up, then steady; half a second of processor time for 5 %
MILL = """\
[run]
time = 3 s
seed = 3
precision = 5 %
[balls]
count = 400
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 50 mm
length = 50 mm
[rotor]
speed = 1200 rpm
shaft_radius = 12 mm
[blades]
count = 3
tip_radius = 43 mm
width = 6 mm
thickness = 6 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
[output]
frames = 0 s
series = 10 ms
"""
TURN = 0.05  # [s] of a revolution
BATCH = TURN / 12
GAS = """\
[run]
time = 2 s
seed = 1
precision = 1 %
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 400
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 50 mm
length = 50 mm
[contact]
restitution = 1
rebound_floor = 0 m/s
[output]
frames = 0 s
series = 10 ms
"""
MEDIAN = "impacts/all/normal_speed/median_above_floor"


@pytest.fixture
def run(millsim, tmp_path):
    """run(*settings, deck=) runs a deck; it gives the output file and the summary of --json."""

    def go(*settings, deck=MILL, name="mill.h5"):
        (tmp_path / "mill.ini").write_text(deck)
        sets = [word for setting in settings for word in ("--set", setting)]
        done = millsim("-q", "-j", "-f", "-o", name, *sets, "mill.ini")
        assert (done.returncode, done.stderr) == (0, "")
        return tmp_path / name, json.loads(done.stdout)

    return go


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """The output of MILL, and its summary as text."""
    folder = tmp_path_factory.mktemp("known")
    (folder / "mill.ini").write_text(MILL)
    done = subprocess.run([PROGRAM, "-q", "mill.ini"], cwd=folder, text=True, capture_output=True, check=True)
    return folder / "mill.h5", done.stdout


def read(path, *names):
    with h5py.File(path, "r") as file:
        values = [file[name][()] for name in names]
    values = [value.decode() if isinstance(value, bytes) else value for value in values]
    return values if len(values) > 1 else values[0]


def precision(path):
    """/statistics/precision, flat."""
    found = {}
    with h5py.File(path, "r") as file:
        file["statistics/precision"].visititems(
            lambda name, item: found.update({name: item[()]} if hasattr(item, "shape") else {})
        )
    return found


# ---- the end ----


def test_the_run_ends_when_median_and_power_are_known_as_well_as_asked(known):
    path, _ = known
    told = precision(path)
    assert read(path, "run/ended_by", "run/status") == ["precision", "complete"]
    assert read(path, "run/time") < 1.5
    for name in ("median_above_floor", "rotor_power"):
        assert 0 < told[f"{name}/standard_error"] <= 0.05 * told[f"{name}/value"]
    assert (told["reached"], told["settled"]) == (1, 1)


def test_what_is_told_to_be_known_is_what_the_statistics_hold(known):
    path, _ = known
    told = precision(path)
    assert told["median_above_floor/value"] == read(path, f"statistics/{MEDIAN}")
    assert told["rotor_power/value"] == read(path, "statistics/rotor/power")
    end, both, starts = read(path, "run/time", "statistics/duration", "statistics/starts")
    length = both / 2
    assert starts == 2 and told["warm_up"] + length == pytest.approx(end, rel=1e-12)
    assert told["batches"] * told["batch"] == pytest.approx(length, rel=1e-9)


def test_it_ends_at_the_end_of_a_batch(known):
    batches = read(known[0], "run/time") / BATCH
    assert batches == pytest.approx(round(batches), abs=1e-9)


@pytest.mark.slow
def test_a_longer_time_allowed_changes_nothing(known, run):
    path, _ = run("run.time=7 s")
    apart = ("/deck/run/time", "/deck/text", "/observables")
    assert_same(path, known[0], (*OWN, *apart))


def test_better_known_takes_longer(known, run):
    path, summary = run("run.precision=3 %")
    told = precision(path)
    assert summary["time"] > read(known[0], "run/time")
    assert told["rotor_power/standard_error"] <= 0.03 * told["rotor_power/value"]


@pytest.mark.slow
@pytest.mark.long
def test_seeds_scatter_no_more_than_told(run):
    """The true errors of five runs: their root mean square is near the 3 % asked for."""
    errors = {"rotor_power": [], "median_above_floor": []}
    truth, _ = run("run.precision=0", "run.sample_from=0.3 s", "run.time=2.5 s", name="truth.h5")
    exact = {"rotor_power": "rotor/power", "median_above_floor": MEDIAN}
    for seed in range(11, 16):
        told = precision(run(f"run.seed={seed}", "run.precision=3 %")[0])
        for name, of in errors.items():
            of.append(told[f"{name}/value"] / read(truth, f"statistics/{exact[name]}") - 1)
    for of in errors.values():
        assert 1e-4 < math.sqrt(np.mean(np.square(of))) < 1.5 * 0.03


# ---- the window ----


@pytest.mark.slow
def test_the_statistics_are_those_of_a_run_sampled_from_the_cut_to_the_end(known, run):
    begin, end = map(float, read(known[0], "statistics/precision/warm_up", "run/time"))
    assert begin > 0
    sets = "run.precision=0", "run.starts=2", f"run.sample_from={begin!r} s", f"run.time={end!r} s"
    plain, _ = run(*sets, name="plain.h5")
    with h5py.File(known[0], "r") as one, h5py.File(plain, "r") as other:
        a, b = one["statistics"], other["statistics"]
        names = []
        b.visititems(lambda name, item: names.append(name) if hasattr(item, "shape") else None)
        assert len(names) > 100
        for name in names:
            # snapshots for the flow of the maps are taken at other times, and blocks begin at others
            if re.search("maps/.*(solid|velocity)|maps/samples|energies/blocks", name):
                continue
            if a[name].dtype.kind == "O":
                assert a[name][()] == b[name][()], name
                continue
            if a[name].dtype.kind == "u":
                assert np.array_equal(a[name][()], b[name][()]), name
            else:
                close = np.isclose(a[name][()], b[name][()], rtol=1e-9, atol=0, equal_nan=True)
                assert np.all(close), name
        solid = "maps/cross_section/solid_fraction"
        assert np.nanmax(abs(a[solid][()] - b[solid][()])) < 0.06
        kind = "impacts/ball_ball/normal_speed/histogram/count"
        assert {key: a[kind].attrs[key] for key in a[kind].attrs} == {key: b[kind].attrs[key] for key in b[kind].attrs}


def test_the_python_tools_find_the_window(known):
    path, _ = known
    window = Run(path).window
    assert window == pytest.approx((precision(path)["warm_up"], read(path, "run/time")), rel=1e-12)


@pytest.mark.slow
def test_the_start_up_is_cut_off(run):
    """The first revolution is unlike all others: the median without the cut is far off."""
    path, _ = run()
    whole, _ = run("run.sample_from=0 s", "run.precision=0", "run.time=0.3 s", name="whole.h5")
    late, _ = run("run.sample_from=0.3 s", "run.precision=0", "run.time=1 s", name="late.h5")
    found, raw, steady = (read(file, f"statistics/{MEDIAN}") for file in (path, whole, late))
    assert abs(found / steady - 1) < 0.5 * abs(raw / steady - 1)


@pytest.mark.parametrize("begin", ["0 s", "60 ms"])
def test_a_given_sample_from_wins(run, begin):
    path, summary = run(f"run.sample_from={begin}")
    told = precision(path)
    assert told["warm_up"] == summary["sample_from"] == float(begin.split()[0]) / (1000 if "ms" in begin else 1)
    assert read(path, "run/ended_by") == "precision"
    assert told["median_above_floor/standard_error"] <= 0.05 * read(path, f"statistics/{MEDIAN}")


def test_few_balls_stop_where_the_window_ends_after_a_given_begin(run):
    """Three balls fly through the begin and the 36 batches behind it within one report of progress."""
    path, summary = run("run.sample_from=0.2 s", "run.precision=1", "balls.count=3", "run.time=20 s", deck=GAS)
    assert summary["run"]["ended_by"] == "precision"
    end = 0.2 + read(path, "statistics/duration") / 2
    assert read(path, "run/time") == pytest.approx(end, rel=1e-12)
    assert read(path, "observables/kinetic_energy/time")[-1] <= end


def test_without_a_rotor_only_the_median_is_to_be_known(run):
    path, summary = run(deck=GAS)
    told = precision(path)
    assert summary["run"]["ended_by"] == "precision"
    assert summary["time"] < 2
    assert told["median_above_floor/standard_error"] <= 0.01 * read(path, f"statistics/{MEDIAN}")


def test_a_rotor_that_touches_nothing_has_no_say(run):
    """No blades and a smooth shaft: it never does any work."""
    deck = GAS + "[rotor]\nspeed = 1000 rpm\nshaft_radius = 5 mm\n"
    path, summary = run(deck=deck)
    assert summary["run"]["ended_by"] == "precision"
    assert abs(precision(path)["rotor_power/value"]) < 1e-12


# ---- the other ends ----


def test_time_is_the_upper_bound(millsim, tmp_path):
    (tmp_path / "mill.ini").write_text(MILL)
    done = millsim("-q", "-s", "run.precision=0.1 %", "-s", "run.time=0.5 s", "mill.ini")
    told = precision(tmp_path / "mill.h5")
    assert done.returncode == 0
    assert read(tmp_path / "mill.h5", "run/ended_by", "run/time") == ["time", 0.5]
    assert told["reached"] == 0
    assert told["rotor_power/standard_error"] > 0.001 * told["rotor_power/value"]
    assert re.search(
        r"run\.time = 500\.0 ms reached: median \+- [\d.]+ %, power \+- [\d.]+ %; requested: 0\.1 %",
        done.stdout,
    )


def test_a_run_too_short_to_settle_says_so(millsim, tmp_path):
    (tmp_path / "mill.ini").write_text(MILL)
    done = millsim("-q", "-s", "run.time=60 ms", "mill.ini")
    assert "the start-up may not be over; requested: 5 %" in done.stdout
    told = precision(tmp_path / "mill.h5")
    assert (told["settled"], told["reached"]) == (0, 0)
    assert 0 < read(tmp_path / "mill.h5", "statistics/duration") <= 0.06


@pytest.mark.parametrize("cap", [1, 500, 30000])
def test_a_number_of_collisions_ends_the_run_at_just_that_one(run, cap):
    path, summary = run(f"run.max_collisions={cap}", "run.precision=0")
    assert sum(summary["run"]["collisions"].values()) == cap
    assert summary["run"]["ended_by"] == read(path, "run/ended_by") == "max_collisions"
    assert read(path, "run/status", "run/time") == ["complete", summary["time"]]
    before, _ = run("run.precision=0", f"run.time={summary['time']!r} s", name="short.h5")
    assert sum(read(before, *(f"run/events/collisions/{k}" for k in summary["run"]["collisions"]))) in (cap - 1, cap)


def test_a_run_ended_by_collisions_before_it_settled_has_half_of_it_in_its_statistics(run):
    path, summary = run("run.max_collisions=3e4")
    assert summary["run"]["ended_by"] == "max_collisions"
    assert precision(path)["reached"] == 0
    assert read(path, "statistics/duration") >= 0.4 * summary["time"]
    assert read(path, "statistics/impacts/all/count") > 0


def test_collisions_may_end_a_run_before_its_window_opens(run):
    path, summary = run("run.max_collisions=1e4", "run.sample_from=2 s")
    assert summary["time"] < 0.5
    assert read(path, "statistics/duration", "run/ended_by") == [0, "max_collisions"]


@pytest.mark.slow
@pytest.mark.long
def test_the_dead_corner_is_never_taken_for_known(run):
    """Without friction the charge comes off the rotor: a power near 0 is not known to 20 %."""
    path, summary = run("contact.friction=0", "run.precision=20 %", "run.max_collisions=2e6", "run.time=4 s")
    assert summary["run"]["ended_by"] in ("max_collisions", "time")
    assert precision(path)["reached"] == 0
    assert any("as a ring" in note for note in summary["notes"])


# ---- the deck ----


def test_a_share_is_a_number_or_has_a_percent_sign(millsim, tmp_path):
    (tmp_path / "mill.ini").write_text(MILL)
    for text in ("2 %", "2%", "0.02", "2e-2", "2 percent"):
        done = millsim("--check", "-q", "-s", f"run.precision={text}", "mill.ini")
        assert re.search(r"^precision = 0\.02 ", done.stdout, re.M), text


@pytest.mark.parametrize(
    ("key", "value", "wanted"),
    [
        ("precision", "2 mm", "expected a share such as '1 %', got '2 mm'"),
        ("precision", "soon", "expected a share such as '1 %', got 'soon'"),
        ("precision", "101 %", "must be between 0 and 1, got '101 %'"),
        ("precision", "-1 %", "must be between 0 and 1, got '-1 %'"),
        ("max_collisions", "1e6 s", "expected a plain number"),
        ("max_collisions", "-1", "must be between 0 and"),
        ("max_collisions", "1.5", "must be a whole number, got 1.5"),
    ],
)
def test_a_wrong_value_is_refused_in_one_line(millsim, tmp_path, key, value, wanted):
    (tmp_path / "mill.ini").write_text(MILL)
    done = millsim("-s", f"run.{key}={value}", "mill.ini")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert f"[run] {key}: {wanted}" in done.stderr


@pytest.mark.slow
def test_the_printed_deck_leaves_the_window_to_be_found(known, run):
    text = read(known[0], "deck/text")
    assert "sample_from" not in text
    again, _ = run(deck=text, name="again.h5")
    assert_same(again, known[0])


@pytest.mark.slow
def test_a_run_of_ten_turns_leaves_out_its_start_up_and_a_shorter_one_does_not(run):
    long, summary = run("run.precision=0", "run.time=0.8 s", name="long.h5")
    short, _ = run("run.precision=0", "run.time=0.45 s", name="short.h5")
    with Run(long) as found, Run(short) as whole:
        begin, end = found.window
        assert 0.05 <= begin <= 0.4 and end == pytest.approx(0.8, abs=BATCH)
        assert whole.window[0] == 0 and whole.duration == pytest.approx(0.45, abs=BATCH)
        power = found.known("rotor_power")[:2]
    given, _ = run("run.precision=0", "run.time=0.8 s", f"run.sample_from={begin!r} s", name="given.h5")
    with Run(given) as known:
        assert known.known("rotor_power")[:2] == pytest.approx(power, rel=1e-6)
    assert "reached" not in summary["statistics"]["precision"]


def test_a_run_without_the_keys_says_nothing_of_them(run):
    path, summary = run("run.precision=0", "run.time=50 ms", "run.sample_from=0 s")
    with h5py.File(path, "r") as file:
        names = []
        file.visit(names.append)
    of_them = "precision/(asked|warm_up|settled|reached)|ended_by|max_coll"
    assert not [name for name in names if re.search(of_them, name)]
    assert "asked" not in summary["statistics"]["precision"]


def test_one_number_has_one_error(known, run):
    """With run.precision and without: what stands beside the number is what /statistics/precision tells of it."""
    plain, summary = run("run.precision=0", "run.time=0.6 s", "run.sample_from=0.1 s", name="one.h5")  # fmt: skip
    for path in (known[0], plain):
        told = precision(path)
        for name in ("power", "torque"):
            value, error = read(path, f"statistics/rotor/{name}", f"statistics/rotor/{name}_error")
            assert told[f"rotor_{name}/value"] == value
            assert told[f"rotor_{name}/standard_error"] == error > 0
            assert told[f"rotor_{name}/degrees_of_freedom"] >= 3
        for name in ("median", "median_above_floor"):
            value = read(path, f"statistics/impacts/all/normal_speed/{name}")
            assert told[f"{name}/value"] == value
            assert 0 < told[f"{name}/standard_error"] < 0.5 * value
        assert told["rate/ball_ball/value"] == read(path, "statistics/impacts/ball_ball/rate")
        assert 0 < told["fast_rate/all/standard_error"][1] < 0.5 * told["fast_rate/all/value"][1]
    assert summary["statistics"]["precision"]["rotor_power"]["standard_error"] == told["rotor_power/standard_error"]


@pytest.mark.thorough
def test_short_runs_hold_the_truth_in_their_intervals(run):
    """24 runs of five revolutions: of 95 % chance, fewer than 19 within come once in a thousand times."""
    told = []
    for seed in range(101, 125):
        path, _ = run(
            f"run.seed={seed}", "run.precision=0", "run.sample_from=0.15 s", "run.time=0.4 s", "balls.count=150"
        )
        told.append([*read(path, "statistics/rotor/power", "statistics/rotor/power_error")])
    value, error = np.array(told).T
    within = abs(value - value.mean()) <= 1.96 * error
    assert 19 <= within.sum()
    assert np.median(error) < 4 * value.std()


def test_the_summary_says_what_was_cut_and_how_well_it_is_known(known):
    path, said = known
    begin, end = (1000 * t for t in read(path, "statistics/precision/warm_up", "run/time"))
    assert re.search(
        rf"^left out the first {begin:#.4g} ms \(start-up by MSER-5\), ended at {end:#.4g} ms: "
        r"median \+- [\d.]+ %, power \+- [\d.]+ %$",
        said,
        re.M,
    )


def test_progress_tells_how_well_it_is_known_by_now(start_millsim, tmp_path):
    (tmp_path / "mill.ini").write_text(MILL)
    process = start_millsim("-s", "run.precision=0.1 %", "-s", "run.time=1000 s", "mill.ini")
    with mostly_halted(process):
        assert re.search(r"left   (start-up|median \+- [\d.]+ %, power \+- )", process.stderr.readline())


# ---- interruptions ----


@pytest.mark.slow
def test_an_interrupted_run_ends_at_the_same_time_with_the_same_bits(tmp_path):
    """Stopped while it warms up and later; what was kept apart for the cut goes through the file."""
    deck = MILL.replace("precision = 5 %", "precision = 3 %\nmax_collisions = 3000000")
    (tmp_path / "mill.ini").write_text(deck)

    def start(*arguments):
        return subprocess.Popen(
            [PROGRAM, "-q", *arguments, "mill.ini"],
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )

    whole = start("-o", "whole.h5", "-s", "output.checkpoint=1 h")
    assert whole.wait(120) == 0
    seen = []
    for leg, number in enumerate((signal.SIGKILL, signal.SIGTERM, signal.SIGKILL)):
        process = start("-s", "output.checkpoint=10 ms", *["--resume"][:leg])
        for _ in range(3000):
            file = tmp_path / "mill.h5"
            reached = status(file)[1] if file.exists() else 0
            if reached > (seen[-1] if seen else 0) or process.poll() is not None:
                break
            time.sleep(0.005)
        seen.append(reached)
        if process.poll() is None:
            os.kill(process.pid, number)
        process.communicate()
    assert 0 < seen[0] < status(tmp_path / "whole.h5")[1]
    last = start("-s", "output.checkpoint=10 ms", "--resume")
    assert last.wait(120) == 0, last.stderr.read()
    assert_same(
        tmp_path / "mill.h5",
        tmp_path / "whole.h5",
        (*OWN, "/deck/output/checkpoint", "/deck/text"),
    )


def test_a_run_that_has_ended_is_not_resumed_beyond_its_end(millsim, tmp_path):
    (tmp_path / "mill.ini").write_text(MILL)
    assert millsim("-q", "mill.ini").returncode == 0
    end = status(tmp_path / "mill.h5")
    done = millsim("--resume", "mill.ini")
    assert done.returncode == 0
    assert "is complete: nothing to resume" in done.stderr
    assert status(tmp_path / "mill.h5") == end
