"""What LIGGGHTS is given: input script, start positions, the blades as triangles.

Everything is written out in numbers, in SI: unknown or misspelt variables on LIGGGHTS' command line are ignored in
silence. The set-up and its pitfalls are explained in docs/dem.md.
"""

import numpy as np

from milltools.dem.model import POISSON, STEPS_PER_SAMPLE
from milltools.dem.paths import digits
from milltools.dem.setup import setup_of

STATE = "id x y z vx vy vz omegax omegay omegaz"


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


def data_file(deck, kinds, state, half=None):
    """LIGGGHTS' read_data text: exactly the balls of a state (place, velocity, spin), ids from 1; kinds (N,): each ball's index
    into the deck's; half (3,) [m]: of the box that LIGGGHTS decomposes, where it is not that of the deck's mill."""
    place, *moving = state
    lines = ["balls of the mill", "", f"{len(place)} atoms", f"{types(deck)} atom types", ""]
    for h, axis in zip(setup_of(deck).half if half is None else half, "xyz", strict=True):
        lines.append(f"{-h:.9g} {h:.9g} {axis}lo {axis}hi")
    lines += ["", "Atoms", ""]
    species = [f"{k} {ball.diameter:.17g} {ball.density:.17g}" for k, ball in enumerate(deck.species, start=1)]
    lines += [
        f"{k} {species[kind]} {digits(at)}" for k, (kind, at) in enumerate(zip(kinds, place, strict=True), start=1)
    ]
    lines += ["", "Velocities", ""]
    lines += [f"{k} {digits(row)}" for k, row in enumerate(np.hstack(moving), start=1)]
    return "\n".join([*lines, ""])


def types(deck):
    """How many types LIGGGHTS has: the balls' kinds, then those of the walls."""
    return len(deck.species) + len(deck.kinds) - 1


def _matrix(deck, name):
    """Values of a contact property for LIGGGHTS: species, then the kinds of walls."""
    size = types(deck)
    table = np.full((size, size), getattr(deck.contact("ball_ball"), name))
    for k, kind in enumerate(deck.kinds[1:], start=len(deck.species)):
        table[k, :] = table[:, k] = getattr(deck.contact(kind), name)
    return digits(table.ravel())


def contact_style(deck, damped):
    """The contact model's keywords of pairs and walls: (models, settings)."""
    rubs = any(deck.contact(kind).friction > 0 for kind in deck.kinds)
    models = f"model hooke tangential {'history' if rubs else 'no_history'}"
    return models, f"tangential_damping {'on' if damped else 'off'} limitForce off ktToKnUser on"


def head(deck, model, damped):
    """The beginning of every script: materials, box and balls from `balls.data`; properties of all types, contacts of balls."""
    size, modulus = types(deck), model.modulus
    skin = 0.3 * max(kind.diameter for kind in deck.species)
    models, settings = contact_style(deck, damped)
    particles = ["hard_particles yes"] * (modulus > 1e9) + ["soft_particles yes"] * (modulus < 5e6)
    pairs = f"all property/global {{}} peratomtypepair {size}"
    return [
        "units si",
        "atom_style granular",
        "atom_modify map array",
        "communicate single vel yes",
        "newton off",
        "boundary f f f",
        *particles,
        "read_data balls.data",
        f"neighbor {skin:.9g} bin",
        "neigh_modify delay 0 every 1 check yes",
        f"fix young all property/global youngsModulus peratomtype {' '.join([f'{modulus:.9g}'] * size)}",
        f"fix poisson all property/global poissonsRatio peratomtype {' '.join([str(POISSON)] * size)}",
        f"fix restitution {pairs.format('coefficientRestitution')} {_matrix(deck, 'restitution')}",
        f"fix friction {pairs.format('coefficientFriction')} {_matrix(deck, 'friction')}",
        f"fix speed all property/global characteristicVelocity scalar {model.speed:.17g}",
        f"timestep {model.time_step:.17g}",
        f"pair_style gran {models} {settings}",
        "pair_coeff * *",
        "fix move all nve/sphere",
    ]


def tail(steps, row):
    """The end of every script: so many steps, watched every `row` steps."""
    return ["thermo_style custom step atoms", f"thermo {row}", "thermo_modify lost error norm no", f"run {steps}", ""]


def _walls(deck, models, settings, stored):
    """Primitive walls, and the groups of balls that they act on."""
    count, lines, grouped = len(deck.species), [], set()
    for wall in setup_of(deck).walls:
        for name, primitive, species in wall.primitives:
            group = "all" if species is None else f"balls{species}"
            if species not in (None, *grouped):
                lines.append(f"group {group} type {species + 1}")
                grouped.add(species)
            words, shear, extra = primitive.partition("shear ")
            lines.append(
                f"fix {name} {group} wall/gran {models} primitive type {count + wall.kind} {words.rstrip()} "
                f"{stored} {shear}{extra} {settings}"
            )
    return lines


def _meshes(deck, model, meshes, begin, row, models, settings, stored, told):
    """Meshes, how they move, and what they do in a row of the series."""
    count, lines, columns, driven = len(deck.species), [], [], [mesh for _, mesh in setup_of(deck).driven]
    for name, kind, _, motion in meshes:
        at = digits(motion.centre) if motion else "0 0 0"
        lines.append(
            f"fix {name} all mesh/surface/stress file {file_of(name)} type {count + kind} verbose yes reference_point {at}"
        )
    if meshes:
        names = " ".join(name for name, *_ in meshes)
        lines.append(
            f"fix blades all wall/gran {models} mesh n_meshes {len(meshes)} meshes {names} {stored} {settings}"
        )
    for name, _, _, motion in meshes:
        if motion and motion.fastest() > 0:
            lines += motion.lines(name, begin, model.time_step)
        if name == "rotor":
            columns.append("f_rotor[4]")
        elif name in driven:
            lines.append(f"variable power_{name} equal {motion.power(name)}")
            columns.append(f"v_power_{name}")
    if told and columns:
        lines.append(f"fix torque all ave/time 1 {row} {row} {' '.join(columns)} file torque.txt")
    return lines


def file_of(mesh):
    """The name of a mesh's file."""
    return "blades.stl" if mesh == "rotor" else f"{mesh}.stl"


def write(folder, deck, model, damped, steps, forces_every, begin, state, told=True, states_every=STEPS_PER_SAMPLE):
    """Writes balls and meshes into `folder`; the input script of one stretch of a mill that begins at `begin` [s] with a state
    (place, velocity, spin), and the numbers of triangles of its meshes.

    steps: how many; told: False leaves out all output and what serves it, to know the price; forces_every, states_every:
    every how many steps the forces of the walls and the states of the balls are told (0: never).
    States come out through `state.bin`, the walls' forces through `walls.bin`, what meshes do through
    `torque.txt` once a row of the series: the mean torque on the blades, the mean powers of others.
    """
    meshes = setup_of(deck).meshes(begin)
    (folder / "balls.data").write_text(data_file(deck, deck.species_of_ball, state))
    for name, _, triangles, _ in meshes:
        (folder / file_of(name)).write_text(stl(triangles))
    models, settings = contact_style(deck, damped)
    row = model.samples_per_row * STEPS_PER_SAMPLE
    stored = "store_force yes" if forces_every and told else ""
    lines = head(deck, model, damped)
    lines += setup_of(deck).frame.lines(begin, model.time_step)
    lines += _walls(deck, models, settings, stored)
    lines += _meshes(deck, model, meshes, begin, row, models, settings, stored, told)
    if told and states_every:
        lines.append(f"dump state all custom {states_every} state.bin {STATE}")
    if stored:
        columns = " ".join(f"f_force_{name}[{k}]" for name in walls_of(deck) for k in (1, 2, 3))
        lines.append(f"dump walls all custom {forces_every} walls.bin id {columns}")
    return "\n".join(lines + tail(steps, row)), [len(triangles) for _, _, triangles, _ in meshes]


def walls_of(deck):
    """Names of the walls in the order in which LIGGGHTS tells their forces: one for each primitive, one for all meshes."""
    setup = setup_of(deck)
    names = [name for wall in setup.walls for name, *_ in wall.primitives]
    return names + ["blades"] * bool(setup.meshes(0.0))
