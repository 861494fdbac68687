"""The deck: what it may say, and that every mistake in it is named with file, line, section and key."""

import math
import re

import pytest
from conftest import SMALL, SMALL_START

WAVY_ONLY = "belongs to the wavy profile"
MIXTURE = """\
[run]
time = 20 ms
[balls.large]
count = 5
diameter = 6 mm
density = 7800 kg/m^3
[balls.small]
count = 10
diameter = 3 mm
density = 6000 kg/m^3
[drum]
radius = 30 mm
length = 40 mm
[contact]
restitution = 0.8
"""


def set_key(text, section, key, value):
    """The deck with one value changed in place, or one key or section added. Returns (deck, line)."""
    lines = text.splitlines()
    place = lines.index(f"[{section}]") if f"[{section}]" in lines else None
    if place is None:
        lines += [f"[{section}]", f"{key} = {value}"]
        return "\n".join(lines) + "\n", len(lines)
    at = place + 1
    while at < len(lines) and not lines[at].startswith("["):
        if lines[at].split("=")[0].strip() == key:
            lines[at] = f"{key} = {value}"
            return "\n".join(lines) + "\n", at + 1
        at += 1
    lines.insert(at, f"{key} = {value}")
    return "\n".join(lines) + "\n", at + 1


def drop_key(text, section, key):
    """The deck without one key."""
    lines = text.splitlines()
    at = lines.index(f"[{section}]") + 1
    while lines[at].split("=")[0].strip() != key:
        at += 1
    del lines[at]
    return "\n".join(lines) + "\n"


# ---- one wrong value: file, line, section, key, what was expected, what is there ----

WRONG_VALUES = [
    ("drum", "radius", "75", "expected a length with its unit such as '75 mm', got '75'"),
    ("drum", "radius", "", "expected a length with its unit such as '75 mm', got nothing"),
    ("drum", "radius", "wide", "expected a length with its unit such as '75 mm', got 'wide'"),
    ("drum", "radius", "75 mmm", "got '75 mmm' (unknown unit 'mmm')"),
    ("drum", "radius", "7 5 mm", "got '7 5 mm' (unknown unit '5 mm')"),
    ("drum", "radius", "75 mm 2", "got '75 mm 2' (unknown unit 'mm 2')"),
    ("drum", "radius", "nan mm", "expected a length"),
    ("drum", "radius", "1e999 mm", "expected a length"),
    ("drum", "radius", "0x4B mm", "expected a length"),
    ("drum", "radius", "0 mm", "must be between 1e-09 and 10000 m, got '0 mm'"),
    ("drum", "radius", "10.1 km", "must be between 1e-09 and 10000 m, got '10.1 km'"),
    ("drum", "length", "0 m", "must be between 1e-09 and 10000 m"),
    ("drum", "length", "1e9 m", "must be between 1e-09 and 10000 m, got '1e9 m'"),
    ("drum", "length", "4 degC", "expected a length such as '75 mm', got '4 degC'"),
    ("drum", "profile", "square", "expected 'circle', 'wavy', 'lifters', 'harmonics' or 'file', got 'square'"),
    ("drum", "buckles", "6", WAVY_ONLY),
    ("drum", "buckle_height", "5 mm", WAVY_ONLY),
    ("drum", "buckle_angle", "0 deg", WAVY_ONLY),
    ("run", "time", "0 s", "must be greater than 0 s"),
    ("run", "time", "20 mm", "expected a time such as '10 ms', got '20 mm'"),
    ("run", "sample_from", "-1 ms", "must be at least 0 s"),
    ("run", "sample_from", "50 ms", "must be before the end of the run, 0.05 s"),
    ("run", "seed", "-1", "must be between 0 and 4294967295, got '-1'"),
    ("run", "seed", "4294967296", "must be between 0 and 4294967295"),
    ("gravity", "acceleration", "-9.81 m/s^2", "expected three numbers and a unit of acceleration"),
    ("gravity", "acceleration", "0 0 -9.81", "expected three numbers and a unit of acceleration"),
    ("balls", "count", "0", "must be between 1 and 50000000, got '0'"),
    ("balls", "count", "-3", "must be between 1 and 50000000, got '-3'"),
    ("balls", "count", "50000001", "must be between 1 and 50000000"),
    ("balls", "count", "99999999999999999999", "must be between 1 and 50000000"),
    ("balls", "count", "20.5", "expected a whole number such as '4000', got '20.5'"),
    ("balls", "count", "5000", "5000 balls do not fit"),
    ("balls", "diameter", "0 mm", "must be at least 1e-09 m"),
    ("balls", "diameter", "26 mm", "does not fit between the shaft and the drum, 0.025 m apart"),
    ("balls", "diameter", "61 mm", "does not fit"),
    ("balls", "density", "0 kg/m^3", "must be at least 0.001 kg/m^3, got '0 kg/m^3'"),
    ("balls", "density", "7800 kg", "expected a density such as '7800 kg/m^3', got '7800 kg'"),
    ("balls", "speed", "-1 m/s", "must be at least 0 m/s"),
    ("balls", "speed", "1 m", "expected a speed such as '5 mm/s', got '1 m'"),
    ("gravity", "acceleration", "0 0 -1e200 m/s^2", "must be at most 1000000000 m/s^2"),
    ("balls", "density", "1e308 kg/m^3", "must be at most 1000000000 kg/m^3"),
    ("rotor", "speed", "1e300 rpm", "must be at most 1000000000 rad/s"),
    ("balls", "start", "", "expected 'random' or the name of a file, got nothing"),
    ("rotor", "speed", "16 Hz", "expected an angular speed with its unit such as '1000 rpm', got '16 Hz'"),
    ("rotor", "shaft_radius", "-1 mm", "must be at least 0 m"),
    ("rotor", "shaft_radius", "30 mm", "must be less than the drum's radius, 0.03 m"),
    ("rotor", "angle", "30 %", "expected an angle"),
    ("rotor", "angle", "1 rad/s", "expected an angle such as '30 deg', got '1 rad/s'"),
    ("blades", "count", "0", "must be between 1 and 10000"),
    ("blades", "tip_radius", "5 mm", "must be greater than the shaft's radius, 0.005 m, got 0.005 m"),
    ("blades", "thickness", "0 mm", "must be between 1e-09 and 10000 m"),
    ("contact", "restitution", "1.01", "must be between 0 and 1, got '1.01'"),
    ("contact", "restitution", "-0.1", "must be between 0 and 1"),
    ("contact", "restitution", "0.8 m", "expected a plain number such as '0.8', got '0.8 m'"),
    ("contact", "restitution", "80 %", "expected a plain number such as '0.8', got '80 %'"),
    ("contact", "friction", "-0.1", "must be between 0 and 10"),
    ("contact", "friction", "10.1", "must be between 0 and 10"),
    ("contact", "tangential_restitution", "1.1", "must be between -1 and 1"),
    ("contact", "tangential_restitution", "-1.1", "must be between -1 and 1"),
    ("contact", "rebound_floor", "-1 mm/s", "must be between 0 and 10 m/s"),
    ("contact.ball_drum", "restitution", "2", "must be between 0 and 1"),
    ("output", "frames", "-1 ms", "must be at least 0 s"),
    ("output", "frames", "1e-12 s", "too short: more than 1e7 frames"),
    ("output", "series", "0 s", "must be greater than 0 s"),
    ("output", "series", "1e-12 s", "too short: more than 1e8 samples"),
    ("output", "impacts", "some", "expected 'statistics' or 'all', got 'some'"),
    ("output", "strike_window", "-1 us", "must be at least 0 s"),
    ("output", "checkpoint", "0 s", "must be greater than 0 s"),
    ("run", "time", "1e300 s", "must be at most 1000000000 s"),
    ("balls", "speed", "1e300 m/s", "must be at most 1000000000 m/s"),
    ("drum", "radius", "1/0 m", "expected a length"),
    (
        "gravity",
        "acceleration",
        "0 0 -1 g",
        "(g is the gram; the unit 'gravity' is 9.80665 m/s^2: write '0 0 -1 gravity')",
    ),
    ("rotor", "speed", "-1e300 rpm", "must be at least -1000000000 rad/s"),
    ("blades", "count", "10001", "must be between 1 and 10000"),
    ("contact", "rebound_floor", "1e9 m/s", "must be between 0 and 10 m/s, got '1e9 m/s'"),
    ("output", "impacts", "ALL", "expected 'statistics' or 'all', got 'ALL'"),
]


@pytest.mark.parametrize("section, key, value, words", WRONG_VALUES)
def test_a_wrong_value_is_named_with_file_line_section_and_key(refused, write_deck, section, key, value, words):
    text, line = set_key(SMALL, section, key, value)
    write_deck(text)
    complaint = refused("deck.ini")
    assert complaint.startswith(f"deck.ini:{line}: [{section}] {key}: ")
    assert words in complaint


@pytest.mark.parametrize("section, key, value, words", WRONG_VALUES[::40])
def test_a_wrong_override_is_named_as_given(refused, small_deck, section, key, value, words):
    order = f"{section}.{key}={value}"
    complaint = refused("deck.ini", "--set", order)
    assert complaint.startswith(f"--set {order}: [{section}] {key}: ")
    assert words in complaint


def test_the_contracts_example_reads_as_promised(refused, write_deck):
    text, _ = set_key(SMALL, "drum", "radius", "75 s")
    write_deck(text, "simoloyer.ini")
    expected = "simoloyer.ini:8: [drum] radius: expected a length such as '75 mm', got '75 s'"
    assert refused("simoloyer.ini") == expected


# ---- structure ----


STRUCTURE = {
    "an unknown section": (SMALL.replace("[drum]", "[durm]"), "7: [durm]: unknown section; did you mean [drum]?"),
    "one without keys": (SMALL + "[hopper]\n", "23: [hopper]: unknown section"),
    "another case": (SMALL.replace("[drum]", "[Drum]"), "7: [Drum]: unknown section; did you mean [drum]?"),
    "an unknown key": (
        SMALL.replace("tip_radius", "tipradius"),
        "15: [blades] tipradius: unknown key; did you mean 'tip_radius'?",
    ),
    "a key of another section": (
        set_key(SMALL, "run", "restitution", "0.8")[0],
        "3: [run] restitution: unknown key; 'restitution' belongs to [contact]",
    ),
    "a key twice": (
        SMALL.replace("count = 20\n", "count = 20\ncount = 20\n"),
        "5: [balls] count: the key is given twice (first in line 4)",
    ),
    "a section twice": (SMALL + "[drum]\n", "23: [drum]: the section is given twice (first in line 7)"),
    "a key before all sections": ("time = 1 s\n" + SMALL, "1: time: stands before the first [section]"),
    "quotes around a number": (
        set_key(SMALL, "drum", "radius", '"30 mm"')[0],
        "8: [drum] radius: double quotes are only allowed around the name of a file",
    ),
    "blades without a rotor": (
        SMALL.replace("[rotor]\nspeed = 600 rpm\nshaft_radius = 5 mm\n", ""),
        "10: [blades]: blades need a section [rotor] that carries them",
    ),
}


@pytest.mark.parametrize("name", STRUCTURE)
def test_sections_and_keys_out_of_place_are_refused_with_line_and_mend(refused, write_deck, name):
    text, expected = STRUCTURE[name]
    write_deck(text)
    assert refused("deck.ini") == f"deck.ini:{expected}"


def test_an_unknown_kind_of_contact_is_refused(refused, write_deck):
    write_deck(SMALL + "[contact.ball_lid]\nfriction = 0\n")
    complaint = refused("deck.ini")
    assert complaint.startswith("deck.ini:23: [contact.ball_lid]: unknown kind of contact")
    assert "ball_blade" in complaint


@pytest.mark.parametrize(
    "line, words",
    [
        ("radius", "expected '[section]' or 'key = value', got 'radius'"),
        ("= 5 mm", "there is no key in front of '='"),
        ("[output", "the closing ']' of the section is missing"),
        ("[output] series = 1 ms", "unexpected text after the ']' of the section"),
        ('start = "half', "the closing '\"' of the value is missing"),
        ('start = "a" b', "unexpected text after the closing '\"' of the value"),
    ],
)
def test_a_line_that_is_no_deck_line_is_refused(refused, write_deck, line, words):
    write_deck(SMALL + line + "\n")
    complaint = refused("deck.ini")
    assert complaint.startswith("deck.ini:23: ")
    assert words in complaint


REQUIRED = [
    ("run", "time", "end of the run", 1),
    ("balls", "count", "number of balls", 3),
    ("balls", "diameter", "of a ball", 3),
    ("balls", "density", "material", 3),
    ("drum", "radius", "inner radius", 7),
    ("drum", "length", "inner length", 7),
    ("rotor", "speed", "speed of the rotor", 10),
    ("rotor", "shaft_radius", "radius of the shaft", 10),
    ("blades", "count", "number of equal blades", 13),
    ("blades", "tip_radius", "from the axis", 13),
    ("blades", "width", "along the axis", 13),
    ("blades", "thickness", "around the axis", 13),
    ("contact", "restitution", "coefficient of restitution", 18),
]


@pytest.mark.parametrize("section, key, meaning, line", REQUIRED)
def test_a_missing_key_is_named_with_its_section_and_meaning(refused, write_deck, section, key, meaning, line):
    write_deck(drop_key(SMALL, section, key))
    complaint = refused("deck.ini")
    assert complaint.startswith(f"deck.ini:{line}: [{section}] {key}: missing (")
    assert meaning in complaint
    assert "expected a" in complaint


def test_a_missing_section_is_named_by_its_required_keys(refused, write_deck):
    write_deck(SMALL.replace("[drum]\nradius = 30 mm\nlength = 40 mm\n", ""))
    first, second = refused("deck.ini", most=2)
    assert first == (
        "deck.ini: [drum] radius: missing (inner radius of the drum); expected a length such as '75 mm', or 'diameter'"
    )
    assert second.startswith("deck.ini: [drum] length: missing (inner length of the drum)")


@pytest.mark.parametrize("frames, gigabytes", [("0.4 us", "0.09"), ("5.1 ns", "7.06")])
def test_many_frames_are_warned_of_and_too_many_refused(millsim, refused, write_deck, frames, gigabytes):
    write_deck()
    order = f"output.frames={frames}"
    done = millsim("--check", "-q", "deck.ini", "-s", order)
    assert (done.returncode, done.stderr.count("\n")) == (0, 1)
    assert done.stderr.startswith(f"millsim: warning: --set {order}: [output] frames: ")
    assert f" {gigabytes} GB" in done.stderr
    assert millsim("--check", "-q", "deck.ini", "-s", "output.frames=0.6 us").stderr == ""
    complaint = refused("deck.ini", "-s", "output.frames=4.9 ns")
    assert "too short: more than 1e7 frames until 0.05 s (7.35 GB of ball states)" in complaint


def test_names_and_lines_may_be_long(millsim, refused, write_deck):
    name, folder = 63 * "n", 60 * "long/"
    text = MIXTURE.replace("[balls.small]", f"[balls.{name}]")
    write_deck(text + f"[balls]\nstart = {folder}end.txt\n")
    assert f"{folder}end.txt': No such file" in refused("deck.ini")
    write_deck(text)
    assert f"[balls.{name}]" in millsim("--check", "-q", "deck.ini").stdout
    write_deck(text.replace(name, name + "n"))
    assert "the name is longer than 63 characters" in refused("deck.ini")


@pytest.mark.parametrize("key", ["position", "angle", "tip_radius", "width", "thickness"])
def test_a_single_blade_needs_all_but_its_pitch(refused, write_deck, key):
    blade = {
        "position": "0 mm",
        "angle": "0 deg",
        "tip_radius": "20 mm",
        "width": "6 mm",
        "thickness": "4 mm",
    }
    del blade[key]
    write_deck(SMALL + "[blade.a]\n" + "".join(f"{k} = {v}\n" for k, v in blade.items()))
    assert refused("deck.ini").startswith(f"deck.ini:23: [blade.a] {key}: missing (")


# ---- what does not fit together ----


def test_a_single_blade_without_a_rotor_is_refused(refused, write_deck):
    blade = "[blade.a]\nposition=0 m\nangle=0 deg\ntip_radius=20 mm\nwidth=6 mm\nthickness=4 mm\n"
    write_deck(SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :] + blade)
    assert "[blade.a]: blades need a section [rotor]" in refused("deck.ini")


def test_a_pitched_blade_is_measured_as_turned(millsim, refused, write_deck):
    # at -L/2 + 4 mm a blade 6 mm wide and 4 mm thick stays inside at 0 and 90 deg;
    # at 60 deg it is 3 sin 30 + 2 sin 60 = 3.23 mm long each way, at 30 deg 3.60 mm
    blade = "[blade.a]\nposition = {} mm\nangle = 90 deg\ntip_radius = 20 mm\n"
    blade += "width = 6 mm\nthickness = 4 mm\npitch = 30 deg\n"
    write_deck(SMALL + blade.format(-16.39))
    assert millsim("--check", "-q", "deck.ini").returncode == 0
    write_deck(SMALL + blade.format(-16.41))
    complaint = refused("deck.ini")
    assert complaint.startswith("deck.ini:23: [blade.a]: leaves the container by 0.00")


def test_a_pitched_blades_corners_may_not_leave_the_drum(millsim, refused, write_deck):
    # pitched by 90 deg the width lies around the axis: corners at hypot(29, 9) = 30.4 mm
    text, _ = set_key(SMALL, "blades", "tip_radius", "29 mm")
    text, _ = set_key(text, "blades", "width", "18 mm")
    write_deck(text)
    assert millsim("--check", "-q", "deck.ini").returncode == 0
    text, _ = set_key(text, "blades", "pitch", "90 deg")
    write_deck(text)
    assert refused("deck.ini").startswith("deck.ini:13: [blades]: leaves the container by 0.36 mm at t = 0 s")


@pytest.mark.parametrize(
    "key, value, by", [("tip_radius", "30 mm", 0.067), ("tip_radius", "29.99 mm", 0.057), ("width", "20.1 mm", 0.05)]
)
def test_a_blade_that_leaves_the_drum_is_told_by_how_much(refused, write_deck, key, value, by):
    write_deck(set_key(SMALL, "blades", key, value)[0])
    expected = f"deck.ini:13: [blades]: leaves the container by {by} mm at t = 0 s: make it smaller, or move it"
    assert refused("deck.ini") == expected


def test_blades_may_fill_the_drums_length_exactly(millsim, write_deck):
    for count, width in [(2, "20 mm"), (3, "13.33333333333333 mm"), (7, "5.714285714285714 mm")]:
        text, _ = set_key(SMALL, "blades", "width", width)
        text, _ = set_key(text, "blades", "count", count)
        write_deck(text)
        assert millsim("--check", "-q", "deck.ini").returncode == 0


def test_a_gap_below_a_ball_is_a_warning(millsim, write_deck):
    write_deck(set_key(SMALL, "blades", "tip_radius", "26 mm")[0])
    result = millsim("--check", "-q", "deck.ini")
    assert result.returncode == 0
    assert result.stderr == (
        "millsim: warning: deck.ini:13: [blades]: comes as near as 3.9 mm to [drum] at t = 0 s, no more than a ball's "
        "diameter of 5 mm: balls can be pinched there\n"
    )


def test_a_gap_of_more_than_a_ball_is_no_warning(millsim, small_deck):
    assert millsim("--check", "-q", "deck.ini").stderr == ""


def test_a_ball_longer_than_the_drum_is_refused(refused, write_deck):
    text, _ = set_key(SMALL, "drum", "length", "14 mm")
    text, line = set_key(text, "balls", "diameter", "15 mm")
    write_deck(text)
    expected = f"deck.ini:{line}: [balls] diameter: a ball of 0.015 m does not fit"
    assert refused("deck.ini").startswith(expected)


def test_a_start_file_excludes_a_speed(refused, write_deck):
    text, _ = set_key(SMALL, "balls", "start", "start.txt")
    text, line = set_key(text, "balls", "speed", "1 m/s")
    write_deck(text)
    assert refused("deck.ini").startswith(f"deck.ini:{line}: [balls] speed: is for a random start only")


def test_a_fault_in_a_default_is_named_as_such(refused, write_deck):
    text, _ = set_key(SMALL, "run", "time", "2e5 s")
    text, _ = set_key(text, "output", "frames", "1 s")
    write_deck(text)
    assert refused("deck.ini").startswith("deck.ini:21: [output] series (default 1 ms): too short")


# ---- mixtures and single blades ----


READ = {
    "a mixture kind by kind": (
        MIXTURE + "[balls]\nspeed = 2 m/s\n",
        {"balls.large.diameter": "0.006 m", "balls.small.count": "10", "balls.count": None, "balls.speed": "2 m/s"},
    ),
    "names that differ in case": (
        MIXTURE.replace("[balls.small]", "[balls.Large]"),
        {"balls.large.count": "5", "balls.Large.count": "10"},
    ),
    "equal blades and a single one": (
        SMALL + "[blade.a]\nposition=0 m\nangle=0 deg\ntip_radius=20 mm\nwidth=6 mm\nthickness=4 mm\n",
        {"blades.count": "2", "blade.a.pitch": "0 rad"},
    ),
    "a law of a kind of contact, the rest from the general one": (
        SMALL + "[contact.ball_drum]\nfriction = 0.5\n",
        {"contact.ball_drum.friction": "0.5", "contact.ball_drum.restitution": "0.8", "contact.friction": "0.3"},
    ),
}


@pytest.mark.parametrize("name", READ)
def test_sections_with_names_are_read(printed, write_deck, name):
    text, expected = READ[name]
    write_deck(text)
    values = printed("deck.ini")
    assert {key: values.get(key) for key in expected} == expected


DEFAULTS = """\
run.seed = 1
run.starts = 1
run.hard_impact = auto
run.spheres = hard
gravity.acceleration = 0 0 -9.81 m/s^2
balls.start = random
balls.speed = 0 m/s
drum.ends = walls
drum.profile = circle
contact.friction = 0
contact.tangential_restitution = 0
contact.rebound_floor = auto
output.frames = 0.01 s
output.series = 0.001 s
output.impacts = statistics
output.strike_window = auto
output.checkpoint = 60 s
"""


def test_defaults_are_those_of_the_contract_and_nothing_else_is_printed(printed, write_deck):
    values = printed(write_deck(MIXTURE))
    wanted = dict(line.split(" = ") for line in DEFAULTS.splitlines())
    assert {key: values.get(key) for key in wanted} == wanted
    assert len(values) == MIXTURE.count("=") + len(wanted)


@pytest.mark.parametrize("key, value", [("count", 5), ("diameter", "1 mm"), ("density", "1 kg/m^3")])
def test_a_mixture_leaves_no_balls_in_the_plain_section(refused, write_deck, key, value):
    write_deck(MIXTURE + f"[balls]\n{key} = {value}\n")
    expected = f"deck.ini:17: [balls] {key}: belongs in the sections [balls.NAME] of this mixture"
    assert refused("deck.ini") == expected


def test_a_mixtures_total_is_bounded(refused, write_deck):
    text = MIXTURE.replace("count = 5", "count = 50000000").replace("6 mm", "1 um")
    write_deck(text.replace("3 mm", "1 um"))
    assert "[balls.small] count: more than 50000000 balls in all" in refused("deck.ini")


@pytest.mark.parametrize("title", ["balls.", "balls.a b", "balls..", "blade.a/b", "blade.-", "balls." + 64 * "x"])
def test_a_bad_name_is_refused(refused, write_deck, title):
    write_deck(MIXTURE + f"[{title}]\n")
    assert refused("deck.ini").startswith("deck.ini:16: [bal" if "balls" in title else "deck.ini:16: [bla")


# ---- units, numbers, white space ----


SPELT = {
    ("drum", "radius", "0.03 m"): "30 mm|30mm|+30 mm|3 cm|3.e1 mm|.3e2 mm|3e-2 m|0.03 metre|30e3 µm",
    ("balls", "density", "7800 kg/m^3"): "7800 kg/m^3|7800 kg/m3|7800 kg m-3|7.8 g/cm^3|7.8 t/m3",
    ("gravity", "acceleration", "0 0 -9.81 m/s^2"): "0  0\t-9.81 m/s2|0 0 -981 cm/s^2|0 0 -9.81 m.s-2",
    ("rotor", "speed", "0 rad/s"): "0 rpm",
    ("run", "seed", "4294967295"): "4294967295",
}


@pytest.mark.parametrize("place, value", [(place, value) for place in SPELT for value in SPELT[place].split("|")])
def test_a_value_may_be_spelt_in_many_ways(printed, write_deck, place, value):
    section, key, expected = place
    write_deck(set_key(SMALL, section, key, value)[0])
    assert printed("deck.ini")[f"{section}.{key}"] == expected


@pytest.mark.parametrize(
    "unit", ["-30 rpm", "180 deg/s", "0.5 revolution/s", "0.5 rev/s", "30 rev/min", "180 degree s-1"]
)
def test_an_angular_speed_may_be_spelt_in_many_ways(printed, write_deck, unit):
    write_deck(set_key(SMALL, "rotor", "speed", unit)[0])
    speed = math.pi * (-1 if unit.startswith("-") else 1)
    assert float(printed("deck.ini")["rotor.speed"].split()[0]) == pytest.approx(speed, rel=1e-15)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: "\ufeff" + text,
        lambda text: text.rstrip("\n"),
        lambda text: text.replace(" = ", "\t=\t"),
        lambda text: text.replace("\n", "\n    "),
        lambda text: text.replace(" = ", "="),
        lambda text: text.replace("\n", "   # remark\n"),
        lambda text: text.replace("\n", "\t; remark = [5]\n"),
        lambda text: "# remark\n; remark\n\n" + text.replace("[", "\n["),
        lambda text: text.replace("[drum]", "# " + 5000 * "long " + "\n[drum]"),
    ],
    ids=[
        "crlf",
        "bom",
        "no newline",
        "tabs",
        "indented",
        "tight",
        "#",
        ";",
        "comment lines",
        "long comment",
    ],
)
def test_white_space_and_comments_make_no_difference(millsim, write_deck, change):
    write_deck()
    plain = millsim("--check", "-q", "deck.ini")
    write_deck(change(SMALL))
    changed = millsim("--check", "-q", "deck.ini")
    assert changed.returncode == 0, changed.stderr
    assert changed.stdout == plain.stdout


def test_a_deck_of_usual_units_needs_no_database_and_another_says_where_it_was_sought(millsim, write_deck):
    nowhere = {"UDUNITS2_XML_PATH": "/nowhere.xml"}
    write_deck()
    assert millsim("--check", "-q", "deck.ini", env=nowhere).returncode == 0
    fathom = millsim("--check", "-q", "-s", "drum.length=3 fathom", "deck.ini", env=nowhere)
    assert fathom.returncode == 2
    said = r"\[drum\] length: cannot read the unit database .* at .*/nowhere.xml; install"
    assert re.search(said, fathom.stderr)


def test_the_locale_makes_no_difference(millsim, small_deck):
    german = millsim("--check", "-q", "deck.ini", env={"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"})
    assert german.stdout == millsim("--check", "-q", "deck.ini").stdout


def test_sections_may_come_in_any_order(millsim, write_deck):
    write_deck()
    plain = millsim("--check", "-q", "deck.ini").stdout
    sections = ["[" + part for part in SMALL.split("[")[1:]]
    write_deck("".join(reversed(sections)))
    assert millsim("--check", "-q", "deck.ini").stdout == plain


def test_blanks_within_the_brackets_of_a_section_do_not_count(millsim, write_deck):
    write_deck()
    plain = millsim("--check", "-q", "deck.ini").stdout
    write_deck(SMALL.replace("[drum]", "[ drum\t]"))
    assert millsim("--check", "-q", "deck.ini").stdout == plain


# ---- files that are no decks ----


@pytest.mark.parametrize(
    "content, words",
    [
        (b"", "deck.ini: the deck is empty"),
        (b"# nothing\n\n", "deck.ini: the deck is empty"),
        (b"[run]\ntime = 1\0 s\n", "deck.ini:2: holds the control character 0x00"),
        (b"\x7fELF\x02\x01\x01\0\0", "deck.ini:1: holds the control character"),
        ("[run]\n".encode("utf-16"), "deck.ini:1: "),
        (b"[run]\rtime = 1 s\r", "deck.ini:1: holds the control character 0x0d"),
        (b"\x89HDF\r\n\x1a\n", "deck.ini:2: holds the control character 0x1a"),
        (b"\xff\xfe\xfd\xfc" * 50, "deck.ini:1: expected"),
    ],
    ids=["empty", "comments", "NUL", "ELF", "UTF-16", "CR only", "HDF5", "bytes"],
)
def test_a_file_that_is_no_deck_is_refused(refused, write_deck, content, words):
    write_deck(content)
    assert refused("deck.ini").startswith(words)


def test_a_folder_is_no_deck(refused, tmp_path):
    (tmp_path / "deck.ini").mkdir()
    assert refused("deck.ini", status=1) == "deck.ini: cannot be read: Is a directory"


def test_a_missing_deck_is_named(refused):
    assert refused("none.ini", status=1) == "none.ini: cannot be read: No such file or directory"


# ---- --set ----


@pytest.mark.parametrize(
    "orders, key, value",
    [
        (["-s", "drum.radius=35mm"], "drum.radius", "0.035 m"),
        (["-s", "run.seed=7"], "run.seed", "7"),  # not in the deck
        (["-s", "contact.ball_wall.friction=0"], "contact.ball_wall.friction", "0"),  # nor its section
        (["-s", "run.seed=7", "--set=run.seed=8"], "run.seed", "8"),
        (["-s", "drum.length=30 mm"], "drum.length", "0.03 m"),  # wrong in the deck
    ],
)
def test_the_last_override_of_a_value_counts(printed, write_deck, orders, key, value):
    text = SMALL if key != "drum.length" else set_key(SMALL, "drum", "length", "30 s")[0]
    assert printed(write_deck(text), *orders)[key] == value


def test_an_override_may_have_spaces_and_equals_signs(printed, small_deck, tmp_path):
    (tmp_path / "a = b.txt").write_text(SMALL_START)
    values = printed("deck.ini", "-s", "balls.start=a = b.txt")
    assert values["balls.start"] == f"{tmp_path}/a = b.txt"


@pytest.mark.parametrize(
    "order, words",
    [
        ("drum.radius", "expected SECTION.KEY=VALUE"),
        ("radius=5 mm", "expected SECTION.KEY=VALUE"),
        (".radius=5 mm", "expected SECTION.KEY=VALUE"),
        ("durm.radius=5 mm", "[durm]: unknown section; did you mean [drum]?"),
        ("drum.radios=5 mm", "[drum] radios: unknown key; did you mean 'radius'?"),
        ("drum.radius=", "got nothing"),
    ],
)
def test_a_wrong_override_is_refused(refused, small_deck, order, words):
    complaint = refused("deck.ini", "--set", order)
    assert complaint.startswith(f"--set {order}: ")
    assert words in complaint


# ---- --check prints a deck ----


def fixed_point(millsim, tmp_path, deck, *arguments):
    first = millsim("--check", "-q", deck, *arguments)
    assert first.returncode == 0, first.stderr
    (tmp_path / "full.ini").write_text(first.stdout)
    second = millsim("--check", "-q", "full.ini")
    assert second.returncode == 0, second.stderr
    assert second.stdout == first.stdout
    return first.stdout


@pytest.mark.parametrize("name", ["simoloyer.ini", "gas.ini", "single.ini"])
def test_a_checked_deck_of_input_checks_to_itself(millsim, tmp_path, root, name):
    fixed_point(millsim, tmp_path, root / "input" / name)


def test_a_checked_mixture_checks_to_itself(millsim, tmp_path, write_deck):
    write_deck(MIXTURE + "[contact.ball_wall]\nfriction = 0.1\n[balls]\nspeed = 0.3 m/s\n")
    fixed_point(millsim, tmp_path, "deck.ini")


def test_checked_numbers_keep_their_bits(millsim, tmp_path, small_deck):
    orders = [
        "rotor.speed=777.7 rpm",
        "rotor.angle=33.3 deg",
        "drum.radius=30.1 mm",
        "run.time=0.1 min",
    ]
    orders += ["balls.density=0.3 lb/inch^3", "blades.pitch=-7 deg", "output.strike_window=3.3 us"]
    fixed_point(millsim, tmp_path, "deck.ini", *(f"--set={order}" for order in orders))


@pytest.mark.parametrize("folder", ["plain", "run #3; b", "with 'quotes' \"too\"", 40 * "long/" + "end"])
def test_a_start_file_is_found_again_wherever_the_deck_lies(millsim, tmp_path, write_deck, folder):
    (tmp_path / folder).mkdir(parents=True)
    text, _ = set_key(SMALL, "balls", "start", "start file.txt")
    write_deck(text, f"{folder}/deck.ini")
    (tmp_path / folder / "start file.txt").write_text(SMALL_START)
    out = fixed_point(millsim, tmp_path, f"{folder}/deck.ini")
    assert "start file.txt" in out
    assert str(tmp_path) in out


def test_a_file_name_may_hold_a_hash_but_after_a_blank_only_in_quotes(printed, refused, write_deck, tmp_path):
    write_deck(set_key(SMALL, "balls", "start", "a#1;b c.txt  # remark")[0])
    (tmp_path / "a#1;b c.txt").write_text(SMALL_START)
    assert printed("deck.ini")["balls.start"] == f"{tmp_path}/a#1;b c.txt"
    for name in ("a #1;b c.txt", "#1.txt"):
        write_deck(set_key(SMALL, "balls", "start", name)[0])
        assert refused("deck.ini").endswith("a comment: put a name with ' #' or ' ;' in double quotes")


def test_every_value_of_a_checked_deck_is_explained(millsim, small_deck):
    out = millsim("--check", "-q", "deck.ini").stdout
    values = [line for line in out.splitlines() if " = " in line and not line.startswith("#")]
    assert len(values) > 25
    assert all(re.search(r" # \w.{3,}$", line) for line in values)
