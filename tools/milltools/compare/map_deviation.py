"""How far do two maps deviate, and how much of that is noise?

Deviation of the solid fraction phi and of the velocity v (vectors), over the cells with phi > 0.02 on both sides,
weighted with phi, the mean of both:

    D_phi = sqrt( sum phi (phi_B - phi_A)^2 / sum phi phi^2 )
    D_v   = sqrt( sum phi |v_B - v_A|^2 / sum phi (|v_A|^2 + |v_B|^2) / 2 )

Noise adds sum phi (var_A + var_B) to both numerators. The variance of a stored map M, a mean over n_M snapshots, is
estimated from the n_F frames of the run in the window: the same rule makes a map F from them, and blocks of time give
the variance of F. F samples the same motion more coarsely, so var M = var F - (F - M)^2, summed over the map, but at
least var F n_F / n_M, the value for independent snapshots. Frames show the blades at few angles only, which makes F - M
too large in the cross-section: the noise is known only roughly. With ten seeds of the reference mill (45 pairs) D was
0.6 to 1.5 times the noise.

Maps of chambers of different size have different cells. They are brought to common cells: every sum over a cell (volume
of the balls, volume times velocity, volume of the chamber) is divided among the common cells by the overlap of area.
"""

import numpy as np

from milltools.read.runfile import VIEWS

LEAST = 0.02  # solid fraction of cells that count
FEWEST_FRAMES = 8
BEYOND = 2  # a deviation of up to this many times the noise counts as noise: see above


def stored(run, view: str, name: str) -> np.ndarray:
    """The map of a file; for "velocity" the first dimension is the component."""
    if name == "velocity":
        return np.array([run.map(f"velocity_{axis}", view) for axis in VIEWS[view][2]])
    return run.map(name, view).astype(float)


def common(runs, view: str):
    """The edges of cells that the maps of all runs can be brought to: they reach as far as all of them and are as large
    as the largest. None if the cells are the same already."""
    every = list(zip(*(run.edges(view) for run in runs)))
    if all(len(one) == len(axis[0]) and np.allclose(one, axis[0], rtol=1e-9) for axis in every for one in axis):
        return None
    found = []
    for axis in every:
        low, high = min(one[0] for one in axis), max(one[-1] for one in axis)
        size = max((one[-1] - one[0]) / (len(one) - 1) for one in axis)
        found.append(np.linspace(low, high, max(1, round((high - low) / size)) + 1))
    return tuple(found)


def divided(sums: np.ndarray, old, new, view: str) -> np.ndarray:
    """Sums over cells (..., n, m) with `old` edges as sums over cells with `new` edges, by the overlap of area."""
    if view == "axial":  # rings: the area grows with the square of r
        old, new = ((x, r**2) for x, r in (old, new))
    shares = []
    for one, two in zip(old, new):
        inside = np.minimum(one[1:], two[1:, None]) - np.maximum(one[:-1], two[:-1, None])
        shares.append(np.maximum(inside, 0) / np.diff(one))
    return shares[0] @ sums @ shares[1].T


def room(run, view: str, cells) -> np.ndarray:
    """Volume [m^3] of the chamber in common `cells`."""
    edges = run.edges(view)
    return divided(run.container.volume(view, edges), edges, cells, view)


def brought(run, view: str, name: str, values: np.ndarray, cells) -> np.ndarray:
    """A map `values` (..., n, m) of a run in common `cells`: means weighted with the volume of the chamber, of a
    velocity with that of the balls; unchanged without cells. Of variances of neighbours that rise and fall together
    this is the variance of their mean, else an upper limit."""
    if cells is None:
        return values
    edges = run.edges(view)
    weight = run.container.volume(view, edges)
    if name == "velocity":
        weight = weight * np.nan_to_num(stored(run, view, "solid_fraction"))
    with np.errstate(invalid="ignore", divide="ignore"):
        sums = divided(np.where(weight > 0, np.nan_to_num(values) * weight, 0), edges, cells, view)
        return sums / divided(weight, edges, cells, view)


def shared(runs, view: str, cells) -> np.ndarray:
    """Which common cells are in the chambers of all runs, so that a difference has a meaning: the smallest volume is
    at least half of the largest."""
    rooms = np.array([room(run, view, cells) for run in runs])
    return (rooms.min(axis=0) > 0) & (rooms.min(axis=0) >= 0.5 * rooms.max(axis=0))


def noise(run, parts) -> dict:
    """(view, name) -> (variance of the frames' map, its squared distance from the stored one) by cell, velocity summed
    over its components; empty where frames are too few to tell. `parts`: cells.Maps of the frames of each block of
    time, or None."""
    frames = np.array([part.samples if part else 0 for part in parts])
    few = len(frames) < 4 or frames.min() < 1 or frames.sum() < FEWEST_FRAMES
    if few or run.starts > 1:  # frames are of the first start, the map is of all
        return {}
    found = {}
    for view in VIEWS:
        cells = [part.cross if view == "cross_section" else part.axial for part in parts]
        shape = run.map("solid_fraction", view).shape
        if shape != cells[0].n:  # the cells belong to another drum
            return {}
        flow = np.array([one.flow.reshape(4, *shape) for one in cells]) / frames[:, None, None, None]
        with np.errstate(invalid="ignore", divide="ignore"):
            fraction = flow[:, 0] / cells[0].room.reshape(shape)
            mean = flow.mean(axis=0)
            speed = mean[1:] / mean[0]
            # the velocity is a ratio of two means; to first order its blocks are
            ratio = (flow[:, 1:] - speed * flow[:, :1]) / mean[0]
        for name, blocks, middle in (("solid_fraction", fraction, fraction.mean(axis=0)), ("velocity", ratio, speed)):
            rough, coarse = blocks.var(axis=0, ddof=1) / len(blocks), (middle - stored(run, view, name)) ** 2
            found[view, name] = _summed(name, rough), _summed(name, coarse)
    return found


def _summed(name, squares):
    """The sum over the components of a velocity."""
    return squares.sum(axis=0) if name == "velocity" else squares


def deviation(a, b, view: str, name: str, steady: bool):
    """(deviation D of side b from side a, the part that noise alone explains or NaN), both relative; None if no cell is
    filled on both sides. If the runs are not steady, the noise comes from replicates."""
    runs = [*a.runs, *b.runs]
    cells = common(runs, view)
    one, two = (side.mean_map("solid_fraction", view, cells) for side in (a, b))
    with np.errstate(invalid="ignore"):
        counts = (one > LEAST) & (two > LEAST)
    if cells is not None:
        counts &= shared([a.first, b.first], view, cells)
    if not counts.any():
        return None
    weight = ((one + two) / 2)[counts]
    variances = [_variance(side, view, name, cells, counts, weight, steady) for side in (a, b)]
    if not steady and np.isnan(variances).any():  # a side with one run gets the scatter of the other side
        runs = [len(side.runs) for side in (a, b)]
        single = np.nanmean([v * n for v, n in zip(variances, runs)]) if not np.isnan(variances).all() else np.nan
        variances = [single / n if np.isnan(v) else v for v, n in zip(variances, runs)]
    one, two = (side.mean_map(name, view, cells) for side in (a, b))
    square = _summed(name, (two - one) ** 2)[counts]
    mean_square = (_summed(name, one**2 + two**2) / 2)[counts] if name == "velocity" else weight**2
    total = np.sum(weight * mean_square)
    return tuple(float(np.sqrt(part / total)) for part in (np.sum(weight * square), np.sum(variances)))


def _variance(side, view, name, cells, counts, weight, steady) -> float:
    """Weighted sum over the cells of the variance of a side's mean map; NaN if unknown."""
    if not steady:
        if len(side.runs) < 2:
            return np.nan
        stack = np.array([brought(run, view, name, stored(run, view, name), cells) for run in side.runs])
        scatter = _summed(name, stack.var(axis=0, ddof=1) / len(side.runs))
        return float(np.sum(weight * scatter[counts]))
    total = 0.0
    for run in side.runs:
        if (view, name) not in run.map_noise:
            return np.nan
        rough, coarse = (
            np.nansum(weight * brought(run, view, name, part, cells)[counts]) for part in run.map_noise[view, name]
        )
        share = min(1.0, run.map_frames / max(int(run.statistic("maps/samples")), 1))
        total += max(rough - coarse, share * rough)
    return float(total) / len(side.runs) ** 2


def verdict(deviation: float, noise: float) -> tuple[str, str]:
    """Words and mood for a deviation and its noise."""
    if not np.isfinite(noise):
        return "noise unknown", "open"
    if deviation <= BEYOND * noise:
        return "noise explains it", "agree"
    return f"{100 * np.sqrt(deviation**2 - noise**2):.1f} % beyond noise", "differ"
