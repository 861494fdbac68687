"""Pictures of a run in 3D: what stands where in them, in which colour; the scenes for POV-Ray."""

import ctypes.util
import dataclasses
import os
import re
import shutil
import subprocess
import sys

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL

from milltools.base.errors import UserError
from milltools.geometry import contour
from milltools.geometry.bodies import Mill
from milltools.geometry.trajectory import State
from milltools.read.runfile import Run
from milltools.render import camera, colour, overlay, pov, scene
from milltools.render.shade import Shade, View

pytestmark = pytest.mark.render

SIZE = (320, 180)
WHITE = (1.0, 1.0, 1.0), (1.0, 1.0, 1.0)
DRUM = "[drum]\nradius = 30 mm\nlength = 40 mm\n"
BALLS = "[run]\ntime = 2 ms\n[balls]\ncount = 20\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
REST = "[contact]\nrestitution = 0.8\n[output]\nframes = 1 ms\n"
WAVY = DRUM + "profile = wavy\nbuckles = 4\nbuckle_height = 4 mm\n"
DECKS = {
    "mill": SMALL.replace("50 ms", "20 ms"),
    "still": BALLS + DRUM + REST,  # no rotor
    "wavy": BALLS + WAVY + REST,
    "one": BALLS.replace("20", "1") + DRUM + REST,
    "mixture": BALLS.replace("[balls]", "[balls.small]")
    + "[balls.large]\ncount = 10\ndiameter = 9 mm\ndensity = 7800 kg/m^3\n"
    + DRUM
    + REST,
    "pitched": SMALL.replace("50 ms", "2 ms").replace("[contact]", "pitch = 60 deg\n[contact]"),
    "hostile": '# "} #debug <script> union{ */\n' + BALLS + DRUM + REST,
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """runs(name) is the open Run of one of DECKS."""
    folder, made = tmp_path_factory.mktemp("runs"), {}

    def run(name):
        if name not in made:
            (folder / f"{name}.ini").write_text(DECKS[name])
            words = [PROGRAM, "-q", f"{name}.ini"]
            subprocess.run(words, cwd=folder, check=True, capture_output=True, timeout=60)
            made[name] = Run(folder / f"{name}.h5")
        return made[name]

    yield run
    for each in made.values():
        each.close()


def state(position, speed=1.0, time=0.0, poses=None):
    """Balls at places (N, 3) [m] with speeds along z [m/s]."""
    position = np.asarray(position, float)
    velocity = np.zeros_like(position)
    velocity[:, 2] = speed
    return State(time, position, velocity, np.zeros_like(position), poses=poses)


def stored(run, index=-1):
    index %= len(run.frame_times())
    columns = ("position", "velocity", "angular_velocity")
    values = (run.frame(index, c).astype(float) for c in columns)
    return State(float(run.frame_times()[index]), *values, poses=run.poses(index))


def picture(run, what, view="end", size=SIZE, quality="draft", limits=(0.0, 4.0), **options):
    """The picture of a state, and the camera as it stood."""
    view = camera.of(view, run) if isinstance(view, str) else view
    options = {"overlay": False, "background": WHITE, **options}
    colours = colour.of(run, "speed", limits)
    with scene.Scene(run, size, quality, view, colours, **options) as drawn:
        return drawn.draw(what), drawn.camera


def project(view, points, size):
    """Where points (K, 3) [m] are in a picture of `size` pixels by a camera.Camera: x from the left, y from the top,
    depth [m]; (K, 3)."""
    right, up, depth = view.axes @ (np.asarray(points, float) - view.eye).T
    half = view.height / 2 if view.angle == 0 else np.tan(np.radians(view.angle) / 2) * depth
    return np.stack([size[0] / 2 + right * size[1] / 2 / half, (1 - up / half) * size[1] / 2, depth], axis=1)


def at(image, view, point):
    """Colour of the pixel where a place [m] is seen."""
    height, width = image.shape[:2]
    x, y = project(view, [point], (width, height))[0, :2]
    return image[int(y), int(x)].astype(int)


def grid(count, x=0.015, step=0.009):
    """Places apart from each other in a plane across the drum."""
    side = int(np.ceil(np.sqrt(count)))
    steps = (np.arange(side) - (side - 1) / 2) * step
    places = [(x, y, z) for z in steps for y in steps]
    return np.array(places[:count])


def share_in_map(pixel):
    """Where in the colour map (0..1) a pixel's hue is, however brightly it is lit; without the map's dark ends."""
    table = colour.Colour("speed", (0.0, 1.0)).rgb(np.linspace(0.12, 0.88, 200)).astype(float)
    table /= np.linalg.norm(table, axis=1)[:, None]
    hue = pixel / np.linalg.norm(pixel)
    return 0.12 + 0.76 * np.argmax(table @ hue) / 199


# ---- pictures


@pytest.mark.parametrize("quality", ["draft", "final"])
def test_a_picture_has_the_size_asked_for_and_is_not_uniform(runs, quality):
    run = runs("mill")
    image, _ = picture(run, stored(run), "front", quality=quality, overlay=True)
    assert image.shape == (180, 320, 3) and image.dtype == np.uint8
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 200


@pytest.mark.parametrize("quality", ["draft", "final"])
def test_every_ball_has_the_colour_of_its_value_in_the_maps_order(runs, quality):
    run = runs("still")
    speeds = np.linspace(0.6, 3.4, 20)
    places = grid(20)
    image, view = picture(run, state(places, speeds), quality=quality)
    found = np.array([share_in_map(at(image, view, place)) for place in places])
    assert np.abs(found - speeds / 4).max() < 0.06
    assert (np.diff(found) > 0).all()


def test_worn_parts_have_the_colour_of_their_wear_where_the_motion_is_and_no_balls_are_before_them(runs, tmp_path):
    """Blades are worn from the lowest value of the scale to the highest along their length; the end wall has none."""
    path = shutil.copy(runs("mill").path, tmp_path / "worn.h5")
    with h5py.File(path, "r+") as file:
        wear = file["statistics/wear"]
        kinds = [str(kind) for kind in wear["parts/kind"].attrs["kinds"]]
        blade = wear["parts/kind"][()][wear["part"][()]] == kinds.index("ball_blade")
        away = np.hypot(*wear["centre"][()][:, 1:].T)
        wear["sliding_power"][...] = np.where(blade, 10 ** (away / 0.022), 0)
    with Run(path) as run:
        colours = colour.of(run, "sliding_power", (1.0, 10.0))
        with scene.Scene(run, SIZE, "draft", camera.of("end", run), colours, WHITE, overlay=False) as drawn:
            image, view = drawn.draw(stored(run)), drawn.camera
        turned = run.poses(len(run.frame_times()) - 1)["rotor"][:, :3]
        places = [turned @ [0.013, -r, 0] for r in (0.009, 0.014, 0.019)]  # on the blade that is nearer
        found = [share_in_map(at(image, view, place)) for place in places]
        assert found == pytest.approx([0.41, 0.64, 0.86], abs=0.08)
        wall = at(image, view, [-0.02, *(0.026 * np.array([np.cos(0.7), np.sin(0.7)]))])
        assert np.ptp(wall) < 15 and 40 < wall.mean() < 200  # grey, though balls are before it


def test_a_blade_can_be_told_from_a_wall_that_is_worn_as_little(runs, tmp_path):
    path = shutil.copy(runs("mill").path, tmp_path / "even.h5")
    with h5py.File(path, "r+") as file:
        file["statistics/wear/sliding_power"][...] = 1.0
    with Run(path) as run:
        colours = colour.of(run, "sliding_power", (1.0, 10.0))
        with scene.Scene(run, (960, 540), "draft", camera.of("end", run), colours, WHITE, overlay=False) as drawn:
            image, view = drawn.draw(stored(run)), drawn.camera
        turned, lines = run.poses(len(run.frame_times()) - 1)["rotor"][:, :3], Mill.of(run).creases["rotor"]
    near = lines[:, :, 0].min(axis=1) > 0.0  # at the camera's side
    middles = lines.mean(axis=1)[near & (np.linalg.norm(np.diff(lines, axis=1)[:, 0], axis=1) > 0.01)] @ turned.T
    x, y = np.array(project(view, middles, (960, 540)))[:, :2].astype(int).T
    around = [image[v - 2 : v + 3, u - 2 : u + 3].max(axis=2).min() for u, v in zip(x, y)]
    assert len(around) >= 2 and np.max(around) < 45  # the darkest pixel at the edge; a worn face is lighter than 90


@pytest.mark.parametrize(
    "name, says", [("archard_rate", "no coefficients for it in"), ("sliding_power", "has no wear")]
)
def test_a_run_without_this_wear_is_refused_in_one_line(runs, tmp_path, name, says):
    path = shutil.copy(runs("mill").path, tmp_path / "bare.h5")
    if name == "sliding_power":
        with h5py.File(path, "r+") as file:
            del file["statistics/wear"]
    with Run(path) as run, pytest.raises(UserError, match=says):
        colour.of(run, name)


def test_a_nearer_ball_hides_a_farther_one(runs):
    run, shares = runs("still"), []
    others = grid(20) * 0.02 - [0.02, 0.0, 0.0]  # the rest in the middle, far away
    for near, far in ((0, 1), (1, 0)):
        places, speeds = others.copy(), np.full(20, 2.0)
        places[near], places[far] = (0.016, 0.010, 0.010), (-0.010, 0.010, 0.010)
        speeds[:2] = 1.0, 3.0
        image, view = picture(run, state(places, speeds))
        shares.append(share_in_map(at(image, view, places[near])))
    assert shares == pytest.approx([0.25, 0.75], abs=0.06)


def test_a_ball_in_a_relief_is_not_seen(runs):
    run, near, far = runs("still"), (0.016, 0.010, 0.010), (-0.010, 0.010, 0.010)
    places, speeds = grid(20) * 0.02 - [0.02, 0.0, 0.0], np.full(20, 2.0)
    places[:2], speeds[:2] = (near, far), (1.0, 3.0)
    relieved, shares = np.arange(20) == 0, []
    for hidden in (relieved, relieved & False, None):
        image, view = picture(run, dataclasses.replace(state(places, speeds), relieved=hidden))
        shares.append(share_in_map(at(image, view, far)))
    assert shares == pytest.approx([0.75, 0.25, 0.25], abs=0.06)
    text = pov.scene(
        run, dataclasses.replace(state(places), relieved=relieved), camera.of("end", run),
        colour.of(run, "speed", (0.0, 4.0)), SIZE,
    )  # fmt: skip
    assert len(re.findall(r"^B\(", text, re.M)) == 19


def test_a_ball_is_as_large_as_its_diameter(runs):
    run = runs("mixture")
    count = len(run.balls("mass"))
    diameters = run.balls("diameter")
    seen = {}
    for diameter in np.unique(diameters):
        places = np.tile([-0.018, 0.0, 0.0], (count, 1))
        chosen = int(np.argmax(diameters == diameter))
        places[chosen] = 0.014, 0.012, 0.012
        speeds = np.where(np.arange(count) == chosen, 9.0, 0.3)
        image, view = picture(run, state(places, speeds), size=(400, 400))
        x, y = project(view, [places[chosen]], (400, 400))[0, :2]
        row = image[int(y)].astype(int)
        across = (row[:, 0] > row[:, 2] + 60)[max(0, int(x) - 60) : int(x) + 60]  # yellow, not white
        seen[diameter] = across.sum() * view.height / 400
    for diameter, width in seen.items():
        assert width == pytest.approx(diameter, abs=0.0006)


def test_a_rotor_turned_by_a_quarter_moves_its_blades(runs):
    run = runs("mill")
    away = np.tile([-0.015, 0.0, 0.0], (20, 1))  # within the shaft: not in the way
    first, view = picture(run, state(away))
    turn = {"rotor": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0]])}
    later, _ = picture(run, state(away, poses=turn))
    blade = run.as_deck.blades[0]
    middle = np.array([blade.position + blade.width / 2, 0.016, 0.0])
    turned = middle[[0, 2, 1]]
    white = np.array([255, 255, 255])
    assert np.abs(at(first, view, middle) - white).max() > 50
    assert np.abs(at(first, view, turned) - white).max() < 12
    assert np.abs(at(later, view, turned) - white).max() > 50
    assert np.abs(at(later, view, middle) - white).max() < 12


def test_a_wavy_wall_differs_from_a_circle_where_its_profile_says(runs):
    images = {}
    view = camera.Camera(np.array([1.0, 0, 0]), np.zeros(3), np.array([0, 0, 1.0]), 0.0, 0.09)
    for name in ("still", "wavy"):
        images[name], _ = picture(runs(name), state(np.zeros((20, 3))), view, (300, 300))
    wavy, circle = (contour.of(runs(name).as_deck) for name in ("wavy", "still"))
    step = np.pi / 4
    for angle, radius in (
        (0.0, wavy.outermost),
        (step, wavy.innermost),
        (2 * step, wavy.outermost),
    ):
        place = (0.021, *(radius * np.array([np.cos(angle), np.sin(angle)])))
        assert at(images["wavy"], view, place).max() < 130  # the dark rim
        assert at(images["still"], view, place).min() > 180
        place = (0.021, *(circle.outermost * np.array([np.cos(angle), np.sin(angle)])))
        assert at(images["wavy"], view, place).min() > 180
        assert at(images["still"], view, place).max() < 130


@pytest.mark.parametrize("name", ["one", "still", "mixture", "wavy", "pitched"])
def test_every_kind_of_mill_can_be_drawn(runs, name):
    run = runs(name)
    image, _ = picture(run, stored(run), "three-quarter", overlay=True)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 100


def test_the_same_state_gives_the_same_picture(runs):
    run = runs("mill")
    one, _ = picture(run, stored(run), "front")
    two, _ = picture(run, stored(run), "front")
    assert (one == two).all()


@pytest.mark.parametrize("view", ["front", "end"])
def test_a_picture_put_together_from_tiles_has_no_seams(runs, monkeypatch, view):
    run = runs("mill")
    whole, _ = picture(run, stored(run), view, background=scene.STUDIO)
    monkeypatch.setattr(scene, "TILE", 8000)
    assert scene.tiles(SIZE, 1)[1] > 1
    tiled, _ = picture(run, stored(run), view, background=scene.STUDIO)
    far = np.abs(whole.astype(int) - tiled).max(axis=2)
    assert (far > 8).mean() < 0.005  # the lamp's picture is coarser


@pytest.mark.parametrize(
    ("text", "size"),
    [("720p", (1280, 720)), ("4K", (3840, 2160)), ("640x360", (640, 360))],
)
def test_sizes_go_by_name_or_number(text, size):
    assert scene.size_of(text) == size


@pytest.mark.parametrize("text", ["641x360", "0x0", "big", "10x10x10", "99999x100", "1e3x100", "x"])
def test_a_size_no_video_can_have_is_refused(text):
    with pytest.raises(UserError, match="^--size: expected"):
        scene.size_of(text)


# ---- a machine without


def without(tmp_path, *libraries):
    """A process on a machine without some libraries: what it prints when it opens a window."""
    for library in libraries:
        (tmp_path / library).touch()
    code = "from milltools.render import window; print(window.open_window((32, 18)).GetClassName())"
    code = (
        "import sys\nfrom milltools.base.errors import UserError\ntry:\n    "
        + code.replace("; ", "\n    ")
        + "\nexcept UserError as fault:\n    print(fault)\n    sys.exit(fault.status)\n"
    )
    environment = {
        **os.environ,
        "LD_LIBRARY_PATH": str(tmp_path),
        "PYTHONPATH": str(ROOT / "tools"),
    }
    environment.pop("VTK_DEFAULT_OPENGL_WINDOW", None)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=60)


def test_without_osmesa_one_line_says_what_to_install(tmp_path):
    done = without(tmp_path, "libOSMesa.so.8", "libOSMesa.so", "libEGL.so.1")
    assert done.returncode == 1 and done.stderr == ""
    assert (
        done.stdout
        == "no library to draw with: libosmesa6 is not installed; on Debian: sudo apt-get install libosmesa6\n"
    )


@pytest.mark.skipif(not ctypes.util.find_library("EGL"), reason="no EGL here (Debian: libegl1)")
def test_without_osmesa_but_with_egl_pictures_are_made_by_egl(tmp_path):
    done = without(tmp_path, "libOSMesa.so.8", "libOSMesa.so")
    if "nothing" in done.stdout:
        pytest.skip("no EGL here")
    assert done.stdout == "vtkEGLRenderWindow\n", done.stdout + done.stderr


# ---- cameras


@pytest.mark.parametrize("name", list(camera.PRESETS))
@pytest.mark.parametrize("size", [(1920, 1080), (500, 500), (400, 900)])
def test_a_mill_fills_the_frame_of_any_shape(runs, name, size):
    for mill in ("mill", "wavy"):
        view = camera.of(name, runs(mill), 0.3)
        frame = (0.1, 0.05, 0.8, 0.9)
        shares = project(view.placed(size, frame), view.hull, size)[:, :2] / size
        low, high = shares.min(axis=0), shares.max(axis=0)
        assert (low > np.array(frame[:2]) - 1e-9).all() and (high < np.array(frame[2:]) + 1e-9).all()
        filled = (high - low) / (np.array(frame[2:]) - frame[:2])
        assert filled.max() > 0.999


def test_an_orbit_goes_around_once_without_coming_nearer(runs):
    run = runs("mill")
    eyes = np.array([camera.of("orbit", run, f).placed((640, 360)).eye for f in (0, 0.25, 0.5, 0.75, 1)])
    around = np.unwrap(np.arctan2(eyes[:, 1], eyes[:, 0]))
    assert np.diff(around) == pytest.approx([np.pi / 2] * 4, abs=0.02)
    away = np.linalg.norm(eyes, axis=1)
    assert away.max() < 1.02 * away.min()


def test_a_free_camera_stands_where_it_is_put(runs):
    view = camera.of(camera.free((0.3, -0.2, 0.1), (0.01, 0, 0), angle=20), runs("one")).placed((640, 360))
    assert view.eye == pytest.approx([0.3, -0.2, 0.1]) and view.angle == 20
    assert project(view, [[0.01, 0, 0]], (640, 360))[0, :2] == pytest.approx([320, 180])


def test_a_camera_that_is_not_there_is_refused(runs):
    with pytest.raises(UserError, match="^--camera: expected one of front"):
        camera.of("side", runs("one"))


@pytest.mark.parametrize(
    "given",
    [
        {"eye": (1, 2)},
        {"eye": (0, 0, 1)},
        {"eye": (0, 0, 0)},
        {"eye": (1, 0, 0), "angle": 0},
        {"eye": (1, 0, 0), "up": (0, 0, 0)},
        {"eye": (float("nan"), 0, 0)},
    ],
)
def test_a_camera_that_sees_nothing_is_refused(given):
    with pytest.raises(UserError, match="^--(eye|up|angle)"):
        camera.free(**given)


# ---- colours


def test_limits_hold_almost_all_balls_of_a_film_and_end_at_a_readable_number(runs):
    run = runs("mill")
    low, high = colour.of(run, "speed").limits
    frames = range(1, len(run.frame_times()))
    speeds = np.concatenate([np.linalg.norm(run.frame(k), axis=1) for k in frames])
    assert low == 0
    assert 0.98 < (speeds <= high).mean()
    assert float(f"{high:.1e}") == pytest.approx(high)


def test_beyond_the_limits_a_ball_has_the_limits_colour_and_an_unknown_one_is_grey():
    colours = colour.Colour("speed", (1.0, 2.0))
    rgb = colours.rgb([0.0, 1.0, 2.0, 9.0, np.nan])
    assert (rgb[0] == rgb[1]).all() and (rgb[2] == rgb[3]).all()
    assert len(set(rgb[4])) == 1


def lightness(rgb):
    """CIE L* of colours (n, 3) 0..255, as a print in grey keeps it."""
    light = np.where(rgb <= 10, rgb / 255 / 12.92, ((rgb / 255 + 0.055) / 1.055) ** 2.4) @ [0.2126, 0.7152, 0.0722]
    return 116 * np.cbrt(light) - 16


def deuteranope(rgb):
    """Colours (n, 3) 0..255 as seen without the green cones (Machado, Oliveira, Fernandes 2009)."""
    matrix = [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]]
    linear = np.where(rgb <= 10, rgb / 255 / 12.92, ((rgb / 255 + 0.055) / 1.055) ** 2.4) @ np.transpose(matrix)
    return 255 * (1.055 * np.clip(linear, 0.0031308, 1) ** (1 / 2.4) - 0.055)


@pytest.mark.parametrize("seen", [np.asarray, deuteranope])
def test_a_faster_ball_is_lighter_in_grey_and_without_green_cones_too(seen):
    rgb = colour.Colour("speed", (0.0, 1.0)).rgb(np.linspace(0, 1, 33)).astype(float)
    steps = np.diff(lightness(seen(rgb)))
    assert steps.min() > 0.6 * steps.mean() and steps.sum() > 55
    assert 28 < lightness(seen(rgb))[0] and lightness(seen(rgb))[-1] < 93  # not black, not white


def test_runs_shown_together_have_the_limits_of_the_faster_one(runs):
    slow, fast = sorted((runs("mill"), runs("mixture")), key=lambda run: colour.of(run, "speed").limits[1])
    assert (
        colour.shared([slow, fast], "speed") == colour.shared([fast, slow], "speed") == colour.of(fast, "speed").limits
    )


def test_a_flash_is_where_the_impact_was_and_a_ball_in_front_hides_it(runs):
    run = runs("one")
    seen = []
    for depth in (0.0, 0.012):  # of the ball behind the flash
        place = np.array([[0.012, 0.005, 0.005]])
        what = dataclasses.replace(state(place, [0.1]), flashes=np.array([[0.012 - depth, 0.005, 0.005, 0.003]]))
        image, view = picture(run, what, "end", size=(400, 400))
        x, y = project(view, what.flashes[:, :3], (400, 400))[0, :2]
        seen.append(image[int(y), int(x)].astype(int).min() > 240)
    assert seen == [True, False]


def test_values_are_those_of_the_state(runs):
    run = runs("mill")
    at_end = stored(run)
    mass = run.balls("mass")
    for quantity, expected in (
        ("speed", np.linalg.norm(at_end.velocity, axis=1)),
        ("spin", np.linalg.norm(at_end.angular_velocity, axis=1)),
        ("energy", 0.5 * mass * (at_end.velocity**2).sum(axis=1)),
    ):
        assert colour.of(run, quantity).values(at_end, run) == pytest.approx(expected, rel=1e-12)
    given = State(0.0, at_end.position, at_end.velocity, at_end.angular_velocity, np.arange(20.0))
    assert (colour.of(run, "impact").values(given, run) == np.arange(20)).all()


@pytest.mark.parametrize("limits", [(1.0, 1.0), (2.0, 1.0), (0.0, np.inf), (np.nan, 1.0)])
def test_limits_that_are_none_are_refused(runs, limits):
    with pytest.raises(UserError, match="limits"):
        colour.of(runs("one"), "speed", limits)


@pytest.mark.parametrize("size", [(640, 360), (360, 640)])
def test_the_bar_shows_the_map_in_order_beside_a_wide_picture_and_below_a_narrow_one(size):
    written = overlay.Overlay(size, colour.Colour("speed", (0.0, 4.0)))
    blank = np.full((size[1], size[0], 3), 255, np.uint8)
    written.paste(blank, 0.1)
    colours = (blank.max(axis=2).astype(int) - blank.min(axis=2)) > 60
    rows, columns = np.nonzero(colours)
    if size[0] > size[1]:
        assert columns.min() > 0.8 * size[0]
        line = blank[:, int(np.median(columns))][::-1]
    else:
        assert rows.min() > 0.85 * size[1]
        line = blank[int(np.median(rows))]
    line = line[(line.max(axis=1).astype(int) - line.min(axis=1)) > 60]
    shares = np.array([share_in_map(pixel) for pixel in line.astype(float)])
    middle = shares[len(shares) // 8 : -len(shares) // 6]
    assert (np.diff(middle) >= 0).all() and middle[-1] - middle[0] > 0.5


# ---- shade


def flat_view(size=(64, 64)):
    """A view down on a square of 64 mm, and the lamp's, straight from above."""
    down = camera.Camera(np.array([0, 0, 1.0]), np.zeros(3), np.array([0, 1.0, 0]), 0.0, 0.064)
    return View(down, size, (0.9, 1.1))


def light_on(depth, lamp=None, radius=0.005):
    view = flat_view(np.shape(depth))
    shade = Shade(view, view, radius)
    buffers = [(np.asarray(d, np.float32) - 0.9) / 0.2 for d in (depth, depth if lamp is None else lamp)]
    return shade.light(*(b.astype(np.float32) for b in buffers))


def test_a_plane_is_in_full_light_and_a_corner_is_not():
    plane = np.full((64, 64), 1.0)
    assert light_on(plane) == pytest.approx(1.0)
    step = plane.copy()
    step[:, :32] -= 0.008  # a wall of 8 mm
    light = light_on(step)
    assert light[:, 33:37].mean() < 0.85 and light[:, 56:].mean() == pytest.approx(1.0, abs=0.01)


def test_what_the_lamp_sees_something_before_is_in_shadow():
    plane, lamp = np.full((64, 64), 1.0), np.full((64, 64), 1.0)
    lamp[:, :20] = 0.98
    light = light_on(plane, lamp)
    assert light[:, :16].max() < 0.75 and light[:, 26:].min() == pytest.approx(1.0)


def test_a_shadow_fades_with_the_distance_from_the_object_that_casts_it():
    plane, dark = np.full((64, 64), 1.0), []
    for near in (0.98, 0.96, 0.92):
        lamp = plane.copy()
        lamp[:, :20] = near
        dark.append(1 - light_on(plane, lamp)[:, :16].mean())
    assert dark[0] > 1.3 * dark[1] > 1.7 * dark[2] > 0


def test_the_shadow_of_a_thin_bar_is_one_beside_large_balls_too():
    plane, lamp = np.full((256, 256), 1.0), np.full((256, 256), 1.0)
    lamp[:, 126:129] = 0.95  # of 0.75 mm
    light = scene.smooth(light_on(plane, lamp, radius=0.03), 4)[128]
    dark = np.flatnonzero(light < 1 - 1e-6)
    assert light.min() < 0.93 and np.ptp(dark) < 30  # not single looks, far apart


# ---- POV-Ray


def written(run, what, tmp_path, size=SIZE, view="end"):
    path = tmp_path / "scene.pov"
    path.write_text(pov.scene(run, what, camera.of(view, run), colour.of(run, "speed", (0.0, 4.0)), size))
    return path


@pytest.mark.parametrize("name", ["mill", "wavy", "hostile", "pitched"])
def test_a_scene_has_every_ball_and_nothing_of_the_decks_text(runs, name, tmp_path):
    run = runs(name)
    text = written(run, stored(run), tmp_path).read_text()
    assert text.count("{") == text.count("}") and text.count("<") == text.count(">")
    rows = np.array([list(map(float, m.split(","))) for m in re.findall(r"^B\((.*)\)$", text, re.M)])
    assert rows[:, :3] == pytest.approx(stored(run).position, abs=1e-7)
    assert rows[:, 3] == pytest.approx(run.balls("diameter") / 2)
    assert not re.search("script|debug|union|nan|inf,", text)


def test_a_missing_povray_is_one_line_and_hinders_no_scene(runs, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    path = written(runs("one"), stored(runs("one")), tmp_path)
    with pytest.raises(UserError, match="apt-get install povray") as fault:
        pov.trace(path.read_text(), SIZE)
    assert fault.value.status == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.pov"]


povray = pytest.mark.skipif(shutil.which("povray") is None, reason="needs povray")


@povray
def test_a_traced_picture_has_the_balls_where_the_data_say(runs, tmp_path):
    run = runs("still")
    places, speeds = grid(20), np.linspace(0.6, 3.4, 20)
    view = camera.of("end", run)
    image = pov.draw(run, state(places, speeds), view, colour.of(run, "speed", (0.0, 4.0)), SIZE)
    assert image.shape == (180, 320, 3)
    frame = overlay.Overlay(SIZE, colour.of(run, "speed", (0.0, 4.0))).frame
    view = view.placed(SIZE, frame)
    beside = [0.0, 0.0012, -0.0012]  # the highlight
    found = np.array([share_in_map(at(image, view, place + beside)) for place in places])
    assert np.abs(found - speeds / 4).max() < 0.08
    assert (np.diff(found) > 0).all()


@povray
def test_a_traced_picture_is_seen_as_the_drawn_one(runs, tmp_path):
    run = runs("pitched")
    colours, view = colour.of(run, "speed"), camera.of("front", run)
    traced = pov.draw(run, stored(run), view, colours, SIZE).astype(int)
    with scene.Scene(run, SIZE, "final", view, colours) as drawn:
        other = drawn.draw(stored(run)).astype(int)
    assert np.abs(traced - other).max(axis=2).mean() < 30


@povray
def test_what_povray_cannot_read_is_told_in_one_line():
    with pytest.raises(UserError, match="Parse Error"):
        pov.trace("sphere { 1 }\n", SIZE)


# ---- what is drawn beside the balls


def test_the_container_is_as_the_deck_says_and_has_bars_along_its_sharp_edges(runs):
    mill, profile = Mill.of(runs("wavy")), contour.of(runs("wavy").as_deck)
    wall = mill.glass.reshape(-1, 3)  # without the flat ends
    assert np.abs(profile.gap(wall[:, 1:])).max() < 1e-8  # single precision
    assert np.abs(wall[:, 0]).max() == pytest.approx(0.02)
    for edge in mill.edges:
        assert np.abs(edge[:, 0]) == pytest.approx(0.02)
        assert np.abs(profile.gap(edge[:, 1:])).max() < 1e-8
    around = np.linalg.norm(mill.edges[:, 1] - mill.edges[:, 0], axis=1).sum()
    assert around == pytest.approx(2 * profile.length, rel=0.01)


def test_bodies_of_a_file_without_triangles_come_from_its_deck(runs, tmp_path):
    path = tmp_path / "bare.h5"
    shutil.copyfile(runs("mill").path, path)
    with h5py.File(path, "r+") as file:
        del file["VTKHDF"]
    with Run(path) as bare:
        one, two = Mill.of(runs("mill")), Mill.of(bare)
        assert [(b.kind, b.motion) for b in one.bodies] == [(b.kind, b.motion) for b in two.bodies]
        for a, b in zip(one.bodies, two.bodies, strict=True):
            assert a.triangles == pytest.approx(b.triangles, abs=1e-9)
