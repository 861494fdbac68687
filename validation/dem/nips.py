"""Nips: clearances of 5.05 to 4.5 mm, where friction can hold a ball of 5 mm between blade edge and drum."""

import matplotlib.pyplot as plt
import numpy as np
from gaps import DECK, RADIUS, SEEDS
from mills import Window, claim, judge
from pinches import PINCHED, pinch_share

HALF = 3.5e-3  # [m] half the blades' thickness: their corners are the nearest to the drum
# [mm] from corner to drum, for balls of 5 mm
GAPS = ("5.05", "4.95", "4.91", "4.8", "4.7", "4.6", "4.5")
STARTS = {"4.5": 2}  # of LIGGGHTS, where not one: a few jams decide there
# At 4.65 mm: mills that the constants of the rule were not chosen by
OTHER = {
    "600 rpm": {"rotor__speed": "600 rpm"},
    "friction 0.5": {"contact__friction": "0.5"},
    "1500 rpm, 2500 balls": {"rotor__speed": "1500 rpm", "balls__count": "2500"},
}
SETTINGS = {"run__time": "0.12 s", "run__sample_from": "0.05 s"}


def compared(case, gap, name, starts=1, **settings):
    """Windows of LIGGGHTS' run at a gap [mm], and of millsim's."""
    tip = np.sqrt((RADIUS - 1e-3 * float(gap)) ** 2 - HALF**2)
    settings = SETTINGS | {"blades__tip_radius": f"{1e3 * tip:.4f} mm"} | settings
    soft = [case.dem(f"nips-{name}-{seed}", DECK, "steel", **settings, run__seed=seed) for seed in range(1, 1 + starts)]
    return [Window(path) for path in soft], [Window(path) for path in case.seeds(SEEDS, DECK, **settings)]


def check(case):
    soft, hard = [], []
    for gap in GAPS:
        windows = compared(case, gap, gap, STARTS.get(gap, 1))
        for quantity in PINCHED:
            claim(
                case,
                judge(quantity, *windows),
                f"LIGGGHTS, steel, {len(windows[0])} start{'s' if len(windows[0]) > 1 else ''}",
                suffix=f", clearance {gap} mm at the corners",
                headline=quantity.headline and gap in ("4.8", "4.5"),
            )
        shares = [pinch_share(run.path) for run in windows[1]]
        case.tell(
            f"clearance {gap} mm at the corners: {100 * np.mean([share for share, _ in shares]):.0f} % of the "
            f"rotor's work is done on pressed balls, {np.mean([count for _, count in shares]):.0f} balls are "
            "let go per run."
        )
        soft.append(np.mean([run.values["power"] for run in windows[0]]))
        hard.append([run.values["power"] for run in windows[1]])
    for words, settings in OTHER.items():
        windows = compared(case, "4.65", words.replace(",", "").replace(" ", "-"), **settings)
        verdicts = [judge(quantity, *windows) for quantity in PINCHED]
        case.tell(
            f"clearance 4.65 mm at the corners, {words}, no claim: millsim deviates from LIGGGHTS by "
            + ", ".join(f"{v.off:+.1f} +- {v.error:.1f} % ({v.quantity.name})" for v in verdicts)
            + "."
        )
    draw(case, np.array([float(gap) for gap in GAPS]), np.array(soft), np.array(hard))


def draw(case, gaps, soft, hard):
    figure, axis = plt.subplots(figsize=(8, 5), layout="constrained")
    axis.errorbar(gaps, hard.mean(axis=1), hard.std(axis=1, ddof=1), fmt=".-", label="millsim")
    axis.plot(gaps, soft, "o", mfc="none", ms=10, color="k", label="LIGGGHTS, steel")
    axis.axvline(5, color="grey", lw=0.8, ls=":")
    axis.annotate(" ball diameter", (5, axis.get_ylim()[1]), va="top")
    axis.set(xlabel="clearance between blade corners and drum [mm]", ylabel="rotor power [W]")
    axis.set_ylim(0)
    axis.legend()
    worst = np.max(np.abs(hard.mean(axis=1) / soft - 1))
    axis.set_title(f"Clearance slightly less than the ball diameter: power within {100 * worst:.0f} % of soft spheres")
    case.save(figure, "nips.png")
    plt.close(figure)
