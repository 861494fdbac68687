"""mill study: intervals are those of a hand computation, the optimum and its regions hold what they must, pictures show
the values in the map's order, nothing from a study steers terminal or page."""

import csv
import html.parser
import math
import os
import re
import subprocess
import sys

import layouts
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import study_tables as made
from conftest import ROOT

from milltools.__main__ import dispatch
from milltools.base.errors import UserError
from milltools.read import runfile
from milltools.study.plan import filling, options
from milltools.study.plan.table import Table, Writer
from milltools.study.show import canvas, contour, data, optimum, outputs, page, pair, slices, summary, tradeoff
from milltools.study.show.data import StudyView, words_of

SPEED, POWER = made.SPEED, made.POWER
VIRIDIS = plt.get_cmap("viridis")(np.linspace(0, 1, 256))[:, :3]


def view(rows, meta, name="made"):
    return StudyView(name, meta, rows)


def line_of(values, errors=None, replicates=1, **options):
    """A study of one key, rotor.speed, with these values."""
    x = np.linspace(60, 120, len(values))
    errors = None if errors is None else {SPEED: np.asarray(errors, float)}
    return made.made(
        pd.DataFrame({"rotor.speed": x}), [made.vary("rotor.speed", x)],
        {SPEED: ("maximise", np.asarray(values, float))}, errors, replicates=replicates, **options,
    )  # fmt: skip


def with_replicates(values, errors=math.nan):
    """One design whose replicates have these values and standard errors."""
    rows, meta = line_of([0.0], [math.nan], replicates=len(values), noise=False)
    rows[SPEED], rows[f"{SPEED}:error"] = values, errors
    return view(rows, meta)


@pytest.fixture(scope="module")
def figure7():
    """Figure 7's grid with 1 % noise, its corner capped, one design failed."""
    return view(*made.figure7(noise=0.01), "figure7")


# ---- how sure


def test_replicates_without_errors_have_students_interval():
    found = with_replicates([1.0, 1.1, 1.3]).estimate(SPEED)
    scatter = math.sqrt((0.1333333**2 + 0.0333333**2 + 0.1666667**2) / 2)
    assert found.mean[0] == pytest.approx(1.1333333)
    assert found.half[0] == pytest.approx(4.302653 * scatter / math.sqrt(3), rel=1e-5)


def test_the_table_shows_that_interval():
    shown = with_replicates([1.0, 1.1, 1.3])
    _, line = summary.best_table(shown, shown.objectives[0])
    assert line[2:5] == ["1.13", "+- 0.38", "3"]  # 4.3027 * 0.15275 / sqrt(3) = 0.379


def test_runs_with_errors_have_the_interval_of_their_errors():
    found = with_replicates([1.00, 1.01], [0.03, 0.04]).estimate(SPEED)
    assert found.half[0] == pytest.approx(1.959964 * 0.05 / 2, rel=1e-5)


def test_a_run_without_error_has_that_of_its_replicate_though_both_agree_by_chance():
    found = with_replicates([32.90, 33.06], [math.nan, 1.38]).estimate(SPEED)
    assert found.mean[0] == pytest.approx(32.98)
    assert found.half[0] == pytest.approx(1.9126, rel=1e-4)  # 1.959964 * 1.38 / sqrt(2)


def test_no_interval_is_narrower_than_that_of_the_known_errors_of_its_runs():
    random = np.random.default_rng(5)
    for _ in range(50):
        group, error = np.repeat(np.arange(4), 3), random.uniform(0.01, 0.1, 12)
        error[random.random(12) < 0.4] = np.nan
        found = data.estimate(group, 1 + 0.03 * random.standard_normal(12), error, 4)
        for k in range(4):
            if len(known := error[group == k][np.isfinite(error[group == k])]):
                assert found.half[k] >= 1.9599 * math.sqrt(np.mean(known**2) / 3)


def test_replicates_without_errors_that_agree_by_chance_have_at_least_the_usual_error_of_the_study():
    group = np.array([0, 0, 1, 1])
    found = data.estimate(group, np.array([1.0, 1.0001, 2.0, 2.1]), np.array([math.nan, math.nan, 0.1, 0.1]), 2)
    assert found.half[0] == pytest.approx(1.959964 * 0.1 / 2.05 * 1.00005 / math.sqrt(2), rel=1e-5)
    assert found.half[1] == pytest.approx(1.959964 * 0.1 / math.sqrt(2), rel=1e-5)


def test_errors_are_enlarged_where_replicates_scatter_more():
    found = with_replicates([1.0, 1.2], [0.02, 0.02]).estimate(SPEED)
    assert found.factor == pytest.approx(math.sqrt(2 * (0.1 / 0.02) ** 2))
    error = 0.02 / math.sqrt(2) * found.factor
    assert found.half[0] == pytest.approx(12.7062 * error, rel=1e-4)  # Student's t, 1 degree of freedom


def test_a_single_run_without_error_has_no_interval():
    shown = with_replicates([1.0])
    assert math.isnan(shown.estimate(SPEED).half[0])
    _, line = summary.best_table(shown, shown.objectives[0])
    assert line[3] == "?"


def test_where_no_error_is_known_nothing_is_claimed():
    shown = view(*line_of([1.0, 1.2, 1.5], [math.nan] * 3, noise=False))
    said = "\n".join(summary.optimum_lines(shown, shown.objectives[0]))
    assert "its error is not known: its window is shorter than 3 revolutions" in said
    assert "longer run.time" in said and "study.replicates" in said
    assert "95 %" not in said and "as good" not in said
    _, *lines = summary.best_table(shown, shown.objectives[0])
    assert [line[-1] for line in lines] == ["best", "", ""]
    assert "95 %" not in contour.best_words(shown, shown.objectives[0])[1]
    (told, *_) = pair.sentences([shown, shown], shown.objectives[0], {"rotor.speed": 60.0})
    assert told.endswith("100 % of the gain remains; the error is not known")


def test_scatter_without_errors_is_pooled_over_designs():
    rows, meta = line_of([1.0, 2.0, 4.0], replicates=2)
    rows[SPEED] = [
        1.0,
        2.0,
        4.0,
        1.02,
        2.0,
        math.nan,
    ]  # the second design's agree by chance, the third ran once
    found = view(rows, meta).estimate(SPEED)
    share = math.sqrt(2 * (0.01 / 1.01) ** 2 / 2)
    assert found.error == pytest.approx(share * np.array([1.01, 2.0, 4.0]) / np.sqrt([2, 2, 1]))
    assert found.half[1] == pytest.approx(4.302653 * found.error[1], rel=1e-5)  # 2 degrees of freedom


def test_the_subset_holds_the_best_of_equal_designs_in_95_percent():
    random, designs, error = np.random.default_rng(3), 20, 0.02
    held = 0
    for _ in range(2000):
        mean = 1 + error * random.standard_normal(designs)
        found = data.estimate(np.arange(designs), mean, np.full(designs, error), designs)
        reach = optimum.subset_reach(found, 1, np.ones(designs, bool))
        held += found.mean.max() - found.mean[0] <= reach[0]
    assert 0.94 < held / 2000 < 0.975  # any one of them may be called the best


def test_the_subset_of_two_is_a_one_sided_test():
    assert optimum.subset_quantile(2) == pytest.approx(1.644854, abs=1e-4)


def test_the_pareto_front_is_that_of_brute_force():
    scores = np.random.default_rng(5).integers(0, 12, (150, 3)).astype(float)
    scores[7] = np.nan
    front = optimum.pareto(scores)
    for k, line in enumerate(scores):
        beaten = ((scores >= line).all(axis=1) & (scores > line).any(axis=1)).any()
        assert front[k] == (not beaten and k != 7)


# ---- the optimum


@pytest.mark.slow
def test_the_regions_hold_what_the_truth_says(figure7):
    best = optimum.find(figure7, figure7.objectives[0])
    n, h = (figure7.designs[key].to_numpy() for key in ("drum.buckles", "drum.buckle_height"))
    truth = made.wavy(n, h)
    alike = truth > 0.98 * truth.max()
    assert truth[best.design] > 0.98 * truth.max()
    assert abs(best.value - truth[best.design]) < 1.5 * best.half
    assert best.open[np.argmax(truth)]
    both, either = (alike & best.alike).sum(), (alike | best.alike).sum()
    assert both > 0.6 * either
    assert not best.open[truth < 0.9 * truth.max()].any()


def test_words_of_the_region_cover_it(figure7):
    best = optimum.find(figure7, figure7.objectives[0])
    inside = figure7.designs[best.open]
    low, high = inside["drum.buckles"].min(), inside["drum.buckles"].max()
    floor, roof = 1e3 * inside["drum.buckle_height"].min(), 1e3 * inside["drum.buckle_height"].max()
    text = "\n".join(summary.lines(figure7))
    assert f"n {low}..{high}, h {floor:g}..{roof:g} mm cannot be distinguished from the best" in text


def test_capped_and_failed_designs_are_never_the_best():
    rows, meta = line_of([1.0, 2.0, 3.0], [0.01] * 3, status=np.array(["done", "done", "capped"], object))
    shown = view(rows, meta)
    best = optimum.find(shown, shown.objectives[0])
    assert best.design == 1 and not best.open[2] and not best.alike[2]


def test_minimised_objectives_are_best_at_the_least():
    rows, meta = line_of([3.0, 1.0, 2.0], [0.01] * 3)
    meta["objectives"][0]["goal"] = "minimise"
    shown = view(rows, meta)
    assert optimum.find(shown, shown.objectives[0]).design == 1


# ---- progress


def test_the_time_left_is_the_pace_of_the_last_runs():
    rows, meta = line_of([1.0] * 11, [0.01] * 11)  # one ends every second
    meta["planned"] = 51
    shown = view(rows, meta)
    now = summary.progress(shown)["ended"] + 1
    progress = summary.progress(shown, now)
    assert progress["left"] == pytest.approx(40) and not progress["complete"]
    assert "11 of 51 runs: 11 done; 40 s left" in summary.progress_lines(shown, now)[0]
    assert "no new run for 2.0 h" in summary.progress_lines(shown, now + 7200)[0]


def test_messages_are_counted_and_cannot_steer_a_terminal():
    status = np.array(["done", "failed", "failed"], object)
    rows, meta = line_of([1.0] * 3, [0.01] * 3, status=status)
    rows["message"] = ["", "bad \x1b[31m deck", "bad \x1b[31m deck"]
    text = "\n".join(summary.lines(view(rows, meta)))
    assert "2 x bad ?[31m deck" in text and "\x1b" not in text


def test_the_command_that_shows_a_table_does_not_take_its_name_for_an_option(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = small(options.output_of("-x.study", None))
    with Writer.begin(path, Table.open(path).meta) as table:
        line, _ = filling.last_words(table, "mill sweep")
    assert re.search(r"^-x.parquet: 3 runs .*: .* study ./-x.parquet$", line)
    with pytest.raises(UserError, match=r"this shows it: .* study ./-x.parquet$"):
        runfile.kind_of("-x.parquet")


# ---- runs that computed contacts without friction


DOUBT = "computed contacts without friction: {} power and rates are not to be trusted"


def with_friction_dropped(values, which):
    rows, meta = line_of(values, [0.01] * len(values))
    rows.loc[which, "message"] = "contacts were computed without friction"
    return rows, meta


def test_a_study_names_designs_whose_contacts_were_computed_without_friction():
    shown = view(*with_friction_dropped([1.0, 2.0, 1.5], [2]))
    text = "\n".join(summary.lines(shown))
    assert f"warning    1 of 3 runs (rotor speed = 1145.9 rpm) {DOUBT.format('its')}" in text
    assert "of this design" not in text  # the best one is another
    assert "friction" not in "\n".join(summary.lines(view(*line_of([1.0, 2.0], [0.01] * 2))))


def test_beside_the_optimum_stands_that_its_contacts_were_computed_without_friction():
    shown = view(*with_friction_dropped([1.0, 2.0, 1.5], [1]))
    best = summary.optimum_lines(shown, shown.objectives[0])
    assert best[1].strip() == f"runs of this design {DOUBT.format('its')}"
    text = page.render(shown, shown.objectives[0], [])
    assert f"(rotor speed = 859.44 rpm) {DOUBT.format('its')}</li>" in text and best[1].strip() in text


def test_a_design_that_had_not_settled_is_told_and_marked():
    rows, meta = line_of([1.0, 2.0, 1.5, 1.2, 1.1], [0.01, math.nan, 0.01, 0.01, 0.01], noise=False)
    rows.loc[1, "message"] = "not settled: no errors are known"
    shown = view(rows, meta)
    assert summary.finding(shown, shown.objectives[0]).endswith("; its own run had not settled")
    text = "\n".join(summary.lines(shown))
    which = shown.tell(1)
    assert f"1 of 5 runs ({which}) had not settled: its errors are not known: sample later (run.sample_from)" in text
    assert text.count("best, not settled") == text.count("not settled\n") == 1


def test_a_long_name_heads_no_column_and_a_limit_in_per_cent_has_its_values_so():
    rows, meta = line_of([1.0, 2.0, 1.5], [0.01] * 3, require=["above_toe <= 45 %"])
    rows["above_toe"], rows["above_toe:error"] = [0.2, 0.5, 0.4], 0.01
    shown = view(rows, meta)
    heads, *lines = summary.best_table(shown, shown.objectives[0])
    assert heads[heads.index("above_toe [%]") :][:2] == ["above_toe [%]", "95 %"]
    assert sorted(line[heads.index("above_toe [%]")] for line in lines) == ["20.0", "40.0", "50.0"]
    assert any("above_toe 50 > 45 %" in line for line in lines[-1])
    meets = "there: 40.0 +- 2.0 % (95 %), required above_toe <= 45 %"
    assert any(meets in line for line in summary.optimum_lines(shown, shown.objectives[0]))
    (pair,) = tradeoff.pairs(shown, shown.objectives[0])
    assert (pair.x.path, pair.slope) == ("above_toe", None)  # a share is no cost of which the speed is a multiple


def test_of_many_designs_without_friction_the_ranges_are_told():
    (line,) = summary.doubt_lines(view(*with_friction_dropped(np.arange(9.0), range(1, 7))))
    which = "6 of 9 designs, with rotor speed 644.58..1002.7 rpm"
    assert line == f"6 of 9 runs ({which}) {DOUBT.format('their')}"


def test_a_sweep_and_a_search_end_with_the_warning_of_contacts_without_friction(tmp_path):
    path = made.write(tmp_path / "made.parquet", *with_friction_dropped([1.0, 2.0, 1.5], [1, 2]))
    for ended in (summary.of_sweep, summary.of_search):
        said = ended(Table.open(path))
        designs = "rotor speed = 859.44 rpm; rotor speed = 1145.9 rpm"
        assert said[-2] == f"warning: 2 of 3 runs ({designs}) {DOUBT.format('their')}"
    assert f"runs of this design {DOUBT.format('its')}" in said


# ---- pictures


def pixels(figure):
    figure.canvas.draw()
    return np.asarray(figure.canvas.buffer_rgba())[..., :3] / 255


def place_in_map(image, ax, x, y):
    """Where the colour at a point of an axes stands in the map, 0..1, and how far it is off the map."""
    column, row = ax.transData.transform((x, y))
    off = np.linalg.norm(VIRIDIS - image[image.shape[0] - 1 - round(row), round(column)], axis=1)
    return off.argmin() / 255, off.min()


@pytest.mark.slow
def test_colours_are_in_the_order_of_the_values(figure7):
    figure = contour.draw(figure7, figure7.objectives[0])
    image, ax = pixels(figure), figure.axes[0]
    spots = [(18.2, 0.3), (18.2, 4.2), (13.2, 4.2), (7.3, 5.2)]  # values rise
    found = [place_in_map(image, ax, *spot) for spot in spots]
    plt.close(figure)
    assert all(off < 0.15 for _, off in found)
    assert np.all(np.diff([place for place, _ in found]) > 0.05)


def test_the_contour_names_keys_units_marks_and_best(figure7):
    figure = contour.draw(figure7, figure7.objectives[0])
    ax, labels = figure.axes[0], [t.get_text() for t in figure.legends[0].get_texts()]
    said = [a.get_title(loc="left") for a in figure.axes]
    plt.close(figure)
    assert ax.get_xlabel() == "number of buckles n [1]" and ax.get_ylabel() == "buckle height h [mm]"
    assert any("impact speed" in s and "[m/s]" in s for s in said)
    assert any("standard error [% of the value]" in s for s in said)
    capped = int((figure7.designs["state"] == "capped").sum())
    for wanted in (
        f"capped ({capped})",
        "failed (1)",
        "at most 2 % worse than the best",
        "not distinguishable from best (95 %)",
    ):
        assert wanted in labels
    assert any(re.match(r"best: n\s=\s\d", label) for label in labels)


@pytest.mark.parametrize("size", [1e-12, 1, -1e5])
def test_no_text_of_lines_is_cut_off_and_none_covers_another(size):
    designs = made.grid(rotor__speed=np.array([60.0, 80, 100, 120]), balls__diameter=np.array([2e-3, 4e-3]))
    entries = [made.vary(key, designs[key].unique()) for key in designs]
    value = size * np.arange(1.0, 9)
    shown = view(*made.made(designs, entries, {SPEED: ("maximise", value)}), "a long name of a study " * 3)
    for figure in (slices.draw(shown, shown.objectives[0]), slices.draw_sensitivity(shown, [(SPEED, 1, 0, 1, 0, "")])):
        assert not layouts.faults(figure)


def test_outlines_enclose_just_the_cells():
    mask = np.random.default_rng(1).random((9, 7)) < 0.4
    area = 0.0
    for loop in canvas.outline(mask, np.arange(8.0), np.arange(10.0)):
        assert (loop[0] == loop[-1]).all()
        x, y = loop.T
        area += 0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])
    assert abs(area) == mask.sum()


def test_a_fine_grid_is_averaged_and_says_so():
    rows, meta = made.figure7(noise=0.02, heights=241)
    shown = view(rows, meta)
    shown._optima = {SPEED: None}  # no surface needed
    plane = contour.plane(shown, shown.objectives[0], *shown.axes)
    assert plane.value.shape == (81, 19) and plane.others == "means of 3 neighbours along h"
    assert np.nanmedian(contour.relative_errors(plane)) == pytest.approx(2 / math.sqrt(3), rel=0.02)


def test_angular_speeds_are_si_with_rpm_beside():
    shown = view(*line_of([1.0, 2.0, 1.5], [0.1] * 3))
    figure = slices.draw(shown, shown.objectives[0])
    ax = figure.axes[0]
    second = ax.child_axes[0].get_xlabel()
    plt.close(figure)
    assert ax.get_xlabel() == "rotor speed [rad/s]" and second == "[rpm]"
    assert shown.tell(0) == "rotor speed = 572.96 rpm"


def test_the_unit_of_the_study_deck_is_that_of_words_and_axes():
    lines = "[vary]\nrotor.speed = 600..1200 rpm step 300 rpm\n"
    shown = view(*line_of([1.0, 2.0, 1.5], [0.1] * 3, study=lines))
    figure = slices.draw(shown, shown.objectives[0])
    ax = figure.axes[0]
    assert ax.get_xlabel() == "rotor speed [rpm]" and not ax.child_axes
    assert ax.get_xlim()[1] > 1100
    both = view(*line_of([1.0, 2.0, 1.5], [0.1] * 3, study=lines.replace("rpm", "rad/s")))
    assert (shown.tell(0), both.tell(0)) == ("rotor speed = 572.96 rpm", "rotor speed = 60 rad/s")


@pytest.mark.parametrize(
    "line, unit",
    [
        ("600, 800, 1000 rpm", "rpm"),
        ("10..20 rad/s in 5 log", "rad/s"),
        ("600..1200 rpm step 100 rpm", "rpm"),
        ("600..1200", None),
        ("600..1200 light-years", None),
    ],
)
def test_the_unit_is_read_from_the_line_of_the_deck(line, unit):
    meta = {"study": f"[vary]\nrotor.speed = {line}  # why\n", "vary": [made.vary("rotor.speed", [1.0, 2.0])]}
    assert {key: scale.unit for key, scale in data.deck_scales(meta).items()} == ({"rotor.speed": unit} if unit else {})


def test_nothing_is_worse_and_within_two_percent_of_the_best_without_saying_so():
    shown = view(*line_of([1.0, 0.99, 0.5], [1e-4] * 3, noise=False))
    _, *lines = summary.best_table(shown, shown.objectives[0])
    assert [line[-1] for line in lines] == ["best", "at most 2 % worse", "worse"]
    text = "\n".join(summary.lines(shown))
    assert "rotor speed 572.96..859.44 rpm: at most 2 % worse than the best (2 designs)" in text


def test_slices_have_an_error_bar_on_every_point():
    shown = view(*line_of([1.0, 2.0, 1.5], [0.1, 0.2, 0.3]))
    figure = slices.draw(shown, shown.objectives[0])
    (bars,) = figure.axes[0].containers[0][2]
    halves = [np.ptp(segment[:, 1]) / 2 for segment in bars.get_segments()]
    plt.close(figure)
    assert halves == pytest.approx([0.196, 0.392, 0.588], rel=1e-3)


@pytest.mark.thorough
@pytest.mark.slow
def test_scattered_studies_of_words_and_two_objectives_are_drawn():
    random = np.random.default_rng(2)
    designs = pd.DataFrame(
        {"drum.buckle_height": 0.01 * random.random(40), "rotor.speed": 60 + 60 * random.random(40),
         "drum.profile": random.choice(["circle", "wavy"], 40)}
    )  # fmt: skip
    speed = designs["rotor.speed"].to_numpy() / 100 + (designs["drum.profile"] == "wavy").to_numpy()
    entries = [
        made.vary("drum.buckle_height", low=0, high=0.01),
        made.vary("rotor.speed", low=60, high=120, log=True),
        made.vary("drum.profile", choices=["circle", "wavy"]),
    ]
    objectives = {SPEED: ("maximise", speed), POWER: ("minimise", 100 * speed**2)}
    errors = {SPEED: 0.01 * speed, POWER: 2 * speed**2}
    shown = view(*made.made(designs, entries, objectives, errors))
    sensitivities = [(key, 0.3, 0.1, 0.4, 0.1, "made") for key in designs]
    kinds = {}
    for kind, _, _, make in outputs.figures(shown, shown.objectives[0], sensitivities):
        figure = make()
        kinds[kind] = len(np.unique(pixels(figure).reshape(-1, 3), axis=0))
        plt.close(figure)
    assert set(kinds) == {"contour", "slices", "pareto", "sensitivity"}
    assert all(colours > 8 for colours in kinds.values())
    text = "\n".join(summary.lines(shown, sensitivities))
    assert "drum profile = wavy" in text and "Pareto front: " in text and "which key matters" in text


# ---- beside


@pytest.mark.slow
def test_what_is_left_of_the_gain_is_what_was_put_in(figure7):
    rows, meta = made.figure7(noise=0.01, gain=0.35, seed=4)
    meta["study"] += "[set]\ncontact.friction = 0.3\n"
    both = [figure7, view(rows, meta, "friction")]
    gains = [pair.gain_of(v, v.objectives[0]) for v in both]
    share, error = pair.left(*gains)
    assert share == pytest.approx(0.35, abs=3 * error) and error < 0.03
    line = pair.sentences(both, figure7.objectives[0])[0]
    assert re.search(r"compared with the circular drum \(h = 0\): .* % higher in figure7, .* of the gain remains", line)
    assert pair.differences(both) == [("contact.friction", "not given", "0.3")]


@pytest.mark.slow
def test_one_colour_scale_for_both(figure7):
    low = view(*made.figure7(noise=0.01, gain=0.35, seed=4), "friction")
    figure = pair.draw([figure7, low], figure7.objectives[0])
    image = pixels(figure)
    first, second = (place_in_map(image, ax, 7.5, 6.2)[0] for ax in figure.axes[:2])  # beside dots and lines
    plt.close(figure)
    assert first > 0.9 and 0.2 < second < 0.5  # 1.1 m/s and 0.68 m/s of 0.4 .. 1.1


# ---- page and CSV


class Reader(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.tags, self.links = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for name, value in attributes if name in ("src", "href")]


def test_the_page_escapes_everything_and_needs_no_network():
    rows, meta = line_of([1.0, 2.0, 1.5], [0.1] * 3, status=np.array(["done", "done", "failed"], object))
    bad = "<script>alert(1)</script><img src=http://x.example/>"
    rows["message"] = bad
    meta |= {"study": bad, "deck": bad, "command": bad, "version": bad}
    shown = view(rows, meta, bad)
    text = page.render(shown, shown.objectives[0], list(outputs.figures(shown, shown.objectives[0])))
    reader = Reader()
    reader.feed(text)
    assert reader.tags.count("script") == 3 and bad not in text and "&lt;script&gt;" in text  # data, theme, pictures
    assert reader.links and all(link.startswith(("data:image/", "#")) for link in reader.links)


def test_the_page_runs_no_deck_that_names_a_file():
    """The table may be a stranger's, and the file any mesh of this computer."""
    shown = view(*line_of([1.0, 2.0, 1.5], [0.1] * 3, common={"body.a.shape": "mesh", "body.a.file": "/mine.stl"}))
    said = "not run again for the page: its deck names the file /mine.stl"
    assert page.render(shown, shown.objectives[0], []).count(f'<p class="missing">{said}</p>') == 3


def csv_of(shown, folder):
    outputs.csv(shown, folder / "runs.csv")
    with open(folder / "runs.csv", newline="") as file:
        return list(csv.DictReader(file))


def test_csv_reads_back_with_units(figure7, tmp_path):
    rows = csv_of(figure7, tmp_path)
    assert len(rows) == len(figure7.rows)
    for k in (0, 50, 200):
        assert float(rows[k]["drum.buckle_height [m]"]) == figure7.rows["drum.buckle_height"][k]
        assert float(rows[k][f"{SPEED} [m/s]"]) == figure7.rows[SPEED][k]
        assert float(rows[k][f"standard error of {SPEED} [m/s]"]) == figure7.rows[f"{SPEED}:error"][k]
    assert rows[0]["drum.buckles"] == "2" and rows[0]["cpu [s]"] == "1.5"
    failed = next(row for row in rows if row["status"] == "failed")
    assert failed[f"{SPEED} [m/s]"] == ""


@pytest.mark.parametrize(
    "path, words",
    [
        ("impacts/ball_ball/normal_speed/median_above_floor", "median normal impact speed above the floor, ball-ball"),
        ("impacts/ball_wall/rate", "rate of impacts, ball-end wall"),
        ("impacts/all/rate", "rate of impacts"),
        ("strikes/all/rate", "strikes all rate"),
    ],
)
def test_a_path_of_a_kind_is_named_as_that_of_all_with_the_kind(path, words):
    assert words_of(path) == words


def test_words_of_a_study_are_no_formulas_of_a_spreadsheet(tmp_path):
    rows, meta = line_of([1.0, 2.0])
    rows["message"] = ["=HYPERLINK(1)", "+1\x1b[31m"]
    rows["@column"] = 1.0
    found = csv_of(view(rows, meta), tmp_path)
    assert [row["message"] for row in found] == ["'=HYPERLINK(1)", "'+1?[31m"]
    assert "'@column" in found[0]


# ---- the command


def small(path, planned=None):
    rows, meta = line_of([1.0, 2.0, 1.5], [0.1] * 3)
    meta["planned"] = planned or len(rows)
    return made.write(path, rows, meta)


@pytest.fixture
def study(tmp_path, monkeypatch, capsys):
    """study(*arguments) is `mill study` in tmp_path, in this process; returns what it prints."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        assert dispatch(["study", *arguments]) == 0
        return capsys.readouterr().out

    return run


def test_a_table_its_journal_and_its_study_deck_mean_the_same(study, tmp_path):
    small(tmp_path / "made.parquet")
    (tmp_path / "made.study").write_text("[study]\n")
    said = {study(name) for name in ("made.parquet", "made.parquet.journal", "made.study")}
    assert len(said) == 1
    assert "rotor speed = 859.44 rpm: " in said.pop()


def test_wrong_usage_is_one_line_and_status_2(mill):
    said = mill("study", "none.parquet")
    assert said.returncode == 2 and said.stdout == ""
    assert said.stderr == "mill study: none.parquet: no such file\n"


@pytest.mark.parametrize(
    "words, says",
    [
        (["other.study"], "other.study: it has no table yet"),
        (["made.parquet", "--x", "drum.radius"], "--x drum.radius: expected one of rotor.speed"),
        (["made.parquet", "--objective", "rate"], "--objective rate: made: no run of this table has kept its results"),
        (["made.parquet", "--png", "a.gif"], "a.gif: expected a name that ends in .png"),
        (["made.parquet", "--png", "no/a.png"], "no/a.png: there is no folder no"),
        (["made.parquet", "--deck", "other.study"], "other.study: exists already"),
        (["made.parquet", "--reference", "rotor.speed=1"], "--reference: only with --beside"),
    ],
)
def test_what_is_wrong_is_said(study, tmp_path, words, says):
    small(tmp_path / "made.parquet")
    (tmp_path / "other.study").write_text("[study]\n")
    with pytest.raises(UserError) as fault:
        study(*words)
    assert says in str(fault.value)


@pytest.mark.slow
def test_pictures_page_and_csv_are_written(study, tmp_path):
    small(tmp_path / "made.parquet")
    study(
        "made.parquet",
        "--png",
        "p.png",
        "--svg",
        "p.svg",
        "--pdf",
        "p.pdf",
        "--html",
        "p.html",
        "--csv",
        "p.csv",
    )
    starts = {
        "p-slices.png": b"\x89PNG", "p-slices.svg": b"<?xml", "p.pdf": b"%PDF", "p.html": b"<!doctype",
        "p.csv": b"design,",
    }  # fmt: skip
    for name, start in starts.items():
        assert (tmp_path / name).read_bytes().startswith(start)


def test_the_reference_of_a_gain_has_units(study, tmp_path):
    for name in ("a.parquet", "b.parquet"):
        small(tmp_path / name)
    both = ("a.parquet", "--beside", "b.parquet", "--reference")
    said = study(*both, "rotor.speed=60 rad/s")
    assert "compared with rotor speed = 572.96 rpm: " in said and "of the gain remains" in said
    with pytest.raises(UserError, match="--reference rotor.speed=60 mm: .*rotor"):
        study(*both, "rotor.speed=60 mm")


@pytest.fixture
def mill_started(tmp_path):
    """mill_started(*arguments) starts the mill command in tmp_path; what still runs is ended after the test."""
    started = []

    def start(*arguments):
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools")}
        command = [sys.executable, "-m", "milltools", *arguments]
        process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, env=environment)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.slow
def test_files_are_written_though_nobody_reads_the_text(mill_started, tmp_path):
    small(tmp_path / "made.parquet")
    process = mill_started("study", "made.parquet", "--csv", "my.csv")
    process.stdout.close()  # as `| head` does
    process.wait(timeout=60)
    assert len((tmp_path / "my.csv").read_text().splitlines()) == 4


@pytest.mark.slow
def test_following_ends_when_the_study_is_complete(mill_started, tmp_path):
    small(tmp_path / "made.parquet", planned=9)
    process = mill_started("study", "made.parquet", "--follow")
    seen = ""
    while "3 of 9 runs" not in seen:
        line = process.stdout.readline()
        assert line, "ended too early"
        seen += line
    assert process.poll() is None
    small(tmp_path / "made.parquet.new").rename(tmp_path / "made.parquet")
    rest, _ = process.communicate(timeout=60)
    assert process.returncode == 0 and "3 of 3 runs: 3 done; complete" in rest


def test_sweep_gets_text_and_picture(tmp_path):
    table = Table.open(small(tmp_path / "made.parquet"))
    outputs.draw(table, tmp_path / "made.png")
    assert (tmp_path / "made.png").read_bytes().startswith(b"\x89PNG")
    assert "the largest" in summary.of_sweep(table)[0]
