"""mill export writes the frames of a run as GSD, VTP and PVD: other programs read the numbers that h5py reads."""

# ruff: noqa: F811 - the fixtures of export_run
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as xml

import numpy as np
import pytest
from export_run import BALLS, FRAMES, INTERVAL, export, names, run_file, stored  # noqa: F401

from milltools.runfile import Run

gsd = pytest.importorskip("gsd.hoomd")

TRAJECTORY = "particles/trajectory"


def frame(stored, index, name):
    return stored[f"{TRAJECTORY}/{name}/value"][index]


def same(a, b):
    """The same numbers, to the last bit, of the same type."""
    a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def read_vtp(path):
    """(points, {name: point data}, {name: field}, polygons (M, 3), {name: cell data}) as VTK's own reader has them."""
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()

    def arrays(of):
        return {
            of.GetArrayName(k): vtk_to_numpy(of.GetArray(k)).copy()
            for k in range(of.GetNumberOfArrays())
        }

    assert data.GetNumberOfVerts() in (0, data.GetNumberOfPoints())
    polygons = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3).copy()
    points = vtk_to_numpy(data.GetPoints().GetData()).copy()
    fields = (data.GetPointData(), data.GetFieldData(), data.GetCellData())
    return points, arrays(fields[0]), arrays(fields[1]), polygons, arrays(fields[2])


# ---- GSD


@pytest.fixture
def trajectory(export, run_file, tmp_path):
    status, out, err = export(run_file, "balls.gsd")
    size = (tmp_path / "balls.gsd").stat().st_size
    assert (status, err) == (0, "")
    assert out == f"balls.gsd: 11 frames of 23 balls, {size / 1000:.3g} kB\n"
    with gsd.open(tmp_path / "balls.gsd") as file:
        yield file


def test_gsd_has_the_moving_numbers_of_every_frame_to_the_last_bit(trajectory, stored):
    assert len(trajectory) == FRAMES
    for index, found in enumerate(trajectory):
        assert same(found.particles.position, frame(stored, index, "position"))
        assert same(found.particles.velocity, frame(stored, index, "velocity"))
        spin = found.log["particles/angular_velocity"]
        assert same(spin, frame(stored, index, "angular_velocity"))
        assert found.configuration.step == stored[f"{TRAJECTORY}/position/step"][index]
        assert found.log["time"][0] == stored[f"{TRAJECTORY}/position/time"][index]
    assert np.abs(frame(stored, -1, "angular_velocity")).max() > 1


def test_gsd_has_kinds_by_name_and_sizes_in_single_precision(trajectory, stored):
    balls = stored[TRAJECTORY]
    for found in (trajectory[0], trajectory[FRAMES - 1]):
        kinds = np.array(found.particles.types)[found.particles.typeid]
        assert list(kinds) == list(balls["species"].attrs["names"][balls["species"][:]])
        assert set(kinds) == {"steel", "glass"}
        assert same(found.particles.diameter, balls["diameter"][:].astype("f4"))
        assert same(found.particles.mass, balls["mass"][:].astype("f4"))


def test_no_ball_has_neighbours_across_the_periodic_box_of_gsd(trajectory):
    widest, least = 0.005, 0.0031
    for found in trajectory:
        box = found.configuration.box
        assert list(box[3:]) == [0, 0, 0]
        reach = np.ptp(found.particles.position, axis=0)
        # from centre to centre, should two of the least touch opposite walls
        assert (box[:3] - reach >= (2 * widest + least) * (1 - 1e-6)).all()


def test_others_may_read_a_gsd_file_if_they_may_read_new_files(export, run_file, tmp_path):
    (tmp_path / "plain").touch()
    assert export(run_file, "balls.gsd")[0] == 0
    assert (tmp_path / "balls.gsd").stat().st_mode == (tmp_path / "plain").stat().st_mode


OVITO = """
import sys
import numpy
from ovito.io import import_file
found = {}
for name in ("balls.gsd", "balls.vtp", "balls.pvd"):
    pipeline = import_file(name)
    found[f"{name} frames"] = pipeline.source.num_frames
    for k in range(pipeline.source.num_frames):
        data = pipeline.compute(k)
        for key, values in data.particles.items():
            found[f"{name} {k} {key}"] = values[...]
        found[f"{name} {k} time"] = data.attributes.get("time", numpy.nan)
        kinds = data.particles.particle_types
        found[f"{name} kinds"] = [kinds.type_by_id(i).name for i in kinds[...]]
numpy.savez("ovito.npz", **found)
"""


@pytest.fixture(scope="module")
def ovito():
    """Why the package ovito cannot be imported here, or ""; it is kept out of this process, for it brings Qt along."""
    words = [sys.executable, "-c", "import ovito.io"]
    done = subprocess.run(words, capture_output=True, text=True)
    return done.stderr.strip().splitlines()[-1] if done.returncode else ""


def test_ovito_reads_the_numbers_of_h5py(export, run_file, stored, tmp_path, ovito):
    if ovito:
        pytest.skip(f"ovito: {ovito}")
    assert export(run_file, "balls.gsd")[0] == 0
    assert export(run_file, "balls.vtp", "--frame", 4)[0] == 0
    assert export(run_file, "balls.pvd")[0] == 0
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    words = [sys.executable, "-c", OVITO]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert done.returncode == 0, done.stderr
    found = np.load(tmp_path / "ovito.npz")
    assert [int(found[f"balls.{s} frames"]) for s in ("gsd", "vtp", "pvd")] == [FRAMES, 1, FRAMES]
    radius = stored[f"{TRAJECTORY}/diameter"][:] / 2
    for k in range(FRAMES):
        for name, velocity in (("balls.gsd", "Velocity"), ("balls.pvd", "velocity")):
            # OVITO keeps float64: all of single precision fits into it
            assert (found[f"{name} {k} Position"] == frame(stored, k, "position")).all()
            assert (found[f"{name} {k} {velocity}"] == frame(stored, k, "velocity")).all()
            spin = found[f"{name} {k} angular_velocity"]
            assert (spin == frame(stored, k, "angular_velocity")).all()
            assert same(found[f"{name} {k} Radius"], radius.astype("f4"))
        assert found[f"balls.gsd {k} time"] == stored[f"{TRAJECTORY}/position/time"][k]
    assert (found["balls.vtp 0 Position"] == frame(stored, 4, "position")).all()
    assert list(found["balls.gsd kinds"]) == ["steel"] * 16 + ["glass"] * 7


# ---- VTP, PVD


def test_vtk_reads_one_frame_to_the_last_bit(export, run_file, stored, tmp_path):
    status, out, err = export(run_file, "balls.vtp", "--frame", 7)
    assert (status, err) == (0, "")
    assert re.fullmatch(r"balls.vtp: frame 7 of 0 to 10, 0.035 s, 23 balls, [\d.]+ kB\n", out)
    points, data, fields, polygons, _ = read_vtp(tmp_path / "balls.vtp")
    assert same(points, frame(stored, 7, "position"))
    for name in ("velocity", "angular_velocity"):
        assert same(data[name], frame(stored, 7, name))
    for name in ("id", "species", "diameter", "mass"):
        assert same(data[name], stored[f"{TRAJECTORY}/{name}"][:])
    assert same(data["radius"], stored[f"{TRAJECTORY}/diameter"][:] / 2)
    assert same(fields["TimeValue"], stored[f"{TRAJECTORY}/position/time"][7:8])
    assert len(polygons) == 0


def test_without_a_choice_vtp_is_the_last_frame(export, run_file, stored, tmp_path):
    assert export(run_file, "balls.vtp")[1].startswith("balls.vtp: frame 10 of 0 to 10, 0.05 s")
    assert same(read_vtp(tmp_path / "balls.vtp")[0], frame(stored, -1, "position"))


def members(path):
    """[(time, file)] of a .pvd file."""
    sets = xml.parse(path).getroot().find("Collection").findall("DataSet")
    return [(float(one.get("timestep")), one.get("file")) for one in sets]


def test_a_collection_has_every_frame_at_its_time(export, run_file, stored, tmp_path):
    status, out, err = export(run_file, "balls.pvd")
    assert (status, err) == (0, "")
    assert re.fullmatch(r"balls.pvd: 11 frames of 23 balls, [\d.]+ kB in balls/\n", out)
    found = members(tmp_path / "balls.pvd")
    assert [time for time, _ in found] == list(stored[f"{TRAJECTORY}/position/time"])
    for index, (time, name) in enumerate(found):
        assert name == f"balls/balls_{index:04}.vtp"
        points, data, fields, _, _ = read_vtp(tmp_path / name)
        assert same(points, frame(stored, index, "position"))
        assert same(data["velocity"], frame(stored, index, "velocity"))
        assert fields["TimeValue"][0] == time
    assert names(tmp_path) == sorted(["balls", "balls.pvd", *(name for _, name in found)])


def test_a_name_is_escaped_in_a_collection(export, run_file, tmp_path):
    assert export(run_file, 'a<b>&".pvd', "--frame", 0)[0] == 0
    assert members(tmp_path / 'a<b>&".pvd') == [(0.0, 'a<b>&"/a<b>&"_0000.vtp')]


def test_a_collection_replaces_an_old_one_and_nothing_else(export, run_file, tmp_path):
    assert export(run_file, "balls.pvd")[0] == 0
    assert export(run_file, "balls.pvd", "--every", 5)[0] == 0
    assert [name for _, name in members(tmp_path / "balls.pvd")] == [
        f"balls/balls_{k:04}.vtp" for k in (0, 5, 10)
    ]
    assert len(names(tmp_path / "balls")) == 3
    (tmp_path / "balls" / "notes.txt").write_text("mine")
    before = names(tmp_path)
    status, _, err = export(run_file, "balls.pvd")
    assert status == 2 and err == (
        "mill export: balls: is in the way, with 'notes.txt' that is not of an export; choose another name\n"
    )
    assert names(tmp_path) == before


def test_the_rotor_of_a_collection_turns_and_the_drum_does_not(export, run_file, tmp_path):
    status, out, _ = export(run_file, "mill.pvd", "--what", "mill", "--to", "10 ms")
    assert status == 0 and out.startswith("mill.pvd: 3 frames of drum, walls, shaft, blades, ")
    meshes = [read_vtp(tmp_path / name) for _, name in members(tmp_path / "mill.pvd")]
    start, _, _, polygons, cells = meshes[0]
    blades = np.unique(polygons[cells["part"] == 3])
    drum = np.unique(polygons[cells["part"] == 0])
    assert len(blades) == 2 * 8
    for k, (points, _, _, own, _) in enumerate(meshes):
        assert same(own, polygons) and same(points[drum], start[drum])
        angle = 600 * 2 * np.pi / 60 * k * INTERVAL
        x, y, z = start[blades].T
        turned = [x, y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)]
        assert points[blades].T == pytest.approx(np.array(turned), abs=1e-8)


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
        (["a.xyz"], "a.xyz: expected a name ending in .stl, .gsd, .vtp, .pvd, .csv"),
        (["a"], "a: expected a name ending in .stl, .gsd, .vtp, .pvd, .csv"),
        (["a.gsd", "--frame", "11"], f"--frame 11: RUN has {HAS}"),
        (["a.gsd", "--frame", "-12"], f"--frame -12: RUN has {HAS}"),
        (["a.vtp", "--time", "1 s"], f"--time 1 s: RUN has {HAS}"),
        (["a.vtp", "--time", "1 mm"], "--time: expected a time such as '100 ms', got '1 mm'"),
        (["a.vtp", "--time", "-1 ms"], "--time: expected a time such as '100 ms', got '-1 ms'"),
        (["a.pvd", "--from", "1 s"], "--from, --to: no frame in there; RUN has 11, from 0 to 0.05 s"),
        (["a.pvd", "--from", "40 ms", "--to", "30 ms"], "--from 40 ms: is after --to 30 ms"),
        (["a.gsd", "--every", "0"], "--every: expected 1 or more, got 0"),
        (["a.gsd", "--every", "2.5"], "argument --every: invalid int value: '2.5'"),
        (["a.gsd", "--frame", "1", "--time", "1 ms"], "--time: either --frame or --time"),
        (["a.gsd", "--frame", "1", "--every", "2"], "--every: either one state (--frame, --time) or many"),
        (["a.vtp", "--every", "2"], "--every: .vtp holds one moment: --time or --frame; .pvd all"),
        (["a.stl", "--to", "2 s"], "--to: .stl holds one moment: --time or --frame; .pvd all"),
        (["a.gsd", "--part", "drum"], "--part: only for the mill's bodies (.stl, or --what mill)"),
        (["a.gsd", "--what", "mill"], "--what mill: not in .gsd, but in .stl or .vtp or .pvd"),
        (["a.stl", "--what", "balls"], "--what balls: not in .stl, but in .gsd or .vtp or .pvd or .csv"),
        (["a.gsd", "-s", "run.time=1 s"], "RUN: --set: what has been run cannot be changed; give its deck"),
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
        (b"PAR1\x15\x04\x15", "a.file: a table of a study, not a run or a deck; 'mill study a.file' shows it"),
        (b"\x93NUMPY\x01\x00", "a.file: neither the output file of a run (HDF5) nor a deck (text)"),
        (b"[run]\n", "a.file: expected the output file of a run, got a deck: it has no results before it is run ('millsim a.file')"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.pvd", "a.csv"])
def test_a_source_that_is_no_run_is_told(export, tmp_path, content, line, target):
    (tmp_path / "a.file").write_bytes(content)
    assert export("a.file", target) == (2, "", f"mill export: {line}\n")
    assert names(tmp_path) == ["a.file"]


def test_a_table_of_a_study_is_no_mill_either(export, tmp_path):
    (tmp_path / "my.parquet").write_bytes(b"PAR1\0\0\0")
    line = "my.parquet: a table of a study, not a run or a deck; 'mill study my.parquet' shows it\n"
    assert export("my.parquet", "a.stl") == (2, "", f"mill export: {line}")


@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.pvd", "a.csv"])
def test_a_run_without_frames_is_told(export, millsim, small_deck, tmp_path, target):
    words = ("-q", "-s", "run.time=1 ms", "-s", "output.frames=0 s")
    assert millsim("deck.ini", *words).returncode == 0
    line = "deck.h5: no ball states are stored (output.frames = 0 s)"
    assert export("deck.h5", target) == (2, "", f"mill export: {line}\n")
    assert names(tmp_path) == ["deck.h5", "deck.ini"]


# ---- whole or not at all


@pytest.mark.parametrize("target", ["a.gsd", "a.pvd", "a.csv"])
@pytest.mark.parametrize("fault, status", [(KeyboardInterrupt, 130), (OSError(28, "No space left on device"), 1)])  # fmt: skip
def test_an_export_that_ends_early_leaves_what_was_there(
    export, run_file, tmp_path, monkeypatch, target, fault, status
):  # fmt: skip
    assert export(run_file, target, "--frame", 0)[0] == 0
    before = {n: (tmp_path / n).read_bytes() for n in names(tmp_path) if (tmp_path / n).is_file()}
    whole = Run.frame

    def fails(self, index, name="velocity"):
        if index == 5:
            raise fault
        return whole(self, index, name)

    monkeypatch.setattr(Run, "frame", fails)
    said = export(run_file, target)
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


@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.csv"])
def test_a_file_that_cannot_grow_is_one_line(run_file, tmp_path, root, target):
    words = [sys.executable, "-c", FULL, str(run_file), target]
    environment = {**os.environ, "PYTHONPATH": str(root / "tools")}
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert (done.returncode, done.stdout) == (1, "")
    # on a busy machine lines of progress may go before it
    assert done.stderr.splitlines()[-1] == f"mill export: {target}: File too large"
    assert names(tmp_path) == []


@pytest.mark.parametrize("target", ["a.gsd", "a.vtp", "a.csv"])
def test_the_same_run_gives_the_same_file(export, run_file, tmp_path, target):
    contents = []
    for _ in range(2):
        assert export(run_file, target)[0] == 0
        contents.append((tmp_path / target).read_bytes())
    assert contents[0] == contents[1]
    assert str(tmp_path).encode() not in contents[0]


# ---- long ones


def test_a_long_export_says_how_far_it_is(export, run_file, monkeypatch):
    from milltools.export import whole

    monkeypatch.setattr(whole, "PATIENCE", 0.0)
    monkeypatch.setattr(whole, "PLAIN", 0.0)
    status, _, err = export(run_file, "a.gsd")
    assert status == 0
    lines = err.splitlines()
    assert all(re.fullmatch(r"mill export: a\.gsd: \d+ %, \d+ s left", line) for line in lines)
    assert len(lines) == FRAMES - 1


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
    import shutil

    import h5py

    path = tmp_path_factory.mktemp("long") / "long.h5"
    shutil.copy(run_file, path)
    many, balls = 180, 8000
    with h5py.File(path, "r+") as file:
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


@pytest.mark.parametrize("target", ["a.gsd", "a.pvd", "a.csv"])
def test_memory_does_not_grow_with_the_frames(long_run, tmp_path, root, target):
    environment = {**os.environ, "PYTHONPATH": str(root / "tools")}

    def peak(*words):
        words = [sys.executable, "-c", PEAK, str(long_run), target, *words]
        done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment)
        assert done.returncode == 0, done.stderr
        return int(done.stdout.splitlines()[-1])

    one, many = peak("--frame", "0"), peak("--every", "2" if target == "a.csv" else "1")
    assert many - one < 20e6
