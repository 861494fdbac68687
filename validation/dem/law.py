"""LIGGGHTS' contact law, integrated here: what its single impacts must be at a given time step.

`model hooke tangential history`, limitForce off, as in the sources of LIGGGHTS 3.8 (tangential_model_history.h): the
tangential spring is cut to mu |Fn| where it is larger, and only where it is not cut the dashpot comes on top. The
steps are those of `fix nve/sphere` (velocity Verlet; forces see the velocities of the half step).
"""

import numpy as np


def impact(spring, friction, ratio, gap, speed, step, damped=True):
    """Solid spheres of no spin that meet: (restitution (A,), slip after over normal speed before (A,)).

    spring: milltools.dem.model.Spring; ratio (A,): slip over normal speed before; gap (A,) [m] before they touch;
    speed [m/s] along the normal; step [s]. The normal does not turn.
    """
    gap, ratio = np.array(gap, float), np.array(ratio, float)
    closing, slip = np.full(ratio.shape, speed), ratio * speed
    shear = np.zeros(ratio.shape)
    mass, mass_t = spring.mass, spring.mass * 2 / 7
    stiffness_t = spring.stiffness * 2 / 7
    damping_t = spring.damping if damped else 0.0
    normal = tangential = np.zeros(ratio.shape)
    for _ in range(int((gap.max() / speed + 1.5 * spring.duration) / step) + 1):
        closing = closing - 0.5 * step * normal / mass
        slip = slip + 0.5 * step * tangential / mass_t
        gap = gap - step * closing
        touching = gap < 0
        normal = np.where(touching, -spring.stiffness * gap + spring.damping * closing, 0.0)
        shear = np.where(touching, shear + slip * step, 0.0)
        pull, most = stiffness_t * shear, friction * np.abs(normal)
        slides = np.abs(pull) > most
        cut = np.where(slides, np.sign(pull) * most, pull)
        shear = cut / stiffness_t
        tangential = -np.where(slides, cut, cut + damping_t * slip) * touching
        closing = closing - 0.5 * step * normal / mass
        slip = slip + 0.5 * step * tangential / mass_t
    return -closing / speed, slip / speed
