"""Forecasts: the computing cost that `--check` forecasts, compared with the run."""

import math
import os
import pty
import re
import subprocess
import time

import h5py
import matplotlib.pyplot as plt
import numpy as np

# (share of the free volume [%], restitution, rpm, run.time [s]); none of them is of those that the law's constants are
# from
DECKS = [
    (5, 0.7, 600, 0.3),
    (5, 0.9, 1500, 0.5),
    (8, 0.8, 800, 0.4),
    (12, 0.6, 1000, 0.3),
    (12, 0.95, 600, 0.5),
    (15, 0.8, 1500, 0.3),
    (18, 0.7, 600, 0.3),
    (20, 0.9, 1200, 0.3),
    (22, 0.6, 1500, 0.12),
    (25, 0.8, 800, 0.3),
    (28, 0.95, 1500, 0.2),
    (30, 0.7, 1000, 0.15),
    (35, 0.9, 600, 0.2),
    (40, 0.8, 1200, 0.12),
    (40, 0.95, 1000, 0.2),
]
WATCHED = (18, 0.7, 600, 0.3)  # whose progress line is read
# [m^3] of the drum without shaft and blades, and of a ball
FREE = math.pi * (0.075**2 - 0.015**2) * 0.12 - 5 * 0.052 * 0.012 * 0.007
BALL = math.pi / 6 * 0.005**3
FACTOR = 2
QUICK = 5  # [s] of processor time of a check, the start's packing included
UNTOLD = 0.3  # share of the notes
FORECAST = re.compile(r"forecast: (\S+) contacts, (\S+) s of processor time, (\S+) MB of memory, a file of (\S+) MB")
WHAT = ("contacts", "processor time", "memory", "size of the file")
UNITS = ("", " s", " MB", " MB")


def check(case):
    told, true, took, before, after = [], [], [], [], []
    for deck in DECKS:
        began = os.times()
        numbers, notes = forecast(case, deck)
        took.append(os.times().children_user - began.children_user)
        told.append(numbers)
        before.append(notes)
        numbers, notes = truth(case, deck)
        true.append(numbers)
        after.append(notes)
    told, true = np.array(told), np.array(true)
    claim(case, told, true, took)
    claim_notes(case, before, after)
    lines = watch(case, WATCHED)
    case.bound(
        f"{name(WATCHED)}: remaining time on the progress line, from 10 % on, "
        "largest factor between it and the true one",
        max(max(left / said, said / left) for share, said, left in lines if 10 <= share <= 90),
        FACTOR,
        against="the run",
    )
    draw(case, told, true, lines)


def name(deck):
    filling, restitution, rpm, end = deck
    return f"{filling} % filled, restitution {restitution}, {rpm} rpm, {end} s"


def settings(deck):
    filling, restitution, rpm, end = deck
    return {
        "balls__count": round(filling / 100 * FREE / BALL),
        "contact__restitution": restitution,
        "rotor__speed": f"{rpm} rpm",
        "run__time": f"{end} s",
    }


def words(case, deck):
    sets = [f"--set={key.replace('__', '.')}={value}" for key, value in settings(deck).items()]
    return [str(case.program), *sets, str(case.folder / "deck.ini")]


# --- The runs -----------------------------------------------------------------------------------------------------


def forecast(case, deck):
    """Contacts, [s], [MB], [MB]; and the rules that --check notes."""
    done = subprocess.run([*words(case, deck), "--check"], capture_output=True, text=True, check=True)
    numbers = [float(number) for number in FORECAST.search(done.stderr).groups()]
    return numbers, rules(re.findall("note: (.*)", done.stderr))


def rules(notes):
    """What the sentences say, whatever their numbers."""
    return {re.sub(r"[\d.]+", "#", note) for note in notes}


def truth(case, deck):
    """The same of the run."""
    path = case.run(output="run.h5", **settings(deck))
    with h5py.File(path) as file:
        run = file["run"]
        contacts = sum(int(count[()]) for count in run["events/collisions"].values())
        numbers = [contacts, run["cpu_time"][()], run["peak_memory"][()] / 1e6, path.stat().st_size / 1e6]  # fmt: skip
        return numbers, rules(run["notes"].asstr()[()].splitlines())


def watch(case, deck):
    """(share done [%], time left as told [s], time that was left [s]) of each progress line, in processor time: what
    else the machine does meanwhile is not for the line to know."""
    master, slave = pty.openpty()
    output = case.scratch / "watched.h5"
    command = [*words(case, deck), "--force", "--output", str(output)]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=slave, cwd=case.scratch)
    os.close(slave)
    seen = []
    while True:
        try:
            text = os.read(master, 4096).decode()
        except OSError:  # its other end is closed
            break
        found = re.findall(r"(\d+) %.*?((?:\d+ \w+ )+)left", text)
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


def off(told, true):
    return np.maximum(told / true, true / told)


def claim(case, told, true, took):
    for k in (0, 1):
        for deck, said, was in zip(DECKS, told[:, k], true[:, k], strict=True):
            case.bound(
                f"{name(deck)}: {WHAT[k]}, forecast {said:.2g}{UNITS[k]}, in the run {was:.2g}{UNITS[k]}: factor",
                off(said, was),
                FACTOR,
                against="the run",
            )
    for k in range(4):
        case.bound(
            f"{len(DECKS)} charges of the reference mill, 5 to 40 % filled: {WHAT[k]}, "
            "largest factor between forecast and run",
            np.max(off(told[:, k], true[:, k])),
            FACTOR,
            against="the runs",
            headline=k < 2,
        )
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


def draw(case, told, true, lines):
    figure, axes = plt.subplots(1, 3, figsize=(15, 5), layout="constrained")
    for k, axis in enumerate(axes[:2]):
        least, most = true[:, k].min() / 3, true[:, k].max() * 3
        line = np.array([least, most])
        axis.fill_between(line, line / FACTOR, line * FACTOR, color="C2", alpha=0.15, label="factor 2")
        axis.plot(line, line, color="grey", lw=0.8)
        colours = axis.scatter(true[:, k], told[:, k], c=[deck[0] for deck in DECKS], cmap="viridis", zorder=3)
        unit = UNITS[k].strip() or "1"
        axis.set(
            xscale="log", yscale="log", xlabel=f"{WHAT[k]} of the run [{unit}]",
            ylabel=f"forecast [{unit}]", xlim=line,
            title=f"{WHAT[k].capitalize()}: forecast within a factor of {np.max(off(told[:, k], true[:, k])):.2g}",
        )  # fmt: skip
        axis.grid(alpha=0.3)
    axes[0].legend(fontsize=9, loc="upper left")
    figure.colorbar(colours, ax=axes[1], label="filling [% of the free volume]")
    share, said, left = np.array([line for line in lines if min(line[1:]) > 0]).T
    axes[2].fill_between(share, left / FACTOR, left * FACTOR, color="C2", alpha=0.15)
    axes[2].plot(share, left, color="grey", lw=0.8, label="true remaining time")
    axes[2].plot(share, said, ".", color="C0", label="on the progress line")
    late = share >= 10
    axes[2].set(
        yscale="log", xlabel="finished fraction of the run [%]", ylabel="remaining processor time [s]",
        title=f"Remaining time: median factor {np.median(off(said, left)[late]):.2g}",
    )  # fmt: skip
    axes[2].grid(alpha=0.3)
    axes[2].legend(fontsize=9)
    case.save(figure)
    plt.close(figure)
