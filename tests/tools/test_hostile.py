"""Files from strangers: whatever is wrong with an output file, a command says it in one line, soon, in bounded memory,
and writes and reads nothing else. tests/tools/hostile.py crafts the files and tries all of them;
tests/fuzz/fuzz_reader.py mutates others."""

# ruff: noqa: F811 - the fixtures of export_run
import fcntl
import os
import re
import shutil
import subprocess
import sys
import zlib

import h5py
import hostile
import numpy as np
import pytest
from conftest import ROOT
from export_run import run_file  # noqa: F401

from milltools.base.errors import InputError, MissingFileError, UserError
from milltools.read.deck_text import read_text
from milltools.read.hdf5 import Store
from milltools.read.runfile import Run, kind_of
from milltools.render.encode import probe
from milltools.study.plan.table import Table

FILES = 400  # all that is crafted


@pytest.mark.render
@pytest.mark.parametrize("pairs", [4, pytest.param(60, marks=pytest.mark.thorough)])
def test_commands_end_well_or_in_one_line(the_program, pairs):
    """In a process of its own: what forks must have no threads, and those that ran other tests may."""
    words = [sys.executable, ROOT / "tests/tools/hostile.py", str(FILES), "5"]
    done = subprocess.run(
        words, env=os.environ | {"PAIRS": str(pairs)}, capture_output=True, text=True, timeout=280, check=False
    )
    said = done.stdout.splitlines()
    tried = re.fullmatch(r"\d+ files, (\d+) commands, 0 ended as they must not", said[-1])
    assert tried and int(tried[1]) >= pairs, done.stdout + done.stderr


@pytest.mark.slow
def test_the_fuzzer_replays_its_corpus():
    corpus = sorted((ROOT / "tests/fuzz/corpus/reader").iterdir())
    assert corpus
    done = subprocess.run(
        [sys.executable, ROOT / "tests/fuzz/fuzz_reader.py", *corpus], capture_output=True, text=True, timeout=300
    )
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture
def copy(run_file, tmp_path):
    """copy(change) is the run, changed by change(h5py.File)."""

    def make(change):
        path = tmp_path / "mill.h5"
        shutil.copyfile(run_file, path)
        with h5py.File(path, "r+") as file:
            change(file)
        return path

    return make


def refused(path, what):
    """The one line about reading something of a run."""
    with pytest.raises(UserError) as fault, Run(path) as run:
        run.read(what)
    assert fault.value.status == 2
    return str(fault.value).removeprefix(f"{path}: ")


VERSION = "run/version"
EDGES = "statistics/maps/axial/x_edges"


@pytest.mark.parametrize(
    ("way", "path", "said"),
    [
        ("elsewhere", VERSION, "its values are stored outside the dataset, perhaps in another file, which is not read"),
        ("virtual", EDGES, "its values are stored outside the dataset, perhaps in another file, which is not read"),
        ("external", VERSION, "a link into another file, which is not followed"),
        ("soft-loop", VERSION, "its links form a circle"),
        ("reference", VERSION, "values of a type that runs do not use (object)"),
        ("huge", EDGES, "bytes by its shape, but the file, of"),
        ("piece", EDGES, "unpacks to more bytes"),
        ("bomb", "observables/kinetic_energy/time", "bytes, compressed into"),
        ("nan", EDGES, "values that do not ascend"),
        ("longer", "statistics/maps/axial/dissipation", "41 rows, expected 40 to match /statistics/maps/axial/x_edges"),
        ("text", EDGES, "expected numbers, got"),
        ("2^62", "particles/trajectory/diameter", "larger than the balls or the drum of the deck"),
        ("2^62", "particles/trajectory/species", "an index that is too large: there are 2"),
        ("2^62", "impacts/ball", "an index that is too large: there are 23"),
        ("2^62", "impacts/partner", "an index that is too large: there are 23"),
        ("2^62", "statistics/wear/parts/kind", "an index that is too large: there are 5"),
        ("2^62", "statistics/wear/parts/motion", "an index that is too large: there are 1"),
        ("2^62", "statistics/wear/part", "an index that is too large: there are 6"),
        ("2^62", "statistics/wear/face", "an index that is too large: there are 6"),
        ("2^62", "statistics/wear/cells", "an index that is too large: there are 2804"),
        ("2^62", "statistics/wear/mesh/facet", "an index that is too large: there are 2804"),
        ("1e9", "statistics/wear/parts/axes", "not a rotation matrix"),
        ("shorter", "statistics/wear/mesh/points", "69599 rows, expected 69600 to match /statistics/wear/mesh/facet"),
        ("shorter", "statistics/energies/ball_ball/normal", "1 rows, expected 2 to match the deck"),
        ("none", "statistics/energies/edges", "values that do not ascend, or fewer than two bins"),
        ("flat", "particles/trajectory/position/value", "expected 3 dimensions, got 1"),
    ],
)
def test_the_reader_says_what_is_damaged(copy, way, path, said):
    file = copy(lambda file: hostile.WAYS[way](file, path))
    (file.parent / "secret.txt").write_text(hostile.SECRET)
    line = refused(file, path)
    assert line.startswith(f"damaged: /{path}: ") and said in line


@pytest.mark.slow
def test_a_run_is_read_where_the_file_system_has_no_locks(run_file, tmp_path):
    (tmp_path / "no.c").write_text("#include <errno.h>\nint flock(int f, int how) { errno = ENOLCK; return -1; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", "no.so", "no.c"], cwd=tmp_path, check=True)
    code = f"from milltools.read.runfile import Run; print([Run({str(run_file)!r}) for _ in '12'][1].status)"
    environment = os.environ | {"LD_PRELOAD": str(tmp_path / "no.so"), "PYTHONPATH": str(ROOT / "tools")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("complete\n", "")


def test_a_file_that_another_program_has_locked_is_said_to_be_so(run_file, tmp_path):
    shutil.copyfile(run_file, path := tmp_path / "mill.h5")
    with open(path) as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(UserError, match=r"mill.h5: another program is writing in it; try again when it has ended$"):
            Run(path)


def test_a_run_has_balls(run_file, tmp_path):
    path = tmp_path / "mill.h5"
    shutil.copyfile(run_file, path)
    hostile.no_balls(path)
    for what in ("particles/trajectory/mass", "particles/trajectory/position/value"):
        assert "no balls" in refused(path, what)


def test_a_pose_is_a_rotation(copy):
    path = copy(lambda file: hostile.WAYS["zero"](file, "observables/pose/rotor/rotation/value"))
    with (
        Run(path) as run,
        pytest.raises(UserError, match="damaged: /observables/pose/rotor/rotation/value: not a rotation matrix"),
    ):
        run.poses(0)


def test_a_link_through_another_file_is_not_followed(copy, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = hostile.SECRET

    def change(file):
        del file[VERSION]
        file["away"] = h5py.ExternalLink("other.h5", "/")
        file[VERSION] = h5py.SoftLink("/away/x")

    assert refused(copy(change), VERSION) == f"damaged: /{VERSION}: a link into another file, which is not followed"


def test_texts_and_numbers_of_other_writers_are_read(copy):
    """Texts of fixed length, padded with blanks or zeros, and arrays of one value in place of scalars."""

    def change(file):
        hostile.put(file, VERSION, np.bytes_(b"v1"))
        hostile.put(file, "run/status", np.array([b"complete"]))
        hostile.put(file, "run/time", np.array([0.05], "<f4"))
        hostile.put(file, "deck/drum/radius", np.bytes_(b"0.03 m"))
        for name in ("position/value", "velocity/value"):
            hostile.put(
                file,
                f"particles/trajectory/{name}",
                file[f"particles/trajectory/{name}"][:].astype(">f8"),
                compression="lzf",
            )
        kind = file["particles/trajectory/species"]
        del kind.attrs["names"], kind.attrs["unit"]
        kind.attrs["names"], kind.attrs["unit"] = np.array([b"steel", b"glass"]), np.bytes_(b"1")

    with Run(copy(change)) as run:
        assert (run.version, run.status, run.species_names()) == ("v1", "complete", ["steel", "glass"])
        assert run.time == pytest.approx(0.05) and run.quantity("drum/radius") == 0.03
        assert run.frame(0, "position").shape == (23, 3)
        assert run.attribute("particles/trajectory/species", "unit", "") == "1"


def test_a_heap_with_an_object_of_no_size_is_refused(run_file, tmp_path):
    """HDF5 2.0 goes round in it for ever."""
    content = bytearray(run_file.read_bytes())
    heap = content.index(b"GCOL\1\0\0\0")
    content[heap + 16 : heap + 32] = bytes(16)
    (tmp_path / "mill.h5").write_bytes(content)
    with pytest.raises(UserError, match="damaged: .*the heap of texts at byte"):
        Store(tmp_path / "mill.h5")


def test_hard_links_in_a_circle_end(copy):
    def change(file):
        file["observables/loop"] = file["observables"]
        file["statistics/impacts/ball_ball/up"] = file["statistics"]

    with Run(copy(change)) as run:
        assert "kinetic_energy" in run.series_names()
        assert len(run.datasets("statistics")) < 2000


@pytest.mark.parametrize("read", [Run, read_text, Table.open, probe])
def test_a_fifo_does_not_make_it_wait(tmp_path, read):
    os.mkfifo(tmp_path / "fifo")
    with pytest.raises(InputError, match="is not an ordinary file"):
        read(tmp_path / "fifo")


@pytest.mark.parametrize("read", [Run, read_text, Table.open, probe])
def test_a_folder_and_a_missing_file_are_told_in_one_way(tmp_path, read):
    with pytest.raises(InputError, match="is a folder, not "):
        read(tmp_path)
    with pytest.raises(MissingFileError, match="missing: no such file"):
        read(tmp_path / "missing")


def test_a_fifo_is_neither_a_run_nor_read(tmp_path):
    """Its kind is left to millsim, which reads a pipe that has a writer: nothing may be taken out of it before."""
    os.mkfifo(tmp_path / "fifo")
    assert kind_of(tmp_path / "fifo") == "deck"


def test_memory_is_bounded_by_what_a_file_can_hold(copy):
    """A few megabytes that unpack to 2 GB."""
    path = copy(lambda file: hostile.bomb(file, "impacts/dissipation"))
    assert path.stat().st_size < 8e6
    assert "compressed into" in refused(path, "impacts/dissipation") or "rows" in refused(path, "impacts/dissipation")


@pytest.mark.skipif(h5py.version.hdf5_version_tuple < (2,), reason="the seeds are of HDF5 2")
def test_the_corpus_is_of_runs(tmp_path):
    for seed in sorted((ROOT / "tests/fuzz/corpus/reader").iterdir()):
        (tmp_path / "seed.h5").write_bytes(zlib.decompress(seed.read_bytes()))
        if not seed.name.startswith("find-"):
            with Run(tmp_path / "seed.h5") as run:
                assert run.status == "complete" and len(run.series_names()) > 5
