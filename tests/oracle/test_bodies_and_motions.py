"""The oracle's motions against differences, its distances against what knows of a body only which points are in it."""

import numpy as np
import pytest
from conftest import some
from mill_decks import random_mill
from mill_parts import prism_mesh, random_motion, stl
from motions import Motion, Swing, Turn
from oracle import length
from read_mill import SPEEDS, copies_of, measured, motions_of, own_axes, triangles_of
from shapes import Box, BoxInside, Capsule, CapsuleInside, Drum, Frustum, FrustumInside, Mesh

WAYS = ("turn", "planetary", "swing", "shift", "table", "swing on swing", "turn on shift")


def random_chain(way, seed):
    sections, files, _ = random_motion(np.random.default_rng(seed), way, "m", 20.0, 20.0, 8.0)
    return motions_of(sections, files)["m"]


# Motions


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("seed", range(3))
def test_velocities_of_a_motion_are_its_derivatives(way, seed):
    motion = random_chain(way, seed)
    t, h = np.linspace(0, 0.4, 300), 1e-6
    pose, before, after = motion.pose(t), motion.pose(t - h), motion.pose(t + h)
    assert pose.velocity == pytest.approx((after.place - before.place) / (2 * h), abs=1e-6)
    turning = (after.rotation - before.rotation) / (2 * h)
    cross = turning @ np.swapaxes(pose.rotation, 1, 2)  # the matrix of omega x
    spin = np.stack([cross[:, 2, 1], cross[:, 0, 2], cross[:, 1, 0]], axis=-1)
    assert pose.spin == pytest.approx(spin, abs=3e-4)


@pytest.mark.parametrize("way", WAYS)
def test_rotations_stay_rotations(way):
    rotation = random_chain(way, 5).pose(np.linspace(0, 30, 1000)).rotation
    assert rotation @ np.swapaxes(rotation, 1, 2) == pytest.approx(
        np.broadcast_to(np.eye(3), rotation.shape), abs=1e-14
    )
    assert np.linalg.det(rotation) == pytest.approx(np.ones(1000))


def test_a_turn_goes_by_the_right_hand_about_its_centre():
    turn = Turn(np.array([1.0, 0, 0]), np.array([0, 0, 3.0]), np.pi / 2, 0.0)
    pose = Motion(turn).pose(np.array([1.0]))
    assert pose.rotation[0] @ [2.0, 0, 0] + pose.place[0] == pytest.approx([1, 1, 0])


def test_a_planetary_jar_turns_by_the_sum_of_its_speeds_about_a_centre_that_goes_round():
    sun = Motion(Turn(np.zeros(3), np.array([0, 0, 1.0]), 7.0))
    jar = Motion(Turn(np.array([0.07, 0, 0]), np.array([0, 0, 1.0]), -14.0), sun)
    t = np.linspace(0, 1, 50)
    pose = jar.pose(t)
    centre = (pose.rotation @ [0.07, 0, 0]) + pose.place
    assert centre == pytest.approx(0.07 * np.stack([np.cos(7 * t), np.sin(7 * t), 0 * t], -1))
    assert pose.spin == pytest.approx(np.broadcast_to([0, 0, -7.0], (50, 3)))


def test_a_swing_reaches_its_amplitude_to_both_sides():
    swing = Swing(np.zeros(3), np.array([0, 0, 1.0]), 0.2, 5.0, np.pi / 2)
    rotation = Motion(swing).pose(np.array([0.0, 0.1])).rotation
    assert rotation[:, 1, 0] == pytest.approx([np.sin(0.2), -np.sin(0.2)])


def test_a_table_goes_through_its_rows_whatever_its_first_time():
    rows = "0 0 0 0 0 0 0\n.02 1e-3 0 0 0 .3 0\n.05 0 2e-3 0 .1 0 4\n.1 0 0 0 0 0 0 # again\n"
    later = "\n".join(" ".join([str(float(row.split()[0]) + 0.7), *row.split()[1:]]) for row in rows.splitlines())
    keys = {"motion.m": {"kind": "table", "file": "a"}}
    for text in (rows, later):
        motion = motions_of(keys, {"a": text.encode()})["m"]
        pose = motion.pose(np.array([0.02, 0.05, 0.1, 0.32]))
        assert pose.place[:, 0] == pytest.approx([1e-3, 0, 0, 1e-3], abs=1e-12)
        # half a turn and more about z, and a bit about x: the direction of the rotation vector stays
        assert pose.rotation[1] @ [0.1, 0, 4] == pytest.approx([0.1, 0, 4])
        assert np.trace(pose.rotation[1]) == pytest.approx(1 + 2 * np.cos(np.hypot(0.1, 4)))


def test_a_bare_turn_a_minute_is_a_turn():
    assert measured("30 1/min", SPEEDS) == measured("30 rpm", SPEEDS) == pytest.approx(np.pi)


# Distances


def pulled(member, p, points):
    """The points, moved towards p as far as the set goes."""
    near, far = np.zeros((len(points), 1)), np.ones((len(points), 1))  # share of the way from p
    for _ in range(45):
        middle = (near + far) / 2
        holds = member(p + middle * (points - p))[:, None]
        near, far = np.where(holds, near, middle), np.where(holds, middle, far)
    return p + far * (points - p)


def nearest_member(member, p, rng):
    """Distance from p to the set of points that `member` knows: members are pulled up, then thrown closer about the
    best. Never too small."""
    trial = p + rng.uniform(-4, 4, (20000, 3))
    for scale in 0.3 * 0.7 ** np.arange(30):
        trial = pulled(member, p, trial[member(trial)])
        best = trial[length(trial - p).argmin()]
        trial = np.vstack([best, best + scale * rng.normal(size=(150, 3))])
    return length(best - p)


def is_nearest(distance, found):
    return distance - 1e-9 < found < distance + 5e-4


def in_box(half):
    return lambda p: (abs(p) <= half).all(axis=-1)


def in_frustum(radius, end, half):
    def member(p):
        side = radius + (end - radius) * (p[..., 2] + half) / (2 * half)
        return (abs(p[..., 2]) <= half) & (np.hypot(p[..., 0], p[..., 1]) <= side)

    return member


def in_capsule(radius, half):
    def member(p):
        z = np.maximum(abs(p[..., 2]) - half, 0)
        return p[..., 0] ** 2 + p[..., 1] ** 2 + z**2 <= radius**2

    return member


HALF = np.array([0.7, 1.0, 0.4])
SOLIDS = {
    "box": (Box(HALF), in_box(HALF)),
    "cylinder": (Frustum(0.8, 0.8, 0.5), in_frustum(0.8, 0.8, 0.5)),
    "cone": (Frustum(0.9, 0.3, 0.6), in_frustum(0.9, 0.3, 0.6)),
    "wide end": (Frustum(0.2, 1.0, 0.4), in_frustum(0.2, 1.0, 0.4)),
    "tip": (Frustum(0.9, 0.0, 0.6), in_frustum(0.9, 0.0, 0.6)),
    "capsule": (Capsule(0.5, 0.6), in_capsule(0.5, 0.6)),
    "sphere": (Capsule(0.8), in_capsule(0.8, 0.0)),
    "mesh": (Mesh(prism_mesh(np.random.default_rng(3), 0.5, 5)), None),
}


def member_of(name):
    shape, member = SOLIDS[name]
    if member:
        return member
    # convex: within the planes of all triangles
    planes = np.cross(shape.corners[:, 1] - shape.corners[:, 0], shape.corners[:, 2] - shape.corners[:, 0])
    levels = (planes * shape.corners[:, 0]).sum(axis=-1)
    return lambda p: (p @ planes.T <= levels).all(axis=-1)


@pytest.mark.parametrize("name", some(SOLIDS, 3))
def test_distance_to_a_solid_is_that_to_its_nearest_point(name):
    rng = np.random.default_rng(8)
    shape, member = SOLIDS[name][0], member_of(name)
    for p in rng.uniform(-2, 2, (12, 3)):
        if member(p[None])[0]:
            continue
        distance, normal, point = (a[:, 0] for a in shape.nearest(p[None]))
        k = distance.argmin()
        assert is_nearest(distance[k], nearest_member(member, p, rng))
        assert point[k] + distance[k] * normal[k] == pytest.approx(p)
        assert length(normal[k]) == pytest.approx(1)


@pytest.mark.slow
@pytest.mark.parametrize("name", some(["box", "cylinder", "cone", "wide end"], 3))
@pytest.mark.parametrize("rounding", some([0.05, 0.25], 2))
def test_a_rounded_solid_is_all_balls_of_that_radius_that_fit_in_it(name, rounding):
    rng = np.random.default_rng(9)
    sharp, member = SOLIDS[name]
    if name == "wide end" and rounding > 0.2:
        rounding = 0.15
    if isinstance(sharp, Box):
        shape, inside = Box(HALF, rounding), BoxInside(HALF)
    else:
        sizes = (sharp.radius, sharp.end_radius, sharp.half)
        shape, inside = Frustum(*sizes, rounding), FrustumInside(*sizes)

    def core(p):
        return member(p) & (inside.nearest(p)[0] >= rounding).all(axis=0)

    for p in rng.uniform(-2, 2, (6, 3)):
        distance, normal, point = (a[0, 0] for a in shape.nearest(p[None]))
        if distance > 0:
            assert is_nearest(distance, nearest_member(core, p, rng) - rounding)
            assert point + distance * normal == pytest.approx(p)


CONTAINERS = {
    "box": (BoxInside(HALF), in_box(HALF)),
    "cylinder": (FrustumInside(0.8, 0.8, 0.5), in_frustum(0.8, 0.8, 0.5)),
    "cone": (FrustumInside(0.9, 0.3, 0.6), in_frustum(0.9, 0.3, 0.6)),
    "capsule": (CapsuleInside(0.5, 0.6), in_capsule(0.5, 0.6)),
    "sphere": (CapsuleInside(0.8), in_capsule(0.8, 0.0)),
    "drum": (Drum(0.8, 0.5), lambda p: in_frustum(0.8, 0.8, 0.5)(p[..., ::-1])),
}


@pytest.mark.parametrize("name", some(CONTAINERS, 2))
def test_distance_within_a_container_is_that_to_its_nearest_wall(name):
    rng = np.random.default_rng(10)
    shape, member = CONTAINERS[name]
    for p in rng.uniform(-1, 1, (12, 3)):
        if member(p[None])[0]:
            distance, normal, point = (a[:, 0] for a in shape.nearest(p[None]))
            free = nearest_member(lambda q: ~member(q), p, rng)
            assert is_nearest(distance.min(), free)
            assert point + distance[:, None] * normal == pytest.approx(np.tile(p, (shape.count, 1)))


def test_a_mesh_of_a_box_is_the_box_within_and_without():
    triangles = prism_mesh(np.random.default_rng(0), 10.0, 4)
    half = triangles.max(axis=(0, 1))
    p = np.random.default_rng(1).uniform(-25, 25, (400, 3))
    out = (abs(p) > half).any(axis=1)
    mesh, box, walls = Mesh(triangles), Box(half), BoxInside(half)
    assert (mesh.covers(p) == ~out).all()
    assert (Mesh(triangles, inside=True).covers(p) == out).all()
    assert mesh.nearest(p[out])[0].min(axis=0) == pytest.approx(box.nearest(p[out])[0][0])
    assert mesh.nearest(p[~out])[0].min(axis=0) == pytest.approx(walls.nearest(p[~out])[0].min(axis=0))


# Reading


def test_a_binary_and_a_plain_stl_file_hold_the_same_triangles():
    triangles = prism_mesh(np.random.default_rng(2), 7.0, 6)
    for binary in (False, True):
        assert (triangles_of(stl(triangles, binary)) == triangles).all()


def test_facets_of_a_mesh_face_out_of_it():
    for sides in (3, 4, 6):
        a, b, c = np.moveaxis(prism_mesh(np.random.default_rng(2), 7.0, sides), 1, 0)
        assert (np.cross(b - a, c - a) * a).sum() > 0
        assert ((np.cross(b - a, c - a) * a).sum(axis=-1) > 0).all()


@pytest.mark.parametrize(
    "axis, x", [("0 0 2", [1, 0, 0]), ("1 0 0", [0, 1, 0]), ("-3 0 0", [0, 1, 0]),
                ("0 1 0", [1, 0, 0]), ("1 0 1", [0.5**0.5, 0, -(0.5**0.5)])]
)  # fmt: skip
def test_own_x_is_as_near_to_the_frames_x_as_may_be(axis, x):
    assert own_axes({"axis": axis})[:, 0] == pytest.approx(np.array(x))
    turned = own_axes({"axis": axis, "angle": "90 deg"})
    assert turned[:, 0] == pytest.approx(own_axes({"axis": axis})[:, 1])


def test_each_copy_is_the_one_before_turned_and_then_shifted():
    keys = {"shape": "cylinder", "radius": "1 mm", "length": "4 mm", "centre": "10 0 0 mm",
            "axis": "1 0 0", "copies": "3", "turn_by": "90 deg", "shift_by": "0 0 5 mm"}  # fmt: skip
    pins = copies_of("pin", keys, {})
    places = [[0.01, 0, 0], [0, 0.01, 0.005], [-0.01, 0, 0.01]]
    assert np.array([pin.place for pin in pins]) == pytest.approx(np.array(places), abs=1e-15)
    assert [pin.labels[0] for pin in pins] == [("ball_pin", k) for k in range(3)]
    assert pins[1].rotation[:, 2] == pytest.approx([0, 1, 0])


@pytest.mark.slow
def test_random_mills_are_the_same_each_time():
    assert random_mill(33).deck(0.1) == random_mill(33).deck(0.1)
