"""A number with its standard error and its unit."""

import dataclasses
import math

SHOWN = 4  # digits of a value without an error


@dataclasses.dataclass(frozen=True)
class Measurement:
    """`value` and its standard `error` (NaN where it is not known) in `unit`, SI as the file writes it ("m s-1").

    float(m) is the value. Its text has only the digits that the error allows: "862.5 +- 15.1 W".
    """

    value: float
    error: float
    unit: str

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        unit = {"m s-1": "m/s"}.get(self.unit, self.unit)
        if not math.isfinite(self.error) or self.error <= 0 or not math.isfinite(self.value):
            return f"{self.value:.{SHOWN}g} {unit}"
        digits = max(2 - math.floor(math.log10(self.error)), 0)  # three of the error
        return f"{self.value:.{digits}f} +- {self.error:.{digits}f} {unit}"

    __repr__ = __str__
