"""What depends on the rebound floor in a planetary mill that presses balls against its wall with 33 g."""

import h5py
import numpy as np
from jars.common import mean

FLOORS = (0.005, 0.02, 0.05, 0.1, 0.2, 0.3)  # [m/s]
USUAL = 0.05
SEEDS = range(1, 9)
TIME, FROM = 3.0, 0.5
CHARGES = {"7 balls of 15 mm": (7, 0.015), "20 balls of 10 mm": (20, 0.010)}
COLUMNS = ("power [W]", "kinetic energy [J]", "median above 50 mm/s [m/s]", "impacts above 0.5 m/s [1/s]",
           "impacts above 1 m/s [1/s]", "contacts [1/s]", "CPU time [s/s]")  # fmt: skip


def run(case, floor, count, diameter, seed):
    path = case.run(
        "planetary.ini",
        output="floor.h5",
        contact__rebound_floor=f"{floor!r} m/s",
        balls__count=count,
        balls__diameter=f"{diameter!r} m",
        run__time=f"{TIME} s",
        run__sample_from=f"{FROM} s",
        run__seed=seed,
        output__impacts="statistics",
    )
    row = round(FROM / 1e-3)
    with h5py.File(path) as f:
        fast = sum(f[f"observables/fast_collisions/{kind}/value"][:] for kind in ("ball_ball", "ball_jar"))
        fast = (fast[-1].astype(float) - fast[row]) / (TIME - FROM)
        whole = f["statistics/impacts/all"]
        return [f["statistics/drive/power"][()], f["observables/kinetic_energy/value"][row:].mean(),
                whole["normal_speed/median_above_floor"][()], fast[0], fast[1], whole["rate"][()],
                f["run/cpu_time"][()] / TIME]  # fmt: skip


def check(case):
    """The table, for figures and README: charge -> floor, column -> mean and its error."""
    told = {}
    for name, (count, diameter) in CHARGES.items():
        rows = np.array([[run(case, floor, count, diameter, seed) for seed in SEEDS] for floor in FLOORS])
        told[name] = np.array([[mean(column) for column in row.T] for row in rows])
        lowest, usual = told[name][0], told[name][FLOORS.index(USUAL)]
        for column, band in ((0, 0.05), (1, 0.05), (4, 0.05)):
            error = np.hypot(lowest[column, 1], usual[column, 1]) / lowest[column, 0]
            case.claim(
                f"planetary mill, {name}: {COLUMNS[column]} with a rebound floor of 50 mm/s, ratio to that with 5 mm/s",
                usual[column, 0] / lowest[column, 0],
                1,
                band,
                against="the floor must not affect it",
                error=error,
            )
    return told


def table(told):
    """Lines of Markdown."""
    lines = [
        "| balls | floor | " + " | ".join(COLUMNS) + " |",
        "| --- |" + " --- |" * (len(COLUMNS) + 1),
    ]
    for name, rows in told.items():
        for floor, row in zip(FLOORS, rows):
            cells = [f"{v:.3g} +- {e:.1g}" if k < 5 else f"{v:.2g}" for k, (v, e) in enumerate(row)]
            lines.append(f"| {name} | {floor:g} m/s | " + " | ".join(cells) + " |")
    return lines


def main():
    """Prints the table of the README."""
    import pathlib
    import tempfile

    import ladder

    with tempfile.TemporaryDirectory() as scratch:
        case = ladder.Case(pathlib.Path(__file__).parent, pathlib.Path(scratch))
        print("\n".join(table(check(case))))


if __name__ == "__main__":
    main()
