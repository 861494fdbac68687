"""Whatever call to the system fails, or wherever the program is killed: --resume ends in the same bits."""

import errno
import os
import pathlib
import subprocess

import pytest
from conftest import PROGRAM, some
from results import differences, status

HERE = pathlib.Path(__file__).resolve().parent
# A run of a few milliseconds in which everything is recorded and a checkpoint follows each slice of events
DECK = """\
[run]
time = 20 ms
sample_from = 5 ms
[balls]
count = 150
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 40 mm
length = 40 mm
[rotor]
speed = 1000 rpm
shaft_radius = 8 mm
[blades]
count = 2
tip_radius = 33 mm
width = 8 mm
thickness = 5 mm
[contact]
restitution = 0.8
friction = 0.3
[output]
frames = 2 ms
impacts = all
checkpoint = 1 ms
"""
ERRORS = {"full": errno.ENOSPC, "killed": 0}
MOST = 400  # calls of one sort that a run makes, at most
BUILT_PLAIN = b"__asan_init" not in PROGRAM.read_bytes()

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not BUILT_PLAIN, reason="sanitizers must be loaded first")]


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    library = tmp_path_factory.mktemp("faults") / "faults.so"
    command = ["cc", "-shared", "-fPIC", "-O1", HERE / "faults.c", "-ldl", "-o", library]
    subprocess.run(command, check=True)
    return library


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The file of an undisturbed run."""
    folder = tmp_path_factory.mktemp("whole")
    assert run(folder).returncode == 0
    return folder / "mill.h5"


@pytest.fixture(scope="module")
def own_code():
    """The addresses of the code of millsim itself, which the program has in one piece, apart from HDF5."""
    words = [line.split() for line in subprocess.check_output(["nm", PROGRAM], text=True).splitlines()]
    found = [
        int(at, 16) for at, kind, name in (row for row in words if len(row) == 3) if kind in "tT" and "mill_" in name
    ]
    return {"FAULT_FROM": hex(min(found)), "FAULT_TO": hex(max(found) + 4096)}


def run(folder, *arguments, **fault):
    (folder / "mill.ini").write_text(DECK)
    environment = {**os.environ, **fault}
    command = [PROGRAM, "--quiet", *arguments, "mill.ini"]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize(
    "call, error",
    some(
        [
            ("write", "full"),
            ("sync", "full"),
            ("write", "killed"),
            ("rename", "full"),
            ("rename", "killed"),
            ("open", "killed"),
            ("open", "full"),
            ("truncate", "full"),
            ("truncate", "killed"),
            ("sync", "killed"),
        ],
        3,
    ),
)
@pytest.mark.parametrize("step", [12, pytest.param(0, marks=pytest.mark.thorough)], ids=["some", "every"])
def test_a_fault_at_any_call_loses_nothing(call, error, step, shim, whole, tmp_path):
    at = 1
    while at < MOST:
        folder = tmp_path / str(at)
        folder.mkdir()
        mark = tmp_path / f"struck-{at}"
        fault = {"FAULT_CALL": call, "FAULT_AT": str(at), "FAULT_ERROR": str(ERRORS[error])}
        ended = run(folder, LD_PRELOAD=str(shim), FAULT_MARK=str(mark), **fault)
        where = f"{call} {at}: {ended.stderr}"
        if not mark.exists():
            break  # there are no more such calls
        assert ended.returncode == (-9 if error == "killed" else 1 if ended.stderr else 0), where
        if error == "full":
            assert ended.stderr.count("\n") <= 1, where
            assert not list(folder.glob("mill.h5.*")), where
        resumed = run(folder, "--resume")
        assert resumed.returncode == 0, where + resumed.stderr
        assert status(folder / "mill.h5")[0] == "complete", where
        assert not differences(whole, folder / "mill.h5"), where
        assert not list(folder.glob("mill.h5.*")), where
        at += 1 + step * (at // 4)  # every call at first, then ever fewer: later ones repeat earlier ones
    assert at > 1, "no such call was made"


@pytest.mark.parametrize("step", [17, pytest.param(1, marks=pytest.mark.thorough)], ids=["some", "every"])
def test_without_memory_for_a_result_the_run_fails_and_the_old_file_stays(step, shim, own_code, whole, tmp_path):
    orders = ["-f", "-s", "output.checkpoint=1 h", "-s", "output.frames=10 ms", "-s", "balls.count=60"]
    assert run(tmp_path, *orders).returncode == 0
    file, mark = tmp_path / "mill.h5", tmp_path / "struck"
    new, old, said = tmp_path / "new.h5", whole.read_bytes(), set()
    file.rename(new)
    for at in range(3, 5000, step):
        file.write_bytes(old)
        mark.unlink(missing_ok=True)
        fault = {"FAULT_CALL": "memory", "FAULT_AT": str(at), "FAULT_ERROR": str(errno.ENOMEM), "FAULT_MARK": str(mark)}
        ended = run(tmp_path, *orders, LD_PRELOAD=str(shim), **fault, **own_code)
        if not mark.exists():
            break
        where = f"memory {at}: {ended.stderr}"
        assert ended.returncode == (1 if ended.stderr else 0), where
        if file.read_bytes() == old:
            assert ended.stderr.count("\n") == 1 and "memory" in ended.stderr, where
        else:  # it had been published: only the summary was missing
            assert not differences(new, file), where
        said.add(ended.stderr)
    assert at > 500 and any("memory for the results" in line for line in said)
