"""A mixture of many kinds of balls: what it costs, and that no impact is lost in the classes of the energies."""

import re
import subprocess

import numpy as np
import pytest
from conftest import PROGRAM

from milltools.base.errors import UserError
from milltools.read import sums
from milltools.read.runfile import Run

SPECIES, CLASSES = 60, 16
DECK = """\
[run]
time = 60 ms
sample_from = 0 s
[drum]
radius = 30 mm
length = 40 mm
[rotor]
speed = 1500 rpm
shaft_radius = 5 mm
[blades]
count = 4
tip_radius = 28 mm
width = 8 mm
thickness = 3 mm
[contact]
restitution = 0.8
friction = 0.2
"""


def mixture(species):
    return DECK + "".join(
        f"[balls.b{k}]\ncount = {1 + k % 2}\ndiameter = {4 + 2 * k / species} mm\ndensity = 7800 kg/m^3\n"
        for k in range(species)
    )


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A run of many kinds of balls: its file, and what the program said."""
    folder = tmp_path_factory.mktemp("species")
    (folder / "deck.ini").write_text(mixture(SPECIES))
    done = subprocess.run([PROGRAM, "deck.ini"], cwd=folder, capture_output=True, text=True, timeout=60, check=True)
    return folder / "deck.h5", done.stderr


@pytest.fixture(scope="module")
def run(made):
    with Run(made[0]) as opened:
        yield opened


def test_what_many_kinds_of_balls_cost_is_said_before_the_run_and_is_little(made):
    path, said = made
    (line,) = [line for line in said.splitlines() if "kinds of balls" in line]
    told = re.search(
        r"of 60 kinds of balls are counted in 16 classes .* (\d+) MB of memory .*; with at most 16 kinds", line
    )
    assert 10 < int(told[1]) < 100
    assert path.stat().st_size < 20e6  # 60 by 60 histograms would be 120 MB


def test_few_kinds_of_balls_are_counted_apart_and_cost_no_word(tmp_path):
    (tmp_path / "deck.ini").write_text(mixture(CLASSES))
    words = [PROGRAM, "-s", "run.time=1 ms", "deck.ini"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True)
    assert "kinds of balls" not in done.stderr
    with Run(tmp_path / "deck.h5") as few:
        assert few.class_of == list(range(CLASSES)) and few.classes == few.as_deck.species
        assert few.read("statistics/energies/ball_ball/normal").shape[:2] == (CLASSES, CLASSES)


def test_classes_hold_all_impacts_and_are_ordered_by_mass(run):
    mass = [one.mass for one in run.as_deck.species]
    assert np.all(np.diff(np.array(run.class_of)[np.argsort(mass)]) >= 0)
    assert np.bincount(run.class_of).max() - np.bincount(run.class_of).min() <= 1
    assert sum(one.count for one in run.classes) == sum(one.count for one in run.as_deck.species)
    assert sum(one.count * one.mass for one in run.classes) == pytest.approx(run.as_deck.mass)
    for kind in run.kinds:
        count = run.statistic(f"impacts/{kind}/count")
        assert run.read(f"statistics/energies/{kind}/normal").sum() == count
        assert sums.total(run, sums.every, kinds=[kind]).value * run.duration == pytest.approx(float(count))
    assert run.statistic("impacts/ball_ball/count") > 50


def test_a_kind_that_shares_its_class_has_no_histogram_of_its_own(run):
    with pytest.raises(UserError, match=r"the impacts of 'b0' are counted together with those of b1, b2, b3$"):
        run.histogram("ball_drum", speed="normal_energy", species="b0")
    assert run.histogram("ball_drum", speed="normal_energy").count.sum() > 100
