"""Bond's laboratory mill, with nothing fitted"""

import math

from charges import MODULUS, SEEDS, Charge, claim, verdicts
from points import FORMULAS
from runs import ROOT, say

from milltools.power import drum
from milltools.read.deck import Deck

DECK = ROOT / "input" / "bond.ini"
TURN = 60 / 70  # [s]
PUBLISHED = (60, 93)  # [J] a revolution: implied by the work index; Bond 1949. A meter gave 91.4
FRICTIONS = (0.2, 0.5)  # beside the 0.3 of the deck


def check(case):
    say("    Bond's mill")
    hard = case.seeds(SEEDS, DECK)
    found = verdicts([case.dem("tumbling-bond", DECK, MODULUS, run__starts=1)], hard)
    *claimed, rare = found
    for verdict in claimed:
        claim(case, verdict, "Bond's mill")
    case.tell(f"No claim, for they are rare: {rare.hard:.0f} impacts a second above 1 m/s, LIGGGHTS {rare.soft:.0f}.")
    power, scatter = found[0].hard, found[0].scatter / 100 * found[0].soft
    low, high = PUBLISHED
    case.claim(
        "Bond's mill: energy of a revolution, nothing fitted",
        power * TURN,
        (low + high) / 2,
        (high - low) / 2,
        error=scatter * TURN / math.sqrt(SEEDS),
        unit="J",
        against=f"published: {low} to {high} J",
        headline=True,
    )
    mill = drum.mill_of(Deck.check(DECK))
    told = ", ".join(f"{name} {value(mill):.1f} W" for name, value in FORMULAS.items())
    case.tell(f"Bond's mill draws {power:.1f} W. The formulas: {told}. Published: 70 to 108 W.")
    for friction in FRICTIONS:
        runs = [Charge(path) for path in case.seeds(2, DECK, contact__friction=friction)]
        values = [run.values["power"] for run in runs]
        case.tell(
            f"With a friction of {friction:g}: {sum(values) / len(values):.1f} W, "
            f"{sum(values) / len(values) * TURN:.0f} J a revolution."
        )
