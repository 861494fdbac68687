"""Pinches: mills whose blades press balls against walls, at steel stiffness; millsim lets balls go, or they jam."""

import numpy as np
from mills import Quantity, Window, claim, judge
from runs import ROOT

from milltools.read.runfile import Run

FOLDER = ROOT / "validation" / "dem"
DECK = FOLDER / "pinch.ini"
SEEDS = 6
PINCHED = [
    Quantity("power", "rotor power", "W", 5, True),
    Quantity("kinetic", "kinetic energy", "J", 5),
    Quantity("ball_1", "ball-ball impacts above 1 m/s", "/s", 8, True),
]
DENSE = {"balls__count": 1800, "rotor__speed": "900 rpm", "blades__count": 8, "blades__width": "9 mm"}  # fmt: skip
# name, what it is, further settings, starts in LIGGGHTS
MILLS = [
    ("pinch", "1500 balls, 700 rpm, clearances of 10 mm at the tip and 4 mm beside the blades", {}, 3),
    (
        "jam",
        "1800 balls, 900 rpm, clearances of 4 mm at the tip and 0.5 mm beside the blades",
        DENSE | {"blades__tip_radius": "56 mm"},
        1,
    ),  # fmt: skip
    ("narrow", "1800 balls, 900 rpm, clearances of 10 mm at the tip and 0.5 mm beside the blades", DENSE, 1),
]


def greatest(path):
    """[W] the greatest millisecond of the rotor's power within the window of a run."""
    with Run(path) as run:
        time, work = run.series("rotor_work")
        inside = time >= run.window[0] - 1e-9
    return (np.diff(work[inside]) / np.diff(time[inside])).max()


def pinch_share(path):
    """Share of the rotor's work that is done on pressed balls, and how many balls were let go."""
    with Run(path) as run:
        _, work = run.series("rotor_work")
        return float(run.read("run/pinch_work")) / work[-1], int(run.read("run/reliefs"))


def check(case):
    for name, text, settings, starts in MILLS:
        soft = [case.dem(f"{name}-{seed}", DECK, "steel", **settings, run__seed=seed) for seed in range(1, 1 + starts)]
        hard = case.seeds(SEEDS, DECK, **settings)
        against = f"LIGGGHTS, steel, {starts} start{'s' if starts > 1 else ''}"
        windows = [Window(path) for path in soft], [Window(path) for path in hard]
        for quantity in PINCHED:
            headline = quantity.headline and name == "pinch"
            claim(case, judge(quantity, *windows), against, suffix=f", {text}", headline=headline)
        powers = np.array([window.values["power"] for window in windows[1]])
        if name == "pinch":
            case.bound(
                f"{text}: scatter of the power from seed to seed",
                100 * powers.std(ddof=1) / powers.mean(),
                2,
                unit="%",
                against="no single ball determines the power of a run",
            )
            case.bound(
                f"{text}: ratio of the largest power in one millisecond, six seeds, to that in LIGGGHTS",
                max(map(greatest, hard)) / max(map(greatest, soft)),
                1.5,
                against="a soft ball gives way, even if it is stiff",
            )
        shares = [pinch_share(path) for path in hard]
        case.tell(
            f"{text}: {100 * np.mean([share for share, _ in shares]):.0f} % of the rotor's work is done on pressed "
            f"balls, {np.mean([count for _, count in shares]):.0f} balls are let go per run; power of the seeds "
            + ", ".join(f"{power:.1f}" for power in powers)
            + f" W; largest power in one millisecond {', '.join(f'{greatest(path):.0f}' for path in hard)} W, "
            f"in LIGGGHTS {', '.join(f'{greatest(path):.0f}' for path in soft)} W."
        )
