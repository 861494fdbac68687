"""Meshes as CAD writes them: a file of several solids is their union, and a file with faults is told all of them."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "oracle"))

from mill_parts import outward, stl

DECK = """\
[run]
time = 1 us
[balls]
diameter = 4 mm
density = 7800 kg/m^3
bulk_fill = 30 %
[contact]
restitution = 0.8
[motion.m]
kind = turn
speed = 10 rpm
[body.tank]
shape = box
side = inside
size = 50 50 50 mm
[body.rotor]
shape = mesh
motion = m
file = rotor.stl
unit = mm
"""


def box(size, centre=(0, 0, 0)):
    """Facets of a box, in mm; facing inwards if the size is negative."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.abs(size) / 2
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    facets = outward(corners, [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]) + np.array(centre)
    return facets if np.min(size) > 0 else facets[:, ::-1]


def cylinder(radius, length, sides=48):
    at = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([radius * np.cos(at), radius * np.sin(at)], axis=-1)
    points = np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (-length / 2, length / 2)])
    ends = [(base, base + k, base + k + 1) for base in (0, sides) for k in range(1, sides - 1)]
    around = [(k, (k + 1) % sides, (k + 1) % sides + sides) for k in range(sides)]
    around += [(k, (k + 1) % sides + sides, k + sides) for k in range(sides)]
    return outward(points, ends + around)


@pytest.fixture
def rotor(write_deck, tmp_path):
    """rotor(*parts): writes a deck whose rotor is a mesh of these solids."""

    def write(*parts):
        (tmp_path / "rotor.stl").write_bytes(stl(np.vstack(parts), binary=True))
        return write_deck(DECK)

    return write


def start(millsim, tmp_path):
    """Places of the balls [mm] at the start, and what was said."""
    done = millsim("-q", "-f", "--export-start", "start.txt", "deck.ini")
    assert done.returncode == 0, done.stderr
    return 1000 * np.loadtxt(tmp_path / "start.txt")[:, :3], done.stderr


def test_a_solid_within_another_leaves_the_start_as_it_is(millsim, rotor, tmp_path):
    rotor(box((30, 30, 30)))
    alone, _ = start(millsim, tmp_path)
    rotor(box((30, 30, 30)), box((20, 20, 20)))
    both, said = start(millsim, tmp_path)
    assert len(both) == 526  # 0.18 (50^3 - 30^3) / (pi/6 4^3)
    assert (both == alone).all() and said == ""


def test_a_closed_room_in_a_body_is_not_filled_and_its_volume_is_told(millsim, rotor, tmp_path):
    rotor(box((30, 30, 30)), box((-20, -20, -20)))
    balls, said = start(millsim, tmp_path)
    assert len(balls) == 526 and (np.abs(balls).max(axis=1) > 15).all()
    assert "[body.rotor] file: it encloses 8 cm3 that no ball can reach" in said


def test_no_ball_starts_in_solids_that_touch(millsim, rotor, tmp_path):
    rotor(box((20, 20, 20), (-10, 0, 0)), box((20, 20, 20), (10, 0, 0)))
    balls, _ = start(millsim, tmp_path)
    assert len(balls) == 586  # of 125 - 16 cm3
    assert (np.abs(balls / [20, 10, 10]).max(axis=1) > 1).all()


def test_no_ball_starts_deep_within_a_mesh_of_small_facets_that_turns(millsim, rotor, tmp_path):
    """No facet comes near to such a place, and it was taken for free."""
    rotor(cylinder(20, 20))
    balls, _ = start(millsim, tmp_path)
    assert ((np.hypot(balls[:, 0], balls[:, 1]) > 19) | (np.abs(balls[:, 2]) > 10)).all()


def test_a_vessel_given_as_a_solid_holds_the_balls_within(millsim, write_deck, tmp_path):
    (tmp_path / "rotor.stl").write_bytes(stl(np.vstack([box((60, 60, 60)), box((-50, -50, -50))]), binary=False))
    head, tail = DECK.split("[motion.m]")[0], "[body.tank]\nshape = mesh\nside = inside\nfile = rotor.stl\nunit = mm\n"
    write_deck(head + tail)
    balls, said = start(millsim, tmp_path)
    assert abs(len(balls) - 671.4) < 1 and np.abs(balls).max() < 23
    assert "[body.tank] file: it is a solid with a room in it, and the balls are in this room" in said


def test_all_faults_of_a_mesh_are_told_with_places_of_the_file_and_the_mend(refused, rotor, tmp_path):
    parts = [box((20, 20, 20)), box((20, 20, 20), (19, 3, 1)), box((20, 20, 20), (60, 0, 0))[1:]]
    parts[0][0] = parts[0][0][::-1]
    rotor(*parts)
    lines = refused("deck.ini", most=9)
    mend = f"; mend it with 'mill mesh {tmp_path}/rotor.stl -o OUT.stl'"
    assert all(line.startswith("deck.ini:19: [body.rotor] file: ") and line.endswith(mend) for line in lines)
    words = [line.removeprefix("deck.ini:19: [body.rotor] file: ").removesuffix(mend) for line in lines]
    assert words[0].startswith("not closed: a hole along 3 edges, beside facet 2") and "at (" in words[0]
    assert words[1].startswith("facets turned over along 3 edges, beside facet 1 at (-10, ")
    assert any("cross at (9, " in what for what in words[2:])


@pytest.mark.parametrize("sides", [(4e-7, 4e-7, 4e-7), (20, 20, 4e-7)])
def test_no_mesh_measures_less_than_a_nanometre(sides, refused, rotor):
    rotor(box(sides))
    line = refused("deck.ini")
    assert line.startswith("deck.ini:20: [body.rotor] unit: the mesh measures ")
    assert line.endswith(" m, and no length of a body may be below 1e-09 m")


def test_twenty_faults_of_a_mesh_are_told_and_the_others_counted(refused, rotor):
    rotor(*(box((2, 2, 2), (3 * k, 0, 0))[1:] for k in range(30)))
    lines = refused("deck.ini", most=21)
    assert len(lines) == 21 and all("a hole along 3 edges" in line for line in lines[:20])
    assert lines[20] == "deck.ini: 10 more faults"


@pytest.mark.parametrize(
    "name, words",
    [
        ("a.obj", "# made by hand\nv 0 0 0\n"),
        ("a.ply", "ply\nformat ascii 1.0\n"),
        ("a.3mf", "PK\x03\x04"),
    ],
)
def test_a_file_of_another_format_is_told_how_to_convert_it(refused, write_deck, tmp_path, name, words):
    (tmp_path / name).write_text(words + 100 * " ")
    write_deck(DECK.replace("rotor.stl", name))
    kind = name.split(".")[1].upper()
    assert f"seems to be a{'n' * (kind[0] == 'O')} {kind} file, not STL: 'mill mesh {tmp_path}/{name} -o" in refused(
        "deck.ini"
    )


@pytest.mark.slow
def test_that_not_a_single_ball_fits_is_told_soon(refused, rotor):
    rotor(cylinder(18, 30, 2000))
    assert "not a single ball fits" in refused(
        "-q", "deck.ini", "-s", "balls.diameter=20 mm", "-s", "balls.bulk_fill=60 %"
    )
