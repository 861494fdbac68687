"""What LIGGGHTS is given: input script, start positions, the blades as triangles.

Everything is written out in numbers, in SI: unknown or misspelt variables on LIGGGHTS' command line are ignored in
silence. The set-up and its pitfalls are explained in docs/dem.md.
"""

import numpy as np

from milltools.dem.model import POISSON, STEPS_PER_SAMPLE
from milltools.dem.setup import scene_of
from milltools.read.kinds import KINDS


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


def data_file(species, species_of_ball, position, velocity, spin, box, types=None):
    """LIGGGHTS' read_data text: exactly these balls, ids from 1; box (3, 2) [m]; types: of balls and walls together."""
    types = types or len(species) + len(KINDS) - 1
    lines = [
        "balls of the mill",
        "",
        f"{len(position)} atoms",
        f"{types} atom types",
        "",
    ]
    lines += [f"{lo:.9g} {hi:.9g} {axis}lo {axis}hi" for (lo, hi), axis in zip(box, "xyz", strict=True)]
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
    """The box (3, 2) [m] that LIGGGHTS decomposes: what holds the balls, and a margin."""
    return [(-h, h) for h in scene_of(deck).half]


def types(deck):
    """How many types LIGGGHTS has: the balls' kinds, then those of the walls."""
    return len(deck.species) + len(deck.kinds) - 1


def _matrix(deck, name, count):
    """Values of a contact property for LIGGGHTS: species, then the kinds of walls."""
    size = types(deck)
    table = np.full((size, size), getattr(deck.contact("ball_ball"), name))
    for k, kind in enumerate(deck.kinds[1:]):
        table[count + k, :] = table[:, count + k] = getattr(deck.contact(kind), name)
    return " ".join(f"{v:.17g}" for v in table.ravel())


def contact_style(deck, damped):
    """The contact model's keywords of pairs and walls: (models, settings)."""
    rubs = any(deck.contact(kind).friction > 0 for kind in deck.kinds)
    tangential = "history" if rubs else "no_history"
    damping = "on" if damped else "off"
    return (
        f"model hooke tangential {tangential}",
        f"tangential_damping {damping} limitForce off ktToKnUser on",
    )


def head(deck, model):
    """The beginning of every script: materials, box and balls from `balls.data`; properties of all types."""
    count, size = len(deck.species), types(deck)
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
        f"fix young all property/global youngsModulus peratomtype {' '.join([f'{modulus:.9g}'] * size)}",
        f"fix poisson all property/global poissonsRatio peratomtype {' '.join([str(POISSON)] * size)}",
    ]
    for name, key in (
        ("coefficientRestitution", "restitution"),
        ("coefficientFriction", "friction"),
    ):
        values = _matrix(deck, key, count)
        lines.append(f"fix {key} all property/global {name} peratomtypepair {size} {values}")
    lines.append(f"fix speed all property/global characteristicVelocity scalar {model.speed:.17g}")
    lines.append(f"timestep {model.time_step:.17g}")
    return lines


def _walls(deck, models, settings, stored):
    """Primitive walls, and the groups of balls that they act on."""
    count, lines, grouped = len(deck.species), [], set()
    for wall in scene_of(deck).walls:
        for name, primitive, species in wall.primitives:
            group = "all" if species is None else f"balls{species}"
            if species not in (None, *grouped):
                lines.append(f"group {group} type {species + 1}")
                grouped.add(species)
            words, _, shear = primitive.partition(" shear ")
            extra = f"shear {shear}" if shear else ""
            lines.append(
                f"fix {name} {group} wall/gran {models} primitive type {count + wall.kind} {words} "
                f"{stored} {extra} {settings}"
            )
    return lines


def _meshes(deck, model, meshes, begin, row, models, settings, stored, told):
    """Meshes, how they move, and what they do in a row of the series."""
    count, lines, columns = len(deck.species), [], []
    step, scene = model.time_step, scene_of(deck)
    for name, kind, _, motion in meshes:
        at = " ".join(f"{v:.17g}" for v in motion.centre) if motion else "0 0 0"
        lines.append(
            f"fix {name} all mesh/surface/stress file {file_of(name)} type {count + kind} verbose yes "
            f"reference_point {at}"
        )
    names = [name for name, *_ in meshes]
    if names:
        lines.append(
            f"fix blades all wall/gran {models} mesh n_meshes {len(names)} meshes {' '.join(names)} {stored} {settings}"
        )
    for name, _, _, motion in meshes:
        if motion and motion.fastest() > 0:
            lines += motion.lines(name, begin, step)
        if name == "rotor":
            columns.append("f_rotor[4]")
        elif name in dict(pair[::-1] for pair in scene.driven):
            lines.append(f"variable power_{name} equal {motion.power(name)}")
            columns.append(f"v_power_{name}")
    if told and columns:
        lines.append(f"fix torque all ave/time 1 {row} {row} {' '.join(columns)} file torque.txt")
    return lines


def file_of(mesh):
    """The name of a mesh's file."""
    return "blades.stl" if mesh == "rotor" else f"{mesh}.stl"


def mill(
    deck,
    model,
    damped,
    steps,
    forces_every,
    meshes,
    begin=0.0,
    told=True,
    states_every=STEPS_PER_SAMPLE,
):
    """The input script of one stretch of a mill that begins at `begin` [s], with the `meshes` of its scene at that time.

    steps: how many; told: False leaves out all output and what serves it, to know the price; forces_every, states_every:
    every how many steps the forces of the walls and the states of the balls are told (0: never).
    States come out through `state.bin`, the walls' forces through `walls.bin`, what meshes do through
    `torque.txt` once a row of the series: the mean torque on the blades, the mean powers of others.
    """
    models, settings = contact_style(deck, damped)
    row = model.samples_per_row * STEPS_PER_SAMPLE
    stored = "store_force yes" if forces_every and told else ""
    lines = head(deck, model)
    lines += [f"pair_style gran {models} {settings}", "pair_coeff * *", "fix move all nve/sphere"]
    lines += scene_of(deck).frame.lines(begin, model.time_step)
    lines += _walls(deck, models, settings, stored)
    lines += _meshes(deck, model, meshes, begin, row, models, settings, stored, told)
    state = "id x y z vx vy vz omegax omegay omegaz"
    if told and states_every:
        lines.append(f"dump state all custom {states_every} state.bin {state}")
    if stored:
        columns = " ".join(f"f_force_{name}[{k}]" for name in walls_of(deck) for k in (1, 2, 3))
        lines.append(f"dump walls all custom {forces_every} walls.bin id {columns}")
    lines += [
        "thermo_style custom step atoms",
        f"thermo {row}",
        "thermo_modify lost error norm no",
        f"run {steps}",
    ]
    return "\n".join([*lines, ""])


def walls_of(deck):
    """Names of the walls in the order in which LIGGGHTS tells their forces: one for each primitive, one for all meshes."""
    scene = scene_of(deck)
    names = [name for wall in scene.walls for name, *_ in wall.primitives]
    return names + ["blades"] * bool(scene.meshes(0.0))
