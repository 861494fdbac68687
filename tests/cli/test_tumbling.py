"""The words of the trade for tumbling mills: a speed in per cent of the critical one, a filling J, a charge whose sizes
are a distribution."""

import math
import re

import h5py
import numpy as np
import pytest

G, R = 9.81, 0.15  # [m/s^2], [m] inner radius of the drum
DECK = """\
[run]
time = 50 ms
starts = 1
[drum]
radius = 150 mm
length = 200 mm
motion = roll
[motion.roll]
kind = turn
axis = 1 0 0
speed = 70 % critical
[balls]
diameter = 20 mm
count = 100
density = 7800 kg/m^3
[contact]
restitution = 0.5
friction = 0.3
"""
JAR = "[body.jar]\nshape = cylinder\nside = inside\nmotion = roll\naxis = 1 0 0\nradius = 150 mm\nlength = 200 mm\n"
DRUM = DECK[DECK.index("[drum]") : DECK.index("[motion")]
BOND = DECK.replace("count = 100", "sizes = bond\nbulk_fill = 20 %")
ROSIN = BOND.replace("sizes = bond", "sizes = rosin_rammler\nd63 = 14 mm\nuniformity = 3\nsmallest = 8 mm\nclasses = 5")
TABLE = BOND.replace("sizes = bond", "sizes = sizes.txt").replace("diameter = 20 mm\n", "")


# ---- the critical speed ----


def critical(d=0.02):
    """[rad/s] At it the largest ball has no weight at the top of the drum."""
    return math.sqrt(G / (R - d / 2))


def speed(told, key="motion.roll.speed"):
    """[rad/s] in the full deck"""
    return float(told[key].removesuffix(" rad/s"))


@pytest.mark.parametrize("text, share", [("70 % critical", 0.7), ("0.7 critical", 0.7), ("-120 % critical", -1.2)])
def test_a_share_of_the_critical_speed_is_a_speed(printed, write_deck, text, share):
    told = printed(write_deck(DECK.replace("70 % critical", text)))
    assert speed(told) == pytest.approx(share * critical(), rel=1e-14)
    assert speed(told) == pytest.approx(share * 42.3 / math.sqrt(0.3 - 0.02) * math.tau / 60, rel=1e-3)


def test_the_largest_ball_and_gravity_across_the_axis_decide(printed, write_deck):
    kinds = "[balls.a]\ncount = 9\ndiameter = 20 mm\ndensity = 1 g/cm^3\n[balls.b]\ncount = 9\ndiameter = 30 mm\n"
    kinds += "density = 7 g/cm^3\n"
    deck = write_deck(DECK.replace(DECK[DECK.index("[balls]") : DECK.index("[contact]")], kinds))
    assert speed(printed(deck)) == pytest.approx(0.7 * critical(0.03))
    assert speed(printed("-s", "gravity.acceleration=5 0 -2.4525 m/s^2", deck)) == pytest.approx(0.35 * critical(0.03))


@pytest.mark.parametrize(
    "old, new",
    [
        (DRUM, JAR),
        ("length = 200 mm\n", "length = 200 mm\nends = periodic\n"),
        ("length = 200 mm\n", "length = 200 mm\nprofile = wavy\nbuckles = 8\nbuckle_height = 4 mm\n"),
    ],
    ids=["jar", "slice", "wavy"],
)
def test_a_round_body_a_slice_and_a_wavy_drum_have_a_critical_speed(printed, write_deck, old, new):
    assert speed(printed(write_deck(DECK.replace(old, new)))) == pytest.approx(0.7 * critical())


def test_a_drum_on_the_rotor_has_one_too(printed, write_deck):
    rotor = "[rotor]\nshaft_radius = 0 m\nspeed = -70 % critical\n"
    text = DECK.replace(DECK[DECK.index("[motion") : DECK.index("[balls]")], rotor)
    told = printed(write_deck(text.replace("motion = roll", "motion = rotor")))
    assert speed(told, "rotor.speed") == pytest.approx(-0.7 * critical())


def test_an_override_in_rpm_replaces_a_share_and_the_other_way_round(printed, write_deck):
    share, plain = write_deck(DECK), write_deck(DECK.replace("70 % critical", "50 rpm"), "plain.ini")
    assert speed(printed("-s", "motion.roll.speed=50 rpm", share)) == speed(printed(plain))
    assert speed(printed("-s", "motion.roll.speed=70 % critical", plain)) == speed(printed(share))


NONE = "11: [motion.roll] speed: there is no critical speed: "
IDLE = "this motion does not carry the container; give the speed in rpm"
ALONE = (
    "the container must be a drum or round body that this turn alone carries about its own axis, across gravity; "
    "give the speed in rpm"
)


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ("axis = 1 0 0", "axis = 0 1 0", NONE + ALONE),
        ("[contact]", "[gravity]\nacceleration = -9.81 0 0 m/s^2\n[contact]", NONE + ALONE),
        ("[contact]", "[gravity]\nacceleration = 0 0 0 m/s^2\n[contact]", NONE + ALONE),
        ("kind = turn", "kind = turn\non = sun", NONE.replace("11", "12") + ALONE),
        ("axis = 1 0 0", "axis = 1 0 0\ncentre = 0 1 0 mm", NONE.replace("11", "12") + ALONE),
        (DRUM, JAR.replace("cylinder", "box").replace("radius = 150 mm\nlength = 200 mm", "size = 300 300 200 mm"),
         NONE.replace("11", "13") + ALONE),
        ("motion = roll\n", "", NONE.replace("11", "10") + IDLE),
        ("70 % critical", "70 % of critical", "11: [motion.roll] speed: expected a share of the critical speed "
         "with its unit such as '70 % critical', got '70 % of critical' (unknown unit '% of critical')"),
        ("70 % critical", "70 critical",
         "11: [motion.roll] speed: 70 times the critical speed: write '70 % critical'?"),
    ],
)  # fmt: skip
def test_where_there_is_no_critical_speed_one_line_says_why(refused, write_deck, old, new, complaint):
    sun = "[motion.sun]\nkind = turn\naxis = 1 0 0\nspeed = 9 rpm\n"
    assert (
        refused("--check", write_deck(DECK.replace(old, new) + sun * ("on = sun" in new)).name)
        == f"deck.ini:{complaint}"
    )


def test_a_share_is_told_without_a_deck_in_its_own_unit(millsim):
    told = millsim("--value=motion.a.speed=-70 % critical", "--value=rotor.speed=0.7 critical").stdout.splitlines()
    assert [line.split("\t")[:4] for line in told] == [
        ["motion.a.speed", "number", "-0.7", "critical"],
        ["rotor.speed", "number", "0.7", "critical"],
    ]


# ---- the summary ----


def said(result, word):
    """The number in front of a word of the summary"""
    return float(re.search(rf"([-\d.e+]+) {re.escape(word)}", result.stderr + result.stdout)[1])


@pytest.mark.parametrize("ends", ["walls", "periodic"])
def test_check_says_the_critical_speed_and_the_filling_of_a_drum_that_turns_about_its_axis(millsim, write_deck, ends):
    told = millsim("--check", "-s", f"drum.ends={ends}", "-s", "motion.roll.speed=-70 % critical", write_deck(DECK))
    volume = math.pi * R**2 * 0.2
    assert said(told, "% of critical") == 70
    assert said(told, "rpm, 70") == pytest.approx(0.7 * critical() * 60 / math.tau, rel=5e-3)
    assert said(told, "rpm, D less d") == pytest.approx(critical() * 60 / math.tau, rel=5e-3)
    filling = 100 * (100 * math.pi / 6 * 0.02**3) / 0.6 / volume
    assert float(re.search(r"; J (\S+) %", told.stderr)[1]) == pytest.approx(filling, rel=5e-3)


def test_a_drum_upright_has_no_critical_speed_in_the_summary(millsim, write_deck):
    upright = ("-s", "gravity.acceleration=-9.81 0 0 m/s^2", "-s", "motion.roll.speed=50 rpm")
    assert "of critical" not in millsim("--check", *upright, write_deck(DECK)).stderr


# ---- sizes ----


def classes(told):
    """Numbers and diameters [m] of the balls of the full deck, in their order"""
    keys = [key.removesuffix(".count") for key in told if re.fullmatch(r"balls\..+\.count", key)]
    return [int(told[f"{key}.count"]) for key in keys], [float(told[f"{key}.diameter"].split()[0]) for key in keys]


def finer_bond(d):
    """The share of the mass below d [m] of balls from 20/3 mm to 20 mm"""
    return ((d / 0.02) ** 3.8 - 3**-3.8) / (1 - 3**-3.8)


def finer_rosin(d):
    """From 8 to 20 mm"""
    low, high, at = (1 - math.exp(-((x / 0.014) ** 3)) for x in (0.008, 0.02, d))
    return (at - low) / (high - low)


@pytest.mark.parametrize("text, finer, count", [(BOND, finer_bond, 4), (ROSIN, finer_rosin, 5)], ids=["Bond", "Rosin"])
def test_a_distribution_becomes_classes_of_equal_mass_and_middle_size(printed, write_deck, text, finer, count):
    numbers, diameters = classes(printed(write_deck(text)))
    assert [finer(d) for d in diameters] == pytest.approx([(k + 0.5) / count for k in range(count)], abs=1e-3)
    masses = np.array(numbers) * np.array(diameters) ** 3
    assert masses == pytest.approx(np.full(count, masses.mean()), rel=0.6 / min(numbers) + 1e-3)
    assert masses.sum() * math.pi / 6 == pytest.approx(0.6 * 0.2 * math.pi * R**2 * 0.2, rel=0.01)


@pytest.mark.parametrize(
    "rows, sizes",
    [
        ("0.01 25\n0.02 75\n", [0.01, 0.02]),
        ("# shares\n0.01 0.25\n0.02 0.75\n", [0.01, 0.02]),
        ("0.005 0\n0.02 25\n0.03 100\n", [0.01, 0.02449]),
    ],
    ids=["per cent", "shares", "screens"],
)
def test_a_table_gives_sizes_and_their_shares_of_the_mass(printed, write_deck, tmp_path, rows, sizes):
    (tmp_path / "sizes.txt").write_text(rows)
    numbers, diameters = classes(printed("-s", "balls.mass=10 kg", write_deck(TABLE)))
    assert diameters == sizes
    masses = [7800 * math.pi / 6 * d**3 * n for n, d in zip(numbers, diameters)]
    assert masses == pytest.approx([2.5, 7.5], abs=0.04)


def test_a_number_of_balls_is_kept_when_it_is_divided_into_classes(printed, write_deck):
    numbers, diameters = classes(printed(write_deck(BOND.replace("bulk_fill = 20 %", "count = 101"))))
    assert sum(numbers) == 101
    assert sorted(numbers, reverse=True) == numbers and sorted(diameters) == diameters


def test_the_full_deck_of_a_distribution_gives_the_same_bits(millsim, write_deck, tmp_path):
    mixed = BOND.replace("[balls]", "[balls.steel]").replace("bulk_fill = 20 %", "bulk_fill = 5 %")
    rock = "[balls.rock]\nsizes = rosin_rammler\ndiameter = 22 mm\nd63 = 20 mm\nuniformity = 2\nbulk_fill = 8 %\n"
    deck = write_deck(mixed.replace("[contact]", f"{rock}density = 2700 kg/m^3\n[contact]"))
    full = write_deck(millsim("--check", "-q", deck).stdout, "full.ini")
    found = []
    for name in (deck, full):
        assert millsim("-q", "-o", f"{name.stem}.h5", name).returncode == 0
        with h5py.File(tmp_path / f"{name.stem}.h5") as file:
            found.append({key: file[f"particles/trajectory/{key}/value"][()] for key in ("position", "velocity")})
    assert millsim("--check", "-q", full).stdout == full.read_text()
    for key in found[0]:
        assert found[0][key].tobytes() == found[1][key].tobytes()


@pytest.mark.parametrize(
    "text, rows, complaint",
    [
        (BOND + "[balls.balls_3]\n", "", "14: [balls] sizes: belongs in the sections [balls.NAME] of this mixture"),
        (BOND.replace("sizes = bond", "sizes = bond\nsmallest = 30 mm"), "",
         "15: [balls] smallest: less than 0.1 % of the balls is from 0.03 m, the smallest, to 0.02 m"),
        (BOND.replace("sizes = bond", "d63 = 3 mm"), "",
         "14: [balls] d63: belongs to 'sizes = rosin_rammler': leave it out"),
        (BOND.replace("sizes = bond", "classes = 3"), "",
         "14: [balls] classes: belongs to 'sizes = bond' or 'sizes = rosin_rammler': leave it out"),
        (TABLE.replace("sizes = ", "diameter = 1 mm\nsizes = "), "0.02 100",
         "13: [balls] diameter: the table of 'sizes' gives the diameters: leave it out; or is 'sizes' bond or "
         "rosin_rammler?"),
        (BOND.replace("bulk_fill = 20 %", "count = 2"), "",
         "15: [balls.balls_2] count: gives 0 balls of 0.01555 m; expected 1 to 50000000"),
    ],
)  # fmt: skip
def test_wrong_sizes_are_refused(refused, write_deck, tmp_path, text, rows, complaint):
    (tmp_path / "sizes.txt").write_text(rows)
    assert complaint in "\n".join(refused("--check", write_deck(text).name, most=9))


SUM = "the shares in '{}' add up to NUMBER, not to 100 %; what passes begins at 0"
ORDER = "diameters, in m, and what passes must ascend from 0"


@pytest.mark.parametrize(
    "rows, complaint",
    [
        ("0.01 30\n0.02 60\n", SUM.replace("NUMBER", "90")),
        ("0.01 30\n0.02 100\n", SUM.replace("NUMBER", "130")),
        ("0.02 50\n0.01 50\n", "{}:2: " + ORDER),
        ("10 50\n20 50\n", "{}:1: " + ORDER),
        ("0.01 0\n0.02 50\n0.03 40\n", "{}:3: " + ORDER),
        ("0.01 1 2\n", "{}:1: expected 2 numbers 'd m': diameter in m, share of the mass"),
    ],
)  # fmt: skip
def test_a_wrong_table_of_sizes_is_refused(refused, write_deck, tmp_path, rows, complaint):
    (tmp_path / "sizes.txt").write_text(rows)
    line = refused("--check", write_deck(TABLE).name)
    assert line == f"deck.ini:13: [balls] sizes: {complaint.format(tmp_path / 'sizes.txt')}"


def test_names_of_classes_must_be_free(refused, write_deck):
    text = BOND.replace("[balls]", "[balls.a]").replace("[contact]", "[balls.a_2]\ncount = 1\ndiameter = 9 mm\n"
                                                        "density = 1 g/cm^3\n[contact]")  # fmt: skip
    assert refused("--check", write_deck(text).name) == (
        "deck.ini:14: [balls.a] sizes: its classes are [balls.a_1], ...: give one section another name"
    )


# ---- contours of files ----

FILE = DECK.replace("motion = roll\n", "motion = roll\nprofile = file\nfile = line.txt\n", 1)
AWAY = "the contour does not go around the axis of the drum, which is its origin: move it"
RANGE = "expected x and y up to 10000 m, and a bulge below 1000"


@pytest.mark.parametrize(
    "rows, complaint",
    [
        ("0.4 0 1\n0.1 0 1\n", AWAY),
        ("0.15 0.1 0\n-0.15 0.1 0\n-0.15 0.02 0.1\n0.15 0.02 0\n", AWAY),  # an arc that just leaves the axis out
        ("1e200 0 1\n-1e200 0 1\n", "corner 1 of the contour, 1e+200 0 1: " + RANGE),
        ("0.15 0 1\n-0.15 0 -1e3\n", "corner 2 of the contour, -0.15 0 -1000: " + RANGE),
        ("0.15 0\n-0.15 0\n", "{}:1: expected 3 numbers 'x y bulge' in SI units, as 'mill contour' writes"),
    ],
)
def test_a_contour_that_is_no_drum_is_refused(refused, write_deck, tmp_path, rows, complaint):
    (tmp_path / "line.txt").write_text(rows)
    line = refused("--check", write_deck(FILE).name)
    assert line == f"deck.ini:9: [drum] file: {complaint.format(tmp_path / 'line.txt')}"


@pytest.mark.parametrize("turned", range(8))
def test_a_contour_may_have_corners_anywhere_around_its_axis(millsim, write_deck, tmp_path, turned):
    """Two halves of a circle, whose chord goes through the axis; a drop, whose large arc alone has the axis."""
    for corners, bulges in (((0.15, -0.15), (1, 1)), ((0.15j + 0.1, 0.15j - 0.1), (0, 2.2))):
        way = np.array(corners) * np.exp(0.25j * np.pi * turned)
        rows = [f"{z.real:.17g} {z.imag:.17g} {b}" for z, b in zip(way, bulges)]
        (tmp_path / "line.txt").write_text("\n".join(rows))
        said = millsim("--check", "-q", write_deck(FILE).name)
        assert said.returncode == 0, said.stderr


def test_a_radius_that_is_not_the_contours_is_told(millsim, refused, write_deck, tmp_path):
    (tmp_path / "line.txt").write_text("0.15 0 1\n-0.15 0 1\n")
    for radius, told in ((145, False), (157, False), (135, True), (165, True)):
        said = millsim("--check", "-q", write_deck(FILE.replace("radius = 150", f"radius = {radius}")).name)
        assert said.returncode == 0 and ("[drum] radius" in said.stderr) == told
    assert "is not the one of the contour, whose points are from 0.15 to 0.15 m away from the axis" in said.stderr
    line = refused("--check", write_deck(FILE.replace("radius = 150", "radius = 400")).name)
    assert "0.4 m is far from the contour" in line


def test_a_single_lifter_leaves_the_drum_open(millsim, write_deck):
    one = DECK.replace("motion = roll\n", "motion = roll\nprofile = lifters\nlifters = 1\nlifter_height = 15 mm\n"
                       "lifter_width = 15 mm\n", 1)  # fmt: skip
    said = millsim("--check", "-q", write_deck(one).name)
    assert said.returncode == 0 and "openings" not in said.stderr
