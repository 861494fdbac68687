"""Studies from Python: the table that mill sweep makes, its best design as run() takes it, pictures, words."""

import os
import warnings

import pandas as pd
import pytest
from conftest import STUDY

import milltools

pytestmark = [pytest.mark.usefixtures("the_program"), pytest.mark.filterwarnings("ignore:not steady:UserWarning")]
MEDIAN = "impacts/all/normal_speed/median_above_floor"


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The study of the small mill as a table: six designs."""
    from conftest import PROGRAM, SMALL

    folder = tmp_path_factory.mktemp("study")
    (folder / "deck.ini").write_text(SMALL)
    (folder / "a.study").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MILLSIM", str(PROGRAM))
        return milltools.sweep(folder / "a.study", folder / "a.parquet", workers=1)


def test_a_sweep_is_its_table(swept):
    table = swept.table
    assert swept.complete and len(table) == 6 and set(table["status"]) == {"done"}
    assert list(table["balls.count"]) == [40, 60] * 3
    pd.testing.assert_frame_equal(table, milltools.load_study(swept.path).table)
    pd.testing.assert_frame_equal(table, milltools.load_study(swept.path.with_name("a.study")).table)


def test_what_is_there_is_not_run_again(swept):
    before = list(swept.table["finished"])
    again = milltools.sweep(swept.path.with_name("a.study"), swept.path)
    assert list(again.table["finished"]) == before


def test_the_best_design_is_a_deck_that_can_be_run(swept):
    best = swept.best
    rows = swept.table
    row = rows.loc[rows[MEDIAN].idxmax()]
    assert best.objective == MEDIAN and set(best.design) == {"rotor.speed", "balls.count"}
    assert best.value.value == row[MEDIAN] and best.value.unit == "m s-1"
    deck = milltools.read_deck(swept.path.with_name("deck.ini"), **best.design)
    assert float(deck["rotor"]["speed"].split()[0]) == row["rotor.speed"]
    assert deck["balls"]["count"] == str(row["balls.count"])


def test_it_says_what_it_found_and_draws_it(swept):
    assert "6 of 6 runs: 6 done; complete" in repr(swept) and "optimum" in repr(swept)
    assert swept._repr_html_().startswith("<pre>a: median")
    assert list(swept.figures) == ["contour", "slices"]
    assert len(swept.plot().axes) > 1 and len(swept.plot("slices").axes) == 2
    with pytest.raises(milltools.InputError, match="unknown figure 'pareto': one of contour, slices"):
        swept.plot("pareto")


@pytest.mark.slow
def test_a_study_may_be_a_text_or_a_dictionary(swept, tmp_path, small_deck, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dictionary = {
        "study": {"deck": "deck.ini", "maximise": MEDIAN, "record": "rotor/power"},
        "set": {"run.time": "60 ms"},
        "vary": {"rotor.speed": "300, 600, 900 rpm", "balls.count": "40..60 step 20"},
    }
    for study, name in ((STUDY, "text.parquet"), (dictionary, "dictionary.parquet")):
        found = milltools.sweep(study, name, balls__count=40, workers=2)
        expected = swept.table[swept.table["balls.count"] == 40]
        assert list(found.table[MEDIAN]) == list(expected[MEDIAN])
    assert sorted(os.listdir()) == ["deck.ini", "dictionary.parquet", "text.parquet"]
    with pytest.raises(milltools.InputError, match="needs the name of its table"):
        milltools.sweep(dictionary)


@pytest.mark.parametrize(
    "options, kind, words",
    [
        ({"study__replicate": 2}, milltools.InputError, r"--set study.replicate=2: \[study\] replicate: unknown key"),
        ({"vary__rotor__speed": "3 m"}, milltools.InputError, r"vary.rotor.speed=3 m"),
        ({"workers": 0}, milltools.InputError, "workers: expected 1 or more, got 0"),
        ({"speed": 3}, TypeError, "unexpected keyword argument 'speed'"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_is_written(write_study, tmp_path, options, kind, words):
    study = write_study()
    with pytest.raises(kind, match=words) as fault:
        milltools.sweep(study, tmp_path / "b.parquet", **options)
    assert "\n" not in str(fault.value)
    assert sorted(os.listdir(tmp_path)) == ["a.study", "deck.ini"]


def test_a_fault_of_a_text_names_no_temporary_file(tmp_path, small_deck, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(milltools.InputError, match=r"^a\.study:4: \[study\] maximize: unknown key"):
        milltools.sweep(STUDY.replace("record =", "maximize ="), "a.parquet")


@pytest.mark.slow
def test_runs_that_failed_are_a_warning(write_study, stand_in, monkeypatch, tmp_path):
    monkeypatch.setenv("MILLSIM", stand_in('case "$seed" in 1) echo "millsim: no luck" >&2; exit 1 ;; esac'))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = milltools.sweep(
            write_study(STUDY.replace("300, 600, ", "")), tmp_path / "a.parquet", study__replicates=2
        )
    failed = [str(one.message) for one in told if "runs failed" in str(one.message)]
    assert failed == [f"{tmp_path / 'a.parquet'}: 2 of 4 runs failed; the most frequent message: no luck"]
    assert [one.filename for one in told if "runs failed" in str(one.message)] == [__file__]
    assert found.complete


@pytest.mark.slow
def test_a_search_finds_a_design(write_study, tmp_path):
    found = milltools.optimize(write_study(), tmp_path / "s.parquet", runs=6, workers=1)
    assert len(found.table) <= 6 and found.best.design["balls.count"] in ("40", "60")
    with pytest.raises(milltools.InputError, match="--runs: expected 1 or more"):
        milltools.optimize(tmp_path / "a.study", tmp_path / "s.parquet", runs=0)
