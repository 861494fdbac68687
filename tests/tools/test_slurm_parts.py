"""What of the way through Slurm needs no Slurm: what a task does, what the driver makes of it. Slurm's commands are
played by functions that start each task as a process, as Slurm would."""

import argparse
import collections
import os
import re
import signal
import subprocess
import sys
import threading
import time

import pytest
import small_job
from cluster_studies import TOOLS, wait

from milltools.base.errors import UserError
from milltools.study import sweep
from milltools.study.plan.job import Lost
from milltools.study.remote import executors, slurm, slurm_queue, slurm_task
from milltools.study.remote.slurm_task import Array, Listener, Sayer, Spool

CALL = "small_job:run"


class Queue:
    """Slurm's commands, and what becomes of tasks."""

    def __init__(self):
        self.tasks, self.submitted, self.cancelled = {}, [], []
        self.away = self.full = None  # how often the next sbatch or squeue is not answered; tasks an account may have
        self.runs = True  # tasks begin

    def check(self):
        pass

    def largest_array(self):
        return 1001

    def submit(self, array, count, script, options="", at_once=None):
        self.submitted.append((array.name, count, options, at_once))
        self._answer()
        if self.full is not None and count + len(self.listed([])) > self.full:
            raise slurm_queue.Full("too many")
        (array.folder / "job").write_text(f"{len(self.submitted)}\n")
        for number in range(count):
            path = f"{TOOLS}:{os.path.dirname(__file__)}"
            self.tasks[array.name, number] = self.runs and subprocess.Popen(
                ["sh", "-c", script],
                env={**os.environ, "PYTHONPATH": path, "SLURM_ARRAY_TASK_ID": str(number)},
                stdin=subprocess.DEVNULL,
                stdout=open(array.folder / f"{number}.out", "w"),
                stderr=subprocess.STDOUT,
            )

    def _answer(self):
        if self.away:
            self.away -= 1
            raise slurm_queue.Away("Unable to contact slurm controller")

    def listed(self, _):
        self._answer()
        return {key for key, process in self.tasks.items() if process and process.poll() is None}

    def cancel(self, names):
        self.cancelled += names
        for (name, _), process in self.tasks.items():
            if name in names and process:
                process.kill()
                process.wait()


@pytest.fixture
def queue(monkeypatch):
    queue = Queue()
    for name in ("check", "largest_array", "submit", "listed", "cancel"):
        monkeypatch.setattr(slurm_queue, name, getattr(queue, name))
    monkeypatch.setattr(slurm, "GRACE", 0.1)
    monkeypatch.setattr(slurm, "AWAY", 0.1)
    monkeypatch.setattr(slurm, "FULL", 0.3)
    yield queue
    queue.cancel([name for name, _ in queue.tasks])


@pytest.fixture
def job(tmp_path):
    """job(name, ...) makes one; job.runs() says which were run, how often."""

    def make(name, sleep=0.0, do=""):
        log = str(tmp_path / "log")
        return {"id": name, "design": 0, "log": log, "sleep": sleep, "do": do}

    def runs():
        log = tmp_path / "log"
        return collections.Counter(log.read_text().split() if log.exists() else [])

    make.runs = runs
    return make


def entries(*jobs):
    return [{"call": CALL, "job": job} for job in jobs]


@pytest.fixture
def task(tmp_path, job):
    """task(jobs) -> (array, start): an array of one task; start(**environment) starts it."""
    started = []

    def make(*jobs):
        array = Array(tmp_path / "00001", "name")
        array.write([entries(*jobs)])

        def start(**environment):
            words = [
                sys.executable,
                "-m",
                "milltools.study.remote.slurm_task",
                str(array.folder),
                "0",
            ]
            path = f"{TOOLS}:{os.path.dirname(__file__)}"
            started.append(subprocess.Popen(words, env={**os.environ, "PYTHONPATH": path, **environment}))
            return started[-1]

        return array, start

    yield make
    for process in started:
        process.kill()
        process.wait()


def said(array, what):
    return [line[what] for line in Listener(array.rows(0)).listen() if what in line]


# ---- files


def test_a_torn_line_is_no_line_and_the_next_begins_anew(tmp_path):
    path = tmp_path / "0.rows"
    path.write_bytes(b'{"start": "a"}\n{"row": {"id": "a", "wa')
    listener = Listener(path)
    assert listener.listen() == [{"start": "a"}]
    sayer = Sayer(path)
    sayer.say({"start": "a"})
    assert listener.listen() == [{"start": "a"}]
    assert listener.listen() == []


def test_a_line_is_heard_when_it_is_whole(tmp_path):
    path = tmp_path / "0.rows"
    listener = Listener(path)
    assert listener.listen() == []
    with open(path, "ab", buffering=0) as file:
        file.write(b'{"row": {"power"')
        assert listener.listen() == []
        file.write(b": NaN}}\n")
        (heard,) = listener.listen()
    assert heard["row"]["power"] != heard["row"]["power"]


def test_names_of_studies_that_a_queue_would_not_take_are_made_plain(tmp_path):
    names = [Spool(tmp_path / f"{word}.slurm").prefix for word in ("a, b|c%\n", "", "ü" * 99)]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]{1,40}", name) for name in names)
    assert len(set(names)) == 3


@pytest.mark.parametrize(
    ("count", "cost", "tasks", "expected"),
    [
        (399, None, None, 20),  # nothing known: a guess
        (399, 3.0, None, 25),  # all of 16 tasks have something to do
        (10_000, 3.0, None, 100),  # five minutes
        (10_000, 0.01, None, 625),
        (10_000, 3000.0, None, 10),  # an array has 1000 tasks
        (1, 3000.0, None, 1),
        (12, None, 4, 3),
    ],
)
def test_bundles_take_minutes_and_leave_none_idle(count, cost, tasks, expected):
    assert slurm.bundle_size(count, cost, tasks) == expected


# ---- a task


def test_a_task_says_each_row_before_it_takes_the_next_job(task, job):
    array, start = task(job("a"), job("b"), job("c", sleep=100))
    process = start()
    wait(lambda: "c" in said(array, "start"), "the third job")
    process.kill()
    assert [row["id"] for row in said(array, "row")] == ["a", "b"]
    assert said(array, "end") == []


@pytest.mark.slow
def test_a_task_that_is_begun_again_does_what_is_left(task, job):
    array, start = task(job("a"), job("b", sleep=100), job("c"))
    process = start()
    wait(lambda: job.runs()["b"], "the second job")
    process.kill()
    process.wait()
    lines = (array.folder / "0.jobs").read_text().replace("100", "0")
    (array.folder / "0.jobs").write_text(lines)
    assert start().wait(90) == 0
    assert job.runs() == {"a": 1, "b": 2, "c": 1}
    assert [row["id"] for row in said(array, "row")] == ["a", "b", "c"]
    assert said(array, "end") == [True]


@pytest.mark.slow
def test_a_job_that_ends_its_task_three_times_is_lost_and_the_others_go_on(task, job):
    array, start = task(job("a", do="die"), job("b"))
    for _ in range(slurm_task.TRIES):
        assert start().wait(90) == -signal.SIGKILL
    assert start().wait(90) == 0
    assert job.runs() == {"a": slurm_task.TRIES, "b": 1}
    assert said(array, "lost") == ["a"]


@pytest.mark.slow
def test_what_a_job_raises_is_said_and_the_others_go_on(task, job):
    array, start = task(job("a", do="lose"), job("b", do="fail"), job("c"))
    assert start().wait(90) == 0
    assert said(array, "lost") == ["a"]
    assert said(array, "error") == ["b"]
    assert said(array, "why") == ["killed from outside", "no space left on the disk"]
    assert [row["id"] for row in said(array, "row")] == ["c"]


@pytest.mark.slow
def test_a_run_that_is_struck_before_its_task_is_not_lost_and_no_other_is_begun(task, job):
    array, start = task(job("a", do="lose"), job("b", sleep=100))
    process = start()
    wait(lambda: job.runs()["a"], "the first job")
    time.sleep(0.1)
    process.terminate()
    assert process.wait(90) == 128 + signal.SIGTERM
    assert said(array, "start") == ["a"] and said(array, "lost") == []
    assert job.runs() == {"a": 1}


def test_a_task_runs_one_job_on_each_core_it_was_given(task, job):
    array, start = task(*(job(name, sleep=100) for name in "abcd"))
    start(SLURM_CPUS_PER_TASK="3")
    wait(lambda: len(said(array, "start")) == 3, "three jobs")
    time.sleep(0.3)
    assert sorted(said(array, "start")) == ["a", "b", "c"]


# ---- the driver


def submit(executor, *jobs):
    return [executor.submit(small_job.run, job) for job in jobs]


@pytest.mark.slow
def test_results_come_back_and_the_folder_goes(queue, job, tmp_path):
    with slurm.SlurmExecutor(tmp_path / "t.slurm", "--time=5", bundle=2) as executor:
        futures = submit(executor, *(job(name) for name in "abc"))
        rows = [future.result(90) for future in futures]
    assert [row["id"] for row in rows] == ["a", "b", "c"]
    assert len({row["task"] for row in rows}) == 2
    ((_, count, options, at_once),) = queue.submitted
    assert (count, options, at_once) == (2, "--time=5", None)
    assert not (tmp_path / "t.slurm").exists()


@pytest.mark.slow
def test_of_a_task_that_dies_what_it_had_begun_is_lost_and_the_rest_goes_into_another(queue, job, tmp_path):
    with slurm.SlurmExecutor(tmp_path / "t.slurm", bundle=4) as executor:
        futures = submit(executor, job("a"), job("b", do="die"), job("c"), job("d"))
        assert futures[0].result(90)["id"] == "a"
        with pytest.raises(Lost, match="its Slurm task was ended while it ran"):
            futures[1].result(90)
        assert [future.result(90)["id"] for future in futures[2:]] == ["c", "d"]
    assert job.runs() == {"a": 1, "b": 1, "c": 1, "d": 1}


@pytest.mark.slow
def test_what_a_task_says_of_a_job_is_raised(queue, job, tmp_path):
    with slurm.SlurmExecutor(tmp_path / "t.slurm") as executor:
        lost, failed = submit(executor, job("a", do="lose"), job("b", do="fail"))
        with pytest.raises(Lost, match="killed from outside"):
            lost.result(90)
        with pytest.raises(UserError, match="no space left on the disk"):
            failed.result(90)


def test_tasks_that_end_before_their_first_run_are_given_up_with_their_last_words(queue, job, tmp_path, monkeypatch):
    words = "echo; echo no such host; echo; exit 1"
    monkeypatch.setattr(slurm_task, "script", lambda array: words)
    executor = slurm.SlurmExecutor(tmp_path / "t.slurm")
    (future,) = submit(executor, job("a"))
    with pytest.raises(UserError, match="3 Slurm tasks ended before .*: no such host"):
        future.result(90)
    assert len(queue.submitted) == 3
    executor.shutdown()


@pytest.mark.slow
def test_a_controller_that_does_not_answer_is_waited_for(queue, job, tmp_path, capfd):
    with slurm.SlurmExecutor(tmp_path / "t.slurm") as executor:
        queue.away = 4
        (future,) = submit(executor, job("a", sleep=3))
        assert future.result(90)["id"] == "a"
    assert job.runs() == {"a": 1}
    assert capfd.readouterr().err.splitlines() == [
        "mill: Slurm does not answer, waiting: Unable to contact slurm controller"
    ]


@pytest.mark.slow
def test_an_account_that_may_have_two_tasks_gets_two_at_a_time(queue, job, tmp_path):
    queue.full = 2
    with slurm.SlurmExecutor(tmp_path / "t.slurm", bundle=1) as executor:
        futures = submit(executor, *(job(name) for name in "abcde"))
        assert [future.result(90)["id"] for future in futures] == list("abcde")
    assert set(job.runs().values()) == {1}


def test_a_place_in_the_queue_is_waited_for_with_one_line(queue, job, tmp_path, capfd):
    queue.full = 0
    with slurm.SlurmExecutor(tmp_path / "t.slurm") as executor:
        (future,) = submit(executor, job("a"))
        wait(lambda: len(queue.submitted) == 3, "the third try")
        queue.full = None
        assert future.result(90)["id"] == "a"
    said = capfd.readouterr().err.splitlines()
    assert said == ["mill: Slurm's queue is full, waiting: too many"]


def abandon(executor):
    """As kill -9 of the driver: nothing is tidied up."""
    executor.closing.set()
    executor.watcher.join()


@pytest.mark.slow
def test_the_next_driver_takes_up_rows_and_what_is_under_way(queue, job, tmp_path):
    jobs = [job("a"), job("b", sleep=1), job("c"), job("d")]
    first = slurm.SlurmExecutor(tmp_path / "t.slurm", bundle=2)
    submit(first, *jobs)
    wait(lambda: job.runs()["b"] and job.runs()["d"], "the second job")
    abandon(first)
    with slurm.SlurmExecutor(tmp_path / "t.slurm", bundle=2) as second:
        futures = submit(second, *({**job, "design": 7} for job in reversed(jobs)))
        rows = [future.result(90) for future in futures]
    assert [row["id"] for row in rows] == ["d", "c", "b", "a"]
    assert rows[3]["design"] == 7, "numbers of designs are those of the study as it is now"
    assert job.runs() == {"a": 1, "b": 1, "c": 1, "d": 1}
    assert len(queue.submitted) == 1
    assert not (tmp_path / "t.slurm").exists()


@pytest.mark.slow
def test_what_the_next_driver_does_not_want_any_more_is_cancelled(queue, job, tmp_path):
    first = slurm.SlurmExecutor(tmp_path / "t.slurm")
    submit(first, job("a", sleep=100))
    wait(lambda: job.runs()["a"], "the job")
    abandon(first)
    ((unwanted, _),) = queue.listed([])
    with slurm.SlurmExecutor(tmp_path / "t.slurm") as second:
        (future,) = submit(second, job("b"))
        assert future.result(90)["id"] == "b"
    assert unwanted in queue.cancelled
    wait(lambda: not queue.listed([]), "the end of the other's task")


@pytest.mark.slow
def test_begun_anew_what_an_earlier_driver_left_is_cancelled_and_forgotten(queue, job, tmp_path):
    first = slurm.SlurmExecutor(tmp_path / "t.slurm", bundle=1)
    submit(first, job("a"), job("b", sleep=100))
    wait(lambda: job.runs()["b"] and job.runs()["a"], "the jobs")
    abandon(first)
    with slurm.SlurmExecutor(tmp_path / "t.slurm", anew=True) as second:
        assert not queue.listed([])
        (future,) = submit(second, job("a"))
        assert future.result(90)["id"] == "a"
    assert job.runs() == {"a": 2, "b": 1}


def test_an_interrupted_driver_that_is_not_detached_cancels(queue, job, tmp_path):
    executor = slurm.SlurmExecutor(tmp_path / "t.slurm")
    (future,) = submit(executor, job("a", sleep=100))
    wait(lambda: job.runs()["a"], "the job")
    executor.shutdown(cancel_futures=True)
    assert not queue.listed([])
    with pytest.raises(Lost):
        future.result(0)


def test_no_thread_is_left(queue, job, tmp_path):
    with slurm.SlurmExecutor(tmp_path / "t.slurm"):
        pass
    assert "slurm" not in [thread.name for thread in threading.enumerate()]


# ---- the command line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--bundle", "3"], "--bundle: only with --slurm"),
        (["--detach"], "--detach: only with --slurm"),
        (["--slurm-options=--time=5"], "--slurm-options: only with --slurm"),
        (["--slurm", "--dask", "local"], "--dask or --slurm, not both"),
        (["--slurm", "--workers", "3"], "--workers is for runs on this machine"),
        (["--slurm", "--tasks", "0"], "--tasks: expected 1 or more, got 0"),
        (["--slurm", "--slurm-options=--comment='a"], "--slurm-options: No closing quotation"),
    ],
)
def test_options_that_do_not_go_together_are_one_line(queue, words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.study").write_text("")
    parser = argparse.ArgumentParser()
    sweep.add_arguments(parser)
    with pytest.raises(UserError, match=f"^{said}") as raised:
        executors.Where(**executors.asked(parser.parse_args(["t.study", *words])))
    assert raised.value.status == 2
