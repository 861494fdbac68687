"""Runs of mills made of bodies and motions: numbers, pictures, exports; the report and the player in a browser."""

import re
import shutil

import h5py
import numpy as np
import pandas as pd
import players
import pytest
from conftest import ROOT
from moving_mills import ATTRITOR, PLANETARY
from test_scene import at, picture, project, stored

import milltools
from milltools.compare import finding, load
from milltools.compare import rows as compared
from milltools.figures import FIGURES, flow, maps, outlines, spectra
from milltools.geometry import bodies, vessel
from milltools.geometry.trajectory import Trajectory
from milltools.player import player
from milltools.read import motions
from milltools.read.histogram import ENERGIES
from milltools.read.runfile import Run
from milltools.render import camera, states
from milltools.report import facts, run_page

pytest_plugins = ["browser"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The output files, by name."""
    decks = {"planetary": PLANETARY, "attritor": ATTRITOR}
    return {name: players.simulate(tmp_path_factory.mktemp(name), deck) for name, deck in decks.items()}


@pytest.fixture
def runs(files):
    """The open Runs, by name."""
    opened = {name: Run(path) for name, path in files.items()}
    yield opened
    for run in opened.values():
        run.close()


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


# ---- what a run says


def test_kinds_that_a_mill_has_no_surface_of_are_left_out(runs):
    assert runs["planetary"].kinds == ("ball_ball", "ball_jar")
    assert runs["attritor"].kinds == ("ball_ball", "ball_tank", "ball_pin")  # as in the deck
    for run in runs.values():
        assert [name for name, _ in run_page.contacts(run)[1]][:2] == ["ball-ball", f"ball-{run.vessel}"]
        assert not any("drum" in name for name in run.series_names())
        told = [name for name, *_ in run_page.everything(run) if "ball_" in name]
        assert any("ball_ball" in name for name in told)
        assert not any(kind in name for name in told for kind in ("drum", "wall", "shaft", "blade"))


@pytest.mark.slow
def test_motions_share_the_power_of_the_drive(files):
    with milltools.load(files["planetary"]) as result:
        assert list(result.motions.index) == ["sun", "jar"]
        assert result.motions["power"].sum() == pytest.approx(result.drive.value, rel=1e-9)
        assert result.drive.unit == "W" and result.drive.error > 0
        assert result.motions.attrs["units"]["torque"] == "N m"
        assert result.motions.loc["jar", "words"] == "turns at −1200 rpm on sun"
        work = result.series["motion_work"]
        assert work.dims == ("time", "motion")
        assert not any("rotor" in name for name in result.estimates.index)
        assert "drive power" in repr(result) and "rotor" not in repr(result)


def test_the_account_has_a_source_for_each_motion_and_adds_up(runs):
    found = flow.account(runs["planetary"])
    assert set(found.drives) == {"sun", "jar"} and set(found.dissipation) == {
        "ball_ball",
        "ball_jar",
    }
    assert abs(found.residual) < 1e-9 * found.turnover


def test_the_report_names_container_motions_and_the_drives_power(runs):
    run = runs["planetary"]
    text = facts.subject(run).replace("\N{NO-BREAK SPACE}", " ")
    assert "the container “jar”, a cylinder of radius 20 mm and length 30 mm; sun turns at 600 rpm" in text
    assert facts.tiles(run)[0][2].startswith("of the drive: ")
    rows = {name: remark for name, _, remark in run_page.balance(run)}
    assert "of the slowest motion" in rows["drive power"]
    assert rows["power of jar"].startswith("turns at −1200 rpm on sun; torque")


def test_power_and_torque_over_time_are_those_of_each_motion(runs):
    run = runs["planetary"]
    power = pd.DataFrame(FIGURES["power"].tables(run)[0].columns)
    assert list(power["motion"].unique()) == ["all", "sun", "jar"]
    for name, place in (("all", "drive"), ("sun", "motions/sun"), ("jar", "motions/jar")):
        own = power[(power["motion"] == name) & (power["mean over"] == "window")].iloc[0]
        assert own["power [W]"] == pytest.approx(run.statistic(f"{place}/power"))
        fine = power[(power["motion"] == name) & (power["mean over"] == "interval")]
        work = fine["power [W]"] * (fine["to [s]"] - fine["from [s]"])
        series = run.drive_work() if name == "all" else run.series(f"motion_work/{name}")
        assert work.sum() == pytest.approx(series[1][-1], rel=1e-9)
    torque = pd.DataFrame(FIGURES["torque"].tables(run)[0].columns)
    jar = torque[(torque["motion"] == "jar") & (torque["mean over"] == "window")].iloc[0]
    assert jar["torque [N m]"] == pytest.approx(run.statistic("motions/jar/torque"))
    fine = [t[(t["motion"] == "jar") & (t["mean over"] == "interval")].iloc[:, 4] for t in (power, torque)]  # fmt: skip
    assert fine[1].to_numpy() == pytest.approx(fine[0].to_numpy() / (-40 * np.pi))
    assert FIGURES["torque"].why_not(runs["attritor"]) is None
    FIGURES["torque"].draw(list(runs.values()))  # of several runs: a colour each, a line each motion


def as_earlier_versions(file, old):
    """A copy of the file in the form of earlier versions: with four kinds and a rotor that the mill does not have."""
    shutil.copy(file, old)
    with h5py.File(old, "r+") as f:
        for group in (
            "statistics/impacts", "statistics/strikes", "statistics/energies", "statistics/energies/blocks",
            "run/events/collisions", "run/floored", "observables/collisions", "observables/fast_collisions",
            "observables/dissipation", "observables/dissipation_normal", "statistics/floor_share",
            "statistics/precision/rate", "statistics/precision/fast_rate",
            "statistics/precision/dissipated_power", "statistics/precision/dissipated_power_normal",
        ):  # fmt: skip
            own = next(name for name in f[group] if name.startswith("ball_") and name != "ball_ball")
            for kind in ("ball_drum", "ball_wall", "ball_shaft", "ball_blade"):
                f.copy(f[f"{group}/{own}"], f[group], name=kind)

                def clear(_, thing):
                    if isinstance(thing, h5py.Dataset) and not thing.name.endswith(("edges", "step", "time")):
                        thing[...] = 0

                thing = f[f"{group}/{kind}"]
                clear("", thing) if isinstance(thing, h5py.Dataset) else thing.visititems(clear)
        for name in ("rotor_work", "rotor_torque"):
            f.copy(f["observables/kinetic_energy"], f["observables"], name=name)
            f[f"observables/{name}/value"][...] = 0
        f.copy(f["statistics/drive"], f["statistics"], name="rotor")
        f["statistics/rotor/power"][...] = 0
    return old


@pytest.mark.parametrize("name", ["planetary", "attritor"])
def test_files_of_earlier_versions_list_more_kinds_and_a_rotor_and_read_the_same(files, name, tmp_path):
    with Run(as_earlier_versions(files[name], tmp_path / "old.h5")) as old, Run(files[name]) as new:
        assert old.kinds == new.kinds and not {"ball_drum", "ball_shaft"} & {*new.kinds}
        assert old.driven == new.driven == old.drive == "drive"
        assert old.series_names() == new.series_names()
        ours, theirs = old.summary(), new.summary()
        assert all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in theirs)
        for one, other in zip(old.drive_work(), new.drive_work()):
            assert one == pytest.approx(other, rel=1e-12)
        assert flow.account(old) == flow.account(new)
        for figure in FIGURES.values():
            assert (figure.why_not(old) is None) == (figure.why_not(new) is None), figure.name


@pytest.mark.slow
def test_words_of_a_mill_without_a_rotor_do_not_speak_of_one(runs, mill, files):
    done = mill("plot", "--list", *files.values())
    assert "not of" not in done.stdout and "rotor" not in done.stdout, done.stdout
    for run in runs.values():
        said = [facts.subject(run), facts.finding(run), *(" ".join(map(str, row)) for row in run_page.balance(run))]
        said += [figure.says([run]) for figure in FIGURES.values() if figure.group == "maps"]
        assert "rotor" not in " ".join(said)


@pytest.mark.parametrize(("kind", "energetic"), [("ball_pin", True), ("ball_tank", False)])
def test_spectra_of_a_bodys_kind_hold_all_its_impacts(runs, kind, energetic):
    run = runs["attritor"]
    speed = ENERGIES[0] if energetic else "speed"
    found = spectra.bins(run, kind, abscissa="energy" if energetic else "speed")
    assert found.total == run.statistic(f"impacts/{kind}/count"), speed


# ---- where things are


def test_poses_are_those_of_the_deck(runs):
    run = runs["planetary"]
    for k in (0, 7, 100):
        time = run.frame_times()[k]
        sun, jar = 20 * np.pi * time, -40 * np.pi * time
        poses = run.poses(k)
        assert poses["sun"][:, :3] == pytest.approx(turned(sun), abs=1e-12)
        assert poses["jar"][:, :3] == pytest.approx(turned(sun + jar), abs=1e-12)
        middle = bodies.moved(poses["jar"], np.array([0.06, 0, 0]))
        assert middle == pytest.approx(turned(sun) @ [0.06, 0, 0], abs=1e-12)


def test_balls_are_in_the_container_wherever_it_is(runs):
    for run in runs.values():
        holds, radius = vessel.of(run), run.balls("diameter")[0] / 2
        for k in (0, 20, 100):
            into = bodies.inverse(bodies.container(run, k))
            x, y, z = bodies.moved(into, run.frame(k, "position").astype(float)).T
            assert np.hypot(y, z).max() < holds.outermost - radius + 1e-6
            assert x.min() > holds.low + radius - 1e-6 and x.max() < holds.high - radius + 1e-6


def test_no_ball_is_in_a_pin(runs):
    run = runs["attritor"]
    (pins,) = [body for body in bodies.Mill.of(run).inner]
    assert len(np.unique(pins.number)) == 3
    for k in (10, 60, 120):
        place = bodies.moved(bodies.inverse(run.poses(k)["stirrer"]), run.frame(k, "position").astype(float))
        for number in range(3):
            corners = pins.triangles[pins.number == number].reshape(-1, 3)
            middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
            along = turned(number * np.pi / 3)[:, 0]
            off = place - middle
            inside = np.abs(off @ along) < 0.022
            away = np.linalg.norm(off - np.outer(off @ along, along), axis=1)
            assert away[inside].min() > 0.003 + 0.0025 - 1e-5


def test_between_frames_a_motion_goes_the_shorter_way(runs):
    run = runs["planetary"]
    state = Trajectory(run).at(0.011)
    assert state.poses["sun"][:, :3] == pytest.approx(turned(20 * np.pi * 0.011), abs=1e-9)


@pytest.mark.slow
def test_cells_of_the_maps_add_up_to_the_container(runs):
    for run, volume in ((runs["planetary"], 0.02**2 * 0.03), (runs["attritor"], 0.03**2 * 0.06)):
        for view in ("cross_section", "axial"):
            cells = vessel.of(run).volume(view, run.edges(view))
            assert cells.sum() == pytest.approx(np.pi * volume, rel=5e-3)
            found = maps.field(run, view)
            balls = np.nansum(found.values["solid"] * found.volume)
            charge = len(run.balls("mass")) * np.pi / 6 * 0.005**3
            assert balls == pytest.approx(charge, rel=0.02)


def test_an_arm_through_the_axis_is_outlined_from_the_axis_on(runs):
    found = list(outlines.swept(runs["attritor"]))
    assert len(found) == 3
    for (near, far), (begin, end), moves in found:
        assert moves and near == 0
        assert far == pytest.approx(np.hypot(0.022, 0.003), rel=2e-2)
        assert end - begin == pytest.approx(0.006, rel=1e-2)


@pytest.mark.slow
def test_what_a_map_shows_is_named_by_the_mill(runs):
    for name, container, dashed in (("planetary", "jar", False), ("attritor", "tank", True)):
        run = runs[name]
        for view, label in (("axial", "x, along the {}'s axis [mm]"), ("section", "y, across the {}'s axis [mm]")):
            figure = FIGURES[f"{view}-solid"]
            assert figure.draw(run).axes[0].get_xlabel() == label.format(container)
            assert ("ashed: the space that moving bodies sweep" in figure.says([run])) == dashed
            assert "shaft" not in figure.says([run])
    both = FIGURES["axial-solid"].draw(list(runs.values()))
    assert both.axes[1].get_xlabel() == "x, along the container's axis [mm]"


# ---- pictures and exports


@pytest.mark.render
def test_a_moving_container_is_in_the_picture_at_every_time(runs):
    run = runs["planetary"]
    view = camera.of("end", run)
    assert np.abs(view.hull).max() > 0.079  # all that it sweeps
    for k in (3, 40):
        image, placed = picture(run, stored(run, k), view)
        middle = bodies.container(run, k)[:, 3]
        edge = bodies.moved(bodies.container(run, k), np.array([0.015, 0.02, 0.0]))
        assert at(image, placed, edge).max() < 180  # the rim
        mirror = at(image, placed, [-middle[0], -middle[1], 0.015])
        assert mirror.min() > 240  # nothing on the other side of the disk


@pytest.mark.render
def test_a_riding_camera_shows_the_container_large_and_at_one_place(runs):
    run = runs["planetary"]
    for name in (*camera.PRESETS, camera.free((0.1, -0.1, 0.05), (0.06, 0, 0))):
        seen = []
        for k in (0, 3, 40):
            into = bodies.after(run.poses(k)["jar"], bodies.inverse(run.vessel_frame()))
            points = bodies.moved(into, np.array([[0, 0, 0], [0.015, 0.02, 0], [-0.015, 0, 0.02]]))
            placed = camera.of(name, run, poses=run.poses(k)).placed((320, 180))
            seen.append(project(placed, points, (320, 180)))
        assert seen[1] == pytest.approx(seen[0], abs=1e-6)
        assert seen[2] == pytest.approx(seen[0], abs=1e-6)
    image, _ = picture(run, stored(run, 40), camera.of("end", run, poses=run.poses(40)))
    rows = np.flatnonzero(image.min(axis=(1, 2)) < 200)
    assert np.ptp(rows) > 0.9 * 180


@pytest.mark.slow
@pytest.mark.parametrize(("name", "words"), [("planetary", ()), ("attritor", ("--ride",))])
def test_mill_render_rides_where_the_path_is_long_and_says_so(mill, files, tmp_path, name, words):
    shutil.copyfile(files[name], tmp_path / "run.h5")
    options = ("--size", "64x48", "-q")
    done = mill("render", "run.h5", "a.png", *options, *words)
    assert done.returncode == 0, done.stderr
    assert ("moves with the container" in done.stderr) == (name == "planetary")
    assert ("the container does not move" in done.stderr) == (name == "attritor")  # there is nothing to ride on
    done = mill("render", "run.h5", "b.png", "--no-ride", *options)
    assert (done.returncode, done.stderr) == (0, "")
    same = (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert same == (name == "attritor")  # its tank stands still


@pytest.mark.render
def test_pins_are_where_the_stirrer_is(runs):
    run = runs["attritor"]
    away = stored(run, 0)
    away.position[:] = 0.0, 0.0, -0.028
    for k in (0, 10):
        pose = run.poses(k)
        state = type(away)(0.0, away.position, away.velocity, away.angular_velocity, poses=pose)
        image, placed = picture(run, state, camera.of("end", run))
        tip = bodies.moved(pose["stirrer"], turned(2 * np.pi / 3) @ [0.018, 0, 0] + [0, 0, 0.015])
        beside = bodies.moved(pose["stirrer"], turned(np.pi / 6) @ [0.018, 0, 0] + [0, 0, 0.015])
        assert at(image, placed, tip).max() < 200 < at(image, placed, beside).min()


def stl(path):
    rows = np.frombuffer(path.read_bytes()[84:], [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("e", "<u2")])
    return rows["c"]


@pytest.mark.slow
def test_a_mesh_that_is_not_that_of_the_run_is_not_read_for_an_export(mill, millsim, write_deck, tmp_path):
    """The file of a stranger may name any mesh of this computer."""
    content, short = (ROOT / "input/rotor.stl").read_bytes(), ("-s", "run.time=1 us", "-s", "run.sample_from=0 s")
    (tmp_path / "rotor.stl").write_bytes(content)
    write_deck((ROOT / "input/stl.ini").read_text())
    assert millsim("-q", "-o", "run.h5", *short, "-s", "balls.count=1", "deck.ini").returncode == 0
    assert mill("export", "run.h5", "a.stl", "--part", "rotor").returncode == 0
    rows = np.frombuffer(content[84:], [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("e", "<u2")]).copy()
    rows["c"] += np.float32(0.01)
    (tmp_path / "rotor.stl").write_bytes(content[:84] + rows.tobytes())
    done = mill("export", "run.h5", "b.stl", "--part", "rotor")
    line = "mill export: run.h5: the tables and meshes that its deck names are not those of the run\n"
    assert (done.returncode, done.stderr, (tmp_path / "b.stl").exists()) == (1, line, False)


@pytest.mark.slow
def test_bodies_are_exported_where_they_are_at_any_time(mill, files, tmp_path):
    (tmp_path / "deck.ini").write_text(PLANETARY)
    shutil.copyfile(files["attritor"], tmp_path / "run.h5")
    assert mill("export", "deck.ini", "a.stl", "--time", "12.3 ms").returncode == 0
    corners = stl(tmp_path / "a.stl").reshape(-1, 3)
    middle = turned(20 * np.pi * 0.0123) @ [0.06, 0, 0]
    away = np.hypot(*(corners - middle)[:, :2].T)
    assert away.max() == pytest.approx(0.02, rel=1e-5)
    done = mill("export", "run.h5", "pins.pvd", "--what", "mill", "--part", "pin", "--to", "4 ms")
    assert "3 frames of pin" in done.stdout, done.stderr
    done = mill("export", "run.h5", "b.stl", "--part", "lid")
    assert done.stderr.endswith("--part lid: this mill has no such part; it has tank, pin\n")


def test_a_mixtures_bodies_are_exported_too(mill, tmp_path):
    charge = "[balls.a]\nfill = 5 %\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n[balls.b]\ncount = 9\n"
    (tmp_path / "deck.ini").write_text(PLANETARY.replace("[balls]\ncount = 12\n", charge))
    done = mill("export", "deck.ini", "a.stl")
    assert done.stdout.startswith("a.stl: jar at 0 s"), done.stderr


def test_liggghts_is_not_given_what_it_cannot_run(mill, tmp_path):
    capsule = PLANETARY.replace("shape = cylinder", "shape = capsule")
    (tmp_path / "deck.ini").write_text(capsule)
    done = mill("dem", "deck.ini", "-o", "soft.h5")
    assert done.returncode == 2
    assert done.stderr.startswith("mill dem: deck.ini: [body.jar] shape: expected cylinder, box, contour or mesh")


@pytest.mark.slow
def test_two_runs_of_such_mills_are_compared(mill, files, tmp_path):
    for name, path in files.items():
        shutil.copyfile(path, tmp_path / f"{name}.h5")
    done = mill("compare", "attritor.h5", "planetary.h5")
    assert done.returncode == 0, done.stderr
    assert re.search(r"^drive power ", done.stdout, re.M) and "rotor power" not in done.stdout
    assert re.search(r"^  motion\.jar\.speed +- \| -1200 rpm$", done.stdout, re.M)
    assert "ball-pin" in done.stdout and "ball-drum" not in done.stdout


def test_drive_power_and_that_of_each_motion_are_compared(files):
    path = str(files["planetary"])
    (table,) = [compared.compare(*load.sides([[path], [path]]))]
    found = {row.key: row for row in table.rows}
    with Run(path) as run:
        assert found["drive_power"].a.value == pytest.approx(run.statistic("drive/power"))
        jar = float(run.statistic("motions/jar/power"))
    assert found["motion_power_jar"].a.value == pytest.approx(jar, rel=1e-6)
    assert not {"rotor_power", "rotor_torque"} & set(found)
    assert finding.sentences(table)[0].startswith("drive power ")


@pytest.mark.slow
def test_a_drum_on_a_motion_without_other_bodies_has_a_drive_power_too(tmp_path):
    drum = "[drum]\nmotion = sun\nradius = 30 mm\nlength = 40 mm\n"
    text = re.sub(r"\[motion.jar\].*?(?=\[balls\])", drum, PLANETARY, flags=re.S)
    path = str(players.simulate(tmp_path, text.replace("speed = 600", "axis = 1 0 0\nspeed = 600")))
    table = compared.compare(*load.sides([[path], [path]]))
    assert "drive_power" in [row.key for row in table.rows]


# ---- the player


@pytest.mark.slow
def test_flashes_of_impacts_move_with_the_container(tmp_path):
    path = players.simulate(tmp_path, PLANETARY, "output.impacts=all", "output.frames=2 ms")
    with Run(path) as run:
        made = states.Flashes(run, run, 0.02, 0.1, 0.02)  # in which the jar turns far
        for index in range(20, 50):
            poses = run.poses(index)
            flashes = made.at(run.frame_time(index), poses)
            own = bodies.moved(bodies.inverse(poses["jar"]), flashes[:, :3])
            assert (
                np.hypot(own[:, 0] - 0.06, own[:, 1]).max(initial=0) < 0.0205 and abs(own[:, 2]).max(initial=0) < 0.0151
            )
        assert len(made.time) > 3


def open_player(open_page, run, tmp_path):
    page = open_page(players.write_page(tmp_path / "page.html", player.fragment(run)))
    assert page.evaluate("millPlayers[0].ready")
    return page


@pytest.mark.slow
def test_the_player_moves_bodies_and_rides_on_the_container(open_page, runs, tmp_path):
    run = runs["planetary"]
    page = open_player(open_page, run, tmp_path)
    choice = page.page.locator(".mp-camera")
    assert choice.input_value() == "riding"  # the jar is small against its path
    place = (
        "(k) => { const one = millPlayers[0]; one.show(k); const { view } = one;"
        " return [...view.world.matrix.clone().multiply(view.moving[view.head.carrier].matrix).elements]; }"
    )
    first = page.evaluate(place, 0)
    stride = -(-len(run.frame_times()) // page.evaluate("millPlayers[0].frames"))
    for how in ("laboratory", "riding"):
        choice.select_option(how)
        for frame in (0, 25):
            seen = page.evaluate(place, frame)
            assert players.coloured(page.picture(".mp-canvas")).sum() > 1000  # balls are in sight
            told = np.vstack([run.poses(stride * frame)["jar"], [0, 0, 0, 1]]).T.ravel()
            assert seen == pytest.approx(first if how == "riding" else told, abs=1e-6)
    page.check()


@pytest.mark.slow
def test_a_container_that_stands_still_is_not_ridden_on(open_page, runs, tmp_path):
    page = open_player(open_page, runs["attritor"], tmp_path)
    assert page.page.locator(".mp-camera").count() == 0
    page.check()


def test_words_of_motions():
    class Told:
        def text(self, path, default=None):
            return {"motion.m/kind": "swing"}.get(path, default)

        def has(self, path):
            return False

        def quantity(self, path, default=None):
            return {"motion.m/amplitude": np.radians(15), "motion.m/frequency": 20.0}.get(path, default)

    assert motions.words(Told(), "m") == "swings by ±15° at 20 Hz"


def test_a_file_of_before_motions_turns_its_rotor(tmp_path):
    """Written without poses: the deck says where the rotor is."""
    path = players.simulate(tmp_path, players.LONE)
    with Run(path) as run:
        told = run.poses(3)["rotor"]
    with h5py.File(path, "r+") as file:
        del file["observables/pose"]
    with Run(path) as run:
        assert run.poses(3)["rotor"] == pytest.approx(told, abs=1e-12)
