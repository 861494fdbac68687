"""/VTKHDF of another program's run: its frames as VTK, ParaView and F3D read them, laid out as src/observe/vtkhdf.c does it.

docs/file-format.md names everything in it. Balls are virtual datasets over /particles/trajectory, what blocks have in
common is linked; only the corners of the turning rotor are written for every frame.
"""

import numpy as np
from h5py import SoftLink, h5d, h5p, h5s, h5t

from milltools.geometry import solids
from milltools.geometry.profile import Profile
from milltools.h5write import append, label, make_column, put, put_attribute, put_column
from milltools.read.kinds import KINDS

TRAJECTORY = "/particles/trajectory"
VERSION = (2, 1)
FLAT = 1e-3  # of the drum's radius: no triangle is farther from the surface it stands for
CELLS = ("Vertices", "Lines", "Polygons", "Strips")
NONE = "no cells of this kind"


def write(file, deck):
    """Adds the group to an h5py.File with all its frames, of the run of `deck` (milltools.read.deck.Deck); nothing without."""
    if f"{TRAJECTORY}/position/time" not in file or not len(file[f"{TRAJECTORY}/position/time"]):
        return
    root = _typed(file, "VTKHDF", "PartitionedDataSetCollection")
    root.create_group("Assembly", track_order=True)
    balls = _begin_block(root, "balls")
    _put_balls(file, balls)
    _put_body(file, root, "drum", _drum(deck), 0.0)
    rotor = _rotor(deck)
    if len(rotor[0]):
        _put_body(file, root, "rotor", rotor, deck.number("rotor.speed", 0.0))


# ---- what all blocks have


def _typed(group, name, kind):
    """A group as VTK knows it by its attributes; VTK wants its members in order."""
    made = group.create_group(name, track_order=True)
    made.attrs.create("Version", np.array(VERSION, "<i8"))
    made.attrs.create("Type", np.array(kind.encode(), f"S{len(kind)}"))
    return made


def _begin_block(root, name):
    """A block's group, its place in the collection and in the tree of names."""
    block = _typed(root, name, "PolyData")
    block.attrs.create("Index", np.int64(len(root["Assembly"])))
    root["Assembly"].create_group(name, track_order=True)[name] = SoftLink(block.name)
    return block


def _link(block, name, existing):
    """Another name for what stands elsewhere in the file; groups on the way are h5py's own, which note no times."""
    group, _, leaf = name.rpartition("/")
    (block.require_group(group) if group else block)[leaf] = existing


def _numbers(block, name, rows, text):
    rows = np.asarray(rows)
    put_column(block, name, rows, "<i8", "1", text)


def _number(block, name, value, text):
    put(block, name, [value], "1", text, "<i8")


def _put_cells(block, kind, corners, each):
    """Cells of one kind by their corners (cells * each,); the other kinds are empty."""
    first = block.parent["balls"]
    for name in CELLS:
        if name == kind:
            continue
        if "Lines" in first:
            block[name] = first["Lines"]
            continue
        _number(block, "Lines/NumberOfCells", 0, NONE)
        for same in ("NumberOfConnectivityIds", "Offsets"):
            _link(block, f"Lines/{same}", block["Lines/NumberOfCells"])
        _numbers(block, "Lines/Connectivity", np.empty(0, int), NONE)
    count = len(corners) // each
    _number(block, f"{kind}/NumberOfCells", count, "number of cells")
    text = "number of the corners of all cells"
    _number(block, f"{kind}/NumberOfConnectivityIds", len(corners), text)
    text = "where a cell's corners begin, and the end"
    _numbers(block, f"{kind}/Offsets", np.arange(count + 1) * each, text)
    if kind == "Vertices":
        _numbers(block, f"{kind}/Connectivity", corners, "corners of the cells: points")
    else:
        put(block, f"{kind}/Connectivity", corners, "1", "corners of the cells: points", "<i8")


def _put_steps(file, block, moving):
    """Times and offsets of the steps; moving: each has its own points, else all have the same."""
    times = file[f"{TRAJECTORY}/position/time"]
    count, first = len(times), block.parent["balls"]
    _link(block, "Steps/Values", times)
    steps = block["Steps"]
    steps.attrs.create("NSteps", np.int64(count))
    if block == first:
        text = "where a frame begins in what all frames share: 0"
        _numbers(steps, "PartOffsets", np.zeros(count), text)
        _numbers(steps, "NumberOfParts", np.ones(count), "parts of a frame: 1")
        text = "where a frame's vertices, lines, polygons and strips begin: 0, all frames share them"
        _numbers(steps, "CellOffsets", np.zeros((count, 4)), text)
    else:
        for name in ("PartOffsets", "NumberOfParts", "CellOffsets"):
            steps[name] = first[f"Steps/{name}"]
    steps["ConnectivityIdOffsets"] = steps["CellOffsets"]
    if moving:
        points = block["NumberOfPoints"][0]
        text = "where a frame's points, and what changes with them, begin"
        _numbers(steps, "PointOffsets", np.arange(count) * points, text)
    else:
        steps["PointOffsets"] = steps["PartOffsets"]


# ---- balls


def _put_view(block, name, source, text):
    """The frames (F, N, 3) of `source` as (F * N, 3), without storing them again."""
    frames, balls, _ = source.shape
    space, layout = h5s.create_simple((frames * balls, 3)), h5p.create(h5p.DATASET_CREATE)
    layout.set_obj_track_times(False)
    # "." is this file, whatever its name will be
    layout.set_virtual(space, b".", source.name.encode(), h5s.create_simple(source.shape))
    group, _, leaf = name.rpartition("/")
    group = block.require_group(group) if group else block
    h5d.create(group.id, leaf.encode(), h5t.IEEE_F32LE, space, layout)
    label(group[leaf], source.attrs["unit"], text)


def _put_balls(file, block):
    balls = file[TRAJECTORY]
    count = len(balls["id"])
    _number(block, "NumberOfPoints", count, "number of points of a frame")
    text = "centres of the balls, frame after frame"
    _put_view(block, "Points", balls["position/value"], text)
    _put_cells(block, "Vertices", np.arange(count), 1)
    _put_steps(file, block, moving=True)
    for name, what in (("velocity", "velocities"), ("angular_velocity", "angular velocities")):
        text = f"{what} of the balls, frame after frame"
        _put_view(block, f"PointData/{name}", balls[f"{name}/value"], text)
        _link(block, f"Steps/PointDataOffsets/{name}", block["Steps/PointOffsets"])
    for name in ("diameter", "id", "mass", "species"):
        _link(block, f"PointData/{name}", balls[name])
        _link(block, f"Steps/PointDataOffsets/{name}", block["Steps/PartOffsets"])


# ---- drum and rotor


def _drum(deck):
    """Triangles (T, 3, 3) of drum and end walls as the balls see them, and kind and number (T,) of each."""
    profile, half = Profile.of(deck.value), deck.number("drum.length") / 2
    outline = profile.outline(FLAT * profile.radius)
    triangles = solids.prism(outline, -half, half)[:, ::-1]
    flat = np.ptp(triangles[:, :, 0], axis=1) == 0
    kind = np.where(flat, KINDS.index("ball_wall"), KINDS.index("ball_drum"))
    return triangles, kind, np.where(flat, triangles[:, 0, 0] > 0, -1)


def _rotor(deck):
    """The same of shaft and blades, the rotor as at t = 0."""
    tolerance = FLAT * deck.number("drum.radius")
    bodies = [(body, "ball_shaft", -1) for body in solids.shaft(deck, tolerance, 0.0)]
    if deck.blades:
        bodies += [(body, "ball_blade", k) for k, body in enumerate(solids.blades(deck, 0.0, 0.0))]
    if not bodies:
        return np.empty((0, 3, 3)), np.empty(0, int), np.empty(0, int)
    return (
        np.concatenate([body for body, _, _ in bodies]),
        np.concatenate([np.full(len(body), KINDS.index(kind)) for body, kind, _ in bodies]),
        np.concatenate([np.full(len(body), number) for body, _, number in bodies]),
    )


def _turned(points, angle):
    """Points (P, 3) turned about +x."""
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[1, 0, 0], [0, c, s], [0, -s, c]])


def _put_body(file, root, name, body, speed):
    """Drum or rotor, turning at `speed` [rad/s]; what stands is stored once."""
    triangles, kind, number = body
    block = _begin_block(root, name)
    points, corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    _number(block, "NumberOfPoints", len(points), "number of points of a frame")
    if speed:
        text = "corners of the triangles, frame after frame"
        column = make_column(block, "Points", (3,), "<f4", "m", text)
        for time in file[f"{TRAJECTORY}/position/time"][:]:
            append(column, _turned(points, speed * time).astype("<f4"))
    else:
        put(block, "Points", points, "m", "corners of the triangles", "<f4")
    _put_cells(block, "Polygons", corners.reshape(-1), 3)
    _put_steps(file, block, moving=bool(speed))
    text = "what the triangle is part of, as the kind of contact with it: index into the attribute kinds"
    put(block, "CellData/kind", kind, "1", text, "u1")
    put_attribute(block["CellData/kind"], "kinds", KINDS)
    text = "number of the blade, end wall or copy of a body, -1 for drum and shaft"
    put(block, "CellData/number", number, "1", text, "<i4")
    for item in ("kind", "number"):
        _link(block, f"Steps/CellDataOffsets/{item}", block["Steps/PartOffsets"])
