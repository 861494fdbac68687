"""The mill's bodies as triangles, and as binary STL."""

import math

import numpy as np

from milltools import engine
from milltools.errors import UserError
from milltools.export import source, whole
from milltools.profile import Profile
from milltools.solids import PARTS

MOST_CORNERS = 4000  # of an outline
TURNING = ("shaft", "blades")


def bodies(deck, arguments) -> dict[str, list[np.ndarray]]:
    """The wanted parts of a mill at t = 0, {part: closed bodies (T, 3, 3) [m]}."""
    profile = Profile.of(deck.value)
    thickness = profile.radius / 20
    if arguments.thickness:
        thickness = source.length(arguments.thickness, "thickness")
    least, most = profile.radius / 1000, 10 * profile.radius
    if not least <= thickness <= most:
        raise UserError(
            f"--thickness: expected {least:.3g} to {most:.3g} m for this drum, got {thickness:.6g} m"
        )
    tolerance = min(profile.radius / 2000, thickness / 2)
    if arguments.tolerance:
        tolerance = source.length(arguments.tolerance, "tolerance")
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
        if solids:
            found[part] = solids
    return found


def turned(corners, angle):
    """Points (..., 3) turned about +x by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = np.moveaxis(corners, -1, 0)
    # number by number, so that corners that meet stay the same to the bit; a matrix product need not keep them
    return np.stack([x, c * y - s * z, s * y + c * z], axis=-1)


def at_time(deck, parts, time):
    """The parts with the rotor as it stands at a time [s], its angle at t = 0 being in them already."""
    angle = deck.number("rotor.speed", 0.0) * time
    return {
        part: [turned(body, angle) for body in solids] if part in TURNING and angle else solids
        for part, solids in parts.items()
    }


def asked_time(arguments) -> float:
    """[s]: --time exactly, or that of --frame; else 0."""
    if arguments.frame is not None:
        with source.open_run(arguments) as run:
            return float(source.stored(run)[source.one(run, arguments)])
    return 0.0 if arguments.time is None else source.moment(arguments.time, "time")


def write(arguments):
    """Binary STL: 80 bytes of head, the number of triangles, 50 bytes a triangle, little-endian."""
    deck = source.deck_of(arguments.source, arguments.set)
    time = asked_time(arguments)
    parts = at_time(deck, bodies(deck, arguments), time)
    corners = np.concatenate([body for solids in parts.values() for body in solids])
    rows = np.zeros(
        len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")]
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    rows["normal"] = normal / np.linalg.norm(normal, axis=1)[:, None]
    rows["corners"] = corners
    names = ", ".join(parts)
    head = f"millsim {engine.version()}: {names}; metres".encode()[:80].ljust(80)
    content = head + np.uint32(len(rows)).astype("<u4").tobytes() + rows.tobytes()
    with whole.file(arguments.file) as draft:
        draft.write_bytes(content)
    return f"{names} at {time:.6g} s: {len(rows)} triangles, {whole.size(len(content))}"
