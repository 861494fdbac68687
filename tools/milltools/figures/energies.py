"""How much energy an impact brings along its normal: E = m* v_n^2 / 2, with m* the ball's mass against a body of the
mill and m1 m2 / (m1 + m2) between two balls.

Where all balls weigh the same, m* is one number for each kind and the bins of speed are bins of energy, exactly:
edges map to edges. Where they do not, the file has histograms of energy. Files of other programs have none: there
only the log of single impacts (output.impacts = all) tells which masses met; it is read by slices.
"""

import bisect
import dataclasses
import math
import weakref

import numpy as np

from milltools.figures.bins import Bins, merged

SAME = 1e-12  # masses that differ by less are one
EDGES = 10.0 ** (np.arange(-140, 15) / 7)  # [J] for a log: seven a decade, 1e-20 to 100 J
SLICE = 1_000_000  # rows of the log at a time: some 50 MB

_logged = weakref.WeakKeyDictionary()  # run -> {kind: Bins}: a log is read once


def one_mass(run) -> float | None:
    """Mass of every ball [kg]; None where they differ."""
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
        return "the balls' masses differ, and which of them meet in a strike is not recorded"
    if stored(run) or run.has("impacts/time"):
        return None
    log = "the log of single impacts (output.impacts = all)"
    return f"the balls' masses differ, and which of them meet is only in {log}"


def kinds_known(run) -> tuple[str, ...]:
    """Rows that have a spectrum: the kinds, and "all" where they share their bins."""
    return run.kinds if one_mass(run) is not None else (*run.kinds, "all")


def bins(run, kind: str, group: str = "impacts") -> Bins:
    """Impacts of a kind by available normal energy [J]; see why_not."""
    mass = one_mass(run)
    if mass is None:
        if stored(run):
            return merged(run.histogram(kind, speed="normal_energy"), run.duration)
        read(run)
        return _logged[run][kind]
    effective = mass / 2 if kind == "ball_ball" else mass
    by_speed = merged(run.histogram(kind, group), run.duration)
    return dataclasses.replace(by_speed, edges=0.5 * effective * by_speed.edges**2)


def read(run, told=None):
    """Reads the log of single impacts, where it is needed, for all that follows; told(share) hears how far it is."""
    if one_mass(run) is None and not stored(run) and run not in _logged:
        _logged[run] = _from_log(run, told or (lambda share: None))


def _from_log(run, told) -> dict[str, Bins]:
    """Bins of every kind and of all, of the impacts in the sampled window."""
    mass, names = run.balls("mass").astype(float), list(run.attribute("impacts", "kinds"))
    size = len(EDGES) + 1  # below and above the edges too
    count, lost = np.zeros((2, len(names), size))
    slices = _slices(run)
    for k, part in enumerate(slices):
        told(k / len(slices))
        kind = run.read("impacts/kind", part).astype(np.int64)
        ball, partner = run.read("impacts/ball", part), run.read("impacts/partner", part)
        effective = mass[ball]
        pair = kind == names.index("ball_ball")
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
        rows = slice(None) if name == "all" else [names.index(name)]
        n, e = count[rows].sum(axis=0), lost[rows].sum(axis=0)
        found[name] = Bins(EDGES, n[1:-1], e[1:-1], (n[0], e[0]), (n[-1], e[-1]), run.duration, part)
    return found


def _slices(run) -> list[slice]:
    """Slices of the log that cover the sampled window, and no more: its rows are in the order of time. A time is met
    within rounding: the window's end is its begin + duration."""
    ends = (math.nextafter(time * (1 - 1e-15), -math.inf) for time in run.window)
    rows = range(run.length("impacts/time"))
    first, last = (bisect.bisect_left(rows, end, key=lambda row: float(run.read("impacts/time", row))) for end in ends)
    return [slice(at, min(at + SLICE, last)) for at in range(first, last, SLICE)]
