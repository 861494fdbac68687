"""`mill watch` as a command: a run that it follows, a deck that it runs."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, SLOWER, SMALL
from watching import ENDLESS, OFTEN, until

from milltools.read.runfile import Run

pytest_plugins = ["watched"]


@pytest.fixture
def watch(tmp_path):
    """watch(*words) starts `mill watch --no-browser` in tmp_path; returns the process and its address. Ended after the
    test."""
    started = []

    def start(*words, browser=False):
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "tools"), "MILLSIM": str(PROGRAM)}
        process = subprocess.Popen(
            [sys.executable, "-m", "milltools", "watch", *["--no-browser"] * (not browser), *map(str, words)],
            cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True,
        )  # fmt: skip
        started.append(process)
        return process, process.stdout.readline().strip()

    yield start
    for process in started:
        process.kill()
        process.communicate()


def differences(one, other):
    """Paths of all values outside of /run that differ between two output files, but the interval of checkpoints."""
    found = []
    with h5py.File(one) as a, h5py.File(other) as b:
        names = [set(), set()]
        for file, own in zip((a, b), names):
            file.visit(own.add)
        found += names[0] ^ names[1]
        for name in names[0] & names[1]:
            if isinstance(a[name], h5py.Dataset) and not name.startswith("run/"):
                same = a[name][()], b[name][()]
                if np.asarray(same[0]).tobytes() != np.asarray(same[1]).tobytes() and same[0] != same[1]:
                    found.append(name)
    return set(found) - {"deck/text", "deck/output/checkpoint"}


@pytest.mark.slow
def test_a_deck_is_run_to_the_same_bits(watch, millsim, small_deck, tmp_path):
    options = ("-s", "run.time=200 s", "-s", "output.frames=1 s", "-s", "output.series=200ms")
    process, address = watch("-o", "a.h5", *options, *OFTEN, "--until-done", "deck.ini")
    said, complaints = process.communicate(timeout=120 * SLOWER)
    assert process.returncode == 0 and re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", address), complaints
    assert "rotor power" in said  # the summary of millsim
    millsim("-q", "-o", "b.h5", *options, "deck.ini")
    assert differences(tmp_path / "a.h5", tmp_path / "b.h5") == set()
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "complete" and run.about("checkpoints") > 0


@pytest.mark.parametrize(
    ("options", "interval"),
    [((), 2.0), (("-s", "output.checkpoint=1 s"), 1.0), (("-s", "output.checkpoint=90 s"), 90.0)],
)
@pytest.mark.slow
def test_checkpoints_are_frequent_unless_the_user_says_otherwise(watch, small_deck, tmp_path, options, interval):
    process, _ = watch("-o", "a.h5", "--until-done", *options, "deck.ini")
    process.communicate(timeout=60 * SLOWER)
    with Run(tmp_path / "a.h5") as run:
        assert run.quantity("output/checkpoint") == interval


@pytest.mark.slow
def test_ctrl_c_saves_a_deck_and_says_how_to_go_on(watch, small_deck, tmp_path):
    options = ("-s", "run.time=300 s", "-s", "output.frames=200ms", "-s", "output.series=200ms")
    process, _ = watch("-o", "a.h5", *options, "deck.ini")
    until((tmp_path / "a.h5").exists)
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, complaints = process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 130
    last = complaints.strip().splitlines()[-1]
    assert last.startswith("mill watch: the run is stopped; this goes on with it: ")
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "stopped" and 0 < run.time < 300
    words = shlex.split(last.partition("with it: ")[2])
    subprocess.run([PROGRAM, "-q", *words[1:]], cwd=tmp_path, check=True, capture_output=True)
    with Run(tmp_path / "a.h5") as run:
        assert run.status == "complete" and run.time == 300


@pytest.mark.slow
def test_a_deck_that_was_killed_fails(watch, small_deck, tmp_path):
    process, address = watch("-o", "a.h5", *ENDLESS, "--until-done", "deck.ini")
    until((tmp_path / "a.h5").exists)
    (child,) = open(f"/proc/{process.pid}/task/{process.pid}/children").read().split()
    os.kill(int(child), signal.SIGKILL)
    _, complaints = process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 137 and "millsim was ended by signal 9" in complaints


@pytest.mark.slow
def test_a_finished_run_is_watched_until_ctrl_c(watch, whole):
    process, address = watch(whole[0])
    assert process.stderr.readline() == f"mill watch: {whole[0]}: complete at 0.1 s\n"
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60 * SLOWER)
    assert (process.returncode, said) == (0, ("", ""))


def test_until_done_ends_with_a_finished_run(mill, whole):
    done = mill("watch", "--no-browser", "--until-done", "--json", whole[0])
    assert done.returncode == 0
    facts = {"command": "watch", "files": [], "run": str(whole[0]), "state": "complete", "time": 0.1}
    assert json.loads(done.stdout) == facts


@pytest.mark.slow
def test_a_missing_run_is_waited_for_in_a_clear_line(watch, small_deck, tmp_path, millsim):
    process, _ = watch("--until-done", "later.h5")
    assert process.stderr.readline() == "mill watch: later.h5: does not exist yet: waiting for its run\n"
    millsim("-q", "-o", "later.h5", "deck.ini")
    process.communicate(timeout=60 * SLOWER)
    assert process.returncode == 0


def test_the_browser_is_opened_without_the_token_on_its_command_line(watch, whole, tmp_path, monkeypatch):
    program = tmp_path / "browser"
    program.write_text('#!/bin/sh\nprintf %s "$1" > words.tmp; cp "${1#file://}" page.html; mv words.tmp words\n')
    program.chmod(0o755)
    monkeypatch.setenv("BROWSER", f"{program} %s &")
    _, address = watch(whole[0], browser=True)
    words = until(lambda: (tmp_path / "words").exists() and (tmp_path / "words").read_text())
    token = address.split("/")[3]
    assert words.startswith("file://") and token not in words
    assert f"url={address}" in (tmp_path / "page.html").read_text()
    folder = os.path.dirname(words.removeprefix("file://"))
    assert os.stat(folder).st_mode & 0o077 == 0


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("none.ini",), "none.ini: cannot be read"),
        (("-s", "drum.radius=75 s", "deck.ini"), "[drum] radius: expected"),
        (("-o", "deck.ini", "deck.ini"), "deck.ini: exists already; --force overwrites it"),
        (("-f", "-o", "deck.ini", "deck.ini"), "deck.ini"),
        (("-f", "later.h5"), "later.h5: is the output file of a run; -s, -o and -f are for decks"),
        (("--port", "70000", "later.h5"), "--port 70000: "),
    ],
)
def test_wrong_usage_is_one_line(mill, small_deck, words, line):
    done = mill("watch", "--no-browser", "--until-done", *words)
    assert done.returncode in (1, 2) and line in done.stderr and len(done.stderr.strip().splitlines()) == 1
    assert small_deck.read_text() == SMALL
