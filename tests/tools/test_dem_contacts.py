"""Contacts out of the states of balls, and the hand-over to a stiffer run: brute force and exact motion know better.

millsim finds the contacts (`millsim --digest`, src/engine/soft_watch.c).
"""

import numpy as np
import pytest
from conftest import PROGRAM, SMALL, some
from dem_oracle import BLADES, MIXTURE, Watched, box_distance, brute, flown

from milltools.base.errors import UserError
from milltools.dem.model import Model
from milltools.read.deck import Deck
from milltools.read.kinds import KINDS

CLOSED = 1e-7 * 0.0025  # [m] overlaps that parting may leave


@pytest.fixture
def deck(write_deck, monkeypatch):
    """deck(text, *overrides) is the Deck of a text."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    return lambda text=SMALL, *overrides: Deck.check(write_deck(text), ["output.impacts=all", *overrides])


@pytest.fixture
def watched(tmp_path):
    """watched(deck, model): a Watched."""
    return lambda deck, model: Watched(deck, model, tmp_path / "seen.h5")


def stored(deck, model, found):
    """[J] in the springs of contacts {kind: {(ball, partner): overlap}}."""
    of, energy = deck.species_of_ball, 0.0
    for kind, contacts in found.items():
        for (ball, partner), overlap in contacts.items():
            spring = model.pair[of[ball]][of[partner]] if kind == "ball_ball" else model.wall[kind][of[ball]]
            energy += 0.5 * spring.stiffness * overlap**2
    return energy


@pytest.mark.slow
@pytest.mark.parametrize("modulus", some([1e8, 1e10, 2.1e11], 2))
@pytest.mark.parametrize(
    "text, counts",
    [(SMALL, ["balls.count=250"]), (MIXTURE, ["balls.large.count=150", "balls.small.count=200"])],
    ids=["one kind", "two kinds"],
)
def test_contacts_are_those_of_brute_force_however_fast_balls_become(deck, watched, text, counts, modulus):
    """Balls at rest that suddenly fly at up to ten times the tips' speed: each contact that begins is an impact, and
    the springs of all that last hold their energy."""
    deck = deck(text + BLADES, *counts)
    model, rng = Model(deck, modulus), np.random.default_rng(4)
    place, velocity, _ = deck.start()
    velocity *= 0
    radius = np.array([kind.diameter / 2 for kind in deck.species])[deck.species_of_ball]
    last, began, compared = {kind: {} for kind in KINDS}, [], 0
    with watched(deck, model) as seen:
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
            seen.sample(time, place, velocity)
            turned = [(blade, blade.angle + deck.rotor_speed * time) for blade in deck.blades]
            if all(box_distance(*blade, place).all() for blade in turned):  # else a centre is inside a blade
                compared += 1
                assert seen.seen.elastic == pytest.approx(stored(deck, model, wanted), rel=1e-9, abs=1e-18)
            for kind, contacts in wanted.items():
                began += [(KINDS.index(kind), *key) for key in contacts.keys() - last[kind].keys()]
            last = wanted
        told = seen.ended()
    got = sorted(zip(told["kind"], told["ball"], told["partner"], strict=True))
    assert compared > 10
    # centres of the fastest balls pass through blades and shaft, where normals turn over
    assert [one for one in got if one[0] < 3] == sorted(one for one in began if one[0] < 3)
    assert len(got) > 40 and {0, 4} <= set(told["kind"])


def test_normals_point_into_the_ball_and_across_the_contact(deck, watched):
    deck = deck(MIXTURE + BLADES, "balls.large.count=150", "balls.small.count=200")
    place, velocity, _ = deck.start()
    place = place + np.random.default_rng(5).normal(size=place.shape) * 4e-4
    with watched(deck, Model(deck, 1e8)) as seen:
        seen.sample(0.0, place, velocity)
        told = seen.ended()
    step, before = 1e-7, brute(deck, place, 0.0)
    assert set(told["kind"]) == set(range(5))
    for kind, ball, partner, normal in zip(*(told[k] for k in ("kind", "ball", "partner", "normal")), strict=True):
        moved, key = place.copy(), (int(ball), int(partner))
        moved[ball] += step * normal
        after = brute(deck, moved, 0.0)[KINDS[kind]]
        assert after.get(key, 0.0) == pytest.approx(max(before[KINDS[kind]][key] - step, 0), abs=1e-10)


# name: where the ball touches, the normal into it, its partner
TOUCHED = {
    "ball_drum": ([0.001, 0, -0.03], [0, 0, 1], -1),
    "ball_wall": ([0.02, 0.013, 0.011], [-1, 0, 0], 1),
    "ball_shaft": ([0, 0, -0.005], [0, 0, -1], -1),
    "ball_blade": ([-0.01, 0.015, 0.002], [0, 0, 1], 0),
}


def bounce(watched, deck, kind, phase, speed=2.5, sampled=40):
    """One ball that follows the damped spring exactly and slips along x or z, begun at `phase` between two samples:
    the Answer at the end, the impacts told, and what they should have been."""
    model = Model(deck, 1e8)
    contact = model.wall[kind][0]
    point, normal, partner = TOUCHED[kind]
    point, normal = np.array(point, float), np.array(normal, float)
    radius, begin = 0.0025, (3 + phase) * model.sample_interval
    along = np.array([0.0, 0, 0.4]) if kind == "ball_wall" else np.array([0.4, 0, 0])
    spin = np.array([[3.0, 50, 20]])
    with watched(deck, model) as seen:
        for sample in range(sampled):
            age = sample * model.sample_interval - begin
            t = np.clip(age, 0, contact.duration)
            wave = np.exp(-contact.decay * t) / contact.frequency * speed
            overlap = wave * np.sin(contact.frequency * t)
            closing = wave * contact.frequency * np.cos(contact.frequency * t) - contact.decay * overlap
            overlap += closing * (age - t)  # free before and after
            velocity = along - closing * normal
            place = point + (radius - overlap) * normal + along * age
            seen.sample(sample * model.sample_interval, place[None], velocity[None], spin)
        answer, told = seen.seen, seen.ended()
    slip = along + np.cross(spin[0], -radius * normal)
    slip -= (slip @ normal) * normal
    return answer, told, {
        "kind": KINDS.index(kind), "ball": 0, "partner": partner, "time": begin, "normal_speed": speed,
        "tangential_speed": np.linalg.norm(slip), "normal": normal[None],
        "dissipation": (1 - deck.contact(kind).restitution ** 2) / 2 * contact.mass * speed**2,
    }  # fmt: skip


@pytest.fixture
def one_ball(deck):
    return deck(SMALL, "balls.count=1", "rotor.speed=0 rpm", "contact.ball_blade.restitution=0.6")


@pytest.mark.parametrize("kind", TOUCHED)
@pytest.mark.parametrize("phase", [0.02, 0.3, 0.97])
def test_an_impact_on_a_surface_is_told_once_as_it_began(one_ball, watched, kind, phase):
    _, told, wanted = bounce(watched, one_ball, kind, phase)
    assert len(told["time"]) == 1
    for name, value in wanted.items():
        rounding = 1e-7 if name == "normal" else 1e-12  # the file has normals in single precision
        assert told[name] == pytest.approx(np.atleast_1d(value), rel=1e-8, abs=rounding), name


@pytest.mark.parametrize("kind", TOUCHED)
def test_what_the_dashpot_takes_is_the_impacts_loss_on_average_over_phases(one_ball, watched, kind):
    taken = []
    for phase in (np.arange(24) + 0.5) / 24:
        answer, _, wanted = bounce(watched, one_ball, kind, phase)
        taken.append(answer.normal)
        assert answer.isolated[wanted["kind"]] == pytest.approx(wanted["dissipation"], rel=1e-8)
    mean = np.mean(taken, axis=0)
    assert mean[wanted["kind"]] == pytest.approx(wanted["dissipation"], rel=0.005)
    assert np.delete(mean, wanted["kind"]).sum() == 0


def test_the_largest_overlap_and_the_springs_energy_are_those_of_the_oscillator(one_ball, watched):
    contact, interval = Model(one_ball, 1e8).wall["ball_drum"][0], Model(one_ball, 1e8).sample_interval
    deepest = flown(contact, 2.5, contact.duration * np.linspace(0.3, 0.6, 99))[0].max()
    found = max(bounce(watched, one_ball, "ball_drum", k / 8)[0].deepest for k in range(8))
    assert found == pytest.approx(deepest, rel=0.01)
    midway, *_ = bounce(watched, one_ball, "ball_drum", 0.0, sampled=7)
    overlap = flown(contact, 2.5, [3 * interval])[0][0]
    assert midway.elastic == pytest.approx(0.5 * contact.stiffness * overlap**2, rel=1e-6)


@pytest.mark.parametrize("slip, slides", [(3.0, True), (0.05, False)])
def test_friction_at_a_surface_takes_what_coulombs_law_or_the_dashpot_says(one_ball, watched, slip, slides):
    """A ball pressed onto an end wall by a constant force slides at constant slip: mu F v; or it sticks, and rocks."""
    model = Model(one_ball, 1e8)
    contact, radius, count = model.wall["ball_wall"][0], 0.0025, 4000
    with watched(one_ball, model) as seen:
        for sample in range(count):
            t = sample * model.sample_interval
            rate = slip if slides else 1e-5 * slip * np.cos(1e4 * slip * t)
            seen.sample(t, np.array([[0.02 - radius + 2e-6, 0.02, 0.01]]), np.array([[0.0, rate, 0]]))
        answer = seen.seen
    span = count * model.sample_interval
    damped = 0.5 * contact.damping * (1e-5 * slip) ** 2
    wanted = 0.3 * contact.stiffness * 2e-6 * slip * span if slides else damped * span
    assert answer.rubbed[2] == pytest.approx(wanted, rel=0.02)
    assert answer.rubbed.sum() == answer.rubbed[2]


def test_an_impact_of_two_unlike_balls_is_that_of_their_relative_motion(deck, watched):
    deck = deck(MIXTURE, "balls.large.count=1", "balls.small.count=1", "blades.tip_radius=8 mm")
    model = Model(deck, 1e8)
    contact, speed, begin = model.pair[0][1], 1.75, 4.4 * model.sample_interval
    mass = np.array([7800 * 0.005**3, 3000 * 0.003**3]) * np.pi / 6
    share = mass[::-1] / mass.sum()  # how much of the relative motion is whose
    drift = np.array([1.0, -2.0, 0.5])
    spin = np.array([[10.0, 200, -30], [0, -80, 500]])
    axis = np.array([0.6, 0.0, 0.8])  # from the small ball to the large one
    with watched(deck, model) as seen:
        for sample in range(30):
            age = sample * model.sample_interval - begin
            t = np.clip(age, 0, contact.duration)
            wave = np.exp(-contact.decay * t) / contact.frequency * speed
            overlap = wave * np.sin(contact.frequency * t)
            closing = wave * contact.frequency * np.cos(contact.frequency * t) - contact.decay * overlap
            overlap += closing * (age - t)
            centre = np.array([0.0, 0.015, 0.0]) + drift * age
            place = [centre + (0.004 - overlap) * share[0] * axis, centre - (0.004 - overlap) * share[1] * axis]
            velocity = [drift - closing * share[0] * axis, drift + closing * share[1] * axis]
            seen.sample(sample * model.sample_interval, np.array(place), np.array(velocity), spin)
        told = seen.ended()
    slip = np.cross(spin[0], -0.0025 * axis) - np.cross(spin[1], 0.0015 * axis)
    assert [told[name].tolist() for name in ("kind", "ball", "partner")] == [[0], [0], [1]]
    assert told["time"] == pytest.approx([begin], abs=1e-12)
    assert told["normal_speed"] == pytest.approx([speed], rel=1e-9)
    assert told["tangential_speed"] == pytest.approx([np.linalg.norm(slip)], rel=1e-9)
    assert told["dissipation"] == pytest.approx([0.18 * contact.mass * speed**2], rel=1e-8)
    assert told["normal"] == pytest.approx(axis[None], abs=1e-7)


@pytest.mark.parametrize("turns", [True, False])
def test_slip_on_a_blade_counts_from_its_moving_surface(deck, watched, turns):
    """A ball that turns with the rotor does not slip on a blade; one at rest slips with the blade's own speed."""
    deck = deck(SMALL, "balls.count=1", "rotor.speed=-600 rpm")
    omega = -20 * np.pi
    place = np.array([[-0.01, 0.0242, 0.0]])  # beyond the tip of blade 0
    velocity, spin = np.cross([omega, 0, 0], place) * turns, np.array([[omega * turns, 0, 0]])
    with watched(deck, Model(deck, 1e8)) as seen:
        seen.sample(0.0, place, velocity, spin)
        told = seen.ended()
    assert (told["kind"].tolist(), told["partner"].tolist()) == ([4], [0])
    wanted = 0.0 if turns else abs(omega) * (0.0242 - 0.0025)
    assert told["tangential_speed"] == pytest.approx([wanted], abs=1e-12)


def test_impacts_come_in_order_of_time_and_never_before_the_last_sample(deck, watched):
    """Balls that overlap at the first sample, or open in their first, are no exception."""
    deck = deck(MIXTURE)
    model, rng = Model(deck, 1e8), np.random.default_rng(6)
    place, begin = deck.start()[0], 0.01
    with watched(deck, model) as seen:
        for sample in range(60):
            place = place + rng.normal(size=place.shape) * 1e-4
            place[:, 1:] *= np.minimum(1, 0.029 / np.hypot(*place.T[1:]))[:, None]
            seen.sample(begin + sample * model.sample_interval, place, *rng.normal(size=(2, *place.shape)))
        answer, told = seen.seen, seen.ended()
    assert (np.diff(told["time"]) >= 0).all() and len(told["time"]) > 50
    assert begin <= told["time"][0] and told["time"][-1] <= begin + 59 * model.sample_interval
    assert (told["normal_speed"] > 0).all() and answer.isolated[0] > 0


# ---- from a soft run to a stiff one ----


def test_parting_leaves_no_overlap_and_moves_balls_little(deck, watched):
    deck = deck(MIXTURE + BLADES, "balls.large.count=150", "balls.small.count=200")
    rng = np.random.default_rng(7)
    place, velocity, _ = deck.start()
    place, velocity = place + rng.normal(size=place.shape) * 1e-4, velocity + 1.0
    before = max(max(found.values(), default=0) for found in brute(deck, place, 0.02).values())
    assert before > 1e-4
    with watched(deck, Model(deck, 1e8)) as seen:
        seen.sample(0.02, place, velocity)
        seen.digest.part()
        parted, kept, _ = seen.seen.state
    after = max(max(found.values(), default=0) for found in brute(deck, parted, 0.02).values())
    assert after <= CLOSED * 1.001
    assert np.linalg.norm(parted - place, axis=1).max() < 6 * before
    assert np.array_equal(kept, velocity)


def test_parting_what_does_not_fit_is_one_line(deck, watched):
    """A ball between the tip of a blade and the drum, where there is no room for it."""
    deck = deck(SMALL, "balls.count=1", "blades.tip_radius=27 mm")
    with watched(deck, Model(deck, 1e8)) as seen:
        seen.sample(0.0, np.array([[-0.01, 0.0285, 0]]), np.zeros((1, 3)))
        seen.digest.part()
        with pytest.raises(UserError, match=r"\(part\): overlaps of 0.001 m that cannot be removed"):
            seen.seen
