"""From a soft run to a stiffer one: the same balls, without the overlaps that soft springs allow.

Stiffer springs would throw balls apart that overlap as soft ones do, with many times the energy. So overlapping
bodies are moved apart first, each pair by half; the balls keep their velocities.
"""

import numpy as np

from milltools.base.errors import UserError

ROUNDS = 400
CLOSED = 1e-7  # of the largest radius: overlaps that count as none


def part(contacts, time, place, velocity):
    """Places (N, 3) [m] without overlaps near the given ones; the largest shift [m] comes second."""
    place, begin = place.copy(), place.copy()
    enough = CLOSED * contacts.radius.max()
    for _ in range(ROUNDS):
        contacts.outer_until = contacts.inner_until = -np.inf
        shift = np.zeros_like(place)
        deepest = 0.0
        for kind, found in enumerate(contacts.find(time, place, velocity)):
            if found is None or not len(found.ball):
                continue
            deepest = max(deepest, found.overlap.max())
            away = (found.overlap + enough / 2)[:, None] * found.normal
            if kind == 0:
                np.add.at(shift, found.ball, away / 2)
                np.add.at(shift, found.partner, -away / 2)
            else:
                np.add.at(shift, found.ball, away)
        if deepest <= enough:
            return place, float(np.linalg.norm(place - begin, axis=1).max())
        place += shift
    raise UserError(
        f"the soft start leaves overlaps of {deepest:.2g} m that cannot be undone: choose a stiffer --warm-up",
        1,
    )
