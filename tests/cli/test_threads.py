"""run.threads: several threads share the events of a run, and every bit stays as it is."""

import json
import os
import pathlib
import shutil
import signal
import subprocess

import h5py
import pytest
from conftest import PROGRAM, some
from results import OWN, differences, status
from test_faults import BUILT_PLAIN
from test_resume import SHORT, Folder, one_line

INPUT = pathlib.Path(__file__).resolve().parents[2] / "input"
CHOICE = (*OWN, "/deck/run/threads", "/deck/text")  # where runs with different numbers of threads may differ

# Long enough along x for two slabs, 20 layers of cells; for three, 45 layers
LONG = SHORT.replace("length = 70 mm", "length = 110 mm").replace("count = 250", "count = 500")
LONGER = SHORT.replace("length = 70 mm", "length = 235 mm").replace("count = 250", "count = 900")

PLAIN = shutil.which("cc") and BUILT_PLAIN
NO_THREAD = "int pthread_create(void *a, const void *b, void *c, void *d) { return a || b || c || d ? 11 : 11; }\n"


def run(folder, threads, *sets, deck=LONG, environment=None):
    """The output file and the summary of a run of a deck, a text or a path."""
    path = deck if isinstance(deck, pathlib.Path) else folder / "mill.ini"
    if path != deck:
        path.write_text(deck)
    output = folder / f"{threads}{'' if environment is None else '-bare'}.h5"
    orders = [word for order in (f"run.threads={threads}", *sets) for word in ("-s", order)]
    command = [PROGRAM, "-q", "-j", "-o", output, *orders, path]
    done = subprocess.run(command, capture_output=True, text=True, env=environment and {**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    return output, json.loads(done.stdout)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The output file of LONG, with one thread."""
    return run(tmp_path_factory.mktemp("whole"), 1)[0]


PRECISE = ("run.precision=20 %", "run.time=2 s", "output.impacts=statistics", "output.series=7 ms")


@pytest.mark.slow
@pytest.mark.parametrize(
    "deck, sets",
    [
        pytest.param(LONG, [*PRECISE, "run.sample_from=50 ms"], id="precision", marks=pytest.mark.thorough),
        pytest.param(LONG.replace("sample_from = 50 ms\n", ""), [*PRECISE], id="start-up-found"),
        pytest.param(LONG, ["run.max_collisions=20001"], id="all-recorded-and-max-collisions"),
        pytest.param(
            INPUT / "mixer.ini",  # turned so that it is long along x, with more and smaller balls
            [
                "run.time=70 ms",
                "run.sample_from=30 ms",
                "body.jar.axis=1 0 0",
                "balls.count=300",
                "balls.diameter=2.5 mm",
            ],
            id="moving-container",
        ),
        pytest.param(INPUT / "simoloyer.ini", ["run.time=20 ms", "run.sample_from=5 ms"], id="reference-mill"),
    ],
)
def test_a_run_on_two_threads_stores_the_same_bits(deck, sets, tmp_path):
    one, first = run(tmp_path, 1, *sets, deck=deck)
    two, second = run(tmp_path, 2, *sets, deck=deck)
    assert differences(one, two, CHOICE) == []
    assert (first["run"]["threads"], second["run"]["threads"]) == (1, 2)
    assert first["run"].get("ended_by") == second["run"].get("ended_by")
    asked = next((word for word in ("precision", "max_collisions") if any(word in order for order in sets)), None)
    assert first["run"].get("ended_by") == asked


@pytest.mark.slow
def test_more_threads_store_the_same_bits(tmp_path):
    one, _ = run(tmp_path, 1, "run.time=60 ms", deck=LONGER)
    for threads in (3, 1000):
        more, summary = run(tmp_path, threads, "run.time=60 ms", deck=LONGER)
        assert differences(one, more, CHOICE) == []
        assert summary["run"]["threads"] == 3


def test_a_mill_that_is_too_short_takes_one_thread(tmp_path):
    _, summary = run(tmp_path, 4, "run.time=60 ms", deck=SHORT)
    assert summary["run"]["threads"] == 1


def test_a_small_mill_takes_one_thread_and_the_file_does_not_say_what_was_not_asked(tmp_path):
    _, summary = run(tmp_path, 0, "run.time=60 ms")
    assert summary["run"]["threads"] == 1
    with h5py.File(tmp_path / "0.h5") as file:
        assert file["run/threads"][()] == 1
        assert "threads" not in file["deck/run"] and b"threads" not in file["deck/text"][()]


@pytest.mark.slow
def test_a_stopped_run_goes_on_with_another_number_of_threads(whole, tmp_path):
    mill = Folder(tmp_path, LONG)
    for leg, threads in enumerate((2, 1)):
        code, _ = mill.stop("-q", "-s", f"run.threads={threads}", *["--resume"][:leg])
        assert code == 128 + signal.SIGINT and status(mill.file)[0] == "stopped"
    mill.finish("--resume", "-s", "run.threads=2")
    assert differences(whole, mill.file, CHOICE) == []


@pytest.mark.slow
def test_a_signal_ends_a_run_on_two_threads(tmp_path):
    mill = Folder(tmp_path, LONG.replace("time = 0.45 s", "time = 1000 s").replace("impacts = all\n", ""))
    code, said = mill.stop("-q", "-s", "run.threads=2", number=signal.SIGTERM, after=0.1)
    assert code == 128 + signal.SIGTERM and "stopped by signal 15" in said
    assert status(mill.file)[0] == "stopped"


@pytest.mark.slow
@pytest.mark.skipif(not PLAIN, reason="sanitizers must be loaded first")
def test_where_no_thread_can_be_started_one_does_all_and_the_summary_says_so(tmp_path):
    (tmp_path / "none.c").write_text(NO_THREAD)
    library = tmp_path / "none.so"
    subprocess.run(["cc", "-shared", "-fPIC", tmp_path / "none.c", "-o", library], check=True)
    bare, summary = run(tmp_path, 2, "run.time=60 ms", environment={"LD_PRELOAD": str(library)})
    two, _ = run(tmp_path, 2, "run.time=60 ms")
    assert differences(two, bare, CHOICE) == []
    assert summary["run"]["threads"] == 1


@pytest.mark.slow
@pytest.mark.skipif(not PLAIN, reason="sanitizers must be loaded first")
@pytest.mark.parametrize("at", some([30, 60, 120], 3))
def test_a_full_disk_ends_a_run_on_two_threads_with_one_line_and_loses_nothing(at, whole, tmp_path):
    shim = tmp_path / "faults.so"
    source = pathlib.Path(__file__).parent / "faults.c"
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", source, "-ldl", "-o", shim], check=True)
    mill = Folder(tmp_path, LONG)
    fault = {"FAULT_CALL": "write", "FAULT_AT": str(at), "FAULT_ERROR": "28", "FAULT_MARK": str(tmp_path / "struck")}
    command = [PROGRAM, "-q", "-s", "run.threads=2", "mill.ini"]
    done = subprocess.run(command, cwd=tmp_path, env={**os.environ, "LD_PRELOAD": str(shim), **fault},
                          capture_output=True, text=True)  # fmt: skip
    assert (tmp_path / "struck").exists()
    assert done.returncode == 1 and one_line(done.stderr, "No space left on device"), done.stderr
    mill.finish("--resume", "-s", "run.threads=2")
    assert differences(whole, mill.file, CHOICE) == []


def test_a_wrong_number_of_threads_is_told_in_one_line(tmp_path):
    (tmp_path / "mill.ini").write_text(SHORT)
    for wrong, said in (("-1", "must be between 0 and 1024"), ("all", "expected a whole number")):
        command = [PROGRAM, "-s", f"run.threads={wrong}", "mill.ini"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert f"[run] threads: {said}" in done.stderr and list(tmp_path.iterdir()) == [tmp_path / "mill.ini"]
