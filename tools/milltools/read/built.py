"""What a run's mill is built of, and what moves in it: the part of milltools.read.runfile.Run that knows bodies and motions."""

import functools
import math

import numpy as np

from milltools.base.errors import UserError
from milltools.read.kinds import KINDS

TURNED = 1e-3  # of a rotation: how far its axes may be from upright to each other, and from length 1


class Built:
    """Of a Run, which reads."""

    def named(self, what: str) -> list[str]:
        """NAME of every section [what.NAME], in the deck's order: of "body", "motion"."""
        return self.as_deck.named(what)

    def kind_of(self, body: str) -> str:
        """The kind of contact with the body of a section [body.NAME]."""
        return self.as_deck.kind_of(body)

    @property
    def vessel(self) -> str:
        """NAME of the body that holds the balls; "": the drum does."""
        inside = (n for n in self.named("body") if self.text(f"body.{n}/side", "") == "inside")
        return next(inside, "")

    @property
    def vessel_kinds(self) -> tuple[str, ...]:
        """Kinds of contact with what holds the balls."""
        return (self.kind_of(self.vessel),) if self.vessel else ("ball_drum", "ball_wall")

    @property
    def carrier(self) -> str:
        """The motion that the container rides on; "": it stands still."""
        return self.text(f"body.{self.vessel}/motion" if self.vessel else "drum/motion", "")

    def vessel_frame(self) -> np.ndarray:
        """The container's own frame, x along its axis, as a pose (3, 4) in the frame of its motion: the frame of the maps."""
        if not self.vessel:
            return np.eye(3, 4)
        place = f"body.{self.vessel}"
        axis = self.vector(f"{place}/axis") if self.has(f"deck/{place}/axis") else [0.0, 0.0, 1.0]
        if not np.any(axis) or len(axis) != 3:
            raise self.damaged(f"deck/{place}/axis", "no direction")
        z = np.array(axis) / np.linalg.norm(axis)
        across = np.eye(3)[1 if np.hypot(z[1], z[2]) < 1e-6 else 0]
        x = across - (across @ z) * z
        x /= np.linalg.norm(x)
        angle = self.quantity(f"{place}/angle", 0.0)
        x, y = (math.cos(t) * x + math.sin(t) * np.cross(z, x) for t in (angle, angle + math.pi / 2))
        centre = self.vector(f"{place}/centre") if self.has(f"deck/{place}/centre") else np.zeros(3)
        return np.column_stack([z, x, y, centre])

    def frame_axis(self, poses) -> np.ndarray:
        """Direction of the container's axis in the laboratory, where motions are at `poses`."""
        axis = self.vessel_frame()[:, 0]
        return poses[self.carrier][:, :3] @ axis if self.carrier in poses else axis

    # ---- kinds of contact, motions

    @functools.cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of contact, those that every file counts first; of these what the mill has surfaces of, or what was met."""
        places = ("statistics/impacts", "run/events/collisions", "observables/collisions")
        names = next((set(found) for place in places if (found := self.names(place))), set(KINDS))
        order = [self.kind_of(name) for name in self.named("body")]
        own = sorted(names - {*KINDS, "all"}, key=lambda kind: (kind not in order, order.index(kind) if kind in order else 0, kind))  # fmt: skip
        drum, rotor = not self.vessel, self.has_rotor
        there = {k for k, has in zip(KINDS, (True, drum, drum, rotor, rotor)) if has} | {*order}
        return (*(kind for kind in KINDS if kind in there or self.collisions(kind)), *own)

    @property
    def absent(self) -> set[str]:
        """Kinds of contact that the file counts, all 0, and that this mill does not have."""
        return {*KINDS} - {*self.kinds}

    def collisions(self, kind: str) -> int:
        """Contacts of a kind in the whole run; 0 where none are counted."""
        path = f"run/events/collisions/{kind}"
        return int(self.read(path)) if self.has(path) else 0

    @property
    def contacts(self) -> int:
        """Contacts in the whole run."""
        return sum(map(self.collisions, self.kinds))

    @property
    def motions(self) -> list[str]:
        """Names of what moves: of [motion.NAME] in the deck's order, and "rotor"."""
        return self.named("motion") + ["rotor"] * self.has_rotor

    @property
    def driven(self) -> str:
        """What does work on the balls: "rotor", "drive" if other motions are there, or "" if nothing moves."""
        return "drive" if self.named("motion") else "rotor" if self.rotor_speed else ""

    def drive_work(self) -> tuple[np.ndarray, np.ndarray]:
        """(time [s], work [J] of all motions since t = 0), by the rows of the time series."""
        parts = [f"motion_work/{name}" for name in self.motions]
        if self.driven != "drive" or not all(map(self.has_series, parts)):
            return self.series("rotor_work")
        series = [self.series(part) for part in parts]
        return series[0][0], sum(value for _, value in series)

    @property
    def period(self) -> float:
        """After which the slowest motion repeats [s]; infinite where nothing moves, or where the deck does not say it."""
        found = [2 * math.pi / abs(self.rotor_speed)] if self.rotor_speed else []
        for name in self.named("motion"):
            speed, rate = (abs(self.quantity(f"motion.{name}/{k}", 0.0)) for k in ("speed", "frequency"))  # fmt: skip
            found += [2 * math.pi / speed] if speed else [1 / rate] if rate else []
        return max(found, default=math.inf)

    def rotor_pose(self, time: float) -> dict[str, np.ndarray]:
        """The same of the rotor alone at any time [s], by its speed; nothing without one."""
        c, s = (f(self.rotor_angle(time)) for f in (math.cos, math.sin))
        return {"rotor": np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0]])} if self.has_rotor else {}

    def first_poses(self) -> dict[str, np.ndarray]:
        """Those of the file's first frame, whatever frames are shown: the points under /VTKHDF begin there."""
        return self.poses(0)

    def poses(self, index: int) -> dict[str, np.ndarray]:
        """Where motions have brought their frames in a stored frame, by name: (3, 4), a point p of a motion's frame is at
        pose[:, :3] @ p + pose[:, 3]."""
        names = self.names("observables/pose")
        if not names:  # a file that does not tell
            return self.rotor_pose(self.frame_time(index))
        found = {}
        for name in names:
            place = f"observables/pose/{name}"
            if self.length(f"{place}/centre/value") <= index:
                raise UserError(f"{self.path}: /{place} has no frame {index}")
            rotation, centre = (self.read(f"{place}/{part}/value", index) for part in ("rotation", "centre"))
            if np.abs(rotation @ rotation.T - np.eye(3)).max() > TURNED:
                raise self.damaged(f"{place}/rotation/value", f"no rotation in frame {index}")
            found[name] = np.column_stack([rotation, centre])
        return found
