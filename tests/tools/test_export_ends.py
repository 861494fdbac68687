"""mill export: which frames, what cannot be, files that are whole or not there, and runs larger than memory."""

# ruff: noqa: F811 - the fixtures of export_run
import os
import re
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest
from conftest import slow
from export_run import FRAMES, INTERVAL, export, names, run_file  # noqa: F401

from milltools.read.runfile import Run

gsd = pytest.importorskip("gsd.hoomd")

TRAJECTORY = "particles/trajectory"

# ---- which frames


@pytest.mark.parametrize(
    "words, steps",
    [
        (["--from", "20 ms"], [4, 5, 6, 7, 8, 9, 10]),
        (["--to", "0.015"], [0, 1, 2, 3]),
        (["--from", "0.01 s", "--to", "40000 us", "--every", "3"], [2, 5, 8]),
        (["--every", "100"], [0]),
        (["--frame", "3"], [3]),
        (["--frame", "-2"], [9]),
        (["--time", "16 ms"], [3]),
        (["--time", "0.05"], [10]),
        (["--time", "5 ns"], [0]),
        (["--from", "45e6 ns"], [9, 10]),
    ],
)
def test_frames_are_chosen(export, run_file, tmp_path, words, steps):
    status, out, _ = export(run_file, "balls.gsd", *words)
    assert status == 0
    assert f": {len(steps)} frame{'s' * (len(steps) > 1)} of 23 balls" in out
    with gsd.open(tmp_path / "balls.gsd") as file:
        assert [found.configuration.step for found in file] == steps


HAS = "frames 0 to 10, from 0 to 0.05 s"


@pytest.mark.parametrize(
    "words, line",
    [
        (["a.xyz"], "a.xyz: expected a name ending in .stl, .gsd, .vtp, .pvd, .csv, .xlsx"),
        (["a"], "a: expected a name ending in .stl, .gsd, .vtp, .pvd, .csv, .xlsx"),
        (["a.gsd", "--frame", "11"], f"--frame 11: RUN has {HAS}"),
        (["a.gsd", "--frame", "-12"], f"--frame -12: RUN has {HAS}"),
        (["a.vtp", "--time", "1 s"], f"--time 1 s: RUN has {HAS}"),
        (["a.vtp", "--time", "1 mm"], "--time: expected a time such as '120 ms', got '1 mm'"),
        (["a.vtp", "--time", "-1 ms"], "--time: must be 0 or more, got '-1 ms'"),
        (["a.pvd", "--from", "1 s"], "--from, --to: no frame in this span; RUN has 11 frames, 0 to 0.05 s"),
        (["a.pvd", "--from", "40 ms", "--to", "30 ms"], "--from 40 ms: is after --to 30 ms"),
        (["a.gsd", "--every", "0"], "--every: expected 1 or more, got 0"),
        (["a.gsd", "--every", "2.5"], "argument --every: invalid int value: '2.5'"),
        (["a.gsd", "--frame", "1", "--time", "1 ms"], "--time: either --frame or --time"),
        (["a.gsd", "--frame", "1", "--every", "2"], "--every: either one state (--frame, --time) or many"),
        (["a.vtp", "--every", "2"], "--every: .vtp files contain one moment: use --time, --frame or .pvd"),
        (["a.stl", "--to", "2 s"], "--to: .stl files contain one moment: use --time, --frame or .pvd"),
        (["a.gsd", "--part", "drum"], "--part: only for the mill's bodies (.stl, or --what mill)"),
        (["a.gsd", "--what", "mill"], "a .gsd file cannot contain mill: write .stl or .vtp or .pvd"),
        (["a.stl", "--what", "balls"], "a .stl file cannot contain balls: write .gsd or .vtp or .pvd or .csv or .xlsx"),
        (["a.gsd", "-s", "run.time=1 s"], "RUN: --set: a finished run cannot be changed; give its deck"),
        (["no/a.gsd"], "no/a.gsd: No such file or directory"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line_and_nothing_is_written(export, run_file, tmp_path, words, line):
    status, out, err = export(run_file, *words)
    assert status == (1 if "No such" in line else 2) and out == ""
    assert err.startswith(f"mill export: {line}".replace("RUN", str(run_file))), err
    assert len(err.splitlines()) == 1
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    "content, line",
    [
        (b"PAR1\x15\x04\x15", "a file: a table of a study, not a run or a deck; this shows it: mill study 'a file'"),
        (b"\x93NUMPY\x01\x00", "a file: neither the output file of a run (HDF5) nor a deck (text)"),
        (b"[run]\n", "a file: expected the output file of a run, got a deck; this runs it: ./millsim 'a file'"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.pvd", "a.csv"])
def test_a_source_that_is_no_run_is_told(export, tmp_path, content, line, target):
    (tmp_path / "a file").write_bytes(content)
    assert export("a file", target) == (2, "", f"mill export: {line}\n")
    assert names(tmp_path) == ["a file"]


@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.pvd", "a.csv"])
def test_a_run_without_frames_is_told(export, millsim, small_deck, tmp_path, target):
    words = ("-q", "-s", "run.time=1 ms", "-s", "output.frames=0 s")
    assert millsim("deck.ini", *words).returncode == 0
    line = "deck.h5: no ball states are stored (output.frames = 0 s)"
    assert export("deck.h5", target) == (2, "", f"mill export: {line}\n")
    assert names(tmp_path) == ["deck.h5", "deck.ini"]


# ---- whole or not at all


@pytest.mark.parametrize("target", ["a.gsd", "a.pvd", "a.csv", "a.xlsx"])
@pytest.mark.parametrize("fault, status", [(KeyboardInterrupt, 130), (OSError(28, "No space left on device"), 1)])
def test_an_export_that_ends_early_leaves_what_was_there(
    export, run_file, tmp_path, monkeypatch, target, fault, status
):  # fmt: skip
    what = ("--what", "balls") if target == "a.xlsx" else ()
    assert export(run_file, target, "--frame", 0, *what)[0] == 0
    before = {n: (tmp_path / n).read_bytes() for n in names(tmp_path) if (tmp_path / n).is_file()}
    whole = Run.frame

    def fails(self, index, name="velocity"):
        if index == 5:
            raise fault
        return whole(self, index, name)

    monkeypatch.setattr(Run, "frame", fails)
    said = export(run_file, target, *what)
    assert said[:2] == (status, "")
    assert len(said[2].splitlines()) == 1
    after = {n: (tmp_path / n).read_bytes() for n in names(tmp_path) if (tmp_path / n).is_file()}
    assert after == before


FULL = """
import resource, sys
from milltools.__main__ import main
resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))
sys.argv = ["mill", "export", *sys.argv[1:]]
sys.exit(main())
"""


@pytest.mark.unmeasured
@pytest.mark.parametrize("target", slow(["a.gsd", "a.vtp", "a.csv", "a.xlsx"], "a.csv", "a.xlsx"))
@pytest.mark.slow
def test_a_file_that_cannot_grow_is_one_line(run_file, tmp_path, root, target):
    words = [sys.executable, "-c", FULL, str(run_file), target]
    environment = {**os.environ, "PYTHONPATH": str(root / "tools")}
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert (done.returncode, done.stdout) == (1, "")
    # on a busy machine lines of progress may go before it
    assert done.stderr.splitlines()[-1] == f"mill export: {target}: File too large"
    assert names(tmp_path) == []


@pytest.mark.parametrize("target", slow(["a.gsd", "a.vtp", "a.csv", "a.xlsx"], "a.xlsx"))
def test_the_same_run_gives_the_same_file(export, run_file, tmp_path, target):
    contents = []
    for _ in range(2):
        assert export(run_file, target)[0] == 0
        contents.append((tmp_path / target).read_bytes())
    assert contents[0] == contents[1]
    assert str(tmp_path).encode() not in contents[0]


# ---- long ones


def test_a_long_export_says_how_far_it_is(export, run_file, monkeypatch):
    from milltools.base import progress

    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress, "PLAIN", 0.0)
    status, _, err = export(run_file, "a.gsd", progress=True)
    assert status == 0
    lines = err.splitlines()
    assert all(re.fullmatch(r"mill export: a\.gsd, \d+ %(, \d+ s left)?", line) for line in lines)
    assert len(lines) == FRAMES


PEAK = """
import resource, sys
from milltools.__main__ import main
sys.argv = ["mill", "export", *sys.argv[1:]]
status = main()
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
sys.exit(status)
"""


@pytest.fixture(scope="module")
def long_run(run_file, tmp_path_factory):
    """The run with its frames said again, 52 MB of them."""
    path = tmp_path_factory.mktemp("long") / "long.h5"
    shutil.copy(run_file, path)
    many, balls = 180, 8000
    with h5py.File(path, "r+") as file:
        del file["observables/pose"]
        group = file[TRAJECTORY]
        for name in ("id", "species", "mass", "diameter"):
            attributes, values = dict(group[name].attrs), group[name][:]
            del group[name]
            group[name] = np.resize(values, balls)
            group[name].attrs.update(attributes)
        for name in ("step", "time"):
            for kind in ("position", "velocity", "angular_velocity"):
                del group[f"{kind}/{name}"]
                group[f"{kind}/{name}"] = np.arange(many) * (1 if name == "step" else INTERVAL)
        for kind in ("position", "velocity", "angular_velocity"):
            block = np.resize(group[f"{kind}/value"][-1], (balls, 3))
            del group[f"{kind}/value"]
            shape, chunks = (many, balls, 3), (1, balls, 3)
            grown = group.create_dataset(f"{kind}/value", shape, "f4", chunks=chunks)
            for index in range(many):
                grown[index] = block
    assert path.stat().st_size > 50e6
    return path


@pytest.mark.thorough
@pytest.mark.parametrize("target", ["a.gsd", "a.pvd", "a.csv"])
def test_memory_does_not_grow_with_the_frames(long_run, tmp_path, root, target):
    """Half of the frames and all of them: if they were kept, the peak would grow by their numbers."""
    # Arrow's own pools keep what is free
    environment = {**os.environ, "PYTHONPATH": str(root / "tools"), "ARROW_DEFAULT_MEMORY_POOL": "system"}

    def peak(every):
        words = [sys.executable, "-c", PEAK, str(long_run), target, "--every", str(every)]
        done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert done.returncode == 0, done.stderr
        return int(done.stdout.splitlines()[-1])

    assert peak(1) - peak(2) < 0.25 * 90 * 8000 * 9 * 4
