"""The contours of drums and bodies as Python gets them: from the program, or from what a run keeps."""

import math

import h5py
import numpy as np
import pytest
from conftest import SMALL

from milltools.base.errors import UserError
from milltools.geometry import contour
from milltools.read.deck import Deck
from milltools.read.runfile import Run
from milltools.report import facts

R = 0.03
PROFILES = {
    "wavy": "wavy\nbuckles = 5\nbuckle_height = 3 mm\nbuckle_angle = 20 deg",
    "overhanging": "wavy\nbuckles = 12\nbuckle_height = 5 mm",
    "lifters": "lifters\nlifters = 4\nlifter_height = 5 mm\nlifter_width = 6 mm\nlifter_front = 20 deg\n"
    "lifter_back = 30 deg\nlifter_angle = 10 deg",
    "harmonics": "harmonics\nrepeats = 3\nwave_1 = 2 mm\nlean_2 = 0.5 mm",
}


def with_profile(name):
    return SMALL.replace("radius = 30 mm\n", f"radius = 30 mm\nprofile = {PROFILES[name]}\n", 1)


@pytest.fixture
def wall_of(write_deck, the_program):
    return lambda name: contour.of(Deck.check(write_deck(with_profile(name) if name in PROFILES else name)))


@pytest.mark.parametrize("name, n, h", [("wavy", 5, 0.003), ("overhanging", 12, 0.005)])
def test_arcs_of_a_wavy_wall_alternate_have_one_radius_and_join_without_a_corner(wall_of, name, n, h):
    wall = wall_of(name)
    every = np.arange(2 * n)
    assert np.sign(wall.vertices[:, 2]) == pytest.approx(np.tile([1, -1], n))
    assert wall.radius == pytest.approx(np.full(2 * n, wall.radius[0]), rel=1e-12)
    assert np.roll(wall.normals(every, 1.0), 1, axis=0) == pytest.approx(wall.normals(every, 0.0), abs=1e-12)
    assert (wall.innermost, wall.outermost) == pytest.approx((R - h, R + h), rel=1e-14)
    # the polygon of the centres, plus the outer sectors, minus the inner ones
    rho = wall.radius[0]
    area = n * (R**2 - (rho - h) ** 2) * math.sin(math.pi / n) + math.pi * rho**2
    assert wall.area == pytest.approx(area, rel=1e-12)


def test_an_outermost_point_of_a_wavy_wall_is_at_its_angle(wall_of):
    at = (R + 0.003) * np.array([math.cos(math.radians(20)), math.sin(math.radians(20))])
    assert wall_of("wavy").gap([at]) == pytest.approx(0, abs=1e-15)


def test_lifters_stand_on_the_circle_with_the_faces_of_the_deck(wall_of):
    wall = wall_of("lifters")
    assert wall.outermost == pytest.approx(R, rel=1e-14)
    assert wall.innermost == pytest.approx(R - 0.005, rel=1e-14)
    middle, around = (np.array([math.cos(a), math.sin(a)]) for a in (math.radians(10), math.radians(100)))
    top = (R - 0.005) * middle
    inside = np.array([wall.gap([top + way * 0.0029999 * around - 1e-9 * middle])[0] for way in (-1, 1)])
    assert inside == pytest.approx(1e-9, rel=1e-3)  # up to the edges of the top
    for way, angle in ((1, 20), (-1, 30)):  # front: towards larger angles
        face = top + way * 0.003 * around + 0.002 * (middle + math.tan(math.radians(angle)) * way * around)
        assert wall.gap([face]) == pytest.approx(0, abs=1e-12)


def test_a_line_of_waves_is_where_its_sum_says(wall_of):
    wall, angle = wall_of("harmonics"), np.linspace(0, 2 * math.pi, 1000)
    away = R + 0.002 * np.cos(3 * angle) + 0.0005 * np.sin(6 * angle)
    gap = wall.gap(away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    assert np.abs(gap).max() < 2e-3 * 0.002


def test_a_round_drum_and_one_of_no_buckle_height_are_two_half_circles(wall_of):
    flat = SMALL.replace("radius = 30 mm\n", "radius = 30 mm\nprofile = wavy\nbuckles = 5\nbuckle_height = 0 mm\n", 1)
    for text in (SMALL, flat):
        wall = wall_of(text)
        assert wall.circle and wall.innermost == wall.outermost == R
        assert wall.area == pytest.approx(math.pi * R**2, rel=1e-15)
        points = np.random.default_rng(2).uniform(-R, R, (1000, 2))
        assert wall.gap(points) == pytest.approx(R - np.hypot(*points.T), abs=1e-17)


def test_the_gap_of_many_points_is_that_of_each_alone(wall_of):
    wall, points = wall_of("lifters"), np.random.default_rng(3).uniform(-1.2 * R, 1.2 * R, (400, 2))
    assert np.array_equal(wall.gap(points), [wall.gap([p])[0] for p in points])
    fine = wall.flattened(1e-8)
    near = np.array([np.hypot(*(fine - p).T).min() for p in points])
    assert (np.abs(wall.gap(points)) <= near + 1e-15).all()


@pytest.fixture
def run(millsim, write_deck, tmp_path):
    write_deck(with_profile("wavy"))
    assert millsim("deck.ini", "-q", "-s", "run.time=1 ms").returncode == 0
    return tmp_path / "deck.h5"


def test_a_run_knows_its_contour_without_the_program(run, wall_of, monkeypatch):
    wall = wall_of("wavy")
    monkeypatch.setenv("MILLSIM", "no/such/program")
    with Run(run) as opened:
        assert np.array_equal(contour.of(opened.as_deck).vertices, wall.vertices)


def test_a_wavy_run_of_a_version_that_kept_no_contours_has_the_same_one(run, wall_of):
    with h5py.File(run, "r+") as file:
        del file["deck/contour"]
    with Run(run) as opened:
        assert np.array_equal(contour.of(opened.as_deck).vertices, wall_of("wavy").vertices)


@pytest.mark.parametrize(
    "text, line",
    [
        ("# [drum]\n1 2\n", "damaged: contour: '1 2'"),
        ("# [drum]\n1 2 nan\n", "[drum]: expected"),
        ("# [drum]\n1 2 0\n", "[drum]: expected two or more rows"),
    ],
)
def test_a_damaged_contour_of_a_run_is_one_line(run, text, line):
    with h5py.File(run, "r+") as file:
        del file["deck/contour"]
        file["deck/contour"] = text
    with Run(run) as opened, pytest.raises(UserError) as fault:
        contour.of(opened.as_deck)
    assert str(fault.value).startswith(f"{run}: {line}")


@pytest.mark.parametrize(
    "name, words",
    [
        ("wavy", "a wavy drum, 60 mm in mean diameter and 40 mm long inside (5 buckles of 3 mm)"),
        ("lifters", "a drum with lifters, 60 mm in diameter and 40 mm long inside (4 lifters of 5 mm)"),
        ("file", "a drum with a contour of 60 x 60 mm, 40 mm long inside"),
    ],
)
def test_a_page_says_which_wall_the_drum_has(millsim, write_deck, tmp_path, name, words):
    (tmp_path / "round.txt").write_text("0.03 0 1\n-0.03 0 1\n")
    by_file = SMALL.replace("radius = 30 mm\n", "radius = 30 mm\nprofile = file\nfile = round.txt\n", 1)
    write_deck(by_file if name == "file" else with_profile(name))
    assert millsim("deck.ini", "-q", "-s", "run.time=1 ms").returncode == 0
    with Run(tmp_path / "deck.h5") as opened:
        assert facts.mill(opened).replace("\N{NO-BREAK SPACE}", " ").startswith(words)
