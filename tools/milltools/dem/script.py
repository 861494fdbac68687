"""What LIGGGHTS is given: input script, start positions, the blades as triangles.

Everything is written out in numbers, in SI: unknown or misspelt variables on LIGGGHTS' command line are ignored in
silence. The set-up and its pitfalls are explained in docs/dem.md.
"""

import math

import numpy as np

from milltools.dem.model import POISSON, STEPS_PER_SAMPLE
from milltools.kinds import KINDS


def stl(triangles):
    """ASCII STL of (T, 3, 3) corners; LIGGGHTS reads no other."""
    lines = ["solid blades"]
    for a, b, c in triangles:
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        lines.append("facet normal " + " ".join(f"{v:.9g}" for v in normal))
        lines.append(" outer loop")
        lines += ["  vertex " + " ".join(f"{v:.12g}" for v in corner) for corner in (a, b, c)]
        lines += [" endloop", "endfacet"]
    return "\n".join([*lines, "endsolid blades", ""])


def data_file(species, species_of_ball, position, velocity, spin, box):
    """LIGGGHTS' read_data text: exactly these balls, ids from 1; box (3, 2) [m]."""
    lines = [
        "balls of the mill",
        "",
        f"{len(position)} atoms",
        f"{len(species) + 4} atom types",
        "",
    ]
    lines += [
        f"{lo:.9g} {hi:.9g} {axis}lo {axis}hi" for (lo, hi), axis in zip(box, "xyz", strict=True)
    ]
    lines += ["", "Atoms", ""]
    for k, (kind, place) in enumerate(zip(species_of_ball, position, strict=True), start=1):
        ball = species[kind]
        where = " ".join(f"{v:.17g}" for v in place)
        lines.append(f"{k} {kind + 1} {ball.diameter:.17g} {ball.density:.17g} {where}")
    lines += ["", "Velocities", ""]
    for k, row in enumerate(np.hstack([velocity, spin]), start=1):
        lines.append(f"{k} " + " ".join(f"{v:.17g}" for v in row))
    return "\n".join([*lines, ""])


def box(deck):
    """The box (3, 2) [m] that LIGGGHTS decomposes: the drum and a margin."""
    margin = max(kind.diameter for kind in deck.species)
    half = deck.number("drum.length") / 2 + margin, *(deck.number("drum.radius") + margin,) * 2
    return [(-h, h) for h in half]


def _matrix(deck, name, count):
    """Values of a contact property for LIGGGHTS: species, then drum, end walls, shaft, blades."""
    size = count + 4
    table = np.full((size, size), getattr(deck.contact("ball_ball"), name))
    for k, kind in enumerate(KINDS[1:]):
        table[count + k, :] = table[:, count + k] = getattr(deck.contact(kind), name)
    return " ".join(f"{v:.17g}" for v in table.ravel())


def contact_style(deck, damped):
    """The contact model's keywords of pairs and walls: (models, settings)."""
    rubs = any(deck.contact(kind).friction > 0 for kind in KINDS)
    tangential = "history" if rubs else "no_history"
    damping = "on" if damped else "off"
    return (
        f"model hooke tangential {tangential}",
        f"tangential_damping {damping} limitForce off ktToKnUser on",
    )


def head(deck, model):
    """The beginning of every script: materials, box and balls from `balls.data`; properties of all types."""
    count = len(deck.species)
    skin = 0.3 * max(kind.diameter for kind in deck.species)
    lines = [
        "units si",
        "atom_style granular",
        "atom_modify map array",
        "communicate single vel yes",
        "newton off",
        "boundary f f f",
    ]
    modulus = model.modulus
    if modulus > 1e9:
        lines.append("hard_particles yes")
    elif modulus < 5e6:
        lines.append("soft_particles yes")
    lines += [
        "read_data balls.data",
        f"neighbor {skin:.9g} bin",
        "neigh_modify delay 0 every 1 check yes",
        f"fix young all property/global youngsModulus peratomtype {' '.join([f'{modulus:.9g}'] * (count + 4))}",
        f"fix poisson all property/global poissonsRatio peratomtype {' '.join([str(POISSON)] * (count + 4))}",
    ]
    for name, key in (
        ("coefficientRestitution", "restitution"),
        ("coefficientFriction", "friction"),
    ):
        values = _matrix(deck, key, count)
        lines.append(f"fix {key} all property/global {name} peratomtypepair {count + 4} {values}")
    lines.append(f"fix speed all property/global characteristicVelocity scalar {model.speed:.17g}")
    lines.append(f"timestep {model.time_step:.17g}")
    return lines


def mill(
    deck, model, damped, steps, forces_every, triangles, told=True, states_every=STEPS_PER_SAMPLE
):
    """The input script of one stretch of a mill.

    steps: how many; told: False leaves out all output and what serves it, to know the price; forces_every, states_every:
    every how many steps the forces of the walls and the states of the balls are told (0: never).
    States come out through `state.bin`, the walls' forces through `walls.bin`, the mean torque of the blades through
    `torque.txt` once a row of the series.
    """
    count = len(deck.species)
    models, settings = contact_style(deck, damped)
    gravity = deck.numbers("gravity.acceleration")
    strength = math.hypot(*gravity)
    half, radius = deck.number("drum.length") / 2, deck.number("drum.radius")
    row = model.samples_per_row * STEPS_PER_SAMPLE
    lines = head(deck, model)
    lines += [f"pair_style gran {models} {settings}", "pair_coeff * *", "fix move all nve/sphere"]
    if strength > 0:
        lines.append(
            f"fix weight all gravity {strength:.17g} vector "
            + " ".join(f"{v:.17g}" for v in gravity)
        )

    stored = "store_force yes" if forces_every and told else ""

    def wall(name, type_, primitive, extra=""):
        lines.append(
            f"fix {name} all wall/gran {models} primitive type {count + type_} {primitive} "
            f"{stored} {extra} {settings}"
        )

    wall("drum", 1, f"xcylinder {radius:.17g} 0 0")
    wall("wall0", 2, f"xplane {-half:.17g}")
    wall("wall1", 2, f"xplane {half:.17g}")
    speed, shaft = deck.rotor_speed, deck.shaft_radius
    if shaft > 0:
        ball = (
            sum(kind.count * kind.diameter for kind in deck.species)
            / sum(k.count for k in deck.species)
            / 2
        )
        # LIGGGHTS takes an angular velocity here and lets it act at the ball's centre
        turning = f"shear y {speed * shaft / (shaft + ball):.17g}" if speed else ""
        wall("shaft", 3, f"xcylinder {shaft:.17g} 0 0", turning)
    if len(triangles):
        lines += [
            f"fix rotor all mesh/surface/stress file blades.stl type {count + 4} verbose yes reference_point 0 0 0",
            f"fix blades all wall/gran {models} mesh n_meshes 1 meshes rotor {stored} {settings}",
        ]
        if speed:
            period, axis = 2 * math.pi / abs(speed), "1 0 0" if speed > 0 else "-1 0 0"
            lines.append(
                f"fix turn all move/mesh mesh rotor rotate origin 0 0 0 axis {axis} period {period:.17g}"
            )
        if told:
            lines.append(f"fix torque all ave/time 1 {row} {row} f_rotor[4] file torque.txt")
    state = "id x y z vx vy vz omegax omegay omegaz"
    if told and states_every:
        lines.append(f"dump state all custom {states_every} state.bin {state}")
    if stored:
        walls = (
            ["drum", "wall0", "wall1"] + ["shaft"] * (shaft > 0) + ["blades"] * bool(len(triangles))
        )
        columns = " ".join(f"f_force_{name}[{k}]" for name in walls for k in (1, 2, 3))
        lines.append(f"dump walls all custom {forces_every} walls.bin id {columns}")
    lines += [
        "thermo_style custom step atoms",
        f"thermo {row}",
        "thermo_modify lost error norm no",
        f"run {steps}",
    ]
    return "\n".join([*lines, ""])
