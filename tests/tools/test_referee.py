"""The input of LAMMPS that validation/referee writes for a deck. LAMMPS itself is not needed."""

import math
import pathlib
import subprocess
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "validation" / "referee")]

import script
from comparison import DECKS
from lammps_run import SPEEDS

from milltools.base.engine import program
from milltools.read.deck import Contact, Deck
from milltools.read.runfile import Run

LAW = Contact(0.8, 0.3, 0.484)


def made(name, *sets):
    path, own = DECKS[name]
    deck = Deck.check(path, [*own, *sets])
    return deck, script.write(deck, deck.start(), 1e10, 3.0, 1e-6)


def test_a_jar_turns_and_moves():
    deck, found = made("planetary")
    lines = [line for line in found.lines if line.startswith(("region jar", "fix jar"))]
    assert lines[0].startswith("region jar cylinder z 0.07") and lines[0].endswith(" 0 0 0 0 1")
    assert " move v_jarx v_jary NULL rotate v_jarturn 0.07" in lines[0]
    assert lines[1].startswith("fix jar all wall/gran/region granular hooke ") and lines[1].endswith(
        "region jar contacts"
    )
    assert sum(line.startswith("create_atoms") for line in found.lines) == 7
    assert found.mass == pytest.approx(deck.species[0].mass) and SPEEDS == (0.5, 1.0, 2.0)


@pytest.mark.parametrize("name", ["planetary", "emax", "mixer", "vibratory", "attritor"])
def test_a_course_is_the_motion_of_millsim(name, tmp_path):
    deck, found = made(name, "balls.count=1", "run.time=20 ms", "run.sample_from=0 s", "output.frames=1 ms")
    words = [word for one in deck.overrides for word in ("-s", one)]
    subprocess.run([program(), "-q", "-o", tmp_path / "run.h5", *words, deck.path], check=True, capture_output=True)
    course = next(wall.course for wall in found.walls if wall.course.angle != "0" or wall.course.shift != ("0",) * 3)
    point, by = np.array([0.013, -0.004, 0.007]), 1e-6
    _, first = course.at(0.0)
    body = next(name for name in deck.bodies if deck.value(f"body.{name}.motion"))
    carrier = deck.value(f"body.{body}.motion")

    def place(time):
        angle, shift = course.at(time)
        arm = point - course.pivot
        turned = arm * math.cos(angle) + np.cross(course.axis, arm) * math.sin(angle)
        turned = turned + course.axis * (course.axis @ arm) * (1 - math.cos(angle)) if course.axis.any() else arm
        return course.pivot + turned + shift - first

    with Run(tmp_path / "run.h5") as run:
        for k, time in enumerate(run.frame_times()):
            pose, begin = run.poses(k)[carrier], run.poses(0)[carrier]
            local = begin[:, :3].T @ (point - begin[:, 3])
            assert place(time) == pytest.approx(pose[:, :3] @ local + pose[:, 3], abs=1e-6)
    at, velocity, _, matrix = course.moving(0.01)
    assert velocity + (place(0.01) - at) @ matrix == pytest.approx(
        (place(0.01 + by) - place(0.01 - by)) / (2 * by), rel=1e-4
    )


def strike(words, mass, slip, steps=2000):
    """Speed and slip after an impact at 1 m/s with the law of these words, which ends when it would attract."""
    stiff, damping, spring, share = (float(words.split()[k]) for k in (1, 2, 5, 6))
    dt, depth, rate, shift = math.pi * math.sqrt(mass / stiff) / steps, 0.0, 1.0, 0.0
    for _ in range(2 * steps):
        force = stiff * depth + damping * mass * rate
        if force <= 0:
            break
        drag = spring * shift + share * damping * mass * slip
        rate, slip = rate - dt * force / mass, slip - 3.5 * dt * drag / mass
        depth, shift = depth + dt * rate, shift + dt * slip
    return -rate, slip


def test_the_limited_law_has_the_restitutions_of_the_deck():
    speed, slip = strike(script.limited(LAW, 1e6, 0.01), 0.01, 1.0)
    assert speed == pytest.approx(0.8, abs=0.003) and slip == pytest.approx(-0.484, abs=0.005)


def test_the_attracting_law_is_in_words_of_lammps():
    assert script.attracting(LAW, 1e6, 0.01).startswith("hooke 1000000 0.8000")
    assert script.attracting(LAW, 1e6, 0.01).endswith("damping coeff_restitution")


@pytest.mark.parametrize("name", ["attritor", "shaker", "stl", "mixture"])
def test_what_lammps_cannot_do_is_refused(name):
    deck = Deck.check(ROOT / "input" / f"{name}.ini")
    with pytest.raises(script.Refused):
        script.write(deck, [np.zeros((1, 3))] * 3, 1e10, 3.0, 1e-6)


def test_a_wavy_drum_is_arcs():
    _, found = made("wavy")
    lines = "\n".join(found.lines)
    assert lines.count("region arc") == 12 and "region bulges union 7 core arc0 arc2" in lines
    assert "fix ends all wall/gran granular" in lines and "xplane -0.012" in lines
