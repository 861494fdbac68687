"""Process parameters of the reference mill: effect of speed, filling, size, restitution on impacts and power."""

import matplotlib.pyplot as plt
import numpy as np
from study_case import MEDIAN, ROOT

MAIN = "Rotor speed, filling, size and restitution of the balls are main process parameters"
STUDY = ROOT / "input" / "process.study"
# Of the deck's 128 designs, each cut off at 2e7 contacts: an eighth of the time, and the exponents are known well
# enough
SAMPLES, CONTACTS = 32, 8e6
POWER = "rotor/power"
KEYS = {
    "rotor.speed": "rotor speed",
    "balls.fill": "filling",
    "balls.diameter": "ball diameter",
    "contact.restitution": "1 - restitution^2",
}
WANTED = {MEDIAN: "median impact speed", POWER: "rotor power"}


UNITS = {MEDIAN: "m/s", POWER: "W"}
# key -> factor, unit and ticks of its axis
SHOWN = {
    "rotor.speed": (30 / np.pi, "rpm", (500, 700, 1000, 1400)),
    "balls.fill": (100, "%", (5, 10, 20)),
    "balls.diameter": (1e3, "mm", (4, 5, 6, 7)),
    "contact.restitution": (1, "1", (0.1, 0.2, 0.5)),
}
TICKS = {MEDIAN: (0.2, 0.5, 1), POWER: (100, 200, 500, 1000, 2000)}


def inputs(table):
    """What the law is a product of powers of: (designs, keys)."""
    x = table[list(KEYS)].to_numpy(float, copy=True)
    x[:, -1] = 1 - x[:, -1] ** 2
    return x


def exponents(table, wanted):
    """{key: (exponent, its standard error)} of a power law through all designs, and its R^2."""
    x = np.log(inputs(table))
    x = np.column_stack([x - x.mean(axis=0), np.ones(len(x))])
    y = np.log(table[wanted].to_numpy())
    found, _, _, _ = np.linalg.lstsq(x, y, rcond=None)
    off = y - x @ found
    variance = off @ off / (len(y) - x.shape[1]) * np.linalg.inv(x.T @ x)
    errors = np.sqrt(np.diag(variance))
    return dict(zip(KEYS, zip(found, errors))), 1 - off.var() / y.var()


def draw(table, laws):
    """Each design against each parameter, brought by the law to the geometric mean of the other three."""
    figure, axes = plt.subplots(2, 4, figsize=(13, 5.6), layout="constrained", sharex="col", sharey="row")
    x = inputs(table)
    middle = np.exp(np.log(x).mean(axis=0))
    for row, (wanted, name) in zip(axes, WANTED.items()):
        powers = np.array([laws[wanted][key][0] for key in KEYS])
        for k, (ax, (key, words)) in enumerate(zip(row, KEYS.items())):
            others = np.delete(np.arange(len(KEYS)), k)
            same = table[wanted] / np.prod((x / middle)[:, others] ** powers[others], axis=1)
            factor, unit, ticks = SHOWN[key]
            level = np.exp(np.log(table[wanted]).mean())
            line = np.geomspace(x[:, k].min(), x[:, k].max(), 50)
            ax.loglog(factor * x[:, k], same, "C0o", ms=4)
            ax.loglog(factor * line, level * (line / middle[k]) ** powers[k], "k-", lw=1)
            ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
            ax.set_yticks(TICKS[wanted], [f"{tick:g}" for tick in TICKS[wanted]])
            ax.minorticks_off()
            value, error = laws[wanted][key]
            ax.set_title(f"exponent {value:.2f} +- {error:.2f}", fontsize=10)
            if ax in axes[-1]:
                ax.set_xlabel(f"{words} [{unit}]")
        row[0].set_ylabel(f"{name} [{UNITS[wanted]}]")
    figure.suptitle("Speed and filling determine the power, restitution and filling the impact speed")
    return figure


def change(laws, key, factor):
    """What a parameter `factor` times as large does to both, in words."""
    changes = (
        f"the {name} by {100 * (factor ** laws[wanted][key][0] - 1):+.0f} +- "
        f"{100 * factor ** laws[wanted][key][0] * laws[wanted][key][1] * np.log(factor):.0f} %"
        for wanted, name in WANTED.items()
    )
    return " and ".join(changes)


def check(case):
    table, _ = case.study(
        "process", "sweep", "--no-picture", "--set", f"study.samples={SAMPLES}", "--set",
        f"study.max_collisions={CONTACTS:g}", file=STUDY,
    )  # fmt: skip
    done = table[table.status == "done"]
    laws, left = {}, {}
    for wanted, name in WANTED.items():
        laws[wanted], explained = exponents(done, wanted)
        left[wanted] = 100 * (1 - explained)
        for key, words in KEYS.items():
            value, error = laws[wanted][key]
            case.ask(
                MAIN, f"power law of the {name}: absolute value of the exponent of {words}, {value:.2f}", abs(value),
                above=0, error=error, headline=key == "rotor.speed",
            )  # fmt: skip
    for key, words in KEYS.items():
        more = (
            "1.1 times as large"
            if key != "contact.restitution"
            else "1.1 times as large (restitution 0.777 instead of 0.8)"
        )
        case.tell(f"{words[0].upper()}{words[1:]} {more}: this changes {change(laws, key, 1.1)}.")
    case.tell(
        f"The power laws do not explain {left[MEDIAN]:.1f} % (median) and {left[POWER]:.1f} % (power) of the variance "
        f"of the logarithm. They are fitted to {len(done)} of {len(table)} designs of Sobol's sequence: "
        f"{int((table.status == 'failed').sum())} failed, the others were not known to 2 % after {CONTACTS:.0e} "
        f"contacts or 1 s; {table.cpu.sum():.0f} CPU s. `input/process.study` itself has 128 designs and 2e7 contacts."
    )
    case.picture("process", "sensitivity", "process-sensitivity.png")
    case.save(draw(done, laws), "process.png")
    plt.close("all")
