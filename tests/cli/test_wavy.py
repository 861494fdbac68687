"""The wavy drum, as its user meets it: what the deck takes, and what the mill does."""

import json

import h5py
import numpy as np
import pytest
from conftest import SMALL

SMALL_TIP = SMALL.replace("tip_radius = 22 mm", "tip_radius = 18 mm")
STEEL = "diameter = 5 mm\ndensity = 7800 kg/m^3\n"


def wavy(buckles, height, text=SMALL_TIP, more=""):
    keys = f"profile = wavy\nbuckles = {buckles}\nbuckle_height = {height}\n{more}"
    return text.replace("length = 40 mm\n", "length = 40 mm\n" + keys)


def run_of(millsim, *options):
    done = millsim("deck.ini", "--json", "--quiet", *options)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["run"], done.stderr


# ---- the mill ----


@pytest.mark.parametrize(
    "buckles, height, angle",
    [(2, "6 mm", 0), (3, "1 um", 50), (5, "3 mm", 7), (8, "2 mm", -90), (12, "5 mm", 200)],
)
def test_every_step_holds_against_brute_force(millsim, write_deck, buckles, height, angle):
    write_deck(wavy(buckles, height, more=f"buckle_angle = {angle} deg\n"))
    run, said = run_of(millsim, "--paranoid", "-s", "rotor.speed=1000 rpm")
    assert "all held" in said
    assert run["collisions"]["ball_drum"] > 10
    assert run["largest_overlap"] < 1e-12
    assert run["energy_balance_error"] < 1e-12
    assert run["not_closing"] == run["reliefs"] == run["overlaps"] == 0


@pytest.mark.parametrize("diameter", ["2 mm", "8 mm", "12 mm"])
def test_balls_that_fit_the_buckles_and_such_that_do_not_hold_too(millsim, write_deck, diameter):
    # 14 buckles of 4 mm have arcs of 4.0 mm: those of 8 mm nearly fill them
    text = SMALL_TIP.replace("diameter = 5 mm", f"diameter = {diameter}")
    text = text.replace("count = 20", "count = 8").replace("tip_radius = 18 mm", "tip_radius = 10 mm")
    write_deck(wavy(14, "4 mm", text))
    run, said = run_of(millsim, "--paranoid", "-s", "run.time=150 ms", "-s", "balls.speed=1 m/s")
    assert "all held" in said
    assert run["collisions"]["ball_drum"] > 10
    assert run["overlaps"] == 0


def datasets(path, groups):
    with h5py.File(path) as file:
        found = {}
        file.visititems(
            lambda name, item: (
                found.update({name: np.asarray(item[()]).tobytes()})
                if isinstance(item, h5py.Dataset) and name.split("/")[0] in groups
                else None
            )
        )
    return found


@pytest.mark.slow
def test_buckles_of_no_height_are_the_circle_to_the_bit(millsim, write_deck, tmp_path):
    for name, text in (("circle", SMALL_TIP), ("wavy", wavy(6, "0 mm"))):
        write_deck(text)
        run_of(millsim, "-o", f"{name}.h5")
    groups = ("statistics", "observables", "particles")
    # the outline of a drum with buckles has other triangles, and so its facets have other areas
    circle, wave = (
        {name: value for name, value in datasets(tmp_path / file, groups).items() if "/wear/" not in name}
        for file in ("circle.h5", "wavy.h5")
    )
    assert len(circle) > 100
    assert circle == wave


def impacts(path):
    with h5py.File(path) as file:
        return {key: file[f"impacts/{key}"][()] for key in ("time", "kind", "ball", "position")}


def test_buckles_of_a_nanometre_change_nothing_until_chaos_does(millsim, write_deck, tmp_path):
    for name, text in (("circle", SMALL_TIP), ("wavy", wavy(7, "1e-9 m"))):
        write_deck(text)
        run_of(millsim, "-o", f"{name}.h5", "-s", "output.impacts=all", "-s", "run.time=100ms")
    circle, fine = impacts(tmp_path / "circle.h5"), impacts(tmp_path / "wavy.h5")
    first = slice(0, 40)
    assert len(circle["time"]) > 40
    assert (circle["ball"][first] == fine["ball"][first]).all()
    assert (circle["kind"][first] == fine["kind"][first]).all()
    assert np.allclose(circle["time"][first], fine["time"][first], rtol=0, atol=1e-6)
    assert np.allclose(circle["position"][first], fine["position"][first], rtol=0, atol=1e-5)
    assert circle["time"][0] != fine["time"][0]


@pytest.mark.parametrize("angle, lowest", [(-90, -0.033), (0, -0.027)])
def test_a_ball_falls_into_the_buckle_at_the_bottom_or_onto_the_bulge(millsim, write_deck, tmp_path, angle, lowest):
    # 6 buckles and angle 0: at -90 degrees, halfway between two of them, is a bulge
    text = f"[run]\ntime = 0.1 s\n[balls]\ncount = 1\n{STEEL}start = one.txt\n[drum]\n"
    text += "radius = 30 mm\nlength = 40 mm\n[contact]\nrestitution = 0.5\n"
    text += "[output]\nimpacts = all\nframes = 0 s\n"
    write_deck(wavy(6, "3 mm", text, f"buckle_angle = {angle} deg\n"))
    (tmp_path / "one.txt").write_text("0 0 0\n")
    run_of(millsim, "-o", "one.h5")
    first = impacts(tmp_path / "one.h5")
    fall = np.sqrt(2 * (-lowest - 0.0025) / 9.81)
    assert first["time"][0] == pytest.approx(fall, rel=1e-12)
    assert first["position"][0] == pytest.approx([0, 0, lowest], abs=1e-15)


# ---- the deck ----


def test_the_deck_is_printed_and_stored_with_its_buckles(millsim, write_deck, tmp_path):
    write_deck(wavy(5, "2 mm"))
    printed = millsim("--check", "-q", "deck.ini").stdout
    assert "profile = wavy " in printed
    assert "buckles = 5 " in printed
    assert "buckle_height = 0.002 m " in printed
    assert "buckle_angle = 0 rad " in printed
    write_deck(printed)
    assert millsim("--check", "-q", "deck.ini").stdout == printed
    run_of(millsim, "-o", "stored.h5")
    with h5py.File(tmp_path / "stored.h5") as file:
        assert file["deck/drum/buckles"][()] == b"5"
        assert file["deck/drum/buckle_height"][()] == b"0.002 m"


def test_a_circle_has_no_buckles_to_print(millsim, small_deck):
    assert "buckle" not in millsim("--check", "-q", "deck.ini").stdout


@pytest.mark.parametrize("key", ["buckles", "buckle_height"])
def test_a_wavy_drum_needs_its_number_and_height(refused, write_deck, key):
    text = "".join(line for line in wavy(5, "2 mm").splitlines(True) if not line.startswith(f"{key} ="))
    write_deck(text)
    assert refused("deck.ini").startswith(f"deck.ini:7: [drum] {key}: missing (")


def complaint_of(refused, write_deck, text, *options):
    write_deck(text)
    return refused("deck.ini", *options)


@pytest.mark.parametrize(
    "buckles, height, key, words",
    [
        ("1", "2 mm", "buckles", "must be between 2 and 500, got '1'"),
        ("501", "2 mm", "buckles", "must be between 2 and 500, got '501'"),
        ("5.5", "2 mm", "buckles", "expected a whole number such as"),
        ("5", "-1 mm", "buckle_height", "must be at least 0 m, got '-1 mm'"),
        ("5", "2", "buckle_height", "expected a length with its unit such as '75 mm', got '2'"),
        ("5", "30 mm", "buckle_height", "5 buckles on a radius of 0.03 m must be lower than"),
        (
            "20",
            "8 mm",
            "buckle_height",
            "must be lower than 0.007591 m, or neighbouring ones run into",
        ),
    ],
)
def test_a_wrong_buckle_is_named(refused, write_deck, buckles, height, key, words):
    complaint = complaint_of(refused, write_deck, wavy(buckles, height))
    assert f"[drum] {key}: " in complaint
    assert complaint.startswith("deck.ini:1")
    assert words in complaint


def test_blades_shaft_and_balls_must_clear_the_buckles(refused, write_deck):
    tip = complaint_of(refused, write_deck, wavy(4, "12 mm"))
    assert "[blades]: leaves the container by 0.11 mm at t = 0 s" in tip
    corner = complaint_of(refused, write_deck, wavy(4, "12 mm", SMALL), "-s", "blades.tip_radius=17.9mm")
    assert "[blades]: leaves the container by" in corner
    bare = SMALL[: SMALL.index("[blades]")] + SMALL[SMALL.index("[contact]") :]
    shaft = complaint_of(refused, write_deck, wavy(3, "25 mm", bare))
    assert "[rotor] shaft_radius: must be less than the drum's radius where its wall comes nearest" in shaft
    ball = complaint_of(refused, write_deck, wavy(3, "21 mm", bare))
    assert "does not fit between the shaft and the drum, 0.004 m apart where its wall comes" in ball


def test_a_gap_below_a_ball_under_a_bulge_is_a_warning(millsim, write_deck):
    write_deck(wavy(4, "8 mm"))
    done = millsim("--check", "-q", "deck.ini")
    assert done.returncode == 0
    assert "[blades]: comes as near as 3.9 mm to [drum] at t = 0 s, no more than a ball's diameter" in done.stderr
    write_deck(wavy(4, "6 mm"))
    assert millsim("--check", "-q", "deck.ini").stderr == ""


LIFTERS = "-s", "drum.profile=lifters", "-s", "drum.lifter_height=3 mm", "-s", "drum.lifter_width=3 mm"


@pytest.mark.parametrize("lifters, good", [(6, True), (7, False)])
def test_two_heights_of_lifters_by_turns_need_an_even_number(millsim, small_deck, lifters, good):
    turns = f"drum.lifters={lifters}", "-s", "drum.lifter_second_height=2 mm"
    done = millsim("--check", "deck.ini", *LIFTERS, "-s", *turns)
    assert done.returncode == (0 if good else 2)
    assert good or "[drum] lifter_second_height: needs an even number of lifters, got 7" in done.stderr
