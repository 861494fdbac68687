"""Asks millsim whether it accepts a mesh: what it refuses is decided there alone."""

import re
import subprocess
import tempfile

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.geometry.stl import binary

# A box of four times the size of the mesh, with one ball: enough to check a deck. The mesh is scaled to 1 m.
DECK = """[run]
time = 1 ms
[body.room]
shape = box
side = inside
size = 4 4 4 m
[body.mesh]
shape = mesh
file = mesh.stl
unit = {unit!r} m
centre = {x!r} {y!r} {z!r} m
[balls]
count = 1
diameter = 0.1 m
density = 1000 kg/m^3
[contact]
restitution = 0.5
friction = 0.1
"""


def complaints(corners, step) -> list[str]:
    """What millsim says against a mesh; nothing if it accepts it. `step` is called now and then."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    unit = 1.0 / float((high - low).max())
    x, y, z = (float(-unit * one) for one in (low + high) / 2)
    with tempfile.TemporaryDirectory(prefix="millsim-mesh-") as folder, tempfile.TemporaryFile("w+") as said:
        with open(f"{folder}/mesh.stl", "wb") as file:
            file.write(binary(corners, ""))
        with open(f"{folder}/deck.ini", "w") as file:
            file.write(DECK.format(unit=unit, x=x, y=y, z=z))
        words = [engine.program().absolute(), "--check", "deck.ini"]
        child = subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL, stderr=said)
        try:
            while (status := _waited(child)) is None:
                step()
        finally:
            child.kill()
            child.wait()
        said.seek(0)
        lines = engine.complaints(status, said.read()) if status else []
    if status not in (0, 2):
        raise UserError(lines, status if status > 0 else 1)
    return [_own_words(line) for line in lines]


def _own_words(line):
    """A message without the names of this deck and its file, the advice to call this command, and the numbers of facets
    of a mesh that is not written."""
    line = line.split("] file: ", 1)[-1].removeprefix("deck.ini: ").split("; mend it with", 1)[0]
    return re.sub(r"\bfacet \d+", "a facet", re.sub(r"\bfacets \d+ and \d+", "two facets", line))


def _waited(child):
    try:
        return child.wait(0.2)
    except subprocess.TimeoutExpired:
        return None
