"""The parts of `mill dem`: springs, meshes, the data file and the deck, against independent answers."""

import math

import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SMALL
from dem_oracle import BLADES, MIXTURE, box_distance, flown
from scipy.integrate import solve_ivp

from milltools.base.errors import UserError
from milltools.dem import script
from milltools.dem.model import Model, spring, sticking_restitution, tangential_damping
from milltools.geometry.solids import blade_triangles
from milltools.read.deck import Deck
from milltools.read.kinds import KINDS


@pytest.fixture
def deck(write_deck, monkeypatch):
    """deck(text, *overrides) is the Deck of a text."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    return lambda text=SMALL, *overrides: Deck.check(write_deck(text), overrides)


# ---- springs ----


@pytest.mark.parametrize("restitution", [0.06, 0.5, 0.8, 1.0])
def test_a_contact_ends_when_and_as_fast_as_the_spring_says(restitution):
    contact = spring(1e9, 7.0, restitution, 5e-4, 2.5e-3)
    overlap, closing = flown(contact, 3.0, [contact.duration])
    scale = 3.0 / contact.frequency
    assert overlap[-1] / scale == pytest.approx(0, abs=1e-8)
    assert -closing[-1] / 3.0 == pytest.approx(restitution, abs=1e-8)


@pytest.mark.parametrize("restitution", [0.1, 0.3, 0.6, 0.8, 0.95, 1.0])
def test_a_sticking_contact_turns_its_slip_round_as_two_oscillators_do(restitution):
    """Solid spheres: 2/7 of the mass moves along the surface, on 2/7 of the stiffness, with the same dashpot."""
    contact = spring(1e9, 7.0, restitution, 5e-4, 2.5e-3)

    def rate(_, state):
        force = 2 / 7 * contact.stiffness * state[0] + contact.damping * state[1]
        return [state[1], -force / (2 / 7 * contact.mass)]

    done = solve_ivp(rate, (0, contact.duration), [0.0, 1.0], rtol=1e-11, atol=1e-18)
    assert sticking_restitution(restitution) == pytest.approx(-done.y[1][-1], abs=1e-7)


@pytest.mark.parametrize("modulus, duration", [(1e8, 232e-6), (1e9, 92e-6), (1e10, 37e-6), (2.1e11, 10.9e-6)])
def test_contacts_of_the_reference_mill_last_as_long_as_measured(modulus, duration, monkeypatch):
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    model = Model(Deck.check(ROOT / "input/simoloyer.ini"), modulus)
    assert model.pair[0][0].duration == pytest.approx(duration, rel=0.01)


@pytest.mark.parametrize("series", ["1 ms", "0.37 ms", "13 us"])
def test_rows_of_the_series_are_whole_samples_and_samples_are_dense_enough(deck, series):
    model = Model(deck(MIXTURE, f"output.series={series}"), 1e9)
    steps = float(series.split()[0]) * {"ms": 1e-3, "us": 1e-6}[series.split()[1]] / model.time_step
    assert steps == pytest.approx(5 * model.samples_per_row, rel=1e-9)
    assert model.shortest / model.sample_interval >= 8 * (1 - 1e-12)


@pytest.mark.parametrize(
    "friction, e, beta0, damped, missed",
    [
        (0.3, 0.8, 0.484, True, set()),
        (0.3, 0.8, 0.98, False, set()),
        (0.3, 0.8, 0.0, True, set(KINDS)),
        (0.3, 1.0, 1.0, True, set()),
        (0, 0.8, 0.0, True, set()),
    ],
)
def test_the_nearer_tangential_damping_is_taken_and_what_it_misses_named(deck, friction, e, beta0, damped, missed):
    sets = {"restitution": e, "friction": friction, "tangential_restitution": beta0}
    got = tangential_damping(deck(SMALL, *(f"contact.{k}={v}" for k, v in sets.items())))
    assert (got[0], set(got[1])) == (damped, missed)


# ---- blades ----


def triangle_distance(point, triangles):
    """Least distance of a point from triangles (T, 3, 3), by their planes and edges."""
    best = np.inf
    for a, b, c in triangles:
        for p, q in ((a, b), (b, c), (c, a)):
            along = np.clip((point - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
            best = min(best, np.linalg.norm(point - p - along * (q - p)))
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        foot = point - ((point - a) @ normal) * normal
        if all(np.cross(q - p, foot - p) @ normal >= 0 for p, q in ((a, b), (b, c), (c, a))):
            best = min(best, abs((point - a) @ normal))
    return best


def points_in_drum(count, seed=1):
    rng = np.random.default_rng(seed)
    x, rho, phi = (
        rng.uniform(-0.02, 0.02, count),
        0.0276 * np.sqrt(rng.uniform(0.08, 1, count)),
        rng.uniform(0, 7, count),
    )
    return np.column_stack([x, rho * np.cos(phi), rho * np.sin(phi)])  # fmt: skip


def test_triangles_are_the_boxes_wherever_a_ball_can_touch_them(deck):
    deck = deck(SMALL + BLADES, "blades.pitch=30 deg", "rotor.angle=20 deg")
    time, radius = 0.0123, 0.0025
    triangles = blade_triangles(deck, deck.rotor_speed * time).reshape(-1, 12, 3, 3)
    points = points_in_drum(1500)
    points = points[np.hypot(points[:, 1], points[:, 2]) > deck.shaft_radius + radius]
    touched = 0
    for blade, own in zip(deck.blades, triangles, strict=True):
        distance = box_distance(blade, blade.angle + deck.rotor_speed * time, points)
        near = (distance > 0) & (distance < radius)
        touched += near.sum()
        for point, wanted in zip(points[near], distance[near], strict=True):
            assert triangle_distance(point, own) == pytest.approx(wanted, abs=1e-15)
    assert touched > 50


@pytest.mark.parametrize("pitch", [0, 30, 45, 90])
@pytest.mark.parametrize("width, thickness", [(6, 4), (7, 7), (12, 2), (2, 12)])
def test_a_blade_is_closed_outward_and_its_foot_hidden_in_the_shaft(deck, pitch, width, thickness):
    deck = deck(SMALL, f"blades.pitch={pitch} deg", f"blades.width={width} mm", f"blades.thickness={thickness} mm")
    triangles = blade_triangles(deck, 0.7).reshape(-1, 12, 3, 3)
    across = (abs(math.sin(math.radians(pitch))) * width + abs(math.cos(math.radians(pitch))) * thickness) / 2e3
    for own in triangles:
        names = {tuple(np.round(corner, 12)) for corner in own.reshape(-1, 3)}
        assert len(names) == 8
        edges = [(tuple(np.round(t[k], 12)), tuple(np.round(t[k - 2], 12))) for t in own for k in range(3)]  # fmt: skip
        assert len(set(edges)) == 36 and {(b, a) for a, b in edges} == set(edges)
        centre = own.reshape(-1, 3).mean(axis=0)
        volume = sum(np.linalg.det(t - centre) for t in own) / 6
        rho = np.hypot(*np.array(sorted(names)).T[1:])
        height = volume / (width * thickness * 1e-6)
        assert 0 < height <= 0.022
        if across < deck.shaft_radius:
            assert np.sort(rho)[3] < deck.shaft_radius
        else:
            assert height > 0.0215  # from the axis, as nothing hides it


def test_the_stl_is_the_triangles(deck):
    triangles = blade_triangles(deck(SMALL + BLADES), 0.3)
    text = script.stl(triangles)
    corners = [line.split()[1:] for line in text.splitlines() if line.strip().startswith("vertex")]
    assert np.array(corners, float).reshape(-1, 3, 3) == pytest.approx(triangles, abs=1e-13)
    normals = [line.split()[2:] for line in text.splitlines() if line.startswith("facet normal")]
    facing = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    facing /= np.linalg.norm(facing, axis=1)[:, None]
    assert np.array(normals, float) == pytest.approx(facing, abs=1e-8)


# ---- the data file ----


def test_the_data_file_is_the_state_to_the_last_bit(deck):
    deck = deck(MIXTURE)
    rng = np.random.default_rng(3)
    place, velocity, spin = deck.start()[0], *rng.normal(size=(2, 120, 3))
    text = script.data_file(deck, deck.species_of_ball, (place, velocity, spin), (0.1, 0.1, 0.1))
    lines = text.splitlines()
    assert lines[2:4] == ["120 atoms", "6 atom types"]
    atoms = np.array([line.split() for line in lines[lines.index("Atoms") + 2 :][:120]], float)
    moves = np.array([line.split() for line in lines[lines.index("Velocities") + 2 :][:120]], float)
    assert np.array_equal(atoms[:, 0], np.arange(1, 121)) and np.array_equal(moves[:, 0], atoms[:, 0])
    assert np.array_equal(atoms[:, 1], np.repeat([1, 2], 60))
    assert np.array_equal(atoms[:, 2:4], np.repeat([[0.005, 7800], [0.003, 3000]], 60, axis=0))
    assert np.array_equal(atoms[:, 4:], place)
    assert np.array_equal(moves[:, 1:], np.hstack([velocity, spin]))


# ---- the deck ----


def test_a_start_file_with_an_odd_name_is_found_and_read(write_deck, tmp_path, monkeypatch):
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    name = 'start "at" 5 #1 %; = état.txt'
    (tmp_path / name).write_text("0 0.027 0 1 2 3 4 5 6\n# a comment\n0.008 -0.027 0 -1 0 0.125 0 0 0\n")
    quoted = name.replace('"', '""')
    deck = write_deck(SMALL.replace("count = 20", f'count = 2\nstart = "{quoted}"'))
    place, velocity, spin = Deck.check(deck).start()
    assert place.tolist() == [[0, 0.027, 0], [0.008, -0.027, 0]]
    assert velocity.tolist() == [[1, 2, 3], [-1, 0, 0.125]]
    assert spin.tolist() == [[4, 5, 6], [0, 0, 0]]


def test_overrides_and_units_are_millsims(deck):
    deck = deck(SMALL, "rotor.speed=-10 rps", "contact.ball_blade.restitution=0.5", "drum.radius=3 cm")
    assert deck.rotor_speed in (pytest.approx(-20 * np.pi), pytest.approx(-10))
    assert deck.number("drum.radius") == pytest.approx(0.03, rel=1e-15)
    laws = [deck.contact(kind).restitution for kind in KINDS]
    assert laws == [0.8, 0.8, 0.8, 0.8, 0.5]
    assert {deck.contact(kind).friction for kind in KINDS} == {0.3}


def test_a_mixture_has_its_kinds_in_the_order_of_their_balls(deck):
    deck = deck(MIXTURE, "balls.small.count=3")
    assert [(s.name, s.count, s.diameter, s.density) for s in deck.species] == [
        ("large", 60, 0.005, 7800),
        ("small", 3, 0.003, 3000),
    ]
    assert deck.species_of_ball.tolist() == [0] * 60 + [1] * 3
    assert len(deck.start()[0]) == 63


def test_blades_of_both_sections_are_numbered_and_turned_as_millsim_has_them(deck):
    deck = deck(SMALL + BLADES, "rotor.angle=10 deg", "blades.angle_step=90 deg", "blades.count=3")
    angles = np.degrees([b.angle for b in deck.blades])
    assert angles == pytest.approx([10, 100, 190, 50, 210])
    places = [b.position for b in deck.blades]
    assert places == pytest.approx([-0.04 / 3, 0, 0.04 / 3, -0.008, 0.012])
    assert [b.pitch for b in deck.blades[3:]] == pytest.approx(np.radians([70, -25]))


def test_a_mill_without_rotor_has_none(deck):
    text = SMALL[: SMALL.index("[rotor]")] + SMALL[SMALL.index("[contact]") :]
    deck = deck(text)
    assert (deck.rotor_speed, deck.shaft_radius, deck.blades) == (0, 0, [])
    assert blade_triangles(deck, 0.0).size == 0


def test_the_line_of_a_wrong_deck_is_millsims(deck):
    with pytest.raises(UserError, match=r"^.*deck.ini:8: \[drum\] radius: expected a length") as fault:
        deck(SMALL.replace("radius = 30 mm", "radius = 30 s"))
    assert fault.value.status == 2
