"""mill optimize: finds the best design of a study deck, forgets no run that was paid for, and says how sure it is."""

import concurrent.futures
import math
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import optuna
import pandas
import pytest
from conftest import ROOT, some
from studies import MEDIAN, alive, runs

from milltools.base.errors import UserError
from milltools.study.plan import job
from milltools.study.plan.filling import send
from milltools.study.plan.study_deck import Study
from milltools.study.plan.table import Table, Writer
from milltools.study.search.acquisition import Budget
from milltools.study.search.search import Search, plain
from milltools.study.search.storage import open_storage
from milltools.study.show import optimum, summary

STUDY = """\
[study]
deck = deck.ini
maximise = impacts/all/normal_speed/median_above_floor
[set]
run.time = 5 ms
[vary]
rotor.speed = 300..900 rpm step 100 rpm
balls.count = 2..20
"""
POWER = "rotor/power"


class Pretended(concurrent.futures.Executor):
    """Runs that cost nothing: their values come from a function of the job, in the order they were submitted."""

    def __init__(self, value, workers=1, error=0.01, stop=math.inf):
        self.value, self.workers, self.width = value, workers, workers
        self.error, self.stop, self.jobs = error, stop, []

    def submit(self, _, one):
        if len(self.jobs) >= self.stop:
            raise KeyboardInterrupt
        self.jobs.append(one)
        future, row = concurrent.futures.Future(), job.empty(one, "done", "")
        values = self.value(one)
        if isinstance(values, str):
            row.update(status="failed", message=values)
        else:
            rng = np.random.default_rng(int(one["id"], 16))
            for path, value in zip(one["objectives"], np.atleast_1d(values), strict=True):
                row[path] = value + self.error * rng.standard_normal()
                row[f"{path}:error"] = self.error
        future.set_result(row)
        return future


def hill(one):
    """Best at 10 balls and 600 rpm."""
    speed, count = one["values"]["rotor.speed"], one["values"]["balls.count"]
    return 1 - ((speed / 62.83 - 1) ** 2) - ((count - 10) / 18) ** 2


def searched(study, path, executor, plan=None, storage=None, dies=None):
    """One driver's search to its end (or to the executor's or its own death); the table's rows."""
    plan = plan or Budget(16, seed=1)
    with Writer.begin(path, study.about(plan.runs)) as table:
        search = Search(study, table, open_storage(storage, path)[0], plan)
        if dies:
            dies(search)
        try:
            send(search.jobs(executor.workers), executor, search.take)
            search.take_over()
        except KeyboardInterrupt:
            pass
    return Table.open(path).rows()


@pytest.fixture
def study(write_study):
    return Study(write_study(STUDY))


def designs(rows):
    return [(row["rotor.speed"], row["balls.count"], row["seed"]) for row in rows]


# ---- what it finds


@pytest.mark.slow
def test_the_best_is_found_and_told_with_its_intervals(study, tmp_path):
    path = tmp_path / "t.parquet"
    rows = searched(study, path, Pretended(hill), Budget(24, seed=1))
    text = "\n".join(summary.of_search(Table.open(path)))
    value, low, high = map(float, re.search(r"above the floor: (\S+?)[, ].*95 %: (\S+) \.\. (\S+)", text).groups())
    assert low < 1 < high and (low + high) / 2 == pytest.approx(value, rel=1e-3)
    count = int(re.search(r"balls.count +(\d+)", text).group(1))
    assert abs(count - 10) <= 2
    assert f"from {len(rows)} runs" in text


@pytest.mark.slow
def test_runs_of_one_design_have_seeds_of_their_own(study, tmp_path):
    rows = searched(study, tmp_path / "t.parquet", Pretended(hill, error=0.05), Budget(20, seed=1))
    assert len(set(designs(rows))) == len(rows) == len({row["id"] for row in rows})
    again = pandas.DataFrame(rows).groupby("design")["seed"].apply(list)
    assert max(map(len, again)) >= 2
    assert all(sorted(seeds) == list(range(1, len(seeds) + 1)) for seeds in again)


@pytest.mark.slow
def test_one_worker_and_a_seed_give_the_same_runs(study, tmp_path):
    one = searched(study, tmp_path / "a.parquet", Pretended(hill), Budget(12, seed=3))
    two = searched(study, tmp_path / "b.parquet", Pretended(hill), Budget(12, seed=3))
    other = searched(study, tmp_path / "c.parquet", Pretended(hill), Budget(12, seed=4))
    assert designs(one) == designs(two) != designs(other)


@pytest.mark.slow
def test_a_design_that_fails_does_not_stop_the_search(study, tmp_path):
    def refused(one):
        return "too many balls" if one["values"]["balls.count"] > 14 else hill(one)

    rows = searched(study, tmp_path / "t.parquet", Pretended(refused), Budget(18, seed=1))
    failed = [row for row in rows if row["status"] == "failed"]
    assert failed and {row["message"] for row in failed} == {"too many balls"}
    assert len({row["design"] for row in failed}) == len(failed) < 9
    surface_rows = [row for row in rows if row["status"] == "done"]
    assert max(hill({"values": row}) for row in surface_rows) > 0.97


@pytest.mark.slow
def test_several_objectives_end_with_their_front(write_study, tmp_path):
    study = Study(write_study(STUDY.replace("[set]", f"minimise = {POWER}\n[set]")))

    def two(one):  # between 2 and 10 balls either objective can be had for the other
        count = one["values"]["balls.count"]
        return [-((count - 10) ** 2), (count - 2) ** 2 + one["values"]["rotor.speed"] / 100]

    path = tmp_path / "t.parquet"
    rows = searched(study, path, Pretended(two, error=1e-6), Budget(50, seed=1))
    assert len(rows) == 50
    text = summary.of_search(Table.open(path))
    assert re.match(r"\d+ of \d+ designs are not beaten", text[0])
    front = [line.split() for line in text[3:-1]]
    counts = [int(line[2]) for line in front]
    assert len(counts) >= 5 and all(2 <= count <= 11 for count in counts)
    share = np.mean([row["balls.count"] <= 10 for row in rows[-20:]])
    assert share >= 0.6  # 9 of 19 by chance


def test_a_front_is_what_no_other_beats():
    values = np.array([[1, 1], [2, 0], [0, 2], [0.5, 0.5], [1, 1], [2, -1]])
    assert list(optimum.pareto(values)) == [True, True, True, False, True, False]
    assert list(optimum.pareto(values * [1, -1])) == [False, False, False, False, False, True]


# ---- whatever ends it


@pytest.mark.slow
def test_a_search_that_is_stopped_goes_on_to_the_same_runs(study, tmp_path):
    whole = searched(study, tmp_path / "a.parquet", Pretended(hill))
    path = tmp_path / "b.parquet"
    first = Pretended(hill, stop=7)
    assert len(searched(study, path, first)) == 7
    second = Pretended(hill)
    assert designs(searched(study, path, second)) == designs(whole)
    assert len(first.jobs) + len(second.jobs) == len(whole)


@pytest.mark.slow
@pytest.mark.parametrize("moment", some(["row not told", "row not in the trial", "trial without its id"], 3))
def test_a_driver_that_dies_between_two_steps_loses_no_run(study, tmp_path, moment):
    path = tmp_path / "t.parquet"

    def dies(search):
        tell, ask = search._tell, search.optuna.ask

        def told(trial_id, row):
            if len(search.table) == 6:
                if moment == "row not told":
                    search.optuna._storage.set_trial_user_attr(trial_id, "row", plain(row))
                raise KeyboardInterrupt
            tell(trial_id, row)

        def asked(*arguments):
            trial = ask(*arguments)
            if len(search.table) == 6:
                raise KeyboardInterrupt
            return trial

        if moment == "trial without its id":
            search.optuna.ask = asked
        else:
            search._tell = told

    before = searched(study, path, Pretended(hill), dies=dies)
    assert len(before) == 6
    second = Pretended(hill)
    rows = searched(study, path, second)
    assert {row["id"] for row in before} <= {row["id"] for row in rows}
    assert len(rows) == len({row["id"] for row in rows}) == 6 + len(second.jobs)
    whole = searched(study, tmp_path / "whole.parquet", Pretended(hill))
    assert designs(rows) == designs(whole)


@pytest.mark.slow
def test_a_line_that_was_torn_is_cut_off(study, tmp_path):
    path = tmp_path / "t.parquet"
    searched(study, path, Pretended(hill, stop=5))
    journal = tmp_path / "t.optuna.journal"
    with open(journal, "ab") as file:
        file.write(b'{"op_code":5,"worker_id')
    assert len(searched(study, path, Pretended(hill))) >= 12
    assert b"worker_id{" not in journal.read_bytes()


@pytest.mark.parametrize("lost", ["storage", "table"])
def test_the_table_or_the_storage_alone_is_enough_to_go_on(study, tmp_path, lost):
    path = tmp_path / "t.parquet"
    before = searched(study, path, Pretended(hill, stop=6))
    (tmp_path / ("t.optuna.journal" if lost == "storage" else "t.parquet")).unlink()
    rows = searched(study, path, Pretended(hill), Budget(9, seed=1))
    assert {row["id"] for row in before} <= {row["id"] for row in rows}
    assert len(rows) == 9


@pytest.mark.slow
def test_two_drivers_share_a_storage_and_its_runs(study, tmp_path):
    storage = f"sqlite:///{tmp_path}/both.db"
    first = Pretended(hill, error=1, stop=5)
    searched(study, tmp_path / "a.parquet", first, storage=storage)  # one is left running
    second = Pretended(hill, error=1)
    rows = searched(study, tmp_path / "b.parquet", second, Budget(10, seed=1), storage)
    assert len(second.jobs) == 10 - 6
    assert len(rows) == 9  # the run that is the other driver's is not done by this one
    third = Pretended(hill, error=1)
    rows = searched(study, tmp_path / "a.parquet", third, Budget(10, seed=1), storage)
    assert len(third.jobs) == 1 and len(rows) == 10


def test_a_run_that_another_driver_has_told_meanwhile_is_told_once(study, tmp_path):
    def twice(search):
        tell = search._tell
        search._tell = lambda number, row: [tell(number, row) for _ in range(2)]

    rows = searched(study, tmp_path / "a.parquet", Pretended(hill, error=1), Budget(4, seed=1), dies=twice)
    assert [row["status"] for row in rows] == ["done"] * 4


def test_a_sweep_that_is_there_is_knowledge(study, tmp_path):
    path = tmp_path / "t.parquet"
    about = study.about(4)
    executor = Pretended(hill, error=1)
    with Writer.begin(path, about) as table:
        for number, count in enumerate((2, 8, 14, 20)):
            one = study.job(number, {"rotor.speed": study.vary[0].values[3], "balls.count": count})
            table.add(executor.submit(None, one).result())
    second = Pretended(hill, error=1)
    rows = searched(study, path, second, Budget(7, seed=1))
    assert len(rows) == 7 and len(second.jobs) == 3


# ---- the command


@pytest.mark.slow
def test_the_command_runs_the_mill_and_goes_on_with_more_runs(mill, write_study, tmp_path):
    write_study(STUDY.replace("5 ms", "20 ms").replace("2..20", "12..20"))
    done = mill("optimize", "a.study", "--runs", "2", "--workers", "1")
    assert done.returncode == 0, done.stderr
    frame = pandas.read_parquet(tmp_path / "a-optimize.parquet")
    assert len(frame) == 2 and set(frame["status"]) == {"done"} and np.isfinite(frame[MEDIAN]).all()
    assert done.stdout.splitlines()[0].startswith("the largest median normal impact speed above the floor: ")
    assert "see them with: mill study a-optimize.parquet" in done.stdout
    more = mill("optimize", "a.study", "--runs", "3", "--workers", "1")
    assert "2 runs are there already" in more.stderr
    longer = pandas.read_parquet(tmp_path / "a-optimize.parquet")
    assert len(longer) == 3 and set(frame["id"]) <= set(longer["id"])


@pytest.mark.slow
def test_kill_9_of_the_driver_loses_no_run_and_leaves_none(mill, write_study, stand_in, tmp_path):
    write_study(STUDY)
    program = stand_in(f"[ $(wc -l < $log) -lt 2 ] || while [ ! -e {tmp_path}/go ]; do sleep 0.02; done")  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": program}
    words = [sys.executable, "-m", "milltools", "optimize", "a.study", "--runs", "3", "--workers", "1"]  # fmt: skip
    driver = subprocess.Popen(words, cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 100
    while len(runs(tmp_path)) < 2:
        assert time.monotonic() < deadline and driver.poll() is None
        time.sleep(0.02)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    hanging = runs(tmp_path)[1][0]
    while alive(hanging):
        assert time.monotonic() < deadline
        time.sleep(0.02)
    (tmp_path / "go").touch()
    done = mill("optimize", "a.study", "--runs", "3", "--workers", "1", env={"MILLSIM": program})
    assert done.returncode == 0, done.stderr
    assert "1 runs are there already" in done.stderr
    begun = [(seed, speed) for _, seed, speed in runs(tmp_path)]
    assert len(begun) == 4  # three, and the one that was in flight once more
    assert len(pandas.read_parquet(tmp_path / "a-optimize.parquet")) == 3


@pytest.mark.parametrize(
    "words, said",
    [
        (["--runs", "0"], "--runs: expected 1 or more, got 0"),
        (["--seed", "-1"], "--seed: expected a whole number from 0 to"),
        (["--storage", "mysql://x/y"], "--storage: expected a file, sqlite:///FILE or postgresql"),
    ],
)
def test_wrong_usage_is_one_line(mill, write_study, tmp_path, words, said):
    write_study(STUDY)
    done = mill("optimize", "a.study", *words)
    assert done.returncode == 2 and said in done.stderr and len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.glob("*.parquet"))


def test_a_storage_that_is_not_there_is_one_line_without_the_password(tmp_path):
    with pytest.raises(UserError) as fault:
        open_storage("postgresql://me:secret@127.0.0.1:1/none", tmp_path / "t.parquet")
    assert fault.value.status == 1 and "secret" not in str(fault.value)
    with pytest.raises(UserError, match="not a journal"):
        (tmp_path / "x").write_text("no journal\nat all\n")
        open_storage(str(tmp_path / "x"), tmp_path / "t.parquet")


def test_what_is_known_of_a_trial_is_what_optuna_shows(study, tmp_path):
    searched(study, tmp_path / "t.parquet", Pretended(hill, stop=3))
    storage, _ = open_storage(None, tmp_path / "t.parquet")
    (name,) = optuna.study.get_all_study_names(storage)
    trials = optuna.load_study(study_name=name, storage=storage).trials
    assert [t.state.name for t in trials] == ["COMPLETE"] * 3 + ["RUNNING"]
    assert trials[0].params["balls.count"] == trials[0].user_attrs["row"]["balls.count"]
    assert trials[0].value == trials[0].user_attrs["row"][MEDIAN]
