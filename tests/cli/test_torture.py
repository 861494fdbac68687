"""Mills that nobody would build: none hangs, crashes, loses a ball or lets two bodies overlap.

What every run here is held against stands in soundness.py; the tests add what is special to each.
"""

import resource

import h5py
import numpy as np
import pytest
from conftest import slow, some
from soundness import depth_in_blades, mill_of, ms, sound

HEAD = """\
[run]
time = 10 ms
[drum]
radius = 40 mm
length = 60 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.484
[output]
frames = 1 ms
"""
BALLS = """\
[balls]
count = 600
diameter = 5 mm
density = 7800 kg/m^3
"""
ROTOR = """\
[rotor]
speed = 1000 rpm
shaft_radius = 8 mm
[blades]
count = 3
tip_radius = 33 mm
width = 8 mm
thickness = 6 mm
"""
DRUM = HEAD + BALLS  # of 0.30 litres, an eighth full
MILL = DRUM + ROTOR
WEIGHTLESS = "gravity.acceleration=0 0 0 m/s^2"


@pytest.fixture
def run(millsim, tmp_path):
    """run(deck, *orders, balls=600, start=None): a run that has been found sound."""

    def sound_run(deck, *orders, balls=600, **options):
        if "[balls." not in deck:
            orders = (f"balls.count={balls}", *orders)
        return sound(millsim, tmp_path, deck, *orders, balls=balls, **options)

    return sound_run


def refusal(millsim, tmp_path, deck, *orders):
    """The complaint of a deck refused with status 2, and the processor time it took [s]."""
    (tmp_path / "deck.ini").write_text(deck)
    began = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = millsim("-q", "deck.ini", *(word for order in orders for word in ("-s", order)))
    took = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - began
    assert done.returncode == 2, done.stderr
    assert not (tmp_path / "deck.h5").exists()
    (complaint,) = done.stderr.splitlines()
    return complaint, took


# ---- as full as can be ----


def hexagonal(drum, length, shaft, radius, spare):
    """Centres of a hexagonal close packing of balls, `spare` (relative) apart, between shaft, drum and ends."""
    d = 2 * radius * (1 + spare)
    n = int(1.2 * drum / d) + 3
    i, j, k = np.mgrid[-n : n + 1, -n : n + 1, 0 : int(length / d / 0.8) + 2].reshape(3, -1)
    x = -length / 2 + d / 2 + k * d * np.sqrt(2 / 3)
    y = d * (i + (j % 2) / 2 + (k % 2) / 2)
    z = d * np.sqrt(3) / 2 * (j + (k % 2) / 3)
    r = np.column_stack([x, y, z])
    off_axis = np.hypot(y, z)
    return r[(x <= length / 2 - d / 2) & (off_axis <= drum - d / 2) & (off_axis >= shaft + d / 2)]


def solid_fraction(balls, radius, room):
    return balls * 4 / 3 * np.pi * radius**3 / room


MILL_ROOM = np.pi * 0.060 * (0.040**2 - 0.008**2) - 3 * 0.008 * 0.006 * (0.033 - 0.008)  # m^3


@pytest.mark.slow
def test_a_random_start_fills_057_of_a_small_mill(run):
    # where every fourth ball is at a wall; a mill of 24 balls across takes up to 0.59
    balls = 2480
    assert solid_fraction(balls, 2.5e-3, MILL_ROOM) > 0.565
    done = run(MILL, "run.time=0.1 ms", "output.frames=0.1 ms", balls=balls)
    assert done.run["collisions"]["ball_ball"] > balls


@pytest.mark.parametrize(
    "balls", [3100, pytest.param(2540, marks=pytest.mark.slow), pytest.param(2700, marks=pytest.mark.thorough)]
)  # 0.58, 0.62, 0.71 of the room
def test_what_is_denser_than_any_random_start_is_refused_at_once(millsim, tmp_path, balls):
    complaint, took = refusal(millsim, tmp_path, MILL, f"balls.count={balls}")
    assert f"[balls] count: {balls} balls do not fit (solid fraction 0." in complaint
    assert complaint.endswith(" fit")
    assert took < 20  # it takes half a second; 5 s under sanitizers


def test_what_is_denser_than_any_packing_is_refused_without_trying(millsim, tmp_path):
    complaint, took = refusal(millsim, tmp_path, MILL, "balls.count=50000000")
    assert "50000000 balls do not fit: they fill 3.27e+03 litres of the drum's 0.29" in complaint
    assert took < 1


@pytest.mark.parametrize(
    "drum, spare, least",
    some([(80, 1e-4, 0.65), (80, 1e-2, 0.64), (40, 0, 0.60), (40, 1e-6, 0.60), (40, 1e-2, 0.60)], 2),
)
def test_a_start_file_may_fill_a_drum_to_beyond_random_close_packing(run, drum, spare, least):
    r = hexagonal(drum * 1e-3, 0.060, 0, 2.5e-3, spare)
    assert solid_fraction(len(r), 2.5e-3, np.pi * 0.060 * (drum * 1e-3) ** 2) > least
    v = np.random.default_rng(1).normal(size=r.shape)
    done = run(
        DRUM, f"drum.radius={drum} mm", f"run.time={ms(1)}", f"output.frames={ms(0.5)}",
        start=np.hstack([r, v]), balls=len(r),
    )  # fmt: skip
    assert done.run["collisions"]["ball_ball"] > len(r) / 5


def test_a_start_file_may_overlap_by_the_rounding_of_its_decimals(run):
    r = hexagonal(0.040, 0.060, 0, 2.5e-3, -1e-10)  # neighbours 0.5 pm deep
    run(DRUM, "run.time=1 ms", start=r, balls=len(r))


@pytest.mark.slow
def test_a_rotor_in_a_crystal_of_064_shears_it_and_what_it_lets_go_is_counted(run, tmp_path):
    r = hexagonal(0.040, 0.060, 0.008, 1.5e-3, 1e-6)
    blades = [((k - 1) * 0.020, k * 2 * np.pi / 3, 0.033, 0.008, 0.006, 0) for k in range(3)]
    mill = type("", (), {"blades": blades, "angle": 0, "speed": 0})
    r = r[depth_in_blades(mill, r, 1.5e-3, 0) < 0]
    assert solid_fraction(len(r), 1.5e-3, MILL_ROOM) > 0.64
    orders = [f"run.time={ms(0.1)}", f"output.frames={ms(0.05)}", "balls.diameter=3 mm"]
    done = run(MILL, *orders, start=r, balls=len(r))
    assert done.run["floored"]["ball_ball"] > 0.3 * done.run["collisions"]["ball_ball"]


# ---- gaps, speeds, laws ----


def tip_radius(gap):
    """The tip radius [mm] at which the blade's corners leave a gap of so many ball diameters."""
    return np.sqrt((40 - 5 * gap) ** 2 - 3**2)


@pytest.mark.parametrize("gap", some([0.99, 0.1, 0.3, 1, 0.5, 0.7, 1.01, 0.9, 0.95, 1.2, 1.5], 3))
def test_any_gap_between_blade_and_drum_runs_and_a_narrow_one_is_warned_of(run, gap):
    orders = [f"blades.tip_radius={tip_radius(gap):.15g} mm", "rotor.speed=1500 rpm"]
    done = run(MILL, *orders, f"run.time={ms(60)}", f"output.frames={ms(2)}")
    assert ("mm to [drum] at t = 0 s" in done.stderr) == (gap < 1)
    assert done.run["collisions"]["ball_blade"] > 0


@pytest.mark.parametrize("gap", [0.95, 0.99])
def test_balls_pinched_at_6000_rpm_are_let_go_and_counted(run, gap):
    orders = [f"blades.tip_radius={tip_radius(gap):.15g} mm", "rotor.speed=6000 rpm"]
    done = run(MILL, *orders, f"run.time={ms(15)}", f"output.frames={ms(0.5)}")
    assert done.run["reliefs"] > 0


@pytest.mark.parametrize("speed", some([6000, 4500, -6000, 3000, 1500], 2))
def test_a_rotor_of_any_speed_runs(run, speed):
    done = run(MILL, f"rotor.speed={speed} rpm", f"run.time={ms(40)}", f"output.frames={ms(2)}")
    assert done.run["reliefs"] == 0
    assert done.run["rotor_work"] > 0
    assert done.summary["statistics"]["rotor"]["torque"] * speed > 0


@pytest.mark.parametrize("friction", [0, 0.5])
@pytest.mark.parametrize("restitution", some([0, 0.25, 0.5, 0.75, 1], 2))
def test_balls_of_any_restitution_run(run, restitution, friction):
    orders = [f"contact.restitution={restitution}", f"contact.friction={friction}"]
    done = run(MILL, *orders, "rotor.speed=1500 rpm", f"run.time={ms(30)}", f"output.frames={ms(2)}")
    if restitution == 0:  # every contact would end at rest
        assert done.run["floored"] == done.run["collisions"]


def test_elastic_smooth_balls_without_a_floor_lose_nothing(run):
    orders = ["contact.restitution=1", "contact.friction=0", "contact.rebound_floor=0 m/s"]
    done = run(MILL, *orders, "rotor.speed=1500 rpm", f"run.time={ms(50)}", f"output.frames={ms(2)}")
    assert sum(done.run["floored"].values()) == 0
    assert abs(done.run["dissipation"]) < 1e-12 * done.run["energy_turnover"]


@pytest.mark.parametrize("tangential", [-1, 1])
def test_balls_with_the_utmost_grip_run(run, tangential):
    orders = ["contact.restitution=1", "contact.friction=10"]
    orders += [f"contact.tangential_restitution={tangential}", "rotor.speed=1500 rpm"]
    run(MILL, *orders, f"run.time={ms(50)}", f"output.frames={ms(2)}")


@pytest.mark.slow
def test_a_quarter_full_mill_of_restitution_a_half_with_friction_at_1500_rpm_runs_and_is_noted(run):
    # a slow build runs for as long: contacts at the floor come with the bed
    orders = ["contact.restitution=0.5", "rotor.speed=1500 rpm", "run.time=40 ms"]
    done = run(MILL, *orders, f"output.frames={ms(2)}", balls=1200)
    assert "contacts with friction have a restitution of 0.5" in done.notes
    assert done.run["floored"]["ball_ball"] > 0.3 * done.run["collisions"]["ball_ball"]


# ---- few, many, unequal ----


@pytest.mark.parametrize("restitution", [0, 0.8, 1])
def test_one_ball_runs_and_settles_or_not(run, restitution):
    orders = [f"contact.restitution={restitution}", "run.time=1 s", "output.frames=10 ms"]
    run(MILL, *orders, balls=1)


@pytest.mark.parametrize(
    "deck, radius, diameter",
    [(DRUM, 40, 59.9), (DRUM, 40, 59.999), (DRUM, 30.0005, 59.999), (MILL, 40, 31.9)],
)
def test_one_ball_that_just_fits_between_the_walls_runs(run, deck, radius, diameter):
    orders = [f"balls.diameter={diameter} mm", f"drum.radius={radius} mm"]
    run(deck, *orders, "balls.speed=1 m/s", f"run.time={ms(50)}", f"output.frames={ms(2)}", balls=1)


@pytest.mark.parametrize("balls", some([20_000, 100_000], 2))
@pytest.mark.slow
def test_many_balls_run(run, balls):
    orders = ["balls.diameter=1 mm", f"run.time={ms(2)}", f"output.frames={ms(1)}"]
    run(MILL, *orders, balls=balls)


MIXTURE = """\
[balls.large]
count = {large}
diameter = 10 mm
density = 7800 kg/m^3
[balls.small]
count = {small}
diameter = 1 mm
density = 7800 kg/m^3
"""


@pytest.mark.parametrize("restitution", slow([0, 0.8], 0))
def test_a_mixture_of_one_to_ten_runs(run, restitution):
    deck = HEAD + MIXTURE.format(large=12, small=5000) + ROTOR
    orders = [f"contact.restitution={restitution}", f"run.time={ms(10)}", f"output.frames={ms(2)}"]
    run(deck, *orders, balls=5012)


def test_a_mixture_of_one_to_ten_may_be_dense(run):
    room = np.pi * 0.015**2 * 0.022
    assert solid_fraction(5, 5e-3, room) + solid_fraction(8000, 0.5e-3, room) > 0.43
    deck = HEAD + MIXTURE.format(large=5, small=8000)
    orders = ["drum.radius=15 mm", "drum.length=22 mm", "balls.speed=1 m/s"]
    done = run(deck, *orders, "run.time=0.01 ms", "output.frames=0.01 ms", balls=8005)
    assert done.run["collisions"]["ball_ball"] > 8005 / 10


# ---- without gravity, without a rotor, too fast ----


def test_balls_at_rest_without_gravity_stay_where_they_are(run):
    done = run(DRUM, WEIGHTLESS, "run.time=100 ms", "output.frames=10 ms")
    assert sum(done.run["collisions"].values()) == 0
    with h5py.File(done.path) as file:
        position = file["particles/trajectory/position/value"]
        assert (position[-1] == position[0]).all()


@pytest.mark.parametrize("floor", ["0 m/s", "5 mm/s"])
def test_a_cooling_gas_runs(run, floor):
    orders = ["balls.speed=1 m/s", "contact.restitution=0.9", f"contact.rebound_floor={floor}"]
    run(DRUM, WEIGHTLESS, *orders, f"run.time={ms(200)}", f"output.frames={ms(10)}")


def test_a_rotor_stirs_balls_without_gravity(run):
    run(MILL, WEIGHTLESS, f"run.time={ms(100)}", f"output.frames={ms(5)}")


@pytest.mark.parametrize("pull", ["9.81 0 0", "0 9.81 0", "0 0 98.1", "-3 4 -5"])
def test_gravity_may_point_anywhere(run, pull):
    run(MILL, f"gravity.acceleration={pull} m/s^2", f"run.time={ms(60)}", f"output.frames={ms(5)}")


def test_balls_in_a_drum_without_a_rotor_come_to_rest(run):
    done = run(DRUM, "run.time=300 ms", "output.frames=100 ms", balls=200)
    floor = 2 * 200 * 0.5 * 7800 * np.pi / 6 * 0.005**3 * 0.005**2  # J, all balls at twice the floor's energy
    assert done.run["kinetic_energy"] < 100 * floor
    assert done.run["drive_work"] == 0


@pytest.mark.parametrize(
    "restitution, speed",
    [(0, 100), (0.8, 100), (1, 100), (0.8, 1000), (1, 1000), pytest.param(0, 1000, marks=pytest.mark.slow)],
)
def test_balls_as_fast_as_bullets_stay_in_the_drum(run, speed, restitution):
    orders = [f"balls.speed={speed} m/s", f"contact.restitution={restitution}"]
    run(MILL, *orders, f"run.time={ms(200 / speed)}", f"output.frames={ms(20 / speed)}", balls=200)


# ---- the ring ----

SMOOTH = ["contact.friction=0", "run.time=600 ms", "run.sample_from=100 ms", "output.frames=20 ms"]


def turning(done):
    """Angular speed of the charge over the rotor's, and the share of its energy that is in the turning."""
    with h5py.File(done.path) as file:
        r, v = (file[f"particles/trajectory/{name}/value"][-1].astype(float) for name in ("position", "velocity"))
        rotor = mill_of(file["deck"]).speed
    momentum = (r[:, 1] * v[:, 2] - r[:, 2] * v[:, 1]).sum()
    speed = momentum / (r[:, 1:] ** 2).sum()
    return speed / rotor, momentum * speed / (v**2).sum()


@pytest.mark.slow
def test_a_charge_without_friction_turns_as_a_ring_and_that_is_said_with_its_speed(run):
    done = run(MILL, *SMOOTH, balls=150)
    speed, share = turning(done)
    assert share > 0.95  # near the rigid limit
    assert f"turns as a ring, at {100 * speed:.0f} % of the rotor's speed" in done.notes
    assert "without friction" in done.notes
    assert "not steady" not in done.notes


def test_a_ring_that_has_not_formed_yet_is_not_said_to_have(run):
    done = run(MILL, *SMOOTH, "run.time=120 ms", balls=150)
    assert "ring" not in done.notes


def test_a_charge_with_friction_is_no_ring(run):
    done = run(MILL, *SMOOTH, "contact.friction=0.3", balls=150)
    assert turning(done)[1] < 0.9
    assert "ring" not in done.notes


# ---- wavy drums ----


def wavy(buckles, height, text=MILL):
    return text.replace(
        "[contact]\n",
        f"profile = wavy\nbuckles = {buckles}\nbuckle_height = {height} mm\n[contact]\n",
        1,
    )


# Shallow and deep, with hardly a neck and with arcs that no ball fits into; more buckles than balls around
BUCKLES = [(2, 6), (3, 0.01), (6, 6), (12, 5.3), (20, 6.5), (60, 2.5)]


@pytest.mark.parametrize("buckles, height", [*BUCKLES, pytest.param(500, 0.3, marks=pytest.mark.thorough)])
def test_any_buckles_run(run, buckles, height):
    done = run(wavy(buckles, height), "blades.tip_radius=26 mm", "rotor.speed=3000 rpm")
    assert done.run["collisions"]["ball_drum"] > 0


def test_a_random_start_fills_a_deep_wavy_drum_to_one_half(run):
    balls = 1900
    done = run(wavy(6, 6, DRUM), "run.time=0.1 ms", "output.frames=0.1 ms", balls=balls)
    with h5py.File(done.path) as file:
        assert solid_fraction(balls, 2.5e-3, 0.060 * mill_of(file["deck"]).drum.area) > 0.4
        y, z = file["particles/trajectory/position/value"][0, :, 1:].astype(float).T
    # bulges are filled as well as the middle
    assert np.mean(np.hypot(y, z) > 0.0375) > 0.05
