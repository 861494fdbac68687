"""`mill dem` of bodies and motions: what is known of single balls without millsim, and what is refused."""

import shutil

import numpy as np
import pytest
from conftest import SMALL
from dem_bodies import BOX, HEAD, JAR, deck_of, follow, laboratory
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import milltools.dem.soft_mill
from milltools.base.errors import UserError
from milltools.base.processes import Stopped
from milltools.dem.command import refuse
from milltools.dem.liggghts import Liggghts
from milltools.dem.meshes import axes
from milltools.dem.paths import Chain
from milltools.dem.setup import Setup, setup_of
from milltools.geometry.bodies import inverse, moved
from milltools.read.deck import Deck

needs_liggghts = pytest.mark.skipif(not shutil.which("liggghts"), reason="no LIGGGHTS")
G = 9.81  # [m/s^2]
RUBS = {"contact__friction": "0.3", "contact__tangential_restitution": "0.467"}
PLANETARY = """\
[motion.sun]
kind = turn
centre = 0.01 0.02 0 m
axis = 0 0 2
speed = 68 rad/s
angle = 0.2 rad
[motion.jar]
kind = turn
on = sun
axis = 0 0 1
centre = 0.07 0 0 m
speed = -136 rad/s
"""
ARM = """\
[motion.arm]
kind = swing
on = sun
axis = 1 2 0
centre = 0 0 0.1 m
amplitude = 0.4 rad
frequency = 12 Hz
phase = 0.3 rad
"""
SHAKE = """\
[motion.shake]
kind = shift
amplitude = 0.002 0.001 0.004 m
frequency = 25 Hz
phase = 0.2 0.3 0.1 rad
"""


# ---- motions ----


def brought(name, place, t):
    """Where the motions of PLANETARY, ARM and SHAKE bring a place of the frame of one of them, one after the other."""

    def turned(about, axis, angle):
        return about + Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).apply(place - about)

    if name == "shake":
        place = place + np.array([0.002, 0.001, 0.004]) * np.sin(50 * np.pi * t + np.array([0.2, 0.3, 0.1]))
    if name in ("shake", "arm"):
        place = turned([0, 0, 0.1], [1, 2, 0], 0.4 * np.sin(24 * np.pi * t + 0.3))
    if name == "jar":
        place = turned([0.07, 0, 0], [0, 0, 1], -136 * t)
    return turned([0.01, 0.02, 0], [0, 0, 1], 0.2 + 68 * t)


@pytest.mark.parametrize("name", ["jar", "arm", "shake"])
def test_a_points_harmonics_are_where_the_chain_of_motions_brings_it(name):
    chain = Chain(deck_of(PLANETARY + ARM + SHAKE + "on = arm\n"), name)
    place, step = np.array([0.02, -0.01, 0.03]), 1e-5
    track = chain.point(place)
    for t in (0.0, 0.0123, 0.77):
        near = [brought(name, place, t + k * step) for k in (-1, 0, 1)]
        assert track(t) == pytest.approx(near[1], abs=1e-12)
        assert moved(chain.pose(t), place) == pytest.approx(near[1], abs=1e-12)
        assert track(t, 1) == pytest.approx((near[2] - near[0]) / (2 * step), abs=1e-4)
        bent = (near[2] - 2 * near[1] + near[0]) / step**2
        assert track(t, 2) == pytest.approx(bent, abs=1e-5 * np.linalg.norm(bent) + 1e-2)


def test_the_frame_goes_with_the_jar_without_turning_and_back_again():
    deck = deck_of(PLANETARY + JAR.replace("radius", "axis = 0 0 1\nradius"))
    scene, rng = setup_of(deck), np.random.default_rng(2)
    state = [rng.normal(size=(5, 3)) for _ in range(3)]
    inside = scene.frame.from_laboratory(0.03, *state)
    for was, now in zip(state, laboratory(scene.frame, 0.03, *inside), strict=True):
        assert now == pytest.approx(was, abs=1e-12)
    assert scene.spin.speed == pytest.approx(68 - 136) and scene.spin.axis == pytest.approx([1, 0, 0])
    # on the jar's axis R (W^2) towards the sun's centre is missing
    assert np.linalg.norm(scene.frame.gravity(0.03)) == pytest.approx(68**2 * np.hypot(0.06, 0.02))


# ---- single balls ----


@pytest.mark.slow
@needs_liggghts
def test_a_ball_rides_on_the_wall_of_a_jar_in_circular_translation():
    """It is pressed outwards by m W^2 (R + l), all the way round."""
    w, circle = 2 * np.pi * 20, 0.017
    path = (
        "[motion.jar]\nkind = shift\namplitude = 0.017 0.017 0 m\nfrequency = 20 Hz\n"
        "phase = 1.5707963267948966 0 0 rad\n"
    )
    deck = deck_of(JAR.replace("0.07 0 0", "0 0 0") + path)
    mill, seen = follow(deck, [0.032, 0, 0], [0, 0.032 * w, 0], 0.001)
    spring = mill.model.wall["ball_jar"][0]
    deep = spring.mass * w**2 * (circle + 0.015) / spring.stiffness
    at = circle + 0.015 + deep
    mill, seen = follow(deck, [at, 0, 0], [0, at * w, 0], 0.1)
    place, *_ = laboratory(mill.setup.frame, mill.time, *mill.state)
    assert place == pytest.approx(np.array([[at, 0, 0]]), abs=1e-6)
    assert mill.deepest == pytest.approx(deep, rel=1e-6)
    assert abs(seen.column("motion_work/jar")).max() < 1e-5 * seen.kinetic(mill.mass)[0]


@pytest.mark.slow
@needs_liggghts
def test_a_ball_on_a_shaken_plate_hits_it_once_a_period():
    w, e, strength = 2 * np.pi * 50, 0.8, 0.8  # A w^2 / g
    size = strength * G / w**2
    phase = np.arccos(np.pi * (1 - e) / ((1 + e) * strength))
    deck = deck_of(
        BOX + f"motion = m\n[motion.m]\nkind = shift\namplitude = 0 0 {size} m\nfrequency = 50 Hz\n",
        gravity__acceleration=f"0 0 {-G} m/s^2",
    )
    speed, when = np.pi * G / w, phase / w
    start = -0.025 + size * np.sin(phase) + speed * when - G * when**2 / 2
    _, seen = follow(deck, [0, 0, start], [0, 0, G * when - speed], 0.2)
    told = seen.all("normal_speed")
    assert told == pytest.approx(2 * np.pi * G / (w * (1 + e)), rel=0.02) and len(told) == 10
    assert np.diff(seen.all("time")) == pytest.approx(0.02, rel=0.02)


@pytest.mark.slow
@needs_liggghts
def test_a_ball_in_a_shaken_box_hits_either_end_once_a_period_and_takes_that_power():
    w, e, size, free = 2 * np.pi * 20, 0.8, 0.004, 0.04
    kappa = np.pi * (1 + e) / (1 - e)
    phase = np.arctan(2 / kappa) - np.arccos(free / size / np.hypot(kappa, 2))
    speed = size * w * np.cos(phase) * (1 + e) / (1 - e)
    deck = deck_of(
        f"[body.box]\nshape = box\nside = inside\nsize = {free + 0.01} 0.05 0.06 m\nmotion = m\n"
        f"[motion.m]\nkind = shift\namplitude = {size} 0 0 m\nfrequency = 20 Hz\n"
    )
    start = -free / 2 + size * np.sin(phase) - speed * phase / w
    mill, seen = follow(deck, [start, 0, 0], [speed, 0, 0], 0.25)
    impact = 2 * size * w * np.cos(phase) / (1 - e)
    assert seen.all("normal_speed").mean() == pytest.approx(impact, rel=0.01)
    assert len(seen.all("time")) == 10
    power = mill.mass[0] * 20 * (1 - e**2) * impact**2
    assert seen.column("motion_work/m")[-1] == pytest.approx(power * 0.25, rel=0.05)
    assert seen.column("dissipation/ball_box")[-1] == pytest.approx(power * 0.25, rel=0.05)


@needs_liggghts
@pytest.mark.parametrize("where", ["wall", "end"])
def test_the_surface_of_a_turning_jar_drags_a_ball_that_slides(where):
    """By mu (1 + e) v_n against its slip, and turns it as much; wall: a primitive, end: a facet."""
    middle, axis = np.array([0.01, 0.02, 0.03]), np.array([0.6, 0, 0.8])
    turn = "[motion.jar]\nkind = turn\ncentre = 0.01 0.02 0.03 m\naxis = 0.6 0 0.8\nspeed = 300 rad/s\n"
    jar = JAR.replace("0.07 0 0 m", "0.01 0.02 0.03 m\naxis = 0.6 0 0.8")
    deck = deck_of(jar + turn, **RUBS)
    out = setup_of(deck).frame.rows[1]
    way, at = (out, 0.02 * out) if where == "wall" else (axis, 0.02 * axis + 0.008 * out)
    mill, seen = follow(deck, middle + at - 0.006 * way, way, 0.004, modulus=1e10)
    _, velocity, spin = laboratory(mill.setup.frame, mill.time, *mill.state)
    drag = np.cross(300 * axis, at)
    assert seen.all("tangential_speed") == pytest.approx([np.linalg.norm(drag)], rel=1e-3)
    drag /= np.linalg.norm(drag)
    assert velocity[0] == pytest.approx(0.54 * drag - 0.8 * way, abs=0.04)
    assert spin[0] == pytest.approx(0.54 * 500 * np.cross(way, drag), abs=16)
    assert seen.all("normal_speed") == pytest.approx([1.0], rel=0.01)


MOVED = {
    "shift": (SHAKE.replace("shake", "m"), 0.0175),
    "swing": (
        "[motion.m]\nkind = swing\naxis = 0 1 0\ncentre = 0.05 0 0 m\n"
        "amplitude = 0.3 rad\nfrequency = 25 Hz\nphase = 0.1 rad\n",
        0.0215,
    ),
    "turn": ("[motion.m]\nkind = turn\naxis = 0 1 0\ncentre = 0.05 0 -0.03 m\nspeed = 30 rad/s\n", 0.021),
    "turn on what stands still": (
        "[motion.m]\nkind = turn\non = base\naxis = 0 1 0\ncentre = 0.05 0 -0.03 m\nspeed = 30 rad/s\n"
        "[motion.base]\nkind = turn\naxis = 1 2 3\nspeed = 0 rad/s\nangle = 0.5 rad\n",
        0.021,
    ),
}


@needs_liggghts
@pytest.mark.parametrize("name", MOVED)
@pytest.mark.slow
def test_a_ball_at_rest_is_hit_by_a_moving_bar_when_and_as_fast_as_the_bar_says(name):
    text, high = MOVED[name]
    bar = "[body.bar]\nshape = box\nsize = 0.02 0.02 0.02 m\ncentre = 0 0 -0.03 m\naxis = 0.1 0.2 1\nmotion = m\n"
    deck = deck_of(BOX.replace("0.04 0.05 0.06", "0.4 0.5 0.6") + "axis = 1 0 0\n" + bar + text)
    chain, (rows, middle) = Chain(deck, "m"), axes(deck, "bar")
    ball = moved(chain.pose(0.0), middle + [0.0015, 0.001, high])

    def gap(t):
        local = rows @ (moved(inverse(chain.pose(t)), ball) - middle)
        return np.linalg.norm(local - np.clip(local, -0.01, 0.01)) - 0.005

    times = np.linspace(0, 0.03, 3001)
    k = int(np.argmax(np.array([gap(t) for t in times]) < 0))
    when = brentq(gap, times[k - 1], times[k])
    speed = (gap(when - 1e-7) - gap(when + 1e-7)) / 2e-7
    mill, seen = follow(deck, ball, [0, 0, 0], when + 3e-4, modulus=1e10)
    assert seen.all("time") == pytest.approx([when], abs=1e-6)
    assert seen.all("normal_speed") == pytest.approx([speed], rel=0.01)
    assert seen.kinds == ["ball_bar"]
    assert np.linalg.norm(mill.state[1]) == pytest.approx(1.8 * speed, rel=0.02)


@pytest.mark.slow
@needs_liggghts
def test_work_of_each_motion_is_what_the_balls_have_taken():
    """Planetary, no friction: kinetic energy less what is lost, and E - W L, with W of the sun, stays but for what
    is lost."""
    deck = deck_of(PLANETARY + JAR, contact__restitution="1", balls__count="2")
    place = setup_of(deck).frame.track(0.0) + [[0.005, 0.006, 0.006], [-0.008, 0.003, -0.006]]
    mill, seen = follow(deck, place, [[0, 1, 0.5], [0.3, 0.5, -0.5]], 0.08)
    work = {name: seen.column(f"motion_work/{name}")[-1] for name in ("sun", "jar")}
    energy = seen.kinetic(mill.mass) + seen.column("elastic_energy")
    assert len(seen.all("time")) > 8 and abs(energy[-1] - energy[0]) > 0.01
    assert work["jar"] == pytest.approx(0, abs=1e-6)  # smooth walls do not feel its spin
    assert work["sun"] == pytest.approx(energy[-1] - energy[0], rel=0.01)


@needs_liggghts
def test_a_stop_while_samples_are_awaited_leaves_none_half_done(monkeypatch):
    """The results end at a time whose state they have."""
    samples, reached = Liggghts.samples, []

    def stop(process, count):
        for k, sample in enumerate(samples(process, count)):
            if k == 3:
                raise Stopped(15)
            yield sample

    monkeypatch.setattr(Liggghts, "samples", stop)
    monkeypatch.setattr(milltools.dem.soft_mill, "WATCHED", 1)
    with pytest.raises(Stopped):
        follow(deck_of(BOX, **RUBS), [0, 0, 0], [0, 0, 0], 0.01, watch=reached.append)
    assert len(reached) == 3 and reached[-1] > 0


# ---- contours ----

LIFTED = """\
[motion.roll]
kind = turn
axis = 1 0 0
speed = 5 rad/s
[drum]
radius = 0.05 m
length = 0.04 m
profile = lifters
lifters = 4
lifter_height = 0.008 m
lifter_width = 0.01 m
lifter_front = 20 deg
lifter_back = 20 deg
"""
STAR = "0.02 0 0\n0.005 0.005 0\n0 0.02 0\n-0.005 0.005 0\n-0.02 0 0\n0 -0.01 0\n"


def lifted(write_deck, *changes):
    return Deck.check(write_deck(HEAD + LIFTED), changes)


def test_plates_between_lifters_are_a_cylinder_and_their_sides_facets_that_turn_with_it(write_deck, the_program):
    mantle, sides, _ = Setup(lifted(write_deck, "drum.motion=roll", "contact.friction=0.3")).walls
    assert [words for _, words, *_ in mantle.primitives] == ["xcylinder 0.050000000000000003 0 0"]
    assert sides.motion.speed == 5 and len(sides.triangles) == 4 * 3 * 2
    corners = sides.triangles.reshape(-1, 3)
    assert np.abs(corners[:, 0]) == pytest.approx(0.02)
    away = np.unique(np.round(np.hypot(*corners.T[1:]), 9))
    assert away == pytest.approx([np.hypot(0.042, 0.005), 0.05], abs=1e-9)  # edges of the tops; feet


def test_a_contour_of_lines_is_a_prism_or_its_sides(write_deck, the_program, tmp_path):
    (tmp_path / "star.txt").write_text(STAR)
    body = "[body.{}]\nshape = contour\nfile = star.txt\nlength = 0.02 m\nside = {}\n"
    star = Setup(Deck.check(write_deck(HEAD + BOX + body.format("star", "outside")))).walls[-1].triangles
    volume = np.einsum("ij,ij->i", star[:, 0], np.cross(star[:, 1], star[:, 2])).sum() / 6
    assert len(star) == 2 * 4 + 2 * 6 and volume == pytest.approx(0.02 * 4e-4, rel=1e-12)
    walls = Setup(Deck.check(write_deck(HEAD + body.format("jar", "inside")), ["balls.diameter=1 mm"])).walls
    assert [len(wall.triangles) for wall in walls] == [2 * 6, 0] and len(walls[1].primitives) == 2  # sides; ends


def test_a_curved_part_of_a_contour_is_refused(write_deck, the_program, tmp_path):
    with pytest.raises(UserError, match="arcs that are not on one circle: .*; set 'lifter_rounding = 0 mm'"):
        Setup(lifted(write_deck, "drum.lifter_rounding=1 mm"))
    angle = 2 * np.pi * np.arange(48) / 48
    (tmp_path / "tube.txt").write_text("".join(f"{0.05 * np.cos(a):.17g} {0.05 * np.sin(a):.17g} 0\n" for a in angle))
    text = LIFTED[: LIFTED.index("profile")] + "profile = file\nfile = tube.txt\n"
    with pytest.raises(UserError, match="its lines make a curved wall, on which LIGGGHTS adds up"):
        Setup(Deck.check(write_deck(HEAD + text)))


@pytest.mark.slow
@needs_liggghts
def test_a_ball_rebounds_from_the_top_of_a_lifter_and_from_the_plate(the_program):
    deck = deck_of(LIFTED)
    for angle, away in ((0.0, 0.042), (np.pi / 4, 0.05)):
        way = np.array([0, np.cos(angle), np.sin(angle)])
        mill, seen = follow(deck, 0.02 * way, 2 * way, 0.02)
        assert seen.all("normal_speed") == pytest.approx([2], rel=1e-2)
        assert seen.all("time") == pytest.approx([(away - 0.005 - 0.02) / 2], abs=2e-4)
        assert seen.velocity[0] == pytest.approx(-0.8 * 2 * way, abs=0.02)


# ---- what is refused ----

TURN = "[motion.m]\nkind = turn\nspeed = 10 rad/s\n"
OFF = "axis = 1 0 0\n"
REFUSED = {
    "capsule": (
        JAR.replace("cylinder", "capsule").replace("motion = jar\n", ""),
        "[body.jar] shape: expected cylinder, box, contour or mesh, got capsule: LIGGGHTS has no such primitive",
    ),
    "a pin": (
        BOX + "[body.pin]\nshape = cylinder\nradius = 0.002 m\nlength = 0.01 m\n",
        "[body.pin] shape: expected box, contour or mesh, got cylinder: LIGGGHTS has no such",
    ),
    "rounded": (
        BOX + "[body.bar]\nshape = box\nsize = 0.01 0.01 0.01 m\nrounding = 0.001 m\n",
        "[body.bar] rounding: LIGGGHTS has no such primitive",
    ),
    "table": (
        BOX + "motion = m\n[motion.m]\nkind = table\nfile = t.txt\n",
        "[motion.m] kind: mill dem cannot run a table: ",
    ),
    "off its axis": (
        JAR.replace("motion = jar", "motion = m\naxis = 1 0 0") + TURN,
        "[body.jar] motion: it does not turn about its own axis: LIGGGHTS' round walls lie along x, y or z",
    ),
    "rocking": (
        JAR.replace("motion = jar", "motion = m") + "[motion.m]\nkind = swing\namplitude = 1 rad\nfrequency = 3 Hz\n",
        "[body.jar] motion: it swings about its own axis: ",
    ),
    "tumbling": (
        BOX + "motion = m\n" + TURN + "on = n\n" + TURN.replace(".m]", ".n]") + OFF,
        "[body.box] motion: motion m: its axis changes direction, and LIGGGHTS turns a wall about one axis",
    ),
    "two motions": (
        BOX
        + "[body.bar]\nshape = box\nsize = 0.01 0.01 0.01 m\nmotion = m\n"
        + TURN
        + "on = n\n"
        + TURN.replace(".m]", ".n]"),
        "[body.bar] motion: 2 motions carry this body: mill dem can move a mesh by only one",
    ),
    "beside": (
        BOX + "motion = m\n[body.bar]\nshape = box\nsize = 0.01 0.01 0.01 m\n" + TURN,
        "[body.bar] motion: the container moves, and this body does not move with it: ",
    ),
    "a body in a slice": (
        "[drum]\nradius = 0.05 m\nlength = 0.04 m\nends = periodic\n[body.bar]\nshape = box\nsize = 0.01 0.01 0.01 m\n",
        "[drum] ends: with periodic ends mill dem can run a drum with its profile and a shaft, but no blades",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_liggghts_cannot_do_right_is_refused_with_the_reason(name):
    text, reason = REFUSED[name]
    with pytest.raises(UserError) as refused:
        Setup(deck_of(text, **RUBS))
    assert str(refused.value).startswith(f"deck.ini: {reason}")


@pytest.mark.parametrize("falls", ["restitution_speed = 1 m/s", "restitution_table = e.txt"])
def test_a_restitution_that_falls_with_the_speed_is_refused(falls):
    deck = Deck(SMALL + f"[contact.ball_drum]\n{falls}\n", "deck.ini")
    with pytest.raises(UserError, match="restitution: it falls with the speed"):
        refuse(deck)


def test_a_jar_that_rocks_about_its_own_axis_is_run_without_friction():
    text, _ = REFUSED["rocking"]
    assert Setup(deck_of(text)).spin.swings


def test_a_tube_of_many_facets_is_curved_and_a_box_of_an_stl_is_not(tmp_path):
    angle = 2 * np.pi * np.arange(48) / 48
    for name, corners, is_curved in (("tube", angle, True), ("bar", angle[::12], False)):
        ring = np.column_stack([np.cos(corners), np.sin(corners)]) * 10
        lines, following = ["solid x"], np.roll(ring, -1, axis=0)
        for (a, b), (c, d) in zip(ring, following, strict=True):
            for three in (
                ((a, b, -5), (c, d, -5), (c, d, 5)),
                ((a, b, -5), (c, d, 5), (a, b, 5)),
                ((0, 0, 5), (a, b, 5), (c, d, 5)),
                ((0, 0, -5), (c, d, -5), (a, b, -5)),
            ):
                lines += [
                    "facet normal 0 0 0",
                    "outer loop",
                    *(f"vertex {x} {y} {z}" for x, y, z in three),
                    "endloop",
                    "endfacet",
                ]
        (tmp_path / f"{name}.stl").write_text("\n".join(lines))
        text = HEAD + BOX + f"[body.{name}]\nshape = mesh\nfile = {name}.stl\nunit = 0.001 m\n"
        deck = deck_of(text.removeprefix(HEAD))
        deck.path = tmp_path / "deck.ini"
        if is_curved:
            with pytest.raises(UserError, match="its facets make a curved wall"):
                Setup(deck)
        else:
            assert len(Setup(deck).walls[-1].triangles) == 16
