"""Wear of the parts for the 3D player: small triangles with the facet of each, and for each facet a level of colour.

One gzip stream of arrays, the numbers little-endian. For each of `bodies`: steps between the corners of its triangles
int32 (3 T,), steps between their facets int32 (T,), planes of its points uint16 (3, N), which mean `lower` + `step` *
number [m] in the frame of its motion. Then for each quantity a level uint8 (facets,): 0 without wear, else
low (limit / low)^((level - 1) / 254).
"""

import gzip

import numpy as np

from milltools.base.text import number
from milltools.dose.wear import YEAR
from milltools.figures.wear import limits
from milltools.geometry.bodies import inverse, moved
from milltools.read.wear import PLACE, Wear, why_not

# columns of the file: words, unit, and how many of this unit are 1 SI
SHOWN = {
    "sliding_power": ("power lost by sliding", "kW/m²", 1e-3),
    "normal_power": ("power lost along the normal", "kW/m²", 1e-3),
    "archard_rate": ("depth of sliding wear", "mm/year", 1e3 * YEAR),
}


def there(run) -> bool:
    """Whether a run has wear."""
    return not why_not(run) and run.has(f"{PLACE}/mesh/facet")


def scales(runs) -> dict[str, tuple[float, float]]:
    """Both ends [SI] of the logarithmic scale of each of SHOWN that the files of some runs have, for all together."""
    found = list(map(Wear, filter(there, runs)))
    known = [name for name in SHOWN if any((wear[name] > 0).any() for wear in found)]
    return {name: limits(found, name) for name in known}


def pack(run, shown: dict[str, tuple[float, float]]) -> tuple[dict, bytes]:
    """(what the head of the player has of it, the stream) for a milltools.read.runfile.Run; `shown`: scales()."""
    wear, names = Wear(run), list(run.first_poses())
    facet, points = run.read(f"{PLACE}/mesh/facet"), run.read(f"{PLACE}/mesh/points").astype(float).reshape(-1, 3, 3)
    part, streams, bodies = wear.part[facet], [], []
    look = [(one.motion, one.kind in run.vessel_kinds) for one in wear.parts]
    for motion, shell in dict.fromkeys(look):
        own = np.flatnonzero([look[k] == (motion, shell) for k in part])
        if not len(own):
            continue
        start = wear.parts[look.index((motion, shell))].start
        place = moved(inverse(start), points[own]).reshape(-1, 3)
        lower, step = place.min(axis=0), float(np.ptp(place, axis=0).max()) / 65535
        steps = np.rint((place - lower) / step).astype(np.uint16)
        _, first, index = np.unique(steps, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)  # points in the order of the triangles, so that steps are small
        corners, facets = np.argsort(order)[index.ravel()], facet[own]
        streams += [np.diff(one, prepend=0).astype("<i4").tobytes() for one in (corners, facets)]
        streams.append(steps[first[order]].T.astype("<u2").tobytes())
        bodies.append(
            {
                "shell": shell, "motion": names.index(motion) if motion in names else -1, "lower": lower.tolist(),
                "step": step, "points": len(first), "triangles": len(own),
            }
        )  # fmt: skip
    for name, (low, high) in shown.items():
        value = np.nan_to_num(wear[name])
        share = np.log(np.maximum(value, low) / low) / np.log(high / low)
        streams.append(np.where(value > 0, 1 + np.rint(254 * np.minimum(share, 1)), 0).astype(np.uint8).tobytes())
    values = [_quantity(name, *ends) for name, ends in shown.items()]
    return {"bodies": bodies, "facets": len(wear.area), "values": values}, gzip.compress(b"".join(streams), mtime=0)


def _quantity(name: str, low: float, high: float) -> dict:
    """What the page needs of a quantity, as player.py tells it of those of the balls."""
    label, unit, factor = SHOWN[name]
    ten = 10.0 ** np.arange(np.floor(np.log10(low * factor)), np.log10(high * factor))
    marks = [m * decade for decade in ten for m in ((1,) if len(ten) > 3 else (1, 2, 5))]
    shares = [(float(np.log(mark / factor / low) / np.log(high / low)), mark) for mark in marks]
    ends = f"{number(low * factor, 2)}", f"{number(high * factor, 2)} {unit}"
    return {
        "name": name,
        "label": label,
        "low": low,
        "limit": high,
        "ticks": [[round(share, 4), number(mark)] for share, mark in shares if -1e-9 <= share < 0.72]
        + [[1, f"≥ {ends[1]}"]],
        "describe": f"Colours, logarithmic: {label} from {ends[0]}, dark blue, to {ends[1]} and more, yellow",
    }
