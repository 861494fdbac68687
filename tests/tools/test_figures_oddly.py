"""Figures of runs with names and numbers that are rare."""

import subprocess

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, SMALL

from milltools.figures import FIGURES
from milltools.read.runfile import Run


@pytest.fixture
def run_file(tmp_path):
    (tmp_path / "deck.ini").write_text(SMALL)
    subprocess.run([PROGRAM, "deck.ini", "-q"], cwd=tmp_path, check=True, capture_output=True)
    return tmp_path / "deck.h5"


def shown(figure):
    return [text.get_text() for legend in figure.legends for text in legend.texts]


@pytest.mark.parametrize("name", ["speeds", "slip-power", "torque", "energy", "collisions"])
def test_runs_whose_names_begin_with_an_underscore_are_in_the_legend(run_file, name):
    """matplotlib leaves out what begins with one."""
    paths = [run_file.with_name(f"_{letter}.h5") for letter in "ab"]
    for path in paths:
        path.write_bytes(run_file.read_bytes())
    with Run(paths[0]) as one, Run(paths[1]) as other:
        words = "".join(shown(FIGURES[name].draw([one, other])))
    assert "_a, " in words and "_b, " in words


def test_a_torque_that_is_negative_throughout_fills_its_picture(run_file):
    """As of a rotor that turns the other way round."""
    with h5py.File(run_file, "r+") as file:
        torque = file["observables/rotor_torque/value"]
        torque[:] = -0.01 - 0.001 * np.cos(np.arange(len(torque)))
    with Run(run_file) as run:
        low, high = FIGURES["torque"].draw(run).axes[0].get_ylim()
    assert low == pytest.approx(-0.01155, rel=0.01)
    assert high == 0
