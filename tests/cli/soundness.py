"""Runs a deck and holds its output against geometry and the books, knowing nothing of the program.

A run is sound when it ends with status 0; in every stored frame each ball is inside the drum and
outside of shaft, blades and all other balls; no overlap was found; the energy balance closes; and
what is counted (reliefs, contacts at the rebound floor) is the same in the file and the summary.
Frames are single precision, so a distance is known to the rounding of a few coordinates.
"""

import json
import re
from dataclasses import dataclass

import h5py
import numpy as np
from conftest import PROGRAM
from scipy.spatial import cKDTree

# The sanitizers' build is some five times slower than the release; its runs are shortened by that.
SLOW = "asan" in PROGRAM.parts
OVERLAP = 1e-9  # m, as promised
BALANCE = 1e-9  # of the energy turned over, as promised

from milltools.geometry.contour import Contour

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")


def ms(milliseconds):
    """A time for the deck, shortened for a slow build."""
    return f"{milliseconds / 5 if SLOW else milliseconds:g} ms"


@dataclass
class Mill:
    """What the frames are checked against, from the deck in SI units."""

    drum: Contour
    length: float
    shaft: float
    speed: float
    angle: float
    blades: list  # (position, angle, tip radius, width, thickness, pitch)


def mill_of(deck):
    """deck: the group /deck of an output file."""

    def number(section, key, default=0.0):
        if section not in deck or key not in deck[section]:
            return default
        return float(deck[section][key].asstr()[()].split()[0])

    radius, text = number("drum", "radius"), deck["contour"].asstr()[()] if "contour" in deck else ""
    rows = np.loadtxt(text.splitlines(), ndmin=2) if text else [(radius, 0, 1), (-radius, 0, 1)]
    length = number("drum", "length")
    count = int(number("blades", "count"))
    box = ("tip_radius", "width", "thickness", "pitch")
    blades = [
        (
            (k + 0.5) * length / count - length / 2,
            k * number("blades", "angle_step"),
            *(number("blades", key) for key in box),
        )
        for k in range(count)
    ]
    for section in deck:
        if section.startswith("blade."):
            blades.append(tuple(number(section, key) for key in ("position", "angle", *box)))
    return Mill(
        Contour(rows),
        length,
        number("rotor", "shaft_radius"),
        number("rotor", "speed"),
        number("rotor", "angle"),
        blades,
    )


def depth_in_drum(mill, r, radius):
    """How deep each ball is in the drum, an end wall or the shaft, the most of them [m]."""
    distance = np.hypot(r[:, 1], r[:, 2])
    depth = np.maximum(radius - mill.drum.gap(r[:, 1:]), np.abs(r[:, 0]) + radius - mill.length / 2)
    return np.maximum(depth, mill.shaft + radius - distance) if mill.shaft > 0 else depth


def depth_in_blades(mill, r, radius, time):
    """How deep each ball is in a blade, the most of them [m]; -inf without blades."""
    depth = np.full(len(r), -np.inf)
    for position, angle, tip, width, thickness, pitch in mill.blades:
        phi = mill.angle + mill.speed * time + angle
        axial = r[:, 0] - position
        radial = r[:, 1] * np.cos(phi) + r[:, 2] * np.sin(phi)
        around = -r[:, 1] * np.sin(phi) + r[:, 2] * np.cos(phi)
        along = axial * np.cos(pitch) + around * np.sin(pitch)
        across = around * np.cos(pitch) - axial * np.sin(pitch)
        # from the faces, > 0 outside
        faces = np.stack(
            [
                np.abs(along) - width / 2,
                np.abs(across) - thickness / 2,
                np.abs(radial - tip / 2) - tip / 2,
            ]
        )
        outside = np.linalg.norm(np.maximum(faces, 0), axis=0)
        gap = np.where(outside > 0, outside, faces.max(axis=0))
        depth = np.maximum(depth, radius - gap)
    return depth


def deepest_pair(r, radius):
    """The deepest overlap of two balls [m]."""
    deepest = -np.inf
    sizes = np.unique(radius)
    trees = [cKDTree(r[radius == size]) for size in sizes]
    for i, tree in enumerate(trees):
        for j, other in enumerate(trees[: i + 1]):
            reach = sizes[i] + sizes[j]
            if i == j and len(tree.data) > 1:
                distance = tree.query(tree.data, k=2, distance_upper_bound=reach)[0][:, 1]
            elif i != j:  # the larger ones have few neighbours of their own, many small ones
                distance = other.query(tree.data, distance_upper_bound=reach)[0]
            else:
                continue
            deepest = max(deepest, reach - distance.min())
    return deepest


def relieved(file, time):
    """Numbers of the balls that are in a relief."""
    if "reliefs" not in file:
        return []
    ball, since, until = (file[f"reliefs/{name}"][:] for name in ("ball", "time", "until"))
    return ball[(since <= time) & (time < until)]


def check_frames(file, balls):
    """Returns in how many frames a ball was in a blade."""
    inside = 0
    mill = mill_of(file["deck"])
    trajectory = file["particles/trajectory"]
    radius = trajectory["diameter"][:] / 2
    time = trajectory["position/time"][:]
    assert trajectory["position/value"].shape == (len(time), balls, 3)
    assert time[-1] == file["run/time"][()]  # so the last frame is the end of the run
    for t, r in zip(time, trajectory["position/value"]):
        r = r.astype(float)
        assert np.isfinite(r).all()
        rounding = 2 * np.sqrt(3) * np.spacing(np.float32(np.abs(r).max()))
        assert depth_in_drum(mill, r, radius).max() <= OVERLAP + rounding, t
        assert deepest_pair(r, radius) <= OVERLAP + rounding, t
        deep = depth_in_blades(mill, r, radius, t) > OVERLAP + rounding
        assert set(np.flatnonzero(deep)) <= set(relieved(file, t)), t
        inside += deep.sum()
    return inside


@dataclass
class Outcome:
    summary: dict
    stderr: str
    path: object

    @property
    def run(self):
        return self.summary["run"]

    @property
    def notes(self):
        return " ".join(self.summary["notes"])


def sound(millsim, tmp_path, deck, *orders, start=None, balls, timeout=60):
    """Runs the deck with these overrides; fails unless it is sound. The Outcome."""
    (tmp_path / "deck.ini").write_text(deck)
    if start is not None:
        np.savetxt(tmp_path / "start.txt", start, fmt="%.17g")
        orders = ("balls.start=start.txt", *orders)
    sets = [word for order in orders for word in ("-s", order)]
    done = millsim("deck.ini", "-q", "--json", *sets, timeout=timeout)
    assert done.returncode == 0, done.stderr
    assert all(line.startswith("millsim: warning: ") for line in done.stderr.splitlines())
    outcome = Outcome(json.loads(done.stdout), done.stderr, tmp_path / "deck.h5")
    run = outcome.run
    assert run["overlaps"] == 0
    assert run["largest_overlap"] <= OVERLAP
    assert run["energy_balance_error"] <= BALANCE
    with h5py.File(outcome.path) as file:
        check_frames(file, balls)
        for name in ("reliefs", "overlaps", "smoothed", "not_closing", "largest_overlap"):
            assert file["run"][name][()] == run[name]
        for kind in file["run/floored"]:
            assert file[f"run/floored/{kind}"][()] == run["floored"][kind]
            assert run["floored"][kind] <= run["collisions"][kind]
    told = re.search(r"let go (\d+) times", outcome.notes)
    assert not told or int(told[1]) == run["reliefs"]
    return outcome
