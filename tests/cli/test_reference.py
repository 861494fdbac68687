"""The decks that come with millsim: the reference mill's figures, and the books of every deck."""

import json
import math
import subprocess

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, slow


def run_deck(name, folder, *options):
    """What the summary of a deck of input/, run in a folder, says of the run."""
    return summary_of(name, folder, *options)["run"]


def summary_of(name, folder, *options):
    done = subprocess.run(
        [PROGRAM, ROOT / "input" / name, "--quiet", "--json", "-o", "run.h5", *options],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The reference mill over 0.2 s of steady state."""
    folder = tmp_path_factory.mktemp("reference")
    summary = run_deck("simoloyer.ini", folder, "-s", "run.time=0.3s")
    with h5py.File(folder / "run.h5") as run:
        yield run, summary


def mean_since(run, name, start):
    time = run[f"observables/{name}/time"][:]
    return run[f"observables/{name}/value"][:][time >= start - 1e-9].mean()


# What an independent hard-sphere model gave for this mill, and how far two such models may differ.


@pytest.mark.long
def test_the_rotor_draws_855_watt(reference):
    run, _ = reference
    assert run["statistics/rotor/power"][()] == pytest.approx(855, rel=0.04)


@pytest.mark.long
def test_the_charge_moves_with_9_6_joule(reference):
    run, _ = reference
    assert mean_since(run, "kinetic_energy", 0.1) == pytest.approx(9.6, rel=0.02)


@pytest.mark.long
def test_the_charge_spins_with_0_66_joule(reference):
    run, _ = reference
    assert mean_since(run, "rotational_energy", 0.1) == pytest.approx(0.66, rel=0.05)


@pytest.mark.long
def test_normal_impacts_dissipate_267_watt(reference):
    run, _ = reference
    lost = 0.0
    for kind in run["observables/dissipation_normal"]:
        series = run[f"observables/dissipation_normal/{kind}"]
        value, time = series["value"][:], series["time"][:]
        lost += value[-1] - value[np.argmin(abs(time - 0.1))]
    assert lost / 0.2 == pytest.approx(267, rel=0.05)


@pytest.mark.long
def test_balls_hit_each_other_above_1_m_s_1_11_million_times_a_second(reference):
    run, _ = reference
    histogram = run["statistics/impacts/ball_ball/normal_speed/histogram"]
    fast = histogram["edges"][:-1] > 1 - 1e-9
    rate = histogram["count"][:][fast].sum() / run["statistics/duration"][()]
    assert rate == pytest.approx(1.11e6, rel=0.05)


@pytest.mark.long
def test_a_mill_of_4000_balls_needs_less_than_60_megabyte(reference):
    assert reference[1]["peak_memory"] < 60e6


@pytest.mark.thorough
def test_256_000_balls_need_at_most_600_byte_each(tmp_path):
    options = ["balls.count=256000", "balls.diameter=1.25mm", "run.time=20us", "run.sample_from=0s"]
    sets = [word for option in options for word in ("--set", option)]
    assert run_deck("gas.ini", tmp_path, *sets)["peak_memory"] < 600 * 256000


def check_books(run):
    assert run["energy_balance_error"] < 1e-9  # of the energy turned over
    assert run["largest_overlap"] < 1e-9
    assert run["overlaps"] == run["reliefs"] == run["not_closing"] == run["smoothed"] == 0


@pytest.mark.long
def test_the_books_of_the_reference_mill_close(reference):
    check_books(reference[1])


@pytest.mark.parametrize("deck", slow(sorted(path.name for path in (ROOT / "input").glob("*.ini")), "mixture.ini"))
def test_the_books_of_every_deck_close_to_rounding(deck, tmp_path):
    run = run_deck(deck, tmp_path, "-s", "run.time=60 ms", "-s", "run.sample_from=0 s", "-s", "run.precision=0")
    assert run["energy_balance_error"] < 1e-14  # of the energy turned over
    radius = 0.9 if deck == "sag.ini" else 0.15  # [m] at most: places are rounded to their size
    assert run["largest_overlap"] < 1.4e-15 * radius
    assert run["overlaps"] == run["not_closing"] == run["smoothed"] == 0


# they take some ten seconds each
COSTLY = dict.fromkeys(("bond.ini", "mixture.ini", "sag.ini"), pytest.mark.thorough)


@pytest.mark.slow
@pytest.mark.parametrize(
    "deck",
    [pytest.param(path.name, marks=COSTLY.get(path.name, ())) for path in sorted((ROOT / "input").glob("*.ini"))],
)
def test_no_deck_samples_its_start_up_and_two_seeds_agree(deck, tmp_path):
    found = [summary_of(deck, tmp_path, "--force", "-s", f"run.seed={seed}") for seed in (1, 2)]
    assert not [note for one in found for note in one["notes"] if note.startswith(("not steady", "not settled"))]
    for name in ("drive_power", "dissipated_power", "median_above_floor", "hard_per_joule"):
        a, b = (one["statistics"]["precision"][name] for one in found)
        a, b = (one.get("all", one) for one in (a, b))
        if None not in (a["standard_error"], b["standard_error"]):
            apart = 4 * math.hypot(a["standard_error"], b["standard_error"])
            assert a["value"] == pytest.approx(b["value"], abs=apart), name


@pytest.mark.slow
@pytest.mark.long
def test_the_gas_keeps_its_energy_over_half_a_million_contacts(tmp_path):
    run = run_deck("gas.ini", tmp_path, "-s", "run.time=1 s")
    check_books(run)
    assert sum(run["collisions"].values()) > 5e5
    start = 4000 * 0.5 * 7800 * np.pi / 6 * 5e-3**3  # all at 1 m/s
    assert run["kinetic_energy"] == pytest.approx(start, rel=1e-12, abs=0)
    assert run["rotational_energy"] == 0
