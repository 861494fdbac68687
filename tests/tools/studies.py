"""What the tests of studies share: a study of the small mill, and programs in millsim's place."""

import shlex

import pytest
from conftest import PROGRAM

STUDY = """\
[study]
deck = deck.ini
maximise = impacts/all/normal_speed/median_above_50mm_s
record = rotor/power
[set]
run.time = 10 ms
[vary]
rotor.speed = 300, 600, 900 rpm
balls.count = 10..20 step 10
"""
MEDIAN = "impacts/all/normal_speed/median_above_50mm_s"


@pytest.fixture
def write_study(write_deck):
    """write_study(text, name) writes the small mill as deck.ini and a study deck beside it."""

    def write(text=STUDY, name="a.study"):
        write_deck()
        return write_deck(text, name)

    return write


@pytest.fixture(autouse=True)
def the_program(monkeypatch):
    """Studies read in the test itself ask the millsim under test."""
    monkeypatch.setenv("MILLSIM", str(PROGRAM))


@pytest.fixture
def stand_in(tmp_path):
    """stand_in(shell) makes a program in millsim's place: what is no run of a design is millsim's own business; a run is
    logged in `runs` as "PID SEED SPEED", then the shell text is done, then millsim."""

    def make(shell):
        path = tmp_path / "stand-in"
        path.write_text(
            f"""#!/bin/sh
case " $* " in *--value*|*--check*|*--version*|*"run.time=1 ns"*) exec {shlex.quote(str(PROGRAM))} "$@" ;; esac
for word; do case $word in run.seed=*) seed=${{word#*=}} ;; rotor.speed=*) speed=${{word#*=}} ;; esac; done
log={shlex.quote(str(tmp_path))}/runs
echo "$$ $seed $speed" >> "$log"
{shell}
exec {shlex.quote(str(PROGRAM))} "$@"
"""
        )
        path.chmod(0o755)
        return str(path)

    return make


def runs(folder):
    """The stand-in's log: (pid, seed, speed as text) of each run that was begun."""
    path = folder / "runs"
    lines = path.read_text().splitlines() if path.exists() else []
    return [(int(line.split()[0]), int(line.split()[1]), line.split()[2]) for line in lines]


def alive(pid):
    """Is there such a process, and no zombie?"""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
