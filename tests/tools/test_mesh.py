"""mill mesh: millsim accepts what it makes of meshes of other programs. What it cannot mend, it refuses, with all
faults, and writes nothing."""

import io
import itertools
import os
import re
import struct
import types
import zipfile

import numpy as np
import pytest

from milltools.base.errors import UserError
from milltools.mesh import judge, mend, read, surface
from milltools.mesh import threemf as threemf_limits

# ---- meshes: triangles (N, 3, 3), counter-clockwise as seen from outside


def box(*size, at=(0, 0, 0)):
    places = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * size + at
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return places[[corner for a, b, c, d in quads for corner in ((a, b, c), (a, c, d))]]


def ball(radius, around=48, rings=24):
    """A sphere of facets, small ones but for few rings."""
    theta, phi = np.pi * np.arange(rings + 1) / rings, 2 * np.pi * np.arange(around) / around
    x, y, z = np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)), np.cos(theta)
    place = radius * np.round(np.stack([x, y, np.tile(z[:, None], around)], axis=2), 9)
    facets = []
    for k, j in itertools.product(range(rings), range(around)):
        a, b, c, d = place[k, j], place[k + 1, j], place[k + 1, (j + 1) % around], place[k, (j + 1) % around]
        facets += [(a, b, d)] * (k > 0) + [(b, c, d)] * (k < rings - 1)
    return np.array(facets)


def turned(mesh):
    return mesh[:, ::-1]


def stl(*meshes, more=b""):
    corners = np.concatenate([mesh.astype("<f4") for mesh in meshes])
    rows = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])
    rows["corners"] = corners
    return bytes(80) + struct.pack("<I", len(rows)) + rows.tobytes() + more


def ascii_stl(mesh):
    facets = [
        "facet normal nan 0 0\nouter loop\n" + "".join("vertex {!r} {!r} {!r}\n".format(*map(float, c)) for c in facet)
        + "endloop\nendfacet\n"
        for facet in mesh
    ]  # fmt: skip
    return f"solid a name\n{''.join(facets)}endsolid a name\n".encode()


def corners(path):
    data = path.read_bytes()
    return np.frombuffer(data, [("normal", "<f4", 3), ("c", "<f4", (3, 3)), ("extra", "<u2")], offset=84)["c"]


def volume(mesh):
    a, b, c = np.asarray(mesh, float).transpose(1, 0, 2)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)[
    [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
]

DECK = """\
[run]
time = 1 ms
[body.room]
shape = box
side = inside
size = 200 200 200 mm
[body.rotor]
shape = mesh
file = out.stl
unit = {unit}
[balls]
count = 1
diameter = 2 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
friction = 0.3
"""


@pytest.fixture
def made(mill, millsim, tmp_path):
    """made(*files, *options): the answer of `mill mesh` and the facets that it wrote, which millsim accepts; `files`:
    bytes of STL, or (name, bytes)."""

    def make(*files, unit="mm"):
        options = [one for one in files if isinstance(one, str)]
        named = [("in.stl", one) if isinstance(one, bytes) else one for one in files if not isinstance(one, str)]
        for name, content in named:
            (tmp_path / name).write_bytes(content)
        done = mill("mesh", *(name for name, _ in named), "-o", "out.stl", "-q", *options)
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        (tmp_path / "deck.ini").write_text(DECK.format(unit=unit))
        checked = millsim("--check", "deck.ini")
        assert checked.returncode == 0, checked.stderr
        return done.stdout, corners(tmp_path / "out.stl")

    return make


@pytest.fixture
def refusal(mill, tmp_path):
    """refusal(*files, *options): the lines with which `mill mesh` refuses, after checking that it wrote nothing."""

    def refuse(*files, status=2):
        options = [one for one in files if isinstance(one, str)]
        named = [("in.stl", one) if isinstance(one, bytes) else one for one in files if not isinstance(one, str)]
        for name, content in named:
            (tmp_path / name).write_bytes(content)
        before = sorted(tmp_path.iterdir())
        done = mill("mesh", *(name for name, _ in named), "-o", "out.stl", "-q", *options)
        assert (done.returncode, done.stdout) == (status, ""), done.stderr
        assert sorted(tmp_path.iterdir()) == before
        return [line.removeprefix("mill mesh: ") for line in done.stderr.splitlines()]

    return refuse


# ---- what is right stays


@pytest.mark.parametrize("file", [stl, ascii_stl], ids=["binary", "ascii"])
def test_a_good_mesh_keeps_its_facets_and_their_order(made, file):
    mesh = ball(20, around=8, rings=4)
    said, found = made(file(mesh))
    assert (found == mesh.astype("<f4")).all()
    assert said.splitlines()[0] == "nothing to mend"


def test_the_answer_has_volume_size_and_unit(made):
    said, _ = made(stl(box(40, 20, 10)), "--unit", "mm")
    assert said.splitlines()[-1] == "out.stl: 12 facets, volume 8000, 40 x 20 x 10 mm; in the deck: unit = mm"


def test_the_progress_names_each_step(tmp_path):
    (tmp_path / "in.stl").write_bytes(stl(box(30, 30, 30), box(20, 20, 20, at=(15, 0, 0))))
    told = []
    asked = types.SimpleNamespace(input=[str(tmp_path / "in.stl")], unit=None, hole=None, weld=None)
    mend.mended(asked, told.append)
    steps = [re.sub(r" \S*in\.stl|, \d+ of \d+ to go|, try \d of \d", "", text) for text, _ in itertools.groupby(told)]
    assert [step for step, _ in itertools.groupby(steps)] == [
        "reading", "mending", "finding which shells lie within others", "uniting solids",
        "checking that millsim accepts it",
    ]  # fmt: skip


def test_the_same_files_give_the_same_bytes(made, tmp_path):
    written = []
    for _ in range(2):
        made(stl(ball(20), box(60, 10, 10, at=(5, 1, 2))), "--force")
        written.append((tmp_path / "out.stl").read_bytes())
    assert written[0] == written[1]


# ---- solids: what at least one of them fills


@pytest.mark.parametrize(
    "solids, right, count",
    [
        ((box(30, 30, 30), box(20, 20, 20)), 27000, 1),
        ((box(20, 20, 20), box(20, 20, 20, at=(20, 0, 0))), 16000, 1),
        ((box(20, 20, 20), box(20, 10, 20, at=(20, 0, 0))), 12000, 1),
        ((box(30, 30, 30), box(20, 20, 20, at=(10, 3, 2))), 29000, 1),
        ((box(10, 10, 60), box(60, 10, 10), box(10, 60, 10)), 16000, 1),
        ((box(10, 10, 10), box(10, 10, 10, at=(30, 0, 0))), 2000, 2),
        ((box(30, 30, 30), turned(box(20, 20, 20)), box(10, 10, 10)), 27000 - 8000 + 1000, 3),
        ((box(30, 30, 30), turned(box(20, 20, 20)), box(40, 10, 10)), 27000 - 8000 + 3000, 1),
    ],
    ids=["nested", "flush", "flush in part", "crossing", "three", "apart", "solid in a room", "through a room"],
)
def test_solids_are_united(made, solids, right, count):
    said, found = made(stl(*solids))
    assert volume(found) == pytest.approx(right, rel=1e-6)
    if len(solids) == 2:
        how = "united" if count == 1 else "apart from each other, none touches another"
        before = sum(map(volume, solids))
        assert said.splitlines()[0] == f"solids: 2 {how}, now {count}; volume {before:.6g}, now {right}"


def ring(outer, inner, low, high, corners=64):
    """A ring whose outlines are polygons."""
    around = 2 * np.pi * np.arange(corners) / corners
    one, many = np.stack([np.cos(around), np.sin(around)], axis=1), np.ones(corners)
    loops = [
        np.column_stack([r * one, z * many]) for r, z in ((outer, low), (outer, high), (inner, high), (inner, low))
    ]
    facets = []
    for p, q in zip(loops, loops[1:] + loops[:1]):
        a, b, c, d = p, np.roll(p, -1, axis=0), np.roll(q, -1, axis=0), q
        facets += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    return np.concatenate(facets)


@pytest.mark.parametrize("seed", (6, 9, 11))
@pytest.mark.parametrize(
    "solids, right",
    [
        ((box(20, 20, 20), box(20, 10, 20, at=(20, 0, 0))), 12000),
        ((ring(20, 10, -15, 15), ring(10, 6, -15, 15)), 30 * 32 * np.sin(np.pi / 32) * (20**2 - 6**2)),
    ],
    ids=["boxes", "hub with bush"],
)
def test_faces_that_lie_upon_each_other_only_nearly_are_united(made, solids, right, seed):
    """Solids with common faces, turned to any direction: their corners are rounded to single precision."""
    across, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    across *= np.linalg.det(across)
    _, found = made(stl(*(mesh @ across.T + 30 for mesh in solids)))
    assert volume(found - found.mean(axis=(0, 1))) == pytest.approx(right, rel=1e-4)


def test_nothing_is_said_of_solids_of_which_none_was_joined(made):
    said, _ = made(stl(ring(20, 10, -5, 5), box(8, 8, 8)))
    assert said.count("solid around") == 2 and "solids:" not in said


def test_several_files_become_one(made):
    _, found = made(("a.stl", stl(box(30, 30, 30))), ("b.stl", stl(box(20, 20, 20, at=(15, 0, 0)))))
    assert volume(found) == pytest.approx(27000 + 4000, rel=1e-6)


def test_a_closed_room_stays_and_is_told(made):
    said, found = made(stl(box(30, 30, 30), turned(box(20, 20, 20))))
    assert volume(found) == pytest.approx(27000 - 8000)
    assert said.splitlines()[:3] == [
        "1 closed room within the solids, of 8000 in all",
        "solid around (0, 0, 0): volume 27000",
        "room around (0, 0, 0): volume 8000",
    ]


@pytest.mark.parametrize("over", [False, True], ids=["outwards", "one turned over"])
def test_solids_that_touch_along_an_edge_are_two(made, over):
    other = box(10, 10, 10, at=(10, 10, 0))
    _, found = made(stl(box(10, 10, 10), turned(other) if over else other))
    assert volume(found) == pytest.approx(2000, rel=1e-5)


# ---- facets that face to the wrong side


def test_single_facets_are_turned_as_their_neighbours(made):
    mesh = ball(20)
    mesh[[7, 100, 101]] = turned(mesh[[7, 100, 101]])
    said, found = made(stl(mesh))
    assert said.splitlines()[0] == "in.stl: 3 facets turned to face as the others around"
    assert volume(found) == pytest.approx(volume(ball(20)))


def test_a_mesh_inside_out_is_turned_over(made):
    said, found = made(stl(turned(box(30, 30, 30)), box(20, 20, 20)))
    assert said.splitlines()[0] == "2 shells faced inwards: turned over"
    assert volume(found) == pytest.approx(27000 - 8000)


# ---- what does not quite fit


def test_a_small_hole_is_closed(made):
    mesh = ball(20, rings=48)
    said, found = made(stl(np.delete(mesh, [0, 1], axis=0)))
    assert re.match(r"in\.stl: a hole of 4 sides closed, [\d.]+ across\n", said)
    assert volume(found) == pytest.approx(volume(mesh), rel=1e-3)


def test_a_large_hole_is_closed_only_on_demand(made, refusal):
    mesh = box(30, 20, 10)[2:]  # without a side of 20 by 10
    (line,) = refusal(stl(mesh))
    assert line == (
        "in.stl: a hole of 4 sides, 20 across, around (-15, 0, 0): if a face is missing there, close it with "
        "--hole 20; else give the sheet that ends there a thickness"
    )
    _, found = made(stl(mesh), "--hole", "20")
    assert volume(found) == pytest.approx(6000)


def test_a_concave_hole_is_closed_within_its_outline(made):
    """The end of a bar whose cross-section is an L."""
    outline = np.array([(0, 0), (30, 0), (30, 10), (10, 10), (10, 30), (0, 30)], float)
    mesh = []
    for (x, y), (u, v) in zip(outline, np.roll(outline, -1, axis=0)):
        a, b, c, d = (x, y, 0), (u, v, 0), (u, v, 40), (x, y, 40)
        mesh += [(a, b, c), (a, c, d)]
    _, found = made(stl(np.array(mesh)), "--hole", "30")
    assert volume(found) == pytest.approx(500 * 40)


def test_corners_that_are_apart_are_welded(made):
    mesh = ball(20)
    mesh[::3] += 1e-5
    said, found = made(stl(mesh))
    assert re.search(r"in\.stl: \d+ corners welded, up to [\d.e-]+ apart\n", said)
    assert volume(found) == pytest.approx(volume(ball(20)), rel=1e-5)


def test_a_side_is_split_at_a_corner_that_lies_on_it(made):
    mesh = box(20, 20, 20)
    a, b, c = mesh[0]
    half = np.array([(a, (a + b) / 2, c), ((a + b) / 2, b, c)])
    said, found = made(stl(half, mesh[1:]))
    assert said.splitlines()[0] == "in.stl: 1 side split at corners that lay on it"
    assert (volume(found), len(found)) == (pytest.approx(8000), 14)


def test_facets_without_area_and_doubled_ones_are_dropped(made):
    mesh = box(20, 20, 20)
    a, b, _ = mesh[0]
    said, found = made(stl(mesh, mesh[3:4], np.array([(a, b, (a + b) / 2)])))
    assert said.splitlines()[:2] == [
        "in.stl: 1 facet without area taken out",
        "in.stl: 1 facet dropped that was there twice",
    ]
    assert len(found) == 12


def test_a_facet_without_area_between_two_others_goes_to_them(made):
    """One side of a box is cut at the middle of a diagonal; there is a facet without area from corner to corner."""
    mesh = box(20, 20, 20)
    a, b, c = mesh[0]
    middle = (a + c) / 2
    said, found = made(stl(mesh[1:], np.array([(a, b, middle), (middle, b, c), (a, middle, c)])))
    assert said.splitlines()[0] == "in.stl: 1 facet without area taken out"
    assert (volume(found), len(found)) == (pytest.approx(8000), 14)


def test_facets_that_are_seen_from_both_sides_count_once(made):
    mesh = box(20, 20, 20)
    _, found = made(stl(mesh, turned(mesh)))
    assert volume(found) == pytest.approx(8000)


def test_a_wall_within_a_solid_is_taken_out(made):
    """Two boxes that share one side, which is there once."""
    left, right = box(20, 20, 20), box(20, 20, 20, at=(20, 0, 0))
    said, found = made(stl(left, right[2:]))
    assert said.splitlines()[0] == "in.stl: 2 facets of walls within the solid dropped"
    assert volume(found) == pytest.approx(16000)


def test_a_facet_that_comes_back_to_where_it_was_ends_mending(monkeypatch):
    """A tetrahedron with a corner within rounding of the end of a side: the facet between them has no area, nor has
    the one that its neighbour gets from it."""
    found, asked = surface.Surface._flat, []
    monkeypatch.setattr(surface.Surface, "_flat", lambda self: asked.append(0) or found(self))
    points = [(0, 0, 0), (0, 0, 1.9e-9), (0, 0, -2.8e-6), (0.0018, 0.0012, 0.0747), (-0.05, 0.01, 0.03)]
    facets = [(3, 1, 0), (3, 0, 2), (4, 0, 1), (4, 2, 0), (3, 2, 4), (3, 4, 1)]
    one = surface.Surface(np.array(points, "f4").astype(float), np.array(facets))
    one.close(1e-8, 0.0)
    assert (one.partner >= 0).all() and len(asked) < 30


def fin(mesh, height):
    """A facet that stands on an edge of a ball."""
    a, b, _ = mesh[len(mesh) // 2]
    return np.array([(a, b, a * (1 + height / np.linalg.norm(a)))])


def test_a_small_sheet_that_sticks_out_is_dropped(made):
    mesh = ball(20, around=96, rings=48)
    said, found = made(stl(mesh, fin(mesh, 1)))
    assert said.splitlines()[0] == "in.stl: 1 facet dropped of small sheets that stuck out"
    assert len(found) == len(mesh)


# ---- formats


QUADS = "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
PLACES = "".join(f"v {x} {y} {z}\n" for x, y, z in itertools.product((0, 10), repeat=3))


def test_obj_has_faces_of_any_number_of_corners(made):
    """A bar whose ends are an L, concave, of six corners, counted from the last one."""
    outline = [(0, 0), (30, 0), (30, 10), (10, 10), (10, 30), (0, 30)]
    text = "".join(f"v {x} {y} {z}\n" for z in (0, 40) for x, y in outline)
    text += "f 6//1 5//1 4//1 3//1 2//1 1//1\nf -6 -5 -4 -3 -2 -1\n"
    text += "".join(f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}\n" for k in range(6))
    _, found = made(("in.obj", text.encode()))
    assert volume(found) == pytest.approx(500 * 40)


def test_the_contents_tell_the_format_whatever_the_name_says(made):
    """millsim advises `mill mesh` for such a file."""
    text = "# a tetrahedron\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in [(0, 0, 0), (9, 0, 0), (0, 9, 0), (0, 0, 9)])
    _, found = made(("in.stl", (text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n").encode()))
    assert volume(found) == pytest.approx(9**3 / 6)


def test_parts_of_an_obj_that_are_closed_are_solids_and_others_belong_together(made):
    sides = "".join(f"g side{k}\n{line}\n" for k, line in enumerate(QUADS.splitlines()))
    other = "".join(f"v {x} {y} {z}\n" for x, y, z in itertools.product((5, 25), repeat=3))
    shifted = re.sub(r"\d+", lambda number: str(int(number[0]) + 8), QUADS)
    _, found = made(("in.obj", f"{PLACES}{other}{sides}o other\n{shifted}".encode()))
    assert volume(found) == pytest.approx(1000 + 8000 - 125, rel=1e-6)


def test_a_part_that_is_turned_over_is_told_from_one_that_it_touches(made):
    other = re.sub(r"(?m)^v \d+", lambda line: f"v {int(line[0][2:]) + 10}", PLACES)
    over = "".join(f"f {' '.join(str(int(word) + 8) for word in line.split()[:0:-1])}\n" for line in QUADS.splitlines())
    _, found = made(("in.obj", f"o a\n{PLACES}{QUADS}o b\n{other}{over}".encode()))
    assert volume(found) == pytest.approx(2000)


def test_a_concave_face_of_four_corners_is_cut_within_it(made):
    """A bar whose ends are arrow heads; the diagonal outside of them is the shorter one."""
    outline = [(0, 0), (10, 30), (0, 24), (-10, 30)]
    text = "".join(f"v {x} {y} {z}\n" for z in (0, 40) for x, y in outline) + "f 4 3 2 1\nf 5 6 7 8\n"
    text += "".join(f"f {k + 1} {(k + 1) % 4 + 1} {(k + 1) % 4 + 5} {k + 5}\n" for k in range(4))
    _, found = made(("in.obj", text.encode()))
    assert volume(found) == pytest.approx(240 * 40)


def test_files_that_an_obj_names_are_not_opened(made, tmp_path):
    os.mkfifo(tmp_path / "pipe")  # to open it would block
    made(("in.obj", f"mtllib pipe\nmtllib /etc/passwd\nusemtl a\n{PLACES}{QUADS}".encode()))


HEAD = "ply\nformat {} 1.0\ncomment x\nelement vertex 8\nproperty {} x\nproperty {} y\nproperty {} z\n" + (
    "element face 6\nproperty uchar flags\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\n"
    "end_header\n"
)


@pytest.mark.parametrize("order, mark", [("ascii", ""), ("binary_little_endian", "<"), ("binary_big_endian", ">")])
def test_ply_is_read_in_all_three_forms(made, order, mark):
    points = list(itertools.product((0.0, 10.0), repeat=3))
    faces = [[int(word) - 1 for word in line.split()[1:]] for line in QUADS.splitlines()]
    if mark:
        body = b"".join(struct.pack(f"{mark}3d", *point) for point in points)
        body += b"".join(struct.pack(f"{mark}BB4i", 7, 4, *face) for face in faces) + struct.pack(f"{mark}i", 1)
    else:
        rows = [*points, *([7, 4, *face] for face in faces), [1]]
        body = "".join(" ".join(map(str, row)) + "\n" for row in rows).encode()
    _, found = made(("in.ply", HEAD.format(order, *["double"] * 3).encode() + body))
    assert volume(found) == pytest.approx(1000)


def test_ply_may_have_faces_of_different_numbers_of_corners(made):
    points = b"".join(struct.pack("<3d", *point) for point in itertools.product((0.0, 10.0), repeat=3))
    faces = [[int(word) - 1 for word in line.split()[1:]] for line in QUADS.splitlines()]
    mixed = [faces[0][:3], [faces[0][0], *faces[0][2:]], *faces[1:]]
    head = HEAD.format("binary_little_endian", *["double"] * 3).replace("face 6", "face 7").encode()
    body = b"".join(struct.pack(f"<BB{len(face)}i", 0, len(face), *face) for face in mixed) + bytes(4)
    _, found = made(("in.ply", head + points + body))
    assert volume(found) == pytest.approx(1000)


def threemf(resources, build, unit="millimeter", head="", **files):
    """A 3MF file of one model."""
    space = 'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"'
    space += ' xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
    text = f'{head}<model unit="{unit}" {space}><resources>{resources}</resources><build>{build}</build></model>'
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", text)
        for name, content in files.items():
            archive.writestr(name, content)
    return "in.3mf", held.getvalue()


def thing(number, mesh=None, parts="", kind="model"):
    """An object of a 3MF file."""
    if mesh is None:
        return f'<object id="{number}" type="{kind}"><components>{parts}</components></object>'
    points = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*point) for point in mesh.reshape(-1, 3))
    facets = "".join(f'<triangle v1="{3 * k}" v2="{3 * k + 1}" v3="{3 * k + 2}"/>' for k in range(len(mesh)))
    mesh = f"<mesh><vertices>{points}</vertices><triangles>{facets}</triangles></mesh>"
    return f'<object id="{number}" type="{kind}">{mesh}</object>'


def test_3mf_knows_its_unit(made):
    said, found = made(threemf(thing(1, box(1, 1, 1)), '<item objectid="1"/>', "inch"), unit="in")
    assert said.splitlines()[-1] == "out.stl: 12 facets, volume 1, 1 x 1 x 1 in; in the deck: unit = in"
    said, found = made(threemf(thing(1, box(1, 1, 1)), '<item objectid="1"/>', "inch"), "--unit", "mm", "--force")
    assert volume(found) == pytest.approx(25.4**3, rel=1e-6)
    assert said.splitlines()[0] == "in.3mf: converted from in to mm"


def test_3mf_places_moves_and_mirrors_objects(made):
    """A tetrahedron twice in an object, as it is and mirrored at x = 0, moved by 10 along z; a support; then a box."""
    twice = '<component objectid="1"/><component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
    objects = thing(1, 10 * TETRAHEDRON) + thing(2, parts=twice) + thing(3, box(90, 90, 90), kind="support")
    move = '<item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 10"/><item objectid="3"/>'
    said, found = made(threemf(objects, move))
    assert volume(found) == pytest.approx(2000 / 6, rel=1e-5)
    _, inside = made(threemf(objects + thing(4, box(50, 50, 50)), move + '<item objectid="4"/>'), "--force")
    assert volume(inside) == pytest.approx(125000)  # the mirrored one is no room in the box
    assert (found.min(axis=(0, 1)), found.max(axis=(0, 1))) == (
        pytest.approx((-10, 0, 10)),
        pytest.approx((10, 10, 20)),
    )
    assert said.splitlines()[0] == "in.3mf: 1 object that is not part of the model (a support or other) is left out"


def test_bytes_after_the_last_facet_are_left_out(made):
    said, _ = made(stl(box(10, 10, 10), more=b"\n"))
    assert said.splitlines()[0] == "in.stl: 1 byte after the last facet left out"


# ---- refusals

ITSELF = "in.stl: this solid crosses or touches itself: mend it in the program that made the mesh"


def test_all_faults_are_told_with_their_places_the_first_twenty(refusal):
    boxes = [box(10, 10, 10, at=(20 * k, 0, 0))[2:] for k in range(25)]
    lines = refusal(stl(*boxes), "--hole", "0")
    assert len(lines) == 21 and lines[-1] == "and 5 more faults"
    told = {
        float(re.match(r"in\.stl: a hole of 4 sides, 10 across, around \((.*?), 0, 0\): ", line)[1])
        for line in lines[:20]
    }
    assert len(told) == 20 and told <= {20 * k - 5.0 for k in range(25)}


@pytest.mark.parametrize("far", [1e3, 1e6])
def test_a_corner_far_from_all_others_does_not_widen_the_welds(refusal, far):
    mesh = ball(10)
    mesh[7, 0] = far
    (line,) = refusal(stl(mesh))
    assert re.match(r"in\.stl: a hole of 4 sides, ", line)


def test_a_surface_that_crosses_itself_is_refused(refusal):
    """A box with a side that is pushed in and out through the other one."""
    mesh = box(20, 20, 20)
    a, b, c = mesh[0]
    tip = np.array([40.0, 3.0, 2.0])
    crossing = np.array([(a, b, tip), (b, c, tip), (c, a, tip)])
    lines = refusal(stl(crossing, mesh[1:]))
    assert len(lines) > 1 and all("cross" in line and "mill mesh" not in line for line in lines)
    assert lines[-1] == ITSELF
    # ... also where it is one of several, before all are united in other ways
    assert refusal(stl(crossing, mesh[1:], box(30, 30, 30, at=(0, 20, 0)))) == lines


def test_a_sheet_that_sticks_out_is_told_as_such(refusal):
    mesh = ball(20)
    lines = refusal(stl(mesh, fin(mesh, 10)), "--hole", "20")
    assert len(lines) == 2 and all("give the sheet that" in line and "inner walls" not in line for line in lines)


def test_of_solids_that_cannot_be_united_the_fewest_faults_are_told(monkeypatch, tmp_path):
    (tmp_path / "in.stl").write_bytes(stl(box(30, 30, 30), box(20, 20, 20, at=(15, 0, 0))))
    faults = iter([name] * 20 + [f"{more} more faults"] for name, more in zip("abcdef", (99, 98, 67, 98, 99, 68)))
    monkeypatch.setattr(judge, "complaints", lambda corners, step: step() or (len(corners) > 12 and next(faults)))
    told, asked = [], types.SimpleNamespace(input=[str(tmp_path / "in.stl")], unit=None, hole=None, weld=None)
    with pytest.raises(UserError, match="accepts each of the solids.*unite them in the program that made") as refused:
        mend.mended(asked, told.append)
    assert [line.split(": ")[1] for line in refused.value.lines[:-1]] == ["c"] * 20 + ["and 67 more faults"]
    checks = [text.split("accepts ")[1] for text, _ in itertools.groupby(told) if "accepts" in text]
    solids = [f"solid {k} of 2, try 1 of 7" for k in (1, 2)]
    assert checks == ["it, try 1 of 6", *solids, *(f"it, try {k} of 6" for k in range(2, 7))]


def test_a_strip_with_one_side_is_refused(refusal):
    around = 2 * np.pi * np.arange(5) / 5
    corners = np.stack([np.cos(around), np.sin(around), around], axis=1)
    strip = corners[[(k, (k + 1) % 5, (k + 2) % 5) for k in range(5)]]
    assert any("as a Moebius strip" in line for line in refusal(stl(strip), "--hole", "99"))


BOMB = '<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "' + "a" * 50 + '"><!ENTITY b "' + "&a;" * 50 + '">]>'
OUTSIDE = '<?xml version="1.0"?><!DOCTYPE m SYSTEM "file:///etc/passwd">'
ITEM = '<item objectid="1"/>'
TWICE = "".join(thing(k, parts=f'<component objectid="{k - 1}"/>' * 2) for k in range(2, 31))
PLY = "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uint int vertex_indices\nend_header\n"


@pytest.mark.parametrize(
    "file, said",
    [
        (stl(box(1, 1, 1))[:-1], "is not a complete STL file: the 12 facets"),
        (bytes(80) + b"\xff\xff\xff\xff" + bytes(900), "is not a complete STL file: the 4294967295 facets"),
        (stl(np.where(box(1, 1, 1) > 0, np.nan, 0.0)), "not finite numbers"),
        (ascii_stl(box(1, 1, 1))[:-30], "in.stl:79: expected 'endsolid' or a whole facet, got 'facet"),
        (b"solid\nfacet normal 0 0 0 outer loop vertex " + b"1" * 1_000_000, "in.stl:2: expected"),
        (b"solid\n" + b" " * 1_000_000 + b"x", "in.stl:2: expected"),
        (b"solid\nendsolid\n", "has no facets"),
        (("in.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "has a corner that is not in the file"),
        (("in.obj", b"v 0 0 0\nf 1 1 -2\n"), "in.obj:2: expected the numbers of at least three points"),
        (("in.obj", b"v 0 0 nil\n"), "in.obj:1: expected three numbers, got 'v 0 0 nil'"),
        (("in.obj", b"v 0 0 0\x1b[31m\n"), "in.obj:1: expected three numbers, got 'v 0 0 0?[31m'"),
        (("in.obj", b"v 0 0 1e99\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "not finite numbers of single precision"),
        (("in.ply", (PLY + FACES).format(4 * 10**9, 1).encode() + bytes(99)), "ends before its last element"),
        (
            ("in.ply", (PLY + FACES).format(1, 99999).encode() + bytes(12) + b"\xff" * 40),
            "ends before its last element",
        ),
        (("in.ply", b"ply\nformat ascii 1.0\nelement vertex x\nend_header\n"), "'element vertex x' in its head"),
        (("in.ply", b"ply\nformat ascii 1.0\n"), "is not a complete PLY file"),
        (("in.3mf", b"PK\x03\x04"), "is not a complete 3MF file"),
        (threemf(thing(1, TETRAHEDRON), ITEM, head=BOMB), "has a document type, which 3MF forbids"),
        (threemf(thing(1, TETRAHEDRON), ITEM, head=OUTSIDE), "has a document type, which 3MF forbids"),
        (threemf("<a>" * 40 + "</a>" * 40, ITEM), "has elements more than 32 deep"),
        (threemf(thing(1, parts='<component objectid="1"/>'), ITEM), "more than 32 objects within each other"),
        (threemf(thing(1, parts='<component objectid="7" p:path="/../../x"/>'), ITEM), "There is no item named"),
        (threemf(thing(1, TETRAHEDRON), '<item objectid="2"/>'), "has no object 2, which is placed"),
        (threemf(thing(1, TETRAHEDRON), ITEM, unit="parsec"), "'parsec' is not a unit of 3MF"),
        (("in.step", b"ISO-10303-21;"), "expected a name ending in .stl, .obj, .ply, .3mf"),
    ],
    ids=itertools.count(),
)
def test_a_damaged_or_hostile_file_is_one_line(refusal, file, said):
    (line,) = refusal(file)
    assert said in line and len(line) < 300


@pytest.mark.parametrize(
    "limit, most, file, said",
    [
        (
            "MOST_PLACES",
            1000,
            threemf(thing(1, TETRAHEDRON) + TWICE, '<item objectid="30"/>'),
            "more than 1000 objects",
        ),
        ("MOST_BYTES", 10_000, threemf(" " * 20_000, ITEM), "is larger than 10 kB unpacked"),
        ("MOST_NAMES", 2, threemf("", ITEM, a="", b=""), "has more than 2 files in it"),
    ],
    ids=["objects", "bytes", "files"],
)
def test_an_archive_that_grows_without_end_is_refused(monkeypatch, tmp_path, limit, most, file, said):
    name, content = file
    (tmp_path / name).write_bytes(content)
    monkeypatch.setattr(threemf_limits, limit, most)
    with pytest.raises(UserError, match=said):
        read.read(str(tmp_path / name))


def test_no_file_is_overwritten_unasked_and_no_link_followed(mill, tmp_path):
    (tmp_path / "in.stl").write_bytes(stl(box(10, 10, 10)))
    (tmp_path / "kept").write_text("mine")
    (tmp_path / "out.stl").symlink_to("kept")
    done = mill("mesh", "in.stl", "-o", "out.stl")
    assert (done.returncode, done.stderr) == (2, "mill mesh: out.stl: exists already; --force overwrites it\n")
    assert mill("mesh", "in.stl", "-o", "out.stl", "--force").returncode == 0
    assert (tmp_path / "kept").read_text() == "mine" and not (tmp_path / "out.stl").is_symlink()


def test_an_input_is_not_overwritten(mill, tmp_path):
    (tmp_path / "in.stl").write_bytes(stl(box(10, 10, 10)))
    done = mill("mesh", "in.stl", "-o", "in.stl", "--force")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1) and "is the input file" in done.stderr
