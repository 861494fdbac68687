"""Names, types, units and meanings of what millsim's output file holds, as far as readers name them."""

THRESHOLDS = (0.5, 1.0, 2.0)  # [m/s] of fast_collisions

SINGLE = {  # of the time series: unit, meaning
    "kinetic_energy": ("J", "translational kinetic energy of all balls"),
    "rotational_energy": ("J", "rotational kinetic energy of all balls"),
    "potential_energy": (
        "J",
        "potential energy of all balls in gravity, 0 at the laboratory's origin",
    ),
    "rotor_work": ("J", "work done by the rotor on the balls, cumulative from t = 0"),
    "rotor_torque": (
        "N m",
        "torque of the rotor on the balls about +x, mean over the interval before; 0 in the first row",
    ),
}
PER_KIND = {
    "dissipation": ("J", "energy lost in impacts of this kind, cumulative from t = 0"),
    "dissipation_normal": (
        "J",
        "normal part of the energy lost in impacts of this kind, cumulative from t = 0",
    ),
}
OPTIONAL = {"elastic_energy": ("J", "energy stored in the springs of all contacts")}

LOG = (  # columns of /impacts
    "time", "kind", "ball", "partner", "position", "normal", "normal_speed", "tangential_speed", "dissipation",
)  # fmt: skip
STATES = {
    "position": ("m", "centres of the balls: frame, ball, (x, y, z)"),
    "velocity": ("m s-1", "velocities of the balls: frame, ball, (x, y, z)"),
    "angular_velocity": ("rad s-1", "angular velocities of the balls: frame, ball, (x, y, z)"),
}
