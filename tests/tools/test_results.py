"""Results of another program in millsim's schema: millsim's own runs, fed through milltools, give millsim's own file."""

import foreign
import h5py
import numpy as np
import pytest
from foreign import DECKS, RUN

from milltools.read.kinds import KINDS


@pytest.fixture(scope="module", params=DECKS, ids=lambda name: name.replace(",", ""))
def pair(request, tmp_path_factory):
    """(file by Results, millsim's own file) of the same run."""
    folder = tmp_path_factory.mktemp("results")
    deck, path = foreign.simulate(folder, DECKS[request.param])
    with h5py.File(path) as theirs:
        results = foreign.start(deck, theirs)
        foreign.feed(results, theirs, foreign.random_batches(len(theirs["impacts/time"]), 1))
        results.write(folder / "ours.h5", RUN)
        with h5py.File(folder / "ours.h5") as ours:
            yield ours, theirs


def tree(file):
    """Everything in the file but /run, energies and pinches, which others do not have (and what millsim's views show again), by name."""
    found = {}
    file.visititems(lambda name, item: found.update({name: item}))
    # visititems names what is linked once only
    for name in list(found):
        if name.startswith("observables/") and name.endswith("/value"):
            for shared in ("step", "time"):
                path = name.removesuffix("value") + shared
                found[path] = file[path]
    for group in ("impacts", "strikes"):
        for row in file[f"statistics/{group}"]:
            for speed in ("normal_speed", "tangential_speed"):
                path = f"statistics/{group}/{row}/{speed}/histogram/edges"
                found[path] = file[path]
    for state in ("velocity", "angular_velocity"):
        for shared in ("step", "time"):
            path = f"particles/trajectory/{state}/{shared}"
            found[path] = file[path]
    return {
        name: item
        for name, item in found.items()
        if name.split("/")[0] not in ("run", "VTKHDF", "h5md")
        and not name.startswith(("statistics/energies", "statistics/rotor/pinch_power", "statistics/drive/pinch_power"))
    }


def only_millsims(name):
    """Errors of medians and rates, which only millsim's batches tell."""
    parts = name.split("/")
    return parts[:2] == ["statistics", "precision"] and parts[2:3] not in ([], ["rotor_power"], ["rotor_torque"], ["drive_power"])  # fmt: skip


def test_names_types_shapes_and_labels_are_those_of_millsim(pair):
    ours, theirs = (tree(file) for file in pair)
    assert ours.keys() == {name for name in theirs if not only_millsims(name)}
    for name in ours:
        mine, other = ours[name], theirs[name]
        assert type(mine) is type(other), name
        attributes = {key: value for key, value in mine.attrs.items() if key != "part"}
        assert attributes.keys() == other.attrs.keys(), name
        for key, value in attributes.items():
            if key == "description" and ("precision/" in name or name.endswith("_error")):
                assert value != ""  # errors are made in another way
            elif isinstance(value, str):
                value = value.replace("the impact, its normal part", "the impact; negative where the rebound floor gave energy")  # fmt: skip
                assert value == other.attrs[key], (name, key)
            else:
                assert np.asarray(value).dtype == np.asarray(other.attrs[key]).dtype, (name, key)
                assert np.shape(value) == np.shape(other.attrs[key]), (name, key)
        if isinstance(mine, h5py.Dataset):
            layouts = [(d.dtype, d.shape, d.maxshape, d.chunks, d.compression, d.shuffle) for d in (mine, other)]  # fmt: skip
            assert layouts[0] == layouts[1], name


def same(mine, other):
    """Equal to the bit, NaN included."""
    if h5py.check_string_dtype(mine.dtype):
        return mine[()] == other[()]
    outside = ("underflow", "overflow", "levels", "thresholds")
    return mine[()].tobytes() == other[()].tobytes() and all(
        np.array_equal(mine.attrs[key], other.attrs[key]) for key in mine.attrs if key in outside
    )


def pressed(tree_or_file):
    """Were balls pinched? What their contacts lose is in the statistics, but in no row of the log."""
    return tree_or_file["statistics/rotor"]["pinch_power"][()] != 0


# all but what follows from single precision (maps), from the rows (power) or from a rebound floor
EXACT = ("deck/", "particles/", "observables/", "impacts/", "statistics/impacts/", "statistics/strikes/", "statistics/duration", "statistics/maps/samples")  # fmt: skip


def test_everything_that_can_be_is_the_same_to_the_bit(pair):
    ours, theirs = (tree(file) for file in pair)
    checked = 0
    for name in ours.keys() & theirs.keys():
        from_rows = name.startswith("statistics/impacts/") and name.endswith("dissipated_power")
        if isinstance(ours[name], h5py.Dataset) and name.startswith(EXACT) and not from_rows:
            if name.endswith(("dissipation", "dissipated_power")) and pressed(theirs):
                continue
            assert same(ours[name], theirs[name]), name
            checked += 1
    assert checked > (250 if pressed(theirs) else 300)


def test_there_are_enough_impacts_and_strikes_to_tell(pair):
    _, theirs = pair
    counts = [int(theirs[f"statistics/{family}/all/count"][()]) for family in ("impacts", "strikes")]
    assert counts[0] > 1500
    if "rotor" in theirs["deck"]:
        assert counts[1] < 0.95 * counts[0]
        assert all(theirs[f"statistics/impacts/{kind}/count"][()] > 20 for kind in KINDS)


def test_the_dissipated_power_is_that_of_the_series(pair):
    ours, theirs = pair
    for row in (*KINDS, "all"):
        name = f"statistics/impacts/{row}/dissipated_power"
        assert ours[name][()] == pytest.approx(theirs[name][()], rel=1e-9, abs=1e-12)


def test_the_rotors_power_torque_and_blocks_come_from_the_series(pair):
    ours, theirs = (file["statistics/rotor"] for file in pair)
    for name in theirs:
        if name.endswith("_error") or name == "pinch_power":  # of revolutions; millsim's is of batches
            continue
        scale = np.abs(theirs[f"block_{name.split('_')[0]}"][:]).max(initial=0) if name.startswith(("power", "torque")) else 0  # fmt: skip
        assert np.allclose(ours[name][()], theirs[name][()], rtol=1e-9, atol=1e-9 * scale, equal_nan=True), name  # fmt: skip


def test_fast_impacts_are_counted_at_every_row(pair):
    ours, theirs = pair
    log = {name: theirs["impacts"][name][:] for name in ("time", "kind", "normal_speed")}
    times = ours["observables/fast_collisions/ball_ball/time"][:]
    for number, kind in enumerate(KINDS):
        value = ours[f"observables/fast_collisions/{kind}/value"]
        assert value.attrs["thresholds"].tolist() == [0.5, 1, 2]
        for k, threshold in enumerate((0.5, 1, 2)):
            fast = (log["kind"] == number) & (log["normal_speed"] >= threshold)
            before = np.searchsorted(log["time"][fast], times, side="left")
            assert np.array_equal(value[:, k], before), (kind, threshold)


@pytest.mark.parametrize("name", ["cross_section", "axial"])
def test_the_maps_are_millsims_to_single_precision(pair, name):
    ours, theirs = (file[f"statistics/maps/{name}"] for file in pair)
    axes = [key for key in theirs if key.endswith("_edges")]
    assert all(np.array_equal(ours[key], theirs[key]) for key in axes)
    for key in ("impact_count", "normal_speed_sum", "dissipation"):
        if key == "dissipation" and pressed(pair[1]):
            continue
        mine, other = ours[key][:].astype(float), theirs[key][:].astype(float)
        assert np.abs(mine - other).sum() <= 1e-3 * np.abs(other).sum(), key  # at edges of cells
        assert mine.sum() == pytest.approx(other.sum(), rel=1e-12)
    solid = [group["solid_fraction"][:] for group in (ours, theirs)]
    assert np.array_equal(*np.isnan(solid))
    assert np.nansum(np.abs(solid[0] - solid[1])) <= 1e-4 * np.nansum(solid[1])
    full = solid[1] > np.nanmean(solid[1])
    assert full.mean() > 0.1
    for key in (key for key in theirs if key.startswith("velocity")):
        assert np.array_equal(np.isnan(ours[key][:]), np.isnan(theirs[key][:])), key
        off = np.abs(ours[key][:][full] - theirs[key][:][full])
        assert np.mean(off < 1e-5) > 0.98 and off.max() < 0.02, key


def test_the_rebound_floors_shares_are_unknown(pair):
    ours, _ = pair
    shares = ours["statistics/floor_share"]
    assert np.isnan([shares[row][()] for row in (*KINDS, "all")]).all()


def test_what_holds_only_the_normal_part_says_so(pair):
    ours, _ = pair
    marked = {name for name, item in tree(ours).items() if item.attrs.get("part") == "normal"}
    named = {
        name
        for name in tree(ours)
        if name == "impacts/dissipation"
        or (name.startswith("statistics/") and name.endswith("/dissipation"))
        or (name.startswith("statistics/strikes/") and name.endswith("/dissipated_power"))
    }
    assert marked == named and len(named) == 1 + 2 * 6 * 2 + 2 + 6


def test_the_run_says_who_made_it(pair):
    ours, theirs = (file["run"] for file in pair)
    for name, fact in RUN.items():
        value, unit, description = fact if isinstance(fact, tuple) else (fact, None, None)
        item = ours[name]
        held = item.asstr()[()] if h5py.check_string_dtype(item.dtype) else item[()]
        assert held == value
        assert unit is None or (item.attrs["unit"], item.attrs["description"]) == (unit, description)  # fmt: skip
        assert item.attrs["description"]
    assert (ours["status"].asstr()[()], ours["steps"].dtype) == ("complete", "<u8")
    assert ours["time"][()] == theirs["time"][()]
    for kind in KINDS:
        name = f"events/collisions/{kind}"
        assert ours[name][()] == theirs[name][()]


def test_mdanalysis_reads_it(pair):
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.coordinates.H5MD import H5MDReader

    H5MDReader._unit_translation["length"]["m"] = "m"
    balls = pair[0]["particles/trajectory"]
    universe = mda.Universe.empty(len(balls["id"]), velocities=True)
    universe.load_new(pair[0].filename, format="H5MD", convert_units=False)
    for k, frame in enumerate(universe.trajectory[:20]):
        assert frame.time == balls["position/time"][k]
        assert (frame.positions == balls["position/value"][k]).all()
        assert (frame.velocities == balls["velocity/value"][k]).all()


def test_pyh5md_reads_it(pair):
    pyh5md = pytest.importorskip("pyh5md")
    balls = pair[0]["particles/trajectory"]
    with pyh5md.File(pair[0].filename, "r") as file:
        position = pyh5md.element(file.particles_group("trajectory"), "position")
        assert (position.value[-1] == balls["position/value"][-1]).all()
        assert (position.step[:] == np.arange(len(position.step))).all()


# ---- /VTKHDF


def paths(group, prefix=""):
    """Everything below a group by every name it has, links not followed: {name: item or soft link}."""
    found = {}
    for name in group:
        link = group.get(name, getlink=True)
        found[prefix + name] = link if isinstance(link, h5py.SoftLink) else group[name]
        if isinstance(found[prefix + name], h5py.Group):
            found.update(paths(group[name], f"{prefix}{name}/"))
    return found


def test_the_frames_are_shown_to_vtk_as_millsim_shows_them(pair):
    ours, theirs = (paths(file["VTKHDF"]) for file in pair)
    assert ours.keys() == theirs.keys()
    for name, mine in ours.items():
        other = theirs[name]
        if isinstance(mine, h5py.SoftLink):
            assert mine.path == other.path
            continue
        assert mine.attrs.keys() == other.attrs.keys(), name
        for key, value in mine.attrs.items():
            assert np.array_equal(value, other.attrs[key]), (name, key)
            assert np.asarray(value).dtype == np.asarray(other.attrs[key]).dtype, (name, key)
        if isinstance(mine, h5py.Dataset):
            assert (mine.dtype, mine.ndim) == (other.dtype, other.ndim), name
            assert (mine.chunks is None) == (other.chunks is None), name
            assert mine.is_virtual == other.is_virtual, name
            if name.startswith("balls/"):
                assert mine[()].tobytes() == other[()].tobytes(), name


def test_drum_and_rotor_are_as_large_as_millsims(pair):
    for name in set(pair[0]["VTKHDF"]) - {"Assembly", "balls"}:
        boxes, kinds = [], []
        for file in pair:
            block = file["VTKHDF"][name]
            count, offsets = block["NumberOfPoints"][0], block["Steps/PointOffsets"][:]
            used = [block["Points"][at : at + count] for at in offsets]
            kind = block["CellData/kind"][:]
            corners = block["Polygons/Connectivity"][:].reshape(-1, 3)
            tips = [points[np.unique(corners[kind == kind.max()])] for points in used]
            boxes.append([np.r_[points.max(axis=0), np.ptp(points, axis=0)] for points in tips])
            kinds.append(set(kind))
        assert kinds[0] == kinds[1]
        # chords may lie elsewhere; a blade begins at the shaft here, at the axis there
        assert np.allclose(*np.array(boxes)[:, :, :3], atol=0.3e-3), name


def test_a_file_of_a_run_that_goes_on_shows_nothing_to_vtk(tmp_path):
    deck, path = foreign.simulate(tmp_path, DECKS["falling balls"])
    with h5py.File(path) as theirs:
        results = foreign.start(deck, theirs)
        foreign.feed(results, theirs, [], until=0.02)
        for status, there in (("running", False), ("stopped", True)):
            results.write(tmp_path / "ours.h5", RUN, status)
            with h5py.File(tmp_path / "ours.h5") as ours:
                assert ("VTKHDF" in ours) == there
        results.close()


def test_vtk_reads_every_state_to_the_bit(pair):
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    ours = pair[0]
    reader = hdf.vtkHDFReader()
    reader.SetFileName(ours.filename)
    balls = ours["particles/trajectory"]
    for k, time in list(enumerate(balls["position/time"][:]))[::40]:
        reader.UpdateTimeStep(time)
        seen = reader.GetOutputDataObject(0).GetPartitionedDataSet(0).GetPartition(0)
        arrays = {"position": seen.GetPoints().GetData()}
        arrays.update((name, seen.GetPointData().GetArray(name)) for name in ("velocity", "angular_velocity"))
        for name, array in arrays.items():
            assert vtk_to_numpy(array).tobytes() == balls[f"{name}/value"][k].tobytes(), (k, name)
