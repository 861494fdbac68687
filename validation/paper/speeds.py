"""The most frequent normal impact speed, in the steady mill and from 0.06 to 0.09 s as in the paper's Figure 3."""

import matplotlib.pyplot as plt
import numpy as np
from log import BALL, over_seeds

TYPICAL = "The most frequent impact speed is that of a fall from 1.5 mm"
OWN = "Impact speeds from 0.06 to 0.09 s after the start (Figure 3) have this maximum and represent the mill"
FALL = float(np.sqrt(2 * 9.81 * 1.5e-3))  # [m/s]
BAND = 0.025  # [m/s]: the paper gives the height to two digits, and the maximum is broad
EDGES = np.linspace(0, 1.5, 76)  # [m/s]
FROM = 0.04  # [m/s]: below, balls at rest meet again and again at the rebound floor
STEADY, EARLY = (0.1, 0.2), (0.06, 0.09)
SMOOTH = {"contact__friction": 0, "contact__tangential_restitution": 0}
# name -> words, window, what differs from the reference mill
MILLS = {
    "steady": ("reference mill, steady", STEADY, {}),
    "early": ("reference mill, 0.06 to 0.09 s", EARLY, {}),
    "early-smooth": ("without friction, 0.06 to 0.09 s", EARLY, SMOOTH),
    "elastic": ("restitution 0.9, steady", STEADY, {"contact__restitution": 0.9}),
    "slow": ("600 rpm, steady", (0.2, 0.3), {"rotor__speed": "600 rpm"}),
}


def maximum(v):
    """Speed at which impacts are most frequent per m/s: the maximum of a quartic through the histogram's lower part."""
    edges = np.linspace(FROM, np.quantile(v, 0.6), 41)
    counts, _ = np.histogram(v, edges)
    middle = (edges[1:] + edges[:-1]) / 2
    fine = np.linspace(edges[0], edges[-1], 2001)
    return float(fine[np.polyval(np.polyfit(middle, counts, 4), fine).argmax()])


def measure(log):
    pairs = log.v[log.of(BALL)]
    return {
        "pairs": maximum(pairs),
        "all": maximum(log.v),
        "median": float(np.median(log.v[log.v > 0.05])),
        "density": (np.histogram(pairs, EDGES)[0] / len(pairs) / np.diff(EDGES)).tolist(),
    }


def draw(found):
    figure, ax = plt.subplots(figsize=(7.2, 4), layout="constrained")
    middle = (EDGES[1:] + EDGES[:-1]) / 2
    for k, (name, (words, _, _)) in enumerate(MILLS.items()):
        density = np.array(found[name]["density"])
        ax.plot(middle, density.mean(axis=0), f"C{k}", label=words)
        ax.plot(found[name]["pairs"].mean(), density.mean(axis=0).max(), f"C{k}v", ms=5)
    ax.axvline(FALL, color="k", ls="--", lw=1, label="fall from 1.5 mm")
    ax.set(
        xlabel="normal speed of ball-ball impacts [m/s]",
        ylabel="probability density [s/m]",
        title="The most frequent speed depends on restitution and rotor speed",
        xlim=(0, 1.5),
    )
    ax.legend(frameon=False)
    return figure


def check(case):
    found = {
        name: over_seeds(case, f"speeds-{name}", measure, window, **settings)
        for name, (_, window, settings) in MILLS.items()
    }
    for name in ("steady", "elastic", "slow"):
        case.ask(
            TYPICAL, f"{MILLS[name][0]}: most frequent normal speed of ball-ball impacts", found[name]["pairs"],
            expected=FALL, band=BAND, unit="m/s",
        )  # fmt: skip
    case.ask(
        TYPICAL, f"{MILLS['steady'][0]}: most frequent normal speed of all impacts", found["steady"]["all"],
        expected=FALL, band=BAND, unit="m/s",
    )  # fmt: skip
    for name in ("early", "early-smooth"):
        case.ask(
            OWN, f"{MILLS[name][0]}: most frequent normal speed of ball-ball impacts", found[name]["pairs"],
            expected=FALL, band=BAND, unit="m/s",
        )  # fmt: skip
    ratio = found["early"]["median"] / found["steady"]["median"]
    case.ask(
        OWN, "reference mill: ratio of the median speed from 0.06 to 0.09 s to that of the steady mill", ratio,
        expected=1, band=0.05,
    )  # fmt: skip
    case.save(draw(found), "speeds.png")
    plt.close("all")
