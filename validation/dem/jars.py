"""Planetary jars, a shaken tube and a box on a circular path: millsim compared with LIGGGHTS at steel stiffness."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
from mills import Quantity, Window, claim, judge
from runs import STIFFNESSES, contact_duration, say
from steady import own_friction

HARD_SEEDS = 48  # of millsim
QUANTITIES = [
    Quantity("power", "power of the drive", "W", 5, True),
    Quantity("kinetic", "kinetic energy", "J", 3),
    Quantity("ball_0.5", "ball-ball impacts above 0.5 m/s", "/s", 8, True),
    Quantity("vessel_strikes", "wall strikes above 0.5 m/s", "/s", 10),
]
RATES = 2  # from here on QUANTITIES are rates
TOLD = [
    Quantity("rotational", "rotational energy", "J", 0),
    Quantity("normal", "power lost in normal direction", "W", 0),
    Quantity("ball_1", "ball-ball impacts above 1 m/s", "/s", 0),
    Quantity("vessel_0.5", "wall impacts above 0.5 m/s (each re-contact counts)", "/s", 0),
    Quantity("ball_slow_strikes", "ball-ball strikes above 0.5 m/s", "/s", 0),
]


@dataclasses.dataclass(frozen=True)
class Mill:
    """A deck of this folder, how many starts LIGGGHTS runs of it, and what it is in words; rates: whether fast impacts
    are so many that their rates are claimed, too."""

    deck: str
    starts: int
    what: str
    rates: bool = True
    known: dict = dataclasses.field(default_factory=dict)  # by quantity: why it is known not to agree


MILLS = [
    Mill(
        "planetary45",
        5,
        "planetary jar, 45 ml, 7 balls of 15 mm, 650 rpm",
        known={
            "ball_0.5": "balls that are pressed together meet several times within the duration of one soft contact"
        },
    ),
    Mill("planetary250b", 3, "planetary jar, 250 ml, 25 balls of 15 mm, 400 rpm"),
    Mill("planetary250", 1, "planetary jar, 250 ml, 50 balls of 10 mm, 300 rpm", False),
    Mill("vibratory", 8, "tube shaken along a circle, 60 balls of 10 mm"),
    Mill("box", 3, "box on a circular path, 20 balls of 10 mm"),
]


def check(case):
    say("    jars and boxes")
    verdicts = {mill.what: compare(case, mill) for mill in MILLS}
    draw(case, verdicts)


def compare(case, mill):
    """Claims of one mill: the same starts in both programs, and more of them in millsim."""
    deck = case.folder / f"{mill.deck}.ini"
    seeds = range(1, mill.starts + 1)
    soft = [Window(case.dem(f"{mill.deck}-{seed}", deck, "steel", run__seed=seed)) for seed in seeds]
    # a soft contact is one: in millsim re-contacts of a pair within its duration are one strike
    duration = contact_duration((deck,), STIFFNESSES["steel"])
    window = {"output__strike_window": f"{duration} s"}
    hard = [Window(path) for path in case.seeds(HARD_SEEDS, deck, **window)]
    verdicts = [judge(quantity, soft, hard) for quantity in QUANTITIES]
    claimed = verdicts if mill.rates else verdicts[:RATES]
    against = f"LIGGGHTS, steel, {mill.what}, starts: {mill.starts}"
    for verdict in claimed:
        claim(case, verdict, against, known=mill.known.get(verdict.quantity.key, ""))
    told = verdicts[len(claimed) :] + [judge(quantity, soft, hard) for quantity in TOLD]
    case.tell(f"No claim, {mill.what}: {words(told)}.")
    own = own_friction(soft[0].path)
    hard = [Window(path) for path in case.seeds(HARD_SEEDS, deck, **window, **own)]
    told = [judge(quantity, soft, hard) for quantity in QUANTITIES + TOLD]
    case.tell(f"With LIGGGHTS' effective friction, {mill.what}: {words(told)}.")
    return claimed


def words(verdicts):
    return ", ".join(f"{v.quantity.name} {v.off:+.1f} +- {v.error:.1f} %" for v in verdicts)


def draw(case, verdicts):
    """Deviations of all mills beside the bands."""
    figure, axis = plt.subplots(figsize=(9, 4.6), layout="constrained")
    rows = np.arange(len(QUANTITIES))[::-1]
    for row, quantity in zip(rows, QUANTITIES, strict=True):
        axis.fill_betweenx([row - 0.4, row + 0.4], -quantity.band, quantity.band, color="C2", alpha=0.15, lw=0)
    for k, (what, of) in enumerate(verdicts.items()):
        shift = 0.28 - 0.14 * k
        off, error = ([getattr(v, name) for v in of] for name in ("off", "error"))
        axis.errorbar(off, rows[: len(of)] + shift, xerr=error, fmt="os^Dv"[k], ms=5, capsize=3, label=what)
    axis.axvline(0, color="k", lw=0.8)
    axis.set_yticks(rows, [quantity.name for quantity in QUANTITIES])
    axis.set(xlabel="deviation of millsim from LIGGGHTS at steel stiffness [%]; bars: one standard error")
    axis.grid(alpha=0.3, axis="x")
    axis.legend(fontsize=8, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.13))
    case.save(figure, "jars.png")
    plt.close(figure)
