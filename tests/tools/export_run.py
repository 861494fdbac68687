"""A small run with two kinds of balls, spins, a turning rotor and every impact logged, for the tests of mill export."""

import os
import subprocess
import sys

import h5py
import pytest
from conftest import PROGRAM, SMALL, lasting

from milltools import __main__ as command

KINDS = SMALL.replace(
    "[balls]\ncount = 20\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n",
    "[balls.steel]\ncount = 16\ndiameter = 5 mm\ndensity = 7800 kg/m^3\n"
    "[balls.glass]\ncount = 7\ndiameter = 3.1 mm\ndensity = 2500 kg/m^3\n[balls]\nspeed = 1 m/s\n",
)
DECK = f"{KINDS}impacts = all\n"
FRAMES, BALLS, INTERVAL = 11, 23, 0.005


def make(folder, name="mill.h5", *options):
    """Runs DECK there; path of the output file."""
    deck = folder / "kinds.ini"
    deck.write_text(DECK)
    words = [PROGRAM, "-q", "-o", folder / name, *options, deck]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder / name


@pytest.fixture(scope="session")
def run_file(tmp_path_factory):
    return make(tmp_path_factory.mktemp("export"))


@pytest.fixture(scope="session")
def stored(run_file):
    """What h5py reads."""
    with h5py.File(run_file) as file:
        yield file


@pytest.fixture
def export(tmp_path, monkeypatch, capsys):
    """export(*words) is `mill export` in tmp_path, in this process: (status, standard output, standard error); the
    latter with lines of progress only if progress=True."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))
    monkeypatch.chdir(tmp_path)

    def call(*words, progress=False):
        monkeypatch.setattr(sys, "argv", ["mill", "export", *map(str, words)])
        capsys.readouterr()
        status = command.main()
        out, err = capsys.readouterr()
        return status, out, err if progress else lasting(err)

    return call


def names(folder):
    """Everything below a folder, by its path in it."""
    return sorted(os.path.relpath(p, folder) for p in folder.rglob("*"))
