"""Where and how hard the balls hit, and which impacts have most of the energy: the reference mill, steady."""

import matplotlib.pyplot as plt
import numpy as np
from log import BALL, DRUM, END, over_seeds

BORDER = "More than half of the impacts are at the border of the grinding chamber"
BLADES = "The hardest impacts are near the blades"
RARE = "Efficient collisions are rare"


def measure(log):
    """Shares in per cent, speeds in m/s, of one log."""
    d = log.diameter
    wall = np.minimum(log.from_drum, log.from_ends)
    pair = log.of(BALL)
    at = {
        "drum": log.of(DRUM),
        "walls": log.of(DRUM) | log.of(END),
        "half": wall <= d / 2,
        "one_drum": log.from_drum <= d,
        "one": wall <= d,
        "two": wall <= 2 * d,
    }
    found = {key: 100 * inside.mean() for key, inside in at.items()}
    found["one_pairs"] = 100 * at["one"][pair].mean()
    near = log.from_blade <= d
    hard = log.v >= np.quantile(log.v, 0.99)
    found |= {
        "near": log.v[near].mean(),
        "far": log.v[~near].mean(),
        "near_share": 100 * near.mean(),
        "hard_near": 100 * near[hard].mean(),
        "hard_two": 100 * (log.from_blade <= 2 * d)[hard].mean(),
        "two_share": 100 * (log.from_blade <= 2 * d).mean(),
        "above": 100 * (log.v > 1).mean(),
    }
    for key, value in (("energy", log.energy), ("loss", log.loss)):
        falling = np.sort(value)[::-1].cumsum()
        for share in (50, 90):
            carry = np.searchsorted(falling, share / 100 * falling[-1]) + 1
            found[f"{key}_{share}"] = 100 * carry / len(falling)
    for k in range(1, 31):  # of the figure
        found[f"within_{k}"] = 100 * (wall <= k * d / 6).mean()
    return found


def draw(found):
    figure, ax = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    steps = np.arange(1, 31)
    shares = np.array([found[f"within_{k}"] for k in steps])
    ax.plot(steps / 6, shares.mean(axis=1), "C0.-")
    ax.axhline(50, color="k", ls="--", lw=1, label="half of all impacts")
    ax.set(
        xlabel="depth of the border, from drum and end walls [ball diameters]",
        ylabel="impacts within the border [%]",
        title="Half of the impacts are at the border if its depth is one ball diameter",
        ylim=(0, 104),
    )
    ax.legend(frameon=False)
    return figure


def check(case):
    f = over_seeds(case, "reference", measure)
    for words, key in (
        ("fraction of impacts with a point of contact within one diameter of drum or end walls", "one"),
        ("fraction of impacts with a point of contact within one diameter of the drum", "one_drum"),
        ("fraction of impacts with a point of contact within two diameters of drum or end walls", "two"),
        (
            "fraction of impacts with a point of contact within half a diameter of drum or end walls "
            "(two balls at a flat wall touch at this distance)",
            "half",
        ),
        ("fraction of ball-ball impacts with a point of contact within one diameter of drum or end walls", "one_pairs"),
        ("fraction of impacts in which a ball hits the drum or an end wall", "walls"),
        ("fraction of impacts in which a ball hits the drum", "drum"),
    ):
        case.ask(BORDER, words, f[key], above=50, unit="%")
    case.ask(
        BLADES, "ratio of the mean v_n within one diameter of a blade to that elsewhere", f["near"] / f["far"], above=1,
    )  # fmt: skip
    case.ask(
        BLADES, "fraction of the hardest 1 % of impacts within one diameter of a blade, divided by that of all impacts",
        f["hard_near"] / f["near_share"], above=1,
    )  # fmt: skip
    case.ask(
        BLADES, "fraction of the hardest 1 % of impacts within one diameter of a blade", f["hard_near"],
        above=50, unit="%",
    )  # fmt: skip
    case.ask(
        BLADES, "fraction of the hardest 1 % of impacts within two diameters of a blade", f["hard_two"],
        above=50, unit="%",
    )  # fmt: skip
    case.tell(
        f"Mean normal speeds: {f['near'].mean():.3f} m/s within one diameter of a blade, {f['far'].mean():.3f} m/s "
        f"elsewhere. {f['near_share'].mean():.1f} % of all impacts are within one diameter of a blade, "
        f"{f['two_share'].mean():.1f} % within two diameters."
    )
    rare = "smallest fraction of impacts that together have half of the"
    case.ask(RARE, f"{rare} energy of normal approach", f["energy_50"], below=10, unit="%")
    case.ask(RARE, f"{rare} dissipated energy", f["loss_50"], below=10, unit="%")
    case.ask(RARE, "fraction of impacts with a normal speed above 1 m/s", f["above"], below=20, unit="%")
    case.tell(
        f"{f['energy_90'].mean():.1f} % of the impacts have nine tenths of the energy of normal approach, "
        f"{f['loss_90'].mean():.1f} % have nine tenths of the dissipated energy."
    )
    case.save(draw(f), "border.png")
    plt.close("all")
