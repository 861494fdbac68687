"""States of the balls at moments of a run."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class State:
    """All balls at a `time` [s]: `position` [m], `velocity` [m/s], `angular_velocity` [rad/s], each (N, 3) float64, and
    a `value` (N,) where what colours them is not to be had from these (the speed of each ball's last impact)."""

    time: float
    position: np.ndarray
    velocity: np.ndarray
    angular_velocity: np.ndarray
    value: np.ndarray | None = None
