"""Runs that `mill watch` follows: `pytest_plugins = ["watched"]`."""

import json
import subprocess

import pytest
from conftest import PROGRAM, SMALL
from watching import ENDLESS, OFTEN


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(output file of a finished run, what `millsim --json` said about it)."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "deck.ini").write_text(SMALL)
    words = [PROGRAM, "-q", "--json", "-o", "run.h5", "-s", "run.time=100 ms", "deck.ini"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True)
    return folder / "run.h5", json.loads(done.stdout)


@pytest.fixture
def running(start_millsim, write_deck, tmp_path):
    """running(*options) starts an endless run with short checkpoints; returns its process and the path of its file."""

    def start(*options):
        write_deck()
        return start_millsim("-q", "-o", "a.h5", *ENDLESS, *OFTEN, *options, "deck.ini"), tmp_path / "a.h5"

    return start
