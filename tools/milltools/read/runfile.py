"""Reads the output file of a run (docs/file-format.md) in SI units, with errors that a user understands.

    with Run("reference.h5") as run:
        time, power = run.series("rotor_work")
        radius = run.quantity("drum/radius")
        spectrum = run.histogram("ball_ball")

Data are read only when they are needed, so opening a file of gigabytes takes no time. For missing or damaged data the
UserError names the file and the dataset, and what option of the run would store it.
"""

import functools
import math
import os
import pathlib
import re
from collections.abc import Iterable
from typing import Any, NamedTuple

import h5py
import numpy as np

from milltools.base.engine import command_line
from milltools.base.errors import UserError
from milltools.base.files import opened
from milltools.base.text import quantity
from milltools.read import rules
from milltools.read.deck import Deck, Species
from milltools.read.hdf5 import Store
from milltools.read.histogram import ENERGIES, Histogram, by_energy, by_speed
from milltools.read.kinds import KINDS

THRESHOLDS = (0.5, 1.0, 2.0)  # [m/s] of fast_collisions
# views of the maps: axes of the first and second index, and components of the velocity
VIEWS = {"cross_section": ("y", "z", ("x", "y", "z")), "axial": ("x", "r", ("x", "r", "phi"))}
# forms of energy in /series, in words
FORMS = {
    "kinetic_energy": "kinetic energy",
    "rotational_energy": "energy in the balls' spin",
    "potential_energy": "potential energy",
    "elastic_energy": "energy in the springs of contacts",
}
SUMMARY = {  # column of the summary of impacts: path below /statistics, with the kind of contact as {}
    "count": "impacts/{}/count",
    "rate": "impacts/{}/rate",
    "dissipated_power": "impacts/{}/dissipated_power",
    "mean": "impacts/{}/normal_speed/mean",
    "median": "impacts/{}/normal_speed/median",
    "median_above_floor": "impacts/{}/normal_speed/median_above_floor",
    "floor_share": "floor_share/{}",
}
MEDIAN = "impacts/all/normal_speed/median_above_floor"
# path below /statistics -> name below /statistics/precision with its standard error; impacts/ROW/rate has one too
PRECISION = {
    "rotor/power": "rotor_power",
    "rotor/torque": "rotor_torque",
    "drive/power": "drive_power",
    "impacts/all/normal_speed/median": "median",
    MEDIAN: "median_above_floor",
}
HARD_RATE, HARD_PER_JOULE = "hard_rate", "hard_per_joule"  # below /statistics/precision
ROUND = {"cylinder", "cone", "capsule", "sphere", "contour"}  # shapes that can turn while their charge is steady
RATE = re.compile(r"impacts/([^/]+)/rate")


class Hard(NamedTuple):
    """Impacts of `energy` [J] or more are hard; NaN: none are. `by`: normal, total or dissipated energy. `found`: half
    of the energy that the impacts of this run lose falls above it; else the deck gives it."""

    energy: float
    by: str = "normal"
    found: bool = False

    @property
    def words(self) -> str:
        """Such as "of 1 mJ or more"."""
        return f"of {quantity(self.energy, 'J')}{f' {self.by}' * (self.by != 'normal')} or more"


def estimates(kinds: Iterable[str]) -> dict[str, tuple[str, Any]]:
    """Numbers with a standard error: name -> (group below /statistics/precision, index into its values)."""
    rows = (*kinds, "all")
    found: dict[str, tuple[str, Any]] = {
        name: (name, ()) for name in (*PRECISION.values(), HARD_RATE, HARD_PER_JOULE, *(f"rate/{r}" for r in rows))
    }
    for row in rows:
        for column, speed in enumerate(THRESHOLDS):
            found[f"rate_above_{speed:g}/{row}"] = f"fast_rate/{row}", column
    return found


def turned(angle: float) -> np.ndarray:
    """The pose (3, 4) after a rotation about x by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0]])


def kind_of(path: str | os.PathLike[str]) -> str:
    """ "run" or "deck", from the first bytes; UserError if the file is neither."""
    try:
        with opened(path, "a run or a deck") as file:
            head = file.read(512)
    except UserError:
        return "deck"  # millsim then reports what is wrong
    if head.startswith(b"\x89HDF\r\n\x1a\n"):
        return "run"
    if head.startswith(b"PAR1"):
        shown = command_line("study", pathlib.Path(path))
        raise UserError(f"{path}: a table of a study, not a run or a deck; this shows it: {shown}")
    if b"\0" in head:
        raise UserError(f"{path}: neither the output file of a run (HDF5) nor a deck (text)")
    return "deck"


class Run(Store):
    """An open output file: a Store that knows the datasets of a run."""

    def __init__(self, path: object) -> None:
        super().__init__(path)
        if not all(isinstance(self.find(name), h5py.Group) for name in ("deck", "run")):
            self.close()
            raise UserError(f"{self.path}: this HDF5 file is not a run: it has no /deck and /run")

    def __reduce__(self) -> tuple[Any, ...]:  # for pickling to another process, which opens the file again
        return Run, (self.path,)

    def _expect(self, path: str, thing: h5py.Dataset) -> None:
        rules.check_layout(self, path, thing)

    def read(self, path: str, index: Any = (), why: str = "") -> Any:
        """Like Store.read, and checks that a run can have these values."""
        values = super().read(path, index, why)
        rule = rules.of(path)
        if rule and rule.shape == () and np.ndim(values) == 1:  # some writers have no scalars
            values = values[0]
        fault = rules.fault(rule, values)
        fault = fault or self._index_fault(path, values, index)
        if path == "particles/trajectory/diameter" and np.max(values, initial=0) > self._largest_ball():
            fault = f"a ball diameter of {np.max(values):g} m, larger than the balls or the drum of the deck"
        if fault:
            raise self.damaged(path, fault)
        return values

    def _largest_ball(self) -> float:
        """The largest possible diameter of a ball [m], with a margin for rounding."""
        drum = 2 * self.quantity("drum/radius", np.inf) if self.text("drum/profile", "circle") == "circle" else np.inf
        return 1.001 * min(drum, max((kind.diameter for kind in self.as_deck.species), default=0.0))

    def _index_fault(self, path: str, values: Any, index: Any) -> str:
        """Why the indices in a dataset are wrong; "" if they are not, and for other datasets."""
        of = rules.indexed(path)
        if path == "impacts/partner" and "ball_ball" in (kinds := self.index_names("impacts/kind")):
            values = np.atleast_1d(values)[np.atleast_1d(self.read("impacts/kind", index)) == kinds.index("ball_ball")]
            if np.min(values, initial=0) < 0:
                return "no partner of an impact between balls"
            of = rules.BALLS
        for k, one in enumerate(of if isinstance(of, tuple) else (of,)):
            if one is None:
                continue
            named = str(one).startswith("@")
            many = one if isinstance(one, int) else len(self.index_names(path)) if named else self.length(one)
            column = values[..., k] if isinstance(of, tuple) else values
            if np.size(column) and np.max(column) >= many:
                return f"an index that is too large: there are {many}"
        return ""

    def index_names(self, path: str) -> list[str]:
        """The names that the indices in a dataset refer to, such as those of the kinds of "impacts/kind"."""
        name = rules.indexed(path)[1:]
        others = {"kinds": self.kinds, "motions": self.motions, "names": ["balls"]}[name]
        return list(self.attribute(path, name, ())) or list(others)

    # ---- program, version, status

    def about(self, name: str, default: Any = None) -> Any:
        """A value of /run by its name, such as "compiler"; the default if it is not there."""
        return self.read(f"run/{name}") if self.has(f"run/{name}") else default

    @property
    def program(self) -> str:
        """The program that made the run: "millsim", or another that wrote the same schema ("LIGGGHTS")."""
        return self.about("program", "millsim")

    @property
    def soft(self) -> bool:
        """Whether the balls are soft spheres, whose contacts take time."""
        return self.program != "millsim" or self.text("run/spheres", "hard") == "soft"

    @property
    def modulus(self) -> float:
        """Young's modulus of soft spheres [Pa]; NaN of hard ones."""
        own = self.quantity("soft/modulus", math.nan) if self.soft else math.nan
        return float(self.about("modulus", own))

    @property
    def contact_duration(self) -> float:
        """Of a contact of soft spheres [s]; NaN of hard ones."""
        own = self.about("soft/contact_duration", math.nan) if self.soft else math.nan
        return float(self.about("contact_duration", own))

    @property
    def version(self) -> str:
        return self.about("version", "?")

    @property
    def status(self) -> str:
        """complete, stopped, failed or running."""
        return self.read("run/status")

    @property
    def notes(self) -> list[str]:
        """Remarks of the program on the numbers of the run, one sentence each."""
        return self.about("notes", "").splitlines()

    @property
    def time(self) -> float:
        """Simulated time reached [s]; 0 before the first checkpoint."""
        return float(self.about("time", 0.0))

    @property
    def cost(self) -> float:
        """CPU seconds per simulated second of a start: from /run/price, or, if that is not there, from the CPU time;
        NaN if the run has not begun."""
        if self.has("run/price"):
            return float(self.read("run/price"))
        return float(self.read("run/cpu_time")) / self.time / self.starts if self.time > 0 else float("nan")

    # ---- the deck

    @functools.cached_property
    def as_deck(self) -> Deck:
        """The deck of the run, with its sections in the order of the text."""
        heads = [line.strip()[1:-1] for line in self.deck_text().splitlines() if line.startswith("[")]
        names = [name for name in self.names("deck") if isinstance(self.find(f"deck/{name}"), h5py.Group)]
        names.sort(key=lambda n: (heads.index(n) if n in heads else len(heads), n))
        found = {name: {key: self.read(f"deck/{name}/{key}") for key in self.names(f"deck/{name}")} for name in names}
        place, outlines = "{path}: damaged: /deck/{section}/{key}", ""
        if self.has("deck/contour"):
            outlines = self.read("deck/contour")
        return Deck(self.deck_text(), self.path, (), found, place, self.digest, outlines)

    def deck(self) -> dict[str, str]:
        """All values of the deck of the run: "section.key" -> text with its SI unit."""
        return {f"{s}.{key}": value for s, keys in self.as_deck.sections.items() for key, value in keys.items()}

    def deck_text(self) -> str:
        """The text of the deck of the run, which millsim can run again."""
        return self.read("deck/text") if self.has("deck/text") else ""

    @property
    def digest(self) -> str:
        """The digest of the tables and meshes that the deck of the run names; "" if it names none."""
        return self.read("deck/digest") if self.has("deck/digest") else ""

    def text(self, path: str, default: str | None = None) -> str:
        """A value of the deck as text, by a path such as "drum/profile". If it is missing: the default, else
        UserError."""
        found = self.as_deck.value(path.replace("/", "."), default)
        if found is None:
            raise UserError(f"{self.path}: has no /deck/{path}")
        return found

    def vector(self, path: str) -> np.ndarray:
        """The numbers of a vector of the deck in SI, by a path such as "gravity/acceleration"."""
        self.quantity(path)
        return np.array(self.as_deck.numbers(path.replace("/", ".")))

    def quantity(self, path: str, default: float | None = None) -> float:
        """A value of the deck as a number in SI, by a path such as "drum/radius". If it is missing: the default, else
        UserError."""
        if default is None:
            self.text(path)
        return self.as_deck.number(path.replace("/", "."), default)

    @property
    def has_rotor(self) -> bool:
        return "rotor" in self.as_deck.sections

    @property
    def rotor_speed(self) -> float:
        """Angular velocity of the rotor about +x [rad/s]; 0 without one."""
        return self.quantity("rotor/speed") if self.has_rotor else 0.0

    def rotor_angle(self, time: float) -> float:
        """Angle of the rotor at a time, from +y to +z [rad]."""
        return self.quantity("rotor/angle") + self.rotor_speed * time if self.has_rotor else 0.0

    # ---- the container

    @property
    def vessel(self) -> str:
        """NAME of the body that contains the balls; "" if the drum contains them."""
        inside = (n for n in self.as_deck.named("body") if self.text(f"body.{n}/side", "") == "inside")
        return next(inside, "")

    @property
    def slice_length(self) -> float:
        """[m] The length along x after which a mill with periodic ends repeats; 0: it has ends."""
        return self.quantity("drum/length") if self.as_deck.periodic else 0.0

    @property
    def vessel_kinds(self) -> tuple[str, ...]:
        """Kinds of contact with the container."""
        return (self.as_deck.kind_of(self.vessel),) if self.vessel else ("ball_drum", "ball_wall")

    @property
    def carrier(self) -> str:
        """The motion that moves the container; "": it stands still."""
        return self.text(f"body.{self.vessel}/motion" if self.vessel else "drum/motion", "")

    @functools.cached_property
    def mapped(self) -> str:
        """The motion of the frame in which the charge is steady, which the maps use: `carrier`, or if the container is
        round or a contour and turns about its own axis, what carries this motion; "": the laboratory."""
        own, vessel = self.carrier, self.vessel
        place = f"motion.{own}"
        if not own or (vessel and self.text(f"body.{vessel}/shape", "") not in ROUND):
            return own
        if own != "rotor":
            if self.text(f"{place}/kind", "turn") not in ("turn", "swing"):
                return own
            axis, centre = (
                self.vector(f"{place}/{key}") if self.text(f"{place}/{key}", "") else usual
                for key, usual in (("axis", np.eye(3)[2]), ("centre", np.zeros(3)))
            )
            if axis.shape != (3,) or centre.shape != (3,) or not axis.any():
                raise self.damaged(f"deck/{place}", "it turns about no line")
            frame, axis = self.vessel_frame(), axis / np.linalg.norm(axis)
            if max(np.abs(np.cross(side, axis)).max() for side in (frame[:, 0], frame[:, 3] - centre)) > 1e-9:
                return own
        return self.text(f"{place}/on", "")

    def vessel_frame(self) -> np.ndarray:
        """The container's own frame with x along its axis, as a pose (3, 4) in the frame of its motion. The maps use
        this frame."""
        if not self.vessel:
            return np.eye(3, 4)
        place = f"body.{self.vessel}"
        axis = self.vector(f"{place}/axis") if self.has(f"deck/{place}/axis") else [0.0, 0.0, 1.0]
        if not np.any(axis) or len(axis) != 3:
            raise self.damaged(f"deck/{place}/axis", "not a direction (three numbers, not all 0)")
        z = np.array(axis) / np.linalg.norm(axis)
        across = np.eye(3)[1 if np.hypot(z[1], z[2]) < 1e-6 else 0]
        x = across - (across @ z) * z
        x /= np.linalg.norm(x)
        angle = self.quantity(f"{place}/angle", 0.0)
        x, y = (math.cos(t) * x + math.sin(t) * np.cross(z, x) for t in (angle, angle + math.pi / 2))
        centre = self.vector(f"{place}/centre") if self.has(f"deck/{place}/centre") else np.zeros(3)
        return np.column_stack([z, x, y, centre])

    def frame_axis(self, poses: dict[str, np.ndarray]) -> np.ndarray:
        """Direction of the container's axis in the laboratory, for the `poses` of the motions."""
        axis = self.vessel_frame()[:, 0]
        return poses[self.carrier][:, :3] @ axis if self.carrier in poses else axis

    # ---- kinds of contact, motions

    @functools.cached_property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of contact that the file lists: first those of KINDS, then those of bodies. Files of old versions list
        all of KINDS: of these, the kinds for which the mill has surfaces or the run has contacts."""
        places = ("statistics/impacts", "run/events/collisions", "observables/collisions")
        names = next((set(found) for place in places if (found := self.names(place))), set(KINDS))
        order = [self.as_deck.kind_of(name) for name in self.as_deck.bodies]
        own = sorted(names - {*KINDS, "all"}, key=lambda kind: ([*order, kind].index(kind), kind))
        drum, rotor = not self.vessel, self.has_rotor
        ends = drum and not self.slice_length
        there = {k for k, has in zip(KINDS, (True, drum, ends, rotor, rotor)) if has} | {*order}
        return (*(k for k in KINDS if k in names and (k in there or self.collisions(k))), *own)

    @property
    def absent(self) -> set[str]:
        """Kinds of contact that the file counts (as 0) although this mill does not have them."""
        return {*KINDS} - {*self.kinds}

    def collisions(self, kind: str) -> int:
        """Number of contacts of a kind in the whole run; 0 if the file does not count them."""
        path = f"run/events/collisions/{kind}"
        return int(self.read(path)) if self.has(path) else 0

    @property
    def contacts(self) -> int:
        """Number of contacts in the whole run."""
        return sum(map(self.collisions, self.names("run/events/collisions")))

    @property
    def motions(self) -> list[str]:
        """Names of the motions: of [motion.NAME] in the order of the deck, and "rotor"."""
        return self.as_deck.motions

    @property
    def driven(self) -> str:
        """What does work on the balls: "drive" if the deck has motions, else "rotor", or "" if nothing moves."""
        return "drive" if self.as_deck.named("motion") else "rotor" if self.rotor_speed else ""

    @property
    def drive(self) -> str:
        """`driven`; where nothing moves, the drive of power 0 that the file has."""
        return self.driven or ("rotor" if self.has("statistics/rotor") else "drive")

    def drive_work(self) -> tuple[np.ndarray, np.ndarray]:
        """(time [s], work [J] of all motions since t = 0) for the rows of the time series."""
        parts = [f"motion_work/{name}" for name in self.motions]
        if self.has_series("rotor_work") and (self.driven != "drive" or not all(map(self.has_series, parts))):
            return self.series("rotor_work")
        time = self.series("kinetic_energy")[0]
        return time, np.sum([np.zeros(len(time)), *(self.series(part)[1] for part in parts)], axis=0)

    @property
    def period(self) -> float:
        """Period of the slowest motion [s]; infinite if nothing moves or the deck does not contain the periods."""
        found = [2 * math.pi / abs(self.rotor_speed)] if self.rotor_speed else []
        for name in self.as_deck.named("motion"):
            speed, rate = (abs(self.quantity(f"motion.{name}/{k}", 0.0)) for k in ("speed", "frequency"))  # fmt: skip
            found += [2 * math.pi / speed] if speed else [1 / rate] if rate else []
        return max(found, default=math.inf)

    def rotor_pose(self, time: float) -> dict[str, np.ndarray]:
        """The pose of the rotor at any time [s], computed from its speed; empty without a rotor."""
        return {"rotor": turned(self.rotor_angle(time))} if self.has_rotor else {}

    def first_poses(self) -> dict[str, np.ndarray]:
        """The poses of the first frame of the file, to which the points under /VTKHDF belong."""
        return self.poses(0)

    def poses(self, index: int) -> dict[str, np.ndarray]:
        """The poses (3, 4) of the motions in a stored frame, by name: a point p in the frame of a motion is in the
        laboratory at pose[:, :3] @ p + pose[:, 3]."""
        names = self.names("observables/pose")
        if not names:  # the file has no poses
            return self.rotor_pose(self.frame_time(index))
        found = {}
        for name in names:
            place = f"observables/pose/{name}"
            if self.length(f"{place}/centre/value") <= index:
                raise UserError(f"{self.path}: /{place} has no frame {index}")
            rotation, centre = (self.read(f"{place}/{part}/value", index) for part in ("rotation", "centre"))
            found[name] = np.column_stack([rotation, centre])
        return found

    # ---- time series

    def has_series(self, name: str) -> bool:
        return self.has(f"observables/{name}/value")

    def series(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """(time [s] (S,), value (S, ...) as float64) of a time series, such as "dissipation/ball_drum"."""
        value = self.read(f"observables/{name}/value").astype(float)
        return self.read(f"observables/{name}/time"), value

    def series_names(self) -> list[str]:
        """Names of all time series, such as "dissipation/ball_drum": first those of the whole mill, then those of each
        kind; without the poses, which belong to the frames."""
        paths = (path.split("/")[1:] for path in self.paths("observables"))
        found = {"/".join(parts[:-1]) for parts in paths if parts[-1] == "value" and parts[0] != "pose"}
        empty = self.absent
        found -= {f"charge/{name}" for name in self.charge}  # at times of its own
        if not self.has_rotor and (self.as_deck.bodies or self.as_deck.named("motion")):
            empty |= {"rotor_work", "rotor_torque"}
        shown = (name for name in found if name.split("/")[-1] not in empty)
        return sorted(shown, key=lambda name: (name.count("/"), name))

    # ---- statistics of the sampled window

    @property
    def has_statistics(self) -> bool:
        return self.has("statistics/duration")

    @property
    def unsampled(self) -> str | None:
        """Why the file has no data of the sampled window; None if it has."""
        if not self.has_statistics:
            return f"no statistics yet: the run (status '{self.status}') has not come to its first checkpoint"
        if not self.duration > 0:
            return f"nothing sampled: the run ended at {self.time:.6g} s, before run.sample_from"
        return None

    def need_statistics(self) -> None:
        """UserError if the file has no data of the sampled window."""
        if why := self.unsampled:
            raise UserError(f"{self.path}: {why}")

    @property
    def duration(self) -> float:
        """Sampled time [s], of all starts together."""
        return float(self.read("statistics/duration", why="the run has no statistics yet"))

    @property
    def window(self) -> tuple[float, float]:
        """Sampled window (from, to) [s]."""
        begin = self.quantity("run/sample_from", 0.0)
        if self.has("statistics/precision/warm_up"):  # the start that the run itself found, or run.sample_from
            begin = float(self.read("statistics/precision/warm_up"))
        return begin, begin + self.duration / self.starts

    @property
    def starts(self) -> int:
        """Starts of the mill that the statistics are of; frames, time series and impacts are of the first one."""
        many = int(self.read("statistics/starts")) if self.has("statistics/starts") else 1
        if many > 1 and self.has("starts/seed") and self.length("starts/seed") != many:
            raise self.damaged("starts/seed", f"it is not of {many} starts")
        return max(many, 1)

    @property
    def above_floor(self) -> float:
        """Normal speed [m/s] from which on impacts do not depend on the rebound floor."""
        return float(self.read("statistics/above_floor")) if self.has("statistics/above_floor") else 0.05

    @property
    def hard(self) -> Hard:
        """Which impacts are hard; in files of old versions those of 1 mJ."""
        if not self.has("statistics/hard_energy"):
            return Hard(1e-3)
        energy, by = float(self.read("statistics/hard_energy")), self.read("statistics/hard_by")
        if energy <= 0 or by not in ("normal", "total", "dissipated"):
            raise self.damaged("statistics/hard_energy", f"{energy:g} J of {by} energy")
        return Hard(energy, by, self.text("run/hard_impact", "auto") == "auto")

    @property
    def strike_window(self) -> float:
        """Impacts of a pair within this time [s] are one strike; NaN: not known."""
        if self.has("statistics/strike_window"):
            return float(self.read("statistics/strike_window"))
        given = self.text("output/strike_window", "auto") != "auto"
        return self.quantity("output/strike_window") if given else math.nan

    @property
    def rebound_floor(self) -> float:
        """Minimum normal speed after any contact [m/s]; 0 where there is none."""
        return float(self.about("rebound_floor", 0.0))

    @property
    def doubt(self) -> str:
        """Why errors of this run would be wrong: "one start", "few starts", "not settled"; "" if they are known."""
        path = "statistics/precision/doubt"
        found = self.read(path) if self.has(path) else "none"
        if found not in ("none", "one start", "few starts", "not settled"):
            raise self.damaged(path, f"'{found}'")
        return "" if found == "none" else found

    def statistic(self, path: str) -> Any:
        """A scalar or array under /statistics, such as "impacts/ball_ball/rate" or "rotor/power"."""
        if path.endswith("above_floor") and not self.has(f"statistics/{path}"):  # as files of old versions say it
            path = path.replace("above_floor", "above_50mm_s")
        return self.read(f"statistics/{path}", why="" if self.has_statistics else "no statistics yet")

    def summary(self) -> dict[str, list[Any]]:
        """The columns of SUMMARY: a value for each kind of contact, then one for all."""
        rows = (*self.kinds, "all")
        return {name: [self.statistic(path.format(row))[()] for row in rows] for name, path in SUMMARY.items()}

    def results(self) -> dict[str, Any]:
        """Status, window, power and summary of the run, for the JSON object of a command."""
        drive, columns = self.drive, self.summary()
        return {
            "status": self.status,
            "time": self.time,
            "window": self.window,
            "power": self.statistic(f"{drive}/power"),
            "power_error": self.standard_error(f"{drive}/power"),
            "impacts": {
                kind: {name: values[k] for name, values in columns.items()}
                for k, kind in enumerate((*self.kinds, "all"))
            },
            "notes": self.notes,
        }

    def standard_error(self, path: str) -> float:
        """The standard error of a scalar under /statistics, in its unit: value +- 1.96 standard errors is the 95 %
        interval. NaN if the file does not contain it."""
        rate = RATE.fullmatch(path)
        name = f"rate/{rate[1]}" if rate else PRECISION.get(path)
        places = [f"precision/{name}/standard_error"] if name else []
        for place in (*places, f"{path}_error", f"{path.removesuffix('value')}standard_error"):
            if self.has(f"statistics/{place}"):
                return float(self.statistic(place))
        return float("nan")

    def known(self, name: str) -> tuple[float, float, float] | None:
        """(value, standard error, degrees of freedom) of one of estimates(), or of another single number below
        /statistics/precision; None if the file does not have them. The degrees of freedom are infinite if the file does
        not contain them."""
        group, column = estimates(self.kinds).get(name, (name, ()))
        place = f"precision/{group}"
        if not self.has(f"statistics/{place}/standard_error"):
            return None

        def part(name: str) -> float:
            values = np.asarray(self.statistic(f"{place}/{name}"))
            if values.shape != (() if column == () else (len(THRESHOLDS),)):
                raise self.damaged(f"statistics/{place}/{name}", f"it has the shape {values.shape}")
            return float(values[column])

        # files of old versions do not say how many degrees of freedom
        old = not self.has(f"statistics/{place}/degrees_of_freedom")
        return part("value"), part("standard_error"), math.inf if old else part("degrees_of_freedom")

    @functools.cached_property
    def charge(self) -> dict[str, tuple[float, float]]:
        """What is known of the charge of a tumbling mill (docs/tumbling.md): name -> (value, standard error), angles in
        rad, places in m; empty for another mill, and for a file of an old version."""
        names = [name for name in self.names("statistics/charge") if self.has(f"statistics/charge/{name}/value")]
        paths = {name: f"charge/{name}/value" for name in names}
        return {name: (float(self.statistic(path)), self.standard_error(path)) for name, path in paths.items()}

    def histogram(
        self, row: str, group: str = "impacts", speed: str = "normal_speed", species: Any = None
    ) -> Histogram:
        """Impacts (or `strikes`) of a kind or of "all" kinds by "normal_speed" or "tangential_speed" [m/s]; or impacts
        by "normal_energy", "total_energy" or "dissipated_energy" [J]. With energies, `species` selects the balls: one
        name, or two names for the impacts between two species."""
        if speed in ENERGIES:
            return by_energy(self, row, group, speed.removesuffix("_energy"), species)
        if species is not None:
            raise UserError(f'{self.path}: only energies are stored by species: use speed="normal_energy"')
        return by_speed(self, f"statistics/{group}/{row}/{speed}/histogram")

    def map(self, name: str, view: str = "cross_section") -> np.ndarray:
        """A map such as "solid_fraction": indices (y, z) in the cross section, (x, r) in the view "axial"."""
        return self.read(f"statistics/maps/{view}/{name}")

    def edges(self, view: str = "cross_section") -> tuple[np.ndarray, np.ndarray]:
        """Edges of a map's cells [m] along its first and second index."""
        first, second, _ = VIEWS[view]
        return self.map(f"{first}_edges", view), self.map(f"{second}_edges", view)

    # ---- balls

    def balls(self, name: str) -> np.ndarray:
        """A constant property of the balls (N,): "mass" [kg], "diameter" [m], "species", "id"."""
        return self.read(f"particles/trajectory/{name}")

    @functools.cached_property
    def class_of(self) -> list[int]:
        """The class of each species by which the file counts energies: the species itself, or if there are many, one
        of a few classes of about the same mass."""
        species = len(self.as_deck.species)
        if not self.has("statistics/energies/class"):
            return list(range(species))
        found = self.read("statistics/energies/class").tolist()
        if sorted(set(found)) != list(range(max(found) + 1)):
            raise UserError(f"{self.path}: damaged: /statistics/energies/class")
        return found

    @functools.cached_property
    def classes(self) -> list[Species]:
        """The classes of class_of: a species, or the mean ball of several."""
        species = self.as_deck.species
        if len(set(self.class_of)) == len(species):
            return species
        found = []
        for k in range(max(self.class_of) + 1):
            members = [one for one, of in zip(species, self.class_of) if of == k and one.count] or species[:1]
            weights = [one.count for one in members]
            size = np.average([one.diameter for one in members], weights=weights)
            mass = np.average([one.mass for one in members], weights=weights)
            found.append(Species(members[0].name, sum(weights), size, mass / (math.pi / 6 * size**3)))
        return found

    def relieved(self, time: float) -> np.ndarray:
        """Which balls are in a relief at a time [s], and may be inside a body; (N,) bool."""
        found = np.zeros(len(self.balls("id")), bool)
        if self.has("reliefs/ball"):
            ball, since, until = (self.read(f"reliefs/{name}") for name in ("ball", "time", "until"))
            found[ball[(since <= time) & (time < until)]] = True
        return found

    def species_names(self) -> list[str]:
        """Names of the species; balls("species") contains indices into them."""
        return self.index_names("particles/trajectory/species")

    def frame_times(self) -> np.ndarray:
        """Times of the stored frames [s]; empty if output.frames = 0 s."""
        path = "particles/trajectory/position/time"
        return self.read(path) if self.has(path) else np.empty(0)

    def frame_time(self, index: int) -> float:
        """Time of a stored frame [s]."""
        times = self.frame_times()
        if not -len(times) <= index < len(times):
            raise UserError(f"{self.path}: has no frame {index}")
        return float(times[index])

    def twist(self, index: int) -> np.ndarray | None:
        """In a stored frame: velocity [m/s], at the origin, and angular velocity [rad/s] (2, 3) of the frame in which
        the charge is steady; None if it stands still."""
        if not self.has("observables/frame_spin/value"):
            return None
        return np.array([self.read(f"observables/frame_{name}/value", index) for name in ("velocity", "spin")])

    def frame(self, index: int, name: str = "velocity") -> np.ndarray:
        """One frame of "position" [m], "velocity" [m/s] or "angular_velocity" [rad/s]; (N, 3)."""
        path = f"particles/trajectory/{name}/value"
        return self.read(path, index, why="no ball states are stored (output.frames = 0 s)")
