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
    ],
)
def test_a_value_is_told_with_kind_and_unit(told, order, kind, value, unit):
    (line,) = told(order)
    assert line["key"] == order.split("=")[0]
    assert (line["kind"], line["value"], line["unit"]) == (kind, value, unit)
    assert line["meaning"]


def test_only_a_choice_has_words(told):
    profile, radius = told("drum.profile=circle", "drum.radius=1 m")
    assert (profile["choices"], radius["choices"]) == ("circle|wavy", "")


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
        ("drum.profile=oval", "[drum] profile: expected 'circle' or 'wavy', got 'oval'"),
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


# ---- balls.fill


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
