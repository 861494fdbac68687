"""/VTKHDF: the frames as VTK's own reader sees them, and what that costs. docs/file-format.md names all of it."""

import os
import shutil
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, slow
from results import assert_same, status

from milltools.geometry import contour
from milltools.read.runfile import Run

TRAJECTORY = "/particles/trajectory"
STATES = {"Points": "position", "PointData/velocity": "velocity",
          "PointData/angular_velocity": "angular_velocity"}  # fmt: skip
SPEED, ANGLE = 900 * 2 * np.pi / 60, np.deg2rad(25)  # of the rotor

DECK = """\
[run]
time = 60 ms
[balls.steel]
count = 60
diameter = 6 mm
density = 7800 kg/m^3
[balls.glass]
count = 30
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = 40 mm
length = 50 mm
[rotor]
speed = 900 rpm
angle = 25 deg
shaft_radius = 8 mm
[blades]
count = 3
tip_radius = 30 mm
width = 8 mm
thickness = 4 mm
pitch = 30 deg
[contact]
restitution = 0.8
friction = 0.3
[output]
frames = 4 ms
"""
WAVY = ("drum.profile=wavy", "drum.buckles=7", "drum.buckle_height=3 mm", "drum.buckle_angle=11 deg")  # fmt: skip


def run(folder, *orders, deck=DECK, name="mill.h5"):
    """The output file of the deck with these settings."""
    (folder / "mill.ini").write_text(deck)
    sets = [word for order in orders for word in ("-s", order)]
    subprocess.run(
        [PROGRAM, "-q", "-f", "-o", name, *sets, "mill.ini"],
        cwd=folder, check=True, timeout=120, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    return folder / name


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return run(tmp_path_factory.mktemp("vtkhdf"))


@pytest.fixture()
def mill(path):
    with h5py.File(path) as file:
        yield file


def corners(block):
    """Points (F, P, 3) of a block, as its steps find them."""
    count, offsets = block["NumberOfPoints"][0], block["Steps/PointOffsets"][:]
    points = block["Points"][:]
    return np.stack([points[offset : offset + count] for offset in offsets])


def turned(points, angle):
    """Points (P, 3), turned about the x axis."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def bodies(path):
    with h5py.File(path) as file:
        return {name: corners(block) for name, block in file["VTKHDF"].items() if name in ("drum", "rotor")}


# ---- what is in the file ----


def test_the_balls_are_shown_to_the_bit_and_not_stored_again(mill):
    for name, state in STATES.items():
        shown, stored = mill[f"VTKHDF/balls/{name}"], mill[f"{TRAJECTORY}/{state}/value"]
        assert shown.is_virtual and shown.id.get_storage_size() == 0
        assert shown.dtype == stored.dtype and shown.shape == (16 * 90, 3)
        assert shown[:].tobytes() == stored[:].tobytes()
        assert shown.attrs["unit"] == stored.attrs["unit"]


@pytest.mark.parametrize("name", ["diameter", "id", "mass", "species"])
def test_what_balls_keep_is_another_name_of_the_same_dataset(mill, name):
    assert mill[f"VTKHDF/balls/PointData/{name}"] == mill[f"{TRAJECTORY}/{name}"]


@pytest.mark.parametrize("block", ["balls", "drum", "rotor"])
def test_every_block_has_the_times_of_the_frames(mill, block):
    steps = mill[f"VTKHDF/{block}/Steps"]
    assert steps["Values"] == mill[f"{TRAJECTORY}/position/time"]
    assert steps.attrs["NSteps"] == 16
    for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
        assert steps[name].shape == (16,), name
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        assert steps[name].shape == (16, 4), name


def test_the_round_drum_has_its_radius_and_length(path):
    drum = bodies(path)["drum"]
    assert (drum == drum[0]).all()
    x, y, z = drum[0].T
    away = np.hypot(y, z)
    middle = away < 1e-3  # of the end walls
    assert middle.sum() == 2
    np.testing.assert_allclose(away[~middle], 0.04, atol=4e-9)
    assert set(x) == {np.float32(-0.025), np.float32(0.025)}


def test_the_wavy_drum_lies_on_its_profile(tmp_path):
    drum = bodies(run(tmp_path, *WAVY, "run.time=4 ms"))["drum"][0].astype(float)
    with Run(tmp_path / "mill.h5") as opened:
        profile = contour.of(opened.as_deck)
    away = np.hypot(*drum.T[1:])
    with h5py.File(tmp_path / "mill.h5") as file:
        block = file["VTKHDF/drum"]
        triangles = block["Polygons/Connectivity"][:].reshape(-1, 3)
        wall = np.unique(triangles[block["CellData/kind"][:] == 1])
    assert np.abs(profile.gap(drum[wall][:, 1:])).max() < 1e-8
    assert profile.gap(drum[:, 1:]).min() > -1e-8  # the end walls are within
    assert away.max() == pytest.approx(0.043, abs=1e-8)
    assert away[wall].min() == pytest.approx(0.037, abs=1e-8)


def test_the_rotor_turns_by_the_angle_of_the_deck(mill):
    points = corners(mill["VTKHDF/rotor"])
    times = mill[f"{TRAJECTORY}/position/time"][:]
    at_rest = turned(points[0], -ANGLE)
    for k, when in enumerate(times):
        np.testing.assert_allclose(points[k], turned(at_rest, ANGLE + SPEED * when), atol=1e-8)
    assert np.abs(points[1] - points[0]).max() > 0.005


def test_shaft_and_blades_are_where_the_deck_has_them(mill):
    block = mill["VTKHDF/rotor"]
    points = turned(corners(block)[0].astype(float), -ANGLE)
    triangles = block["Polygons/Connectivity"][:].reshape(-1, 3)
    kind, number = block["CellData/kind"][:], block["CellData/number"][:]
    names = block["CellData/kind"].attrs["kinds"]
    assert set(names[kind]) == {"ball_shaft", "ball_blade"}
    shaft = points[np.unique(triangles[names[kind] == "ball_shaft"])]
    assert np.hypot(*shaft.T[1:]).max() == pytest.approx(0.008, abs=1e-8)
    assert abs(shaft[:, 0]).max() == pytest.approx(0.025, abs=1e-8)
    for k in range(3):  # at x = -L/2 + (k + 1/2) L/3, pointing at k 120 deg
        own = points[np.unique(triangles[number == k])]
        own = turned(own - [(k - 1) * 0.05 / 3, 0, 0], -k * 2 * np.pi / 3)
        assert len(own) == 8
        cosine, sine = np.cos(np.pi / 6), np.sin(np.pi / 6)
        along = cosine * own[:, 0] + sine * own[:, 2]
        across = cosine * own[:, 2] - sine * own[:, 0]
        np.testing.assert_allclose(np.sort(own[:, 1]), [0] * 4 + [0.03] * 4, atol=1e-8)
        np.testing.assert_allclose(np.abs(along), 0.004, atol=1e-8)
        np.testing.assert_allclose(np.abs(across), 0.002, atol=1e-8)


def test_a_rotor_that_stands_is_stored_once(tmp_path):
    rotor = run(tmp_path, "rotor.speed=0 rpm")
    with h5py.File(rotor) as file:
        block = file["VTKHDF/rotor"]
        assert len(block["Points"]) == block["NumberOfPoints"][0]
        points = corners(block)[0]
    other = bodies(run(tmp_path, "rotor.speed=10 rpm", name="other.h5"))["rotor"]
    assert (points == other[0]).all()


def test_a_mill_without_a_rotor_has_none(tmp_path):
    deck = DECK[: DECK.index("[rotor]")] + DECK[DECK.index("[contact]") :]
    with h5py.File(run(tmp_path, "run.time=4 ms", deck=deck)) as file:
        assert set(file["VTKHDF"]) == {"Assembly", "balls", "drum", "wear"}
        assert set(file["VTKHDF/Assembly"]) == {"balls", "drum", "wear"}


def test_without_frames_there_is_no_group(tmp_path):
    with h5py.File(run(tmp_path, "output.frames=0 s")) as file:
        assert "VTKHDF" not in file


def test_only_the_rotors_corners_take_room(mill):
    """What the group adds to a file: a hundredth of the frames of a large mill."""
    stored = {}
    mill["VTKHDF"].visititems(
        lambda name, item: (
            stored.update({name: item.id.get_storage_size()})
            if isinstance(item, h5py.Dataset) and name.split("/")[-1] not in mill[TRAJECTORY] and "wear" not in name
            else None
        )
    )
    assert stored.pop("rotor/Points") < 16 * mill["VTKHDF/rotor/NumberOfPoints"][0] * 12
    stored.pop("balls/Steps/Values", None)  # the frames' own
    assert sum(stored.values()) < 32000


# ---- interrupted runs ----


@pytest.fixture
def interrupted(tmp_path):
    """interrupted(signal, *options): a run of 10 s, sent the signal after a checkpoint of its own."""
    (tmp_path / "mill.ini").write_text(DECK)
    file = tmp_path / "mill.h5"

    def interrupt(number, *options):
        before = file.stat().st_ino if file.exists() else None
        process = subprocess.Popen(
            [PROGRAM, "-q", "-s", "run.time=10 s", "-s", "output.checkpoint=20 ms", *options, "mill.ini"],
            cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for _ in range(3000):
            if file.exists() and file.stat().st_ino != before and status(file)[1] > 0:
                break
            time.sleep(0.01)
        process.send_signal(number)
        process.wait(timeout=60)
        return file

    return interrupt


@pytest.mark.slow
def test_a_stopped_run_shows_its_frames_also_to_vtk(interrupted, vtk_step):
    path = interrupted(signal.SIGTERM)
    assert_vtk_reads(vtk_step, path)
    with h5py.File(path) as file:
        position = file[f"{TRAJECTORY}/position/value"]
        points = file["VTKHDF/balls/Points"]
        assert points.shape == (len(position) * 90, 3) and len(position) > 1
        assert points[:].tobytes() == position[:].tobytes()
        assert len(corners(file["VTKHDF/rotor"])) == len(position)


@pytest.mark.slow
def test_a_run_that_goes_on_has_none_until_it_ends(interrupted):
    with h5py.File(interrupted(signal.SIGKILL)) as file:
        assert "VTKHDF" not in file
    with h5py.File(interrupted(signal.SIGINT, "--resume")) as file:
        assert "VTKHDF" in file
    with h5py.File(interrupted(signal.SIGKILL, "--resume")) as file:
        assert file["run/status"].asstr()[()] == "running"
        assert "VTKHDF" not in file


@pytest.mark.slow
def test_a_resumed_run_ends_with_the_same(tmp_path):
    whole = run(tmp_path, "run.time=0.4 s", name="whole.h5")
    process = subprocess.Popen([PROGRAM, "-q", "-s", "run.time=0.4 s", "-o", "parts.h5", "mill.ini"], cwd=tmp_path)
    while not (tmp_path / "parts.h5").exists():
        time.sleep(0.001)
    process.send_signal(signal.SIGINT)
    process.wait(timeout=60)
    parts = tmp_path / "parts.h5"
    if process.returncode != 0:  # else it was too fast to be stopped
        with h5py.File(parts) as file:
            assert len(file["VTKHDF/balls/Steps/Values"]) < 101
        subprocess.run(
            [PROGRAM, "-q", "--resume", "-s", "run.time=0.4 s", "-o", "parts.h5", "mill.ini"],
            cwd=tmp_path, check=True, stdout=subprocess.DEVNULL,
        )  # fmt: skip
    assert_same(parts, whole)


# ---- VTK's own reader ----


@pytest.fixture(scope="module")
def vtk_step():
    """vtk_step(path, time) gives {block: vtkPolyData} of a step, as VTK reads it."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    readers = {}

    def read(path, when):
        reader = readers.get(path)
        if not reader:
            reader = readers[path] = hdf.vtkHDFReader()
            reader.SetFileName(str(path))
            assert reader.CanReadFile(str(path))
        reader.UpdateTimeStep(when)
        collection = reader.GetOutputDataObject(0)
        assert collection.GetClassName() == "vtkPartitionedDataSetCollection"
        assembly = collection.GetDataAssembly()
        found = {}
        for node in range(1, assembly.GetNumberOfChildren(0) + 1):
            (index,) = assembly.GetDataSetIndices(node)
            found[assembly.GetNodeName(node)] = collection.GetPartitionedDataSet(index).GetPartition(0)  # fmt: skip
        return found

    return read


def numpy_of(array):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(array)


def assert_vtk_reads(vtk_step, path):
    """Every step as h5py has it, to the last bit of the stored type."""
    with h5py.File(path) as file:
        balls = file[TRAJECTORY]
        for k, when in enumerate(balls["position/time"][:]):
            blocks = vtk_step(path, when)
            data = blocks["balls"].GetPointData()
            seen = {"position": blocks["balls"].GetPoints().GetData(),
                    "velocity": data.GetArray("velocity"),
                    "angular_velocity": data.GetArray("angular_velocity")}  # fmt: skip
            for name, array in seen.items():
                assert numpy_of(array).dtype == np.float32
                assert numpy_of(array).tobytes() == balls[f"{name}/value"][k].tobytes(), (k, name)
            for name in ("diameter", "id", "mass", "species"):
                assert numpy_of(data.GetArray(name)).tobytes() == balls[name][:].tobytes(), name
            if "rotor" in blocks:
                rotor = numpy_of(blocks["rotor"].GetPoints().GetData())
                assert rotor.tobytes() == corners(file["VTKHDF/rotor"])[k].tobytes()
    return blocks


def test_vtk_reads_every_state_of_every_ball_to_the_bit(vtk_step, path):
    blocks = assert_vtk_reads(vtk_step, path)
    assert set(blocks) == {"balls", "drum", "rotor", "wear"}
    assert blocks["balls"].GetNumberOfVerts() == blocks["balls"].GetNumberOfCells() == 90


def test_vtk_sees_the_times_of_the_frames(path, mill):
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    reader = hdf.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    about = reader.GetOutputInformation(0)
    steps = [about.Get(Pipeline.TIME_STEPS(), k) for k in range(about.Length(Pipeline.TIME_STEPS()))]
    assert steps == list(mill[f"{TRAJECTORY}/position/time"])


def test_vtk_sees_bodies_of_triangles_with_their_kinds(vtk_step, path):
    blocks = vtk_step(path, 0.004)
    kinds = {name: set(numpy_of(blocks[name].GetCellData().GetArray("kind"))) for name in ("drum", "rotor")}
    assert kinds == {"drum": {1, 2}, "rotor": {3, 4}}
    for name, reach in (("drum", 0.04), ("rotor", 0.03)):
        body = blocks[name]
        assert body.GetNumberOfPolys() == body.GetNumberOfCells() > 20
        assert body.GetMaxCellSize() == 3
        x0, x1, y0, y1, z0, z1 = body.GetBounds()
        assert (x0, x1) == pytest.approx((-0.025, 0.025))
        assert 0.9 * reach < max(-y0, y1, -z0, z1) < 1.02 * reach


@pytest.mark.parametrize(
    "orders",
    [WAVY, ("rotor.speed=0 rpm",), ("rotor.speed=-700 rpm", "output.frames=3 ms"), ("run.time=2 ms",)],
    ids=["wavy", "standing", "backwards", "one frame"],
)  # fmt: skip
def test_vtk_reads_other_mills_too(vtk_step, tmp_path, orders):
    assert_vtk_reads(vtk_step, run(tmp_path, *orders))


def test_vtk_reads_a_mill_without_a_rotor(vtk_step, tmp_path):
    deck = DECK[: DECK.index("[rotor]")] + DECK[DECK.index("[contact]") :]
    blocks = assert_vtk_reads(vtk_step, run(tmp_path, deck=deck))
    assert set(blocks) == {"balls", "drum", "wear"}


def test_the_file_may_be_moved_renamed_linked_and_read_only(vtk_step, path, tmp_path, monkeypatch):
    folder = tmp_path / "else where"
    folder.mkdir()
    monkeypatch.chdir(tmp_path)
    copy = folder / "renamed.hdf"
    shutil.copy(path, copy)
    copy.chmod(0o444)
    assert_vtk_reads(vtk_step, os.path.relpath(copy))
    (folder / "run.vtkhdf").symlink_to("renamed.hdf")
    assert_vtk_reads(vtk_step, "else where/run.vtkhdf")


def test_a_repacked_file_still_shows_its_frames(vtk_step, path, tmp_path):
    if not shutil.which("h5repack"):
        pytest.skip("no h5repack (Debian: hdf5-tools)")
    repacked = tmp_path / "repacked.h5"
    subprocess.run(["h5repack", path, repacked], check=True)
    with h5py.File(repacked) as file:
        assert all(file[f"VTKHDF/balls/{name}"].is_virtual for name in STATES)
    assert_vtk_reads(vtk_step, repacked)


@pytest.mark.thorough
def test_thousands_of_frames_are_read_fast(vtk_step, tmp_path):
    many = run(tmp_path, "run.time=200 ms", "output.frames=0.1 ms")
    with h5py.File(many) as file:
        times = file[f"{TRAJECTORY}/position/time"][:]
    assert len(times) == 2001
    before = time.process_time()
    for when in times[::10]:
        vtk_step(many, when)
    took = time.process_time() - before
    assert took / 201 < 0.05, f"{1e3 * took / 201:.1f} ms a step"


# ---- very many frames ----


@pytest.mark.slow
def test_a_signal_that_comes_while_very_many_frames_are_added_leaves_complete_results(tmp_path):
    few = ("balls.steel.count=2", "balls.glass.count=1", "run.time=5 ms", "output.frames=0.2 us")
    whole = run(tmp_path, *few, name="whole.h5")
    file = tmp_path / "mill.h5"
    command = [PROGRAM, *(word for order in few for word in ("-s", order)), "mill.ini"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not (file.exists() and status(file)[0] == "complete"):
        time.sleep(0.002)
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=30)[1]
    assert process.returncode == 143
    assert "mill.h5 holds all results but not the frames for ParaView (/VTKHDF), which --resume adds" in said
    with h5py.File(file) as mill:
        assert "VTKHDF" not in mill and mill["run/status"].asstr()[()] == "complete"
        assert len(mill[f"{TRAJECTORY}/position/value"]) == 25001
    done = subprocess.run([*command, "--resume", "-q"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert_same(file, whole)
    with h5py.File(file) as mill:
        assert "VTKHDF" in mill and "checkpoint" not in mill


# round ends and small faces: facets smaller than triangles
@pytest.mark.parametrize("deck", slow(["mixer.ini", "stl.ini"], "stl.ini"))
def test_every_facet_has_a_triangle_in_pictures(tmp_path, deck):
    short = ["run.sample_from=0 s", "run.time=1 ms", "output.frames=0 s"]
    orders = [word for order in short for word in ("-s", order)]
    subprocess.run([PROGRAM, "-q", "-o", tmp_path / "mill.h5", *orders, ROOT / "input" / deck], check=True)
    with h5py.File(tmp_path / "mill.h5") as file:
        wear = file["statistics/wear"]
        assert set(wear["mesh/facet"][()]) == set(range(len(wear["area"])))
