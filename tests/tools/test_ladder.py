"""make validate: what a claim that is known not to hold means."""

import datetime
import os
import pathlib
import re
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "validation"))

import ladder
import parts


@pytest.fixture
def case(tmp_path):
    return ladder.Case(tmp_path, tmp_path)


def test_a_claim_outside_its_band_is_no_fault_if_it_is_known_why(case):
    case.bound("off", 2, 1, against="theory", known="the theory is too simple")
    (claim,) = case.claims
    assert not claim.holds and claim.as_known
    assert "**NO**: the theory is too simple" in ladder.claims_table(case.claims)[-1]


def test_a_claim_that_holds_against_what_is_known_is_a_fault(case):
    case.claim("on", 1, 1, 0.1, against="theory", known="the theory is too simple")
    (claim,) = case.claims
    assert claim.holds and not claim.as_known
    assert "against what is known" in ladder.claims_table(case.claims)[-1]


def test_a_claim_of_which_nothing_is_known_must_hold(case):
    case.bound("off", 2, 1, against="theory")
    assert not case.claims[0].as_known


@pytest.mark.parametrize("known, status", [("the theory is too simple", 0), ("", 1)])
def test_a_comparison_fails_for_a_deviation_of_which_nothing_is_known(tmp_path, monkeypatch, known, status):
    (tmp_path / "off_by_two.py").write_text(
        f'"""Off."""\ndef check(case):\n    case.bound("off", 2, 1, against="theory", known={known!r})\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "off_by_two", raising=False)
    monkeypatch.setattr(sys, "argv", ["validate.py", "one"])
    named = {"one": ("off_by_two",)}
    assert (
        parts.main(
            "Claims.",
            "runs",
            tmp_path,
            "Title",
            "",
            named,
            lambda at, scratch, kept: parts.Part(at, scratch),
        )
        == status
    )


def test_results_say_version_day_and_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(ladder, "PROGRAM", tmp_path / "millsim")
    ladder.PROGRAM.write_text("#!/bin/sh\necho millsim 1.2.3-4-gabc\n")
    ladder.PROGRAM.chmod(0o755)
    parts.write_results(
        "Title", "make x", "words", [], tmp_path / "parts.md", lambda claims: "0 of 0", lambda results: []
    )
    ladder.write_results([], tmp_path / "ladder.md")
    today = datetime.date.today()
    for name in ("parts.md", "ladder.md"):
        said = (tmp_path / name).read_text().splitlines()[4]
        assert re.fullmatch(rf"Written with millsim 1\.2\.3-4-gabc on {today}: .+, {os.cpu_count()} cores, .+\.", said)
