"""The oracle's mills of bodies and motions against cases known by pen and paper, and the comparison against wrong
programs."""

from dataclasses import replace

import numpy as np
import pytest
from any_mill import AnySimulation
from conftest import some
from decks import random_case
from few_balls import agreement, predict, row_of
from mill_decks import random_mill
from mill_parts import stl
from oracle import STEP, length
from read_mill import AnyCase, any_mill_of

DENSITY = "7800 kg/m^3"


def mill(sections, diameter="10 mm", balls=1, restitution=0.8, files=None, gravity="0 0 0 m/s^2"):
    always = {
        "gravity": {"acceleration": gravity},
        "balls": {"count": str(balls), "diameter": diameter, "density": DENSITY},
        "contact": {"restitution": str(restitution), "rebound_floor": "0 m/s"},
    }
    return any_mill_of({**always, **sections}, files or {})


def simulation(a_mill, position, velocity, spin=None):
    position = np.array(position, dtype=float)
    return AnySimulation(a_mill, position, velocity, 0 * position if spin is None else spin)


def jar(**keys):
    return {"body.jar": {"side": "inside", **keys}}


@pytest.mark.parametrize("e, ratio, value", [(0.8, 10, 4.179391), (0.5, 4, 2.379893), (0.5, 6, 3.086419)])
def test_a_ball_in_a_shaken_box_hits_both_ends_once_a_period(e, ratio, value):
    """The one-dimensional mixer mill: free path S = ratio A, walls A sin(w t)."""
    amplitude, frequency, radius = 3e-3, 25.0, 5e-3
    omega, free = 2 * np.pi * frequency, ratio * amplitude
    kappa = np.pi * (1 + e) / (1 - e)
    phase = np.arctan(2 / kappa) - np.arccos(ratio / np.hypot(kappa, 2))
    size = f"{(free + 2 * radius) * 1e3:.17g} 60 60 mm"
    shake = {"kind": "shift", "amplitude": "3 0 0 mm", "frequency": "25 Hz"}
    shake["phase"] = f"{np.degrees(phase):.17g} deg"
    m = mill({"motion.m": shake, **jar(shape="box", size=size, motion="m")}, restitution=e)
    start = -free / 2 + amplitude * np.sin(phase)  # has just left the left end
    speed = amplitude * omega * np.cos(phase) * (1 + e) / (1 - e)
    impacts = simulation(m, [[start, 0, 0]], [[speed, 0, 0]]).run(1.0, 12)
    hits = [i.normal_speed for i in impacts]
    expected = 2 * amplitude * omega * np.cos(phase) / (1 - e)
    assert expected == pytest.approx(value * amplitude * omega, rel=3e-7)
    assert hits == pytest.approx([expected] * 12, rel=1e-9)
    assert np.diff([0] + [i.time for i in impacts]) == pytest.approx(np.full(12, 0.5 / frequency))


def test_a_ball_bounces_once_a_period_on_a_shaken_plate():
    e, gamma, omega, g = 0.8, 0.8, 2 * np.pi * 30, 9.81
    amplitude = gamma * g / omega**2
    phase = np.arccos(np.pi * (1 - e) / ((1 + e) * gamma))
    shake = {"kind": "shift", "amplitude": f"0 0 {amplitude:.17g} m", "frequency": "30 Hz"}
    shake["phase"] = f"0 0 {np.degrees(phase):.17g} deg"
    plate = {"shape": "box", "size": "50 50 4 mm", "motion": "m", "centre": "0 0 -2 mm"}
    tank = jar(shape="sphere", radius="200 mm")
    m = mill({"motion.m": shake, **tank, "body.plate": plate}, restitution=e,
             gravity="0 0 -9.81 m/s^2")  # fmt: skip
    start = 5e-3 + amplitude * np.sin(phase)
    impacts = simulation(m, [[0, 0, start]], [[0, 0, np.pi * g / omega]]).run(1.0, 10)
    assert {(i.kind, i.partner) for i in impacts} == {("ball_plate", 0)}
    assert [i.normal_speed for i in impacts] == pytest.approx([2 * np.pi * g / (omega * (1 + e))] * 10, rel=1e-9)
    assert [i.time for i in impacts] == pytest.approx(2 * np.pi / omega * np.arange(1, 11))


@pytest.mark.parametrize(
    "sun, r, d, rpm, k, release, v_b, flight, v_n, v_t",
    [
        (70, 20, 15, 650, -2, 100.287, 4.9875, 12.8717, 2.3351, 3.3011),
        (70, 20, 10, 650, -2, 102.374, 5.0823, 14.9173, 3.0858, 3.4489),
        (125, 37.5, 20, 400, -2.19, 108.152, 5.8109, 26.1765, 4.3778, 3.0433),
        (70.5, 37.5, 20, 650, -2, 112.959, 5.7914, 21.4264, 5.8444, 2.0267),
    ],
)
def test_a_ball_leaves_the_wall_of_a_planetary_jar_and_meets_it_again(
    sun, r, d, rpm, k, release, v_b, flight, v_n, v_t
):
    speed, gone = rpm * 2 * np.pi / 60, 5e-4  # s since the release, where the gap has a triple root
    own = speed * (1 + k)
    centre, arm = np.array([sun, 0, 0]) * 1e-3, (r - d / 2) * 1e-3
    angle = -np.arccos(-(own**2) * arm / (speed**2 * sun * 1e-3))
    assert np.degrees(-angle) == pytest.approx(release, abs=1e-3)
    off = arm * np.array([np.cos(angle), np.sin(angle), 0])
    z = np.array([0, 0, 1.0])
    velocity = np.cross(speed * z, centre) + np.cross(own * z, off)
    assert length(velocity) == pytest.approx(v_b, abs=1e-4)
    sections = {
        "motion.sun": {"kind": "turn", "speed": f"{rpm} rpm", "angle": f"{np.degrees(speed * gone):.17g} deg"},
        "motion.jar": {"kind": "turn", "on": "sun", "centre": f"{sun} 0 0 mm", "speed": f"{k * rpm} rpm"},
        **jar(shape="cylinder", motion="jar", centre=f"{sun} 0 0 mm", radius=f"{r} mm", length="60 mm"),
    }  # fmt: skip
    m = mill(sections, diameter=f"{d} mm")
    position = centre + off + velocity * gone
    impact = simulation(m, [position], [velocity], [own * z]).run(0.1, 1)[0]
    assert impact.time + gone == pytest.approx(flight * 1e-3, abs=1e-7)
    assert impact.normal_speed == pytest.approx(v_n, abs=1e-4)
    assert impact.tangential_speed == pytest.approx(v_t, abs=1e-4)


def test_a_ball_between_two_discs_feels_the_one_that_moves():
    moves = {"kind": "shift", "amplitude": "0 0 5 mm", "frequency": "10 Hz"}
    disc = {"shape": "cylinder", "radius": "20 mm", "length": "2 mm", "kind": "ball_discs"}
    m = mill({"motion.m": moves, **jar(shape="sphere", radius="90 mm"),
              "body.low": {**disc, "motion": "m", "centre": "0 0 -10 mm"},
              "body.high": {**disc, "centre": "0 0 20 mm"}}, restitution=1)  # fmt: skip
    impacts = simulation(m, [[0, 0, 0]], [[0, 0, 0]]).run(0.2, 2)
    assert [i.kind for i in impacts] == ["ball_discs"] * 2
    when = impacts[0].time  # the disc has risen by 4 mm at sin = 0.8
    assert when == pytest.approx(np.arcsin(0.8) / (20 * np.pi))
    speed = 0.005 * 20 * np.pi * 0.6
    assert impacts[0].normal_speed == pytest.approx(speed)
    assert impacts[1].normal_speed == pytest.approx(2 * speed)
    assert impacts[1].time == pytest.approx(when + 0.014 / (2 * speed))


def test_an_edge_that_two_facets_share_is_met_once():
    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10.0]])
    facets = corners[np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]
    tetra = {"shape": "mesh", "file": "t.stl", "unit": "mm"}
    tank = jar(shape="sphere", radius="90 mm")
    m = mill({**tank, "body.t": tetra}, files={"t.stl": stl(facets, True)})
    # along the bisector of the edge on the x axis, and at the corner in the origin
    for start, towards in (([3, -20, -20], [0, 1, 1]), ([-20, -20, -20], [1, 1, 1])):
        s = simulation(m, [np.array(start) * 1e-3], [np.array(towards) * 1.0])
        (impact,) = s.run(0.03)
        assert (impact.kind, impact.partner) == ("ball_t", 0)
        assert impact.normal == pytest.approx(-np.array(towards) / length(np.array(towards)))


def test_a_drum_that_turns_rubs_and_does_not_push():
    drum = {"radius": "50 mm", "length": "60 mm", "motion": "m"}
    turn = {"kind": "turn", "axis": "1 0 0", "speed": "20 rad/s"}
    contact = {"restitution": "0.8", "friction": "0.1"}
    m = mill({"drum": drum, "motion.m": turn, "contact": contact}, diameter="10 mm")
    s = simulation(m, [[0, 0, 0]], [[0, 0, -1.0]])
    (impact,) = s.run(0.05)
    assert (impact.kind, impact.partner, impact.grip) == ("ball_drum", -1, "sliding")
    assert impact.tangential_speed == pytest.approx(20 * 0.05)
    assert s.v[0] == pytest.approx([0, 0.1 * 1.8, 0.8])  # the bottom moves along +y


# The comparison itself


@pytest.mark.slow
@pytest.mark.parametrize("seed, wavy", some([(2, True), (2, False), (6, False), (7, False), (12, True)], 5))
def test_a_mill_of_drum_and_rotor_runs_as_it_did(seed, wavy):
    case = random_case(seed, wavy)
    expected = [row_of(i) for i in predict(case)]
    other = AnySimulation(any_mill_of(case.sections, {}), case.position, case.velocity, case.spin)
    found = [row_of(i) for i in other.run(expected[-1].time + 1e-6)]
    assert agreement(expected, found, case.mill) == (len(expected), [])


@pytest.mark.slow
@pytest.mark.parametrize("seed", some([3, 8, 12, 14, 26], 5))
def test_a_finer_sampling_finds_the_same_impacts(seed):
    case = random_mill(seed)
    expected = [row_of(i) for i in predict(case)]
    fine = AnySimulation(case.mill, case.position, case.velocity, case.spin, step=STEP / 5)
    found = [row_of(i) for i in fine.run(expected[-1].time + 1e-6)]
    assert agreement(expected, found, case.mill) == (len(expected), [])


@pytest.mark.parametrize("seed", some(range(5, 10), 2))
def test_the_books_balance(seed):
    s = random_mill(seed).simulation()
    before = s.energy()
    assert s.run(0.4, 30)
    turnover = abs(s.rotor_work) + abs(s.dissipated) + abs(before)
    assert abs(s.energy() - before - s.rotor_work + s.dissipated) < 1e-12 * turnover


def changed(section, key, value):
    return lambda sections: {**sections, section: {**sections[section], key: value}}


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    some(
        [
            changed("motion.jar", "speed", "-10.0001 rad/s"),
            changed("motion.jar", "centre", "30.0001 0 0 mm"),
            changed("motion.jar", "angle", "0.0001 deg"),
            changed("motion.sun", "amplitude", "10.0001 deg"),
            changed("motion.sun", "frequency", "12.0001 Hz"),
            changed("motion.sun", "phase", "0.001 deg"),
            changed("body.jar", "end_radius", "22.00001 mm"),
            changed("body.fin", "angle", "0.001 deg"),
            changed("body.fin", "rounding", "1.001 mm"),
            changed("body.fin", "turn_by", "119.9999 deg"),
            changed("body.fin", "kind", "ball_jar"),
            changed("contact.ball_fin", "restitution", "0.95001"),
        ],
        12,
    ),
)
def test_the_comparison_notices_a_program_that_is_wrong(fault):
    sections = {
        "gravity": {"acceleration": "0 0 -9.81 m/s^2"},
        "balls": {"count": "3", "diameter": "6 mm", "density": DENSITY},
        "contact": {"restitution": "0.9", "friction": "0.2"},
        "contact.ball_fin": {"restitution": "0.95"},
        "motion.sun": {"kind": "swing", "axis": "0 1 0", "amplitude": "10 deg", "frequency": "12 Hz"},
        "motion.jar": {"kind": "turn", "on": "sun", "centre": "30 0 0 mm", "speed": "-10 rad/s"},
        "body.jar": {"shape": "cone", "side": "inside", "motion": "jar", "centre": "30 0 0 mm",
                     "radius": "30 mm", "end_radius": "22 mm", "length": "50 mm", "axis": "1 2 0"},
        "body.fin": {"shape": "box", "motion": "jar", "size": "5 8 20 mm", "centre": "20 0 0 mm",
                     "rounding": "1 mm", "copies": "3", "turn_by": "120 deg", "turn_about": "1 0 0.3"},
    }  # fmt: skip
    position = np.array([[38, 5, 5], [30, -12, -8], [22, 10, -5.0]]) * 1e-3
    velocity = np.array([[-0.5, 0, -1.0], [0.3, 0.5, 1.0], [0.5, -1.0, 0]])
    case = AnyCase(0, sections, any_mill_of(sections, {}), position, velocity, 50 * velocity, 9)
    expected = [row_of(i) for i in predict(case)]
    assert {row.kind for row in expected} == {"ball_ball", "ball_jar", "ball_fin"}
    wrong = replace(case, mill=any_mill_of(fault(sections), {})).simulation()
    found = [row_of(i) for i in wrong.run(expected[-1].time + 1e-6)]
    same, names = agreement(expected, found, case.mill)
    assert same < len(expected) and names
