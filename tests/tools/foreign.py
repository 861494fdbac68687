"""A run of millsim as if another program had made it: decks, and handing its own output file to milltools.results."""

import os
import subprocess
import sys
from pathlib import Path
from time import process_time

import pytest

h5py = pytest.importorskip("h5py")
np = pytest.importorskip("numpy")

ROOT = Path(__file__).resolve().parents[2]
MILLSIM = Path(os.environ.get("MILLSIM", ROOT / "millsim"))
sys.path.insert(0, str(ROOT / "tools"))

from milltools.read.deck import Deck as deck_of  # of a text as `millsim --check` prints it
from milltools.results import Results

# The last of four revolutions is cut off; frames at twice the rate of the maps' snapshots, so that they include
# them; a strike window so wide that a good part of the contacts is merged.
MIXTURE = """
[run]
time = 0.2 s
sample_from = 0.02 s
seed = 3
[balls.big]
count = 150
diameter = 6 mm
density = 7800 kg/m^3
[balls.little]
count = 150
diameter = 4 mm
density = 2500 kg/m^3
[drum]
radius = 50 mm
length = 60 mm
[rotor]
speed = 1200 rpm
shaft_radius = 19 mm
[blades]
count = 2
tip_radius = 33 mm
width = 11 mm
thickness = 6 mm
[contact]
restitution = 0.8
friction = 0.3
tangential_restitution = 0.4
rebound_floor = 10 mm/s
[output]
frames = 0.5 ms
series = 1 ms
impacts = all
strike_window = 1 ms
"""
GAS = """
[run]
time = 0.1 s
[gravity]
acceleration = 0 0 0 m/s^2
[balls]
count = 200
diameter = 5 mm
density = 7800 kg/m^3
speed = 1 m/s
[drum]
radius = 30 mm
length = 40 mm
[contact]
restitution = 0.95
[output]
frames = 0.5 ms
impacts = all
strike_window = 0 s
"""
DECKS = {
    "friction, mixture": MIXTURE,
    "smooth, backwards": MIXTURE.replace("friction = 0.3", "").replace("= 1200", "= -1200"),
    "short blocks, late": MIXTURE.replace("= 1200", "= 3000")
    .replace("= 0.02 s", "= 0.15 s")
    .replace("frames = 0.5 ms", "frames = 0.25 ms"),
    "no rotor, no gravity": GAS,
    "wavy drum": MIXTURE.replace("[drum]", "[drum]\nprofile = wavy\nbuckles = 7\nbuckle_height = 3 mm"),
    "falling balls": GAS.replace("0 0 0", "0 0 -9.81").replace("= 0.95", "= 0.7"),
}
RUN = {
    "program": "LIGGGHTS",
    "version": "3.8.0",
    "command": "mill dem deck.ini",
    "started": "2026-01-31T12:00:00Z",
    "wall_time": 12.5,
    "cpu_time": 25.0,
    "steps": (300_000, "1", "time steps"),
    "modulus": (2.1e11, "Pa", "Young's modulus of balls and walls"),
}


def simulate(folder, text):
    """A deck as checked, and millsim's own file of it."""
    if not MILLSIM.exists():
        pytest.fail(f"{MILLSIM} is not built; run make first")
    (folder / "mill.ini").write_text(text)
    done = [
        subprocess.run(
            [MILLSIM, *options, "mill.ini"],
            cwd=folder, capture_output=True, text=True, timeout=120, check=True,
        ).stdout
        for options in (["--check"], ["-q", "-o", "mill.h5"])
    ]  # fmt: skip
    return deck_of(done[0]), folder / "mill.h5"


def start(deck, theirs):
    balls = theirs["particles/trajectory"]
    names = list(balls["species"].attrs["names"])
    columns = (balls[name][:] for name in ("diameter", "mass", "species"))
    return Results(deck, *columns, names)


def series(theirs):
    """(times, {path: rows}) of millsim's time series but those that Results counts."""
    group, found = theirs["observables"], {}
    group.visititems(
        lambda name, item: (
            found.update({name.removesuffix("/value"): item[:]})
            if name.endswith("/value") and "collisions" not in name and not name.startswith("pose/")
            else None
        )
    )
    return group["rotor_work/time"][:], found


ORDER = (
    "time", "kind", "ball", "partner", "position", "normal",
    "normal_speed", "tangential_speed", "dissipation",
)  # fmt: skip


def feed(results, theirs, batches, until=np.inf):
    """Hands over millsim's own impacts in batches up to these rows, and whatever is due in between."""
    log = [theirs["impacts"][name][:] for name in ORDER]
    balls = theirs["particles/trajectory"]
    states = [balls[f"{name}/value"][:] for name in ("position", "velocity", "angular_velocity")]
    frame_times, poses = balls["position/time"][:], theirs["observables"].get("pose", {})
    for k, time in enumerate(frame_times):
        if time <= until:
            where = {name: (g["rotation/value"][k], g["centre/value"][k]) for name, g in poses.items()}  # fmt: skip
            results.frame(time, *(state[k] for state in states), where)
    for time in results.snapshot_times[results.snapshot_times <= until]:
        k = int(np.argmin(np.abs(frame_times - time)))
        assert abs(frame_times[k] - time) < 1e-9
        results.snapshot(states[0][k], states[1][k])
    times, rows = series(theirs)
    done = k = 0
    for stop in [*batches, len(log[0])]:
        part = [column[done:stop] for column in log]
        results.impacts(*(column[part[0] < until] for column in part))
        done = stop
        ahead = log[0][done] if done < len(log[0]) else np.inf
        while k < len(times) and times[k] <= min(ahead, until):
            results.row(times[k], {name: values[k] for name, values in rows.items()})
            k += 1


def random_batches(n, seed):
    """Ends of batches of all sizes, from none to half of them."""
    generator = np.random.default_rng(seed)
    return sorted(generator.integers(0, n, 3).tolist() + generator.integers(0, min(n, 500), 40).tolist())


def batch(times, **other):
    n = len(times)
    columns = {"kind": np.zeros(n), "point": np.zeros((n, 3)), **other}
    return (
        times, columns["kind"].astype(int), np.zeros(n, int), np.ones(n, int), columns["point"],
        np.zeros((n, 3)), np.ones(n), np.ones(n), np.ones(n),
    )  # fmt: skip


def cost(call):
    """Processor time of a call [s], the least of three."""
    seconds = []
    for _ in range(3):
        before = process_time()
        call()
        seconds.append(process_time() - before)
    return min(seconds)
