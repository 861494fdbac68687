"""The charge of a tumbling mill in figures, reports, studies and Python, and the ball that a lifter throws."""

import math
import pathlib
import re
import subprocess
import xml.etree.ElementTree as ET

import h5py
import layouts
import numpy as np
import pytest
from conftest import PROGRAM, SMALL, once
from matplotlib.collections import EllipseCollection

import milltools
from milltools import figures
from milltools.base.errors import UserError
from milltools.base.text import degrees
from milltools.figures import FIGURES
from milltools.figures.charge import View
from milltools.geometry.throw import throw
from milltools.read.expression import Expression
from milltools.read.results import Results
from milltools.read.runfile import Run

INPUT = pathlib.Path(__file__).resolve().parents[2] / "input"


def run_millsim(folder, *words):
    subprocess.run([PROGRAM, "-q", *map(str, words)], cwd=folder, check=True, capture_output=True)


@pytest.fixture(scope="module")
def tumbling(tmp_path_factory):
    """The output file of a short run of input/tumbling.ini."""
    sets = ("run.time=3 s", "run.sample_from=1 s", "run.starts=4", "output.frames=500 ms")
    order = [word for one in sets for word in ("-s", one)]
    make = lambda folder: run_millsim(folder, *order, "-o", "mill.h5", INPUT / "tumbling.ini")  # noqa: E731
    return once(tmp_path_factory, "tumbling-charge", make) / "mill.h5"


@pytest.fixture
def run(tumbling):
    with Run(tumbling) as opened:
        yield opened


# ---- the ball that a lifter throws: a mill of 2.5 m at 75 % of the critical speed, balls of 80 mm, lifters of 100 mm

TABLE = {  # face: slips, leaves [degrees from 3 o'clock], speed [m/s], highest place [m], lands, landing speed
    5: (44.5, 70.4, 3.56, 2.28, 202.9, 8.71),
    15: (35.3, 61.2, 3.46, 2.17, 215.1, 9.00),
    25: (24.9, 51.1, 3.34, 2.00, 230.1, 9.21),
    35: (13.4, 40.0, 3.21, 1.76, 248.2, 9.24),
}
OMEGA = 0.75 * math.sqrt(9.81 / 2.5)


@pytest.mark.parametrize("face", TABLE)
def test_a_thrown_ball_has_the_path_of_the_trade(face):
    found = throw(2.5, OMEGA, 0.08, 0.1, math.radians(face), 0.3)
    slips, leaves, lands = (math.degrees(getattr(found, name)) for name in ("slips", "leaves", "lands"))
    told = (slips, leaves, found.speed, found.head, lands, found.landing_speed)
    assert told == pytest.approx(TABLE[face], abs=0.06, rel=0)
    assert [told[k] for k in (2, 3, 5)] == pytest.approx([TABLE[face][k] for k in (2, 3, 5)], abs=0.006, rel=0)


@pytest.mark.parametrize("face", TABLE)
def test_the_path_of_a_thrown_ball_ends_at_the_wall_and_has_no_jump(face):
    path = throw(2.5, OMEGA, 0.08, 0.1, math.radians(face), 0.3).path
    assert np.hypot(*path[0]) == pytest.approx(2.46) and np.hypot(*path[-1]) == pytest.approx(2.46)
    assert np.hypot(*path.T).max() < 2.46 + 1e-9
    assert np.hypot(*np.diff(path, axis=0).T).max() < 0.2


def test_the_flight_of_a_thrown_ball_keeps_its_energy():
    found = throw(2.5, OMEGA, 0.08, 0.1, math.radians(15), 0.3)
    fall = found.head - found.path[-1, 1]
    at_head = found.speed**2 - 2 * 9.81 * (found.head - 2.4 * math.sin(found.leaves))
    assert found.landing_speed**2 == pytest.approx(at_head + 2 * 9.81 * fall, rel=1e-3)


def test_without_lifters_a_ball_leaves_where_it_no_longer_presses_on_the_wall():
    found = throw(2.5, OMEGA, 0.08, face=0.3)
    assert found.leaves == found.slips == pytest.approx(math.pi / 2 - math.acos(0.75**2 * 2.46 / 2.5))
    assert found.speed == pytest.approx(OMEGA * 2.46)
    assert math.degrees(found.lands) == pytest.approx(math.degrees(found.leaves * -3 % math.tau), abs=1e-6)  # Davis


def test_a_ball_beyond_the_critical_speed_is_not_thrown():
    assert throw(2.5, 1.02 * math.sqrt(9.81 / 2.46), 0.08, 0.1, 0.1, 0.3) is None


# ---- runs


def test_no_text_of_the_figure_is_cut_off_and_none_covers_another(run):
    for runs in ([run], [run, run]):
        assert not layouts.faults(FIGURES["charge"].draw(runs))


def test_the_figure_as_inline_svg_stands_alone(run):
    root = ET.fromstring(figures.svg(FIGURES["charge"].draw(run), "figure-charge"))
    assert root.tag.endswith("svg") and "http" not in "".join(root.itertext())


def test_the_figure_marks_toe_and_shoulder_where_the_run_has_them(run):
    figure = FIGURES["charge"].draw(run)
    ax = figure.axes[0]
    said = {text.get_text().split("\n")[0]: text.get_text().split("\n")[1] for text in ax.texts}
    for name in ("toe", "shoulder"):
        angle, error = run.charge[name]
        assert said[name] == str(degrees(angle, error))
    assert all(np.hypot(*text.get_position()) > 1.5 * View(run).radius for text in ax.texts)  # they hide no balls
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert {"half as dense as at its densest", "centre of mass", "dynamic angle of repose"} < set(words)
    ends = [np.array(line.get_xydata()[1]) for line in ax.lines if line.get_linewidth() == 2.5]
    angles = [math.atan2(x, -y) for x, y in ends]
    assert angles == pytest.approx([run.charge["toe"][0], run.charge["shoulder"][0]])


def test_the_figure_shows_all_balls_with_the_rising_side_at_the_right(run):
    (balls,) = (one for one in FIGURES["charge"].draw(run).axes[0].collections if isinstance(one, EllipseCollection))
    places = balls.get_offsets()
    assert len(places) == 100
    seen, view = run.frame(-1, "position").astype(float), View(run)
    # +y to +z is the turn about +x; gravity is along -z: the wall rises at +y
    assert np.allclose(view.axes, [[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    assert sorted(places[:, 0]) == pytest.approx(sorted(seen[:, 1]))


def test_the_map_of_the_figure_has_the_centre_of_mass_of_the_charge(run):
    across, up, _ = View(run).fullness()
    full = run.map("solid_fraction")
    room = np.nan_to_num(full)
    centre = [float((part * room).sum() / room.sum()) for part in (across, up)]
    assert centre == pytest.approx([run.charge["mass_across"][0], run.charge["mass_up"][0]], abs=1.5e-3)


def test_the_caption_tells_of_the_thrown_ball_where_there_are_lifters(run):
    assert "throws" in FIGURES["charge"].says([run])
    found = View(run).thrown()
    assert math.hypot(*found.path[0]) == pytest.approx(0.14)
    assert math.degrees(found.leaves) > 45


@pytest.mark.slow
def test_the_numbers_of_the_figure_are_those_of_python(run, tumbling):
    (table,) = FIGURES["charge"].tables(run)
    with milltools.load(tumbling) as result:
        frame = result.charge
        assert list(frame.index) == list(table.columns["number"])
        assert frame["value"].tolist() == table.columns["value [rad, m or 1]"].tolist()
        assert frame.loc["shoulder", "unit"] == "rad" and frame.loc["mass_up", "unit"] == "m"
        over_time = result.series["charge_mass_across"]
        assert over_time.dims == ("turn",) and over_time.shape == result.series["turn"].shape


def test_expressions_know_the_charge_with_its_errors(run):
    kept = Results.unpack(Results.of(run).pack())
    found = Expression("shoulder").of(kept)
    assert (found.value, found.error) == pytest.approx(run.charge["shoulder"])
    assert Expression("shoulder - 90 deg").of(kept).value == pytest.approx(found.value - math.pi / 2)
    assert Expression("in_flight / power").of(kept).unit == "W-1"


def test_an_expression_of_a_mill_that_does_not_tumble_says_what_is_missing(tmp_path, write_deck):
    run_millsim(tmp_path, "-o", "mill.h5", write_deck(SMALL))
    with Run(tmp_path / "mill.h5") as run, pytest.raises(UserError, match="charge/toe/value"):
        Expression("toe").of(Results.of(run))


@pytest.mark.slow
def test_the_report_has_a_section_of_the_charge(mill, tumbling, tmp_path):
    assert mill("report", tumbling, "-o", "page.html").returncode == 0
    page = (tmp_path / "page.html").read_text()
    assert '<section id="charge">' in page and 'href="#charge"' in page and 'id="figure-charge"' in page
    assert re.search(r"as Morrell counts: \d+\.\d°", page)


@pytest.mark.slow
def test_a_mill_that_does_not_tumble_has_no_word_of_the_charge(mill, tmp_path, write_deck):
    run_millsim(tmp_path, "-o", "mill.h5", write_deck(SMALL))
    assert mill("report", "mill.h5", "-o", "page.html").returncode == 0
    page = (tmp_path / "page.html").read_text()
    assert 'id="charge"' not in page and "#charge" not in page
    told = mill("plot", "mill.h5", "x.png", "--figure", "charge")
    assert told.returncode == 2 and "horizontal axis" in told.stderr


def test_a_file_of_an_older_version_is_read_as_before(mill, tumbling, tmp_path):
    (tmp_path / "old.h5").write_bytes(tumbling.read_bytes())
    with h5py.File(tmp_path / "old.h5", "a") as file:
        del file["statistics/charge"], file["observables/charge"]
    with Run(tmp_path / "old.h5") as old:
        assert old.charge == {} and FIGURES["charge"].why_not(old)
    assert mill("export", "old.h5", "series.csv").returncode == 0


def test_the_series_of_the_charge_are_not_mixed_with_the_others(mill, tumbling, tmp_path):
    assert mill("export", tumbling, "series.csv").returncode == 0
    assert "toe" not in (tmp_path / "series.csv").read_text().splitlines()[0]
