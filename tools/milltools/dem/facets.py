"""Bodies of a deck as flat facets, where their motion's frame has them; what is curved is refused."""

import pathlib

import numpy as np

from milltools.base.errors import UserError
from milltools.dem.paths import turned
from milltools.geometry.solids import FACES

FLAT = np.cos(np.radians(10))  # between neighbouring facets: nearer to flat than this they are a curved wall's
CORNERS = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / 2


def fault(deck, name, key, reason):
    """UserError about a key of [body.NAME]."""
    return UserError(f"{deck.path}: [body.{name}] {key}: {reason}")


def axes(deck, name):
    """Rows (3, 3): the body's own z, x and y in its motion's frame; and its middle (3,)."""
    place = f"body.{name}"
    z = np.array(deck.numbers(f"{place}.axis") or [0.0, 0.0, 1.0])
    z = z / np.linalg.norm(z)
    across = np.eye(3)[1 if np.hypot(z[1], z[2]) < 1e-6 else 0]
    x = across - (across @ z) * z
    x = turned(z, deck.number(f"{place}.angle", 0.0)) @ (x / np.linalg.norm(x))
    middle = np.array(deck.numbers(f"{place}.centre") or [0.0] * 3)
    return np.array([z, x, np.cross(z, x)]), middle


def read_stl(path):
    """Triangles (T, 3, 3) of an STL file, binary or ASCII."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:84], "little")
    if len(content) == 84 + 50 * count:
        rows = np.frombuffer(content, np.dtype([("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]), offset=84)  # fmt: skip
        return rows["p"].astype(float)
    words = [line.split()[1:4] for line in content.decode(errors="replace").splitlines() if line.split()[:1] == ["vertex"]]  # fmt: skip
    return np.array(words, float).reshape(-1, 3, 3)


def own_triangles(deck, name):
    """Of a box or a mesh around its own origin, outwards; rows of coordinates are along its own z, x, y."""
    place, shape = f"body.{name}", deck.value(f"body.{name}.shape")
    if shape == "box":
        corner = CORNERS * np.roll(deck.numbers(f"{place}.size"), 1)
        return np.array([corner[list(t)] for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))])
    file = pathlib.Path(deck.path).parent / deck.value(f"{place}.file").strip('"')
    try:
        triangles = read_stl(file) * deck.number(f"{place}.unit", 1.0)
    except (OSError, ValueError) as reason:
        raise fault(deck, name, "file", f"{file}: {reason}") from None
    if curved(triangles):
        raise fault(deck, name, "file", "its facets make a curved wall, on which LIGGGHTS adds up the forces of neighbours, which changes restitution")  # fmt: skip
    return np.roll(triangles, 1, axis=2)


def curved(triangles):
    """Whether facets that share an edge are nearly, but not quite, in one plane."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    size = np.abs(triangles).max()
    owner = {}
    for k, triangle in enumerate(np.round(triangles / size, 6)):
        for a, b in ((0, 1), (1, 2), (2, 0)):
            owner.setdefault(frozenset((tuple(triangle[a]), tuple(triangle[b]))), []).append(k)
    between = np.array([normal[k[0]] @ normal[k[1]] for k in owner.values() if len(k) == 2])
    return bool(((between > FLAT) & (between < 1 - 1e-9)).any())


def copies(deck, name):
    """[triangles (T, 3, 3) of each copy in the frame of its motion]."""
    place = f"body.{name}"
    rows, middle = axes(deck, name)
    now = own_triangles(deck, name) @ rows + middle
    about = np.array(deck.numbers(f"{place}.turn_about") or [0.0, 0.0, 1.0])
    turn = turned(about / np.linalg.norm(about), deck.number(f"{place}.turn_by", 0.0))
    shift = np.array(deck.numbers(f"{place}.shift_by") or [0.0] * 3)
    found = [now]
    for _ in range(int(deck.number(f"{place}.copies", 1)) - 1):
        found.append(found[-1] @ turn.T + shift)
    return found
