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


def run(folder, *arguments, **fault):
    (folder / "mill.ini").write_text(DECK)
    environment = {**os.environ, **fault}
    command = [PROGRAM, "--quiet", *arguments, "mill.ini"]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


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
