"""Other mills: 600 rpm and 2500 balls at steel stiffness; and restitution 0.5, where the two programs do not agree."""

from mills import STEADY, Window, judge
from runs import ROOT, say
from steady import compare, own_friction

DECK = ROOT / "input" / "simoloyer.ini"
SETTINGS = {
    "rotor__speed": "600 rpm",
    "balls__count": 2500,
    "run__time": "0.6 s",
    "run__sample_from": "0.2 s",
}
INELASTIC_SEEDS = 4
INELASTIC = {"contact__restitution": 0.5, "run__time": "0.4 s", "run__sample_from": "0.1 s"}


def check(case):
    say("    another speed and fill")
    compare(case, "other", "600 rpm, 2500 balls", DECK, SETTINGS)
    inelastic(case)


def inelastic(case):
    """Restitution 0.5 with friction 0.3 at 1e10 Pa: not claimed, told."""
    soft = case.dem("inelastic", DECK, "1e10", **INELASTIC)
    own = own_friction(soft)
    pair = own["contact__ball_ball__friction"], own["contact__ball_ball__tangential_restitution"]
    effective = f"LIGGGHTS' effective friction (pairs: {pair[0]:.3f}, tangential restitution {pair[1]:.3f})"
    for settings, text in (({}, "the deck's friction"), (own, effective)):
        hard = [Window(path) for path in case.seeds(INELASTIC_SEEDS, DECK, **INELASTIC, **settings)]
        verdicts = [judge(quantity, [Window(soft)], hard) for quantity in STEADY[:5]]
        off = ", ".join(f"{v.off:+.1f} +- {v.error:.1f} % ({v.quantity.name})" for v in verdicts)
        case.tell(
            f"Restitution 0.5, friction 0.3, LIGGGHTS at 1e10 Pa, 1000 rpm, 4000 balls: with {text}, "
            f"millsim deviates from LIGGGHTS by {off}."
        )
