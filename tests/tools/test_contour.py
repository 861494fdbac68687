"""Contours: the geometry of lines and arcs, how they wear, and what `mill contour` reads of drawings that are made here
by ezdxf."""

import json
import math

import ezdxf
import numpy as np
import pytest
from matplotlib.path import Path

from milltools.base.errors import UserError
from milltools.contour.drawing import read
from milltools.geometry.contour import READ, Contour
from milltools.geometry.worn import along, fitted, simplified, worn

ROUND = math.tan(math.pi / 8)  # the bulge of a quarter of a circle
CIRCLE = [(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0)]
SQUARE = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
# a square with two corners rounded outwards and two cut out by arcs
MIXED = [(0.01, 1.0, -ROUND), (-0.09, 0.9, 0), (-0.09, 0.1, -ROUND), (0.01, 0, 0), (1, 0, ROUND), (1.1, 0.1, 0),
         (1.1, 0.9, ROUND), (1, 1, 0)]  # fmt: skip
MIXED_AREA = 1.19 - 4 * 0.01 + 2 * math.pi * 0.01 / 4 + 2 * (0.01 - math.pi * 0.01 / 4)


def lifters(n=12, radius=1.0, height=0.1, width=0.1, tip=0.0, front=0.0, back=0.0):
    """n bars on a circle, with flat tops, faces at angles [deg] to the radius, and edges rounded by `tip`."""
    rows, top, half = [], radius - height, width / 2
    low, high = -half - height * math.tan(math.radians(back)), half + height * math.tan(math.radians(front))
    ends = [np.array([math.sqrt(radius**2 - y**2), y]) for y in (low, high)]
    gap = math.tan((2 * math.pi / n - math.asin(high / radius) + math.asin(low / radius)) / 4)
    edges = np.array([ends[0], (top, -half), (top, half), ends[1]])
    ways = np.diff(edges, axis=0) / np.hypot(*np.diff(edges, axis=0).T)[:, None]
    corners = [(*ends[0], 0)]
    for edge, u, v in zip(edges[1:3], ways, ways[1:]):
        turn = math.acos(u @ v)
        cut = tip * math.tan(turn / 2)
        corners += [(*(edge - cut * u), -math.tan(turn / 4)), (*(edge + cut * v), 0)] if tip else [(*edge, 0)]
    corners.append((*ends[1], gap))
    for k in range(n):
        c, s = math.cos(2 * math.pi * k / n), math.sin(2 * math.pi * k / n)
        rows += [(c * x - s * y, s * x + c * y, b) for x, y, b in corners]
    return Contour(rows)


SHAPES = {"circle": Contour(CIRCLE), "mixed": Contour(MIXED), "lifters": lifters(), "rounded": lifters(tip=0.02)}
RAKED = lifters(radius=0.3, height=0.035, width=0.03, tip=0.005, front=25, back=15)
shapes = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def shares(shape, each=(0.05, 0.3, 0.5, 0.9)):
    return np.repeat(np.arange(len(shape.vertices)), len(each)), np.tile(each, len(shape.vertices))


def shoelace(polygon):
    x, y = polygon.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


# ---- geometry


def test_areas_of_circles_squares_and_arcs_are_exact():
    assert Contour(CIRCLE).area == pytest.approx(math.pi, rel=1e-15)
    assert Contour(CIRCLE).length == pytest.approx(2 * math.pi, rel=1e-15)
    assert Contour(MIXED).area == pytest.approx(MIXED_AREA, rel=1e-14)
    assert Contour(CIRCLE).box == pytest.approx(np.array([[-1, -1], [1, 1]]), abs=1e-15)


@pytest.mark.parametrize("bulge", [1e-9, 1e-3, 0.0299, 0.0301, 0.4, 1.0, 3.0, -0.5])
def test_area_length_and_box_are_those_of_a_fine_polygon(bulge):
    shape = Contour([(0.0, 0.0, bulge), (1.0, 0.2, 0.1), (0.4, 2.0, -0.3)])
    polygon = shape.flattened(1e-8)
    assert shoelace(polygon) == pytest.approx(shape.area, rel=1e-7)
    assert np.hypot(*(np.roll(polygon, -1, axis=0) - polygon).T).sum() == pytest.approx(shape.length, rel=1e-7)
    assert np.stack([polygon.min(axis=0), polygon.max(axis=0)]) == pytest.approx(shape.box, abs=2e-8)


def test_a_clockwise_curve_is_turned_around_and_stays_the_same_curve():
    rows = np.array(MIXED)
    back = np.column_stack([rows[::-1, :2], -np.roll(rows[::-1, 2], -1)])
    one, other = Contour(rows), Contour(back)
    assert one.area == pytest.approx(other.area, rel=1e-15) and one.area > 0
    assert np.abs(one.gap(other.points(*shares(other)))).max() < 1e-15


@shapes
def test_inside_is_what_is_inside_a_fine_polygon(shape):
    points = np.random.default_rng(1).uniform(*(1.1 * shape.box), (3000, 2))
    inside = Path(shape.flattened(1e-7)).contains_points(points)
    assert np.array_equal(shape.winding(points), inside.astype(int))
    assert np.array_equal(shape.gap(points) > 0, inside)


@shapes
def test_a_developed_length_leads_to_its_place(shape):
    s = np.linspace(0, shape.length, 50, endpoint=False)
    piece, share = shape.at(s)
    before = np.cumsum(shape.lengths) - shape.lengths
    assert before[piece] + share * shape.lengths[piece] == pytest.approx(s)
    assert shape.at(s + shape.length)[0] == pytest.approx(piece)
    assert np.abs(shape.gap(shape.points(piece, share))).max() < 1e-14


@pytest.mark.slow
def test_wear_of_random_curves_is_exact_and_never_crosses_itself():
    rng, tried = np.random.default_rng(5), 0
    while tried < 15:
        n = rng.integers(3, 30)
        angle, away = np.sort(rng.uniform(0, 2 * np.pi, n)), rng.uniform(0.3, 1, n)
        bulge = rng.uniform(-0.9, 0.9, n) * rng.integers(0, 2, n)
        shape = Contour(np.column_stack([away * np.cos(angle), away * np.sin(angle), bulge]))
        if len(shape.crossings()) or shape.area < 0.05:
            continue
        tried += 1
        s, depth = np.sort(rng.uniform(0, shape.length, 40)), rng.uniform(0, 0.05, 40)
        after = worn(shape, s, depth, 0.1)
        assert after.area - shape.area == pytest.approx(along(shape, s, depth)[0], rel=1e-9)
        assert not len(after.crossings())


@pytest.mark.parametrize(
    "rows, place",
    [
        ([(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 1, 0)], (2 / 3, 2 / 3)),  # two lines cross
        ([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 0, 0), (0, 1, 0)], (1, 0)),  # a corner touches a line
        ([(0, 0, 0), (4, 0, 0), (4, 2, 0), (3, 0, 0), (1, 0, 0), (0, 2, 0)], (2, 0)),  # a line follows a line
        ([(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (1, 1, 0), (0, 1, 0)], (1, 1.5)),  # forth and back
        ([(0, 0, 0), (2, 0, 0), (2, 1, 1), (0, 1, 0), (1, 2.5, 0), (0.5, 2.5, 0)], None),  # a line crosses an arc
        ([(0, 0, 0), (4, 0, 0), (4, 1, 0), (3, 1, 2), (2, 1, 0), (1.9, 1, 2), (0, 1, 0)], None),  # two arcs
    ],
)
def test_a_curve_that_meets_itself_is_found_with_the_place(rows, place):
    found = Contour(rows).crossings()
    assert len(found)
    assert place is None or np.hypot(*(found - place).T).min() < 1e-9


@shapes
def test_a_sound_curve_meets_itself_nowhere(shape):
    assert not len(shape.crossings())


@shapes
def test_the_largest_ball_at_a_place_touches_the_curve_there_and_crosses_it_nowhere(shape):
    where = shares(shape)
    ball, _, _ = shape.touching(*where)
    centre = shape.points(*where) + ball[:, None] * shape.normals(*where)
    assert shape.gap(centre) == pytest.approx(ball, abs=1e-12)


def test_a_fillet_a_slot_and_the_ground_between_walls_are_narrow_and_corners_are_not():
    fillet = Contour([(0.01, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0.01, ROUND)])
    assert fillet.narrow(0.02)[0] == pytest.approx(np.array([[0.01, 0.01, 0.01]]))
    assert len(fillet.narrow(0.009)[0]) == 0
    slot = [(1, 0.4, 0), (1.1, 0.4, 0), (1.1, 0.42, 0), (1, 0.42, 0)]
    square = Contour([(0, 0, 0), (1, 0, 0), *slot, (1, 1, 0), (0, 1, 0)])
    assert square.narrow(0.05)[0][0, 1:] == pytest.approx([0.41, 0.01])
    assert len(square.narrow(0.009)[0]) == 0
    valley = Contour(
        [(0, 0, 0), (1, 0, 0), (1, 0.4, 0), (1.1, 0.42, 0), (1.1, 0.44, 0), (1, 0.46, 0), (1, 1, 0), (0, 1, 0)]
    )
    assert valley.narrow(0.03)[0][0, 2] == pytest.approx(0.01 * math.tan(math.atan2(0.1, -0.02) / 2), rel=1e-6)
    chamfer = Contour([(0.01, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0.01, 0)])
    assert len(Contour(SQUARE).narrow(0.2)[0]) == len(chamfer.narrow(0.2)[0]) == len(lifters().narrow(0.2)[0]) == 0


@pytest.mark.parametrize("bulge", [1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6, 1e-3])
def test_a_nearly_straight_arc_is_as_far_as_its_chord(bulge):
    square = np.array([(-1, -2, bulge), (3, -1, -bulge), (2, 3, bulge), (-2, 2, 0)])
    arcs, lines = Contour(square), Contour(square * [1, 1, 0])
    points = np.random.default_rng(2).uniform(-4, 5, (500, 2))
    slack = 3 * bulge + 1e-14  # the arc leaves its chord by half of bulge times chord
    assert arcs.gap(points) == pytest.approx(lines.gap(points), abs=slack)
    sizes = [(one.innermost, one.outermost, *one.box.ravel()) for one in (arcs, lines)]
    assert sizes[0] == pytest.approx(sizes[1], abs=slack)
    balls = [one.touching(*shares(one))[0] for one in (arcs, lines)]
    assert balls[0] == pytest.approx(balls[1], rel=30 * bulge + 1e-12)


def star(n=4, inner=0.018, outer=0.03):
    angle, away = np.pi * np.arange(2 * n) / n, np.tile([inner, outer], n)
    return Contour(np.column_stack([away * np.cos(angle), away * np.sin(angle), 0 * angle]))


@pytest.mark.parametrize(
    "shape, largest",
    [
        (star(), 0.018),  # it touches corners only
        (Contour([(0, 0, 0), (0.03, 0, 0), (0.015, 0.03, 0)]), 0.03 / (1 + math.sqrt(5))),
        (Contour([(0.1, 0, 0), (0, 1e-7, 0), (-0.1, 0, 0), (0, -1e-7, 0)]), 1e-7),
        (Contour(CIRCLE), 1.0),
    ],
    ids=["star", "triangle", "flat", "circle"],
)
def test_a_ball_fits_up_to_the_largest_inner_circle_and_a_larger_one_nowhere(shape, largest):
    assert [len(part) if part is not None else 0 for part in shape.narrow(0.9999 * largest)] == [0, 0]
    places, widest = shape.narrow(1.0001 * largest)
    assert len(places) == 1 and widest[2] == pytest.approx(largest, rel=1e-7)
    assert shape.gap([widest[:2]]) == pytest.approx(largest, rel=1e-7)


@pytest.mark.slow
def test_the_largest_ball_of_random_curves_is_the_farthest_point_from_them():
    rng, tried = np.random.default_rng(3), 0
    while tried < 20:
        n = rng.integers(3, 20)
        angle, away = np.sort(rng.uniform(0, 2 * np.pi, n)), rng.uniform(0.3, 1, n)
        bulge = rng.uniform(-0.9, 0.9, n) * rng.integers(0, 2, n) * rng.choice([1, 1e-9])
        shape = Contour(np.column_stack([away * np.cos(angle), away * np.sin(angle), bulge]))
        if len(shape.crossings()) or shape.area < 0.05:
            continue
        tried += 1
        places, widest = shape.narrow(5.0)
        points = rng.uniform(*shape.box, (4000, 2))
        assert shape.gap(points).max() <= widest[2] == pytest.approx(shape.gap([widest[:2]])[0], abs=1e-9)
        places, none = shape.narrow(0.9 * widest[2])
        assert none is None
        assert shape.gap(places[:, :2]) == pytest.approx(places[:, 2], abs=1e-9) if len(places) else True


def test_a_fine_polygon_becomes_few_arcs_of_the_same_area_within_the_tolerance():
    shape = Contour(MIXED)
    polygon = shape.flattened(1e-7)
    fine = Contour(np.column_stack([polygon, np.zeros(len(polygon))]))
    few = simplified(fine, 1e-5)
    assert len(few.vertices) < 20 < len(fine.vertices) / 20
    assert few.area == pytest.approx(fine.area, rel=1e-12)
    assert np.abs(shape.gap(few.points(*shares(few)))).max() < 1.1e-5
    assert np.array_equal(fitted(np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0.0)]), 1e-3)[:, :2], [(0, 0), (1, 0), (1, 1)])


# ---- wear

DEPTHS = {
    "even": lambda s, length: np.full_like(s, 0.004),
    "a wave on each lifter": lambda s, length: 0.006 * (1 + np.sin(24 * math.pi * s / length)),
    "one place only": lambda s, length: 0.01 * (np.abs(s - 0.3) < 0.05),
}


@pytest.mark.parametrize("depth", DEPTHS.values(), ids=DEPTHS)
@pytest.mark.parametrize("smooth", [0.0, 0.03])
@pytest.mark.parametrize("name", ["circle", "lifters", "rounded"])
def test_wear_removes_exactly_the_depths_times_the_lengths_without_loops(name, depth, smooth):
    shape = SHAPES[name]
    s = np.arange(0, shape.length - 0.008, 0.008)
    after = worn(shape, s, depth(s, shape.length), smooth)
    removed = along(shape, s, depth(s, shape.length))[0]
    assert after.area - shape.area == pytest.approx(removed, rel=1e-9)
    assert not len(after.crossings())
    assert shape.gap(after.points(*shares(after))).max() < 1e-4  # nothing grows
    assert len(after.vertices) < 600
    assert after.width.min() > 5e-8 * after.size  # millsim takes no points that are much nearer to each other


@pytest.mark.parametrize("smooth", [0.0, 0.03])
def test_a_corner_that_no_ball_reaches_stays_sharp_when_it_wears(smooth):
    for shape in (lifters(), Contour(SQUARE)):
        after = worn(shape, [0.0], [0.001], smooth)
        hollow = after.vertices[:, 2] > 0
        assert after.radius[hollow].min(initial=1.0) > 0.5
        assert after.area - shape.area == pytest.approx(0.001 * shape.length, rel=1e-9)
        assert len(after.narrow(0.05)[0]) == 0


def test_a_head_that_comes_loose_is_gone_besides_the_worn_area():
    web, head, deep = 0.02, 0.08, 0.023
    base = math.sqrt(1 - web**2)
    tee = [(base, -web, 0), (0.85, -web, 0), (0.85, -head, 0), (0.75, -head, 0), (0.75, head, 0), (0.85, head, 0),
           (0.85, web, 0), (base, web, math.tan((math.tau - 2 * math.asin(web)) / 4))]  # fmt: skip
    shape = Contour(tee)
    after = worn(shape, [0.0], [deep])
    assert np.hypot(*after.points(*shares(after)).T).min() > 0.97  # the head is gone
    assert after.outermost == pytest.approx(1 + deep, abs=0.1 * deep)  # the plate wore as deep as it should
    loose = after.area - shape.area - deep * shape.length
    assert 0.3 < loose / ((2 * head - 2 * deep) * (0.1 - 2 * deep)) < 1.5


@pytest.mark.parametrize("phase", range(6))
@pytest.mark.parametrize("name", ["circle", "rounded", "raked"])
def test_uneven_wear_makes_no_corners_but_tips_of_lifters(name, phase):
    shape, depth, many = {"circle": (SHAPES["circle"], 0.005, 0), "rounded": (SHAPES["rounded"], 0.005, 24),
                          "raked": (RAKED, 0.0012, 24)}[name]  # fmt: skip
    for _ in range(6):
        s = np.linspace(0, shape.length, 1200, endpoint=False)
        shape = worn(shape, s, depth * (1 + 0.8 * np.cos(12 * math.tau * s / shape.length + phase)), shape.length / 150)
        turn = np.degrees(shape.turns)
        assert (turn > 20).sum() == many  # at the foot of each face
        assert turn.min() > -100 and turn.max() < 100  # what is left of a rounded edge, too


def test_wear_of_a_circle_by_an_even_depth_is_the_larger_circle():
    after = worn(Contour(CIRCLE), [0.0], [0.01])
    away = np.hypot(*after.points(*shares(after)).T)
    assert away == pytest.approx(math.sqrt(1 + 0.02), abs=2e-5)


@pytest.mark.parametrize("face, deep", [(-12, 0.0235), (-12, 0.034), (-15, 0.031)])
def test_where_heads_of_lifters_come_loose_a_worn_contour_is_found(face, deep):
    shape = lifters(front=face, back=face)
    assert worn(shape, [0.0], [deep]).outermost - shape.outermost == pytest.approx(deep, rel=0.15)


def test_neighbours_of_a_consumed_tip_do_not_grow_beyond_it():
    shape = lifters(n=20, height=0.2, width=0.012)
    s = np.linspace(0, shape.length, 600, endpoint=False) + shape.length / 1300
    after = worn(shape, s, (np.arange(600) % 37 == 3) * 0.014)
    assert shape.gap(after.start).max() < 0.1 * 0.014


def test_equal_parts_wear_alike():
    way = np.exp(1j * (math.tau * np.arange(6) / 6 + 0.1))
    shape, k = Contour(np.column_stack([way.real, way.imag, 0 * way.real])), np.arange(600)
    after = worn(
        shape, (k + 0.5) / 600 * shape.length, 0.01 * (1 + 0.7 * np.sin(math.tau * k / 100)), shape.length / 60
    )
    spots = after.vertices[:, :2] @ [1, 1j]
    assert abs(spots[:, None] - spots * np.exp(1j * math.tau / 6)).min(axis=0).max() < 1e-13


def test_a_worn_contour_has_no_more_vertices_than_millsim_reads(monkeypatch):
    shape = Contour(lifters(n=420, width=0.003, height=0.004, tip=0.0005).vertices * [0.25, 0.25, 1])
    k = np.arange(3360)
    wear = k / 3360 * shape.length, 2e-5 * (1 + 0.8 * np.sin(math.tau * k / 8)), shape.length / 4000
    few = worn(shape, *wear)
    monkeypatch.setattr("milltools.geometry.worn.READ", 10**6)
    assert len(few.vertices) <= READ < len(worn(shape, *wear).vertices)


@pytest.mark.parametrize("depth", [1e-3, 1e300])
def test_depths_that_leave_nothing_are_refused(depth):
    shape, deep = lifters(n=8, height=0.15, width=0.04, front=5, back=5), np.zeros(600)
    deep[10:12] = 40 * depth
    with pytest.raises(ValueError, match="depths"):
        worn(shape, (np.arange(600) + 0.5) / 600 * shape.length, deep)


def test_wear_that_lifters_do_not_outlive_leaves_a_rounder_drum():
    after = worn(lifters(), [0.0], [0.08])
    assert np.hypot(*after.points(*shares(after)).T).min() > 0.97
    assert after.area - lifters().area == pytest.approx(0.08 * lifters().length, rel=1e-9)


def test_smoothing_moves_depth_along_the_contour_and_loses_none():
    shape, s = Contour(CIRCLE), np.array([1.0, 1.1, 1.2, 1.3])
    area, mean = along(shape, s, [0.0, 1.0, 1.0, 0.0])
    x = np.linspace(0, shape.length, 5000, endpoint=False)
    assert area == pytest.approx(0.2)
    assert mean(x, 0.5).mean() * shape.length == pytest.approx(area, rel=1e-6)
    assert mean(np.array([1.15]), 0.0) == 1.0 and mean(np.array([1.15]), 0.5) == pytest.approx(0.4)


@pytest.mark.parametrize(
    "s, depth", [([0.0, 1.0], [0.1]), ([1.0, 0.5], [0.1, 0.1]), ([0.0], [-0.1]), ([0.0, 7.0], [0.1, 0.1])]
)
def test_depths_that_belong_to_no_place_are_refused(s, depth):
    with pytest.raises(ValueError):
        worn(Contour(CIRCLE), s, depth)


# ---- files


def test_a_contour_file_keeps_every_bit(tmp_path):
    (tmp_path / "a.txt").write_text(SHAPES["rounded"].text(["a comment"]))
    assert np.array_equal(Contour.read(tmp_path / "a.txt").vertices, SHAPES["rounded"].vertices)


@pytest.mark.parametrize(
    "text, said",
    [
        ("0 0 0\n1 0\n", ":2: expected 'x y bulge' (metres), got '1 0'"),
        ("0 0 0\n\n1 zero 0 # x\n", ":3: expected 'x y bulge' (metres), got '1 zero 0'"),
        ("0 0 nan\n", ":1: expected 'x y bulge' (metres), got '0 0 nan'"),
        ("0,1 0 0\n", ":1: expected 'x y bulge' (metres), got '0,1 0 0'; write decimal points, and commas between all "
         "numbers or none"),
        ("# nothing\n", ": expected two or more rows x, y, bulge"),
        ("0 0 0\n1 0 1e300\n", ": expected coordinates below 1e+12, and bulges below 1000"),
        ("0 0 0\n1 0 0\n1 0 0\n0 1 0\n", ": vertex 2 and the next one are the same point"),
    ],
)  # fmt: skip
def test_a_wrong_contour_file_is_told_with_its_line(tmp_path, text, said):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(UserError) as fault:
        Contour.read(tmp_path / "a.txt")
    assert str(fault.value) == f"{tmp_path}/a.txt{said}"


DRUM = """[run]
time = 1 s
[drum]
radius = 150 mm
length = 90 mm
motion = turn
profile = file
file = a.txt
[motion.turn]
kind = turn
axis = 1 0 0
speed = 70 % critical
[balls]
count = 1
diameter = 20 mm
density = 7800 kg/m^3
[contact]
restitution = 0.7
friction = 0.3
tangential_restitution = 0.4
"""
ROWS = {  # whether it is one
    True: ["-0.15,0,1", "-.15 , 0e0 ,\t1.", "\ufeff-0.15 0 1", " ,-0.15 0 1,,\r", "-0.15,0,1,"],
    False: ["-0.15,0 1", "-0.15,,0,1", ",,-0.15 0 1", "-0.1_5 0 1", "-0.15\u00a00 1", "-0.15\x1c0 1", "-0.15 0 0x1",
            "-0.15 0 1e", "-0.15 0 1e400", "-0.15 0 1" + 4096 * " "],
}  # fmt: skip


@pytest.mark.parametrize("good, row", [(good, row) for good, rows in ROWS.items() for row in rows])
def test_mill_takes_the_same_rows_of_a_contour_as_millsim(millsim, write_deck, tmp_path, good, row):
    (tmp_path / "a.txt").write_bytes(f"{row}\n0.15 0 1\n".encode())
    assert millsim("--check", "-q", write_deck(DRUM)).returncode == 2 * (not good)
    if good:
        assert Contour.read(tmp_path / "a.txt").area == pytest.approx(math.pi * 0.15**2)
    else:
        with pytest.raises(UserError, match="a.txt:1: expected 'x y bulge'"):
            Contour.read(tmp_path / "a.txt")


@pytest.mark.parametrize("rows, why", [
    ("0.15 0 -1\n-0.15 0 -1\n", "it is clockwise"),
    ("0.45 0 1\n0.15 0 1\n", "the axis, 0 0, is not inside of it"),
])  # fmt: skip
def test_a_contour_file_that_millsim_refuses_is_drawn_with_a_warning(mill, millsim, write_deck, tmp_path, rows, why):
    (tmp_path / "a.txt").write_text(rows)
    assert millsim("--check", "-q", write_deck(DRUM)).returncode == 2
    done = mill("contour", "a.txt", "--draw", "a.svg")
    assert done.returncode == 0 and done.stderr.count("\n") == 1 and (tmp_path / "a.svg").exists()
    assert done.stderr.startswith("mill contour: warning: a.txt: millsim refuses it") and why in done.stderr


# ---- drawings


@pytest.fixture
def drawing(tmp_path):
    """drawing(unit=4, version="R2010") is (document, its modelspace, function that saves it as a.dxf)."""

    def make(unit=4, version="R2010"):
        document = ezdxf.new(version)
        document.header["$INSUNITS"] = unit
        document.header["$MEASUREMENT"] = 1
        return document, document.modelspace(), lambda: document.saveas(tmp_path / "a.dxf")

    return make


@pytest.fixture
def found(mill, tmp_path):
    """found(*options): (contour that was written of a.dxf, facts)."""

    def of(*options):
        done = mill("contour", "a.dxf", "-o", "a.txt", "--force", "--json", *options)
        assert done.returncode == 0, done.stderr
        return Contour.read(tmp_path / "a.txt"), json.loads(done.stdout)

    return of


@pytest.fixture
def refused(mill, tmp_path):
    """refused(*options): the line with which a.dxf is refused, after checking that nothing was written."""

    def of(*options, status=2):
        done = mill("contour", "a.dxf", "-o", "a.txt", *options)
        assert (done.returncode, done.stdout) == (status, "") and not (tmp_path / "a.txt").exists()
        assert done.stderr.count("\n") == 1
        return done.stderr.removeprefix("mill contour: ").rstrip("\n")

    return of


def scaled(rows, by=1000.0, move=(0.0, 0.0)):
    return [(x * by + move[0], y * by + move[1], b) for x, y, b in rows]


def same_curve(one, other, tolerance=1e-12):
    assert one.area == pytest.approx(other.area, rel=max(1e-12, 10 * tolerance))
    assert np.abs(one.gap(other.points(*shares(other)))).max() < tolerance


def test_a_closed_polyline_is_read_bit_by_bit_with_its_bulges(drawing, found):
    _, space, save = drawing()
    space.add_lwpolyline(scaled(CIRCLE), format="xyb", close=True)
    save()
    shape, facts = found()
    assert np.array_equal(shape.vertices, CIRCLE)
    assert (facts["unit"], facts["unit_from"], facts["width"], facts["area"]) == ("mm", "$INSUNITS", 2.0, math.pi)


def test_lines_and_arcs_in_any_order_with_gaps_become_one_curve(drawing, found):
    _, space, save = drawing()
    pieces = [*zip(scaled(MIXED), scaled(MIXED)[1:] + scaled(MIXED)[:1])]
    rng = np.random.default_rng(3)
    for k in rng.permutation(len(pieces)):
        (x, y, bulge), (u, v, _) = pieces[k]
        x, y, u, v = np.array([x, y, u, v]) + rng.uniform(-1, 1, 4) * 1e-3
        if bulge:
            space.add_lwpolyline([(x, y, bulge), (u, v, 0)], format="xyb")
        else:
            space.add_line(*((x, y), (u, v))[:: 1 if k % 2 else -1])
    save()
    shape, facts = found("--centre", "0", "500")
    same_curve(shape, Contour(MIXED).moved((0, -0.5)), 3e-6)
    assert (facts["lines"], facts["arcs"]) == (4, 4)
    assert shape.area == pytest.approx(MIXED_AREA, rel=1e-5)
    assert 1e-7 < facts["gap"] < 3e-6


def test_gaps_are_told_of_the_curve_that_is_taken(drawing, mill):
    _, space, save = drawing()
    space.add_circle((0, 0), 1000)
    space.add_lwpolyline([(0, 0), (100, 0), (100, 100), (0.001, 0.002)])
    save()
    said = [mill("contour", "a.dxf", "--loop", loop, "--centre", "50", "25").stdout for loop in "12"]
    assert ["gaps       closed up to" in one for one in said] == [False, True]


def test_an_arc_passes_through_its_middle(drawing, found):
    _, space, save = drawing()
    space.add_arc((0, 0), 1000, 90, 270)  # the left half
    space.add_line((0, -1000), (0, 1000))
    save()
    shape, _ = found("--centre", "-500", "0")
    assert shape.area == pytest.approx(math.pi / 2) and shape.box[0, 0] == pytest.approx(-0.5)


@pytest.mark.parametrize("kind", ["polyline", "pieces", "circle"])
def test_a_mirrored_block_is_mirrored_with_all_its_arcs(drawing, found, kind):
    document, space, save = drawing()
    block = document.blocks.new("PLATE")
    if kind == "circle":
        block.add_circle((1000, 0), 300)
        expected = Contour([(-0.7, 0, 1.0), (-1.3, 0, 1.0)])
    else:
        expected = Contour([(-x, y, -b) for x, y, b in MIXED])
        line = block.add_lwpolyline(scaled(MIXED), format="xyb", close=True)
        if kind == "pieces":
            line.explode()
    space.add_blockref("PLATE", (0, 0), dxfattribs={"xscale": -1})
    save()
    centre = (-1000.0, 0.0) if kind == "circle" else (-500.0, 500.0)
    shape, _ = found("--centre", *map(str, centre))
    same_curve(shape, expected.moved([-x / 1000 for x in centre]))


def test_old_polylines_of_r12_are_read_and_have_no_unit(drawing, refused, mill):
    document, space, save = drawing(version="R12")
    space.add_polyline2d(scaled(MIXED), format="xyb", close=True)
    del document.header["$MEASUREMENT"]
    save()
    assert refused() == "a.dxf: does not tell its unit: give it, such as --unit mm"
    facts = json.loads(mill("contour", "a.dxf", "--unit", "cm", "--json").stdout)
    assert facts["area"] == pytest.approx(100 * MIXED_AREA) and facts["arcs"] == 4


def test_a_drawing_without_a_header_has_no_unit(tmp_path, refused):
    circle = "0 SECTION 2 ENTITIES 0 CIRCLE 8 0 10 0 20 0 40 1 0 ENDSEC 0 EOF"
    (tmp_path / "a.dxf").write_text(circle.replace(" ", "\n") + "\n")
    assert refused() == "a.dxf: does not tell its unit: give it, such as --unit mm"


@pytest.mark.parametrize(
    "insunits, measurement, size, why",
    [(1, 1, 0.0254, "$INSUNITS"), (6, 0, 1.0, "$INSUNITS"), (0, 1, 1e-3, "$MEASUREMENT 1: metric"),
     (0, 0, 0.0254, "$MEASUREMENT 0: imperial")],
)  # fmt: skip
def test_the_unit_is_that_of_insunits_then_of_measurement(drawing, mill, insunits, measurement, size, why):
    document, space, save = drawing(insunits)
    document.header["$MEASUREMENT"] = measurement
    space.add_circle((0, 0), 0.5)
    save()
    facts = json.loads(mill("contour", "a.dxf", "--json").stdout)
    assert (facts["width"], facts["unit_from"]) == (pytest.approx(size), why)


@pytest.mark.parametrize("kind", ["spline", "ellipse", "squeezed block"])
def test_curves_become_arcs_within_the_tolerance(drawing, found, kind):
    document, space, save = drawing()
    if kind == "ellipse":
        space.add_ellipse((0, 0), (1000, 0), 0.8)
    elif kind == "spline":
        circle = [(1000 * math.cos(a), 800 * math.sin(a)) for a in np.linspace(0, 2 * math.pi, 200)]
        space.add_spline(fit_points=circle)
    else:
        document.blocks.new("C").add_circle((0, 0), 1000)
        space.add_blockref("C", (0, 0), dxfattribs={"yscale": 0.8})
    save()
    shape, facts = found("--tolerance", "0.1")
    x, y = shape.points(*shares(shape)).T
    assert np.abs(np.hypot(x, y / 0.8) - 1).max() < 1.5e-4
    assert shape.area == pytest.approx(0.8 * math.pi, rel=1e-4)
    assert facts["arcs"] + facts["lines"] < 60


def test_the_largest_curve_is_taken_and_the_others_are_named(drawing, mill):
    document, space, save = drawing()
    space.add_circle((0, 0), 1100, dxfattribs={"layer": "SHELL"})
    space.add_circle((0, 0), 1000, dxfattribs={"layer": "LINER"})
    save()
    said = mill("contour", "a.dxf").stdout
    assert "size       2.2 m x 2.2 m" in said
    assert "not taken  2 m x 2 m, layer LINER: --loop 2 takes it" in said
    for options in (("--loop", "2"), ("--layer", "liner")):
        assert "size       2 m x 2 m" in mill("contour", "a.dxf", *options).stdout


def test_what_does_not_belong_to_the_curve_is_ignored_and_told(drawing, found):
    document, space, save = drawing()
    document.layers.add("OLD").freeze()
    space.add_circle((0, 0), 1000)
    space.add_circle((0, 0), 5000, dxfattribs={"layer": "OLD"})
    space.add_line((0, 0), (3000, 0))
    space.add_text("liner")
    document.layouts.get("Layout1").add_circle((0, 0), 7000)
    save()
    shape, facts = found()
    assert shape.area == pytest.approx(math.pi)
    assert facts["ignored"] == {"in paper space": 1, "on layer OLD (frozen)": 1, "TEXT": 1, "with an open end": 1}


def test_lines_that_begin_at_a_corner_and_doubled_ones_do_not_open_the_curve(drawing, found):
    """Plates with joints: the inside of the drum is one face of what the lines divide the plane into."""
    _, space, save = drawing()
    for k in range(6):
        a, b = 60 * k, 60 * k + 60
        for radius in (1000, 1100):
            space.add_arc((0, 0), radius, a, b)
        ends = [(r * math.cos(math.radians(a)), r * math.sin(math.radians(a))) for r in (1000, 1100)]
        space.add_line(*ends)
        space.add_line(*ends)
    save()
    shape, facts = found()
    assert (shape.area, facts["arcs"], facts["loops"]) == (pytest.approx(math.pi), 6, 7)


def test_the_axis_is_the_origin_where_that_is_inside_and_else_the_middle(drawing, mill):
    for centre, why in (
        ((100, 0), "the origin, which is inside the curve; the centre of"),
        ((5000, 0), "the centre of"),
    ):
        _, space, save = drawing()
        space.add_circle(centre, 1000)
        save()
        axis = (0, 0) if centre[0] < 1000 else centre
        assert f"axis       {axis} mm: {why}" in mill("contour", "a.dxf").stdout


def test_the_axis_is_where_plates_have_their_centre_also_with_an_odd_number_of_lifters(drawing, found):
    _, space, save = drawing()
    place = lambda r, a: (1500 + r * math.cos(math.radians(a)), 1150 + r * math.sin(math.radians(a)))  # noqa: E731
    for k in range(11):
        a, b, c = 360 / 11 * k, 360 / 11 * k + 5, 360 / 11 * (k + 1)
        for ends in ((place(600, a), place(550, a)), (place(550, a), place(550, b)), (place(550, b), place(600, b))):
            space.add_line(*ends)
        space.add_arc((1500, 1150), 600, b, c)
    save()
    _, facts = found()
    assert facts["centre"] == pytest.approx([1500, 1150], abs=1e-6)


def test_a_frame_around_a_finer_curve_and_a_liner_in_pieces_are_told(drawing, mill):
    _, space, save = drawing()
    space.add_lwpolyline([(0, 0), (2970, 0), (2970, 2100), (0, 2100)], close=True, dxfattribs={"layer": "FRAME"})
    hexagon = [(1500 + 500 * math.cos(k), 1000 + 500 * math.sin(k)) for k in np.arange(6) * math.pi / 3]
    space.add_lwpolyline(hexagon, close=True, dxfattribs={"layer": "LINER"})
    save()
    said = "warning: 1 closed curve with more corners inside of the one that is taken"
    assert said in mill("contour", "a.dxf").stderr
    assert [mill("contour", "a.dxf", *one).stderr for one in (("--layer", "LINER"), ("--loop", "1"))] == ["", ""]
    _, space, save = drawing()
    for k in range(3):
        space.add_lwpolyline([(5 * k, 0), (5 * k + 4, 0), (5 * k + 4, 1)], close=True)
    save()
    assert "warning: 3 closed curves have the same area" in mill("contour", "a.dxf").stderr


def test_a_drum_in_two_halves_is_told(drawing, mill):
    _, space, save = drawing()
    space.add_arc((0, 0), 1000, 0, 180)
    space.add_arc((0, 0), 1000, 180, 360)
    space.add_line((-1000, 0), (1000, 0))
    save()
    assert "warning: 2 closed curves have the same area" in mill("contour", "a.dxf").stderr


def test_inner_and_outer_face_of_a_thin_shell_are_no_pieces(drawing, mill):
    _, space, save = drawing()
    for radius in (1000, 1002, 1004):
        space.add_circle((0, 0), radius)
    save()
    assert mill("contour", "a.dxf").stderr == ""


@pytest.mark.parametrize(
    "draw, options, said",
    [
        (lambda s: s.add_lwpolyline([(0, 0), (2, 2), (2, 0), (0, 1)], close=True), (),
         "a.dxf: the curve crosses or touches itself at (0.666667, 0.666667) mm"),
        (lambda s: s.add_lwpolyline([(0, 0), (100, 0), (100, 100), (0.1, 0.2)]), (),
         "a.dxf: no closed curve; pieces with an open end: 3; a gap is 0.224 mm wide, at (0.1, 0.2) mm: close "
         "it, or give --tolerance 0.23"),
        (lambda s: s.add_text("x"), (), "a.dxf: has no lines, arcs, circles, polylines, splines or ellipses; ignored: "
         "1 TEXT"),
        (lambda s: s.add_circle((0, 0), 1), ("--layer", "LINER"), "a.dxf: nothing to read on layer LINER: it has 0"),
        (lambda s: s.add_circle((0, 0), 1), ("--loop", "2"), "--loop 2: the drawing has 1 closed curve"),
        (lambda s: s.add_circle((0, 0), 1), ("--loop", "0"), "--loop 0: expected 1, which is the largest closed curve, "
         "or more"),
        (lambda s: s.add_circle((0, 0), 1), ("--centre", "3", "0"), "--centre 3 0: is not inside the curve"),
        (lambda s: s.add_circle((0, 0), 1), ("--ball", "40"), "--ball 40: expected a diameter with its unit, such as "
         "'40 mm'"),
        *((lambda s: s.add_circle((0, 0), 1), ("--tolerance", text), f"--tolerance {text}: expected a length, 0 or "
           "more, such as '0.1 mm'") for text in ("-1", "1 furlong", "wide", "nan", "1e999 mm")),
        (lambda s: s.add_lwpolyline([(0, 0), (100, 0), (100, 100), (0.1, 0.2)]), ("--tolerance", "0.2 mm"),
         "a.dxf: no closed curve; pieces with an open end: 3; a gap is 0.224 mm wide, at (0.1, 0.2) mm: close "
         "it, or give --tolerance 0.23"),
        (lambda s: s.add_circle((0, 0), 1), ("--draw", "a.bmp"), "a.bmp: expected a name that ends in .svg, .png, "
         ".pdf"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_one_line_with_the_place_or_the_mend(drawing, refused, draw, options, said):
    _, space, save = drawing()
    draw(space)
    save()
    assert refused(*options) == said


def test_a_gap_is_closed_by_the_tolerance_that_the_refusal_names(drawing, refused, found):
    _, space, save = drawing()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 100), (0.1, 0.2)])
    save()
    tolerance = refused().rpartition(" ")[2]
    assert found("--tolerance", tolerance)[1]["lines"] == 3


@pytest.mark.parametrize("tolerance", ["0.25", "0.25 in", "6.35mm", "1e-2 m"])
def test_a_tolerance_has_its_own_unit_or_that_of_the_drawing(drawing, found, tolerance):
    _, space, save = drawing(unit=1)
    space.add_lwpolyline([(0, 0), (100, 0), (100, 100), (0.1, 0.2)])
    save()
    assert found("--tolerance", tolerance)[1]["lines"] == 3


def test_blocks_that_contain_themselves_are_refused(drawing, refused):
    document, space, save = drawing()
    document.blocks.new("A").add_blockref("A", (0, 0))
    space.add_blockref("A", (0, 0))
    save()
    assert refused() == "a.dxf: block A contains itself, or blocks are nested too deep"


def test_blocks_that_unfold_without_limit_are_refused(drawing, tmp_path, monkeypatch):
    monkeypatch.setattr("milltools.contour.drawing.MOST", 1000)
    document, space, save = drawing()
    for name in "FEDCB":
        block = document.blocks.new(name)
        for k in range(10):
            block.add_blockref(chr(ord(name) + 1), (k, 0)) if name != "F" else block.add_circle((0, 0), 1)
    space.add_blockref("B", (0, 0))
    save()
    with pytest.raises(UserError, match="more than 1000 entities: choose layers with --layer"):
        read(tmp_path / "a.dxf")


@pytest.mark.parametrize("content, said", [
    (b"AC1032\0\0", "a.dxf: is a DWG file: save the drawing as DXF"),
    (b"0\nSECTION\n", "a.dxf: is no DXF file that can be read"),
    (b"\x89PNG\r\n\x1a\n", "a.dxf: is no DXF file that can be read"),
])  # fmt: skip
def test_other_files_are_refused(tmp_path, refused, content, said):
    (tmp_path / "a.dxf").write_bytes(content)
    assert refused().startswith(said)


def test_a_contour_of_more_vertices_than_millsim_reads_is_not_written(drawing, refused):
    _, space, save = drawing()
    space.add_lwpolyline(scaled(lifters(n=1001, width=1e-3).vertices), format="xyb", close=True)
    save()
    assert refused() == (
        "a.dxf: the contour has 4004 vertices, and millsim reads at most 4000: give a larger --tolerance"
    )


def test_a_contour_of_more_vertices_than_millsim_reads_is_not_searched_for_places(mill, tmp_path):
    angle = 2 * np.pi * np.arange(20_000) / 20_000
    (tmp_path / "a.txt").write_text("".join(f"{math.cos(a)} {math.sin(a)} 0\n" for a in angle))
    done = mill("contour", "a.txt", "--ball", "40 mm")
    line = "mill contour: a.txt: the contour has 20000 vertices, and millsim reads at most 4000\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", line)


def test_a_ball_that_fits_nowhere_is_told_with_the_largest_that_fits(mill, tmp_path):
    (tmp_path / "a.txt").write_text(star().text())
    said, facts = (mill("contour", "a.txt", "--ball", "40 mm", *more).stdout for more in ((), ("--json",)))
    assert "a ball of 40 mm fits nowhere; the widest place is (" in said and ": 36 mm fits there" in said
    assert json.loads(facts)["narrowest"]["diameter"] == pytest.approx(0.036)


def test_an_existing_file_is_kept_unless_forced(drawing, mill, tmp_path):
    _, space, save = drawing()
    space.add_circle((0, 0), 1000)
    save()
    (tmp_path / "a.txt").write_text("mine")
    done = mill("contour", "a.dxf", "-o", "a.txt")
    assert (done.returncode, done.stderr) == (2, "mill contour: a.txt: exists already; --force overwrites it\n")
    assert (tmp_path / "a.txt").read_text() == "mine"


def test_a_ball_that_does_not_fit_is_told_with_the_place_in_the_drawing(drawing, mill):
    _, space, save = drawing()
    space.add_lwpolyline([(10, 0), (1000, 0), (1000, 1000), (0, 1000), (0, 10, 0, 0, ROUND)], close=True)
    save()
    said = mill("contour", "a.dxf", "--ball", "40 mm").stdout
    assert "ball       a ball of 40 mm does not fit at 1 place; the narrowest is (10, 10) mm: 20 mm fits there" in said
    assert "a ball of 19 mm reaches all arcs and slots" in mill("contour", "a.dxf", "--ball", "19mm").stdout


def test_the_picture_of_a_contour_file_shows_scale_axis_and_the_narrowest_place(mill, tmp_path):
    (tmp_path / "a.txt").write_text(
        Contour([(0.01, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0.01, ROUND)]).moved((-0.5, -0.5)).text()
    )
    done = mill("contour", "a.txt", "--draw", "a.svg")
    assert done.returncode == 0, done.stderr
    svg = (tmp_path / "a.svg").read_text()
    for text in ("100 mm", "axis", "lines", "arcs", "smallest radius, 10 mm", "a ball of 20 mm fits"):
        assert text in svg


@pytest.mark.parametrize("option, value", [("--unit", "mm"), ("--loop", "0"), ("--tolerance", "0")])
def test_an_option_for_drawings_is_refused_with_a_contour_file(mill, tmp_path, option, value):
    (tmp_path / "a.txt").write_text(star().text())
    done = mill("contour", "a.txt", option, value)
    said = f"mill contour: {option} is for a drawing (.dxf): a.txt is read as a contour file\n"
    assert (done.returncode, done.stderr) == (2, said)
