"""The formulas of the dose (docs/dose.md has their sources). All quantities are in SI units; energies are arrays."""

import math

import numpy as np

# ---- powder that an impact catches [kg]; rho_b: density of the powder with its voids


def captured(energy: np.ndarray, radius: float, powder) -> np.ndarray:
    """Powder caught in an impact of the normal energy E [J] of two bodies of reduced radius R [m], by the model of
    `powder.capture`."""
    bulk = powder.packing * powder.density
    if powder.capture == "monolayer":  # one layer of particles where the gap is at most their size x
        return np.full_like(energy, 2 * math.pi * radius * powder.size**2 * bulk)
    if powder.capture == "volume":  # all of the space where the gap is at most x (Kwade)
        return np.full_like(energy, math.pi * radius * powder.size**2 * bulk)
    # a layer on the Hertz contact: radius^2 = R delta (Maurice & Courtney)
    depth = (15 * energy / (8 * powder.modulus * math.sqrt(radius))) ** 0.4
    return math.pi * radius * depth * powder.layer * bulk


# ---- what an impact of energy E does


def effect(energy: np.ndarray, radius: float, powder) -> np.ndarray:
    """k(E) of `powder.law`, for each impact."""
    if powder.law == "power":
        return powder.coefficient * energy**powder.exponent
    if powder.law == "threshold":
        return np.where(energy >= powder.threshold * (1 - 1e-12), powder.coefficient, 0.0)
    if powder.law == "vogel_peukert":
        return broken(energy, captured(energy, radius, powder), powder)
    energies, rates = powder.rates
    return np.interp(energy, energies, rates)


def broken(energy: np.ndarray, caught: np.ndarray, powder) -> np.ndarray:
    """Number of particles that an impact breaks: the number of those caught, times the probability
    1 - exp(-f_Mat (x W - x W_min)) that one breaks, W = E / caught mass (Vogel & Peukert 2003, equation 9)."""
    particles = caught / (powder.density * math.pi / 6 * powder.size**3)
    work = powder.size * np.divide(energy, caught, out=np.zeros_like(energy), where=caught > 0)
    return particles * -np.expm1(-powder.strength * np.maximum(work - powder.least, 0.0))


# ---- temperatures


class Heat:
    """Balls, with the powder between them, and jar, each of one temperature:

    C_b dT_b/dt = s P - h (T_b - T_j),   C_j dT_j/dt = (1 - s) P + h (T_b - T_j) - H (T_j - T_room).
    """

    def __init__(self, power: float, balls: float, powder: float, heat):
        """power P [W]; masses of balls and powder [kg]; heat: the values of [heat]."""
        self.capacity = np.array(
            [
                balls * heat.ball_heat_capacity + powder * heat.powder_heat_capacity,
                heat.jar_mass * heat.jar_heat_capacity,
            ]
        )
        inner, outer = heat.ball_to_jar, heat.jar_to_room
        self.source = power * np.array([heat.share, 1 - heat.share])
        self.flow = np.array([[-inner, inner], [inner, -inner - outer]])
        self.room = heat.room
        self.open = outer > 0

    def steady(self) -> np.ndarray:
        """(balls, jar) [K] in the end; infinite if no heat leaves the jar."""
        if not self.open:
            return np.full(2, math.inf)
        return self.room - np.linalg.solve(self.flow, self.source)

    def after(self, time: float) -> np.ndarray:
        """(balls, jar) [K] after a time [s], from the temperature of the room."""
        rates, modes = np.linalg.eig(self.flow / self.capacity[:, None])
        amounts = np.linalg.solve(modes, self.source / self.capacity)
        grown = [time if abs(r) * time < 1e-12 else math.expm1(r * time) / r for r in rates.real]
        return self.room + modes.real @ (amounts.real * np.array(grown))
