"""The cross-section of the drum in Python: the wavy profile from its formula, and the circle."""

import math

import numpy as np
import pytest

from milltools.base.errors import UserError
from milltools.geometry.profile import Profile

R = 0.075
SHAPES = [(n, h) for n in (2, 3, 5, 8, 13, 20) for h in (1e-9, 1e-4, 4e-3, 10e-3)]


@pytest.fixture(params=SHAPES, ids=lambda shape: f"n={shape[0]} h={1e3 * shape[1]:g}mm")
def wavy(request):
    return Profile(R, *request.param, angle=0.3)


def test_arcs_alternate_and_each_begins_where_the_last_ends_in_the_same_direction(wavy):
    arcs = wavy.arcs()
    assert [arc.turn > 0 for arc in arcs] == [True, False] * wavy.buckles
    for arc, after in zip(arcs, arcs[1:] + arcs[:1]):
        assert after.point(0) == pytest.approx(arc.point(1), abs=1e-15)
        ends = [(np.cos(a), np.sin(a)) for a in (arc.start + arc.turn, after.start + math.pi)]
        # two circles of opposite bulge that share a point and its normal are tangent
        assert ends[0] == pytest.approx(ends[1], abs=1e-11)
        assert math.dist(arc.centre, after.centre) == pytest.approx(2 * arc.radius, rel=1e-14)


def test_the_wall_reaches_from_r_less_h_to_r_plus_h(wavy):
    radii = [np.hypot(*arc.point([0.0, 0.5, 1.0]).T) for arc in wavy.arcs()]
    for arc, (start, middle, end) in zip(wavy.arcs(), radii):
        assert middle == pytest.approx(wavy.outermost if arc.turn > 0 else wavy.innermost, abs=2e-16 * 10)
        assert wavy.innermost - 1e-16 <= min(start, end) <= max(start, end) <= wavy.outermost
    assert (wavy.innermost, wavy.outermost) == (R - wavy.height, R + wavy.height)
    angles = [np.arctan2(*wavy.arcs()[k].point(0.5)[::-1]) for k in (0, 1)]
    assert angles[0] == pytest.approx(0.3, abs=1e-12)  # an outermost point at buckle_angle
    assert (angles[1] - angles[0]) % (2 * math.pi) == pytest.approx(math.pi / wavy.buckles)


def shoelace(polygon):
    y, z = polygon.T
    return 0.5 * np.sum(y * np.roll(z, -1) - z * np.roll(y, -1))


def test_area_and_length_are_those_of_a_fine_outline(wavy):
    outline = wavy.outline(1e-9)
    assert shoelace(outline) == pytest.approx(wavy.area, rel=1e-6)
    steps = np.roll(outline, -1, axis=0) - outline
    assert np.hypot(*steps.T).sum() == pytest.approx(wavy.length, rel=1e-6)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_no_chord_of_an_outline_is_farther_from_the_wall_than_the_tolerance(wavy, tolerance):
    outline = wavy.outline(tolerance)
    assert np.abs(wavy.gap(*outline.T)).max() < 1e-15 * 20
    between = np.linspace(outline, np.roll(outline, -1, axis=0), 9)[1:-1]
    assert np.abs(wavy.gap(*between.reshape(-1, 2).T)).max() <= tolerance * (1 + 1e-9)


def test_the_gap_is_the_distance_from_a_fine_outline_and_its_sign_tells_inside(wavy):
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.2, 1.2, (60, 2)) * R
    outline = wavy.outline(1e-7)
    a, b = outline, np.roll(outline, -1, axis=0)
    along = np.einsum("psk,sk->ps", points[:, None] - a, b - a) / np.sum((b - a) ** 2, axis=1)
    foot = a + np.clip(along, 0, 1)[..., None] * (b - a)
    distance = np.hypot(*(points[:, None] - foot).transpose(2, 0, 1)).min(axis=1)
    # even-odd rule
    y, z = points.T[..., None]
    crosses = (a[:, 1] > z) != (b[:, 1] > z)
    with np.errstate(divide="ignore", invalid="ignore"):
        right = y < a[:, 0] + (z - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    inside = (crosses & right).sum(axis=1) % 2 == 1
    assert 10 < inside.sum() < 50
    gap = wavy.gap(*points.T, radius=0.002)
    assert gap == pytest.approx(np.where(inside, distance, -distance) - 0.002, abs=1.1e-7)


def test_overhangs_begin_at_r_sin_of_a_quarter_of_a_buckle():
    n = 12
    limit = R * math.sin(math.pi / (2 * n))
    assert Profile(R, n, 0.999 * limit).offset > 0 > Profile(R, n, 1.001 * limit).offset

    def backwards(profile):
        angle = np.unwrap(np.arctan2(*profile.outline(1e-6).T[::-1]))
        return (np.diff(angle) < -1e-9).any()

    assert not backwards(Profile(R, n, 0.9 * limit))
    assert backwards(Profile(R, n, 1.1 * limit))


def test_the_arcs_of_the_papers_range_hold_a_ball_of_5_mm():
    rho = [Profile(R, n, h).arc_radius for n in range(2, 21) for h in np.linspace(0.5e-3, 10e-3, 20)]
    assert 5.8e-3 < min(rho)


@pytest.mark.parametrize("n", [2, 7, 20])
def test_no_height_is_the_circle_and_a_small_one_comes_near_it(n):
    circle, flat, small = Profile(R), Profile(R, n, 0.0), Profile(R, n, 1e-12)
    assert flat.circle and flat.area == circle.area == math.pi * R * R
    assert small.area == pytest.approx(circle.area, rel=1e-9)
    assert small.arc_radius == pytest.approx(R, rel=1e-6)
    rng = np.random.default_rng(2)
    points = rng.uniform(-R, R, (2, 1000))
    assert small.gap(*points) == pytest.approx(circle.gap(*points), abs=2e-12)
    assert circle.gap(*points, 0.001) == pytest.approx(R - np.hypot(*points) - 0.001, abs=0)


@pytest.mark.parametrize("n, h", [(1, 1e-3), (-3, 1e-3), (5, -1e-3), (5, R), (5, math.nan), (20, 0.03)])
def test_what_is_no_profile_is_refused(n, h):
    with pytest.raises(ValueError, match="no profile"):
        Profile(R, n, h)


def test_neighbours_touch_where_the_neck_closes():
    n = 20
    low, high = 0.01, 0.03
    for _ in range(60):  # the largest height that has a profile
        middle = (low + high) / 2
        try:
            Profile(R, n, middle)
            low = middle
        except ValueError:
            high = middle
    arcs = Profile(R, n, low).arcs()
    inner = [np.array(arc.centre) for arc in arcs if arc.turn < 0]
    outer = [np.array(arc.centre) for arc in arcs if arc.turn > 0]
    least = min(math.dist(c[0], c[1]) for c in (inner, outer)) - 2 * arcs[0].radius
    assert least == pytest.approx(0, abs=1e-12)


WAVY = {
    "drum.radius": "0.075 m",
    "drum.profile": "wavy",
    "drum.buckles": "8",
    "drum.buckle_height": "0.004 m",
    "drum.buckle_angle": "0.5 rad",
}


def test_a_profile_is_read_from_a_decks_texts():
    assert Profile.of(WAVY.get) == Profile(0.075, 8, 0.004, 0.5)
    assert Profile.of({**WAVY, "drum.profile": "circle"}.get) == Profile(0.075)
    assert Profile.of({"drum.radius": "0.075 m"}.get) == Profile(0.075)


@pytest.mark.parametrize(
    "change, line",
    [
        ({"drum.profile": "square"}, "drum.profile: expected 'circle' or 'wavy', got 'square'"),
        ({"drum.buckles": "eight"}, "drum.buckles: expected a number, got 'eight'"),
        ({"drum.buckle_height": ""}, "drum.buckle_height: expected a number, got ''"),
        ({"drum.buckle_height": "0.08 m"}, "no profile: buckle height 0.08 m reaches the axis"),
        ({"drum.radius": None}, "the deck has no drum.radius"),
    ],
)
def test_a_wrong_deck_is_one_line(change, line):
    texts = {key: text for key, text in {**WAVY, **change}.items() if text is not None}
    with pytest.raises(UserError) as fault:
        Profile.of(lambda key, default: texts.get(key, default))
    assert str(fault.value) == line
