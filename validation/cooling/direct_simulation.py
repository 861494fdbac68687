"""Direct simulation Monte Carlo of rough spheres: what Boltzmann's equation says, without millsim."""

import numpy as np
from cooling.common import BALLS, COUNTS, DIAMETER, LENGTH, RADIUS, at_counts

FRICTION = 10.0  # the most a deck may have: all but 1 contact in 2000 stick
FREE_PATH = np.pi * RADIUS**2 * LENGTH / (np.sqrt(2) * np.pi * DIAMETER**2 * BALLS)

ORACLE_BALLS, ORACLE_BATCH = 100_000, 2000
# Hits on walls per collision with a ball, both per ball: surface <v> / 4 volume over <v> / free path, of the
# volume that is open to centres
_RADIUS, _LENGTH = RADIUS - DIAMETER / 2, LENGTH - DIAMETER
WALL_HITS = (2 / _RADIUS + 2 / _LENGTH) / 4 * FREE_PATH * _RADIUS**2 * _LENGTH / (RADIUS**2 * LENGTH)


def direct_simulation(e, beta, seed, friction=FRICTION):
    """Boltzmann's equation of a homogeneous gas, solved by chance (Bird): unit mass, unit radius, no places.

    Pairs and directions n are drawn at random and collide with a probability in proportion to |g.n|. No mean
    field, no assumption on distributions or on how spins and velocities go together. Smooth walls turn velocities
    but not spins, which they leave less alike than they were: so there are walls too.
    """
    rng = np.random.default_rng([seed, 77])
    v, w = rng.normal(size=(ORACLE_BALLS, 3)), np.zeros((ORACLE_BALLS, 3))
    start = (v**2).sum()
    count, hits, rows, batch = 0, 0, [], 0
    while not rows or rows[-1][0] < COUNTS[-1]:
        if batch % 10 == 0:
            energy, spin = (v**2).sum(), 0.4 * (w**2).sum()
            rows.append((2 * count / ORACLE_BALLS, np.log(energy / start), spin / energy))
            fastest = 7 * np.sqrt(2 * energy / (3 * ORACLE_BALLS))
            hits += turn_back(v, round(2 * count * WALL_HITS) - hits, fastest, rng)
        count += collide_some(v, w, (e, beta, friction), fastest, rng)
        batch += 1
    return at_counts(*np.array(rows).T)


def turn_back(v, number, fastest, rng):
    """So many velocities are mirrored at walls, with a probability in proportion to |v.n|; returns how many."""
    done = 0
    while done < number:
        some = 16 * (number - done)  # one in some twelve is accepted
        ball = rng.integers(ORACLE_BALLS, size=some)
        n = rng.normal(size=(some, 3))
        n /= np.sqrt((n**2).sum(axis=1))[:, None]
        v_n = (v[ball] * n).sum(axis=1)
        hit = np.flatnonzero(np.abs(v_n) > fastest * rng.random(some))
        hit = hit[np.sort(np.unique(ball[hit], return_index=True)[1])][: number - done]
        v[ball[hit]] -= 2 * v_n[hit, None] * n[hit]
        done += len(hit)
    return done


def collide_some(v, w, law, fastest, rng):
    """Of ORACLE_BATCH random pairs those collide that chance lets; returns how many."""
    e, beta, friction = law
    pairs = rng.integers(ORACLE_BALLS, size=2 * ORACLE_BATCH)
    once = np.zeros(2 * ORACLE_BATCH, dtype=bool)
    once[np.unique(pairs, return_index=True)[1]] = True
    pairs, once = pairs.reshape(2, -1), once.reshape(2, -1).all(axis=0)
    n = rng.normal(size=(ORACLE_BATCH, 3))
    n /= np.sqrt((n**2).sum(axis=1))[:, None]
    g_n = ((v[pairs[0]] - v[pairs[1]]) * n).sum(axis=1)
    if np.abs(g_n).max() > fastest:
        raise RuntimeError("direct simulation: a pair was faster than the assumed maximum")
    # n may point either way: half of the directions are parting, turn them round
    hit = once & (np.abs(g_n) > fastest * rng.random(ORACLE_BATCH))
    (i, j), n, g_n = pairs[:, hit], (n * np.sign(g_n)[:, None])[hit], np.abs(g_n)[hit]

    slip = v[i] - v[j] + np.cross(w[i] + w[j], n)
    slip -= (slip * n).sum(axis=1)[:, None] * n
    normal = (1 + e) / 2 * g_n
    tangential = (1 + beta) / 7 * slip
    size = np.sqrt((tangential**2).sum(axis=1))
    tangential *= np.minimum(1, friction * normal / np.maximum(size, 1e-300))[:, None]
    kick = normal[:, None] * n + tangential
    twist = 2.5 * np.cross(n, kick)
    v[i] -= kick
    v[j] += kick
    w[i] -= twist
    w[j] -= twist
    return len(i)
