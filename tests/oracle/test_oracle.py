"""The oracle by itself, against cases known by pen and paper."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import some
from decks import random_case
from few_balls import agreement, predict, row_of
from oracle import KINDS, STEP, Blade, Law, Mill, Simulation

STEEL = 7800.0
LOSSY = Law(0.8)


def mill(balls=1, radius=2.5e-3, law=LOSSY, gravity=(0, 0, -9.81), **more):
    return Mill(
        drum_radius=more.pop("drum_radius", 0.05),
        drum_length=more.pop("drum_length", 0.06),
        radius=np.broadcast_to(np.asarray(radius, dtype=float), (balls,)).copy(),
        density=np.full(balls, STEEL),
        laws=dict.fromkeys(KINDS, law),
        gravity=np.array(gravity, dtype=float),
        **more,
    )


def simulation(a_mill, position, velocity, spin=None):
    spin = np.zeros_like(np.array(position, dtype=float)) if spin is None else spin
    return Simulation(a_mill, position, velocity, spin)


def test_a_ball_thrown_up_from_the_bottom_returns_after_twice_u_over_g():
    m = mill(law=Law(1.0))
    s = simulation(m, [[0, 0, -0.0475]], [[0, 0, 0.5]])
    impacts = s.run(1.0, 3)
    assert [i.time for i in impacts] == pytest.approx([2 * 0.5 / 9.81 * k for k in (1, 2, 3)], abs=1e-14)
    assert [i.normal_speed for i in impacts] == pytest.approx([0.5] * 3, abs=1e-13)


def test_rebounds_of_an_inelastic_ball_shrink_by_e_until_the_floor():
    m = mill(law=Law(0.5), rebound_floor=0.1)
    s = simulation(m, [[0, 0, -0.0475 + 0.02]], [[0, 0, 0.0]])
    v0 = np.sqrt(2 * 9.81 * 0.02)
    speeds = [i.normal_speed for i in s.run(1.0, 6)]
    assert speeds[:3] == pytest.approx([v0, v0 / 2, v0 / 4], abs=1e-12)
    assert speeds[3:] == pytest.approx([0.1] * 3, abs=1e-12)


@pytest.mark.parametrize("angle", [0.3, 1e-3, 2e-5])  # the last: hops of a fifth of a step
def test_a_ball_hops_along_the_drum_with_chords_of_one_length(angle):
    m = mill(law=Law(1.0), gravity=(0, 0, 0), rebound_floor=0.0)
    s = simulation(m, [[0, 0, -0.0475]], [[0, np.cos(angle), np.sin(angle)]])
    hops = np.diff([0] + [i.time for i in s.run(10.0, 20)])
    # an ulp of the position turns the next chord by ulp / (R sin(angle)) and its length with it
    rounding = 20 * np.finfo(float).eps / np.sin(angle) ** 2
    assert hops == pytest.approx(np.full(20, 2 * 0.0475 * np.sin(angle)), rel=rounding)


def test_head_on_equal_elastic_balls_swap_velocities():
    m = mill(2, law=Law(1.0), gravity=(0, 0, 0))
    s = simulation(m, [[-0.01, 0, 0], [0.01, 0, 0]], [[1, 0, 0], [0, 0, 0]])
    (impact,) = s.run(0.017, 5)
    assert (impact.kind, impact.ball, impact.partner) == ("ball_ball", 0, 1)
    assert impact.time == pytest.approx(0.015, abs=1e-15)
    assert impact.normal == pytest.approx([-1, 0, 0])
    assert impact.position == pytest.approx([0.0075, 0, 0])
    assert s.v == pytest.approx(np.array([[0, 0, 0], [1, 0, 0]]), abs=1e-14)


@pytest.mark.parametrize("clearance, hits", [(-1e-9, 1), (1e-9, 0)])
def test_a_graze_between_two_samples_is_seen(clearance, hits):
    m = mill(2, law=Law(1.0), gravity=(0, 0, 0))
    s = simulation(m, [[-0.01, 0.005 + clearance, 0], [0, 0, 0]], [[1, 0, 0], [0, 0, 0]])
    assert len(s.run(0.015)) == hits


def test_a_ball_runs_against_the_face_of_a_standing_blade():
    blade = Blade(0.0, 0.0, 0.04, 0.02, 0.004, 0.0)  # along +y, faces at z = +-2 mm
    m = mill(law=Law(0.5), gravity=(0, 0, 0), blades=(blade,), shaft_radius=0.005)
    s = simulation(m, [[0, 0.02, 0.0245]], [[0, 0, -1.0]])
    (impact,) = s.run(0.025)
    assert (impact.kind, impact.partner, impact.feature) == ("ball_blade", 0, "face")
    assert impact.time == pytest.approx(0.02, abs=1e-14)
    assert impact.position == pytest.approx([0, 0.02, 0.002], abs=1e-14)
    assert s.v[0] == pytest.approx([0, 0, 0.5], abs=1e-14)


def test_positive_pitch_turns_the_plus_x_edge_towards_increasing_angle():
    blade = Blade(0.0, 0.0, 0.04, 0.02, 0.004, np.radians(30))
    m = mill(gravity=(0, 0, 0), blades=(blade,), shaft_radius=0.005)
    right, left = (simulation(m, [[x, 0.02, 0.02]], [[0, 0, -1.0]]).run(0.05, 1)[0] for x in (0.004, -0.004))
    assert right.position[2] > 0.002 > left.position[2]
    assert right.normal == pytest.approx([-0.5, 0, np.sqrt(0.75)], abs=1e-12)


@pytest.mark.parametrize("speed", [100.0, -100.0])
def test_a_turning_blade_throws_a_resting_ball(speed):
    blade = Blade(0.0, np.radians(90 if speed < 0 else -90), 0.04, 0.02, 0.004, 0.0)
    m = mill(law=Law(0.7), gravity=(0, 0, 0), blades=(blade,), shaft_radius=0.005, rotor_speed=speed)
    s = simulation(m, [[0, 0.02, 0]], [[0, 0, 0]])
    impact = s.run(1.0, 1)[0]
    # face parallel to y and 2 mm + 2.5 mm from its mid-plane: sin(angle left) = 4.5/20
    assert impact.time == pytest.approx((np.pi / 2 - np.arcsin(4.5 / 20)) / 100, abs=1e-13)
    approach = 100 * 0.02 * np.cos(np.arcsin(4.5 / 20))
    assert impact.normal_speed == pytest.approx(approach, rel=1e-12)
    assert s.v[0] @ impact.normal == pytest.approx(1.7 * approach, rel=1e-12)
    assert s.rotor_work == pytest.approx(s.energy() + s.dissipated, rel=1e-12)


def test_the_tip_of_a_blade_has_faces_edges_and_corners():
    blade = Blade(0.0, 0.0, 0.03, 0.01, 0.004, 0.0)
    m = mill(gravity=(0, 0, 0), blades=(blade,), shaft_radius=0.005)
    seen = []
    for x, z in [(0, 0), (0.006, 0), (0, 0.003), (0.006, 0.003)]:
        seen.append(simulation(m, [[x, 0.04, z]], [[0, -1.0, 0]]).run(0.05, 1)[0].feature)
    assert seen == ["face", "edge", "edge", "corner"]


def test_without_friction_spins_are_left_alone():
    m = mill(2, law=Law(0.8, 0.0, 0.5), gravity=(0, 0, 0))
    spin = np.array([[10.0, 20, 30], [-5, 6, 7]])
    s = simulation(m, [[-0.01, 0.001, 0], [0.01, 0, 0]], [[1, 0, 0], [0, 0, 0]], spin)
    impact = s.run(0.05, 1)[0]
    assert (s.w == spin).all()
    assert impact.tangential_speed > 0
    assert s.v.sum(axis=0) == pytest.approx([1, 0, 0], abs=1e-14)


def test_a_perfectly_rough_elastic_blow_reverses_the_slip_and_loses_nothing():
    m = mill(2, radius=[2e-3, 3e-3], law=Law(1.0, 100.0, 1.0), gravity=(0, 0, 0))
    spin = np.array([[10.0, 200, 30], [-5, 60, 70]])
    s = simulation(m, [[-0.01, 0.001, 0], [0.01, 0, 0]], [[1, 0.1, 0], [0, 0, 0.2]], spin)
    before = s.energy()
    impact = s.run(0.05, 1)[0]
    n = impact.normal
    slip = s.v[0] - s.v[1] + np.cross(2e-3 * s.w[0] + 3e-3 * s.w[1], -n)
    assert slip @ n == pytest.approx(impact.normal_speed, rel=1e-12)
    assert np.linalg.norm(slip - (slip @ n) * n) == pytest.approx(impact.tangential_speed, rel=1e-12)
    assert s.energy() == pytest.approx(before, rel=1e-13)


def test_dissipation_of_equal_balls_follows_the_closed_formula():
    e, beta = 0.7, 0.4
    m = mill(2, law=Law(e, 100.0, beta), gravity=(0, 0, 0))
    spin = np.array([[10.0, 200, 30], [-5, 60, 70]])
    s = simulation(m, [[-0.01, 0.001, 0], [0.01, 0, 0]], [[1, 0.1, 0], [0, 0, 0.2]], spin)
    i = s.run(0.05, 1)[0]
    loss = (1 - e**2) * i.normal_speed**2 + 2 / 7 * (1 - beta**2) * i.tangential_speed**2
    assert i.dissipation == pytest.approx(m.mass()[0] / 4 * loss, rel=1e-11)


def test_sliding_friction_is_capped_by_coulomb():
    mu, e = 0.1, 0.8
    m = mill(law=Law(e, mu, 0.0), gravity=(0, 0, 0))
    s = simulation(m, [[0, 0, -0.04]], [[0, 5.0, -0.5]])
    v = s.v.copy()
    impact = s.run(0.1, 1)[0]
    kick = s.v[0] - v[0]
    normal = kick @ impact.normal
    assert normal == pytest.approx((1 + e) * impact.normal_speed, rel=1e-12)
    assert np.linalg.norm(kick - normal * impact.normal) == pytest.approx(mu * normal, rel=1e-12)


def test_mirrored_mills_run_alike():
    rng = np.random.default_rng(4)
    r = np.array([[-0.01, 0.03, 0.001], [0.012, 0.028, 0.005], [0.0, -0.03, 0.004]])
    v, w = rng.normal(0, 1, (3, 3)), rng.normal(0, 50, (3, 3))
    runs = []
    for side in (1, -1):  # mirror at the plane y = 0: rotor, angles, pitch and spins change sign
        blade = Blade(0.004, side * 0.3 + (0 if side > 0 else np.pi), 0.03, 0.01, 0.003, 0.5 * side)
        m = mill(3, law=Law(0.9, 0.3, 0.4), gravity=(0.5, -2.0 * side, -9.0), blades=(blade,),
                 shaft_radius=0.006, rotor_speed=90.0 * side)  # fmt: skip
        mirror = np.array([1, side, 1])
        runs.append(simulation(m, r * mirror, v * mirror, w * side * mirror).run(0.2, 12))
    for a, b in zip(*runs):
        assert (a.kind, a.ball, a.partner) == (b.kind, b.ball, b.partner)
        assert a.time == pytest.approx(b.time, abs=1e-10)
        assert a.position * [1, -1, 1] == pytest.approx(b.position, abs=1e-9)


@pytest.mark.slow
def test_the_books_balance_over_a_busy_run():
    rng = np.random.default_rng(7)
    blades = (
        Blade(-0.01, 0.2, 0.032, 0.012, 0.003, 0.6),
        Blade(0.012, 2.5, 0.03, 0.01, 0.004, -0.4),
    )
    m = mill(3, law=Law(0.85, 0.3, 0.3), blades=blades, shaft_radius=0.006, rotor_speed=120.0)
    r = [[-0.02, -0.03, 0.02], [0.0, 0.03, -0.025], [0.02, -0.03, 0.02]]
    s = simulation(m, r, rng.normal(0, 1, (3, 3)), rng.normal(0, 50, (3, 3)))
    before = s.energy()
    impacts = s.run(1.0, 60)
    assert len(impacts) == 60
    turnover = abs(s.rotor_work) + abs(s.dissipated)
    assert abs(s.energy() - before - s.rotor_work + s.dissipated) < 1e-13 * turnover


# The comparison itself


@pytest.mark.slow
@pytest.mark.parametrize("seed", some([17, 5, 6, 27], 4))
def test_a_finer_sampling_finds_the_same_impacts(seed):
    case = random_case(seed)
    expected = [row_of(i) for i in predict(case)]
    fine = Simulation(case.mill, case.position, case.velocity, case.spin, step=STEP / 3)
    found = [row_of(i) for i in fine.run(expected[-1].time + 1e-6)]
    assert agreement(expected, found, case.mill) == (len(expected), [])


@pytest.fixture(scope="module")
def expected():
    """The impacts of the mill that the comparison is tried on."""
    return [row_of(i) for i in predict(random_case(38))]


def wrong_pitch(mill):
    return replace(mill, blades=tuple(b._replace(pitch=-b.pitch) for b in mill.blades))


def wrong_turn(mill):
    return replace(mill, rotor_speed=-mill.rotor_speed)


def longer_blades(mill):
    longer = (b._replace(tip_radius=b.tip_radius + 1e-6) for b in mill.blades)
    return replace(mill, blades=tuple(longer))


def other_law(**change):
    def change_law(mill):
        laws = {kind: law._replace(**change) for kind, law in mill.laws.items()}
        return replace(mill, laws=laws)

    return change_law


@pytest.mark.parametrize(
    "fault",
    some(
        [
            wrong_pitch,
            wrong_turn,
            longer_blades,
            other_law(restitution=0.9),
            other_law(friction=0.0),
            other_law(tangential=0.0),
            lambda mill: replace(mill, rebound_floor=0.2),
            lambda mill: replace(mill, gravity=mill.gravity * (1 + 1e-5)),
            lambda mill: replace(mill, drum_length=mill.drum_length + 1e-7),
            lambda mill: replace(mill, radius=mill.radius[::-1].copy()),
        ],
        3,
    ),
)
def test_the_comparison_notices_a_program_that_is_wrong(fault, expected):
    case = random_case(38)
    faulty = replace(case, mill=fault(case.mill)).simulation()
    found = [row_of(i) for i in faulty.run(expected[-1].time + 1e-6)]
    same, wrong = agreement(expected, found, case.mill)
    assert same < len(expected) and wrong


@pytest.mark.parametrize("ball, apart, accepted", [(1, 1e-10, True), (0, 1e-10, False), (1, 1e-8, False)])
def test_only_simultaneous_impacts_of_different_balls_may_change_order(ball, apart, accepted):
    case = random_case(6)
    impact = row_of(case.simulation().run(1.0, 1)[0])
    one = impact._replace(kind="ball_drum", ball=0, partner=-1)
    two = one._replace(ball=ball, kind="ball_wall", partner=1, time=one.time + apart)
    found = [two._replace(time=one.time), one._replace(time=two.time)]
    assert (agreement([one, two], found, case.mill)[1] == []) == accepted
