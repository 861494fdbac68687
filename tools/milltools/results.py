"""A run of another program, written in millsim's own file schema, so that every reader works on both.

`Results` is fed while the other program runs (balls, rows of the time series, impacts), keeps what it needs for
the statistics and none of the impacts, and writes the whole file at any moment. docs/file-format.md names every
dataset; "Files of other programs" says what is different in such a file. SI throughout.
"""

import contextlib
import math
import os
import tempfile

import h5py
import numpy as np

import milltools.tally_write as sheet
from milltools import vtkhdf
from milltools.geometry import profile
from milltools.h5write import (
    VERSIONS,
    Disk,
    append,
    make_column,
    put,
    put_attribute,
    put_column,
    whole_file,
)
from milltools.moved import Moved
from milltools.read.schema import (
    LOG,
    OPTIONAL,
    STATES,
    STATUSES,
    THRESHOLDS,
    deck_entries,
    run_facts,
    series_of,
)
from milltools.tally import Blocks, Maps, Speeds, Strikes, find_slots

__all__ = ["Results"]

SLICE = 1 << 18  # impacts worked on at a time, at most: memory does not grow with the batch
FEW = 1 << 16  # as many are gathered first, for few cost as much as thousands
BATCH = 16  # impacts: the memory of an empty batch


def _balls(values, n, what):
    values = np.asarray(values, dtype=float)
    if values.shape != (n, 3):
        raise ValueError(f"{what}: expected an array ({n}, 3), got {values.shape}")
    return values


class Results(Moved):
    """Gathers a run of `deck` (milltools.read.deck.Deck) with the balls diameter [m], mass [kg], species_index (N,).

    folder: where frames and logged impacts wait in a nameless file until they are written; the system's own for
    temporary files if None. ValueError for what cannot be part of such a run."""

    def __init__(self, deck, diameter, mass, species_index, species_names, folder=None):
        self.deck = deck
        self.entries = list(deck_entries(deck.text))
        settings = {f"{section}.{key}": value for section, key, value, _ in self.entries}
        self.diameter, self.mass = np.array(diameter, float), np.array(mass, float)
        self.species = np.array(species_index, dtype="<i4")
        self.names = list(species_names)
        self.end = float(deck.number("run.time"))
        self.begin = float(deck.number("run.sample_from", 0.0))
        self.end = max(self.end, self.begin)
        self.frames_wanted = deck.number("output.frames", 0.0) > 0
        self.log_wanted = settings.get("output.impacts") == "all"
        self.rotor_speed = float(deck.number("rotor.speed", 0.0))
        self._plan_snapshots()
        self.maps = Maps(*profile.section(deck))
        window = float(deck.number("output.strike_window", 0.0))
        self.strikes, self.watch = Strikes(window), self.begin - 2 * window
        self.kinds, self.labels = deck.kinds, series_of(deck)
        self.speeds = {name: Speeds(len(self.kinds)) for name in ("impacts", "strikes")}
        self.latest = -math.inf  # [s] of the impacts so far
        self.total = np.zeros((len(self.kinds), 1 + len(THRESHOLDS)), np.uint64)
        self.waiting, self.crowd = [], 0  # batches not yet looked at, and how large they are
        self.pending = []  # impacts since the last row: (time, kind, how many thresholds reached)
        self.counted = np.zeros_like(self.total)  # before the last row
        self.times, self.counts = [], []
        self.series = {name: [] for name in self.labels}
        self._open_scratch(folder)

    def _plan_snapshots(self):
        duration = self.end - self.begin
        step = min(1e-3, duration / 100) if duration > 0 else math.inf
        most = int(duration / step) + 2 if duration > 0 else 0
        times = self.begin + (np.arange(most) + 0.5) * step if most else np.empty(0)
        self.snapshot_times = times[times <= self.end]

    def _open_scratch(self, folder):
        self.scratch = None
        if not self.frames_wanted and not self.log_wanted:
            return
        with tempfile.TemporaryDirectory(prefix="mill-", dir=folder) as place:
            self.disk = Disk(os.path.join(place, "run.h5"))
            self.scratch = h5py.File(self.disk, "w", libver=VERSIONS)
        if self.frames_wanted:  # the folder is gone: nothing is left behind, however the run ends
            n, group = len(self.mass), self.scratch.create_group("trajectory")
            first = group.create_group("position")
            self.poses = {}  # by motion: columns of its centre and rotation
            self.states = {
                "step": make_column(first, "step", (), "<i8", "1", "number of the frame"),
                "time": make_column(first, "time", (), "<f8", "s", "simulated time"),
            }
            for name, (unit, text) in STATES.items():
                self.states[name] = make_column(group, f"{name}/value", (n, 3), "<f4", unit, text, plain=True)
                if name != "position":
                    group[f"{name}/step"], group[f"{name}/time"] = first["step"], first["time"]
        if self.log_wanted:
            group = self.scratch.create_group("impacts")
            self.log = {  # kept open: a dataset opened anew packs its last chunk anew
                name: make_column(group, name, shape, dtype, unit, text, rows=16384)
                for name, (dtype, shape, unit, text) in LOG.items()
            }
            put_attribute(group["dissipation"], "part", "normal")
            put_attribute(group, "kinds", self.kinds)
            put_attribute(group["kind"], "kinds", self.kinds)

    # ---- what the run delivers ----

    def snapshot(self, position, velocity):
        """The balls (N, 3) at the next of snapshot_times."""
        n = len(self.mass)
        position, velocity = _balls(position, n, "position"), _balls(velocity, n, "velocity")
        if self.maps.samples == len(self.snapshot_times):
            raise ValueError(f"there are only {self.maps.samples} snapshot_times")
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            raise ValueError("a snapshot holds what is no number")
        self.maps.sample(position, velocity, self.diameter / 2)

    def frame(self, time, position, velocity, angular_velocity, poses=None):
        """The next frame of the trajectory: the balls (N, 3) at `time`, about the next multiple of output.frames; poses: what is
        known of motions, {name: (rotation (3, 3), centre (3,))}, the same names in all frames; None: of the rotor alone.
        OSError if there is no room for it."""
        if not self.frames_wanted:
            raise ValueError("the deck wants no frames: output.frames is 0 s")
        states = zip(STATES, (position, velocity, angular_velocity))
        states = {name: _balls(values, len(self.mass), name) for name, values in states}
        append(self.states["step"], [len(self.states["step"])])
        append(self.states["time"], [time])
        for name, values in states.items():
            append(self.states[name], values[None].astype("<f4"))
        for name, (rotation, centre) in (poses or self._rotor(time)).items():
            self._append_pose(name, {"rotation": rotation, "centre": centre})
        self.disk.check()

    def row(self, time, values):
        """The next row of the time series: its values by path below /observables, without those that are counted.

        What is not given is NaN in the file (elastic_energy, motion_work: not there; motion_work/rotor is rotor_work again).
        The impacts before `time` have been delivered."""
        if "motion_work/rotor" in self.labels and "rotor_work" in values:
            values = {"motion_work/rotor": values["rotor_work"], **values}
        unknown = sorted(set(values) - set(self.labels))
        if unknown:
            raise ValueError(f"{unknown[0]}: no time series of that name, or one that is counted")
        self._settle()
        self.times.append(float(time))
        for name, column in self.series.items():
            column.append(float(values.get(name, math.nan)))
        self.counted = self.counted + self._take_pending(time)
        self.counts.append(self.counted)

    def _take_pending(self, time):
        """Counts (kinds, 1 + thresholds) of the pending impacts before `time`, which pend no longer."""
        found, later = np.zeros_like(self.total), []
        for when, kind, reached in self.pending:
            n = int(np.searchsorted(when, time, side="left"))
            found += self._by_threshold(kind[:n], reached[:n])
            if n < len(when):
                later.append((when[n:], kind[n:], reached[n:]))
        self.pending = later
        return found

    def _by_threshold(self, kind, reached):
        width, kinds = 1 + len(THRESHOLDS), len(self.kinds)
        count = np.bincount(kind.astype(np.intp) * width + reached, minlength=kinds * width)
        count = count.reshape(kinds, width)[:, ::-1].cumsum(axis=1)[:, ::-1]  # at or above
        return count.astype(np.uint64)

    def impacts(
        self,
        time,
        kind,
        ball,
        partner,
        point,
        normal,
        normal_speed,
        tangential_speed,
        dissipation,
        inside=None,
    ):
        """A batch of n impacts in order of time, none before those of the last batch.

        kind: index into the deck's kinds; partner as in /impacts; point [m], normal (n, 3); dissipation: its normal part [J];
        inside (n, 3): the points in the container's own frame, if that is not the laboratory's."""
        given = (
            time,
            kind,
            ball,
            partner,
            point,
            normal,
            normal_speed,
            tangential_speed,
            dissipation,
        )
        batch = {}
        for values, (name, (dtype, shape, *_)) in zip(given, LOG.items()):
            wider = "<f8" if dtype == "<f4" else dtype
            batch[name] = np.asarray(values, dtype=wider)
            if batch[name].shape != (len(batch["time"]), *shape):
                raise ValueError(f"{name} of the impacts has the shape {batch[name].shape}")
        batch["inside"] = np.asarray(batch["position"] if inside is None else inside, float)
        when = batch["time"]
        if not len(when):
            return
        if not (when[0] >= self.latest and np.all(when[1:] >= when[:-1])):
            raise ValueError("impacts are not in order of time")
        if batch["kind"].max() >= len(self.kinds):
            raise ValueError(f"an impact's kind is none of 0..{len(self.kinds) - 1}")
        self.latest = float(when[-1])
        if len(when) < FEW:  # it may be the caller's own array, to be filled anew
            batch = {name: values.copy() for name, values in batch.items()}
        self.waiting.append(batch)
        self.crowd += len(when) + BATCH
        if self.crowd >= FEW:
            self._settle()

    def _settle(self):
        """Works on the impacts that wait."""
        if not self.waiting:
            return
        batch = self.waiting[0]
        if len(self.waiting) > 1:
            batch = {name: np.concatenate([one[name] for one in self.waiting]) for name in batch}
        self.waiting, self.crowd = [], 0
        for first in range(0, len(batch["time"]), SLICE):
            self._take({name: values[first : first + SLICE] for name, values in batch.items()})

    def _take(self, part):
        """One slice of the impacts."""
        reached = np.zeros(len(part["time"]), np.uint8)
        for threshold in THRESHOLDS:
            reached += part["normal_speed"] >= threshold
        self.total += self._by_threshold(part["kind"], reached)
        self.pending.append((part["time"].copy(), part["kind"].copy(), reached))
        if self.log_wanted:
            for name in LOG:
                append(self.log[name], part[name])
            self.disk.check()
        near = slice(*np.searchsorted(part["time"], (self.watch, self.end)))
        if near.start < near.stop:
            self._gather({name: values[near] for name, values in part.items()})

    def _gather(self, part):
        """Those of the window, and of the time before it in which their strikes may have begun."""
        time, kind, loss = part["time"], part["kind"].astype(np.intp), part["dissipation"]
        speeds = part["normal_speed"], part["tangential_speed"]
        slots = np.stack([find_slots(speed) for speed in speeds])
        inside = slice(int(np.searchsorted(time, self.begin)), None)
        counted = [values[inside] for values in (kind, *slots, *speeds)]
        self.speeds["impacts"].add(*counted)
        self.speeds["impacts"].add_dissipation(*counted[:3], loss[inside])
        self.maps.impacts(part["inside"][inside], speeds[0][inside], loss[inside])
        own = slots.copy()
        own[:, : inside.start] = -1
        fresh, head = self.strikes.meet(part["kind"], part["ball"], part["partner"], time, own)
        new = fresh & (own[0] >= 0)
        self.speeds["strikes"].add(*(values[new] for values in (kind, *slots, *speeds)))
        held = head[0] >= 0
        self.speeds["strikes"].add_dissipation(kind[held], *head[:, held], loss[held])

    # ---- the file ----

    def write(self, path, run, status="complete", time=None):
        """Writes the whole file in one step; may be called again as the run goes on.

        run: facts of /run by name, each a value or (value, unit, description); program, version, command, started,
        wall_time and cpu_time are needed. time: simulated time reached [s]. OSError, one line, if it cannot be
        written."""
        if status not in STATUSES:
            raise ValueError(f"status {status!r} is none of {', '.join(STATUSES)}")
        facts = run_facts(run)
        if time is None:
            time = self.end if status == "complete" else max(self.times, default=0.0)
        self._settle()
        if self.scratch:
            self.scratch.flush()
            self.disk.check()
        with whole_file(path) as file:
            self._write_head(file, facts["program"][0], facts["version"][0])
            self._write_balls(file.create_group("particles/trajectory"))
            self._write_series(file.create_group("observables"))
            if self.frames_wanted:
                self._write_poses(file)
            if self.log_wanted:
                self.scratch.copy("impacts", file)
            self._write_deck(file.create_group("deck"))
            self._write_run(file.create_group("run"), facts, status, float(time))
            self._write_statistics(file.create_group("statistics"), float(time))
            if status != "running" and not (self.deck.bodies or self.deck.named("motion")):
                vtkhdf.write(file, self.deck)

    @staticmethod
    def _write_head(file, program, version):
        file.create_group("h5md").attrs.create("version", np.array([1, 1], "<i4"))
        for name, attributes in (
            ("author", {"name": "millsim"}),
            ("creator", {"name": program, "version": version}),
            ("modules/units", {"version": np.array([1, 0], "<i4"), "system": "SI"}),
        ):
            group = file.create_group(f"h5md/{name}")
            for key, value in attributes.items():
                put_attribute(group, key, value)

    def _write_balls(self, group):
        box = group.create_group("box")
        put_attribute(box, "dimension", np.int32(3))
        put_attribute(box, "boundary", ["none"] * 3)
        n = len(self.mass)
        text = "number of the ball: its line in the start file, from 0"
        put(group, "id", np.arange(n), "1", text, "<i4")
        text = "kind of the ball: index into the attribute names"
        put(group, "species", self.species, "1", text, "<i4", names=self.names)
        put(group, "mass", self.mass, "kg", "mass of the ball")
        put(group, "diameter", self.diameter, "m", "diameter of the ball")
        if self.frames_wanted:  # at once, so that step and time stay linked
            self.scratch.copy("trajectory", group, "_")
            for name in STATES:
                group.move(f"_/{name}", name)
            del group["_"]

    def _write_series(self, group):
        rows = len(self.times)
        first = group.create_group("kinetic_energy")
        put_column(first, "step", np.arange(rows), "<i8", "1", "number of the row")
        put_column(first, "time", self.times, "<f8", "s", "simulated time")

        def element(name, values, dtype, unit, text, **attributes):
            member = group.require_group(name)
            if member != first:
                member["step"], member["time"] = first["step"], first["time"]
            put_column(member, "value", values, dtype, unit, text, **attributes)

        for name, label in self.labels.items():
            values = self.series[name]
            told = name not in OPTIONAL and not name.startswith("motion_work/")
            if told or not np.isnan(values).all():
                element(name, values, "<f8", *label)
        counts = np.array(self.counts, np.uint64).reshape(rows, *self.total.shape)
        fast = (
            "impacts of this kind with a normal speed at or above each of `thresholds` (m s-1), cumulative from t = 0"
        )
        for k, kind in enumerate(self.kinds):
            text = "impacts of this kind, cumulative from t = 0"
            element(f"collisions/{kind}", counts[:, k, 0], "<u8", "1", text)
            name, limits = f"fast_collisions/{kind}", np.array(THRESHOLDS)
            element(name, counts[:, k, 1:], "<u8", "1", fast, thresholds=limits)

    def _write_deck(self, group):
        for section, key, value, meaning in self.entries:
            put(group.require_group(section.replace("/", "_")), key, value, "", meaning)
        text = "the deck as run, with all defaults; itself a deck"
        put(group, "text", self.deck.text, "", text)

    def _write_run(self, group, facts, status, time):
        for name, (value, unit, text) in facts.items():
            kind = None
            if isinstance(value, (int, np.integer)):
                kind = "<u8" if value >= 0 else "<i8"
            put(group, name, value, unit, text, kind)
        text = "complete, stopped (by a signal), failed, or running (if it is not, it was killed)"
        put(group, "status", status, "", text)
        put(group, "time", time, "s", "simulated time reached")
        put(group, "hdf5", h5py.version.hdf5_version, "", "version of the HDF5 library")
        for kind, count in zip(self.kinds, self.total[:, 0]):
            text = "impacts of this kind, from t = 0"
            put(group, f"events/collisions/{kind}", count, "1", text, "<u8")

    def _write_statistics(self, group, time):
        duration = max(0.0, min(time, self.end) - self.begin)
        text = "length of the window that the statistics cover: from run.sample_from to the end"
        put(group, "duration", duration, "s", text)
        times = np.array(self.times)
        series = {name: np.array(values) for name, values in self.series.items()}
        impulse = self._impulse(times, series)

        def mean(sums, of_nothing):
            """Mean rate of a cumulative series over the window, as far as there are rows."""
            if not duration > 0:
                return of_nothing
            reach = min(time, self.end, times[-1] if len(times) else -math.inf)
            if not reach > self.begin:
                return math.nan
            return float(np.diff(np.interp([self.begin, reach], times, sums))[0]) / (reach - self.begin)

        power = [mean(series[f"dissipation/{kind}"], 0.0) for kind in self.kinds]
        edges = sheet.put_speeds(
            group.create_group("impacts"), self.speeds["impacts"], duration, power, None, self.kinds
        )
        sheet.put_speeds(group.create_group("strikes"), self.speeds["strikes"], duration, None, edges, self.kinds)
        sheet.put_floor_share(group.create_group("floor_share"), self.kinds)
        sheet.put_maps(group.create_group("maps"), self.maps)
        blocks = Blocks(self.rotor_speed, self.begin, self.end)
        blocks.close(*(sums[times <= time] for sums in (times, series["rotor_work"], impulse)))
        rotor = mean(series["rotor_work"], math.nan), mean(impulse, math.nan)
        sheet.put_rotor(group.create_group("rotor"), blocks, *rotor)
        sheet.put_precision(group.create_group("precision"), blocks, *rotor)
        if self._tells_motions():
            self._write_drive(group, mean, times[times <= time], series)

    @staticmethod
    def _impulse(times, series):
        """Cumulative angular impulse of the rotor at the rows [N m s], from its mean torques between them."""
        if not len(times):
            return np.empty(0)
        steps = series["rotor_torque"][1:] * np.diff(times)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def close(self):
        """Lets go of what waits on the disk; Results is of no use afterwards."""
        if self.scratch is not None:
            with contextlib.suppress(Exception):
                self.scratch.close()
            self.disk.close()
