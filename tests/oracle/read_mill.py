"""From a deck's sections to the mill that the oracle runs: bodies and motions, and the drum, rotor and blades beside
them."""

import struct
from dataclasses import dataclass, field

import numpy as np
from any_mill import AnyMill, AnySimulation, Surface
from decks import Case, blades_of, mill_of, si
from motions import Motion, Shift, Swing, Table, Turn, rotation_of
from oracle import KINDS, Law, box_axes, length, wavy_arcs
from shapes import (
    Box,
    BoxInside,
    Capsule,
    CapsuleInside,
    Drum,
    Frustum,
    FrustumInside,
    Mesh,
    Shaft,
    X,
    Y,
)

TURN = 2 * np.pi
SPEEDS = {"rpm": TURN / 60, "1/min": TURN / 60, "rad/s": 1.0, "deg/s": TURN / 360}
FREQUENCIES = {"Hz": 1.0, "1/s": 1.0, "1/min": 1 / 60}


@dataclass
class AnyCase(Case):
    files: dict = field(default_factory=dict)  # name: bytes, of tables and meshes

    def simulation(self):
        return AnySimulation(self.mill, self.position, self.velocity, self.spin)


def measured(text, units):
    number, unit = text.split()
    return float(number) * units[unit]


def bare(text):
    return np.array([float(word) for word in text.split()])


# Motions


def table_of(data):
    rows = (line.split("#")[0].split() for line in data.decode().splitlines())
    return Table(np.array([[float(word) for word in row] for row in rows if row]))


def link_of(keys, files):
    if keys["kind"] == "table":
        return table_of(files[keys["file"]])
    phase = si(keys.get("phase", "0 deg"))
    if keys["kind"] == "shift":
        frequency = measured(keys["frequency"], FREQUENCIES)
        return Shift(si(keys["amplitude"]), frequency, np.broadcast_to(phase, 3))
    centre, axis = si(keys.get("centre", "0 0 0 m")), bare(keys.get("axis", "0 0 1"))
    if keys["kind"] == "turn":
        return Turn(centre, axis, measured(keys["speed"], SPEEDS), si(keys.get("angle", "0 deg")))
    frequency = measured(keys["frequency"], FREQUENCIES)
    return Swing(centre, axis, si(keys["amplitude"]), frequency, phase)


def motions_of(sections, files):
    motions = {}
    if "rotor" in sections:
        keys = sections["rotor"]
        angle = si(keys.get("angle", "0 deg"))
        motions["rotor"] = Motion(Turn(np.zeros(3), X, measured(keys["speed"], SPEEDS), angle))

    def motion(name):
        if name not in motions:
            keys = sections[f"motion.{name}"]
            carrier = motion(keys["on"]) if "on" in keys else None
            motions[name] = Motion(link_of(keys, files), carrier)
        return motions[name]

    for name in sections:
        if name.startswith("motion."):
            motion(name.removeprefix("motion."))
    return motions


# Bodies


def triangles_of(data):
    """Corners (n, 3, 3) of the facets of an STL file, ASCII or binary."""
    if data.startswith(b"solid"):
        lines = (line.split() for line in data.decode().splitlines())
        corners = [[float(word) for word in line[1:]] for line in lines if line[:1] == ["vertex"]]
        return np.array(corners).reshape(-1, 3, 3)
    (count,) = struct.unpack_from("<I", data, 80)
    facets = [struct.unpack_from("<12fH", data, 84 + 50 * k) for k in range(count)]
    return np.array([facet[3:12] for facet in facets]).reshape(-1, 3, 3)


def shape_of(keys, files):
    inside = keys.get("side", "outside") == "inside"
    rounding = si(keys.get("rounding", "0 m"))
    kind = keys["shape"]
    if kind == "box":
        half = si(keys["size"]) / 2
        return BoxInside(half) if inside else Box(half, rounding)
    if kind in ("cylinder", "cone"):
        radius, half = si(keys["radius"]), si(keys["length"]) / 2
        end = si(keys["end_radius"]) if kind == "cone" else radius
        return FrustumInside(radius, end, half) if inside else Frustum(radius, end, half, rounding)
    if kind in ("capsule", "sphere"):
        half = si(keys["length"]) / 2 if kind == "capsule" else 0.0
        return (CapsuleInside if inside else Capsule)(si(keys["radius"]), half)
    return Mesh(triangles_of(files[keys["file"]]) * si("1 " + keys["unit"]), inside)


def own_axes(keys):
    """Rotation from a body's own frame to its motion's: its z along `axis`, its x as near to the frame's as may be."""
    z = bare(keys.get("axis", "0 0 1"))
    z = z / length(z)
    near = Y if min(length(z - X), length(z + X)) < 1e-6 else X
    x = near - (near @ z) * z
    x = x / length(x)
    turn = rotation_of(si(keys.get("angle", "0 deg")) * z)
    return turn @ np.stack([x, np.cross(z, x), z], axis=-1)


def copies_of(name, keys, files):
    shape = shape_of(keys, files)
    kind = keys.get("kind", f"ball_{name}")
    place, rotation = si(keys.get("centre", "0 0 0 m")), own_axes(keys)
    about = bare(keys.get("turn_about", "0 0 1"))
    turn = rotation_of(si(keys.get("turn_by", "0 deg")) * about / length(about))
    shift = si(keys.get("shift_by", "0 0 0 m"))
    surfaces = []
    for number in range(int(keys.get("copies", "1"))):
        if number:
            place, rotation = turn @ place + shift, turn @ rotation
        labels = ((kind, number),) * shape.count
        surfaces.append(Surface(shape, labels, keys.get("motion"), place, rotation))
    return surfaces


def blade_surface(blade, number):
    half = np.array([blade.tip_radius, blade.width, blade.thickness]) / 2
    radial, wide, thick = box_axes(np.array(blade.angle), blade.pitch)
    axes = np.stack([radial, wide, -thick], axis=-1)  # right-handed: a cross product is taken in them
    place = blade.position * X + half[0] * axes[:, 0]
    return Surface(Box(half), (("ball_blade", number),), "rotor", place, axes)


def drum_surfaces(sections):
    """Drum with end walls, shaft and blades."""
    drum = sections["drum"]
    radius, reach = si(drum["radius"]), si(drum["length"]) / 2
    wave = si(drum.get("buckle_height", "0 m"))
    arcs = wavy_arcs(mill_of(sections)) if "buckles" in drum else None
    labels = (("ball_drum", -1), ("ball_wall", 0), ("ball_wall", 1))
    surfaces = [Surface(Drum(radius, reach, arcs, radius + wave), labels, drum.get("motion"))]
    shaft = si(sections.get("rotor", {}).get("shaft_radius", "0"))
    if shaft > 0:
        surfaces.append(Surface(Shaft(shaft, reach), (("ball_shaft", -1),), "rotor"))
    blades = blades_of(sections, 2 * reach)
    return surfaces + [blade_surface(blade, k) for k, blade in enumerate(blades)]


def any_mill_of(sections, files):
    surfaces = drum_surfaces(sections) if "drum" in sections else []
    for name, keys in sections.items():
        if name.startswith("body."):
            surfaces += copies_of(name.removeprefix("body."), keys, files)
    kinds = [keys for name, keys in sections.items() if name.startswith("balls.")]
    kinds = kinds or [sections["balls"]]
    counts = [int(keys["count"]) for keys in kinds]
    laws = {}
    for kind in (*KINDS, *(kind for surface in surfaces for kind, _ in surface.labels)):
        keys = {"friction": "0", "tangential_restitution": "0", **sections["contact"]}
        keys.update(sections.get(f"contact.{kind}", {}))
        laws[kind] = Law(*(float(keys[n]) for n in Law._fields[:2]),
                         float(keys["tangential_restitution"]))  # fmt: skip
    return AnyMill(
        radius=np.repeat([si(keys["diameter"]) / 2 for keys in kinds], counts),
        density=np.repeat([si(keys["density"]) for keys in kinds], counts),
        laws=laws,
        surfaces=surfaces,
        motions=motions_of(sections, files),
        rebound_floor=si(sections["contact"].get("rebound_floor", "5 mm/s")),
        gravity=si(sections.get("gravity", {}).get("acceleration", "0 0 -9.81 m/s^2")),
    )
