"""Same deck, same bits: this build stores the frozen values."""

import json
import math
import shutil
import sys

import pytest
from conftest import PROGRAM, ROOT, slow

sys.path.insert(0, str(ROOT / "tests/golden"))

import golden

WHY = "a frozen hash changes only with a reason in CHANGELOG.md: see tests/golden/README.md"


@pytest.mark.long  # `make golden` runs the same decks
@pytest.mark.parametrize("name", slow(golden.DECKS, "stl"))
@pytest.mark.skipif(not golden.is_reference(), reason="frozen on Debian 12, x86-64, FMA")
def test_a_golden_deck_stores_the_frozen_values(tmp_path, name):
    frozen = json.loads(golden.FROZEN.read_text())[name]
    assert golden.differing(golden.run(PROGRAM, name, tmp_path), frozen) == [], WHY


@pytest.mark.slow
def test_the_hashes_do_not_depend_on_where_the_deck_lies_or_when_it_runs(millsim, tmp_path):
    for folder in ("here", "there"):
        shutil.copytree(ROOT / "input", tmp_path / folder)
        done = millsim("-q", "-o", f"{folder}.h5", f"{folder}/single.ini")
        assert done.returncode == 0, done.stderr
    here, there = (golden.fingerprint(tmp_path / f"{f}.h5") for f in ("here", "there"))
    assert set(here) == {*golden.GROUPS, "energies"}
    assert golden.differing(here, there) == []


@pytest.mark.slow
def test_the_hashes_see_the_last_bit_of_a_start_position(millsim, tmp_path):
    marks = []
    for height in (0.03, math.nextafter(0.03, 1)):
        shutil.copytree(ROOT / "input", tmp_path, dirs_exist_ok=True)
        start = f"0 0.045 {height!r}\n-0.03 -0.045 0 0.5 0 0\n0.03 -0.045 0 -0.5 0 0\n"
        (tmp_path / "single.txt").write_text(start)
        assert millsim("-q", "-f", "single.ini").returncode == 0
        marks.append(golden.fingerprint(tmp_path / "single.h5"))
    assert "impacts" in golden.differing(*marks)


@pytest.mark.slow
def test_only_a_deck_that_was_changed_changes_the_decks_hash(millsim, tmp_path):
    marks = []
    for seed in (1, 2):
        done = millsim("-q", "-f", ROOT / "input/single.ini", "-s", f"run.seed={seed}")
        assert done.returncode == 0, done.stderr
        marks.append(golden.fingerprint(tmp_path / "single.h5"))
    assert golden.differing(*marks) == ["deck"]  # a start file leaves nothing to chance
