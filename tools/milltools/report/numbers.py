"""Numbers as the terminal's summary writes them: four digits and an SI prefix, with the value as it is beside them."""

import dataclasses
import math

PREFIX = {-4: "p", -3: "n", -2: "\N{MICRO SIGN}", -1: "m", 0: "", 1: "k", 2: "M", 3: "G", 4: "T"}
SPACE = "\N{NO-BREAK SPACE}"
THIN = "\N{NARROW NO-BREAK SPACE}"
SUPERSCRIPT = (
    "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ZERO}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}"
    + "".join(chr(0x2070 + digit) for digit in range(4, 10))
)
MISSING = "\N{EN DASH}"


@dataclasses.dataclass(frozen=True)
class Number:
    """What is shown, and the value it stands for."""

    text: str
    value: float

    def __str__(self):
        return self.text


def _scale(value: float) -> tuple[int, int] | None:
    """(thousands, decimals) of four significant digits; None where no prefix fits."""
    if not math.isfinite(value):
        return None
    exponent = 0 if value == 0 else int(f"{value:.3e}".split("e")[1])  # 999.96 is 1.000 k
    if not -12 <= exponent <= 14:
        return None
    thousands = exponent // 3
    return thousands, 3 - (exponent - 3 * thousands)


def _tail(thousands: int, unit: str) -> str:
    tail = PREFIX[thousands] + unit.replace(" ", SPACE)
    return SPACE + tail if tail else ""


def scaled(value: float, unit: str) -> Number:
    """862.4519 W -> "862.5 W", 8977160/s -> "8.977 M/s"; a dash for NaN."""
    value = float(value)
    scale = _scale(value)
    if math.isnan(value):
        return Number(MISSING, value)
    if value == 0:
        return Number(f"0{SPACE}{unit}".rstrip(SPACE), value)
    if scale is None:
        return Number(f"{value:.3e}{SPACE}{unit}".rstrip(SPACE), value)
    return Number(f"{value / 1000.0 ** scale[0]:.{scale[1]}f}{_tail(scale[0], unit)}", value)


def small(value: float) -> Number:
    """1.5e-15 -> "1.5 x 10^-15", as it is printed."""
    value = float(value)
    if value == 0 or not math.isfinite(value):
        return Number("0" if value == 0 else MISSING, value)
    digits, exponent = f"{value:.1e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", SUPERSCRIPT))
    return Number(f"{digits}{THIN}\N{MULTIPLICATION SIGN}{THIN}10{raised}", value)


def count(value) -> Number:
    """1795432 -> "1 795 432"."""
    return Number(f"{int(value):,}".replace(",", THIN), int(value))


def share(value: float) -> Number:
    """Of 1, in per cent."""
    return Number(MISSING if math.isnan(value) else f"{100 * value:.1f}{SPACE}%", float(value))


def with_error(value: float, error: float, unit: str) -> Number:
    """Both on the scale of the larger one: "8.236 +- 0.145 N m". An error that would read 0 has the digits that it takes."""
    scale = (
        _scale(max(abs(value), error)) if math.isfinite(value) and math.isfinite(error) else None
    )
    if scale is None:
        return scaled(value, unit)
    one, decimals = 1000.0 ** scale[0], scale[1]
    while error > 0 and error / one < 10.0**-decimals and decimals < 9:
        decimals += 1
    text = f"{value / one:.{decimals}f} \N{PLUS-MINUS SIGN}{SPACE}{error / one:.{decimals}f}"
    return Number(text + _tail(scale[0], unit), float(value))
