"""mill export writes the frames of a run as GSD, VTP and PVD: other programs read the numbers that h5py reads."""

# ruff: noqa: F811 - the fixtures of export_run
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as xml

import h5py
import numpy as np
import pytest
from export_run import BALLS, FRAMES, INTERVAL, export, names, run_file, stored  # noqa: F401

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
        return {of.GetArrayName(k): vtk_to_numpy(of.GetArray(k)).copy() for k in range(of.GetNumberOfArrays())}

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


@pytest.mark.parametrize("mask, mode", [(0o022, 0o100644), (0o007, 0o100660)])
def test_a_file_may_be_read_by_whom_the_umask_allows(export, run_file, tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        assert export(run_file, "balls.gsd")[0] == 0
    finally:
        os.umask(before)
    assert (tmp_path / "balls.gsd").stat().st_mode == mode


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


@pytest.mark.slow
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


@pytest.mark.slow
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


def test_a_ball_is_marked_while_its_relief_lasts(export, run_file, tmp_path):
    pinched = shutil.copy(run_file, tmp_path / "pinched.h5")
    with h5py.File(pinched, "r+") as file:
        times = file[f"{TRAJECTORY}/position/time"][:]
        file["reliefs/ball"] = [3, 5, 7]
        file["reliefs/time"], file["reliefs/until"] = times[[2, 6, 7]], [times[7], np.inf, times[8]]
    assert export(pinched, "balls.vtp", "--frame", 7)[::2] == (0, "")
    assert np.flatnonzero(read_vtp(tmp_path / "balls.vtp")[1]["relief"]).tolist() == [5, 7]


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


@pytest.mark.slow
def test_both_has_balls_and_bodies_of_every_frame(export, run_file, tmp_path):
    status, out, _ = export(run_file, "mill.pvd", "--what", "both", "--every", 4)
    assert status == 0 and out.startswith("mill.pvd: 3 frames of 23 balls, drum, walls, shaft, blades, ")
    assert export(run_file, "balls.pvd", "--every", 4)[0] == 0
    assert export(run_file, "bodies.pvd", "--what", "mill", "--every", 4)[0] == 0
    assert export(run_file, "mill.pvd", "--what", "both", "--every", 4)[0] == 0  # over the old one
    sets = xml.parse(tmp_path / "mill.pvd").getroot().find("Collection").findall("DataSet")
    assert [one.get("part") for one in sets] == ["0", "1"] * 3
    found = members(tmp_path / "mill.pvd")
    alone = zip(members(tmp_path / "balls.pvd"), members(tmp_path / "bodies.pvd"), strict=True)
    for (time, name), (when, other) in zip(found, (one for pair in alone for one in pair), strict=True):
        assert time == when and (tmp_path / name).read_bytes() == (tmp_path / other).read_bytes()


def test_a_name_is_escaped_in_a_collection(export, run_file, tmp_path):
    assert export(run_file, 'a<b>&".pvd', "--frame", 0)[0] == 0
    assert members(tmp_path / 'a<b>&".pvd') == [(0.0, 'a<b>&"/a<b>&"_0000.vtp')]


def test_a_collection_replaces_an_old_one_and_nothing_else(export, run_file, tmp_path):
    assert export(run_file, "balls.pvd")[0] == 0
    assert export(run_file, "balls.pvd", "--every", 5)[0] == 0
    assert [name for _, name in members(tmp_path / "balls.pvd")] == [f"balls/balls_{k:04}.vtp" for k in (0, 5, 10)]
    assert len(names(tmp_path / "balls")) == 3
    (tmp_path / "balls" / "notes.txt").write_text("mine")
    before = names(tmp_path)
    status, _, err = export(run_file, "balls.pvd")
    assert status == 2 and err == (
        "mill export: balls: exists and holds 'notes.txt', which no export wrote; choose another name\n"
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


def test_no_ball_is_in_a_blade_of_its_frame(export, run_file, stored, tmp_path):
    """Bodies and balls are of one frame of reference, and the rotor turns the way the balls say."""
    vtk = pytest.importorskip("vtk")
    assert export(run_file, "mill.pvd", "--what", "mill", "--part", "blades")[0] == 0
    radius = stored[f"{TRAJECTORY}/diameter"][:] / 2
    nearest = []
    for index, (_, name) in enumerate(members(tmp_path / "mill.pvd")):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / name))
        reader.Update()
        distance = vtk.vtkImplicitPolyDataDistance()
        distance.SetInput(reader.GetOutput())
        centres = frame(stored, index, "position")
        gaps = [distance.EvaluateFunction(centre) for centre in centres.astype(float)]
        nearest.append((np.array(gaps) - radius).min())
    assert min(nearest) > -1e-7
