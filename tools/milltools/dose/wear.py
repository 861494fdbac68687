"""`mill wear`: which parts of the mill the balls wear, by part and face."""

import dataclasses
import itertools
import math
import operator
import os
import pathlib
import textwrap
import typing

import numpy as np

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.files import check_writable, write_text
from milltools.base.progress import say
from milltools.base.text import columns, number, plain
from milltools.dose import dose, liner
from milltools.dose.liner import STEP, Liner
from milltools.read import values
from milltools.read.runfile import Run
from milltools.read.wear import PLACE, Wear

SUMMARY = (
    "Says which parts of the mill the balls wear: for each part the power that is lost along the normal and by "
    "sliding, its share, and where sliding is densest; with --faces for each face too. With the coefficients of [wear] "
    "of the deck or of -s, also the depth that sliding removes (Archard) and the mass that erosion removes (Finnie). "
    "'mill plot RUN --figure wear' draws it. Of a liner that is a contour it says where it wears; --worn writes the "
    "contour that is left."
)
YEAR = 365.25 * 86400
ENOUGH = 20  # impacts on a facet, for its depth to be told, and for it to set a scale of colours
MOST = 0.2  # of the height of a liner may go in one step, unless it is forced
LEAST = 1e-3  # faces with a smaller share of the power do not count as the densest
# what pictures show, columns of the file: words, unit, and how many of this unit are 1 SI
SHOWN = {
    "sliding_power": ("power lost by sliding", "kW/m²", 1e-3),
    "normal_power": ("power lost along the normal", "kW/m²", 1e-3),
    "archard_rate": ("depth of sliding wear", "mm/year", 1e3 * YEAR),
}
COEFFICIENTS = ("archard", "hardness", "erosion")
SUCH_AS = "-s wear.archard=1e-4 -s 'wear.hardness=2 GPa'"


@dataclasses.dataclass(frozen=True)
class Face:
    """A face of a part, several of one name, or all of a part: area [m^2], impacts per second [1/s], power lost along
    the normal and by sliding [W], the largest power lost by sliding per area [W/m^2] of a facet with ENOUGH
    impacts (peak), depth [m/s] removed by sliding wear (mean over the face) and its largest value on such a facet, mass
    removed by erosion [kg/s]; NaN where coefficients are not known."""

    part: str
    face: str
    area: float
    rate: float
    normal: float
    sliding: float
    depth: float
    deepest: float
    peak: float
    erosion: float

    @property
    def power(self) -> float:
        return self.normal + self.sliding

    @property
    def density(self) -> float:
        """Power lost by sliding, per area [W/m^2]."""
        return self.sliding / self.area


def faces(run: Run, sets: typing.Sequence[str] = ()) -> list[Face]:
    """All faces that impacts have hit, those with the most power first; `sets`: "SECTION.KEY=VALUE" of [wear]."""
    wear = Wear(run)
    area = wear.area
    column = {name: wear[name] for name in ("rate", "normal_power", "sliding_power", "archard_rate", "finnie_rate")}
    if sets:
        _recompute(wear, column, sets)
    found, enough = [], wear["count"] >= ENOUGH
    for k, part in enumerate(wear.parts):
        names = {face: wear.face_name(part, face) for face in np.unique(wear.face[wear.part == k]).tolist()}
        for name in dict.fromkeys(names.values()):
            own = (wear.part == k) & np.isin(wear.face, [face for face, of in names.items() if of == name])
            if not column["rate"][own].any():
                continue
            total = {what: float(values[own] @ area[own]) for what, values in column.items()}
            size, deep = float(area[own].sum()), column["archard_rate"][own & enough]
            deepest = float(np.fmax.reduce(deep, initial=math.nan))
            peak = float(column["sliding_power"][own & enough].max(initial=0.0))
            powers = total["normal_power"], total["sliding_power"]
            worn = total["archard_rate"] / size, deepest, peak, total["finnie_rate"]
            found.append(Face(wear.part_name(part), name, size, total["rate"], *powers, *worn))
    return sorted(found, key=lambda face: -face.power)


def _recompute(wear: Wear, column: dict[str, np.ndarray], sets: typing.Sequence[str]) -> None:
    """Sets the depths and masses of `column` to those with other coefficients. UserError where nothing can be told."""
    kinds = list(dict.fromkeys(part.kind for part in wear.parts))
    kind_of, laws = np.array([kinds.index(part.kind) for part in wear.parts])[wear.part], coefficients(wear, sets)
    slid, carved = wear["slid_power"], wear["carved_power"]
    for k, kind in enumerate(kinds):
        own, (archard, erosion) = kind_of == k, laws[kind]
        column["archard_rate"][own] = archard * slid[own]
        column["finnie_rate"][own] = erosion * carved[own]
    if not (np.isfinite(column["archard_rate"]).any() or np.isfinite(column["finnie_rate"]).any()):
        raise UserError(f"{wear.run.path}: no depth: it needs wear.archard, wear.hardness and a friction above 0")


def coefficients(wear: Wear, sets: typing.Sequence[str]) -> dict[str, tuple[float, float]]:
    """(depth per work [m^3/J] of Archard's law, mass per energy [kg/J] of Finnie's) of each kind of contact of the
    parts, from the deck and "SECTION.KEY=VALUE" of [wear]; NaN where coefficients are not known."""
    deck, kinds = wear.run.as_deck, list(dict.fromkeys(part.kind for part in wear.parts))
    base, asked, found = deck.sections.get("wear", {}), dose.given(sets, ("wear",)), {}
    for section, _, _ in asked:
        if section != "wear" and section.removeprefix("wear.") not in kinds:
            raise UserError(f"[{section}]: no part of this mill has this kind of contact: one of {', '.join(kinds)}")
    if not wear.run.has(f"{PLACE}/slid_power"):
        raise UserError(f"{wear.run.path}: an older version wrote it: run the deck again with the coefficients")
    for kind in kinds:
        law = {}
        for key in COEFFICIENTS:
            text = deck.sections.get(f"wear.{kind}", {}).get(key)
            # the file does not tell what a section of a kind had from [wear]: what is equal
            follows = [f"wear.{kind}"] if text not in (None, base.get(key)) else ["wear", f"wear.{kind}"]
            changes = [float(value) for place in follows for at, of, value in asked if (at, of) == (place, key)]
            law[key] = (float((text or base.get(key) or "0").split()[0]), *changes)[-1]
        if bool(law["archard"]) != bool(law["hardness"]):
            other = ("wear.archard=1e-4", "'wear.hardness=2 GPa'")[law["archard"] > 0]
            raise UserError(f"{wear.run.path}: the depth needs both wear.archard and wear.hardness: add -s {other}")
        resists = law["hardness"] * deck.contact(kind).friction
        found[kind] = law["archard"] / resists if resists else math.nan, law["erosion"] or math.nan
    return found


# ---- the contour that is left


def depth_rate(found: Liner, sets: typing.Sequence[str] = (), density: float = math.nan) -> np.ndarray:
    """(bins,) depth removed per time [m/s] along a period of the contour, by sliding wear and, with the density
    [kg/m^3] of the liner, by erosion; NaN without coefficients."""
    archard, erosion = coefficients(Wear(found.run), sets)[found.run.vessel_kinds[0]]
    slides, carves = archard * found.density("slid"), erosion / density * found.density("carved")
    return np.where(np.isfinite(slides) & np.isfinite(carves), slides + carves, np.fmax(slides, carves))


def worn_after(found: Liner, arguments) -> tuple[np.ndarray, float]:
    """Depths [m] (bins,) after the time, or with the share of the height removed, that the options ask for; and this
    time [s], NaN if coefficients are missing."""
    density = values.tell([f"balls.density={arguments.density}"])[0].value if arguments.density else math.nan
    rate = depth_rate(found, arguments.set, density)
    known = bool(np.isfinite(rate).all() and rate.any())
    if arguments.after is not None:
        (time,) = values.seconds({"--after": arguments.after})
        if not known:
            raise UserError(
                f"{found.run.path}: no depth after a time without coefficients: add {SUCH_AS} (for erosion "
                "-s 'wear.erosion=1e-12 kg/J' --density '7.8 g/cm^3'), or give --removed '5 %' in place of --after"
            )
        return rate * time, time
    share = _share(arguments.removed)
    if not found.height > 1e-6 * found.contour.size:
        raise UserError(f"{found.run.path}: --removed: a circle has no height: give --after '1000 h'")
    depth = found.scaled(rate if known else found.density("slid"), share * found.height)
    return depth, float(depth.sum() / rate.sum()) if known else math.nan


def _share(text: str) -> float:
    """--removed."""
    try:
        (one,) = values.tell([f"balls.fill={text}"])
    except UserError:
        raise UserError(f"--removed: expected a share such as '5 %', got '{plain(text)}'") from None
    return float(one.value)


def wear_out(found: Liner, arguments) -> tuple[str, dict]:
    """Writes the contour that is left to --worn; what it says, and the facts."""
    depth, time = worn_after(found, arguments)
    left, largest = found.worn(depth), float(found.smoothed(depth).max())
    share, steps = (largest / found.height, math.ceil(largest / found.height / STEP)) if found.height else (0.0, 1)
    much = (
        f"{100 * share:.0f} % of the height of the liner go in one step, and its shape changes what the balls do: make "
        f"{steps} steps, each with a run of its own ('mill sweep' with [life] does it: input/liner-life.study)"
    )
    if share > MOST and not arguments.force:
        raise UserError(f"--worn: {much}, or --force")
    removed = left.area - found.contour.area
    when = f" after {number(time / 3600)} h" if time == time else ""
    reads = f"body.{found.run.vessel}.file" if found.run.vessel else "drum.profile = file"
    made = f"mill wear {pathlib.Path(found.run.path).name}: the contour{when}"
    write_text(arguments.worn, left.text([plain(made)]))
    said = (
        f"{plain(arguments.worn)}: the contour{when}, {len(left.vertices)} vertices; {number(1e6 * removed)} mm² "
        f"removed, at most {number(1e3 * largest)} mm deep{found.loose(depth, left)}. {reads} reads it."
    )
    said += f" {much}." * (share > STEP)
    facts = {"time": time, "removed_area": removed, "largest_depth": largest, "height": found.height, "steps": steps}
    return said, facts


def parts(found: list[Face]) -> list[tuple[Face, Face]]:
    """(the sum of its faces, its face where sliding is densest) of each part, those with the most power first."""
    done = []
    for name, own in itertools.groupby(sorted(found, key=lambda f: f.part), operator.attrgetter("part")):
        own = list(own)
        whole = _joined(name, own)
        some = [f for f in own if f.power > LEAST * whole.power]
        done.append((whole, max(some or own, key=lambda f: f.density)))
    return sorted(done, key=lambda pair: -pair[0].power)


def _joined(name: str, own: list[Face]) -> Face:
    """Several faces as one."""
    add = {key: sum(getattr(f, key) for f in own) for key in ("area", "rate", "normal", "sliding", "erosion")}
    depth = sum(f.depth * f.area for f in own) / add["area"] if own else math.nan
    deepest = float(np.fmax.reduce([f.deepest for f in own], initial=math.nan))
    return Face(name, "", **add, depth=depth, deepest=deepest, peak=max((f.peak for f in own), default=0.0))


def scalars(run: Run) -> dict[str, tuple[float, float, str]]:
    """{path: (value, standard error (not known), unit)} of the parts of each kind of contact and of all, as studies
    keep them: "wear/ball_lifter/depth". Depth and erosion are there if the deck has coefficients."""
    wear, found, told = Wear(run), faces(run), {}
    kinds = {wear.part_name(part): part.kind for part in wear.parts}
    laws = [keys for name, keys in run.as_deck.sections.items() if name.partition(".")[0] == "wear"]
    known = {key: any(float(keys.get(key, "0").split()[0]) for keys in laws) for key in COEFFICIENTS}
    units = {"normal": "W", "sliding": "W", "peak": "W/m2"}
    units |= {"depth": "m/s", "deepest": "m/s"} if known["archard"] and known["hardness"] else {}
    units |= {"erosion": "kg/s"} if known["erosion"] else {}
    for kind in [*dict.fromkeys(kinds.values()), "all"]:
        whole = _joined(kind, [face for face in found if kind in ("all", kinds[face.part])])
        told |= {f"wear/{kind}/{name}": (getattr(whole, name), math.nan, unit) for name, unit in units.items()}
    return told


def finding(found: list[Face]) -> str:
    """A sentence: what takes most of the power, and where it is most concentrated."""
    all_power = sum(face.power for face in found)
    if not all_power > 0:
        return "no part lost energy in impacts"
    worst = max(found, key=lambda face: face.peak)
    first = found[0]
    said = (
        f"{first.part}, {first.face}, takes {100 * first.power / all_power:.0f} % of the power that reaches the parts"
    )
    if not worst.peak > 0:
        return said  # too few impacts on each spot
    return f"{said}; sliding is densest at a spot of {worst.part}, {worst.face}: {number(worst.peak / 1e3)} kW/m²"


def _worn(found: list[Face]) -> tuple[list[str], list[list[str]]]:
    """Heads and cells of what coefficients tell; no columns without them."""
    depths, eroded = (any(getattr(f, what) == getattr(f, what) for f in found) for what in ("depth", "erosion"))
    heads = ["depth [mm/year]", "deepest [mm/year]"] * depths + ["eroded [mg/h]"] * eroded
    row = lambda f: [1e3 * YEAR * f.depth, 1e3 * YEAR * f.deepest] * depths + [1e6 * 3600 * f.erosion] * eroded  # noqa: E731
    return heads, [list(map(_short, row(f))) for f in found]


def _short(value: float) -> str:
    return "<0.001" if 0 < value < 1e-3 else number(value).replace("?", "–")


def cells(found: list[Face]) -> tuple[list[str], list[list[str]]]:
    """Heads with units, and rows of texts, of faces."""
    more, worn = _worn(found)
    heads = ["part", "face", "area [cm²]", "impacts [1/s]", "normal [W]", "sliding [W]", "sliding [kW/m²]", *more]
    numbers = ((1e4 * f.area, f.rate, f.normal, f.sliding, f.density / 1e3) for f in found)
    return heads, [[f.part, f.face, *map(_short, n), *w] for f, n, w in zip(found, numbers, worn)]


def sums(found: list[Face]) -> tuple[list[str], list[list[str]]]:
    """Heads with units, then rows of texts, of parts."""
    pairs = parts(found)
    more, worn = _worn([whole for whole, _ in pairs])
    power = sum(face.power for face in found) or 1.0
    heads = ["part", "normal [W]", "sliding [W]", "share [%]", "densest [kW/m²]", *more]
    numbers = ((f.normal, f.sliding, 100 * f.power / power, top.density / 1e3) for f, top in pairs)
    return heads, [[f.part, *map(_short, n), *w] for (f, _), n, w in zip(pairs, numbers, worn)]


def _table(heads, *rows, left) -> list[str]:
    """Lines of a table, the units below the heads."""
    names, units = zip(*(head.rstrip("]").partition(" [")[::2] for head in heads))
    return columns([names, units, *rows], left)


def add_arguments(parser):
    parser.add_argument("run", metavar="RUN", help="output file of a run")
    parser.add_argument("--faces", action="store_true", help="print the faces of the parts too")
    parser.add_argument(
        "-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
        help="a value of [wear] for this run, such as wear.archard=1e-4 or 'wear.hardness=2 GPa'; may be repeated",
    )  # fmt: skip
    add = parser.add_argument
    add("--worn", metavar="NEXT.txt", help="write the contour of the liner that is left: lines and arcs")
    add("--after", metavar="TIME", help="with --worn: after so much time, such as '1000 h'; needs coefficients")
    add("--removed", metavar="SHARE", help="with --worn: when the tops have lost this share of the height, as '5 %%'")
    add("--density", metavar="DENSITY", help="of the liner, with which erosion removes a depth, such as '7.8 g/cm^3'")
    add("-f", "--force", action="store_true", help="overwrite an existing file; wear much in one step")


def check(arguments):
    """UserError for options that do not fit together, or a file that would be overwritten."""
    given = [name for name in ("after", "removed") if getattr(arguments, name)]
    if arguments.worn is None and (given or arguments.density):
        raise UserError(f"--{(given or ['density'])[0]}: only with --worn NEXT.txt")
    if arguments.worn is None:
        return
    if len(given) != 1:
        raise UserError("--worn: expected one of --after '1000 h' and --removed '5 %'")
    check_writable(arguments.worn, [arguments.run])
    if os.path.lexists(arguments.worn) and not arguments.force:
        raise UserError(f"{plain(arguments.worn)}: exists already; --force overwrites it")


def lining(run: Run) -> list[tuple[str, dict]]:
    """Sentences about the liner, with their facts: along its contour, then around the axis of a mill that tumbles."""
    found, along = [], liner.why_not(run) is None and Liner(run)
    if along:
        facts = {"shares": along.shares("slid"), "hits": along.shares("normal"), "lifters": along.lifters}
        found.append((f"{along.finding()}.", facts | {"height": along.height, "parts": along.parts}))
    if liner.why_no_turn(run) is None:
        turn = liner.Turn(run, along.lifters if along else liner.bars(run))
        found.append((turn.finding(), turn.facts()))
    return found


def run(arguments) -> Answer:
    check(arguments)
    with Run(arguments.run) as opened:
        found, about = faces(opened, arguments.set), lining(opened)
        left = [wear_out(Liner(opened), arguments)] if arguments.worn else []
        for note in opened.notes:
            say("mill wear", f"note: {note}")
    said, pairs, (heads, rows) = finding(found), parts(found), sums(found)
    text = [*textwrap.wrap(said, 80), "", *_table(heads, *rows, left=(0,)), ""]
    if arguments.faces:
        heads, rows = cells(found)
        text += [*_table(*([*row[:2], *row[4:]] for row in (heads, *rows)), left=(0, 1)), ""]  # within 80 columns
    else:
        text += ["--faces prints the faces of each part."]
    text += ["densest: power lost by sliding, per area, mean of the face where it is highest."]
    if not any(face.depth == face.depth for face in found):
        text += [f"For depths add coefficients: {SUCH_AS}"]
    for sentence in [f"{said[0].upper()}{said[1:]}" for said, _ in about] + [said for said, _ in left]:
        text += ["", *textwrap.wrap(sentence, 80)]
    power = sum(face.power for face in found) or 1.0
    results = {"faces": list(map(dataclasses.asdict, found)), "parts": [
        dataclasses.asdict(whole) | {"share": whole.power / power, "densest_face": top.face, "densest": top.density}
        for whole, top in pairs
    ], "liner": {key: value for _, facts in about for key, value in facts.items()}}  # fmt: skip
    results |= {"worn": left[0][1]} if left else {}
    files = [arguments.worn] if left else []
    return Answer("\n".join(text), {"run": arguments.run, "files": files, "finding": said, **results})
