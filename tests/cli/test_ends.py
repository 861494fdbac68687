"""drum.ends = periodic: a slice of a long mill. What repeats along the axis has the same impacts however much of it is
simulated and wherever it begins; end walls are in no table; decks that cannot repeat are refused."""

import json

import h5py
import numpy as np
import pytest

LENGTH, DIAMETERS = 0.024, (0.005, 0.0016)  # [m]
SLICE = """\
[run]
time = {time} s
[gravity]
acceleration = 0 0 -9.81 m/s^2
[balls.big]
count = {big}
diameter = 5 mm
density = 7800 kg/m^3
[balls.small]
count = {small}
diameter = 1.6 mm
density = 7800 kg/m^3
[balls]
start = start.txt
[drum]
radius = 20 mm
length = {length} m
ends = periodic
[rotor]
speed = 1000 rpm
shaft_radius = 4 mm
[blades]
count = {blades}
angle_step = 0 deg
tip_radius = 12 mm
width = 8 mm
thickness = 3 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
[output]
impacts = all
frames = 5 ms
series = 5 ms
"""
GAS = """\
[run]
time = 0.5 s
sample_from = 0.1 s
seed = {seed}
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 750
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 42.5 mm
length = 30 mm
ends = periodic
[contact]
restitution = 1
rebound_floor = 0 m/s
[output]
impacts = all
frames = 2 ms
"""


@pytest.fixture
def run(millsim, write_deck, tmp_path):
    """run(text, *arguments): the output file of a deck; {name: columns} of its impacts."""

    def go(text, *arguments, name="deck"):
        write_deck(text, f"{name}.ini")
        done = millsim(f"{name}.ini", "--quiet", *arguments)
        assert done.returncode == 0, done.stderr
        with h5py.File(tmp_path / f"{name}.h5") as file:
            log = file["impacts"]
            return {key: log[key][:] for key in log} | {"kinds": list(log.attrs["kinds"])}

    return go


def clear_start(count, seed=1):
    """States (N, 6) of `count` big and small balls in the slice, between shaft and drum, clear of each other's images
    and of the blade's end; big ones first."""
    random, found, radii = np.random.default_rng(seed), [], np.array([])
    for many, diameter in zip(count, DIAMETERS):
        radius, added = diameter / 2, 0
        while added < many:
            x, (r, angle) = random.uniform(-LENGTH / 2, LENGTH / 2), random.uniform((0.014, 0), (0.0195, 2 * np.pi))
            place = np.array([x, r * np.cos(angle), r * np.sin(angle)])
            gap = np.array(found).reshape(-1, 6)[:, :3] - place
            gap[:, 0] -= LENGTH * np.rint(gap[:, 0] / LENGTH)
            if r + radius < 0.0199 and r - radius > 0.0121 and np.all(np.linalg.norm(gap, axis=1) > radius + radii):
                found.append([*place, *random.normal(0, 0.5, 3)])
                radii = np.append(radii, radius)
                added += 1
    return np.array(found)


def wrapped(x, length):
    return x - length * np.floor(x / length + 0.5)


def impacts(log):
    """Their rows (time, kind, pair), in the order of time."""
    return log["time"], np.column_stack([log["kind"], log["ball"], log["partner"]])


COUNT = (25, 260)
FIRST = 300  # impacts that must agree: later ones differ by the growth of rounding errors


def write(path, states):
    np.savetxt(path, states, fmt="%.17g")


def test_it_does_not_matter_where_the_slice_begins(run, tmp_path):
    start, text = clear_start(COUNT), SLICE.format(time=0.01, big=25, small=260, length=LENGTH, blades=1)
    text = text.replace("width = 8 mm", "width = 24 mm")  # looks the same everywhere
    write(tmp_path / "start.txt", start)
    one = run(text, name="one")
    start[:, 0] = wrapped(start[:, 0] + 0.0097, LENGTH)
    write(tmp_path / "start.txt", start)
    other = run(text, name="other")
    for here, there in zip(impacts(one), impacts(other)):
        assert len(here) > FIRST
        np.testing.assert_allclose(here[:FIRST], there[:FIRST], atol=1e-9, rtol=0)
    moved = wrapped(one["position"][:FIRST, 0] + 0.0097 - other["position"][:FIRST, 0], LENGTH)
    np.testing.assert_allclose(moved, 0, atol=1e-8)


def test_a_slice_of_twice_the_length_has_each_impact_twice(run, tmp_path):
    start = clear_start(COUNT)
    write(tmp_path / "start.txt", start)
    one = run(SLICE.format(time=0.01, big=25, small=260, length=LENGTH, blades=1), name="one")
    left, right = start - [LENGTH / 2, 0, 0, 0, 0, 0], start + [LENGTH / 2, 0, 0, 0, 0, 0]
    both = [np.concatenate([own, images]) for own, images in zip(np.split(left, [25]), np.split(right, [25]))]
    write(tmp_path / "start.txt", np.concatenate(both))
    two = run(SLICE.format(time=0.01, big=50, small=520, length=2 * LENGTH, blades=2), name="two")
    time, rows = impacts(two)
    own = np.concatenate([np.tile(np.arange(25), 2), 25 + np.tile(np.arange(260), 2)])  # of which ball it is an image
    assert two["kinds"][0] == "ball_ball"
    balls = np.column_stack([own[rows[:, 1]], np.where(rows[:, 0] == 0, own[rows[:, 2]], -2)])
    np.testing.assert_allclose(time[: 2 * FIRST], np.repeat(one["time"][:FIRST], 2), atol=1e-9, rtol=0)
    mine = np.column_stack([one["ball"], np.where(one["kind"] == 0, one["partner"], -2)])[:FIRST]
    assert np.array_equal(np.sort(balls[: 2 * FIRST], axis=1), np.repeat(np.sort(mine, axis=1), 2, axis=0))


def kolafa(phi):
    """Compressibility of hard spheres, right to 0.01 % up to a packing of 0.4 (see validation/dense)."""
    return (1 + phi + phi**2 - 2 / 3 * phi**3 * (1 + phi)) / (1 - phi) ** 3


def ramp(depth):
    """0 up to 2 diameters from the drum's wall, 1 from 5 on, smooth: the gas forms layers at the wall."""
    u = np.clip((depth / 0.005 - 2) / 3, 0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


@pytest.mark.thorough
def test_a_gas_between_periodic_ends_has_the_pressure_of_the_bulk(run, tmp_path):
    ratios = []
    for seed in range(1, 7):
        log = run(GAS.format(seed=seed), name=f"gas{seed}")
        with h5py.File(tmp_path / f"gas{seed}.h5") as file:
            frames = file["particles/trajectory"]
            late = frames["position/time"][:] >= 0.1 - 1e-9
            place, velocity = (frames[f"{key}/value"][:][late].astype(float) for key in ("position", "velocity"))
        core = ramp(0.0425 - np.hypot(place[..., 1], place[..., 2]))
        balls, t = core.sum() / len(core), np.sum(core[..., None] * velocity**2) / (3 * core.sum())
        near, far = 0.01, 0.025  # [m] where the ramp begins and ends; its mean is 1/2, its first moment 5/14
        area = np.pi * (0.0425 - far) ** 2 + 2 * np.pi * (far - near) * ((0.0425 - near) / 2 - (far - near) * 5 / 14)
        phi = balls / (area * 0.03) * np.pi / 6 * 0.005**3
        chosen = (log["kind"] == 0) & (log["time"] >= 0.1)
        weight = ramp(0.0425 - np.hypot(log["position"][chosen, 1], log["position"][chosen, 2]))
        z = 1 + 0.005 * weight @ log["normal_speed"][chosen] / (3 * t * 0.4 * balls)
        assert 0.25 < phi < 0.35
        ratios.append(z / kolafa(phi))
    ratios = np.array(ratios)
    error = ratios.std(ddof=1) / np.sqrt(len(ratios))
    assert error < 0.003
    assert abs(ratios.mean() - 1) < 4 * error + 0.001


def test_no_table_lists_end_walls_and_the_maps_hold_all_balls(millsim, write_deck, tmp_path):
    write_deck(GAS.format(seed=1).replace("time = 0.5 s", "time = 0.12 s"))
    done = millsim("deck.ini", "--quiet")
    assert done.returncode == 0 and "ball_wall" not in done.stdout
    with h5py.File(tmp_path / "deck.h5") as file:
        maps, box = file["statistics/maps/axial"], file["particles/trajectory/box"]
        fraction, (x, r) = maps["solid_fraction"][:], [maps[f"{name}_edges"][:] for name in ("x", "r")]
        assert list(box.attrs["boundary"]) == ["periodic", "none", "none"] and box.attrs["edges"][0] == 0.03
        assert np.abs(file["impacts/position"][:, 0]).max() <= 0.015
    volume = np.outer(np.diff(x), np.pi * np.diff(r**2))
    along = (fraction * volume).sum(axis=1)
    assert along.sum() == pytest.approx(750 * np.pi / 6 * 0.005**3, rel=1e-9)
    assert np.abs(along / along.mean() - 1).max() < 0.1  # also next to the ends


MILL = SLICE.format(time=0.01, big=5, small=5, length=LENGTH, blades=1).replace("start = start.txt", "speed = 0 m/s")
BODY = "[motion.arm]\nkind = {kind}\n[body.bar]\nshape = box\nsize = {size}\nmotion = arm\ncentre = 0 0 13 mm\n"
WRONG = {
    "drum.length=14 mm": ("[drum] length", "more than three diameters of a ball, 0.015 m"),
    "gravity.acceleration=1 0 -9 m/s^2": ("[gravity] acceleration", "0 along x"),
    "blades.width=20 mm": ("[blades]", "keep a ball's radius, 2.5 mm, away from the periodic ends"),
    "drum.ends=open": ("[drum] ends", "walls"),
    "body.bar.motion=tilt": ("[body.bar] motion", "may only turn about the x axis"),
    "body.bar.size=23 2 2 mm": ("[body.bar]", "away from the periodic ends"),
    "drum.motion=tilt": ("[drum] motion", "may only turn about the x axis"),
}
BAR = (
    "[motion.tilt]\nkind = swing\naxis = 0 1 0\namplitude = 1 deg\nfrequency = 1 Hz\n"
    "[body.bar]\nshape = box\nsize = 10 2 2 mm\ncentre = 0 0 -17 mm\n"
)


@pytest.mark.parametrize("change", WRONG)
def test_a_mill_that_cannot_repeat_is_refused_in_one_line(change, millsim, write_deck, tmp_path):
    write_deck(MILL + (BAR if "bar" in change or "tilt" in change else ""))
    rotorless = ["-s", "rotor.shaft_radius=0 m"]
    if change.startswith("drum.motion"):
        (tmp_path / "deck.ini").write_text(MILL[: MILL.index("[rotor]")] + MILL[MILL.index("[contact]") :] + BAR)
        rotorless = []
    before = sorted(tmp_path.iterdir())
    done = millsim("deck.ini", "-s", change, *rotorless)
    assert (done.returncode, done.stdout) == (2, "")
    lines = [line for line in done.stderr.splitlines() if "warning" not in line]
    assert len(lines) == 1 and all(word in lines[0] for word in WRONG[change]), done.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_a_blade_may_reach_through_both_periodic_ends(millsim, write_deck):
    write_deck(MILL)
    assert millsim("--check", "deck.ini", "-s", "blades.width=40 mm").returncode == 0


def test_a_start_file_with_a_ball_beyond_an_end_is_refused(millsim, write_deck, tmp_path):
    write(tmp_path / "start.txt", [[0, 0, 0.016, 0, 0, 0], [0.0121, 0, -0.016, 0, 0, 0]])
    write_deck(SLICE.format(time=0.01, big=1, small=1, length=LENGTH, blades=1))
    done = millsim("deck.ini")
    assert done.returncode == 2 and "start.txt:2: x is 0.0121 m from the middle" in done.stderr


def test_ends_are_walls_where_the_deck_says_nothing(millsim, small_deck):
    assert "ends = walls" in millsim("--check", "deck.ini").stdout
    assert json.loads(millsim("deck.ini", "--json", "--quiet").stdout)["run"]["collisions"]["ball_wall"] > 0


def test_a_rotor_like_a_screw_gets_a_note_and_a_straight_one_gets_none(millsim, write_deck):
    write_deck(MILL.replace("count = 5\n", "count = 60\n").replace("time = 0.01 s", "time = 0.3 s"))
    quick = ["--quiet", "-s", "output.impacts=statistics", "-s", "run.sample_from=0.1 s"]
    assert "drift" not in millsim("deck.ini", "-f", *quick).stdout
    screw = ["-s", "blades.pitch=45 deg", "-s", "rotor.speed=3000 rpm"]
    assert "drift along the axis" in " ".join(millsim("deck.ini", "-f", *quick, *screw).stdout.split())
