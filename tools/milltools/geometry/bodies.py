"""The bodies of a mill as triangles, each in the frame of the motion that carries it. Pictures, player and exports use
them. They are read from /VTKHDF, which every finished run has. For other runs millsim runs the deck for an instant with
one ball.

A pose is an array (3, 4): a point p of a motion's frame is at pose[:, :3] @ p + pose[:, 3] in the laboratory.
Triangles (T, 3, 3) are counter-clockwise seen from outside of the body; a container's from outside of the mill.
"""

import contextlib
import dataclasses
import functools
import weakref

import numpy as np

from milltools.geometry import rerun
from milltools.read.wear import PLACE

STILL = np.eye(3, 4)
INSTANT = 1e-6  # [s] end of a run that is made only for the bodies of its deck
SAMPLED = 120  # number of poses used to find the space that a motion sweeps
SHARP = np.cos(np.radians(35))  # an edge is sharp if the angle between the normals of its faces is larger
RIM = 0.04  # thickness of the bars along the container's edges, as a share of its size
LINE = 0.003  # the same along the edges of worn bodies
WANDERS = 2.0  # a camera moves with a container whose path is longer than this, in sizes of the container
FLAT = 0.04  # a wall is flat if this share of the container's surface is in one plane
SAME = 1e-6  # corners closer than this share of the mill's size are one corner


def _around(count):
    """Unit vectors in all directions, evenly distributed on a spiral of golden angles, and those along the axes."""
    k = np.arange(count) + 0.5
    angle, height = np.pi * (1 + 5**0.5) * k, 1 - 2 * k / count
    flat = np.sqrt(1 - height**2)
    spiral = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])
    return np.concatenate([spiral, np.eye(3), -np.eye(3)])


DIRECTIONS = _around(1000)

_KEPT = weakref.WeakKeyDictionary()  # cache: open run -> its Mill


def moved(pose, points):
    """Points (..., 3) of a motion's frame in the laboratory. Unlike a matrix product, it keeps equal corners equal to
    the bit."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([a * x + b * y + c * z + d for a, b, c, d in pose], axis=-1)


def facing(triangles):
    """Unit normals (T, 3) of triangles, and twice their areas (T,)."""
    normal = np.cross(*(triangles[:, k] - triangles[:, 0] for k in (1, 2)))
    twice = np.linalg.norm(normal, axis=1)
    return normal / np.maximum(twice, 1e-300)[:, None], twice


def inverse(pose):
    back = pose[:, :3].T
    return np.column_stack([back, -back @ pose[:, 3]])


def container(run, index):
    """The pose of the container, as the frame of the maps has it, in a stored frame of a run."""
    return after(Mill.pose(run.mapped, run.poses(index)), inverse(run.vessel_frame()))


def seen(run, motion, points, poses):
    """Points (..., 3) of a motion's frame in the frame of the maps, where motions are at `poses`."""
    if motion != run.mapped:
        ride, own = (Mill.pose(one, poses) for one in (run.mapped, motion))
        points = moved(inverse(ride), moved(own, points))
    return moved(inverse(run.vessel_frame()), points)


def after(pose, first):
    """The displacement (3, 4) from the pose `first` of a motion to another pose."""
    back = inverse(first)
    return np.column_stack([pose[:, :3] @ back[:, :3], moved(pose, back[:, 3])])


@dataclasses.dataclass(frozen=True)
class Body:
    """Surfaces of one kind of contact that one motion ("": none) carries; `number` (T,): index of the blade, wall or
    copy."""

    kind: str
    motion: str
    triangles: np.ndarray
    number: np.ndarray


@contextlib.contextmanager
def bare(deck, time=0.0, frames=1):
    """The Run of a Deck with one ball of each kind: frame 0 shows the bodies at t = 0, the last one of so many `frames`
    after it at `time` [s]."""
    until = time if time > 0 else INSTANT
    changes = rerun.frames_only(until, until / frames)
    changes["balls.start"] = "random"
    kinds = [section for section in deck.sections if section.startswith("balls.")] or ["balls"]
    changes |= {f"{kind}.count": "1" for kind in kinds}
    with rerun.run_of(deck, changes) as run:
        yield run


class Mill:
    """All bodies of a run, its container, and the poses of the motions."""

    def __init__(self, bodies, container, poses, axis=(1.0, 0.0, 0.0)):
        self.bodies = bodies
        self.container = container  # the kinds of the container's surfaces
        self.axis = np.array(axis)  # of the container, in the laboratory at the start
        self.poses = poses  # dictionaries as from Run.poses, at times throughout the run

    @classmethod
    def of(cls, run) -> "Mill":
        """From a milltools.read.runfile.Run."""
        if run not in _KEPT:
            frames = len(run.frame_times())
            chosen = np.unique(np.linspace(0, frames - 1, min(frames, SAMPLED)).astype(int))
            poses = [run.poses(int(k)) for k in chosen]
            with contextlib.nullcontext(run) if run.has("VTKHDF") else bare(run.as_deck) as source:
                first = source.first_poses()
                _KEPT[run] = cls(read(source), run.vessel_kinds, poses or [first], run.frame_axis(first))
        return _KEPT[run]

    @property
    def walls(self) -> list[Body]:
        """The bodies of the container."""
        return [body for body in self.bodies if body.kind in self.container]

    @property
    def inner(self) -> list[Body]:
        """All other bodies."""
        return [body for body in self.bodies if body.kind not in self.container]

    @property
    def carrier(self) -> str:
        """The motion that moves the container; "": it stands still."""
        return next((body.motion for body in self.walls), "")

    @functools.cached_property
    def shell(self) -> np.ndarray:
        """The container's triangles, without those that have no area."""
        found = np.concatenate([np.empty((0, 3, 3)), *(body.triangles for body in self.walls)])
        return found[facing(found)[1] > SAME**2 * np.ptp(found, axis=(0, 1)).max() ** 2] if len(found) else found

    @functools.cached_property
    def glass(self) -> np.ndarray:
        """The triangles of the shell to draw: those of round walls. Flat walls would only dim the picture; the bars
        along the edges show them."""
        normal, area = facing(self.shell)
        away = np.einsum("ij,ij->i", normal, self.shell[:, 0]) / self.size
        _, plane = np.unique(np.round(np.column_stack([normal, away]), 3), axis=0, return_inverse=True)
        share = np.bincount(plane.ravel(), area)[plane.ravel()] / area.sum()
        return self.shell[share < FLAT]

    @functools.cached_property
    def size(self) -> float:
        """Half of the container's smallest extent [m]: the unit for the widths of lines."""
        points = self.shell.reshape(-1, 3)
        return float(np.ptp(points, axis=0).min()) / 2 if len(points) else 1.0

    @functools.cached_property
    def hull(self) -> np.ndarray:
        """Points (K, 3) [m] whose convex hull contains the container at all times."""
        return self.swept(self.poses)

    @functools.cached_property
    def wanders(self) -> bool:
        """Whether the path of the container is so long that a picture of the whole path shows the container small."""
        path, own = (np.linalg.norm(np.ptp(p, axis=0)) for p in (self.hull, self.swept(self.poses[:1])))  # fmt: skip
        return bool(path > WANDERS * own)

    @functools.cached_property
    def reach(self) -> float:
        """The largest distance of any body from the origin of the laboratory at any time [m]."""
        far = [
            np.linalg.norm(body.triangles.reshape(-1, 3), axis=1).max(initial=0)
            + max((np.linalg.norm(self.pose(body.motion, p)[:, 3]) for p in self.poses), default=0.0)
            for body in self.bodies
        ]
        return max(far, default=0.0)

    @staticmethod
    def pose(motion, poses):
        """The pose of a motion, from the poses of a frame; STILL if the motion has none."""
        return poses.get(motion, STILL)

    def swept(self, poses) -> np.ndarray:
        """Points (K, 3) [m] whose convex hull contains the container and the bodies fixed to it in each of
        `poses`."""
        where = [self.pose(self.carrier, one) for one in poses] or [STILL]
        where = np.unique(np.round(where, 12), axis=0)
        aboard = [b.triangles for b in self.inner if self.carrier and b.motion == self.carrier]
        points = outermost(np.concatenate([self.shell, *aboard]).reshape(-1, 3))
        return outermost(np.concatenate([moved(pose, points) for pose in where]))

    @functools.cached_property
    def edges(self) -> np.ndarray:
        """Sharp edges of the container (E, 2, 3) [m], and those of its open ends, in its motion's frame."""
        return sharp_edges(self.shell, SAME * self.size, ends=True)

    @functools.cached_property
    def creases(self) -> dict[str, np.ndarray]:
        """Sharp edges of the other bodies (E, 2, 3) [m] by their motion: faces of one colour can be told apart."""
        found = {}
        for body in self.inner:
            found.setdefault(body.motion, []).append(sharp_edges(body.triangles, SAME * self.size))
        return {motion: np.concatenate(edges) for motion, edges in found.items()}

    @property
    def line(self) -> float:
        """Radius of the bars along the creases [m]."""
        return LINE * self.size

    @property
    def rim(self) -> float:
        """Radius of the bars along the container's edges, from the middle to a corner [m]."""
        return RIM * self.size

    @functools.cached_property
    def frame(self) -> np.ndarray:
        """Triangles of six-sided bars along the container's sharp edges."""
        return bars(self.edges, self.rim)


def sharp_edges(triangles, same, ends=False):
    """Edges (E, 2, 3) of triangles (T, 3, 3) between two faces that turn by more than SHARP, with `ends` also those of
    one face; corners nearer than `same` [m] are one."""
    triangles = triangles[facing(triangles)[1] > same**2]
    _, index = np.unique(np.round(triangles.reshape(-1, 3) / same), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    normal, _ = facing(triangles)
    sides = np.concatenate([index[:, [k, (k + 1) % 3]] for k in range(3)])
    places = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    owner = np.tile(np.arange(len(index)), 3)
    _, first, edge = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(edge.ravel(), kind="stable")
    edge, owner = edge.ravel()[order], owner[order]
    pairs = np.flatnonzero(edge[1:] == edge[:-1])
    turn = np.einsum("ij,ij->i", normal[owner[pairs]], normal[owner[pairs + 1]])
    alone = np.flatnonzero(np.bincount(edge) == 1) if ends else []
    return places[first[np.r_[edge[pairs[turn < SHARP]], alone].astype(int)]]


def bars(edges, width):
    """Triangles (24 E, 3, 3) of six-sided bars around lines (E, 2, 3); the bars are a little longer than the lines."""
    if not len(edges):
        return np.empty((0, 3, 3))
    along = edges[:, 1] - edges[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    other = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    one = np.cross(along, other)
    one *= width / np.linalg.norm(one, axis=1)[:, None]
    two = np.cross(along, one)
    angle = np.arange(6) * np.pi / 3
    ring = np.cos(angle)[:, None, None] * one + np.sin(angle)[:, None, None] * two
    a, b = (ring + edges[:, k] + sign * 0.3 * width * along for k, sign in ((0, -1), (1, 1)))
    a_next, b_next = np.roll(a, -1, axis=0), np.roll(b, -1, axis=0)
    middle = [np.broadcast_to(end.mean(axis=0), end.shape) for end in (a, b)]
    faces = [(a, a_next, b_next), (a, b_next, b), (middle[0], a_next, a), (middle[1], b, b_next)]
    return np.concatenate([np.stack(face, axis=2).reshape(-1, 3, 3) for face in faces])


def outline(points):
    """The corners of the convex hull of points (N, 2), counter-clockwise."""
    points = np.unique(points, axis=0)
    sides = []
    for way in (points, points[::-1]):
        side = []
        for x, y in way.tolist():
            while len(side) > 1:
                (a, b), (c, d) = side[-2:]
                if (c - a) * (y - b) > (x - a) * (d - b):  # it turns left here
                    break
                side.pop()
            side.append((x, y))
        sides += side[:-1] or side
    return np.array(sides)


def silhouette(corners):
    """The shadow of a closed surface, of its triangles seen along an axis (T, 3, 2): closed lines [(N, 2), ...] with
    the shadow on their left. They are the edges of those triangles that are counter-clockwise; where several lie one
    above the other, the lines wind around them more than once."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    size = np.ptp(corners, axis=(0, 1)).max()
    front = corners[a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > SAME * size**2].reshape(-1, 2)
    _, first, index = np.unique(np.round(front / (SAME * size)), axis=0, return_index=True, return_inverse=True)
    index = index.reshape(-1, 3)
    sides = {(i, j) for k in range(3) for i, j in zip(index[:, k].tolist(), index[:, (k + 1) % 3].tolist())}
    onwards, found = {}, []
    for i, j in sorted(side for side in sides if side[::-1] not in sides):
        onwards.setdefault(i, []).append(j)
    while onwards:
        line = [next(iter(onwards))]
        while line[-1] in onwards:
            ends = onwards[line[-1]]
            line.append(ends.pop())
            if not ends:
                del onwards[line[-2]]
        found.append(front[first[line[:-1]]])
    return found


def outermost(points):
    """Those of the points (N, 3) that are farthest in one of many directions. Their extent along the axes is exact, in
    other directions within 0.5 %."""
    points = np.unique(points, axis=0)
    far = [np.argmax(points @ some.T, axis=0) for some in np.array_split(DIRECTIONS, 20)]
    return points[np.unique(np.concatenate(far))]


def worn(run, wear):
    """Yields (whether of the container, motion, triangles (T, 3, 3) [m] in the frame of the motion, facet of each) of
    the surfaces of a Wear; its triangles are counter-clockwise seen from the balls."""
    facet, points = run.read(f"{PLACE}/mesh/facet"), run.read(f"{PLACE}/mesh/points").astype(float).reshape(-1, 3, 3)
    look = [(part.kind in run.vessel_kinds, part.motion) for part in wear.parts]
    for one in dict.fromkeys(look):
        own = np.isin(wear.part[facet], [k for k, other in enumerate(look) if other == one])
        if own.any():
            yield *one, moved(inverse(wear.parts[look.index(one)].start), points[own]), facet[own]


def read(run) -> list[Body]:
    """The bodies in /VTKHDF of a run, in the order of the blocks."""
    poses, found = run.first_poses(), []
    names = sorted(run.names("VTKHDF"), key=lambda name: run.attribute(f"VTKHDF/{name}", "Index", 0))
    for name in names:
        place = f"VTKHDF/{name}"
        if name == "balls" or not run.has(f"{place}/CellData/kind"):
            continue
        count = int(run.read(f"{place}/NumberOfPoints", slice(0, 1)).sum())
        first = int(run.read(f"{place}/Steps/PointOffsets", slice(0, 1)).sum())
        points = run.read(f"{place}/Points", slice(first, first + count)).astype(float)
        corners = run.read(f"{place}/Polygons/Connectivity")
        kinds = run.index_names(f"{place}/CellData/kind")
        kind, number = (run.read(f"{place}/CellData/{what}") for what in ("kind", "number"))
        if len(corners) != 3 * len(kind) or corners.max(initial=0) >= len(points):
            raise run.damaged(place, f"not triangles: {len(points)} points, {len(corners)} corners, {len(kind)} kinds")
        corners = corners.reshape(-1, 3)
        motion = name if name in poses else ""
        triangles = moved(inverse(Mill.pose(motion, poses)), points)[corners]
        for k in dict.fromkeys(kind.tolist()):
            own = triangles[kind == k]
            if kinds[k] in run.vessel_kinds:
                own = own[:, ::-1]  # in the file they face the balls
            found.append(Body(kinds[k], motion, own, number[kind == k]))
    return found
