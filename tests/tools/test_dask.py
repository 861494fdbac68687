"""Studies through a real Dask scheduler and real workers, on loopback."""

import collections
import json
import os
import pathlib
import signal
import subprocess
import sys

import pytest
from cluster_studies import TOOLS, Case, alive, facts, wait

DASK = [sys.executable, "-m", "dask"]


class Scheduler:
    """A scheduler, and workers of one thread each; all end with it."""

    def __init__(self, folder):
        self.folder, self.file, self.processes = folder, folder / "scheduler.json", []
        self.workers = []

    def _start(self, *words, tools=TOOLS):
        with open(self.folder / "dask.log", "ab") as log:
            process = subprocess.Popen(
                [*DASK, *map(str, words)],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": tools},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )
        self.processes.append(process)
        return process

    def start(self, workers=2, **options):
        words = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.scheduler = self._start("scheduler", *words, "--scheduler-file", self.file)
        wait(self.file.exists, "the scheduler's file")
        for _ in range(workers):
            self.add_worker(**options)
        return self

    def add_worker(self, **options):
        words = ("--nthreads", "1", "--host", "127.0.0.1", "--no-dashboard", "--no-nanny")
        worker = self._start("worker", "--scheduler-file", self.file, *words, **options)
        self.workers.append(worker)
        return worker

    @property
    def address(self):
        return json.loads(self.file.read_text())["address"]

    def stop(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
        for process in self.processes:
            process.wait()


@pytest.fixture
def scheduler(tmp_path):
    """A scheduler to start, for tests that do it harm."""
    folder = tmp_path / "dask"
    folder.mkdir()
    scheduler = Scheduler(folder)
    yield scheduler
    scheduler.stop()


@pytest.fixture(scope="module")
def pool(tmp_path_factory):
    """A scheduler and two workers that nobody harms."""
    scheduler = Scheduler(tmp_path_factory.mktemp("dask")).start()
    yield scheduler
    scheduler.stop()


@pytest.fixture
def case(tmp_path):
    case = Case(tmp_path)
    yield case
    case.stop()


def worker_of(case, pid):
    """The process that started this run: a Dask worker."""
    return int(pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


@pytest.mark.slow
def test_dask_gives_the_rows_that_this_machine_gives(case, pool):
    assert case.sweep().returncode == 0
    here = case.table()
    done = case.sweep("--force", "--dask", pool.address.removeprefix("tcp://"))
    assert (done.returncode, done.stderr) == (0, "")
    assert facts(case.table()).equals(facts(here))
    workers = collections.Counter(case.table()["worker"])
    assert sorted(int(w.split(":")[1]) for w in workers) == sorted(w.pid for w in pool.workers)


@pytest.mark.slow
@pytest.mark.thorough
def test_a_killed_worker_costs_one_more_run_of_what_it_had_in_hand_and_nothing_else(case, scheduler):
    case.hold(5)
    scheduler.start()
    sweep = case.start("--dask", str(scheduler.file))
    design, _, pid = case.await_held(2)[-1]
    # a result that the driver has not fetched dies with its worker
    wait(lambda: case.kept() == len(case.starts()) - 2, "the rows of all that are not held")
    victim = worker_of(case, pid)
    assert victim in [worker.pid for worker in scheduler.workers]
    os.kill(victim, signal.SIGKILL)
    wait(lambda: not alive(pid), "the end of the run: it outlives its worker")
    case.release()
    assert sweep.wait(90) == 0, sweep.stderr.read()
    runs = case.runs()
    assert len(runs) == case.designs
    assert runs.pop(design) == 2
    assert set(runs.values()) == {1}
    assert list(case.table()["status"]) == ["done"] * case.designs


@pytest.mark.slow
@pytest.mark.thorough
def test_a_dead_scheduler_is_one_line_and_the_same_command_goes_on(case, scheduler):
    case.hold(5)
    scheduler.start()
    sweep = case.start("--dask", str(scheduler.file))
    case.await_held(2)
    wait(case.kept, "a row")
    scheduler.scheduler.kill()
    _, said = sweep.communicate(timeout=90)
    assert sweep.returncode == 1
    assert said.startswith(f"mill sweep: the Dask scheduler at {scheduler.file} is gone")
    assert len(said.splitlines()) == 1
    kept, before = case.kept(), len(case.starts())
    assert kept >= 1
    case.release()
    done = case.sweep("--dask", "local")
    assert done.returncode == 0, done.stderr
    assert list(case.table()["status"]) == ["done"] * case.designs
    assert len(case.starts()) - before == case.designs - kept, "what was done is not done again"


@pytest.mark.slow
def test_no_scheduler_is_one_line(case):
    done = case.sweep("--dask", "127.0.0.1:1")
    assert done.returncode == 1
    assert done.stderr.startswith("mill sweep: --dask: no scheduler at 127.0.0.1:1")
    assert len(done.stderr.splitlines()) == 1
    assert not case.starts()


@pytest.mark.slow
def test_workers_without_milltools_are_one_line(case, scheduler):
    # as if it were not there, wherever it is installed
    (scheduler.folder / "milltools.py").write_text(
        "raise ModuleNotFoundError(\"No module named 'milltools'\", name='milltools')\n"
    )
    scheduler.start(workers=1, tools=str(scheduler.folder))
    done = case.sweep("--dask", str(scheduler.file))
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert "does not find this version of milltools" in done.stderr
    assert "start the workers with PYTHONPATH=" in done.stderr


@pytest.mark.slow
def test_workers_with_another_milltools_are_one_line(case, scheduler):
    other = scheduler.folder / "other"
    subprocess.run(["cp", "-r", TOOLS, other], check=True)
    with open(other / "milltools/study/plan/job.py", "a") as file:
        file.write("# another version\n")
    scheduler.start(workers=1, tools=str(other))
    done = case.sweep("--dask", str(scheduler.file))
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert "milltools differs: " in done.stderr
    assert not case.starts()


@pytest.mark.slow
def test_ctrl_c_ends_the_runs_on_the_workers_and_leaves_the_workers(case, pool):
    case.hold(1)
    sweep = case.start("--dask", str(pool.file))
    case.await_held(2)
    sweep.send_signal(signal.SIGINT)
    assert sweep.wait(90) == 130
    wait(lambda: not any(alive(pid) for _, _, pid in case.starts()), "the runs' end")
    case.release()
    done = case.sweep("--dask", str(pool.file))
    assert done.returncode == 0, done.stderr
    assert list(case.table()["status"]) == ["done"] * case.designs


@pytest.mark.slow
@pytest.mark.thorough
def test_dask_local_is_a_cluster_of_ones_own_that_goes_with_the_driver(case):
    case.hold(3)
    sweep = case.start("--dask", "local", "--workers", "2")
    pids = [int(pid) for _, _, pid in case.await_held(2)]
    workers = {worker_of(case, pid) for pid in pids}
    assert sweep.pid not in workers
    sweep.kill()
    sweep.wait()
    wait(lambda: not any(alive(pid) for pid in [*pids, *workers]), "the end of all it started")
    kept, before = case.kept(), len(case.starts())
    case.release()
    done = case.sweep("--dask", "local")
    assert done.returncode == 0, done.stderr
    assert list(case.table()["status"]) == ["done"] * case.designs
    assert len(case.starts()) - before == case.designs - kept, "what was done is not done again"
