"""Studies through a real Slurm: one node on loopback, started for these tests."""

import collections
import re
import signal
import time

import pytest
import slurm_cluster
from cluster_studies import Case, alive, facts, wait

pytestmark = [
    pytest.mark.slurm,
    pytest.mark.skipif(slurm_cluster.missing() is not None, reason=slurm_cluster.missing() or ""),
]


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    with slurm_cluster.SlurmCluster(tmp_path_factory.mktemp("slurm"), cpus=4) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def limited(tmp_path_factory, slurm):
    """(case, its driver, a task): a study whose one task meets its time limit. Limits are whole minutes, this one is
    moved to now; Slurm looks for it twice a minute. So it begins with the first test and is looked at by the last."""
    case = Case(tmp_path_factory.mktemp("limited"), 11, slurm.environment, "limited")
    case.hold(1, "only")
    sweep = case.start("--slurm", "--bundle", "4", "--slurm-options=--time=1")
    ((_, task, _),) = case.await_held(1)
    slurm.command("scontrol", "update", f"JobId={task}", "EndTime=now")
    yield case, sweep, task
    case.stop()


@pytest.fixture
def case(tmp_path, slurm, limited):
    case = Case(tmp_path, environment=slurm.environment)
    yield case
    case.stop()
    slurm.cancel("mill-t-")


def tasks(starts):
    """{ARRAY_TASK: designs that it has begun}"""
    found = collections.defaultdict(list)
    for design, task, _ in starts:
        found[task].append(design)
    return found


def all_done(case):
    return list(case.table()["status"]) == ["done"] * case.designs


def test_slurm_gives_the_rows_that_this_machine_gives_a_bundle_in_a_task(case, slurm):
    assert case.sweep().returncode == 0
    here = case.table()
    case.log.unlink()
    case.hold(2)
    sweep = case.start("--force", "--slurm", "--bundle", "3", "--tasks", "2")
    case.await_held(2)
    running = [len(slurm.listed("mill-t-", "RUNNING")) for _ in range(3)]
    case.release()
    while sweep.poll() is None:
        running.append(len(slurm.listed("mill-t-", "RUNNING")))
        time.sleep(0.5)
    assert (sweep.returncode, sweep.stderr.read()) == (0, "")
    assert facts(case.table()).equals(facts(here))
    assert sorted(len(begun) for begun in tasks(case.starts()).values()) == [2, 3, 3]
    assert set(case.runs().values()) == {1} and max(running) == 2
    assert not slurm.listed("mill-t-")
    assert not list(case.folder.glob("*.slurm")) and not list((case.folder / "scratch").iterdir())


@pytest.mark.thorough
def test_a_killed_task_costs_one_more_run_of_what_it_had_in_hand_and_nothing_else(case, slurm):
    case.hold(2)
    sweep = case.start("--slurm", "--bundle", "2")
    design, task, pid = case.await_held(3)[-1]
    slurm.command("scancel", task)
    wait(lambda: not alive(pid), "the end of its run")
    case.release()
    assert sweep.wait(90) == 0, sweep.stderr.read()
    runs = case.runs()
    assert len(runs) == case.designs and all_done(case)
    assert [d for d, count in runs.items() if count > 1] == [design] and runs[design] == 2


def test_a_driver_killed_and_started_again_waits_for_what_is_under_way(case, slurm):
    case.hold(2)
    driver = case.start("--slurm", "--bundle", "2")
    case.await_held(3)
    driver.kill()
    driver.wait()
    assert slurm.listed("mill-t-")
    case.release()
    done = case.sweep("--slurm", "--bundle", "2")
    assert done.returncode == 0, done.stderr
    assert all_done(case)
    assert set(case.runs().values()) == {1}
    assert len({task.split("_")[0] for task in tasks(case.starts())}) == 1, "submitted once"


def test_ctrl_c_cancels_the_tasks_and_keeps_their_rows(case, slurm):
    case.hold(2)
    sweep = case.start("--slurm", "--bundle", "3")
    case.await_held(3)
    sweep.send_signal(signal.SIGINT)
    assert sweep.wait(90) == 130
    wait(lambda: not slurm.listed("mill-t-"), "an empty queue")
    before = case.starts()
    assert not any(alive(pid) for _, _, pid in before) and len(before) < case.designs
    case.release()
    done = case.sweep("--slurm")
    assert done.returncode == 0, done.stderr
    assert all_done(case)
    in_hand = {designs[-1] for designs in tasks(before).values()}
    assert {design for design, count in case.runs().items() if count > 1} <= in_hand


@pytest.mark.thorough
def test_detached_tasks_go_on_alone_and_their_rows_are_taken_up(case, slurm):
    case.hold(2)
    sweep = case.start("--slurm", "--bundle", "3", "--detach")
    case.await_held(3)
    sweep.send_signal(signal.SIGINT)
    _, said = sweep.communicate(timeout=90)
    assert sweep.returncode == 130
    assert re.search(r"tasks stay in Slurm's queue \(\d+\); the same command later collects", said)
    case.release()
    wait(lambda: not slurm.listed("mill-t-"), "the tasks")
    assert set(case.runs().values()) == {1} and len(case.runs()) == case.designs
    done = case.sweep("--slurm", "--detach")
    assert done.returncode == 0, done.stderr
    assert all_done(case) and sum(case.runs().values()) == case.designs
    assert not list(case.folder.glob("*.slurm"))


def test_what_sbatch_refuses_is_one_line(case):
    done = case.sweep("--slurm", "--slurm-options=--partition=nowhere")
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("mill sweep: sbatch: invalid partition specified: nowhere")
    assert not case.starts()


@pytest.mark.thorough
def test_a_time_limit_costs_one_more_run_of_what_was_in_hand(limited, slurm):
    case, sweep, task = limited
    wait(lambda: task not in slurm.listed("limited"), "the limit")
    log = (slurm.folder / "slurmctld.log").read_text()
    assert f"Time limit exhausted for JobId={task}" in log
    assert sweep.wait(90) == 0, sweep.stderr.read()
    assert all_done(case)
    assert sorted(case.runs().values()) == [1] * (case.designs - 1) + [2]
    assert case.runs()[case.starts()[0][0]] == 2
