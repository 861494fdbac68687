"""Formats numbers, units and names for readers: alike in pictures, pages, terminals and tables."""

import dataclasses
import math

PREFIXES = dict(zip(range(-4, 5), ("p", "n", "µ", "m", "", "k", "M", "G", "T")))  # powers of 1000
COUNTS = {1: "thousand", 2: "million", 3: "billion", 4: "trillion"}  # the same of numbers of things and their rates
SPACE = "\N{NO-BREAK SPACE}"
THIN = "\N{NARROW NO-BREAK SPACE}"
MISSING = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


# ---- names and lines from files


def plain(text, keep: str = "") -> str:
    """A text from a file without control characters for terminals or pages; `keep`: control characters to keep."""
    return "".join(c if c.isprintable() or c in keep else "?" for c in str(text))


def lines(text) -> str:
    """`plain` for a text of several lines."""
    return plain(text, keep="\n\t")


def literal(text, most: int = 60) -> str:
    """A name as text for matplotlib: without mathematics and control characters, of at most `most` characters."""
    text = plain(text)
    if len(text) > most:
        text = text[: most // 2 - 1] + "..." + text[-(most // 2 - 2) :]
    # matplotlib leaves names that begin with "_" out of legends, unless a character of no width is in front
    text = "\N{WORD JOINER}" * text.startswith("_") + text
    return text.replace("\\", "/").replace("$", r"\$")


def cell(text) -> str:
    """A name as a cell of a CSV file: spreadsheets must not take it for a formula."""
    text = plain(text)
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text


def plural(number: int, noun: str) -> str:
    """1 frame, 31 frames."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def columns(rows, left=()) -> list[str]:
    """Rows of texts as lines, `plain`, each column as wide as its widest cell; those in `left` are flush left."""
    rows = [[plain(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    aligned = [[f"{c:<{w}}" if k in left else f"{c:>{w}}" for k, (c, w) in enumerate(zip(row, widths))] for row in rows]
    return ["  ".join(row).rstrip() for row in aligned]


# ---- numbers


def spoken_unit(unit: str) -> str:
    """A unit as people write it: "m s-1" -> "m/s", "W m-2" -> "W/m²", "1" -> ""; a text that is not a product of units
    stays as it is."""
    over, under = [], []
    for factor in unit.split():
        letters = factor.rstrip("-0123456789")
        power = factor[len(letters) :]
        if not letters:
            return "" if unit == "1" else unit
        raised = letters + ("" if power.lstrip("-") in ("", "1") else power.lstrip("-").translate(SUPERSCRIPT))
        (under if power.startswith("-") else over).append(raised)
    below = " ".join(under)
    if len(under) > 1:
        below = f"({below})"
    return " ".join(over) + (f"/{below}" if under and over else "") or (f"1/{below}" if under else "")


def number(value: float, digits: int = 3) -> str:
    """A number as text, such as 862, 0.0123 and 7.17×10⁶; "?" if it is not finite."""
    if not math.isfinite(value):
        return "?"
    text = f"{value:.{digits}g}"
    if "e" not in text and (value == 0 or 1e-3 <= abs(value)):
        return text.replace("-", MINUS)
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    exponent = int(exponent)
    if 0 <= exponent < 4:  # 1.23e+03
        return f"{value:.0f}".replace("-", MINUS)
    return f"{mantissa}×10{str(exponent).translate(SUPERSCRIPT)}".replace("-", MINUS)


def _exponent(value: float, digits: int) -> int:
    """The power of ten of a value rounded to so many digits: 999.96 with four digits is 1.000 k."""
    return int(f"{abs(value):.{digits - 1}e}".split("e")[1])


def prefix(value: float, digits: int = 3) -> tuple[float, str]:
    """(factor, its SI prefix) that suit a value of so many digits: 31.4e-6 -> (1e-6, "µ")."""
    if not math.isfinite(value):
        return 1.0, ""
    thousands = min(max(_exponent(value, digits) // 3, min(PREFIXES)), max(PREFIXES))
    return 1000.0**thousands, PREFIXES[thousands]


def _counted(unit: str) -> bool:
    """Whether a unit takes no prefix: "M/s" would look like metres per second, "m/J" like metres per joule."""
    return not unit or unit.startswith(("/", "1/", "%"))


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """A number with its unit and prefix, as in 862 W and 31.4 µW."""
    factor, letter = (1.0, "") if _counted(unit) else prefix(value, digits)
    return f"{number(value / factor, digits)} {letter}{unit}".rstrip()


def decade(value: float) -> str:
    """A label of a logarithmic axis: a whole power of ten as text, "" for other numbers."""
    exponent = math.log10(value)
    if abs(exponent - round(exponent)) > 1e-6:
        return ""
    exponent = round(exponent)
    return f"{value:g}" if -3 <= exponent <= 2 else "10" + str(exponent).translate(SUPERSCRIPT)


def duration(seconds: float) -> str:
    """42 s, 12 min, 3.5 h, 2.5 days; "?" if not finite."""
    if not math.isfinite(seconds):
        return "?"
    scales = ((120, 1, 0, "s"), (7200, 60, 0, "min"), (360_000, 3600, 1, "h"), (math.inf, 86_400, 1, "days"))
    size, digits, unit = next(scale for most, *scale in scales if seconds < most)
    return f"{seconds / size:.{digits}f} {unit}"


def size(count: float) -> str:
    """A number of bytes: 6.2 MB."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 999.5 or unit == "GB":
            return f"{count:.0f} {unit}" if unit == "bytes" else f"{count:.3g} {unit}"
        count /= 1000
    return ""


# ---- numbers of pages: the text together with the exact value


@dataclasses.dataclass(frozen=True)
class Number:
    """The text to show, and its exact value."""

    text: str
    value: float

    def __post_init__(self):
        object.__setattr__(self, "text", self.text.replace("-", MINUS))

    def __str__(self):
        return self.text


def _scale(value: float, unit: str) -> tuple[float, int, str] | None:
    """(divisor, decimals, what follows the number) for four significant digits; None if no prefix fits."""
    exponent = _exponent(value, 4) if math.isfinite(value) else math.inf
    thousands, unit = exponent // 3, unit.replace(" ", SPACE)
    if thousands not in PREFIXES:
        return None
    tail = f"{SPACE}{unit}" if unit else ""
    if not _counted(unit):
        tail = f"{SPACE}{PREFIXES[thousands]}{unit}"
    elif thousands > 0:
        tail = f"{SPACE}{COUNTS[thousands]}{unit.removeprefix('1')}"
    elif exponent < -3:
        return 10.0**exponent, 3, f"{THIN}\N{MULTIPLICATION SIGN}{THIN}10{str(exponent).translate(SUPERSCRIPT)}{tail}"
    else:
        thousands = 0
    return 1000.0**thousands, 3 - exponent + 3 * thousands, tail


def scaled(value: float, unit: str) -> Number:
    """862.4519 W -> "862.5 W", 8977160/s -> "8.977 million/s"; a dash for NaN."""
    value = float(value)
    scale = _scale(value, unit)
    if math.isnan(value):
        return Number(MISSING, value)
    if value == 0:
        return Number(f"0{SPACE}{unit}".rstrip(SPACE), value)
    if scale is None:
        return Number(f"{value:.3e}{SPACE}{unit}".rstrip(SPACE), value)
    one, decimals, tail = scale
    return Number(f"{value / one:.{decimals}f}{tail}", value)


def degrees(angle: float, error: float = math.nan) -> Number:
    """An angle [rad], with its error if it is known: "146.4 ± 3.3°"; a dash for NaN."""
    value, digits = math.degrees(angle), 2 if math.degrees(error) < 0.1 else 1
    more = f" \N{PLUS-MINUS SIGN}{SPACE}{math.degrees(error):.{digits}f}" if math.isfinite(error) else ""
    return Number(MISSING if math.isnan(value) else f"{value:.{digits}f}{more}°", float(value))


def brief(value: float, error: float, unit: str) -> Number:
    """With few digits: "862 ± 9 W". The error has one digit, or two if the first one is 1 or 2; without an error the
    value has three digits."""
    known = 0 < error < math.inf
    scale = _scale(max(abs(value), error) if known else abs(value), unit)
    if scale is None or not value:
        return scaled(value, unit)
    one, decimals, tail = scale
    places, more = decimals - 1, ""
    if known:
        first, exponent = f"{error / one:.0e}".split("e")
        places = max(0, (first in "12") - int(exponent))
        more = f"{SPACE}\N{PLUS-MINUS SIGN}{SPACE}{error / one:.{places}f}"
    return Number(f"{value / one:.{places}f}{more}{tail}", float(value))


def column(values, unit: str) -> list[Number]:
    """Numbers of a column of a table, all on the scale of the largest one, with as many decimals as it needs."""
    values = [float(value) for value in values]
    scale = _scale(max((abs(value) for value in values if math.isfinite(value)), default=0.0), unit)
    if scale is None or not any(values):
        return [scaled(value, unit) for value in values]
    one, decimals, tail = scale
    least = 10.0**-decimals
    texts = (f"{v / one:.{decimals}f}" if not 0 < abs(v) / one < least / 2 else f"<{SPACE}{least:g}" for v in values)
    return [Number(MISSING if math.isnan(v) else text + tail, v) for v, text in zip(values, texts)]


def small(value: float) -> Number:
    """1.5e-15 -> "1.5 × 10⁻¹⁵"."""
    value = float(value)
    if value == 0 or not math.isfinite(value):
        return Number("0" if value == 0 else MISSING, value)
    digits, exponent = f"{value:.1e}".split("e")
    raised = str(int(exponent)).translate(SUPERSCRIPT)
    return Number(f"{digits}{THIN}\N{MULTIPLICATION SIGN}{THIN}10{raised}", value)


def count(value) -> Number:
    """1795432 -> "1 795 432"."""
    return Number(f"{int(value):,}".replace(",", THIN), int(value))


def share(value: float) -> Number:
    """A share of 1 in per cent."""
    return Number(MISSING if math.isnan(value) else f"{100 * value:.1f}{SPACE}%", float(value))


def with_error(value: float, error: float, unit: str) -> Number:
    """Both on the scale of the larger one: "8.236 ± 0.145 N m". An error that would be rounded to 0 gets more
    digits."""
    scale = _scale(max(abs(value), error), unit) if math.isfinite(value + error) else None
    if scale is None:
        return scaled(value, unit)
    one, decimals, tail = scale
    while error > 0 and error / one < 10.0**-decimals and decimals < 9:
        decimals += 1
    text = f"{value / one:.{decimals}f} \N{PLUS-MINUS SIGN}{SPACE}{error / one:.{decimals}f}"
    return Number(text + tail, float(value))
