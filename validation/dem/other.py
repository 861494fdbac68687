"""Another mill: 600 rpm and 2500 balls, slower and emptier, against LIGGGHTS at steel stiffness."""

from runs import ROOT, say
from steady import compare

SETTINGS = {
    "rotor__speed": "600 rpm",
    "balls__count": 2500,
    "run__time": "0.6 s",
    "run__sample_from": "0.2 s",
}


def check(case):
    say("    another speed and fill")
    compare(case, "other", "600 rpm, 2500 balls", ROOT / "input" / "simoloyer.ini", SETTINGS)
