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
from milltools.geometry import bodies, contour, solids, vessel
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


TURNS = WAVY[: WAVY.index("[rotor]")] + (
    "[contact]\nrestitution = 0.8\nfriction = 0.3\n[motion.roll]\nkind = turn\naxis = 1 0 0\nspeed = 300 rpm\n"
    "angle = 10 deg\n"
)


@pytest.fixture
def turning(millsim, write_deck, tmp_path):
    write_deck(TURNS.replace("[drum]\n", "[drum]\nmotion = roll\n"))
    assert millsim("deck.ini", "-q", "-s", "run.time=51 ms", "-s", "run.starts=1").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        yield run


def turned_back(points, angle):
    return points @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@pytest.mark.slow
def test_a_wall_that_turns_is_drawn_as_it_stands_in_the_last_frame_and_as_at_the_start(turning):
    wall, time = contour.of(turning.as_deck), turning.frame_times()[-1]
    panels = overview.draw(turning).axes[:2] + FIGURES["section-rate"].draw(turning).axes[:1]
    for ax, when in zip(panels, (time, 0.0, 0.0)):
        rim = next(p for p in ax.patches if isinstance(p, Polygon))
        points = turned_back(rim.get_xy(), np.radians(10) + 10 * np.pi * when)
        assert np.abs(wall.gap(points)).max() < 1e-8
    assert "he wall turns; it is drawn as at the start" in FIGURES["section-rate"].says([turning])


def test_the_map_of_a_wall_that_turns_is_a_circle(turning):
    holds = vessel.of(turning)
    assert turning.mapped == "" and holds.turns
    for view in ("cross_section", "axial"):
        volume = holds.volume(view, turning.edges(view))
        assert volume.sum() == pytest.approx(np.pi * 0.036**2 * turning.quantity("drum/length"), rel=1e-12)
    ax = FIGURES["section-rate"].draw(turning).axes[0]
    edge = ax.transData.inverted().transform(ax.collections[0].get_clip_path().get_fully_transformed_path().vertices)
    assert np.hypot(*edge.T).min() == pytest.approx(0.036, rel=1e-3)


@pytest.mark.parametrize(
    "changes, frame",
    [
        ({}, ""),
        ({"axis = 1 0 0": "axis = 0 1 0"}, "roll"),
        ({"axis = 1 0 0": "axis = 1 0 0\ncentre = 0 1 0 mm"}, "roll"),
    ],
)
def test_maps_do_not_turn_with_a_drum_that_turns_about_its_own_axis(millsim, write_deck, tmp_path, changes, frame):
    text = TURNS.replace("[drum]\n", "[drum]\nmotion = roll\n")
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    write_deck(text)
    assert millsim("deck.ini", "-q", "-s", "run.time=1 ms", "-s", "run.starts=1").returncode == 0
    with Run(tmp_path / "deck.h5") as run:
        assert run.mapped == frame
        assert run.has("observables/frame_spin/value") == bool(frame)


def test_the_shadow_of_a_star_is_the_star_and_that_of_a_ring_has_a_hole():
    angle = np.pi * np.arange(10) / 5
    star = (1 + np.arange(10) % 2)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    (line,) = bodies.silhouette(solids.prism(star, 0, 1)[..., 1:])
    at = np.flatnonzero((line == star[0]).all(axis=1))[0]
    assert np.array_equal(np.roll(line, -at, axis=0), star)
    ring = solids.prism(2.5 * star[1::2], 0, 1, star[1::2] / 4)
    assert sorted(len(one) for one in bodies.silhouette(ring[..., 1:])) == [5, 5]
