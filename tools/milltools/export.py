"""`mill export`: a mill in the formats of other programs; the file's suffix chooses.

A format is an entry of FORMATS: a function (source, path, arguments) that writes the file.
"""

import os
import pathlib
import re

import numpy as np

from milltools import engine
from milltools.deck import Deck
from milltools.errors import UserError
from milltools.profile import Profile
from milltools.runfile import Run
from milltools.solids import PARTS

SUMMARY = """Writes a mill for other programs; the suffix of the file chooses the format. .stl: the bodies of the mill (drum,
end walls, shaft, blades at t = 0) as closed surfaces, binary STL in metres. An old file is replaced."""

HDF5 = b"\x89HDF\r\n\x1a\n"
UNITS = {"": 1.0, "m": 1.0, "mm": 1e-3, "um": 1e-6}
MOST_CORNERS = 4000  # of an outline


def add_arguments(parser):
    parser.add_argument("source", metavar="DECK-or-RUN", help="a deck, or the output file of a run")
    parser.add_argument("file", metavar="FILE", help="what to write: FILE.stl")
    parser.add_argument("-s", "--set", action="append", default=[], metavar="SECTION.KEY=VALUE",
                        help="override one value of a deck; may be repeated")  # fmt: skip
    parser.add_argument("--part", action="append", choices=PARTS,
                        help="only this part; may be repeated (default: all there are)")  # fmt: skip
    parser.add_argument("--tolerance", metavar="LENGTH",
                        help="how far flats may be from the round surfaces, such as '0.1 mm'; default: a "
                        "two-thousandth of the drum's radius")  # fmt: skip
    parser.add_argument("--thickness", metavar="LENGTH",
                        help="of the drum's wall where it is thinnest and of the end walls, such as '2 mm'; default: a "
                        "twentieth of the drum's radius")  # fmt: skip


def length(text, what):
    """[m] from '0.1 mm', '1e-4 m', '1e-4'."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([A-Za-z]*)\s*", text)
    try:
        value = float(found[1]) * UNITS[found[2]]
    except (TypeError, KeyError, ValueError):
        value = np.nan
    if not 0 < value < np.inf:
        raise UserError(f"--{what}: expected a length such as '0.1 mm', got '{text}'")
    return value


def deck_of(path, overrides) -> Deck:
    """The deck of a run, or the one at a path."""
    try:
        with open(path, "rb") as file:
            is_run = file.read(len(HDF5)) == HDF5
    except OSError:
        is_run = False  # millsim says it in its own words
    if not is_run:
        return Deck.check(path, overrides)
    if overrides:
        raise UserError(f"{path}: --set: what has been run cannot be changed; give its deck")
    with Run(path) as run:
        text = run.deck_text()
    if not text:
        raise UserError(f"{path}: has no /deck/text")
    return Deck(text, path)


def bodies(deck, arguments) -> dict[str, list[np.ndarray]]:
    """The wanted parts of a mill, {part: closed bodies (T, 3, 3) [m]}."""
    profile = Profile.of(deck.value)
    thickness = profile.radius / 20
    if arguments.thickness:
        thickness = length(arguments.thickness, "thickness")
    least, most = profile.radius / 1000, 10 * profile.radius
    if not least <= thickness <= most:
        raise UserError(
            f"--thickness: expected {least:.3g} to {most:.3g} m for this drum, got {thickness:.6g} m"
        )
    tolerance = min(profile.radius / 2000, thickness / 2)
    if arguments.tolerance:
        tolerance = length(arguments.tolerance, "tolerance")
    finest = max(
        1e-6 * profile.radius, (profile.length / MOST_CORNERS) ** 2 / (8 * profile.arc_radius)
    )
    coarsest = min(profile.radius / 5, thickness / 2)
    if finest > coarsest:
        raise UserError(f"{deck.path}: too many buckles for triangles")
    if not finest <= tolerance <= coarsest:
        raise UserError(
            f"--tolerance: expected {finest:.2g} to {coarsest:.2g} m for this drum and wall, got {tolerance:.6g} m"
        )
    found = {}
    for part in arguments.part or PARTS:
        solids = PARTS[part](deck, tolerance, thickness)
        if arguments.part and not solids:
            raise UserError(f"{deck.path}: --part {part}: this mill has none")
        found[part] = solids
    return found


def stl(arguments):
    """Binary STL: 80 bytes of head, the number of triangles, 50 bytes a triangle, little-endian."""
    deck = deck_of(arguments.source, arguments.set)
    parts = bodies(deck, arguments)
    corners = np.concatenate([body for solids in parts.values() for body in solids])
    rows = np.zeros(
        len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")]
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rows["normal"] = normal / np.linalg.norm(normal, axis=1)[:, None]
    rows["corners"] = corners
    names = ", ".join(name for name, solids in parts.items() if solids)
    head = f"millsim {engine.version()}: {names}; metres".encode()[:80].ljust(80)
    write(arguments.file, head + np.uint32(len(rows)).astype("<u4").tobytes() + rows.tobytes())


def write(path, content: bytes):
    """Writes a file, whole or not at all; an old one is replaced."""
    path = pathlib.Path(path)
    draft = path.with_name(f"{path.name}.part")
    try:
        draft.write_bytes(content)
        os.replace(draft, path)
    except OSError as fault:
        draft.unlink(missing_ok=True)
        raise UserError(f"{path}: {fault.strerror or fault}", status=1) from None


FORMATS = {".stl": stl}


def run(arguments) -> int:
    suffix = pathlib.Path(arguments.file).suffix.lower()
    if suffix not in FORMATS:
        raise UserError(f"{arguments.file}: expected a name ending in {' or '.join(FORMATS)}")
    FORMATS[suffix](arguments)
    return 0
