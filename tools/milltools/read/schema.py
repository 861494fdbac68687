"""Names, types, units and meanings of what millsim's output file holds, for those who write such a file."""

import re

from milltools.read.kinds import KINDS

THRESHOLDS = (0.5, 1.0, 2.0)  # [m/s] of fast_collisions
STATUSES = ("complete", "running", "stopped", "failed")

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
SERIES = {
    **SINGLE,
    **{f"{name}/{kind}": label for name, label in PER_KIND.items() for kind in KINDS},
    **OPTIONAL,
}

MOTION = ("J", "work done on the balls by this motion's own velocity, cumulative from t = 0")
POSE = {  # of a motion: shape, unit, meaning
    "centre": ((3,), "m", "where the frame's origin is: frame, (x, y, z)"),
    "rotation": ((3, 3), "1", "axes of the frame, as columns: a point p of it is at centre + rotation p"),
}  # fmt: skip


def series_of(deck):
    """SERIES of a milltools.read.deck.Deck: with the kinds of its bodies, and its motions."""
    kinds = {f"{name}/{kind}": label for name, label in PER_KIND.items() for kind in deck.kinds}
    motions = {f"motion_work/{name}": MOTION for name in deck.motions}
    return {**SINGLE, **kinds, **motions, **OPTIONAL}


FACTS = {  # of /run: unit, meaning
    "program": ("", "program that made the run"),
    "version": ("", "version of the program"),
    "command": ("", "command line"),
    "started": ("", "when the run was started, UTC"),
    "wall_time": ("s", "time on the wall's clock"),
    "cpu_time": ("s", "processor time"),
    "peak_memory": ("byte", "largest resident memory"),
    "largest_overlap": ("m", "largest overlap seen"),
    "energy_turnover": (
        "J",
        "energy turned over: what the balance's error is measured against",
    ),
    "energy_balance_error": (
        "1",
        "|rotor work - change of energy - dissipation| over the energy turned over",
    ),
}
NEEDED = ("program", "version", "command", "started", "wall_time", "cpu_time")

LOG = {  # of /impacts: type, shape of a row, unit, meaning
    "time": ("<f8", (), "s", "simulated time of the impact"),
    "kind": ("u1", (), "1", "kind of contact: index into the attribute kinds"),
    "ball": ("<i4", (), "1", "number of the ball"),
    "partner": (
        "<i4",
        (),
        "1",
        "number of the other ball, of the blade, the end wall or the body's copy; -1 for drum and shaft",
    ),
    "position": ("<f4", (3,), "m", "point of contact: (x, y, z)"),
    "normal": ("<f4", (3,), "1", "unit normal of the contact, into the ball: (x, y, z)"),
    "normal_speed": ("<f8", (), "m s-1", "approach speed along the normal just before"),
    "tangential_speed": ("<f8", (), "m s-1", "slip of the two surfaces just before"),
    "dissipation": ("<f8", (), "J", "energy lost in the impact, its normal part"),
}
STATES = {
    "position": ("m", "centres of the balls: frame, ball, (x, y, z)"),
    "velocity": ("m s-1", "velocities of the balls: frame, ball, (x, y, z)"),
    "angular_velocity": ("rad s-1", "angular velocities of the balls: frame, ball, (x, y, z)"),
}
ENTRY = re.compile(r'(?P<key>[^\s=]+) = (?P<value>"(?:[^"]|"")*"|.*?)\s+# (?P<meaning>.*)')


def deck_entries(text):
    """(section, key, value, meaning) of every line of a deck as `millsim --check` prints it."""
    section = ""
    for line in text.splitlines():
        entry = ENTRY.fullmatch(line)
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1]
        elif entry:
            yield section, entry["key"], entry["value"], entry["meaning"]


def run_facts(run):
    """The facts of /run, {name: (value, unit, description)}, from values or such triples; ValueError if one is
    missing or says too little of itself."""
    missing = [name for name in NEEDED if name not in run]
    if missing:
        raise ValueError(f"run: {missing[0]} is missing")
    facts = {}
    for name, fact in run.items():
        if not isinstance(fact, tuple):
            if name not in FACTS:
                raise ValueError(f"run: {name}: expected (value, unit, description)")
            fact = (fact, *FACTS[name])
        facts[name] = fact
    return facts
