"""What the 3D player of the report is given: the frames of the run, within a thousandth of a pixel, in the room
there is."""

import base64
import hashlib
import html.parser
import importlib.resources
import io
import re
import shutil

import h5py
import numpy as np
import players
import pytest
from conftest import SMALL
from PIL import Image

from milltools.player import frames, parts, player
from milltools.read.runfile import Run
from milltools.read.wear import Wear

MOVING = SMALL.replace("shaft_radius = 5 mm", "shaft_radius = 5 mm\nangle = 30 deg")
VENDOR = importlib.resources.files("milltools.player") / "vendor"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A run of 120 balls of 5 mm and 80 of 3 mm, 11 frames."""
    return players.simulate(tmp_path_factory.mktemp("mixed"), players.MIXED)


@pytest.fixture
def copy(file, tmp_path):
    return shutil.copy(file, tmp_path / "copy.h5")


@pytest.fixture
def mixed(file):
    with Run(file) as run:
        yield run


@pytest.fixture
def run_of(tmp_path):
    """run_of(deck, *options): the open run of a deck."""
    opened = []

    def open_it(deck, *options):
        (folder := tmp_path / str(len(opened))).mkdir()
        opened.append(Run(players.simulate(folder, deck, *options)))
        return opened[-1]

    yield open_it
    for run in opened:
        run.close()


# ---- the data


def test_the_positions_are_those_of_the_run_within_two_micrometres(mixed):
    position, _ = players.decode(player.fragment(mixed))
    there = players.stored(mixed, "position", range(11))
    assert position.shape == there.shape
    half_a_step = np.array([0.04, 0.06, 0.06]) / 65535 / 2
    assert (abs(position - there) <= half_a_step * (1 + 1e-6)).all()
    assert abs(position - there).max() < 2e-6


@pytest.mark.slow
def test_a_drum_of_262_mm_is_still_within_two_micrometres(run_of):
    run = run_of(SMALL, "drum.radius=131 mm", "drum.length=200 mm", "run.time=10 ms")
    position, _ = players.decode(player.fragment(run))
    assert abs(position - players.stored(run, "position", range(3))).max() < 2e-6


def test_the_colours_are_of_speed_spin_and_kinetic_energy(mixed):
    fragment = player.fragment(mixed)
    _, levels = players.decode(fragment)
    speed = np.linalg.norm(players.stored(mixed, "velocity", range(11)), axis=2)
    spin = np.linalg.norm(players.stored(mixed, "angular_velocity", range(11)), axis=2)
    energy = mixed.balls("mass") * speed**2 / 2
    assert [v["name"] for v in players.head(fragment)["values"]] == ["speed", "spin", "energy"]
    for choice, values in zip(players.head(fragment)["values"], (speed, spin, energy), strict=True):
        limit = choice["limit"]
        level = levels[choice["name"]]
        # small velocities and spins are finer
        assert abs((level + 0.5) * limit / 256 - np.minimum(values, limit)).max() < 0.02 * limit
        assert 0.005 < (values > limit).mean() + 0.01 and (values > limit).mean() < 0.02
        assert level.max() > 120  # the colours are made use of


def test_any_step_between_two_frames_is_packed_without_loss():
    random = np.random.default_rng(7)
    steps = random.integers(0, 65536, (6, 3, 50)).astype(np.uint16)
    steps[1:3] = np.array([[[65535]], [[0]]], np.uint16)  # the farthest there is
    now = np.zeros((3, 50), int)
    for before, after in zip(steps, steps[1:], strict=False):
        now = before.astype(int)
        raw = np.frombuffer(frames.planes(after, before), np.uint8).reshape(6, 50).astype(int)
        zigzag = 256 * raw[0::2] + raw[1::2]
        change = np.where(zigzag % 2, -(zigzag + 1) // 2, zigzag // 2)
        assert ((now + change) % 65536 == after).all()


def test_times_angles_and_sizes_are_those_of_the_run(mixed):
    head = players.head(player.fragment(mixed))
    assert head["times"] == mixed.frame_times().tolist()
    assert head["labels"][3] == "t = 15 ms"
    turn = 600 / 60 * 2 * np.pi * mixed.frame_times()
    (poses,) = np.moveaxis(players.poses(head), 1, 0)
    assert head["motions"] == ["rotor"] and head["carrier"] == -1
    assert poses[:, 1, 1] == pytest.approx(np.cos(turn), abs=1e-6)
    assert poses[:, 2, 1] == pytest.approx(np.sin(turn), abs=1e-6)
    assert [run[:2] for run in head["runs"]] == [[120, 0.005], [80, 0.003]]
    steel = players.points(head, "steel")
    assert np.hypot(*steel[:, 1:].T).max() == pytest.approx(np.hypot(0.022, 0.002), rel=1e-6)
    assert [b["motion"] for b in head["bodies"]] == [-1, 0]


def test_a_mill_without_a_rotor_has_none_here(run_of):
    still = SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :]
    head = players.head(player.fragment(run_of(still, "run.time=10 ms")))
    assert [b["look"] for b in head["bodies"]] == ["shell"] and head["motions"] == []
    assert np.hypot(*players.points(head, "shell")[:, 1:].T) == pytest.approx(0.03, abs=1e-7)


@pytest.mark.slow
def test_the_wall_of_a_wavy_mill_bulges(run_of):
    wavy = ["drum.profile=wavy", "drum.buckles=6", "drum.buckle_height=2 mm", "run.time=10 ms"]
    head = players.head(player.fragment(run_of(SMALL, *wavy)))
    away = np.hypot(*players.points(head, "shell")[:, 1:].T)
    assert (away.min(), away.max()) == pytest.approx((0.028, 0.032), abs=0.03 / 1000)
    assert head["upper"][:2] == pytest.approx([0.02, 0.032], rel=1e-3)


@pytest.mark.slow
def test_worn_parts_are_those_of_the_file_each_in_the_frame_of_its_motion(run_of):
    """Triangles within a step of those in the file, all of them, with the facet of each; 1 % of the values."""
    run = run_of(MOVING, "wear.archard=1e-4", "wear.hardness=8 GPa")
    bodies, values = players.worn(player.fragment(run))
    wear, points = Wear(run), run.read("statistics/wear/mesh/points").astype(float).reshape(-1, 3, 3)
    facet, names = run.read("statistics/wear/mesh/facet"), list(run.first_poses())
    assert {(body["motion"], body["shell"]) for body in bodies} == {(-1, True), (0, False)}
    shown = np.concatenate([body["facet"] for body in bodies])
    assert np.array_equal(np.bincount(shown), np.bincount(facet))
    for body in bodies:
        kept = np.isin(facet, body["facet"])
        start = run.first_poses()[names[body["motion"]]] if body["motion"] >= 0 else np.eye(3, 4)
        there = body["corners"] @ start[:, :3].T + start[:, 3]
        assert np.array_equal(facet[kept], body["facet"])
        assert abs(there - points[kept]).max() < body["step"]
    assert list(values) == ["sliding_power", "normal_power", "archard_rate"]
    for one in players.head(player.fragment(run))["wear"]["values"]:
        within = np.clip(wear[one["name"]], one["low"], one["limit"])
        assert values[one["name"]] == pytest.approx(np.where(wear[one["name"]] > 0, within, 0), rel=0.02)
        assert (within < one["limit"]).any() and (within > one["low"]).any()


@pytest.mark.slow
def test_a_file_without_wear_or_coefficients_offers_no_such_colours(run_of, copy):
    assert list(players.worn(player.fragment(run_of(SMALL)))[1]) == ["sliding_power", "normal_power"]
    with h5py.File(copy, "r+") as old:
        del old["statistics/wear"]
    with Run(copy) as run:
        fragment = player.fragment(run)
    assert players.head(fragment)["wear"] is None
    assert "optgroup" not in fragment and "mp-worn" not in fragment and player.WEAR not in fragment


@pytest.mark.slow
def test_the_edges_of_bodies_are_there_so_that_a_worn_blade_is_seen_before_a_wall_of_its_colour(run_of):
    run = run_of(MOVING)
    bodies = players.head(player.fragment(run))["bodies"]
    edges = [np.frombuffer(base64.b64decode(one["creases"]["lines"]), "<f4").reshape(-1, 2, 3) for one in bodies]
    assert not len(edges[0]) and any(map(len, edges[1:]))  # the container has bars of its own
    for one, lines in zip(bodies, edges):
        points = np.frombuffer(base64.b64decode(one["points"]), "<f4").reshape(-1, 3)
        assert all((np.abs(points - end).max(axis=1) < 1e-7).any() for end in lines.reshape(-1, 3))


@pytest.mark.slow
def test_runs_beside_each_other_have_one_scale_of_wear(run_of):
    runs = [run_of(SMALL), run_of(SMALL.replace("600 rpm", "1200 rpm"))]
    alone, both = [player.scales([run])["sliding_power"] for run in runs], player.scales(runs)["sliding_power"]
    assert alone[0][1] < both[1] <= alone[1][1]
    shown = players.head(player.fragment(runs[0], limits=player.scales(runs)))["wear"]["values"][0]
    assert (shown["low"], shown["limit"]) == both


@pytest.mark.slow
def test_up_is_against_gravity_whichever_way_that_is(run_of):
    run = run_of(SMALL, "gravity.acceleration=-9.81 0 0 m/s^2", "run.time=10 ms")
    head = players.head(player.fragment(run))
    assert head["up"] == [1, 0, 0]
    assert all(abs(np.linalg.norm(view) - 1) < 1e-12 for view in head["views"].values())


@pytest.mark.slow
def test_the_same_run_gives_the_same_bytes(mixed):
    assert player.fragment(mixed) == player.fragment(mixed)


# ---- the room there is


@pytest.mark.parametrize("most", [60_000, 45_000, 36_000])
@pytest.mark.slow
def test_a_fragment_fits_the_room_it_is_given(run_of, most):
    run = run_of(SMALL, "balls.count=150", "output.frames=1 ms", "balls.diameter=4 mm")
    fragment = player.fragment(run, most_bytes=most)
    assert 0.4 * most < len(fragment.encode()) <= most  # strides are whole numbers
    head, (position, _) = players.head(fragment), players.decode(fragment)
    stride = round(head["times"][1] / 1e-3)
    assert stride > 1 and head["times"] == pytest.approx(np.arange(0, 51, stride) * 1e-3)
    thinned = -(-150 // head["drawn"])
    there = players.stored(run, "position", range(0, 51, stride))[:, ::thinned]
    assert abs(position - there).max() < 1e-6
    assert "stored frame, " in fragment


@pytest.mark.slow
def test_at_most_three_hundred_frames_are_there(run_of):
    fragment = player.fragment(run_of(SMALL, "output.frames=0.15 ms", "balls.count=5"))
    assert len(players.head(fragment)["times"]) == 167
    assert "The player has every 2nd stored frame, 167 of 334." in fragment


def test_of_very_many_balls_every_kth_is_drawn_and_the_page_says_so(mixed, monkeypatch):
    monkeypatch.setattr(frames, "MOST_BALLS", 70)
    fragment = player.fragment(mixed)
    position, _ = players.decode(fragment)
    assert abs(position - players.stored(mixed, "position", range(11))[:, ::3]).max() < 1e-6
    assert [run[:2] for run in players.head(fragment)["runs"]] == [[40, 0.005], [27, 0.003]]
    assert "every 3rd ball is drawn, 67 of 200" in fragment


@pytest.mark.parametrize("last", [False, True])
def test_frames_are_left_out_before_balls(mixed, last):
    packed = frames.pack(mixed, 5000, player.scales([mixed]), last)
    assert len(packed.chosen) == 200 and 1 < len(packed.index) < 11 and len(packed.data) <= 5000
    assert packed.index[-1] == 10 or not last
    assert len(set(np.diff(packed.index))) <= 1 and (not last or np.diff(packed.index)[0] == 1)


def test_where_nothing_fits_one_frame_of_the_fewest_balls_is_there(mixed, monkeypatch):
    monkeypatch.setattr(frames, "FEWEST_BALLS", 60)
    packed = frames.pack(mixed, 0, player.scales([mixed]))
    assert (len(packed.index), len(packed.chosen)) == (1, 67)


@pytest.mark.slow
def test_the_still_picture_leaves_the_room_to_the_balls(mixed):
    noise = np.random.default_rng(1).integers(0, 256, (540, 960, 3), np.uint8)
    Image.fromarray(noise).save(store := io.BytesIO(), format="png")
    small = parts.smaller(store.getvalue(), 80_000)
    assert small.startswith(b"\x89PNG") and len(small) < 80_000 < len(store.getvalue())
    assert parts.smaller(small, 80_000) is small
    (fragment,) = parts.balls([mixed], "never", print, print, 120_000)
    assert len(fragment) < 120_000 and players.head(fragment)["drawn"] == 200 and "ball is drawn" not in fragment


@pytest.mark.slow
def test_a_still_counts_as_well(run_of):
    run = run_of(SMALL, "balls.count=150", "output.frames=1 ms", "balls.diameter=4 mm")
    fragment = player.fragment(run, most_bytes=80_000, still=b"\x89PNG" + bytes(20_000))
    assert len(fragment.encode()) <= 80_000
    assert 'src="data:image/png;base64,iVBOR' in fragment


# ---- the page


def test_a_run_without_frames_says_so_and_shows_the_still(run_of):
    fragment = player.fragment(run_of(SMALL, "output.frames=0 s"), still=b"\x89PNG")
    assert "No ball states are stored in this run: output.frames is 0 s." in fragment
    assert "data:image/png;base64,iVBO" in fragment and "<script" not in fragment


def test_what_is_seen_is_said(mixed):
    fragment = player.fragment(mixed)
    assert "120 balls “coarse” of 5 mm, 80 balls “fine” of 3 mm." in fragment
    assert "Frames are 5 ms apart" in fragment
    assert "the rotor turns by 18°" in fragment


def test_no_name_in_a_file_becomes_part_of_the_page(copy):
    evil = "</script><script>alert(1)</script><!--"
    with h5py.File(copy, "r+") as file:
        names = file["particles/trajectory/species"].attrs
        del names["names"]
        names.create("names", [evil, "fine"], dtype=h5py.string_dtype())
    with Run(copy) as run:
        fragment = player.fragment(run)
    seen = []

    class Reader(html.parser.HTMLParser):
        def handle_starttag(self, tag, attributes):
            seen.append((tag, dict(attributes).get("class")))

        def handle_comment(self, data):
            seen.append(("comment", data))

    Reader().feed(fragment)
    scripts = [name for tag, name in seen if tag == "script"]
    assert scripts == ["mp-head", "mp-data", "mp-worn"]
    assert not any(tag == "comment" for tag, _ in seen)
    assert "&lt;script&gt;alert(1)" in fragment


@pytest.mark.slow
def test_a_page_of_its_own_needs_nothing_else_and_runs_only_our_scripts(mixed):
    text = player.page(mixed, "<b>mixed\n")
    assert "<title>&lt;b&gt;mixed?</title>" in text
    assert player.fragment(mixed) in text and player.scripts() in text
    allowed = re.search('Content-Security-Policy" content="([^"]*)"', text)[1]
    hashes = set(re.findall("sha256-([^&]*)&#39;", allowed))
    assert allowed.startswith("default-src &#39;none&#39;") and len(hashes) == 3
    for script in re.findall(r"<script>(.*?)</script>", text, re.S):
        assert base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() in hashes
    assert not re.search(r'(src|href)="(?!data:)', text.replace(player.scripts(), ""))


def test_the_scripts_hold_the_licence_and_end_where_they_should():
    scripts = player.scripts()
    assert scripts.count("</script>") == scripts.count("<script>") == 3
    assert "<!--" not in scripts
    assert "three.js 0.187.0" in scripts
    licence = (VENDOR / "three-LICENSE.txt").read_text("utf-8")
    assert licence.startswith("The MIT License") and licence.strip() in scripts


def test_the_vendored_bundle_is_the_one_its_readme_tells_of():
    readme = (VENDOR / "README.md").read_text("utf-8")
    digest = hashlib.sha256((VENDOR / "three.min.js").read_bytes()).hexdigest()
    assert f"{digest}  three.min.js" in readme
