"""The mills that are compared: another program, soft millsim and hard millsim, from the same starts."""

import dataclasses
import datetime
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
    **{one.stem: (one, ()) for folder in (INPUT, HERE) for one in sorted(folder.glob("*.ini"))},
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
    found = {"power": float(run.statistic(f"{run.drive}/power"))} if run.driven else {}
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


def lammps(runner, mill, path, own, soft, law="limited"):
    """The quantities of LAMMPS' run of a deck with these overrides; `soft`: facts of the run of soft millsim."""
    deck = runner.deck(path, own)
    made = write(deck, deck.start(), mill.modulus, soft["speed"], soft["time_step"], law)
    return runner.kept(
        f"{mill.name} {law} {own[0]}",
        "\n".join([f"{mill.begin} {mill.end}", *made.lines]),
        lambda: measure(made, deck, mill.begin, mill.end),
    )


def compare(runner, mill, referee):
    """{program: [quantities of each start]}; "other" is that of `referee`, called as lammps()."""
    path, sets = DECKS[mill.deck]
    found = {"other": [], "soft": [], "hard": []}
    for seed in range(1, mill.starts + 1):
        own = [f"run.seed={seed}", f"run.time={mill.end} s", f"run.sample_from={mill.begin} s"]
        own += [
            "run.precision=0",
            "run.starts=1",
            f"output.series={mill.end / 1000:.9g} s",
            "output.frames=0 s",
            *sets,
            *mill.sets,
        ]
        own += nudged(runner, path, own, seed)
        with runner.soft(path, own, mill.modulus) as run:
            soft = {key: float(run.read(f"run/soft/{key}")) for key in ("speed", "time_step", "contact_duration")}
        window = f"output.strike_window={soft['contact_duration']:.9g} s"
        for program, start in (("soft", runner.soft), ("hard", runner.millsim)):
            with start(path, [*own, window], *([mill.modulus] if program == "soft" else [])) as run:
                found[program].append(of_file(run))
        found["other"].append(referee(runner, mill, path, [*own, window], soft))
        runner.say(f"{mill.name}: start {seed} of {mill.starts}")
    return found


def write_page(name, title, made, lines, off):
    """Writes a page of results beside this file. made: how, when and with what; lines: its tables; off: as table()."""
    text = [
        f"# {title}",
        "",
        f"Written on {datetime.date.today()} by {made}.",
        "[README.md](README.md) explains the tables.",
        *lines,
        "",
        f"Off: {'; '.join(' '.join(one) for one in off) or 'nothing'}.",
    ]
    (HERE / name).write_text("\n".join(text) + "\n")


def told(values):
    """Mean and its standard error, as text."""
    mean, error = np.mean(values), np.std(values, ddof=1) / np.sqrt(len(values))
    return mean, error


def pair(mean, error):
    """A mean with as many places as its error deserves."""
    places = max(0, 1 - int(np.floor(np.log10(error)))) if error > 1e-9 * abs(mean) else 2
    return f"{mean:.{places}f} +- {error:.{places}f}"


def judge(found, key):
    """(off [%], error [%]) of soft and of hard millsim, relative to the other program: differences of runs from one
    start.
    """
    reference = np.array([one[key] for one in found["other"]])
    pairs = []
    for program in ("soft", "hard"):
        off, error = told(np.array([one[key] for one in found[program]]) - reference)
        pairs.append((100 * off / reference.mean(), 100 * error / reference.mean()))
    return pairs


def table(runner, mills=MILLS, referee=lammps, name="LAMMPS"):
    """The lines of a table, and the (mill, quantity) that are off. name: of the other program."""
    lines = [
        f"| mill | quantity | {name} | soft millsim | hard millsim | soft/{name} - 1, % | hard/{name} - 1, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    off = []
    for mill in mills:
        found = compare(runner, mill, referee)
        label = f"{mill.name}, {mill.modulus:.2g} Pa, {mill.starts} starts, {mill.begin:g} to {mill.end:g} s"
        for key, words in NAMES.items():
            if key not in found["other"][0] or not any(one[key] for one in found["other"]):
                continue
            cells = []
            for program in found:
                mean, error = told([SCALE.get(key, 1) * one[key] for one in found[program]])
                cells.append(pair(mean, error))
            pairs = judge(found, key)
            cells += [f"{value:+.2g} +- {error:.2g}" for value, error in pairs]
            if key in ("power", "kinetic") and not (abs(pairs[0][0]) <= max(1.0, 2 * pairs[0][1])):
                off.append((mill.name, words, cells[3]))
            lines.append(f"| {label} | {words} | {' | '.join(cells)} |")
            label = ""
        cost = {program: np.sum([one["cpu"] for one in found[program]]) for program in found}
        cells = " | ".join(f"{value:.3g}" for value in cost.values())
        lines.append(f"| | processor time of all starts, s | {cells} | | |")
    return lines, off
