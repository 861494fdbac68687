"""Gaps: forty designs, clearances of blades and drum down to half a millimetre, and LIGGGHTS for five of them."""

import subprocess

import matplotlib.pyplot as plt
import numpy as np
import pandas
from mills import Window, claim, judge
from pinches import PINCHED
from runs import ROOT, folder, say

DECK = ROOT / "input" / "simoloyer.ini"
RADIUS = 75e-3  # [m] of the drum
SEEDS = 4
SCATTER = 10  # [%] between two seeds of 0.15 s
# tip radius and width of the blades [mm]: gaps of two balls and more, of a little less than a ball (which jams between
# edge and drum), of half a ball and of none; the reference mill, 67 and 12, is in steady.py
WEDGE = ("70.5", "17")
JAM = (
    "half of the power goes to balls pushed along between blade corner and drum, and soft balls take a tenth more; "
    "the moment at which they are let go has no effect"
)
DESIGNS = [("64", "13.5"), ("66", "17"), WEDGE, ("72.5", "10"), ("74.5", "23.5")]
TIP, WIDTH, POWER = "blades.tip_radius", "blades.width", "rotor/power"


def check(case):
    table = sweep(case)
    soft = {}
    for design in DESIGNS:
        windows = compared(case, design, "steel")
        soft[design] = windows[0]
        for quantity in PINCHED:
            verdict = judge(quantity, *windows)
            known = JAM if design == WEDGE and quantity.key == "power" else ""
            claim(case, verdict, "LIGGGHTS, steel", suffix=f", {named(design)}", known=known)
    powers = [run.values["power"] for run in (soft[WEDGE][0], compared(case, WEDGE, "1e10")[0][0])]
    case.tell(
        f"{named(WEDGE)}: the power in LIGGGHTS is {powers[0]:.0f} W at steel and {powers[1]:.0f} W at 1e10 Pa. "
        "Balls jam between the edge of a blade and the drum, and the power that this takes depends on their stiffness; "
        "such a run has a note about pinches."
    )
    draw(case, table, soft)


def named(design):
    tip, width = design
    return f"clearance {1e3 * RADIUS - float(tip):g} mm at the tip, blades {width} mm wide"


def compared(case, design, modulus):
    """Windows of LIGGGHTS' run of a design, and of millsim's."""
    tip, width = design
    settings = {
        "blades__tip_radius": f"{tip} mm",
        "blades__width": f"{width} mm",
        "run__time": "0.2 s",
    }
    path = case.dem(f"gaps-{tip}-{width}-{modulus}", DECK, modulus, **settings)
    return [Window(path)], [Window(path) for path in case.seeds(SEEDS, DECK, **settings)]


def sweep(case):
    """The table of gaps.study, two seeds a design."""
    say("    40 designs, two seeds each")
    path = case.scratch / "gaps.parquet"
    study = folder() / "gaps.study"
    subprocess.run(
        [ROOT / "mill", "sweep", "-q", "--no-picture", study, "-o", path],
        stdout=subprocess.DEVNULL,
        check=True,
    )
    table = pandas.read_parquet(path)
    case.bound(
        f"{len(table)} runs of 40 designs: number that failed, were cut short or left a ball deep in a body",
        int((table.status != "done").sum()),
        0,
        against="no pinch makes a run unusable",
        headline=True,
    )
    power = table.groupby([TIP, WIDTH])[POWER]
    off = 100 * (power.max() - power.min()) / power.mean()
    case.bound(
        "40 designs: largest relative difference of the power between two seeds",
        off.max(),
        SCATTER,
        unit="%",
        against="no single ball determines the power of a run of 0.15 s",
    )
    share = (table["rotor/pinch_power"] / table[POWER]).groupby(table[TIP]).mean()
    told = ", ".join(f"{1e3 * (RADIUS - tip):.1f} mm: {100 * part:.0f} %" for tip, part in share.items())
    case.tell(
        f"The powers of two seeds of a design differ by {np.sqrt(np.mean(off**2)):.1f} % (rms). Fraction of the power "
        f"that goes to pressed balls, by the clearance at the tip: {told}."
    )
    return table


def draw(case, table, soft):
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    designs = table.groupby([WIDTH, TIP])[POWER].mean()
    for k, (width, powers) in enumerate(designs.groupby(level=0)):
        gap = 1e3 * (RADIUS - powers.index.get_level_values(TIP))
        axis.plot(gap, powers.values, ".-", color=f"C{k}", label=f"blades {1e3 * width:g} mm wide")
        drawn = [(t, w) for t, w in soft if abs(float(w) - 1e3 * width) < 1e-6]
        axis.plot(
            [1e3 * RADIUS - float(tip) for tip, _ in drawn],
            [soft[design][0].values["power"] for design in drawn],
            "o", mfc="none", ms=10, color=f"C{k}",
        )  # fmt: skip
    axis.plot([], [], "o", mfc="none", ms=10, color="k", label="LIGGGHTS, steel")
    axis.axvline(5, color="grey", lw=0.8, ls=":")
    axis.annotate(" ball diameter", (5, axis.get_ylim()[1]), va="top")
    axis.set(xlabel="clearance between blades and drum [mm]", ylabel="rotor power [W]", yscale="log")
    axis.legend(fontsize=8)
    axis.set_title("Forty designs: balls jam only where the clearance is slightly less than a ball diameter")
    case.save(figure, "gaps.png")
    plt.close(figure)
