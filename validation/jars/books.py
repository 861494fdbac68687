"""The books of every deck with bodies: nothing is lost."""

import configparser
import pathlib

from jars.common import value

DECKS = pathlib.Path(__file__).resolve().parents[2] / "input"
LONG = {"attritor": "0.3 s", "discs": "0.05 s", "tumbling": "1 s"}  # many balls


def with_bodies():
    for path in sorted(DECKS.glob("*.ini")):
        deck = configparser.ConfigParser(inline_comment_prefixes=("#", ";"), strict=True)
        deck.optionxform = str
        deck.read(path)
        if any(section.startswith("motion.") for section in deck.sections()):
            yield path


def check(case):
    for path in with_bodies():
        name = path.stem
        out = case.run(path, run__time=LONG.get(name, "1 s"), run__sample_from="0 s", output__frames="0 s")
        off, turned, wrong, deep = value(out, "run/energy_balance_error", "run/energy_turnover", "run/not_closing",
                                         "run/overlaps")  # fmt: skip
        case.bound(
            f"input/{path.name}: error of the energy balance, divided by the energy turned over, {turned:.3g} J",
            off,
            1e-9,
            against="work of all motions = change of energy + losses",
        )
        case.bound(
            f"input/{path.name}: number of anomalies (contacts with an opening gap, overlaps)",
            float(wrong) + float(deep),
            0,
            against="none",
        )
