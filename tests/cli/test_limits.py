"""What a body may measure, and what thin bodies, many copies and many kinds of balls cost."""

import resource
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from conftest import PROGRAM, SLOWER
from test_faults import BUILT_PLAIN

TANK = """\
[run]
time = 1 us
[balls]
count = 20
diameter = 8 mm
density = 7800 kg/m^3
[motion.m]
kind = turn
speed = 300 rpm
axis = 0 0 1
[body.tank]
shape = cylinder
side = inside
radius = 50 mm
length = 90 mm
[contact]
restitution = 0.8
friction = 0.3
"""
ROOM = 4 << 30 if BUILT_PLAIN else resource.RLIM_INFINITY  # bytes of address space


def body(text):
    return f"{TANK}[body.b]\nmotion = m\n{text}\n"


def run(folder, deck, *arguments):
    (folder / "deck.ini").write_text(deck)
    return subprocess.run(
        [PROGRAM, "-q", *arguments, "deck.ini"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (ROOM, ROOM)),
    )


@pytest.mark.parametrize(
    "text",
    [
        "shape = sphere\nradius = 1e-150 mm",
        "shape = sphere\nradius = 0.9e-9 m",
        "shape = capsule\nradius = 1e-160 mm\nlength = 1 mm",
        "shape = cylinder\nradius = 1e-160 mm\nlength = 1e-160 mm",
        "shape = box\nsize = 1 1e-10 1 mm",
    ],
)
def test_a_body_that_is_too_small_is_refused_before_anything_is_written(text, tmp_path):
    done = run(tmp_path, body(text))
    assert done.returncode == 2
    assert "must be between 1e-09 and 10000 m" in done.stderr
    assert [one.name for one in tmp_path.iterdir()] == ["deck.ini"]


def test_a_shaft_that_is_too_thin_is_refused_with_its_key(refused, small_deck):
    line = refused("-s", "rotor.shaft_radius=1e-10 m", small_deck)
    assert line.endswith("[rotor] shaft_radius: must be 0 m (no shaft), or at least 1e-09 m; got 1e-10 m")


def test_the_smallest_body_runs(tmp_path):
    done = run(tmp_path, body("shape = sphere\nradius = 1e-9 m"))
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_thin_body_costs_as_much_as_a_thick_one(tmp_path):
    sizes = []
    for radius in ("1 mm", "1e-3 mm", "1e-5 mm"):
        done = run(tmp_path, body(f"shape = cylinder\nradius = {radius}\nlength = 50 mm"), "-f")
        assert done.returncode == 0, done.stderr
        sizes.append((tmp_path / "deck.h5").stat().st_size)
    assert max(sizes) < 2 * sizes[0]


def test_a_hundred_kinds_of_balls_make_no_large_file(tmp_path):
    kinds = "".join(
        f"[balls.s{k}]\ncount = 1\ndiameter = {4 + k / 100} mm\ndensity = 7800 kg/m^3\n" for k in range(100)
    )
    one = "[balls]\ncount = 20\ndiameter = 8 mm\ndensity = 7800 kg/m^3\n"
    done = run(tmp_path, TANK.replace(one, kinds))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "deck.h5").stat().st_size < 8e6


@pytest.mark.slow
def test_the_set_up_of_many_copies_can_be_stopped(tmp_path):
    (tmp_path / "deck.ini").write_text(
        body("shape = box\nsize = 1 1 1 mm\ncentre = 20 0 0 mm\ncopies = 10000\nturn_by = 0.036 deg")
    )
    process = subprocess.Popen([PROGRAM, "-q", "deck.ini"], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    time.sleep(0.7)
    begin = time.monotonic()
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=30)
    assert process.returncode == 128 + signal.SIGTERM
    assert time.monotonic() - begin < 1.0


RESTING = """\
[run]
sample_from = 1 s
[balls]
count = 1
diameter = 5 mm
density = 7800 kg/m^3
[drum]
radius = 50 mm
length = 70 mm
[contact]
restitution = 0.6
friction = 0.3
[output]
frames = 0 s
series = 100 s
"""


@pytest.mark.slow
def test_balls_at_rest_cost_next_to_nothing_and_are_in_the_maps(tmp_path):
    cost = []
    for seconds in (100, 6100):
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        assert run(tmp_path, RESTING, "-f", "-s", f"run.time={seconds} s").returncode == 0
        cost.append(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before)
    assert cost[1] - cost[0] < 0.4 * SLOWER  # s, of 6000 s; with a sample of the maps each millisecond 2 s
    with h5py.File(tmp_path / "deck.h5") as file:
        maps = file["statistics/maps"]
        assert maps["samples"][()] == 6099000
        share = np.nan_to_num(maps["cross_section/solid_fraction"][()])
    assert (share > 0.01 * share.max()).sum() < 40  # cells, where it rests
