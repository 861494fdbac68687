"""What a comparison has found, in words: a title, the sentences below it, and differences with their 95 % intervals.

Of two designs the title names what the work of the drive buys (impacts of 1 mJ or more per joule), and the power; the
sentences name also the rate of these impacts and the median. Of two programs or starts the title counts the verdicts.
"""

import math

from milltools.base.text import MINUS, number, plain, plural, prefix
from milltools.compare.agreement import NORMAL
from milltools.read.runfile import THRESHOLDS

TOLD = ("rotor_power", "drive_power", "median_above_floor", "kinetic_energy")  # of two programs
NAMED = 4  # keys at most
INTERVALS = "Ranges are 95 % intervals."
KNOWN = ("apart", "tied")  # moods
MANY, MUCH, FAST = ("more", "fewer", "many"), ("more", "less", "much"), ("faster", "slower", "fast")


def _places(half: float) -> int:
    """Decimal places of numbers that are known to +- half."""
    return next((places for places in range(3) if half >= 10.0**-places), 3)


def percent(row) -> str:
    """The difference in per cent, rounded to its error: "+63 %"."""
    places = 0 if row.bare else _places(100 * NORMAL * row.difference_error)
    return f"{100 * row.difference:+.{places}f} %".replace("-", MINUS)


def interval(row) -> str:
    """The 95 % interval of the difference: "+55 to +71 %"."""
    places = _places(100 * NORMAL * row.difference_error)
    return "{:+.{p}f} to {:+.{p}f} %".format(*(100 * end for end in row.interval), p=places).replace("-", MINUS)


def size(row, more: str, less: str, many: str) -> tuple[str, str]:
    """A difference in words, and its 95 % interval: ("63 % more", "55 to 71 %"), ("2.2 times as much", "2.1 to 2.3
    times")."""
    if row.mood != "apart":
        return "tied" if row.mood == "tied" else "undecided", interval(row)
    low, high = row.interval
    if row.difference >= 1:
        places = max(int(row.difference < 99), _places((high - low) / 2))
        ends = "{:.{p}f} to {:.{p}f} times".format(1 + low, 1 + high, p=places)
        return f"{1 + row.difference:.{places}f} times as {many}", ends
    places, word = _places(50 * (high - low)), more if row.difference > 0 else less
    ends = sorted(100 * abs(end) for end in row.interval)  # both have one sign
    return f"{100 * abs(row.difference):.{places}f} % {word}", "{:.{p}f} to {:.{p}f} %".format(*ends, p=places)


def title(table) -> str:
    """The finding in one line."""
    a, b = plain(table.a.name), plain(table.b.name)
    if not table.designs:
        moods = [row.mood for row in table.shown]
        agree, differ = moods.count("agree"), moods.count("differ")
        return f"{b} and {a} agree in {agree} of {len(moods)} quantities and differ in {differ}"
    words, rate, per_joule = table.hard
    known = [(row, per) for row, per in ((per_joule, "joule"), (rate, "second")) if row and row.mood in KNOWN]
    said, same = _made(*known[0], words, a, b) if known else ("", False)
    power = table.power
    if not power or power.mood not in KNOWN or power.bare:
        return said or f"{b} against {a}: {_others(table)}"
    drawn = f"draws {size(power, *MUCH)[0]} power"
    if not said:
        end = f" {'as' if power.difference >= 1 else 'than'} {a}"
        return f"{b} and {a} draw the same power" if power.mood == "tied" else f"{b} {drawn}{end}"
    if power.mood == "tied":
        return f"{said}; their power is tied"
    return f"{said} and {drawn}" if same else f"{said}; {b} {drawn}"


def _made(row, per, words, a, b) -> tuple[str, bool]:
    """The impacts that both sides make, in words, and whether b is what the end of these words is about."""
    what = f"impacts {words} per {per}"
    if row.mood == "tied":
        return f"{b} and {a} are tied in {what}", False
    if row.bare:
        one, two = _values(row.b.value, row.a.value, row.unit)
        return f"{b} makes {one} {what}, {a} makes {two}" if row.b.value else f"{a} makes {two} {what}, {b} none", False
    return f"{b} makes {size(row, *MANY)[0]} {what} {'as' if row.difference >= 1 else 'than'} {a}", True


def _others(table) -> str:
    """What is known to differ where hard impacts and power are not."""
    apart = [row for row in table.shown if row.mood == "apart"]
    if not apart:
        return "what differs is not known"
    first = next(
        (f", such as {row.name} ({percent(row)})" for row in apart if row.group != "maps" and not row.bare), ""
    )
    rows = f"{plural(len(apart), 'row')} of the table differ{'s' * (len(apart) == 1)}"
    return f"{rows}{first}; the errors of power and of impacts {table.hard[0]} are not known well enough"


def sentences(table) -> list[str]:
    """The sentences below the title; the first one is about the same quantities."""
    if not table.designs:
        words = []
        for row in table.shown:
            if row.key in TOLD and math.isfinite(row.difference):
                known = f" {percent(row)}, {interval(row)}" if math.isfinite(row.difference_error) else ""
                words.append(f"{row.label}{known} ({row.verdict})")
        open_ = [row.mood for row in table.shown].count("open")
        return [
            f"{'; '.join(words)}. {INTERVALS}",
            f"{plural(open_, 'row')} of the table {'has' if open_ == 1 else 'have'} no verdict.",
        ]
    a, b = plain(table.a.name), plain(table.b.name)
    words, rate, per_joule = table.hard
    above = f"impacts {words}"
    median, said = table.row("median_above_floor"), []
    for row, words, way in (
        (per_joule, "Per joule of work {b} makes {} {above}, {a} makes {}", MANY),
        (table.power, "{b} draws {}, {a} draws {}", MUCH),
        (rate, "Per second {b} makes {} {above}, {a} makes {}", MANY),
        (median, "The median speed of the impacts above the floor is {} in {b}, {} in {a}", FAST),
    ):
        if row and (math.isfinite(row.difference) or row.bare):
            values = _values(row.b.value, row.a.value, row.unit)
            told = "{} ({})".format(*size(row, *way)) if math.isfinite(row.difference_error) else row.verdict
            end = "" if row.bare else f": {told}"
            said.append(f"{words.format(*values, a=a, b=b, above=above)}{end}.")
    scale = [
        f"{_better(row)} above {speed:g} m/s ({percent(row) if math.isfinite(row.difference) else f'{a} makes none'})"
        for speed in THRESHOLDS
        if (row := table.row(f"hard_per_joule_{speed:g}")) and row.mood != "open"
    ]
    if scale:
        said.append(f"On the scale of impacts per joule, {b} is {', '.join(scale)}.")
    return [" ".join([*said[:2], INTERVALS]), *_mixed(table.keys), *said[2:]]


def _mixed(keys) -> list[str]:
    """A sentence if keys of more than one section of the decks differ: those of other sections than the first one
    first."""
    section = lambda key: key.rpartition(".")[0]  # noqa: E731
    others = [key for key in keys if section(key) != section(keys[0])]
    if not others:
        return []
    named = others + [key for key in keys if key not in others]
    more = f" and {plural(len(named) - NAMED, 'more key')}" if len(named) > NAMED else ""
    shown = ", ".join(map(plain, named[:NAMED])) + more
    return [f"The decks differ in {shown}: this is the effect of all differences together."]


def _better(row) -> str:
    return "tied" if row.mood not in ("apart", "differ") else "better" if row.b.value > row.a.value else "worse"


def _values(one: float, two: float, unit: str) -> tuple[str, str]:
    """Two values with one prefix if they are not very different; large counts in millions, "no" and "none" for 0."""
    low, high = sorted((abs(one), abs(two)))
    if unit.startswith("1"):
        told = (f"{number(value / 1e6)} million" if low >= 1e5 else number(value) for value in (one, two))
        return tuple(words if value else zero for words, value, zero in zip(told, (one, two), ("no", "none")))
    factor, letter = prefix(low if low > high / 1000 else high)
    return tuple(f"{number(value / factor)} {letter}{unit}" for value in (one, two))
