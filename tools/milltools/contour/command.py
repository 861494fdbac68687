"""`mill contour`: makes a contour file for a deck from a drawing, and shows contours."""

import math
import os
import pathlib
import re

import numpy as np

from milltools.base.answer import Answer
from milltools.base.errors import UserError
from milltools.base.extras import needs
from milltools.base.files import check_writable, write_text
from milltools.base.progress import say
from milltools.base.text import number, plain, plural, quantity

SUMMARY = (
    "Reads the inner face of a liner from a drawing (DXF), the curve that the balls touch, and writes it as a contour "
    "file: a row 'x y bulge' per vertex, in metres, around the axis of the drum. Lines and arcs stay exact. It says "
    "which unit, layers and axis it took, how large the curve is, and what it ignored. --draw shows the contour of a "
    "drawing or of a contour file."
)
UNITS = ("um", "mm", "cm", "m", "in", "ft")
PICTURES = (".svg", ".png", ".pdf")
MOST = 200  # arcs whose centre may be the axis
SHARED = 0.2  # of the curve are arcs whose common centre is the axis
TOLD = 5  # other loops that are named


def add_arguments(parser):
    add = parser.add_argument
    add("input", metavar="IN", help="a drawing (.dxf), or a contour file")
    add("-o", "--output", metavar="OUT.txt", help="the contour file to write")
    add("--draw", metavar="FILE", help="a picture to write: .svg, .png or .pdf")
    add("-f", "--force", action="store_true", help="overwrite existing files")
    add("--unit", choices=UNITS, help="unit of the drawing (default: $INSUNITS of the file, else $MEASUREMENT)")
    add("--layer", action="append", default=[], metavar="NAME", help="read only this layer; may be repeated")
    add("--loop", type=int, metavar="N", help="take the Nth largest closed curve (default: 1)")
    add(
        "--centre", nargs=2, type=float, metavar=("X", "Y"),
        help="the drum's axis, in the unit of the drawing (default: its origin if that is inside the curve, else the "
        "centre that its arcs share, else that of its bounding box)",
    )  # fmt: skip
    add(
        "--tolerance", metavar="LENGTH",
        help="close gaps up to this width, and replace splines and ellipses by arcs that are as near, such as "
        "'0.1 mm'; a number alone is in the unit of the drawing (default: 0.00001 of its size)",
    )  # fmt: skip
    add("--ball", metavar="DIAMETER", help="say where a ball does not fit, such as --ball '40 mm'")


def run(arguments) -> Answer:
    from milltools.geometry.contour import READ

    source, ball = arguments.input, _diameter(arguments.ball)
    outputs = [one for one in (arguments.output, arguments.draw) if one]
    if arguments.draw and pathlib.Path(arguments.draw).suffix.lower() not in PICTURES:
        raise UserError(f"{plain(arguments.draw)}: expected a name that ends in {', '.join(PICTURES)}")
    for output in outputs:
        check_writable(output, [source])
        if os.path.lexists(output) and not arguments.force:
            raise UserError(f"{plain(output)}: exists already; --force overwrites it")
    drawn = pathlib.Path(source).suffix.lower() in (".dxf", ".dwg")
    shape, lines, facts, at = (_from_drawing if drawn else _from_file)(arguments)
    lines += _size(shape, facts, at)
    if len(shape.vertices) > READ and (arguments.output or ball):
        raise UserError(
            f"{plain(source)}: the contour has {len(shape.vertices)} vertices, and millsim reads at most {READ}"
            + ": give a larger --tolerance" * drawn
        )
    places, largest = shape.narrow(ball / 2) if ball else ([], None)
    if ball:
        lines.append(_fit(ball, places, largest, at))
        narrowest = {"place": places[0, :2], "diameter": 2 * places[0, 2]} if len(places) else None
        facts |= {"ball": ball, "narrow_places": len(places), "narrowest": narrowest}
    if arguments.output:
        unit = facts["unit"]
        made = f"made by mill contour from {pathlib.Path(source).name}, unit {unit}; anticlockwise, the axis at 0 0"
        write_text(arguments.output, shape.text([made]))
        lines.append(f"{plain(arguments.output)}: {len(shape.vertices)} vertices")
    if arguments.draw:
        from milltools.contour import picture
        from milltools.figures import base, style

        style.save(picture.draw(shape, pathlib.Path(source).name, ball), arguments.draw, 200, base.LOOK)
        lines.append(f"{plain(arguments.draw)}: the contour")
    return Answer("\n".join(lines), {"files": outputs} | facts)


def _length(text):
    """(number, its unit or "") of a text such as '40 mm'; the number is nan in another text."""
    parts = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-z]*)\s*", text)
    try:
        return (float(parts[1]), parts[2]) if parts and parts[2] in ("", *UNITS) else (math.nan, "")
    except ValueError:
        return math.nan, ""


def _diameter(text):
    from milltools.contour.drawing import UNITS as SIZES

    if text is None:
        return None
    value, unit = _length(text)
    if not (unit and 0 < value < math.inf):
        raise UserError(f"--ball {plain(text)}: expected a diameter with its unit, such as '40 mm'")
    over, under = SIZES[unit]
    return value * over / under


def _from_file(arguments):
    """(contour, lines, facts, how to tell a place) of a contour file."""
    from milltools.geometry.contour import Contour

    for name in ("output", "unit", "layer", "loop", "centre", "tolerance"):
        if getattr(arguments, name) not in (None, []):
            raise UserError(f"--{name} is for a drawing (.dxf): {plain(arguments.input)} is read as a contour file")
    shape = Contour.read(arguments.input)
    _refuse_crossings(arguments.input, shape, place_in_metres)
    begin = f"warning: {plain(arguments.input)}: millsim refuses it"
    if shape.clockwise:
        mend = "list its vertices in the other order, each with the negative bulge of the one before it"
        say("mill contour", f"{begin}, for it is clockwise: {mend}")
    if shape.gap([(0.0, 0.0)])[0] <= 0:
        say("mill contour", f"{begin} as the wall of a drum, for the axis, 0 0, is not inside of it: move the contour")
    return shape, [], {"unit": "m", "vertices": len(shape.vertices)}, place_in_metres


def place_in_metres(point):
    return f"({point[0]:.6g}, {point[1]:.6g}) m"


def _refuse_crossings(source, shape, at):
    crossings = shape.crossings()
    if len(crossings):
        more = f" (and at {len(crossings) - 1} more places)" if len(crossings) > 1 else ""
        raise UserError(f"{plain(source)}: the curve crosses or touches itself at {at(crossings[0])}{more}")


def _from_drawing(arguments):
    """(contour, lines, facts, how to tell a place) of a drawing."""
    needs("contour")
    from milltools.contour import drawing
    from milltools.geometry.contour import Contour

    source, loop = arguments.input, 1 if arguments.loop is None else arguments.loop
    tolerance = None if arguments.tolerance is None else _length(arguments.tolerance)
    if loop < 1:
        raise UserError(f"--loop {loop}: expected 1, which is the largest closed curve, or more")
    if tolerance and not 0 <= tolerance[0] < math.inf:
        raise UserError(f"--tolerance {plain(arguments.tolerance)}: expected a length, 0 or more, such as '0.1 mm'")
    if arguments.centre and not all(map(math.isfinite, arguments.centre)):
        raise UserError("--centre: expected two finite numbers")
    found = drawing.read(source, arguments.unit, arguments.layer, tolerance)
    if loop > len(found.loops):
        raise UserError(f"--loop {loop}: the drawing has {plural(len(found.loops), 'closed curve')}")
    curve, layers, gap = found.loops[loop - 1]
    unit, (over, under) = found.unit, drawing.UNITS[found.unit]
    _refuse_crossings(source, curve, lambda point: drawing.place(point, unit))
    centre, why = _axis(arguments.centre, curve)
    rows = curve.vertices.copy()
    rows[:, :2] = (rows[:, :2] - centre) * over / under
    shape = Contour(rows)

    def at(point):
        return drawing.place([x * under / over + c for x, c in zip(point, centre)], unit)

    ignored = ", ".join(f"{count} {plain(what)}" for what, count in sorted(found.ignored.items()))
    lines = [
        f"unit       {unit} ({found.unit_from})" + "; --unit gives another one" * (not arguments.unit),
        f"layer      {', '.join(sorted(map(plain, layers)))}" + (f"; ignored: {ignored}" if ignored else ""),
        f"axis       {drawing.place(centre, unit)}: {why}",
    ]
    if gap > 1e-9 * curve.size:
        lines.append(f"gaps       closed up to {number(gap)} {unit} (--tolerance {found.tolerance:.2g})")
    others = [k for k in range(len(found.loops)) if k != loop - 1]
    for k in others[:TOLD]:
        other, on, _ = found.loops[k]
        width, height = (other.box[1] - other.box[0]) * over / under
        sizes = f"{quantity(width, 'm', 4)} x {quantity(height, 'm', 4)}"
        lines.append(f"not taken  {sizes}, layer {', '.join(sorted(map(plain, on)))}: --loop {k + 1} takes it")
    if len(others) > TOLD:
        lines.append(f"           and {len(others) - TOLD} smaller ones; --layer reads one layer only")
    if arguments.loop is None:
        _doubt(found.loops)
    facts = {
        "unit": unit, "unit_from": found.unit_from, "layers": sorted(layers), "ignored": found.ignored,
        "centre": list(centre), "loops": len(found.loops), "gap": gap * over / under,
        "vertices": len(shape.vertices),
    }  # fmt: skip
    return shape, lines, facts, at


def _doubt(loops):
    """Warns where the largest curve may not be the liner."""
    curve = loops[0][0]
    finer = [k for k, (one, *_) in enumerate(loops) if len(one.vertices) > len(curve.vertices)]
    finer = [k for k in finer if loops[k][0].area > 0.01 * curve.area]
    within = [k for k in finer if _is_within(loops[k][0], curve)]
    if within:
        layer = ", ".join(sorted(map(plain, loops[within[0]][1])))
        say(
            "mill contour",
            f"warning: {plural(len(within), 'closed curve')} with more corners inside of the one that is taken: if "
            f"that is a frame or the shell, --layer {layer} or --loop {within[0] + 1} takes the liner",
        )
    liner = loops[within[0]][0] if within else curve
    alike = [one for one, *_ in loops if one is not liner and abs(one.area - liner.area) < 0.01 * liner.area]
    apart = [one for one in alike if not _is_within(one, liner) and not _is_within(liner, one)]
    if apart:
        say(
            "mill contour",
            f"warning: {len(apart) + 1} closed curves have the same area: the liner may be in pieces; draw "
            "its inner face as one closed curve, or choose one by --loop",
        )


def _is_within(one, other):
    """Whether a curve is inside of another one, or the same."""
    every = np.arange(len(one.vertices))
    return other.gap(np.concatenate([one.start, one.points(every, 0.5)])).min() > -1e-3 * other.size


def _axis(given, curve):
    """(point of the axis in the drawing, why this one)."""
    if given:
        if curve.gap([given])[0] <= 0:
            raise UserError(f"--centre {given[0]:g} {given[1]:g}: is not inside the curve")
        return tuple(given), "--centre"
    middle, of = _middle(curve)
    if curve.gap([(0.0, 0.0)])[0] > 0:
        off = math.hypot(*middle)
        far = f"; {of} is ({middle[0]:.6g}, {middle[1]:.6g})" if off > 1e-4 * curve.size else ""
        return (0.0, 0.0), f"the origin, which is inside the curve{far}; --centre gives another one"
    return middle, f"{of}, for the origin is outside; --centre gives another one"


def _middle(curve):
    """The centre that arcs share, such as those of plates, if it is inside and they are much of the curve; else that of
    the bounding box; and which one it is."""
    arcs = np.flatnonzero(curve.is_arc)
    length, centres = curve.lengths[arcs], curve.centre[arcs]
    longest = centres[np.argsort(-length)[:MOST]]
    near = np.hypot(*np.moveaxis(longest[:, None] - centres, -1, 0)) < 1e-4 * curve.size
    share = near @ length / curve.length
    if len(arcs) and share.max() > SHARED:
        own = near[share.argmax()]
        middle = length[own] @ centres[own] / length[own].sum()
        if curve.gap([middle])[0] > 0:
            return tuple(map(float, middle)), f"the centre of arcs that are {100 * share.max():.0f} % of the curve"
    return tuple(float(x) for x in curve.box.mean(axis=0)), "the centre of the bounding box"


def _size(shape, facts, at):
    width, height = shape.box[1] - shape.box[0]
    arcs, near, far = int(shape.is_arc.sum()), shape.innermost, shape.outermost
    facts |= {
        "width": width, "height": height, "area": shape.area, "length": shape.length,
        "least_radius": near, "largest_radius": far,
        "lines": len(shape.vertices) - arcs, "arcs": arcs, "smallest_radius": shape.radius.min(),
    }  # fmt: skip
    sizes = [quantity(one, "m", 5) for one in (width, height, math.sqrt(4 * shape.area / math.pi), shape.length)]
    area = f"area {number(shape.area, 5)} m² (as a circle of {sizes[2]})"
    lines = [
        f"size       {sizes[0]} x {sizes[1]}, {area}, length {sizes[3]}",
        f"radius     {quantity(near, 'm', 5)} to {quantity(far, 'm', 5)} from the axis; drum.radius: the plates'",
        f"pieces     {plural(len(shape.vertices) - arcs, 'line')}, {plural(arcs, 'arc')}",
    ]
    if arcs:
        k = int(shape.radius.argmin())
        lines[-1] += f"; smallest radius {quantity(shape.radius[k], 'm', 4)} at {at(shape.points(k, 0.5))}"
    return lines


def _fit(ball, places, largest, at):
    said = f"a ball of {quantity(ball, 'm', 4)}"
    if not len(places):
        return f"ball       {said} reaches all arcs and slots"
    count = "1000 places or more" if len(places) == 1000 else plural(len(places), "place")
    x, y, radius = places[0]
    fits = f"{at((x, y))}: {quantity(2 * radius, 'm', 4)} fits there"
    if largest is not None:
        return f"ball       {said} fits nowhere; the widest place is {fits}"
    free = "The gaps behind stay free of such balls, as usual at the foot of lifters"
    return f"ball       {said} does not fit at {count}; the narrowest is {fits}. {free}"
