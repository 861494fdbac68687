"""The output file: what docs/file-format.md promises, read with h5py, MDAnalysis and pyh5md."""

import re
import resource
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM
from results import OWN, assert_same

KINDS = ["ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade"]
TRAJECTORY = "/particles/trajectory"

DECK = """
[run]
time = 0.1 s
sample_from = 20 ms
seed = 5
[balls.steel]
count = 50
diameter = 8 mm
density = 7800 kg/m^3
[balls.glass]
count = 30
diameter = 6 mm
density = 2500 kg/m^3
[drum]
radius = 75 mm
length = 60 mm
[rotor]
speed = 1200 rpm
shaft_radius = 15 mm
[blades]
count = 3
tip_radius = 62 mm
width = 10 mm
thickness = 6 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
[output]
frames = 10 ms
series = 1 ms
impacts = all
"""


def millsim(folder, *arguments, **options):
    return subprocess.run(
        [PROGRAM, *arguments],
        cwd=folder, capture_output=True, text=True, timeout=120, **options,
    )  # fmt: skip


def run(folder, name, *arguments):
    """Runs DECK in the folder; the path of the output file."""
    (folder / "mill.ini").write_text(DECK)
    done = millsim(folder, "-q", "-o", name, *arguments, "mill.ini")
    assert done.returncode == 0, done.stderr
    return folder / name


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return run(tmp_path_factory.mktemp("output"), "mill.h5")


@pytest.fixture()
def mill(path):
    with h5py.File(path) as file:
        yield file


def datasets(file):
    """Every dataset by every hard-linked name it has."""
    found = {}

    def walk(group):
        for name in group:
            if group.get(name, getlink=True).__class__ is h5py.SoftLink:
                continue
            member = group[name]
            if isinstance(member, h5py.Group):
                walk(member)
            else:
                found[member.name] = member

    walk(file)
    return found


# ---- labels and layout ----


def test_every_dataset_has_a_unit_and_a_description(mill):
    for name, dataset in datasets(mill).items():
        assert isinstance(dataset.attrs.get("unit"), str), name
        assert isinstance(dataset.attrs.get("description"), str), name
        assert dataset.attrs["description"].strip(), name
        if dataset.dtype.kind != "O":
            assert dataset.attrs["unit"], f"{name}: a number needs a unit, 1 if it has none"


def test_every_text_is_read_as_str(mill):
    def check(name, thing):
        for key, value in thing.attrs.items():
            assert not isinstance(value, bytes) or key == "Type", f"{name}: {key}"

    mill.visititems(check)
    assert mill["/run/version"].asstr()[()]


@pytest.mark.parametrize(
    "name, dtype, shape, unit",
    [
        ("position/value", "<f4", (11, 80, 3), "m"),
        ("velocity/value", "<f4", (11, 80, 3), "m s-1"),
        ("angular_velocity/value", "<f4", (11, 80, 3), "rad s-1"),
        ("position/step", "<i8", (11,), "1"),
        ("position/time", "<f8", (11,), "s"),
        ("id", "<i4", (80,), "1"),
        ("species", "<i4", (80,), "1"),
        ("mass", "<f8", (80,), "kg"),
        ("diameter", "<f8", (80,), "m"),
    ],
)
def test_trajectory_layout(mill, name, dtype, shape, unit):
    dataset = mill[f"{TRAJECTORY}/{name}"]
    assert (dataset.dtype, dataset.shape, dataset.attrs["unit"]) == (dtype, shape, unit)


@pytest.mark.parametrize("name", ["kinetic_energy", "rotational_energy", "potential_energy",
                                  "rotor_work", "rotor_torque"]
                         + [f"{what}/{kind}" for kind in KINDS
                            for what in ("dissipation", "dissipation_normal", "collisions")])  # fmt: skip
def test_series_layout(mill, name):
    group = mill[f"/observables/{name}"]
    counts = name.startswith("collisions")
    unit = "1" if counts else "N m" if name == "rotor_torque" else "J"
    assert group["value"].dtype == ("<u8" if counts else "<f8")
    assert group["value"].attrs["unit"] == unit
    assert [group[part].shape for part in ("step", "time", "value")] == [(101,)] * 3


@pytest.mark.parametrize("kind", KINDS)
def test_fast_impacts_have_a_column_for_each_threshold(mill, kind):
    group = mill[f"/observables/fast_collisions/{kind}"]
    assert (group["value"].dtype, group["value"].shape) == ("<u8", (101, 3))
    assert group["value"].attrs["unit"] == "1"
    assert group["time"] == mill["/observables/rotor_work/time"]


@pytest.mark.parametrize(
    "name, dtype, vector, unit",
    [
        ("time", "<f8", False, "s"),
        ("kind", "|u1", False, "1"),
        ("ball", "<i4", False, "1"),
        ("partner", "<i4", False, "1"),
        ("position", "<f4", True, "m"),
        ("normal", "<f4", True, "1"),
        ("normal_speed", "<f8", False, "m s-1"),
        ("tangential_speed", "<f8", False, "m s-1"),
        ("dissipation", "<f8", False, "J"),
    ],
)
def test_impact_layout(mill, name, dtype, vector, unit):
    dataset = mill[f"/impacts/{name}"]
    rows = len(mill["/impacts/time"])
    assert rows > 100
    assert dataset.shape == ((rows, 3) if vector else (rows,))
    assert (dataset.dtype, dataset.attrs["unit"]) == (dtype, unit)


def test_h5md_header(mill):
    assert list(mill["/h5md"].attrs["version"]) == [1, 1]
    assert mill["/h5md/creator"].attrs["name"] == "millsim"
    assert mill["/h5md/creator"].attrs["version"] == mill["/run/version"][()].decode()
    assert mill["/h5md/author"].attrs["name"]
    assert mill["/h5md/modules/units"].attrs["system"] == "SI"
    box = mill[f"{TRAJECTORY}/box"]
    assert box.attrs["dimension"] == 3
    assert list(box.attrs["boundary"]) == ["none"] * 3
    assert "edges" not in box


def test_step_and_time_are_stored_once(mill):
    poses = "/observables/pose/"  # at the times of the frames
    for parents, but in (((TRAJECTORY, poses), "none"), (("/observables",), poses)):
        shared = {}
        for name, dataset in datasets(mill).items():
            if name.startswith(parents) and not name.startswith(but) and name.endswith(("/step", "/time")):
                address = h5py.h5o.get_info(dataset.id).addr
                shared.setdefault(name.rsplit("/", 1)[1], set()).add(address)
        assert {part: len(addresses) for part, addresses in shared.items()} == {
            "step": 1,
            "time": 1,
        }


# ---- frames ----


def test_frames_and_rows_lie_at_multiples_of_their_intervals(mill):
    step = mill[f"{TRAJECTORY}/position/step"][:]
    assert list(step) == list(range(11))
    # to the bit, but for the last: it may be the end of the run itself, a rounding error off
    for name, interval in ((f"{TRAJECTORY}/position/time", 0.01), ("/observables/rotor_work/time", 0.001)):
        times = mill[name][:]
        assert list(times[:-1]) == list(np.arange(len(times) - 1) * interval)
        assert times[-1] == pytest.approx(0.1, rel=1e-15)


def test_balls_are_described_in_the_order_of_the_deck(mill):
    group = mill[TRAJECTORY]
    assert list(group["id"]) == list(range(80))
    names = group["species"].attrs["names"][group["species"][:]]
    assert list(names) == ["steel"] * 50 + ["glass"] * 30
    np.testing.assert_allclose(group["diameter"][:], [0.008] * 50 + [0.006] * 30)
    density = np.where(names == "steel", 7800, 2500)
    np.testing.assert_allclose(group["mass"], density * np.pi / 6 * group["diameter"][:] ** 3)


def test_frames_hold_the_energies_of_the_series(mill):
    group = mill[TRAJECTORY]
    mass, diameter = group["mass"][:], group["diameter"][:]
    v, w = group["velocity/value"][:], group["angular_velocity/value"][:]
    z = group["position/value"][:, :, 2]
    inertia = mass * diameter**2 / 10
    every = slice(0, None, 10)  # ten rows of the series to a frame
    for name, value in [
        ("kinetic_energy", (mass * (v**2).sum(2) / 2).sum(1)),
        ("rotational_energy", (inertia * (w**2).sum(2) / 2).sum(1)),
        ("potential_energy", (mass * 9.81 * z).sum(1)),
    ]:
        series = mill[f"/observables/{name}/value"][every]
        np.testing.assert_allclose(value, series, rtol=1e-5, atol=1e-9, err_msg=name)


def test_balls_are_inside_the_drum_in_every_frame(mill):
    group = mill[TRAJECTORY]
    r, radius = group["position/value"][:], group["diameter"][:] / 2
    assert (np.hypot(r[..., 1], r[..., 2]) + radius <= 0.075 + 1e-7).all()
    assert (abs(r[..., 0]) + radius <= 0.03 + 1e-7).all()


def test_no_frames_when_the_interval_is_zero(tmp_path):
    with h5py.File(run(tmp_path, "none.h5", "-s", "output.frames=0 s")) as file:
        assert set(file[TRAJECTORY]) == {"box", "id", "species", "mass", "diameter"}
        assert len(file["/observables/kinetic_energy/value"]) == 101


def test_an_end_that_is_no_multiple_has_no_frame(tmp_path):
    with h5py.File(run(tmp_path, "odd.h5", "-s", "run.time=0.0451 s")) as file:
        assert len(file[f"{TRAJECTORY}/position/time"]) == 5
        assert len(file["/observables/rotor_work/time"]) == 46


# ---- series and log ----


def test_energy_balance_closes_in_every_row(mill):
    group = mill["/observables"]
    energy = sum(group[f"{name}_energy/value"][:] for name in ("kinetic", "rotational", "potential"))
    lost = sum(group[f"dissipation/{kind}/value"][:] for kind in KINDS)
    work = group["rotor_work/value"][:]
    error = abs(work - work[0] - (energy - energy[0]) - lost)
    assert work[-1] > 0.01
    assert error.max() < 1e-9 * (abs(work).max() + lost.max())


def test_torque_times_angle_is_the_work_of_the_rotor(mill):
    torque = mill["/observables/rotor_torque/value"][:]
    work = mill["/observables/rotor_work/value"][:]
    speed = 1200 * 2 * np.pi / 60
    assert torque[0] == 0
    np.testing.assert_allclose(torque[1:] * 0.001 * speed, np.diff(work), rtol=1e-9, atol=1e-15)


def test_normal_losses_are_part_of_the_losses(mill):
    for kind in KINDS:
        normal = mill[f"/observables/dissipation_normal/{kind}/value"][-1]
        assert normal <= mill[f"/observables/dissipation/{kind}/value"][-1] * (1 + 1e-12)


def test_series_and_log_tell_the_same_counts_and_losses(mill):
    log = mill["/impacts"]
    assert list(log.attrs["kinds"]) == list(log["kind"].attrs["kinds"]) == KINDS
    when, kind, loss = log["time"][:], log["kind"][:], log["dissipation"][:]
    assert (np.diff(when) >= 0).all()
    times = mill["/observables/rotor_work/time"][:]
    for k, name in enumerate(KINDS):
        # a row of the series sees the impacts before its time
        before = np.searchsorted(when[kind == k], times, side="left")
        assert list(mill[f"/observables/collisions/{name}/value"]) == list(before), name
        lost = np.concatenate([[0], np.cumsum(loss[kind == k])])[before]
        np.testing.assert_allclose(mill[f"/observables/dissipation/{name}/value"], lost, rtol=1e-12, atol=1e-18)


def test_fast_impacts_are_counted_as_the_log_has_them(mill):
    log = mill["/impacts"]
    when, kind, speed = log["time"][:], log["kind"][:], log["normal_speed"][:]
    times = mill["/observables/rotor_work/time"][:]
    for k, name in enumerate(KINDS):
        counted = mill[f"/observables/fast_collisions/{name}/value"]
        thresholds = counted.attrs["thresholds"]
        assert list(thresholds) == [0.5, 1.0, 2.0]
        for column, threshold in zip(counted[:].T, thresholds):
            fast = when[(kind == k) & (speed >= threshold)]
            assert list(column) == list(np.searchsorted(fast, times, side="left")), (
                name,
                threshold,
            )
    # of every speed there are some, and some slower
    total = sum(mill[f"/observables/fast_collisions/{name}/value"][-1] for name in KINDS)
    assert len(speed) > total[0] > total[1] > total[2] > 0


def test_an_impact_at_the_threshold_is_fast(tmp_path):
    """Three balls fly freely along the axis, each meets an end wall once, at 0.5, 1 and 2 m/s exactly."""
    (tmp_path / "start.txt").write_text("0.02 -0.02 0 0.5 0 0 1 10 -1\n0.02 0 0 1 0 0\n0.02 0.02 0 2 0 0\n")
    (tmp_path / "walls.ini").write_text(
        "[run]\ntime = 18 ms\n[output]\nframes = 6 ms\n[gravity]\nacceleration = 0 0 0 m/s^2\n"
        "[balls]\ncount = 3\ndiameter = 10 mm\ndensity = 7800 kg/m^3\nstart = start.txt\n"
        "[drum]\nradius = 50 mm\nlength = 60 mm\n[contact]\nrestitution = 1\n"
    )
    assert millsim(tmp_path, "-q", "walls.ini").returncode == 0
    with h5py.File(tmp_path / "walls.h5") as file:
        assert list(file["/observables/fast_collisions/ball_wall/value"][-1]) == [3, 2, 1]
        assert list(file[f"{TRAJECTORY}/position/time"]) == [0, 0.006, 0.012, 0.018]  # 3 * 0.006 is more, by rounding
        assert list(file[f"{TRAJECTORY}/angular_velocity/value"][0, 0]) == [1, 10, -1]
        assert list(file[f"{TRAJECTORY}/species"].attrs["names"]) == ["balls"]  # those of a plain section


def test_log_counts_every_impact_of_the_run(mill):
    kind = mill["/impacts/kind"][:]
    for k, name in enumerate(KINDS):
        assert (kind == k).sum() == mill[f"/run/events/collisions/{name}"][()], name
    assert (kind == 0).sum() > 0 and (kind == 4).sum() > 0


def test_logged_contacts_make_sense(mill):
    log = mill["/impacts"]
    kind, ball, partner = log["kind"][:], log["ball"][:], log["partner"][:]
    assert (partner[kind == 0] > ball[kind == 0]).all()
    assert set(partner[kind == 1]) | set(partner[kind == 3]) <= {-1}
    assert set(partner[kind == 2]) <= {0, 1}
    assert set(partner[kind == 4]) <= {0, 1, 2}
    walls = log["position"][:, 0][kind == 2]
    np.testing.assert_allclose(walls, np.where(partner[kind == 2] == 0, -0.03, 0.03), atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(log["normal"][:], axis=1), 1, atol=1e-6)
    drum = log["position"][:][kind == 1]
    np.testing.assert_allclose(np.hypot(drum[:, 1], drum[:, 2]), 0.075, atol=1e-6)
    inwards = -drum[:, 1:] / 0.075
    np.testing.assert_allclose(log["normal"][:][kind == 1][:, 1:], inwards, atol=1e-5)


def test_impacts_are_not_logged_unasked(tmp_path):
    with h5py.File(run(tmp_path, "plain.h5", "-s", "output.impacts=statistics")) as file:
        assert "impacts" not in file


# ---- promises ----


@pytest.mark.slow
def test_two_runs_give_the_same_bits(path, tmp_path):
    time.sleep(1)  # HDF5 would note the second in which an object was made
    assert_same(path, run(tmp_path, "again.h5"))


def test_output_options_do_not_change_the_run(path, tmp_path):
    other = run(tmp_path, "other.h5", "-s", "output.frames=0.7 ms", "-s", "output.series=50 ms",
                "-s", "output.impacts=statistics")  # fmt: skip
    with h5py.File(path) as a, h5py.File(other) as b:
        for kind in KINDS:
            for what in ("collisions", "fast_collisions", "dissipation"):
                name = f"/observables/{what}/{kind}/value"
                assert a[name][-1].tobytes() == b[name][-1].tobytes(), name
        assert a["/run/events/predictions"][()] == b["/run/events/predictions"][()]


@pytest.mark.slow
def test_stored_deck_gives_the_same_run(path, tmp_path):
    with h5py.File(path) as file:
        (tmp_path / "stored.ini").write_text(file["/deck/text"].asstr()[()])
    done = millsim(tmp_path, "-q", "stored.ini")
    assert done.returncode == 0, done.stderr
    assert_same(path, tmp_path / "stored.h5", (*OWN, "/deck/text"))


def test_deck_is_stored_with_defaults_and_meanings(mill):
    assert mill["/deck/gravity/acceleration"].asstr()[()]
    assert mill["/deck/run/seed"].asstr()[()] == "5"
    assert mill["/deck/contact/rebound_floor"].asstr()[()]  # a default
    assert {"balls.steel", "balls.glass", "contact", "drum"} <= set(mill["/deck"])


def test_run_facts(mill):
    facts = mill["/run"]
    assert facts["status"].asstr()[()] == "complete"
    assert facts["time"][()] == pytest.approx(0.1, rel=1e-12)
    assert facts["energy_balance_error"][()] < 1e-9
    assert facts["largest_overlap"][()] < 1e-9
    assert facts["overlaps"][()] == facts["reliefs"][()] == 0
    assert facts["events/predictions"][()] > 0
    assert 0 < facts["cpu_time"][()] < 100 and facts["wall_time"][()] > 0 and 1e6 < facts["peak_memory"][()] < 1e11
    assert re.fullmatch(r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ", facts["started"].asstr()[()])
    assert "-o mill.h5" in facts["command"].asstr()[()]


@pytest.mark.parametrize("option", ["-q", "--resume"])
@pytest.mark.parametrize("end", ["part", "new", "lock"])
def test_files_in_the_way_that_are_not_ours_are_refused_and_kept(tmp_path, end, option):
    mine = tmp_path / f"mill.h5.{end}"
    mine.write_text("my thesis")
    (tmp_path / "mill.ini").write_text(DECK)
    done = millsim(tmp_path, option, "-q", "mill.ini")
    assert done.returncode == 2
    said = "exists and is not an unfinished file of millsim; move it away, or use --force"
    assert done.stderr.splitlines()[-1] == f"millsim: {mine.name}: {said}"
    assert mine.read_text() == "my thesis"
    assert {entry.name for entry in tmp_path.iterdir()} == {mine.name, "mill.ini"}
    run(tmp_path, "mill.h5", "--force")
    assert {entry.name for entry in tmp_path.iterdir()} == {"mill.h5", "mill.ini"}


@pytest.mark.parametrize("end", ["part", "new", "lock"])
def test_links_in_the_way_are_not_followed(tmp_path, end):
    (tmp_path / "mill.ini").write_text(DECK)
    (tmp_path / f"mill.h5.{end}").symlink_to("elsewhere")
    done = millsim(tmp_path, "-q", "mill.ini")
    assert done.returncode == 2
    assert not (tmp_path / "elsewhere").exists()
    (tmp_path / "elsewhere").write_text("my thesis")
    run(tmp_path, "mill.h5", "--force")
    assert (tmp_path / "elsewhere").read_text() == "my thesis"
    assert {entry.name for entry in tmp_path.iterdir()} == {"elsewhere", "mill.h5", "mill.ini"}


def test_resuming_a_complete_file_clears_the_lock_of_a_killed_run(tmp_path):
    path = run(tmp_path, "mill.h5")
    before = path.read_bytes()
    (tmp_path / "mill.h5.lock").touch()
    done = millsim(tmp_path, "--resume", "mill.ini")
    assert done.returncode == 0
    assert "is complete: nothing to resume" in done.stderr
    assert path.read_bytes() == before
    assert {entry.name for entry in tmp_path.iterdir()} == {"mill.h5", "mill.ini"}


def test_a_disk_that_fills_up_ends_in_one_line_and_status_1(tmp_path):
    (tmp_path / "mill.ini").write_text(DECK)

    def small_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (60000, 60000))

    done = millsim(tmp_path, "-q", "mill.ini", preexec_fn=small_disk)
    assert done.returncode == 1
    lines = [line for line in done.stderr.splitlines() if not line.startswith("millsim: warning")]
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("millsim: mill.h5: cannot ")
    assert "File too large" in lines[0]
    assert {entry.name for entry in tmp_path.iterdir()} <= {"mill.h5", "mill.ini"}


# ---- other people's readers ----


def test_mdanalysis_reads_positions_and_velocities(path, mill):
    mda = pytest.importorskip("MDAnalysis")
    from MDAnalysis.coordinates.H5MD import H5MDReader

    H5MDReader._unit_translation["length"]["m"] = "m"
    universe = mda.Universe.empty(80, velocities=True)
    universe.load_new(str(path), format="H5MD", convert_units=False)
    assert universe.trajectory.n_frames == 11
    for k, frame in enumerate(universe.trajectory):
        assert frame.time == mill[f"{TRAJECTORY}/position/time"][k]
        assert (frame.positions == mill[f"{TRAJECTORY}/position/value"][k]).all()
        assert (frame.velocities == mill[f"{TRAJECTORY}/velocity/value"][k]).all()


def test_pyh5md_reads_positions(path, mill):
    pyh5md = pytest.importorskip("pyh5md")
    with pyh5md.File(str(path), "r") as file:
        group = file.particles_group("trajectory")
        position = pyh5md.element(group, "position")
        assert (position.value[:] == mill[f"{TRAJECTORY}/position/value"][:]).all()
        assert (position.step[:] == np.arange(11)).all()
