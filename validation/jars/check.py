"""Mills whose walls move: planetary mills, mixers, shakers.

README.md says what is claimed, from where, and how closely.
"""

from jars import (
    books,
    circle,
    figures,
    floors,
    mixer,
    prisms,
    ratio,
    release,
    scaling,
    shaken,
    smooth,
    twins,
)


def check(case):
    shaken.check(case)
    mixed = mixer.check(case)
    circle.check(case)
    release.check(case)
    _, curves = twins.check(case)
    scaling.check(case)
    swings = smooth.check(case)
    sizes = prisms.check(case)
    told = ratio.check(case)
    books.check(case)
    floors.check(case)
    figures.ratio(case, told)
    figures.same(case, curves, mixed)
    figures.swing_and_prisms(case, swings, sizes)
