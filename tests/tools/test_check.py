"""mill check: hard and soft spheres from several starts, what is found in words, and a second call that goes on."""

import dataclasses
import json
import math
import re

import h5py
import numpy as np
import pytest
from conftest import SMALL, SMALL_START, once, run_mill

from milltools.base.errors import UserError
from milltools.check import plan as plans
from milltools.check import verdict
from milltools.compare import load
from milltools.read.deck import Deck
from milltools.read.runfile import Run
from milltools.report import run_page

# 60 balls, so that there are impacts in 20 ms
DECK = SMALL.replace("count = 20\n", "count = 60\n")
QUICK = ("--time", "20 ms", "--starts", "2", "--modulus", "100 MPa")


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    """The folder of a check that has been made, and what it printed"""

    def make(folder):
        (folder / "deck.ini").write_text(DECK)
        done = run_mill(folder, "check", "deck.ini", "--json", *QUICK)
        (folder / "said").write_text(json.dumps([done.returncode, done.stdout, done.stderr]))

    folder = once(tmp_path_factory, "checked", make)
    return folder, json.loads((folder / "said").read_text())


def runs(folder):
    return sorted(path.name for path in (folder / "deck-check").glob("*.h5"))


# ---- the runs ----


@pytest.mark.slow
def test_each_start_is_run_with_hard_and_with_soft_spheres(checked):
    folder, (status, _, said) = checked
    assert status == 0, said
    assert runs(folder) == ["hard-1.h5", "hard-2.h5", "soft-1.h5", "soft-2.h5"]
    decks = {name: Run(str(folder / "deck-check" / name)) for name in runs(folder)}
    for name, run in decks.items():
        assert run.soft == name.startswith("soft")
        assert run.deck()["run.time"] == "0.02 s"
        assert run.status == "complete"
    assert decks["hard-1.h5"].deck()["run.seed"] != decks["hard-2.h5"].deck()["run.seed"]
    assert decks["hard-2.h5"].deck()["run.seed"] == decks["soft-2.h5"].deck()["run.seed"]
    # re-contacts within a soft contact count as one strike on both sides
    with h5py.File(folder / "deck-check/soft-1.h5") as f:
        lasts = f["run/soft/contact_duration"][()]
    windows = {run.deck()["output.strike_window"] for run in decks.values()}
    assert len(windows) == 1 and float(windows.pop().split()[0]) == pytest.approx(lasts, rel=0.01)


@pytest.mark.slow
def test_modulus_is_that_of_the_soft_runs_and_unknown_of_the_hard_ones(checked):
    folder, _ = checked
    assert Run(str(folder / "deck-check/soft-1.h5")).modulus == 1e8
    assert math.isnan(Run(str(folder / "deck-check/hard-1.h5")).modulus)


@pytest.mark.slow
def test_two_files_at_most_are_open_at_a_time(checked, monkeypatch):
    folder, _ = checked
    opened = []

    class Counted(verdict.Sampled):
        def __init__(self, path):
            opened.append(path)
            assert len(opened) <= 2  # one tells what is watched of all
            super().__init__(path)

        def close(self):
            opened.remove(self.path)
            super().close()

    monkeypatch.setattr(verdict, "Sampled", Counted)
    hard, soft = ([str(folder / f"deck-check/{kind}-{k}.h5") for k in (1, 2)] for kind in ("hard", "soft"))
    assert verdict.findings(hard, soft)
    assert not opened


@pytest.mark.slow
def test_the_report_has_a_column_of_the_rebound_floor_only_where_there_is_one(checked):
    folder, _ = checked
    for kind, has in (("hard", True), ("soft", False)):
        heads, rows = run_page.contacts(Run(str(folder / f"deck-check/{kind}-1.h5")))
        assert ("at the rebound floor" in heads) is has
        assert all(len(cells) == len(heads) for _, cells in rows)


@pytest.mark.slow
def test_the_facts_are_those_of_the_files(checked):
    folder, (_, text, _) = checked
    facts = json.loads(text)
    assert (facts["starts"], facts["modulus"], facts["time"]) == (2, 1e8, 0.02)
    assert facts["verdict"] in ("holds", "off", "open", "energy")
    for kind in ("hard", "soft"):
        energy = []
        for k in (1, 2):
            with h5py.File(folder / f"deck-check/{kind}-{k}.h5") as f:
                energy.append(f["observables/kinetic_energy/value"][:].mean())
        assert facts["quantities"]["kinetic_energy"][kind] == pytest.approx(np.mean(energy), rel=0.02)
    power = facts["quantities"]["power"]
    assert power["difference"] == pytest.approx(power["hard"] / power["soft"] - 1)


@pytest.mark.slow
def test_the_same_command_again_runs_nothing_again(checked):
    folder, (_, text, _) = checked
    before = {name: (folder / "deck-check" / name).stat().st_mtime_ns for name in runs(folder)}
    again = run_mill(folder, "check", "deck.ini", "--json", *QUICK)
    assert (again.returncode, json.loads(again.stdout)) == (0, json.loads(text))
    assert before == {name: (folder / "deck-check" / name).stat().st_mtime_ns for name in runs(folder)}


@pytest.mark.slow
def test_what_is_missing_is_run_and_another_check_is_not_mixed_with_it(checked, tmp_path):
    folder, (_, text, _) = checked
    (tmp_path / "deck.ini").write_text(DECK)
    (tmp_path / "deck-check").mkdir()
    for path in (folder / "deck-check").iterdir():
        if path.name != "soft-2.h5":
            (tmp_path / "deck-check" / path.name).write_bytes(path.read_bytes())
    again = run_mill(tmp_path, "check", "deck.ini", "--json", *QUICK)
    assert (again.returncode, json.loads(again.stdout)) == (0, json.loads(text))
    other = run_mill(tmp_path, "check", "deck.ini", *QUICK[:-1], "1 GPa")
    assert other.returncode == 2
    assert "has another check; -o gives another folder, --force starts again" in other.stderr


@pytest.mark.slow
def test_the_table_ends_with_the_sentence(checked):
    folder, (_, text, _) = checked
    done = run_mill(folder, "check", "deck.ini", *QUICK)
    *table, empty, sentence = done.stdout.rstrip("\n").split("\n")
    assert (empty, sentence) == ("", json.loads(text)["sentence"])
    assert re.match(r" +hard spheres +soft spheres +difference", table[0])
    assert table[-1].startswith("everything else: mill compare ")


# The seed gives no other start to balls that a file places.
@pytest.mark.slow
def test_balls_of_a_start_file_get_nudged_starts(tmp_path):
    (tmp_path / "start.txt").write_text(SMALL_START)
    (tmp_path / "deck.ini").write_text(SMALL.replace("count = 20\n", "count = 20\nstart = start.txt\n"))
    done = run_mill(tmp_path, "check", "deck.ini", "--json", *QUICK)
    assert done.returncode == 0, done.stderr
    first, second = (np.loadtxt(tmp_path / f"deck-check/start-{k}.txt") for k in (1, 2))
    assert (first[:, :3] == np.loadtxt(tmp_path / "start.txt")).all()
    assert (second[:, :3] == first[:, :3]).all() and (first[:, 3:6] == 0).all()
    assert 0.2e-5 < second[:, 3:6].std() < 5e-5
    seen = []
    for k in (1, 2):
        with h5py.File(tmp_path / f"deck-check/soft-{k}.h5") as f:
            seen.append(f["observables/kinetic_energy/value"][-1])
    assert seen[0] != seen[1]


# ---- what is refused ----


@pytest.mark.parametrize(
    "words, complaint",
    [
        (["--starts", "1"], "--starts 1: expected 2 or more: their scatter gives the errors"),
        (["--minutes", "0"], "--minutes 0: expected more than 0"),
        (["--minutes", "nan"], "--minutes nan: expected more than 0"),
        (["--minutes", "1e300"], "--minutes 1e+300: expected more than 0, and at most 100000"),
        (["--modulus", "3"], "expected a pressure with its unit such as '8 GPa', or 'steel', got '3'"),
        (["--time", "3"], "time: expected a time with its unit"),
        (["-s", "soft.law=cubic"], "expected 'linear' or 'hertz', got 'cubic'"),
    ],
)
def test_a_wrong_argument_is_status_2_and_makes_nothing(mill, small_deck, tmp_path, words, complaint):
    done = mill("check", "deck.ini", *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert complaint in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["deck.ini"]


def test_a_deck_that_is_not_there_is_told(mill, tmp_path):
    done = mill("check", "none.ini")
    assert (done.returncode, done.stdout) == (1, "")
    assert "none.ini" in done.stderr


def test_a_folder_that_is_a_file_is_told(mill, small_deck, tmp_path):
    (tmp_path / "deck-check").write_text("")
    done = mill("check", "deck.ini", *QUICK)
    assert done.returncode != 0 and "deck-check" in done.stderr


# ---- the plan ----


@pytest.fixture
def forecasts(monkeypatch, small_deck, the_program):
    """The deck, with processor seconds for a simulated second of soft (of SOFTEST) and hard spheres as given"""

    def set_(soft, hard):
        monkeypatch.setattr(plans, "forecast", lambda deck, seconds, *sets: (soft, 1e-4) if sets else (hard, 0.0))
        monkeypatch.setattr(plans, "cores", lambda: 2)
        return Deck.check(str(small_deck), ["run.time=10 s"])

    return set_


def test_the_stiffest_balls_for_which_there_is_time_are_taken(forecasts):
    for cheap, stiff in ((0.1, 2.1e11), (100.0, 1e10), (1e4, 1e9)):
        assert plans.make(forecasts(cheap, 1.0), 3.0).modulus == stiff


def test_what_is_asked_for_is_kept(forecasts):
    plan = plans.make(forecasts(1e4, 1.0), 3.0, modulus=5e10, starts=3, time=0.7)
    assert (plan.modulus, plan.starts, plan.time) == (5e10, 3, 0.7)


@pytest.mark.parametrize("soft", [0.01, 1.0, 30.0, 1e3])
def test_a_plan_takes_no_more_than_the_time_that_there_is(forecasts, soft):
    plan = plans.make(forecasts(soft, 0.1), None)
    assert plan.time <= 10 and plans.FEWEST <= plan.starts <= plans.MOST
    assert plan.wall <= 1.3 * 180 or plan.time <= plans.LEAST
    assert plan.contact == pytest.approx(1e-4 * (plan.modulus / 1e9) ** -0.4)


def test_more_minutes_give_more_starts_where_the_deck_is_short(forecasts):
    few, many = (plans.make(forecasts(0.01, 0.1), minutes) for minutes in (None, 6.0))
    assert (few.time, many.time) == (10, 10) and few.starts == plans.MOST < many.starts
    assert 250 < many.wall <= 6 * 60


def test_the_first_half_is_sampled_only_if_the_deck_does(forecasts):
    deck = forecasts(0.1, 0.1)
    assert plans.make(deck, 3.0, time=0.2).sample_from == (0.1 if deck.number("run.sample_from", 0.0) > 0 else 0.0)


def test_the_longest_period_counts(write_deck, the_program):
    deck = Deck.check(str(write_deck()), [])
    assert plans.period_of(deck) == pytest.approx(0.1)  # 600 rpm


# ---- the words ----


def finding(key="power", difference=0.0, error=0.01, matters=0.03, **more):
    known = dict(words=key.replace("_", " "), unit="W", hard=1.0 + difference, soft=1.0)
    return verdict.Finding(key=key, difference=difference, error=error, matters=matters, **{**known, **more})


@pytest.mark.parametrize(
    "difference, error, state",
    [
        (0.0, 0.01, "holds"),
        (0.029, 0.001, "holds"),  # less than matters, however certain
        (-0.029, 0.001, "holds"),
        (0.02, 0.02, "open"),  # it may be 0.06
        (0.04, 0.025, "open"),
        (0.1, 0.01, "off"),
        (-0.1, 0.01, "off"),
        (0.1, 0.05, "open"),
        (0.0, 0.2, "open"),  # nothing would be noticed
        (0.5, 0.1, "off"),
        (math.nan, math.nan, "open"),
        (0.01, math.inf, "open"),
    ],
)
def test_a_difference_holds_is_off_or_is_open(difference, error, state):
    assert finding(difference=difference, error=error).state == state


# Soft contacts merge impacts that are several for steel. The truth is between the rates with and without re-contacts.
def test_impacts_are_off_only_if_they_are_with_and_without_recontacts():
    assert finding("impacts_above_1", difference=-0.3, matters=0.1, bound=0.2).state == "open"
    assert finding("impacts_above_1", difference=-0.3, matters=0.1, bound=-0.05).state == "open"
    assert finding("impacts_above_1", difference=-0.3, matters=0.1, bound=-0.2).state == "off"


def test_rare_impacts_decide_nothing():
    rare = finding("impacts_above_1", difference=0.9, rare=True)
    assert rare.state == "rare" and verdict.lines([rare])[-1].endswith("too rare to compare")
    assert verdict.sentence([finding(), rare], 2.1e11)[1] == "holds"


def test_a_difference_is_told_with_its_error():
    assert finding(difference=-0.0001, error=0.001).told == "+0.0 +- 0.1 %"
    assert finding(difference=0.0061, error=0.012).told == "+0.6 +- 1.2 %"
    assert finding(difference=-0.0061, error=0.012).told == "−0.6 +- 1.2 %"
    assert finding(difference=-0.33, error=0.035).told == "−33 +- 3.5 %"
    assert finding(difference=math.nan).told == "not known"


def said(**differences):
    found = [finding(key, **({"difference": d} if isinstance(d, float) else d)) for key, d in differences.items()]
    return verdict.sentence(found, 2.1e11)


def test_all_three_hold():
    words, state = said(power=0.01, kinetic_energy=-0.01, impacts_above_1=0.02)
    assert state == "holds"
    assert words == (
        "hard spheres hold for this mill: power +1.0 +- 1 %, kinetic energy −1.0 +- 1 %, impacts above 1 +2.0 +- 1 %"
        " (soft spheres of steel)"
    )


def test_only_impacts_are_off():
    words, state = said(power=0.01, kinetic_energy=-0.01, impacts_above_1=0.3)
    assert state == "energy"
    assert words.startswith("hard spheres hold for power and energies of this mill, power +1.0")
    assert words.endswith("and less for impacts: impacts above 1 +30 +- 1 % (soft spheres of steel)")


def test_what_is_off_is_named_alone():
    words, state = said(power=0.2, kinetic_energy=-0.01, impacts_above_1=0.3)
    assert state == "off"
    told = "power +20 +- 1 %, impacts above 1 +30 +- 1 % (soft spheres of steel)"
    assert words == f"hard spheres do not hold for this mill: {told}"


def test_what_is_not_known_is_named_with_the_mend():
    words, state = said(power={"difference": 0.1, "error": 0.05}, kinetic_energy=0.0)
    assert state == "open"
    assert words == "not decided: power +10 +- 5 % (soft spheres of steel): more starts (--starts, --minutes) tell"


# One that is off decides, whatever is not known of the others.
def test_off_comes_before_open():
    assert said(power=0.2, kinetic_energy={"difference": 0.1, "error": 0.05})[1] == "off"
    assert said(power={"difference": 0.1, "error": 0.05}, impacts_above_1=0.3)[1] == "off"


# The spin is told, but hard spheres are not rejected for it.
def test_what_does_not_decide_is_not_in_the_sentence():
    words, state = said(power=0.0, rotational_energy=0.5, impacts_above_2=0.5)
    assert state == "holds" and "rotational" not in words and "above 2" not in words
    assert said(rotational_energy=0.0) == ("not decided: there is too little to compare", "open")


def test_softer_balls_than_steel_are_told_with_their_modulus():
    assert "(soft spheres of 10" in verdict.sentence([finding()], 1e10)[0]
    assert "stiffer ones can differ less" in verdict.sentence([finding(difference=0.3)], 1e10)[0]
    assert "stiffer" not in verdict.sentence([finding(difference=0.3)], 2.1e11)[0]


def test_every_line_says_whether_it_agrees():
    found = [finding(), finding(difference=0.3), finding(difference=0.1, error=0.05)]
    *_, one, two, three = verdict.lines(found)
    assert one.endswith("agrees") and two.endswith("differs") and three.endswith("not known well enough")


# ---- compare ----


@pytest.mark.slow
def test_hard_and_soft_runs_of_a_mill_are_the_same_mill_by_two_programs(checked):
    folder, _ = checked
    names = [",".join(f"deck-check/{kind}-{k}.h5" for k in (1, 2)) for kind in ("soft", "hard")]
    sides = load.sides([[str(folder / name) for name in side.split(",")] for side in names])
    assert not load.designs(*sides)
    done = run_mill(folder, "compare", *names)
    assert done.returncode == 0, done.stderr


def asked(deck="deck", minutes=None, **more):
    return {"deck": deck, "minutes": minutes, "modulus": None, "starts": None, "time": None} | more


def test_the_plan_of_something_else_is_not_taken(tmp_path):
    plan = plans.Plan(1.0, 0.5, 1e9, 1e-4, 6, 100.0)
    plans.save(tmp_path / "a", asked(), plan)
    assert plans.load(tmp_path / "a", asked()) == plan
    assert plans.load(tmp_path / "a", asked(modulus=1e9)) == plan
    for other in (asked("other"), asked(modulus=1e10), asked(time=2.0), asked(starts=5)):
        with pytest.raises(UserError, match="has another check"):
            plans.load(tmp_path / "a", other)
    (tmp_path / "a" / plans.PLAN).write_text("{}")
    with pytest.raises(UserError, match="is not the plan of a check"):
        plans.load(tmp_path / "a", asked())
    assert plans.load(tmp_path / "b", asked()) is None


def test_two_checks_in_a_folder_do_not_run_at_once(tmp_path):
    with plans.alone(tmp_path), pytest.raises(UserError, match="another check is running there"), plans.alone(tmp_path):
        pass
    with plans.alone(tmp_path):
        pass


@pytest.mark.slow
def test_a_link_in_the_folder_is_not_followed(checked, tmp_path):
    (tmp_path / "deck.ini").write_text(DECK)
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "deck-check").mkdir()
    (tmp_path / "deck-check/hard-1.h5").symlink_to(tmp_path / "precious")
    done = run_mill(tmp_path, "check", "deck.ini", "-f", *QUICK)
    assert done.returncode == 2 and "hard-1.h5: is a link" in done.stderr
    assert (tmp_path / "precious").read_text() == "mine"


def test_more_starts_or_minutes_go_on_with_the_same_stretch(tmp_path):
    plan = plans.Plan(1.0, 0.5, 1e9, 1e-4, 6, 100.0)
    plans.save(tmp_path / "a", asked(), plan)
    assert plans.load(tmp_path / "a", asked(starts=9)) == dataclasses.replace(plan, starts=9, wall=150.0)
    longer = asked(minutes=2 * plans.MINUTES)
    more = plans.load(tmp_path / "a", longer)
    assert more == dataclasses.replace(plan, starts=12, wall=200.0)
    plans.save(tmp_path / "a", longer, more)
    assert plans.load(tmp_path / "a", asked(minutes=2 * plans.MINUTES)) == more
    assert plans.load(tmp_path / "a", asked()) == more
