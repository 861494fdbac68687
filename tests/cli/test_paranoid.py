"""Small mills of every character with each step checked against brute force: --paranoid."""

import json
import re

import numpy as np
import pytest
from conftest import ROOT, slow

KEYS = (
    "events",
    "predictions",
    "pairs",
    "surfaces",
    "gaps",
    "calendar entries",
    "cells",
    "balances",
    "quartics",
)
COUNTS = re.compile(
    r"paranoid: (\d+) events, (\d+) predictions, (\d+) pairs, (\d+) surfaces \((\d+) gaps\), "
    r"(\d+) calendar entries, (\d+) cells, (\d+) balances, (\d+) quartics: all held\n"
)

BASE = {
    "run": {"time": "60 ms"},
    "balls": {"count": "100", "diameter": "5 mm", "density": "7800 kg/m^3"},
    "drum": {"radius": "30 mm", "length": "40 mm"},
    "rotor": {"speed": "1000 rpm", "shaft_radius": "6 mm"},
    "blades": {"count": "2", "tip_radius": "22 mm", "width": "8 mm", "thickness": "4 mm"},
    "contact": {
        "restitution": "0.8",
        "friction": "0.3",
        "tangential_restitution": "0.484",
    },
    "output": {"frames": "0 s"},
}
THROWN = {**BASE["balls"], "speed": "2 m/s"}
WEIGHTLESS = {"acceleration": "0 0 0 m/s^2"}

# What is different from BASE: section -> keys added or changed, or None: without it
MILLS = {
    "pitched blades": {"blades": {"pitch": "25 deg"}},
    "mixture 1:3": {
        "balls": None,
        "balls.big": {"count": "10", "diameter": "7.5 mm", "density": "7800 kg/m^3"},
        "balls.small": {"count": "120", "diameter": "2.5 mm", "density": "2500 kg/m^3"},
        "blades": {"tip_radius": "19 mm"},
    },
    # so many of the smaller balls that each size has a grid of its own
    "mixture 1:4:10": {
        "run": {"time": "2 ms"},
        "balls": None,
        "balls.large": {"count": "6", "diameter": "5 mm", "density": "7800 kg/m^3"},
        "balls.medium": {"count": "150", "diameter": "2 mm", "density": "7800 kg/m^3"},
        "balls.small": {"count": "2400", "diameter": "0.5 mm", "density": "2500 kg/m^3"},
        "drum": {"radius": "12 mm", "length": "10 mm"},
        "rotor": {"speed": "3000 rpm", "shaft_radius": "2 mm"},
        "blades": {"count": "1", "tip_radius": "5 mm", "width": "3 mm", "thickness": "1 mm", "pitch": "20 deg"},
    },
    "mixture 1:3 in a planetary jar": {
        "run": {"time": "5 ms"},
        "drum": None,
        "rotor": None,
        "blades": None,
        "motion.sun": {"kind": "turn", "speed": "650 rpm"},
        "motion.jar": {"kind": "turn", "on": "sun", "centre": "70 0 0 mm", "speed": "-1300 rpm"},
        "body.jar": {
            "shape": "cylinder",
            "side": "inside",
            "motion": "jar",
            "centre": "70 0 0 mm",
            "radius": "14 mm",
            "length": "20 mm",
        },
        "balls": None,
        "balls.large": {"count": "5", "diameter": "6 mm", "density": "7800 kg/m^3"},
        "balls.small": {"count": "240", "diameter": "2 mm", "density": "7800 kg/m^3"},
    },
    "bare shaft": {"balls": THROWN, "blades": None},
    "no rotor": {"balls": THROWN, "rotor": None, "blades": None},
    "oblique gravity": {"gravity": {"acceleration": "4 -6 -5 m/s^2"}, "balls": THROWN},
    "no gravity": {"gravity": WEIGHTLESS, "balls": THROWN},
    "gravity along the axis": {"gravity": {"acceleration": "9.81 0 0 m/s^2"}, "balls": THROWN},
    "heavy gravity": {"run": {"time": "30 ms"}, "gravity": {"acceleration": "0 0 -200 m/s^2"}},
    "smooth": {"contact": {"friction": "0"}, "balls": THROWN},
    "very rough": {
        "contact": {"restitution": "1", "friction": "1", "tangential_restitution": "1"},
        "balls": THROWN,
    },
    "elastic gas": {
        "run": {"time": "100 ms"},
        "gravity": WEIGHTLESS,
        "balls": THROWN,
        "rotor": None,
        "blades": None,
        "contact": {"restitution": "1", "friction": "0"},
    },
    "tip gap of 1.5 diameters": {"blades": {"tip_radius": "22.4 mm", "thickness": "2 mm"}},
    "backwards and fast": {"rotor": {"speed": "-3000 rpm"}},
    "dense": {"balls": {"count": "250"}, "run": {"time": "8 ms"}, "drum": {"radius": "28 mm"}},
    "few in a wide drum": {
        "balls": {**THROWN, "count": "5", "diameter": "1 mm"},
        "drum": {"radius": "80 mm", "length": "150 mm"},
        "run": {"time": "200 ms"},
    },
    "periodic ends": {"drum": {"ends": "periodic", "length": "24 mm"}, "blades": {"count": "1"}},
    "periodic ends, a blade that goes through, buckles": {
        "drum": {"ends": "periodic", "length": "20 mm", "profile": "wavy", "buckles": "7", "buckle_height": "1 mm"},
        "blades": {"count": "1", "width": "20 mm"},
        "balls": {**THROWN, "count": "80"},
    },
    "periodic mixture": {
        "drum": {"ends": "periodic", "length": "32 mm"},
        "balls": None,
        "balls.big": {"count": "10", "diameter": "5 mm", "density": "7800 kg/m^3"},
        "balls.small": {"count": "900", "diameter": "1.2 mm", "density": "2500 kg/m^3"},
        "run": {"time": "2 ms"},
        "rotor": {"speed": "6000 rpm"},
    },
    "one ball": {"balls": {**THROWN, "count": "1"}, "run": {"time": "200 ms"}},
}

# no force across the axis: parabolas; and walls that move are searched in steps
WITHOUT_QUARTICS = {"no gravity", "gravity along the axis", "elastic gas", "mixture 1:3 in a planetary jar"}


def deck(changes):
    sections = {name: dict(keys) for name, keys in BASE.items()}
    for name, keys in changes.items():
        if keys is None:
            del sections[name]
        else:
            sections[name] = {**sections.get(name, {}), **keys}
    return "\n".join(
        f"[{name}]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items()) for name, keys in sections.items()
    )


def counts_of(stderr):
    found = COUNTS.findall(stderr)
    assert len(found) == 1, stderr
    return dict(zip(KEYS, map(int, found[0])))


@pytest.mark.parametrize("name", slow(MILLS, "mixture 1:4:10", "periodic mixture"))
def test_every_step_of_a_mill_holds_against_brute_force(name, millsim, write_deck):
    write_deck(deck(MILLS[name]))
    done = millsim("deck.ini", "--paranoid", "--json", "--quiet")
    assert done.returncode == 0, done.stderr
    run = json.loads(done.stdout)["run"]
    counts = counts_of(done.stderr)
    balls, images = len_of(MILLS[name]), 3 if name.startswith("periodic") else 1
    assert counts["events"] > 20
    assert all(counts[key] > 0 for key in KEYS[:-1] if key != "pairs" or balls > 1), counts
    assert (counts["quartics"] == 0) == (name in WITHOUT_QUARTICS)
    assert counts["pairs"] == counts["predictions"] * (balls - 1) * images
    assert counts["calendar entries"] >= counts["events"] * balls
    assert run["overlaps"] == 0


ROUND = ["single", "tumbling", "discs", "mixture", "simoloyer", "wavy"]  # the decks whose drum stands still


@pytest.mark.parametrize("name", slow(ROUND, *ROUND[2:]))
def test_other_solvers_share_every_contact_time_of_the_decks(name, millsim):
    short = ("-s", "run.time=3 ms", "-s", "run.sample_from=0 s", "-s", "run.precision=0", "-o", "run.h5")
    done = millsim("--paranoid", "--quiet", *short, ROOT / f"input/{name}.ini")
    assert done.returncode == 0 and counts_of(done.stderr)["quartics"] > 0, done.stderr


def len_of(changes):
    sections = {**BASE, **changes}
    return sum(
        int(({**BASE.get(name, {}), **keys})["count"])
        for name, keys in sections.items()
        if name.split(".")[0] == "balls" and keys
    )


@pytest.mark.slow
def test_a_watched_run_writes_the_same_data(millsim, small_deck, tmp_path):
    h5py = pytest.importorskip("h5py")
    for name, options in (("plain.h5", []), ("watched.h5", ["--paranoid"])):
        done = millsim("deck.ini", "--quiet", "-o", name, *options)
        assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "plain.h5") as a, h5py.File(tmp_path / "watched.h5") as b:
        names = []
        a.visititems(lambda name, item: names.append(name) if hasattr(item, "shape") else None)
        data = [name for name in names if name.split("/")[0] in ("particles", "observables", "statistics")]
        assert len(data) > 100
        for name in data:
            assert np.asarray(a[name][()]).tobytes() == np.asarray(b[name][()]).tobytes(), name


def test_without_it_nothing_is_said(millsim, small_deck):
    done = millsim("deck.ini", "--quiet")
    assert done.returncode == 0
    assert "paranoid" not in done.stdout + done.stderr


def test_help_names_it(millsim):
    assert "--paranoid" in millsim("--help").stdout
