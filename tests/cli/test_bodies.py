"""Mills of bodies whose results went wrong once, or could."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracle"))

from mill_parts import prism_mesh, stl

CHARGE = """\
[balls]
count = {count}
diameter = {diameter} mm
density = 7800 kg/m^3
{start}
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.484
[output]
frames = 5 ms
"""
TURN = "[motion.{}]\nkind = turn\naxis = 1 0 0\nspeed = 60 rpm\n"


def charge(count, diameter, start=""):
    return CHARGE.format(count=count, diameter=diameter, start=start)


def test_balls_of_a_random_start_are_within_a_mesh_that_turns(millsim, write_deck, tmp_path):
    """Cells outside of it that no facet comes near to were taken for free."""
    drum = prism_mesh(np.random.default_rng(1), 40.0, 24)[:, :, [2, 0, 1]]  # its axis along x
    radius = np.hypot(drum[..., 1], drum[..., 2]).max() / 1000
    (tmp_path / "drum.stl").write_bytes(stl(drum, binary=True))
    mesh = "[body.drum]\nshape = mesh\nside = inside\nmotion = m\nfile = drum.stl\nunit = mm\n"
    write_deck("[run]\ntime = 20 ms\n" + TURN.format("m") + mesh + charge(100, 5))
    done = millsim("--paranoid", "-o", "run.h5", "deck.ini")
    assert done.returncode == 0, done.stderr
    assert "no anomalies" in done.stdout
    with h5py.File(tmp_path / "run.h5") as file:
        places = file["particles/trajectory/position/value"][0]
    assert np.hypot(places[:, 1], places[:, 2]).max() < radius - 0.0025


def test_a_body_counted_as_the_drum_is_not_taken_for_it_by_the_maps(millsim, write_deck, tmp_path):
    lifter = (
        "[drum]\nradius = 50 mm\nlength = 100 mm\nmotion = m\n"
        "[body.lifter]\nshape = box\nsize = 90 5 10 mm\nmotion = m\ncentre = 0 45 0 mm\n"
    )
    write_deck("[run]\ntime = 0.1 s\n" + TURN.format("m") + lifter + charge(100, 6))
    maps = []
    for kind in ("ball_lifter", "ball_drum"):
        name = f"{kind}.h5"
        assert millsim("-q", "-s", f"body.lifter.kind={kind}", "-o", name, "deck.ini").returncode == 0
        with h5py.File(tmp_path / name) as file:
            maps.append(file["statistics/maps/axial/solid_fraction"][()])
    assert np.array_equal(*maps)


def test_no_motion_loses_its_block_to_one_of_a_name_alike(millsim, write_deck, tmp_path):
    bodies = "".join(
        TURN.format(name) + f"[body.{body}]\nshape = box\nsize = 5 5 5 mm\nmotion = {name}\ncentre = {x} 0 0 mm\n"
        for name, body, x in (("balls", "a", -20), ("motion_balls", "b", 20))
    )
    drum = "[drum]\nradius = 50 mm\nlength = 100 mm\n"
    write_deck("[run]\ntime = 10 ms\n" + bodies + drum + charge(5, 5))
    assert millsim("-q", "-o", "run.h5", "deck.ini").returncode == 0
    with h5py.File(tmp_path / "run.h5") as file:
        blocks = {name for name in file["VTKHDF"] if "motion" in name}
        assert blocks == {"motion_balls", "motion_motion_balls"}
        for name in blocks:
            assert file[f"VTKHDF/{name}/CellData/number"].shape == (12,)


@pytest.mark.parametrize("side", [0, 1e-6])
def test_a_ball_dropped_on_the_axis_into_the_tip_of_a_cone_comes_to_rest_there(millsim, write_deck, tmp_path, side):
    (tmp_path / "start.txt").write_text(f"{side} 0 0.03\n")
    jar = "[body.jar]\nshape = cone\nside = inside\nradius = 0 mm\nend_radius = 50 mm\nlength = 100 mm\n"
    write_deck("[run]\ntime = 2 s\n" + jar + charge(1, 10, "start = start.txt"))
    done = millsim("--paranoid", "-o", "run.h5", "deck.ini")
    assert done.returncode == 0, done.stderr
    assert "no anomalies" in done.stdout
    with h5py.File(tmp_path / "run.h5") as file:
        end = file["particles/trajectory/position/value"][-1, 0]
    tip = 0.005 * np.sqrt(1 + 0.5**2) / 0.5 - 0.05  # the contact radius vanishes
    assert end == pytest.approx([0, 0, tip], abs=1e-4)
