"""Invariances: the same mill mirrored, turned, renumbered, with another clock, queue or cells; and run backwards.

README.md says what is claimed and where each band comes from.
"""

import os
import pathlib
import re
import subprocess

import h5py
import matplotlib.pyplot as plt
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROBE = pathlib.Path(os.environ.get("MILLSIM_PROBE", ROOT / "build/release/validation/invariances/probe"))
DIAMETER = 5e-3  # [m] deviations are counted in diameters of the larger balls
NUDGE = 1e-11  # relative
LEAST, MOST = 1e-11, 1e-3  # [diameters] between these a deviation grows exponentially
KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")
SPREAD = 3.0  # bound of a mean square of differences over standard errors
SEEDS = range(1, 9)  # of the mills
GAS_SEEDS = range(1, 65)
TURN = 77.0  # [deg] about the drum's axis
ANGLE = 295.0  # [deg] of the rotor at the start that the twins share: 25 deg and 3 3/4 revolutions

# --- the twins of a mill -------------------------------------------------------------------------


class Twin:
    """A mill moved by an orthogonal matrix that keeps the x axis: y turns about x or changes sign, x changes sign."""

    def __init__(self, matrix):
        self.matrix = np.array(matrix, float)
        self.hand = round(np.linalg.det(self.matrix))  # -1: mirrored
        # a turn about +x stays one unless y is mirrored
        self.sense = self.hand * round(self.matrix[0, 0])

    def angle(self, degrees):
        """Where the matrix takes the direction `degrees` of the cross-section."""
        y, z = self.matrix[1:, 1:] @ [np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]
        return np.degrees(np.arctan2(z, y))

    def states(self, rows):
        """Positions, velocities, spins: a spin is an axial vector."""
        moved = rows.reshape(*rows.shape[:-1], 3, 3) @ self.matrix.T
        moved[..., 2, :] *= self.hand
        return moved.reshape(rows.shape)

    def undo(self, rows):
        return Twin(self.matrix.T).states(rows)

    def deck(self, text, start_angle=None):
        """The deck of the twin: gravity, speed and angles of the rotor, places, angles and pitches of blades."""
        key = None
        lines = []
        for line in text.splitlines():
            section = re.match(r"\[(.*)\]", line)
            key = section[1] if section else key
            name, _, value = (part.strip() for part in line.partition("="))
            lines.append(self.entry(key, name, value, start_angle) or line)
        return "\n".join(lines) + "\n"

    def entry(self, section, name, value, start_angle):
        if section == "gravity" and name == "acceleration":
            *numbers, unit = value.split()
            return f"{name} = {' '.join(repr(float(x)) for x in self.matrix @ np.array(numbers, float))} {unit}"
        if name not in ("speed", "angle", "position", "pitch") or section is None:
            return None
        number, unit = value.split()
        number = float(number)
        if section == "rotor" and name == "speed":
            number *= self.sense
        elif section == "rotor" and name == "angle":
            number = self.angle(number if start_angle is None else start_angle)
        elif name == "angle":  # in the rotor's frame, counted from the rotor's own angle
            number *= self.sense
        elif name == "position":
            number *= self.matrix[0, 0]
        elif name == "pitch":  # +x edge towards increasing angle
            number *= self.hand
        return f"{name} = {float(number)!r} {unit}"


def turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return [[1, 0, 0], [0, c, -s], [0, s, c]]


TWINS = {
    "mirrored along the axis": Twin(np.diag([-1, 1, 1])),
    "mirrored across the axis": Twin(np.diag([1, -1, 1])),
    f"turned by {TURN:g} deg": Twin(turned(TURN)),
    "turned end for end": Twin(np.diag([-1, -1, 1])),
}
SAME = Twin(np.eye(3))


# --- runs of the probe -------------------------------------------------------------------------------


def probe(case, deck, time, slices, *options, settings=()):
    """States at slices + 1 times (with --reverse as many again), and a row of figures for each.

    Returns figures [times, 9] and states [times, balls, 9].
    """
    command = [PROBE, *map(str, options), deck, repr(time), str(slices), *settings]
    result = subprocess.run(command, capture_output=True, check=False)
    if result.returncode != 0:
        raise RuntimeError(f"probe: {result.stderr.decode().strip()}")
    times = (slices + 1) * (2 if "--reverse" in options else 1)
    rows = np.frombuffer(result.stdout).reshape(times, -1, 9)
    return rows[:, 0], rows[:, 1:]


def start_file(case, name, rows):
    """A start file with these states, to the last bit."""
    return case.write(name, "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows))


def deviation(a, b):
    """Distance of two runs in configuration space, in diameters, at each time."""
    return np.sqrt(((a[..., :3] - b[..., :3]) ** 2).sum(axis=(1, 2))) / DIAMETER


def nudged(rows, seed):
    noise = np.random.default_rng(seed).standard_normal(rows.shape)
    return rows * (1.0 + NUDGE * noise)


def growth(times, curve):
    """Rate at which a deviation grows between LEAST and MOST [1/s]."""
    part = (curve > LEAST) & (curve < MOST)
    return np.polyfit(times[part], np.log(curve[part]), 1)[0]


# --- the same bits -------------------------------------------------------------------------------------


def bits(case, deck):
    time, slices = 8.0, 32
    figures, states = probe(case, deck, time, slices)
    different = {
        "calendar with days of 0.1 us": ["--width", 1e-7],
        "calendar with days of 1 ms": ["--width", 1e-3],
        "clock started at 100 000 s": ["--clock", 1e5],
    }
    for what, options in different.items():
        other = probe(case, deck, time, slices, *options)
        case.bound(
            f"{what}: output values that differ, of {figures.size + states.size}",
            (other[0] != figures).sum() + (other[1] != states).sum(),
            0,
            against="the same arithmetic gives the same bits",
            headline="clock" in what,
        )
    order = np.concatenate([np.random.default_rng(1).permutation(150), np.arange(150, 250)])
    order[150:] = 150 + np.random.default_rng(2).permutation(100)
    start = start_file(case, "permuted.txt", states[0][order])
    other = probe(case, deck, time, slices, settings=[f"balls.start={start}"])
    case.bound(
        f"balls renumbered: output values that differ, of {states.size}",
        (other[1] != states[:, order]).sum(),
        0,
        against="a contact does not depend on which ball comes first",
    )


# --- twins part as neighbours do -------------------------------------------------------------------------


def twins(case, text):
    """Twins that start in the same steady state: how far apart are they, and is it rounding?"""
    begin = probe(case, case.folder / "deck.ini", 0.25, 4)[1][-1]
    time, slices = 0.1875, 192

    def run(name, twin, rows, *options):
        start = start_file(case, "start.txt", twin.states(rows))
        deck = case.write(f"{name}.ini", twin.deck(text, ANGLE))
        states = probe(case, deck, time, slices, *options, settings=[f"balls.start={start}"])[1]
        return twin.undo(states)

    base = run("base", SAME, begin)
    nudge = deviation(run("nudged", SAME, nudged(begin, 1)), base)
    curves = {name: deviation(run("twin", twin, begin), base) for name, twin in TWINS.items()}
    curves["cells of twice the size"] = deviation(run("cells", SAME, begin, "--cells", 2), base)
    part = (nudge > 10.0 * nudge[0]) & (nudge < MOST)
    for name, curve in curves.items():
        case.bound(
            f"{name}: deviation at the start that would grow to the deviation found",
            np.exp(np.mean(np.log((curve / nudge)[part]))) * nudge[0],
            4e-12,
            against="rounding",
            unit="diameters",
            headline=name == "mirrored along the axis",
        )
    return np.linspace(0.0, 1e3 * time, slices + 1), nudge, curves


# --- the same statistics -----------------------------------------------------------------------------------


def measure(path, twin):
    """Figures of one run that no twin may change; the centre of the charge is moved back."""
    with h5py.File(path) as f:
        statistics = f["statistics"]
        figures = {"power of the rotor [W]": statistics["rotor/power"][()]}
        for kind in (one for one in KINDS if one in statistics["impacts"]):
            part = statistics["impacts"][kind]
            figures[f"{kind} contacts [1/s]"] = part["rate"][()]
            figures[f"{kind} mean normal speed [m/s]"] = part["normal_speed/mean"][()]
            figures[f"{kind} losses [W]"] = part["dissipated_power"][()]
        centre = twin.matrix.T @ centre_of_charge(statistics["maps"])
    for axis, value in zip("xyz", centre):
        figures[f"centre of the charge, {axis} [m]"] = value
    return figures


def centre_of_charge(maps):
    y, z = (0.5 * (e[1:] + e[:-1]) for e in (maps["cross_section"][k][:] for k in ("y_edges", "z_edges")))
    x, r = maps["axial/x_edges"][:], maps["axial/r_edges"][:]
    across = np.nan_to_num(maps["cross_section/solid_fraction"][:])
    along = maps["axial/solid_fraction"][:] * np.diff(r**2)
    x = 0.5 * (x[1:] + x[:-1])
    return np.array(
        [
            np.average(x, weights=along.sum(axis=1)),
            np.average(y, weights=across.sum(axis=1)),
            np.average(z, weights=across.sum(axis=0)),
        ]
    )


def statistics(case, text):
    """Every figure of every twin against the mill itself, all from independent runs."""
    base = gather(case, text, SAME, SEEDS)
    worst = {}
    for k, (name, twin) in enumerate(TWINS.items()):
        other = gather(case, text, twin, [100 * (k + 1) + seed for seed in SEEDS])
        worst[name] = {}
        for what in base:
            (a, a_error), (b, b_error) = mean(base[what]), mean(other[what])
            error = np.hypot(a_error, b_error)
            worst[name][what] = (b - a) / error
            if what.startswith(("power", "ball_ball losses")) or what.endswith("x [m]"):
                case.claim(
                    f"{name}: {what.split(' [')[0]}",
                    b,
                    a,
                    4.0 * error,
                    against="the original mill with other seeds",
                    error=error,
                    unit=what.split("[")[1].rstrip("]"),
                )
        case.bound(
            f"{name}: mean square of all {len(base)} differences divided by their standard errors",
            np.mean(np.square(list(worst[name].values()))),
            SPREAD,
            against="about 1.2 is expected by chance",
        )
    return worst


def gather(case, text, twin, seeds):
    deck = case.write("statistics.ini", twin.deck(text))
    runs = [measure(case.run(deck, output="statistics.h5", run__seed=seed), twin) for seed in seeds]
    return {what: [run[what] for run in runs] for what in runs[0]}


def mean(values):
    return np.mean(values), np.std(values, ddof=1) / np.sqrt(len(values))


# --- backwards -----------------------------------------------------------------------------------------------


def backwards(case, what, *settings, options=()):
    """Elastic balls retrace their path until rounding has grown: for how long?"""
    deck = case.folder / "gas.ini"
    # a start file brings its own speeds
    given = case.write("gas.ini", re.sub(r"(?m)^speed = .*$", "", deck.read_text()))
    time, slices = 0.125, 512
    times = np.linspace(0.0, time, slices + 1)
    curves, forward, back, lasted = [], [], [], []
    for seed in GAS_SEEDS:
        deck_values = [f"run.seed={seed}", *settings]
        _, states = probe(case, deck, time, slices, "--reverse", *options, settings=deck_values)
        start = start_file(case, "gas.txt", nudged(states[0], seed))
        nudge = probe(case, given, time, slices, *options, settings=[f"balls.start={start}", *deck_values])[1]
        there, again = states[: slices + 1], states[slices + 1 :]
        curves.append(deviation(again, there[::-1]))
        forward.append(growth(times, deviation(nudge, there)))
        back.append(growth(times, curves[-1]))
        lasted.append(np.interp(np.log(MOST), np.log(curves[-1][1:]), times[1:]))
    balls = states.shape[1]
    rounding = np.sqrt(3.0 * balls / 12.0) * np.spacing(0.015) / DIAMETER
    rate, rate_error = mean(forward)
    claim_return(case, what, rate, rate_error, back, lasted, rounding)
    return times, curves, rounding * np.exp(rate * times)


def claim_return(case, what, rate, rate_error, back, lasted, rounding):
    backward, error = mean(back)
    error = np.hypot(error, rate_error)
    case.claim(
        f"{what} run backwards: growth rate of the deviation from the forward path",
        backward,
        rate,
        4.0 * error,
        against="growth rate of a small change of the start in the forward run",
        error=error,
        unit="1/s",
    )
    expected = np.log(MOST / rounding) / rate
    until, error = mean(lasted)
    error = np.hypot(error, expected * rate_error / rate)
    case.claim(
        f"{what} run backwards: time until the deviation from the forward path is a thousandth of a diameter",
        1e3 * until,
        1e3 * expected,
        1e3 * (0.06 * expected + 4.0 * error),
        against="ln(1e-3 d / rounding) / growth rate in the forward run",
        error=1e3 * error,
        unit="ms",
        headline=what == "smooth gas",
    )


# --- figure ----------------------------------------------------------------------------------------------------


def draw(case, parting, worst, gases):
    figure, axes = plt.subplots(1, 3, figsize=(15, 4.4))
    times, nudge, curves = parting
    ax = axes[0]
    ax.semilogy(times, nudge, "k--", lw=1, label=f"start nudged by {NUDGE:g}")
    for name, curve in curves.items():
        ax.semilogy(times[1:], curve[1:], lw=1.2, label=name)
    ax.set(xlabel="time [ms]", ylabel="distance from the original mill [diameters]", title="mill")
    ax.legend(fontsize=8)
    ax = axes[1]
    for k, (name, (times, curves, _)) in enumerate(gases.items()):
        for n, curve in enumerate(curves):
            label = f"{name}, {len(curves)} runs" if n == 0 else None
            ax.semilogy(1e3 * times[1:], curve[1:], f"C{k}", lw=0.4, alpha=0.6, label=label)
    for (name, (times, _, theory)), style in zip(gases.items(), ("k-", "k--")):
        part = theory < 1.0
        ax.semilogy(1e3 * times[part], theory[part], style, lw=2, label=f"theory, {name}")
    ax.set(
        xlabel="time after the reversal [ms]",
        ylabel="distance from the forward path [diameters]",
        title="elastic gas, run backwards",
    )
    ax.legend(fontsize=8)
    ax = axes[2]
    for k, (name, off) in enumerate(worst.items()):
        ax.plot(list(off.values()), np.arange(len(off)) + 0.12 * (k - 1.5), "o", ms=4, label=name)
    ax.set_yticks(range(len(off)), list(off), fontsize=6)
    ax.axvspan(-4.0, 4.0, color="0.92")
    ax.set(xlabel="difference from the original mill [standard errors]", title="steady mill")
    ax.set_ylim(-0.7, len(off) + 3.5)
    ax.legend(fontsize=7, loc="upper center", ncol=2)
    figure.tight_layout()
    case.save(figure)
    plt.close(figure)


def check(case):
    text = (case.folder / "deck.ini").read_text()
    bits(case, case.folder / "deck.ini")
    parting = twins(case, text)
    gases = {
        "smooth gas": backwards(case, "smooth gas"),
        "rough gas": backwards(
            case,
            "rough gas",
            "contact.friction=1",
            "contact.tangential_restitution=1",
            options=["--stick"],
        ),
    }
    draw(case, parting, statistics(case, text), gases)
