"""mill plot draws every run there can be."""

import resource
import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from conftest import ROOT, SMALL
from matplotlib.patches import Polygon

from milltools.figures import FIGURES, overview, style
from milltools.geometry import contour
from milltools.read.runfile import Run


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["contact.restitution=1", "contact.friction=0", "contact.rebound_floor=0 m/s"],
        ["output.frames=0 s"],
        ["run.sample_from=49.9 ms"],
        ["rotor.speed=-600 rpm", "blades.pitch=30 deg"],
    ],
)
@pytest.mark.slow
def test_a_run_becomes_a_picture(millsim, mill, write_deck, tmp_path, options):
    write_deck(SMALL)
    sets = [word for option in options for word in ("-s", option)]
    assert millsim("deck.ini", "-q", *sets).returncode == 0
    done = mill("plot", "deck.h5", "run.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run.png").read_bytes().startswith(b"\x89PNG")


WAVY = SMALL.replace("radius = 30 mm\n", "radius = 30 mm\nprofile = wavy\nbuckles = 12\nbuckle_height = 6 mm\n", 1)


@pytest.mark.slow
def test_a_wavy_drum_is_drawn_along_its_wall(millsim, write_deck, tmp_path):
    write_deck(WAVY)
    assert millsim("deck.ini", "-q").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        figure, wall = overview.draw(run), contour.of(run.as_deck)
    for ax in figure.axes[:2]:
        rim = next(p for p in ax.patches if isinstance(p, Polygon))
        points = rim.get_xy()
        assert abs(wall.gap(points)).max() < 1e-15
        assert len(points) > 100 and np.hypot(*points.T).max() == pytest.approx(0.036)
        assert ax.get_xlim()[1] > 0.036  # all of it is seen


@pytest.mark.slow
def test_a_picture_without_a_known_format_is_one_line(millsim, mill, small_deck):
    assert millsim("deck.ini", "-q").returncode == 0
    done = mill("plot", "deck.h5", "run.mp7")
    assert done.returncode == 2
    assert done.stderr.startswith("mill plot: run.mp7: ")
    assert len(done.stderr.splitlines()) == 1


def test_help_needs_no_matplotlib():
    code = "import sys, milltools.figures.command; sys.exit('matplotlib' in sys.modules or 'numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], env={"PYTHONPATH": str(ROOT / "tools")}).returncode == 0


@pytest.mark.slow
@pytest.mark.unmeasured
def test_a_full_disk_leaves_the_old_picture(millsim, mill, small_deck, tmp_path):
    assert millsim("deck.ini", "-q").returncode == 0
    (tmp_path / "run.png").write_text("old")
    full = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))}
    done = mill("plot", "deck.h5", "run.png", **full)
    assert (done.returncode, done.stderr) == (1, "mill plot: run.png: File too large\n")
    assert (tmp_path / "run.png").read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck.h5", "deck.ini", "run.png"]


def test_a_users_own_layout_of_matplotlib_changes_no_picture(millsim, small_deck, tmp_path):
    assert millsim("deck.ini", "-q").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        plain = style.embedded(FIGURES["section-rate"].draw(run))
        with matplotlib.rc_context({"figure.autolayout": True}):
            own = style.embedded(FIGURES["section-rate"].draw(run))
    assert own == plain


@pytest.mark.slow
def test_a_figure_within_a_page_is_the_same_text_each_time(millsim, small_deck, tmp_path):
    assert millsim("deck.ini", "-q").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        one, two = (style.embedded(overview.draw(run)) for _ in range(2))
    assert one == two and one.startswith("data:image/svg+xml;base64,")
