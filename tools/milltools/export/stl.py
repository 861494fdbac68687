"""The mill's bodies as triangles, and as binary STL.

Drum, shaft and blades are separate closed bodies (solids.py). Bodies of sections [body.NAME] have the same surface as
in the run; of a container this is the inner surface.
"""

import numpy as np

from milltools.base import engine
from milltools.base.errors import UserError
from milltools.base.files import whole
from milltools.base.text import size
from milltools.export import source
from milltools.geometry import bodies, contour, solids, stl
from milltools.read.runfile import turned
from milltools.read.values import metres, seconds

MOST_CORNERS = 4000  # of one outline
FIXED = {"drum": "ball_drum", "walls": "ball_wall", "shaft": "ball_shaft", "blades": "ball_blade"}


class Parts:
    """The wanted parts of a mill. `at_start`: {part: [(motion, closed body (T, 3, 3) [m] at t = 0), ...]}."""

    def __init__(self, deck, arguments):
        self.deck = deck
        self.plain = not any(name.startswith(("body.", "motion.")) for name in deck.sections)
        self.first, found = {}, {}
        if "drum" in deck.sections:
            rides = dict.fromkeys(("drum", "walls"), deck.value("drum.motion", ""))
            for part, own in solids.parts(deck, *_sizes(deck, arguments)).items():
                found[part] = [(rides.get(part, "rotor"), body) for body in own]
        elif arguments.tolerance or arguments.thickness:
            raise UserError(f"{deck.path}: --tolerance, --thickness: this mill has no drum")
        if not self.plain:
            with bodies.bare(deck) as run:
                self.first = run.poses(0)
                for body in bodies.read(run):
                    if body.kind not in [kind for part, kind in FIXED.items() if found.get(part)]:
                        triangles = bodies.moved(bodies.Mill.pose(body.motion, self.first), body.triangles)
                        name = body.kind.removeprefix("ball_")
                        found.setdefault(name, []).append((body.motion, triangles))
        self.names = [*solids.PARTS, *(name for name in found if name not in solids.PARTS)]
        for part in arguments.part or ():
            if not found.get(part):
                there = ", ".join(name for name, own in found.items() if own)
                raise UserError(f"{deck.path}: --part {part}: this mill has no such part; it has {there}")
        self.at_start = {part: own for part, own in found.items() if own and part in (arguments.part or found)}

    def placed(self, pieces, time, poses=None):
        """The points of (motion, points at t = 0), in this order, at the `poses` of the motions or at a time [s]."""
        if self.plain:
            angle = self.deck.number("rotor.speed", 0.0) * time
            ways = {"rotor": turned(angle)} if angle else {}
        else:
            if poses is None and time > 0:
                with bodies.bare(self.deck, time) as run:
                    poses = run.poses(1)
            ways = {name: bodies.after(pose, self.first[name]) for name, pose in (poses or {}).items()}
        return np.concatenate([bodies.moved(ways[motion], p) if motion in ways else p for motion, p in pieces])


def _sizes(deck, arguments):
    """Tolerance and thickness of the drum's walls [m]."""
    wall, radius = contour.of(deck), deck.number("drum.radius")
    asked = metres({"--thickness": arguments.thickness, "--tolerance": arguments.tolerance})
    thickness = radius / 20 if asked[0] is None else asked[0]
    least, most = radius / 1000, 10 * radius
    if not least <= thickness <= most:
        raise UserError(f"--thickness: expected {least:.3g} to {most:.3g} m for this drum, got {thickness:.6g} m")
    tolerance = min(radius / 2000, thickness / 2) if asked[1] is None else asked[1]
    corners = (wall.lengths / np.sqrt(8 * wall.radius)).sum()  # for a tolerance of 1 m
    finest = max(1e-6 * radius, (corners / MOST_CORNERS) ** 2)
    coarsest = min(radius / 5, thickness / 2)
    if finest > coarsest or len(wall.vertices) > MOST_CORNERS:
        raise UserError(f"{deck.path}: too many arcs to describe them by triangles")
    if not finest <= tolerance <= coarsest:
        raise UserError(
            f"--tolerance: expected {finest:.2g} to {coarsest:.2g} m for this drum and wall, got {tolerance:.6g} m"
        )
    return tolerance, thickness


def asked_time(arguments) -> float:
    """Time [s] of the bodies: exactly --time, or the time of --frame, else 0."""
    if arguments.frame is not None:
        with source.open_run(arguments) as run:
            return float(source.stored(run)[source.one(run, arguments)])
    return seconds({"--time": arguments.time})[0] or 0.0


def mill(arguments):
    parts, time = Parts(source.deck_of(arguments), arguments), asked_time(arguments)
    corners = parts.placed([piece for own in parts.at_start.values() for piece in own], time)
    names = ", ".join(parts.at_start)
    content = stl.binary(corners, f"millsim {engine.version()}: {names}; metres", bodies.facing(corners)[0])
    with whole(arguments.file) as draft:
        draft.write_bytes(content)
    facts = {"parts": list(parts.at_start), "time": time, "triangles": len(corners), "bytes": len(content)}
    return f"{names} at {time:.6g} s: {len(corners)} triangles, {size(len(content))}", facts
