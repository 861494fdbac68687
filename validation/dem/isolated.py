"""Isolated impacts in a mill: speeds in LIGGGHTS, reconstructed from its stored states, compared with millsim."""

import shutil

import matplotlib.pyplot as plt
import numpy as np
from runs import KEPT, LABELS, say

from milltools.read.runfile import Run

SEED = 5
STIFF = ("1e10", "steel")
BALL, DRUM, SHAFT, TIP, HALF = 0.005, 0.075, 0.015, 0.067, 0.06
BLADES = [(-0.048 + 0.024 * k, 2 * np.pi * k / 5) for k in range(5)]  # place, angle
ALONE = 2e-4  # [s] without another impact of the ball, for its velocity after
SETTLED = 1e-4  # [s] after the impact its contact is over
# allowed deviations by what was hit: normal speed [%], velocity after over the impact's speed [%]
PARTS = ("ball", "drum", "end wall", "shaft", "blade face", "blade edge")
SPEED_BAND = {"1e10": 2.0, "steel": 1.0}
AFTER_BAND = 3.0  # friction and restitution are LIGGGHTS' own, which shows at large slip


def place_balls():
    """Rows x y z vx vy vz: balls that rest ahead of the blades, and balls that fly between their planes, where
    nothing sweeps."""
    random = np.random.default_rng(SEED)
    rows = []

    def turned(x, r, angle, vx, radial, along):
        c, s = np.cos(angle), np.sin(angle)
        rows.append([x, r * c, r * s, vx, radial * c - along * s, radial * s + along * c])

    for x, angle in BLADES:  # faces at the first three, edges and corners at the others
        for k, ahead in enumerate((0.28, 0.45, 0.62)):
            turned(x + random.uniform(-5, 5) * 1e-3, (0.026, 0.045, 0.062)[k], angle + ahead, 0, 0, 0)
        for k, ahead in enumerate((0.2, 0.4)):
            side = random.choice([-1, 1]) * random.uniform(6.3, 8.0) * 1e-3
            turned(x + side, (0.034, 0.0665)[k], angle - 2.2 + ahead + 2 * np.pi / 5 * 2, 0, 0, 0)
    lanes = [x + 0.012 for x, _ in BLADES[:-1]]
    for x in lanes:
        for k in range(3):
            turned(x, 0.066, 0.7 + 2.1 * k + random.uniform(0, 0.3), 0, 3.0, random.uniform(-3, 3))
            turned(x, 0.024, 1.7 + 2.1 * k + random.uniform(0, 0.3), 0, -3.0, random.uniform(-1.5, 1.5))
        for k in range(2):  # a pair, oblique
            angle, offset = 0.3 + 3.1 * k, random.uniform(-0.6, 0.6) * BALL
            turned(x, 0.045, angle, 0, 0, 2.0)
            turned(x, 0.045 + offset, angle + 0.16, 0, 0, -1.0)
    for side in (-1, 1):
        for k in range(2):
            angle = BLADES[0 if side < 0 else 4][1] - 0.8 - 1.2 * k
            turned(side * 0.0555, 0.05, angle, side * 2.0, 0, random.uniform(-2, 2))
    return np.array(rows)


def check(case):
    say("    isolated impacts in a mill")
    rows = place_balls()
    # beside the runs that are kept: the start file's path is part of the deck
    KEPT.mkdir(parents=True, exist_ok=True)
    text = "\n".join(" ".join(map(repr, map(float, row))) for row in rows)
    (KEPT / "isolated.txt").write_text(text)
    deck = KEPT / "isolated.ini"
    shutil.copy(case.folder / "isolated.ini", deck)
    found = {}
    for stiff in STIFF:
        soft = case.dem(f"isolated-{stiff}", deck, stiff, balls__count=len(rows))
        found[stiff] = compare(soft, case.run(deck, balls__count=len(rows)))
        claim(case, stiff, found[stiff])
    draw(case, found)


class Log:
    """The first impact of each ball in a run, and the ball's velocity some time after it."""

    def __init__(self, path):
        with Run(path) as run:
            column = {
                name: run.read(f"impacts/{name}")
                for name in (
                    "time",
                    "kind",
                    "ball",
                    "partner",
                    "normal",
                    "normal_speed",
                    "tangential_speed",
                )
            }
            self.kinds = run.index_names("impacts/kind")
            self.velocity = run.read("particles/trajectory/velocity/value").astype(float)
            self.times = run.frame_times()
            self.rotor = run.rotor_speed
        self.column = column
        pair = np.flatnonzero(column["kind"] == 0)
        who = np.concatenate([column["ball"], column["partner"][pair]])
        row = np.concatenate([np.arange(len(column["time"])), pair])
        order = np.lexsort((row, who))
        self.rows = {}
        for ball, k in zip(who[order], row[order], strict=True):
            self.rows.setdefault(int(ball), []).append(int(k))

    def after(self, ball, time):
        """Velocity of a ball at the first frame that is SETTLED after a time; None where there is none in time."""
        frame = int(np.searchsorted(self.times, time + SETTLED))
        if frame >= len(self.times) or self.times[frame] > time + ALONE:
            return None
        return self.velocity[frame, ball]

    def alone(self, ball):
        """Whether nothing else happens to the ball within ALONE of its first impact."""
        times = self.column["time"][self.rows[ball]]
        return len(times) < 2 or times[1] - times[0] > ALONE


def part_of(log, row):
    """What was hit, as one of PARTS."""
    kind = log.kinds[log.column["kind"][row]]
    if kind != "ball_blade":
        return {
            "ball_ball": "ball",
            "ball_drum": "drum",
            "ball_wall": "end wall",
            "ball_shaft": "shaft",
        }[kind]
    angle = BLADES[log.column["partner"][row]][1] + log.rotor * log.column["time"][row]
    across = np.array([0.0, -np.sin(angle), np.cos(angle)])
    return "blade face" if abs(log.column["normal"][row] @ across) > 1 - 1e-6 else "blade edge"


def compare(soft, hard):
    """Rows (part, normal speed of millsim, of LIGGGHTS, slip of each, time off, velocity after off) of each first
    impact."""
    one, other = Log(hard), Log(soft)
    found = []
    for ball, rows in sorted(one.rows.items()):
        row = rows[0]
        kind = one.column["kind"][row]
        if kind == 0 and one.column["ball"][row] != ball:
            continue
        match = [k for k in other.rows.get(ball, [])[:1] if other.column["kind"][k] == kind]
        if not match or other.column["partner"][match[0]] != one.column["partner"][row]:
            raise RuntimeError(f"ball {ball}: LIGGGHTS has another first impact than millsim")
        other_row = match[0]
        value = [
            log.column[name][k]
            for name in ("normal_speed", "tangential_speed", "time")
            for log, k in ((one, row), (other, other_row))
        ]
        after = np.nan
        if one.alone(ball) and other.alone(ball):
            velocities = one.after(ball, value[4]), other.after(ball, value[4])
            if all(v is not None for v in velocities):
                after = np.linalg.norm(velocities[1] - velocities[0]) / np.hypot(value[0], value[2])
        found.append((part_of(one, row), *value[:4], value[5] - value[4], after))
    return found


def claim(case, stiff, found):
    for part in PARTS:
        rows = np.array([row[1:] for row in found if row[0] == part])
        if not len(rows):
            raise RuntimeError(f"isolated: no ball met a {part}")
        off = 100 * (rows[:, 1] / rows[:, 0] - 1)
        case.bound(
            f"LIGGGHTS at {LABELS[stiff]}, {len(rows)} isolated impacts, {part}: "
            "normal speed, largest relative deviation",
            off[np.abs(off).argmax()],
            SPEED_BAND[stiff],
            unit="%",
            against="millsim, exact in flight",
            headline=stiff == "steel" and part == "blade edge",
        )
        after = 100 * np.nanmax(rows[:, 5])
        case.bound(
            f"LIGGGHTS at {LABELS[stiff]}, isolated impacts, {part}: velocity after the impact, largest deviation",
            after,
            AFTER_BAND,
            unit="%",
            against="millsim with the deck's contact law; relative to the speed of the impact",
        )


def draw(case, found):
    figure, axes = plt.subplots(1, 2, figsize=(12, 4.6), layout="constrained", sharey=True)
    for axis, stiff in zip(axes, STIFF, strict=True):
        for k, part in enumerate(PARTS):
            rows = np.array([row[1:] for row in found[stiff] if row[0] == part])
            axis.plot(rows[:, 0], 100 * (rows[:, 1] / rows[:, 0] - 1), "o^svDX"[k], label=part, ms=5)
        axis.axhspan(-SPEED_BAND[stiff], SPEED_BAND[stiff], color="C2", alpha=0.12, label="claimed band")
        axis.axhline(0, color="k", lw=0.8)
        axis.set(
            xlabel="normal speed, millsim [m/s]",
            title=f"Isolated impacts, LIGGGHTS at {LABELS[stiff]}",
        )
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("normal speed in LIGGGHTS, deviation from millsim [%]")
    axes[1].legend(fontsize=8)
    case.save(figure, "isolated.png")
    plt.close(figure)
