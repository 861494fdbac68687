"""Around one of the twelve points: the contact law, two sizes of balls, worn lifters"""

import dataclasses

from charges import MODULUS, SEEDS, claim, claim_errors, listed, verdicts
from points import FLOOR
from runs import say
from steady import own_friction

from milltools.dem.model import sticking_restitution

TIME = {"run__time": "10 s"}


def law(restitution=0.8, friction=0.3, sticking=None):
    """Settings of a contact law; sticking: the tangential restitution, by default the one that LIGGGHTS has."""
    tangential = sticking_restitution(restitution) if sticking is None else sticking
    return {
        "contact__restitution": restitution,
        "contact__friction": friction,
        "contact__tangential_restitution": round(tangential, 3),
    }


@dataclasses.dataclass(frozen=True)
class Mill:
    """A mill beside that of the centre: its name, what it is, its settings and deck, and the keys of the quantities
    that are known to be off as at the points."""

    name: str
    what: str
    settings: dict = dataclasses.field(default_factory=dict)
    deck: str = "deck.ini"
    off: tuple = ()


MILLS = [
    Mill("e0.3", "e 0.3", law(restitution=0.3), off=("kinetic", "shoulder")),
    Mill("e0.5", "e 0.5", law(restitution=0.5), off=("kinetic", "shoulder")),
    Mill("e0.9", "e 0.9", law(restitution=0.9), off=("kinetic", "shoulder")),
    Mill("mu0.1", "friction 0.1", law(friction=0.1), off=("kinetic", "shoulder")),
    Mill("mu0.5", "friction 0.5", law(friction=0.5), off=("kinetic",)),
    Mill("mu0.7", "friction 0.7", law(friction=0.7), off=("kinetic",)),
    Mill("sizes", "balls of 22 and 15 mm", deck="sizes.ini"),
    Mill("worn", "worn lifters", {"run__time": "20 s"}, "worn.ini", ("kinetic",)),
    Mill(
        "elastic", "e 0.3, no dashpot along the surface", law(restitution=0.3, sticking=1), off=("kinetic", "shoulder")
    ),
]
FLAT = "with two sizes, occupancy along the wall hardly falls where it is half: starts differ by some degrees"
FEW = "one run of LIGGGHTS has some 3000 of them in its 7 to 17 s, and they come in groups"
OWN = ("e0.3", "e0.5")  # also with the friction that LIGGGHTS has there


def check(case):
    say("    around 70 % of critical, J 30 %")
    found = []
    for mill in MILLS:
        deck = case.folder / mill.deck
        own = TIME | mill.settings
        soft = case.dem(f"tumbling-{mill.name}", deck, MODULUS, **own)
        found.append(verdicts([soft], case.seeds(SEEDS, deck, **own)))
        for verdict in found[-1]:
            claim(case, verdict, mill.what, known=FLOOR if verdict.quantity.key in mill.off else "")
        if mill.name in OWN:
            rubs = own_friction(soft)
            told = verdicts([soft], case.seeds(SEEDS, deck, **own | rubs))
            friction = rubs["contact__ball_ball__friction"]
            case.tell(f"{mill.what}, with LIGGGHTS' own friction of {friction:.2f} in single impacts: {listed(told)}.")
    claim_errors(case, found, {"shoulder": FLAT, "fast": FEW})
