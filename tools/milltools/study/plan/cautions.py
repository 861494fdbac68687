"""What the designs of a study change or lose without a word, one sentence each, with its mend: copies of a body in the
same place, or no longer around the whole circle, and the ratio of two speeds of a motion that carries another one."""

import itertools
import math
import re

from milltools.base.text import plural

# so near is the same place: 0.36 degrees, as typed angles have few digits (7 times 51.4 degrees are 359.8); and less
# than a tenth of the angle between neighbours, which are apart however close they are
SAME = 1e-3  # of a turn
MOST = 2000  # designs that are looked at


def cautions(study) -> list[str]:
    """For a study_deck.Study."""
    return [*_places(study), *_ratios(study)]


def _designs(study, keys):
    """Designs with all combinations of the values (of a range without values: its ends) that the varied keys take from
    which these keys follow."""
    roots = set().union(*map(study.formulas.roots, keys))
    values = [(r.values or (r.low, r.high)) if r.key in roots else [(r.values or (r.low,))[0]] for r in study.vary]
    for found in itertools.islice(itertools.product(*values), MOST):
        yield dict(zip((r.key for r in study.vary), found))


def _value(study, key, design, preset):
    """The value of a key [SI] in a design."""
    if study.formulas.roots(key) or key in study.formulas.derived:
        return study.formulas.look(design)(key).value
    return study.base[key].value if key in study.base else preset


def _places(study):
    """Copies that are turned by a whole turn, without a shift, are in the place of others. The container has none."""
    keys = dict.fromkeys([*study.base, *study.varied, *study.formulas.derived])
    for body in [key.removesuffix(".copies") for key in keys if key.startswith("body.") and key.endswith(".copies")]:
        copies, turn, shift = (f"{body}.{name}" for name in ("copies", "turn_by", "shift_by"))
        side, shifts = study.base.get(f"{body}.side"), study.base.get(shift)
        moved = any(key.startswith(shift) for key in [*study.varied, *study.formulas.derived])
        if (side and side.value == "inside") or moved or (shifts and any(map(float, shifts.value.split()))):
            continue
        pairs = [
            (round(_value(study, copies, one, 1)), _value(study, turn, one, 0.0))
            for one in _designs(study, (copies, turn))
        ]
        said = _doubled(copies, turn, pairs) or _open(study, copies, turn, pairs)
        if said:
            yield f"{said}; for copies around the whole circle write '{_mend(study, copies, turn)}' into [set]"


def _told(copies, turn, count, angle):
    return f"{copies} = {count} with {turn} = {math.degrees(angle):.6g} deg"


def _doubled(copies, turn, pairs) -> str:
    """Of the first angle at which most copies are too many."""
    most = max(count for count, _ in pairs)
    for count, angle in pairs:
        turns = angle / math.tau
        same = min(SAME, abs(turns) / 10)
        places = next((k for k in range(1, count) if abs(k * turns - round(k * turns)) <= same), count)
        if count == most and places < count:
            twice = f"only {plural(places, 'place')}, so {count - places} of the copies are where others are already"
            return f"{_told(copies, turn, count, angle)}: {twice}"
    return ""


def _open(study, copies, turn, pairs) -> str:
    """Where the copies of the base deck are evenly around the circle, and a study changes only their number or only
    the angle: the first design that leaves a part of it."""
    own = [study.original.get(key) for key in (copies, turn)]
    if not all(own) or abs(abs(own[0].value * own[1].value) / math.tau - 1) > SAME:
        return ""
    if all(_chosen(study, value) for value in own):
        return ""
    for count, angle in pairs:
        if abs(abs(count * angle) / math.tau - 1) > SAME:
            around = f"{count} times this angle are {math.degrees(abs(count * angle)):.6g} deg"
            return f"{_told(copies, turn, count, angle)}: {around}, and in the base deck 360 deg"
    return ""


def _chosen(study, own) -> bool:
    """Whether a study varies or sets a key of the base deck."""
    varied = study.formulas.roots(own.key) or own.key in study.formulas.derived
    return bool(varied) or study.base.get(own.key) != own


def _mend(study, copies, turn) -> str:
    """The key that follows from the one that is varied."""
    if study.formulas.roots(turn) and not study.formulas.roots(copies):
        return f"{copies} = 360 deg / {turn}"
    sign = "-" * (_value(study, turn, next(_designs(study, (copies, turn))), 0.0) < 0)
    return f"{turn} = {sign}360 deg / {copies}"


def _ratios(study):
    """Speeds that are varied, or not, beside the speed of a motion that carries theirs, directly or by others."""
    speeds, changed = {}, {key for key in [*study.varied, *study.formulas.derived] if study.formulas.roots(key)}
    for key in [*study.base, *study.varied, *study.formulas.derived]:
        section, _, name = key.rpartition(".")
        if key in ("rotor.speed", "rotor.tip_speed") or (name == "speed" and section.startswith("motion.")):
            speeds[section.removeprefix("motion.")] = key
    on = {key[7:-3]: value.value for key, value in study.base.items() if re.fullmatch(r"motion\..+\.on", key)}
    for name, key in speeds.items():
        carrier, seen = on.get(name), {name}
        while carrier and carrier not in seen:
            seen.add(carrier)
            other = speeds.get(carrier)
            moved, still = (key, other) if key in changed else (other, key)
            if moved in changed and still and still not in changed and study.base[still].value:
                one, two = (study.original.get(key) for key in (moved, still))
                known = one and two and one.unit == two.unit and one.value
                mend = f"{still} = {two.value / one.value:.6g} * {moved}" if known else f"{still} = RATIO * {moved}"
                yield (
                    f"{moved} is varied, and {still} is not: the ratio of the speeds of '{carrier}' and of '{name}', "
                    f"which it carries, is different in each design; to keep it write '{mend}' into [set]"
                )
            carrier = on.get(carrier)
