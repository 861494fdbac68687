"""Runs with periodic ends: no tool shows end walls, and a ball that leaves at one end is shown at the other."""

import struct

import numpy as np
import pytest

from milltools.foreign.digest import snapshot_times
from milltools.geometry import contour
from milltools.geometry.cells import Maps
from milltools.geometry.trajectory import Trajectory, stored
from milltools.read.deck import Deck
from milltools.read.runfile import Run
from milltools.report import facts

GAS = """\
[run]
time = 60 ms
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 60
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 15 mm
length = 20 mm
ends = periodic
[contact]
restitution = 1
[output]
frames = 0.3 ms
"""


@pytest.fixture
def run(millsim, write_deck, tmp_path):
    """run(*arguments): the open Run of the gas."""
    opened = []

    def make(*arguments):
        write_deck(GAS)
        path = tmp_path / f"{len(opened)}.h5"
        assert millsim("deck.ini", "--quiet", "-o", path.name, *arguments).returncode == 0
        opened.append(Run(path))
        return opened[-1]

    yield make
    for one in opened:
        one.close()


def test_between_frames_balls_fly_through_the_ends(run):
    fine, coarse = run(), run("-s", "output.frames=1.2 ms")
    trajectory, crossed = Trajectory(coarse), 0
    for index in range(len(fine.frame_times())):
        state = stored(fine, index)
        found = trajectory.at(state.time)
        flights = trajectory.flights(min(index // 4, len(coarse.frame_times()) - 2))
        known = ~flights.unknown
        assert np.abs(found.position[:, 0]).max() <= 0.01 * (1 + 1e-6)
        off = found.position - state.position
        off[:, 0] -= 0.02 * np.rint(off[:, 0] / 0.02)
        assert np.abs(off[known]).max() < 1e-6
        crossed += np.sum(known & (np.abs(flights.b.position[:, 0]) > 0.01))
    assert crossed > 100


def test_frames_make_the_maps_of_the_file_also_next_to_the_ends(run, tmp_path, the_program):
    run()
    deck = Deck.check(tmp_path / "deck.ini")
    with Run(tmp_path / "0.h5") as file:
        times, maps = snapshot_times(deck), Maps(contour.of(deck), 0.02, periodic=True)
        frames = np.argmin(np.abs(file.frame_times() - times[:, None]), axis=1)
        for k in frames:
            state = stored(file, int(k))
            maps.sample(state.position, state.velocity, file.balls("diameter") / 2)
        volume, solid = maps.axial.flow[0].reshape(maps.axial.n), file.read("statistics/maps/axial/solid_fraction")
    off = volume / (maps.axial.room.reshape(maps.axial.n) * maps.samples) - solid
    assert np.abs(off).sum() <= 1e-3 * solid.sum()


@pytest.mark.slow
def test_no_tool_knows_end_walls(run, mill, tmp_path):
    found = run()
    assert found.kinds == ("ball_ball", "ball_drum") and found.vessel_kinds[0] == "ball_drum"
    assert "20\xa0mm long with periodic ends" in facts.mill(found)
    assert mill("export", "deck.ini", "mill.stl").returncode == 0
    raw = (tmp_path / "mill.stl").read_bytes()
    corners = np.frombuffer(raw[84:], np.dtype([("n", "<3f4"), ("p", "<9f4"), ("a", "<u2")]))["p"].reshape(-1, 3)
    assert struct.unpack("<I", raw[80:84])[0] == len(corners) // 3
    assert np.abs(corners[:, 0]).max() == pytest.approx(0.01)  # walls would be outside of this
    done = mill("export", "deck.ini", "walls.stl", "--part", "walls")
    assert done.returncode == 2 and "no such part" in done.stderr


def test_the_axial_cut_has_no_line_at_the_ends(run):
    plt = pytest.importorskip("matplotlib.pyplot")
    from milltools.figures import outlines

    figure, ax = plt.subplots()
    wall = outlines.axial(ax, run())
    assert wall.get_edgecolor()[3] == 0
    lines = [line for line in ax.lines if line.get_label() == "_mantle"]
    assert [list(line.get_ydata()) for line in lines] == [[0.015, 0.015]]
    plt.close(figure)


def test_the_box_of_gsd_is_as_long_as_the_slice(run, mill, tmp_path):
    gsd = pytest.importorskip("gsd.hoomd")
    run()
    assert mill("export", "0.h5", "balls.gsd").returncode == 0
    with gsd.open(str(tmp_path / "balls.gsd")) as file:
        assert file[0].configuration.box[0] == pytest.approx(0.02)
        assert file[0].configuration.box[1] > 0.03
