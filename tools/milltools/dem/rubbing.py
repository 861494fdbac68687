"""Energy that friction takes at the walls, from LIGGGHTS' own forces at a few moments.

The power of the tangential forces against the slip, summed over all contacts of a moment and averaged over moments, is
the energy that goes into tangential springs, dashpots and sliding; what the springs give back is in it with its sign. So
the mean over many moments is the loss, however far apart they are. Only its scatter depends on their number.

Between balls this does not work: `compute pair/gran/local` evaluates the contact law once more, after the step, and a
sliding contact whose spring was just cut back to mu F_n then counts as sticking, dashpot added. What friction takes there is
what the balance of energy leaves over (milltools.dem.soft_mill).
"""

import numpy as np

from milltools.dem.setup import SHAFT


def columns_of(contacts, which, found):
    """Of each contact with the wall of number `which`: which of script.walls_of tells its force."""
    walls = contacts.walls[1:]
    wall = walls[which - 1]
    first = sum(len(other.primitives) for other in walls[: which - 1])
    if not wall.primitives:  # one column for all meshes
        first = sum(len(other.primitives) for other in walls)
    if wall.primitives and wall.primitives[0][2] is not None:
        return first + contacts.kind_of_ball[found.ball]
    return first + (found.part if len(wall.primitives) > 1 else 0 * found.part)


def at_walls(contacts, state, forces):
    """Power [W] of the tangential forces by kind (0 for ball_ball), and the torque [N m] of the shaft on the balls
    about +x.

    contacts: a Contacts that has just sampled this state: place, velocity, spin (N, 3); forces (N, W, 3) [N] of the
    W walls (script.walls_of) on the balls.
    """
    place, velocity, spin = state
    power, torque = np.zeros(len(contacts.normal_loss)), 0.0
    touched = [(k, f) for k, f in enumerate(contacts.found) if k and len(f.ball)]
    columns = [columns_of(contacts, which, found) for which, found in touched]
    shared = np.zeros(forces.shape[:2], int)  # a ball between two blades: half of the force to each
    for (_, found), column in zip(touched, columns, strict=True):
        np.add.at(shared, (found.ball, column), 1)
    for (which, contact), column in zip(touched, columns, strict=True):
        here = forces[contact.ball, column] / shared[contact.ball, column][:, None]
        tangential = here - np.einsum("ij,ij->i", here, contact.normal)[:, None] * contact.normal
        slip = contacts.slip(which, contact, place, velocity, spin)
        kind = contacts.kinds[which]
        power[kind] -= np.einsum("ij,ij->", tangential, slip)
        if kind == SHAFT:
            arm = place[contact.ball] - contacts.radius[contact.ball, None] * contact.normal
            torque = float(np.sum(arm[:, 1] * here[:, 2] - arm[:, 2] * here[:, 1]))
    return power, torque
