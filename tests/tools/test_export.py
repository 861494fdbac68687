"""mill export writes the mill's bodies as closed surfaces."""

import json
import math
from collections import Counter

import numpy as np
import pytest
from conftest import ROOT, SMALL, slow

from milltools.geometry import contour, solids
from milltools.read.deck import Deck

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
WAVY = SMALL.replace("radius = 30 mm\n", "radius = 30 mm\nprofile = wavy\n", 1)
SHAPES = {
    "circle": SMALL,
    "wavy": WAVY.replace("wavy\n", "wavy\nbuckles = 5\nbuckle_height = 3 mm\nbuckle_angle = 20 deg\n"),
    "overhanging": WAVY.replace("wavy\n", "wavy\nbuckles = 12\nbuckle_height = 5 mm\n"),
    "hardly wavy": WAVY.replace("wavy\n", "wavy\nbuckles = 7\nbuckle_height = 1 nm\n"),
    "lifters": WAVY.replace(
        "wavy\n",
        "lifters\nlifters = 6\nlifter_height = 4 mm\nlifter_width = 5 mm\n"
        "lifter_front = 20 deg\nlifter_back = 30 deg\nlifter_rounding = 1 mm\n",
    ),
}


def read(path):
    """(head, normals (T, 3), corners (T, 3, 3)) of a binary STL, by its layout."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:84], "little")
    assert len(content) == 84 + 50 * count
    rows = np.frombuffer(content, TRIANGLE, offset=84)
    return content[:80], rows["normal"].astype(float), rows["corners"]


def bodies(corners):
    """Triangles joined over the corners they share, body by body."""
    names = {}
    corner = [[names.setdefault(tuple(p), len(names)) for p in t] for t in corners.tolist()]
    root = list(range(len(names)))

    def find(k):
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    for a, b, c in corner:
        root[find(a)] = root[find(b)] = find(c)
    groups = {}
    for number, triangle in enumerate(corner):
        groups.setdefault(find(triangle[0]), []).append(number)
    return [(corners[rows].astype(float), [corner[k] for k in rows]) for rows in groups.values()]


def closed(triangles):
    """Whether each edge of triangles (indices of corners) is there once in each direction."""
    edges = Counter((t[k], t[k - 2]) for t in triangles for k in range(3))
    return all(edges[b, a] == count == 1 for (a, b), count in edges.items())


def volume(corners):
    """Enclosed by triangles that are seen counter-clockwise from outside."""
    return np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6


@pytest.mark.parametrize("shape", slow(SHAPES, "circle", "overhanging"))
@pytest.mark.slow
def test_every_body_is_closed_and_of_its_volume(mill, write_deck, tmp_path, shape):
    wall = contour.of(Deck.check(write_deck(SHAPES[shape])))
    sizes = {}
    for part in ("drum", "walls", *(("shaft", "blades") if shape == "circle" else ())):
        done = mill("export", "deck.ini", "mill.stl", "--part", part, "--tolerance", "5 um")
        assert (done.returncode, done.stderr) == (0, "")
        _, normals, corners = read(tmp_path / "mill.stl")
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (np.einsum("ij,ij->i", normals, across) > 0).all()
        for own, triangles in bodies(corners):
            assert closed(triangles)
            sizes.setdefault(part, []).append(volume(own))
    rim = math.pi * (wall.outermost + 0.0015) ** 2  # a twentieth of the radius thick
    assert sizes["drum"] == pytest.approx([(rim - wall.area) * 0.04], rel=3e-3)
    assert sizes["walls"] == pytest.approx([rim * 0.0015] * 2, rel=1e-3)
    if shape != "circle":
        return
    assert sizes["shaft"] == pytest.approx([math.pi * 0.005**2 * 0.04], rel=2e-3)
    blade = 0.006 * 0.004 * 0.022  # but for the foot, which is hidden in the shaft
    assert len(sizes["blades"]) == 2 and blade * 0.77 < min(sizes["blades"]) <= max(sizes["blades"]) < blade


LARGE = ("stl.ini", "attritor.ini", "wavy.ini", "single.ini")


ALIKE = ("discs.ini", "tumbling.ini", "mixture.ini", "simoloyer.ini")  # their bodies are of kinds that others have


def whole(corners):
    """Triangles as indices into all corners of the file, equal corners joined."""
    return np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3).tolist()


@pytest.mark.parametrize(
    "deck",
    [
        pytest.param(name, marks=pytest.mark.thorough if name in ALIKE else [pytest.mark.slow] * (name in LARGE))
        for name in sorted(p.name for p in (ROOT / "input").glob("*.ini"))
    ],
)
@pytest.mark.slow
def test_all_parts_in_one_file_are_closed_and_separate(mill, tmp_path, deck):
    done = mill("export", ROOT / "input" / deck, "mill.stl", "--json")
    assert done.returncode == 0, done.stderr
    corners = read(tmp_path / "mill.stl")[2]
    assert closed(whole(corners))
    alone = 0
    for part in json.loads(done.stdout)["parts"]:
        assert mill("export", ROOT / "input" / deck, "part.stl", "--part", part).returncode == 0
        alone += len(bodies(read(tmp_path / "part.stl")[2]))
    assert len(bodies(corners)) == alone


@pytest.mark.parametrize("buckles", [2, 3, 18])
def test_no_number_of_buckles_makes_drum_and_end_walls_share_an_edge(the_program, buckles):
    deck = Deck.check(ROOT / "input/wavy.ini", [f"drum.buckles={buckles}", "drum.buckle_height=1.5 mm"])
    made = [body for own in solids.parts(deck, 3.75e-5, 3.75e-3).values() for body in own]
    corners = np.concatenate(made).astype("f4")
    assert closed(whole(corners)) and len(bodies(corners)) == len(made) == 9


def test_the_inner_surface_of_a_wavy_drum_is_its_profile(mill, write_deck, tmp_path):
    profile = contour.of(Deck.check(write_deck(SHAPES["overhanging"])))
    assert mill("export", "deck.ini", "mill.stl", "--part", "drum").returncode == 0
    _, _, corners = read(tmp_path / "mill.stl")
    points = np.unique(corners.reshape(-1, 3), axis=0).astype(float)
    assert set(np.abs(points[:, 0])) == {np.float64(np.float32(0.02))}
    gap = profile.gap(points[:, 1:])
    assert (np.abs(gap) < 1e-8).sum() > 200  # the wall; all others are on the outer circle
    rest = points[np.abs(gap) >= 1e-8]
    assert np.hypot(*rest.T[1:]) == pytest.approx(profile.outermost + 0.0015, abs=1e-8)


def test_without_part_all_bodies_are_there(mill, small_deck, tmp_path):
    assert mill("export", "deck.ini", "all.STL").returncode == 0
    head, _, corners = read(tmp_path / "all.STL")
    assert len(bodies(corners)) == 1 + 2 + 1 + 2
    assert head.startswith(b"millsim ") and b"drum, walls, shaft, blades; metres" in head


@pytest.mark.slow
def test_a_run_and_its_deck_are_the_same_mill(millsim, mill, small_deck, tmp_path):
    order = "rotor.angle=30 deg"
    assert millsim("deck.ini", "-q", "-s", "run.time=1 ms", "-s", order).returncode == 0
    assert mill("export", "deck.h5", "run.stl").returncode == 0
    assert mill("export", "deck.ini", "deck.stl", "-s", order).returncode == 0
    assert mill("export", "deck.ini", "other.stl").returncode == 0
    run, deck, other = ((tmp_path / f"{n}.stl").read_bytes() for n in ("run", "deck", "other"))
    assert run == deck != other


@pytest.mark.slow
def test_at_a_time_the_rotor_is_turned_and_the_drum_is_not(mill, small_deck, tmp_path):
    found = {}
    for parts in (("drum",), ("shaft", "blades")):
        words = [word for part in parts for word in ("--part", part)]
        for time in ("0 s", "25 ms"):  # a quarter of a turn at 600 rpm
            done = mill("export", "deck.ini", "mill.stl", *words, "--time", time)
            assert (done.returncode, done.stderr) == (0, "")
            at = "0 s" if time == "0 s" else "0.025 s"
            assert done.stdout.startswith(f"mill.stl: {', '.join(parts)} at {at}: ")
            found[parts[0], time] = read(tmp_path / "mill.stl")[2]
    assert (found["drum", "0 s"] == found["drum", "25 ms"]).all()
    x, y, z = np.moveaxis(found["shaft", "0 s"], -1, 0)
    quarter = np.stack([x, -z, y], axis=-1)  # +y has come to +z
    assert found["shaft", "25 ms"] == pytest.approx(quarter, abs=1e-8)
    assert len(bodies(found["shaft", "25 ms"])) == 1 + 2  # corners that met still do


@pytest.mark.slow
def test_a_frame_of_a_run_is_a_time(millsim, mill, small_deck, tmp_path):
    assert millsim("deck.ini", "-q", "-s", "run.time=20 ms").returncode == 0
    assert mill("export", "deck.h5", "frame.stl", "--frame", "3").returncode == 0
    assert mill("export", "deck.h5", "time.stl", "--time", "15 ms").returncode == 0
    assert (tmp_path / "frame.stl").read_bytes() == (tmp_path / "time.stl").read_bytes()


def test_a_finer_tolerance_makes_more_triangles_and_an_old_file_is_replaced(mill, small_deck, tmp_path):
    counts = []
    for tolerance in ("0.5 mm", "5e-5"):
        done = mill("export", "deck.ini", "mill.stl", "--part", "drum", "--tolerance", tolerance)
        assert done.returncode == 0, done.stderr
        counts.append(len(read(tmp_path / "mill.stl")[2]))
    assert counts[1] > 2 * counts[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.ini", "mill.stl"]


BARE = SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :]


def test_a_mill_without_a_rotor_has_drum_and_walls(mill, write_deck, tmp_path):
    write_deck(BARE)
    assert mill("export", "deck.ini", "mill.stl").returncode == 0
    assert len(bodies(read(tmp_path / "mill.stl")[2])) == 3


@pytest.mark.parametrize(
    "words, line",
    [
        (["deck.ini", "mill.xyz"], "mill.xyz: expected a name ending in .stl"),
        (["deck.ini", "mill"], "mill: expected a name ending in .stl"),
        (["deck.ini", "a.stl", "--part", "shaft"], "deck.ini: --part shaft: this mill has no such part"),
        (["deck.ini", "a.stl", "--part", "lid"],
         "deck.ini: --part lid: this mill has no such part; it has drum, walls"),
        (["deck.ini", "a.stl", "--tolerance", "1 s"], "--tolerance: expected a length such as '0.1 mm', got '1 s'"),
        (["deck.ini", "a.stl", "--tolerance", "-1 mm"], "--tolerance: must be 0 or more, got '-1 mm'"),
        (["deck.ini", "a.stl", "--tolerance", "1 mm"],
         "--tolerance: expected 3e-08 to 0.00075 m for this drum and wall, got 0.001 m"),
        (["deck.ini", "a.stl", "--thickness", "1 um"],
         "--thickness: expected 3e-05 to 0.3 m for this drum, got 1e-06 m"),
        (["deck.ini", "a.stl", "-s", "drum.radius=1 s"], "--set drum.radius"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line(mill, write_deck, tmp_path, words, line):
    write_deck(BARE)
    done = mill("export", *words)
    assert done.returncode == 2
    assert done.stderr.startswith(f"mill export: {line}"), done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert [p.name for p in tmp_path.iterdir()] == ["deck.ini"]


def test_a_source_that_is_missing_is_one_line(mill, tmp_path):
    done = mill("export", "none.ini", "a.stl")
    line = "none.ini: cannot be read: No such file or directory"
    assert (done.returncode, done.stderr) == (1, f"mill export: {line}\n")


def test_a_folder_that_is_missing_is_one_line(mill, small_deck):
    done = mill("export", "deck.ini", "nowhere/a.stl")
    assert (done.returncode, done.stderr) == (
        1,
        "mill export: nowhere/a.stl: No such file or directory\n",
    )
