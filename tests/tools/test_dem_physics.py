"""mill dem: does LIGGGHTS do what the deck says? Single impacts, small mills, balances. Half a minute in all.

The whole comparison is `make validate-dem`; here are mills of 300 soft balls and some tens of milliseconds.
"""

import shutil

import numpy as np
import pytest
from conftest import some

from milltools.dem import singles
from milltools.dem.model import Model, sticking_restitution, tangential_damping
from milltools.read.deck import Deck
from milltools.read.kinds import KINDS
from milltools.read.runfile import Run

pytestmark = [pytest.mark.dem, pytest.mark.skipif(not shutil.which("liggghts"), reason="LIGGGHTS is not installed")]

MILL = """\
[run]
time = 30 ms
[balls]
count = 300
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 40 mm
length = 30 mm
[rotor]
speed = 1500 rpm
shaft_radius = 8 mm
[blades]
count = 2
tip_radius = 32 mm
width = 4 mm
thickness = 5 mm
[contact]
restitution = 0.8
[output]
frames = 0 s
"""

# A thick shaft that balls fall on; nothing else turns
SHAFT = """\
[run]
time = 30 ms
[balls]
count = 120
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 30 mm
length = 30 mm
[rotor]
speed = 1000 rpm
shaft_radius = 18 mm
[contact]
restitution = 0.8
[output]
frames = 0 s
"""

SEEDS = 16  # of millsim
SOFT_SEEDS = (1, 2)  # of LIGGGHTS
SOFTNESS = 0.05  # what 1e9 Pa is off steel: power 5 %, energy less (shared by all comparisons with LIGGGHTS)
CHANCE = 4  # standard errors


def soft_run(mill, tmp_path, deck, *options):
    output = tmp_path / "soft.h5"
    words = ["--quiet", "--force", "--modulus", "1e9", "-o", output]
    result = mill("dem", deck, *words, *options)
    assert result.returncode == 0, result.stderr
    return output


def power_and_energy(path):
    with Run(path) as run:
        time, work = run.series("rotor_work")
        _, kinetic = run.series("kinetic_energy")
    return work[-1] / time[-1], kinetic[-1]


@pytest.mark.thorough
def test_a_frictionless_start_draws_the_power_and_gains_the_energy_that_millsim_says(
    millsim, mill, write_deck, tmp_path
):
    deck = write_deck(MILL)
    hard = []
    for seed in range(1, SEEDS + 1):
        assert millsim("-q", "-f", "-o", "hard.h5", "-s", f"run.seed={seed}", deck).returncode == 0
        hard.append(power_and_energy(tmp_path / "hard.h5"))
    soft = [power_and_energy(soft_run(mill, tmp_path, deck, "-s", f"run.seed={seed}")) for seed in SOFT_SEEDS]
    scatter = np.std(hard, axis=0, ddof=1) * np.sqrt(1 / len(hard) + 1 / len(soft))
    expected = np.mean(hard, axis=0)
    off = np.abs(np.mean(soft, axis=0) - expected)
    assert (off <= CHANCE * scatter + SOFTNESS * expected).all(), (hard, soft)


LAWS = """
[contact.ball_drum]
restitution = 0.9
friction = 0.1
[contact.ball_blade]
restitution = 0.7
friction = 0.2
"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """(Deck, what singles.measure says) of a mill whose kinds of contact differ."""
    path = tmp_path_factory.mktemp("laws") / "deck.ini"
    path.write_text(MILL + LAWS)
    deck = Deck.check(path, ["contact.friction=0.3", "contact.tangential_restitution=0.467"])
    return deck, singles.measure(deck, Model(deck, 1e9), tangential_damping(deck)[0])


@pytest.mark.parametrize("kind", KINDS)
def test_single_impacts_have_the_restitution_of_their_kind_to_a_percent(measured, kind):
    deck, laws = measured
    assert laws[kind].restitution == pytest.approx(deck.contact(kind).restitution, rel=0.01)


@pytest.mark.parametrize("kind", ("ball_ball", "ball_drum", "ball_wall", "ball_shaft"))
def test_sliding_impacts_have_about_the_friction_of_their_kind(measured, kind):
    deck, laws = measured
    assert laws[kind].friction == pytest.approx(deck.contact(kind).friction, rel=0.08)


@pytest.mark.parametrize("kind", KINDS)
def test_sticking_impacts_turn_back_as_the_damped_oscillators_say(measured, kind):
    deck, laws = measured
    expected = sticking_restitution(deck.contact(kind).restitution)
    assert laws[kind].tangential_restitution == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("kind", some(("ball_shaft", "ball_drum", "ball_wall", "ball_blade"), 4))
def test_what_friction_takes_at_a_wall_closes_the_balance(mill, write_deck, tmp_path, kind):
    """Friction there and nowhere else: nothing is left over for friction between balls."""
    deck = write_deck(SHAFT if kind == "ball_shaft" else MILL)
    options = [f"contact.{kind}.friction=0.3", f"contact.{kind}.tangential_restitution=0.467"]
    path = soft_run(mill, tmp_path, deck, *(w for o in options for w in ("-s", o)))
    with Run(path) as run:
        lost, normal = (
            {k: run.series(f"{name}/{k}")[1][-1] for k in run.kinds} for name in ("dissipation", "dissipation_normal")
        )
    rubbed = {k: lost[k] - normal[k] for k in lost}
    assert rubbed[kind] > 0.02 * sum(lost.values())
    assert abs(rubbed["ball_ball"]) < 0.02 * sum(lost.values())
    # a blade's edge: normals of two programs differ by rounding of its triangles and of the overlap
    assert all(abs(rubbed[k]) < 2e-3 * sum(lost.values()) for k in lost if k not in ("ball_ball", kind))
