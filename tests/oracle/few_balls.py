"""The program against the oracle, impact by impact, on a mill of few balls.

A mill forgets its start: an error of the last digit grows tenfold and more at every contact of two
balls, so two correct programs part company after some dozens of impacts. How far they must agree is
measured, not guessed: the oracle runs again from starts displaced by PERTURBATION, a hundred times
the rounding errors that either side makes, and only the impacts that these twins agree upon to a
tenth of the tolerances are compared.

    python few_balls.py [--wavy | --any] SEED...     compares these mills and prints where they part
"""

import os
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
from any_mill import AnyMill
from decks import random_case
from mill_decks import random_mill

PROGRAM = Path(os.environ.get("MILLSIM", Path(__file__).resolve().parents[2] / "millsim"))
PERTURBATION = 1e-14  # m, m/s, rad; and relative, of spins and the rotor's speed
TWINS = 2
MOST = 100  # impacts of one mill
LONGEST = 0.4  # s
SIMULTANEOUS = 1e-9  # s; contacts closer in time may come in either order
TOLERANCE = {
    "time": 1e-8,
    "position": 1e-6,
    "normal": 1e-5,
    "normal_speed": 1e-5,
    "tangential_speed": 1e-5,
}
# Of mills of any bodies and motions, few impacts each: what is promised of every contact (time, speeds) and what
# follows from it
FINE_MOST = 50
FINE = {
    "time": 1e-9,
    "position": 1e-8,
    "normal": 1e-6,
    "normal_speed": 1e-7,
    "tangential_speed": 1e-7,
}


class Row(NamedTuple):
    """One impact as both sides tell it."""

    time: float
    kind: str
    ball: int
    partner: int
    position: np.ndarray
    normal: np.ndarray
    normal_speed: float
    tangential_speed: float
    dissipation: float


def row_of(impact):
    return Row(*impact[: len(Row._fields)])


def terms(mill):
    """The tolerances of this mill, and how many of its impacts are looked at."""
    return (FINE, FINE_MOST) if isinstance(mill, AnyMill) else (TOLERANCE, MOST)


def mismatch(a, b, mill, scale=1.0):
    """What differs between two rows by more than `scale` tolerances: names of the columns."""
    names = [name for name in ("kind", "ball", "partner") if getattr(a, name) != getattr(b, name)]
    tolerances, _ = terms(mill)
    for name, tolerance in tolerances.items():
        # "not <=" so that a NaN is a mismatch
        if not np.abs(np.subtract(getattr(a, name), getattr(b, name))).max() <= scale * tolerance:
            names.append(name)
    # a loss is at most m v^2 / 2: it is known as well as its speeds are
    loss = mill.mass()[a.ball] * (a.normal_speed + a.tangential_speed) * tolerances["normal_speed"]
    if not abs(a.dissipation - b.dissipation) <= scale * loss:
        names.append("dissipation")
    return names


def shares_a_ball(a, b):
    def balls(row):
        return {row.ball, row.partner} if row.kind == "ball_ball" else {row.ball}

    return bool(balls(a) & balls(b))


def agreement(expected, found, mill, scale=1.0):
    """(how many of the expected rows are found, what is wrong with the next). Two impacts of
    different balls at the same time may be found in either order."""
    found = list(found)
    for k, row in enumerate(expected):
        if k >= len(found):
            return k, ["there is no such impact"]
        wrong = mismatch(row, found[k], mill, scale)
        if wrong and k + 1 < len(found):
            this, later = found[k : k + 2]
            if later.time - this.time < SIMULTANEOUS and not shares_a_ball(this, later):
                found[k : k + 2] = later, this
                wrong = mismatch(row, found[k], mill, scale)
        if wrong:
            return k, wrong
    return len(expected), []


def twin(case, rng):
    """The same mill, started and turned a hundred roundings differently."""

    def near(values):
        return values + PERTURBATION * rng.normal(size=np.shape(values))

    if isinstance(case.mill, AnyMill):
        mill = case.mill.jolted(near)
    else:
        mill = replace(
            case.mill,
            rotor_angle=float(near(case.mill.rotor_angle)),
            rotor_speed=case.mill.rotor_speed * float(near(1.0)),
        )
    spin = case.spin * near(np.ones_like(case.spin))
    return replace(case, mill=mill, position=near(case.position), velocity=near(case.velocity), spin=spin)


def predict(case):
    """The oracle's impacts, as far as their outcome is certain."""
    impacts = case.simulation().run(LONGEST, terms(case.mill)[1])
    rows = [row_of(impact) for impact in impacts]
    certain = len(rows)
    rng = np.random.default_rng(case.seed)
    for _ in range(TWINS):
        end = rows[certain - 1].time + 1e-6 if certain else 0.0
        other = [row_of(i) for i in twin(case, rng).simulation().run(end, certain)]
        certain = agreement(rows[:certain], other, case.mill, scale=0.1)[0]
    for k in range(1, certain):
        if rows[k].time - rows[k - 1].time < SIMULTANEOUS and shares_a_ball(rows[k], rows[k - 1]):
            certain = k - 1  # which of the two comes first decides what follows
            break
    return impacts[:certain]


def run_program(case, until, folder):
    """Runs the program on the case and returns its impacts as rows."""
    assert PROGRAM.exists(), f"{PROGRAM} is not built; run make first"
    folder = Path(folder)
    (folder / "deck.ini").write_text(case.deck(until))
    (folder / "start.txt").write_text(case.start())
    for name, data in getattr(case, "files", {}).items():
        (folder / name).write_bytes(data)
    command = [str(PROGRAM.resolve()), "deck.ini", "-o", "out.h5", "-q", "-f"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, f"exit status {done.returncode}\n{done.stderr}\n{case.deck(until)}"
    with h5py.File(folder / "out.h5") as file:
        impacts = file["impacts"]
        names = [n.decode() if isinstance(n, bytes) else str(n) for n in impacts.attrs["kinds"]]
        columns = {name: impacts[name][...] for name in Row._fields}
    columns["kind"] = [names[k] for k in columns["kind"]]
    return [Row(*values) for values in zip(*(columns[name] for name in Row._fields))]


def show(row):
    lines = (f"    {name:17}{value}" for name, value in zip(Row._fields, row))
    return "\n".join(lines)


def compare(case, impacts, folder):
    """None when the program finds the oracle's impacts, else the story of the first it does not."""
    expected = [row_of(impact) for impact in impacts]
    until = expected[-1].time + 1e-6
    found = run_program(case, until, folder)
    same, wrong = agreement(expected, found, case.mill)
    if not wrong:
        return None
    feature, kind = impacts[same].feature, impacts[same].kind
    part = "" if isinstance(case.mill, AnyMill) else " of a blade" if kind == "ball_blade" else " arc"
    where = f" on the {feature}{part}" if feature else ""
    lines = [
        f"mill {case.seed}: impact {same} of {len(expected)}{where} differs in {', '.join(wrong)}",
        "  oracle",
        show(expected[same]),
        "  program",
        show(found[same]) if same < len(found) else "    none",
        f"  deck and start in {folder}",
    ]
    return "\n".join(lines)


def census(runs):
    """How many impacts of each kind, on each part of a surface that has several, and of each way to end."""
    names = (
        name
        for impacts in runs
        for i in impacts
        for name in (i.kind, i.feature, i.grip, "floored" if i.floored else "bounced")
    )
    return Counter(names)


def main(seeds, way):
    for seed in seeds:
        case = random_mill(seed) if way == "--any" else random_case(seed, way == "--wavy")
        impacts = predict(case)
        folder = tempfile.mkdtemp(prefix=f"mill{seed}-")
        story = compare(case, impacts, folder)
        print(story or f"mill {seed}: {len(impacts)} impacts agree")


if __name__ == "__main__":
    words = sys.argv[1:]
    ways = [word for word in words if word.startswith("--")]
    main([int(word) for word in words if word not in ways], *(ways or [""]))
