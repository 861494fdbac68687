"""The mills that are compared: LAMMPS, soft millsim and hard millsim, from the same starts."""

import dataclasses
import pathlib

import numpy as np
from lammps_run import SPEEDS, measure
from script import write

HERE = pathlib.Path(__file__).resolve().parent
INPUT = HERE.parent.parent / "input"
NUDGE = 0.02  # [m/s]
SLICE = (
    "balls.count=800", "drum.length=24 mm", "blades.count=1", "blades.tip_radius=60 mm", "drum.buckles=6",
    "drum.buckle_height=8 mm", "contact.friction=0", "run.precision=0",
)  # fmt: skip
DECKS = {
    **{name: (INPUT / f"{name}.ini", ()) for name in ("vibratory", "planetary", "emax", "mixer")},
    **{name: (HERE / f"{name}.ini", ()) for name in ("j1", "attritor", "discs", "bridge")},
    "wavy": (INPUT / "wavy.ini", SLICE),
}


@dataclasses.dataclass(frozen=True)
class Mill:
    """A row of the comparison: `deck` of DECKS with more overrides; modulus [Pa]; sampled from `begin` to `end` [s]."""

    name: str
    deck: str
    modulus: float
    starts: int
    begin: float
    end: float
    sets: tuple = ()


MILLS = [
    Mill("bridge of two balls", "bridge", 2.1e11, 12, 0.0, 0.005),
    Mill("vibratory", "vibratory", 1e10, 6, 0.5, 1.2),
    Mill("planetary", "planetary", 1e10, 6, 0.1, 0.4),
    Mill("planetary, steel", "planetary", 2.1e11, 6, 0.1, 0.2),
    Mill("emax", "emax", 1e10, 6, 0.1, 0.3),
    Mill("mixer", "mixer", 1e10, 6, 0.3, 0.9),
    Mill("J1", "j1", 1e10, 6, 0.24, 0.72),
    Mill("attritor", "attritor", 1e9, 6, 0.2, 0.4),
    Mill("discs, from rest", "discs", 1e9, 6, 0.0, 0.03),
    Mill("discs in 40 mm, from rest", "discs", 1e9, 6, 0.0, 0.03, ("body.chamber.length=40 mm", "balls.count=800")),
    Mill("wavy slice", "wavy", 1e9, 6, 0.01, 0.03),
]
NAMES = {"power": "power, W", "kinetic": "kinetic energy, mJ", "rotation": "energy of rotation, mJ"}
NAMES |= {f"above {s:g}": f"ball-ball impacts above {s:g} m/s, 1/s" for s in SPEEDS}
SCALE = {"kinetic": 1e3, "rotation": 1e3}


def of_file(run):
    """The same quantities of an output file of millsim."""
    begin, _ = run.window
    found = {"power": float(run.statistic(f"{run.drive}/power"))}
    for key, series in (("kinetic", "kinetic_energy"), ("rotation", "rotational_energy")):
        time, values = run.series(series)
        found[key] = values[time >= begin].mean()
    strikes = run.histogram("ball_ball", "strikes")
    return found | {f"above {s:g}": strikes.above(s) / run.duration for s in SPEEDS} | {"cpu": run.about("cpu_time")}


def nudged(runner, path, sets, seed):
    """Other starts of a deck that names the balls: the same places, speeds that differ by NUDGE. As overrides."""
    deck = runner.deck(path, sets)
    if deck.value("balls.start") == "random" or seed == 1:
        return []
    place, velocity, spin = deck.start()
    velocity += NUDGE * np.random.default_rng(seed).standard_normal(velocity.shape)
    file = pathlib.Path(runner.folder, "start.txt")
    np.savetxt(file, np.hstack([place, velocity, spin]), fmt="%.17g")
    return [f"balls.start={file}"]


def compare(runner, mill, law="limited"):
    """{program: [quantities of each start]}"""
    path, sets = DECKS[mill.deck]
    found = {"LAMMPS": [], "soft": [], "hard": []}
    for seed in range(1, mill.starts + 1):
        own = [*sets, *mill.sets, f"run.seed={seed}", f"run.time={mill.end} s", f"run.sample_from={mill.begin} s"]
        own += [f"output.series={mill.end / 1000:.9g} s", "output.frames=0 s", *nudged(runner, path, own, seed)]
        with runner.soft(path, own, mill.modulus) as run:
            speed, step, lasts = (float(run.read(f"run/soft/{k}")) for k in ("speed", "time_step", "contact_duration"))
        window = f"output.strike_window={lasts:.9g} s"
        for program, start in (("soft", runner.soft), ("hard", runner.millsim)):
            with start(path, [*own, window], *([mill.modulus] if program == "soft" else [])) as run:
                found[program].append(of_file(run))
        deck = runner.deck(path, own)
        made = write(deck, deck.start(), mill.modulus, speed, step, law)
        one = runner.kept(
            f"{mill.name} {law} {seed}",
            "\n".join([f"{mill.begin} {mill.end}", *made.lines]),
            lambda own=(made, deck): measure(*own, mill.begin, mill.end),
        )
        found["LAMMPS"].append(one)
        runner.say(f"{mill.name}: start {seed} of {mill.starts}")
    return found


def told(values):
    """Mean and its standard error, as text."""
    mean, error = np.mean(values), np.std(values, ddof=1) / np.sqrt(len(values))
    return mean, error


def pair(mean, error):
    """A mean with as many places as its error deserves."""
    places = max(0, 1 - int(np.floor(np.log10(error)))) if error > 0 else 2
    return f"{mean:.{places}f} +- {error:.{places}f}"


def judge(found, key):
    """(off [%], error [%]) of soft and of hard millsim, relative to LAMMPS: differences of runs from the same start."""
    reference = np.array([one[key] for one in found["LAMMPS"]])
    pairs = []
    for program in ("soft", "hard"):
        off, error = told(np.array([one[key] for one in found[program]]) - reference)
        pairs.append((100 * off / reference.mean(), 100 * error / reference.mean()))
    return pairs


def table(runner, mills=MILLS, law="limited"):
    """The lines of a table, and the (mill, quantity) that are off."""
    lines = [
        "| mill | quantity | LAMMPS | soft millsim | hard millsim | soft/LAMMPS - 1, % | hard/LAMMPS - 1, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    off = []
    for mill in mills:
        found = compare(runner, mill, law)
        label = f"{mill.name}, {mill.modulus:.2g} Pa, {mill.starts} starts, {mill.begin:g} to {mill.end:g} s"
        for key, name in NAMES.items():
            if key not in found["LAMMPS"][0] or not any(one[key] for one in found["LAMMPS"]):
                continue
            cells = []
            for program in ("LAMMPS", "soft", "hard"):
                mean, error = told([SCALE.get(key, 1) * one[key] for one in found[program]])
                cells.append(pair(mean, error))
            pairs = judge(found, key)
            cells += [f"{value:+.2g} +- {error:.2g}" for value, error in pairs]
            if key in ("power", "kinetic") and not (abs(pairs[0][0]) <= max(1.0, 2 * pairs[0][1])):
                off.append((mill.name, name, cells[3]))
            lines.append(f"| {label} | {name} | {' | '.join(cells)} |")
            label = ""
        cost = {program: np.sum([one["cpu"] for one in found[program]]) for program in found}
        cells = " | ".join(f"{value:.3g}" for value in cost.values())
        lines.append(f"| | processor time of all starts, s | {cells} | | |")
    return lines, off
