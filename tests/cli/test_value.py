"""--value: what a value of a deck is, told without a deck; and balls.fill, which says the number of balls as a
share."""

import math
import re

import pytest
from conftest import SMALL

COLUMNS = ("key", "kind", "value", "unit", "meaning", "choices")


@pytest.fixture
def told(millsim):
    """told(*orders): a dict for each line."""

    def ask(*orders):
        result = millsim(*(f"--value={order}" for order in orders))
        assert (result.returncode, result.stderr) == (0, "")
        return [dict(zip(COLUMNS, line.split("\t"), strict=True)) for line in result.stdout.splitlines()]

    return ask


@pytest.mark.parametrize(
    "order, kind, value, unit",
    [
        ("drum.radius=75 mm", "number", "0.075", "m"),
        ("rotor.speed=1000 rpm", "number", repr(1000 * math.tau / 60), "rad/s"),
        ("contact.restitution=0.8", "number", "0.8", "1"),
        ("run.precision=2 %", "number", "0.02", "1"),
        ("balls.count=4000", "whole", "4000", "1"),
        ("run.seed=7", "whole", "7", "1"),
        ("drum.profile=wavy", "choice", "wavy", "1"),
        ("gravity.acceleration=0 0 -9.81 m/s^2", "vector", "0 0 -9.81", "m/s^2"),
        ("balls.start=random", "file", "random", "1"),
        ("balls.start=some where.txt", "file", "some where.txt", "1"),
        ("balls.small.diameter=3 mm", "number", "0.003", "m"),
        ("blade.paddle.position=-1 cm", "number", "-0.01", "m"),
        ("contact.ball_drum.friction=0.3", "number", "0.3", "1"),
        ("motion.a.amplitude=2 mrad", "number", "0.002", "rad"),
        ("motion.a.amplitude=1 2 3 mm", "vector", "0.001 0.002 0.003", "m"),
        ("motion.a.phase=2 rad", "number", "2", "rad"),
        ("motion.a.frequency=60 1/min", "number", "1", "Hz"),
        ("motion.a.on=sun", "name", "sun", "1"),
        ("body.a.unit=mm", "number", "0.001", "m"),
        ("body.a.unit=2 cm", "number", "0.02", "m"),
        ("body.a.axis=0 0 2", "vector", "0 0 2", "1"),
        ("body.a.file=a.stl", "file", "a.stl", "1"),
        ("body.a.shape=cone", "choice", "cone", "1"),
        ("contact.ball_a.friction=0.1", "number", "0.1", "1"),
    ],
)
def test_a_value_is_told_with_kind_and_unit(told, order, kind, value, unit):
    (line,) = told(order)
    assert line["key"] == order.split("=")[0]
    assert (line["kind"], line["value"], line["unit"]) == (kind, value, unit)
    assert line["meaning"]


def test_a_choice_has_words_and_so_has_a_file_that_there_need_not_be(told):
    lines = told("drum.profile=circle", "drum.radius=1 m", "balls.start=a.txt", "body.a.file=a.stl")
    assert [line["choices"] for line in lines] == ["circle|wavy|lifters|harmonics|file", "", "random", ""]


def test_a_told_number_reads_back_to_the_same_bits(told):
    first = told("rotor.speed=333.3 rpm", "drum.radius=0.1 in", "balls.density=7.8 g/cm^3")
    again = told(*(f"{line['key']}={line['value']} {line['unit']}" for line in first))
    assert again == first


def test_many_are_told_in_their_order(told):
    orders = [f"drum.length={k} mm" for k in range(1, 300)]
    assert [float(line["value"]) for line in told(*orders)] == [k / 1000 for k in range(1, 300)]


@pytest.mark.parametrize(
    "order, line",
    [
        ("rotor.speed=1000", "[rotor] speed: expected an angular speed with its unit such as '1000 rpm', got '1000'"),
        ("rotor.sped=1 rpm", "[rotor] sped: unknown key; did you mean 'speed'?"),
        ("rotors.speed=1 rpm", "[rotors]: unknown section; did you mean [rotor]?"),
        (
            "drum.profile=oval",
            "[drum] profile: expected 'circle', 'wavy', 'lifters', 'harmonics' or 'file', got 'oval'",
        ),
        ("balls.count=0", "[balls] count: must be between 1 and 50000000, got '0'"),
        ("speed", "expected SECTION.KEY=VALUE such as 'rotor.speed=1000 rpm'"),
    ],
)  # fmt: skip
def test_a_wrong_one_is_one_line_and_none_is_told(millsim, order, line):
    result = millsim("--value", "drum.radius=75 mm", "--value", order)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"millsim: --value {order}: {line}\n"


@pytest.mark.parametrize("other", ["deck.ini", "--check", "--set=run.seed=1", "--json"])
def test_nothing_else_is_done_at_the_same_time(millsim, other):
    result = millsim("--value=run.seed=1", other)
    assert result.returncode == 2
    assert re.match("millsim: options? '--value' and '.*' exclude each other: ", result.stderr)


# ---- keys that stand for others: balls.fill, drum.diameter, ...


def count(millsim, *arguments):
    """Balls of the deck as --check prints it."""
    result = millsim("--check", "-q", *arguments)
    assert result.returncode == 0, result.stderr
    section = result.stdout.split("[balls]\n")[1]
    assert "fill" not in section.split("\n\n")[0]
    return int(section.split()[2])


def test_a_fill_is_the_number_of_balls_that_have_this_volume(millsim, write_deck):
    deck = write_deck(SMALL.replace("count = 20", "fill = 12 %"))
    share = 0.12 * math.pi * 0.03**2 * 0.04 / (math.pi / 6 * 0.005**3)
    assert count(millsim, deck) == round(share)


def test_an_override_of_the_fill_replaces_the_count_and_the_other_way_round(millsim, write_deck):
    counted, filled = write_deck(), write_deck(SMALL.replace("count = 20", "fill = 5 %"), "f.ini")
    assert count(millsim, "-s", "balls.fill=5 %", counted) == count(millsim, filled)
    assert count(millsim, "-s", "balls.count=33", filled) == 33


@pytest.mark.parametrize(
    "line, complaint",
    [
        ("count = 20\nfill = 5 %",
         "4: [balls] count: 'count' and 'fill' both set the number of balls; give only one of them"),
        ("fill = 0 %", "4: [balls] fill: must be greater than 0, got '0 %'"),
        ("fill = 1e-6", "4: [balls] fill: gives 0.00173 balls of 0.005 m; expected 1 to 50000000"),
    ],
)  # fmt: skip
def test_a_wrong_fill_is_refused(millsim, write_deck, line, complaint):
    result = millsim("--check", "-q", write_deck(SMALL.replace("count = 20", line)).name)
    assert result.returncode == 2
    assert result.stderr == f"millsim: deck.ini:{complaint}\n"


def test_too_many_balls_by_fill_are_refused_at_the_fill(millsim, write_deck):
    """4.0e7 of each kind: either alone would do."""
    kind = "fill = 5 %\ndiameter = 1.957 mm\ndensity = 7800 kg/m^3\n"
    sizes = "[drum]\nradius = 1 m\nlength = 1 m\n[contact]\nrestitution = 0.8\n"
    deck = f"[run]\ntime = 1 s\n[balls.a]\n{kind}[balls.b]\n{kind}{sizes}"
    result = millsim("--check", "-q", write_deck(deck).name)
    assert result.returncode == 2
    assert result.stderr == "millsim: deck.ini:8: [balls.b] fill: more than 50000000 balls in all\n"


BALL = math.pi / 6 * 0.005**3  # [m^3]
SHAFT = "\n[rotor]\nspeed = 100 rpm\nshaft_radius = 10 mm\n"
FREE = math.pi * (0.03**2 - 0.01**2) * 0.04  # [m^3]
BARE = SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :] + SHAFT


def test_a_mass_is_the_number_of_balls_that_weigh_it(printed, write_deck):
    told = printed(write_deck(SMALL.replace("count = 20", "mass = 20 g")))
    assert told["balls.count"] == str(round(0.02 / (7800 * BALL)))
    assert "balls.mass" not in told


def test_a_bulk_fill_fills_the_free_volume_with_balls_and_voids(printed, write_deck):
    told = printed(write_deck(BARE.replace("count = 20", "bulk_fill = 40 %")))
    assert int(told["balls.count"]) == pytest.approx(0.6 * 0.4 * FREE / BALL, rel=1e-3)


def test_blades_take_room_from_a_bulk_fill(printed, write_deck):
    thick = SMALL.replace("thickness = 4 mm", "thickness = 20 mm").replace("count = 20", "bulk_fill = 40 %")
    assert int(printed(write_deck(thick))["balls.count"]) < 0.97 * 0.6 * 0.4 * math.pi * 0.03**2 * 0.04 / BALL


def test_a_mixture_takes_masses_and_fillings_of_each_kind(printed, write_deck):
    kinds = "[balls.big]\nmass = 30 g\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    kinds += "[balls.small]\nbulk_fill = 10 %\ndiameter = 4 mm\ndensity = 6000 kg/m^3\n"
    text = BARE.replace(BARE[BARE.index("[balls]") : BARE.index("[drum]")], kinds)
    told = printed(write_deck(text))
    assert told["balls.big.count"] == str(round(0.03 / (7800 * BALL)))
    assert int(told["balls.small.count"]) == pytest.approx(0.06 * FREE / BALL * 1.25**3, rel=1e-2)


def test_a_bulk_fill_of_balls_in_a_container_that_is_a_body_needs_no_drum(printed, write_deck):
    jar = "[body.jar]\nshape = cylinder\nside = inside\ndiameter = 60 mm\nlength = 40 mm\n"
    text = BARE.replace("[drum]\nradius = 30 mm\nlength = 40 mm\n", jar).replace(SHAFT, "")
    told = printed(write_deck(text.replace("count = 20", "bulk_fill = 30 %")))
    assert int(told["balls.count"]) == pytest.approx(0.18 * math.pi * 0.03**2 * 0.04 / BALL, rel=2e-3)
    assert told["body.jar.radius"] == "0.03 m"
    assert "body.jar.diameter" not in told


def test_a_tip_speed_is_that_of_the_longest_blade(printed, write_deck):
    told = printed(write_deck(SMALL.replace("speed = 600 rpm", "tip_speed = 3 m/s")))
    assert float(told["rotor.speed"].split()[0]) == pytest.approx(3 / 0.022)
    assert "rotor.tip_speed" not in told


def test_a_tip_speed_is_that_of_the_farthest_corner_of_bodies_on_the_rotor(printed, write_deck):
    bar = "[body.bar]\nshape = box\nmotion = rotor\nsize = 4 6 32 mm\n"
    told = printed(write_deck(BARE.replace("speed = 100 rpm", "tip_speed = -2 m/s") + bar))
    assert float(told["rotor.speed"].split()[0]) == pytest.approx(-2 / math.hypot(0.003, 0.016))


def test_a_tip_speed_of_a_disc_is_that_of_its_rim(printed, write_deck):
    disc = "[body.disc]\nshape = cylinder\nmotion = rotor\naxis = 1 0 0\nradius = 20 mm\nlength = 5 mm\n"
    told = printed(write_deck(BARE.replace("speed = 100 rpm", "tip_speed = 2 m/s") + disc))
    assert float(told["rotor.speed"].split()[0]) == pytest.approx(100, rel=1e-12)


def test_diameters_stand_for_radii_to_the_bit(printed, write_deck):
    radii = printed(write_deck(BARE))
    wide = BARE.replace("shaft_radius = 10 mm", "shaft_diameter = 2 cm").replace("radius = 30 mm", "diameter = 60 mm")
    assert printed(write_deck(wide)) == radii


ONE_OF = "give only one of them"


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ("count = 20", "mass = 1 kg\nbulk_fill = 5 %",
         f"5: [balls] bulk_fill: 'bulk_fill' and 'mass' both set the number of balls; {ONE_OF}"),
        ("radius = 30 mm", "radius = 30 mm\ndiameter = 60 mm",
         f"8: [drum] radius: 'radius' and 'diameter' both set the inner radius of the drum; {ONE_OF}"),
        ("speed = 100 rpm", "speed = 100 rpm\ntip_speed = 1 m/s",
         f"17: [rotor] speed: 'speed' and 'tip_speed' both set the constant speed of the rotor; {ONE_OF}"),
        ("count = 20", "bulk_fill = 105 %", "4: [balls] bulk_fill: must be at most 1, got '105 %'"),
        ("count = 20", "mass = 20", "4: [balls] mass: expected a mass with its unit such as '22 kg', got '20'"),
        ("count = 20", "mass = 1 mg",
         "4: [balls] mass: gives 0.00196 balls of 0.005 m; expected 1 to 50000000"),
        ("speed = 100 rpm", "tip_speed = 1 m/s", "17: [rotor] tip_speed: needs blades, or bodies with "
         "'motion = rotor': their largest distance from the axis is the radius of the tip; without them give 'speed'"),
    ],
)  # fmt: skip
def test_a_wrong_key_that_stands_for_another_is_refused(millsim, write_deck, old, new, complaint):
    result = millsim("--check", "-q", write_deck(BARE.replace(old, new, 1)).name)
    assert result.returncode == 2
    assert result.stderr == f"millsim: deck.ini:{complaint}\n"


def test_overrides_replace_each_other_but_two_at_once_are_refused(printed, millsim, write_deck):
    deck = write_deck(SMALL.replace("count = 20", "fill = 5 %"))
    told = printed("-s", "balls.mass=10 g", "-s", "drum.diameter=6 cm", "-s", "rotor.tip_speed=1 m/s", deck)
    assert told["balls.count"] == str(round(0.01 / (7800 * BALL)))
    assert told["drum.radius"] == "0.03 m"
    both = millsim("--check", "-q", "-s", "balls.mass=10 g", "-s", "balls.count=7", deck)
    assert both.stderr == (
        "millsim: --set balls.count=7: [balls] count: 'count' and 'mass' both set the number of balls; "
        "give only one of them\n"
    )


def test_values_of_keys_that_stand_for_others_are_told_as_given(millsim):
    result = millsim("--value=drum.diameter=15 cm", "--value=rotor.tip_speed=8 m/s", "--value=balls.mass=500 g",
                     "--value=balls.bulk_fill=30 %")  # fmt: skip
    fields = [line.split("\t")[:4] for line in result.stdout.splitlines()]
    assert fields == [
        ["drum.diameter", "number", "0.15", "m"],
        ["rotor.tip_speed", "number", "8", "m/s"],
        ["balls.mass", "number", "0.5", "kg"],
        ["balls.bulk_fill", "number", "0.3", "1"],
    ]


def test_a_deck_that_cannot_be_is_refused_for_itself_and_not_for_its_bulk_fill(millsim, write_deck):
    deck = write_deck(SMALL.replace("count = 20", "bulk_fill = 5 %"))
    result = millsim("--check", "-q", "-s", "blades.tip_radius=31 mm", deck)
    assert result.returncode == 2
    assert result.stderr.count("\n") == 1
    assert "[blades]: leaves the container" in result.stderr
