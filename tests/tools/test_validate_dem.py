"""make validate-dem: are its checks able to fail, and are kept runs only used again where they may be? Only the last
test needs LIGGGHTS."""

import pathlib
import shutil
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation" / "dem"), str(ROOT / "validation")]

import mills
import parts
import runs
from law import impact

from milltools.dem.model import spring, sticking_restitution

MILL = """\
[run]
time = 0.2 s
sample_from = 0.04 s
[balls]
count = 300
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 40 mm
length = 30 mm
[rotor]
speed = 1500 rpm
shaft_radius = 8 mm
[blades]
count = 2
tip_radius = 32 mm
width = 4 mm
thickness = 5 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.484
[output]
frames = 0 s
"""


@pytest.fixture
def case(tmp_path, monkeypatch):
    """A part of the comparison that keeps its runs in tmp_path and writes them itself instead of LIGGGHTS."""
    monkeypatch.setattr(runs, "KEPT", tmp_path / "build" / "dem")
    monkeypatch.setattr(runs, "ROOT", tmp_path)
    monkeypatch.setattr(runs, "version", lambda: "1.0")
    made = []

    def call(words, what):
        made.append(what)
        words[words.index("-o") + 1].write_text("a run")

    monkeypatch.setattr(runs, "call", call)
    case = runs.DemCase(ROOT / "validation" / "dem", tmp_path)
    case.made = made
    return case


@pytest.fixture
def windows(case, write_deck):
    """windows(**settings): six seeds of a small mill, measured."""
    deck = write_deck(MILL)
    return lambda **settings: [mills.Window(p) for p in case.seeds(6, deck, **settings)]


@pytest.mark.slow
def test_a_mill_is_not_off_itself(windows):
    first, *others = windows()
    for quantity in mills.STEADY:
        verdict = mills.judge(quantity, [first], others)
        assert abs(verdict.off) < 5 * verdict.error, quantity.key


@pytest.mark.slow
def test_a_rotor_that_turns_a_tenth_slower_is_out_of_band(windows):
    first = windows()[0]
    slow = windows(rotor__speed="1350 rpm")
    missed = [
        quantity.key for quantity in mills.STEADY if abs(mills.judge(quantity, [first], slow).off) > quantity.band
    ]
    assert {"power", "kinetic", "rotational", "normal", "ball_1", "ball_2"} <= set(missed)


@pytest.mark.slow
def test_maps_of_a_rotor_that_turns_the_other_way_are_out_of_band(windows):
    one, other = windows(), windows(rotor__speed="-1500 rpm")
    paths = [window.path for window in one]
    off, noise = mills.map_verdict(other[0].path, paths, "cross_section", mills.velocity_off)
    same, _ = mills.map_verdict(paths[0], paths[1:], "cross_section", mills.velocity_off)
    assert off > 1
    assert same < 2 * noise


def test_a_kept_run_is_used_again(case, write_deck):
    deck = write_deck(MILL)
    for _ in range(2):
        case.dem("one", deck, "1e9")
    assert len(case.made) == 1


@pytest.mark.parametrize("change", ("deck", "start", "modulus", "warm-up", "version"), ids=lambda change: change)
def test_a_kept_run_of_anything_else_is_made_anew(case, write_deck, tmp_path, monkeypatch, change):
    start = tmp_path / "start.txt"
    start.write_text("0 0.02 0\n")
    text = MILL.replace("count = 300", f"count = 1\nstart = {start}", 1)
    deck = write_deck(text)
    case.dem("one", deck, "1e9")
    settings, modulus, warm_up = {}, "1e9", None
    if change == "deck":
        settings = {"rotor__speed": "1400 rpm"}
    elif change == "start":
        start.write_text("0 0.021 0\n")
    elif change == "modulus":
        modulus = "1e10"
    elif change == "warm-up":
        warm_up = "1e9"
    else:
        monkeypatch.setattr(runs, "version", lambda: "2.0")
    case.dem("one", deck, modulus, warm_up, **settings)
    assert len(case.made) == 2


def test_a_run_that_failed_is_not_kept(case, write_deck, monkeypatch):
    deck = write_deck(MILL)

    def fail(words, what):
        words[words.index("-o") + 1].write_text("half a run")
        raise RuntimeError("stopped")

    good = runs.call
    monkeypatch.setattr(runs, "call", fail)
    with pytest.raises(RuntimeError):
        case.dem("one", deck, "1e9")
    monkeypatch.setattr(runs, "call", good)
    case.dem("one", deck, "1e9")
    assert len(case.made) == 1


@pytest.fixture
def fine():
    """A contact of two balls and steps so fine that the step does not matter."""
    contact = spring(1e9, 7.0, 0.8, 2.5e-4, 1.25e-3)
    return contact, contact.duration / 4000


def test_the_integrated_law_has_the_restitution_of_the_damped_spring(fine):
    contact, step = fine
    e, _ = impact(contact, 0.3, [0.0, 1.0, 4.0], [1e-6] * 3, 0.02, step)
    assert e == pytest.approx(0.8, rel=1e-3)


def test_a_sticking_contact_of_the_integrated_law_turns_back_as_the_closed_form_says(fine):
    contact, step = fine
    ratio = np.array([0.1, 0.3])  # friction beyond all: the cap does not act where the normal force goes through 0
    _, after = impact(contact, 1e5, ratio, [1e-6] * 2, 0.02, step)
    assert -after / ratio == pytest.approx(sticking_restitution(0.8), abs=2e-3)


@pytest.mark.dem
@pytest.mark.slow
@pytest.mark.thorough
def test_single_impacts_hold_and_are_drawn(tmp_path):
    """The shortest part, whole: 10 s."""
    (tmp_path / "dem").mkdir()
    for deck in (ROOT / "validation" / "dem").glob("*.ini"):
        shutil.copy(deck, tmp_path / "dem")
    found = parts.run_part(
        "dem", "ladder", ("impacts", "isolated"), lambda scratch: runs.DemCase(tmp_path / "dem", scratch)
    )
    assert not found["failure"] and all(claim.as_known for claim in found["claims"])
    assert found["figures"] == sorted(path.name for path in (tmp_path / "dem").glob("*.png")) != []
