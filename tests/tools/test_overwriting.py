"""No tool writes its output over the run that it comes from."""

import pytest
from conftest import SMALL


@pytest.mark.parametrize(
    "name, words",
    [
        ("run", ["plot", "run", "run"]),  # a name without a suffix is a PNG
        ("run", ["plot", "run", "./run"]),
        ("run.svg", ["plot", "--figure", "speeds", "run.svg", "run.svg"]),
        ("run.gsd", ["export", "run.gsd", "run.gsd"]),
        ("run.stl", ["export", "run.stl", "run.stl"]),
        ("run.html", ["compare", "deck.h5", "run.html", "--html", "run.html"]),
        ("run.csv", ["compare", "run.csv,deck.h5", "deck.h5", "--csv", "run.csv"]),
    ],
)
def test_a_run_is_not_overwritten_by_what_is_made_of_it(millsim, mill, write_deck, tmp_path, name, words):  # fmt: skip
    write_deck(SMALL)
    assert millsim("deck.ini", "-q").returncode == 0
    assert millsim("deck.ini", "-q", "-o", name).returncode == 0
    before = (tmp_path / name).read_bytes()
    done = mill(*words)
    assert done.returncode == 2
    assert f"is the input file {name} itself; give another name" in done.stderr
    assert (tmp_path / name).read_bytes() == before
