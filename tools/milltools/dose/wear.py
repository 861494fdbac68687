"""`mill wear`: which parts of the mill the balls wear, by part and face."""

import dataclasses
import math

import numpy as np

from milltools.base.answer import Answer
from milltools.base.text import columns, number
from milltools.read.runfile import Run
from milltools.read.wear import Wear

SUMMARY = (
    "Says which parts of the mill the balls wear: for each face of each part its area, the impacts, the power that is "
    "lost along the normal and by sliding, and with the coefficients of [wear] in the deck the depth that sliding "
    "removes (Archard) and the mass that erosion removes (Finnie). 'mill plot RUN --figure wear' draws it."
)
YEAR = 365.25 * 86400
ENOUGH = 20  # impacts on a facet, for its depth to be told, and for it to set a scale of colours
LEAST = 1e-3  # faces with a smaller share of the power are one row


@dataclasses.dataclass(frozen=True)
class Face:
    """A face of a part, or several of one name: area [m^2], impacts per second [1/s], power lost along the normal and
    by sliding [W] with errors, depth [m/s] removed by sliding wear (mean over the face) and its largest value on a
    facet with ENOUGH impacts, mass removed by erosion [kg/s]; NaN where coefficients are not known."""

    part: str
    face: str
    area: float
    rate: float
    normal: float
    normal_error: float
    sliding: float
    sliding_error: float
    depth: float
    deepest: float
    erosion: float

    @property
    def power(self) -> float:
        return self.normal + self.sliding


def faces(run: Run) -> list[Face]:
    """All faces that impacts have hit, those with the most power first."""
    wear = Wear(run)
    area = wear.area
    column = {name: wear[name] for name in ("rate", "normal_power", "sliding_power", "archard_rate", "finnie_rate")}
    error = {name: wear[f"{name}_error"] for name in ("normal_power", "sliding_power")}
    found, enough = [], wear["count"] >= ENOUGH
    for k, part in enumerate(wear.parts):
        names = {face: wear.face_name(part, face) for face in np.unique(wear.face[wear.part == k]).tolist()}
        for name in dict.fromkeys(names.values()):
            own = (wear.part == k) & np.isin(wear.face, [face for face, of in names.items() if of == name])
            if not column["rate"][own].any():
                continue
            total = {what: float(values[own] @ area[own]) for what, values in column.items()}
            squares = {what: math.sqrt(float(values[own] ** 2 @ area[own] ** 2)) for what, values in error.items()}
            size, deep = float(area[own].sum()), column["archard_rate"][own & enough]
            deepest = float(np.fmax.reduce(deep, initial=math.nan))
            powers = (total["normal_power"], squares["normal_power"], total["sliding_power"], squares["sliding_power"])
            worn = total["archard_rate"] / size, deepest, total["finnie_rate"]
            found.append(Face(wear.part_name(part), name, size, total["rate"], *powers, *worn))
    return sorted(found, key=lambda face: -face.power)


def finding(found: list[Face]) -> str:
    """A sentence: what takes most of the power, and where it is most concentrated."""
    all_power = sum(face.power for face in found)
    if not all_power > 0:
        return "no part lost energy in impacts"
    worst = max((f for f in found if f.power > LEAST * all_power), key=lambda face: face.sliding / face.area)
    first = found[0]
    return (
        f"{first.part}, {first.face}, takes {100 * first.power / all_power:.0f} % of the power that reaches the parts; "
        f"sliding is densest on {worst.part}, {worst.face}: {number(worst.sliding / worst.area / 1e3)} kW/m²"
    )


def cells(found: list[Face]) -> tuple[list[str], list[list[str]]]:
    """Heads with units, and rows of texts."""
    heads = ["part", "face", "area [cm²]", "impacts [1/s]", "normal [W]", "sliding [W]", "sliding [kW/m²]"]
    depths, eroded = (any(getattr(f, what) == getattr(f, what) for f in found) for what in ("depth", "erosion"))
    heads += ["depth [mm/year]", "deepest [mm/year]"] * depths + ["eroded [mg/h]"] * eroded
    rows = []
    for f in found:
        density, error = f.sliding / f.area / 1e3, f.sliding_error / f.area / 1e3
        row = [f.part, f.face, number(1e4 * f.area), number(f.rate), number(f.normal), number(f.sliding)]
        row.append(f"{number(density)} ± {number(error, 2)}")
        row += [number(1e3 * YEAR * f.depth), number(1e3 * YEAR * f.deepest)] * depths
        row += [number(1e6 * 3600 * f.erosion)] * eroded
        rows.append([cell.replace("?", "–") for cell in row])
    return heads, rows


def add_arguments(parser):
    parser.add_argument("run", metavar="RUN", help="output file of a run")


def run(arguments) -> Answer:
    with Run(arguments.run) as opened:
        found = faces(opened)
        said = finding(found)
    heads, rows = cells(found)
    note = "\N{PLUS-MINUS SIGN}: one standard error as if impacts were independent; the true one is larger."
    text = "\n".join([said, "", *columns([heads, *rows], left=(0, 1)), "", note])
    return Answer(
        text, {"run": arguments.run, "files": [], "finding": said, "faces": list(map(dataclasses.asdict, found))}
    )
