"""mill sweep: every design becomes a row; nothing that ends it loses one, and no design is run twice but those in
flight."""

import collections
import contextlib
import os
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pandas
import pytest
from conftest import PROGRAM, ROOT, SMALL, STUDY, lasting, some
from scipy import stats
from studies import MEDIAN, alive, runs

from milltools.__main__ import dispatch
from milltools.base import processes
from milltools.base.errors import UserError
from milltools.study.plan import job
from milltools.study.plan.filling import Tracker, send
from milltools.study.plan.study_deck import Study
from milltools.study.plan.table import Table
from milltools.study.remote import executors
from milltools.study.sweep import sweep as sweep_study

WAIT = "while [ ! -e {}/go ]; do sleep 0.02; done"
SLOW = f"case $speed in 31.4*) ;; *) {WAIT} ;; esac"  # all but 300 rpm
TWO, FOUR = (STUDY.replace("300, 600, 900", speeds) for speeds in ("600", "300, 600"))  # designs


@pytest.fixture
def start(tmp_path):
    """start(*arguments, program) starts `mill` in a session of its own; what is left of it is ended after the test."""
    started = []

    def begin(*arguments, program=PROGRAM, **options):
        process = subprocess.Popen(
            [sys.executable, "-m", "milltools", *arguments],
            cwd=tmp_path,
            env={
                **os.environ,
                "PYTHONPATH": str(ROOT / "tools"),
                "MILLSIM": str(program),
                "TMPDIR": str(tmp_path),
            },
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield begin
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
    for pid, _, _ in runs(tmp_path):
        if alive(pid):
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def sweep(monkeypatch, capsys, tmp_path, the_program):
    """sweep(*words, program) does `mill sweep` in this process, in tmp_path: status, stdout and stderr as a
    command's."""
    monkeypatch.chdir(tmp_path)

    def run(*words, program=PROGRAM):
        monkeypatch.setenv("MILLSIM", str(program))
        try:
            status = dispatch(["sweep", "--no-picture", *words])
        except UserError as fault:
            status = fault.status
            print(f"mill sweep: {fault}", file=sys.stderr)
        out, err = capsys.readouterr()
        return subprocess.CompletedProcess(words, status, out, lasting(err))

    return run


def until(condition, what):
    """Waits for something that must come."""
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline, f"no {what} within a minute"
        time.sleep(0.01)


def rows_so_far(folder):
    try:
        return Table.open(folder / "a.parquet").rows()
    except UserError:
        return []


# ---- a whole sweep


@pytest.mark.slow
def test_every_design_becomes_a_row_with_what_millsim_says_and_the_best_is_told(sweep, millsim, write_study, tmp_path):
    write_study(FOUR)
    done = sweep("a.study", "--workers", "2", "-o", "my runs.parquet")
    assert done.returncode == 0, done.stderr
    path = tmp_path / "my runs.parquet"
    frame = pandas.read_parquet(path)
    assert list(frame["design"]) == list(range(4))
    assert set(frame["status"]) == {"done"}
    assert not path.with_name("my runs.parquet.journal").exists()
    row = frame.iloc[3]
    words = ("-s", "run.time=60 ms", "-s", "rotor.speed=600 rpm", "-s", "balls.count=60", "deck.ini")
    assert millsim("-o", "one.h5", *words).returncode == 0
    with h5py.File(tmp_path / "one.h5") as file:
        assert row[MEDIAN] == file[f"statistics/{MEDIAN}"][()]
        assert row["rotor/power"] == file["statistics/rotor/power"][()]
        kinds = file["run/events/collisions"]
        assert row["collisions"] == sum(kinds[kind][()] for kind in kinds)
    assert (row["seed"], row["time"], row["sample_from"]) == (1, 0.06, 0.0)
    assert row["worker"].count(":") == 1 and row["version"]
    said = "mill sweep --no-picture a.study --workers 2 -o 'my runs.parquet'"
    assert Table.open(path).meta["command"] == said
    best = frame.loc[frame[MEDIAN].idxmax()]
    lines = done.stdout.splitlines()
    assert lines[0] == "the largest median normal impact speed above the floor of 4 designs:"
    assert lines[2].split()[:3] == ["rotor", "speed", "[rpm]"]
    speed, count = f"{best['rotor.speed'] * 30 / np.pi:.5g}", str(best["balls.count"])
    assert lines[3].split()[:5] == ["1", speed, count, f"{best[MEDIAN]:.5g}", "?"]
    assert lines[-1] == "my runs.parquet: 4 runs (4 done); see them with: mill study 'my runs.parquet'"


@pytest.mark.slow
def test_replicates_have_seeds_of_their_own_and_give_an_error(sweep, write_study, tmp_path):
    write_study()
    done = sweep("a.study", "-s", "study.replicates=2", "-s", "rotor.speed=600 rpm")
    frame = pandas.read_parquet(tmp_path / "a.parquet")
    assert sorted(frame["seed"]) == [1, 1, 2, 2]
    assert frame[MEDIAN].nunique() == 4
    # relative scatter of the replicates, pooled over all designs; Student's t with a degree of freedom from each
    groups = frame.groupby("balls.count")[MEDIAN].agg(["mean", "std"])
    scatter = np.sqrt(((groups["std"] / groups["mean"]) ** 2).mean())
    best = groups["mean"].max()
    half = stats.t.ppf(0.975, len(groups)) * scatter * best / np.sqrt(2)
    shown = done.stdout.splitlines()[3].split()
    assert shown[-2] == "+-"
    assert float(shown[-3]) == pytest.approx(best, abs=half / 20) and float(shown[-1]) == pytest.approx(half, rel=0.05)


def test_progress_is_lines_where_there_is_no_terminal(write_study, capsys):
    study = Study(write_study())
    kept = [{"status": "capped", MEDIAN: 0.75}, {"status": "failed", MEDIAN: float("nan")}]
    tracker = Tracker("mill sweep", 6, kept, study, quiet=False)
    tracker.note({"status": "done", MEDIAN: 0.5})
    tracker.progress.due -= 60
    tracker.tick()
    tracker.tick()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("mill sweep: 3 of 6 runs, 1 failed, 1 capped, best 0.5, 50 %, ")
    assert lines[0].endswith(" left")


# ---- from Python


@pytest.mark.slow
def test_a_script_sweeps_and_gets_the_table(write_study, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    table = sweep_study(write_study(), overrides=["rotor.speed=600 rpm"], workers=1, quiet=True)
    assert table.path.name == "a.parquet" and table.meta["command"] == "milltools.sweep"
    assert list(table.frame()["status"]) == ["done", "done"] and Table.open("a.parquet").complete
    again = sweep_study("a.study", "a.parquet", overrides=["rotor.speed=600 rpm"], quiet=True)
    pandas.testing.assert_frame_equal(again.frame(), table.frame())
    assert capsys.readouterr() == ("", "")
    with pytest.raises(UserError, match="--workers: expected 1 or more"):
        sweep_study("a.study", workers=0)


# ---- going on


@pytest.mark.slow
def test_what_is_done_is_not_done_again_and_more_may_be_asked_for(sweep, write_study, stand_in, tmp_path):
    write_study(TWO)
    program = stand_in("")
    assert sweep("a.study", program=program).returncode == 0
    first = pandas.read_parquet(tmp_path / "a.parquet")
    done = sweep("a.study", program=program)
    assert "mill sweep: 2 of 2 runs are there already\n" == done.stderr
    assert len(runs(tmp_path)) == 2
    write_study(FOUR)
    assert sweep("a.study", program=program).returncode == 0
    assert len(runs(tmp_path)) == 4
    second = pandas.read_parquet(tmp_path / "a.parquet").set_index("id")
    assert list(second["design"]) == list(range(4))
    same = first.set_index("id").drop(columns="design")
    pandas.testing.assert_frame_equal(second.loc[same.index, same.columns], same)


@pytest.mark.slow
def test_another_base_deck_is_refused_and_force_begins_anew(sweep, write_study, write_deck, tmp_path):
    write_study()
    assert sweep("a.study", "-s", "rotor.speed=600 rpm").returncode == 0
    before = (tmp_path / "a.parquet").read_bytes()
    words = ("a.study", "-s", "rotor.speed=600 rpm", "-s", "drum.length=50 mm")
    done = sweep(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "mill sweep: a.parquet: contains the runs of another study: drum.length is 0.04 m in the table "
        "and 0.05 m in the study deck; -o sets another name, --force replaces it\n"
    )
    assert (tmp_path / "a.parquet").read_bytes() == before
    assert sweep(*words, "--force").returncode == 0
    assert len(pandas.read_parquet(tmp_path / "a.parquet")) == 2


@pytest.mark.slow
def test_kill_9_loses_nothing_leaves_nothing_running_and_costs_only_what_flew(
    start, mill, write_study, stand_in, tmp_path
):
    write_study(FOUR)
    program = stand_in(SLOW.format(tmp_path))
    process = start("sweep", "--no-picture", "a.study", "--workers", "2", program=program)
    until(lambda: len(rows_so_far(tmp_path)) == 2 and len(runs(tmp_path)) == 4, "two rows")
    flying = [pid for pid, _, _ in runs(tmp_path)[2:]]
    process.send_signal(signal.SIGKILL)
    process.communicate()
    until(lambda: not any(alive(pid) for pid in flying), "end of its runs")
    (tmp_path / "go").touch()
    done = mill("sweep", "--no-picture", "a.study", env={"MILLSIM": program})
    assert done.returncode == 0
    assert done.stderr == "mill sweep: 2 of 4 runs are there already\n"
    assert len(pandas.read_parquet(tmp_path / "a.parquet")) == 4
    assert len(runs(tmp_path)) == 4 + 2


@pytest.mark.slow
@pytest.mark.parametrize("number, status", some([(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)], 3))
def test_a_signal_ends_what_runs_keeps_what_is_done_and_says_how_to_go_on(
    start, write_study, stand_in, tmp_path, number, status
):
    write_study()
    program = stand_in(SLOW.format(tmp_path))
    process = start("sweep", "--no-picture", "a.study", "--workers", "2", program=program)
    until(lambda: len(rows_so_far(tmp_path)) == 2 and len(runs(tmp_path)) == 4, "two rows")
    os.killpg(process.pid, number)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (status, "")
    assert lasting(err) == "mill sweep: interrupted; a.parquet has 2 of 6 runs; the same command continues\n"
    assert not any(alive(pid) for pid, _, _ in runs(tmp_path))
    assert len(pandas.read_parquet(tmp_path / "a.parquet")) == 2


# ---- designs that go wrong


@pytest.mark.slow
def test_a_design_that_is_refused_is_recorded_in_one_line_and_does_not_stop_the_rest(
    sweep, write_study, write_deck, tmp_path
):
    blade = "[blade.{}]\nposition = 0 m\nangle = 0 deg\ntip_radius = 24 mm\nwidth = 6 mm\nthickness = 4 mm\n"
    write_study(FOUR.replace("balls.count = 40..60 step 20", "drum.radius = 23, 30 mm"))
    write_deck(SMALL + blade.format("a") + blade.format("b"))
    done = sweep("a.study")
    assert done.returncode == 0
    frame = pandas.read_parquet(tmp_path / "a.parquet").set_index("drum.radius")
    assert set(frame.loc[0.03, "status"]) == {"done"}
    assert set(frame.loc[0.023, "status"]) == {"failed"}
    (message,) = set(frame.loc[0.023, "message"])
    assert message.startswith("deck.ini:23: [blade.a]: leaves the container by 1.1 mm at t = 0 s")
    assert message.endswith("(and 1 more fault)")
    assert "(2 done, 2 failed)" in done.stdout
    assert done.stderr == f"mill sweep: 2 runs failed; the most frequent message: {message}\n"


def test_a_study_of_which_no_design_is_taken_ends_at_once(sweep, write_study, stand_in, tmp_path):
    write_study(STUDY.replace("balls.count = 40..60 step 20", "drum.radius = 10, 20 mm"))
    before = sorted(tmp_path.iterdir())
    done = sweep("a.study")
    assert (done.returncode, done.stdout) == (2, "")
    assert "[blades]: leaves the container by 12 mm" in done.stderr
    assert done.stderr.endswith("(4 other designs were refused too)\n")
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "key, path, hint",
    [
        ("maximise", "impacts/all/normal_speed/medain", "; did you mean 'impacts/all/normal_speed/median'?"),
        ("minimise", "strikes/ball_ball/normal_speed/histogram/count", ""),
        ("record", "rotor/powr", "; did you mean 'rotor/power'?"),
    ],
)  # fmt: skip
def test_an_objective_that_does_not_exist_ends_it_at_once(sweep, write_study, tmp_path, key, path, hint):
    text = TWO.replace("record = rotor/power", "").replace("40..60 step 20", "40")
    text = text.replace(f"maximise = {MEDIAN}", f"maximise = {MEDIAN}" if key != "maximise" else "")
    write_study(text.replace("[study]", f"[study]\n{key} = {path}"))
    before = sorted(tmp_path.iterdir())
    done = sweep("a.study")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(
        f"mill sweep: a.study:2: [study] {key}: '{path}': '{path}' is not a scalar of /statistics"
    )
    assert hint in done.stderr
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.slow
def test_all_failed_is_status_1_and_retry_runs_them_again(sweep, write_study, stand_in, tmp_path):
    write_study(TWO)
    done = sweep("a.study", program=stand_in("echo millsim: no disk >&2; exit 1"))
    assert done.returncode == 1
    assert "2 runs failed; the most frequent message: no disk" in done.stderr
    assert sweep("a.study").returncode == 1
    assert sweep("a.study", "--retry").returncode == 0
    frame = pandas.read_parquet(tmp_path / "a.parquet")
    assert list(frame["status"]) == ["done"] * 2


@pytest.fixture
def one_job(write_study, tmp_path):
    """one_job(program, **changes): a job of the small study and the program."""

    def make(program=PROGRAM, **changes):
        study = Study(write_study())
        made = study.job(0, {"rotor.speed": 60.0, "balls.count": 40})
        return made | {"program": str(program)} | changes

    return make


def test_a_run_that_reaches_its_most_collisions_is_capped(one_job):
    done = one_job()
    done["set"] += ["run.time=1 s", "run.max_collisions=200"]
    path_of = job.read(done, finished(done, {"run/ended_by": "max_collisions"}))
    assert (path_of["status"], path_of["message"]) == ("capped", "stopped at run.max_collisions")
    assert path_of[MEDIAN] > 0


@pytest.mark.slow
def test_a_run_with_pinches_is_done_and_one_with_balls_deep_in_others_is_not(one_job):
    done = one_job()
    assert job.read(done, finished(done, {"run/reliefs": 3000}))["status"] == "done"
    row = job.read(done, finished(done, {"run/overlaps": 3}))
    assert row["status"] == "capped" and "3 balls overlap other bodies" in row["message"]


@pytest.mark.slow
def test_a_run_that_computed_contacts_without_friction_is_done_and_its_message_says_so(one_job):
    done = one_job()
    row = job.read(done, finished(done, {"run/smoothed": 3}))
    assert (row["status"], row["message"]) == ("done", "contacts were computed without friction")
    row = job.read(done, finished(done, {"statistics/precision/doubt": "not settled"}))
    assert (row["status"], row["message"]) == ("done", "not settled: no errors are known")
    row = job.read(done, finished(done, {"run/smoothed": 3, "run/ended_by": "max_collisions"}))
    said = "stopped at run.max_collisions; contacts were computed without friction"
    assert (row["status"], row["message"]) == ("capped", said)
    assert job.read(done, finished(done, {}))["message"] == ""


def test_the_error_of_a_run_with_precision_is_the_one_it_found(one_job):
    done = one_job()
    extra = {
        "statistics/precision/median_above_floor/standard_error": 0.004,
        "statistics/precision/reached": 0,
    }
    row = job.read(done, finished(done, extra))
    assert row[f"{MEDIAN}:error"] == 0.004
    assert (row["status"], row["message"]) == (
        "capped",
        "run.time was reached before run.precision",
    )


def finished(made, extra):
    """The file of a run with more datasets: what a run with these keys writes."""
    path = os.path.join(os.path.dirname(made["deck"]), "made.h5")
    words = [word for text in made["set"] if "max_coll" not in text for word in ("-s", text)]
    command = [
        made["program"],
        "-q",
        "-f",
        "-o",
        path,
        *words,
        "-s",
        "run.time=10 ms",
        made["deck"],
    ]
    assert subprocess.run(command, capture_output=True).returncode == 0
    with h5py.File(path, "a") as file:
        for name, value in extra.items():
            if name in file:
                del file[name]
            file[name] = value
    return path


@pytest.mark.slow
def test_a_run_over_its_limit_of_cpu_time_is_stopped_keeps_what_it_has_and_is_capped(one_job):
    long = one_job(limit=0.3)
    long["set"] += ["run.time=1000 s", "output.series=1 s", "balls.count=200"]
    row = job.run(long)
    assert (row["status"], row["message"]) == ("capped", "stopped after 0.3 s of CPU time")
    assert row[MEDIAN] > 0 and 0 < row["time"] < 1000


@pytest.mark.slow
def test_where_cpu_time_is_not_told_the_wall_clock_ends_a_run(one_job, monkeypatch):
    monkeypatch.setattr(job, "PROC", "/nowhere/{pid}")
    long = one_job(limit=0.3)
    long["set"] += ["run.time=1000 s", "output.series=1 s", "balls.count=200"]
    row = job.run(long)
    assert row["status"] == "capped" and row["message"].startswith("stopped after 0.3 s of wall-clock time")
    assert row[MEDIAN] > 0 and 0 < row["time"] < 1000


def test_a_run_leaves_no_folder(one_job, tmp_path, monkeypatch):
    (tmp_path / "work").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "work"))
    assert job.run(one_job())["status"] == "done"
    assert job.run(one_job(set=["drum.radius=1 mm"]))["status"] == "failed"
    assert list((tmp_path / "work").iterdir()) == []


def test_a_lost_run_is_run_again_and_given_up_after_three_times(one_job, stand_in, tmp_path):
    die = stand_in(f"[ $(wc -l < $log) -gt $(cat {tmp_path}/deaths) ] || kill -9 $$")
    for deaths, status in ((2, "done"), (9, "failed")):
        (tmp_path / "deaths").write_text(str(deaths))
        (tmp_path / "runs").write_text("")
        rows = []
        with executors.Local(1) as executor:
            send([one_job(die)], executor, rows.append)
        assert [row["status"] for row in rows] == [status]
        assert len(runs(tmp_path)) == 3
    assert rows[0]["message"] == "no result, tried 3 times: millsim was ended by signal 9"


# ---- the driver


class Counting:
    """An executor that answers at once and notes how many jobs it holds."""

    width = 7

    def __init__(self):
        self.held = self.most = 0

    def submit(self, function, made):
        import concurrent.futures

        self.held += 1
        self.most = max(self.most, self.held)
        future = concurrent.futures.Future()
        future.set_result(made)
        return future


def test_no_more_than_a_wave_is_handed_over_and_every_row_is_taken():
    executor, rows = Counting(), []

    def take(row):
        executor.held -= 1
        rows.append(row)

    asked = []

    def plan():
        for number in range(1000):
            asked.append(number - len(rows))
            yield number

    send(plan(), executor, take)
    assert rows == list(range(1000))
    assert executor.most <= 7 and max(asked) <= 7


def test_a_plan_may_wait_for_rows():
    executor, rows = Counting(), []

    def plan():
        yield "first"
        while not rows:
            yield None
        yield "second, knowing the first"

    send(plan(), executor, rows.append)
    assert rows == ["first", "second, knowing the first"]


@pytest.mark.unmeasured
@pytest.mark.slow
def test_a_row_costs_the_driver_few_calls(tmp_path, one_job):
    """Calls of functions of Python and of C: their number is the same on every machine."""
    made = one_job()
    template = finished(made, {})
    program = tmp_path / "quick"
    program.write_text(f'#!/bin/sh\nwhile [ "$1" != -o ]; do shift; done\nexec cp {template} "$2"\n')
    program.chmod(0o755)
    calls = collections.Counter()
    job.run(made | {"program": str(program)})  # what is loaded once
    sys.setprofile(lambda _, event, argument: calls.update([event]))
    row = job.run(made | {"program": str(program)})
    sys.setprofile(None)
    assert row["status"] == "done"
    assert calls["call"] + calls["c_call"] < 150_000  # 110 000: mostly what h5py does for about 220 datasets


def test_a_signal_waits_for_the_row_at_hand_and_a_second_one_does_not():
    executor, rows = Counting(), []

    def take(row):
        os.kill(os.getpid(), signal.SIGTERM)
        rows.append(row)  # reached: the signal waits
        if row == 5:
            os.kill(os.getpid(), signal.SIGTERM)
            rows.append("never")

    for plan, taken in (([1, 2], [1]), ([5, 6], [5])):
        rows.clear()
        with pytest.raises(processes.Stopped) as stop, processes.stops_in_order():
            send(plan, executor, take)
        assert (rows, stop.value.number) == (taken, signal.SIGTERM)


def test_who_drives_after_a_stop_was_not_asked_to_end():
    with contextlib.suppress(processes.Stopped), processes.stops_in_order():
        signal.raise_signal(signal.SIGTERM)
    processes.raise_if_asked()
