"""The 3D player of the report in a browser: what is drawn is what was stored, and every button and key does its
work."""

import shutil

import h5py
import numpy as np
import players
import pytest

from milltools.figures.style import SPEEDS
from milltools.geometry.trajectory import Trajectory
from milltools.player import player
from milltools.read.runfile import Run

pytestmark = pytest.mark.browser

pytest_plugins = ["browser"]

CANVAS = ".mp-canvas"
THERE = "millPlayers[0].ready"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A run of 120 balls of 5 mm and 80 of 3 mm, 11 frames."""
    return players.simulate(tmp_path_factory.mktemp("mixed"), players.MIXED)


@pytest.fixture(scope="module")
def fragment(file):
    with Run(file) as run:
        return player.fragment(run, still=players.red())


@pytest.fixture(scope="module")
def mixed(fragment, tmp_path_factory):
    """Its page."""
    return players.write_page(tmp_path_factory.mktemp("page") / "mixed.html", fragment)


@pytest.fixture(scope="module")
def shared(keep_page, mixed):
    page = keep_page(mixed)
    assert page.evaluate(THERE) is True
    return page


@pytest.fixture
def page(shared):
    """The page, opened once and set back for every test: front view, colours of speed, frame 9 of 0 to 10."""
    shared.page.set_viewport_size({"width": 640, "height": 480})
    shared.page.emulate_media(media="screen", color_scheme="light", reduced_motion="reduce")
    shared.until("document.querySelector('.mp-canvas').width === 640")
    shared.evaluate("millPlayers[0].reset(); millPlayers[0].colourBy('speed'); millPlayers[0].show(9)")
    yield shared
    shared.check()


@pytest.fixture
def page_of(tmp_path):
    """page_of(run file) writes a page and returns its path."""

    def write(path, **options):
        with Run(path) as run:
            return players.write_page(tmp_path / "page.html", player.fragment(run, **options))

    return write


@pytest.fixture(scope="module")
def painted(keep_page, file, tmp_path_factory):
    """A page without a still of the run changed: from frame 1 on all balls of frame k are k m/s fast; in frame 0 a big
    and a small ball alone are fast, at y = 20 and -20 mm before all others."""
    folder = tmp_path_factory.mktemp("painted")
    path = shutil.copy(file, folder / "painted.h5")
    speed = np.zeros((11, 200, 3), np.float32)
    speed[:, :, 1] = np.arange(11)[:, None]
    speed[0, [0, -1], 1] = 10
    with Run(path) as run:
        place = players.stored(run, "position", range(11)).astype(np.float32)
    place[0, :, 0] = -0.015
    place[0, 0], place[0, -1] = (0.015, 0.02, 0), (0.015, -0.02, 0)
    trajectory = "particles__trajectory__"
    players.change(path, **{f"{trajectory}position__value": place, f"{trajectory}velocity__value": speed})
    with Run(path) as run:
        page = keep_page(players.write_page(folder / "page.html", player.fragment(run)))
    assert page.evaluate(THERE) is True
    return page


@pytest.fixture(scope="module")
def close(tmp_path_factory, keep_page):
    """(page, run file) of frames so close that states between them are drawn, and a log of impacts."""
    folder = tmp_path_factory.mktemp("close")
    words = ("output.frames=1 ms", "output.impacts=all", "run.time=0.1 s")
    path = players.simulate(folder, players.MIXED, *words)
    with Run(path) as run:
        page = keep_page(players.write_page(folder / "page.html", player.fragment(run)))
    assert page.evaluate(THERE) is True
    return page, path


# ---- between two frames


@pytest.mark.slow
def test_between_close_frames_a_ball_with_at_most_one_impact_is_where_it_was(close):
    page, path = close
    with Run(path) as run:
        trajectory, shares = Trajectory(run), []
        for time in (0.0203, 0.0505, 0.0808):
            drawn = np.reshape(
                page.evaluate("(t) => { millPlayers[0].at(t); return [...millPlayers[0].positions()]; }", time), (-1, 3)
            )
            right = trajectory.at(time)
            known = ~trajectory.flights(int(time * 1e3)).unknown
            off = np.linalg.norm(drawn - right.position, axis=1)[known]
            assert np.quantile(off, 0.98) < 20e-6 and off.max() < 200e-6  # velocities have eight bits
            shares.append(known.mean())
            pose = page.evaluate("[...millPlayers[0].pose('rotor')]")
            assert pose == pytest.approx(run.rotor_pose(time)["rotor"].ravel(), abs=1e-6)
    assert min(shares) > 0.5


@pytest.mark.slow
def test_hard_impacts_flash_for_a_while_unless_switched_off(close):
    page, path = close
    with Run(path) as run:
        hardest = int(np.argmax(run.read("impacts/dissipation")))
        time = float(run.read("impacts/time", hardest))
    count = "(t) => { millPlayers[0].at(t); millPlayers[0].view.draw(); return millPlayers[0].flashes(); }"
    assert page.evaluate(count, time + 1e-5) > 0
    page.evaluate("document.querySelector('.mp-flashes').click()")
    assert page.evaluate(count, time + 1e-5) == 0
    page.evaluate("document.querySelector('.mp-flashes').click()")


def test_frames_that_are_far_apart_are_shown_as_they_are(page):
    page.evaluate("millPlayers[0].at(0.0222)")
    assert page.evaluate("[millPlayers[0].frame, millPlayers[0].clock]") == [4, 0.02]
    assert page.evaluate("document.querySelector('.mp-flashes')") is None


# ---- what is drawn


def test_the_balls_are_seen_and_nothing_is_asked_of_a_network(page):
    picture = page.picture(CANVAS)
    assert picture.shape == (360, 640, 3)
    assert 0.03 < players.coloured(picture).mean() < 0.8
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000
    page.check()


def test_it_does_not_start_by_itself_for_who_prefers_no_motion(page):
    assert not page.evaluate("millPlayers[0].playing")
    assert page.evaluate("millPlayers[0].draws") > 0


def test_the_balls_stand_where_the_run_has_them_in_every_frame(page, fragment, file):
    drawn = page.evaluate(
        "[...Array(millPlayers[0].frames).keys()].map((k) => { millPlayers[0].show(k);"
        " return [[...millPlayers[0].positions()], [...millPlayers[0].levels()], [...millPlayers[0].pose('rotor')]]; })"
    )
    position, levels = players.decode(fragment)
    with Run(file) as run:
        there = players.stored(run, "position", range(11))
        poses = [run.poses(k)["rotor"].ravel() for k in range(11)]
    for k, (centres, level, pose) in enumerate(drawn):
        centres = np.reshape(centres, (-1, 3))
        assert abs(centres - position[k]).max() < 1e-8  # single precision
        assert abs(centres - there[k]).max() < 2e-6
        assert level == levels["speed"][k].tolist()
        assert pose == pytest.approx(poses[k], abs=1e-6)


def test_balls_of_a_kind_have_its_size(painted):
    """Of the two red balls, seen from the end, the bigger one covers (5/3)^2 of the smaller one's pixels."""
    painted.evaluate("millPlayers[0].show(0); millPlayers[0].look('end')")
    seen = painted.picture(CANVAS)
    ball = players.coloured(seen) & (seen[..., 0].astype(int) > seen[..., 2])
    half = ball.shape[1] // 2
    small, big = ball[:, :half].sum(), ball[:, half:].sum()  # +y is right, seen from +x
    assert small > 100
    assert big / small == pytest.approx((5 / 3) ** 2, rel=0.2)


def test_colours_follow_the_map(painted):
    """The colour seen at the speed of k tenths is nearest to the map's own there."""
    assert painted.page.locator(".mp-ticks span").last.inner_text() == "≥ 10 m/s"
    shares = np.array([2, 5, 8]) / 10
    table = SPEEDS(shares)[:, :3]
    table = table / np.linalg.norm(table, axis=1)[:, None]
    for expected, share in enumerate(shares):
        painted.evaluate("(k) => millPlayers[0].show(k)", round(10 * share))
        seen = painted.picture(CANVAS)
        mean = seen[players.coloured(seen)].astype(float).mean(axis=0)
        assert np.argmax(table @ (mean / np.linalg.norm(mean))) == expected
    painted.check()


def test_a_blade_points_where_the_rotor_is(open_page, tmp_path, page_of):
    """One blade seen from the end: its grey leans as the angle says, from +y (right) towards +z (up)."""
    page = open_page(page_of(players.simulate(tmp_path, players.LONE)))
    page.evaluate(THERE)
    page.evaluate("millPlayers[0].look('end')")
    for frame in (1, 8):
        page.evaluate("(k) => millPlayers[0].show(k)", frame)
        seen = page.picture(CANVAS).astype(int)
        steel = seen.sum(axis=2) < 480
        y, x = np.mgrid[0:360, 0:640] + 0.5
        across, up = x - 320, 180 - y
        away = np.hypot(across, up) / (0.5 * 360 / 1.1)  # about the drum's radius
        tip = steel & (away > 0.35) & (away < 0.65)
        assert tip.sum() > 30
        angle = np.arctan2(up[tip].mean(), across[tip].mean())
        expected = np.radians(20 + 18 * frame)
        assert abs((angle - expected + np.pi) % (2 * np.pi) - np.pi) < np.radians(4)
    page.check()


def test_the_wear_of_a_blade_turns_with_it_and_balls_have_no_colour_then(open_page, tmp_path, page_of):
    """Only the blade is worn: in this choice its colour, the map's brightest, is the only one, where the blade is."""
    path = players.simulate(tmp_path, players.LONE.replace("count = 1\n", "count = 60\n", 1))
    with h5py.File(path, "r+") as file:
        wear = file["statistics/wear"]
        kinds = [str(kind) for kind in wear["parts/kind"].attrs["kinds"]]
        blade = wear["parts/kind"][()][wear["part"][()]] == kinds.index("ball_blade")
        wear["sliding_power"][...] = np.where(blade, 2e4, 0)
    page = open_page(page_of(path))
    page.evaluate(THERE)
    assert players.coloured(page.picture(CANVAS)).any()
    page.page.locator(".mp-colour").select_option("sliding_power")
    assert page.page.locator(".mp-ticks span").last.inner_text() == "≥ 20 kW/m²"
    page.evaluate("(async () => { await millPlayers[0].colourBy('sliding_power'); millPlayers[0].look('end'); })()")
    for frame in (1, 8):
        page.evaluate("(k) => millPlayers[0].show(k)", frame)
        seen = page.picture(CANVAS)
        worn = players.coloured(seen)
        assert worn.sum() > 300 and (seen[worn].astype(int)[:, 1] > 100 + seen[worn].astype(int)[:, 2]).mean() > 0.9
        y, x = np.argwhere(worn).mean(axis=0) + 0.5
        expected = np.radians(20 + 18 * frame)
        assert abs((np.arctan2(180 - y, x - 320) - expected + np.pi) % (2 * np.pi) - np.pi) < np.radians(4)
    page.evaluate("millPlayers[0].colourBy('speed')")
    assert players.coloured(page.picture(CANVAS)).any()
    page.check()


def test_beside_wear_a_run_whose_file_has_none_is_shown_without_colours(open_page, file, fragment, tmp_path):
    with h5py.File(shutil.copy(file, tmp_path / "old.h5"), "r+") as old:
        del old["statistics/wear"]
    with Run(tmp_path / "old.h5") as run:
        plain = player.fragment(run)
    linked = f'<div class="mp-linked"><div class="mp-shared"></div>{fragment}{plain}</div>'
    page = open_page(players.write_page(tmp_path / "two.html", linked), height=1100)
    assert page.evaluate("Promise.all(millPlayers.map((p) => p.ready))") == [True, True]
    for name, wanted in (("sliding_power", [True, False]), ("speed", [True, True])):
        page.page.locator(".mp-colour").first.select_option(name)
        page.until(f"Boolean(millPlayers[0].view.coated) === {str(name != 'speed').lower()}")
        seen = page.picture()
        boxes = [page.page.locator(CANVAS).nth(k).bounding_box() for k in (0, 1)]
        parts = [seen[int(b["y"]) : int(b["y"] + b["height"]), int(b["x"]) : int(b["x"] + b["width"])] for b in boxes]
        assert [players.coloured(part).any() for part in parts] == wanted
    page.check()


# ---- buttons and keys


def test_the_slider_moves_the_balls(page, fragment):
    slider, before = page.page.get_by_role("slider", name="Time"), page.picture(CANVAS)
    slider.fill("7")
    assert page.page.locator(".mp-time").inner_text() == "t = 35 ms"
    assert slider.get_attribute("aria-valuetext") == "t = 35 ms"
    shown = np.reshape(page.evaluate("[...millPlayers[0].positions()]"), (-1, 3))
    assert abs(shown - players.decode(fragment)[0][7]).max() < 1e-8
    after = page.picture(CANVAS)
    assert (abs(after.astype(int) - before) > 40).any(axis=2).mean() > 0.02
    slider.press("ArrowRight")
    assert page.evaluate("millPlayers[0].frame") == 8


def test_the_choice_of_colours_changes_balls_and_bar(page, fragment):
    speed = page.picture(CANVAS)
    ends = []
    for name, label in (("spin", "spin"), ("energy", "kinetic energy"), ("speed", "speed")):
        page.page.locator(".mp-colour").select_option(label=label)
        assert page.evaluate("[...millPlayers[0].levels()]") == players.decode(fragment)[1][name][9].tolist()
        ends.append(page.page.locator(".mp-ticks span").last.inner_text())
        assert label in page.page.locator(".mp-bar").get_attribute("aria-label")
        same = (page.picture(CANVAS) == speed).all()
        assert same == (name == "speed")
    assert [end.split()[-1] for end in ends] == ["rad/s", "µJ", "m/s"]


def test_play_runs_through_the_frames_at_the_pace_that_is_chosen(page):
    assert page.page.get_by_label("Slow motion").locator("option:checked").inner_text() == ("1/20 of real time")
    page.page.get_by_label("Slow motion").select_option(label="1/10 of real time")
    page.page.get_by_role("button", name="Play").click()
    page.until("millPlayers[0].frame >= 4")
    page.page.get_by_role("button", name="Pause").click()
    frame = page.evaluate("millPlayers[0].frame")
    page.page.wait_for_timeout(300)
    assert page.evaluate("millPlayers[0].frame") == frame


def test_a_slow_motion_of_a_tenth_shows_a_frame_of_5_ms_for_50_ms(page):
    page.page.get_by_label("Slow motion").select_option(label="1/10 of real time")
    seen = page.evaluate(
        "(p => { p.show(2); p.begin(); p.advance(1000);"
        " return [1040, 1060, 1090, 1110].map((now) => { p.advance(now); return p.frame; }); })(millPlayers[0])"
    )
    assert seen == [2, 3, 3, 4]


def test_it_plays_from_the_start_again_after_the_end(page):
    page.evaluate("millPlayers[0].show(10); millPlayers[0].play()")
    page.until("millPlayers[0].frame < 10 && millPlayers[0].playing")


def test_the_keyboard_does_what_the_mouse_does(page):
    page.page.locator(CANVAS).focus()
    keys = page.page.keyboard
    eye = "millPlayers[0].view.camera.position.toArray()"
    seen = [page.evaluate(eye)]
    for key in ("ArrowLeft", "ArrowUp", "+", "-", "ArrowRight", "ArrowDown"):
        keys.press(key)
        seen.append(page.evaluate(eye))
    away = np.linalg.norm(seen, axis=1)
    assert seen[1] != seen[0] and seen[2][2] > seen[1][2]
    assert away[3] < 0.95 * away[0] and away[4] == pytest.approx(away[0])
    assert seen[-1] == pytest.approx(seen[0])
    keys.press("Home")
    keys.press(".")
    keys.press(".")
    keys.press(",")
    assert page.evaluate("millPlayers[0].frame") == 1
    keys.press("Space")
    assert page.evaluate("millPlayers[0].playing")
    keys.press("Space")
    assert not page.evaluate("millPlayers[0].playing")
    keys.press("ArrowLeft")
    keys.press("Home")
    assert page.evaluate("millPlayers[0].frame") == 0
    assert page.evaluate(eye) == pytest.approx(seen[0])


def test_the_mouse_turns_it_and_the_wheel_scrolls_the_page_until_the_mill_was_clicked(page):
    page.evaluate("document.activeElement.blur()")
    eye = "millPlayers[0].view.camera.position.toArray()"
    mouse, first = page.page.mouse, page.evaluate(eye)
    mouse.move(320, 150)
    mouse.wheel(0, 100)
    page.until("scrollY > 20")
    assert page.evaluate(eye) == first
    page.evaluate("scrollTo(0, 0)")
    mouse.down()
    mouse.move(360, 160)
    mouse.up()
    turned = page.evaluate(eye)
    assert turned != first
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(first))
    mouse.wheel(0, -100)
    page.until(f"Math.hypot(...{eye}) < {0.99 * np.linalg.norm(first)}")
    assert page.evaluate("scrollY") == 0


def test_a_finger_turns_the_mill_sideways_and_scrolls_the_page_upwards(open_page, tmp_path, fragment):
    file = players.write_page(tmp_path / "tall.html", fragment, '<div class="tall"></div>')
    page = open_page(file, width=360, height=640, touch=True)
    page.evaluate(THERE)
    eye = "millPlayers[0].view.camera.position.toArray()"
    first = page.evaluate(eye)
    page.swipe(180, 200, 0, -120)
    page.until("scrollY > 50")
    page.page.wait_for_timeout(100)
    assert page.evaluate(eye) == pytest.approx(first)
    page.evaluate("scrollTo(0, 0)")
    page.swipe(100, 200, 120, 0)
    assert np.linalg.norm(np.subtract(page.evaluate(eye), first)) > 0.03
    assert page.evaluate("scrollY") == 0
    page.check()


def test_every_view_shows_the_whole_drum_and_each_another_side(page):
    pictures = []
    for name in ("Front", "Three-quarter", "End"):
        page.page.get_by_role("button", name=name, exact=True).click()
        pictures.append(page.picture(CANVAS))
        seen = players.coloured(pictures[-1])
        border = np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]])
        assert seen.mean() > 0.05 and not border.any()
    assert all((a != b).any() for a, b in zip(pictures, pictures[1:], strict=False))


# ---- surroundings


def test_it_starts_when_it_comes_into_sight_and_rests_when_it_leaves(open_page, tmp_path, fragment):
    file = players.write_page(tmp_path / "tall.html", '<div class="tall"></div>', fragment)
    page = open_page(file, motion=True, before="performance.now = () => 0")  # a fast machine
    page.page.wait_for_timeout(100)
    assert page.evaluate("millPlayers[0].view === undefined")  # nothing is even unpacked
    page.evaluate("scrollTo(0, 4000)")
    page.until("millPlayers[0].playing && millPlayers[0].frame > 1")
    page.evaluate("scrollTo(0, 0)")
    page.until("!millPlayers[0].visible")
    draws = [page.evaluate("millPlayers[0].draws")]
    while len(draws) < 10 and draws[-1] not in draws[:-1]:  # a picture that was begun may take long
        page.page.wait_for_timeout(500)
        draws.append(page.evaluate("millPlayers[0].draws"))
    assert draws[-1] == draws[-2]
    page.evaluate("scrollTo(0, 4000)")
    page.until(f"millPlayers[0].draws > {draws[-1] + 2}")
    page.check()


def test_two_players_on_a_page_do_not_mind_each_other(open_page, tmp_path, fragment):
    page = open_page(players.write_page(tmp_path / "two.html", fragment, fragment), height=900)
    assert page.evaluate("Promise.all(millPlayers.map((p) => p.ready))") == [True, True]
    first, second = (page.page.locator(CANVAS).nth(k) for k in (0, 1))
    before = second.screenshot()
    page.page.get_by_role("slider", name="Time").first.fill("6")
    page.page.locator(".mp-colour").first.select_option("spin")
    assert page.evaluate("millPlayers.map((p) => p.frame)") == [6, 0]
    assert page.evaluate("millPlayers.map((p) => p.by.name)") == ["spin", "speed"]
    assert second.screenshot() == before != first.screenshot()
    page.check()


def test_it_follows_the_window_and_never_grows_wider(page):
    page.page.set_viewport_size({"width": 360, "height": 640})
    page.until("document.querySelector('.mp-canvas').width === 360")
    assert page.evaluate("document.documentElement.scrollWidth") == 360
    assert page.picture(CANVAS).shape == (360, 360, 3)
    assert players.coloured(page.picture(CANVAS)).mean() > 0.1


def test_light_and_dark_are_told_apart(page):
    drums = []
    for scheme in ("light", "dark"):
        page.page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        page.page.wait_for_timeout(50)
        seen = page.picture(CANVAS)
        assert (seen[2:20, 2:20].mean() < 80) == (scheme == "dark")
        drums.append(page.evaluate("millPlayers[0].view.shell.color.getHex()"))
    assert drums[0] < drums[1]


def test_a_lost_context_is_said_and_comes_back(page):
    before = page.picture(CANVAS)
    page.evaluate(
        "window.gl = millPlayers[0].view.renderer.getContext().getExtension('WEBGL_lose_context'); gl.loseContext()"
    )
    page.until("millPlayers[0].lost")
    assert "graphics driver" in page.page.get_by_role("status").inner_text()
    page.evaluate("millPlayers[0].show(3)")
    page.evaluate("gl.restoreContext()")
    page.until("!millPlayers[0].lost")
    assert not page.page.get_by_role("status").is_visible()
    page.evaluate("millPlayers[0].show(9)")
    assert abs(page.picture(CANVAS).astype(int) - before).mean() < 1


# ---- where it cannot be


@pytest.mark.parametrize(
    "missing, words",
    [
        ("HTMLCanvasElement.prototype.getContext = () => null", "needs WebGL 2"),
        ("delete window.DecompressionStream", "DecompressionStream"),
        ("damaged data", "failed"),
        ("scripts", "needs JavaScript"),
    ],
)
def test_what_cannot_be_leaves_the_still_and_a_line(open_page, tmp_path, fragment, missing, words):
    data, scripts = players.part(fragment, "data"), missing != "scripts"
    shown = fragment.replace(data, data[:400]) if missing == "damaged data" else fragment
    before = missing if "." in missing else ""
    page = open_page(players.write_page(tmp_path / "a.html", shown), before=before, scripts=scripts)
    assert not scripts or page.evaluate(THERE) is False
    assert words in page.page.locator("figure").inner_text()
    assert page.page.locator(".mp-still").is_visible() and not page.page.locator(".mp-controls").is_visible()
    seen = page.picture(".mp-stage").astype(int)
    assert ((seen[..., 0] > 200) & (seen[..., 1] < 60)).mean() > 0.8
    page.check()


def test_on_paper_there_is_the_still(page):
    page.page.emulate_media(media="print", reduced_motion="reduce")
    assert page.page.locator(".mp-still").is_visible()
    assert not page.page.locator(CANVAS).is_visible()
    assert not page.page.locator(".mp-controls").is_visible()


def test_on_paper_without_a_still_there_is_what_was_seen(painted):
    painted.evaluate("millPlayers[0].show(9)")
    painted.evaluate("dispatchEvent(new Event('beforeprint'))")
    painted.page.emulate_media(media="print", reduced_motion="reduce")
    painted.until("document.querySelector('.mp-still').naturalWidth === 640")
    assert players.coloured(painted.picture(".mp-stage")).mean() > 0.03
    assert painted.page.locator(".mp-bar").is_visible()
    assert not painted.page.get_by_role("button").first.is_visible()
    painted.page.emulate_media(media="screen", reduced_motion="reduce")


def test_a_run_without_frames_has_the_still_and_no_player(open_page, tmp_path, page_of):
    page = open_page(page_of(players.simulate(tmp_path, players.LONE, "output.frames=0 s"), still=players.red()))
    assert page.evaluate(THERE) is False
    assert "No ball states are stored" in page.page.get_by_role("status").inner_text()
    assert page.page.locator(".mp-still").is_visible()
    page.check()
