"""The type, shape and values that readers require of the datasets of an output file (docs/file-format.md)."""

import functools
import re
import typing
from collections.abc import Callable

import numpy as np

TURNED = 1e-3  # tolerance of a rotation matrix: its rows must be orthogonal and of length 1
TEXT, NUMBER, WHOLE, EITHER = "SO", "iufb", "iub", "SOiufb"  # kinds of numpy's types


def _finite(values):
    return np.isfinite(values).all()


def _no_infinity(values):
    return not np.isinf(values).any()


def _positive(values):
    return (np.isfinite(values) & (values > 0)).all()


def _not_negative(values):
    return (np.isfinite(values) & (values >= 0)).all()


def _from_zero(values):
    return (values >= 0).all()


def _known_not_negative(values):
    return not (np.isinf(values) | (values < 0)).any()


def _bins(values):
    return len(values) > 2 and _rising(values)


def _rotations(values):
    turns = values[..., :3].astype(float)
    return (np.abs(turns @ np.swapaxes(turns, -1, -2) - np.eye(3)) <= TURNED).all() and _finite(values)


def _rising(values):
    return not np.isnan(values).any() and (np.diff(values) > 0).all()


def _rising_or_level(values):
    return np.isfinite(values).all() and (np.diff(values) >= 0).all()


class Rule(typing.NamedTuple):
    """What the datasets whose paths match `pattern` must be."""

    pattern: re.Pattern
    kinds: str  # of numpy's types
    # a number; None: any; SPECIES; "PATH": as many rows as that dataset, "PATH -1": one less, "PATH *3": three times
    shape: tuple
    check: Callable | None  # of the values


SAID = {
    _finite: "a value that is not a finite number",
    _no_infinity: "an infinite value",
    _positive: "a value that is not above 0",
    _not_negative: "a value that is below 0 or not a number",
    _from_zero: "a value that is below 0 or not a number",
    _known_not_negative: "a value that is below 0 or infinite",
    _rising: "values that do not ascend",
    _rotations: "not a rotation matrix",
    _bins: "values that do not ascend, or fewer than two bins",
    _rising_or_level: "values that descend or are not numbers",
}
BALLS = "particles/trajectory/id"
FRAMES = "particles/trajectory/position/time"
SPECIES = "species"  # as many as the deck has
CLASSES = "classes"  # of species, by which energies are counted
ENERGIES = "statistics/energies"
STARTS = "starts/seed"
BLOCKS, EACH = f"{ENERGIES}/blocks", f"{ENERGIES}/blocks/ball_ball/normal"
PARTS, FACETS = "statistics/wear/parts/kind", "statistics/wear/area"
# What datasets of indices refer to, one for all columns or one for each: the rows of a dataset, the names in the
# attribute "@NAME", so many, or nothing (None). -1 is no index where a rule allows it.
INDICES = {
    r"impacts/kind": "@kinds",
    r"(impacts|reliefs)/ball": BALLS,
    r"particles/trajectory/species": "@names",
    r"VTKHDF/.*/CellData/kind": "@kinds",
    PARTS: "@kinds",
    r"statistics/wear/parts/motion": "@motions",
    r"statistics/wear/part": PARTS,
    r"statistics/wear/face": 6,
    r"statistics/wear/cells": (FACETS, None, None, None, None, 6),
    r"statistics/wear/mesh/facet": FACETS,
}
# NaN: not known, such as a median of no impacts, or a velocity in a cell that no ball entered
RULES = [
    Rule(re.compile(pattern), kinds, shape, check)
    for pattern, kinds, shape, check in (
        (r"deck/.*", TEXT, (), None),
        (r"run/(program|version|command|started|status|notes)", TEXT, (), None),
        (r"run/(time|cpu_time|wall_time)", NUMBER, (), _not_negative),
        (r"run/price", NUMBER, (), _known_not_negative),  # NaN if the run is too short to measure it
        (r"run/(events|reach|floored)/.*", NUMBER, (), _no_infinity),
        (r"run/.*", EITHER, (), None),
        (r"particles/trajectory/id", WHOLE, (None,), None),
        (r"particles/trajectory/species", WHOLE, (BALLS,), _not_negative),
        (r"particles/trajectory/(mass|diameter)", NUMBER, (BALLS,), _positive),
        (r"particles/trajectory/\w+/value", NUMBER, (FRAMES, BALLS, 3), _finite),
        (r"particles/trajectory/\w+/time", NUMBER, (None,), _rising),
        (r"particles/trajectory/\w+/step", NUMBER, (FRAMES,), _not_negative),
        (r"observables/(pose/.*/centre|frame_velocity|frame_spin)/value", NUMBER, (FRAMES, 3), _finite),
        (r"observables/pose/.*/rotation/value", NUMBER, (FRAMES, 3, 3), _rotations),
        (r"observables/(fast_collisions/.*)/value", NUMBER, (r"observables/\1/time", None), _no_infinity),
        (r"observables/(.*)/value", NUMBER, (r"observables/\1/time",), _no_infinity),
        (r"observables/.*/time", NUMBER, (None,), _rising_or_level),
        (r"impacts/time", NUMBER, (None,), _finite),
        (r"impacts/(position|normal)", NUMBER, ("impacts/time", 3), _no_infinity),
        (r"impacts/(kind|ball)", WHOLE, ("impacts/time",), _not_negative),
        (r"impacts/partner", WHOLE, ("impacts/time",), None),
        (r"impacts/.*", NUMBER, ("impacts/time",), _no_infinity),
        (r"reliefs/ball", WHOLE, ("reliefs/time",), _not_negative),
        (r"reliefs/time", NUMBER, (None,), _rising_or_level),
        (r"reliefs/until", NUMBER, ("reliefs/time",), _from_zero),
        (r"VTKHDF/.*/(NumberOfPoints|PointOffsets|Connectivity)", WHOLE, (None,), _not_negative),
        (r"VTKHDF/.*/Points", NUMBER, (None, 3), _finite),
        (r"VTKHDF/(.*)/CellData/kind", WHOLE, (None,), _not_negative),
        (r"VTKHDF/(.*)/CellData/number", WHOLE, (r"VTKHDF/\1/CellData/kind",), None),
        (r"statistics/duration", NUMBER, (), _not_negative),
        (STARTS, WHOLE, (None,), _not_negative),
        (r"starts/(begin|end)", NUMBER, (), _not_negative),
        (r"starts/speeds", WHOLE, (STARTS, None), _not_negative),
        (r"starts/fast_rate/.*", NUMBER, (STARTS, None), _no_infinity),
        (r"starts/.*", NUMBER, (STARTS,), _no_infinity),
        (r"statistics/maps/samples", NUMBER, (), _not_negative),
        (r"statistics/maps/\w+/\w_edges", NUMBER, (None,), _bins),
        (r"(statistics/maps/cross_section/)\w+", NUMBER, (r"\1y_edges -1", r"\1z_edges -1"), _no_infinity),
        (r"(statistics/maps/axial/)\w+", NUMBER, (r"\1x_edges -1", r"\1r_edges -1"), _no_infinity),
        (r"statistics/(.*)/histogram/edges", NUMBER, (None,), _bins),
        (r"statistics/(.*)/histogram/count", NUMBER, (r"statistics/\1/histogram/edges -1",), _not_negative),
        (r"statistics/(.*)/histogram/\w+", NUMBER, (r"statistics/\1/histogram/edges -1",), _no_infinity),
        (r"statistics/energies/(blocks/)?edges", NUMBER, (None,), _bins),
        (r"statistics/energies/class", WHOLE, (SPECIES,), _not_negative),
        (r"statistics/energies/blocks/(duration|period)", NUMBER, (), _not_negative),
        (f"({BLOCKS})/ball_ball/normal", WHOLE, (None, CLASSES, CLASSES, r"\1/edges -1"), _not_negative),
        (f"({BLOCKS})/ball_ball/.*", WHOLE, (EACH, CLASSES, CLASSES, r"\1/edges -1"), _not_negative),
        (f"({BLOCKS})/.*", WHOLE, (EACH, CLASSES, r"\1/edges -1"), _not_negative),
        (r"statistics/wear/parts/(start|axes)", NUMBER, (PARTS, 3, 4), _rotations),
        (PARTS, WHOLE, (None,), _not_negative),
        (r"statistics/wear/parts/\w+", WHOLE, (PARTS,), None),
        (r"statistics/wear/mesh/triangles", WHOLE, (), _not_negative),
        (r"statistics/wear/mesh/points", NUMBER, ("statistics/wear/mesh/facet *3", 3), _finite),
        (r"statistics/wear/mesh/facet", WHOLE, (None,), _not_negative),
        (r"statistics/wear/mesh/\w+", NUMBER, ("statistics/wear/mesh/facet",), _no_infinity),
        (r"statistics/wear/centre", NUMBER, (FACETS, 3), _finite),
        (r"statistics/wear/cells", WHOLE, (None, 6), _not_negative),
        (r"statistics/wear/lattices", NUMBER, (PARTS, 7), _finite),
        (FACETS, NUMBER, (None,), _positive),
        (r"statistics/wear/along/count", NUMBER, (None,), _not_negative),
        (r"statistics/wear/along/\w+", NUMBER, ("statistics/wear/along/count",), _no_infinity),
        (r"statistics/wear/(part|face|count)", WHOLE, (FACETS,), _not_negative),
        (r"statistics/wear/\w+", NUMBER, (FACETS,), _no_infinity),
        (f"{ENERGIES}/ball_ball/dissipation", NUMBER, (CLASSES, CLASSES, f"{ENERGIES}/edges -1"), _no_infinity),
        (f"{ENERGIES}/ball_ball/.*", NUMBER, (CLASSES, CLASSES, f"{ENERGIES}/edges -1"), _not_negative),
        (f"{ENERGIES}/.*/dissipation", NUMBER, (CLASSES, f"{ENERGIES}/edges -1"), _no_infinity),
        (f"{ENERGIES}/.*", NUMBER, (CLASSES, f"{ENERGIES}/edges -1"), _not_negative),
        (r"statistics/.*/quantiles\w*", NUMBER, (None,), _no_infinity),
        (r"statistics/(precision/doubt|hard_by)", TEXT, (), None),
        (r"statistics/hard_energy", NUMBER, (), None),  # NaN where nothing is hard
        (r"statistics/strike_window", NUMBER, (), _not_negative),
        (r"statistics/precision/fast_rate/.*", NUMBER, (None,), None),
        (r"statistics/precision/.*", NUMBER, (), None),  # an exact value has infinitely many degrees of freedom
        (r"statistics/charge/occupancy", NUMBER, (None,), _not_negative),
        (r"statistics/charge/liner/edges", NUMBER, (None,), _bins),
        (r"statistics/charge/liner/sizes", NUMBER, (None, "statistics/charge/liner/edges -1"), _not_negative),
        (r"statistics/charge/liner/duration", NUMBER, (), _not_negative),
        (r"statistics/charge/liner/count", NUMBER, (None,), _not_negative),
        (r"statistics/charge/liner/\w+", NUMBER, ("statistics/charge/liner/count",), _finite),
        (r"statistics/charge/.*", NUMBER, (), None),  # as precision; NaN where the charge has no such place
        (r"statistics/impacts/.*/(count|rate)", NUMBER, (), _not_negative),
        (r"statistics/.*", NUMBER, (), _no_infinity),
    )
]  # fmt: skip


@functools.lru_cache(maxsize=4096)
def of(path: str) -> Rule | None:
    """The first rule for a path."""
    return next((rule for rule in RULES if rule.pattern.fullmatch(path)), None)


@functools.lru_cache(maxsize=4096)
def indexed(path: str):
    """What the indices in a dataset refer to, as in INDICES; None for other datasets."""
    return next((of for pattern, of in INDICES.items() if re.fullmatch(pattern, path)), None)


def check_layout(run, path: str, thing):
    """ValueError if a dataset does not have the type and shape that the rule for its path requires."""
    rule = of(path)
    if not rule:
        return
    if thing.dtype.kind not in rule.kinds:
        raise ValueError(f"expected {'a text' if rule.kinds == TEXT else 'numbers'}, got {thing.dtype}")
    if path == BALLS and thing.size == 0:
        raise ValueError("no balls")
    shape = () if not rule.shape and thing.size == 1 else thing.shape
    if len(shape) != len(rule.shape):
        raise ValueError(f"expected {len(rule.shape)} dimensions, got {len(shape)}")
    for have, want in zip(shape, rule.shape):
        if isinstance(want, str):
            other, _, change = rule.pattern.fullmatch(path).expand(want).partition(" ")
            counted = run.as_deck.species if other == SPECIES else run.classes if other == CLASSES else None
            want = run.length(other) if counted is None else len(counted)
            want = want * int(change[1:]) if change[:1] == "*" else want + int(change or 0)
            if have != want:
                model = f"/{other}" if counted is None else "the deck"
                raise ValueError(f"{have} rows, expected {want} to match {model}")
        elif want not in (None, have):
            raise ValueError(f"{have} columns, expected {want}")


def fault(rule: Rule | None, values) -> str:
    """Why values break a rule; "" if they do not."""
    wrong = rule and rule.check and not rule.check(np.atleast_1d(values))
    return SAID[rule.check] if wrong else ""
