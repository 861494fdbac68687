"""Studies through a real Slurm: one node on loopback, started for these tests."""

import collections
import os
import re
import signal
import subprocess
import sys

import pytest
import slurm_cluster
from cluster_studies import TOOLS, Case, alive, facts, wait

pytestmark = pytest.mark.skipif(
    slurm_cluster.missing() is not None, reason=slurm_cluster.missing() or ""
)


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    with slurm_cluster.SlurmCluster(tmp_path_factory.mktemp("slurm"), cpus=4) as cluster:
        yield cluster
        assert not cluster.listed(), "tasks are left in the queue"


@pytest.fixture
def case(tmp_path, slurm):
    case = Case(tmp_path, environment=slurm.environment)
    yield case
    case.stop()
    slurm.cancel_all()


def tasks(case):
    """{ARRAY_TASK: designs that it has begun}"""
    found = collections.defaultdict(list)
    for design, task, _ in case.starts():
        found[task].append(design)
    return found


def all_done(case):
    return list(case.table()["status"]) == ["done"] * case.designs


def test_slurm_gives_the_rows_that_this_machine_gives_in_tasks_of_a_bundle(case, slurm):
    assert case.sweep().returncode == 0
    here = case.table()
    case.log.unlink()
    done = case.sweep("--force", "--slurm", "--bundle", "5")
    assert (done.returncode, done.stderr) == (0, "")
    assert facts(case.table()).equals(facts(here))
    assert sorted(len(begun) for begun in tasks(case).values()) == [2, 5, 5]
    assert set(case.runs().values()) == {1}
    assert not slurm.listed()
    assert not list(case.folder.glob("*.slurm")) and not list((case.folder / "scratch").iterdir())


def test_a_killed_task_costs_one_more_run_of_what_it_had_in_hand_and_nothing_else(case, slurm):
    case.pause(0.4)
    sweep = case.start("--slurm", "--bundle", "4")
    case.await_starts(6)
    design, task, pid = case.starts()[-1]
    slurm.command("scancel", task)
    case.pause(0)
    assert sweep.wait(60) == 0, sweep.stderr.read()
    runs = case.runs()
    assert len(runs) == case.designs and all_done(case)
    assert [d for d, count in runs.items() if count > 1] == [design] and runs[design] == 2
    assert not alive(pid)


def test_a_task_that_slurm_puts_back_into_the_queue_does_not_repeat_what_it_did(case, slurm):
    case.pause(0.4)
    sweep = case.start("--slurm", "--bundle", "6", "--slurm-options=--requeue")
    case.await_starts(5)
    design, task, _ = case.starts()[-1]
    slurm.command("scontrol", "requeue", task)
    case.pause(0)
    wait(lambda: case.runs()[design] == 2, "the second time", 20)
    assert sweep.wait(60) == 0, sweep.stderr.read()
    assert sum(case.runs().values()) == case.designs + 1 and all_done(case)
    assert {task.split("_")[0] for task in tasks(case)} == {task.split("_")[0]}, "one array did it"


def test_a_time_limit_keeps_what_was_finished(case, slurm):
    case.pause(1.5)
    sweep = case.start("--slurm", "--bundle", "12", "--slurm-options=--time=1")
    case.await_starts(1)
    task = case.starts()[0][1]
    # limits are minutes; this one is made to strike at once, which is when Slurm next looks for it
    slurm.command("scontrol", "update", f"JobId={task}", "EndTime=now")
    wait(lambda: task not in slurm.listed(), "the limit", 40)
    begun = len(case.starts())
    assert 0 < begun < case.designs
    case.pause(0)
    assert sweep.wait(60) == 0, sweep.stderr.read()
    assert sum(case.runs().values()) == case.designs + 1 and all_done(case)


def test_a_driver_killed_and_started_again_waits_for_what_is_under_way(case, slurm):
    case.pause(0.4)
    driver = case.start("--slurm", "--bundle", "3")
    case.await_starts(4)
    driver.kill()
    driver.wait()
    assert slurm.listed()
    done = case.sweep("--slurm", "--bundle", "3")
    assert done.returncode == 0, done.stderr
    assert all_done(case)
    assert set(case.runs().values()) == {1}
    assert len({task.split("_")[0] for task in tasks(case)}) == 1, "nothing was submitted again"


def test_rows_of_tasks_that_ended_without_a_driver_are_not_computed_again(case, slurm):
    case.pause(0.2)
    driver = case.start("--slurm", "--bundle", "6")
    case.await_starts(2)
    driver.kill()
    driver.wait()
    wait(lambda: not slurm.listed(), "the tasks")
    assert sum(case.runs().values()) == case.designs
    done = case.sweep("--slurm")
    assert done.returncode == 0, done.stderr
    assert all_done(case) and sum(case.runs().values()) == case.designs
    assert not list(case.folder.glob("*.slurm"))


def test_ctrl_c_cancels_the_tasks_and_keeps_their_rows(case, slurm):
    case.pause(0.4)
    sweep = case.start("--slurm", "--bundle", "3")
    case.await_starts(6)
    sweep.send_signal(signal.SIGINT)
    assert sweep.wait(30) == 130
    wait(lambda: not slurm.listed(), "an empty queue")
    before = case.starts()
    assert not any(alive(pid) for _, _, pid in before) and len(before) < case.designs
    case.pause(0)
    done = case.sweep("--slurm")
    assert done.returncode == 0, done.stderr
    repeated = {design for design, count in case.runs().items() if count > 1}
    assert all_done(case)
    in_hand = {designs[-1] for designs in tasks_of(before).values()}
    assert repeated <= in_hand


def tasks_of(starts):
    found = collections.defaultdict(list)
    for design, task, _ in starts:
        found[task].append(design)
    return found


def test_detached_tasks_go_on_and_their_rows_are_taken_up(case, slurm):
    case.pause(0.4)
    sweep = case.start("--slurm", "--bundle", "3", "--detach")
    case.await_starts(4)
    sweep.send_signal(signal.SIGINT)
    _, said = sweep.communicate(timeout=30)
    assert sweep.returncode == 130
    assert re.search(r"tasks stay in Slurm's queue \(\d+\); the same command takes up", said)
    assert slurm.listed()
    done = case.sweep("--slurm", "--detach")
    assert done.returncode == 0, done.stderr
    assert all_done(case) and set(case.runs().values()) == {1}


def test_at_most_so_many_tasks_at_once(case, slurm):
    case.pause(0.2)
    sweep = case.start("--slurm", "--bundle", "2", "--tasks", "2")
    most = 0
    while sweep.poll() is None:
        most = max(most, len(slurm.listed("RUNNING")))
    assert sweep.returncode == 0, sweep.stderr.read()
    assert len(tasks(case)) == 6 and most == 2


def test_a_task_uses_the_cores_it_was_given(case):
    case.pause(1)
    sweep = case.start("--slurm", "--bundle", "12", "--slurm-options=--cpus-per-task=3")
    case.await_starts(3)
    assert len([pid for _, _, pid in case.starts() if alive(pid)]) == 3
    case.pause(0)
    assert sweep.wait(30) == 0
    assert len(tasks(case)) == 1


def test_what_sbatch_refuses_is_one_line(case):
    done = case.sweep("--slurm", "--slurm-options=--partition=nowhere")
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "mill sweep: sbatch: Batch job submission failed: Invalid partition name specified"
    ]
    assert not case.starts()


def test_force_cancels_what_an_earlier_driver_left(case, slurm):
    case.pause(30)
    driver = case.start("--slurm", "--bundle", "6")
    case.await_starts(2)
    driver.kill()
    driver.wait()
    old = {task.split("_")[0] for task in slurm.listed()}
    case.pause(0)
    done = case.sweep("--slurm", "--force")
    assert done.returncode == 0, done.stderr
    assert all_done(case)
    assert not {task.split("_")[0] for task in slurm.listed()} & old


def test_a_task_needs_no_slurm(case):
    """Any machine with the folder can do a task: the line of the batch script, typed by hand."""
    case.pause(30)
    driver = case.start("--slurm", "--bundle", "12", "--slurm-options=--hold")
    wait(lambda: list(case.folder.glob("t.slurm/00001/job")), "the array")
    words = [sys.executable, "-m", "milltools.study.slurm_task", "t.slurm/00001", "0"]
    case.pause(0)
    environment = {**os.environ, "PYTHONPATH": TOOLS, "TMPDIR": str(case.folder / "scratch")}
    subprocess.run(words, cwd=case.folder, env=environment, check=True, timeout=60)
    assert driver.wait(30) == 0, driver.stderr.read()
    assert all_done(case) and set(tasks(case)) == {"-_-"}
