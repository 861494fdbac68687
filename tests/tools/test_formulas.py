"""What a study can say of keys: keys that follow from others, components of vectors, requirements on keys; and of
results: doses and wear."""

import json
import math

import numpy as np
import optuna
import pandas as pd
import pytest
from conftest import SMALL, STUDY, run_mill
from study_tables import SPEED, made, vary
from test_expression import results

from milltools.base.errors import UserError
from milltools.dose import dose, wear
from milltools.read.deck import Deck
from milltools.read.expression import parsed
from milltools.read.runfile import Run
from milltools.read.values import tell
from milltools.study.plan import designs, formulas, job, probe, ranges
from milltools.study.plan.study_deck import Study
from milltools.study.search import acquisition, search
from milltools.study.search.space import Space
from milltools.study.show import optimum, outputs, page
from milltools.study.show.data import StudyView, opened

pytestmark = pytest.mark.usefixtures("the_program")
RPM = math.tau / 60
BARS = """
[motion.sun]
kind = turn
speed = 60 rpm
[motion.jar]
kind = turn
on = sun
speed = -120 rpm
[body.bar]
shape = box
motion = jar
size = 3 2 1 mm
copies = 8
turn_by = 45 deg
[body.rib]
shape = box
size = 6 5 4 mm
"""
HEAD = "[study]\ndeck = deck.ini\nmaximise = power\n"


@pytest.fixture
def study(write_study, write_deck):
    def make(vary, sets="", head="", overrides=()):
        path = write_study(f"{HEAD}{head}\n[set]\n{sets}\n[vary]\n{vary}\n")
        write_deck(SMALL + BARS)
        return Study(path, overrides)

    return make


def orders(study, **more):
    """{key: text with its unit} that each design of a plan sets."""
    return [dict(text.split("=", 1) for text in study.job(0, one)["set"]) for one in designs.plan(study)]


# ---- keys that follow


def test_a_key_that_follows_has_its_value_in_each_design_in_si(study):
    found = orders(study("body.bar.copies = 4, 8", "body.bar.turn_by = 360 deg / body.bar.copies"))
    assert [one["body.bar.turn_by"] for one in found] == [f"{math.tau / 4!r} rad", f"{math.tau / 8!r} rad"]
    found = orders(study("motion.sun.speed = 400, 650 rpm", "motion.jar.speed=-2*motion.sun.speed"))
    assert [one["motion.jar.speed"] for one in found] == [f"{-800 * RPM!r} rad/s", f"{-1300 * RPM!r} rad/s"]


@pytest.mark.parametrize(
    "key, text, wanted",
    [
        ("body.bar.copies", "360 deg/body.bar.turn_by", "4"),
        ("body.rib.size.2", "2 * body.bar.size.1 - balls.diameter", "0.006 0.001 0.004 m"),
        ("rotor.tip_speed", "motion.sun.speed * blades.tip_radius", f"{60 * RPM * 0.022!r} m/s"),
        ("motion.jar.speed", "max(-2 * motion.sun.speed, -100 rpm)", f"{-100 * RPM!r} rad/s"),
        ("contact.friction", "abs(-0.2) * min(1 + 1, 4 / body.bar.copies, 1)", "0.1"),
        ("contact.restitution", "50 % + balls.diameter / 50 mm", "0.6"),
        ("rotor.speed", "motion.sun.speed", f"{60 * RPM!r} rad/s"),
    ],
)
def test_a_key_that_follows_has_the_kind_and_the_unit_of_its_key(study, key, text, wanted):
    found = orders(study("body.bar.turn_by = 90, 120 deg", f"{key} = {text}"))[0]
    assert found[key.removesuffix(".2")] == wanted


def test_a_key_may_follow_from_one_that_follows(study):
    sets = "body.bar.size.3 = 2 * body.bar.size.2\nbody.bar.size.2 = 2 * body.bar.size.1"
    assert orders(study("body.bar.size.1 = 1, 2 mm", sets))[1]["body.bar.size"] == "0.002 0.004 0.008 m"


def test_a_key_that_follows_may_stand_in_vary_or_on_the_command_line(study):
    line = "motion.jar.speed = -2 * motion.sun.speed"
    first = study(f"motion.sun.speed = 400, 650 rpm\n{line}")
    second = study("motion.sun.speed = 400, 650 rpm", overrides=[line.replace(" = ", "=")])
    assert orders(first) == orders(second) and list(first.formulas.derived) == ["motion.jar.speed"]


@pytest.mark.parametrize(
    "line, complaint",
    [
        ("body.bar.turn_by = 3 mm / body.bar.copies", "a.study:6: [set] body.bar.turn_by: expected an angle such as"),
        ("body.bar.turn_by = 360 / body.bar.copies", "expected an angle with its unit such as '30 deg', got '90.0'"),
        ("body.bar.turn_by = 1 deg / body.bar.copis", "neither the base deck nor the study gives body.bar.copis"),
        ("body.bar.turn_by = 1 deg / body.bar.size", "is not one number in SI (its components are .1, .2 and .3)"),
        ("body.bar.turn_by = 1 deg + 1 mm / body.bar.copies", "rad and m cannot be added or compared"),
        ("body.bar.turn_by = 1 deg / (body.bar.copies - 4)", "divides by zero"),
        ("body.bar.turn_by = 2 * body.bar.turn_by", "body.bar.turn_by follows from itself"),
        (
            "body.bar.turn_by = 1 deg * body.bar.size.2 / 1 mm\nbody.bar.size.2 = body.bar.size.1\n"
            "body.bar.size.1 = 2 mm * body.bar.turn_by / 1 deg",
            "body.bar.turn_by follows from itself, by body.bar.size.2 and body.bar.size.1",
        ),
        ("body.bar.turn_by = 1 W / power / body.bar.copies * 1 deg", "power is a result: it is known only after a run"),
        ("body.bar.turn_by = 1 deg / body.bar.copies)", "expected an expression"),
        ("motion.jar.speed = 1 Hz * body.bar.copies", "turns or radians? write rpm or rad/s"),
        ("balls.count = 2.6 * body.bar.copies", "expected a whole number such as '4000', got '10.4'"),
        ("body.*.turn_by = 1 deg / body.bar.copies", "expected one key on the left, got several (*)"),
        ("run.seed = 2 * body.bar.copies", "cannot be set: use seed, seeds or replicates of [study]"),
        ("body.bar.radius.2 = 1 mm", "a.study:6: [set] body.bar.radius.2: expected one component of a vector"),
        ("body.bar.centre.2 = 1 mm", "neither the base deck nor [set] gives body.bar.centre"),
        ("body.bar.centre.2 = 1 mm * body.bar.copies", "neither the base deck nor [set] gives body.bar.centre"),
    ],
)
def test_a_wrong_formula_is_one_line_with_its_place(study, tmp_path, monkeypatch, line, complaint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as fault:
        study("body.bar.copies = 4, 8", line)
    assert complaint in str(fault.value) and len(fault.value.lines) == 1 and "a.study" in str(fault.value)


def test_a_name_of_a_file_is_no_formula():
    known = {"balls.count"}
    assert not any(formulas.is_formula(text, known) for text in ("mine.txt", "runs-2/mine.txt", "3 N.m", "1..2 mm"))
    assert all(formulas.is_formula(text, known) for text in ("balls.count", "2*balls.count", "2 * balls.cont"))


def test_another_formula_is_another_study_and_the_same_one_however_written_the_same(study):
    sets = [f"body.bar.turn_by = {angle} deg / body.bar.copies" for angle in ("360", "180", "360.0")]
    prints = [study("body.bar.copies = 4, 8", text).fingerprint for text in sets[:2]]
    assert prints[0] != prints[1]
    spaced = study("body.bar.copies = 4, 8", sets[0].replace(" / ", "  /  "))
    assert spaced.fingerprint == prints[0] and spaced.common()["body.bar.turn_by"] == "360 deg / body.bar.copies"


def test_the_caution_of_a_study_is_gone_once_its_mend_is_written(study):
    vary = "motion.sun.speed = 400, 650 rpm\nbody.bar.copies = 4, 12"
    notes = study(vary).about()["notes"]
    mends = [note.split("'")[-2] for note in notes]
    assert mends == ["body.bar.turn_by = 360 deg / body.bar.copies", "motion.jar.speed = -2 * motion.sun.speed"]
    assert study(vary, "\n".join(mends)).about()["notes"] == []


# ---- components of vectors


def test_a_varied_component_leaves_the_others_as_they_are(study):
    found = orders(study("body.bar.size.2 = 4..8 mm step 2 mm"))
    assert [one["body.bar.size"] for one in found] == [f"0.003 {x} 0.001 m" for x in (0.004, 0.006, 0.008)]
    found = orders(study("body.*.size.1 = 7, 8 mm", "body.bar.size.3 = 9 mm"))
    assert [one["body.bar.size"] for one in found] == ["0.007 0.002 0.009 m", "0.008 0.002 0.009 m"]
    assert found[0]["body.rib.size"] == "0.007 0.005 0.004 m"


def test_a_component_is_a_number_with_the_unit_of_its_vector():
    length, direction, fall = tell(["body.a.size.2=5 mm", "motion.a.axis.3=0", "gravity.acceleration.3=-9.81 m/s^2"])
    assert (length.kind, length.value, length.unit) == ("number", 0.005, "m")
    assert (direction.value, direction.unit, fall.value) == (0.0, "1", -9.81)
    for text in ("body.a.size.2=5", "drum.radius.1=5 mm", "drum.profile.2=circle"):
        with pytest.raises(UserError, match="expected one component of a vector such as '20 mm'"):
            tell([text])


def test_a_run_is_the_same_whether_its_vector_or_a_component_is_written(study):
    one, two = (study("balls.count = 20, 30", f"body.bar.size{text}") for text in (".2 = 4 mm", " = 3 4 1 mm"))
    assert one.fingerprint == two.fingerprint


def test_the_unit_of_a_range_is_all_that_follows_its_numbers():
    assert ranges.unit_written("60..90 % critical step 10 % critical") == "% critical"
    assert ranges.NUMBER.match("90 % critical")[2] == "% critical"


# ---- requirements on keys


LIMITS = "require = body.bar.size.2 <= 2 * balls.diameter\nrequire = power <= 5 W, balls.diameter >= 4 mm"


def test_designs_that_break_a_requirement_on_keys_are_not_in_the_plan(study):
    found = study("balls.diameter = 3, 4, 5 mm\nbody.bar.size.2 = 8, 10, 12 mm", head=LIMITS)
    plan = [tuple(1e3 * x for x in one.values()) for one in designs.plan(found)]
    assert plan == [pytest.approx(pair) for pair in [(4, 8), (5, 8), (5, 10)]]  # equal sides meet it
    assert found.left_out == 6 and [one.text for one in found.require] == ["power <= 5 W"]


def test_a_requirement_may_name_a_key_that_follows(study):
    sets = "body.bar.size.1 = body.bar.size.2 / 2"
    found = study("body.bar.size.2 = 8, 10, 12 mm", sets, "require = body.bar.size.1 < 5.5 mm")
    assert len(designs.plan(found)) == 2


@pytest.mark.parametrize(
    "line, complaint",
    [
        ("balls.diameter <= 3 g", "'balls.diameter <= 3 g': m and kg cannot be compared"),
        ("balls.diameter <= 3 W / power", "power is a result: it is known only after a run"),
        ("balls.diametr <= 3 mm", "neither the base deck nor the study gives balls.diametr"),
        ("balls.diameter", "expected a requirement such as 'power <= 225 W', got 'balls.diameter'"),
    ],
)
def test_a_wrong_requirement_is_named_with_its_own_line(study, tmp_path, monkeypatch, line, complaint):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError) as fault:
        study("balls.diameter = 3, 4 mm", head=f"require = power <= 5 W\nrequire = {line}")
    assert "a.study:5: [study] require: " in str(fault.value) and complaint in str(fault.value)


def test_a_plan_without_any_possible_design_and_one_that_needs_all_are_refused(study):
    with pytest.raises(UserError, match=r"a.study:4: \[study\] require: none of 2 designs meets balls.count > 50"):
        designs.plan(study("balls.count = 20, 30", head="require = balls.count > 50"))
    head = "require = balls.count > 20\nmethod = saltelli\nsamples = 8"
    with pytest.raises(UserError, match="'method = saltelli' needs all designs; use sobol"):
        designs.plan(study("balls.count = 20, 30\ncontact.friction = 0..1", head=head))


def test_lines_of_a_list_on_the_command_line_add_up_and_replace_those_of_the_study_deck(study):
    given = ["require=power <= 1 W", "study.require=rate <= 2 1/s", "minimise=rate", "maximise="]
    found = study("balls.count = 20, 30", head=LIMITS, overrides=given)
    assert [one.text for one in found.require] == ["power <= 1 W", "rate <= 2 1/s"] and not found.formulas.rules
    assert [(o.path, o.goal) for o in found.objectives] == [("rate", "minimise")]


def test_a_forecast_tries_only_designs_that_are_possible(study):
    found = study("balls.diameter = 3..5 mm\nbody.bar.size.2 = 8..12 mm", head=LIMITS)
    tried = probe.corners(found)
    assert len(tried) == 5 and all(found.formulas.met(one) for one in tried)


@pytest.mark.slow
def test_a_search_proposes_only_designs_that_are_possible(study):
    found = study("balls.diameter = 3..5 mm\nbody.bar.size.2 = 8..12 mm", head=LIMITS)
    space = Space(found.about()["vary"], found.formulas.met)
    budget = acquisition.Budget(20)
    runs = []
    while len(runs) < budget.runs and (design := acquisition.choose(space, runs, budget)):
        runs.append(acquisition.Tried(design, -((design[0] - 0.0035) ** 2), 1e-7))
    assert len(runs) > 8 and all(found.formulas.met(dict(zip(space.keys, run.design))) for run in runs)


@pytest.mark.slow
def test_nsga_proposes_only_designs_that_are_possible(study):
    found = study("balls.diameter = 3..5 mm\nbody.bar.size.2 = 8..12 mm", head=LIMITS)
    space, budget = Space(found.about()["vary"], found.formulas.met), acquisition.Budget(80)
    sampler = search.Sampler(space, budget)
    made, seen = optuna.create_study(directions=["maximize", "minimize"], sampler=sampler), []
    for _ in range(60):
        sampler.start = acquisition.spread(space, seen, budget)
        trial = made.ask(sampler.distributions)
        seen.append(search.design_of(space, trial.params))
        made.tell(trial, [sum(seen[-1]), seen[-1][0]])
    assert len(set(seen)) > 20 and all(found.formulas.met(dict(zip(space.keys, one))) for one in seen)


# ---- a study that is run


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A sweep with all of it, in a folder of its own."""
    folder = tmp_path_factory.mktemp("formulas")
    (folder / "deck.ini").write_text(SMALL + BARS.partition("[motion.jar]")[0])
    (folder / "a.study").write_text(
        f"{HEAD}require = balls.count >= 16\nrecord = hard_rate, dose_rate, dose_rate / power, wear_depth(ball_wall), "
        "wear/all/sliding, dose/ball_to_powder\n[set]\nblades.angle_step = 360 deg / blades.count\n"
        "powder.mass = 2 g\npowder.density = 3000 kg/m^3\nwear.archard = 1e-4\nwear.hardness = 2 GPa\n"
        "run.time = 200 ms\nrun.sample_from = 20 ms\n"
        "[vary]\nblades.count = 2, 3\nballs.count = 12, 16, 20\ngravity.acceleration.2 = 0, -3 m/s^2\n"
    )
    deck = folder / "deck.ini"
    deck.write_text(deck.read_text() + "[gravity]\nacceleration = 0 0 -9.81 m/s^2\n")
    done = run_mill(folder, "sweep", "a.study", "--no-picture")
    assert done.returncode == 0, done.stderr
    return folder, done


@pytest.mark.slow
def test_a_sweep_tells_what_it_leaves_out_and_its_table_has_the_keys_that_follow(swept):
    folder, done = swept
    assert "mill sweep: 4 designs that would break balls.count >= 16 will not be run\n" in done.stderr
    rows = opened(str(folder / "a.parquet"))[1].rows
    assert len(rows) == 8 and (rows["status"] == "done").all()
    assert rows["blades.angle_step"].to_numpy() == pytest.approx(math.tau / rows["blades.count"].to_numpy())


@pytest.mark.slow
def test_the_same_command_does_no_run_again(swept):
    done = run_mill(swept[0], "sweep", "a.study", "--no-picture")
    assert done.returncode == 0 and "8 of 8 runs are there already" in done.stderr


@pytest.mark.slow
def test_a_requirement_on_keys_that_comes_later_keeps_the_runs_and_forbids_designs(swept):
    folder, _ = swept
    (folder / "b.parquet").write_bytes((folder / "a.parquet").read_bytes())
    words = "-o", "b.parquet", "-s", "require=balls.count <= 16", "--no-picture"
    done = run_mill(folder, "sweep", "a.study", *words)
    assert done.returncode == 0 and "4 of 8 runs are there already" in done.stderr, done.stderr
    view = opened(str(folder / "b.parquet"))[1]
    assert (view.feasible == (view.designs["balls.count"] <= 16)).all() and len(view.designs) == 12
    assert "that meet balls.count <= 16" in done.stdout


@pytest.mark.slow
def test_a_question_to_a_table_may_require_something_of_keys(swept):
    view = opened(str(swept[0] / "a.parquet"))[1]
    view.ask("power", ["blades.count <= 2", "blades.angle_step >= 170 deg", "power <= 1 kW"])
    assert view.feasible.sum() == 4 and (view.designs["blades.count"][view.feasible] == 2).all()


@pytest.mark.slow
def test_settings_of_a_design_have_vectors_and_keys_that_follow(swept):
    view = opened(str(swept[0] / "a.parquet"))[1]
    found = page.settings(view, 1, page.spoken(view))
    assert found == [
        "blades.count=2", "balls.count=16", "gravity.acceleration=0 -3.0 -9.81 m/s^2",
        f"blades.angle_step={math.pi!r} rad",
    ]  # fmt: skip


@pytest.mark.slow
def test_the_best_design_of_a_study_with_vectors_and_keys_that_follow_is_a_deck(swept):
    done = run_mill(swept[0], "study", "a.parquet", "--deck", "best.ini")
    assert done.returncode == 0, done.stderr
    best, found = opened(str(swept[0] / "a.parquet"))[1], Deck.check(swept[0] / "best.ini")
    design = optimum.find(best, best.objectives[0]).design
    line = best.rows.iloc[np.flatnonzero(best.design_of == design)[0]]
    assert found.number("blades.angle_step") == pytest.approx(math.tau / line["blades.count"])
    assert found.numbers("gravity.acceleration") == [0, line["gravity.acceleration.2"], -9.81]


def test_a_wall_that_cannot_be_drawn_is_told(monkeypatch, capfd):
    frame = pd.DataFrame({"drum.buckles": [2, 3]})
    rows, meta = made(frame, [vary("drum.buckles", [2, 3])], {SPEED: ("maximise", np.ones(2))})
    shown = StudyView("x", meta | {"common": {"drum.profile": "file", "drum.file": "mine.txt"}}, rows)
    assert outputs._shaped(shown, shown.objectives[0]) is None
    assert capfd.readouterr().err == (
        "mill study: note: no picture of the wall of the best design: its deck names the file mine.txt\n"
    )


@pytest.mark.slow
def test_doses_and_wear_of_a_row_are_those_of_mill_dose_and_mill_wear(swept):
    study = Study(swept[0] / "a.study")
    kept = {}

    def read(one, path):
        with Run(path) as run:
            kept.update({row.name: (row.value, row.error) for row in dose.rows(run)})
            kept["parts"] = wear.parts(wear.faces(run))
            kept["angle"] = run.as_deck.number("blades.angle_step")
        return job.read(one, path)

    row = job.run(json.loads(json.dumps(study.job(0, designs.plan(study)[0]))), read)
    for path, name in (("dose_rate", "dose rate"), ("hard_rate", "hard impacts")):
        assert (row[path], row[f"{path}:error"]) == pytest.approx(kept[name], nan_ok=True), path
    assert row["wear/all/sliding"] == pytest.approx(sum(whole.sliding for whole, _ in kept["parts"]))
    walls = [whole for whole, _ in kept["parts"] if whole.part.startswith("end wall")]
    area = sum(one.area for one in walls)
    assert row["wear_depth(ball_wall)"] == pytest.approx(sum(one.depth * one.area for one in walls) / area)
    assert kept["angle"] == row["blades.angle_step"] == pytest.approx(math.pi)


@pytest.mark.slow
def test_a_dose_or_wear_that_a_deck_does_not_give_is_refused_before_the_first_run(mill, write_study):
    for text, says in (("dose_rate", "it needs [powder]"), ("wear_depth", "it needs wear.archard and wear.hardness")):
        write_study(STUDY.replace("rotor/power", text))
        done = mill("sweep", "a.study", "-n")
        assert done.returncode == 2 and says in done.stderr and len(done.stderr.splitlines()) == 1, done.stderr


# ---- a hostile or old table


def test_a_table_with_formulas_that_make_no_sense_is_refused_in_one_line():
    frame = pd.DataFrame({"drum.buckles": [2, 3]})
    rows, meta = made(frame, [vary("drum.buckles", [2, 3])], {SPEED: ("maximise", np.ones(2))})
    with pytest.raises(UserError, match="neither the base deck nor the study gives drum.x"):
        _ = StudyView("x", meta | {"rules": ["drum.x <= 2"]}, rows).feasible


def test_the_error_of_a_modulus_or_of_a_larger_one_is_known_only_far_from_the_kink():
    def value(text):
        return parsed(text).of(results())

    assert (value("abs(3 N.m - torque * 2)").value, value("abs(-power)").error) == (3.0, 1.0)
    assert value("min(power, 60 W)").error == 1.0 and math.isnan(value("max(power, 51 W)").error)
    assert math.isnan(value("abs(power - 49 W)").error) and value("max(power, 90 W, 80 W)").value == 90
