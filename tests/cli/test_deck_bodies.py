"""Motions and bodies in decks: what they take, and that every mistake is named with file, line, section and key."""

import math
import re

import pytest
from conftest import ROOT, SMALL
from test_deck import drop_key, fixed_point, set_key

SMALL_JAR = """\
[run]
time = 20 ms
[balls]
count = 5
diameter = 5 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
[body.jar]
shape = cylinder
side = inside
motion = a
radius = 20 mm
length = 35.8 mm
"""
# Keys in the order of the lines, so tests can name a line.
PLANET = """\
[run]
time = 20 ms
[balls]
count = 5
diameter = 5 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
[motion.sun]
kind = turn
speed = 650 rpm
[motion.jar]
kind = turn
on = sun
centre = 70 0 0 mm
axis = 0 0 1
speed = -1300 rpm
angle = 10 deg
[motion.rock]
kind = swing
centre = 0 0 0 mm
amplitude = 5 deg
frequency = 10 Hz
phase = 0 deg
[motion.shake]
kind = shift
amplitude = 1 0 0 mm
frequency = 600 1/min
phase = 90 0 0 deg
[body.jar]
shape = cylinder
side = inside
motion = jar
centre = 70 0 0 mm
axis = 0 0 1
angle = 0 deg
radius = 20 mm
length = 35.8 mm
[body.bar]
shape = box
motion = jar
centre = 70 0 0 mm
size = 3 4 5 mm
rounding = 1 mm
copies = 2
turn_by = 90 deg
turn_about = 0 0 1
shift_by = 0 0 1 mm
kind = ball_bars
[body.tip]
shape = cone
motion = jar
centre = 78 0 0 mm
radius = 3 mm
end_radius = 1 mm
length = 4 mm
"""

WRONG_VALUES = [
    ("motion.sun", "kind", "spin", "expected 'turn', 'swing', 'shift' or 'table', got 'spin'"),
    ("motion.sun", "speed", "10 Hz", "got '10 Hz' (Hz: turns or radians? write rpm or rad/s)"),
    ("motion.sun", "speed", "10 1/s", "(1/s: turns or radians? write rpm or rad/s)"),
    ("motion.sun", "speed", "10 m/s", "expected an angular speed such as '1000 rpm', got '10 m/s'"),
    ("motion.sun", "speed", "10", "expected an angular speed with its unit such as '1000 rpm'"),
    ("motion.sun", "axis", "0 0 0", "expected three numbers, not all of them 0, such as '0 0 1'"),
    ("motion.sun", "axis", "0 0 1 m", "expected three numbers, not all of them 0"),
    ("motion.sun", "centre", "5 mm", "expected three lengths in one unit such as '60 20 10 mm'"),
    ("motion.sun", "centre", "0 0 -11 km", "must be at most 10000 m, got '0 0 -11 km'"),
    ("motion.sun", "on", "moon", "there is no section [motion.moon]"),
    ("motion.sun", "on", "", "expected a name, got nothing"),
    ("motion.sun", "on", "rokc", "there is no section [motion.rokc]; did you mean 'rock'?"),
    ("motion.sun", "on", "rotor", "there is no section [rotor]"),
    ("motion.sun", "on", "sun", "a motion cannot carry itself"),
    ("motion.sun", "on", "jar", "in a circle: 'jar' is itself carried by 'sun'"),
    ("motion.sun", "amplitude", "5 deg", "not belong to 'kind = turn' (only to: swing, shift)"),
    ("motion.sun", "file", "a.txt", "does not belong to 'kind = turn' (only to: table)"),
    ("motion.rock", "speed", "5 rpm", "does not belong to 'kind = swing' (only to: turn)"),
    ("motion.rock", "frequency", "600 rpm", "(rpm is an angular speed; cycles are counted in Hz"),
    ("motion.rock", "frequency", "6 rad/s", "(rad/s is an angular speed; cycles are counted in"),
    ("motion.rock", "frequency", "-1 Hz", "must be at least 0 Hz, got '-1 Hz'"),
    ("motion.rock", "frequency", "1 s", "expected a frequency such as '25 Hz', got '1 s'"),
    ("motion.rock", "amplitude", "5 mm", "expected an angle such as '30 deg', got '5 mm'"),
    ("motion.shake", "amplitude", "5 mm", "expected three lengths in one unit"),
    ("motion.shake", "phase", "1 0 deg", "expected three angles in one unit such as '90 0 0 deg'"),
    ("motion.shake", "axis", "0 0 1", "does not belong to 'kind = shift' (only to: turn, swing)"),
    ("body.jar", "shape", "tube", "expected 'box', 'cylinder', 'cone', 'capsule', 'sphere'"),
    ("body.jar", "side", "in", "expected 'outside' or 'inside', got 'in'"),
    ("body.jar", "motion", "jra", "there is no section [motion.jra]; did you mean 'jar'?"),
    ("body.jar", "motion", "rotor", "there is no section [rotor]"),
    ("body.jar", "axis", "0 0 1e-10", "expected three numbers, not all of them 0"),
    ("body.jar", "radius", "0 mm", "must be between 1e-09 and 10000 m"),
    ("body.jar", "size", "1 1 1 mm", "does not belong to 'shape = cylinder' (only to: box"),
    ("body.jar", "end_radius", "1 mm", "does not belong to 'shape = cylinder' (only to: cone)"),
    ("body.jar", "rounding", "1 mm", "a container's edges are not rounded: leave it out"),
    ("body.jar", "copies", "2", "a mill has one container: leave it out"),
    ("body.tip", "side", "inside", "[body.jar] holds the balls, and a mill has one container"),
    ("body.bar", "size", "1 0 1 mm", "must be between 1e-09 and 10000 m, got '1 0 1 mm'"),
    ("body.bar", "rounding", "1.6 mm", "0.0016 m is too large for the sizes of the body"),
    ("body.bar", "copies", "0", "must be between 1 and 10000"),
    ("body.bar", "turn_about", "0 0 0", "expected three numbers, not all of them 0"),
    ("body.bar", "kind", "bars", "a kind of contact begins with 'ball_': write 'ball_bars'"),
    ("body.bar", "kind", "ball_ball", "'ball_ball' is the kind of contact of two balls"),
    ("body.bar", "kind", "ball_a/b", "'ball_a/b' is not allowed: a name consists of letters, digits"),
    ("body.bar", "kind", "a/b", "'a/b' is not allowed: a name consists of letters, digits"),
    ("body.bar", "kind", "ball_", "'ball_' is not allowed: a name consists of letters, digits"),
    ("body.bar", "radius", "1 mm", "(only to: cylinder, cone, capsule, sphere): leave it out"),
    ("body.bar", "unit", "mm", "does not belong to 'shape = box' (only to: mesh)"),
    ("body.tip", "radius", "-1 mm", "must be between 0 and 10000 m"),
    ("body.tip", "rounding", "2 mm", "0.002 m is too large for the sizes of the body"),
    ("balls", "diameter", "35.8 mm", "a ball of 0.0358 m does not fit into the container [body.jar]"),
    ("balls", "count", "600", "600 balls do not fit: they fill 0.0393 litres of the container's"),
    ("contact.ball_jra", "friction", "0.1", "unknown kind of contact; there are ball_ball,"),
    ("contact.jar", "friction", "0.1", "its name begins with 'ball_'"),
    ("contact.ball_drum", "friction", "0.1", "unknown kind of contact; there are ball_ball,"),
]


@pytest.mark.parametrize("section, key, value, words", WRONG_VALUES)
def test_a_wrong_value_is_named_with_file_line_section_and_key(refused, write_deck, section, key, value, words):
    text, line = set_key(PLANET, section, key, value)
    write_deck(text)
    complaint = refused("deck.ini")
    if section.startswith("contact."):
        assert complaint.startswith(f"deck.ini:{line - 1}: [{section}]: ")
    else:
        assert complaint.startswith(f"deck.ini:{line}: [{section}] {key}: ")
    assert words in complaint


@pytest.mark.parametrize("section, key, value, words", WRONG_VALUES[::20])  # read in one way, whatever the key
def test_a_wrong_override_is_named_as_given(refused, write_deck, section, key, value, words):
    write_deck(PLANET)
    order = f"{section}.{key}={value}"
    complaint = refused("deck.ini", "--set", order)
    assert complaint.startswith(f"--set {order}: [{section}]")
    assert words in complaint


REQUIRED = [
    ("motion.sun", "kind", 9),
    ("motion.sun", "speed", 9),
    ("motion.rock", "amplitude", 19),
    ("motion.rock", "frequency", 19),
    ("motion.shake", "amplitude", 25),
    ("motion.shake", "frequency", 25),
    ("body.jar", "shape", 30),
    ("body.jar", "radius", 30),
    ("body.jar", "length", 30),
    ("body.bar", "size", 39),
    ("body.tip", "radius", 50),
    ("body.tip", "end_radius", 50),
    ("body.tip", "length", 50),
]


@pytest.mark.parametrize("section, key, line", REQUIRED)
def test_a_missing_key_is_named(refused, write_deck, section, key, line):
    write_deck(drop_key(PLANET, section, key))
    assert refused("deck.ini").startswith(f"deck.ini:{line}: [{section}] {key}: missing (")


@pytest.mark.parametrize(
    "text, key",
    [
        ("[motion.a]\nkind = table\n", "motion.a] file"),
        ("[body.a]\nshape = mesh\nunit = mm\n", "body.a] file"),
        ("[body.a]\nshape = mesh\nfile = a.stl\n", "body.a] unit"),
        ("[body.a]\nshape = capsule\nradius = 1 mm\n", "body.a] length"),
        ("[body.a]\nshape = sphere\n", "body.a] radius"),
    ],
)
def test_a_missing_key_of_other_kinds_is_named(refused, write_deck, text, key):
    write_deck(PLANET + text)
    assert refused("deck.ini").startswith(f"deck.ini:57: [{key}: missing (")


# ---- what does not fit together ----

JAR = "[body.jar]\nshape = cylinder\nside = inside\nradius = 20 mm\nlength = 30 mm\n"
TURN = "[motion.a]\nkind = turn\nspeed = 60 rpm\n"


def test_a_mill_needs_a_container(refused, write_deck):
    write_deck(PLANET.replace("side = inside\n", ""))
    expected = "deck.ini: nothing holds the balls: add [drum], or a [body.NAME] with 'side = inside'"
    assert refused("deck.ini") == expected


def test_a_drum_and_a_body_cannot_both_hold_the_balls(refused, write_deck):
    write_deck(SMALL + JAR)
    assert refused("deck.ini").startswith("deck.ini:25: [body.jar] side: [drum] holds the balls")


def test_circles_of_motions_are_named(refused, write_deck):
    motions = "".join(
        f"[motion.{a}]\nkind = turn\nspeed = 1 rpm\non = {b}\n"
        for a, b in ("ab", "bc", "cd", "db")  # a hangs on the circle of b, c and d
    )
    write_deck(SMALL + motions)
    complaint = refused("deck.ini")
    assert "] on: motions carry each other in a circle: '" in complaint
    assert complaint.startswith(("deck.ini:30: [motion.b]", "deck.ini:34: [motion.c]", "deck.ini:38: [motion.d]"))


def test_a_rotor_has_no_second_motion(refused, write_deck):
    write_deck(SMALL + TURN.replace(".a]", ".rotor]"))
    expected = "deck.ini:23: [motion.rotor]: 'rotor' is the motion of [rotor]; give this one another name"
    assert refused("deck.ini") == expected


def test_motions_and_kinds_have_a_number(millsim, refused, write_deck):
    motions = [TURN.replace(".a]", f".m{k}]") for k in range(16)]
    write_deck(SMALL + "".join(motions[:15]))
    assert millsim("--check", "-q", "deck.ini").returncode == 0
    write_deck(SMALL + "".join(motions))
    expected = "deck.ini:68: [motion.m15]: there are more than 16 motions, the rotor's included"
    assert refused("deck.ini") == expected
    bodies = [f"[body.b{k}]\nshape = sphere\nradius = 1 mm\ncentre = 0 0 0.1 mm\n" for k in range(20)]
    text = SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :]
    write_deck(text + "".join(bodies))
    assert "more than 24 kinds of contact: give bodies that belong together a common 'kind'" in refused("deck.ini")
    write_deck(text + "".join(b + "kind = ball_b\n" for b in bodies))
    assert millsim("--check", "-q", "deck.ini").returncode == 0


@pytest.mark.parametrize(
    "drop, place, words",
    [
        ("blades", "deck.ini:12: [rotor] shaft_radius: shafts need a [drum] that does not move", ""),
        (
            "shaft",
            "deck.ini:13: [blades]: blades need a [drum] that does not move",
            "'motion = rotor'",
        ),
    ],
)
def test_shaft_and_blades_need_a_drum_that_stands_still(refused, write_deck, drop, place, words):
    text = SMALL.replace("shaft_radius = 5 mm", "shaft_radius = 0 mm") if drop == "shaft" else SMALL
    if drop == "blades":
        text = text[: text.index("[blades]")] + text[text.index("[contact]") :]
    moved = text.replace("length = 40 mm\n", "length = 40 mm\nmotion = a\n") + TURN
    write_deck(moved)
    assert refused("deck.ini").startswith(
        place.replace(":12:", ":13:") if drop == "blades" else place.replace(":13:", ":14:")
    )
    without = text.replace("[drum]\nradius = 30 mm\nlength = 40 mm\n", "") + JAR
    write_deck(without)
    complaint = refused("deck.ini")
    assert complaint.startswith(place.replace(":12:", ":9:").replace(":13:", ":10:"))
    assert words in complaint


def test_a_drum_names_its_motion(refused, write_deck):
    write_deck(SMALL.replace("[rotor]", "motion = b\n[rotor]") + TURN)
    expected = "deck.ini:10: [drum] motion: there is no section [motion.b]; did you mean 'a'?"
    assert refused("deck.ini") == expected


def test_a_start_file_says_how_its_balls_move(refused, write_deck, tmp_path):
    (tmp_path / "start.txt").write_text("0.07 0 0\n" * 5)
    text, _ = set_key(PLANET, "balls", "start", "start.txt")
    text, line = set_key(text, "balls", "start_motion", "still")
    write_deck(text)
    complaint = refused("deck.ini")
    assert complaint.startswith(f"deck.ini:{line}: [balls] start_motion: is for a random start only")


def test_a_ball_in_a_body_is_told(refused, write_deck, tmp_path):
    (tmp_path / "start.txt").write_text("0.07 0 0\n")
    text, _ = set_key(PLANET, "balls", "start", "start.txt")
    text, _ = set_key(text, "balls", "count", "1")
    # without the motions that carry nothing, which are warned of
    text = text[: text.index("[motion.rock]")] + text[text.index("[body.jar]") :]
    write_deck(text)
    complaint = refused("deck.ini")
    assert f"{tmp_path}/start.txt:1: ball overlaps the body bars by " in complaint
    (tmp_path / "start.txt").write_text("0.088 0.001 0.010\n")
    assert "ball overlaps the body jar by " in refused("deck.ini")


# ---- files ----


def test_a_table_that_is_not_there_is_named(refused, write_deck, tmp_path):
    write_deck(PLANET + "[motion.a]\nkind = table\nfile = away.txt\n")
    complaint = refused("deck.ini")
    expected = f"deck.ini:59: [motion.a] file: cannot read '{tmp_path}/away.txt': No such file"
    assert complaint.startswith(expected)
    write_deck(PLANET + "[motion.a]\nkind = table\nfile = /dev/zero\n")
    assert "'/dev/zero' is a device, not a file" in refused("deck.ini")


def test_a_fault_in_a_file_is_told_with_the_line_that_names_it(refused, write_deck, tmp_path):
    (tmp_path / "a.txt").write_text("0 0 0 0 0 0\n")
    write_deck(PLANET + "[motion.a]\nkind = table\nfile = a.txt\n")
    expected = f"deck.ini:59: [motion.a] file: {tmp_path}/a.txt:1: expected 7 numbers"
    assert refused("deck.ini").startswith(expected)
    (tmp_path / "a.stl").write_text("solid a\nfacet bad\n")
    write_deck(PLANET + "[body.a]\nshape = mesh\nfile = a.stl\nunit = mm\n")
    expected = f"deck.ini:59: [body.a] file: {tmp_path}/a.stl:2: expected 'normal', got 'bad'"
    assert refused("deck.ini").startswith(expected)


def test_a_mesh_in_the_wrong_unit_is_told_with_its_size(refused):
    complaint = refused(ROOT / "input/stl.ini", "-s", "body.rotor.unit=m")
    assert "leaves the container by 3.9e+04 mm at t = 0 s" in complaint
    assert "with this 'unit' the mesh measures 78.9 x 78.9 x 64 m: check 'unit'" in complaint


def test_more_facets_than_memory_holds_are_refused_by_the_number_of_copies(refused):
    order = ("-s", "body.rotor.copies=1200", "-s", "body.rotor.turn_by=0.1 deg")
    complaint = refused(ROOT / "input/stl.ini", *order)
    assert "[body.rotor] copies: 1200 copies of 4200 facets are more than 5000000" in complaint


def test_a_jar_beside_the_axis_of_its_turn_is_a_warning(millsim):
    for key in ("body.jar.centre", "motion.jar.centre"):
        done = millsim("--check", "-q", "-s", f"{key}=0 0 0 mm", ROOT / "input/planetary.ini")
        assert done.returncode == 0
        assert "[body.jar] centre: the container's axis is 70 mm away from the axis of" in done.stderr
    assert millsim("--check", "-q", ROOT / "input/planetary.ini").stderr == ""


def test_bodies_that_pass_each_other_closer_than_a_ball_are_a_warning(millsim):
    def warned(length):
        order = ("-s", f"body.arm.length={length} mm", ROOT / "input/attritor.ini")
        done = millsim("--check", "-q", *order)
        assert done.returncode == 0
        return done.stderr

    # the tank's radius is 45 mm, a ball's diameter 5 mm; of an arm's rims the ends are rounded by 1 mm
    assert warned(79) == ""
    text = warned(84)
    assert "[body.arm]: its copy 0 comes as near as 3 mm to [body.tank] at t = 0 s" in text
    assert text.endswith("no more than a ball's diameter of 5 mm: balls can be pinched there\n")
    assert len(text.splitlines()) == 1


# the plate begins 30 mm from the axis about which the bar turns; the bar's corners are at 29.4 mm
PASSING = """\
[run]
time = 20 ms
[drum]
radius = 60 mm
length = 80 mm
[rotor]
speed = 300 rpm
shaft_radius = 0 mm
[body.plate]
shape = box
centre = 0 0 -40 mm
size = 40 16 20 mm
[body.bar]
shape = box
motion = rotor
centre = 0 9 0 mm
size = 10 40 10 mm
[balls]
count = 9
diameter = 3 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
"""


def test_bodies_that_can_never_touch_are_a_warning_if_a_ball_can_be_pinched_between_them(millsim, write_deck):
    def warned(place):
        done = millsim("--check", "-q", "-s", f"body.bar.centre=0 {place} 0 mm", write_deck(PASSING))
        assert done.returncode == 0
        return done.stderr

    assert "[body.plate]: comes as near as 0.57 mm to [body.bar] at t = 0." in warned(9)
    assert "[body.plate]: comes as near as 2.5 mm to [body.bar] at t = 0." in warned(7)
    assert warned(5) == ""


# the body's ends are 10 mm from the lids, the tank's wall is farther away
CONTOURS = """\
[run]
time = 20 ms
[motion.turn]
kind = turn
axis = 0 0 1
speed = 60 rpm
[body.tank]
shape = {tank}
side = inside
radius = 150 mm
length = 80 mm
[body.star]
shape = contour
motion = turn
file = star.txt
length = 60 mm
[balls]
count = 9
diameter = 8 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
"""
# a circle, one beside the axis, a lune, and two that are thinner than the flats of their outlines
THIN = ".05 0 0\n-.05 0 .0002\n", ".05 0 .0001\n-.05 0 -.00009\n"
ROUND = ".05 0 1\n-.05 0 1\n", ".1 0 1\n.04 0 1\n", ".05 0 .2\n-.05 0 -.15\n"


@pytest.mark.parametrize("tank", ["contour", "cylinder"])
@pytest.mark.parametrize("star", ROUND + THIN)
def test_a_contour_is_no_nearer_than_it_is(millsim, write_deck, tmp_path, tank, star):
    (tmp_path / "star.txt").write_text(star)
    (tmp_path / "tank.txt").write_text(".15 0 1\n-.15 0 1\n")
    text = CONTOURS.format(tank=tank)
    deck = write_deck(text.replace("radius = 150 mm", "file = tank.txt") if tank == "contour" else text)
    done = millsim("--check", "-q", deck)
    assert (done.returncode, done.stderr) == (0, "")
    done = millsim("--check", "-q", "-s", "balls.diameter=12 mm", deck)
    assert "[body.star]: comes as near as 9.9 mm to [body.tank] at t = 0 s" in done.stderr


def test_a_bound_in_another_unit_is_still_within_the_bounds(refused, millsim, write_deck):
    deck = write_deck(PASSING)
    assert millsim("--check", "-q", "-s", "body.plate.size=1e-6 10 10 mm", deck).returncode == 0
    assert "between 1e-09 and 10000 m, got '0.9e-6" in refused("-s", "body.plate.size=0.9e-6 10 10 mm", deck)


SHAKEN = """\
[motion.{name}]
kind = shift
amplitude = 0.5 0 0 mm
frequency = {frequency} Hz
[body.{name}]
shape = box
motion = {name}
centre = {x} 0 -180 mm
size = 6 5 5 mm
copies = 40
shift_by = 0 0 9 mm
"""
TANK = "[body.tank]\nshape = cylinder\nside = inside\nradius = 90 mm\nlength = 400 mm\n"


@pytest.mark.thorough
def test_bodies_whose_check_would_take_too_long_are_a_warning_but_their_begin_is_seen(millsim, write_deck):
    one = SHAKEN.format(name="a", frequency=50, x=-4)
    other = SHAKEN.format(name="b", frequency=51.2345678, x=4)
    balls = "[balls]\ncount = 9\ndiameter = 1 mm\ndensity = 7800 kg/m^3\n"
    law = "[contact]\nrestitution = 0.8\n[output]\nframes = 0 s\n"
    text = "[run]\ntime = 1 h\n" + one + other + TANK + balls + law
    write_deck(text)
    done = millsim("--check", "-q", "deck.ini")
    assert done.returncode == 0
    assert "[body.a]: it was not checked whether its copy " in done.stderr
    assert done.stderr.endswith(" s, because this would take too long\n")
    ball = "[body.{0}]\nshape = sphere\nradius = 3 mm\nmotion = {1}\ncentre = {2} 40 0 mm\n"
    write_deck(text + ball.format("y", "a", 0) + ball.format("z", "b", 5))
    done = millsim("--check", "-q", "deck.ini")
    assert done.returncode == 2
    assert "[body.z]: runs into [body.y] at t = 0 s" in done.stderr


@pytest.mark.parametrize(
    "half, period, words",
    [
        (2.0, 0.04, "the table moves by 2 m, at up to 306 m/s and 4.97e+03 g"),  # mm
        (2.0, 40.0, "the table moves by 2 m, at up to 0.306 m/s and 0.00497 g"),  # mm and ms
        (0.002, 0.04, None),
    ],
)
def test_a_table_in_millimetres_and_milliseconds_is_a_warning(millsim, write_deck, tmp_path, half, period, words):
    steps = [(k * period / 16, half * round(math.sin(k * math.pi / 8), 12)) for k in range(17)]
    (tmp_path / "shake.txt").write_text("".join(f"{t:.10g} {x:.10g} 0 0 0 0 0\n" for t, x in steps))
    deck = SMALL_JAR + "[motion.a]\nkind = table\nfile = shake.txt\n"
    write_deck(deck)
    done = millsim("deck.ini", "-qc")
    mend = ": its rows are in s, m and rad; divide lengths in mm and times in ms by 1000\n"
    place = f"millsim: warning: deck.ini:{deck.count(chr(10))}: [motion.a] file: "
    assert (done.returncode, done.stderr) == (0, place + words + mend if words else "")


def test_a_table_is_found_again_and_never_overwritten(millsim, write_deck, tmp_path):
    (tmp_path / "sub").mkdir()
    rows = "0 0 0 0 0 0 0\n1 0 0 0 0 0 1\n2 0 0 0 0 0 -1\n3 0 0 0 0 0 0\n"
    (tmp_path / "sub" / "path.h5").write_text(rows)
    write_deck(PLANET + "[motion.a]\nkind = table\nfile = path.h5\n", "sub/deck.ini")
    text = fixed_point(millsim, tmp_path, "sub/deck.ini")
    assert f"\nfile = {tmp_path}/sub/path.h5 " in text
    done = millsim("-f", "-o", "sub/path.h5", "sub/deck.ini")
    assert done.returncode == 2
    assert "sub/path.h5: is the deck's file of a body or motion" in done.stderr
    assert (tmp_path / "sub" / "path.h5").read_text() == rows


# ---- --check prints a deck ----


def test_defaults_are_those_of_the_contract(printed, write_deck):
    text = (
        PLANET[: PLANET.index("[motion.sun]")]
        + JAR
        + "motion = a\n[motion.a]\nkind = turn\nspeed = 1 rad/s\n"
        + "[motion.b]\nkind = swing\namplitude = 1 rad\nfrequency = 1 Hz\n"
        + "[motion.c]\nkind = shift\namplitude = 1 0 0 m\nfrequency = 1 Hz\n"
        + "[body.x]\nshape = box\nsize = 1 1 1 mm\nmotion = a\n"
        + "[body.y]\nshape = box\nsize = 1 1 1 mm\nmotion = a\ncopies = 2\nshift_by = 1 0 0 mm\n"
    )
    write_deck(text)
    expected = """\
balls.start_motion = container
motion.a.centre = 0 0 0 m
motion.a.axis = 0 0 1
motion.a.angle = 0 rad
motion.b.axis = 0 0 1
motion.b.phase = 0 rad
motion.c.phase = 0 0 0 rad
body.x.side = outside
body.x.centre = 0 0 0 m
body.x.axis = 0 0 1
body.x.angle = 0 rad
body.x.rounding = 0 m
body.x.copies = 1
body.y.turn_by = 0 rad
body.y.turn_about = 0 0 1
"""
    values = printed("deck.ini")
    assert expected.splitlines() == [f"{key} = {values.get(key)}" for key in re.findall(r"^\S+", expected, re.M)]
    assert not {"body.x.turn_by", "body.jar.copies", "body.jar.rounding", "motion.a.on", "body.x.kind"} & set(values)


def test_a_checked_mill_of_bodies_checks_to_itself(millsim, tmp_path, write_deck):
    write_deck(PLANET)
    fixed_point(millsim, tmp_path, "deck.ini")


NAMES = "planetary emax mixer shaker vibratory attritor discs tumbling"


@pytest.mark.parametrize("name", NAMES.split())
def test_a_checked_deck_of_input_checks_to_itself(millsim, tmp_path, name):
    fixed_point(millsim, tmp_path, ROOT / "input" / f"{name}.ini")
