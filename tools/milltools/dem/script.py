"""The input of LIGGGHTS: input script, start positions, the blades as triangles.

All values are written as numbers in SI, because LIGGGHTS ignores unknown or misspelt variables on its command line
without a message. docs/dem.md explains the set-up and its pitfalls.
"""

import pathlib

import jinja2
import numpy as np

from milltools.dem.model import POISSON, STEPS_PER_SAMPLE
from milltools.dem.paths import digits
from milltools.dem.setup import setup_of
from milltools.geometry.bodies import facing

FACET = "facet normal %.9g %.9g %.9g\n outer loop\n" + 3 * "  vertex %.12g %.12g %.12g\n" + " endloop\nendfacet\n"


def stl(triangles):
    """ASCII STL of (T, 3, 3) corners, the only STL that LIGGGHTS reads."""
    rows = np.hstack([facing(triangles)[0], triangles.reshape(-1, 9)])
    return "".join(["solid blades\n", *(FACET % tuple(row) for row in rows), "endsolid blades\n"])


def data_file(deck, kinds, state, half):
    """LIGGGHTS' read_data text: exactly the balls of a state (place, velocity, spin), ids from 1; kinds (N,): index of
    each ball's kind in the deck; half (3,) [m]: half the size of the box that LIGGGHTS decomposes."""
    place, *moving = state
    lines = ["balls of the mill", "", f"{len(place)} atoms", f"{types(deck)} atom types", ""]
    lines += [f"{-h:.9g} {h:.9g} {axis}lo {axis}hi" for h, axis in zip(half, "xyz", strict=True)]
    species = [f"{k} {ball.diameter:.17g} {ball.density:.17g}" for k, ball in enumerate(deck.species, start=1)]
    for title, rows in (
        ("Atoms", [f"{species[kind]} {digits(at)}" for kind, at in zip(kinds, place, strict=True)]),
        ("Velocities", map(digits, np.hstack(moving))),
    ):
        lines += ["", title, "", *(f"{k} {row}" for k, row in enumerate(rows, start=1))]
    return "\n".join([*lines, ""])


def types(deck):
    """The number of types in LIGGGHTS: the kinds of balls, then those of walls."""
    return len(deck.species) + len(deck.kinds) - 1


def _matrix(deck, name):
    """Values of a contact property for LIGGGHTS: species, then the kinds of walls."""
    size = types(deck)
    table = np.full((size, size), getattr(deck.contact("ball_ball"), name))
    for k, kind in enumerate(deck.kinds[1:], start=len(deck.species)):
        table[k, :] = table[:, k] = getattr(deck.contact(kind), name)
    return table.ravel()


def fill(deck, model, damped, steps, row, states_every, walls, **mill):
    """The input script of `steps` steps with the balls of `balls.data`, with output every `row` steps; mill: further
    values, as `write` has them."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(pathlib.Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["g"] = digits
    nothing = {"frame": None, "meshes": (), "driven": (), "columns": (), "shafts": (), "sampled": STEPS_PER_SAMPLE,
               "periodic": False}  # fmt: skip
    return environment.get_template("in.mill.jinja").render(
        nothing | mill, model=model, damped=damped, steps=steps, row=row, states_every=states_every, walls=walls,
        types=types(deck), species_count=len(deck.species), skin=0.3 * max(kind.diameter for kind in deck.species),
        poisson=POISSON, pi=np.pi, restitution=_matrix(deck, "restitution"), friction=_matrix(deck, "friction"),
    )  # fmt: skip


def write(folder, deck, model, damped, steps, begin, state, told=True, states_every=STEPS_PER_SAMPLE):
    """Writes balls and meshes into `folder`; returns the input script and the meshes of a part of a run that begins at
    `begin` [s] with a state (place, velocity, spin).

    steps: their number; told: False leaves out all output, to measure the cost; states_every: interval in steps of the
    output of the balls' states (0: never), to `state.bin`. `torque.txt` gets one row for each row of the series: the
    mean torque on the blades and the mean powers of the other meshes; `shaft.txt` the mean torque of the shaft.
    """
    setup = setup_of(deck)
    meshes, driven = setup.meshes(begin), [mesh.name for mesh in setup.driven]
    (folder / "balls.data").write_text(data_file(deck, deck.species_of_ball, state, setup.half))
    for mesh in meshes:
        (folder / mesh.file).write_text(stl(mesh.triangles))
    columns = ["f_rotor[4]"] * bool(deck.blades) + [f"v_power_{name}" for name in driven]
    mill = {"begin": begin, "frame": setup.frame, "meshes": meshes, "driven": driven, "periodic": deck.periodic}
    if told:
        mill |= {"columns": columns, "shafts": setup.shafts}
    row = model.samples_per_row * STEPS_PER_SAMPLE
    return fill(deck, model, damped, steps, row, states_every if told else 0, setup.walls, **mill), meshes
