"""Study decks: what they say, and that each mistake is one line with file, line and key before anything is written."""

import json
import math
import pathlib

import pytest
from conftest import SMALL, SMALL_START, STUDY
from studies import MEDIAN

from milltools.base.errors import UserError
from milltools.study.plan.ranges import Range, parse
from milltools.study.plan.study_deck import Study

RPM = math.tau / 60
pytestmark = pytest.mark.usefixtures("the_program")


# ---- ranges


@pytest.mark.parametrize(
    "key, text, values",
    [
        ("drum.buckles", "2..20", list(range(2, 21))),
        ("balls.count", "100..400 step 100", [100, 200, 300, 400]),
        ("balls.diameter", "2..10 mm step 4 mm", [0.002, 0.006, 0.01]),
        ("balls.diameter", "2..11mm step 4mm", [0.002, 0.006, 0.01]),
        ("balls.diameter", "2 mm..1 cm step 4 mm", [0.002, 0.006, 0.01]),
        ("balls.diameter", "1..16 mm in 5 log", [0.001, 0.002, 0.004, 0.008, 0.016]),
        ("balls.diameter", "1..16 mm log in 5", [0.001, 0.002, 0.004, 0.008, 0.016]),
        ("balls.count", "1..1000 in 4 log", [1, 10, 100, 1000]),
        ("balls.count", "1..3 log", [1, 2, 3]),
        ("drum.length", "2..4 in in 3", [0.0508, 0.0762, 0.1016]),
        ("rotor.speed", "600, 800, 1000 rpm", [600 * RPM, 800 * RPM, 1000 * RPM]),
        ("rotor.speed", "600 rpm, 100 rad/s", [600 * RPM, 100.0]),
        ("contact.restitution", "0.7, .8,0.9", [0.7, 0.8, 0.9]),
        ("contact.restitution", "0.7..0.9 step 0.1", [0.7, 0.8, 0.9]),
        ("contact.friction", "0.3", [0.3]),
        ("balls.fill", "5..15 % step 5 %", [0.05, 0.1, 0.15]),
        ("balls.mass", "400, 500 g", [0.4, 0.5]),
        ("balls.bulk_fill", "20..40 % step 20 %", [0.2, 0.4]),
        ("drum.diameter", "15..20 cm in 2", [0.15, 0.2]),
        ("rotor.tip_speed", "8..12 m/s step 2 m/s", [8.0, 10.0, 12.0]),
        ("drum.profile", "circle, wavy", ["circle", "wavy"]),
        ("gravity.acceleration", "0 0 -9.81 m/s^2, 0 0 0 m/s^2", ["0 0 -9.81", "0 0 0"]),
    ],
)
def test_a_range_is_its_values_in_si(key, text, values):
    found = parse(key, text)
    assert found.numeric == isinstance(values[0], (int, float))
    assert list(found.values) == (pytest.approx(values, rel=1e-15) if found.numeric else values)


def test_steps_give_the_bits_that_the_values_written_out_give():
    steps = parse("balls.diameter", "0.1..9.9 mm step 0.1 mm")
    written = parse("balls.diameter", ", ".join(f"{k // 10}.{k % 10} mm" for k in range(1, 100)))
    assert steps.values == written.values


def test_a_range_without_steps_is_every_number_between():
    found = parse("contact.restitution", "0.7..0.9")
    assert (found.values, found.low, found.high) == (None, 0.7, 0.9)
    assert [found.at(share) for share in (0.0, 0.25, 0.5)] == pytest.approx([0.7, 0.75, 0.8])


def test_a_logarithmic_range_is_even_in_the_logarithm():
    found = parse("balls.diameter", "1..100 mm log")
    assert [found.at(share) for share in (0.0, 0.5)] == pytest.approx([0.001, 0.01])
    assert found.share(0.01) == pytest.approx(0.5)


def test_whole_numbers_share_a_range_evenly():
    found = parse("drum.buckles", "2..5")
    shares = [found.at(k / 1000) for k in range(1000)]
    assert {value: shares.count(value) for value in (2, 3, 4, 5)} == dict.fromkeys((2, 3, 4, 5), 250)  # fmt: skip


def test_whole_numbers_of_a_logarithmic_range_are_even_in_the_logarithm():
    found = parse("balls.count", "10..1000 log")
    assert [found.at(share) for share in (0.0, 0.5, 0.999999)] == [10, 100, 1000]


def test_a_share_of_the_critical_speed_is_varied_in_its_own_unit():
    found = parse("motion.roll.speed", "60..90 % critical step 10 % critical")
    assert (found.values, found.unit, found.written) == ((0.6, 0.7, 0.8, 0.9), "critical", "% critical")


def test_a_range_survives_the_tables_metadata():
    for key, text in (("rotor.speed", "1..9 rpm"), ("drum.profile", "circle, wavy"), ("balls.count", "1..4")):
        found = parse(key, text)
        assert Range.of(json.loads(json.dumps(found.about()))) == found


@pytest.mark.parametrize(
    "key, text, complaint",
    [
        ("rotor.speed", "", "got nothing"),
        ("rotor.speed", "600,,800 rpm", "got '600,,800 rpm'"),
        ("rotor.speed", "600, 600 rpm", "expected different values, got '600 rpm' twice"),
        ("rotor.speed", "60 rpm, 1 Hz", "an angular speed"),
        ("rotor.speed", "60 rpm, 70 % critical", "expected all values in one kind of unit, got critical and rad/s"),
        ("rotor.speed", "1..2 rpm step 1 % critical", "got critical and rad/s"),
        ("rotor.speed", "0..1000", "expected an angular speed with its unit such as '1000 rpm', got '0'"),
        ("rotor.speed", "1000..600 rpm", "expected a range from low to high, got '1000..600 rpm'"),
        ("rotor.speed", "0..600 rpm log", "expected a range above 0 for 'log', got '0..600 rpm log'"),
        ("rotor.speed", "1..2 rpm step 0 rpm", "expected a step above 0, got '1..2 rpm step 0 rpm'"),
        ("rotor.speed", "1..2 rpm step", "(unknown unit 'rpm step')"),
        ("rotor.speed", "1..2 rpm step 1 mm", "expected an angular speed"),
        ("rotor.speed", "1..2 rpm step 1 rpm in 3", "got both 'step' and 'in'"),
        ("rotor.speed", "1..2 rpm step 1 rpm log", "got 'step' and 'log'"),
        ("rotor.speed", "1..2 rpm log log", "got 'log' twice"),
        ("rotor.speed", "1..2 rpm in 1", "expected 'in 2' to 'in 1000000', got 'in 1'"),
        ("rotor.speed", "0..1 rpm step 1e-9 rpm", "expected at most 1000000 values"),
        ("rotor.speed", "slow..fast rpm", "'fast rpm' as the end"),
        ("contact.restitution", ".7...9", "(numbers such as 0.5 on both sides of '..')"),
        ("contact.restitution", "0.5..1.5", "must be between 0 and 1, got '1.5'"),
        ("balls.count", "1..5 step 0.5", "expected a whole number such as '4000', got '1.0'"),
        ("drum.profile", "circle, oval", "expected 'circle', 'wavy', 'lifters', 'harmonics' or 'file', got 'oval'"),
        ("gravity.acceleration", "0..1 m/s^2", "three numbers"),
        ("rotor.sped", "1 rpm", "unknown key; did you mean 'speed'?"),
    ],
)  # fmt: skip
def test_a_wrong_range_says_what_was_expected(key, text, complaint):
    with pytest.raises(UserError) as fault:
        parse(key, text)
    assert complaint in str(fault.value)
    assert fault.value.status == 2


# ---- study decks


def test_a_study_deck_is_read(write_study, tmp_path):
    study = Study(write_study())
    assert [(o.path, o.goal) for o in study.objectives] == [(MEDIAN, "maximise")]
    assert (study.record, study.replicates, study.seeds) == (["rotor/power"], 1, "shared")
    assert [r.key for r in study.vary] == ["rotor.speed", "balls.count"]
    assert study.deck == str(tmp_path / "deck.ini")
    assert [value.order for value in study.fixed] == ["run.time=0.06 s"]


def test_several_objectives_of_both_kinds(write_study):
    text = STUDY.replace("record = ", "minimise = strikes/all/rate, ")
    study = Study(write_study(text))
    assert [(o.path, o.sign) for o in study.objectives] == [
        (MEDIAN, 1),
        ("strikes/all/rate", -1),
        ("rotor/power", -1),
    ]


def test_precision_and_most_collisions_are_those_of_each_run(write_study):
    study = Study(write_study(STUDY.replace("[set]", "precision = 2 %\nmax_collisions = 3e7\n[set]")))  # fmt: skip
    orders = study.job(0, {"rotor.speed": 60.0, "balls.count": 10})["set"]
    assert {"run.precision=0.02", "run.max_collisions=30000000"} <= set(orders)


def test_an_override_may_name_study_set_and_vary(write_study):
    study = Study(write_study(), ["study.replicates=3", "rotor.speed=500rpm", "vary.drum.length=30, 40 mm"])
    assert study.replicates == 3
    assert [r.key for r in study.vary] == ["balls.count", "drum.length"]
    assert f"rotor.speed={500 * RPM!r} rad/s" in [value.order for value in study.fixed]


@pytest.mark.parametrize(
    "old, new, complaint",
    [
        ("[study]", "[studie]", "a.study:2: [studie]: unknown section; there are [study], [set], [vary] and [life]"),
        ("deck = deck.ini\n", "", "a.study: [study] deck: missing; expected the name of the base deck"),
        ("deck.ini", "none.ini", "a.study:2: [study] deck: none.ini: no such file"),
        ("record = ", "remark = ", "a.study:4: [study] remark: unknown key; there are deck, "),
        ("maximise = ", "deck = ", "is given twice (first in line 2)"),
        ("maximise = ", "# ", "a.study: [study] maximise: missing, and so is minimise"),
        ("maximise = impacts", "maximise = im pacts", "a.study:3: [study] maximise: 'im pacts/all"),
        ("record = ", "replicates = 0\n#",
         "a.study:4: [study] replicates: expected a whole number from 1 to 10000, got '0'"),
        ("record = ", "replicates = 1.5\n#", "expected a whole number from 1 to 10000, got '1.5'"),
        ("record = ", "seeds = mine\n#", "a.study:4: [study] seeds: expected shared or own, got 'mine'"),
        ("record = ", "method = full\n#",
         "a.study:4: [study] method: expected grid, lhs, sobol or saltelli, got 'full'"),
        ("record = ", "method = lhs\n#",
         "a.study: [study] samples: missing; 'method = lhs' needs the number of samples"),
        ("record = ", "samples = 9\n#", "a.study:4: [study] samples: is only for the methods"),
        ("record = ", "precision = 2 mm\n#",
         "a.study:4: [study] precision: expected a share such as '1 %', got '2 mm'"),
        ("record = ", "cpu_limit = 5\n#", "a.study:4: [study] cpu_limit: expected a time with its unit"),
        ("record = ", f"minimise = {MEDIAN}\n#",
         "a.study:4: [study] minimise: '" + MEDIAN + "' is an objective of 'maximise' already"),
        ("run.time = 60 ms", "run.time = 10",
         "a.study:6: [set] run.time: expected a time with its unit such as '10 ms', got '10'"),
        ("run.time = 60 ms", "run.tim = 10", "a.study:6: [set] run.tim: unknown key; did you mean 'time'?"),
        ("run.time = 60 ms", "run.seed = 1", "run.seed: cannot be set: use seed, seeds or replicates of [study]"),
        ("rotor.speed = 300, ", "rotor.speed = 300 mm, ", "a.study:8: [vary] rotor.speed: expected an angular speed"),
        ("rotor.speed = ", "rotor.sped = ", "a.study:8: [vary] rotor.sped: unknown key; did you mean 'speed'?"),
        ("rotor.speed = 300, 600, 900 rpm", "run.time = 1, 2 s",
         "a.study:8: [vary] run.time: is given in [set] already (a.study:6)"),
        ("rotor.speed = 300, 600, 900 rpm", "run.seed = 1, 2",
         "a.study:8: [vary] run.seed: cannot be varied: use seed, seeds or replicates"),
        ("balls.count = 40..60 step 20", "rotor.speed = 1 rpm",
         "a.study:9: [vary] rotor.speed: is given twice (first in line 8)"),
        ("[vary]", "[set]", "a.study:7: [set]: is given twice (first in line 5)"),
        ("[set]", "set", "a.study:5: expected '[section]' or 'key = value', got 'set'"),
        ("[study]\n", "", "a.study:1: deck: stands before the first [section]"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(write_study, tmp_path, monkeypatch, old, new, complaint):
    assert old in STUDY
    monkeypatch.chdir(tmp_path)
    write_study(STUDY.replace(old, new, 1))
    with pytest.raises(UserError) as fault:
        Study("a.study")
    assert complaint in str(fault.value)
    assert fault.value.status == 2


def test_a_mistake_in_the_base_deck_is_named_with_its_own_line(write_study, write_deck, tmp_path):
    path = write_study()
    write_deck(SMALL.replace("radius = 30 mm", "radius = 30 s", 1))
    with pytest.raises(UserError) as fault:
        Study(path)
    assert str(fault.value).startswith(f"{tmp_path}/deck.ini:8: [drum] radius: expected a length")


def test_all_mistakes_in_the_base_deck_are_named_at_once(write_study, write_deck, tmp_path):
    path = write_study()
    write_deck(SMALL.replace("radius = 30 mm", "inner_radius = 30 s", 1).replace("time = 50 ms", "time = 50 mm"))
    with pytest.raises(UserError) as fault:
        Study(path)
    assert [line.removeprefix(f"{tmp_path}/deck.ini:")[:21] for line in fault.value.lines] == [
        "2: [run] time: expect",
        "8: [drum] inner_radiu",
    ]


def test_an_empty_vary_is_refused(write_study):
    with pytest.raises(UserError, match=r"\[vary\]: missing or empty"):
        Study(write_study(STUDY.partition("[vary]")[0]))


# ---- what decides a run

DESIGN = {"rotor.speed": 60.0, "balls.count": 10}


def test_a_run_is_known_by_what_decides_it_not_by_how_it_is_written(write_study, write_deck):
    first = Study(write_study()).job(0, DESIGN)["id"]
    again = Study(write_study("# a remark\n" + STUDY.replace("60 ms", "0.06 s")))
    write_deck(
        "; remark\n" + SMALL.replace("radius = 30 mm", "radius = 3 cm").replace("frames = 5 ms", "frames = 1 ms")
    )
    assert again.job(0, DESIGN)["id"] == first
    assert Study(again.file).job(3, DESIGN)["id"] == first


def test_a_number_of_balls_that_set_gives_replaces_the_one_of_the_deck(write_study):
    one = STUDY.replace("balls.count = 40..60 step 20\n", "")
    assert "balls.count" in Study(write_study(one)).common()
    common = Study(write_study(one.replace("[set]\n", "[set]\nballs.mass = 30 g\n"))).common()
    assert common["balls.mass"] == "0.03 kg" and "balls.count" not in common


@pytest.mark.parametrize(
    "old, new",
    [
        ("run.time = 60 ms", "run.time = 11 ms"),
        ("run.time = 60 ms", "run.time = 60 ms\ncontact.friction = 0.2"),
        ("record = rotor/power", "record = rotor/torque"),
        ("record = ", "seed = 5\nrecord = "),
        ("record = ", "precision = 1 %\nrecord = "),
    ],
)
def test_another_run_has_another_identity(write_study, old, new):
    first = Study(write_study()).job(0, DESIGN)["id"]
    assert Study(write_study(STUDY.replace(old, new, 1))).job(0, DESIGN)["id"] != first


def test_what_a_start_file_holds_decides_the_run(write_study, write_deck):
    text = STUDY.replace("balls.count = 40..60 step 20", "").replace("[set]", "[set]\nballs.start = s.txt")  # fmt: skip
    path = write_study(text)
    ids = []
    for start in (SMALL_START, SMALL_START.replace("-0.016", "-0.0161")):
        write_deck(start, "s.txt")
        ids.append(Study(path).job(0, {"rotor.speed": 60.0})["id"])
    assert ids[0] != ids[1]


def test_a_run_finds_the_files_of_its_deck_and_what_they_hold_decides_it(write_study, write_deck, tmp_path):
    path = write_study(STUDY.replace("[set]", "[set]\ncontact.restitution_table = law.txt"))
    ids = []
    for law in ("0 0.8\n9 0.5\n", "0 0.8\n9 0.6\n"):
        write_deck(law, "law.txt")
        study = Study(path)
        ids.append(study.job(0, DESIGN)["id"])
        assert f"contact.restitution_table={tmp_path}/law.txt" in study.job(0, DESIGN)["set"]
    assert ids[0] != ids[1]


def test_shared_seeds_are_those_of_the_replicates_own_ones_all_different(write_study):
    study = Study(write_study(), ["study.replicates=3", "study.seed=7"])
    assert [study.seed_of(design, k) for design in (0, 5) for k in range(3)] == [7, 8, 9] * 2
    own = Study(study.file, ["study.replicates=3", "study.seed=7", "study.seeds=own"])
    assert len({own.seed_of(design, k) for design in range(10) for k in range(3)}) == 30


def test_a_job_can_be_sent_anywhere(write_study):
    job = Study(write_study()).job(4, DESIGN, 0)
    assert json.loads(json.dumps(job)) == job
    assert pathlib.Path(job["deck"]).is_absolute() and pathlib.Path(job["program"]).is_absolute()
    assert (job["design"], job["replicate"], job["seed"]) == (4, 0, 1)


def test_an_empty_value_takes_a_key_out_of_the_base_deck(write_study):
    whole = Study(write_study())
    study = Study(write_study(STUDY.replace("[set]", "[set]\ncontact.friction =")))
    rows = [pair for pair in zip(whole.deck_text.splitlines(), study.deck_text.splitlines(), strict=True)]
    assert [before for before, after in rows if before != after] == ["friction = 0.3"]
    assert "contact.friction" not in study.base
    assert whole.job(0, DESIGN)["id"] != study.job(0, DESIGN)["id"]


def test_only_a_key_of_the_base_deck_can_be_taken_out(write_study, tmp_path):
    with pytest.raises(UserError) as fault:
        Study(write_study(STUDY.replace("[set]", "[set]\nblades.pitch =")))
    assert str(fault.value) == (
        f"{tmp_path}/a.study:6: [set] blades.pitch: an empty value removes a key from the base deck, but the base deck "
        "has no such key"
    )


def test_varied_start_files_are_found_from_anywhere(write_study, write_deck, tmp_path):
    write_deck(SMALL_START, "s.txt")
    study = Study(write_study(STUDY.replace("balls.count = 40..60 step 20", "balls.start = random, s.txt")))
    orders = [study.job(0, {"rotor.speed": 60.0, "balls.start": name})["set"] for name in ("random", "s.txt")]
    assert "balls.start=random" in orders[0]
    assert f"balls.start={tmp_path}/s.txt" in orders[1]
