"""The paper's grid of Figure 7, 19 x 1001 designs: its computing cost, and the effect of one step of 0.01 mm."""

import numpy as np
from study_case import MEDIAN, ROOT, H

FULL = "Figure 7 on a grid of 19 x 1001 designs (h in steps of 0.01 mm)"
STUDY = ROOT / "input" / "figure7-full.study"
DRAWN = 40  # designs, evenly spread over the grid by Sobol's sequence: what one costs
LINE = "n = 16, h = 3 to 3.2 mm"  # 21 neighbours on the grid
ERROR = f"{MEDIAN}:error"


def check(case):
    price, _ = case.study(
        "full-price", "sweep", "--no-picture", "--set", "study.method=sobol", "--set", f"study.samples={DRAWN}",
        "--set", "vary.drum.buckle_height=0..10 mm step 0.01 mm", file=STUDY,
    )  # fmt: skip
    line, _ = case.study(
        "full-line", "sweep", "--no-picture", "--set", "vary.drum.buckles=16",
        "--set", "vary.drum.buckle_height=3..3.2 mm step 0.01 mm", file=STUDY,
    )  # fmt: skip
    cost = price.cpu.to_numpy()
    error = cost.std(ddof=1) / np.sqrt(len(cost))
    hours = 19 * 1001 * cost.mean() / 3600
    case.ask(
        FULL, "the whole grid",
        reason=f"not repeated: {cost.mean():.1f} +- {error:.1f} CPU s per design, "
        f"in total {hours:.0f} +- {19019 * error / 3600:.0f} hours of one core",
    )  # fmt: skip
    capped = int((price.status == "capped").sum())
    case.tell(
        f"The computing cost is the mean of {len(price)} designs that Sobol's sequence distributes over the grid "
        f"({capped} of them ended at 1e7 contacts), on this machine, which did other work at the same time. "
        "`mill sweep input/figure7-full.study` runs the whole grid, with `--slurm` on a cluster."
    )
    h, v = line[H].to_numpy(), line[MEDIAN].to_numpy()
    slope, at = np.polyfit(h - h.mean(), v, 1)
    off = (v - at - slope * (h - h.mean())) / line[ERROR].to_numpy()
    scatter = np.sqrt((off**2).sum() / (len(h) - 2))
    case.ask(
        FULL, f"{LINE}: scatter of the {len(h)} neighbouring designs about a straight line, "
        "divided by their standard errors", scatter, expected=1, band=1, error=scatter / np.sqrt(2 * (len(h) - 2)),
    )  # fmt: skip
    step = abs(slope) * 1e-5 / line[ERROR].mean()
    case.ask(
        FULL, f"{LINE}: change of the median from one design to the next, "
        "divided by the standard error of a median",
        step, below=1, error=step * np.sqrt(np.mean(line[ERROR] ** 2) / ((h - h.mean()) ** 2).sum()) / abs(slope),
    )  # fmt: skip
    known = 100 * line[ERROR].mean() / at
    case.tell(
        f"At {LINE} the median changes by {100 * slope * 1e-3 / at:.1f} % per millimetre, "
        f"thus by {abs(100 * slope * 1e-5 / at):.2f} % per step. "
        f"Each run reports a standard error of {known:.1f} %; their scatter gives {scatter * known:.1f} %."
    )
