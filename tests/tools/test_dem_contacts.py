"""Contacts out of the states of balls, and the hand-over to a stiffer run: brute force and exact motion know better."""

import numpy as np
import pytest
from conftest import PROGRAM, SMALL, some
from dem_oracle import BLADES, MIXTURE, brute, flown

from milltools.base.errors import UserError
from milltools.dem.contacts import CLOSED, Contacts, part
from milltools.dem.model import Model
from milltools.read.deck import Deck
from milltools.read.kinds import KINDS


@pytest.fixture
def deck(write_deck, monkeypatch):
    """deck(text, *overrides) is the Deck of a text."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    return lambda text=SMALL, *overrides: Deck.check(write_deck(text), overrides)


@pytest.mark.slow
@pytest.mark.parametrize("modulus", some([1e8, 1e10, 2.1e11], 2))
@pytest.mark.parametrize(
    "text, counts",
    [(SMALL, ["balls.count=250"]), (MIXTURE, ["balls.large.count=150", "balls.small.count=200"])],
    ids=["one kind", "two kinds"],
)
def test_contacts_are_those_of_brute_force_however_fast_balls_become(deck, text, counts, modulus):
    """Balls at rest that suddenly fly at up to ten times the tips' speed."""
    deck = deck(text + BLADES, *counts)
    model = Model(deck, modulus)
    contacts, rng = Contacts(deck, model), np.random.default_rng(4)
    place, velocity, _ = deck.start()
    velocity *= 0
    radius, seen = contacts.radius, dict.fromkeys(KINDS, 0)
    for sample in range(160):
        if sample in (9, 70):
            velocity = rng.normal(size=velocity.shape)
            velocity *= (rng.uniform(0, 14, len(place)) / np.linalg.norm(velocity, axis=1))[:, None]
        place = place + velocity * model.sample_interval
        rho = np.hypot(place[:, 1], place[:, 2])
        back = (rho > 0.03 - 0.8 * radius) & ((place * velocity)[:, 1:].sum(axis=1) > 0)
        velocity[back, 1:] *= -1
        back = (abs(place[:, 0]) > 0.02 - 0.8 * radius) & (place[:, 0] * velocity[:, 0] > 0)
        velocity[back, 0] *= -1
        time = sample * model.sample_interval
        wanted = brute(deck, place, time)
        for kind, found in zip(KINDS, contacts.find(time, place, velocity), strict=True):
            got = dict(zip(zip(found.ball.tolist(), found.partner.tolist()), found.overlap))
            if kind == "ball_blade":  # centres inside a blade have no part in this comparison
                got = {key: overlap for key, overlap in got.items() if overlap < radius[key[0]]}
            assert got == pytest.approx(wanted[kind], abs=1e-14), (kind, sample)
            seen[kind] += len(got)
    assert seen["ball_ball"] > 20 and seen["ball_blade"] > 20


def test_normals_point_into_the_ball_and_across_the_contact(deck):
    deck = deck(MIXTURE + BLADES, "balls.large.count=150", "balls.small.count=200")
    contacts = Contacts(deck, Model(deck, 1e8))
    place, velocity, _ = deck.start()
    place = place + np.random.default_rng(5).normal(size=place.shape) * 4e-4
    step = 1e-7
    for kind, found in zip(KINDS, contacts.find(0.0, place, velocity), strict=True):
        assert len(found.ball), kind
        for k in range(len(found.ball)):
            moved = place.copy()
            moved[found.ball[k]] += step * found.normal[k]
            after = brute(deck, moved, 0.0)[kind]
            key = int(found.ball[k]), int(found.partner[k])
            assert after.get(key, 0.0) == pytest.approx(max(found.overlap[k] - step, 0), abs=1e-10)


# name: where the ball touches, the normal into it, its partner
TOUCHED = {
    "ball_drum": ([0.001, 0, -0.03], [0, 0, 1], -1),
    "ball_wall": ([0.02, 0.013, 0.011], [-1, 0, 0], 1),
    "ball_shaft": ([0, 0, -0.005], [0, 0, -1], -1),
    "ball_blade": ([-0.01, 0.015, 0.002], [0, 0, 1], 0),
}


def bounce(deck, kind, phase, speed=2.5, sampled=40):
    """One ball that follows the damped spring exactly and slips along x or z, begun at `phase` between two samples:
    the Contacts, what they returned, and what it should have been."""
    model = Model(deck, 1e8)
    contact = model.wall[kind][0]
    point, normal, partner = TOUCHED[kind]
    point, normal = np.array(point, float), np.array(normal, float)
    radius, begin = 0.0025, (3 + phase) * model.sample_interval
    along = np.array([0.0, 0, 0.4]) if kind == "ball_wall" else np.array([0.4, 0, 0])
    spin = np.array([[3.0, 50, 20]])
    contacts, seen = Contacts(deck, model), []
    for sample in range(sampled):
        age = sample * model.sample_interval - begin
        t = np.clip(age, 0, contact.duration)
        wave = np.exp(-contact.decay * t) / contact.frequency * speed
        overlap = wave * np.sin(contact.frequency * t)
        closing = wave * contact.frequency * np.cos(contact.frequency * t) - contact.decay * overlap
        overlap += closing * (age - t)  # free before and after
        velocity = along - closing * normal
        place = point + (radius - overlap) * normal + along * age
        found = contacts.sample(sample * model.sample_interval, place[None], velocity[None], spin)
        if found is not None:
            seen.append(found)
    slip = along + np.cross(spin[0], -radius * normal)
    slip -= (slip @ normal) * normal
    return contacts, seen, {
        "kind": KINDS.index(kind), "ball": 0, "partner": partner, "time": begin, "normal_speed": speed,
        "tangential_speed": np.linalg.norm(slip), "normal": normal[None],
        "dissipation": (1 - deck.contact(kind).restitution ** 2) / 2 * contact.mass * speed**2,
    }  # fmt: skip


@pytest.fixture
def one_ball(deck):
    return deck(SMALL, "balls.count=1", "rotor.speed=0 rpm", "contact.ball_blade.restitution=0.6")


@pytest.mark.parametrize("kind", TOUCHED)
@pytest.mark.parametrize("phase", [0.02, 0.3, 0.97])
def test_an_impact_on_a_surface_is_told_once_as_it_began(one_ball, kind, phase):
    _, seen, wanted = bounce(one_ball, kind, phase)
    assert len(seen) == 1
    for name, value in wanted.items():
        assert seen[0][name] == pytest.approx(np.atleast_1d(value), rel=1e-8, abs=1e-12), name


@pytest.mark.parametrize("kind", TOUCHED)
def test_what_the_dashpot_takes_is_the_impacts_loss_on_average_over_phases(one_ball, kind):
    taken = []
    for phase in (np.arange(24) + 0.5) / 24:
        contacts, seen, wanted = bounce(one_ball, kind, phase)
        taken.append(contacts.normal_loss)
        assert contacts.isolated_loss[wanted["kind"]] == pytest.approx(wanted["dissipation"], rel=1e-8)
    mean = np.mean(taken, axis=0)
    assert mean[wanted["kind"]] == pytest.approx(wanted["dissipation"], rel=0.005)
    assert np.delete(mean, wanted["kind"]).sum() == 0


def test_the_largest_overlap_and_the_springs_energy_are_those_of_the_oscillator(one_ball):
    contact = Model(one_ball, 1e8).wall["ball_drum"][0]
    deepest = flown(contact, 2.5, contact.duration * np.linspace(0.3, 0.6, 99))[0].max()
    assert max(bounce(one_ball, "ball_drum", k / 8)[0].deepest for k in range(8)) == pytest.approx(deepest, rel=0.01)
    midway = bounce(one_ball, "ball_drum", 0.0, sampled=7)[0]
    overlap = flown(contact, 2.5, [3 * midway.interval])[0][0]
    assert midway.elastic[1] == pytest.approx(0.5 * contact.stiffness * overlap**2, rel=1e-6)


def test_an_impact_of_two_unlike_balls_is_that_of_their_relative_motion(deck):
    deck = deck(MIXTURE, "balls.large.count=1", "balls.small.count=1", "blades.tip_radius=8 mm")
    model = Model(deck, 1e8)
    contact, speed, begin = model.pair[0][1], 1.75, 4.4 * model.sample_interval
    mass = np.array([7800 * 0.005**3, 3000 * 0.003**3]) * np.pi / 6
    share = mass[::-1] / mass.sum()  # how much of the relative motion is whose
    contacts, drift, seen = Contacts(deck, model), np.array([1.0, -2.0, 0.5]), []
    spin = np.array([[10.0, 200, -30], [0, -80, 500]])
    for sample in range(30):
        age = sample * model.sample_interval - begin
        t = np.clip(age, 0, contact.duration)
        wave = np.exp(-contact.decay * t) / contact.frequency * speed
        overlap = wave * np.sin(contact.frequency * t)
        closing = wave * contact.frequency * np.cos(contact.frequency * t) - contact.decay * overlap
        overlap += closing * (age - t)
        axis = np.array([0.6, 0.0, 0.8])  # from the small ball to the large one
        centre = np.array([0.0, 0.015, 0.0]) + drift * age
        place = [centre + (0.004 - overlap) * share[0] * axis, centre - (0.004 - overlap) * share[1] * axis]
        velocity = [drift - closing * share[0] * axis, drift + closing * share[1] * axis]
        found = contacts.sample(sample * model.sample_interval, np.array(place), np.array(velocity), spin)  # fmt: skip
        if found is not None:
            seen.append(found)
    assert len(seen) == 1
    (impact,) = seen
    assert (impact["kind"], impact["ball"], impact["partner"]) == ([0], [0], [1])
    assert impact["time"] == pytest.approx([begin], abs=1e-12)
    assert impact["normal_speed"] == pytest.approx([speed], rel=1e-9)
    slip = np.cross(spin[0], -0.0025 * axis) - np.cross(spin[1], 0.0015 * axis)
    assert impact["tangential_speed"] == pytest.approx([np.linalg.norm(slip)], rel=1e-12)
    assert impact["dissipation"] == pytest.approx([0.18 * contact.mass * speed**2], rel=1e-8)
    assert impact["normal"] == pytest.approx(axis[None], abs=1e-12)


def test_slip_on_a_blade_counts_from_its_moving_surface(deck):
    """A ball that turns with the rotor does not slip on a blade; one at rest slips with the blade's own speed."""
    deck = deck(SMALL, "balls.count=1", "rotor.speed=-600 rpm")
    omega = -20 * np.pi
    contacts = Contacts(deck, Model(deck, 1e8))
    place = np.array([[-0.01, 0.0242, 0.0]])  # beyond the tip of blade 0
    (found,) = contacts.find(0.0, place, np.zeros((1, 3)))[4:]
    assert found.ball.tolist() == [0]
    with_it = np.cross([omega, 0, 0], place)
    spin = np.array([[omega, 0, 0]])
    assert contacts.slip(4, found, place, with_it, spin) == pytest.approx(np.zeros((1, 3)), abs=1e-12)
    at_rest = contacts.slip(4, found, place, np.zeros((1, 3)), np.zeros((1, 3)))
    assert at_rest == pytest.approx(np.array([[0, 0, -omega * (0.0242 - 0.0025)]]), rel=1e-12)


def test_impacts_come_in_order_of_time_and_never_before_the_last_sample(deck):
    """Results takes them so; balls that overlap at the first sample, or open in their first, are no exception."""
    deck = deck(MIXTURE)
    contacts = Contacts(deck, Model(deck, 1e8))
    rng, last = np.random.default_rng(6), 0.5
    place = deck.start()[0]
    for sample in range(60):
        time = 0.5 + sample * contacts.interval
        place = place + rng.normal(size=place.shape) * 1e-4
        place[:, 1:] *= np.minimum(1, 0.029 / np.hypot(*place.T[1:]))[:, None]
        found = contacts.sample(time, place, rng.normal(size=place.shape), rng.normal(size=place.shape))
        if found is not None:
            assert (np.diff(found["time"]) >= 0).all()
            assert last <= found["time"][0] and found["time"][-1] <= time
            assert (found["normal_speed"] > 0).all()
        last = time
    assert contacts.isolated_loss[0] > 0


# ---- from a soft run to a stiff one ----


def test_parting_leaves_no_overlap_and_moves_balls_little(deck):
    deck = deck(MIXTURE + BLADES, "balls.large.count=150", "balls.small.count=200")
    contacts = Contacts(deck, Model(deck, 1e8))
    rng = np.random.default_rng(7)
    place, velocity, _ = deck.start()
    place = place + rng.normal(size=place.shape) * 1e-4
    before = max(max(found.values(), default=0) for found in brute(deck, place, 0.1).values())
    assert before > 1e-4
    parted = part(contacts, 0.1, place, velocity)
    after = max(max(found.values(), default=0) for found in brute(deck, parted, 0.1).values())
    assert after <= CLOSED * 0.0025
    assert np.linalg.norm(parted - place, axis=1).max() < 6 * before


def test_parting_what_does_not_fit_is_one_line(deck):
    deck = deck(SMALL, "balls.count=2", "drum.length=12 mm", "blades.count=1")
    contacts = Contacts(deck, Model(deck, 1e8))
    contacts.walls[2].half = 0.0024  # a mill shorter than its balls
    with pytest.raises(UserError, match="overlaps of .* m that cannot be removed"):
        part(contacts, 0.0, deck.start()[0], np.zeros((2, 3)))
