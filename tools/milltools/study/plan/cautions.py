"""What the designs of a study change or lose without a word, one sentence each: copies of a body in the same place, and
the ratio of two speeds of a motion that carries another one."""

import math
import re

from milltools.base.text import plural

# so near is the same place: 0.36 degrees, as typed angles have few digits (7 times 51.4 degrees are 359.8); and less
# than a tenth of the angle between neighbours, which are apart however close they are
SAME = 1e-3  # of a turn


def cautions(study) -> list[str]:
    """For a study_deck.Study."""
    return [*_places(study), *_ratios(study)]


def _values(study, key, preset) -> tuple:
    """All values [SI] that a key takes in the designs; the ends of a range that has no single values."""
    r = study.varied.get(key)
    if r:
        return r.values or (r.low, r.high)
    return (study.base[key].value if key in study.base else preset,)


def _places(study):
    """Copies that are turned by a whole turn, without a shift, are in the place of others. The container has none."""
    keys = dict.fromkeys([*study.base, *study.varied])
    for body in [key.removesuffix(".copies") for key in keys if key.startswith("body.") and key.endswith(".copies")]:
        copies, turn, shift = (f"{body}.{name}" for name in ("copies", "turn_by", "shift_by"))
        count, side = max(_values(study, copies, 1)), study.base.get(f"{body}.side")
        if (side and side.value == "inside") or any(
            float(x) for text in _values(study, shift, "0") for x in text.split()
        ):
            continue
        for angle in _values(study, turn, 0.0):
            turns = angle / math.tau
            same = min(SAME, abs(turns) / 10)
            places = next((k for k in range(1, count) if abs(k * turns - round(k * turns)) <= same), count)
            if places < count:
                yield (
                    f"{copies} = {count} with {turn} = {math.degrees(angle):.6g} deg: only "
                    f"{plural(places, 'place')}, so {count - places} of the copies are where others are already"
                )
                break


def _ratios(study):
    """Speeds that are varied, or not, beside the speed of a motion that carries theirs, directly or by others."""
    speeds = {}
    for key in [*study.base, *study.varied]:
        section, _, name = key.rpartition(".")
        if key in ("rotor.speed", "rotor.tip_speed") or (name == "speed" and section.startswith("motion.")):
            speeds[section.removeprefix("motion.")] = key
    on = {key[7:-3]: value.value for key, value in study.base.items() if re.fullmatch(r"motion\..+\.on", key)}
    for name, key in speeds.items():
        carrier, seen = on.get(name), {name}
        while carrier and carrier not in seen:
            seen.add(carrier)
            other = speeds.get(carrier)
            moved, still = (key, other) if key in study.varied else (other, key)
            if moved in study.varied and still and still not in study.varied and study.base[still].value:
                yield (
                    f"{moved} is varied, and {still} is not: the ratio of the speeds of '{carrier}' and of '{name}', "
                    "which it carries, is different in each design"
                )
            carrier = on.get(carrier)
