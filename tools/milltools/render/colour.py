"""What the balls are coloured by: a value for each, limits that hold for a whole film, a colour map."""

import dataclasses
from collections.abc import Callable

import matplotlib
import numpy as np

from milltools.base.errors import UserError
from milltools.base.text import prefix
from milltools.figures.style import SPEEDS
from milltools.geometry.trajectory import stored

SHARE = 0.995  # of the balls are within the limits, if not said otherwise
TABLE = (matplotlib.colormaps[SPEEDS](np.arange(256))[:, :3] * 255 + 0.5).astype(np.uint8)
LOOKED_AT = 12  # frames that the limits are found from


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Its `label` at the bar, its SI `unit`, and how it is had from a state and the masses of the balls."""

    label: str
    unit: str
    values: Callable


QUANTITIES = {
    "speed": Quantity("speed", "m/s", lambda state, mass: np.linalg.norm(state.velocity, axis=1)),
    "spin": Quantity("spin", "rad/s", lambda state, mass: np.linalg.norm(state.angular_velocity, axis=1)),
    "energy": Quantity("kinetic energy", "J", lambda state, mass: 0.5 * mass * (state.velocity**2).sum(axis=1)),
    "impact": Quantity("speed of last impact", "m/s", lambda state, mass: state.value),
}


@dataclasses.dataclass(frozen=True)
class Colour:
    """`quantity` (of QUANTITIES) within `limits` (low, high) [SI]."""

    quantity: str
    limits: tuple[float, float]

    def values(self, state, run) -> np.ndarray:
        """The value of every ball (N,) [SI]; NaN where a ball has none yet."""
        return QUANTITIES[self.quantity].values(state, run.balls("mass"))

    def rgb(self, values) -> np.ndarray:
        """Colours (N, 3) uint8; beyond the limits that of the limit, NaN grey."""
        low, high = self.limits
        share = (np.asarray(values, float) - low) / (high - low)
        known = np.isfinite(share)
        index = np.clip(np.where(known, share, 0.0) * 256, 0, 255).astype(int)
        return np.where(known[:, None], TABLE[index], np.uint8(150))

    # ---- for the bar

    @property
    def scale(self) -> tuple[float, str]:
        """What a value is divided by to be written, and the unit it then has."""
        unit, top = QUANTITIES[self.quantity].unit, max(map(abs, self.limits))
        if unit != "J":
            return 1.0, unit
        factor, letter = prefix(top)
        return factor, letter + unit

    @property
    def title(self) -> str:
        """As in "speed [m/s]"."""
        return f"{QUANTITIES[self.quantity].label} [{self.scale[1]}]"


def of(run, quantity: str, limits=None) -> Colour:
    """The colours of a milltools.read.runfile.Run: `limits` (low, high) [SI], or such that all but few balls of its
    frames are within them, from 0 on."""
    if limits is None:
        limits = 0.0, _nice(_top(run, quantity))
    low, high = map(float, limits)
    if not (np.isfinite([low, high]).all() and low < high):
        raise UserError(f"colour: limits: expected two numbers, the lower first; got {low:g}, {high:g}")
    return Colour(quantity, (low, high))


def _top(run, quantity) -> float:
    """The value that all but a share of the balls stay below in the frames of a run."""
    if quantity == "impact":
        return _top_impact(run)
    times = run.frame_times()
    if len(times) == 0:
        raise UserError(
            f"{run.path}: no ball states are stored (output.frames = 0 s) that tell how far the colours reach: "
            "--limits LOW,HIGH does"
        )
    # the first frames are of a start, not of the mill
    chosen = np.unique(np.linspace(min(1, len(times) - 1), len(times) - 1, LOOKED_AT).astype(int))
    found = [QUANTITIES[quantity].values(stored(run, int(index)), run.balls("mass")) for index in chosen]
    return float(np.quantile(np.concatenate(found), SHARE))


def _top_impact(run) -> float:
    """From the spectrum of impacts; where nothing was sampled, from the fastest balls."""
    if run.has("statistics/impacts/all/normal_speed/histogram/count"):
        histogram = run.histogram("all")
        total = histogram.count.sum()
        if total > 0:
            reached = np.searchsorted(np.cumsum(histogram.count), 0.98 * total)
            return float(histogram.edges[min(reached + 1, len(histogram.edges) - 1)])
    return 0.5 * _top(run, "speed")


def _nice(top: float) -> float:
    """The next number of two digits from `top` on, so that the bar ends at a number one can read."""
    if not top > 0:
        return 1.0
    unit = 10.0 ** np.floor(np.log10(top) - 1)
    return float(np.ceil(top / unit * (1 - 1e-9)) * unit)
