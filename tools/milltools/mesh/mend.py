"""Leads the steps of `mill mesh`, and says what they changed."""

import dataclasses
import functools
import re

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import plain, plural
from milltools.mesh import judge, solids, unclosed
from milltools.mesh.parts import METRES, SHORT, check_count, single
from milltools.mesh.read import read
from milltools.mesh.surface import Changes, Surface
from milltools.mesh.unclosed import OUT, place

HOLE, WELD = 0.05, 1e-5  # over the largest dimension of a file, as the help of --hole and --weld says
MOST_TOLD = 20  # faults, shells
# How solids are united, the first that millsim accepts: they grow by this much, so that solids that just do not touch,
# because of rounding, do; and surfaces may move by this much, so that no tiny facets stay. Over the largest coordinate.
FORMS = ((0.0, 0.0), (0.0, 1e-6), (1e-6, 1e-6), (1e-6, 1e-5), (5e-6, 2e-5), (0.0, 1e-4))


@dataclasses.dataclass
class Mended:
    corners: np.ndarray  # (M, 3, 3)
    unit: str  # "" if it is not known
    lines: list[str]  # what was changed
    result: str  # what the file contains
    facts: dict


def mended(arguments, progress) -> Mended:
    """Reads and mends files; a UserError that lists the faults of what cannot be mended."""
    files, unit = _read(arguments, progress)
    lines = [f"{plain(one.path)}: {note}" for one in files for note in one.notes]
    shells, changes, faults = [], [], []
    for one in files:
        progress(f"mending {plain(one.path)}")
        its, change, wrong = _closed(one, arguments, progress)
        shells.append(its)
        changes.append(change)
        faults += [f"{plain(one.path)}: {line}" for line in wrong]
    if faults:
        raise UserError(_first(faults))
    for one, its, change in zip(files, shells, changes):
        lines += [f"{plain(one.path)}: {line}" for line in _told(change)]
        empty = [shell for shell in its if shell.is_empty]
        if empty:
            count = sum(len(shell.facets) for shell in empty)
            lines.append(f"{plain(one.path)}: {plural(len(empty), 'shell')} without volume left out: {count} facets")
            its[:] = [shell for shell in its if not shell.is_empty]
    every = [shell for its in shells for shell in its]
    if not every:
        raise UserError([f"{plain(one.path)}: encloses no volume: give sheets a thickness{OUT}" for one in files])

    def step(items, text):
        for item in items:
            progress(text)
            yield item

    bodies, turned = solids.sort_out(every, step)
    if turned:
        lines.append(f"{plural(turned, 'shell')} faced inwards: turned over")
    try:
        corners, after, more = _accepted(bodies, progress)
    except UserError as fault:
        names = ", ".join(map(plain, arguments.input))
        raise UserError([f"{names}: {line}" for line in fault.lines], fault.status) from None
    rooms = sum(len(body.rooms) for body in bodies)
    before = sum(shell.volume for shell in every)
    count = sum(shell.volume > 0 for shell in after)
    if count != len(bodies) or (len(bodies) > 1 and not solids.need_uniting(bodies)):
        how = "united" if count != len(bodies) else "apart from each other, none touches another"
        lines.append(f"solids: {len(bodies)} {how}, now {count}; volume {before:.6g}, now {_volume(after):.6g}")
    if rooms or any(shell.volume < 0 for shell in after):
        inner = [shell for shell in after if shell.volume < 0]
        volume = -sum(shell.volume for shell in inner) + 0.0
        lines.append(f"{plural(len(inner), 'closed room')} within the solids, of {volume:.6g} in all")
    lines += more or (["nothing to mend"] if not lines else [])
    return _answer(arguments, unit, lines, corners, after, before, changes, turned)


def _read(arguments, progress):
    """The files, all in one unit, and its name."""
    files, total = [], 0
    for path in arguments.input:
        progress(f"reading {plain(path)}")
        files.append(read(path))
        total += files[-1].count
        check_count(path, total)
    own = [one.unit for one in files if one.unit]
    unit = METRES[arguments.unit] if arguments.unit else own[0] if own else None
    for one in files:
        if one.unit and one.unit != unit:
            one.notes.append(f"converted from {SHORT[one.unit]} to {SHORT[unit]}")
            for part in one.parts:
                part.points = single(one.path, part.points * (one.unit / unit))
        elif own and not one.unit:
            one.notes.append(f"has no unit: taken to be in {SHORT[unit]}")
    return files, SHORT[unit] if unit else ""


def _closed(one, arguments, progress):
    """(shells, changes, faults) of a file. A part that is closed by itself is a surface of its own; the others belong
    together, as some programs write each face as a part."""
    low = np.min([part.points.min(axis=0) for part in one.parts], axis=0)
    high = np.max([part.points.max(axis=0) for part in one.parts], axis=0)
    ends = np.quantile(np.concatenate([part.points for part in one.parts]), (0.01, 0.99), axis=0)
    # a few corners far from all others, of a damaged file, must not make all tolerances large
    size = min(float((high - low).max()), 10.0 * float((ends[1] - ends[0]).max()))
    hole = HOLE * size if arguments.hole is None else arguments.hole
    weld = WELD * size if arguments.weld is None else arguments.weld
    alone, pooled = [], []
    for part in one.parts:
        surface = Surface(part.points, part.facets)
        (alone if (surface.edges()[2] == 2).all() else pooled).append(surface)
    if pooled:
        begins = np.cumsum([0, *(len(surface.points) for surface in pooled)])
        facets = np.concatenate([surface.facets + begin for surface, begin in zip(pooled, begins)])
        alone.append(Surface(np.concatenate([surface.points for surface in pooled]), facets))
    shells, changes, faults = [], Changes(), []
    for surface in alone:
        surface.close(weld, hole, functools.partial(progress, f"mending {plain(one.path)}"))
        wrong = unclosed.faults(surface)
        faults += wrong
        changes.add(surface.changes)
        if not wrong and len(surface.facets):
            shells += solids.shells_of(surface)
    return shells, changes, faults


def _accepted(bodies, progress, what="it"):
    """(corners, shells, lines) of what the solids fill together, in the first form that millsim accepts; else a
    UserError with the faults of a single solid as it is, or of the form of several that has the fewest."""
    faults, reach = [], max(float(abs(body.points).max()) for body in bodies)
    tries = len(FORMS) + (not solids.need_uniting(bodies))
    for k, (shells, moved, wrong) in enumerate(_forms(bodies, reach, progress), 1):
        if not wrong:
            corners = np.concatenate([shell.corners() for shell in shells])
            text = f"checking that millsim accepts {what}, try {k} of {tries}"
            progress(text)
            wrong = judge.complaints(corners, functools.partial(progress, text))
        if not wrong:
            return corners, shells, [f"surfaces moved by up to {moved:.3g}, so that no facets cross"] if moved else []
        if not faults or (len(bodies) > 1 and _count(wrong) < _count(faults)):
            faults = wrong
        for number, body in enumerate(bodies if k == 1 < len(bodies) else [], 1):
            # one that crosses itself is told here: no form of all would help
            _accepted([body], progress, f"solid {number} of {len(bodies)}")
    if len(bodies) == 1:
        raise UserError([*_first(faults), f"this solid crosses or touches itself: mend it{OUT}"])
    why = "millsim accepts each of the solids, but not what they fill together, whose faults these are"
    raise UserError([*_first(faults), f"{why}: unite them{OUT}"])


def _forms(bodies, reach, progress):
    """The shells of what the solids fill together: as they are if no two can touch, else united, see FORMS. (shells,
    how far surfaces may have moved, faults)"""
    if not solids.need_uniting(bodies):
        yield [shell for body in bodies for shell in (body, *body.rooms)], 0.0, []
    wholes = {}
    for grow, share in FORMS:
        progress("uniting solids")
        if grow not in wholes:
            wholes[grow] = solids.united(bodies, grow * reach, progress)
        surface = Surface(*solids.facets_of(wholes[grow], share * reach))
        surface.close(1e-7 * reach, 0.0, functools.partial(progress, "uniting solids"))
        wrong = [line.split(": ")[0] for line in unclosed.faults(surface)]
        wrong += ["uniting the solids leaves nothing"] * (not len(surface.facets))
        shells = [] if wrong else [one for one in solids.shells_of(surface) if not one.is_empty]
        moved = (grow + share) * reach
        if not wrong:
            _check_volume(bodies, shells, 3 * moved)
        yield shells, moved, wrong


def _check_volume(bodies, shells, moved):
    """What solids fill together is at least the largest of them, and at most their sum."""
    own = [body.volume + sum(room.volume for room in body.rooms) for body in bodies]
    slack = 1e-5 * sum(body.volume for body in bodies) + moved * sum(body.area for body in bodies)
    if not max(own) - slack <= _volume(shells) <= sum(body.volume for body in bodies) + slack:
        raise UserError(
            f"uniting failed: the solids of {sum(own):.6g} in all would fill {_volume(shells):.6g}: unite them{OUT}"
        )


def _volume(shells) -> float:
    return sum(shell.volume for shell in shells)


def _first(faults):
    more = _count(faults) - MOST_TOLD
    return faults[:MOST_TOLD] + [f"and {plural(more, 'more fault')}"] * (more > 0)


def _count(faults):
    """How many there are: a line of millsim stands for those that it does not tell."""
    many = (re.match(r"(\d+)(?: or)? more faults?$", line) for line in faults)
    return sum(int(found[1]) if found else 1 for found in many)


def _told(change: Changes):
    """A line for each change."""
    if change.dropped:
        yield f"{plural(change.dropped, 'facet')} without area taken out"
    if change.doubled:
        yield f"{plural(change.doubled, 'facet')} dropped that {'was' if change.doubled == 1 else 'were'} there twice"
    if change.welded:
        yield f"{plural(change.welded, 'corner')} welded, up to {change.apart:.3g} apart"
    if change.split:
        yield f"{plural(change.split, 'side')} split at corners that lay on {'it' if change.split == 1 else 'them'}"
    if change.turned:
        yield f"{plural(change.turned, 'facet')} turned to face as the others around"
    if change.walls:
        yield f"{plural(change.walls, 'facet')} of walls within the solid dropped"
    if change.fins:
        yield f"{plural(change.fins, 'facet')} dropped of small sheets that stuck out"
    for across, sides in change.holes[:MOST_TOLD]:
        yield f"a hole of {sides} sides closed, {across:.3g} across"
    if len(change.holes) > MOST_TOLD:
        yield f"{plural(len(change.holes) - MOST_TOLD, 'more hole')} closed"


def _answer(arguments, unit, lines, corners, after, before, changes, turned) -> Mended:
    for shell in after[:MOST_TOLD] if len(after) > 1 else []:
        kind = "solid" if shell.volume > 0 else "room"
        lines.append(f"{kind} around {place((shell.low + shell.high) / 2)}: volume {abs(shell.volume):.6g}")
    if len(after) > MOST_TOLD:
        lines.append(f"and {plural(len(after) - MOST_TOLD, 'more shell')}")
    volume = _volume(after)
    extent = np.ptp(corners, axis=(0, 1))
    across = " x ".join(f"{one:.5g}" for one in extent)
    told = f" {unit}; in the deck: unit = {unit}" if unit else "; the file does not know its unit: set it in the deck"
    facts = {
        "facets": len(corners), "volume": volume, "volume_before": before, "size": extent, "unit": unit or None,
        "shells": [shell.volume for shell in after], "turned_shells": turned,
        "changes": [
            {field.name: getattr(one, field.name) for field in dataclasses.fields(one)} | {"file": path}
            for path, one in zip(arguments.input, changes)
        ],
    }  # fmt: skip
    result = f"{plural(len(corners), 'facet')}, volume {volume:.6g}, {across}{told}"
    return Mended(corners, unit, lines, result, facts)
