"""Forecasts: the computing cost that `--check` forecasts, compared with the run."""

import math
import os
import pty
import re
import subprocess
import time
from typing import NamedTuple

import h5py
import matplotlib.pyplot as plt
import numpy as np


class Mill(NamedTuple):
    name: str
    deck: str  # below the top of the repository
    sets: tuple[str, ...]
    filling: float = math.nan  # [%] of the free volume


def charge(filling, restitution, rpm, end):
    """Of the reference mill."""
    sets = (f"balls.count={round(filling / 100 * FREE / BALL)}", f"contact.restitution={restitution}")
    name = f"{filling} % filled, restitution {restitution}, {rpm} rpm, {end} s"
    return Mill(name, "validation/forecast/deck.ini", (*sets, f"rotor.speed={rpm} rpm", f"run.time={end} s"), filling)


def other(name, deck, end, *sets):
    return Mill(f"{name}, {end} s", deck, ("run.starts=1", "run.precision=0", f"run.time={end} s", *sets))


# [m^3] of the drum without shaft and blades, and of a ball
FREE = math.pi * (0.075**2 - 0.015**2) * 0.12 - 5 * 0.052 * 0.012 * 0.007
BALL = math.pi / 6 * 0.005**3
CHARGES = [
    charge(5, 0.7, 600, 0.3),
    charge(5, 0.9, 1500, 0.5),
    charge(8, 0.8, 800, 0.4),
    charge(12, 0.6, 1000, 0.3),
    charge(12, 0.95, 600, 0.5),
    charge(15, 0.8, 1500, 0.3),
    charge(18, 0.7, 600, 0.3),
    charge(20, 0.9, 1200, 0.3),
    charge(22, 0.6, 1500, 0.12),
    charge(25, 0.8, 800, 0.3),
    charge(28, 0.95, 1500, 0.2),
    charge(30, 0.7, 1000, 0.15),
    charge(35, 0.9, 600, 0.2),
    charge(40, 0.8, 1200, 0.12),
    charge(40, 0.95, 1000, 0.2),
]
BARS, ARMS = "validation/referee/bars.ini", "validation/referee/attritor.ini"
MILLS = [
    other("planetary mill", "input/planetary.ini", 60),
    other("planetary mill, 70 balls of 8 mm", "input/planetary.ini", 6, "balls.count=70", "balls.diameter=8 mm"),
    other("high energy mill", "input/emax.ini", 20),
    other("mixer mill", "input/mixer.ini", 100),
    other("shaker mill", "input/shaker.ini", 60),
    other("vibration mill", "input/vibratory.ini", 30),
    other("drum with lifters", "input/tumbling.ini", 60),
    other("Bond's mill", "input/bond.ini", 30),
    other("drum with bars, 10 %", BARS, 20, "balls.bulk_fill=10 %"),
    other("drum with bars, 30 %", BARS, 15),
    other("drum with bars, 42 %", BARS, 10, "balls.bulk_fill=42 %"),
    other("attritor", "input/attritor.ini", 8),
    other("attritor, 30 %", ARMS, 8, "balls.count=310"),
    other("attritor, 57 %", ARMS, 4, "balls.count=570"),
    other("stirred mill with discs", "input/discs.ini", 1),
    other("stirred mill with discs, 20 % at 2000 rpm", "input/discs.ini", 1, "motion.shaft.speed=2000 rpm"),
    other("stirrer from CAD", "input/stl.ini", 3),
    other("two sizes of balls", "input/mixture.ini", 0.8),
    other("wavy drum", "input/wavy.ini", 1),
    other("gas", "input/gas.ini", 6),
]
WATCHED = CHARGES[6]  # whose progress line is read
FACTOR = 2
QUICK = 8  # [s] of processor time of a check, the start's packing included
UNTOLD = 0.3  # share of the notes
FORECAST = re.compile(
    r"forecast: (at least |)(\S+) contacts, (\S+) s of processor time, (\S+) MB of memory, a file of (\S+) MB"
)
WHAT = ("contacts", "processor time", "memory", "size of the file")
UNITS = ("", " s", " MB", " MB")


def check(case):
    told, true, took, before, after, bounds = [], [], [], [], [], []
    for mill in CHARGES + MILLS:
        began = os.times()
        numbers, notes, bound = forecast(case, mill)
        took.append(os.times().children_user - began.children_user)
        told.append(numbers)
        before.append(notes)
        bounds.append(bound)
        numbers, notes = truth(case, mill)
        true.append(numbers)
        after.append(notes)
    told, true = np.array(told), np.array(true)
    claim(case, off(told, true, np.array(bounds)), told, true, bounds, took)
    claim_notes(case, before[: len(CHARGES)], after[: len(CHARGES)])
    lines = watch(case, WATCHED)
    case.bound(
        f"{WATCHED.name}: remaining time on the progress line, from 10 % on, "
        "largest factor between it and the true one",
        max(max(left / said, said / left) for share, said, left in lines if 10 <= share <= 90),
        FACTOR,
        against="the run",
    )
    draw(case, told, true, np.array(bounds), lines)


def words(case, mill):
    sets = [word for one in mill.sets for word in ("-s", one)]
    return [str(case.program), *sets, str(case.folder.parent.parent / mill.deck)]


# --- The runs -----------------------------------------------------------------------------------------------------


def forecast(case, mill):
    """Contacts, [s], [MB], [MB]; the rules that --check notes; and whether the forecast is a lower bound."""
    done = subprocess.run([*words(case, mill), "--check"], capture_output=True, text=True, check=True)
    bound, *numbers = FORECAST.search(done.stderr).groups()
    return list(map(float, numbers)), rules(re.findall("note: (.*)", done.stderr)), bool(bound)


def rules(notes):
    """What the sentences say, whatever their numbers."""
    return {re.sub(r"[\d.]+", "#", note) for note in notes}


def truth(case, mill):
    """The same of the run."""
    path = case.scratch / "run.h5"
    command = [*words(case, mill), "--force", "--quiet", "--output", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with h5py.File(path) as file:
        run = file["run"]
        contacts = sum(int(count[()]) for count in run["events/collisions"].values())
        numbers = [contacts, run["cpu_time"][()], run["peak_memory"][()] / 1e6, path.stat().st_size / 1e6]  # fmt: skip
        return numbers, rules(run["notes"].asstr()[()].splitlines())


def watch(case, mill):
    """(share done [%], time left as told [s], time that was left [s]) of each progress line, in processor time: what
    else the machine does meanwhile is not for the line to know."""
    master, slave = pty.openpty()
    output = case.scratch / "watched.h5"
    command = [*words(case, mill), "--force", "--output", str(output)]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=slave, cwd=case.scratch)
    os.close(slave)
    seen = []
    while True:
        try:
            text = os.read(master, 4096).decode()
        except OSError:  # its other end is closed
            break
        found = re.findall(r"(\d+) %[^%]*?  ((?:\d+ \w+ )+)left", text)  # not "at least", in the first turn
        if found:
            share, left = found[-1]
            seen.append((time.monotonic(), spent(running.pid), float(share), seconds(left)))
    os.close(master)
    running.wait()
    with h5py.File(output) as file:
        end = file["run/cpu_time"][()]
    lines = []
    for k, (wall, cpu, share, told) in enumerate(seen):
        earlier = seen[next((i for i in range(k) if wall - seen[i][0] < 5), 0)]
        if wall > earlier[0] and cpu > earlier[1]:
            lines.append((share, told * (cpu - earlier[1]) / (wall - earlier[0]), end - cpu))
    return lines


def spent(pid):
    """Processor time of a process [s]."""
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def seconds(text):
    """Of "1 h 05 min "."""
    length = {"s": 1, "min": 60, "h": 3600, "d": 86400}
    parts = text.split()
    return sum(float(n) * length[unit] for n, unit in zip(parts[::2], parts[1::2], strict=True))


# --- Claims -------------------------------------------------------------------------------------------------------


def off(told, true, bounds):
    """The factors between them; of lower bounds only by how much they are above the truth."""
    return np.maximum(told / true, np.where(bounds[:, None], 1.0, true / told))


def claim(case, factors, told, true, bounds, took):
    mills = CHARGES + MILLS
    for k in (0, 1):
        for mill, bound, factor, said, was in zip(mills, bounds, factors[:, k], told[:, k], true[:, k], strict=True):
            case.bound(
                f"{mill.name}: {WHAT[k]}, forecast {'at least ' * bound}{said:.2g}{UNITS[k]}, "
                f"in the run {was:.2g}{UNITS[k]}: factor",
                factor,
                FACTOR,
                against="the run",
            )
    for k in range(4):
        case.bound(
            f"{len(CHARGES)} charges of the reference mill, 5 to 40 % filled, and {len(MILLS)} other mills: {WHAT[k]}, "
            "largest factor between forecast and run",
            np.max(factors[:, k]),
            FACTOR,
            against="the runs",
            headline=k < 2,
        )
    case.bound("forecasts that are only lower bounds", sum(bounds), len(mills) // 4, against="the forecasts")
    case.bound(
        "longest processor time of a forecast", max(took), QUICK, unit="s",
        against="users make forecasts often",
    )  # fmt: skip


def claim_notes(case, before, after):
    """before, after: rules noted of each charge."""
    pairs = list(zip(before, after, strict=True))
    case.bound(
        "charges outside the range of the model that have no note before the run",
        sum(bool(later and not sooner) for sooner, later in pairs),
        0,
        against="the notes of the run",
        headline=True,
    )
    case.bound(
        "notes before the run that the run does not confirm",
        sum(len(sooner - later) for sooner, later in pairs),
        0,
        against="the notes of the run",
    )
    count = sum(map(len, after))
    case.bound(
        f"fraction of the {count} notes of the runs that were missing before the runs",
        sum(len(later - sooner) for sooner, later in pairs) / count,
        UNTOLD,
        against="the notes of the run; a value slightly above a limit can be below it in the trial",
        known="the trial contains the start-up, in which the values are lower",
    )


# --- Figure -------------------------------------------------------------------------------------------------------


def draw(case, told, true, bounds, lines):
    figure, axes = plt.subplots(1, 3, figsize=(15, 5), layout="constrained")
    for k, axis in enumerate(axes[:2]):
        least, most = true[:, k].min() / 3, true[:, k].max() * 3
        line = np.array([least, most])
        axis.fill_between(line, line / FACTOR, line * FACTOR, color="C2", alpha=0.15, label="factor 2")
        axis.plot(line, line, color="grey", lw=0.8)
        n = len(CHARGES)
        axis.plot(true[n:, k], told[n:, k], "s", color="0.4", ms=5, label="other mills")
        colours = axis.scatter(true[:n, k], told[:n, k], c=[one.filling for one in CHARGES], cmap="viridis", zorder=3)
        axis.plot(true[bounds, k], told[bounds, k], "^", mfc="none", ms=11, color="C3", label="lower bounds")
        unit = UNITS[k].strip() or "1"
        axis.set(
            xscale="log", yscale="log", xlabel=f"{WHAT[k]} of the run [{unit}]",
            ylabel=f"forecast [{unit}]", xlim=line,
            title=f"{WHAT[k].capitalize()}: within a factor of {np.max(off(told, true, bounds)[:, k]):.2g}",
        )  # fmt: skip
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=9, loc="upper left")
    figure.colorbar(colours, ax=axes[1], label="filling of the reference mill [% of the free volume]")
    share, said, left = np.array([line for line in lines if min(line[1:]) > 0]).T
    axes[2].fill_between(share, left / FACTOR, left * FACTOR, color="C2", alpha=0.15)
    axes[2].plot(share, left, color="grey", lw=0.8, label="true remaining time")
    axes[2].plot(share, said, ".", color="C0", label="on the progress line")
    late = share >= 10
    axes[2].set(
        yscale="log", xlabel="finished fraction of the run [%]", ylabel="remaining processor time [s]",
        title=f"Remaining time: median factor {np.median(np.maximum(said / left, left / said)[late]):.2g}",
    )  # fmt: skip
    axes[2].grid(alpha=0.3)
    axes[2].legend(fontsize=9)
    case.save(figure)
    plt.close(figure)
