"""Wear of the parts for the 3D player: small triangles with the facet of each, and for each facet a level of colour.

One gzip stream of arrays, the numbers little-endian. For each of `bodies`: steps between the corners of its triangles
int32 (3 T,), steps between their facets int32 (T,), planes of its points uint16 (3, N), which mean `lower` + `step` *
number [m] in the frame of its motion. Then for each quantity a level uint8 (facets,): 0 without wear, else
low (limit / low)^((level - 1) / 254).
"""

import gzip

import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import number
from milltools.geometry.bodies import worn
from milltools.read.wear import PLACE, Wear, why_not
from milltools.render.colour import WEAR, Colour, shared


def there(run) -> bool:
    """Whether a run has wear."""
    return not why_not(run) and run.has(f"{PLACE}/mesh/facet")


def scales(runs) -> dict[str, tuple[float, float]]:
    """Both ends [SI] of the logarithmic scale of each quantity of wear that some runs have, for all together."""
    found, known = list(filter(there, runs)), {}
    for name in WEAR if found else ():
        try:
            known[name] = shared(found, name)
        except UserError:
            continue
    return known


def pack(run, shown: dict[str, tuple[float, float]]) -> tuple[dict, bytes]:
    """(what the head of the player has of it, the stream) for a milltools.read.runfile.Run; `shown`: scales()."""
    wear, names = Wear(run), list(run.first_poses())
    streams, bodies = [], []
    for shell, motion, triangles, facet in worn(run, wear):
        place = triangles.reshape(-1, 3)
        lower, step = place.min(axis=0), float(np.ptp(place, axis=0).max()) / 65535
        steps = np.rint((place - lower) / step).astype(np.uint16)
        _, first, index = np.unique(steps, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)  # points in the order of the triangles, so that steps are small
        corners = np.argsort(order)[index.ravel()]
        streams += [np.diff(one, prepend=0).astype("<i4").tobytes() for one in (corners, facet)]
        streams.append(steps[first[order]].T.astype("<u2").tobytes())
        bodies.append(
            {
                "shell": shell, "motion": names.index(motion) if motion in names else -1, "lower": lower.tolist(),
                "step": step, "points": len(first), "triangles": len(facet),
            }
        )  # fmt: skip
    for name, ends in shown.items():
        share = np.clip(Colour(name, ends).share(wear[name]), 0, 1)
        streams.append(np.where(np.isnan(share), 0, 1 + np.rint(254 * np.nan_to_num(share))).astype(np.uint8).tobytes())
    values = [_quantity(Colour(name, ends)) for name, ends in shown.items()]
    return {"bodies": bodies, "facets": len(wear.area), "values": values}, gzip.compress(b"".join(streams), mtime=0)


def _quantity(colour: Colour) -> dict:
    """What the page needs of a quantity, as player.py tells it of those of the balls."""
    label, (divisor, unit) = WEAR[colour.quantity][0], colour.scale
    low, high = (number(limit / divisor, 2) for limit in colour.limits)
    return {
        "name": colour.quantity,
        "label": label,
        "low": colour.limits[0],
        "limit": colour.limits[1],
        "ticks": [[round(share, 4), text] for share, text in colour.marks() if share < 0.72]
        + [[1, f"≥ {high} {unit}"]],
        "describe": f"Colours, logarithmic: {label} from {low}, dark blue, to {high} {unit} and more, yellow",
    }
