"""A wrong deck: all its faults at once in the order of its lines, none that only follows from another one, and the
mend of what people type for something that has another name here."""

import re

import pytest
from conftest import SMALL


@pytest.fixture
def faults(refused, write_deck):
    """faults(text, *arguments): the lines of complaint about a deck, without "deck.ini:"."""

    def check(text, *arguments):
        write_deck(text)
        return [line.removeprefix("deck.ini:") for line in refused("deck.ini", *arguments, most=21)]

    return check


def places(lines):
    """What is in front of the text of each line: "3: [run] time" """
    return [re.match(r"(\d+: |--set \S+ |)(\[[^]]*\])?( \w+)?", line.lstrip())[0].strip(" :") for line in lines]


WRONG = """\
[run]
time = 50 s s
seed = 1
seed = 2
[mill]
[balls]
coun = 20
diameter = 5 mm
[drum]
radius = 30 mm
length 40 mm
[contact]
friction = 0.3
[body.lid]
shape = bx
axis = 0 0 0
[output]
frame = 5 ms
"""


def test_all_faults_of_a_deck_are_told_in_the_order_of_its_lines(faults):
    assert places(faults(WRONG, "-s", "gravity.acceleration=1", "-s", "gravity.x=1")) == [
        "2: [run] time",
        "4: [run] seed",
        "5: [mill]",
        "6: [balls] density",
        "7: [balls] coun",
        "11",
        "12: [contact] restitution",
        "15: [body.lid] shape",
        "16: [body.lid] axis",
        "18: [output] frame",
        "--set gravity.x=1: [gravity] x",
        "--set gravity.acceleration=1: [gravity] acceleration",
    ]


def test_checks_of_several_keys_are_told_with_faults_of_other_sections(faults):
    text = SMALL.replace("time = 50 ms", "time = 50 ms\nsample_from = 60 ms").replace("restitution = 0.8", "e = 0.8")
    text = text.replace("shaft_radius = 5 mm", "shaft_radius = 32 mm") + "series = 1e-12 s\n"
    assert places(faults(text)) == [
        "3: [run] sample_from",
        "13: [rotor] shaft_radius",
        "20: [contact] e",
        "24: [output] series",
    ]


def test_a_fault_hides_the_checks_that_need_its_section(faults):
    text = SMALL.replace("radius = 30 mm", "radius = 30 s").replace("diameter = 5 mm", "diameter = 500 mm")
    assert places(faults(text)) == ["8: [drum] radius"]


def test_every_kind_of_ball_has_its_own_fault(faults):
    kind = "[balls.{}]\ncount = 2\ndiameter = 70 mm\ndensity = 7800 kg/m^3\n"
    mixed = SMALL.replace(SMALL[SMALL.index("[balls]") : SMALL.index("[drum]")], kind.format("a") + kind.format("b"))
    assert places(faults(mixed)) == ["5: [balls.a] diameter", "9: [balls.b] diameter"]


def test_several_keys_of_powder_that_a_law_needs_are_told_at_once(faults):
    powder = "[powder]\nmass = 1 g\ndensity = 2 g/cm^3\nlaw = vogel_peukert\ncapture = layer\n"
    keys = ["strength", "size", "layer"]
    assert [place.split()[-1] for place in places(faults(SMALL + powder))] == keys


def test_equal_blades_have_one_fault(faults):
    assert len(faults(SMALL.replace("tip_radius = 22 mm", "tip_radius = 31 mm"))) == 1


def test_a_wrong_shape_of_a_body_is_the_only_fault_of_its_keys(faults):
    body = "[body.pin]\nshape = tube\nradius = 1 mm\nlength = 5 mm\nend_radius = 1 mm\n"
    assert places(faults(SMALL + body)) == ["24: [body.pin] shape"]


def test_a_wrong_profile_does_not_refuse_the_keys_of_buckles(faults):
    text = SMALL.replace("length = 40 mm", "length = 40 mm\nprofile = wave\nbuckles = 5\nbuckle_height = 2 mm")
    assert places(faults(text)) == ["10: [drum] profile"]


@pytest.mark.parametrize("title", ["[ball]", "[balls", "[media]"])
def test_the_keys_of_a_section_that_cannot_be_read_are_not_missed(faults, title):
    assert len(faults(SMALL.replace("[balls]", title))) == 1


def test_sections_that_an_unknown_one_does_not_stand_for_are_missed(faults):
    text = SMALL.replace("[balls]", "[beads]").replace("[contact]\nrestitution = 0.8\nfriction = 0.3\n", "")
    assert places(faults(text)) == ["3: [beads]", "[contact] restitution"]


def test_a_section_may_follow_an_unknown_one_that_stands_for_it(faults):
    assert places(faults("[mill]\nx = 1\n" + SMALL.replace("radius = 30 mm", "radius = 30 s"))) == [
        "1: [mill]",
        "10: [drum] radius",
    ]


@pytest.mark.parametrize("line", ["inner_diameter = 60 mm", "radios = 30 mm", "radius 30 mm", 'radius = "30 mm'])
def test_a_key_that_cannot_be_read_is_not_missing_too(faults, line):
    assert len(faults(SMALL.replace("radius = 30 mm", line, 1))) == 1


def test_of_many_faults_twenty_are_told_and_the_rest_counted(faults):
    lines = faults(SMALL + "".join(f"x{i} = 1\n" for i in range(30)))
    assert places(lines[:20]) == [f"{23 + i}: [output] x{i}" for i in range(20)]
    assert lines[20:] == [" 10 more faults"]
    assert faults(SMALL + "".join(f"x{i} = 1\n" for i in range(21)))[20:] == [" 1 more fault"]


def test_of_very_many_faults_reading_ends_at_a_hundred(faults):
    assert faults(SMALL + "".join(f"x{i} = 1\n" for i in range(3000)))[20:] == [" 80 or more faults"]


# ---- what people type


@pytest.mark.parametrize(
    "section, line, mend",
    [
        ("drum", "inner_diameter = 60 mm", "here it is drum.diameter"),
        ("drum", "Inner Diameter = 60 mm", "here it is drum.diameter"),
        ("rotor", "rpm = 600", "here it is rotor.speed"),
        ("rotor", "v-tip = 8 m/s", "here it is rotor.tip_speed"),
        ("blades", "number = 5", "here it is blades.count"),
        ("balls", "filling = 30 %",
         "here it is balls.bulk_fill (with the voids between the balls; 'fill' is without them)"),
        ("contact", "mu = 0.3", "here it is contact.friction"),
        ("run", "t_end = 1 s", "here it is run.time"),
        ("run", "timestep = 1 us", "millsim has no time step: leave it out"),
        ("drum", "tilt = 10 deg", "here it is gravity.acceleration: turn gravity instead"),
        ("output", "dump_interval = 1 ms", "here it is output.frames"),
    ],
)  # fmt: skip
def test_a_word_of_the_trade_is_told_what_it_is_here(faults, section, line, mend):
    told = faults(SMALL.replace(f"[{section}]\n", f"[{section}]\n{line}\n"))
    assert [one.partition("unknown key; ")[2] for one in told] == [mend]


def test_a_word_of_the_trade_in_a_named_section_is_told_with_its_name(faults):
    kind = "[balls.big]\nweight = 1 kg\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    text = SMALL.replace(SMALL[SMALL.index("[balls]") : SMALL.index("[drum]")], kind)
    assert faults(text) == ["4: [balls.big] weight: unknown key; here it is balls.big.mass"]


@pytest.mark.parametrize("title, here", [("jar", "drum"), ("Vial", "drum"), ("beads", "balls"), ("agitator", "rotor"),
                                         ("pins.a", "body.NAME"), ("simulation", "run")])  # fmt: skip
def test_a_section_of_the_trade_is_told_what_it_is_here(faults, title, here):
    (line,) = faults(SMALL + f"[{title}]\nx = 1\n")
    assert line.startswith(f"23: [{title}]: unknown section; here it is [{here}]")


# ---- numbers and units of data sheets


@pytest.mark.parametrize(
    "key, value, mend",
    [
        ("drum.radius", "37,5 mm", "write 37.5 mm with a decimal point"),
        ("rotor.speed", "664,3 rpm", "write 664.3 rpm with a decimal point"),
        ("contact.restitution", "0,8", "write 0.8 with a decimal point"),
        ("balls.count", "4,000", "write 4000"),
        ("gravity.acceleration", "0, 0, -9.81 m/s^2", None),
        ("gravity.acceleration", "0, 0, -9 m/s^2", "write 0  0  -9 m/s^2 with blanks between the numbers"),
        ("gravity.acceleration", "0,0,-9 m/s^2", "write 0 0 -9 m/s^2 with blanks between the numbers"),
        ("gravity.acceleration", "0,1 0,0 -9,81 m/s^2", "write 0.1 0.0 -9.81 m/s^2 with decimal points"),
        ("drum.radius", "1,234.5 mm", None),
        ("balls.diameter", "3/8 in", "write 0.375 in"),
    ],
)
def test_a_comma_or_fraction_in_a_number_is_told_its_mend(faults, key, value, mend):
    (line,) = faults(SMALL, "-s", f"{key}={value}")
    assert f"got '{value}'" in line
    assert (line.partition("'; ")[2] or None) == mend


@pytest.mark.parametrize(
    "unit", ["rpm", "RPM", "1/min", "min^-1", "min-1", "U/min", "r/min", "rev/min", "min⁻¹", "min–1", "/min"]
)
def test_turns_per_minute_are_read_as_data_sheets_print_them(millsim, unit):
    result = millsim(f"--value=rotor.speed=600 {unit}")
    assert result.returncode == 0, result.stderr
    assert float(result.stdout.split("\t")[2]) == 62.83185307179586


@pytest.mark.parametrize("key", ["rotor.speed", "motion.a.frequency"])
def test_litres_per_minute_are_told_apart_from_one_per_minute(millsim, key):
    result = millsim(f"--value={key}=600 l/min")
    assert result.returncode == 2
    assert result.stderr.endswith("got '600 l/min' (the letter l; with the digit one: 1/min)\n")
