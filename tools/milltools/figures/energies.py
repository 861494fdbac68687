"""The available normal energy of an impact: E = m* v_n^2 / 2. Here m* is the mass of the ball for impacts on the mill,
and m1 m2 / (m1 + m2) for impacts of two balls.

If all balls have the same mass, each kind has one m*, and the bins of speed become bins of energy exactly. Otherwise,
and for all kinds together, the histograms of energy in the file are used. Files of other programs have none: then the
energies of different balls come from the log of single impacts (output.impacts = all), which contains the two balls of
each impact. It is read in slices.
"""

import bisect
import dataclasses
import math
import weakref

import numpy as np

from milltools.figures.bins import Bins, merged

SAME = 1e-12  # relative tolerance of equal masses
EDGES = 10.0 ** (np.arange(-140, 15) / 7)  # [J] for a log: seven per decade, 1e-20 to 100 J
SLICE = 1_000_000  # rows of the log read at a time: about 50 MB

_logged = weakref.WeakKeyDictionary()  # run -> {kind: Bins}, so that a log is read only once


def one_mass(run) -> float | None:
    """Mass of every ball [kg]; None if the masses differ."""
    mass = run.balls("mass")
    return float(mass[0]) if len(mass) and np.ptp(mass) <= SAME * mass[0] else None


def stored(run) -> bool:
    """Whether the file has histograms of energy."""
    return run.has("statistics/energies")


def why_not(run, group: str = "impacts") -> str | None:
    """Why the energies of the impacts are not known; None if they are."""
    if one_mass(run) is not None:
        return None
    if group != "impacts":
        return "the balls have different masses, and the file does not say which of them meet in a strike"
    if stored(run) or run.has("impacts/time"):
        return None
    log = "the log of single impacts (output.impacts = all)"
    return f"the balls have different masses, so this needs {log}"


def bins(run, kind: str, group: str = "impacts") -> Bins:
    """Impacts of a kind or of "all" by available normal energy [J]; see why_not."""
    mass = one_mass(run)
    if (mass is None or kind == "all") and group == "impacts" and stored(run):
        return merged(run.histogram(kind, speed="normal_energy"), run.duration)
    if mass is None:
        read(run)
        return _logged[run][kind]
    if kind == "all":
        return _together(run, group, mass)
    by_speed = merged(run.histogram(kind, group), run.duration)
    return dataclasses.replace(by_speed, edges=_energy(mass, kind, by_speed.edges))


def _energy(mass: float, kind: str, speed: np.ndarray) -> np.ndarray:
    """Of balls of one mass."""
    return 0.5 * (mass / 2 if kind == "ball_ball" else mass) * speed**2


def _together(run, group: str, mass: float) -> Bins:
    """All kinds in common bins: of a bin of speed, which is 2 % wide, all impacts are in the bin of its middle."""
    count, lost = np.zeros((2, len(EDGES) + 1))
    for kind in run.kinds:
        found = run.histogram(kind, group)
        cell = np.searchsorted(EDGES, _energy(mass, kind, np.sqrt(found.edges[:-1] * found.edges[1:])), side="right")
        for sums, values, below, above in (
            (count, found.count, found.underflow, found.overflow),
            (lost, found.dissipation, found.dissipation_underflow, found.dissipation_overflow),
        ):
            np.add.at(sums, np.concatenate([[0], cell, [-1]]), np.concatenate([[below], values, [above]]))
    return _bins(run, count, lost, found.part)


def _bins(run, count: np.ndarray, lost: np.ndarray, part: str) -> Bins:
    """Of numbers and losses below, within and above EDGES."""
    ends = ((count[k], lost[k]) for k in (0, -1))
    return Bins(EDGES, count[1:-1], lost[1:-1], *ends, run.duration, part)


def read(run, told=None):
    """Reads the log of single impacts once, if it is needed; calls told(share) with the progress."""
    if one_mass(run) is None and not stored(run) and run not in _logged:
        _logged[run] = _from_log(run, told or (lambda share: None))


def _from_log(run, told) -> dict[str, Bins]:
    """Bins of every kind and of "all", for the impacts in the sampled window."""
    mass, names = run.balls("mass").astype(float), run.index_names("impacts/kind")
    size = len(EDGES) + 1  # with the cells below and above the edges
    count, lost = np.zeros((2, len(names), size))
    slices = _slices(run)
    for k, part in enumerate(slices):
        told(k / len(slices))
        kind = run.read("impacts/kind", part).astype(np.int64)
        ball, partner = run.read("impacts/ball", part), run.read("impacts/partner", part)
        effective = mass[ball]
        pair = kind == (names.index("ball_ball") if "ball_ball" in names else -1)
        other = mass[partner[pair]]
        effective[pair] *= other / (effective[pair] + other)
        energy = 0.5 * effective * run.read("impacts/normal_speed", part) ** 2
        cell = kind * size + np.searchsorted(EDGES, energy, side="right")
        count += np.bincount(cell, minlength=count.size).reshape(count.shape)
        loss = run.read("impacts/dissipation", part)
        lost += np.bincount(cell, loss, minlength=lost.size).reshape(lost.shape)
    part = run.attribute("impacts/dissipation", "part", "all")
    found = {}
    for name in (*run.kinds, "all"):
        rows = slice(None) if name == "all" else [k for k, other in enumerate(names) if other == name]
        found[name] = _bins(run, count[rows].sum(axis=0), lost[rows].sum(axis=0), part)
    return found


def _slices(run) -> list[slice]:
    """Slices of the log for exactly the sampled window; the rows are in the order of time. Times are compared with a
    tolerance for rounding, because the end of the window is its begin + duration."""
    ends = (math.nextafter(time * (1 - 1e-15), -math.inf) for time in run.window)
    rows = range(run.length("impacts/time"))
    first, last = (bisect.bisect_left(rows, end, key=lambda row: float(run.read("impacts/time", row))) for end in ends)
    return [slice(at, min(at + SLICE, last)) for at in range(first, last, SLICE)]
