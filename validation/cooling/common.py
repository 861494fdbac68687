"""The gas that cools, and what its checks ask of a run."""

import numpy as np
from scipy.spatial import cKDTree

BALLS, DIAMETER, RADIUS, LENGTH = 2000, 0.005, 0.188, 0.250  # as in deck.ini
COUNTS = np.array([0.5, 1, 2, 3, 4, 6, 8, 10, 13, 16, 19])  # collisions per ball, compared there


def write_start(case, seed):
    """start.txt: balls anywhere, Maxwell's velocities with T = m (m/s)^2, no spin.

    The sum of the momenta is zero, and so is the angular momentum about the axis, which smooth walls keep: it
    would stay while all else cools.
    """
    rng = np.random.default_rng([seed, 11])
    place = random_places(rng, BALLS)
    while len(close := cKDTree(place).query_pairs(1.000001 * DIAMETER, output_type="ndarray")):
        place[close[:, 0]] = random_places(rng, len(close))
    v = rng.normal(size=(BALLS, 3))
    modes = np.zeros((4, BALLS, 3))
    modes[[0, 1, 2], :, [0, 1, 2]] = 1
    modes[3] = np.cross([1.0, 0, 0], place)
    modes = modes.reshape(4, -1).T
    v -= (modes @ np.linalg.lstsq(modes, v.ravel(), rcond=None)[0]).reshape(BALLS, 3)
    v *= np.sqrt(3 / (v**2).sum(axis=1).mean())
    lines = (" ".join(map(repr, row)) for row in np.column_stack([place, v]).tolist())
    case.write("start.txt", "\n".join(lines) + "\n")


def random_places(rng, number):
    radius = (RADIUS - DIAMETER / 2) * np.sqrt(rng.random(number))
    angle = 2 * np.pi * rng.random(number)
    x = (LENGTH - DIAMETER) * (rng.random(number) - 0.5)
    return np.column_stack([x, radius * np.cos(angle), radius * np.sin(angle)])


def collisions(file):
    """C, contacts with other balls that each ball has had."""
    return 2 / BALLS * file["observables/collisions/ball_ball/value"][:].astype(float)


def at_counts(count, *rows):
    if count[-1] < COUNTS[-1]:
        raise RuntimeError(f"only {count[-1]:g} collisions per ball")
    return [np.interp(COUNTS, count, row) for row in rows]


def mean_and_error(samples):
    """Mean over the first axis, the seeds, and its standard error."""
    return samples.mean(axis=0), samples.std(axis=0, ddof=1) / np.sqrt(len(samples))
