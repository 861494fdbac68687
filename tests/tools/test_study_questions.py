"""A study answers questions: requirements, objectives asked afterwards, keys of several sections, its cost before it
starts, its page."""

import csv
import json
import math
import re
import shlex

import numpy as np
import pytest
import study_tables as made
from conftest import SMALL, STUDY, run_mill
from test_study_show import SPEED, line_of, view

from milltools.base.errors import UserError
from milltools.read.deck import Deck
from milltools.study.plan import probe
from milltools.study.plan.study_deck import Study
from milltools.study.plan.table import Table
from milltools.study.search.acquisition import Budget, Tried, choose
from milltools.study.search.space import Space
from milltools.study.show import canvas, contour, data, optimum, outputs, page, slices, summary, tradeoff

HARD = """\
[study]
deck = deck.ini
maximise = rate_above(0.1 uJ) / power
require = power <= 1 W
record = power / mass
replicates = 2
[set]
run.time = 60 ms
[vary]
rotor.speed = 300, 600, 900 rpm
"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The table of HARD."""
    folder = tmp_path_factory.mktemp("hard")
    (folder / "deck.ini").write_text(SMALL)
    (folder / "hard.study").write_text(HARD)
    done = run_mill(folder, "sweep", "hard.study", "-q")
    assert done.returncode == 0, done.stderr
    return folder / "hard.parquet"


def limited(limit=None):
    """Five designs whose speed rises with the key, and of which the first three meet SPEED <= 1.3 m/s."""
    more = {"require": [f"{SPEED} <= {limit}"]} if limit else {}
    return view(*line_of([1.0, 1.2, 1.25, 1.6, 2.0], [0.01] * 5, noise=False, **more))


# ---- requirements


def test_the_best_design_is_the_best_of_those_that_meet_the_requirement():
    free, bound = limited(), limited("1.3 m/s")
    assert optimum.find(free, free.objectives[0]).design == 4
    assert optimum.find(bound, bound.objectives[0]).design == 2
    assert bound.feasible.tolist() == [True, True, True, False, False]


def test_a_design_whose_interval_reaches_beyond_the_limit_is_called_unsure():
    near, far = limited("1.26 m/s"), limited("1.4 m/s")
    said = ["\n".join(summary.optimum_lines(one, one.objectives[0])) for one in (near, far)]
    assert "within its error it may not meet this" in said[0] and "may not meet" not in said[1]


def test_a_better_neighbour_beyond_the_limit_is_told():
    bound, free = limited("1.3 m/s"), limited()
    (line,) = summary.beyond(bound, bound.objectives[0], 2)
    low, high = (bound.axes[0].tell(value) for value in (90, 105))
    assert line.startswith(
        f"a {bound.axes[0].short} between {low} and {high} may be better: {high} is, but does not meet"
    )
    assert not summary.beyond(bound, bound.objectives[0], 1) and not summary.beyond(free, free.objectives[0], 2)


def test_designs_that_break_a_requirement_are_the_last_of_the_table_and_say_which():
    shown = limited("1.3 m/s")
    _, *lines = summary.best_table(shown, shown.objectives[0])
    assert [line[0] for line in lines] == ["1", "2", "3", "", ""]
    assert [line[-1] for line in lines][::4] == ["best", f"{SPEED} 1.6 > 1.3 m/s"]
    assert f"; last those that do not meet {SPEED} <= 1.3 m/s" in "\n".join(summary.lines(shown))
    assert len(summary.best_table(shown, shown.objectives[0], 4)) == 5


def test_the_lines_of_a_study_shade_what_a_requirement_forbids_and_show_the_point_of_the_best_design():
    shown = limited("1.3 m/s")  # 90 rad/s has 1.25 m/s and 105 rad/s 1.6 m/s
    (ax,) = slices.draw(shown, shown.objectives[0]).axes[:1]
    (area,) = (one for one in ax.collections if one.get_label() == f"does not meet {SPEED} <= 1.3 m/s")
    (path,) = area.get_paths()
    assert (path.vertices[:, 0].min(), path.vertices[:, 0].max()) == pytest.approx(
        (90 + 15 * 0.05 / 0.35, ax.get_xlim()[1])
    )
    look = {line.get_markerfacecolor(): line.get_xdata() for line in ax.lines}  # hollow points, hollow star
    assert look["white"] == pytest.approx([105, 120]) and look["none"] == pytest.approx([90])


def test_a_label_of_the_trade_off_covers_no_other_point():
    figure = canvas.new(4, 4)
    ax = figure.subplots()
    shown, x = limited(), np.array([0.5, 0.55, 0.0, 1.0, 0.5])
    y = np.array([0.5, 0.52, 0.0, 1.0, 0.9])
    ax.plot(x, y, "o")
    figure.draw_without_rendering()
    tradeoff._labels(ax, shown, x, y, [0])
    box = ax.texts[0].get_window_extent()
    assert not any(box.contains(*spot) for spot in ax.transData.transform(np.column_stack([x, y])))


def test_where_no_design_meets_the_requirement_the_nearest_is_named():
    shown = limited("0.5 m/s")
    said = "\n".join(summary.lines(shown))
    assert f"none: no design that was run meets {SPEED} <= 0.5 m/s" in said
    assert "may not meet" not in said and f"{SPEED} 1 < 0.5" not in said and f"{SPEED} 1 > 0.5 m/s" in said
    assert "nearest to it is rotor speed = 572.96 rpm" in said and summary.finding(shown, shown.objectives[0]) == ""


def test_where_no_run_has_the_value_that_is_required_this_is_one_line():
    rows, meta = line_of([1.0, 2.0], [0.01] * 2, require=["rotor/power <= 1 W", f"{SPEED} <= 9 m/s"])
    shown = view(rows.assign(**{"rotor/power": math.nan, "rotor/power:error": math.nan}), meta)
    said = "optimum    none: no design has a value of what is required, "
    assert summary.optimum_lines(shown, shown.objectives[0]) == [f"{said}rotor/power <= 1 W and {SPEED} <= 9 m/s"]
    text = "\n".join(summary.lines(shown))
    assert "rotor/power has no value" in text and "nan" not in text and page.render(shown, shown.objectives[0], [])
    one = view(rows.assign(**{"rotor/power": [math.nan, 3.0], "rotor/power:error": math.nan}), meta)
    assert "nearest to it is rotor speed = 1145.9 rpm" in summary.optimum_lines(one, one.objectives[0])[1]


@pytest.mark.slow
def test_a_requirement_of_another_unit_is_refused_before_the_first_run(mill, write_study, tmp_path):
    write_study(HARD.replace("1 W", "1 kg"))
    done = mill("sweep", "a.study")
    assert done.returncode == 2 and "a.study:4: [study] require: 'power <= 1 kg'" in done.stderr
    assert not (tmp_path / "a.parquet").exists()


@pytest.mark.slow
def test_a_search_ends_at_the_best_design_within_the_limit():
    """Maximise x with y = x^2 <= 0.25: the search must end near x = 0.5, far from the best of all."""
    space = Space([made.vary("contact.restitution", low=0.0, high=1.0)])
    runs, random = [], np.random.default_rng(3)
    for _ in range(24):
        design = choose(space, runs, Budget(24))
        if design is None:
            break
        x = design[0]
        excess = x**2 - 0.25 + 0.002 * random.standard_normal()
        runs.append(Tried(design, x + 0.002 * random.standard_normal(), 0.002, "done", ((excess, 0.002),)))
    good = [run.design[0] for run in runs if run.excess[0][0] <= 0]
    assert 0.45 < max(good) <= 0.51
    assert sum(run.design[0] > 0.7 for run in runs) < 6


# ---- questions afterwards


@pytest.mark.slow
def test_another_question_is_answered_from_the_table(mill, swept):
    done = mill("study", str(swept), "--objective", "minimise power / mass", "--require", "rate >= 1/s")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("hard: power per mass of the balls [W/kg], minimised")
    assert "rate >= 1/s: 3 of 3 designs meet this" in done.stdout


def test_a_new_limit_replaces_that_of_the_study(swept):
    shown = data.opened(str(swept))[1]
    shown.ask(None, ["power <= 2 W"])
    assert [one.text for one in shown.require] == ["power <= 2 W"]


def test_an_objective_asked_afterwards_is_that_of_the_rows(swept):
    shown = data.opened(str(swept))[1]
    stored, computed = shown.estimate("rate_above(0.1 uJ) / power"), shown.estimate("rate_above(0.1 uJ)/power")
    assert computed.mean == pytest.approx(stored.mean, rel=1e-12)


def test_a_table_of_an_earlier_version_says_that_it_has_no_results():
    shown = limited()
    with pytest.raises(UserError) as fault:
        shown.ask("rate / power")
    assert f"there are only {SPEED}" in str(fault.value)


def test_a_table_without_the_column_of_results_still_opens(tmp_path):
    import pyarrow.parquet

    rows, meta = line_of([1.0, 2.0], [0.1, 0.1])
    path = made.write(tmp_path / "old.parquet", rows, meta)
    stored = pyarrow.parquet.read_table(path)
    pyarrow.parquet.write_table(stored.drop_columns(["results"]), path)
    assert Table.open(path).frame()["results"].tolist() == ["", ""]
    outputs.csv(data.opened(str(path))[1], tmp_path / "a.csv")
    assert f",rotor.speed [rad/s],{SPEED} [m/s],standard" in (tmp_path / "a.csv").read_text()


# ---- keys


def test_a_key_with_a_star_sets_all_sections_of_the_base_deck(write_study, write_deck):
    blades = "[blade.a]\nposition = 0 mm\nangle = 0 deg\ntip_radius = 20 mm\nwidth = 6 mm\nthickness = 4 mm\n"
    path = write_study(STUDY + "blade.*.pitch = 0, 30 deg\n")
    write_deck(SMALL + blades + blades.replace("blade.a", "blade.b"))
    study = Study(path)
    job = study.job(0, {"rotor.speed": 60.0, "balls.count": 40, "blade.*.pitch": 0.5})
    assert [text for text in job["set"] if "pitch" in text] == ["blade.a.pitch=0.5 rad", "blade.b.pitch=0.5 rad"]


def test_a_star_that_names_no_section_is_refused(write_study):
    with pytest.raises(UserError, match=r"blade\.\*\.pitch: no section of the base deck is named so"):
        Study(write_study(STUDY + "blade.*.pitch = 0, 30 deg\n")).fingerprint


def test_the_unit_of_an_override_is_that_of_the_axes(write_study):
    study = Study(write_study(), ["vary.rotor.speed=10..20 rad/s step 5 rad/s"])
    assert study.about()["vary"][0]["written"] == "rad/s"


def test_a_forecast_tries_only_designs_of_the_plan(write_study):
    text = STUDY.replace("300, 600, 900 rpm", "900, 300, 600 rpm").replace("40..60 step 20", "40..90 step 20")
    found = probe.corners(Study(write_study(text)))
    assert {one["balls.count"] for one in found} <= {40, 60, 80}
    assert {round(one["rotor.speed"] * 30 / math.pi) for one in found} == {300, 600, 900}


MOVING = """
[motion.sun]
kind = turn
speed = 60 rpm
[motion.arm]
kind = turn
on = sun
speed = 0 rpm
[motion.jar]
kind = turn
on = arm
speed = -120 rpm
[body.jar]
shape = cylinder
side = inside
radius = 30 mm
length = 30 mm
motion = jar
[body.pin]
shape = cylinder
motion = jar
centre = 20 0 0 mm
radius = 1 mm
length = 9 mm
copies = 8
turn_by = 45 deg
"""
RATIO = "is not: the ratio of the speeds of 'sun' and of 'jar', which it carries, is different in each design"


@pytest.mark.parametrize(
    "vary, said",
    [
        ("body.pin.copies = 4, 8", "4 with body.pin.turn_by = 45 deg: 4 times this angle are 180 deg, and in the base"),
        ("body.pin.copies = 3, 4\nbody.pin.turn_by = 45 deg, 60 deg", ""),
        ("body.pin.copies = 4, 8, 12\nbody.pin.turn_by = 360 deg / body.pin.copies", ""),
        ("body.pin.turn_by = 45, 30 deg", "write 'body.pin.copies = 360 deg / body.pin.turn_by' into [set]"),
        (
            "body.pin.copies = 4, 8, 12",
            "12 with body.pin.turn_by = 45 deg: only 8 places, so 4 of the copies are where",
        ),
        (
            "body.*.turn_by = 45, 120 deg",
            "8 with body.pin.turn_by = 120 deg: only 3 places, so 5 of the copies are where",
        ),
        ("body.pin.copies = 8, 12\nbody.pin.shift_by = 0 0 1 mm", ""),
        *(
            (
                f"body.pin.copies = 7, 14\nbody.pin.turn_by = {angle} deg, 10 deg",
                f"14 with body.pin.turn_by = {angle:.6g} deg: only 7 places, so 7 of the copies are where",
            )
            for angle in (51.4, 51.43, 51.4286, 51.428571, 360 / 7)
        ),
        ("body.pin.copies = 14\nbody.pin.turn_by = 51 deg, 25.72 deg", ""),
        ("body.pin.copies = 50\nbody.pin.turn_by = 0.2 deg, 7 deg", ""),
        ("body.*.copies = 4, 8", "write 'body.pin.turn_by = 360 deg / body.pin.copies' into [set]"),
        ("motion.sun.speed = 60, 80 rpm", f"motion.sun.speed is varied, and motion.jar.speed {RATIO}"),
        ("motion.sun.speed = 60, 80 rpm", "to keep it write 'motion.jar.speed = -2 * motion.sun.speed' into [set]"),
        ("motion.sun.speed = 60, 80 rpm\nmotion.jar.speed = -2 * motion.sun.speed", ""),
        ("motion.jar.speed = 60, 80 rpm", f"motion.jar.speed is varied, and motion.sun.speed {RATIO}"),
        ("motion.sun.speed = 60, 80 rpm\nmotion.jar.speed = -120, -160 rpm", ""),
    ],
)
def test_a_study_warns_of_copies_in_one_place_and_of_a_changing_ratio_of_speeds(write_study, write_deck, vary, said):
    path = write_study(STUDY.partition("[vary]")[0] + f"[vary]\n{vary}\n")
    write_deck(SMALL + MOVING)
    notes = Study(path).about()["notes"]
    assert len(notes) == bool(said) and said in "".join(notes)


def test_a_study_that_is_refused_has_no_warnings(write_study, write_deck, capsys):
    path = write_study(STUDY.partition("[vary]")[0] + "[vary]\nbody.*.copies = 12, 16\n")
    write_deck(SMALL + MOVING)
    study = Study(path)
    assert "only 8 places" in "".join(study.about()["notes"])
    with pytest.raises(UserError, match=r"\[body.jar\]"):
        probe.probe("mill sweep", study, [{"body.*.copies": count} for count in (12, 16)])
    assert capsys.readouterr().err == ""


# ---- the cost


@pytest.mark.slow
def test_a_dry_run_tells_runs_and_cost_and_writes_nothing(mill, write_study, tmp_path):
    write_study(STUDY + "contact.friction = 0..0.3 step 0.3\ncontact.restitution = 0.8, 9e-1\n")
    before = sorted(tmp_path.iterdir())
    done = mill("sweep", "a.study", "--dry-run", "--workers", "2")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("plan       24 designs, 1 run each: 24 runs\n")
    said = "rotor.speed = 300 rpm, balls.count = 40, contact.friction = 0, contact.restitution = 0.8: "
    assert said in done.stdout
    assert re.search(r"cost +at least .* of CPU", done.stdout) and "with 2 runs at a time" in done.stdout
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.slow
def test_a_dry_run_of_a_search_counts_the_runs_that_are_missing_and_warns(mill, write_study, write_deck, tmp_path):
    write_study()
    write_deck(
        SMALL + "[body.pin]\nshape = sphere\nradius = 1 mm\nmotion = rotor\ncentre = 0 15 0 mm\n"
        "copies = 3\nturn_by = 180 deg\nturn_about = 1 0 0\n"
    )
    done = mill("optimize", "a.study", "-n", "--runs", "7")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("mill optimize: warning: body.pin.copies = 3 with body.pin.turn_by = 180 deg: only 2")
    assert done.stdout.startswith("plan       at most 7 runs\n") and not list(tmp_path.glob("*.parquet*"))


# ---- pictures


@pytest.mark.slow
def test_the_region_of_ties_ends_where_the_difference_is_its_own_error():
    rows, meta = made.figure7(noise=0.01)
    shown = view(rows, meta)
    plane = contour.plane(shown, shown.objectives[0], *contour.main_keys(shown))
    inside, best = plane.gap <= plane.reach, optimum.find(shown, shown.objectives[0])
    assert inside.sum() == best.open.sum()
    assert np.nanmax(plane.gap[inside]) <= np.nanmax(plane.reach[inside]) < 0.2 * best.value


def test_a_quotient_is_traded_off_as_numerator_over_denominator(swept):
    shown = data.opened(str(swept))[1]
    (pair,) = tradeoff.pairs(shown, shown.objectives[0])
    assert (pair.x.path, pair.x.goal) == ("power", "minimise")
    assert (pair.y.path, pair.y.goal, pair.slope) == ("rate_above(0.1 uJ)", "maximise", "1/J")


def test_the_knee_of_a_front_is_its_corner():
    x = np.linspace(60, 120, 5)
    power, speed = [1.0, 2.0, 3.0, 30.0, 60.0], [0.1, 0.5, 1.0, 1.05, 1.1]
    goals = {SPEED: ("maximise", np.array(speed)), made.POWER: ("minimise", np.array(power))}
    rows, meta = made.made(made.grid(rotor__speed=x), [made.vary("rotor.speed", x)], goals)
    shown = view(rows, meta)
    assert optimum.knee(shown, shown.objectives, optimum.front(shown)) == 2


# ---- the page


def rendered(swept):
    shown = data.opened(str(swept))[1]
    kinds = list(outputs.figures(shown, shown.objectives[0]))
    return shown, page.render(shown, shown.objectives[0], kinds)


@pytest.mark.slow
def test_the_page_begins_with_the_finding_and_has_the_mill_of_the_best_design(swept):
    shown, text = rendered(swept)
    best = optimum.find(shown, shown.objectives[0]).design
    title = re.search(r"<h1>(.*?)</h1>", text)[1]
    assert title.startswith(shown.tell(best).replace("r", "R", 1)) and "impacts of 0.1 uJ or more per joule" in title
    found = json.loads(re.search(r'id="data">(.*?)</script>', text)[1])
    assert found["best"] == best and best in found["mills"] and f'class="turning" data-design="{best}"' in text
    assert found["designs"][best]["aims"][0] == pytest.approx(shown.estimate(shown.objectives[0].path).mean[best])


def test_the_page_says_before_it_runs_designs_again_how_long_this_takes(swept, monkeypatch, capsys):
    shown = data.opened(str(swept))[1]
    shown.rows["cpu"] = 5.0
    monkeypatch.setattr(page, "_mill", lambda *_: "")
    page.render(shown, shown.objectives[0], [], quiet=False)
    said = capsys.readouterr().err.splitlines()
    about = round(2 * (page.TWICE * 5 + page.DRAWN))  # two runs of 5 s
    assert said[0] == f"mill study: runs the best design and 1 other once more for the page: about {about} s"
    assert said[1].startswith("mill study: running 300 rpm again")


def test_settings_of_a_design_run_it_again(swept):
    shown = data.opened(str(swept))[1]
    assert page.settings(shown, 1) == ["rotor.speed=62.83185307179586 rad/s"]


@pytest.mark.slow
def test_the_deck_of_the_best_design_is_that_of_its_run(mill, swept, tmp_path):
    assert mill("study", str(swept), "--deck", "best.ini").returncode == 0
    shown = data.opened(str(swept))[1]
    best = optimum.find(shown, shown.objectives[0]).design
    deck = Deck.check(tmp_path / "best.ini")
    assert deck.number("rotor.speed") == shown.designs["rotor.speed"][best]
    assert deck.count("run.seed") == shown.rows["seed"][best]


@pytest.mark.slow
def test_the_wall_of_the_best_design_is_drawn_where_its_shape_is_varied(mill, write_study, write_deck, tmp_path):
    study = write_study(STUDY.split("[vary]")[0] + "[vary]\ndrum.wave_1 = 1, 2 mm\n")
    write_deck(SMALL.replace("radius = 30 mm\n", "radius = 30 mm\nprofile = harmonics\nrepeats = 6\n", 1))
    assert mill("sweep", str(study), "-o", "s.parquet", "--no-picture").returncode == 0
    assert mill("study", "s.parquet", "--svg", "s.svg").returncode == 0
    assert (tmp_path / "s-wall.svg").exists()


def test_the_page_offers_a_design_in_the_unit_of_the_study(swept):
    shown = data.opened(str(swept))[1]
    shown.meta["study"] = HARD.replace("[set]\nrun.time = 60 ms\n", "")
    found = page.data(shown, shown.objectives[0], [])["designs"]
    assert found[1]["set"] == "-s 'rotor.speed=600 rpm'"


@pytest.mark.slow
def test_a_design_of_a_study_with_set_is_offered_as_the_command_that_writes_its_deck(mill, write_study, tmp_path):
    study = write_study(HARD.replace("[vary]", "contact.friction =\nballs.diameter = 9 mm\n[vary]"))
    assert mill("sweep", str(study), "-o", "s.parquet", "--no-picture").returncode == 0
    shown = data.opened(str(tmp_path / "s.parquet"))[1]
    offered = page.data(shown, shown.objectives[0], [])["designs"][1]["set"]
    assert mill(*shlex.split(offered)[1:]).returncode == 0
    deck = Deck.check(next(tmp_path.glob("s-*.ini")))
    assert deck.number("rotor.speed") == shown.designs["rotor.speed"][1]
    assert deck.number("balls.diameter") == 0.009 and deck.number("contact.friction") == 0
    done = mill("study", "s.parquet", "--deck", "a.ini", "--design", "99")
    assert done.returncode == 2 and "has no run of a design with this number" in done.stderr


def test_a_number_that_the_unit_of_the_study_does_not_give_back_is_offered_in_si(swept):
    shown = data.opened(str(swept))[1]
    odd = 62.83185307179586 * (1 + 1e-15)
    shown.designs.loc[1, "rotor.speed"] = odd
    assert page.settings(shown, 1, page.spoken(shown)) == [f"rotor.speed={odd!r} rad/s"]


def test_the_csv_has_the_question_and_what_is_required_with_errors(swept, tmp_path):
    shown = data.opened(str(swept))[1]
    asked = shown.ask("dissipation", ["power <= 1 kW"])
    outputs.csv(shown, tmp_path / "runs.csv", asked)
    with open(tmp_path / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for aim in (asked, shown.aim("power")):
        value, error = shown.column(aim.path)
        assert [float(row[f"{aim.path} [W]"]) for row in rows] == value.tolist()
        told = [row[f"standard error of {aim.path} [W]"] for row in rows]
        assert [float(text or "nan") for text in told] == pytest.approx(error.tolist(), nan_ok=True)


def test_heads_of_the_csv_are_expressions_and_keys_with_their_units_as_the_study_writes_them(swept, tmp_path):
    outputs.csv(data.opened(str(swept))[1], tmp_path / "runs.csv")
    with open(tmp_path / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["rotor.speed [rpm]"] for row in rows] == ["300.0", "300.0", "600.0", "600.0", "900.0", "900.0"]
    assert {"power / mass [W/kg]", "rate_above(0.1 uJ) / power [1/J]", "power [W]"} <= rows[0].keys()


@pytest.mark.slow
def test_the_mill_in_the_page_has_all_its_balls(swept):
    """Also where its still picture alone would need more than its room."""
    shown = data.opened(str(swept))[1]
    text = page._mill(shown, 0, 150_000)
    head = json.loads(re.search(r'class="mp-head">(.*?)</script>', text, re.S)[1])
    assert len(text) <= 150_000 and sum(run[0] for run in head["runs"]) == head["drawn"]
    assert "ball is drawn" not in text
