"""How long a run still takes, from the pace of its last publications, and how certain this is."""

import dataclasses
import math

from milltools.base.text import duration

KEPT = 6  # publications that are remembered
FEW = 3  # publications
ONE = 1.3  # factor of uncertainty of an estimate from a single publication
ALIKE = 1.2  # two ends of an estimate closer than this factor are said as one
LATE = 2.0  # news that is older than so many intervals widens the estimate
# of the window that a precision needs, if the error falls with its root: errors are themselves known to some 20 %
ROOT = (0.6, 1.7)
MEASURES = {"median_above_floor": "median", "drive_power": "power"}


@dataclasses.dataclass(frozen=True)
class Precision:
    """`asked`: relative; `errors`: relative errors by name (NaN: not known), `window` [s], `warm_up` [s]."""

    asked: float
    errors: dict[str, float]
    window: float
    warm_up: float
    settled: bool

    @classmethod
    def of(cls, run) -> "Precision | None":
        place = "precision"
        if not run.has(f"statistics/{place}/asked"):
            return None
        errors = {}
        for name, words in MEASURES.items():
            value, error = (float(run.statistic(f"{place}/{name}/{part}")) for part in ("value", "standard_error"))
            if name != "drive_power" or run.driven:
                errors[words] = abs(error / value) if value else math.nan
        asked, warm_up = (float(run.statistic(f"{place}/{name}")) for name in ("asked", "warm_up"))
        return cls(asked, errors, run.duration / run.starts, warm_up, bool(run.statistic(f"{place}/settled")))

    def ends(self, latest: float) -> tuple[float, float]:
        """The earliest and latest simulated time [s] at which the run will probably end."""
        worst = max(self.errors.values(), default=math.nan)
        if not (self.settled and worst < math.inf and self.window > 0):
            return self.warm_up + self.window, latest
        needed = max(worst / self.asked, 1.0) ** 2 * self.window
        return tuple(min(max(self.warm_up + root * needed, self.warm_up + self.window), latest) for root in ROOT)

    def __str__(self):
        if not self.settled:
            return f"start-up not over; wanted: {100 * self.asked:.2g} %"
        known = {name: f"known to {100 * e:.2g} %" if e < math.inf else "not known" for name, e in self.errors.items()}
        return f"{', '.join(map(' '.join, known.items()))}; wanted: {100 * self.asked:.2g} %"


class Pace:
    """The publications of a run: elapsed (wall-clock) time of the run [s] and simulated time [s], contacts."""

    def __init__(self):
        self.known: list[tuple[float, float, float]] = []

    def add(self, wall: float, time: float, contacts: float):
        if self.known and not (wall > self.known[-1][0] and time >= self.known[-1][1]):
            self.known.clear()  # another run
        self.known = [*self.known[-KEPT + 1 :], (wall, time, contacts)]

    @property
    def steps(self) -> list[tuple[float, float, float]]:
        """(elapsed time, simulated time, contacts) from each publication to the next; if there are few, from the start
        too."""
        rows = [(0.0, 0.0, 0.0), *self.known] if len(self.known) < FEW else self.known
        return [tuple(b - a for a, b in zip(*pair)) for pair in zip(rows, rows[1:])]

    @property
    def interval(self) -> float:
        """Elapsed time from the publication before to the last one [s]."""
        return self.steps[-1][0] if self.known else 0.0

    @property
    def rates(self) -> tuple[float, float]:
        """Simulated seconds and contacts per second of elapsed time."""
        wall, time, contacts = self.steps[-1] if self.known else (0.0, 0.0, 0.0)
        return (time / wall, contacts / wall) if wall > 0 else (math.nan, math.nan)

    def left(self, earliest: float, latest: float, age: float) -> tuple[float, float] | None:
        """Lower and upper estimate of the time left [s] of a run that ends between two simulated times; age [s]: of the
        last publication. None if nothing is known."""
        paces = [time / wall for wall, time, _ in self.steps if time > 0 and wall > 0]
        if not paces:
            return None
        unsure = ONE if len(paces) == 1 else 1.0
        low = (earliest - self.known[-1][1]) / (max(paces) * unsure)
        high = (latest - self.known[-1][1]) / (min(paces) / unsure)
        late = age > LATE * self.interval
        return max(low - age, 0.0), max(high - (0.0 if late else age), 0.0)


def told(low: float, high: float) -> str:
    """Such as "about 4 min left", "about 3 min to 2.0 h left", "at most 10 min left"."""
    if high < ALIKE * low or high < 2:
        return f"about {duration(max(1, (low + high) / 2))} left"
    if low < 1:
        return f"at most {duration(high)} left"
    return f"about {duration(low)} to {duration(high)} left"
