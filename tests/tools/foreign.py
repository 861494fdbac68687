"""A run of millsim as if another program had made it: decks, and handing its own output file to `millsim --digest`."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from moving_mills import JAR_ON_A_DISK

h5py = pytest.importorskip("h5py")
np = pytest.importorskip("numpy")

ROOT = Path(__file__).resolve().parents[2]
MILLSIM = Path(os.environ.get("MILLSIM", ROOT / "millsim"))
sys.path.insert(0, str(ROOT / "tools"))

from milltools.foreign.digest import IMPACT, Digest, impacts_of
from milltools.read.deck import Deck

# Frames at twice the rate of the maps' snapshots, so that they include
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
JAR = (
    "[run]\ntime = 0.2 s\nsample_from = 0.04 s\n"
    + JAR_ON_A_DISK[JAR_ON_A_DISK.index("[motion.jar]") :]  # before its carrier
    + JAR_ON_A_DISK[: JAR_ON_A_DISK.index("[motion.jar]")]
    + """\
[balls]
count = 30
diameter = 5 mm
density = 7800 kg/m^3
[contact]
restitution = 0.8
friction = 0.3
[output]
frames = 0.5 ms
series = 1 ms
impacts = all
"""
)
DECKS = {
    "friction, mixture": MIXTURE,
    # batches end at rows: three revolutions of 60 ms in twelfths, of which errors are told
    "smooth, backwards": MIXTURE.replace("friction = 0.3", "").replace("= 1200", "= -1000"),
    "short blocks, late": MIXTURE.replace("= 1200", "= 3000")
    .replace("= 0.02 s", "= 0.15 s")
    .replace("frames = 0.5 ms", "frames = 0.25 ms"),
    "no rotor, no gravity": GAS,
    "wavy drum": MIXTURE.replace("[drum]", "[drum]\nprofile = wavy\nbuckles = 7\nbuckle_height = 3 mm"),
    "jar on a disk": JAR,
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
    """A deck, and millsim's own file of it."""
    if not MILLSIM.exists():
        pytest.fail(f"{MILLSIM} is not built; run make first")
    (folder / "mill.ini").write_text(text.replace("[run]\n", "[run]\nstarts = 1\n", 1))
    subprocess.run(
        [MILLSIM, "-q", "-o", "mill.h5", "mill.ini"],
        cwd=folder,
        capture_output=True,
        timeout=120,
        check=True,
    )
    return Deck.check(folder / "mill.ini"), folder / "mill.h5"


def accounts(deck, theirs):
    """(times, {name: rows}) of millsim's time series as accounts name them; what turns evenly has its impulse from
    its work."""
    group = theirs["observables"]
    names = [f"{name}/{kind}" for name in ("dissipation", "dissipation_normal") for kind in group[name]]
    found = {name: group[f"{name}/value"][:] for name in [*names, *(f"motion_work/{name}" for name in deck.motions)]}
    for name in deck.motions:
        speed = deck.number("rotor.speed" if name == "rotor" else f"motion.{name}.speed")
        found[f"motion_impulse/{name}"] = found[f"motion_work/{name}"] / speed
    return group["kinetic_energy/time"][:], found


def feed(digest, deck, theirs, until=np.inf, batches=()):
    """Hands over millsim's own states, impacts, in batches up to these rows, and accounts; all up to a time."""
    log = impacts_of(**{name: theirs["impacts"][name][:] for name in IMPACT.names if name != "nothing"})
    log["kind"] = np.array([deck.kinds.index(kind) for kind in theirs["impacts"].attrs["kinds"]])[log["kind"]]
    balls = theirs["particles/trajectory"]
    names = ("position", "velocity", "angular_velocity")
    states = list(zip(balls["position/time"][:], *(balls[f"{name}/value"][:] for name in names), strict=True))
    done = told = 0
    times, values = accounts(deck, theirs)
    ends = [0, *batches, len(log)]
    for k, time in enumerate(times[times <= until]):
        while told < len(states) and states[told][0] <= time:
            digest.state(*states[told])
            told += 1
        row = int(np.searchsorted(log["time"], time))
        for stop in [end for end in ends if done < end < row] + [row]:
            digest.impacts(log[done:stop])
            done = stop
        digest.account(time, {name: column[k] for name, column in values.items()})


def digested(folder, deck, path, name="ours.h5", **options):
    """The file at `path` handed over as a whole; what comes out."""
    with h5py.File(path) as theirs, Digest(deck, folder / name, apart=1e-9) as digest:
        digest.facts(RUN)
        feed(digest, deck, theirs, **options)
        digest.end("complete", deck.number("run.time"))
    return folder / name
