"""What was measured, and where each number was read. README.md says what could not be read."""

import numpy as np
from single.oblique import Law

# Binary impacts. S. F. Foerster, M. Y. Louge, H. Chang, K. Allia, Phys. Fluids 6 (1994) 1108-1115.
# Coefficients and errors as they are commonly quoted, unchecked: the paper itself could not be read
GLASS = Law(0.97, 0.092, 0.44)
GLASS_ERROR = Law(0.01, 0.006, 0.07)
ACETATE = Law(0.87, 0.25, 0.43)
ACETATE_ERROR = Law(0.02, 0.02, 0.06)

# Spheres of aluminium oxide, 5 mm, on a thick plate of soda-lime glass. A. H. Kharaz, D. A. Gorham, A. D. Salman,
# Powder Technology 120 (2001) 281-291. Two people read its figures for their own programs: MFIX (tests/dem/DEM05,
# AUTOTEST/POST_ALPHA.dat, POST_COEFF.dat, POST_OMEGA.dat) and Lethe (examples/dem/3d-oblique-wall-impact,
# oblique_wall_impact_postprocessing.py). The friction is what both and Yade take, the speed Lethe's and Yade's, the
# restitution Yade's.
SPEED = 3.9  # [m/s]
DIAMETER, DENSITY = 0.005, 4000.0  # [m], [kg/m^3]
FRICTION, RESTITUTION = 0.092, 0.98
# angle from the normal [deg], then: angle after [deg]; tangential speed of the centre after over before;
# spin after [rad/s]
ANGLE = {
    "MFIX": (
        (0.2397, 2.2945, 4.2922, 9.9429, 20.5594, 30.3767, 39.6233, 49.7831, 60.0571),
        (0.1194, 1.7630, 2.9577, 6.6917, 12.3645, 21.7809, 32.5455, 45.1051, 57.3652),
    ),
    "Lethe": (
        (0.016, 2.15, 4.096, 9.826, 20.567, 30.29, 39.535, 49.747, 60.208),
        (0.074, 1.733, 2.962, 6.518, 12.208, 21.67, 32.613, 45.125, 57.474),
    ),
}
KEPT = {
    "MFIX": (
        (2.0275, 3.9282, 9.6304, 20.0845, 30.2218, 39.3031, 49.5459, 59.8416),
        (0.7938, 0.7450, 0.6728, 0.5964, 0.6883, 0.7719, 0.8469, 0.9019),
    ),
    "Lethe": (
        (1.84, 3.703, 9.496, 20.012, 30.127, 39.382, 49.694, 60.02),
        (0.79344, 0.74533, 0.67257, 0.59691, 0.68756, 0.77148, 0.84761, 0.90142),
    ),
}
SPIN = {
    "MFIX": (
        (6.0025, 10.9840, 21.1931, 31.0947, 39.0283, 50.2214, 60.2460),
        (135.5703, 264.5493, 577.0096, 612.6481, 595.4843, 452.9444, 381.3185),
    ),
    "Lethe": (
        (6.143, 10.991, 21.251, 31.157, 39.143, 50.348, 60.328),
        (136.18, 265.69, 577.65, 612.88, 595.49, 453.21, 382.09),
    ),
}

# Spheres in a drop tower. T. Trittel, D. Puzyrev, K. Harth, R. Stannarius, npj Microgravity 10 (2024), its abstract
TRITTEL_RATIO = 2 / 3  # "roughly": rotational over translational energy, each of three degrees of freedom
TRITTEL_ENERGY = 0.05  # "about": of the energy at the start, after three Haff times


def both(readings):
    """Mean of the two readings of a figure: (angle [deg], value)."""
    return np.mean([readings["MFIX"], readings["Lethe"]], axis=0)
