"""Colours of the balls, or of the wear of the parts: a value for each ball or facet, limits for a whole film, a map."""

import dataclasses
from collections.abc import Callable

import matplotlib
import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import number, prefix
from milltools.dose.wear import SHOWN as WEAR
from milltools.figures.style import SPEEDS, log_marks, rounded_up
from milltools.figures.wear import limits as wear_limits
from milltools.geometry.trajectory import stored
from milltools.read.wear import Wear

SHARE = 0.99  # of the balls are within the default limits
MAPS = {"speeds": SPEEDS, "turbo": matplotlib.colormaps["turbo"]}
TABLES = {name: (made(np.arange(256))[:, :3] * 255 + 0.5).astype(np.uint8) for name, made in MAPS.items()}
LOOKED_AT = 12  # number of frames for the default limits


@dataclasses.dataclass(frozen=True)
class Quantity:
    """A quantity: `label` at the bar, SI `unit`, and a function of a state and the masses of the balls."""

    label: str
    unit: str
    values: Callable


QUANTITIES = {
    "speed": Quantity("speed", "m/s", lambda state, mass: state.speed),
    "spin": Quantity("spin", "rad/s", lambda state, mass: np.linalg.norm(state.angular_velocity, axis=1)),
    "energy": Quantity("kinetic energy", "J", lambda state, mass: 0.5 * mass * (state.velocity**2).sum(axis=1)),
    "impact": Quantity("speed of last impact", "m/s", lambda state, mass: state.value),
}


@dataclasses.dataclass(frozen=True)
class Colour:
    """`quantity` (of QUANTITIES, or WEAR: logarithmic) within `limits` (low, high) [SI], in the colours of `map` (of
    MAPS)."""

    quantity: str
    limits: tuple[float, float]
    map: str = "speeds"
    seen: str = ""  # from where, if not from the laboratory

    def values(self, state, run) -> np.ndarray:
        """The value of every ball (N,) [SI]; NaN where a ball has none yet."""
        return QUANTITIES[self.quantity].values(state, run.balls("mass"))

    def rgb(self, values) -> np.ndarray:
        """Colours (N, 3) uint8; values beyond a limit have the colour of the limit, NaN is grey."""
        share = self.share(np.asarray(values, float))
        known = np.isfinite(share)
        index = np.clip(np.where(known, share, 0.0) * 256, 0, 255).astype(int)
        return np.where(known[:, None], TABLES[self.map][index], np.uint8(150))

    @property
    def worn(self) -> bool:
        return self.quantity in WEAR

    def share(self, values):
        """Values [SI] as shares 0..1 of the limits."""
        low, high = self.limits
        if self.worn:
            values = np.log(np.where(np.asarray(values) > 0, values, np.nan))  # without wear: grey
            low, high = np.log(self.limits)
        return (values - low) / (high - low)

    # ---- for the bar

    def marks(self) -> list[tuple[float, str]]:
        """Shares of a logarithmic bar, with their labels."""
        divisor = self.scale[0]
        found = log_marks(*(limit / divisor for limit in self.limits))
        return [(float(self.share(mark * divisor)), number(mark)) for mark in found]

    @property
    def scale(self) -> tuple[float, str]:
        """(divisor, unit) for the numbers at the bar."""
        if self.worn:
            _, unit, factor = WEAR[self.quantity]
            return 1 / factor, unit
        unit, top = QUANTITIES[self.quantity].unit, max(map(abs, self.limits))
        if unit != "J":
            return 1.0, unit
        factor, letter = prefix(top)
        return factor, letter + unit

    @property
    def title(self) -> str:
        """Such as "speed [m/s]"."""
        label = WEAR[self.quantity][0] if self.worn else QUANTITIES[self.quantity].label
        return f"{label}{self.seen} [{self.scale[1]}]"


def shared(runs, quantity: str) -> tuple[float, float]:
    """The limits of the colours [SI] for runs that are shown together: from 0 to a short number that only few balls of
    any of the runs exceed; of wear both ends. UserError for runs without it."""
    if quantity in WEAR:
        found = [Wear(run) for run in runs]
        if not any((wear[quantity] > 0).any() for wear in found):
            why = "the deck has no coefficients for it in [wear]" if quantity == "archard_rate" else "no impacts"
            raise UserError(f"{runs[0].path}: no {WEAR[quantity][0]}: {why}")
        return wear_limits(found, quantity)
    return 0.0, rounded_up(max(_top(run, quantity) for run in runs))


def of(run, quantity: str, limits=None, colours="speeds") -> Colour:
    """The colours (of MAPS) of a milltools.read.runfile.Run. `limits` (low, high) [SI]; default: those of `shared`."""
    low, high = map(float, limits or shared([run], quantity))
    if not (np.isfinite([low, high]).all() and low < high):
        raise UserError(f"--limits: expected two numbers, the lower first; got {low:g}, {high:g}")
    return Colour(quantity, (low, high), colours, seen(run, quantity))


def seen(run, quantity: str) -> str:
    """From where a speed is seen, in words; "": from the laboratory."""
    return " in the container" if quantity == "speed" and run.has("observables/frame_spin/value") else ""


def _top(run, quantity) -> float:
    """The value below which SHARE of the balls are in the frames of a run."""
    if quantity == "impact":
        return _top_impact(run)
    times = run.frame_times()
    if len(times) == 0:
        raise UserError(
            f"{run.path}: no ball states are stored (output.frames = 0 s) to find the range of the colours from: "
            "give it with --limits LOW,HIGH"
        )
    # without the first frame, which shows the start state
    chosen = np.unique(np.linspace(min(1, len(times) - 1), len(times) - 1, LOOKED_AT).astype(int))
    found = [QUANTITIES[quantity].values(stored(run, int(index)), run.balls("mass")) for index in chosen]
    return float(np.quantile(np.concatenate(found), SHARE))


def _top_impact(run) -> float:
    """The limit for impact speeds: from the spectrum of impacts, or, if nothing was sampled, from the fastest balls."""
    if run.has("statistics/impacts/all/normal_speed/histogram/count"):
        histogram = run.histogram("all")
        total = histogram.count.sum()
        if total > 0:
            reached = np.searchsorted(np.cumsum(histogram.count), 0.98 * total)
            return float(histogram.edges[min(reached + 1, len(histogram.edges) - 1)])
    return 0.5 * _top(run, "speed")
