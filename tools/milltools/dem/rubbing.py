"""Energy that friction takes at the walls, from LIGGGHTS' own forces at a few moments.

The power of the tangential forces against the slip, summed over all contacts of a moment and averaged over moments, is
the energy that goes into tangential springs, dashpots and sliding; what the springs give back is in it with its sign. So
the mean over many moments is the loss, however far apart they are. Only its scatter depends on their number.

Between balls this does not work: `compute pair/gran/local` evaluates the contact law once more, after the step, and a
sliding contact whose spring was just cut back to mu F_n then counts as sticking, dashpot added. What friction takes there is
what the balance of energy leaves over (milltools.dem.mill).
"""

import numpy as np

WALLS = {1: ("drum",), 2: ("wall0", "wall1"), 3: ("shaft",), 4: ("blades",)}


def walls_of(deck):
    """Names of the walls of a deck in the order in which LIGGGHTS tells their forces."""
    return (
        ["drum", "wall0", "wall1"]
        + ["shaft"] * (deck.shaft_radius > 0)
        + ["blades"] * bool(deck.blades)
    )


def at_walls(contacts, walls, state, forces):
    """Power (5,) [W] of the tangential forces by kind (0 for ball_ball), and the torque [N m] of the shaft on the balls
    about +x.

    contacts: a Contacts that has just sampled this state: place, velocity, spin (N, 3); forces (N, 3 W) [N] of the
    `walls` on the balls.
    """
    place, velocity, spin = state
    power, torque = np.zeros(5), 0.0
    for kind, names in WALLS.items():
        contact = contacts.found[kind]
        if contact is None or not len(contact.ball):
            continue
        total = sum(forces[:, 3 * k : 3 * k + 3] for k, name in enumerate(walls) if name in names)
        here = total[contact.ball]
        if kind == 4:  # a ball between two blades: half of the force to each
            here = here / np.bincount(contact.ball, minlength=contacts.count)[contact.ball, None]
        tangential = here - np.einsum("ij,ij->i", here, contact.normal)[:, None] * contact.normal
        slip = contacts.slip(kind, contact, place, velocity, spin)
        power[kind] = -np.einsum("ij,ij->", tangential, slip)
        if kind == 3:
            arm = place[contact.ball] - contacts.radius[contact.ball, None] * contact.normal
            torque = float(np.sum(arm[:, 1] * here[:, 2] - arm[:, 2] * here[:, 1]))
    return power, torque
