"""make validate-paper: is a verdict what its number says, and is the place of an impact where it is? No mill needed."""

import pathlib
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation" / "paper"), str(ROOT / "validation")]

import log
import process
import speeds
import study_case
import verdicts

from milltools.read.deck import Blade


@pytest.fixture
def case(tmp_path, monkeypatch):
    """A part that keeps its measurements in tmp_path."""
    monkeypatch.setattr(study_case, "KEPT", tmp_path)
    monkeypatch.setattr(verdicts, "KEPT", tmp_path)
    monkeypatch.setattr(verdicts, "version", lambda: "1.0")
    return verdicts.PaperCase(tmp_path, tmp_path, keep=True)


def verdict(case, *args, **words):
    case.ask("a statement", "a question", *args, **words)
    return case.claims[-1].verdict


def test_a_number_far_above_its_bound_confirms_and_far_below_refutes(case):
    assert verdict(case, [59.0, 60.0, 61.0], above=50) == "confirmed"
    assert verdict(case, [39.0, 40.0, 41.0], above=50) == "refuted"
    assert verdict(case, [39.0, 40.0, 41.0], below=50) == "confirmed"


def test_a_number_within_students_quantile_of_its_bound_leaves_the_question_open(case):
    # three runs: 4.30 standard errors of 0.577 each are 2.48
    assert verdict(case, [51.4, 52.4, 53.4], above=50) == "open"
    assert verdict(case, [51.6, 52.6, 53.6], above=50) == "confirmed"


def test_a_band_confirms_within_and_refutes_beyond_its_edges(case):
    assert verdict(case, 0.17, expected=0.17, band=0.02, error=0.005) == "confirmed"
    assert verdict(case, 0.185, expected=0.17, band=0.02, error=0.005) == "open"
    assert verdict(case, 0.24, expected=0.17, band=0.02, error=0.005) == "refuted"


def test_what_the_mill_cannot_say_is_open_and_no_failure(case):
    assert verdict(case, reason="no steady state") == "open"
    assert case.claims[-1].holds


def test_a_question_without_a_number_is_a_failure(case):
    verdict(case, float("nan"), above=0)
    assert not case.claims[-1].holds


def test_a_statement_whose_answers_differ_counts_them(case):
    for bound in (10, 20, 50):
        case.ask("border", f"above {bound}", 40, above=bound, error=1)
    assert verdicts.overall(case.claims) == "2 confirmed, 1 refuted"
    assert "*2 confirmed, 1 refuted*" in case.table()[0]


def test_what_is_wanted_has_the_unit_of_the_answer(case):
    case.ask("border", "near", 40, above=50, error=1, unit="%")
    assert "| near | > 50 % | 40 +- 1 % |" in "\n".join(case.table())


def test_the_first_sentence_counts_statements_and_answers(case):
    case.ask("border", "near", 40, above=50, error=1)
    case.ask("border", "wide", 60, above=50, error=1)
    case.ask("rare", "share", 5, below=10, error=1)
    said = verdicts.counted(case.claims)
    assert said.startswith("2 statements: 1 confirmed, 0 refuted, 0 open, 1 with answers that differ")
    assert "of 3 answers 2 confirmed, 1 refuted, 0 open" in said


def test_what_was_measured_is_kept_and_not_measured_again(case):
    assert case.kept("once", lambda: [1.0]) == [1.0]
    assert case.kept("once", lambda: [2.0]) == [1.0]
    case.keep = False
    assert case.kept("once", lambda: [3.0]) == [3.0]


def test_a_place_is_as_far_from_a_blade_as_from_its_nearest_face_edge_or_corner():
    blade = Blade(0.01, 0.0, 0.06, 0.012, 0.008, 0.0)
    places = np.array(
        [
            [0.01, 0.05, 0.001],  # inside
            [0.01, 0.065, 0.0],  # 5 mm beyond the tip
            [0.01, 0.03, 0.007],  # 3 mm before its face
            [0.019, 0.03, 0.008],  # 3 mm beside and 4 mm before: the edge
        ]
    ).T
    assert log.box_distance(blade, 0.0, *places) == pytest.approx([0, 5e-3, 3e-3, 5e-3], abs=1e-15)


def test_a_blade_is_where_the_rotor_has_turned_it():
    blade = Blade(0.0, 0.0, 0.06, 0.012, 0.008, 0.0)
    assert log.box_distance(blade, np.pi / 2, 0.0, 0.0, 0.065) == pytest.approx(5e-3)
    assert log.box_distance(blade, np.pi / 2, 0.0, 0.065, 0.0) == pytest.approx(0.061)


def test_the_most_frequent_speed_of_rayleighs_distribution_is_found_to_three_per_cent():
    v = np.random.default_rng(1).rayleigh(0.17, 400_000)
    assert speeds.maximum(v) == pytest.approx(0.17, rel=0.03)


def test_the_exponents_of_a_power_law_are_found_within_their_errors():
    import pandas

    random = np.random.default_rng(2)
    keys = {"rotor.speed": (40, 150), "balls.fill": (0.05, 0.2), "balls.diameter": (4e-3, 7e-3)}
    table = pandas.DataFrame({k: random.uniform(*r, 200) for k, r in keys.items()})
    table["contact.restitution"] = random.uniform(0.7, 0.95, 200)
    law = table["rotor.speed"] ** 2.5 * table["balls.fill"] * (1 - table["contact.restitution"] ** 2) ** 0.3
    table["rotor/power"] = law * np.exp(random.normal(0, 0.05, 200))
    found, explained = process.exponents(table, "rotor/power")
    for key, expected in zip(process.KEYS, (2.5, 1.0, 0.0, 0.3)):
        value, error = found[key]
        assert abs(value - expected) < 4 * error < 0.2
    assert explained > 0.98
