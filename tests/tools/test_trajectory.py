"""Between stored frames balls are where their flights say, and what is not known is said."""

import numpy as np
import pytest
from conftest import SMALL

from milltools.base.errors import UserError
from milltools.geometry.trajectory import Bounds, Flights, State, Trajectory, between, stored
from milltools.read.runfile import Run

FINE, COARSE = (
    0.5e-3,
    2e-3,
)  # [s] frames of the run that is right, and of the one in between which is looked

# one ball that is thrown and bounces on the drum, faster and faster
BALL = """\
[run]
time = 1.2 s
[balls]
count = 1
diameter = 5 mm
density = 7800 kg/m^3
start = start.txt
[drum]
radius = 75 mm
length = 120 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
[output]
impacts = all
"""


@pytest.fixture
def runs(millsim, write_deck, tmp_path):
    """runs(deck, start) gives the same deck run twice: (coarse, fine), open."""
    opened = []

    def make(text, start=None, coarse=COARSE, fine=FINE):
        write_deck(text)
        if start:
            (tmp_path / "start.txt").write_text(start)
        for name, step in (("coarse", coarse), ("fine", fine)):
            words = "-q", "-s", f"output.frames={step!r} s", "-s", "output.impacts=all"
            done = millsim("deck.ini", *words, "-o", f"{name}.h5")
            assert done.returncode == 0, done.stderr
            opened.append(Run(tmp_path / f"{name}.h5"))
        return opened

    yield make
    for run in opened:
        run.close()


def impacts_in(run, begin, end):
    """How many impacts every ball has between two times."""
    first, last = np.searchsorted(run.read("impacts/time"), (begin, end))
    ball, partner, kind = (run.read(f"impacts/{n}", slice(first, last)) for n in ("ball", "partner", "kind"))
    both = np.concatenate([ball, partner[kind == 0]])
    return np.bincount(both, minlength=len(run.balls("id")))


def compare(coarse, fine):
    """Every state of the fine run against the coarse one's trajectory: yields (impacts in the gap, unknown, error [m],
    error of the velocity [m/s], error of the spin [rad/s]), arrays over balls."""
    trajectory, times = Trajectory(coarse), coarse.frame_times()
    for index, time in enumerate(fine.frame_times()):
        if trajectory.frame_at(time) is not None or time > trajectory.end:
            continue
        gap = int(np.searchsorted(times, time)) - 1
        right, found = stored(fine, index), trajectory.at(time)
        flights = trajectory.flights(gap)
        off = [
            np.abs(getattr(found, name) - getattr(right, name)).max(axis=1)
            for name in ("position", "velocity", "angular_velocity")
        ]
        close = np.abs(flights.contact - (time - times[gap])) < 1e-6  # before it or after: as may be
        yield impacts_in(fine, times[gap], times[gap + 1]), flights.unknown, *off, close


@pytest.mark.slow
@pytest.mark.parametrize(
    "start",
    [
        "0 0 0 0 0 0\n",  # straight down: several bounces cross in a point as well, but behind the wall
        "0 0.03 0.02 0.05 -0.4 0.3 0 0 20\n",
        "0.05 0 0 0.5 0.2 0\n",
    ],
)
def test_a_bouncing_ball_is_where_a_run_with_finer_frames_has_it(runs, start):
    coarse, fine = runs(BALL, start, coarse=40e-3, fine=4e-3)
    bounces = {"flies": 0, "bounces once": 0, "bounces more": 0}
    for impacts, unknown, place, speed, spin, close in compare(coarse, fine):
        bounces[("flies", "bounces once", "bounces more")[min(impacts[0], 2)]] += 1
        assert unknown[0] == (impacts[0] > 1)
        if not unknown[0]:
            assert place[0] < 4e-8  # float32 of 0.1 m and of 1 m/s for 20 ms
            assert close[0] or (speed[0] < 4e-7 and spin[0] < 2e-5)
    assert min(bounces.values()) > 20


@pytest.mark.slow
def test_in_a_mill_no_more_than_one_contact_is_known_and_right(runs):
    coarse, fine = runs(SMALL.replace("frames = 5 ms\n", ""))
    once = flying = 0
    for impacts, unknown, place, speed, _, close in compare(coarse, fine):
        assert not unknown[impacts <= 1].any()
        assert place[~unknown].max() < 1e-7
        assert speed[~unknown & ~close].max() < 2e-6
        assert place[unknown].max(initial=0) < 5e-3  # a guess, but no ball is thrown out
        flying += (impacts == 0).sum()
        once += (impacts == 1).sum()
    assert flying > 500 and once > 50


def test_what_is_guessed_is_counted(runs):
    coarse, _ = runs(BALL, "0 0 0 0 0 0\n", coarse=50e-3)
    trajectory = Trajectory(coarse)
    gaps = [impacts_in(coarse, a, a + 50e-3)[0] for a in trajectory.times[:-1]]
    for time in trajectory.times[:-1]:
        trajectory.at(time)
    assert (trajectory.asked, trajectory.unknown) == (0, 0)  # stored states are no guess
    for time in trajectory.times[:-1]:
        trajectory.at(time + 10e-3)
    assert trajectory.asked == len(gaps) == 24
    assert trajectory.unknown == sum(n > 1 for n in gaps) > 0


def test_a_stored_state_comes_back_to_the_bit(runs):
    coarse, _ = runs(SMALL.replace("frames = 5 ms\n", ""))
    trajectory = Trajectory(coarse)
    state = trajectory.at(trajectory.times[7])
    for name in ("position", "velocity", "angular_velocity"):
        assert (getattr(state, name) == coarse.frame(7, name)).all()


def test_states_are_known_from_the_first_frame_to_the_last(runs):
    coarse, _ = runs(SMALL.replace("frames = 5 ms\n", ""))
    with pytest.raises(UserError, match="0.0501 s: ball states are stored from 0 s to 0.05 s"):
        Trajectory(coarse).at(0.0501)


def test_a_contact_s_time_is_exact(runs):
    """Two states a bounce apart, in double precision: only the solution's own error is left."""
    coarse, _ = runs(BALL, "0 0 0 0 0 0\n")
    mill = Bounds(coarse)
    g, floor = 9.81, -0.0725
    rest = np.zeros((1, 3))
    at = 0.013  # [s] of the bounce; up before it, the other way after
    down, up = -1.1, 0.88  # [m/s]
    a = State(0.0, np.array([[0, 0, floor - down * at - g * at**2 / 2]]), np.array([[0.2, 0, down + g * at]]), rest)
    left = 0.02 - at
    b = State(
        0.02,
        np.array([[0.004 - 0.05 * left, 0, floor + up * left - g * left**2 / 2]]),
        np.array([[-0.05, 0, up - g * left]]),
        rest,
    )
    a.position[0, 0] = 0.004 - 0.2 * at
    flights = Flights(a, b, mill)
    assert flights.contact[0] == pytest.approx(at, abs=1e-12)
    assert flights.at(at).position[0] == pytest.approx([0.004, 0, floor], abs=1e-12)


def test_a_frame_that_is_damaged_is_one_line(millsim, small_deck, tmp_path):
    import h5py

    assert millsim("deck.ini", "-q").returncode == 0
    with h5py.File(tmp_path / "deck.h5", "r+") as file:
        file["particles/trajectory/velocity/value"][3, 5, 1] = np.nan
    with Run(tmp_path / "deck.h5") as run, pytest.raises(UserError) as fault:
        Trajectory(run).at(0.015)
    assert "damaged: /particles/trajectory/velocity/value: a value that is not a finite number" in str(fault.value)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 0.7, -3.0, np.pi])
def test_a_pose_between_two_is_a_share_of_the_turn_and_of_the_way(angle):
    c, s = np.cos(angle), np.sin(angle)
    one = np.eye(3, 4)
    two = np.array([[c, -s, 0, 2.0], [s, c, 0, 0], [0, 0, 1, -4]])
    half = between(one, two, 0.5)
    assert half[:, 3] == pytest.approx([1, 0, -2])
    assert np.abs(half[:, :3] @ half[:, :3] - two[:, :3]).max() < 1e-9
    assert between(one, two, 1.0) == pytest.approx(two, abs=1e-9)
