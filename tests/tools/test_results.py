"""Results of another program in millsim's schema: millsim's own runs, fed through milltools, give millsim's own file."""

import configparser
import os
import subprocess
import sys
import types
from pathlib import Path

import pytest

h5py = pytest.importorskip("h5py")
np = pytest.importorskip("numpy")

ROOT = Path(__file__).resolve().parents[2]
MILLSIM = Path(os.environ.get("MILLSIM", ROOT / "millsim"))
sys.path.insert(0, str(ROOT / "tools"))

from milltools import h5write, tally
from milltools.results import KINDS, Results

# The last of four revolutions is cut off; frames at twice the rate of the maps' snapshots, so that they include
# them; a strike window so wide that a good part of the contacts is merged.
MIXTURE = """
[run]
time = 0.2 s
sample_from = 0.02 s
seed = 3
[balls.big]
count = 150
diameter = 6 mm
density = 7800 kg/m^3
[balls.little]
count = 150
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = 50 mm
length = 60 mm
[rotor]
speed = 1200 rpm
shaft_radius = 19 mm
[blades]
count = 2
tip_radius = 33 mm
width = 11 mm
thickness = 6 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
rebound_floor = 10 mm/s
[output]
frames = 0.5 ms
series = 1 ms
impacts = all
strike_window = 1 ms
"""
GAS = """
[run]
time = 0.1 s
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 200
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 30 mm
length = 40 mm
[contact]
restitution = 0.95
[output]
frames = 0.5 ms
impacts = all
strike_window = 0 s
"""
DECKS = {
    "friction, mixture": MIXTURE,
    "smooth, backwards": MIXTURE.replace("friction = 0.3", "").replace("= 1200", "= -1200"),
    "short blocks, late": MIXTURE.replace("= 1200", "= 3000")
    .replace("= 0.02 s", "= 0.15 s")
    .replace("frames = 0.5 ms", "frames = 0.25 ms"),
    "no rotor, no gravity": GAS,
    "falling balls": GAS.replace("0 0 0", "0 0 -9.81").replace("= 0.95", "= 0.7"),
}
RUN = {
    "program": "LIGGGHTS",
    "version": "3.8.0",
    "command": "mill dem deck.ini",
    "started": "2026-01-31T12:00:00Z",
    "wall_time": 12.5,
    "cpu_time": 25.0,
    "steps": (300_000, "1", "time steps"),
    "modulus": (2.1e11, "Pa", "Young's modulus of balls and walls"),
}


def deck_of(text):
    """What milltools.deck.Deck offers, of a text as `millsim --check` prints it."""
    parser = configparser.ConfigParser(inline_comment_prefixes="#", interpolation=None)
    parser.read_string(text)

    def number(key, default=None):
        section, _, name = key.rpartition(".")
        value = parser.get(section, name, fallback=None)
        return default if value is None else float(value.split()[0])

    sections = {name: dict(parser[name]) for name in parser.sections()}
    return types.SimpleNamespace(text=text, number=number, sections=sections)


def simulate(folder, text):
    """A deck as checked, and millsim's own file of it."""
    if not MILLSIM.exists():
        pytest.fail(f"{MILLSIM} is not built; run make first")
    (folder / "mill.ini").write_text(text)
    done = [
        subprocess.run(
            [MILLSIM, *options, "mill.ini"],
            cwd=folder, capture_output=True, text=True, timeout=120, check=True,
        ).stdout
        for options in (["--check"], ["-q", "-o", "mill.h5"])
    ]  # fmt: skip
    return deck_of(done[0]), folder / "mill.h5"


def start(deck, theirs):
    balls = theirs["particles/trajectory"]
    names = list(balls["species"].attrs["names"])
    columns = (balls[name][:] for name in ("diameter", "mass", "species"))
    return Results(deck, *columns, names)


def series(theirs):
    """(times, {path: rows}) of millsim's time series but those that Results counts."""
    group, found = theirs["observables"], {}
    group.visititems(
        lambda name, item: (
            found.update({name.removesuffix("/value"): item[:]})
            if name.endswith("/value") and "collisions" not in name
            else None
        )
    )
    return group["rotor_work/time"][:], found


ORDER = (
    "time", "kind", "ball", "partner", "position", "normal",
    "normal_speed", "tangential_speed", "dissipation",
)  # fmt: skip


def feed(results, theirs, batches, until=np.inf):
    """Hands over millsim's own impacts in batches up to these rows, and whatever is due in between."""
    log = [theirs["impacts"][name][:] for name in ORDER]
    balls = theirs["particles/trajectory"]
    states = [balls[f"{name}/value"][:] for name in ("position", "velocity", "angular_velocity")]
    frame_times = balls["position/time"][:]
    for k, time in enumerate(frame_times):
        if time <= until:
            results.frame(time, *(state[k] for state in states))
    for time in results.snapshot_times[results.snapshot_times <= until]:
        k = int(np.argmin(np.abs(frame_times - time)))
        assert abs(frame_times[k] - time) < 1e-9
        results.snapshot(states[0][k], states[1][k])
    times, rows = series(theirs)
    done = k = 0
    for stop in [*batches, len(log[0])]:
        part = [column[done:stop] for column in log]
        results.impacts(*(column[part[0] < until] for column in part))
        done = stop
        ahead = log[0][done] if done < len(log[0]) else np.inf
        while k < len(times) and times[k] <= min(ahead, until):
            results.row(times[k], {name: values[k] for name, values in rows.items()})
            k += 1


def random_batches(n, seed):
    """Ends of batches of all sizes, from none to half of them."""
    generator = np.random.default_rng(seed)
    return sorted(
        generator.integers(0, n, 3).tolist() + generator.integers(0, min(n, 500), 40).tolist()
    )


@pytest.fixture(scope="module", params=DECKS, ids=lambda name: name.replace(",", ""))
def pair(request, tmp_path_factory):
    """(file by Results, millsim's own file) of the same run."""
    folder = tmp_path_factory.mktemp("results")
    deck, path = simulate(folder, DECKS[request.param])
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        feed(results, theirs, random_batches(len(theirs["impacts/time"]), 1))
        results.write(folder / "ours.h5", RUN)
        with h5py.File(folder / "ours.h5") as ours:
            yield ours, theirs


def tree(file):
    """Everything in the file but /run (and what millsim's views show again), by name."""
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
    }


def test_names_types_shapes_and_labels_are_those_of_millsim(pair):
    ours, theirs = (tree(file) for file in pair)
    fast = {name for name in ours if name.startswith("observables/fast_collisions")}
    assert ours.keys() - theirs.keys() <= fast and not theirs.keys() - ours.keys()
    for name in ours.keys() & theirs.keys():
        mine, other = ours[name], theirs[name]
        assert type(mine) is type(other), name
        attributes = {key: value for key, value in mine.attrs.items() if key != "part"}
        assert attributes.keys() == other.attrs.keys(), name
        for key, value in attributes.items():
            if isinstance(value, str):
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


# all but what follows from single precision (maps), from the rows (power) or from a rebound floor
EXACT = ("deck/", "particles/", "observables/", "impacts/", "statistics/impacts/", "statistics/strikes/", "statistics/duration", "statistics/maps/samples")  # fmt: skip


def test_everything_that_can_be_is_the_same_to_the_bit(pair):
    ours, theirs = (tree(file) for file in pair)
    checked = 0
    for name in ours.keys() & theirs.keys():
        from_rows = name.startswith("statistics/impacts/") and name.endswith("dissipated_power")
        if isinstance(ours[name], h5py.Dataset) and name.startswith(EXACT) and not from_rows:
            assert same(ours[name], theirs[name]), name
            checked += 1
    assert checked > 300


def test_there_are_enough_impacts_and_strikes_to_tell(pair):
    _, theirs = pair
    counts = [
        int(theirs[f"statistics/{family}/all/count"][()]) for family in ("impacts", "strikes")
    ]
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


# ---- one mill, looked at closely ----


@pytest.fixture(scope="module")
def mill(tmp_path_factory):
    """(deck, millsim's file) of the mixture."""
    return simulate(tmp_path_factory.mktemp("mill"), MIXTURE)


def test_batches_change_nothing(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        n = len(theirs["impacts/time"])
        contents = []
        for name, batches in (("one.h5", []), ("many.h5", range(1, n, 97))):
            results = start(deck, theirs)
            feed(results, theirs, batches)
            results.write(tmp_path / name, RUN)
            contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]


def test_a_batch_of_millions_is_worked_on_slice_by_slice(mill, tmp_path, monkeypatch):
    deck, path = mill
    monkeypatch.setattr("milltools.results.SLICE", 1000)
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        feed(results, theirs, [])
        results.write(tmp_path / "ours.h5", RUN)
        with h5py.File(tmp_path / "ours.h5") as ours:
            for name in ("impacts/all", "strikes/ball_blade"):
                name = f"statistics/{name}/normal_speed/histogram/dissipation"
                assert np.array_equal(ours[name], theirs[name])


def test_arrays_may_be_used_again_after_they_were_handed_over(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        columns = [theirs["impacts"][name][:100] for name in ORDER]
        results.impacts(*columns)
        for column in columns:
            column[:] = 0
        results.write(tmp_path / "ours.h5", RUN)
        with h5py.File(tmp_path / "ours.h5") as ours:
            assert all(np.array_equal(ours["impacts"][name], theirs["impacts"][name][:100]) for name in ORDER)  # fmt: skip


def test_results_so_far_cover_the_time_so_far(mill, tmp_path):
    deck, path = mill
    until = 0.13  # two whole blocks of 50 ms
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
        feed(results, theirs, [], until)
        results.write(tmp_path / "ours.h5", RUN, status="running", time=until)
        times = theirs["impacts/time"][:]
        inside = np.sum((times >= 0.02) & (times < until))
        blocks = theirs["statistics/rotor/block_power"][:2]
        with h5py.File(tmp_path / "ours.h5") as ours:
            assert ours["run/status"].asstr()[()] == "running"
            assert ours["run/time"][()] == until
            assert ours["statistics/duration"][()] == until - 0.02
            assert ours["statistics/impacts/all/count"][()] == inside
            assert ours["observables/rotor_work/value"].shape == (131,)
            assert ours["particles/trajectory/velocity/value"].shape[0] == 261
            assert ours["statistics/maps/samples"][()] == 110
            rotor = ours["statistics/rotor"]
            assert np.allclose(rotor["block_power"][:], blocks, rtol=1e-9)
            work = theirs["observables/rotor_work/value"][:]
            assert rotor["power"][()] == pytest.approx((work[130] - work[20]) / 0.11, rel=1e-9)


def test_a_run_that_goes_on_after_writing_ends_like_one_that_was_not_written(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        for name, early in (("a.h5", False), ("b.h5", True)):
            results = start(deck, theirs)
            if early:
                results.write(tmp_path / name, RUN, status="running", time=0.0)
                with h5py.File(tmp_path / name) as so_far:
                    assert np.isnan(so_far["statistics/rotor/power"][()])
                    assert so_far["statistics/duration"][()] == 0
                    assert so_far["statistics/impacts/all/rate"][()] == 0
                    assert so_far["statistics/impacts/all/dissipated_power"][()] == 0
                    assert so_far["observables/rotor_work/value"].shape == (0,)
            feed(results, theirs, random_batches(1000, 5))
            results.write(tmp_path / name, RUN)
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_blocks_between_two_rows_are_interpolated():
    time = np.linspace(0, 1, 11)
    blocks = tally.Blocks(2 * np.pi / 0.25, 0.05, 1.0)
    blocks.close(time, 3 * time, -2 * time)
    assert len(blocks.power) == 3 and blocks.duration == 0.25
    assert np.allclose(blocks.power, 3) and np.allclose(blocks.torque, -2)


def test_a_block_that_is_not_over_is_not_counted():
    time = np.linspace(0, 0.5, 6)
    blocks = tally.Blocks(2 * np.pi / 0.25, 0.05, 1.0)
    blocks.close(time, 3 * time, -2 * time)
    assert len(blocks.power) == 1


def test_what_a_row_does_not_give_is_unknown_not_zero(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
    for time in (0.0, 0.1, 0.2):
        results.row(time, {"kinetic_energy": 1.0, "elastic_energy": 2 * time})
    results.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        assert np.isnan(ours["observables/rotor_work/value"][:]).all()
        assert np.isnan(ours["statistics/rotor/power"][()])
        assert np.isnan(ours["statistics/impacts/all/dissipated_power"][()])
        elastic = ours["observables/elastic_energy"]
        assert (
            elastic["value"][:].tolist() == [0, 0.2, 0.4] and elastic["value"].attrs["unit"] == "J"
        )
        assert elastic["time"] == ours["observables/kinetic_energy/time"]


# ---- the file ----


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


def test_an_older_file_stands_when_a_new_one_cannot_be_made(tmp_path, monkeypatch):
    path = tmp_path / "mill.h5"
    path.write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"mill.h5: cannot write: .*No space left") as raised:
        with h5write.whole_file(path) as file:
            file["x"] = 1
    assert "\n" not in str(raised.value)
    assert path.read_bytes() == b"old" and os.listdir(tmp_path) == ["mill.h5"]


def test_a_file_is_replaced_as_a_whole_and_a_link_stays_a_link(tmp_path):
    (tmp_path / "there").mkdir()
    target, link = tmp_path / "there" / "mill.h5", tmp_path / "mill.h5"
    link.symlink_to(target)
    with h5write.whole_file(link) as file:
        file["x"] = 1
        assert not target.exists()
    with h5py.File(target) as old, h5write.whole_file(link) as file:
        file["x"] = 2
        assert old["x"][()] == 1
    with h5py.File(link) as new:
        assert link.is_symlink() and new["x"][()] == 2
    assert os.listdir(target.parent) == ["mill.h5"]


def test_nothing_is_left_among_the_temporary_files(mill, tmp_path):
    deck, path = mill
    with h5py.File(path) as theirs:
        columns = (theirs["particles/trajectory"][name][:] for name in ("diameter", "mass", "species"))  # fmt: skip
        results = Results(deck, *columns, ["big", "little"], folder=tmp_path)
        feed(results, theirs, [])
    assert os.listdir(tmp_path) == []


# ---- borders ----


@pytest.fixture
def idle(mill):
    """Results of the mixture, nothing delivered yet."""
    deck, path = mill
    with h5py.File(path) as theirs:
        return start(deck, theirs)


def batch(times, **other):
    n = len(times)
    columns = {"kind": np.zeros(n), "point": np.zeros((n, 3)), **other}
    return (
        times, columns["kind"].astype(int), np.zeros(n, int), np.ones(n, int), columns["point"],
        np.zeros((n, 3)), np.ones(n), np.ones(n), np.ones(n),
    )  # fmt: skip


def test_speeds_on_an_edge_belong_to_the_bin_above_it():
    edges = tally.EDGES
    assert tally.find_slots(edges).tolist() == list(range(1, tally.SLOTS))
    assert tally.find_slots(np.nextafter(edges, 0)).tolist() == list(range(tally.SLOTS - 1))
    assert tally.find_slots(np.array([0, -1, np.nan, 1e9])).tolist() == [0, 0, 0, tally.SLOTS - 1]
    assert 0.05 == edges[tally.FAST - 1] and {1.0, 20.0} <= set(edges)


@pytest.mark.parametrize("slot", [0, 1, 700, tally.BINS, tally.SLOTS - 1])
def test_quantiles_of_one_bin_lie_in_it(slot):
    count = np.zeros(tally.SLOTS, np.uint64)
    count[slot] = 4
    lower = tally.EDGES[slot - 1] if slot > 0 else 0
    upper = tally.EDGES[min(slot, tally.BINS)] if slot > 0 else 0
    expected = np.sqrt(lower * upper) if slot <= tally.BINS else tally.EDGES[-1]
    assert tally.quantile(count, 0.5) == pytest.approx(expected, rel=1e-12)
    assert np.isnan(tally.quantile(0 * count, 0.5))


def test_an_impact_at_a_rows_time_counts_from_the_next_row_on(idle, tmp_path):
    idle.impacts(*batch([0.0, 0.1, 0.1, 0.15]))
    for time in (0.0, 0.1, 0.2):
        idle.row(time, {})
    idle.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        for name, value in (("collisions", [0, 1, 4]), ("fast_collisions", [[0] * 3, [1, 1, 0], [4, 4, 0]])):  # fmt: skip
            assert ours[f"observables/{name}/ball_ball/value"][:].tolist() == value


def test_an_impact_at_the_windows_begin_is_in_and_one_at_its_end_is_out(idle, tmp_path):
    before, end = np.nextafter(0.02, 0), 0.2
    idle.impacts(*batch([before, 0.02, 0.1, np.nextafter(end, 0), end, 0.3]))
    idle.write(tmp_path / "ours.h5", RUN)
    with h5py.File(tmp_path / "ours.h5") as ours:
        assert ours["statistics/impacts/all/count"][()] == 3
        assert ours["statistics/maps/axial/impact_count"][:].sum() == 3
        assert (
            ours["statistics/strikes/all/count"][()] == 2
        )  # 0.02 s: of a strike that began before
        assert ours["run/events/collisions/ball_ball"][()] == 6


# ---- what cannot be ----


def test_impacts_out_of_order_are_refused(idle):
    idle.impacts(*batch([0.1, 0.1, 0.2]))
    for times in ([0.3, 0.25], [0.19], [np.nan]):
        with pytest.raises(ValueError, match="order of time"):
            idle.impacts(*batch(times))
    idle.impacts(*batch([0.2]))


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda r: r.impacts(*batch([0.1], kind=np.array([5]))), r"kind is none of 0\.\.4"),
        (lambda r: r.impacts(*batch([0.1], point=np.zeros(3))), r"position.* shape \(3,\)"),
        (lambda r: r.row(0.0, {"rotor_wrok": 1}), "rotor_wrok: no time series"),
        (lambda r: r.row(0.0, {"collisions/ball_ball": 1}), "is counted"),
        (lambda r: r.snapshot(np.zeros((4, 3)), np.zeros((4, 3))), r"expected an array \(300, 3\)"),
        (lambda r: r.snapshot(np.full((300, 3), np.nan), np.zeros((300, 3))), "no number"),
        (lambda r: r.frame(0.0, *[np.zeros((300, 2))] * 3), r"position: expected an array \(300, 3\)"),
        (lambda r: r.write("x.h5", RUN, status="done"), "'done' is none of complete"),
        (lambda r: r.write("x.h5", {}), "run: program is missing"),
        (lambda r: r.write("x.h5", {**RUN, "dt": 1e-6}), r"run: dt: expected \(value, unit"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(idle, tmp_path, monkeypatch, call, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message) as raised:
        call(idle)
    assert "\n" not in str(raised.value)
    assert os.listdir(tmp_path) == []


def test_there_are_no_more_snapshots_than_planned(idle):
    balls = np.zeros((300, 3))
    assert len(idle.snapshot_times) == 180
    assert np.allclose(idle.snapshot_times, 0.02 + (np.arange(180) + 0.5) * 1e-3, atol=1e-12)
    for _ in idle.snapshot_times:
        idle.snapshot(balls, balls)
    with pytest.raises(ValueError, match="only 180"):
        idle.snapshot(balls, balls)


def test_frames_are_refused_where_the_deck_wants_none(mill):
    deck, path = mill
    deck = deck_of(deck.text.replace("frames = 0.0005 s", "frames = 0 s"))
    with h5py.File(path) as theirs:
        results = start(deck, theirs)
    with pytest.raises(ValueError, match="output.frames is 0 s"):
        results.frame(0.0, *[np.zeros((300, 3))] * 3)


def test_a_file_name_in_quotes_is_one_value():
    from milltools.schema import deck_entries

    text = '[balls]\nstart = "a # b.txt"   # random, or a file\nspeed = 0 m/s  # of every ball # at t = 0\n'
    assert list(deck_entries(text)) == [
        ("balls", "start", '"a # b.txt"', "random, or a file"),
        ("balls", "speed", "0 m/s", "of every ball # at t = 0"),
    ]
