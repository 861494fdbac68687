"""Runs that `mill watch` follows: `pytest_plugins = ["watched"]` for the fixtures."""

import base64
import json
import subprocess
import time

import numpy as np
import pytest
from conftest import PROGRAM, SLOWER, SMALL

KINDS = {"f4": "<f4", "f8": "<f8", "u4": "<u4", "u1": "u1"}
ENDLESS = ("-s", "run.time=10000 s", "-s", "output.frames=1 s", "-s", "output.series=1 s")
OFTEN = ("-s", "output.checkpoint=0.2 s")


def decoded(value):
    """A value of the server's JSON with its arrays as numpy arrays."""
    if isinstance(value, list):
        return [decoded(one) for one in value]
    if isinstance(value, dict):
        if len(value) == 1 and (kind := next(iter(value))) in KINDS:
            return np.frombuffer(base64.b64decode(value[kind], validate=True), KINDS[kind])
        return {name: decoded(one) for name, one in value.items()}
    return value


def until(true, seconds=30.0):
    """Waits until a function is true; returns its value."""
    end = time.monotonic() + seconds * SLOWER
    while not (found := true()):
        assert time.monotonic() < end, "never came true"
        time.sleep(0.05)
    return found


def messages(answer, kind):
    return [message for message in answer["news"] if message["type"] == kind]


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
