"""Pieces of random mills: shapes and motions as the keys of their sections, and the files they name. Lengths are in
mm."""

import struct

import numpy as np
from decks import number

GRID = 64  # corners of meshes are whole multiples of 1/GRID mm: float32 and decimals hold them exactly


def lengths(values):
    return " ".join(f"{value:.3f}" for value in np.atleast_1d(values)) + " mm"


def random_axis(rng):
    """Three bare numbers: a plain axis, or any direction, of any length."""
    if rng.random() < 0.5:
        return str(rng.choice(["1 0 0", "0 1 0", "0 0 1", "0 0 -2", "-1 0 0", "0 -0.5 0"]))
    return " ".join(f"{x:.3f}" for x in rng.normal(size=3) * rng.uniform(0.5, 2))


def random_direction(rng):
    a = rng.normal(size=3)
    return a / np.sqrt(a @ a)


def random_angle(rng):
    return f"{number(rng, -180, 360, 1)} deg"


# Meshes


def outward(points, facets):
    """Facets (corner numbers) of a convex body about its middle, all in right-hand order as seen from outside."""
    triangles = points[np.array(facets)]
    middle = points.mean(axis=0)
    a, b, c = np.moveaxis(triangles, 1, 0)
    turned = (np.cross(b - a, c - a) * (a - middle)).sum(axis=-1) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return triangles


def prism_mesh(rng, size, sides):
    """A prism over a polygon of `sides` corners; four sides may make a box."""
    half = np.round(size * rng.uniform(0.7, 1.3) * GRID) / GRID
    if sides == 4:
        wide, deep = np.round(size * rng.uniform(0.7, 1.3, 2) * GRID) / GRID
        ring = np.array([[wide, deep], [-wide, deep], [-wide, -deep], [wide, -deep]])
    else:
        at = 2 * np.pi * np.arange(sides) / sides + rng.uniform(0, 1)
        ring = np.stack([np.cos(at), np.sin(at)], axis=-1) * size * rng.uniform(1.1, 1.4)
        ring = np.round(ring * GRID) / GRID
    points = np.vstack(
        [
            np.column_stack([ring, np.full(sides, -half)]),
            np.column_stack([ring, np.full(sides, half)]),
        ]
    )
    facets = [(base, base + k, base + k + 1) for base in (0, sides) for k in range(1, sides - 1)]
    for k in range(sides):
        after = (k + 1) % sides
        facets += [(k, after, after + sides), (k, after + sides, k + sides)]
    return outward(points, facets)


def stl(triangles, binary):
    """The triangles as the bytes of an STL file."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    normals /= np.sqrt((normals**2).sum(axis=-1))[:, None]
    if binary:
        facets = (struct.pack("<12fH", *n, *t.ravel(), 0) for n, t in zip(normals, triangles))
        return b"a mesh".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(facets)
    lines = ["solid part"]
    for n, corners in zip(normals.tolist(), triangles.tolist()):
        lines += ["facet normal {:.6g} {:.6g} {:.6g}".format(*n), "outer loop"]
        lines += ["vertex {!r} {!r} {!r}".format(*corner) for corner in corners]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part", ""]).encode()


# Shapes


def random_shape(rng, way, size, name):
    """Keys of a shape about `size` mm from its middle to its surface, and its files."""
    wide = size * rng.uniform(0.8, 1.2)
    rounding = {}
    if way.startswith("round "):
        way = way.removeprefix("round ")
        rounding = {"rounding": lengths(size * rng.uniform(0.1, 0.5))}
    long = lengths(2 * size * rng.uniform(0.8, 1.5))
    keys = {"shape": way, **rounding}
    if way == "sphere":
        return {**keys, "radius": lengths(wide)}, {}
    if way == "box":
        return {**keys, "size": lengths(2 * size * rng.uniform(0.7, 1.3, 3))}, {}
    if way in ("cylinder", "capsule"):
        return {**keys, "radius": lengths(wide), "length": long}, {}
    if way == "cone":
        end = wide * rng.uniform(0.6, 1.6)
        return {**keys, "radius": lengths(wide), "end_radius": lengths(end), "length": long}, {}
    sides = 4 if way == "box mesh" else int(rng.choice([3, 5, 6]))
    triangles = prism_mesh(rng, size, sides)
    off = np.round(size * rng.uniform(-0.5, 0.5, 3) * (rng.random() < 0.3) * GRID) / GRID
    file, data = f"{name}.stl", stl(triangles + off, binary=rng.random() < 0.5)
    return {"shape": "mesh", "file": file, "unit": "mm"}, {file: data}


def slender(rng, way, size, name):
    """Keys of a pin, a disc or a plate of about this size; a mesh or a cone is as before."""
    keys, files = random_shape(rng, way, size, name)
    thin = size * rng.uniform(0.2, 0.4)
    if rng.random() < 0.5:
        if way in ("cylinder", "capsule"):
            keys["radius"], keys["length"] = lengths(thin), lengths(2.5 * size)
        elif way == "round cylinder":
            keys["length"] = lengths(2 * thin)
        elif way in ("box", "round box"):
            sides = 2 * np.array([size * 1.2, size, thin])
            keys["size"] = lengths(rng.permutation(sides))
        if "rounding" in keys:
            keys["rounding"] = lengths(thin * rng.uniform(0.3, 0.9))
    return keys, files


# Motions


def speed_text(rng, speed):
    unit, factor = {
        0: ("rpm", 60 / (2 * np.pi)),
        1: ("rad/s", 1.0),
        2: ("deg/s", 180 / np.pi),
        3: ("1/min", 60 / (2 * np.pi)),
    }[int(rng.integers(4))]
    return f"{speed * factor:.3f} {unit}"


def frequency_text(rng, frequency):
    if rng.random() < 0.25:
        return f"{60 * frequency:.2f} 1/min"
    return f"{frequency:.3f} {rng.choice(['Hz', 'Hz', '1/s'])}"


def turn(rng, speed, centre=None, axis=None):
    keys = {"kind": "turn", "axis": axis or random_axis(rng), "speed": speed_text(rng, speed)}
    if centre is not None:
        keys["centre"] = lengths(centre)
    if rng.random() < 0.5:
        keys["angle"] = random_angle(rng)
    return keys


def swing(rng, speed, arm, centre):
    """A swing that moves what is `arm` mm from its axis at `speed` m/s."""
    amplitude = rng.uniform(4, 20)
    frequency = speed * 1e3 / (2 * np.pi * arm * np.radians(amplitude))
    keys = {"kind": "swing", "centre": lengths(centre), "axis": random_axis(rng)}
    keys.update(amplitude=f"{amplitude:.2f} deg", frequency=frequency_text(rng, min(frequency, 60)))
    if rng.random() < 0.5:
        keys["phase"] = random_angle(rng)
    return keys


def shift(rng, speed, stroke):
    amplitude = stroke * rng.uniform(0.1, 1, 3) * (rng.random(3) < 0.7)
    amplitude[int(rng.integers(3))] = stroke
    frequency = min(speed * 1e3 / (2 * np.pi * stroke), 80)
    keys = {"kind": "shift", "amplitude": lengths(amplitude)}
    keys["frequency"] = frequency_text(rng, frequency)
    if rng.random() < 0.7:
        phases = rng.uniform(-180, 180, int(rng.choice([1, 3])))
        keys["phase"] = " ".join(f"{phase:.1f}" for phase in phases) + " deg"
    return keys


def table(rng, speed, stroke, reach, name):
    """Two harmonics of place and of rotation vector, about any middle, at rows that are not evenly apart."""
    swing = rng.uniform(0.05, 0.3)
    period = np.round(2 * np.pi * (stroke + swing * reach) / (speed * 1e3), 3)
    period = np.clip(period, 0.02, 0.3)
    rows = int(rng.integers(8, 15))
    at = (np.arange(rows) + rng.uniform(-0.25, 0.25, rows)) / rows
    at[0] = 0.0
    scale = np.array([stroke * 1e-3] * 3 + [swing] * 3)
    value = np.concatenate([np.zeros(3), rng.uniform(-1, 1, 3)])
    for wave in (1, 2):
        size = scale / wave**2 * rng.uniform(-1, 1, 6)
        value = value + size * np.cos(2 * np.pi * (wave * at[:, None] + rng.uniform(0, 1, 6)))
    # starts a whole number of periods from zero: t is any
    first = period * int(rng.choice([0, 0, 1, -2, 3]))
    lines = ["# t x y z rx ry rz"]
    for t, row in zip([*(at * period), period], [*value, value[0]]):
        lines.append(" ".join([f"{first + t:.9f}", *(f"{x:.9f}" for x in row)]))
    return {"kind": "table", "file": f"{name}.txt"}, "\n".join([*lines, ""]).encode()


def random_motion(rng, way, name, arm, reach, stroke):
    """Sections of motion `name` for a body that reaches `reach` mm: about `arm` mm from where it turns, or moved by
    `stroke`. Returns them, their files, and where the body's middle best is in the motion's frame."""
    speed = np.exp(rng.uniform(np.log(0.5), np.log(3.5))) * rng.choice([-1, 1])
    key, under = f"motion.{name}", f"motion.{name}_under"
    rate = speed * 1e3 / (arm + reach)
    off = arm * random_direction(rng)
    centre = rng.uniform(-0.2, 0.2, 3) * reach
    if way == "turn":
        return {key: turn(rng, rate, centre)}, {}, centre + off
    if way == "planetary":
        axis = random_axis(rng) if rng.random() < 0.3 else "0 0 1"
        own = off * np.array([1, 1, 0])
        jar = turn(rng, rate * rng.uniform(-2.5, 1), own, axis)
        return {key: {**jar, "on": f"{name}_under"}, under: turn(rng, rate, None, "0 0 1")}, {}, own
    if way == "swing":
        return {key: swing(rng, abs(speed), arm + reach, centre)}, {}, centre + off
    if way == "shift":
        return {key: shift(rng, abs(speed), stroke)}, {}, centre
    if way == "table":
        keys, data = table(rng, abs(speed), stroke, reach, name)
        return {key: keys}, {keys["file"]: data}, centre
    if way == "swing on swing":
        own = {**swing(rng, abs(speed) / 2, arm + reach, centre), "on": f"{name}_under"}
        return {key: own, under: swing(rng, abs(speed) / 2, arm + reach, centre)}, {}, centre + off
    own = {**turn(rng, rate / 2, centre), "on": f"{name}_under"}
    return {key: own, under: shift(rng, abs(speed) / 2, stroke)}, {}, centre + off
